"""Boxes that wait in a search, and the tree of their subdivision.

Nodes are numbered as they are made, the two halves of a box one after the other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array

CLOSED, OPEN = -1, -2
SPLIT = ("nodes", "axes", "positions", "first")  # columns of the records of splits
DIRECTED = ("owners", "vectors")  # columns of the directions of closed boxes


class Batch:
    """Arrays with a row for each of several things."""

    def part(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Self:
        """Return some of them."""
        return type(self)(*(array[keep] for array in vars(self).values()))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return several batches, one or more, as one."""
        return cls(*map(np.concatenate, zip(*(vars(p).values() for p in parts), strict=True)))


@dataclass
class Boxes(Batch):
    """Boxes that wait, ``(B, n)`` each.

    With their numbers in the tree, and the bisections since a candidate was tried there.
    """

    lower: Array
    upper: Array
    nodes: NDArray[np.int64]
    since: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.lower)

    @property
    def middles(self) -> Array:
        """Their middles, ``(B, n)``."""
        return 0.5 * (self.lower + self.upper)


def bisected(lower: Array, upper: Array, axes: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return the halves of boxes along an axis each: all first halves, then all second ones."""
    each = np.arange(len(lower))
    first, second = upper.copy(), lower.copy()
    first[each, axes] = second[each, axes] = (0.5 * (lower + upper))[each, axes]
    return np.concatenate([lower, second]), np.concatenate([first, upper])


@dataclass
class Tree:
    """Records of all nodes, in pieces that are joined on demand.

    A node's code is the axis along which it was split, ``CLOSED``, or ``OPEN``.
    """

    count: int = 1
    _split: list[tuple[NDArray[np.int64], NDArray[np.int8], Array, NDArray[np.int64]]] = field(
        default_factory=list
    )
    _closed: list[NDArray[np.int64]] = field(default_factory=list)
    _directions: list[tuple[NDArray[np.int64], NDArray[np.float32]]] = field(default_factory=list)

    def close(self, nodes: NDArray[np.int64], owners: NDArray[np.int64], directions: Array) -> None:
        """Record boxes as closed, and directions ``(I, n)`` for some nodes, ``owners``."""
        self._closed.append(nodes)
        # The tests of boxes have used directions of single precision: nothing is rounded here.
        self._directions.append((owners, directions.astype(np.float32)))

    def split(
        self, nodes: NDArray[np.int64], axes: NDArray[np.intp], positions: Array
    ) -> NDArray[np.int64]:
        """Record boxes as split; return the numbers of the first halves, the second follow them."""
        # The second half of a node has the next number, so that one number stores both.
        first = self.count + 2 * np.arange(len(nodes))
        self._split.append((nodes, axes.astype(np.int8), positions, first))
        self.count += 2 * len(nodes)
        return first

    @property
    def marks(self) -> tuple[int, int]:
        """How many records of splits and of closed boxes there are."""
        return len(self._split), len(self._closed)

    def records(self, marks: tuple[int, int] = (0, 0)) -> dict[str, NDArray[Any]]:
        """Return what was recorded since some marks, as arrays by name; see :meth:`extend`."""
        splits, closed = self._split[marks[0] :], self._closed[marks[1] :]
        directions = self._directions[marks[1] :]
        found: dict[str, NDArray[Any]] = {"count": np.array(self.count)}
        if splits:
            columns = [np.concatenate(column) for column in zip(*splits, strict=True)]
            found |= dict(zip(SPLIT, columns, strict=True))
        if closed:
            columns = [np.concatenate(column) for column in zip(*directions, strict=True)]
            found |= {"closed": np.concatenate(closed), **dict(zip(DIRECTED, columns, strict=True))}
        return found

    def extend(self, records: Mapping[str, NDArray[Any]]) -> None:
        """Add what another tree recorded after this one was like it."""
        self.count = int(records["count"])
        if SPLIT[0] in records:
            nodes, axes, positions, first = (records[name] for name in SPLIT)
            self._split.append((nodes, axes, positions, first))
        if "closed" in records:
            owners, vectors = (records[name] for name in DIRECTED)
            self._closed.append(records["closed"])
            self._directions.append((owners, vectors))

    def preorder(self) -> tuple[NDArray[np.int8], Array, NDArray[np.uint16], NDArray[np.float32]]:
        """Return the tree with each node before its halves.

        Returns
        -------
        codes : (nodes,) array
        positions : (splits,) array
            Where boxes are split.
        counts : (closed,) array
            How many directions belong to each closed node.
        directions : (I, n) array
            All of them, in this order.
        """
        # What is neither split nor closed waits, or is undecided.
        codes = np.full(self.count, OPEN, dtype=np.int8)
        where, first = np.zeros(self.count), np.zeros(self.count, dtype=np.int64)
        for nodes, axes, positions, children in self._split:
            codes[nodes], where[nodes], first[nodes] = axes, positions, children
        for nodes in self._closed:
            codes[nodes] = CLOSED
        order = _preorder(codes, first)
        owners = np.concatenate([o for o, _ in self._directions] or [np.zeros(0, np.int64)])
        vectors = [v for _, v in self._directions]
        n = vectors[0].shape[1] if vectors else 0
        joined = np.concatenate(vectors) if vectors else np.zeros((0, n), np.float32)
        rank = np.empty(self.count, dtype=np.int64)
        rank[order] = np.arange(len(order))
        # A node may have no direction (outside, or in a region) or several, one for each branch.
        counts = np.bincount(owners, minlength=self.count)[order]
        ordered = codes[order]
        # Stable, as directions of one node belong to its branches in their order.
        by_rank = np.argsort(rank[owners], kind="stable")
        return (
            ordered,
            where[order][ordered >= 0],
            counts[ordered == CLOSED].astype(np.uint16),
            joined[by_rank],
        )


def _preorder(codes: NDArray[np.int8], first: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the nodes of a tree, each before its halves."""
    order = np.empty(len(codes), dtype=np.int64)
    waiting, place = [0], 0
    split, children = (codes >= 0).tolist(), first.tolist()
    while waiting:
        node = waiting.pop()
        order[place] = node
        place += 1
        if split[node]:
            # The first half is popped next, so it is pushed last.
            waiting += [children[node] + 1, children[node]]
    return order[:place]
