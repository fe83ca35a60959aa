"""Polynomials whose coefficients are bound late, so that generated problems compile nothing."""

from functools import lru_cache

import numpy as np
import sympy as sp

from polycorner import SmoothFunction
from polycorner.formulas.families import Family


@lru_cache
def _family(names, degree):
    symbols = [sp.Symbol(name, real=True) for name in names]
    powers = sorted(sp.itermonomials(symbols, degree), key=sp.default_sort_key)
    open_numbers = sp.symbols(f"c0:{len(powers)}", real=True)
    total = sum(c * power for c, power in zip(open_numbers, powers, strict=True))
    return Family.of({"polynomial": total}, names, [c.name for c in open_numbers]), powers


def count(manifold, degree):
    """Return how many coefficients a polynomial of that degree has."""
    return len(_family(manifold.names, degree)[1])


def polynomial(manifold, degree, coefficients, label, *, constant=None):
    """Return a polynomial; ``constant`` replaces its value at the origin."""
    family, powers = _family(manifold.names, degree)
    numbers = np.array(coefficients, dtype=float)
    if constant is not None:
        numbers[powers.index(sp.S.One)] = constant
    return SmoothFunction.member(
        family, "polynomial", manifold, parameters=numbers.tolist(), label=label
    )


def quadratic(manifold, form, slope=None, *, constant=0.0, label="energy"):
    """Return ``constant + slope.x + x.form.x / 2``."""
    _, powers = _family(manifold.names, 2)
    x = manifold.symbols
    form, n = np.asarray(form), manifold.dimension
    slope = np.zeros(n) if slope is None else np.asarray(slope)
    numbers = dict.fromkeys(powers, 0.0) | {sp.S.One: constant}
    for i in range(n):
        numbers[x[i]] = slope[i]
        for j in range(i + 1):
            numbers[x[i] * x[j]] = form[i, i] / 2 if i == j else (form[i, j] + form[j, i]) / 2
    return polynomial(manifold, 2, [numbers[power] for power in powers], label)


def linear(manifold, slope, constant, label):
    """Return ``constant + slope.x``."""
    n = manifold.dimension
    return quadratic(manifold, np.zeros((n, n)), slope, constant=constant, label=label)
