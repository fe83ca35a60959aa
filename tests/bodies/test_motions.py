"""Where bodies are in a motion, and where they touch, against placements and distances."""

import math

import numpy as np
import pytest
from arrangements import anywhere
from hulls import distance
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    box,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    sphere,
)
from polycorner.bodies.motions import nearest_points, poses_of

SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.2)
CUBE = polytope([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 0.1)
DUMBBELL = compound({"1": sphere(0.5, [-1, 0, 0]), "rod": capsule([-1, 0, 0], [1, 0, 0], 0.2)})
MIXED = [
    ([disc(0.5), SQUARE, capsule([-1, 0.5], [1, 0], 0.3)], [[-9, -9], [9, 9]]),
    ([sphere(0.5), CUBE, DUMBBELL, capsule([-1, 0, 0], [1, 0, 0], 0.3)], [[-9] * 3, [9] * 3]),
]


@pytest.mark.parametrize("orientations", ["needed", "all", "none"])
@pytest.mark.parametrize(("bodies", "corners"), MIXED)
def test_bodies_are_where_the_arrangement_places_them(bodies, corners, orientations):
    a = Arrangement(bodies, box(*corners), orientations=orientations)
    rng = np.random.default_rng(3)
    points = np.array([anywhere(a, rng) for _ in range(4)])
    poses = poses_of(a, points)
    for k, q in enumerate(points):
        for name, body in a.placed(q).items():
            for part, shape in body.parts.items():
                found = poses.placed(k)[name].parts[part]
                np.testing.assert_allclose(found.points, shape.points, atol=1e-12)


def test_an_axis_may_point_the_other_way():
    a = Arrangement([capsule([-1, 0, 0], [1, 0, 0], 0.3), sphere(1)])
    for u in ([1, 0, 0], [-1, 0, 0], [0, 1, 0]):
        ends = poses_of(a, [0, 0, 0, *u, 3, 0, 0]).placed(0)["1"].parts[""].points
        np.testing.assert_allclose(ends[0] - ends[1], 2 * np.array(u), atol=1e-12)


def test_between_two_instants_bodies_move_and_turn_evenly():
    a = Arrangement({"A": SQUARE, "B": disc(1.0)})
    poses = poses_of(a, [[0, 0, 0.0, 5, 5], [2, 4, 0.6, 5, 5]]).between([0.0, 0.5, 1.0])
    np.testing.assert_allclose(poses.origins[1, 0], [1, 2])
    angles = [math.atan2(m[1, 0], m[0, 0]) for m in poses.matrices[:, 0]]
    np.testing.assert_allclose(angles, [0, 0.3, 0.6])


def test_a_turn_past_a_half_goes_the_short_way():
    a = Arrangement({"A": CUBE, "B": sphere(1.0)}, orientations="all")
    turns = [Rotation.from_rotvec([0, 0, t]) for t in (3.0, 3.4)]
    points = [a.point({"A": ([0, 0, 0], t), "B": ([5, 5, 5], turns[0])}) for t in turns]
    points[1][3:7] *= -1
    middle = poses_of(a, points).between([0.5]).matrices[0, 0]
    np.testing.assert_allclose(middle, Rotation.from_rotvec([0, 0, 3.2]).as_matrix(), atol=1e-12)


def test_several_bodies_of_one_kind_have_numbers():
    a = Arrangement({"A": disc(0.5)}, box([0, 0], [9, 9]))
    system = a.system(count=2, gravity=[0, -10])
    path = simulate(system, system.state([[1, 1], [3, 2]]), 0.1, 0.01)
    poses = poses_of(a, path)
    assert poses.names == ["A 1", "A 2"]
    np.testing.assert_array_equal(poses.origins, path.q)
    assert list(poses.placed(-1)) == ["A 1", "A 2"]


def test_who_has_left_is_not_placed():
    a = Arrangement({"A": disc(0.5)}, {"floor": HalfSpace([0, 1], [0, 0])})
    system = a.system(count=2, exits={"xA": 2.0})
    start = system.state([[0, 1], [0, 4]], [[0, 0], [4, 0]])
    poses = poses_of(a, simulate(system, start, 1.0, 0.01))
    assert list(poses.placed(0)) == ["A 1", "A 2"]
    assert list(poses.placed(len(poses) - 1)) == ["A 1"]


def test_in_a_periodic_box_bodies_are_in_the_box():
    a = Arrangement([disc(0.1), disc(0.1)], period=[1, None])
    poses = poses_of(a, [[2.3, 5.0, -0.4, 0.0]])
    np.testing.assert_allclose(poses.boxed[0], [[0.3, 5.0], [0.6, 0.0]])


def test_a_motion_of_another_arrangement_is_refused():
    a, b = (Arrangement({name: disc(1)}, box([-5, -5], [5, 5])) for name in "AB")
    system = a.system()
    path = simulate(system, system.state([0, 0]), 0.1, 0.05)
    with pytest.raises(ValueError, match="motion: expected one of the coordinates xB, yB; got 'xA"):
        poses_of(b, path)
    with pytest.raises(ValueError, match=r"motion: expected shape \(T, 2\), or \(T, n, k\)"):
        poses_of(a, np.zeros((2, 3, 4)))


# ---------------------------------------------------------------------------------------- contacts


def from_body(point, body):
    """The distance of a point from the surface of a body, negative inside a rounded rim."""
    return min(distance(point[None], part.points) - part.radius for part in body.parts.values())


def around(bodies, **given):
    """An arrangement, a random point of it, and its gaps by name."""
    a = Arrangement(bodies, **given)
    q = anywhere(a, np.random.default_rng(5), reach=4)
    functions = a.polyhedron.functions
    return a, q, {f.name: float(f.value(q)) for f in functions}


@pytest.mark.parametrize(("bodies", "corners"), MIXED)
def test_marks_are_midway_between_what_a_gap_is_the_distance_of(bodies, corners):
    a, q, gaps = around({f"B{k}": body for k, body in enumerate(bodies)}, walls=box(*corners))
    names = [name for name in gaps if ">" not in name and "<" not in name]
    poses = poses_of(a, q).touched((tuple(((0,), name, 1.0) for name in names),))
    placed, marks = a.placed(q), dict(poses.named_marks(0))
    assert marks.keys() == set(names)
    checked = 0
    for name, point in marks.items():
        one, other = name.split("-")
        whole = [placed[side] for side in (one, other) if side in placed]
        if other in a.walls:
            wall = a.walls[other]
            away = float((point - wall.point) @ wall.normal)
            assert away == pytest.approx(gaps[name] / 2)
        elif len(whole) == 2 and all(len(body.parts) == 1 for body in whole):
            # Two whole bodies: the mark is as far from both.
            for body in whole:
                assert from_body(point, body) == pytest.approx(gaps[name] / 2, abs=1e-6)
                checked += 1
    assert checked or len(whole) < 2


def test_a_mark_on_a_round_wall_is_on_the_way_outwards():
    waves = {"drum": Cylinder(5.0, point=[1.0, 2.0], waves={3: (0.2, 0.4)})}
    a = Arrangement({"A": disc(0.5)}, waves)
    way = np.array([math.cos(0.7), math.sin(0.7)])
    edge = 5.0 + 0.2 * math.cos(3 * 0.7 + 0.4)
    poses = poses_of(a, [1, 2] + (edge - 0.5) * way).touched(((((0,), "A-drum", 1.0),),))
    np.testing.assert_allclose(poses.marks(0), [[1, 2] + edge * way])


def test_a_contact_across_the_side_of_a_box_is_beside_the_first():
    a = Arrangement({"A": disc(0.2)}, period=[1, 4])
    poses = poses_of(a, [[[0.1, 1.0], [0.7, 1.0]]]).touched(((((0, 1), "A1-A2", 1.0),),))
    np.testing.assert_allclose(poses.marks(0), [[-0.1, 1.0]])


def test_equations_and_unknown_names_have_no_marks():
    a = Arrangement({"A": disc(0.2), "B": disc(0.2)})
    poses = poses_of(a, [0, 0, 1, 0]).touched((tuple(((0,), n, 1.0) for n in ("hinge", "A-X")),))
    assert poses.marks(0).shape == (0, 2)


@pytest.mark.parametrize("d", [2, 3])
def test_nearest_points_are_as_far_apart_as_the_hulls(d):
    rng = np.random.default_rng(d)
    for sizes in [(1, 2), (2, 2), (1, 4), (4, 4), (2, 6)]:
        one, two = (rng.normal(shift, 1, (k, d)) for shift, k in zip((0, 4), sizes, strict=True))
        p, q = nearest_points(one, two)
        assert np.linalg.norm(q - p) == pytest.approx(distance(one, two), abs=1e-6)
