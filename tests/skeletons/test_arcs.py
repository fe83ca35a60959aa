"""Lengths of edges against quadrature of curves that are written with a parameter."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from oracles_skeletons import arc_length
from skeleton_shapes import counts

from polycorner import Manifold, Polyhedron, Symmetry, skeleton

PLANE = Manifold.euclidean("x y")
SPACE = Manifold.euclidean("x y z")
x, y = PLANE.symbols
EXACT = 1e-9
t = sp.Symbol("t", real=True)


def edges_on(atlas, name):
    return [edge for edge in atlas.edges if name in edge.active]


@given(st.floats(0.2, 5), st.floats(0.2, 5), st.floats(0, 6.3), st.integers(0, 99))
def test_an_ellipse_of_any_axes_and_direction(a, b, angle, seed):
    c, s = math.cos(angle), math.sin(angle)
    u, v = c * x + s * y, c * y - s * x
    atlas = skeleton(
        Polyhedron(PLANE, {"rim": 1 - (u / a) ** 2 - (v / b) ** 2}), [[0, 0]], rng=seed
    )
    assert counts(atlas) == (0, 1, 1)
    exact = arc_length(lambda t: (a * sp.cos(t), b * sp.sin(t)), 0, math.tau)
    assert atlas.edges[0].length == pytest.approx(exact, rel=EXACT)


GRAPHS = {
    "parabola": t**2,
    "cubic": t**3 - t,
    "wave": sp.sin(5 * t) / 3,
    "bump": 1 / (1 + 25 * t**2),
    "steep": sp.exp(3 * t) / 10,
}


@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_over_a_segment(name):
    height = GRAPHS[name]
    sides = {"left": x + 1, "right": 1 - x, "lid": 3 - y}
    atlas = skeleton(Polyhedron(PLANE, {"graph": y - height.subs(t, x), **sides}), [[0, 2.5]])
    (graph,) = edges_on(atlas, "graph")
    assert graph.length == pytest.approx(
        arc_length(lambda t: (t, height.subs("t", t)), -1, 1), rel=EXACT
    )


def test_scales_are_units_of_length():
    M = Manifold(("x", "y"), scales=(2.0, 0.5))
    atlas = skeleton(Polyhedron(M, {"rim": 1 - x**2 - y**2}), [[0, 0]])
    exact = arc_length(lambda t: (sp.cos(t) / 2, 2 * sp.sin(t)), 0, math.tau)
    assert atlas.edges[0].length == pytest.approx(exact, rel=EXACT)


def test_curves_of_two_functions_that_end_where_they_cross():
    """Viviani's curve: half of one of its loops, between the crossing and the far point."""
    x, y, z = SPACE.symbols
    D = Polyhedron(SPACE, {"ball": 4 - x**2 - y**2 - z**2, "tube": 1 - (x - 1) ** 2 - y**2})
    atlas = skeleton(D, [[1, 0.1, 0.2]])
    window = [edge for edge in atlas.edges if set(edge.active) == {"ball", "tube"}]
    exact = arc_length(lambda t: (1 + sp.cos(t), sp.sin(t), 2 * sp.sin(t / 2)), -math.pi, math.pi)
    assert sum(edge.length for edge in window) == pytest.approx(2 * exact, rel=EXACT)


def test_edges_between_crossings_of_one_function():
    """Both loops of the lemniscate."""
    atlas = skeleton(Polyhedron(PLANE, {"rim": x**2 - y**2 - (x**2 + y**2) ** 2}), [[0.5, 0]])
    exact = arc_length(
        lambda t: (sp.cos(t) / (1 + sp.sin(t) ** 2), sp.sin(2 * t) / 2 / (1 + sp.sin(t) ** 2)),
        -math.pi / 2,
        math.pi / 2,
    )
    assert [edge.length for edge in atlas.edges] == pytest.approx([exact, exact], rel=EXACT)


def test_an_edge_that_ends_in_a_cusp_is_known_as_exactly_as_the_cusp():
    """``x^3`` is below any rounding within 1e-7 of the cusp."""
    atlas = skeleton(Polyhedron(PLANE, {"cusp": x**3 - y**2, "lid": 1 - x}), [[0.5, 0]])
    exact = arc_length(lambda t: (t**2, t**3), 0, 1)
    for edge in edges_on(atlas, "cusp"):
        assert edge.length == pytest.approx(exact, abs=3e-7)


@given(st.floats(0.3, 3), st.floats(0.3, 3), st.integers(0, 99))
def test_relative_angles_of_two_turning_points(r, s, seed):
    """Circles of radii ``r`` and ``s``, turned together.

    Across the orbits the first turns by ``- s^2 / (r^2 + s^2)`` of their angle, the second by the
    rest: a length of ``r s / sqrt(r^2 + s^2)`` times the angle.
    """
    M = Manifold.euclidean("a b c d")
    a, b, c, d = M.symbols
    D = Polyhedron(M, {}, equations={"one": a**2 + b**2 - r**2, "two": c**2 + d**2 - s**2})
    turning = Symmetry(
        tangents=lambda q: np.array([[-q[1], q[0], -q[3], q[2]]]),
        invariants=lambda q: np.array([q[0] * q[2] + q[1] * q[3], q[0] * q[3] - q[1] * q[2]]),
    )
    atlas = skeleton(D, [[r, 0, 0, s]], symmetry=turning, rng=seed)
    assert counts(atlas)[:2] == (0, 1)
    exact = math.tau * r * s / math.hypot(r, s)
    assert atlas.edges[0].length == pytest.approx(exact, rel=EXACT)
