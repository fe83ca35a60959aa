"""Vanishing multipliers against closed forms."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.minimisation import crossing

M = Manifold.euclidean("x y")
x, y = M.symbols
a, b = sympy.symbols("a b", positive=True)


def function(name, expression, **parameters):
    return SmoothFunction(name, expression, M, parameters=parameters)


@given(st.floats(0.5, 3), st.floats(-2, 0), st.floats(-3, 3))
def test_a_multiplier_vanishes_where_the_wall_lets_go(slope, pull, height):
    """At the foot of a wall on a slope, dE = (-sinh p, 1) = lam (1, 0) + (-a, 1)."""
    p = sympy.Symbol("p")
    energy = function("e", (x - sympy.sinh(p)) ** 2 / 2 + y, p=pull)
    d = Polyhedron(M, [function("wall", x), function("slope", y - a * x - b, a=slope, b=height)])
    found = crossing(minimise(d, energy, [1.0, height + 5]), "wall", "p")
    assert pull + found.change == pytest.approx(math.asinh(slope), abs=1e-12)
    assert found.multipliers == pytest.approx({"wall": 0, "slope": 1}, abs=1e-12)
    np.testing.assert_allclose(found.point, [0, height], atol=1e-12)


def test_several_parameters_may_change_together():
    energy = function("e", (x - a) ** 2 / 2 + b * x + y, a=-1.0, b=1.0)
    c = minimise(Polyhedron(M, {"wall": x, "floor": y}), energy, [1.0, 1.0])  # lam = b - a
    assert crossing(c, "wall", {"a": 1, "b": -3}).change == pytest.approx(0.5)


def test_a_multiplier_that_never_vanishes_is_not_found():
    c = minimise(
        Polyhedron(M, {"wall": x, "floor": y}), function("e", sympy.exp(a) * x + y, a=1.0), [1, 1]
    )
    assert crossing(c, "wall", "a") is None
