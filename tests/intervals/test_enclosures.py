"""Formulas in balls: values and derivatives against SymPy and mpmath, branches, exactness."""

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import sympy as sp
from enclosing import precise
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import smooth_expressions

from polycorner import Manifold, SmoothFunction
from polycorner.formulas.families import Family
from polycorner.intervals.balls import ball, between, bounds, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")

DIGITS = 50
M1, M2 = Manifold.euclidean("x"), Manifold.euclidean("x y")
x, y = M2.symbols
shares = st.lists(st.floats(0, 1), min_size=2, max_size=2)
points = st.lists(st.floats(-2, 2, allow_subnormal=False), min_size=2, max_size=2)


def formulas(*expressions, manifold=M2, **options):
    functions = [SmoothFunction(f"f{k}", e, manifold) for k, e in enumerate(expressions)]
    return Formulas(functions, manifold, **options)


def box(*sides):
    return Box([between(*side) for side in sides])


def inside(expression, at, enclosure):
    """Whether an expression's value at a rational point lies in a ball; to forty digits."""
    value = mpmath.mpf(sp.N(expression.subs({s: sp.Rational(v) for s, v in at.items()}), DIGITS))
    lower, upper = (precise(b) for b in bounds(enclosure))
    small = mpmath.mpf(10) ** -40 * (1 + abs(value))
    return lower - small <= value <= upper + small


def rational(number):
    return sp.Rational(Fraction(number).numerator, Fraction(number).denominator)


def exactly(expression):
    """Return an expression with its floating-point numbers as the fractions that they are."""
    return expression.xreplace({f: sp.Rational(f) for f in expression.atoms(sp.Float)})


# ------------------------------------------------------------------------------ values, derivatives


@given(smooth_expressions((x, y)), points, st.sampled_from([0.0, 1e-9, 1e-2]), shares)
def test_values_and_derivatives_land_in_their_enclosures(expression, middle, width, share):
    expression = expression + x * y
    f = formulas(expression)
    sides = [(Fraction(m) - Fraction(width), Fraction(m) + Fraction(width)) for m in middle]
    at = {
        s: rational(lo + Fraction(t) * (up - lo))
        for s, (lo, up), t in zip((x, y), sides, share, strict=True)
    }
    truth = exactly(expression)
    with precision(100), mpmath.workdps(DIGITS):
        forms = f.smooth(box(*sides), [0])
        assume(not isinstance(forms, Undecided))
        values, gradients, hessians = forms.evaluate(box(*sides), 2)
        assert inside(truth, at, values[0])
        for i, s in enumerate((x, y)):
            assert inside(truth.diff(s), at, gradients[0][i])
            for j, t in enumerate((x, y)):
                assert inside(truth.diff(s, t), at, hessians[0][i][j])


@given(
    smooth_expressions((x, y)),
    points,
    st.lists(st.floats(-1, 1), min_size=2, max_size=2),
    st.sampled_from([1e-6, 1e-2]),
    st.floats(-1, 1),
)
def test_in_a_moving_box_everything_lands_in_its_enclosure(expression, middle, way, reach, share):
    expression = expression - x * y
    f = formulas(expression)
    t = Fraction(share) * Fraction(reach)
    at = {
        s: rational(Fraction(m) + Fraction(w) * t)
        for s, m, w in zip((x, y), middle, way, strict=True)
    }
    truth = exactly(expression)
    with precision(100), mpmath.workdps(DIGITS):
        moving = Box.moving([ball(m) for m in middle], [[ball(w)] for w in way], [ball(0, reach)])
        forms = f.smooth(moving, [0])
        assume(not isinstance(forms, Undecided))
        values, gradients, hessians = forms.evaluate(moving, 2)
        turned, bent = forms.slopes(moving)
        assert inside(truth, at, values[0])
        assert inside(truth, at, f.values(moving, [0])[0])
        for i, s in enumerate((x, y)):
            assert inside(truth.diff(s), at, gradients[0][i])
            along = sum(truth.diff(s, u) * rational(w) for u, w in zip((x, y), way, strict=True))
            assert inside(along, at, turned[0][i][0])
            for j, u in enumerate((x, y)):
                assert inside(truth.diff(s, u), at, hessians[0][i][j])
                along = sum(
                    truth.diff(s, u, v) * rational(w) for v, w in zip((x, y), way, strict=True)
                )
                assert inside(along, at, bent[0][i][j][0])


def width(enclosure):
    lower, upper = bounds(enclosure)
    return float(upper - lower)


def test_what_moves_together_cancels():
    f = formulas(sp.sin(x - y))
    together = Box.moving([ball(1), ball(1)], [[ball(1)], [ball(1)]], [ball(0, 0.25)])
    (tight,), (loose,) = f.values(together, [0]), f.values(Box(together.hull), [0])
    assert width(tight) < 1e-6
    assert width(loose) > 0.1


def test_the_mean_value_form_errs_to_second_order():
    f = formulas(sp.exp(x) * (1 - y) + x**2 * y)
    excess = []
    for h in (0.1, 0.05, 0.025):
        moving = Box.moving([ball(0.3), ball(0.2)], [[ball(1)], [ball(-2)]], [ball(0, h)])
        (value,) = f.values(moving, [0])
        t = np.linspace(-h, h, 2001)
        xs, ys = 0.3 + t, 0.2 - 2 * t
        truth = np.exp(xs) * (1 - ys) + xs**2 * ys
        excess.append(width(value) - np.ptp(truth))
    ratios = [a / b for a, b in pairwise(excess)]
    assert all(3 < r < 5.5 for r in ratios)


def test_a_free_parameter_is_an_input_with_derivatives():
    a = sp.Symbol("a", real=True)
    f = Formulas([SmoothFunction("f", a * x**2 + y, M2, parameters={"a": 3.0})], M2, ["a"])
    assert (f.dimension, f.inputs) == (2, 3)
    forms = f.smooth(box((2, 2), (0, 0), (5, 5)), [0])
    values, gradients, hessians = forms.evaluate(box((2, 2), (0, 0), (5, 5)), 2)
    assert bounds(values[0]) == (20, 20)
    assert [bounds(g)[0] for g in gradients[0]] == [20, 1, 4]
    assert [[bounds(h)[0] for h in row] for row in hessians[0]] == [[10, 0, 4], [0, 0, 0]]


def test_functions_share_their_operations():
    f = formulas(sp.sin(x) + y, sp.sin(x) - y)
    assert sum(op == "sin" for op, _ in f.graph.nodes) == 1


# ------------------------------------------------------------------------------------- exactness


@pytest.mark.parametrize(
    ("expression", "truth"),
    [
        (x + sp.Rational(1, 3), lambda: mpmath.mpf(1) / 3),
        (x + sp.pi, lambda: +mpmath.pi),
        (x + sp.E, lambda: +mpmath.e),
        (x + sp.sqrt(2), lambda: mpmath.sqrt(2)),
        (x + sp.Rational(1, 7) ** sp.Rational(1, 3), lambda: mpmath.cbrt(mpmath.mpf(1) / 7)),
        (x + sp.Float("0.1", 60), lambda: mpmath.mpf(sp.Float("0.1", 60)._mpf_)),
        (x + sp.Float(0.1), lambda: precise(Fraction(0.1))),
    ],
)  # fmt: skip
def test_constants_are_exact(expression, truth):
    with precision(700), mpmath.workdps(200):
        (value,) = formulas(expression, manifold=M1).values(box((0, 0)), [0])
        lower, upper = (precise(b) for b in bounds(value))
        small = mpmath.mpf(10) ** -180
        assert lower - small <= truth() <= upper + small
        assert upper - lower < small


def test_a_parameter_is_the_dyadic_fraction_that_was_given():
    a = sp.Symbol("a", real=True)
    f = Formulas([SmoothFunction("f", x - a, M1, parameters={"a": 0.1})], M1)
    assert bounds(f.values(Box([ball(0.1)]), [0])[0]) == (0, 0)
    with precision(200):
        lower, upper = bounds(f.values(Box([ball(Fraction(1, 10))]), [0])[0])
    assert lower <= Fraction(1, 10) - Fraction(0.1) <= upper < 0


# ---------------------------------------------------------------------------------------- branches


def test_an_undecided_branch_gives_both_values_and_no_derivatives():
    f = formulas(sp.Piecewise((x, x < 1), (3 - x, True)), manifold=M1)
    lower, upper = bounds(f.values(box((0.5, 1.25)), [0])[0])
    assert lower <= 0.5
    assert upper >= 2
    undecided = f.smooth(box((0.5, 1.25)), [0])
    assert isinstance(undecided, Undecided)
    assert str(undecided) == "f0: the box does not decide which branch is taken"
    beside = box((1.01, 1.25))
    assert [bounds(g)[0] for g in f.smooth(beside, [0]).evaluate(beside, 1)[1][0]] == [-1]


def test_a_step_is_not_taken_for_a_constant():
    f = formulas(sp.Piecewise((1, x < 0), (2, True)) + y)
    assert isinstance(f.smooth(box((-1, 1), (0, 1)), [0]), Undecided)
    moving = Box.moving([ball(0), ball(0)], [[ball(1)], [ball(0)]], [ball(0, 1)])
    lower, upper = bounds(f.values(moving, [0])[0])
    assert lower <= 1
    assert upper >= 2


def test_branches_are_told_apart_by_what_they_take():
    yes, no = sp.sin(x), sp.cos(x)
    f = formulas(sp.Piecewise((yes, x < 0), (no, True)), sp.Piecewise((yes, x > 0), (no, True)))
    for side in ((-0.75, -0.5), (0.5, 0.75)):
        (first, second), *_ = f.smooth(box(side, (0, 0)), [0, 1]).evaluate(box(side, (0, 0)), 1)
        middle = sum(side) / 2
        sine, cosine = math.sin(middle), math.cos(middle)
        wanted = (sine, cosine) if middle < 0 else (cosine, sine)
        for value, truth in zip((first, second), wanted, strict=True):
            lower, upper = bounds(value)
            assert lower <= truth <= upper


def test_a_branch_not_taken_may_be_undefined():
    f = formulas(sp.Piecewise((sp.sqrt(x - 5), x > 6), (1 / (x - 9), x > 8), (x**2, True)))
    forms = f.smooth(box((-0.5, 0.5), (0, 0)), [0])
    assert not isinstance(forms, Undecided)
    assert bounds(f.values(box((2, 2), (0, 0)), [0])[0]) == (4, 4)


@pytest.mark.parametrize(
    ("expression", "sides", "reason"),
    [
        (sp.Abs(x), (-1, 1), "branch"),
        (sp.Max(x, y), (-1, 1), "branch"),
        (sp.sqrt(x + 1), (-1, 1), "square root"),
        (sp.log(x + 1), (-1, 1), "logarithm"),
        (sp.asin(x), (0, 1), "arcsine"),
        (sp.acos(x), (0, 1), "arccosine"),
        (sp.tan(x), (1, 2), "tangent"),
        (1 / x, (-1, 1), "denominator"),
        (x ** sp.Rational(7, 3), (0, 1), "base of a power"),
        (sp.atan2(x, y - 2), (-1, 1), "cut"),
        (sp.sqrt(x - 3), (-1, 1), "square root"),
        (sp.exp(sp.exp(sp.exp(100 * x))), (1, 2), "not bounded"),
    ],
)
def test_where_a_function_is_not_smooth_it_is_named_with_the_reason(expression, sides, reason):
    undecided = formulas(y, expression).smooth(box(sides, (0, 0.5)), [0, 1])
    assert isinstance(undecided, Undecided)
    assert undecided.name == "f1"
    assert reason in undecided.reason


def test_an_angle_has_no_mean_value_form_across_its_cut():
    f = formulas(sp.atan2(x, y))
    across = Box.moving([ball(0), ball(-1)], [[ball(1)], [ball(0)]], [ball(0, 0.5)])
    lower, upper = bounds(f.values(across, [0])[0])
    assert lower <= -3.1
    assert upper >= 3.1
    beside = Box.moving([ball(0), ball(1)], [[ball(1)], [ball(0)]], [ball(0, 0.5)])
    lower, upper = bounds(f.values(beside, [0])[0])
    assert lower <= -math.atan(0.5)
    assert math.atan(0.5) <= upper < 0.51


@given(st.floats(-3, 3), st.floats(1e-3, 1), st.floats(0, 1))
def test_logic_in_a_piecewise_decides_only_what_is_certain(middle, half, share):
    def step(v):
        return sp.Piecewise((1, sp.And(v > -1, sp.Or(v < 0, sp.Not(v < 1)))), (2, True))

    f = formulas(step(x), manifold=M1)
    lower, upper = bounds(f.values(Box([between(middle - half, middle + half)]), [0])[0])
    inside_point = sp.Rational(middle - half) + sp.Rational(share) * (
        sp.Rational(middle + half) - sp.Rational(middle - half)
    )
    assert lower <= int(step(inside_point)) <= upper


# ------------------------------------------------------------------------------------------ errors


def test_an_operation_without_enclosure_is_refused_by_name(monkeypatch):
    class Strange(Family):
        pass

    known = SmoothFunction("gap", sp.sin(x) + y, M2)
    program = known.family.program()
    graph = program.graph
    graph.nodes = [("gamma", args) if op == "sin" else (op, args) for op, args in graph.nodes]
    monkeypatch.setattr(
        "polycorner.intervals.enclosures.compile_expressions",
        lambda *_: replace(program, graph=graph),
    )
    with pytest.raises(ValueError, match="gap: the operation gamma has no enclosure"):
        Formulas([known], M2)


def test_parameters_that_leave_a_function_undefined_are_found():
    a = sp.Symbol("a", real=True)

    def undefined(expression, value):
        f = Formulas([SmoothFunction("gap", expression, M1, parameters={"a": 2.0})], M1, ["a"])
        return f.undefined([ball(value)])

    assert undefined(x + sp.sqrt(a), -1.0) == "gap"
    assert undefined(x / (a - 1), 1.0) == "gap"
    assert undefined(x + sp.sqrt(a), 1.0) == ""
    assert undefined(sp.sqrt(x + a), -5.0) == ""  # for another x it has a value
    assert undefined(sp.Piecewise((x, a < 0), (sp.sqrt(a) * x, True)), -1.0) == ""
