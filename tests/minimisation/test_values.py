"""Values of minimisation and the arrays of its callers."""

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, minima, minimise

M = Manifold.euclidean("x y")
x, y = M.symbols
a = sympy.Symbol("a")
BOWL = SmoothFunction("bowl", y - a * x**2, M, parameters={"a": 1.0})
D = Polyhedron(M, [BOWL, SmoothFunction("lid", 2 - y, M)])
E = SmoothFunction("energy", x + y, M)


def certificate():
    return minimise(D, E, [1.0, 1.5])


def test_a_point_given_by_the_caller_stays_writable():
    start = np.array([1.0, 1.5])
    minimise(D, E, start)
    minima(D, E, starts=start[None])
    start[0] = 2.0
    assert certificate().point[0] == pytest.approx(-0.5)
