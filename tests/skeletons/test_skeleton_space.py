"""Skeletons of curved bodies, on cylinders and tori, and on sections, against closed forms."""

import math

import numpy as np
import pytest
import sympy as sp
from oracles_skeletons import arc_length
from skeleton_shapes import ball, check_incidence, closed, counts, space, whole

from polycorner import AllOf, Manifold, Polyhedron, skeleton

TAU = math.tau

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols


class TestSpace:
    def test_a_ball_cut_by_a_plane(self):
        D = Polyhedron(SPACE, {"ball": 1 - x**2 - y**2 - z**2, "plane": z - sp.Rational(1, 2)})
        atlas = skeleton(D, [[0.1, 0.05, 0.8]])
        assert counts(atlas) == (0, 1, 2)
        assert closed(atlas) == [True]
        assert atlas.edges[0].length == pytest.approx(TAU * math.sqrt(0.75), rel=1e-9)
        assert atlas.euler_characteristic == 2
        assert atlas.components == {0: 0, 1: 1, 2: 2, 3: 1}

    def test_an_octant_of_a_ball_is_a_curved_tetrahedron(self):
        D = Polyhedron(SPACE, {"ball": 1 - x**2 - y**2 - z**2, "a": x, "b": y, "c": z})
        atlas = skeleton(D, [[0.2, 0.3, 0.4]])
        assert counts(atlas) == (4, 6, 4)
        expected = [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
        found = sorted(c.point.round(9).tolist() for c in atlas.corners)
        np.testing.assert_allclose(found, expected, atol=1e-9)
        for edge in atlas.edges:
            exact = math.pi / 2 if "ball" in edge.active else 1.0
            assert edge.length == pytest.approx(exact, rel=1e-9)
        check_incidence(atlas)

    def test_a_cylinder_with_lids_has_closed_edges_and_an_annulus(self):
        D = Polyhedron(SPACE, {"wall": 1 - x**2 - y**2, "floor": z, "lid": 1 - z})
        atlas = skeleton(D, [[0.1, 0.2, 0.5]])
        assert counts(atlas) == (0, 2, 3)
        curves = {face.active: len(face.boundary) for face in atlas.faces}
        assert curves == {("wall",): 2, ("floor",): 1, ("lid",): 1}
        assert atlas.euler_characteristic == 2

    def test_a_thick_pipe_is_a_torus(self):
        D = Polyhedron(
            SPACE,
            {"wall": 4 - x**2 - y**2, "bore": x**2 + y**2 - 1, "floor": z, "lid": 1 - z},
        )
        atlas = skeleton(D, [[1.5, 0, 0.5]])
        assert counts(atlas) == (0, 4, 4)
        assert all(len(face.boundary) == 2 for face in atlas.faces)
        assert atlas.euler_characteristic == 0
        assert atlas.components[3] == 1

    def test_half_a_solid_torus_cut_along_and_across(self):
        solid = sp.Rational(1, 4) - (sp.sqrt(x**2 + y**2) - 2) ** 2 - z**2
        along = skeleton(Polyhedron(SPACE, {"solid": solid, "plane": z}), [[2, 0.1, 0.2]])
        assert (counts(along), along.euler_characteristic) == ((0, 2, 2), 0)
        lengths = sorted(e.length for e in along.edges)
        assert lengths[0] == pytest.approx(TAU * 1.5, rel=1e-9)
        assert lengths[1] == pytest.approx(TAU * 2.5, rel=1e-9)
        across = skeleton(Polyhedron(SPACE, {"solid": solid, "plane": x}), [[1.8, 0.5, 0.2]])
        assert (counts(across), across.euler_characteristic) == ((0, 2, 3), 2)

    def test_the_lens_of_two_balls(self):
        D = Polyhedron(space(3), AllOf(ball((1, 0, 0), 2, "right"), ball((-1, 0, 0), 2, "left")))
        atlas = skeleton(D, [[0.1, 0.2, 0.3]])
        assert counts(atlas) == (0, 1, 2)
        assert atlas.edges[0].length == pytest.approx(TAU * math.sqrt(3), rel=1e-9)

    def test_curves_cross_where_gradients_are_dependent(self):
        """Two cylinders of one radius: two ellipses cross twice; the boundary is a sphere."""
        D = Polyhedron(SPACE, {"one": 1 - x**2 - y**2, "two": 1 - x**2 - z**2})
        atlas = skeleton(D, [[0.1, 0.2, 0.3]])
        assert (counts(atlas), atlas.euler_characteristic) == ((2, 4, 4), 2)
        assert counts(atlas) == (2, 4, 4) or atlas.notes

    def test_a_ball_that_touches_the_rim_of_a_cylinder_loses_no_face(self):
        parts = {"wall": 1 - x**2 - y**2, "floor": z + 1, "lid": 1 - z}
        parts["ball"] = (x - 2) ** 2 + y**2 + (z - 1) ** 2 - 1
        for seed in range(3):
            atlas = skeleton(Polyhedron(SPACE, parts), [[-0.1, 0.3, 0.2]], rng=seed)
            assert len(atlas.corners) == 1
            whole = counts(atlas) == (1, 2, 3) and atlas.euler_characteristic == 2
            assert whole or (atlas.euler_characteristic is None and atlas.notes)


class TestCircles:
    STRIP = Manifold(("phi", "h"), periods=(TAU, math.inf))

    def test_the_edges_of_a_strip_wind_around_the_cylinder(self):
        phi, h = self.STRIP.symbols
        top = 1 + sp.Rational(1, 5) * sp.sin(phi)
        atlas = skeleton(Polyhedron(self.STRIP, {"low": h, "high": top - h}), [[3, 0.5]])
        assert whole(atlas) == ((0, 2, 1), 0)
        for edge in atlas.edges:
            assert abs(edge.polyline[-1, 0] - edge.polyline[0, 0]) == pytest.approx(TAU)
        low, high = sorted(atlas.edges, key=lambda e: e.active, reverse=True)
        assert low.length == pytest.approx(TAU)
        assert high.length == pytest.approx(
            arc_length(lambda t: (t, 1 + sp.sin(t) / 5), 0, TAU), rel=1e-9
        )

    def test_a_strip_that_pinches_and_touches(self):
        """``h <= 1 + cos phi`` touches the floor at pi and the lid at 0."""
        phi, h = self.STRIP.symbols
        D = Polyhedron(self.STRIP, {"low": h, "lid": 2 - h, "wave": 1 + sp.cos(phi) - h})
        atlas = skeleton(D, [[0.2, 0.5]])
        assert counts(atlas) == (2, 3, 1)
        assert all(c.singular for c in atlas.corners)
        assert atlas.euler_characteristic == 0

    def test_bands_on_a_torus_close_after_winding_twice(self):
        torus = Manifold(("a", "b"), periods=(TAU, TAU))
        a, b = torus.symbols
        atlas = skeleton(
            Polyhedron(torus, {"band": sp.cos(a - 2 * b) - sp.Rational(1, 2)}), [[0, 0]]
        )
        assert whole(atlas) == ((0, 2, 1), 0)
        for edge in atlas.edges:
            assert edge.length == pytest.approx(TAU * math.sqrt(5))
            wound = abs(edge.polyline[-1] - edge.polyline[0]) / TAU
            np.testing.assert_allclose(wound, [2, 1], atol=1e-7)

    def test_corners_on_either_side_of_the_cut_of_the_chart_are_joined(self):
        phi, h = self.STRIP.symbols
        D = Polyhedron(self.STRIP, {"low": h, "high": 1 - h, "gate": -sp.cos(phi)})
        atlas = skeleton(D, [[3.0, 0.5]])
        assert counts(atlas) == (4, 4, 1)
        assert sorted(e.length for e in atlas.edges) == pytest.approx([1, 1, math.pi, math.pi])
        check_incidence(atlas)


class TestEquations:
    def test_an_octant_of_the_sphere_is_a_triangle(self):
        D = Polyhedron(SPACE, {"a": x, "b": y, "c": z}, {"sphere": x**2 + y**2 + z**2 - 1})
        atlas = skeleton(D, [np.ones(3) / math.sqrt(3)])
        assert whole(atlas) == ((3, 3, 1), 1)
        assert atlas.components == {0: 3, 1: 3, 2: 1}
        assert {c.rank for c in atlas.corners} == {3}
        for edge in atlas.edges:
            assert edge.length == pytest.approx(math.pi / 2, rel=1e-9)

    def test_a_plane_section_of_the_cube_is_a_hexagon(self):
        sides = {f"{'-+'[s > 0]}{v}": 1 + s * v for v in (x, y, z) for s in (1, -1)}
        atlas = skeleton(Polyhedron(SPACE, sides, [x + y + z]), [[0.1, -0.1, 0.0]])
        assert counts(atlas) == (6, 6, 1)
        assert [e.length for e in atlas.edges] == pytest.approx([math.sqrt(2)] * 6)
        check_incidence(atlas)

    def test_a_curve_cut_by_a_line_is_an_edge_with_two_ends(self):
        D = Polyhedron(PLANE, {"right": x}, {"circle": x**2 + y**2 - 1})
        atlas = skeleton(D, [[0.6, 0.8]])
        assert counts(atlas) == (2, 1, 0)
        assert atlas.edges[0].length == pytest.approx(math.pi, rel=1e-9)
        assert atlas.edges[0].active == ()

    def test_a_closed_curve_alone_is_a_closed_edge(self):
        D = Polyhedron(PLANE, [], {"circle": x**2 + y**2 - 1})
        atlas = skeleton(D, [[0.6, 0.8]])
        assert counts(atlas) == (0, 1, 0)
        assert closed(atlas) == [True]
