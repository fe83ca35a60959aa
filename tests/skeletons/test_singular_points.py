"""Curves that cross, cusps and apexes, against what is known of famous curves and solids."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from kept_files import same_atlas
from skeleton_shapes import check_incidence, counts, whole

from polycorner import Manifold, Polyhedron, SmoothFunction, skeleton
from polycorner.files import load_skeleton, save_skeleton
from polycorner.formulas.families import Family
from polycorner.skeletons import Completeness, End, resume

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
few = settings(max_examples=2, phases=[Phase.generate])

c, s, size, x0, y0 = numbers = sp.symbols("c s size x0 y0", real=True)
u, v = (c * (x - x0) + s * (y - y0)) / size, (c * (y - y0) - s * (x - x0)) / size
r2 = u**2 + v**2

# Name: function, counts of corners, edges and faces, singular corners, a point inside.
CURVES = {
    "lemniscate": (u**2 - v**2 - r2**2, (1, 2, 2), [(0, 0)], (0.5, 0.1)),
    "figure eight": (4 * u**2 * (1 - u**2) - v**2, (1, 2, 2), [(0, 0)], (0.5, 0.1)),
    "trefoil": (u**3 - 3 * u * v**2 - r2**2, (1, 3, 3), [(0, 0)], (0.5, 0.1)),
    "rose of four petals": (4 * u**2 * v**2 - r2**3, (1, 4, 4), [(0, 0)], (0.5, 0.5)),
    "two circles": (
        -((u - 1) ** 2 + v**2 - 2) * ((u + 1) ** 2 + v**2 - 2),
        (2, 4, 2),
        [(0, 1), (0, -1)],
        (1.5, 0.1),
    ),
    "teardrop": (u**3 * (1 - u) - v**2, (1, 1, 1), [(0, 0)], (0.5, 0.1)),
    "cardioid": (r2 - (r2 - u) ** 2, (1, 1, 1), [(0, 0)], (1.0, 0.3)),
    "astroid": (
        -((r2 - 1) ** 3) - 27 * u**2 * v**2,
        (4, 4, 1),
        [(1, 0), (-1, 0), (0, 1), (0, -1)],
        (0.1, 0.2),
    ),
}
FAMILY = Family.of(
    {name: curve[0] for name, curve in CURVES.items()}, PLANE.names, tuple(map(str, numbers))
)


def found(D, starts, **options):
    """Return the whole skeleton."""
    atlas = skeleton(D, starts, **options)
    assert atlas.complete is Completeness.EXHAUSTED
    assert atlas.notes == ()
    return atlas


class TestPlane:
    @pytest.mark.parametrize("name", CURVES)
    @given(st.floats(0, math.tau), st.floats(0.5, 3), st.integers(0, 99))
    @few
    def test_wherever_the_curve_lies(self, name, angle, length, seed):
        _, expected, singular, inner = CURVES[name]
        centre = np.array([0.3, -0.7])
        turn = length * np.array(
            [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        )
        values = (math.cos(angle), math.sin(angle), length, *centre)
        D = Polyhedron(PLANE, SmoothFunction.member(FAMILY, name, PLANE, parameters=values))
        atlas = found(D, [centre + turn @ inner], rng=seed)
        assert counts(atlas) == expected
        assert atlas.euler_characteristic == expected[0] - expected[1] + expected[2]
        check_incidence(atlas)
        exact = [centre + turn @ p for p in singular]
        for corner in atlas.corners:
            assert min(np.linalg.norm(corner.point - p) for p in exact) < 1e-6 * length
            assert corner.singular
            assert corner.active == (name,)
            assert len(corner.edges) == 2 * expected[1] / expected[0]

    @given(st.integers(1, 3), st.integers(1, 3), st.integers(0, 99))
    @few
    def test_a_critical_level_on_the_torus(self, a, b, seed):
        """Every cell of the chequerboard meets four others in its corners."""
        T = Manifold(("p", "q"), periods=(math.tau, math.tau))
        p, q = T.symbols
        atlas = found(Polyhedron(T, {"f": sp.cos(a * p) + sp.cos(b * q)}), [[0.1, 0.2]], rng=seed)
        assert whole(atlas) == ((2 * a * b, 4 * a * b, a * b), -a * b)

    @pytest.mark.parametrize("seed", range(3))
    def test_branches_that_touch(self, seed):
        D = Polyhedron(PLANE, {"f": y**2 - x**4 - y**4})
        atlas = found(D, [[0.1, 0.5]], rng=seed)
        assert whole(atlas) == ((1, 2, 2), 1)
        check_incidence(atlas)

    @given(st.floats(0, math.tau), st.floats(0.3, 1), st.integers(0, 99))
    @few
    def test_regions_that_touch_along_a_line(self, angle, width, seed):
        """``|v| <= w u^2``: both halves touch in the origin, thinner than any sector."""
        a, b = math.cos(angle), math.sin(angle)
        p, q = a * x + b * y, a * y - b * x
        D = Polyhedron(PLANE, {"f": width**2 * p**4 - q**2, "lid": 1 - p, "wall": 1 + p})
        inner = [[side * a / 2, side * b / 2] for side in (1, -1)]
        atlas = found(D, inner, rng=seed)
        assert (counts(atlas), atlas.euler_characteristic) == ((5, 6, 2), 1)
        check_incidence(atlas)

    @pytest.mark.parametrize("power", [sp.Rational(1, 2), sp.Rational(3, 2), sp.Rational(5, 2)])
    @given(st.floats(0, math.tau), st.floats(0.5, 2), st.integers(0, 99))
    @few
    def test_tips_at_the_end_of_roots(self, power, angle, width, seed):
        """``|v| <= w u^p`` as two functions, neither of which has values for ``u < 0``."""
        a, b = math.cos(angle), math.sin(angle)
        p, q = a * x + b * y, a * y - b * x
        root = width * p**power
        D = Polyhedron(PLANE, {"above": root - q, "below": root + q, "lid": 1 - p})
        atlas = found(D, [[0.5 * a, 0.5 * b]], rng=seed)
        assert counts(atlas) == (3, 3, 1)
        assert atlas.euler_characteristic in (1, None)  # a cusp may be too thin for a net
        (tip,) = [c for c in atlas.corners if c.active == ("above", "below")]
        assert np.linalg.norm(tip.point) < 1e-5
        assert all(edge.kinds == (End.CORNER, End.CORNER) for edge in atlas.edges)

    def test_curves_that_nearly_cross_do_not(self):
        """Between the lemniscate and one loop around both foci, or two."""
        for level, edges in ((1e-6, 1), (-1e-6, 2)):
            f = x**2 - y**2 - (x**2 + y**2) ** 2 + level
            atlas = found(Polyhedron(PLANE, {"f": f}), [[0.5, 0.1], [-0.5, 0.1]])
            assert counts(atlas) == (0, edges, edges)


def rotated(angles):
    """Return the coordinates turned about two axes."""
    a, b = angles
    turn = sp.Matrix(
        np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
        @ np.array([[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]])
    )
    return turn * sp.Matrix([x, y, z])


@pytest.mark.parametrize(
    ("D", "start"),
    [
        (Polyhedron(PLANE, {"f": x**3 * (1 - x) - y**2}), [0.5, 0.1]),
        (Polyhedron(SPACE, {"cone": z**2 - x**2 - y**2, "up": z, "lid": 1 - z}), [0.1, 0.2, 0.5]),
    ],
    ids=["cusp", "apex"],
)
def test_singular_corners_survive_files_and_interruptions(D, start, tmp_path):
    atlas = found(D, [start])
    same_atlas(load_skeleton(save_skeleton(atlas, tmp_path / "whole.json")), atlas)
    parts = skeleton(D, [start], budget=1)
    for _ in range(9):
        parts = resume(load_skeleton(save_skeleton(parts, tmp_path / "part.json")), budget=1)
    assert counts(parts) == counts(atlas)
    assert parts.complete is Completeness.EXHAUSTED


class TestSpace:
    @pytest.mark.parametrize("angles", [(0.0, 0.0), (0.4, 1.1)])
    def test_two_equal_cylinders_at_right_angles(self, angles):
        a, b, c = rotated(angles)
        D = Polyhedron(SPACE, {"one": 1 - a**2 - c**2, "two": 1 - b**2 - c**2})
        atlas = found(D, [[0.1, 0.2, 0.1]])
        assert whole(atlas) == ((2, 4, 4), 2)
        assert all(corner.singular and len(corner.edges) == 4 for corner in atlas.corners)
        check_incidence(atlas)

    def test_three_equal_cylinders_at_right_angles(self):
        D = Polyhedron(SPACE, {"a": 1 - x**2 - y**2, "b": 1 - y**2 - z**2, "c": 1 - x**2 - z**2})
        atlas = found(D, [[0.1, 0.2, 0.15]])
        assert whole(atlas) == ((14, 24, 12), 2)
        assert sorted(len(corner.edges) for corner in atlas.corners) == [3] * 8 + [4] * 6

    def test_the_window_of_viviani(self):
        sphere, pipe = 4 - x**2 - y**2 - z**2, 1 - (x - 1) ** 2 - y**2
        curve = found(Polyhedron(SPACE, {"all": z + 5}, [sphere, pipe]), [[0, 0, 2]])
        assert counts(curve) == (1, 2, 0)
        window = found(Polyhedron(SPACE, {"pipe": pipe}, [sphere]), [[0.6, 0, math.sqrt(3.64)]])
        assert counts(window) == (1, 2, 2)
        solid = found(Polyhedron(SPACE, {"ball": sphere, "pipe": pipe}), [[0.9, 0.1, 0.2]])
        assert whole(solid) == ((1, 2, 3), 2)
        np.testing.assert_allclose(solid.corners[0].point, [2, 0, 0], atol=1e-8)

    @pytest.mark.parametrize("tilt", [0, sp.Rational(1, 3)])
    @pytest.mark.parametrize("wide", [1, sp.Rational(1, 2)])
    def test_the_apex_of_a_cone(self, tilt, wide):
        cone = z**2 - (x - tilt * z) ** 2 - (y / wide) ** 2
        D = Polyhedron(SPACE, {"cone": cone, "up": z, "lid": 1 - z})
        atlas = found(D, [[float(tilt) / 2 + 0.1, 0.1, 0.5]])
        assert whole(atlas) == ((1, 1, 2), 2)
        np.testing.assert_allclose(atlas.corners[0].point, 0, atol=1e-8)
        around = {face.active: sorted(face.boundary) for face in atlas.faces}
        assert around == {("cone",): [(), (0,)], ("lid",): [(0,)]}

    def test_both_halves_of_a_cone_from_a_start_in_one(self):
        D = Polyhedron(SPACE, {"cone": z**2 - x**2 - y**2, "up": 1 + z, "lid": 1 - z})
        atlas = found(D, [[0.1, 0.2, 0.6]])
        assert whole(atlas) == ((1, 2, 4), 3)
