"""Never a false theorem: random problems with exactly known answers, many of them on the edge."""

from collections import Counter
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from exact_kinds import KINDS, departures, programme
from exact_oracle import holds
from exact_problems import Programme
from hypothesis import settings

from polycorner.proofs import prove

DIGITS = 20
FEW = 16
MANY = max(80, settings().max_examples)  # of each kind; 1000 where the run is a thorough one
# Of strict, nowhere degenerate minima that a search has found, the share that has to be proved.
LEAST_PROVED = 0.95


def attempted(kind, rng):
    """Return a problem, whether a search found the point, its certificate and the proof of it."""
    problem = programme(kind, rng)
    search = bool(rng.integers(2))
    c = problem.certificate(problem.start() + departures(rng, problem.n), search=search)
    return problem, c, prove(c, digits=DIGITS, symmetry=problem.symmetry)


def at_centre(problem, proof):
    """Whether the proof speaks of the point ``c``."""
    bounds = problem.straightened(proof) if proof.enclosures else []
    return bool(bounds) and all(lower <= 0 <= upper for lower, upper in bounds)


def tried(kind, count, seed):
    """Try problems of one kind; return what came of them, and complain of anything false."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    found = Counter()
    for _ in range(count):
        problem, c, proof = attempted(kind, rng)
        statuses = set(proof.conditions.values())
        if proof.proved:
            assert holds(problem, proof), f"false theorem: {problem}\n{proof}"
            found["proved"] += 1
        elif "failed" in statuses:
            known = problem.minimum and at_centre(problem, proof)
            assert not known, f"false refutation: {problem}\n{proof}"
            found["refuted"] += 1
        else:
            found["undecided" if c.is_minimum else "refused"] += 1
        if problem.minimum and c.is_minimum:
            found["minima"] += 1
            found["minima proved"] += proof.proved
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_no_false_theorem_in_some_hundred_problems(kind):
    found = tried(kind, FEW, seed=1)
    assert sum(found[word] for word in ("proved", "refuted", "undecided", "refused")) == FEW


def test_no_false_theorem_in_hundreds_of_problems_or_thousands():
    totals = {kind: tried(kind, MANY, seed=2) for kind in KINDS}
    sure = totals["minimum"]
    assert sure["minima proved"] >= LEAST_PROVED * sure["minima"] > 0
    for kind in ("saddle", "pulling contact", "faint curvature", "faint multiplier"):
        assert totals[kind]["refuted"] > MANY / 20
    assert totals["weak contact"]["proved"] > MANY / 20


def test_minima_found_by_a_search_are_proved():
    found = tried("minimum", 40, seed=3)
    assert found["minima proved"] >= LEAST_PROVED * found["minima"] > 0


@pytest.mark.parametrize(("curvature", "true"), [(1, True), (-1, False)])
@pytest.mark.parametrize(("multiplier", "allowed"), [(1, True), (0, True), (-1, False)])
def test_the_oracle_allows_a_multiplier_of_zero_where_the_form_is_positive(
    curvature, true, multiplier, allowed
):
    """``E = 2 x + m y + x^2/2 + c y^2/2`` on ``x >= 0, y >= 0``: at 0 the multipliers are 2, m."""
    one, nil = Fraction(1), Fraction(0)
    form = ((one, nil), (nil, Fraction(curvature)))
    rows, flat = ((one, nil), (nil, one)), (nil, nil)
    slope = (Fraction(2), Fraction(multiplier))
    problem = Programme("weak", form, slope, rows, flat, flat, (flat,) * 3)
    enclosed = {"q1": (0, 0), "q2": (0, 0)}
    said = SimpleNamespace(minimum=None, active=("f0", "f1"), symmetry=None, enclosures=enclosed)
    assert holds(problem, said) == (allowed and (true or multiplier > 0))


def test_the_oracle_tells_true_theorems_from_false_ones():
    """The judge must be able to convict: a proof transplanted to another problem is false."""
    rng = np.random.default_rng(5)
    convicted = 0
    for _ in range(20):
        problem, _, proof = attempted("minimum", rng)
        if not proof.proved:
            continue
        assert holds(problem, proof)
        for change in (
            {"form": tuple(tuple(-x for x in row) for row in problem.form)},
            {"slope": tuple(-g for g in problem.slope)},
            {"centre": tuple(c + 1 for c in problem.centre)},
            {"offsets": tuple(b + 9 for b in problem.offsets)},
        ):
            altered = type(problem)(**{**vars(problem), **change})
            same = (
                problem.n == len(proof.active)
                if "form" in change
                else change == {key: getattr(problem, key) for key in change}
            )
            if not same:
                assert not holds(altered, proof)
                convicted += 1
    assert convicted > 20
