"""The package's own sine and cosine: within two units in the last place, everywhere."""

import math

import mpmath
import numpy as np
import oracles
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from strategies import together

from polycorner.formulas import emit

ALLOWED = 2.0
# Where millions of random angles met the largest errors of the reduced argument.
HARDEST = [
    0.8171697376933368,
    7.602939097641823,
    60.756930975646,
    987.9996385999224,
    6592.616558159278,
    75694.97906173604,
    711785.6832893274,
]


@pytest.fixture(scope="module")
def circular():
    """Return ``q -> (sin q, cos q)`` for an array of angles, in lanes and one by one."""
    angle = sp.Symbol("angle", real=True)
    both = together({"sine": sp.sin(angle), "cosine": sp.cos(angle)}, "angle")

    def in_lanes(q):
        return both.evaluate(np.asarray(q, dtype=float)[:, None], 0)[0]

    def one_by_one(q):
        return np.array([both.evaluate(np.array([a], dtype=float), 0)[0] for a in q])

    return in_lanes, one_by_one


def worst(computed, angles):
    """Return the largest error in units in the last place."""
    with mpmath.workdps(350):
        errors = [
            oracles.ulps(value, exact(mpmath.mpf(float(a))))
            for a, row in zip(angles, computed, strict=True)
            for value, exact in zip(row, (mpmath.sin, mpmath.cos), strict=True)
        ]
    return max(errors)


def near_multiples(counts):
    """Return the floats next to whole multiples of a quarter turn, and to odd eighths."""
    with mpmath.workdps(350):
        centres = [float(int(k) * mpmath.pi / 4) for k in counts]
    return np.array([step(c, side) for c in centres for side in (-9e999, 9e999) for step in STEPS])


STEPS = (
    lambda c, _: c,
    np.nextafter,
    lambda c, side: c * (1 + math.copysign(1e-12, side)),
    lambda c, side: c + math.copysign(1e-7, side),
)


@pytest.mark.parametrize("reach", [1e-300, 1e-8, 1.0, 10.0, 1e3, 9.99e5, 1.01e6, 1e10, 1e16, 1e300])
def test_both_are_within_two_units_in_the_last_place(circular, reach):
    angles = np.random.default_rng(7).uniform(-reach, reach, 400)
    for evaluate in circular:
        assert worst(evaluate(angles), angles) <= ALLOWED


@pytest.mark.parametrize(
    "counts", [range(-40, 41), range(1_000, 1_040), range(1_273_200, 1_273_260), [2**40, 2**52]]
)
def test_both_stay_exact_near_multiples_of_a_quarter_turn(circular, counts):
    angles = near_multiples(counts)
    for evaluate in circular:
        assert worst(evaluate(angles), angles) <= ALLOWED


@pytest.mark.parametrize("angle", HARDEST)
def test_both_are_that_close_for_the_hardest_angles_too(circular, angle):
    for evaluate in circular:
        assert worst(evaluate([angle, -angle]), [angle, -angle]) <= ALLOWED


@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_any_angle_at_all(circular, angle):
    for evaluate in circular:
        assert worst(evaluate([angle]), [angle]) <= ALLOWED


@pytest.mark.parametrize("bad", [math.inf, -math.inf, math.nan])
def test_what_is_no_angle_has_no_sine(circular, bad):
    for evaluate in circular:
        values = evaluate([bad] * 9)
        assert np.isnan(values).all()


@pytest.mark.parametrize("far", [1e6, -3e7, 1e300, math.inf, math.nan])
@pytest.mark.parametrize("lane", [0, 3, 7])
def test_a_distant_angle_does_not_change_its_neighbours(circular, far, lane):
    in_lanes, one_by_one = circular
    angles = np.random.default_rng(1).uniform(-100, 100, 64)
    angles[lane::8] = far
    assert in_lanes(angles).tobytes() == one_by_one(angles).tobytes()


@given(st.floats(-1e6, 1e6))
def test_symmetry_is_exact(circular, angle):
    in_lanes, _ = circular
    (sine, cosine), (minus, same) = in_lanes([angle, -angle])
    assert (minus, same) == (-sine, cosine)


class TestHalfPi:
    """The constants of the argument reduction, from thirty and more digits."""

    @staticmethod
    def bits(value):
        """Return the number of significant bits of a float."""
        mantissa = int(math.frexp(value)[0] * 2**53)
        return mantissa.bit_length() - (mantissa & -mantissa).bit_length() + 1

    def test_the_parts_are_the_leading_bits_in_turn(self):
        with mpmath.workdps(60):
            rest = mpmath.pi / 2
            for part in emit.HALF_PI[:2]:
                last = mpmath.ldexp(1, math.frexp(part)[1] - 33)
                assert abs(rest - part) <= last
                rest -= part
            assert emit.HALF_PI[2] == float(rest)

    def test_products_with_a_quadrant_number_are_exact(self):
        count = math.ceil(emit.REDUCTION_LIMIT * 2 / math.pi)
        assert count < 2**20
        for part in emit.HALF_PI[:2]:
            assert self.bits(part) <= 33

    def test_the_sum_is_half_pi_far_beyond_double_precision(self):
        with mpmath.workdps(60):
            error = abs(mpmath.fsum(map(mpmath.mpf, emit.HALF_PI)) - mpmath.pi / 2)
            assert error < mpmath.ldexp(1, -118)

    def test_the_sums_are_truncated_below_half_an_ulp(self):
        quarter = mpmath.pi / 4
        assert quarter**17 / mpmath.factorial(17) / mpmath.sin(quarter) < 2**-53
        assert quarter**18 / mpmath.factorial(18) / mpmath.cos(quarter) < 2**-53
        assert len(emit.SINE_TERMS) == 7
        assert len(emit.COSINE_TERMS) == 7
