"""Quotients by motions: skeletons of orbits against skeletons of shapes and distances."""

import itertools
import math

import numpy as np
import pytest
import sympy as sp
from skeleton_shapes import counts, polytope, space

from polycorner import Manifold, Polyhedron, Symmetry, skeleton
from polycorner.polyhedra import Element
from polycorner.skeletons import End

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols

# ------------------------------------------------------------------------------------------ motions


def gaps_on_a_line(count):
    """Return ``count`` points on a line, neighbours 1 to 3 apart, and the translations."""
    rows, limits = [], []
    for k in range(count - 1):
        step = np.eye(count, dtype=int)[k + 1] - np.eye(count, dtype=int)[k]
        rows += [-step, step]
        limits += [-1, 3]
    translation = Symmetry(tangents=lambda q: np.ones((1, len(q))), invariants=np.diff)
    return polytope(rows, limits), translation


def planar_motions(count):
    """Return the tangents of translations and rotation of points in the plane."""

    def tangents(q):
        away = q.reshape(count, 2) - q.reshape(count, 2).mean(axis=0)
        motions = np.zeros((3, count, 2))
        motions[0, :, 0] = motions[1, :, 1] = 1
        motions[2] = away @ np.array([[0, 1], [-1, 0]])
        return motions.reshape(3, -1)

    return tangents


def sides(q):
    """Return the distances of all pairs of points in the plane."""
    p = q.reshape(-1, 2)
    return np.array([math.dist(a, b) for a, b in itertools.combinations(p, 2)])


class TestMotions:
    @pytest.mark.parametrize("count", [2, 3, 4])
    def test_points_on_a_line_modulo_translations_are_a_cube_of_gaps(self, count):
        D, translation = gaps_on_a_line(count)
        atlas = skeleton(D, [2.0 * np.arange(count)], symmetry=translation)
        cube = polytope(
            np.vstack([np.eye(count - 1), -np.eye(count - 1)]),
            [3] * (count - 1) + [-1] * (count - 1),
        )
        whole = skeleton(cube, [np.full(count - 1, 2.0)])
        assert counts(atlas) == counts(whole)
        assert {dim - 1: n for dim, n in atlas.components.items()} == dict(whole.components)
        assert atlas.euler_characteristic == whole.euler_characteristic
        gaps = {tuple(np.diff(c.point).round(9)) for c in atlas.corners}
        assert gaps == set(itertools.product((1.0, 3.0), repeat=count - 1))

    def test_lengths_are_measured_across_the_orbits(self):
        """Two points move apart by 2: each by 1, to either side."""
        D, translation = gaps_on_a_line(2)
        atlas = skeleton(D, [[0, 2]], symmetry=translation)
        assert atlas.edges[0].length == pytest.approx(math.sqrt(2))
        assert sum(atlas.edges[0].polyline[0]) == pytest.approx(sum(atlas.edges[0].polyline[-1]))

    def test_two_points_in_the_plane_modulo_translations_are_an_annulus(self):
        M = Manifold.euclidean("a b c d")
        a, b, c, d = M.symbols
        apart = (a - c) ** 2 + (b - d) ** 2
        D = Polyhedron(M, {"near": apart - 1, "far": 4 - apart})
        shift = Symmetry(
            tangents=lambda _: np.array([[1, 0, 1, 0], [0, 1, 0, 1]]),
            invariants=lambda q: q[2:] - q[:2],
        )
        atlas = skeleton(D, [[0, 0, 1.5, 0]], symmetry=shift)
        assert counts(atlas) == (0, 2, 1)
        assert all(edge.kinds == (End.CLOSED, End.CLOSED) for edge in atlas.edges)
        assert atlas.components == {2: 0, 3: 2, 4: 1}
        assert atlas.euler_characteristic == 0

    def test_two_points_in_the_plane_modulo_motions_are_a_segment(self):
        M = Manifold.euclidean("a b c d")
        a, b, c, d = M.symbols
        apart = (a - c) ** 2 + (b - d) ** 2
        D = Polyhedron(M, {"near": apart - 1, "far": 4 - apart})
        symmetry = Symmetry(tangents=planar_motions(2), invariants=sides)
        atlas = skeleton(D, [[0, 0, 1.5, 0]], symmetry=symmetry)
        assert counts(atlas) == (2, 1, 0)
        assert sorted(sides(c.point)[0] for c in atlas.corners) == pytest.approx([1, 2])

    def test_an_annulus_modulo_rotations_is_a_segment(self):
        D = Polyhedron(PLANE, {"rim": 4 - x**2 - y**2, "hole": x**2 + y**2 - 1})
        symmetry = Symmetry(
            tangents=lambda q: np.array([[-q[1], q[0]]]),
            invariants=lambda q: np.array([np.hypot(*q)]),
        )
        atlas = skeleton(D, [[0.9, 1.1]], symmetry=symmetry)
        assert counts(atlas) == (2, 1, 0)
        assert atlas.edges[0].length == pytest.approx(1)
        assert {c.rank for c in atlas.corners} == {1}

    def test_triangles_modulo_motions_are_a_cube_of_side_lengths(self):
        """Sides between 1 and 3/2 always make a triangle; either orientation is a component."""
        M = space(6)
        q = M.symbols
        parts = {}
        for (i, j), name in zip(itertools.combinations(range(3), 2), "cba", strict=True):
            square = sum((q[2 * i + k] - q[2 * j + k]) ** 2 for k in range(2))
            parts |= {f"short {name}": square - 1, f"long {name}": sp.Rational(9, 4) - square}
        D = Polyhedron(M, parts)

        def invariants(q):
            u, v = q[2:4] - q[:2], q[4:] - q[:2]
            return np.append(sides(q), u[0] * v[1] - u[1] * v[0])

        symmetry = Symmetry(tangents=planar_motions(3), invariants=invariants)
        upper, lower = [0, 0, 1.2, 0, 0.6, 1.1], [0, 0, 1.2, 0, 0.6, -1.1]
        one = skeleton(D, [upper], symmetry=symmetry)
        assert counts(one) == (8, 12, 6)
        assert one.components == {3: 8, 4: 12, 5: 6, 6: 1}
        assert one.euler_characteristic == 2
        both = skeleton(D, [upper, lower], symmetry=symmetry)
        assert counts(both) == (16, 24, 12)
        assert both.components == {3: 16, 4: 24, 5: 12, 6: 2}
        mirror = Element(lambda q: q * np.array([1, -1, 1, -1, 1, -1]), {})
        folded = Symmetry(symmetry.tangents, symmetry.invariants, elements=(mirror,))
        assert counts(skeleton(D, [upper, lower], symmetry=folded)) == (8, 12, 6)

    def test_separation_is_zero_on_orbits_and_positive_between_them(self):
        symmetry = Symmetry(tangents=planar_motions(3), invariants=sides)
        M, p = space(6), np.array([0, 0, 1, 0, 0.3, 0.8])
        turn = np.array([[0.6, -0.8], [0.8, 0.6]])
        moved = (p.reshape(3, 2) @ turn.T + [3, -2]).ravel()
        assert symmetry.separation(M, p, moved) == pytest.approx(0, abs=1e-14)
        assert symmetry.separation(M, p, 1.1 * p) == pytest.approx(0.1 * max(sides(p)))
