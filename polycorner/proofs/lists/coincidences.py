"""Signs of all functions at the point of a region, exact zeros included.

At the point of a region the functions of its face vanish by construction.  Others that vanish
there, redundant contacts, have no sign that an enclosure could show: exact algebra shows that they
are zero, at a point that it recognises or as combinations of the functions that vanish
(:mod:`~polycorner.proofs.exact`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycorner.intervals.balls import between, precision
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import Box
from polycorner.proofs.exact import common_zero, implied
from polycorner.proofs.lists.acceptance import BITS
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball
    from polycorner.proofs.lists.branches import Mask

NEGATIVE, ZERO, POSITIVE, OPEN = -1, 0, 1, 2


@dataclass(frozen=True, eq=False)
class Place:
    """A point by its enclosure, and where some functions have their only common zero around it.

    Attributes
    ----------
    point : list of Ball
        All coordinates.
    lower, upper : (n,) arrays
        The box in which ``rows`` have no other common zero.
    rows : tuple of int
        Functions that vanish there.
    unique : bool
        Whether they have no other common zero; if not, the point is not recognised.
    """

    point: "list[Ball]"
    lower: Array
    upper: Array
    rows: tuple[int, ...]
    unique: bool = True


def signs(formulas: Formulas, place: Place, count: int) -> list[int]:
    """Return the signs of the first ``count`` functions at a point, ``OPEN`` where not decided."""
    with precision(BITS):
        values = formulas.values(Box(place.point), range(count))
        found = [POSITIVE if v > 0 else NEGATIVE if v < 0 else OPEN for v in values]
        for row in place.rows:
            if row < count:
                found[row] = ZERO
        left = [i for i, sign in enumerate(found) if sign == OPEN and values[i].is_finite()]
        if left:
            exact = common_zero(formulas, place.rows, place.point) if place.unique else None
            if exact is not None and not all(
                between(a, b).contains(exact.symbols.ball(x))
                for a, b, x in zip(
                    place.lower.tolist(), place.upper.tolist(), exact.unknowns, strict=True
                )
            ):
                exact = None
            for i in left:
                shown = exact is not None and exact.vanishes(formulas, i)
                if shown or implied(formulas, place.rows, i):
                    found[i] = ZERO
    return found


def active_at(conj: "Mask", found: Sequence[int]) -> tuple[int, ...] | None:
    """Return the functions that vanish at a point and matter for the set near it.

    The set is near the point a union of pieces, where functions that vanish are not negative; a
    piece inside another does not matter.  None outside the set.

    Parameters
    ----------
    conj : (c, m) array
        The set as a union of intersections.
    found : sequence of int
        Signs, all of them decided.
    """
    at = np.array(found)
    pieces = [
        frozenset(np.flatnonzero(c & (at == ZERO)).tolist())
        for c in conj
        if not (c & (at == NEGATIVE)).any()
    ]
    least = [piece for piece in pieces if not any(other < piece for other in pieces)]
    return tuple(sorted(frozenset().union(*least))) if least else None
