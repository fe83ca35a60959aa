"""Entry points of the compiled tests of boxes, cached under a key over this folder's sources."""

from typing import Any

import numpy as np
from numba import njit

from polycorner.formulas.cache import sources_digest
from polycorner.proofs.lists.curvature import bent_down
from polycorner.proofs.lists.directions import one


def _direction_search(sources: str) -> Any:
    @njit(cache=True, nogil=True)
    def directions(low, high, boxes, masks, equations, scales, energy_sign):
        """Find a direction for each item: a box, and the inequalities of a branch.

        Parameters
        ----------
        low, high : (B, m + k + 1, n) arrays
            Enclosures of the gradients: inequalities, equations, energy.
        boxes : (I,) array of int
        masks : (I, m) array of bool
            Inequalities that may vanish in the box and have to hold in the branch.
        equations : int
            ``k``.
        scales : (n,) array
            Units of the coordinates; 0 for coordinates that are fixed.
        energy_sign : float
            -1 for directions of descent, 0 for directions into the set alone.

        Returns
        -------
        found : (I,) array of bool
        v : (I, n) array
            The directions.
        weights : (I, m + 1) array
            Weights of the gradients with which they nearly cancel, by row, the energy last.
        """
        _ = sources
        items, m = masks.shape
        n = scales.size
        found, v = np.zeros(items, np.bool_), np.zeros((items, n))
        weights = np.zeros((items, m + 1))
        a, rho, rows = np.zeros((m + 1, n)), np.zeros(m + 1), np.zeros(m + 1, np.int64)
        basis, spread, w = np.zeros((equations, n)), np.zeros(n), np.zeros(m + 1)
        units = np.zeros(n)
        for item in range(items):
            lo, hi = low[boxes[item]], high[boxes[item]]
            w[:] = 0.0
            found[item] = one(
                lo, hi, masks[item], equations, scales, energy_sign,
                a, rho, rows, basis, v[item], spread, w, units,
            )  # fmt: skip
            count = 0
            for k in range(m):
                if masks[item, k]:
                    weights[item, k] = w[count]
                    count += 1
            weights[item, m] = w[count]
        return found, v, weights

    return directions


def _box_tests(sources: str) -> tuple[Any, ...]:
    @njit(cache=True, nogil=True)
    def covered(lower, upper, boxes, masks, left, right, active):
        """Whether each item lies inside one of some regions and asks for none but its functions.

        Strictly inside, so that a neighbourhood of each of its points does.

        Regions have the sides ``left``, ``right`` ``(R, n)``, and the functions ``active``
        ``(R, m)``; the others are as in ``directions``.
        """
        _ = sources
        found = np.zeros(len(boxes), np.bool_)
        for item in range(len(boxes)):
            lo, hi = lower[boxes[item]], upper[boxes[item]]
            for r in range(len(left)):
                inside = True
                for j in range(lo.size):
                    within = left[r, j] < lo[j] and hi[j] < right[r, j]
                    if not within and left[r, j] < right[r, j]:
                        inside = False
                        break
                if inside:
                    for k in range(masks.shape[1]):
                        if masks[item, k] and not active[r, k]:
                            inside = False
                            break
                if inside:
                    found[item] = True
                    break
        return found

    @njit(cache=True, nogil=True)
    def carried(lower, upper, orders, signs, shifts, slopes, weights, periods, least, most, margin):
        """Whether a motion carries each box into a domain and increases ``w . q`` on all of it.

        Parameters
        ----------
        lower, upper : (B, n) arrays
        orders, signs, shifts : (G, n) arrays
            The motions ``q -> signs * q[order] + shifts``.
        slopes : (G, n) array
            Gradients of the change of ``w . q``.
        weights : (n,) array
            ``w``.
        periods, least, most : (n,) arrays
            Periods of the coordinates, infinite for lines; the sides of the domain.
        margin : float
            By how much ``w . q`` has to increase.
        """
        _ = sources
        gone = np.zeros(len(lower), np.bool_)
        for box in range(len(lower)):
            for g in range(len(orders)):
                inside, growth = True, 0.0
                for j in range(weights.size):
                    a = signs[g, j] * lower[box, orders[g, j]]
                    b = signs[g, j] * upper[box, orders[g, j]]
                    turn = shifts[g, j]
                    if periods[j] < np.inf:
                        turn -= periods[j] * np.rint((0.5 * (a + b) + turn) / periods[j])
                    if not (least[j] <= min(a, b) + turn and max(a, b) + turn <= most[j]):
                        inside = False
                        break
                    slope = slopes[g, j]
                    growth += slope * (lower[box, j] if slope > 0.0 else upper[box, j])
                    growth += turn * weights[j]
                if inside and growth > margin:
                    gone[box] = True
                    break
        return gone

    return covered, carried


def _curvature_test(sources: str) -> Any:
    @njit(cache=True, nogil=True)
    def bent(g_lo, g_hi, h_lo, h_hi, left, start):
        """Whether negative curvature shows that there is no local minimum, for each box.

        Arguments are those of :func:`~polycorner.proofs.lists.curvature.bent_down`, stacked.
        """
        _ = sources
        count, k, n = left.shape
        found = np.zeros(count, np.bool_)
        spread, lam, reach = np.zeros(n), np.zeros(k), np.zeros(k)
        for box in range(count):
            found[box] = bent_down(
                g_lo[box], g_hi[box], h_lo[box], h_hi[box], left[box], start[box],
                spread, lam, reach,
            )  # fmt: skip
        return found

    return bent


SOURCES = sources_digest(__package__)
directions = _direction_search(SOURCES)
covered, carried = _box_tests(SOURCES)
bent = _curvature_test(SOURCES)
