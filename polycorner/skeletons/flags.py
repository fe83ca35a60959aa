"""Two-dimensional faces put together from the flags around corners."""

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any

# An edge (its end at a corner, or its position) and the names of a face beside it.
Flag = tuple[str, Any, frozenset[str]]


@dataclass(frozen=True)
class Crossing:
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
