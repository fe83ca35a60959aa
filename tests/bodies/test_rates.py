"""Largest rates of joints, and other limits on velocities of arrangements and robots."""

import numpy as np
import pytest
import sympy

from polycorner import simulate
from polycorner.bodies import Arrangement, Hinge, Motor, capsule
from polycorner.motion import EventKind

LINK = capsule([0, 0], [1, 0], 0.05)


def pendulum():
    return Arrangement({"link": LINK}, joints={"shoulder": Hinge("world", "link")})


def test_a_joint_turns_no_faster_than_its_rate():
    """A motor turns a link: freely up to the rate, and then at it, whatever the torque."""
    a = pendulum()
    system = a.system(drives={"motor": Motor("shoulder", 2.0)}, rates={"shoulder": 0.5})
    path = simulate(system, system.state(a.point(joints={"shoulder": 0.0})), 4.0, 5e-3, every=1)
    angles = np.unwrap(a.joint_values(path.q[:, 0])["shoulder"])
    rates = np.diff(angles) / 5e-3
    assert rates.max() <= 0.5 * (1 + 1e-5)  # of chords, to second order
    assert rates[-1] == pytest.approx(0.5, rel=1e-5)
    assert [(e.kind, e.contact) for e in path.events] == [(EventKind.ACTED, "shoulder.rate")]
    assert path.audit < 1e-9


def test_limits_are_formulas_of_rates():
    """A ratchet in the joint: the pendulum cannot swing back."""
    a = pendulum()
    system = a.system(gravity=[0, -10], limits={"ratchet": a.joint_rate("shoulder")})
    path = simulate(system, system.state(a.point(joints={"shoulder": 0.3})), 1.0, 1e-2)
    assert path.q[-1].tolist() == path.q[0].tolist()
    turned = system.state(a.point(joints={"shoulder": -3.0}))
    angles = a.joint_values(simulate(system, turned, 3.0, 1e-2, every=1).q[:, 0])["shoulder"]
    assert (np.diff(angles) > -1e-12).all()
    assert angles[-1] == pytest.approx(-np.pi + 3.0, abs=0.02)  # as high as it began


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"rates": {"knee": 1.0}}, "rates: expected"),
        ({"rates": {"shoulder": -1.0}}, "rates: expected"),
        ({"limits": {"a": sympy.Symbol("z")}}, "limits: expected a formula in"),
        ({"count": {"link": 2}, "rates": {"shoulder": 1.0}}, "none where count has names"),
    ],
)
def test_what_are_no_rates_is_refused(arguments, told):
    with pytest.raises(ValueError, match=told):
        pendulum().system(**arguments)
