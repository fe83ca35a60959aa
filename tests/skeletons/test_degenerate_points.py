"""Points where gradients vanish or depend on each other, however linear algebra rounds there."""

import math

import numpy as np
import pytest
import sympy as sp
from linear_algebra import Disturbed
from skeleton_shapes import counts, polytope

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, skeleton
from polycorner.formulas.functions import Family
from polycorner.models.spheres import SphereCluster
from polycorner.skeletons import Completeness

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
a, b, c, d = sp.symbols("a b c d", real=True)
turned = (a * (x - c) + b * (y - d)) * (-b * (x - c) + a * (y - d))
CROSSES = Family.of({"saddle": turned}, PLANE.names, ("a", "b", "c", "d"))
DISC = SmoothFunction("disc", 1 - x**2 - y**2, PLANE)


def quarters(angle, centre=(0.0, 0.0)):
    """Return two opposite quarters of a disc: one function crosses itself in the middle."""
    numbers = (math.cos(angle), math.sin(angle), *centre)
    return Polyhedron(
        PLANE,
        AllOf(SmoothFunction.member(CROSSES, "saddle", PLANE, parameters=numbers), DISC),
    )


def check_edges(atlas):
    """Check that every edge is a curve, not a point."""
    for edge in atlas.edges:
        assert len(edge.polyline) >= 2
        assert edge.length > 0


def check_quarters(atlas, centre):
    check_edges(atlas)
    assert counts(atlas) == (5, 6, 2)
    assert atlas.complete is Completeness.EXHAUSTED
    assert atlas.notes == ()
    assert atlas.euler_characteristic == 1
    (crossing,) = [corner for corner in atlas.corners if corner.active == ("saddle",)]
    np.testing.assert_allclose(crossing.point, centre, atol=1e-9)
    assert crossing.singular
    assert len(crossing.edges) == 4


class TestSelfCrossing:
    @pytest.mark.parametrize("angle", [0.0, math.pi / 4, 0.3, 1.0, math.pi / 2])
    @pytest.mark.parametrize("centre", [(0.0, 0.0), (0.1, -0.2), (1e-9, 0.0)])
    def test_the_crossing_is_a_corner_of_four_edges(self, angle, centre):
        """The rim meets the lines in four more corners."""
        out = 0.5 * np.array([math.cos(angle + 0.5), math.sin(angle + 0.5)])
        atlas = skeleton(quarters(angle, centre), [centre + out])
        check_quarters(atlas, centre)

    @pytest.mark.parametrize("away", [0.0, 1e-17, 1e-15, 1e-12, 1e-9])
    @pytest.mark.parametrize("direction", [(1, 0), (0, -1), (1, 1), (-3, -1)])
    def test_a_start_may_lie_at_the_crossing(self, away, direction):
        check_quarters(skeleton(quarters(0.0), [away * np.array(direction)]), (0, 0))

    @pytest.mark.parametrize("power", [2, 3])
    def test_a_function_without_gradient_all_along_its_zeros_is_no_edge(self, power):
        """``x^2 >= 0`` is no boundary; the plane ``x^3 >= 0`` has a boundary without slope."""
        D = Polyhedron(PLANE, {"flat": x**power, "disc": 1 - x**2 - y**2})
        check_edges(skeleton(D, [[0.5, 0.2]]))

    def test_the_apex_of_a_round_cone(self):
        D = Polyhedron(SPACE, {"cone": z**2 - x**2 - y**2, "lid": 1 - z, "up": z + 1})
        for start in ([0.0, 0.1, 0.5], [0, 0, 0], [1e-16, 0, 1e-17]):
            check_edges(skeleton(D, [start]))


class TestRounding:
    """The same skeleton is found, whatever the last bits, signs and null bases of LAPACK."""

    SHAPES = (
        pytest.param(
            polytope(np.vstack([np.eye(3), -np.eye(3)]), np.ones(6)), (8, 12, 6), id="cube"
        ),
        pytest.param(
            polytope([[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1], [0, 0, -1]], [1, 1, 1, 1, 0]),
            (5, 8, 5),
            id="pyramid",
        ),
        pytest.param(
            Polyhedron(PLANE, AllOf(x, y, 2 - x, 2 - y, AnyOf(1 - x, 1 - y))), (6, 6, 1), id="union"
        ),
        pytest.param(
            Polyhedron(SPACE, {"ball": 1 - x**2 - y**2 - z**2, "floor": z, "wall": x}),
            (2, 3, 3),
            id="quarter ball",
        ),
    )

    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize(("polyhedron", "expected"), SHAPES)
    def test_regular_and_degenerate_corners(self, polyhedron, expected, seed, monkeypatch):
        start = np.full(polyhedron.dimension, 0.2)
        Disturbed(seed).install(monkeypatch.setattr)
        atlas = skeleton(polyhedron, [start])
        assert counts(atlas) == expected
        assert atlas.complete is Completeness.EXHAUSTED

    @pytest.mark.parametrize("seed", range(8))
    def test_crossings(self, seed, monkeypatch):
        Disturbed(seed).install(monkeypatch.setattr)
        check_quarters(skeleton(quarters(0.0), [[0.5, 0.2]]), (0, 0))

    @pytest.mark.parametrize("seed", range(4))
    def test_orbits_whose_directions_depend_on_each_other(self, seed, monkeypatch):
        """Rigid motions of collinear spheres span five dimensions, not six."""
        model = SphereCluster(3)
        line = np.array([[-1.0, 0, 0], [0, 0, 0], [1, 0, 0]]).ravel()
        Disturbed(seed).install(monkeypatch.setattr)
        atlas = skeleton(model.polyhedron, [line, model.stacked()], symmetry=model.symmetry)
        assert len(atlas.corners) == 1
        check_edges(atlas)
