"""Boxes with exactly one KKT point, and definiteness, against exact rational answers."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from exact_algebra import inertia, null_space, restricted
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction
from polycorner.intervals.balls import ball, between, bounds, exact, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.proofs.definite import pivots, tangent_form
from polycorner.proofs.kkt import Cell, Enclosure, KKTSystem, enclose, newton, widened

M1, M2 = Manifold.euclidean("x"), Manifold.euclidean("x y")
x, y = M2.symbols
whole = st.integers(-4, 4)


def system(manifold, functions, energy, held, anchor, gauges=(), free=(), parameters=None):
    d = Polyhedron(
        manifold,
        [SmoothFunction(k, e, manifold, parameters=parameters) for k, e in functions.items()],
    )
    f = SmoothFunction("energy", energy, manifold, parameters=parameters)
    formulas = Formulas([*d.functions, f], manifold, free)
    units = (*manifold.scales, *[1.0] * (len(held) + len(gauges)))
    return KKTSystem(formulas, tuple(held), tuple(gauges), tuple(anchor), units)


def solved(s, start, bits=120, cell=None, p=()):
    z = newton(s, [ball(v) for v in start], p, bits=bits)
    if isinstance(z, Undecided):
        return z
    with precision(bits):
        return enclose(s, z, cell, bits=bits)


# ------------------------------------------------------------------------------------ definiteness


def symmetric(entries, n):
    rows = [[Fraction(0)] * n for _ in range(n)]
    values = iter(entries)
    for i in range(n):
        for j in range(i, n):
            rows[i][j] = rows[j][i] = Fraction(next(values))
    return rows


@given(st.integers(1, 4), st.lists(whole, min_size=10, max_size=10))
def test_pivots_say_what_the_exact_inertia_says(n, numbers):
    form = symmetric(numbers, n)
    positive, negative = inertia(form)
    found = pivots([[ball(v) for v in row] for row in form])
    if len(found) == n and all(p > 0 for p in found):
        assert positive == n
    if found[-1] < 0:
        assert negative > 0
    if positive == n:
        assert all(p > 0 for p in found)


@given(
    st.integers(1, 4),
    st.lists(whole, min_size=10, max_size=10),
    st.lists(st.lists(whole, min_size=4, max_size=4), max_size=3),
    st.lists(st.sampled_from([1e-3, 1.0, 50.0]), min_size=4, max_size=4),
)
def test_the_form_on_the_tangent_space_has_the_exact_inertia(n, numbers, normals, scales):
    form = symmetric(numbers, n)
    rows = [[Fraction(v) for v in row[:n]] for row in normals]
    basis = null_space(rows, n) if rows else null_space([[Fraction(0)] * n], n)
    if len(basis) != n - len(rows):
        return  # dependent normals: no enclosure would have been found
    positive, negative = inertia(restricted(form, basis)) if basis else (0, 0)
    with precision(200):
        found = tangent_form(
            [[ball(v) for v in row] for row in form],
            [[ball(v) for v in row] for row in rows],
            scales[:n],
        )
        signs = pivots(found)
        if positive == len(basis):
            assert len(signs) == len(basis)
            assert all(p > 0 for p in signs)
        elif negative:
            assert not all(p > 0 for p in signs)
        else:
            assert not signs[-1] > 0


def test_a_box_of_forms_is_positive_only_where_every_member_is():
    def verdict(half):
        form = [[between(2 - half, 2 + half), ball(1)], [ball(1), ball(2)]]
        found = pivots(form)
        return len(found) == 2 and all(p > 0 for p in found)

    assert verdict(1.25)
    assert not verdict(1.6)


# ------------------------------------------------------------------------------------ one solution


@given(st.integers(1, 8), st.sampled_from([1, -1]))
def test_the_widest_box_holds_one_of_two_solutions(a, side):
    root = Fraction(a, 8)
    s = system(M1, {"far": x + 100}, x**3 / 3 - sp.Rational(a, 8) ** 2 * x, (), (0.0,))
    found = solved(s, [float(side * root) + 1e-5])
    assert isinstance(found, Enclosure)
    with precision(120):
        lower, upper = bounds(found.solution[0])
    assert lower <= side * root <= upper
    assert upper - lower < Fraction(1, 10**25)
    with precision(64):
        (candidate,) = widened(found)
    centre, reach = exact(found.predictor.centre[0].mid()), exact(candidate.rad())
    assert centre - reach <= side * root <= centre + reach
    assert not centre - reach <= -side * root <= centre + reach
    assert reach >= root / 100


@pytest.mark.parametrize("power", [20, 40, 60])
def test_a_double_root_is_never_enclosed_as_one(power):
    gap = sp.Rational(1, 2**power)
    exactly = system(M1, {"far": x + 100}, x**3 / 3, (), (0.0,))
    assert isinstance(solved(exactly, [1e-9]), Undecided)
    beside = system(M1, {"far": x + 100}, x**3 / 3 - gap**2 * x, (), (0.0,))
    found = solved(beside, [float(gap)], bits=400)
    assert isinstance(found, Enclosure)
    with precision(400):
        lower, upper = bounds(found.solution[0])
    assert lower <= Fraction(1, 2**power) <= upper
    assert lower > -Fraction(1, 2**power)


def test_no_solution_is_found_where_there_is_none():
    s = system(M1, {"far": x + 100}, sp.exp(x), (), (0.0,))
    assert isinstance(solved(s, [0.0]), Undecided)


@given(st.lists(whole, min_size=6, max_size=6))
def test_a_linear_system_is_enclosed_about_its_exact_solution(numbers):
    h = [[Fraction(9), Fraction(numbers[0])], [Fraction(numbers[0]), Fraction(9)]]
    g, a, b = numbers[1:3], [Fraction(numbers[3]), Fraction(5)], Fraction(numbers[4])
    energy = (9 * x**2 + 9 * y**2 + 2 * numbers[0] * x * y) / 2 + g[0] * x + g[1] * y
    s = system(M2, {"f": numbers[3] * x + 5 * y - numbers[4]}, energy, (0,), (0.0, 0.0))
    found = solved(s, [0.1, 0.1, 0.0])
    assert isinstance(found, Enclosure)
    exact_one = sp.Matrix([[*h[0], -a[0]], [*h[1], -a[1]], [a[0], a[1], 0]]).LUsolve(
        sp.Matrix([-g[0], -g[1], b])
    )
    for value, truth in zip(found.solution, exact_one, strict=True):
        lower, upper = bounds(value)
        assert lower <= Fraction(int(truth.p), int(truth.q)) <= upper


def test_a_gauge_makes_a_locus_a_point_and_has_no_multiplier():
    energy = (x - y) ** 2 + x - y
    free = system(M2, {"far": x - y + 9}, energy, (), (1.0, 0.0))
    assert isinstance(solved(free, [1.0, 0.0]), Undecided)
    held = system(M2, {"far": x - y + 9}, energy, (), (1.0, 0.0), gauges=((1.0, 1.0),))
    found = solved(held, [1.0, 0.0, 0.0])
    assert [float(v) for v in found.solution] == pytest.approx([0.25, 0.75, 0.0], abs=1e-20)


# --------------------------------------------------------------------------------------- parameters


def test_for_every_parameter_of_a_cell_the_solution_is_enclosed():
    a, b = sp.symbols("a b", real=True)
    # E = cosh x - a x + (y - b x)^2: the minimum is x = asinh a, y = b x.
    energy = sp.cosh(x) - a * x + (y - b * x) ** 2
    s = system(
        M2, {"far": x + 50 + a + b}, energy, (), (0.0, 0.0), free=("a", "b"),
        parameters={"a": 1.0, "b": 0.5},
    )  # fmt: skip
    p0, half = (1.0, 0.5), (0.0625, 0.125)
    middle, reach = [ball(v) for v in p0], [ball(0, h) for h in half]
    found = solved(s, [0.9, 0.4], bits=64, cell=Cell(middle, reach), p=middle)
    assert isinstance(found, Enclosure)
    whole_box = [tuple(float(v) for v in bounds(z)) for z in found.solution]
    grid = np.linspace(-1, 1, 9)
    for u, v in ((u, v) for u in grid for v in grid):
        p = [p0[0] + u * half[0], p0[1] + v * half[1]]
        truth = [np.arcsinh(p[0]), p[1] * np.arcsinh(p[0])]
        for (lower, upper), t in zip(whole_box, truth, strict=True):
            assert lower <= t <= upper
        # The remainder beside the predictor is small of second order, and encloses it, too.
        part = [ball(u * half[0]), ball(v * half[1])]
        near = found.predictor.part(part)
        for z, t in zip(near.unknowns(found.remainder), truth, strict=True):
            lower, upper = (float(e) for e in bounds(z))
            assert lower - 1e-15 <= t <= upper + 1e-15
            assert upper - lower < 0.15
    true_span = np.arcsinh(p0[0] + half[0]) - np.arcsinh(p0[0] - half[0])
    assert whole_box[0][1] - whole_box[0][0] < 2 * true_span


def test_remainders_shrink_to_second_order():
    a = sp.Symbol("a", real=True)
    s = system(
        M1, {"far": x + 50 + a}, sp.cosh(x) - a * x, (), (0.0,), free=("a",), parameters={"a": 1.0}
    )
    widths = []
    for h in (0.2, 0.1, 0.05):
        found = solved(s, [0.88], bits=64, cell=Cell([ball(1)], [ball(0, h)]), p=[ball(1)])
        lower, upper = bounds(found.remainder[0])
        widths.append(float(upper - lower))
    ratios = [u / v for u, v in pairwise(widths)]
    assert all(3 < r < 6 for r in ratios)


def test_a_cell_that_reaches_a_fold_is_not_enclosed():
    a = sp.Symbol("a", real=True)
    # x^3/3 - a x has its minimum at sqrt a, which ends at a = 0.
    s = system(
        M1, {"far": x + 50}, x**3 / 3 - a * x, (), (0.0,), free=("a",), parameters={"a": 1.0}
    )

    def cell(half):
        return solved(s, [1.0], bits=64, cell=Cell([ball(1)], [ball(0, half)]), p=[ball(1)])

    assert isinstance(cell(0.3), Enclosure)
    assert isinstance(cell(1.0), Undecided)
