"""Heights at which wells of a function of two coordinates are joined, on grids, from both sides.

Below: cells that cover the set, each with a lower bound of the energy on it, next to each other if
they share a corner.  Above: segments between nodes that lie in the set, with an upper bound of the
energy on them.  Bounds are Taylor's, of second order, with second derivatives from the grid
itself: the greatest nearby, times ``SLACK``.  Nothing here is of the package.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np
import sympy as sp
from scipy.ndimage import maximum_filter

Array = np.ndarray
Tree = Any  # the number of a function, ("and", tree, ...) or ("or", tree, ...)
SLACK = 1.25  # of second derivatives between nodes
WAYS = ((1, 0), (0, 1), (1, 1), (1, -1))
REACH = 8  # cells about a minimum in which nodes may be joined to it
SAMPLES = np.linspace(0.0, 1.0, 33)
TINY = 1e-9  # of functions that vanish at a minimum


def implicit(tree: Tree, values: Array) -> Array:
    """Return the least of an "and", the greatest of an "or"."""
    if isinstance(tree, int):
        return values[tree]
    parts = [implicit(part, values) for part in tree[1:]]
    if not parts:
        return np.full(values.shape[1:], np.inf)
    return (np.minimum if tree[0] == "and" else np.maximum).reduce(parts)


@dataclass(frozen=True)
class Chart:
    """A set and an energy in two coordinates.

    Attributes
    ----------
    symbols : two symbols
    energy : expression
    functions : tuple of expressions
    tree : Tree
        How ``f >= 0`` are joined.
    sides : two pairs of numbers
        Between which the set lies, with room.
    around : (bool, bool)
        Whether a side is a whole circle.
    poles : bool
        Whether all of each end of the second side is one point.
    region : tuple of expressions
        Functions that are at least zero in the region, where one may be left.
    """

    symbols: tuple[sp.Symbol, sp.Symbol]
    energy: sp.Expr
    functions: tuple[sp.Expr, ...]
    tree: Tree
    sides: tuple[tuple[float, float], tuple[float, float]]
    around: tuple[bool, bool] = (False, False)
    poles: bool = False
    region: tuple[sp.Expr, ...] = ()

    @cached_property
    def _compiled(self) -> list[Any]:
        """Values, slopes and second derivatives, one function for each expression."""
        u, v = self.symbols
        found = []
        for f in map(sp.sympify, (self.energy, *self.functions, *self.region)):
            fu, fv = f.diff(u), f.diff(v)
            parts = [f, fu, fv, fu.diff(u), fu.diff(v), fv.diff(v)]
            found.append(sp.lambdify([u, v], parts, "numpy", cse=True))
        return found

    def jets(self, u: Array, v: Array, of: Sequence[int] | None = None) -> Array:
        """Return values, slopes and second derivatives of energy and functions, (1 + m, 6, ...).

        ``of`` are the numbers of some of them; the energy has the number 0.
        """
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        chosen = range(len(self._compiled)) if of is None else of
        found = np.empty((len(chosen), 6, *u.shape))
        for row, k in enumerate(chosen):
            for column, part in enumerate(self._compiled[k](u, v)):
                found[row, column] = part
        return found

    def values(self, u: Array, v: Array) -> Array:
        """Return the values of energy and functions."""
        return self.jets(u, v)[:, 0]

    def inside(self, values: Array, tolerance: float = 0.0) -> Array:
        """Whether points lie in the set, from values of all functions, the energy not among."""
        return implicit(self.tree, values[: len(self.functions)]) >= -tolerance

    def unrolled(self, at: Array, point: Array) -> Array:
        """Return the image of a point by whole turns that is nearest to another."""
        turn = np.array([b - a for a, b in self.sides])
        return point - np.where(self.around, turn * np.rint((point - at) / turn), 0.0)


@numba.njit(cache=True)
def _merged(links: Array, heights: Array, born: Array, count: int) -> Any:
    """Join nodes by links ``(k, 2)``, the lowest first.

    Returns ``(a, b, height)`` where groups with seeds were joined, and how deep the deepest well
    without one is.  Seeds are the first ``count`` nodes; ``born`` are the weights of nodes.
    """
    root, seed = np.arange(len(born)), np.arange(len(born))
    born = born.copy()
    found = [(0, 0, 0.0) for _ in range(0)]
    stray = 0.0
    for k in range(len(links)):
        p, q = links[k]
        while root[p] != p:
            root[p] = p = root[root[p]]
        while root[q] != q:
            root[q] = q = root[root[q]]
        if p == q:
            continue
        if seed[p] < count and seed[q] < count:
            found.append((seed[p], seed[q], heights[k]))
        else:
            lone = p if seed[p] >= count and (seed[q] < count or born[p] > born[q]) else q
            if born[lone] < np.inf:
                stray = max(stray, heights[k] - born[lone])
        root[p] = q
        seed[q] = min(seed[p], seed[q])
        born[q] = min(born[p], born[q])
    return found, stray


@dataclass(frozen=True)
class Flood:
    """Heights at which seeds are joined, (k, k), the outside last; how deep a lone well is."""

    heights: Array
    stray: float


class Grid:
    """A chart on ``n`` nodes a side."""

    def __init__(self, chart: Chart, n: int) -> None:
        self.chart = chart
        axes = [
            np.linspace(a, b, n, endpoint=not circle)
            for (a, b), circle in zip(chart.sides, chart.around, strict=True)
        ]
        self.steps = np.array([axis[1] - axis[0] for axis in axes])
        self.low = np.array([axis[0] for axis in axes])
        self.shape = (n, n)
        self.nodes = np.meshgrid(*axes, indexing="ij")
        self.jets = chart.jets(*self.nodes)
        # The greatest second derivatives nearby.
        modes = ["wrap" if circle else "nearest" for circle in chart.around]
        curved = maximum_filter(abs(self.jets[:, 3:]), size=3, mode=modes, axes=(2, 3))
        self.curved = SLACK * curved

    def bend(self, step: Array) -> Array:
        """Return bounds of ``|s'' f|`` for a step ``s``, of all functions."""
        a, b = abs(step)
        c = self.curved
        return a * a * c[:, 0] + 2 * a * b * c[:, 1] + b * b * c[:, 2]

    def room(self) -> Array:
        """Return how much functions may differ in a cell from their values at the node."""
        half = self.steps / 2
        slope = abs(self.jets[:, 1]) * half[0] + abs(self.jets[:, 2]) * half[1]
        return slope + self.bend(half) / 2

    def below(self, seeds: Sequence[Array], leave: bool = False, stay: bool = False) -> Flood:
        """Flood cells that cover the set.

        Parameters
        ----------
        seeds : sequence of points
            Points of the set.
        leave : bool
            Whether cells beyond the region belong to one more seed, the outside.
        stay : bool
            Whether the region alone is flooded.
        """
        room = self.room()
        value, m = self.jets[:, 0], len(self.chart.functions)
        meets = self.chart.inside((value + room)[1:])
        most = (value + room)[1 + m :]
        if stay:
            meets = meets & (most >= 0).all(axis=0)
        weight = np.where(meets, value[0] - room[0], np.inf)
        links = np.ones((4, *self.shape), bool)
        extra = [(self._node(q), k) for k, q in enumerate(seeds)]
        for node, _ in extra:
            if weight.flat[node] == np.inf:
                msg = "a minimum lies in no cell of the set"
                raise AssertionError(msg)
        gone = meets & ((value - room)[1 + m :] <= 0).any(axis=0) if leave else None
        return self._flooded(weight, links, extra, len(seeds), gone)

    def above(self, seeds: Sequence[Array], leave: bool = False, stay: bool = False) -> Flood:
        """Flood segments in the set; the arguments are those of :meth:`below`."""
        value, m = self.jets[:, 0], len(self.chart.functions)
        rise = np.zeros(self.shape)
        links = np.zeros((4, *self.shape), bool)
        for k, way in enumerate(WAYS):
            bend = self.bend(np.array(way) * self.steps)
            rise = np.maximum(rise, bend[0] / 8)
            there = value
            for axis, shift in enumerate(way):
                there = np.roll(there, -shift, axis=axis + 1)
            least = (np.minimum(value, there) - bend / 8)[1:]
            good = self.chart.inside(least)
            if stay:
                good &= (least[m:] >= 0).all(axis=0)
            links[k] = good
        kept = self.chart.inside(value[1:])
        if stay:
            kept &= (value[1 + m :] >= 0).all(axis=0)
        weight = np.where(kept, value[0] + rise, np.inf)
        extra = [(node, k) for k, q in enumerate(seeds) for node in self._reached(q, weight)]
        gone = kept & (value[1 + m :] <= 0).any(axis=0) if leave else None
        return self._flooded(weight, links, extra, len(seeds), gone)

    def euler(self, cap: float) -> int | None:
        """Return the Euler characteristic of the set up to an energy, if inner and outer agree."""
        value = self.jets[:, 0]
        room = self.room()
        outer = self.chart.inside((value + room)[1:]) & (value[0] - room[0] <= cap)
        inner = self.chart.inside((value - room)[1:]) & (value[0] + room[0] <= cap)
        around = self.chart.around
        found = {
            _euler(np.pad(cells, [(0, 1 - c) for c in around]), wide)
            for cells, wide in ((outer, True), (inner, False))
        }
        return found.pop() if len(found) == 1 and not self.chart.poles else None

    def _node(self, q: Array) -> int:
        """Return the node whose cell contains a point."""
        ij = np.rint((np.asarray(q) - self.low) / self.steps).astype(int)
        ij = np.where(self.chart.around, ij % self.shape, np.clip(ij, 0, np.array(self.shape) - 1))
        return int(ij[0] * self.shape[1] + ij[1])

    def _reached(self, q: Array, weight: Array) -> list[int]:
        """Return a node near a minimum to which a segment leads in the set, the lowest such."""
        q = np.asarray(q)
        i, j = divmod(self._node(q), self.shape[1])
        offsets = np.arange(-REACH, REACH + 1)
        rows, columns = (a.ravel() for a in np.meshgrid(i + offsets, j + offsets))
        fine = np.ones(len(rows), bool)
        for k, (index, circle) in enumerate(zip((rows, columns), self.chart.around, strict=True)):
            fine &= circle | ((index >= 0) & (index < self.shape[k]))
        rows, columns = rows[fine] % self.shape[0], columns[fine] % self.shape[1]
        known = np.isfinite(weight[rows, columns])
        rows, columns = rows[known], columns[known]
        ends = self.chart.unrolled(
            q, np.stack([self.nodes[0][rows, columns], self.nodes[1][rows, columns]], axis=-1)
        )
        on = q + SAMPLES[:, None, None] * (ends - q)
        values = self.chart.values(on[..., 0], on[..., 1])
        # Between samples functions bend by so much at most, as seen from the chord.
        c = self.curved.max(axis=(2, 3))
        u, v = abs(ends - q).max(axis=0) / (len(SAMPLES) - 1)
        bend = ((u * u * c[:, 0] + 2 * u * v * c[:, 1] + v * v * c[:, 2]) / 8)[:, None, None]
        least = np.minimum(values[:, :-1], values[:, 1:]) - bend
        # From a zero on, f >= t f(1) - 4 t (1 - t) bend.
        least[:, :1] = np.where(values[:, :1] >= -TINY, values[:, 1:2] - 4 * bend, -1.0)
        inside = self.chart.inside(least[1:]).all(axis=0)
        values[0] += bend[0]
        if not inside.any():
            return []
        top = np.where(inside, np.maximum(values[0].max(axis=0), weight[rows, columns]), np.inf)
        best = int(top.argmin())
        node = int(rows[best] * self.shape[1] + columns[best])
        weight.flat[node] = max(weight.flat[node], top[best])
        return [node]

    def _flooded(
        self, weight: Array, links: Array, seeds: list[tuple[int, int]], count: int, gone: Any
    ) -> Flood:
        """Return the heights of seeds; ``seeds`` are nodes and the seeds that they belong to."""
        number = np.arange(weight.size).reshape(self.shape)
        pairs = []
        for k, way in enumerate(WAYS):
            there = np.roll(number, (-way[0], -way[1]), axis=(0, 1))
            kept = links[k] & np.isfinite(np.maximum(weight, weight.ravel()[there]))
            for axis, shift in enumerate(way):
                if shift and not self.chart.around[axis]:
                    kept[(slice(None),) * axis + (-1 if shift > 0 else 0,)] = False
            pairs.append(np.stack([number[kept], there[kept]], axis=-1))
        # Seeds come first, then what stands for the outside, for poles, and the nodes.
        belongs = list(seeds)
        if gone is not None:
            belongs += [(int(node), count) for node in np.flatnonzero(gone)]
            count += 1
        if self.chart.poles:
            belongs += [(int(node), count + k) for k in (0, 1) for node in number[:, -k]]
        first = count + 2
        more = np.array([(k, node + first) for node, k in belongs], dtype=int).reshape(-1, 2)
        every = np.concatenate([*(p + first for p in pairs), more])
        born = np.concatenate([np.full(first, np.inf), weight.ravel()])
        flat = np.concatenate([np.full(first, -np.inf), weight.ravel()])
        heights = flat[every].max(axis=1)
        order = np.argsort(heights)
        order = order[np.isfinite(heights[order])]
        found, stray = _merged(every[order], heights[order], born, count)
        return Flood(joined(count, found), stray)


def _euler(cells: Array, wide: bool) -> int:
    """Return vertices less edges plus cells of a union of cells, around both ends.

    Of closed cells if it is wide, joined by corners, too; else of what is inside their union.
    """
    both = np.logical_or if wide else np.logical_and
    along = [both(cells, np.roll(cells, 1, axis=axis)) for axis in (0, 1)]
    vertices = both(along[0], np.roll(along[0], 1, axis=1))
    return int(vertices.sum()) - sum(int(edges.sum()) for edges in along) + int(cells.sum())


def joined(count: int, links: Any) -> Array:
    """Return heights at which nodes are joined by links ``(a, b, height)``, lowest first."""
    heights = np.full((count, count), np.inf)
    groups = [{k} for k in range(count)]
    for a, b, height in links:
        one, other = groups[a], groups[b]
        if one is not other:
            for p in one:
                for q in other:
                    heights[p, q] = heights[q, p] = height
            one |= other
            for p in other:
                groups[p] = one
    return heights
