"""The table of elementary functions: every entry is complete, and all that follows from it agrees.

A function that is added to the table is tested here without another line.
"""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold
from polycorner.files.formulas import formula_text, read_formula
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import Graph
from polycorner.intervals.balls import ANALYTIC, PARTIALS, ball, bounds, operations, precision
from polycorner.intervals.boxes import BoxFunctions
from polycorner.minimisation.jets import function_series, ring
from polycorner.proofs.checker import operations as checker

M = Manifold.euclidean("x")
x = M.symbols[0]
EACH = pytest.mark.parametrize("op", OPERATIONS)


def inside(op, count=20):
    """Return points at which a function is analytic, away from where it begins or ends."""
    low, high = OPERATIONS[op].limits
    points = np.random.default_rng(3).uniform(max(low, -1.4), min(high, 1.4), count)
    return points[(points - low > 0.05) & (high - points > 0.05)]


def function(op):
    return SmoothFunction(op, getattr(sp, op)(x), M)


@EACH
def test_a_function_has_one_name_everywhere(op):
    for module in (math, sp, mpmath):
        assert hasattr(module, op)
    assert {op} <= set(operations()) & set(PARTIALS) & set(checker.VALUES) & set(checker.SLOPES)
    written = getattr(sp, op)(x)
    assert read_formula(formula_text(written), {"x": x}) == written
    assert (op in ANALYTIC) == (OPERATIONS[op].analytic is not None)


@EACH
def test_compiled_values_and_derivatives_are_those_of_mpmath(op):
    q = inside(op)
    f, exact = function(op), getattr(mpmath, op)
    rows = q[:, None], f.value(q[:, None]), f.gradient(q[:, None]), f.hessian(q[:, None])
    for point, *found in zip(*rows, strict=True):
        with mpmath.workdps(50):
            true = [mpmath.diff(exact, float(point[0]), k) for k in range(3)]
        numbers = np.concatenate([*map(np.ravel, found)])
        assert np.allclose(numbers, np.array(true, dtype=float), rtol=1e-12, atol=1e-14)


@EACH
def test_balls_and_bounds_enclose_values_and_slopes(op):
    q = inside(op)
    lo, hi = q[:, None] - 1e-3, q[:, None] + 1e-3
    low, high, falling, rising = (
        a.ravel() for a in BoxFunctions([function(op)], M).gradients(lo, hi)
    )
    with precision(120):
        for k, point in enumerate(q):
            b = ball(Fraction(float(point)))
            value = operations()[op](b)
            slope = ball(0) + PARTIALS[op][0]([b], value)
            step = ball(Fraction(1, 2**40))
            quotient = (operations()[op](b + step) - operations()[op](b - step)) / (2 * step)
            assert abs(quotient - slope) < ball(Fraction(1, 10**9)) * (1 + abs(slope))
            for found, below, above in ((value, low, high), (slope, falling, rising)):
                assert (
                    Fraction(below[k]) <= bounds(found)[0] <= bounds(found)[1] <= Fraction(above[k])
                )


@EACH
def test_power_series_are_those_of_the_derivatives(op):
    domain, f = ring(1, 5), function(op)
    for point in inside(op, 5):
        with mpmath.workdps(40):
            true = mpmath.taylor(getattr(mpmath, op), mpmath.mpf(float(point)), 5)
        series = [domain.constant(point) + domain.variable(0)]
        (found,) = function_series([f], series, domain, slopes=False)[0]
        assert np.allclose(found[0], np.array(true, dtype=float), rtol=1e-12, atol=1e-13)


@EACH
def test_what_the_table_says_of_values_is_true(op):
    known = OPERATIONS[op]
    q = np.linspace(max(known.limits[0], -50.0), min(known.limits[1], 50.0), 401)
    values = np.array([float(operations()[op](ball(float(t)))) for t in q])
    least, greatest = known.values
    assert least is None or (values >= least).all()
    assert greatest is None or (values <= greatest).all()
    assert math.log2(abs(values).max()) <= known.size
    assert not known.keeps_signs or (values * q >= 0).all()
    steps = np.diff(values)
    assert {
        "increasing": (steps >= 0).all(),
        "decreasing": (steps <= 0).all(),
        "even": np.allclose(values, values[::-1]) and (steps[200:] >= 0).all(),
        "periodic": known.turns > 0,
    }[known.shape]
    for argument, value in known.known.items():
        assert operations()[op](ball(argument)) == value
        graph = Graph()
        node = graph.unary(op, graph.const(argument))
        assert (node == graph.const(argument)) == (argument == value)
    for k, derivative in enumerate(known.cycle):
        assert math.isclose(derivative(0.7), float(mpmath.diff(getattr(mpmath, op), 0.7, k)))
