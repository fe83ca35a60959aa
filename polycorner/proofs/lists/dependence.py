"""Whether functions can vanish together in boxes, and whether their gradients are independent.

Both are shown for many boxes at a time, in double precision with bounds of all rounding errors: a
sum of ``n`` products is off by at most ``(n + 2) 2^-52`` times the sum of their magnitudes,
underflow excluded, which a summand of ``2^-1000`` covers ([Higham] sec. 3.1).

Let ``[G]`` enclose the gradients of ``r`` functions on a box ``X`` with the middle ``c``, and
``Y`` be near a right inverse of its middle.

- If ``|I - [G] Y| < 1`` in a maximum norm, every matrix in ``[G]`` has rank ``r``.  Where ``[G]``
  contains Clarke's generalised gradients and ``r < N``, the functions' common zeros in ``X`` are
  then a Lipschitz manifold of dimension ``N - r``, in which no point is isolated; where ``r = N``
  there is at most one ([Clarke] sec. 7.1, [Neumaier] sec. 5.1).
- If ``0`` is not in ``sum_i l_i (f_i(c) + [G_i] (X - c))`` for some numbers ``l_i``, the
  functions do not vanish together in ``X``, by the mean value theorem.  Combinations that nearly
  cancel all but one direction, and those with which a gradient is nearly orthogonal to the others,
  are tried.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.proofs.lists.entries import TINY, UNIT
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

LARGE = 2.0**200
MOST_DEFECT = 0.99
SHIFT = 1e-10  # of the squares of gradients that are inverted, relative to their sum

Truths = NDArray[np.bool_]
Places = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Enclosures of ``M`` functions on ``B`` boxes in the ``N`` coordinates that are free.

    Attributes
    ----------
    low, high : (B, M, N) arrays
        Bounds of the gradients.
    least, most : (B, M) arrays
        Bounds of the values in the middles.
    reach : (B, N) array
        Bound of the distance of a point of a box from its middle.
    usable : (B, M) array
        Whether a function is continuous on a box, so that the mean value theorem holds.
    """

    low: Array
    high: Array
    least: Array
    most: Array
    reach: Array
    usable: Truths

    @classmethod
    def of(
        cls,
        functions: BoxFunctions,
        lower: Array,
        upper: Array,
        gradients: tuple[Array, Array],
        free: Sequence[int],
    ) -> "Enclosures":
        """Return those of functions on boxes ``(B, n)``, whose gradients are given."""
        middle = 0.5 * (lower + upper)
        least, most = functions.values(middle, middle)
        at = list(free)
        reach = np.maximum(upper - middle, middle - lower)[:, at] * (1 + UNIT)
        low, high = (side[:, :, at] for side in gradients)
        return cls(low, high, least, most, reach, functions.continuous(lower, upper))

    @cached_property
    def middles(self) -> Array:
        """Middles of the gradients, 0 where these may be large, ``(B, M, N)``."""
        with np.errstate(invalid="ignore"):
            middle = 0.5 * (self.low + self.high)
        usual = (abs(self.low) < LARGE) & (abs(self.high) < LARGE)
        return np.where(usual, middle, 0.0)

    @cached_property
    def radii(self) -> Array:
        """Bounds of the distance of gradients from their middles, ``(B, M, N)``."""
        with np.errstate(invalid="ignore"):
            apart = np.maximum(self.high - self.middles, self.middles - self.low)
        return np.where(np.isfinite(apart), apart, np.inf) * (1 + UNIT)

    def independent(self, at: Places, rows: Sequence[int]) -> Truths:
        """Return whether the gradients of functions are independent on all of some boxes."""
        places = np.array(rows, dtype=np.intp)
        middle, radius = self.middles[np.ix_(at, places)], self.radii[np.ix_(at, places)]
        units = np.linalg.norm(middle, axis=2) + 1 / LARGE
        inverse = np.linalg.pinv(middle / units[:, :, None]) / units[:, None, :]
        identity = np.eye(len(places))
        size = abs(inverse)
        with np.errstate(invalid="ignore", over="ignore"):
            defect = abs(identity - middle @ inverse) + radius @ size
            defect += (
                (inverse.shape[1] + 4) * UNIT * (identity + abs(middle) @ size + radius @ size)
            )
            scaled = (defect * units[:, None, :] / units[:, :, None]).sum(axis=2)
        found = np.asarray((scaled < MOST_DEFECT).all(axis=1))  # False for NaN
        return np.asarray(found & self.usable[np.ix_(at, places)].all(axis=1), dtype=np.bool_)

    def incompatible(self, at: Places, rows: Sequence[int]) -> Truths:
        """Return whether functions do not vanish together anywhere in some boxes."""
        places = np.array(rows, dtype=np.intp)
        middle, radius = self.middles[np.ix_(at, places)], self.radii[np.ix_(at, places)]
        least, most = self.least[np.ix_(at, places)], self.most[np.ix_(at, places)]
        weights = _combinations(middle, self.reach[at])
        with np.errstate(invalid="ignore", over="ignore"):
            value, spread = 0.5 * (least + most), 0.5 * (most - least) * (1 + 4 * UNIT)
            size = abs(weights)
            centre = abs((weights @ value[:, :, None])[:, :, 0])
            away = (size @ spread[:, :, None])[:, :, 0]
            slopes = abs(weights @ middle) + size @ radius
            moved = (slopes @ self.reach[at][:, :, None])[:, :, 0]
            most_of = size @ (abs(value) + spread)[:, :, None]
            whole = (
                most_of[:, :, 0]
                + ((size @ (abs(middle) + radius)) @ self.reach[at][:, :, None])[:, :, 0]
            )
            error = (2 * len(places) + 2 * middle.shape[2] + 16) * UNIT * whole + TINY
            found = np.asarray((centre > away + moved + error).any(axis=1))  # False for NaN
        return np.asarray(found & self.usable[np.ix_(at, places)].all(axis=1), dtype=np.bool_)


def _combinations(middle: Array, reach: Array) -> Array:
    """Return weights ``(B, C, r)`` of combinations of functions with gradients ``(B, r, N)``."""
    scaled = middle * reach[:, None, :]
    units = np.linalg.norm(scaled, axis=2, keepdims=True)
    units = np.where(units > 0, units, 1.0)
    rows = scaled / units
    count = rows.shape[1]
    inverse = np.linalg.inv(rows @ rows.transpose(0, 2, 1) + SHIFT * np.eye(count))
    every = np.concatenate([inverse, rows.transpose(0, 2, 1) @ inverse], axis=1)
    return np.asarray(every / units[:, None, :, 0])
