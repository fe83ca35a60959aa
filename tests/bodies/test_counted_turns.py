"""Hinges whose limits are turns apart: turns are counted, and nothing else changes."""

import math

import numpy as np
import pytest

from polycorner import certify, minimise, simulate, stratum_at
from polycorner.bodies import (
    Arrangement,
    Gear,
    Hinge,
    Mass,
    Slider,
    Spring,
    capsule,
    disc,
    mass_of,
)

BAR, ROD = capsule([-1, 0], [1, 0], 0.1), capsule([-1, 0, 0], [1, 0, 0], 0.1)
THREE = 3 * math.tau


def wheel(d, **more):
    """A bar that turns about its middle; in space about a slanted axis."""
    if d == 2:
        return Arrangement({"A": BAR}, joints={"hub": Hinge("world", "A", **more)})
    return Arrangement({"A": ROD}, joints={"hub": Hinge("world", "A", axis=[0, 1, 1], **more)})


@pytest.mark.parametrize("d", [2, 3])
def test_a_wheel_turns_three_times_and_bounces_off_its_stop(d):
    a = wheel(d, limits=(-1.0, THREE))
    assert a.polyhedron.names == ("hub.min", "hub.max")
    assert "hub.turns" in a.polyhedron.equation_names
    e, rate, start = 0.6, 20.0, 0.3
    q = a.point(joints={"hub": start})
    system = a.system(restitution={"hub": e})
    v = a.velocity(q, joints={"hub": rate})
    kinetic, _ = system.energies(system.state(q, v))
    if d == 2:
        assert kinetic == pytest.approx(mass_of(BAR).inertia * rate**2 / 2)
    path = simulate(system, system.state(q, v), 1.5, 1e-3, every=1)
    hit = (THREE - start) / rate
    angle = a.joint_values(path.q[:, 0])["hub"]
    exact = np.where(
        path.times < hit, start + rate * path.times, THREE - e * rate * (path.times - hit)
    )
    # In the step of the impact the two straight lines meet elsewhere than at its ends.
    assert angle == pytest.approx(exact, abs=2e-3 if d == 3 else 1e-6)
    (bounce,) = [event for event in path.events if event.contact == "hub.max"]
    assert bounce.time == pytest.approx(hit, abs=1e-3 if d == 3 else 1e-8)
    assert path.kinetic[-1] == pytest.approx(e**2 * path.kinetic[0], rel=1e-4)


def test_a_counted_pendulum_swings_as_one_that_is_not():
    masses = {"A": Mass(2.0, [0.4, 0], 0.3)}
    found = []
    for limits in (None, (-THREE, THREE)):
        a = wheel(2, limits=limits)
        system = a.system(gravity=[0, -9.81], masses=masses)
        q = a.point(joints={"hub": 0.4})
        path = simulate(system, system.state(q), 1.5, 1e-3)
        found.append(path.q[:, 0, :3])
    np.testing.assert_allclose(*found, atol=1e-7)


def test_a_screw_of_three_turns_goes_as_far_as_its_lead():
    """A nut on a screw goes ``lead`` with each turn, by a gear, up to where three turns end."""
    lead = 0.25
    joints = {
        "turn": Hinge("world", "screw", limits=(0.0, THREE)),
        "way": Slider("world", "nut", axis=[1, 0], at=[0, 3]),
        "thread": Gear("turn", "way", lead / math.tau),
    }
    a = Arrangement({"screw": BAR, "nut": disc(0.2)}, joints=joints)
    q = a.point(joints={"turn": 1.0})
    best = minimise(a.polyhedron, -a.joint_function("way"), q)
    assert best.active == ("turn.max",)
    values = a.joint_values(best.point)
    assert values["turn"] == pytest.approx(THREE)
    assert values["way"] == pytest.approx(3 * lead)
    assert stratum_at(a.polyhedron, best.point).dimension == 0
    held = a.system(drives={"spring": Spring("turn", stiffness=2.0, length=4 * math.pi)})
    rest = minimise(a.polyhedron, held.potential, q)
    assert a.joint_values(rest.point)["turn"] == pytest.approx(4 * math.pi)  # two turns
    assert certify(a.polyhedron, held.potential, rest.point).verdict.name == "STRICT_MINIMUM"


def test_turns_are_told_apart_by_a_point():
    a = wheel(2, limits=(-THREE, math.inf))
    once, twice = (a.point(joints={"hub": 0.5 + k * math.tau}) for k in (1, 2))
    assert a.joint_values(once)["hub"] == pytest.approx(0.5 + math.tau)
    assert a.joint_values(twice)["hub"] == pytest.approx(0.5 + 2 * math.tau)
    assert not a.polyhedron.contains(a.point(joints={"hub": -THREE - 0.1}), tolerance=1e-9)
    one, two = (a.placed(q)["A"].parts[""].points for q in (once, twice))
    np.testing.assert_allclose(one, two, atol=1e-12)
