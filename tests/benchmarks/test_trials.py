"""The problems of the trials, and what judges the answers to them."""

import numpy as np
import pytest
import sympy
from sympy import pi, sqrt

from benchmarks.trials.hock_schittkowski import problems
from benchmarks.trials.judge import Judge
from benchmarks.trials.random_formulas import problem
from benchmarks.trials.run_random_formulas import summary, trial
from benchmarks.trials.stages import staged
from polycorner import minimise

# Solutions in the book, rounded to seven digits or eight decimals where it gives no closed form.
PUBLISHED = {
    "HS24": (3, sqrt(3)),
    "HS43": (0, 1, 2, -1),
    "HS56": (2.4, 1.2, 1.2, *[sympy.asin(sqrt(sympy.Rational(k, 7))) for k in (4, 2, 2)], pi / 2),
    "HS63": (3.512118, 0.2169882, 3.552174),
    "HS68": (0.06785874, 3.6461717, 0.00026617, 0.8948622),
    "HS71": (1, 4.742999, 3.821150, 1.379408),
    "HS84": (4.537431, 2.4, 60, 9.3, 7),
    "HS87": (107.8119, 196.3186, 373.8307, 420, 21.30713, 0.1532920),
    "HS99": (0.5424603, 0.5290159, 0.5084506, 0.4802693, 0.4512352, 0.4091878, 0.3527847),
    "HS100": (2.330499, 1.951372, -0.4775414, 4.365726, -0.6244870, 1.038131, 1.594227),
    "HS113": (2.171996, 2.363683, 8.773926, 5.095984, 0.9906548, 1.430574, 1.321644, 9.828726,
              8.280092, 8.375927),
}  # fmt: skip


def change_by_rounding(expression, at):
    """Bound to first order how much the rounding of coordinates changes a value."""
    errors = {x: max(1e-6 * abs(float(value)), 1e-8) for x, value in at.items()}
    return 1e-9 + sum(abs(float(expression.diff(x).subs(at))) * errors[x] for x in at)


class TestHockSchittkowski:
    def test_every_number_of_the_book_with_a_formula_is_there(self):
        numbers = {int(problem.name[2:]) for problem in problems()}
        assert set(range(1, 120)) - numbers == {58, 67, 82, *range(88, 93), 94, 115}

    @pytest.mark.parametrize("name", PUBLISHED)
    def test_the_published_solution_is_feasible_and_has_the_best_known_value(self, name):
        problem = next(problems(name))
        at = dict(zip(problem.symbols, PUBLISHED[name], strict=True))
        for x, (low, high) in zip(problem.symbols, problem.bounds, strict=True):
            assert low is None or float(at[x]) >= low
            assert high is None or float(at[x]) <= high
        for g in problem.inequalities:
            assert float(g.subs(at)) >= -change_by_rounding(g, at)
        for h in problem.equations:
            assert abs(float(h.subs(at))) <= change_by_rounding(h, at)
        error = abs(float(problem.energy.subs(at)) - problem.best)
        assert error <= change_by_rounding(problem.energy, at) + 1e-9 * abs(problem.best)

    def test_they_are_polyhedra_whose_minima_can_be_searched(self):
        problem = next(problems("HS71"))
        found = minimise(problem.polyhedron, problem.energy, problem.start)
        assert found.is_minimum
        assert float(problem.energy.subs(dict(zip(problem.symbols, found.point, strict=True)))) == (
            pytest.approx(problem.best, rel=1e-8)
        )


x, y = sympy.symbols("x y", real=True)


def refuted(energy, inequalities=(), equations=(), at=(0.0, 0.0)):
    judge = Judge((x, y), energy, list(inequalities), list(equations))
    return next(judge.lower_points(np.array(at), np.random.default_rng(0)), None) is not None


class TestJudge:
    @pytest.mark.parametrize(
        ("energy", "inequalities", "equations"),
        [
            ((x + 1) ** 2 + y, [x**2, y], []),
            (-(x**4) + y**2, [], []),
            (x * sympy.Abs(x) + y**2, [], []),
            ((y - x**2) * (y - 2 * x**2), [], []),
            (x * y, [x + y], []),
            (x, [], [x - y**3]),
            (-x, [sympy.Max(-x, y)], []),
        ],
    )
    def test_it_refutes_what_is_no_minimum(self, energy, inequalities, equations):
        assert refuted(energy, inequalities, equations)

    @pytest.mark.parametrize(
        ("energy", "inequalities", "equations"),
        [
            (x**4 + y**2, [], []),
            (x * y, [x, y], []),
            (sympy.Abs(x) + y**2, [], []),
            (x**2 - y, [], [y - x**2]),
            (x, [sympy.Max(x, y), x + y], [x - y**2]),
        ],
    )
    def test_it_does_not_refute_minima(self, energy, inequalities, equations):
        assert not refuted(energy, inequalities, equations)

    def test_a_minimum_with_a_lower_valley_behind_a_barrier_is_not_refuted(self):
        assert not refuted(x**2 * (x - 1) ** 2 - x**3 / 100 + y**2)
        assert not refuted(x**2 * (x - 0.008) ** 2 - x**5 + y**2)

    @pytest.mark.parametrize(
        ("inequalities", "equations", "at", "reachable"),
        [
            ([x - 51], [], (0.0, 0.0), True),
            ([x**2 - 1, y], [x - y], (0.3, -0.2), True),
            ([3 * x + 7, x**2 - 16, 12 - x], [], (-3.2, 0.0), False),
            ([x**2 + y**2 - 1, -(x**2) - y**2 - 1], [], (0.5, 0.0), False),
        ],
    )
    def test_it_tells_where_all_violations_decrease(self, inequalities, equations, at, reachable):
        judge = Judge((x, y), x, inequalities, equations)
        assert judge.reachable(np.array(at), np.random.default_rng(0)) is reachable

    def test_it_finds_points_that_are_just_as_low(self):
        origin = np.zeros(2)
        assert Judge((x, y), (x - y) ** 2, [], []).as_low(origin) is not None
        assert Judge((x, y), x**4 + y**6, [], []).as_low(origin) is None


class TestRandomFormulas:
    def test_a_problem_is_the_same_whenever_it_is_asked_for(self):
        assert [repr(problem(1, k)) for k in range(8)] == [repr(problem(1, k)) for k in range(8)]

    def test_what_is_said_of_a_problem_is_judged(self):
        """Number 18 is x/((x**4 - x)**2 + 1) on 4 - x**2 >= 0, from -1/2."""
        facts = {}
        for more in trial(problem(1, 18)):
            facts |= more
        assert facts["minimise"] == ("right", "STRICT_MINIMUM")
        assert facts["minimise, proof"] == "proved"
        assert facts["certify"] == ("declined", "NOT_STATIONARY")
        assert summary(facts) == "right"

    def test_the_worst_claim_decides_and_a_theorem_about_it_is_false(self):
        wrong = {"minimise": ("wrong", ""), "certify": ("right", ""), "minimise, proof": "proved"}
        assert summary(wrong) == "wrong"
        assert wrong["false proof"] == "minimise"
        assert summary({"minimise": ("right", ""), "crash": "IndexError"}) == "crash"
        assert summary({"minimise": ("right", ""), "certify": ("declined", "")}) == "right"


def facts_then(end):
    yield {"before": 1}
    end()
    yield {"after": 2}


def raise_division():
    return 1 // 0


def wait():
    while True:
        pass


class TestStages:
    def test_a_task_that_ends_returns_everything(self):
        assert staged(facts_then, list, seconds=30) == {"before": 1, "after": 2}

    def test_what_was_known_before_a_crash_is_kept(self):
        facts = staged(facts_then, raise_division, seconds=30)
        assert facts["before"] == 1
        assert facts["crash"].startswith("ZeroDivisionError")

    def test_what_was_known_before_the_time_was_over_is_kept(self):
        assert staged(facts_then, wait, seconds=1) == {"before": 1, "stopped": 1}
