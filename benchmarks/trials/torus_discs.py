"""Several equal discs on a flat torus: the polyhedron of placements without overlap.

Squares of distances are polynomials of the relative positions of the discs; written as sums of
squares they are enclosed well.

>>> polyhedron, energy, box = several_discs(3, "square", (0.2505, 0.6))
>>> len(polyhedron.functions), len(box)
(17, 5)
"""

import math
from itertools import combinations, permutations, product
from typing import Any

import numpy as np
import sympy as sp

from polycorner import Manifold, Polyhedron
from polycorner.polyhedra.symmetry import Element, Symmetry

HALF = sp.Rational(1, 2)
WHOLE = ((-1, 0, 1), (-1, 0, 1))


def square_of(lattice: str, a: Any, b: Any) -> Any:
    """Return the square of the length of a combination of the lattice vectors."""
    return a**2 + b**2 if lattice == "square" else (a + b / 2) ** 2 + sp.Rational(3, 4) * b**2


def several_discs(
    count: int, lattice: str, radii: tuple[float, float], unit: Any = 1
) -> tuple[Polyhedron, Any, list[tuple[float, float]]]:
    """Return polyhedron, energy ``-r`` and box, in the other centres and the radius ``r``.

    The radius is in some unit, whose square is given.

    On the square torus centres are seen from the point farthest from the first one, so that of each
    other disc four images can touch it.  The box is the whole torus for each of them.
    """
    M = Manifold.euclidean([f"{c}{i}" for i in range(2, count + 1) for c in "uv"] + ["r"])
    *centres, r = M.symbols
    places = dict(enumerate(zip(centres[::2], centres[1::2], strict=True), start=2))
    away, near = (HALF, ((-1, 0), (-1, 0))) if lattice == "square" else (0, WHOLE)
    gaps = {}
    for i, (u, v) in places.items():
        for p, q in product(*near):
            gaps[f"1-{i}({p},{q})"] = square_of(lattice, u + away + p, v + away + q)
    for (i, (a, b)), (j, (u, v)) in combinations(places.items(), 2):
        for p, q in product(*WHOLE):
            gaps[f"{i}-{j}({p},{q})"] = square_of(lattice, u - a + p, v - b + q)
    d = Polyhedron(M, {name: gap - 4 * unit * r**2 for name, gap in gaps.items()})
    sides = tuple(x / math.sqrt(unit) for x in radii)
    return d, -r, [(-0.5, 0.5)] * len(centres) + [sides]


def symmetries(count: int, lattice: str) -> Symmetry:
    """Return symmetries of the lattice that permute and reflect coordinates, and relabellings."""

    def element(labels: Any, axes: Any, signs: Any) -> Element:
        order = [*(2 * i + axis for i in labels for axis in axes), 2 * len(labels)]
        factors = np.array([*signs * len(labels), 1])
        return Element(lambda q: factors * np.asarray(q)[order], {})

    signs = product((1, -1), repeat=2) if lattice == "square" else [(1, 1), (-1, -1)]
    every = product(permutations(range(count - 1)), permutations(range(2)), signs)
    next(every)  # the identity
    return Symmetry(elements=[element(*e) for e in every])
