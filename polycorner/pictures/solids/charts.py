"""Newton's method for points of a surface ``min f_i = 0`` and the functions that vanish there."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from polycorner.pictures.solids.grids import Mask
from polycorner.spaces.manifold import Array

# Of points ``(N, 3)`` the values ``(N, m)`` and, for order 1, the gradients ``(N, m, 3)``.
Gaps = Callable[[Array, int], tuple[Array, ...]]

# A function is active where it vanishes to within this many cells.
ACTIVE = 1e-7
NEWTON_STEPS = 12
# Largest distance, in cells, that Newton's method may move a point.
REACH = 2.0
TURNS = 3
DEPENDENT = 1e-5
SLAB = 50_000


@dataclass(frozen=True)
class Chart:
    """Functions whose minimum bounds a region, in units of the cells of a grid.

    Parameters
    ----------
    gaps : callable
        Of points ``(N, 3)`` and an order: the values ``(N, m)`` alone for order 0, with the
        gradients ``(N, m, 3)`` for order 1.
    low, spacing : (3,) array
        The corner of the box, and the sides of a cell.
    """

    gaps: Gaps
    low: Array
    spacing: Array

    def places(self, points: Array) -> Array:
        """Return points in cells from the corner of the box."""
        return np.asarray((points - self.low) / self.spacing)

    def points(self, places: Array) -> Array:
        """Return places in the units of the axes."""
        return np.asarray(self.low + places * self.spacing)

    def evaluate(self, places: Array) -> tuple[Array, Array]:
        """Return values ``(N, m)`` and gradients per cell ``(N, m, 3)``, 0 if not finite."""
        parts = [places[k : k + SLAB] for k in range(0, max(1, len(places)), SLAB)]
        found = [self.gaps(self.points(part), 1) for part in parts]
        values = np.concatenate([np.asarray(v, dtype=np.float64) for v, _ in found])
        slopes = np.concatenate([np.asarray(g, dtype=np.float64) for _, g in found]) * self.spacing
        return values, np.where(np.isfinite(slopes).all(axis=-1, keepdims=True), slopes, 0.0)

    def distances(self, places: Array) -> Array:
        """Return ``f_i / |grad f_i|``, distances in cells to first order, ``(N, m)``."""
        return _distances(*self.evaluate(places))

    def settle(self, places: Array, wanted: Mask, fixed: Mask) -> tuple[Array, Mask]:
        """Return points near given places where wanted functions vanish, and a mask of success.

        Newton's method with the shortest corrections; coordinates marked as fixed are kept.

        Parameters
        ----------
        places : (N, 3) array
        wanted : (N, m) bool
            Functions that shall vanish; their gradients may be dependent.
        fixed : (N, 3) bool
        """
        here, left = places.copy(), np.arange(len(places))
        for _ in range(NEWTON_STEPS):
            values, slopes = self.evaluate(here[left])
            step = _shortest(np.where(wanted[left], values, 0.0), slopes, wanted[left], fixed[left])
            here[left] += step
            near = np.linalg.norm(here[left] - places[left], axis=1) < REACH
            left = left[near & (np.linalg.norm(step, axis=1) > 1e-12)]
            if not len(left):
                break
        missed = abs(np.where(wanted, self.distances(here), 0.0)).max(axis=1)
        near = np.linalg.norm(here - places, axis=1) < REACH
        return here, near & (missed < ACTIVE)

    def active(self, places: Array) -> Mask:
        """Return a mask of the functions that vanish at given places, ``(N, m)``."""
        return np.asarray(abs(self.distances(places)) < ACTIVE)

    def descend(self, places: Array, fixed: Mask) -> tuple[Array, Mask]:
        """Return points of the surface near given places, and the functions active there.

        Newton's method on the least function; where another one is negative at the solution, on
        that one.  Places where this fails are returned with the least function alone.
        """
        here, active = places.copy(), np.zeros((len(places), 0), dtype=bool)
        left = np.arange(len(places))
        for turn in range(TURNS):
            distances = self.distances(here[left])
            least = distances == distances.min(axis=1, keepdims=True)
            if not turn:
                active = least.copy()
            settled, fine = self.settle(here[left], least, fixed[left])
            here[left[fine]], active[left] = settled[fine], least
            active[left[fine]] |= self.active(settled[fine])
            least_now = self.distances(here[left]).min(axis=1)
            left = left[fine & (least_now < -ACTIVE)]
            if not len(left):
                break
        return here, active

    def meet(self, places: Array, wanted: Mask, fixed: Mask) -> tuple[Array, Mask]:
        """Return points of the surface where wanted functions vanish, and all that are active.

        Where another function is negative at the solution, the edge has passed a corner, and that
        function has to vanish as well.  Where there is no such point near by, see
        :meth:`descend`.
        """
        here, active = places.copy(), wanted.copy()
        left = np.arange(len(places))
        for _ in range(TURNS):
            settled, fine = self.settle(places[left], active[left], fixed[left])
            distances = self.distances(settled)
            worst = distances.argmin(axis=1)
            below = distances.min(axis=1) < -ACTIVE
            done = fine & ~below
            here[left[done]] = settled[done]
            active[left[done]] |= abs(distances[done]) < ACTIVE
            more = fine & below
            active[left[more], worst[more]] = True
            many = ~fine & (active[left].sum(axis=1) > 3)
            for k in left[many]:
                here[k], active[k] = self._corner(places[k], active[k], fixed[k])
            lost = left[~fine & ~many]
            here[lost], active[lost] = self.descend(places[lost], fixed[lost])
            left = left[more]
            if not len(left):
                return here, active
        here[left], active[left] = self.descend(places[left], fixed[left])
        return here, active

    def _corner(self, place: Array, wanted: Mask, fixed: Mask) -> tuple[Array, Mask]:
        """Return the nearest point of the surface where three of four or more functions vanish.

        With two corners in one cell, the wanted functions need not all vanish at one point.
        Where there is no point for any three, see :meth:`descend`.
        """
        triples = list(combinations(np.flatnonzero(wanted), 3))
        tried = np.zeros((len(triples), len(wanted)), dtype=bool)
        np.put_along_axis(tried, np.array(triples), True, axis=1)
        here, fine = self.settle(
            np.tile(place, (len(tried), 1)), tried, np.tile(fixed, (len(tried), 1))
        )
        distances = self.distances(here)
        fine &= distances.min(axis=1) > -ACTIVE
        if not fine.any():
            found, active = self.descend(place[None], fixed[None])
            return found[0], active[0]
        best = int(np.where(fine, np.linalg.norm(here - place, axis=1), np.inf).argmin())
        return here[best], tried[best] | (abs(distances[best]) < ACTIVE)


def _distances(values: Array, slopes: Array) -> Array:
    lengths = np.linalg.norm(slopes, axis=-1)
    return np.asarray(values / np.where(lengths > 0, lengths, 1.0))


def _shortest(values: Array, slopes: Array, wanted: Mask, fixed: Mask) -> Array:
    """Return the shortest corrections ``(N, 3)`` that make wanted linearised functions vanish."""
    rows = np.where(fixed[:, None, :] | ~wanted[..., None], 0.0, slopes)
    step = np.zeros_like(rows[:, 0])
    count = wanted.sum(axis=1)
    one = count == 1
    row, value = rows[one].sum(axis=1), values[one].sum(axis=1)
    squares = (row * row).sum(axis=1)
    step[one] = -row * (value / np.where(squares > 0, squares, 1.0))[:, None]
    several = count > 1
    inverse = np.linalg.pinv(rows[several], rcond=DEPENDENT)
    step[several] = -np.einsum("nkm,nm->nk", inverse, values[several])
    return step
