"""Boxes around points where more functions vanish than are needed to hold them.

Let ``U`` be the inequalities that may vanish in a box ``X`` in some branch, all functions be smooth
there, and ``top`` the number of coordinates that are free less that of equations.  Suppose that
each set ``T`` of ``top`` functions of ``U``

- has a direction along which the energy decreases and all of ``T`` increase, on all of ``X``; or
- is contained in the active functions ``A`` of a region around ``X``.

Then the stationary points in ``X``, in this branch, are points of such regions.  For let ``x`` be
another one, and ``S`` the functions that vanish there.

If ``dE`` is a combination of the gradients of ``S`` without negative weights, modulo those of the
equations, it is one of those of an independent set of at most ``top`` of them, by Caratheodory's
theorem.  A set that contains these has no direction of the first kind.  In a region all multipliers
of ``A`` are positive and unique, so that they are all of ``A``, and ``x`` is the point of the
region.

If it is none, there is a direction with ``dE v < 0`` and ``df_i v >= 0`` on ``S`` by Farkas' lemma,
and ``x`` is not stationary unless some gradients of ``S`` cancel with positive weights.  Let ``M``
be as few of these as possible.  ``top`` of them or fewer cancel neither where a direction increases
all of them nor in a region, where gradients are independent.  ``top + 1`` of them, of which none
can be left out, reach every vector with weights that are not negative, so that ``dE`` is such a
combination after all ([Schrijver] secs. 7.3, 7.7).

Boxes around points that ``A`` holds to first order (:mod:`~polycorner.proofs.lists.pinned`) serve
as regions, too: no other point is stationary for a combination of functions of ``A``, and these
increase along one direction, so that none of their gradients cancel.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.balls import between, precision
from polycorner.intervals.enclosures import Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.lists.attempts import WIDER, Starts
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.candidates import active_sets
from polycorner.proofs.lists.examination import Examined
from polycorner.proofs.lists.intermediate import covered, directions
from polycorner.proofs.lists.known import Known
from polycorner.proofs.lists.operators import BITS
from polycorner.proofs.lists.settings import Setting
from polycorner.spaces.manifold import Array

MOST_SETS = 500  # of one item
MOST_ITEMS = 64  # of one chunk


@dataclass
class Closing:
    """What items with redundant functions are closed with, and what is missing.

    Attributes
    ----------
    boxes : (I,) array of int
        Boxes of directions that items are closed with.
    v : (I, n) array
        The directions.
    starts : list of Starts
        Where to look for the points of faces that have no direction.
    """

    boxes: NDArray[np.intp]
    v: Array
    starts: list[Starts]


def close_redundant(setting: Setting, known: Known, e: Examined) -> Closing:
    """Close items with redundant functions, or say which faces are missing for that."""
    owners, vectors, missing = [np.zeros(0, dtype=np.intp)], [e.v[:0]], list[Starts]()
    for item in _candidates(setting, known, e):
        box = e.where[item]
        if not _smooth(setting, e, item):
            continue
        sets = largest_sets(setting, known, e, item)
        if not len(sets):
            e.done[item] = True
            continue
        found, v = _directions(setting, e, box, sets)
        if found.all():
            e.done[item] = True
            owners.append(np.full(len(v), box))
            vectors.append(v)
        else:
            missing.append(starts(setting, e, box, sets[~found]))
    return Closing(np.concatenate(owners), np.concatenate(vectors), missing)


def _candidates(setting: Setting, known: Known, e: Examined) -> Iterator[int]:
    """Yield open items with more functions than can be independent, in regions or just tried.

    Of those that were tried, the ones that more functions seem to hold than can be independent.
    """
    top = len(setting.domain.free) - setting.equations
    left = e.open_items
    counts = e.masks[e.rest.items[left]].sum(axis=1)
    left = left[e.rest.smooth[left] & (counts > top) & (top > 0)]
    if not left.size:
        return
    items = e.rest.items[left]
    anything = np.zeros((len(left), e.masks.shape[1]), dtype=np.bool_)
    chosen = covered((e.boxes.lower, e.boxes.upper), e.where[items], anything, *known.sides())
    holding = active_sets(e.rest.weights[left], e.rest.pulls[left]).sum(axis=1)
    chosen |= (holding > top) & (e.boxes.since[e.where[items]] == 0)
    for item in items[chosen][:MOST_ITEMS].tolist():
        if comb(int(e.masks[item].sum()), top) <= MOST_SETS:
            yield item


def _smooth(setting: Setting, e: Examined, item: int) -> bool:
    """Whether all functions of an item, the equations and the energy are smooth on its box."""
    lower, upper = (side[e.where[item]].tolist() for side in (e.boxes.lower, e.boxes.upper))
    rows = setting.faces.rows(np.flatnonzero(e.masks[item]).tolist())
    with precision(BITS):
        box = Box([between(a, b) for a, b in zip(lower, upper, strict=True)])
        return not isinstance(setting.faces.formulas.smooth(box, rows), Undecided)


def largest_sets(setting: Setting, known: Known, e: Examined, item: int) -> Mask:
    """Return the largest sets of functions that no region around the box has, ``(T, m)``."""
    lower, upper = e.boxes.lower[e.where[item]], e.boxes.upper[e.where[item]]
    (left, right), active = known.sides()
    within = (left < lower) & (upper < right) | (left == right)
    around = active[within.all(axis=1)]
    rows = np.flatnonzero(e.masks[item]).tolist()
    chosen = [
        some
        for some in combinations(rows, len(setting.domain.free) - setting.equations)
        if not around[:, list(some)].all(axis=1).any()
    ]
    masks = np.zeros((len(chosen), e.masks.shape[1]), dtype=np.bool_)
    for mask, some in zip(masks, chosen, strict=True):
        mask[list(some)] = True
    return masks


def _directions(setting: Setting, e: Examined, box: int, sets: Mask) -> tuple[Mask, Array]:
    lower, upper = e.boxes.lower[[box]], e.boxes.upper[[box]]
    _, _, low, high = setting.functions.gradients(lower, upper)
    where = np.zeros(len(sets), dtype=np.intp)
    found, v, _ = directions(
        (low, high), where, sets, setting.equations, setting.domain.units, -1.0
    )
    return found, v


def starts(setting: Setting, e: Examined, box: int, sets: Mask) -> Starts:
    """Return the middle of a box as a start for each set of functions."""
    q = np.repeat(e.boxes.middles[[box]], len(sets), axis=0)
    widths = (e.boxes.upper[box] - e.boxes.lower[box]) / setting.problem.scales
    widest = np.full(len(sets), WIDER * widths[list(setting.domain.free)].max())
    return Starts(q, sets, widest, np.zeros(len(q), dtype=np.bool_))
