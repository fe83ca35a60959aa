"""Diagnostics: bad starts, open ends, near misses, interruptions, wrong arguments."""

import itertools
import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from skeleton_shapes import counts, polytope, whole

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, skeleton
from polycorner.polyhedra import LocalType
from polycorner.skeletons import Completeness, End

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
TRIANGLE = polytope([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])
few = settings(max_examples=settings.default.max_examples // 4)


def told(atlas, *words):
    """Whether one of the notes contains all the words."""
    return any(all(word in note for word in words) for note in atlas.notes)


class TestStarts:
    def test_starts_outside_are_named_and_the_others_used(self):
        atlas = skeleton(TRIANGLE, [[-1, -1], [0.2, 0.2], [5, 5]])
        assert counts(atlas) == (3, 3, 1)
        assert told(atlas, "start 0", "outside")
        assert told(atlas, "start 2", "outside")
        assert not told(atlas, "start 1")
        assert atlas.complete is Completeness.EXHAUSTED

    def test_starts_outside_alone_are_moved_in(self):
        atlas = skeleton(TRIANGLE, [[-1, -1], [2, 2]])
        assert counts(atlas) == (3, 3, 1)
        assert atlas.complete is Completeness.EXHAUSTED
        for number, away in ((0, 2**0.5), (1, 1.5 * 2**0.5)):
            assert told(atlas, f"start {number} lies outside", f"moved in by {away:.3g} scale")

    def test_nothing_is_found_in_an_empty_set(self):
        atlas = skeleton(Polyhedron(PLANE, [x, y, -1 - x - y]), [[-1, -1], [2, 2]])
        assert counts(atlas) == (0, 0, 0)
        assert atlas.complete is Completeness.SEEDS
        assert atlas.euler_characteristic is None
        assert dict(atlas.components) == {}
        assert atlas.graph.number_of_nodes() == 0
        assert len(atlas.notes) == 2

    def test_an_empty_set_has_no_start_inside(self):
        empty = Polyhedron(PLANE, [x, y, -1 - x - y])
        grid = list(itertools.product(np.linspace(-2, 2, 5), repeat=2))
        atlas = skeleton(empty, grid)
        assert atlas.complete is Completeness.SEEDS
        assert len(atlas.notes) == len(grid)

    def test_a_start_off_the_equations_lies_outside(self):
        D = Polyhedron(PLANE, {"right": x}, {"circle": x**2 + y**2 - 1})
        atlas = skeleton(D, [[0.5, 0.5], [0.6, 0.8]])
        assert told(atlas, "start 0", "outside")
        assert counts(atlas) == (2, 1, 0)

    @pytest.mark.parametrize(
        "start", [[0.5, 0.5], [0.0, 0.3], [0.0, 0.0], [1.0, 0.0]], ids=["edge", "side", "o", "tip"]
    )
    def test_a_start_may_lie_on_the_boundary(self, start):
        assert counts(skeleton(TRIANGLE, [start])) == (3, 3, 1)

    def test_one_start_may_be_a_single_point(self):
        assert counts(skeleton(TRIANGLE, [0.2, 0.2])) == (3, 3, 1)

    def test_a_start_where_a_function_is_not_finite_lies_outside(self):
        D = Polyhedron(PLANE, {"root": sp.sqrt(x) - y, "base": y, "lid": 1 - x})
        atlas = skeleton(D, [[-1, 0.5], [0.5, 0.1]])
        assert told(atlas, "start 0", "outside")
        assert told(atlas, "chart") or len(atlas.corners) == 3

    def test_a_set_without_edges_is_told_from_an_empty_one(self):
        atlas = skeleton(Polyhedron(SPACE, {"bowl": z - x**2 - y**2}), [[0, 0, 1]], extent=5)
        assert atlas.complete is Completeness.SEEDS
        assert told(atlas, "start 0")
        assert not told(atlas, "outside")


class TestOpenEnds:
    def test_an_unbounded_wedge_has_edges_to_infinity(self):
        atlas = skeleton(Polyhedron(PLANE, {"floor": y, "wall": x}), [[1, 2]], extent=40)
        assert counts(atlas) == (1, 2, 1)
        for edge in atlas.edges:
            assert edge.kinds == (End.CORNER, End.INFINITY)
            assert edge.ends == (0, None)
            assert edge.length > 40
            assert told(atlas, edge.active[0], End.INFINITY.value)
        assert not atlas.faces[0].closed
        assert atlas.euler_characteristic is None
        assert atlas.graph.number_of_edges() == 0

    def test_a_half_plane_has_an_edge_without_ends(self):
        atlas = skeleton(Polyhedron(PLANE, {"floor": y}), [[1, 2]], extent=40)
        assert counts(atlas) == (0, 1, 1)
        assert atlas.edges[0].kinds == (End.INFINITY, End.INFINITY)
        assert atlas.edges[0].length > 80
        assert not atlas.edges[0].is_closed
        assert atlas.euler_characteristic is None

    def test_an_octant_is_bounded_by_three_open_faces(self):
        atlas = skeleton(polytope(-np.eye(3), np.zeros(3)), [[1, 1, 1]], extent=20)
        assert counts(atlas) == (1, 3, 3)
        assert all(not face.closed for face in atlas.faces)

    def test_a_slab_without_edges_says_that_nothing_was_met(self):
        atlas = skeleton(Polyhedron(SPACE, {"floor": z, "lid": 1 - z}), [[0, 0, 0.5]], extent=10)
        assert counts(atlas) == (0, 0, 0)
        assert atlas.complete is Completeness.SEEDS
        assert atlas.notes

    def test_what_is_longer_than_the_extent_is_not_infinite_to_a_larger_one(self):
        D = polytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [30, 0, 1, 0])
        short, long = (skeleton(D, [[0.5, 0.5]], extent=e) for e in (10, 100))
        assert told(short, End.INFINITY.value)
        assert short.euler_characteristic is None
        assert (counts(long), long.notes) == ((4, 4, 1), ())

    @pytest.mark.parametrize("extent", [100, 1000, 5000])
    @pytest.mark.parametrize("shear", [0, 0.7, -2])
    def test_edges_that_go_on_are_one_from_wherever_they_are_met(self, shear, extent):
        """A road with a bottleneck: walks across it meet its sides far from where they began."""
        u, v = x + shear * y, y
        road = AllOf(v, 30 - v, AnyOf(14 - v, 10 - u, u - 13))
        starts = [[0.5 - shear / 4, 0.25], [0.5 - 10 * shear, 10], [11.5 - 10 * shear, 10]]
        atlas = skeleton(Polyhedron(PLANE, road), starts, extent=extent)
        assert counts(atlas) == (4, 6, 1)

    def test_a_square_root_ends_the_chart(self):
        D = Polyhedron(PLANE, {"root": sp.sqrt(x) - y, "floor": y + 1, "wall": 4 - x})
        atlas = skeleton(D, [[1, 0]])
        ends = {edge.active: edge.kinds for edge in atlas.edges}
        assert ends == {
            ("wall",): (End.CORNER, End.CORNER),
            ("floor",): (End.CORNER, End.CHART),
            ("root",): (End.CORNER, End.CHART),
        }
        (floor,) = [e for e in atlas.edges if e.active == ("floor",)]
        assert floor.length == pytest.approx(4, abs=1e-5)
        assert told(atlas, "floor", "chart")
        assert told(atlas, "root", "chart")
        assert atlas.euler_characteristic is None

    def test_a_logarithm_ends_the_chart(self):
        D = Polyhedron(PLANE, {"log": y - sp.log(x), "lid": 1 - y})
        atlas = skeleton(D, [[1, 0.5]], extent=50)
        (lid,) = [e for e in atlas.edges if e.active == ("lid",)]
        assert set(lid.kinds) == {End.CORNER, End.CHART}
        assert told(atlas, "lid", "chart")

    def test_a_point_where_the_gradient_vanishes_is_a_corner(self):
        """``x^3 >= y^2`` has a cusp at the origin, where the gradient is zero."""
        atlas = skeleton(Polyhedron(PLANE, {"cusp": x**3 - y**2, "lid": 1 - x}), [[0.5, 0]])
        assert (counts(atlas), atlas.euler_characteristic) == ((3, 3, 1), 1)

    def test_a_crossing_of_one_function_with_itself_is_a_corner(self):
        """``x y >= 0`` in a disc: two quarters; the crossing has no gradient."""
        D = Polyhedron(PLANE, {"saddle": x * y, "disc": 1 - x**2 - y**2})
        atlas = skeleton(D, [[0.5, 0.2], [-0.5, -0.3]])
        assert (counts(atlas), atlas.euler_characteristic) == ((5, 6, 2), 1)


class TestNearMisses:
    @given(st.sampled_from([1e-2, 1e-4, 1e-5, 3e-6, 1e-6]), st.floats(0.2, 1.3), st.integers(0, 99))
    def test_corners_that_are_a_millionth_apart_are_two(self, distance, angle, seed):
        """A right angle cut off by a line at a small distance."""
        normal = [-math.cos(angle), -math.sin(angle)]
        D = polytope([[-1, 0], [0, -1], normal, [1, 1]], [0, 0, -distance, 2])
        atlas = skeleton(D, [[0.5, 0.4]], rng=seed)
        assert counts(atlas) == (4, 4, 1)
        (short,) = [e for e in atlas.edges if e.active == ("f3",)]
        exact = distance / (math.cos(angle) * math.sin(angle))
        assert short.length == pytest.approx(exact, rel=1e-3)
        assert atlas.euler_characteristic == 1

    @pytest.mark.parametrize("height", [1e-3, 1e-5, 1e-6])
    def test_a_thin_strip_has_four_corners(self, height):
        D = polytope([[-1, 0], [1, 0], [0, -1], [0, 1]], [0, 1, 0, height])
        atlas = skeleton(D, [[0.4, height / 2]])
        assert counts(atlas) == (4, 4, 1)

    @pytest.mark.parametrize("shift", [1e-2, 1e-4, 1e-5, 1e-6])
    def test_an_apex_that_is_nearly_one_point_is_a_short_ridge(self, shift):
        """Four faces of a pyramid, one of them moved out."""
        rows = [[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1], [0, 0, -1]]
        atlas = skeleton(polytope(rows, [1, 1, 1, 1 + shift, 0]), [[0.1, 0.2, 0.3]])
        assert whole(atlas) == ((6, 9, 5), 2)
        ridge = min(atlas.edges, key=lambda e: e.length)
        assert ridge.length == pytest.approx(shift, rel=1e-3)

    @given(st.sampled_from([1e-9, 3e-9]), st.integers(0, 99))
    @few
    def test_corners_within_the_tolerance_are_one_and_the_skeleton_says_so(self, distance, seed):
        D = polytope([[-1, 0], [0, -1], [-1, -1], [1, 1]], [0, 0, -distance, 2])
        atlas = skeleton(D, [[0.5, 0.4]], rng=seed)
        assert counts(atlas) == (3, 3, 1)
        assert told(atlas, "f1, f2, f3", "tolerance")
        (blunt,) = [c for c in atlas.corners if len(c.active) == 3]
        assert blunt.local_type is LocalType.CONE

    @pytest.mark.parametrize(("tolerance", "corners"), [(1e-8, 4), (1e-3, 3)])
    def test_the_tolerance_decides_what_is_one_point(self, tolerance, corners):
        D = polytope([[-1, 0], [0, -1], [-1, -1], [1, 1]], [0, 0, -1e-4, 2])
        atlas = skeleton(D, [[0.5, 0.4]], tolerance=tolerance)
        assert len(atlas.corners) == corners

    def test_a_gap_just_above_the_tolerance_is_remarked_on(self):
        """A fourth line passes a corner of a triangle at a distance of 1e-6, outside."""
        D = polytope([[-1, 0], [0, -1], [1, 1], [-1, -1]], [0, 0, 1, 1e-6])
        atlas = skeleton(D, [[0.2, 0.2]])
        assert counts(atlas) == (3, 3, 1)
        assert told(atlas, "f1, f2", "f4", "not counted as active")
