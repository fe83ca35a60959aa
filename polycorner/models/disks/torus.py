"""Distances on a flat torus, in lattice coordinates, and sets of points on it that coincide.

The lattice has basis vectors ``a``, ``b`` of length 1 at an angle with the cosine ``c``; a vector
with lattice coordinates ``(u, v)`` has the length ``sqrt(u^2 + 2 c u v + v^2)``.
"""

from collections.abc import Callable
from functools import lru_cache
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from polycorner.formulas.families import Family
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import sympy

    Formulas = tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]

OWN = "own"
IMAGES = tuple(product((-1, 0, 1), repeat=2))


@lru_cache(maxsize=1)
def gap() -> Family:
    """Return ``|x_2 - x_1 + v| - 2r`` in lattice coordinates; parameters ``p q c``.

    ``v = p a + q b`` and ``c = cos`` of the angle between the basis vectors.
    """
    variables = ("x1", "y1", "x2", "y2", "r")
    return _family(("gap",), variables, ("p", "q", "c"), _gap_formula)


@lru_cache(maxsize=1)
def bound() -> Family:
    """Return the bound by a disk's own image, and the energy."""
    return _family((OWN, "smallness"), ("r",), (), _bound_formulas)


def _family(
    names: tuple[str, ...],
    variables: tuple[str, ...],
    parameters: tuple[str, ...],
    formulas: "Callable[[], Formulas]",
) -> Family:
    from polycorner.formulas.cache import source_key

    key = repr((source_key(__name__), names, variables, parameters))
    return Family(names, variables, parameters, formulas, key, "lattice vector")


def _gap_formula() -> "Formulas":
    import sympy

    x1, y1, x2, y2, r, p, q, c = sympy.symbols("x1 y1 x2 y2 r p q c", real=True)
    across, along = x2 - x1 + p, y2 - y1 + q
    return {}, {"gap": sympy.sqrt(across**2 + 2 * c * across * along + along**2) - 2 * r}


def _bound_formulas() -> "Formulas":
    import sympy

    r = sympy.Symbol("r", real=True)
    return {}, {OWN: 1 - 2 * r, "smallness": -r}


class Pairs:
    """Distances in groups, one for each pair, of one function for each image."""

    def __init__(self, count: int, cosine: float) -> None:
        pairs = combinations(range(count), 2)
        self.reads = np.array([[2 * i, 2 * i + 1, 2 * j, 2 * j + 1] for i, j in pairs])
        self._kernel = gap().kernel
        self._parameters = [np.array([p, q, cosine]) for p, q in IMAGES]

    def derivatives(self, points: Array) -> tuple[Array, Array, Array]:
        """Return values, gradients and Hessians of every pair and image; see ``Local``."""
        local = wrapped(points)[:, self.reads]
        inputs = np.concatenate([local, np.zeros((*local.shape[:2], 1))], axis=2).reshape(-1, 5)
        images = [self._kernel.over(inputs, p.ctypes.data, 2) for p in self._parameters]
        values, gradients, hessians = (np.stack(part, axis=1) for part in zip(*images, strict=True))
        outer = (*local.shape[:2], len(IMAGES))
        return (
            values.reshape(outer),
            gradients.reshape(*outer, 5)[..., :4],
            hessians.reshape(*outer, 5, 5)[..., :4, :4],
        )


def wrapped(centres: Array) -> Array:
    """Bring lattice coordinates into ``(-1/2, 1/2]``."""
    return np.asarray(centres - np.ceil(centres - 0.5))


def uncut(along: Array) -> Array:
    """Turn a circle of length 1 so that its largest stretch without points lies at 1/2."""
    places = np.sort(along % 1.0)
    gaps = np.diff(places, append=places[0] + 1)
    widest = int(np.argmax(gaps))
    turned = along - (places[widest] + gaps[widest] / 2) + 0.5
    return wrapped(turned)


def components(count: int, joined: list[tuple[int, int]]) -> tuple[tuple[int, ...], ...]:
    """Return the connected components of a graph on ``1..count``, the largest first."""
    from networkx.utils import UnionFind

    sets = UnionFind(range(1, count + 1))
    for i, j in joined:
        sets.union(i, j)
    parts = [tuple(sorted(part)) for part in sets.to_sets()]
    return tuple(sorted(parts, key=lambda part: (-len(part), part)))


def translates(one: Array, other: Array, tolerance: float) -> bool:
    """Whether a translation of the torus carries one set of points ``(k, 2)`` to another."""
    if len(one) != len(other):
        return False
    for shift in other - one[0]:
        apart = (one + shift)[:, None] - other
        close = abs(apart - np.round(apart)).max(axis=2) <= tolerance
        if close.any(axis=0).all() and close.any(axis=1).all():
            return True
    return False
