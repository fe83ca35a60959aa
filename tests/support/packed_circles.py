"""Equal circles that are as large as there is room for, in a square and on a torus."""

from itertools import combinations

import numpy as np

from polycorner import Manifold, Polyhedron


def circles(centres, side=1):
    """Return the packings of equal circles in a square, and the point of given centres."""
    n = len(centres)
    manifold = Manifold.euclidean(" ".join(f"x{i} y{i}" for i in range(n)) + " r")
    *z, r = manifold.symbols
    walls = {f"{s}low": s - r for s in z} | {f"{s}high": side - r - s for s in z}
    gaps = {
        f"gap{i}_{j}": (z[2 * i] - z[2 * j]) ** 2 + (z[2 * i + 1] - z[2 * j + 1]) ** 2 - 4 * r**2
        for i, j in combinations(range(n), 2)
    }
    c = np.array(centres)
    apart = min(np.linalg.norm(a - b) for a, b in combinations(c, 2)) / 2
    radius = min(apart, c.min(), (float(side) - c).min())
    return Polyhedron(manifold, {**walls, **gaps}), -r, np.append(c.ravel(), radius)


def torus():
    """Return two circles in a square torus, of which one touches four images of the other."""
    manifold = Manifold.euclidean("x0 y0 x1 y1 r")
    x0, y0, x1, y1, r = manifold.symbols
    gaps = {
        f"gap{i}{j}": (x0 - x1 - i) ** 2 + (y0 - y1 - j) ** 2 - 4 * r**2
        for i in (0, 1) for j in (0, 1)
    }  # fmt: skip
    return Polyhedron(manifold, gaps), -r, [0.8, 0.7, 0.3, 0.2, 0.125**0.5]
