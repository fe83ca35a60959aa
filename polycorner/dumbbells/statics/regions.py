"""Regions of a rectangle between curves, on a grid of nodes that is even in logarithms.

Neighbouring nodes are in one region unless a curve passes between them, so that curves bound
regions exactly and the grid only tells which parts are one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.interpolate import Akima1DInterpolator

from polycorner.toolkit import Array, Checked, cached_property


@dataclass(frozen=True, eq=False)
class Plane(Checked):
    """A rectangle of two positive numbers, and nodes in it.

    Attributes
    ----------
    rectangle : ((float, float), (float, float))
        Least and largest values of either.
    nodes : int
        Along either side, each in the middle of its cell.
    """

    rectangle: tuple[tuple[float, float], tuple[float, float]]
    nodes: int

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """Values at the nodes along either side."""
        parts = (np.arange(self.nodes) + 0.5) / self.nodes
        first, second = (low * (high / low) ** parts for low, high in self.rectangle)
        return first, second

    def placed(self, points: Array) -> Array:
        """Return points ``(k, 2)`` in units of the grid."""
        low, high = np.log(np.transpose(self.rectangle))
        return np.asarray((np.log(points) - low) / (high - low) * self.nodes - 0.5)

    def smooth(self, points: Array, fine: float = 1.0) -> Array:
        """Return a polyline on the grid through points of a curve, with steps up to ``fine``."""
        line = self.placed(points)
        steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        kept = np.concatenate([[True], steps > 0])
        if kept.sum() < 2:
            return line[:0]
        along = np.concatenate([[0.0], np.cumsum(steps)])[kept]
        count = max(int(along[-1] / fine), 1) + 1
        at = np.union1d(along, np.linspace(0, along[-1], count))
        return np.asarray(Akima1DInterpolator(along, line[kept], method="makima")(at))

    def labels(self, lines: Sequence[Array]) -> NDArray[np.int64]:
        """Return the number of the region of each node, ``(nodes, nodes)``."""
        n = self.nodes
        ways = np.ones((2, n, n), dtype=bool)  # to the next node along either side
        ways[0, -1], ways[1, :, -1] = False, False
        for line in lines:
            for one, two in pairwise(line):
                for k in (0, 1):
                    self._close(ways[k], k, one, two)
        index = np.arange(n * n).reshape(n, n)
        pairs = [np.stack([index[ways[k]], np.roll(index, -1, axis=k)[ways[k]]]) for k in (0, 1)]
        rows, columns = np.hstack(pairs)
        graph = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(n * n, n * n))
        found = sparse.csgraph.connected_components(graph, directed=False)[1]
        return np.asarray(found.reshape(n, n), dtype=np.int64)

    def _close(self, ways: NDArray[np.bool_], k: int, one: Array, two: Array) -> None:
        """Close the ways along side ``k`` that a segment crosses."""
        (low, at), (high, end) = sorted(((one[1 - k], one[k]), (two[1 - k], two[k])))
        across = np.arange(np.floor(low) + 1, np.floor(high) + 1)
        if not len(across):
            return
        along = np.floor(at + (across - low) / (high - low) * (end - at))
        within = (across >= 0) & (across < self.nodes) & (along >= 0) & (along < self.nodes - 1)
        i, j = along[within].astype(int), across[within].astype(int)
        ways[(i, j) if k == 0 else (j, i)] = False

    def at(self, node: tuple[int, int]) -> tuple[float, float]:
        """Return the numbers at a node."""
        return float(self.axes[0][node[0]]), float(self.axes[1][node[1]])

    def points(self, line: Array) -> Array:
        """Return the numbers along a polyline on the grid, ``(k, 2)``."""
        low, high = np.log(np.transpose(self.rectangle))
        return np.asarray(np.exp(low + (line + 0.5) / self.nodes * (high - low)))

    def around(self, places: Array) -> NDArray[np.int64]:
        """Return the nearest node of each place on the grid, ``(k, 2)``."""
        return np.clip(np.rint(places), 0, self.nodes - 1).astype(np.int64)


def joined(one: Array, two: Array, lines: Sequence[Array]) -> bool:
    """Whether the way between two places crosses no line."""
    way = two - one
    for line in lines:
        step = np.diff(line, axis=0)
        side = _turn(way, line - one)
        across = _turn(step, one - line[:-1]) * _turn(step, two - line[:-1]) < 0
        if (across & (side[:-1] * side[1:] <= 0)).any():
            return False
    return True


def _turn(one: Array, two: Array) -> Array:
    return np.asarray(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0])


def deepest(region: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the node of a region that is farthest from others."""
    inside = ndimage.distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1]
    i, j = np.unravel_index(int(np.argmax(inside)), inside.shape)
    return int(i), int(j)


def filled(labels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return labels with those that are negative replaced by the nearest others."""
    _, (i, j) = ndimage.distance_transform_edt(labels < 0, return_indices=True)
    return np.asarray(labels[i, j], dtype=np.int64)


def near(line: Array, lines: Sequence[Array], distance: float) -> bool:
    """Whether all points of a line are within a distance of others."""
    left = line
    for other in lines:
        one, way = other[:-1], np.diff(other, axis=0)
        length = np.maximum((way**2).sum(axis=1), np.finfo(float).tiny)
        part = np.clip(((left[:, None] - one) * way).sum(axis=2) / length, 0, 1)
        apart = np.linalg.norm(left[:, None] - one - part[..., None] * way, axis=2)
        left = left[apart.min(axis=1, initial=np.inf) > distance]
        if not len(left):
            return True
    return not len(left)
