"""Balls contain what they should: every operation against mpmath at sixty digits."""

import math
from fractions import Fraction

import mpmath
import pytest
from enclosing import precise
from hypothesis import assume, given
from hypothesis import strategies as st

from polycorner.formulas.operations import OPERATIONS
from polycorner.intervals.balls import (
    ANALYTIC,
    PARTIALS,
    ball,
    between,
    bounds,
    constant,
    decimals,
    exact,
    matrix,
    middle_inverse,
    narrower,
    operations,
    precision,
    square,
)

DIGITS = 60
ONE = {
    "neg": lambda x: -x,
    **{op: getattr(mpmath, op) for op in OPERATIONS},
    "square": lambda x: x * x,
}
TWO = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
    "pow": lambda x, y: x**y,
    "atan2": mpmath.atan2,
}
numbers = st.floats(-5, 5, allow_subnormal=False)
shares = st.floats(0, 1)
widths = st.sampled_from([0.0, 1e-12, 1e-3, 0.5])


def within(value, b):
    lower, upper = bounds(b)
    return precise(lower) <= value <= precise(upper)


def sides(middle, width, share):
    """Return a ball, and a number inside it."""
    lower, upper = Fraction(middle) - Fraction(width), Fraction(middle) + Fraction(width)
    return between(lower, upper), lower + Fraction(share) * (upper - lower)


def test_every_operation_of_programs_is_known_and_has_an_oracle():
    logic = {"lt", "le", "not", "and", "or", "select"}
    assert set(operations()) - logic == set(ONE) | set(TWO)
    assert set(PARTIALS) == set(ONE) | set(TWO)
    assert set(ANALYTIC) <= set(PARTIALS)


@pytest.mark.parametrize("op", ONE)
@given(middle=numbers, width=widths, share=shares, bits=st.sampled_from([24, 53, 150]))
def test_one_argument_lands_in_the_result(op, middle, width, share, bits):
    with mpmath.workdps(DIGITS), precision(bits):
        x, inside = sides(middle, width, share)
        result = operations()[op](x)
        assume(result.is_finite())
        assert within(ONE[op](precise(inside)), result)


@pytest.mark.parametrize("op", TWO)
@given(first=numbers, second=numbers, width=widths, one=shares, other=shares)
def test_two_arguments_land_in_the_result(op, first, second, width, one, other):
    with mpmath.workdps(DIGITS), precision(53):
        x, a = sides(first, width, one)
        y, b = sides(second, width, other)
        result = operations()[op](x, y)
        assume(result.is_finite())
        value = TWO[op](precise(a), precise(b))
        assume(mpmath.isfinite(value))
        assert within(value, result)


@pytest.mark.parametrize("op", PARTIALS)
@given(middles=st.lists(numbers, min_size=2, max_size=2), width=widths, share=shares)
def test_partial_derivatives_land_in_their_enclosures(op, middles, width, share):
    function = (ONE | TWO)[op]
    with mpmath.workdps(DIGITS), precision(80):
        pairs = [sides(m, width, share) for m in middles[: len(PARTIALS[op])]]
        given_balls, point = [x for x, _ in pairs], [precise(a) for _, a in pairs]
        assume(op not in ANALYTIC or ANALYTIC[op][1](*given_balls))
        # A difference quotient is no oracle for an argument that is smaller than its step.
        assume(not any(0 < abs(a) < mpmath.mpf(10) ** -20 for a in point))
        value = operations()[op](*given_balls)
        for k, partial in enumerate(PARTIALS[op]):
            slope = ball(0) + partial(given_balls, value)
            if not slope.is_finite():
                continue  # a power of a negative number has no derivative by its exponent
            truth = mpmath.diff(
                function, tuple(point), tuple(int(i == k) for i in range(len(point)))
            )
            lower, upper = (precise(x) for x in bounds(slope))
            small = mpmath.mpf(10) ** -20 * (1 + abs(truth))
            assert lower - small <= truth <= upper + small


@pytest.mark.parametrize(
    ("op", "at", "fine"),
    [
        ("sqrt", [(0, 1)], False),
        ("sqrt", [(0.25, 1)], True),
        ("log", [(0, 1)], False),
        ("asin", [(0.5, 1)], False),
        ("acos", [(-1, 0)], False),
        ("acos", [(-0.5, 0.5)], True),
        ("tan", [(1.5, 1.6)], False),
        ("tan", [(-1, 1)], True),
        ("tan", [(1, 8)], False),
        ("div", [(1, 1), (-1, 1)], False),
        ("div", [(1, 1), (-1, -0.5)], True),
        ("pow", [(-1, 1), (2, 2)], True),
        ("pow", [(-1, 1), (-2, -2)], False),
        ("pow", [(-1, 1), (2.5, 2.5)], False),
        ("pow", [(-2, -1), (-3, -3)], True),
        ("pow", [(-2, -1), (1.9, 2.1)], False),
        ("atan2", [(-1, 1), (-2, -1)], False),
        ("atan2", [(-1, 1), (1, 2)], True),
        ("atan2", [(1, 2), (-1, 1)], True),
        ("atan2", [(0, 1), (-1, 1)], False),
    ],
)
def test_where_operations_are_analytic(op, at, fine):
    assert ANALYTIC[op][1](*[between(*side) for side in at]) is fine


def test_logic_has_three_values():
    less, at_most, no = (operations()[op] for op in ("lt", "le", "not"))
    both, either, select = (operations()[op] for op in ("and", "or", "select"))
    one, two, wide = ball(1), ball(2), between(0, 3)
    assert (less(one, two), less(two, one), less(one, one), less(one, wide)) == (
        True, False, False, None
    )  # fmt: skip
    assert (at_most(one, one), at_most(two, one), at_most(wide, one)) == (True, False, None)
    nothing = ball(-1).sqrt()
    assert less(nothing, one) is None
    assert at_most(nothing, one) is None
    truths = (True, False, None)
    assert [no(a) for a in truths] == [False, True, None]
    assert {(a, b): both(a, b) for a in truths for b in truths} == {
        (True, True): True, (True, False): False, (True, None): None,
        (False, True): False, (False, False): False, (False, None): False,
        (None, True): None, (None, False): False, (None, None): None,
    }  # fmt: skip
    assert either(True, None) is True
    assert either(False, None) is None
    assert bounds(select(True, one, two)) == (1, 1)
    lower, upper = bounds(select(None, one, two))
    assert lower <= 1
    assert upper >= 2


def test_a_square_is_not_negative():
    lower, upper = bounds(square(between(-2, 1)))
    assert -Fraction(1, 10**6) < lower <= 0
    assert 4 <= upper < 4.001


def test_the_narrower_of_two_enclosures_is_kept():
    wide, narrow, nothing = between(0, 3), between(1, 2), ball(-1).sqrt()
    assert bounds(narrower(wide, narrow)) == bounds(narrow)
    assert bounds(narrower(narrow, wide)) == bounds(narrow)
    assert bounds(narrower(narrow, nothing)) == bounds(narrow)
    assert bounds(narrower(nothing, wide)) == bounds(wide)


@pytest.mark.parametrize(
    ("value", "truth"),
    [
        ("pi", lambda: mpmath.pi),
        ("e", lambda: mpmath.e),
        (Fraction(1, 3), lambda: mpmath.mpf(1) / 3),
    ],
)
def test_constants_are_enclosed_to_any_precision(value, truth):
    with mpmath.workdps(400), precision(1200):
        b = constant(value)
        assert within(+truth(), b)
        assert b.rad() < ball(10) ** -350


@given(st.fractions(), st.integers(2, 200))
def test_a_fraction_is_inside_its_ball(x, bits):
    with precision(bits):
        lower, upper = bounds(ball(x))
        assert lower <= x <= upper


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_float_is_the_dyadic_fraction_that_it_is(x):
    assert exact(ball(x)) == Fraction(x)


@given(st.fractions(), st.fractions(), st.integers(1, 40), st.booleans())
def test_decimals_are_rounded_to_the_side_that_was_asked_for(a, b, digits, inwards):
    lower, upper = min(a, b), max(a, b)
    down, up = (Fraction(text) for text in decimals(lower, upper, digits, inwards=inwards))
    step = Fraction(10) ** (1 - digits) * max(abs(lower), abs(upper))
    if inwards:
        assert lower <= down <= lower + step
        assert upper - step <= up <= upper
    else:
        assert lower - step <= down <= lower
        assert upper <= up <= upper + step


@given(st.integers(-(10**12), 10**12), st.integers(-60, 60))
def test_decimals_of_a_decimal_number_are_that_number(count, power):
    x = Fraction(count) * Fraction(10) ** power
    texts = decimals(x, x, 13)
    assert [Fraction(text) for text in texts] == [x, x]
    assert all(len(text) < 80 for text in texts)


def test_thousands_of_digits_are_written_without_a_limit():
    with precision(20000):
        lower, upper = decimals(*bounds(constant("pi")), 5000)
    with mpmath.workdps(5010):
        truth = mpmath.nstr(+mpmath.pi, 5005)
    assert len(lower) == len(upper) == 5001
    assert truth.startswith(lower[:4990])
    assert lower < truth < upper  # digits before the point are as many: text is in order


def test_the_inverse_of_a_singular_matrix_is_none():
    assert middle_inverse([[ball(1), ball(1)], [ball(1), ball(1)]]) is None
    inverse = middle_inverse([[ball(2), ball(0)], [ball(0), ball(4)]])
    assert [[float(x) for x in row] for row in inverse.tolist()] == [[0.5, 0], [0, 0.25]]
    product = inverse * matrix([[2, 0], [0, 4]])
    assert math.isclose(float(product[1, 1]), 1)
