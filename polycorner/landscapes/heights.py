"""Lower bounds of an energy on the parts of a set in boxes, many at a time.

Let ``L = E - sum y_i f_i - sum z_j h_j`` with ``y_i >= 0`` for inequalities ``f_i >= 0`` that hold
in a branch, and any ``z_j`` for equations ``h_j = 0``.  On the points of the branch ``E >= L``, and
by the mean value theorem, where all are continuous with gradients enclosed on a box with middle
``c`` and half sides ``r``,

    ``L >= L(c) - sum_k r_k max |dL/dq_k|``.

For given enclosures the right side is concave in ``(y, z)``: it is the dual of a linear programme,
the least value of ``E`` to first order on the part of the box where ``f`` to first order is not
negative.  It is raised one weight at a time, to the best of the breakpoints of its slope.  At a
point where ``E`` is least, or passes over, on a wall, ``dL`` vanishes: the error is of second order
in the size of the box, while that of ``E`` alone is of first order there.  Whatever the weights
are, the bound holds; it is rounded downwards.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.branches import Mask, conjunctions, items
from polycorner.proofs.lists.contraction import narrowed
from polycorner.proofs.lists.entries import TINY, UNIT
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

SWEEPS = 3  # over the weights
MARKS = 1 << 24  # branches times functions times boxes, of one batch


@dataclass(frozen=True)
class Bounds:
    """Enclosures on boxes.

    Attributes
    ----------
    values, slopes : (lower, upper) of (B, M) and (B, M, n) arrays
        On the boxes.
    central : (lower, upper) of (B, M) arrays
        Values in the middles.
    continuous : (B, M) array of bool
    middles, reach : (B, n) arrays
        Points near the middles, and the largest distances of points of the box from them.
    """

    values: tuple[Array, Array]
    slopes: tuple[Array, Array]
    central: tuple[Array, Array]
    continuous: Mask
    middles: Array
    reach: Array


class Heights:
    """Lower bounds of the energy on the points of a set in boxes.

    ``exits`` is how many of the inequalities, the last ones, are those whose zeros are asked about.
    """

    def __init__(self, problem: Problem, exits: int = 0) -> None:
        self.functions = BoxFunctions(problem.functions, problem.polyhedron.manifold)
        self.m, self.k = problem.inequalities, len(problem.polyhedron.equations)
        self.exits = range(self.m - exits, self.m)
        self.conj = conjunctions(problem.polyhedron)
        self.most = max(1, MARKS // max(self.conj.size, 1))  # boxes of one batch

    def narrowed(self, lower: Array, upper: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Return which boxes may meet the set, and narrower sides of them."""
        kept, lows, highs = [], [], []
        for at in _batches(len(lower), self.most):
            low, high = lower[at], upper[at]
            bounds = self.functions.gradients(low, high, monotone=True)
            continuous = self.functions.continuous(low, high)
            alive = np.flatnonzero(self._alive(bounds[0], bounds[1]))
            empty = np.zeros(len(alive), dtype=np.int64)
            boxes = Boxes(low[alive], high[alive], empty, empty)
            parts = [side[alive] for side in bounds]
            least, most = narrowed(boxes, parts, continuous[alive], self.conj, self.k)
            some = (least <= most).all(axis=1)
            kept.append(alive[some] + at.start)
            lows.append(least[some])
            highs.append(most[some])
        return np.concatenate(kept), np.concatenate(lows), np.concatenate(highs)

    def _alive(self, low: Array, high: Array) -> Mask:
        """Return which boxes may meet the set, ``(B,)``."""
        m, k = self.m, self.k
        zero = np.all((low[:, m : m + k] <= 0) & (high[:, m : m + k] >= 0), axis=1)
        gone = np.any((high[:, None, :m] < 0) & self.conj, axis=2).all(axis=1)
        return np.asarray(zero & ~gone)

    def least(
        self, lower: Array, upper: Array, *, leaving: bool = False
    ) -> tuple[Array, Array, Mask]:
        """Return lower bounds of the energy, and what they may rise to when boxes are divided.

        Both are infinite where no point of the set lies.

        Parameters
        ----------
        lower, upper : (B, n) arrays
            The boxes.
        leaving : bool
            Whether to bound it on the zeros of the last inequalities as well.

        Returns
        -------
        on_set, on_zeros : (2, B) arrays
            The latter infinite if not asked for.
        cut : (B,) array of bool
            Whether functions may vanish in the box.
        """
        on_set, on_zeros = (np.full((2, len(lower)), np.inf) for _ in range(2))
        cut = np.full(len(lower), self.k > 0)
        for at in _batches(len(lower), self.most):
            bounds = self._bounds(lower[at], upper[at])
            low, high = bounds.values
            where, masks = items(self.conj, high[:, : self.m] < 0, low[:, : self.m] > 0)
            alive = self._alive(low, high)[where]
            where, masks = where[alive], masks[alive]
            cut[where[masks.any(axis=1)] + at.start] = True
            self._lower(on_set[:, at], where, self._items(bounds, where, masks, None))
            for row in self.exits if leaving else ():
                cross = (low[where, row] <= 0) & (high[where, row] >= 0)
                heights = self._items(bounds, where[cross], masks[cross], row)
                self._lower(on_zeros[:, at], where[cross], heights)
        return on_set, on_zeros, cut

    @staticmethod
    def _lower(found: Array, where: NDArray[np.intp], heights: Array) -> None:
        for row, height in zip(found, heights, strict=True):
            np.minimum.at(row, where, height)

    def _bounds(self, lower: Array, upper: Array) -> Bounds:
        c = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
        v_lo, v_hi, *slopes = self.functions.gradients(lower, upper, monotone=True)
        # By second derivatives: natural bounds of the slopes of bodies' gaps are wide.
        g_lo, g_hi = self.functions.mean_value_gradients(lower, upper)
        slopes = [np.fmax(slopes[0], g_lo), np.fmin(slopes[1], g_hi)]
        reach = np.maximum(upper - c, c - lower) * (1 + 4 * UNIT)
        central = self.functions.values(c, c)
        continuous = self.functions.continuous(lower, upper)
        return Bounds((v_lo, v_hi), (slopes[0], slopes[1]), central, continuous, c, reach)

    def _items(self, b: Bounds, where: NDArray[np.intp], masks: Mask, zero: int | None) -> Array:
        """Return the same for items ``(2, I)``, on the zeros of one of the functions perhaps."""
        natural = b.values[0][where, -1]
        if not where.size:
            return np.stack([natural, natural])
        m, n = self.m, b.reach.shape[1]
        with np.errstate(all="ignore"):
            steep = 0.5 * (b.slopes[0] + b.slopes[1])
            turn = np.einsum("bmk,bk->bm", abs(steep), b.reach)
            near = 0.5 * (b.central[0] + b.central[1]) / turn
        usable = b.continuous & np.isfinite(turn) & (turn > 0) & np.isfinite(near)
        rank = np.where(masks & usable[where, :m], near[where, :m], np.inf)
        if zero is not None:
            rank[:, zero] = np.inf
        chosen = np.argsort(rank, axis=1)[:, : n + 1]
        used = np.take_along_axis(rank, chosen, axis=1) < np.inf
        free = [*range(m, m + self.k), *([] if zero is None else [zero])]
        rows = np.hstack([chosen, np.tile(np.array(free, dtype=np.intp), (len(where), 1))])
        used = np.hstack([used, usable[where][:, free]])
        signed = np.arange(rows.shape[1]) < chosen.shape[1]
        dual = _Dual(b, where, rows, used, signed)
        found: Array = np.fmax(natural, dual.bounds(dual.weights()))
        return found


def _batches(count: int, most: int) -> list[slice]:
    return [slice(i, min(i + most, count)) for i in range(0, max(count, 1), most)]


class _Dual:
    """The lower bounds of items by weights of some rows."""

    def __init__(
        self, b: Bounds, where: NDArray[np.intp], rows: NDArray[np.intp], used: Mask, signed: Mask
    ) -> None:
        at = where[:, None]
        self.reach = b.reach[where]
        self.signed, self.used = signed, used
        self.fine = b.continuous[where, -1]
        v, g = b.central, b.slopes
        self.v = [np.where(used, side[at, rows], 0.0) for side in v]
        self.g = [np.where(used[:, :, None], side[at, rows], 0.0) for side in g]
        self.e = b.central[0][where, -1]
        self.slope = g[0][where, -1], g[1][where, -1]

    def weights(self) -> Array:
        """Return weights ``(I, P)`` with which the bounds are high."""
        none: Array = np.zeros(self.used.shape)
        with np.errstate(all="ignore"):
            tried = [self._raised(none), self._raised(self._balanced())]
            heights = [np.nan_to_num(self.bounds(y)[0], nan=-np.inf) for y in tried]
        best = (heights[1] > heights[0])[:, None]
        return np.where(best, tried[1], tried[0])

    def _balanced(self) -> Array:
        """Return weights with which gradients nearly cancel in the scale of the boxes."""
        middle = 0.5 * (self.g[0] + self.g[1]) * self.reach[:, None]
        pull = 0.5 * (self.slope[0] + self.slope[1]) * self.reach
        sizes = np.linalg.norm(middle, axis=2)
        kept = self.used & np.isfinite(sizes) & (sizes > 0) & np.isfinite(pull).all(axis=1)[:, None]
        y: Array = np.zeros(kept.shape)
        for _ in range(SWEEPS):
            rows = np.where(kept[:, :, None], middle / sizes[:, :, None], 0.0)
            # Least squares; the unit on the diagonal of what is left out, a little elsewhere.
            square = rows @ rows.transpose(0, 2, 1)
            square += np.where(kept, DEFAULT.rank, 1.0)[:, :, None] * np.eye(kept.shape[1])
            right = np.where(kept, np.einsum("ipk,ik->ip", rows, np.nan_to_num(pull)), 0.0)
            y = np.linalg.solve(square, right[:, :, None])[:, :, 0]
            kept &= (y > 0) | ~self.signed
        return np.where(kept, y / np.where(sizes > 0, sizes, 1.0), 0.0)

    def _raised(self, y: Array) -> Array:
        """Return weights after each was moved to where the bound is highest, one at a time."""
        middle, half = 0.5 * (self.g[0] + self.g[1]), 0.5 * (self.g[1] - self.g[0])
        spread = np.einsum("ipk,ik->ip", half, self.reach)
        above, below = self.v[1] + spread, self.v[0] - spread
        y = y.copy()
        h = 0.5 * (self.slope[0] + self.slope[1]) - np.einsum("ip,ipk->ik", y, middle)
        for j in [*range(y.shape[1])] * SWEEPS:
            row = middle[:, j]
            h = h + y[:, j, None] * row
            tried = np.hstack([h / row, np.zeros((len(h), 1))])
            tried = np.where(np.isfinite(tried), tried, 0.0)
            if self.signed[j]:
                tried = np.maximum(tried, 0.0)
            cost = tried * np.where(tried > 0, above[:, j, None], below[:, j, None])
            left = abs(h[:, None] - tried[:, :, None] * row[:, None])
            value = -cost - np.einsum("itk,ik->it", left, self.reach)
            value = np.where(np.isnan(value), -np.inf, value)
            y[:, j] = np.take_along_axis(tried, value.argmax(axis=1)[:, None], axis=1).ravel()
            h = h - y[:, j, None] * row
        return y

    def bounds(self, y: Array) -> Array:
        """Return bounds of ``L`` with given weights, the lower ones rounded downwards."""
        units = y.shape[1] + self.reach.shape[1] + 8
        up, three = y > 0, y[:, :, None]
        with np.errstate(all="ignore"):
            high = three * np.where(up[:, :, None], self.g[1], self.g[0])
            low = three * np.where(up[:, :, None], self.g[0], self.g[1])
            size = np.maximum(abs(high), abs(low)).sum(axis=1)
            size += np.maximum(abs(self.slope[0]), abs(self.slope[1]))
            most = np.maximum(self.slope[1] - low.sum(axis=1), high.sum(axis=1) - self.slope[0])
            # Every sum errs by a unit for each of its terms at most, relative to their sizes.
            fall = (most + units * UNIT * size) * self.reach
            held = y * np.where(up, self.v[1], self.v[0])
            size = abs(self.e) + abs(held).sum(axis=1) + abs(fall).sum(axis=1)
            found = self.e - held.sum(axis=1) - fall.sum(axis=1) - units * UNIT * size - TINY
            most_found = self.e - held.sum(axis=1) + fall.sum(axis=1)
        fine = self.fine & np.isfinite(found)
        return np.where(fine, [found, most_found], [[-np.inf], [np.inf]])
