"""Vertex figures: rays and sectors at regular, degenerate, singular and concave corners."""

import itertools
import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_skeletons import Cells
from skeleton_shapes import ball, boxes_union, half_spaces, polytope, space

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry
from polycorner.polyhedra.quotients import Quotient
from polycorner.skeletons.explorer import Explorer
from polycorner.tolerances import DEFAULT

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
few = settings(max_examples=settings.default.max_examples // 2)
fewest = settings(max_examples=settings.default.max_examples // 8)


def figure(D, q, symmetry=None):
    """Return what leaves a point, with all functions that matter there."""
    point = np.asarray(q, dtype=float)
    point = Quotient(D, symmetry or Symmetry(), DEFAULT, 100.0).near([point]).at(point)
    explorer = Explorer(point.quotient, [], np.random.default_rng(0))
    return explorer.registry.figure(point, point.active())


def directions(found):
    return sorted((ray.direction.round(9) + 0.0).tolist() for ray in found.rays)


def names(D, rows):
    return {D.names[i] for i in rows}


def check(D, found, q):
    """Assert that every ray begins a curve inside the set on which its functions vanish."""
    for ray in found.rays:
        assert np.linalg.norm(ray.direction) == pytest.approx(1)
        there = ray.sample.q
        assert D.contains(there, tolerance=1e-8)
        assert abs(D.values(there)[sorted(ray.active)]).max(initial=0) < 1e-12
        away = (there - q) / np.array(D.manifold.scales)
        assert np.linalg.norm(away) == pytest.approx(ray.distance, rel=0.1)
        assert away @ ray.direction > 0.9 * np.linalg.norm(away)
    for sector in found.sectors:
        one, other = (found.rays[k] for k in sector.rays)
        assert sector.active <= one.active & other.active


class TestRegular:
    @given(st.integers(2, 5), st.integers(0, 10**6))
    @few
    def test_a_simplicial_corner_has_the_columns_of_the_inverse(self, n, seed):
        rng = np.random.default_rng(seed)
        normals = np.linalg.qr(rng.standard_normal((n, n)))[0] + 0.2 * rng.random((n, n))
        D = polytope(-normals, np.zeros(n))
        found = figure(D, np.zeros(n))
        inverse = np.linalg.inv(normals).T
        expected = inverse / np.linalg.norm(inverse, axis=1)[:, None]
        assert len(found.rays) == n
        for ray in found.rays:
            (left,) = set(range(n)) - ray.active
            np.testing.assert_allclose(ray.direction, expected[left], atol=1e-9)
        assert len(found.sectors) == math.comb(n, 2)
        assert (found.rank, found.full, found.singular, found.notes) == (n, n, False, ())
        check(D, found, np.zeros(n))

    @pytest.mark.parametrize("sides", [4, 5, 7])
    def test_the_apex_of_a_pyramid_has_an_edge_between_neighbouring_facets(self, sides):
        angles = math.tau * np.arange(sides) / sides
        rows = np.column_stack([np.cos(angles), np.sin(angles), np.ones(sides)])
        D = polytope(rows, np.zeros(sides))
        found = figure(D, np.zeros(3))
        assert {ray.active for ray in found.rays} == {
            frozenset((k, (k + 1) % sides)) for k in range(sides)
        }
        assert {sector.active for sector in found.sectors} == {
            frozenset((k,)) for k in range(sides)
        }
        assert len(found.sectors) == sides
        check(D, found, np.zeros(3))

    def test_rows_that_only_touch_belong_to_the_rays_they_touch(self):
        rows = [[-1, 0, 0], [0, -1, 0], [0, 0, -1], [-1, -1, 0], [-1, -1, -1]]
        D = polytope(rows, [0] * 5)
        found = figure(D, np.zeros(3))
        active = {tuple(ray.direction.round(9) + 0.0): set(ray.active) for ray in found.rays}
        assert active == {
            (0, 0, 1): {0, 1, 3},
            (0, 1, 0): {0, 2},
            (1, 0, 0): {1, 2},
        }

    @given(st.floats(0.1, 3), st.floats(-1, 1), st.integers(0, 99))
    @fewest
    def test_curvature_changes_neither_rays_nor_sectors(self, bend, twist, seed):
        rng = np.random.default_rng(seed)
        forms = [m + m.T for m in rng.uniform(-1, 1, (3, 3, 3))]
        point = sp.Matrix([x, y, z])
        bent = [
            v + bend * (point.T * sp.Matrix(form) * point)[0] + twist * x * y * z
            for v, form in zip((x, y, z), forms, strict=True)
        ]
        D = Polyhedron(SPACE, bent)
        found = figure(D, np.zeros(3))
        assert directions(found) == [[0, 0, 1], [0, 1, 0], [1, 0, 0]]
        assert len(found.sectors) == 3
        check(D, found, np.zeros(3))

    @given(st.lists(st.floats(0.01, 100), min_size=3, max_size=3))
    @few
    def test_directions_are_in_scale_units(self, scales):
        M = Manifold(space(3).names, scales=tuple(scales))
        D = Polyhedron(M, AllOf(*half_spaces(-np.eye(3), [0, 0, 0], M)))
        found = figure(D, np.zeros(3))
        assert directions(found) == [[0, 0, 1], [0, 1, 0], [1, 0, 0]]
        check(D, found, np.zeros(3))

    def test_a_line_has_one_ray_and_the_end_of_a_wedge_two(self):
        assert directions(figure(polytope([[-1]], [0]), [0.0])) == [[1.0]]
        found = figure(Polyhedron(PLANE, {"top": x - y, "bottom": y}), [0.0, 0.0])
        root = round(math.sqrt(0.5), 9)
        assert directions(found) == [[root, root], [1, 0]]
        (sector,) = found.sectors
        assert (set(sector.rays), sector.active) == ({0, 1}, frozenset())

    def test_equations_and_symmetries_are_quotiented_out(self):
        D = Polyhedron(SPACE, {"a": x, "b": y, "c": z}, {"plane": x + y + z - 1})
        found = figure(D, [1.0, 0.0, 0.0])
        assert (found.rank, found.full) == (2, 2)
        root = math.sqrt(0.5)
        np.testing.assert_allclose(
            directions(found), [[-root, 0, root], [-root, root, 0]], atol=1e-8
        )
        shift = Symmetry(tangents=lambda _: np.array([[1.0, 1.0]]), invariants=np.diff)
        found = figure(Polyhedron(PLANE, {"gap": y - x - 1}), [0.0, 1.0], shift)
        np.testing.assert_allclose(directions(found), [[-root, root]], atol=1e-9)


class TestConcave:
    @given(st.integers(1, 254))
    def test_some_rays_at_any_pattern_of_octants_are_the_segments_that_bend(self, octants):
        """As written there may be more, along sides that parts share."""
        cube = itertools.product((0, 1), repeat=3)
        boxes = [[(b, b + 1) for b in bits] for k, bits in enumerate(cube) if octants >> k & 1]
        cells, middle = Cells(boxes), (1, 1, 1)
        D = boxes_union(boxes)
        expected = {
            tuple(sign * np.eye(3)[axis])
            for axis in range(3)
            for sign in (1, -1)
            if (tuple(1 - (k == axis and sign < 0) for k in range(3)), axis) in cells.segments()
        }
        found = figure(D, middle)
        if cells.bends(cells.around(middle, range(3))):
            assert expected <= {tuple(d) for d in directions(found)}
        check(D, found, np.array(middle))

    @pytest.mark.parametrize(
        ("tree", "expected"),
        [
            (AnyOf(x, y), [[-1, 0], [0, -1]]),
            (AllOf(x, y), [[0, 1], [1, 0]]),
            (AnyOf(AllOf(x, y), AllOf(-x, -y)), [[-1, 0], [0, -1], [0, 1], [1, 0]]),
        ],
        ids=["concave", "convex", "opposite"],
    )
    def test_corners_of_the_plane(self, tree, expected):
        D = Polyhedron(PLANE, tree)
        found = figure(D, [0.0, 0.0])
        assert directions(found) == expected
        assert len(found.sectors) == len(expected) // 2
        check(D, found, np.zeros(2))

    def test_three_half_spaces_joined(self):
        D = Polyhedron(SPACE, AnyOf(x, y, z))
        found = figure(D, np.zeros(3))
        assert directions(found) == [[-1, 0, 0], [0, -1, 0], [0, 0, -1]]
        assert len(found.sectors) == 3

    def test_boxes_that_cross_in_a_corner(self):
        D = boxes_union([[(0, 2), (0, 1)], [(0, 1), (0, 2)]])
        found = figure(D, [1.0, 1.0])
        assert directions(found) == [[0, 1], [1, 0]]
        (sector,) = found.sectors
        assert sector.active == frozenset()


class TestSingular:
    @given(st.floats(0, math.tau), st.floats(0.1, 0.9))
    def test_where_circles_touch_from_inside_four_rays_leave_along_one_line(self, angle, r):
        at = np.array([math.cos(angle), math.sin(angle)])
        D = Polyhedron(
            space(2), AllOf(ball((0, 0), 1, "rim"), ball((1 - r) * at, r, "hole", inside=False))
        )
        found = figure(D, at)
        assert found.singular
        assert len(found.rays) == 4
        for ray in found.rays:
            assert abs(ray.direction @ at) < ray.distance / r
            assert len(ray.active) == 1
        assert sorted(len(s.rays) for s in found.sectors) == [2, 2]
        check(D, found, at)

    def test_a_touching_line_leaves_the_circle_s_two_rays(self):
        D = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2, "line": 1 - x})
        found = figure(D, [1.0, 0.0])
        ahead = sorted(ray.direction.tolist() for ray in found.rays)
        np.testing.assert_allclose(ahead, [[0, -1], [0, 1]], atol=found.rays[0].distance)
        assert all(names(D, ray.active) == {"disc"} for ray in found.rays)
        (sector,) = found.sectors
        assert set(sector.rays) == {0, 1}

    def test_dependent_planes_through_one_line_leave_the_line(self):
        D = Polyhedron(SPACE, {"a": x, "b": y, "c": x + y})
        found = figure(D, np.zeros(3))
        assert found.singular
        assert directions(found) == [[0, 0, -1], [0, 0, 1]]
        assert all(names(D, ray.active) == {"a", "b", "c"} for ray in found.rays)
