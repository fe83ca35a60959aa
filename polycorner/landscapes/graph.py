"""Least heights at which nodes of a weighted graph are joined.

The *bottleneck* of two nodes is the least weight ``w`` such that links of weight at most ``w`` join
them.  It does not decrease when weights grow or links are left out: with lower bounds of the
weights, and links wherever there may be one, it is a lower bound; with upper bounds, and those
links alone that are shown, an upper bound.  The links of a minimal spanning forest have the
same bottlenecks as all (Kruskal).
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class Tie:
    """A link between nodes, which joins all of them.

    Attributes
    ----------
    nodes : tuple of int
    weight : float
    source : int
        What the link is made of: the number of a pass.
    """

    nodes: tuple[int, ...]
    weight: float
    source: int


@dataclass(frozen=True)
class Joined:
    """Where a link joins two classes of nodes: their least members, the smaller number first."""

    link: Tie
    first: int
    second: int


class Forest:
    """The minimal spanning forest of a graph, links of equal weight in the given order."""

    def __init__(self, count: int, links: Iterable[Tie]) -> None:
        self.root = list(range(count))
        self.joins: list[Joined] = []
        self._next: list[list[tuple[int, Tie]]] = [[] for _ in range(count)]
        for link in sorted(links, key=lambda one: one.weight):
            for a, b in zip(link.nodes, link.nodes[1:], strict=False):
                first, second = sorted((self.find(a), self.find(b)))
                if first != second and link.weight < inf:
                    self.root[second] = first
                    self.joins.append(Joined(link, first, second))
                    self._next[a].append((b, link))
                    self._next[b].append((a, link))

    def find(self, a: int) -> int:
        """Return the least node of the class of a node."""
        while self.root[a] != a:
            self.root[a] = a = self.root[self.root[a]]
        return a

    def path(self, a: int, b: int) -> Sequence[tuple[int, int, Tie]] | None:
        """Return the links ``(from, to, link)`` on the way between two nodes; None if none."""
        before: dict[int, tuple[int, Tie] | None] = {a: None}
        waiting = deque([a])
        while waiting and b not in before:
            here = waiting.popleft()
            for there, link in self._next[here]:
                if there not in before:
                    before[there] = (here, link)
                    waiting.append(there)
        if b not in before:
            return None
        steps: list[tuple[int, int, Tie]] = []
        while (last := before[b]) is not None:
            steps.append((last[0], b, last[1]))
            b = last[0]
        return steps[::-1]

    def bottleneck(self, a: int, b: int) -> float:
        """Return the least height at which two nodes are joined; infinite if they never are."""
        found = self.path(a, b)
        return inf if found is None else max((link.weight for _, _, link in found), default=-inf)
