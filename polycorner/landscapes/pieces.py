"""Classes of the pieces of a set near a critical point, and their nerve.

See :mod:`~polycorner.landscapes.passes`.
"""

from collections.abc import Sequence
from itertools import combinations

from polycorner.polyhedra.polyhedron import Piece


def parted(active: frozenset[int], pieces: Sequence[Piece]) -> list[Piece]:
    """Return a piece of each class of those that lower points join."""
    root = list(range(len(pieces)))

    def find(a: int) -> int:
        while root[a] != a:
            a = root[a]
        return a

    for a, b in combinations(range(len(pieces)), 2):
        if pieces[a] | pieces[b] != active:
            root[find(b)] = find(a)
    return [piece for k, piece in enumerate(pieces) if root[k] == k]


def nerve(active: frozenset[int], pieces: Sequence[Piece]) -> int:
    """Return the Euler characteristic of the nerve of lower points in pieces."""
    chi = 0
    for size in range(1, len(pieces) + 1):
        some = (frozenset[int]().union(*chosen) for chosen in combinations(pieces, size))
        chi -= (-1) ** size * sum(union != active for union in some)
    return chi
