"""Power series of programs against SymPy's, and their error bounds."""

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold
from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.jets import EPSILON, NotAnalyticError, function_series, ring

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
M = Manifold.euclidean("x y")
x, y = M.symbols
t, u = sp.symbols("t u", real=True)
BASE = (0.3, 0.7)
FORMULAS = [
    x**3 * y - 2 * y**2 / (1 + x),
    sp.sin(x + 2 * y) * sp.exp(x * y),
    sp.sqrt(1 + x * y) + sp.log(y + 2),
    sp.atan2(y - 2, x - 1) + sp.atan(x * y) + sp.asin(x - y) + sp.acos(x * y),
    sp.erf(x - y) + sp.tan(x) * sp.tanh(y) + sp.sinh(x) - sp.cosh(y) + (1 + x) ** sp.Rational(2, 3),
    (2 + x) ** y + sp.pi * x + sp.E,
    sp.Piecewise((x**2, x > 5), (x * y, True)) + sp.Abs(x - 3),
]


def along(formula, domain):
    """Return the series of a formula along ``(0.3 + t, 0.7 + u)``, or ``(.3 + t, .7 - 2 t)``."""
    variables = domain.variables
    p = domain.constant(BASE[0]) + domain.variable(0)
    q = domain.constant(BASE[1]) + (
        domain.variable(1) if variables == 2 else -2.0 * abs(domain.variable(0))
    )
    return function_series([SmoothFunction("f", formula, M)], [p, q], domain, slopes=True)[0]


@pytest.mark.parametrize("formula", FORMULAS, ids=str)
def test_the_coefficients_are_taylors(formula):
    domain = ring(2, 5)
    for series, expression in zip(
        along(formula, domain), (formula, sp.diff(formula, x), sp.diff(formula, y)), strict=True
    ):
        for (i, j), found, bound in zip(domain.exponents.tolist(), *series, strict=True):
            exact = sp.diff(expression, x, i, y, j) / sp.factorial(i) / sp.factorial(j)
            value = float(exact.subs({x: sp.Rational(3, 10), y: sp.Rational(7, 10)}).evalf(30))
            # The base point itself is rounded.
            assert abs(found - value) <= 1e-12 * (1 + abs(value))
            assert bound >= 0


def test_error_bounds_see_cancellation():
    domain = ring(1, 4)
    series = along((x - y + 0.4) ** 2 * 1e8 - 1e8 * (x - y + 0.4) ** 2 + (x - 0.3), domain)[0]
    exact = np.zeros(5)
    exact[1] = 1
    assert (abs(series[0] - exact) <= 10 * EPSILON * series[1] + 1e-300).all()


@pytest.mark.parametrize(
    "formula", [sp.Abs(x - 0.3), sp.sqrt(x - 0.3), sp.Max(x, 0.3), sp.log(x - 0.3)], ids=str
)
def test_kinks_have_no_series(formula):
    with pytest.raises(NotAnalyticError):
        along(formula, ring(1, 4))


def test_a_polynomial_is_moved():
    domain = ring(2, 4)
    coefficients = np.random.default_rng(3).normal(size=domain.size)
    move = np.array([0.5, -1.5])
    points = np.random.default_rng(4).normal(size=(5, 2))

    def value(c, w):
        return (c * np.prod(w[:, None, :] ** domain.exponents, axis=2)).sum(axis=1)

    moved = domain.shifted(coefficients, move)
    assert value(moved, points) == pytest.approx(value(coefficients, points + move))
