"""Boxes in which no point is a corner but the known ones, by the sets that may vanish there.

Whether functions can vanish together, and whether their gradients are independent, is shown for
many boxes at a time, in double precision with bounds of all rounding errors: a sum of ``n``
products is off by at most ``(n + 2) 2^-52`` times the sum of their magnitudes, underflow excluded,
which a summand of ``2^-1000`` covers ([Higham] sec. 3.1).

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

Let ``U`` be the inequalities that may vanish in a box ``X`` and matter for the set there, ``h`` the
``k`` equations and ``N`` the number of coordinates.  A corner ``q`` in ``X`` is isolated among the
common zeros of ``h`` and a subset ``A(q)`` of ``U``.  Suppose that each set ``T`` in ``U`` with at
most ``N - k`` elements

1. has no common zero with ``h`` in ``X``; or
2. has only one, which is known; or
3. has fewer than ``N - k`` elements, and the gradients of ``T`` and ``h`` are independent on ``X``,
   except at a known point; or
4. contains a set with one of the first two properties; or
5. contains a function that is a linear combination of others of ``T`` and of ``h``.

Then all corners in ``X`` are known.  ``A(q)`` contains no set as in 1, since it vanishes at ``q``,
and if it contains one as in 2, ``q`` is the known point.  Otherwise leave out functions that are
combinations of others until there is none: the common zeros are the same.  All subsets of what is
left, of at most ``N - k`` elements, are as in 3, so that it has fewer than ``N - k`` elements, and
its common zeros are a manifold of positive dimension near ``q``, unless ``q`` is the known point.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.entries import TINY, UNIT
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

LARGE = 2.0**200
MOST_DEFECT = 0.99
Truths = NDArray[np.bool_]
Places = NDArray[np.intp]
MOST_SETS = 2000  # of one size that are looked at in a batch of boxes
Rows = tuple[int, ...]
Question = Callable[[Rows, Places], Truths]


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


def _combinations(middle: Array, reach: Array, *, shift: float = 1e-10) -> Array:
    """Return weights ``(B, C, r)`` of combinations of functions with gradients ``(B, r, N)``.

    The shift makes the products of unit gradients regular where these are dependent.
    """
    scaled = middle * reach[:, None, :]
    units = np.linalg.norm(scaled, axis=2, keepdims=True)
    units = np.where(units > 0, units, 1.0)
    rows = scaled / units
    count = rows.shape[1]
    inverse = np.linalg.inv(rows @ rows.transpose(0, 2, 1) + shift * np.eye(count))
    every = np.concatenate([inverse, rows.transpose(0, 2, 1) @ inverse], axis=1)
    return np.asarray(every / units[:, None, :, 0])


@dataclass(frozen=True, eq=False)
class Levels:
    """What is shown of a batch of boxes.

    Attributes
    ----------
    left : (B,) array of bool
        Boxes in which there may be other corners.
    largest : list of (tuple of int, array of int)
        Sets of ``N - k`` functions that may vanish together, and the boxes.
    """

    left: Truths
    largest: list[tuple[Rows, Places]]


def levels(
    found: Enclosures,
    masks: Mask,
    equations: int,
    known: Question,
    except_at_known: Question,
    related: Sequence[frozenset[int]] = (),
) -> Levels:
    """Return the boxes in which there may be corners that are not known.

    Parameters
    ----------
    found : Enclosures
        Of inequalities, then equations.
    masks : (B, m) array
        ``U`` for each box.
    equations : int
        ``k``.
    known, except_at_known : callable
        Whether the common zero of a set, or the point where its gradients are dependent, is known.
    related : sequence of frozenset of int
        Sets of functions in which one is a combination of others.
    """
    count, m = masks.shape
    top = found.reach.shape[1] - equations
    left = np.zeros(count, dtype=np.bool_)
    alive: dict[Rows, Truths] = {(): np.ones(count, dtype=np.bool_)}
    largest: list[tuple[Rows, Places]] = []
    for size in range(top + 1):
        survivors: dict[Rows, Truths] = {}
        for rows, where in alive.items():
            at = np.flatnonzero(where & ~left)
            if any(some.issubset(rows) for some in related):
                continue
            every = (*rows, *range(m, m + equations))
            if not at.size:
                continue
            if every:
                at = at[~(known(rows, at) | found.incompatible(at, every))]
            if size == top:
                left[at] = True
                largest.append((rows, at))
                continue
            if every:
                left[at] = ~(found.independent(at, every) | except_at_known(rows, at))
            survivors[rows] = np.zeros(count, dtype=np.bool_)
            survivors[rows][at] = True
        # A set has to be looked at if all its subsets may vanish: of the others 4 or 5 is true.
        alive = dict(_larger(survivors, masks & ~left[:, None]))
        # Too many sets for a batch: what they may vanish in is left, and bisected.
        if len(alive) > MOST_SETS:
            for where in alive.values():
                left |= where
            return Levels(left, largest)
    if top < 0:
        left[:] = True
    return Levels(left, largest)


def _larger(alive: dict[Rows, Truths], masks: Mask) -> Iterator[tuple[Rows, Truths]]:
    """Yield the sets with one more element all of whose subsets are alive, and their boxes."""
    present = np.flatnonzero(masks.any(axis=0)).tolist()
    for rows, where in alive.items():
        for j in present:
            if rows and j <= rows[-1]:
                continue
            new = (*rows, j)
            parts = [alive.get((*new[:i], *new[i + 1 :])) for i in range(len(rows))]
            boxes = where & masks[:, j]
            for part in parts:
                boxes = boxes & part if part is not None else np.zeros_like(boxes)
            if boxes.any():
                yield new, boxes
