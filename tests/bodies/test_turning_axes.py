"""Motion in axes that turn, against motion in axes at rest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, capsule, compound, polygon, sphere
from polycorner.motion import time_symbol

FAR = {"floor": HalfSpace([0, 0, 1], [0, 0, -100])}
OMEGA, PULL = np.array([0.3, -0.5, 0.9]), np.array([0.0, 1.0, -3.0])
SPEED, SPIN = np.array([0.3, -0.2, 0.8]), np.array([0.7, 0.2, -1.1])
SCREW = compound({"1": sphere(0.5, at=[0, 0, -1]), "2": sphere(0.3, at=[0, 0.4, 1])})


def test_a_body_moves_as_seen_from_axes_that_turn():
    """Place and orientation after a second; its centre of mass is off its origin."""
    a = Arrangement({"A": SCREW}, FAR, orientations="all")
    q = a.point({"A": ([1.0, 2.0, 0.5], Rotation.from_rotvec([0.2, 0.5, -0.3]))})
    rest, turning = (b.system(gravity=PULL) for b in (a, replace(a, turning=OMEGA)))
    own = SPEED - np.cross(OMEGA, q[:3]), SPIN - OMEGA
    starts = {
        rest: rest.state(q, a.velocity(q, {"A": (SPEED, SPIN)})),
        turning: turning.state(q, a.velocity(q, {"A": own})),
    }
    turn, errors = Rotation.from_rotvec(OMEGA), []
    for dt in (2e-3, 1e-3):
        still, turned = (np.array(simulate(s, starts[s], 1.0, dt).q[-1, 0]) for s in starts)
        seen = (turn * Rotation.from_quat(turned[3:], scalar_first=True)).as_matrix()
        known = Rotation.from_quat(still[3:], scalar_first=True).as_matrix()
        apart = np.abs(turn.apply(turned[:3]) - still[:3]).max()
        errors.append(max(apart, np.abs(seen - known).max()))
    assert errors[1] < 2e-6
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.1)  # methods of second order


def test_a_direction_turns_as_seen_from_axes_that_turn():
    """A smooth rod, known by the direction of its axis; and a body in the plane."""
    rod = Arrangement({"A": capsule([0, 0, -1], [0, 0, 1], 0.2)}, FAR)
    q = rod.point({"A": ([1.0, 0.0, 0.0], Rotation.from_rotvec([0.4, 0.3, 0.0]))})
    ends = []
    for omega in (np.zeros(3), OMEGA):
        system = replace(rod, turning=omega).system()
        motion = SPEED - np.cross(omega, q[:3]), SPIN - omega
        end = simulate(system, system.state(q, rod.velocity(q, {"A": motion})), 1.0, 5e-4).q[-1, 0]
        turn = Rotation.from_rotvec(omega)
        ends.append([*turn.apply(np.array(end[:3])), *turn.apply(np.array(end[3:]))])
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)


def test_a_body_in_the_plane_turns_against_its_axes():
    a = Arrangement(
        {"A": polygon([[0, 0], [2, 0], [0, 1]])}, {"floor": HalfSpace([0, 1], [0, -100])}
    )
    q = a.point({"A": ([1.0, 2.0], 0.3)})
    ends = []
    for omega in (0.0, -0.8):
        system = replace(a, turning=omega).system(gravity=[0.5, -2.0])
        motion = np.array([0.3, 0.4]) - omega * np.array([-2.0, 1.0]), 1.5 - omega
        x, y, theta = simulate(system, system.state(q, a.velocity(q, {"A": motion})), 1.0, 5e-4).q[
            -1, 0
        ]
        turn = np.array([[np.cos(omega), -np.sin(omega)], [np.sin(omega), np.cos(omega)]])
        ends.append([*turn @ [x, y], theta + omega])
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)


def test_energy_in_the_axes_is_conserved():
    """Coriolis forces do no work, the centrifugal one has a potential; weight along the axis."""
    a = Arrangement({"A": SCREW}, FAR, orientations="all", turning=OMEGA)
    system = a.system(gravity=-2 * OMEGA)
    q = a.point({"A": ([1.0, 2.0, 0.5], Rotation.from_rotvec([0.2, 0.5, -0.3]))})
    path = simulate(system, system.state(q, a.velocity(q, {"A": (SPEED, SPIN)})), 1.0, 1e-3)
    assert np.ptp(path.kinetic) > 1.0
    assert np.ptp(path.kinetic + path.potential) < 1e-5 * np.ptp(path.kinetic)


def test_shaken_weight_keeps_its_directions():
    """A force along x of the axes at rest gives the same motion in both axes."""
    import sympy

    a, now = Arrangement({"A": sphere(0.5)}, FAR), time_symbol()
    pull, ends = [sympy.sin(3 * now), 0, -now], []
    for omega in (np.zeros(3), OMEGA):
        system = replace(a, turning=omega).system(gravity=pull)
        start = system.state([1.0, 2.0, 0.5], SPEED - np.cross(omega, [1.0, 2.0, 0.5]))
        end = np.array(simulate(system, start, 1.0, 5e-4).q[-1, 0])
        ends.append(Rotation.from_rotvec(omega).apply(end))
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)


@pytest.mark.parametrize("wrong", [1.0, [1.0, 2.0], [0.0, 0.0, np.inf], "fast"])
def test_angular_velocities_are_checked(wrong):
    with pytest.raises((TypeError, ValueError), match="turning: expected 3 finite numbers, or 0"):
        Arrangement({"A": sphere(0.5)}, FAR, turning=wrong)
