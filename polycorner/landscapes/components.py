"""Connected components of the points of a set with given values of some coordinates.

Let ``S`` be these points.  A box that lies in the set is *sure*.  A box is *led* if a vector ``u``
along the other coordinates takes all of it into the set, and increases, on the hull of the box and
its image, all functions that may vanish there.  From a point of ``S`` in it the way along ``u``
stays in ``S``, as no function that is nonnegative becomes negative, and ends in the image: all such
points, and the image, are in one component of ``S``.

A sure box is therefore joined to what it touches; two led boxes that touch may do so outside of
``S`` alone.  If they belong to different classes they are divided, until that does not happen.  If
then no box is left that may meet ``S``, the classes are its components.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.tree import bisected
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH
from polycorner.values import Value

MOST_BOXES = 8192
BEYOND = 1 / 4  # of the range of a function on a box, by which an image lies inside
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Component(Value):
    """A connected part of ``S``, by sure boxes that are joined.

    Attributes
    ----------
    lower, upper : (B, n) arrays
        The boxes, of coordinates ``free``.
    sample : (n,) array
        A point of the largest one.
    free : tuple of int
    periods : (n,) array
    """

    lower: Array
    upper: Array
    sample: Array
    free: tuple[int, ...]
    periods: Array

    def _turned(self, q: Array) -> tuple[Array, Array]:
        """Return the boxes along the free coordinates, on circles in the turn nearest to ``q``."""
        at = list(self.free)
        lower, upper, period = self.lower[:, at], self.upper[:, at], self.periods[at]
        turns = _turns(q[at] - 0.5 * (lower + upper), period)
        return lower + turns, upper + turns

    def way(self, q: Array) -> list[Array]:
        """Return a polyline through the boxes from the point nearest to ``q`` to the sample.

        Along the free coordinates, with the other coordinates of ``q``; on circles it begins in the
        turn of ``q``.
        """
        at, found = list(self.free), [q.copy()]
        lower, upper = self._turned(q)
        points = np.clip(q[at], lower, upper)
        box = int(abs(points - q[at]).sum(axis=1).argmin())
        found[0][at] = points[box]
        goal = int(np.prod((self.upper - self.lower)[:, at], axis=1).argmax())
        sides = lower[box], upper[box]
        for following in self._path(box, goal)[1:]:
            middle = found[0].copy()
            middle[at] = 0.5 * (sides[0] + sides[1])
            low, high = (side[following] for side in self._turned(middle))
            point = found[-1].copy()
            point[at] = 0.5 * (np.maximum(low, sides[0]) + np.minimum(high, sides[1]))
            found.append(point)
            sides = low, high
        last = found[-1].copy()
        last[at] = 0.5 * (sides[0] + sides[1])
        return [*found, last]

    def _path(self, start: int, goal: int) -> list[int]:
        """Return boxes that touch, from one to another."""
        at = list(self.free)
        before, waiting = {goal: goal}, deque([goal])
        while start not in before:
            here = waiting.popleft()
            near = _touching(self.lower[:, at], self.upper[:, at], self.periods[at], here)
            new = [k for k in np.flatnonzero(near).tolist() if k not in before]
            before.update(dict.fromkeys(new, here))
            waiting.extend(new)
        path = [start]
        while path[-1] != goal:
            path.append(before[path[-1]])
        return path

    def has(self, q: Array) -> bool:
        """Whether a point lies in one of the boxes, along the free coordinates."""
        lower, upper = self._turned(q)
        at = list(self.free)
        return bool(((lower <= q[at]) & (q[at] <= upper)).all(axis=1).any())


@dataclass(frozen=True, eq=False)
class Components(Value):
    """Connected parts of ``S``.

    They are ``open`` where two may be parts of one component, or others may be missing.
    """

    parts: tuple[Component, ...]
    open: bool


def components(
    problem: Problem, domain: Domain, z: Sequence[int], lower: Array, upper: Array
) -> Components:
    """Return the components of the points of a set in a box that is thin along ``z``.

    Each of them has a point for every value of ``z``.  With equations nothing is decided.
    """
    if problem.rows - 1 > problem.inequalities:
        return Components((), open=True)
    along = np.array([i for i in domain.free if i not in z], dtype=int)
    periods = np.array(problem.polyhedron.manifold.periods)
    search = _ComponentSearch(problem, along, periods, lower, upper)
    search.run(lower[None].copy(), upper[None].copy())
    return search.found()


class _ComponentSearch:
    """Boxes that are sure, with those that are led to them, and those that are left."""

    def __init__(
        self, problem: Problem, along: NDArray[np.int64], periods: Array, lower: Array, upper: Array
    ) -> None:
        self.polyhedron, self.along, self.periods = problem.polyhedron, along, periods
        self.functions = BoxFunctions(self.polyhedron.functions, self.polyhedron.manifold)
        self.width = (upper - lower)[along]
        self.sure = lower[None][:0], upper[None][:0]
        self.led = self.sure
        self.image = np.zeros(0, dtype=np.int64)  # of led boxes, among the sure ones
        self.open = False
        self.treated = 0

    def run(self, low: Array, high: Array) -> None:
        """Divide boxes until all are sure, led or outside, or too small."""
        while len(low):
            while len(low):
                low, high = self._divided(*self._open(low, high))
            clash = self._clashes(self.labels()[1])
            low, high = self._divided(self.led[0][clash], self.led[1][clash])
            self.led = self.led[0][~clash], self.led[1][~clash]
            self.image = self.image[~clash]

    def _divided(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return the halves of boxes; those that are too small, or too many, are left open."""
        sides = (high - low)[:, self.along] / self.width
        small = sides.max(axis=1, initial=0.0) <= SEARCH.resolution
        if self.treated > MOST_BOXES:
            small[:] = True
        self.open = self.open or bool(small.any())
        low, high, sides = low[~small], high[~small], sides[~small]
        if not len(low):
            return low, high
        return bisected(low, high, self.along[sides.argmax(axis=1)])

    def _open(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Sort boxes, and return those that are neither sure nor led nor outside."""
        self.treated += len(low)
        least, most = self.functions.values(low, high)
        inside = self.polyhedron.implicit_of(least) > 0
        self.sure = _more(self.sure, (low[inside], high[inside]))
        left = ~inside & ~(self.polyhedron.implicit_of(most) < 0)
        low, high = low[left], high[left]
        shown, images = self._images(low, high)
        self.image = np.append(self.image, len(self.sure[0]) + np.arange(shown.sum()))
        self.sure = _more(self.sure, (images[0][shown], images[1][shown]))
        self.led = _more(self.led, (low[shown], high[shown]))
        return low[~shown], high[~shown]

    def _images(self, low: Array, high: Array) -> tuple[Mask, tuple[Array, Array]]:
        """Return which boxes are led, and their images, a little narrowed."""
        if not len(low) or not len(self.along):
            return np.zeros(len(low), dtype=np.bool_), (low, high)
        bounds = self.functions.gradients(low, high)
        step = self._steps(*bounds)
        slack = 2 * np.spacing(abs(low) + abs(high) + abs(step))
        images = low + step - slack, high + step + slack
        hull = np.minimum(low, images[0]), np.maximum(high, images[1])
        v_lo, v_hi, g_lo, g_hi = self.functions.gradients(*hull)
        fixed = (v_lo > 0) | (v_hi < 0)  # not so for bounds that are no numbers
        rising = (_growth(g_lo, g_hi, step) > 0) & self.functions.continuous(*hull)
        shown = (step != 0).any(axis=1)
        shown &= (fixed | rising | ~self._mattering(v_lo, v_hi)).all(axis=1)
        shown &= self.polyhedron.implicit_of(self.functions.values(*images)[0]) > 0
        # Narrowed by more than what counts as touching: boxes that touch them share points.
        more = 16 * np.spacing(abs(images[0]) + abs(images[1]))
        more[:, np.setdiff1d(np.arange(low.shape[1]), self.along)] = 0.0
        return shown, (images[0] + more, images[1] - more)

    def _mattering(self, v_lo: Array, v_hi: Array) -> Mask:
        """Return the functions that say where the set is in each box, whatever the others are."""
        signs = np.where(v_lo > 0, 1, np.where(v_hi < 0, -1, 0))
        found = np.zeros(signs.shape, dtype=np.bool_)
        for k, row in enumerate(signs.tolist()):
            found[k, sorted(frozenset[int]().union(*self.polyhedron.signs_to_pieces(row)))] = True
        return found

    def _steps(self, v_lo: Array, v_hi: Array, g_lo: Array, g_hi: Array) -> Array:
        """Return vectors along which all functions that may vanish grow above 0, as a guess."""
        may = (v_lo <= 0) & (v_hi >= 0) & self._mattering(v_lo, v_hi)
        step = np.zeros((len(v_lo), g_lo.shape[2]))
        with np.errstate(all="ignore"):
            rows = (0.5 * (g_lo + g_hi))[:, :, self.along] * self.width * may[:, :, None]
            rows /= np.where(may, np.linalg.norm(rows, axis=2), 1.0)[:, :, None]
            fine = np.isfinite(rows).all(axis=(1, 2))
            rows[~fine] = 0.0
            u = np.einsum("bij,bj->bi", np.linalg.pinv(rows), may.astype(np.float64)) * self.width
            step[:, self.along] = u
            growth = _growth(g_lo, g_hi, step)
            # From the least value to above 0, by a part of how much values differ.
            rise = BEYOND * (v_hi - v_lo) - v_lo
            long = np.where(may, rise / growth, 0.0).max(axis=1, initial=0.0)
            fine &= (~may | (growth > 0)).all(axis=1) & np.isfinite(long)
            step *= np.where(fine, long, 0.0)[:, None]
        return np.where(fine[:, None], step, 0.0)

    # ------------------------------------------------------------------------------ what is joined

    def labels(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the classes of sure boxes, and those of led boxes."""
        both = _more(self.sure, self.led)
        low, high = both[0][:, self.along], both[1][:, self.along]
        count, root = len(self.sure[0]), np.arange(len(low))
        for a in range(count):
            near = np.flatnonzero(_touching(low, high, self.periods[self.along], a))
            _join(root, a, near)
        for k, image in enumerate(self.image.tolist()):
            _join(root, image, np.array([count + k]))
        return root[:count], root[count:]

    def _clashes(self, roots: NDArray[np.int64]) -> Mask:
        """Return the led boxes that touch one of another class."""
        low, high = (side[:, self.along] for side in self.led)
        clash = np.zeros(len(low), dtype=np.bool_)
        for a in range(len(low)):
            near = _touching(low, high, self.periods[self.along], a) & (roots != roots[a])
            clash |= near
            clash[a] |= near.any()
        return clash

    def found(self) -> Components:
        """Return the classes."""
        parts, (labels, _) = [], self.labels()
        for label in np.unique(labels):
            low, high = (side[labels == label] for side in self.sure)
            largest = int(np.prod((high - low)[:, self.along], axis=1).argmax())
            sample = 0.5 * (low[largest] + high[largest])
            parts.append(Component(low, high, sample, tuple(self.along.tolist()), self.periods))
        return Components(tuple(parts), self.open)


def _more(some: tuple[Array, Array], others: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.concatenate([some[0], others[0]]), np.concatenate([some[1], others[1]])


def _growth(g_lo: Array, g_hi: Array, step: Array) -> Array:
    """Return lower bounds of the products of gradients and steps, ``(B, m)``."""
    with np.errstate(all="ignore"):
        low, high = g_lo * step[:, None], g_hi * step[:, None]
        used = np.broadcast_to(step[:, None] != 0, low.shape)
        sizes = np.where(used, np.maximum(abs(low), abs(high)), 0.0).sum(axis=2)
        # The bound of rounding errors of a sum of products ([Higham] sec. 3.1), twice as large.
        error = (2 * step.shape[1] + 4) * np.finfo(np.float64).eps * sizes
        return np.asarray(np.where(used, np.minimum(low, high), 0.0).sum(axis=2) - error)


def _turns(apart: Array, periods: Array) -> Array:
    """Return the whole turns in differences, ``(..., k)``."""
    circles = np.where(np.isfinite(periods), periods, np.inf)
    turned = np.rint(apart / circles) * np.where(np.isfinite(periods), periods, 0.0)
    return np.asarray(turned)


def _touching(low: Array, high: Array, periods: Array, one: int) -> Mask:
    """Return which boxes touch one of them, on circles as well."""
    apart = 0.5 * (low + high) - 0.5 * (low[one] + high[one])
    apart -= _turns(apart, periods)
    reach = 0.5 * (high - low) + 0.5 * (high[one] - low[one])
    # Ends of boxes are equal or far apart, but for what a turn rounds; images are narrowed.
    slack = 8 * np.spacing(abs(low).max(axis=0) + abs(high).max(axis=0))
    return np.asarray((abs(apart) <= reach + slack).all(axis=1))


def _join(root: NDArray[np.int64], one: int, others: NDArray[np.int64]) -> None:
    """Give all classes of some boxes the least of their numbers."""
    classes = np.unique(root[np.append(others, one)])
    root[np.isin(root, classes)] = classes[0]
