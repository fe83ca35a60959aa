"""What other tools say of points, and how it is compared with what is there."""

from fractions import Fraction
from importlib.util import find_spec

import bench_verdicts
import numpy as np
import pytest

CASES = {case.name: case for case in bench_verdicts.cases()}


def test_radii_that_are_too_large_overlap_exactly_by_so_much():
    case = CASES["4 circles, 1e-9 too large"]
    r = Fraction(float(case.start[-1]))
    assert case.overlap(case.start) == pytest.approx(float(2 * r - Fraction(1, 2)), rel=1e-9)


@pytest.mark.parametrize("name", ["4 circles", "corner of a box", "contact without a force"])
def test_points_without_an_overlap_lie_in_the_set(name):
    assert CASES[name].overlap(CASES[name].start) == 0


def test_an_empty_set_is_violated_wherever_one_looks():
    rng = np.random.default_rng(1)
    case = CASES["set empty by 1e-12"]
    points = np.vstack([np.zeros((1, 2)), rng.normal(size=(50, 2))])
    assert all(case.overlap(q) >= 1e-12 / 3 for q in points)


@pytest.mark.parametrize("name", ["3 circles in a row", "contact without a force"])
def test_near_what_is_called_no_minimum_there_are_lower_points(name):
    case = CASES[name]
    energy, _, functions, _ = bench_verdicts.derivatives(case)
    step = np.array([0, 1e-3] * (len(case.start) // 2) + [0] * (len(case.start) % 2))
    if "row" in name:  # the middle one goes up, and the others follow the walls and grow
        step[:6] = [0, 0, 0, 1e-2, 0, 0]
        step[6] = 1e-7
        step[[0, 4]] = 1e-7, -1e-7
    q = case.start + step
    assert energy(q) < energy(case.start)
    assert functions(q).min() >= 0


@pytest.mark.parametrize(
    ("name", "word", "verdict"),
    [
        ("corner of a box", "proved", "true"),
        ("corner of a box", "optimal", "right"),
        ("corner of a box", "none", "wrong"),
        ("corner of a box", "empty", "false"),
        ("saddle 1e-7 beside minima", "proved", "false"),
        ("saddle 1e-7 beside minima", "optimal", "wrong"),
        ("saddle 1e-7 beside minima", "none", "right"),
        ("minimum 1e-7 beside a saddle", "optimal", "right"),
        ("set empty by 1e-12", "empty", "true"),
        ("set empty by 1e-12", "optimal", "wrong"),
        ("set empty by 1e-12", "nothing", "does not say"),
    ],
)
def test_claims_are_compared_with_what_is_there(name, word, verdict):
    case = CASES[name]
    assert bench_verdicts.judged(case, word, case.start) == verdict


def test_what_rattles_may_be_anywhere():
    case = CASES["7 circles"]
    moved = case.start.copy()
    moved[10] += 0.01
    assert bench_verdicts.judged(case, "proved", moved) == "true"


def test_the_program_runs_without_optional_packages(monkeypatch, capsys):
    kept = {}
    few = [CASES["corner of a box"], CASES["contact without a force"]]
    monkeypatch.setattr(bench_verdicts, "cases", lambda: few)
    monkeypatch.setattr(bench_verdicts, "write", lambda _, figures: kept.update(figures))
    own = {"polycorner", "scipy"}
    monkeypatch.setattr(bench_verdicts, "find_spec", lambda x: find_spec(x) if x in own else None)
    bench_verdicts.main()
    assert "POUNCE is left out: pounce-solver is not installed" in capsys.readouterr().out
    assert set(kept["counts"]) == {"certify", "prove", "SLSQP"}
    assert kept["counts"]["prove"] == {"true": 1, "does not say": 1}
