"""Boxes that wait in a search."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array


@dataclass
class Boxes:
    """Boxes that wait, ``(B, n)`` each.

    With their numbers in the tree, and the bisections since a candidate was tried there.
    """

    lower: Array
    upper: Array
    nodes: NDArray[np.int64]
    since: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.lower)

    def part(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Boxes":
        """Return some of them."""
        return Boxes(self.lower[keep], self.upper[keep], self.nodes[keep], self.since[keep])

    def with_others(self, *others: "Boxes") -> "Boxes":
        """Return these and others."""
        return joined([self, *others])

    @property
    def middles(self) -> Array:
        """Their middles, ``(B, n)``."""
        return 0.5 * (self.lower + self.upper)


def joined(parts: Sequence[Boxes]) -> Boxes:
    """Return several collections as one."""
    return Boxes(
        np.concatenate([p.lower for p in parts]),
        np.concatenate([p.upper for p in parts]),
        np.concatenate([p.nodes for p in parts]),
        np.concatenate([p.since for p in parts]),
    )
