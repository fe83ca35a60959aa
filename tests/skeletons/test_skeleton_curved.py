"""Skeletons of curved regions against closed forms: arcs, closed edges, tangential contacts."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_skeletons import arc_length, circle_meetings, turned
from skeleton_shapes import ball, check_incidence, closed, counts, half_space, space, whole

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, skeleton
from polycorner.polyhedra import LocalType

TAU = math.tau
few = settings(max_examples=settings.default.max_examples // 2)

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
angles = st.floats(0, TAU)
seeds = st.integers(0, 10**6)


def at(radius, angle, centre=(0.0, 0.0)):
    return np.asarray(centre) + radius * np.array([math.cos(angle), math.sin(angle)])


class TestTwoDiscs:
    @given(angles, st.floats(0.5, 2), st.floats(0.5, 2), st.floats(0.1, 0.9), seeds)
    @few
    def test_a_lens_has_two_corners_and_two_arcs(self, angle, r1, r2, depth, seed):
        d = abs(r1 - r2) + depth * (r1 + r2 - abs(r1 - r2))
        c2 = at(d, angle)
        D = Polyhedron(space(2), AllOf(ball((0, 0), r1, "one"), ball(c2, r2, "two")))
        inner = at((max(d - r2, -r1) + min(r1, d + r2)) / 2, angle)
        atlas = skeleton(D, [inner], rng=seed)
        assert whole(atlas) == ((2, 2, 1), 1)
        check_incidence(atlas)
        meetings = circle_meetings((0, 0), r1, c2, r2)
        for corner in atlas.corners:
            assert np.linalg.norm(meetings - corner.point, axis=1).min() < 1e-10
            assert corner.active == ("one", "two")
        half = {
            "one": math.acos((d**2 + r1**2 - r2**2) / (2 * d * r1)),
            "two": math.acos((d**2 + r2**2 - r1**2) / (2 * d * r2)),
        }
        for edge in atlas.edges:
            (name,) = edge.active
            centre, radius = ((0, 0), r1) if name == "one" else (c2, r2)
            assert turned(edge.polyline, centre) == pytest.approx(2 * half[name], abs=1e-9)
            assert edge.length == pytest.approx(2 * half[name] * radius, rel=1e-9)

    @given(angles, st.floats(0.5, 2), st.floats(0.5, 2), st.floats(0.1, 0.9), seeds)
    @few
    def test_a_disc_without_another_is_a_crescent(self, angle, r1, r2, depth, seed):
        d = abs(r1 - r2) + depth * (r1 + r2 - abs(r1 - r2))
        c2 = at(d, angle)
        D = Polyhedron(
            space(2), AllOf(ball((0, 0), r1, "disc"), ball(c2, r2, "bite", inside=False))
        )
        inner = at(-(r1 + max(-r1, r2 - d)) / 2, angle)
        atlas = skeleton(D, [inner], rng=seed)
        assert counts(atlas) == (2, 2, 1)
        outer = math.acos((d**2 + r1**2 - r2**2) / (2 * d * r1))
        (edge,) = [e for e in atlas.edges if e.active == ("disc",)]
        assert turned(edge.polyline, (0, 0)) == pytest.approx(TAU - 2 * outer, abs=1e-9)
        assert all(c.local_type is LocalType.QUADRANT for c in atlas.corners)

    @given(st.floats(0.3, 3), st.floats(0.2, 0.9), seeds)
    @few
    def test_an_annulus_has_two_closed_edges_and_a_face_between_them(self, radius, part, seed):
        D = Polyhedron(
            space(2),
            AllOf(ball((0, 0), radius, "rim"), ball((0, 0), part * radius, "hole", inside=False)),
        )
        atlas = skeleton(D, [[(1 + part) / 2 * radius, 0]], rng=seed)
        assert counts(atlas) == (0, 2, 1)
        assert closed(atlas) == [True, True]
        assert all(edge.ends == (None, None) and edge.is_loop for edge in atlas.edges)
        assert sorted(map(len, atlas.faces[0].boundary)) == [1, 1]
        assert atlas.euler_characteristic == 0
        assert atlas.components == {0: 0, 1: 2, 2: 1}
        for edge in atlas.edges:
            r = radius if edge.active == ("rim",) else part * radius
            assert turned(edge.polyline, (0, 0)) == pytest.approx(TAU, abs=1e-6)
            assert edge.length == pytest.approx(TAU * r, rel=1e-9)
        check_incidence(atlas)

    @pytest.mark.parametrize("width", [1.0, 0.3, 0.1, 0.03])
    def test_two_boundary_curves_of_one_function_are_told_apart(self, width):
        r2, outer = x**2 + y**2, (1 + sp.Rational(str(width))) ** 2
        D = Polyhedron(PLANE, {"ring": (r2 - 1) * (outer - r2)})
        atlas = skeleton(D, [[1 + width / 2, 0]])
        assert whole(atlas) == ((0, 2, 1), 0)
        found = sorted(np.linalg.norm(edge.polyline[0]) for edge in atlas.edges)
        assert found == pytest.approx([1, 1 + width])


class TestTangentialContacts:
    """Walks meet functions that reach zero and turn back, at any phase of their steps."""

    @given(angles, st.floats(0.1, 0.9), seeds)
    @few
    def test_a_hole_that_touches_the_rim_from_inside_is_a_singular_corner(self, angle, r, seed):
        D = Polyhedron(
            space(2),
            AllOf(ball((0, 0), 1, "rim"), ball(at(1 - r, angle), r, "hole", inside=False)),
        )
        atlas = skeleton(D, [at(-r, angle)], rng=seed)
        assert counts(atlas) == (1, 2, 1)
        (corner,) = atlas.corners
        np.testing.assert_allclose(corner.point, at(1, angle), atol=1e-7)
        assert (corner.active, corner.rank, corner.singular) == (("rim", "hole"), 1, True)
        assert corner.local_type is LocalType.DEGENERATE
        assert sorted(corner.edges) == [0, 0, 1, 1]
        for edge in atlas.edges:
            assert edge.is_loop
            assert not edge.is_closed
            centre = (0, 0) if edge.active == ("rim",) else at(1 - r, angle)
            assert turned(edge.polyline, centre) == pytest.approx(TAU, abs=1e-6)
        assert atlas.euler_characteristic == 0

    @given(angles, st.floats(0.1, 0.9), seeds)
    @few
    def test_a_function_that_touches_from_outside_makes_a_corner_on_a_loop(self, angle, r, seed):
        D = Polyhedron(
            space(2),
            AllOf(ball((0, 0), 1, "disc"), ball(at(1 + r, angle), r, "beside", inside=False)),
        )
        atlas = skeleton(D, [[0.1, 0.2]], rng=seed)
        assert counts(atlas) == (1, 1, 1)
        np.testing.assert_allclose(atlas.corners[0].point, at(1, angle), atol=1e-7)
        assert atlas.corners[0].edges == (0, 0)
        assert atlas.edges[0].is_loop
        assert turned(atlas.edges[0].polyline, (0, 0)) == pytest.approx(TAU, abs=1e-6)
        assert atlas.euler_characteristic == 1

    @given(angles, seeds)
    @few
    def test_a_redundant_half_plane_that_touches_is_met(self, angle, seed):
        D = Polyhedron(
            space(2), AllOf(ball((0, 0), 1, "disc"), half_space(at(1, angle), 1, "line"))
        )
        atlas = skeleton(D, [[0.1, 0.2]], rng=seed)
        assert counts(atlas) == (1, 1, 1)
        assert atlas.corners[0].local_type is LocalType.CONE

    @given(angles, st.floats(0.1, 0.9), seeds)
    @few
    def test_the_union_of_discs_that_touch_has_two_faces(self, angle, r, seed):
        D = Polyhedron(space(2), AnyOf(ball((0, 0), 1, "one"), ball(at(1 + r, angle), r, "two")))
        atlas = skeleton(D, [[0.1, 0.2]], rng=seed)
        assert counts(atlas) == (1, 2, 2)
        assert atlas.corners[0].local_type is LocalType.UNION
        assert atlas.euler_characteristic == 1

    @given(angles, st.sampled_from([1e-2, 1e-3, 1e-4, 1e-5]), seeds)
    def test_a_cut_that_is_nearly_tangential_has_two_corners(self, angle, depth, seed):
        """The chord at distance ``1 - depth`` has half length ``sqrt(2 depth - depth^2)``."""
        D = Polyhedron(
            space(2), AllOf(ball((0, 0), 1, "disc"), half_space(at(1, angle), 1 - depth, "line"))
        )
        atlas = skeleton(D, [[0.1, 0.2]], rng=seed)
        assert counts(atlas) == (2, 2, 1)
        (chord,) = [e for e in atlas.edges if e.active == ("line",)]
        assert chord.length == pytest.approx(2 * math.sqrt(2 * depth - depth**2), rel=1e-7)

    @given(angles, st.sampled_from([1e-3, 1e-5, 1e-6]), seeds)
    def test_a_function_that_stays_away_makes_no_corner(self, angle, gap, seed):
        D = Polyhedron(
            space(2), AllOf(ball((0, 0), 1, "disc"), half_space(at(1, angle), 1 + gap, "line"))
        )
        assert counts(skeleton(D, [[0.1, 0.2]], rng=seed)) == (0, 1, 1)

    @given(st.floats(-0.4, 0.4), st.floats(0.6, 2), seeds)
    def test_a_pinch_of_two_parabolas_has_a_face_on_either_side(self, height, right, seed):
        D = Polyhedron(
            PLANE, {"top": x**2 - y, "bottom": x**2 + y, "right": right - x, "left": x + 1}
        )
        atlas = skeleton(D, [[right * 0.9, height * right**2]], rng=seed)
        assert counts(atlas) == (5, 6, 2)
        assert sum(c.singular for c in atlas.corners) == 1
        assert atlas.euler_characteristic == 1


class TestOtherPlanarRegions:
    @given(st.floats(-1.5, 1.5), st.floats(0.2, 2), seeds)
    @few
    def test_between_a_parabola_and_a_line(self, slope, height, seed):
        D = Polyhedron(PLANE, {"bowl": y - x**2, "lid": height + slope * x - y})
        atlas = skeleton(D, [[0, height / 2]], rng=seed)
        assert counts(atlas) == (2, 2, 1)
        root = math.sqrt(slope**2 + 4 * height)
        left, right = (slope - root) / 2, (slope + root) / 2
        found = sorted(c.point.tolist() for c in atlas.corners)
        np.testing.assert_allclose(found, [[left, left**2], [right, right**2]], atol=1e-10)
        lid, bowl = sorted(atlas.edges, key=lambda e: e.active, reverse=True)
        assert lid.length == pytest.approx((right - left) * math.hypot(1, slope), rel=1e-9)
        assert bowl.length == pytest.approx(arc_length(lambda t: (t, t**2), left, right), rel=1e-9)
        assert abs(np.diff(np.sign(np.diff(bowl.polyline[:, 0])))).max() == 0

    def test_an_ellipse_is_one_closed_edge(self):
        atlas = skeleton(Polyhedron(PLANE, {"ellipse": 1 - x**2 / 9 - y**2}), [[0.5, 0.2]])
        assert counts(atlas) == (0, 1, 1)
        exact = arc_length(lambda t: (3 * sp.cos(t), sp.sin(t)), 0, TAU)
        assert atlas.edges[0].length == pytest.approx(exact, rel=1e-9)
        assert atlas.euler_characteristic == 1

    def test_edges_between_the_same_corners_on_the_same_function_are_told_apart(self):
        """A disc cut by ``x^2 >= 1/4``: two caps; each arc belongs to its own."""
        D = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2, "cut": x**2 - sp.Rational(1, 4)})
        atlas = skeleton(D, [[0.7, 0], [-0.7, 0.1]])
        assert counts(atlas) == (4, 4, 2)
        for edge in atlas.edges:
            assert len(set(np.sign(edge.polyline[:, 0]))) == 1
        assert atlas.euler_characteristic == 2

    def test_a_cusp_of_third_order_is_found_or_its_edges_are_reported(self):
        """Between ``-x^3`` and ``x^3``; the tolerance reaches 0.002 along it."""
        D = Polyhedron(PLANE, {"top": x**3 - y, "bottom": x**3 + y, "lid": 1 - x})
        atlas = skeleton(D, [[0.5, 0]])
        tips = [c for c in atlas.corners if c.active == ("top", "bottom")]
        assert len(tips) == 1
        assert np.linalg.norm(tips[0].point) < 2.2e-3
        assert tips[0].singular
        assert counts(atlas) == (3, 3, 1)
        assert atlas.notes or atlas.euler_characteristic == 1
