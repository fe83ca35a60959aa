"""How many kinds there are: exact expectations over every sample of a planted population."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.minimisation import richness

abundances = st.lists(st.integers(1, 30), min_size=1, max_size=12)


def compositions(total, parts):
    """Yield every way to spread ``total`` draws over ``parts`` kinds, in order."""
    if parts == 1:
        yield (total,)
        return
    for first in range(total + 1):
        for rest in compositions(total - first, parts - 1):
            yield (first, *rest)


def samples(shares, draws):
    """Yield every sample of a population, as its positive counts, with its exact probability."""
    for counts in compositions(draws, len(shares)):
        weight = Fraction(math.factorial(draws))
        for share, count in zip(shares, counts, strict=True):
            weight *= share**count / math.factorial(count)
        yield counts, weight


def expectation(shares, draws, figure):
    return float(sum(float(w) * figure(counts) for counts, w in samples(shares, draws)))


def estimated(counts):
    return richness([c for c in counts if c])


EVEN = [Fraction(1, 5)] * 5
UNEVEN = [Fraction(k, 15) for k in (8, 3, 2, 1, 1)]
populations = pytest.mark.parametrize("shares", [EVEN, UNEVEN], ids=["even", "uneven"])


@given(abundances)
def test_the_estimate_is_the_formula(counts):
    n, f1, f2 = sum(counts), counts.count(1), counts.count(2)
    exact = len(counts) + Fraction(n - 1, n) * Fraction(f1 * (f1 - 1), 2 * (f2 + 1))
    found = richness(counts)
    assert found.estimate == pytest.approx(float(exact), rel=1e-14)
    assert found.coverage == pytest.approx(float(1 - Fraction(f1, n)), rel=1e-14)
    assert (found.observed, found.draws, found.singles, found.doubles) == (len(counts), n, f1, f2)


@given(abundances)
def test_what_was_seen_is_there(counts):
    found = richness(counts)
    low, high = found.interval
    assert len(counts) <= low <= high
    assert len(counts) <= found.estimate <= high
    assert found.unseen >= 0
    assert found.variance >= 0
    assert richness(counts[::-1]) == found


@given(st.lists(st.integers(20, 1000), min_size=1, max_size=8))
def test_kinds_that_were_all_met_often_are_all_there_are(counts):
    found = richness(counts)
    assert found.estimate == len(counts)
    assert found.coverage == 1
    assert found.interval == pytest.approx((len(counts), len(counts)), abs=1e-3)


@populations
def test_coverage_is_that_of_one_draw_less(shares):
    """The expectation of ``1 - f1/n`` is the share expected to be met in ``n - 1`` draws."""
    n = 10
    met = 1 - sum(float(p * (1 - p) ** (n - 1)) for p in shares)
    computed = expectation(shares, n, lambda counts: estimated(counts).coverage)
    assert computed == pytest.approx(met, rel=1e-12)


def test_the_estimate_is_nearly_unbiased_for_an_even_population():
    errors = [
        abs(expectation(EVEN, n, lambda counts: estimated(counts).estimate) - 5)
        for n in (8, 12, 16, 24)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.03


def test_the_estimate_is_between_what_is_seen_and_what_there_is_for_an_uneven_population():
    for n in (8, 12, 16):
        seen, claimed = (
            expectation(UNEVEN, n, lambda counts, what=what: getattr(estimated(counts), what))
            for what in ("observed", "estimate")
        )
        assert seen + 0.3 * (5 - seen) < claimed < 5


@populations
def test_the_variance_is_of_the_right_size(shares):
    n = 12
    mean = expectation(shares, n, lambda counts: estimated(counts).estimate)
    exact = expectation(shares, n, lambda counts: (estimated(counts).estimate - mean) ** 2)
    claimed = expectation(shares, n, lambda counts: estimated(counts).variance)
    assert 0.5 < claimed / exact < 3


def test_the_interval_contains_the_truth_as_often_as_it_says_once_there_are_draws_enough():
    def contains(counts):
        low, high = estimated(counts).interval
        return low <= 5 <= high

    assert expectation(EVEN, 24, contains) > 0.95
    assert expectation(EVEN, 12, contains) < 0.9  # which is why the level is called nominal


@given(st.integers(1, 5000))
def test_what_may_be_overlooked_is_missed_once_in_twenty(n):
    share = richness([n]).overlooked
    assert (1 - share) ** n == pytest.approx(0.05, rel=1e-9)
    if n > 100:
        assert share == pytest.approx(3 / n, rel=0.02)


def test_nothing_is_known_without_draws():
    found = richness([])
    assert (found.observed, found.estimate, found.coverage, found.overlooked) == (0, 0, 0, 1)
    assert found.interval == (0, math.inf)


def test_numpy_counts_are_counts():
    assert richness(np.array([4, 1, 1])) == richness([4, 1, 1])
