"""The problems of the trials, and what judges the answers to them."""

import pytest
import sympy
from sympy import pi, sqrt

from benchmarks.trials.hock_schittkowski import problems
from polycorner import minimise

# Solutions in the book, rounded to seven digits or eight decimals where it gives no closed form.
PUBLISHED = {
    "HS24": (3, sqrt(3)),
    "HS43": (0, 1, 2, -1),
    "HS56": (2.4, 1.2, 1.2, *[sympy.asin(sqrt(sympy.Rational(k, 7))) for k in (4, 2, 2)], pi / 2),
    "HS63": (3.512118, 0.2169882, 3.552174),
    "HS68": (0.06785874, 3.6461717, 0.00026617, 0.8948622),
    "HS70": (12.27695, 4.631788, 0.3128625, 2.029290),
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
