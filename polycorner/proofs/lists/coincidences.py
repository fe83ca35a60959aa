"""Signs of all functions at the point of a region, exact zeros included.

At the point of a region the functions of its face vanish by construction.  Others that vanish
there, redundant contacts, have no sign that an enclosure could show: exact algebra shows that they
are zero, at a point that it recognises or as combinations of the functions that vanish
(:mod:`~polycorner.proofs.exact`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polycorner.intervals.balls import Ball, ball, between, precision
from polycorner.intervals.tapes import Box
from polycorner.proofs.exact import MOST_CONSTANTS, ExactPoint, implied, in_ideal, number_in
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.faces import BITS, EnclosedFaces, outward
from polycorner.proofs.polynomials import Polynomial
from polycorner.proofs.symbols import Symbols, constants, evaluate
from polycorner.spaces.manifold import Array

NEGATIVE, ZERO, POSITIVE, OPEN = -1, 0, 1, 2
REACH = 2.0**-40  # of the box in which coordinates that are not recognised are sought


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


def signs(faces: EnclosedFaces, place: Place, count: int) -> list[int]:
    """Return the signs of the first ``count`` functions at a point, ``OPEN`` where not decided."""
    formulas = faces.formulas
    with precision(BITS):
        values = formulas.values(Box(place.point), range(count))
        found = [POSITIVE if v > 0 else NEGATIVE if v < 0 else OPEN for v in values]
        for row in place.rows:
            if row < count:
                # Zero by construction: enclosures there contain 0 and decide nothing.
                found[row] = ZERO
        # Without a finite value the formula may not be defined there, and exact algebra would not
        # say.
        left = [i for i, sign in enumerate(found) if sign == OPEN and values[i].is_finite()]
        if left:
            # Once for all functions, and only if one is open: exact algebra is slow.
            exact = common_zero(faces, place) if place.unique else None
            for i in left:
                shown = exact is not None and exact.vanishes(formulas, i)
                if shown or implied(formulas, place.rows, i):
                    found[i] = ZERO
    return found


def common_zero(faces: EnclosedFaces, place: Place) -> ExactPoint | None:
    """Return the point of a place exactly, or None.

    Some coordinates are recognised as combinations of constants.  Where they have these values
    some of the functions are polynomials of the others, in symbols, and have one common zero in the
    other coordinates by Krawczyk's operator; the rest of the functions are combinations of these
    polynomials.  The point found lies in the box in which the functions have one common zero only:
    it is the one.
    """
    formulas, symbols = faces.formulas, Symbols()
    sought = constants(formulas, symbols)
    pi = symbols.of("const", "pi")
    sought += [pi] if pi not in sought else []
    if len(sought) > MOST_CONSTANTS:
        return None
    known = [number_in(x, sought, symbols) for x in place.point]
    # The ball of a recognised constant has a radius of its own, and has to lie inside.
    wide = [x + ball(0, 2.0**-50) for x in place.point]
    for i, (w, p) in enumerate(zip(wide, known, strict=True)):
        if p is None or not w.contains(symbols.ball(p)):
            known[i] = None
    left = tuple(i for i, p in enumerate(known) if p is None)
    if not set(left) <= set(faces.free):
        return None
    hull = [
        x + ball(0, REACH) if p is None else symbols.ball(p)
        for x, p in zip(place.point, known, strict=True)
    ]
    # Outside of the box the zero of the polynomials might be another one.
    if not all(map(_within, hull, place.lower.tolist(), place.upper.tolist())):
        return None
    symbols.places = {i: hull[i] for i in left}
    unknowns = [symbols.of("var", i) if p is None else p for i, p in enumerate(known)]
    outputs = [formulas.outputs[row] for row in place.rows]
    values = evaluate(formulas.graph, outputs, unknowns, symbols)
    if any(value is None for value in values):
        return None
    chosen, zeros = list[int](), list[Polynomial]()
    for row, value in zip(place.rows, values, strict=True):
        # A combination of those before vanishes with them, and would make the system too large.
        if not in_ideal(value, zeros):
            chosen.append(row)
            zeros.append(value)
    # Krawczyk's operator needs as many equations as unknowns.
    if len(chosen) != len(left):
        return None
    if left:
        ends = np.array([outward(x) for x in hull])
        if replace(faces, free=left).zero(ends[:, 0], ends[:, 1], chosen) is None:
            return None
    return ExactPoint(tuple(unknowns), symbols, tuple(zeros))


def _within(x: "Ball", lower: float, upper: float) -> bool:
    return bool(between(lower, upper).contains(x))


def active_at(conj: Mask, found: Sequence[int]) -> tuple[int, ...] | None:
    """Return the functions that vanish at a point and matter for the set near it.

    The set is near the point a union of pieces, where functions that vanish are not negative; a
    piece inside another does not matter.  None outside the set.  ``conj`` is the set as a union of
    intersections ``(c, m)``; all signs are decided.
    """
    at = np.array(found)
    pieces = [
        frozenset(np.flatnonzero(c & (at == ZERO)).tolist())
        for c in conj
        if not (c & (at == NEGATIVE)).any()
    ]
    least = [piece for piece in pieces if not any(other < piece for other in pieces)]
    return tuple(sorted(frozenset().union(*least))) if least else None
