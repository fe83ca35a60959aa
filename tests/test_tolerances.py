"""The ladder of tolerances: its default, its order, and what it is made of."""

import itertools
import math
import re
import sys
from dataclasses import fields
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.tolerances import DEFAULT, Tolerances

EPSILON = sys.float_info.epsilon
exponents = st.floats(-10, -4)


def is_ascending(*numbers):
    return all(a < b for a, b in itertools.pairwise(numbers))


def test_the_default_is_that_of_the_two_public_numbers():
    """To the bit: nothing changes for those who give no tolerance."""
    assert Tolerances.of() == Tolerances() == DEFAULT
    assert (DEFAULT.corner, DEFAULT.beside, DEFAULT.multiplier) == (1e-5, 1e-3, 1e-9)


@given(exponents)
def test_the_order_is_kept(exponent):
    t = Tolerances.of(10**exponent)
    assert is_ascending(EPSILON, t.rounding, t.held, t.feasible, t.zero, t.same, t.corner)
    assert is_ascending(t.corner, t.near, t.beside, 1)
    assert is_ascending(t.settled**2, t.held)
    assert is_ascending(EPSILON, t.difference**2)
    assert is_ascending(math.sqrt(EPSILON), t.dependent, t.rank)
    assert is_ascending(t.multiplier, t.stationary)
    assert is_ascending(t.curvature, t.flat)
    assert t.zero == pytest.approx(10**exponent)


@given(exponents, exponents)
def test_a_larger_tolerance_makes_no_number_smaller(one, other):
    least, most = sorted((one, other))
    few, many = Tolerances.of(10**least), Tolerances.of(10**most)
    assert all(getattr(few, f.name) <= getattr(many, f.name) for f in fields(Tolerances))


@given(st.floats(-7.5, -2))
def test_the_rank_tolerance_moves_what_is_dependent_and_nothing_else(exponent):
    t = Tolerances.of(rank_tolerance=10**exponent)
    assert t.rank == pytest.approx(10**exponent)
    assert t.dependent == pytest.approx(t.rank / 10)
    others = [f.name for f in fields(t) if f.name not in ("rank", "dependent")]
    assert all(getattr(t, name) == getattr(DEFAULT, name) for name in others)


@pytest.mark.parametrize("argument", ["tolerance", "rank_tolerance"])
@pytest.mark.parametrize("value", [0.0, -1e-8, 1.0, math.nan, math.inf])
def test_a_number_that_is_no_tolerance_is_refused(argument, value):
    with pytest.raises(ValueError, match=rf"^{argument}: expected a number"):
        Tolerances.of(**{argument: value})
    with pytest.raises(TypeError, match=rf"^{argument}: "):
        Tolerances.of(**{argument: "small"})


def test_the_page_has_every_number_with_its_rule():
    """Each cell such as ``1e-6 s^(3/4)`` is what the code makes of other tolerances."""
    page = (Path(__file__).parents[1] / "docs" / "tolerances.md").read_text()
    rules = dict(re.findall(r"^\| `(\w+)` \| `([^`]+)` \|", page, flags=re.MULTILINE))
    assert list(rules) == [f.name for f in fields(Tolerances)]
    powers = {"": 0.0, "s": 1.0, "s^(1/2)": 0.5, "s^(3/4)": 0.75}
    for exponent in (-10, -8, -5):
        s, changed = 10.0 ** (exponent + 8), Tolerances.of(10.0**exponent, 1e-5)
        for name, rule in rules.items():
            number, _, factor = rule.partition(" ")
            if number == "rank_tolerance":
                expected = 1e-5
            else:
                expected = float(number) * (10.0 if factor == "r" else s ** powers[factor])
            assert getattr(changed, name) == pytest.approx(expected), name
