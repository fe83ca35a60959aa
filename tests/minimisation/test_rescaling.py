"""Badly scaled problems: a stalled descent goes on in scales estimated from the data."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, Verdict, minimise
from polycorner.formulas import Family
from polycorner.minimisation.methods import advice
from polycorner.minimisation.problem import pose

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
a, b = sp.symbols("a b")
FREE = Polyhedron(PLANE, {"wall": x + 10**9})
BOWL = Family.of({"bowl": (x / a - 1) ** 2 + (y / b - 1) ** 2}, ["x", "y"], ["a", "b"])
powers = st.integers(-2, 4)


@settings(max_examples=30)
@given(powers, powers)
def test_a_bowl_of_any_proportions_is_descended(i, j):
    """The minimum is at the scales themselves; its condition number is their ratio squared."""
    E = SmoothFunction.member(BOWL, "bowl", PLANE, parameters=[10.0**i, 10.0**j])
    found = minimise(FREE, E, [0.0, 0.0])
    assert found.point == pytest.approx([10.0**i, 10.0**j], rel=1e-6)


@settings(max_examples=30)
@given(st.integers(0, 12), st.integers(-9, 9), st.integers(-9, 9))
def test_a_bowl_of_any_condition_is_descended(order, p, q):
    E = SmoothFunction.member(BOWL, "bowl", PLANE, parameters=[1.0, 10.0 ** (-order / 2)])
    found = minimise(FREE, E, [float(p), float(q)])
    assert found.point == pytest.approx([1.0, 10.0 ** (-order / 2)], abs=1e-6)


@pytest.mark.parametrize("order", [2, 4, 6])
def test_a_bent_valley_is_descended(order):
    found = minimise(FREE, (1 - x) ** 2 + 10**order * (y - x**2) ** 2, [-1.2, 1.0])
    assert found.point == pytest.approx([1, 1], abs=1e-6)


def test_a_heat_exchanger_in_its_own_units_is_designed():
    """Problem 106 of Hock and Schittkowski: coordinates of a thousand, a minimum at a vertex."""
    M = Manifold.euclidean("x1 x2 x3 x4 x5 x6 x7 x8")
    x1, x2, x3, x4, x5, x6, x7, x8 = M.symbols
    parts = {
        "g1": 1 - (x4 + x6) / 400,
        "g2": 1 - (x5 + x7 - x4) / 400,
        "g3": 1 - (x8 - x5) / 100,
        "g4": x1 * x6 - sp.Rational("833.33252") * x4 - 100 * x1 + sp.Rational("83333.333"),
        "g5": x2 * x7 - 1250 * x5 - x2 * x4 + 1250 * x4,
        "g6": x3 * x8 - 1250000 - x3 * x5 + 2500 * x5,
    }
    low, high = [100, 1000, 1000] + [10] * 5, [10000] * 3 + [1000] * 5
    for z, least, most in zip(M.symbols, low, high, strict=True):
        parts |= {f"{z} low": z - least, f"{z} high": most - z}
    found = minimise(Polyhedron(M, parts), x1 + x2 + x3, [5000] * 3 + [200, 350, 150, 225, 425])
    assert found.verdict is Verdict.STRICT_MINIMUM
    assert found.energy == pytest.approx(7049.248020, rel=1e-8)


def test_a_small_limit_still_cuts_a_search_short():
    E = SmoothFunction.member(BOWL, "bowl", PLANE, parameters=[1.0, 10.0**6])
    found = minimise(FREE, E, [0.0, 0.0], max_iterations=3)
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.iterations == 3
    assert np.isfinite(found.energy)


@pytest.mark.parametrize("order", [8, 9])
def test_a_search_that_stopped_says_what_may_help(order):
    """The banks of a bent valley are steep in both coordinates: no scales of theirs help."""
    found = minimise(FREE, (1 - x) ** 2 + 10**order * (y - x**2) ** 2, [-1.2, 1.0])
    if found.verdict is Verdict.NOT_CONVERGED:
        assert "No other scales" in found.explain()
        assert "max_iterations" in found.explain()
    assert not found.is_minimum or found.point == pytest.approx([1, 1], abs=1e-3)


@given(powers, powers)
def test_scales_are_suggested_where_curvatures_differ(i, j):
    E = SmoothFunction.member(BOWL, "bowl", PLANE, parameters=[10.0**i, 10.0**j])
    text = advice(pose(FREE, E), np.array([1.0, 1.0]))
    if abs(i - j) < 3:
        assert "No other scales" in text
    else:
        low = min(i, j)
        assert f"scales=({10.0 ** (i - low):.2g}, {10.0 ** (j - low):.2g})" in text
