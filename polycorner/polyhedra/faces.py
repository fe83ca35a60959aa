"""Two-dimensional faces put together from the flags around corners."""

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner.geometry.manifold import Array
from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.curves import Frame, Ground, settle
from polycorner.polyhedra.strata import RANK_TOLERANCE

STEP = 1e-3

# An edge (its end at a corner, or its position) and the names of a face beside it.
Flag = tuple[str, Any, frozenset[str]]


@dataclass(frozen=True)
class Passage:
    """A straight way across a face, from one of its edges to another."""

    start: Flag
    stop: Flag


class Forest:
    """Disjoint sets of hashable things (union-find with path halving)."""

    def __init__(self) -> None:
        self._parent: dict[Hashable, Hashable] = {}

    def find(self, item: Hashable) -> Hashable:
        """Return the representative of the set that the item is in, adding it if it is new."""
        parent = self._parent
        parent.setdefault(item, item)
        while parent[item] != item:
            parent[item] = parent[parent[item]]
            item = parent[item]
        return item

    def join(self, one: Hashable, other: Hashable) -> None:
        """Put two items into one set."""
        self._parent[self.find(one)] = self.find(other)

    def groups(self, items: Iterable[Any]) -> list[list[Any]]:
        """Return the items by set, in the order they come."""
        found: dict[Hashable, list[Any]] = {}
        for item in items:
            found.setdefault(self.find(item), []).append(item)
        return list(found.values())


def inward(
    ground: Ground, q: Array, active: frozenset[int], face: frozenset[int]
) -> tuple[Frame, Array] | None:
    """Return a point a little inside a face from a point of an edge, and the way there.

    None where the face is not beside the edge.
    """
    spot = ground.spot(q)
    along = null_space(spot.matrix(spot.basis(active)), RANK_TOLERANCE)[:, 0]
    kept = spot.basis(face)
    frame = Frame(ground, q, kept)
    scales = ground.polyhedron.manifold.scale_array
    opened = sorted(active - face)
    slopes = spot.gradients[opened] / np.linalg.norm(spot.gradients[opened], axis=1)[:, None]
    v = frame.tangent(slopes.sum(axis=0))
    v = v - (v @ along) * along
    for way in (v, -v) if ground.polyhedron.is_union else (v,):
        ahead = settle(ground, q + STEP * scales * way, kept, STEP)
        if ahead is not None and ahead.active() == face:
            return ahead, way
    return None
