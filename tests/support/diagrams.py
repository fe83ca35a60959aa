"""Diagrams of equilibria over a parameter whose arcs and events are known."""

from functools import cache

import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import branches

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
T = sympy.Symbol("t")
STOP = 0.8


@cache
def leaning_well():
    """A double well that leans, with a stop in its right half: folds at ``t = +-2/3^(3/2)``."""
    well = X**4 / 4 - X**2 / 2 - T * X + Y**2
    energy = SmoothFunction("E", well, PLANE, parameters={"t": 0.0})
    d = Polyhedron(PLANE, {"stop": STOP - X, "far": X + 9})
    return branches(minimise(d, energy, [-1, 0]), "t", (-0.6, 0.6))
