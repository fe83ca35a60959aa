"""Joints and springs through the sides of a periodic box, as without one."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Ball,
    Damper,
    Hinge,
    Prescribed,
    Slider,
    Spring,
    capsule,
    disc,
    mass_of,
    sphere,
)
from polycorner.motion import Solver, time_symbol

G, L = 9.81, 8.0
BAR = capsule([-1, 0], [1, 0], 0.1)
TIGHT = Solver(tolerance=1e-10)
PINS = {
    "nail": Hinge("world", "A", at=[0.5, 3], on=[-1, 0]),
    "elbow": Hinge("A", "B", at=[1, 0], on=[-1, 0], limits=(-1.2, 2.5)),
}


def double(**more):
    return Arrangement({"A": BAR, "B": BAR}, joints=PINS, **more)


@pytest.mark.parametrize("shifts", [(0, 0), (1, 0), (0, -2), (3, 4)])
def test_a_double_pendulum_swings_in_a_box_as_without_one(shifts):
    """Wherever in the boxes its bars are, and whichever side they hang through."""
    free, boxed = double(), double(period=[L, None])
    laws = {
        "gravity": [0, -G],
        "drives": {"brake": Damper("elbow", damping=0.1), "cord": Spring("A", "B", stiffness=2.0)},
    }
    q = free.point(joints={"nail": -2.0, "elbow": 1.0})
    moved = q + L * np.array([shifts[0], 0, 0, shifts[1], 0, 0])
    assert boxed.polyhedron.equation_values(moved) == pytest.approx(np.zeros(4), abs=1e-9)
    np.testing.assert_allclose(
        boxed.polyhedron.equation_values(moved + 0.1), free.polyhedron.equation_values(q + 0.1)
    )
    paths = []
    for a, start in ((free, q), (boxed, moved)):
        system = a.system(**laws)
        paths.append(simulate(system, system.state(start), 0.6, 1e-3, solver=TIGHT))
    np.testing.assert_allclose(paths[1].q - moved, paths[0].q - q, atol=1e-7)
    np.testing.assert_allclose(paths[1].potential, paths[0].potential, atol=1e-6)
    if shifts == (3, 4):
        kinds = boxed.system(**laws, count={"A": 1, "B": 1})
        start = kinds.state({"A": [moved[:3]], "B": [moved[3:]]})
        tied = simulate(kinds, start, 0.6, 1e-3, solver=TIGHT)
        np.testing.assert_allclose(tied.q, paths[1].q[:, 0], atol=1e-6)


def test_a_ring_of_bars_goes_round_the_box():
    """It is straight, as long as the box, and swings between two nails as a chain of four does."""
    a = Arrangement({"link": BAR}, period=[L, None], orientations="all")
    joints = {f"pin{k}": Hinge(f"link {k}", f"link {k % 4 + 1}", at=[1, 0], on=[-1, 0]) for k in
              range(1, 5)}  # fmt: skip
    system = a.system(count=4, joints=joints, gravity=[0, -G])
    q = np.array([[1 + 2 * k + L * (k - 2), 0.0, 0.0] for k in range(4)])
    v = np.zeros((4, 3))
    v[:, 0] = 2.0
    path = simulate(system, system.state(q, v), 1.0, 1e-3, solver=TIGHT)
    # Nothing holds it: it falls as a whole, and goes round the box.
    exact = np.stack([2 * path.times, -G * path.times**2 / 2, 0 * path.times], axis=-1)
    np.testing.assert_allclose(path.q - q, np.broadcast_to(exact[:, None], path.q.shape), atol=1e-8)
    with pytest.raises(ValueError, match=r"q: expected equation 'pin3.x'"):
        system.state(q + np.outer([0, 0, 0, 1], [0.1, 0, 0]))


def test_a_spring_pulls_through_the_side():
    """Two discs oscillate about the distance at which it is relaxed, along the shorter way."""
    k, length = 3.0, 1.5
    a = Arrangement({"D": disc(0.5)}, period=[L, L])
    system = a.system(count=2, drives={"s": Spring("D 1", "D 2", stiffness=k, length=length)})
    path = simulate(system, system.state([[0.4, 1.0], [L - 1.4, 1.0]]), 2.0, 1e-3)
    omega = math.sqrt(2 * k / mass_of(disc(0.5)).mass)
    stretch = (1.8 - length) * np.cos(omega * path.times)
    np.testing.assert_allclose(path.q[:, 0, 0] - path.q[:, 1, 0] + L, length + stretch, atol=1e-5)


def test_a_ball_joint_and_a_prescribed_slider_in_space():
    """A bob hangs from a bead that is driven along the box, through its side."""
    speed = 3.0
    a = Arrangement(
        {"bead": sphere(0.2), "bob": capsule([0, 0, 0], [0, 0, -1], 0.1)},
        joints={
            "way": Slider("world", "bead", axis=[1, 0, 0]),
            "hook": Ball("bead", "bob"),
        },
        period=[4.0, None, None],
        orientations="all",
    )
    drive = {"drive": Prescribed("xbead", 1.5 + speed * time_symbol())}
    system = a.system(gravity=[0, 0, -G], drives=drive)
    turn = Rotation.identity()
    q = a.point({"bead": ([1.5, 0, 0], turn), "bob": ([1.5 - 4.0, 0, 0], turn)})
    v = a.velocity(q, {"bead": [speed, 0, 0], "bob": [speed, 0, 0]})
    path = simulate(system, system.state(q, v), 1.0, 1e-3)
    names = a.manifold.names
    for body in ("bead", "bob"):
        x = path.q[:, 0, names.index(f"x{body}")]
        np.testing.assert_allclose(x - x[0], speed * path.times, atol=1e-7)
    assert {e.kind.name for e in path.events} <= {"REST"}


def test_boxes_have_to_be_wide_enough_for_one_image():
    with pytest.raises(ValueError, match=r"period: expected lengths of at least .* joined"):
        double(period=[4.0, None])


def test_motions_of_the_whole_box_keep_joints():
    a = Arrangement({"A": BAR, "B": BAR}, joints={"elbow": PINS["elbow"]}, period=[L, L])
    assert a.symmetry.fields == [
        {n: int(n[0] == way) for n in a.manifold.names} for way in ("x", "y")
    ]
    q = a.point({"A": ([7.5, 1.0], 0.3)}, joints={"elbow": 0.5})
    for shift in np.random.default_rng(0).uniform(-20, 20, (3, 2)):
        moved = q + np.tile([*shift, 0], 2)
        assert a.polyhedron.equation_values(moved) == pytest.approx(np.zeros(2), abs=1e-9)
    assert not double(period=[L, L]).symmetry.fields
