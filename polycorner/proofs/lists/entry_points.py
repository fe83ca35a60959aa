"""Entry points of the compiled tests of boxes, cached under a key over this folder's sources."""

from typing import Any

import numpy as np
from numba import njit

from polycorner.formulas.cache import sources_digest
from polycorner.proofs.lists.directions import one


def _entry_points(sources: str) -> tuple[Any, ...]:
    @njit(cache=True)
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

    @njit(cache=True)
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

    return directions, covered


directions, covered = _entry_points(sources_digest(__package__))
