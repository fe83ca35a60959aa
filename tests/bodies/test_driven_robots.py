"""Joints of robots that move as prescribed: what they push, and the forces that they take."""

import math
from pathlib import Path

import numpy as np
import pytest
import sympy

from polycorner import simulate
from polycorner.bodies import HalfSpace, Mass, Robot, RobotJoint, RobotLink, capsule, polytope
from polycorner.files import read_urdf
from polycorner.motion import time_symbol

NOW = time_symbol()
ARM = Path(__file__).parents[2] / "examples/data/arm.urdf"
CUBE = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.2)])


def rod(kind="continuous"):
    """Return a rod that hangs from its end, 1 m long, of 2 kg, as thin as its inertia says."""
    link = RobotLink(capsule([0, 0, 0], [0, 0, -1], 0.05), Mass(2.0, [0, 0, -0.5], np.eye(3) / 6))
    joint = RobotJoint("base", "rod", kind, axis=[0, 1, 0], effort=1.0)
    links = {"base": RobotLink(), "rod": link}
    return Robot(links, {"pivot": joint}, walls={"far": HalfSpace([0, 0, 1], [0, 0, -9])})


def test_an_arm_pushes_a_box_as_far_as_its_tip_goes():
    """The shoulder turns by 0.4 rad with the elbow straight, from a start with the tip at the box.

    The tip, 0.7 m from the shoulder, is a ball without friction on an upright face, so that the box
    bears on the floor with its weight alone and does not leave the tip while that brakes less than
    friction does.
    """
    pytest.importorskip("yourdfpy")
    mu, mass, g, reach = 0.3, 3.0, 9.81, 0.7
    begin, end = 1.4, 1.0
    swing = (begin + end) / 2 - (end - begin) / 2 * sympy.cos(sympy.pi * NOW)
    floor = {"floor": HalfSpace([0, 0, 1], [0, 0, -0.75])}
    robot = read_urdf(ARM).among(walls=floor, bodies={"box": polytope(CUBE)})
    system = robot.system(
        gravity=[0, 0, -g],
        masses={"box": mass},
        friction={"floor": mu},
        motions={"shoulder": swing, "elbow": 0},
    )
    first = reach * math.cos(begin) + 0.03 + 0.1
    q = robot.point({"shoulder": begin, "box": [first, 0, -0.75]})
    path = simulate(system, system.state(q), 1.0, 2e-3)
    way = reach * (math.cos(end) - math.cos(begin))
    names = robot.manifold.names
    moved = path.q[-1, 0] - q
    assert moved[names.index("xbox")] == pytest.approx(way, abs=1e-6)
    assert np.abs(moved[2 + 1 :]).max() < 1e-6
    assert moved[:2].tolist() == pytest.approx([end - begin, 0], abs=1e-5)
    loss = mu * mass * g * way
    assert path.dissipated["sliding"][-1] == pytest.approx(loss, rel=1e-4)
    # The links, of 1.5 and 1 kg with centres at 0.2 and 0.55 m, were lifted; damping is 0.5.
    lift = g * (1.5 * 0.2 + 1.0 * 0.55) * (math.sin(begin) - math.sin(end))
    damped = 0.5 * (math.pi * (end - begin) / 2) ** 2 / 2
    assert path.work["drive"][-1] == pytest.approx(loss + lift + damped, rel=1e-4)


@pytest.mark.parametrize("kind", ["continuous", "revolute"])
def test_a_rod_is_turned_by_the_torque_of_euler(kind):
    """About the pivot the inertia is ``1/6 + 2/4``; the effort of the joint is no limit."""
    robot = rod(kind)
    angle = 7 * NOW**2
    system = robot.system(gravity=[0, 0, -9.81], motions={"pivot": angle})
    path = simulate(system, system.state([0.0]), 1.5, 1e-3)
    assert math.remainder(path.q[-1, 0, 0] - 7 * 1.5**2, math.tau) == pytest.approx(0, abs=1e-4)
    (torque,) = [force for _, name, force in path.touching[-1] if name == "pivot"]
    middle = float(angle.subs(NOW, 1.5 - 0.5e-3))
    expected = (1 / 6 + 2 / 4) * 14 + 2 * 9.81 * 0.5 * math.sin(middle)
    assert torque == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("motions", "words"),
    [
        ({"pivo": 0}, "motions: expected names among pivot; got pivo "),
        ({"pivot": sympy.Symbol("x")}, r"motions\['pivot'\]: expected a formula in the time"),
        ({"pivot": "x"}, r"motions\['pivot'\]: expected"),
        ({"pivot": math.nan}, r"motions\['pivot'\]: expected"),
        ([0.0], "motions: expected a mapping"),
    ],
)
def test_motions_that_are_none_are_refused(motions, words):
    with pytest.raises((TypeError, ValueError), match=words):
        rod().system(motions=motions)


def test_a_state_off_its_motion_is_refused():
    system = rod().system(motions={"pivot": 0.5 + NOW})
    with pytest.raises(ValueError, match="pivot"):
        system.state([0.0], [1.0])
    with pytest.raises(ValueError, match="pivot"):
        system.state([0.5])
    assert system.state([0.5], [1.0]).v.tolist() == [1.0]
