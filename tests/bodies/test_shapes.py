"""Bodies and arrangements: what they are made of, and arguments that are refused."""

import math
import pickle
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

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

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
CUBE = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
STAR = [[math.cos(a), math.sin(a)] for a in 2 * math.tau / 5 * np.arange(5)]
TWO = [disc(1), disc(1)]


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_polygons_go_round_counterclockwise(seed, backwards):
    points = np.random.default_rng(seed).standard_normal((9, 2))
    points = points[ConvexHull(points).vertices]
    (part,) = polygon(points[::-1] if backwards else points).parts.values()
    x, y = part.points.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0
    heights = part.points @ part.facets.normals.T
    starts = part.points[[face[0] for face in part.facets.faces]]
    assert (heights <= (starts * part.facets.normals).sum(axis=1) + 1e-12).all()


@given(st.integers(0, 2**32 - 1))
def test_polyhedra_have_faces_and_edges_by_euler(seed):
    rng = np.random.default_rng(seed)
    points = np.vstack([rng.standard_normal((6, 3)), CUBE * 3 - 1.5])
    points = points[ConvexHull(points).vertices]
    (part,) = polytope(points).parts.values()
    facets = part.facets
    assert len(points) - len(facets.edges) + len(facets.faces) == 2
    for face, normal in zip(facets.faces, facets.normals, strict=True):
        heights = points @ normal
        assert heights.max() == pytest.approx(heights[face[0]])
        around = points[[*face]]
        turned = np.cross(around[1] - around[0], around[2] - around[1])
        assert turned @ normal > 0
    for i, j, left, right in facets.edges:
        for k, side in ((left, (i, j)), (right, (j, i))):
            face = facets.faces[k]
            assert face[(face.index(side[0]) + 1) % len(face)] == side[1]


def test_a_moved_body_is_turned_first():
    body = capsule([1, 0], [2, 0], 0.5).moved([0, 5], math.pi / 2)
    np.testing.assert_allclose(body.markers, [[0, 6], [0, 7]], atol=1e-12)
    turned = sphere(1, at=[1, 0, 0]).moved(turn=Rotation.from_euler("z", 90, degrees=True))
    np.testing.assert_allclose(turned.markers, [[0, 1, 0]], atol=1e-12)


def test_placements_are_read_back():
    rng = np.random.default_rng(0)
    bodies = {"A": capsule([0, 0, 1], [0, 0, 2], 0.5), "B": polytope(CUBE), "C": sphere(1)}
    a = Arrangement(bodies, unit="mm")
    assert a.manifold.dimension == 5 + 6 + 3
    assert set(a.manifold.units) == {"mm", ""}
    turns = Rotation.random(2, random_state=np.random.RandomState(1))
    places = rng.standard_normal((3, 3))
    q = a.point({"A": (places[0], turns[0]), "B": (places[1], turns[1]), "C": places[2]})
    placed = a.placed(q)
    np.testing.assert_allclose(placed["A"].markers, bodies["A"].moved(places[0], turns[0]).markers)
    np.testing.assert_allclose(placed["B"].markers, bodies["B"].moved(places[1], turns[1]).markers)
    np.testing.assert_allclose(placed["C"].markers, [places[2]])


def test_arrangements_can_be_pickled():
    a = Arrangement({"A": polygon(SQUARE), "B": disc(1)}, box([-5, -5], [5, 5]))
    q = a.point({"A": [0, 0], "B": [3, 3]})
    again = pickle.loads(pickle.dumps(a))
    np.testing.assert_array_equal(again.polyhedron.values(q), a.polyhedron.values(q))
    assert len(pickle.loads(pickle.dumps(a.symmetry)).elements) == 3


@pytest.mark.parametrize(
    ("make", "kind", "said"),
    [
        (lambda: disc(0), ValueError, "radius: expected a number > 0"),
        (lambda: disc(1, at=[1, 2, 3]), ValueError, "at: expected points of 2"),
        (lambda: disc(1, at="ab"), TypeError, "at"),
        (lambda: sphere(1, at=[0, 0, math.nan]), ValueError, "at"),
        (lambda: capsule([0, 0], [0, 0], 1), ValueError, "end"),
        (lambda: capsule([0, 0], [0, 0, 1], 1), (TypeError, ValueError), "end"),
        (lambda: capsule([0, 0], [1, 0], -1), ValueError, "radius"),
        (lambda: polygon([[0, 0], [1, 0]]), ValueError, "vertices: expected at least three"),
        (
            lambda: polygon([[0, 0], [2, 0], [1, 0.5], [0, 2]]),
            ValueError,
            r"outwards at \(1, 0.5\)",
        ),
        (lambda: polygon([[0, 0], [1, 0], [2, 0], [0, 2]]), ValueError, "by no angle"),
        (lambda: polygon(STAR), ValueError, "star"),
        (lambda: polygon(STAR[::-1]), ValueError, "star"),
        (lambda: polygon(SQUARE, -0.1), ValueError, "radius"),
        (lambda: polytope(CUBE[:4]), ValueError, "vertices: .* interior"),
        (lambda: polytope([*CUBE, [0.5, 0.5, 0.5]]), ValueError, r"\(0.5, 0.5, 0.5\)"),
        (lambda: compound([]), ValueError, "bodies"),
        (lambda: compound([disc(1), sphere(1)]), ValueError, "bodies: expected all in the plane"),
        (lambda: compound([1]), TypeError, "bodies"),
        (lambda: disc(1).moved(turn="a"), TypeError, "turn"),
        (lambda: sphere(1).moved(turn=0.5), TypeError, "turn: expected .*Rotation"),
        (lambda: HalfSpace([0, 0], [0, 0]), ValueError, "normal"),
        (lambda: HalfSpace([0, 1], [0, 0, 0]), ValueError, "point"),
        (lambda: Cylinder(-1), ValueError, "radius"),
        (lambda: Cylinder(1, axis=[0, 0]), ValueError, "axis"),
        (lambda: box([0, 0], [1, 0]), ValueError, "high"),
        (lambda: Arrangement(disc(1)), TypeError, "bodies"),
        (lambda: Arrangement([]), ValueError, "bodies: expected at least one"),
        (lambda: Arrangement([1]), TypeError, "bodies"),
        (
            lambda: Arrangement([disc(1), sphere(1)]),
            ValueError,
            "bodies: expected all in the plane",
        ),
        (
            lambda: Arrangement({"left arm": disc(1)}),
            ValueError,
            "bodies: expected names .*'left arm'",
        ),
        (lambda: Arrangement(TWO, {"w": 1}), TypeError, "walls"),
        (lambda: Cylinder(1, point=[0, 0, 0], spin=1.0), ValueError, "spin"),
        (lambda: Arrangement(TWO, {"w": HalfSpace([0, 0, 1], [0, 0, 0])}), ValueError, "walls"),
        (lambda: Arrangement(TWO, fixed={"1": disc(1)}), ValueError, "fixed: .* own; got '1'"),
        (lambda: Arrangement(TWO, orientations="some"), ValueError, "orientations"),
        (lambda: Arrangement(TWO, {"w": Cylinder(0.9)}).polyhedron, ValueError, "'w'"),
        (lambda: Arrangement(TWO).point({"1": [0, 0]}), ValueError, "placed: .* '2'"),
        (lambda: Arrangement(TWO).point({"1": [0, 0], "3": [0, 0]}), ValueError, "placed"),
        (lambda: Arrangement(TWO).point({"1": [0, 0], "2": [0]}), ValueError, "placed"),
        (
            lambda: Arrangement([polygon(SQUARE)] * 2, orientations="none").point(
                {"1": [0, 0], "2": ([3, 0], 0.1)}
            ),
            ValueError,
            "placed: expected no rotation of '2'",
        ),
        (lambda: Arrangement(TWO).placed([0, 0]), ValueError, "q: expected"),
    ],
)
def test_wrong_arguments_are_named(make, kind, said):
    with pytest.raises(kind, match=said):
        make()


@pytest.mark.parametrize("length", [np.nextafter(1.5, 0), 1.5, np.nextafter(1.5, 2)])
def test_the_axis_leads_to_the_first_of_points_as_far_but_for_rounding(length):
    """Which of two ends is the farther by the last bit says nothing."""
    rod = capsule([0, 0, -1.5], [0, 0, length], 0.2)
    assert np.allclose(rod.axis, [0, 0, -1], rtol=0, atol=1e-14)


@given(st.integers(0, 10**6), st.sampled_from([0.0, 1e-10, 1e-9, 2e-9, 1e-8, 1e-7]))
def test_faces_that_are_almost_flat_have_edges_of_two_faces(seed, noise):
    rng = np.random.default_rng(seed)
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) @ Rotation.random(rng=rng).as_matrix()
    part = polytope(corners + noise * rng.uniform(-1, 1, corners.shape)).parts[""]
    faces = [set(face) for face in part.facets.faces]
    assert 6 <= len(faces) <= 12
    assert 8 - len(part.facets.edges) + len(faces) == 2  # Euler
    for i, j, left, right in part.facets.edges:
        assert {i, j} <= faces[left]
        assert {i, j} <= faces[right]
