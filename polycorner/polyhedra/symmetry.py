"""Symmetries of a polyhedron: continuous motions and relabellings.

A continuous symmetry is given by its tangent vectors and by invariants that tell its orbits
apart; a discrete one by the relabellings that carry one point to another.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value

# From the names of functions at one point to the names of the same bodies' functions at another.
Relabelling = Mapping[str, str]


@dataclass(frozen=True)
class Element(Value):
    """An element of a finite symmetry group: a map of points, and how it renames functions.

    Attributes
    ----------
    apply : callable
        From a point ``(n,)`` to its image.
    names : mapping from str to str
        ``names[f]`` is the function that takes at the image the value of ``f`` at the point;
        functions that are not listed keep their names.
    """

    apply: Callable[[Array], Array]
    names: Relabelling


@dataclass(frozen=True)
class Symmetry(Value):
    """A group of symmetries of a polyhedron, continuous, finite or both.

    It can be pickled where its functions can: module-level functions and methods of values.

    Attributes
    ----------
    tangents : callable, optional
        ``(n,) -> (g, n)``: vectors that span the orbit of the continuous symmetries at a point,
        in the manifold's coordinates.  Every function must be constant along them.
    invariants : callable, optional
        ``(n,) -> (k,)``: continuous in the point, equal exactly on orbits of the continuous
        symmetries, of the size of the manifold's scales.  Default: the coordinates themselves.
    elements : sequence of Element, optional
        A finite group, without the identity.
    key : callable, optional
        ``(n,) -> (k,)``: continuous numbers that relabellings do not change; tells most points
        apart before relabellings are looked for.
    relabel : callable, optional
        ``(p, q, tolerance) -> relabellings`` that carry ``p`` to the orbit of ``q``, for groups
        that are too large to list; replaces ``elements``.
    """

    tangents: Callable[[Array], Array] | None = None
    invariants: Callable[[Array], Array] | None = None
    elements: Sequence[Element] = ()
    key: Callable[[Array], Array] | None = None
    relabel: Callable[[Array, Array, float], Sequence[Relabelling]] | None = None

    @property
    def relabels(self) -> bool:
        """Whether functions may change their names."""
        return self.relabel is not None or any(
            name != image for g in self.elements for name, image in g.names.items()
        )

    @property
    def group(self) -> list[Element]:
        """The finite group with the identity first."""
        return [Element(_same, {}), *self.elements]

    def directions(self, manifold: Manifold, q: Array) -> Array:
        """Return the scaled tangent vectors of the orbit, ``(g, n)``."""
        if self.tangents is None:
            return np.empty((0, manifold.dimension))
        return np.asarray(self.tangents(q), dtype=np.float64) / manifold.scale_array

    def separation(self, manifold: Manifold, p: Array, q: Array) -> float:
        """Return how far the continuous orbits of two points are apart, in scale units."""
        if self.invariants is None:
            apart = manifold.difference(p, q) / manifold.scale_array
        else:
            apart = self.invariants(p) - self.invariants(q)
        return float(abs(apart).max())

    def relabellings(
        self, manifold: Manifold, p: Array, q: Array, tolerance: float
    ) -> list[Relabelling]:
        """Return every relabelling that carries ``p`` to the orbit of ``q``; none if none does."""
        if self.key is not None and abs(self.key(p) - self.key(q)).max() > tolerance:
            return []
        if self.relabel is not None:
            return list(self.relabel(p, q, tolerance))
        return [
            element.names
            for element in self.group
            if self.separation(manifold, element.apply(p), q) <= tolerance
        ]


def _same(q: Array) -> Array:
    return q


def renamed(names: frozenset[str], relabelling: Relabelling) -> frozenset[str]:
    """Return the names after a relabelling."""
    return frozenset(relabelling.get(name, name) for name in names)
