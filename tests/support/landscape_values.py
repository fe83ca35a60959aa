"""Landscapes written by hand, without any search: trees whose shape is known."""

from math import inf

import numpy as np

from polycorner import Manifold, Polyhedron
from polycorner.landscapes import Landscape, Minimum, Pass, Route, Side
from polycorner.minimisation.problem import pose

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
DISC = Polyhedron(PLANE, {"rim": 16 - X**2 - Y**2, "post": (X - 0.1) ** 2 + (Y - 1) ** 2 - 0.2})
WELLS = pose(DISC, (X**2 - 1) ** 2 + Y**2 / 2 + X / 10)


def minimum(point, energy, *, orbit=0, active=(), kind="isolated"):
    wide = energy if isinstance(energy, tuple) else (energy, energy)
    return Minimum(np.array(point, float), wide, active, kind, orbit)


def route(points, verified=True, problem=WELLS):
    vertices = np.array(points, float)
    energies = problem.energy.value(vertices)
    return Route(vertices, energies, float(max(energies)), verified)


def a_pass(point, energy, sides, *, kind="saddle", index=1, orbit=0, active=(), verified=True):
    """Return a pass with sides that are numbers of minima, or sides."""
    wide = energy if isinstance(energy, tuple) else (energy, energy)
    point = np.array(point, float)
    # A route that stays at the pass: its top is the energy of the pass.
    stay = Route(np.array([point, point]), np.array([wide[1]] * 2), wide[1], verified)
    made = tuple(
        s if isinstance(s, Side) else Side(s, None if s == -1 or s is None else stay) for s in sides
    )
    return Pass(point, wide, active, index, kind, made, orbit)


def tree(energies, joins, *, problem=WELLS, proved=True, **more):
    """Return a landscape of minima with energies, joined as in ``(energy, minima, options)``."""
    minima = [minimum((k, 0), e, orbit=k) for k, e in enumerate(energies)]
    passes = [
        a_pass((0, 0), energy, sides, **({"orbit": k} | options))
        for k, (energy, sides, options) in enumerate(joins)
    ]
    return Landscape(problem, tuple(minima), tuple(passes), proved, **more)


def random_tree(count, seed=0, **more):
    """Return a landscape of minima joined one by one in random order."""
    rng = np.random.default_rng(seed)
    energies = np.sort(rng.uniform(0, 1, count)).tolist()
    joins = []
    for k in range(1, count):
        other = int(rng.integers(k))
        top = max(energies[k], energies[other]) + rng.uniform(0.05, 1)
        joins.append((float(top), (k, other), {}))
    return tree(energies, sorted(joins, key=lambda join: join[0]), **more)


def double_well():
    """Return the landscape of two wells over a disc with a post, with its routes."""
    from scipy.optimize import brentq

    roots = [brentq(lambda x: 4 * x * (x * x - 1) + 0.1, a, b) for a, b in BRACKETS]
    left, top, right = ((x, 0.0) for x in roots)
    low, high = float(WELLS.energy.value(left)), float(WELLS.energy.value(right))
    over = float(WELLS.energy.value(top))
    ways = [route(np.linspace(top, end, 20)) for end in (left, right)]
    sides = (Side(0, ways[0]), Side(1, ways[1]))
    minima = (minimum(left, low), minimum(right, high, orbit=1))
    return Landscape(WELLS, minima, (a_pass(top, over, sides),), proved=True)


BRACKETS = ((-1.5, -0.6), (-0.4, 0.4), (0.6, 1.5))
CAGE = {"region": True, "cap": inf}
