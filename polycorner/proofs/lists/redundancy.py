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
from itertools import combinations
from math import comb

import numpy as np

from polycorner.intervals.balls import precision
from polycorner.intervals.enclosures import Undecided
from polycorner.proofs.lists.attempts import Attempts, Starts, active_sets
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.examination import Examined
from polycorner.proofs.lists.faces import BITS, enclosing
from polycorner.proofs.lists.intermediate import covered, directions
from polycorner.proofs.lists.known import Known, Setting
from polycorner.proofs.lists.pinned import Pinned, pinned
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH

MOST_SETS = 500  # of one item
MOST_ITEMS = 64  # of one chunk
NEWTON = 6  # steps towards a point where all functions of a box vanish
STRAY = 4.0  # sides of a box that such a point may be away from its middle
PINS = -2  # before the functions of such a point, where it is tried in vain


def close_redundant(setting: Setting, e: Examined) -> list[Starts]:
    """Close items with redundant functions; return where to look for faces missing for that."""
    missing = list[Starts]()
    for item in _candidates(setting, e):
        box = e.where[item]
        if not _smooth(setting, e, item):
            continue
        sets = largest_sets(setting, e, item)
        # Each set lies in a region around the box, so that nothing is left to show.
        if not len(sets):
            e.done[item] = True
            continue
        found, v = _directions(setting, e, box, sets)
        if found.all():
            e.done[item] = True
            # One direction for each set: the box is closed by all of them together.
            e.further.append((box, v))
        else:
            missing.append(starts(setting, e, box, sets[~found]))
    return missing


def _candidates(setting: Setting, e: Examined) -> Iterator[int]:
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
    # Items without functions: the question is whether a region is around the box, of any face.
    anything = np.zeros((len(left), e.masks.shape[1]), dtype=np.bool_)
    chosen = covered(
        (e.boxes.lower, e.boxes.upper), e.where[items], anything, *setting.known.sides()
    )
    holding = active_sets(e.rest.weights[left], e.rest.pulls[left]).sum(axis=1)
    # An item that was just tried without success, though too many functions hold it.
    chosen |= (holding > top) & (e.boxes.since[e.where[items]] == 0)
    for item in items[chosen][:MOST_ITEMS].tolist():
        # Bisection thins out the functions of an item; later there are fewer sets.
        if comb(int(e.masks[item].sum()), top) <= MOST_SETS:
            yield item


def _smooth(setting: Setting, e: Examined, item: int) -> bool:
    """Whether all functions of an item, the equations and the energy are smooth on its box."""
    box, faces = e.where[item], setting.faces
    rows = (*faces.rows(np.flatnonzero(e.masks[item]).tolist()), setting.problem.rows - 1)
    with precision(BITS):
        box = enclosing(e.boxes.lower[box], e.boxes.upper[box])
        return not isinstance(faces.formulas.smooth(box, rows), Undecided)


def largest_sets(setting: Setting, e: Examined, item: int) -> Mask:
    """Return the largest sets of functions that no region around the box has, ``(T, m)``."""
    lower, upper = e.boxes.lower[e.where[item]], e.boxes.upper[e.where[item]]
    (left, right), active = setting.known.sides()
    # Fixed coordinates and parameters have no width, and are the same everywhere.
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
    widest = np.full(len(sets), SEARCH.surroundings * widths[list(setting.domain.free)].max())
    return Starts(q, sets, widest, np.zeros(len(q), dtype=np.bool_))


def pin(setting: Setting, e: Examined, attempts: Attempts) -> None:
    """Look for points that are held to first order, near open boxes that were just tried.

    In boxes where more functions may vanish than can be independent.
    """
    free, units = list(setting.domain.free), setting.problem.scales
    left = e.open_items
    counts = e.masks[e.rest.items[left]].sum(axis=1)
    tried = e.boxes.since[e.where[e.rest.items[left]]] == 0
    left = left[e.rest.smooth[left] & (counts > len(free)) & tried][:MOST_ITEMS]
    # What `pinned` shows is shown for one intersection without equations.
    if len(setting.conj) > 1 or setting.equations or setting.domain.parameters or not left.size:
        return
    items = e.rest.items[left]
    boxes, masks = e.boxes.part(e.where[items]), e.masks[items]
    widths = ((boxes.upper - boxes.lower) / units)[:, free].max(axis=1)
    q = boxes.middles
    for _ in range(NEWTON):
        values, slopes = _vanishing(setting, q, masks)
        # More functions than coordinates: the shortest step that fits them best.
        step = np.clip(np.einsum("bij,bj->bi", np.linalg.pinv(slopes), -values), -1, 1)
        q[:, free] += step * units[free]
    values, slopes = _vanishing(setting, q, masks)
    sizes = abs(slopes).max(axis=(1, 2), initial=0.0)
    # A guess only: whether they all vanish is decided exactly, in `pinned`.
    fine = abs(values).max(axis=1, initial=0.0) <= DEFAULT.feasible * sizes
    fine &= (abs(q - boxes.middles) / units)[:, free].max(axis=1) <= STRAY * widths
    for i in np.flatnonzero(fine):
        rows = tuple(np.flatnonzero(masks[i]).tolist())
        reach = SEARCH.surroundings * float(widths[i])
        if _is_pinned(setting.known, q[i], masks[i]) or attempts.failed.has(
            (PINS, *rows), q[i], reach
        ):
            continue
        region = pinned(setting.faces, q[i], slopes[i], reach)
        # A point at which some of them do not vanish does not close the box.
        if region is None or not set(rows) <= set(region.active):
            attempts.failed.add((PINS, *rows), q[i], reach)
        else:
            if comb(len(rows), len(free)) <= MOST_SETS:  # listed with as few functions as possible
                sets = largest_sets(setting, e, items[i])
                attempts.run(starts(setting, e, e.where[items[i]], sets))
            setting.known.add(region)


def _is_pinned(known: Known, q: Array, mask: Mask) -> bool:
    """Whether a point lies in a box around one that some functions, and more, hold."""
    rows = set(np.flatnonzero(mask).tolist())
    held = (r for r in known.regions if isinstance(r, Pinned) and rows <= set(r.active))
    return any(bool(np.all((r.lower <= q) & (q <= r.upper))) for r in held)


def _vanishing(setting: Setting, q: Array, masks: Mask) -> tuple[Array, Array]:
    """Return values and scaled gradients of some functions, 0 of the others."""
    m, free = masks.shape[1], list(setting.domain.free)
    values, gradients = setting.problem.evaluate(q, 1)
    values, gradients = (np.nan_to_num(x[:, :m], posinf=0, neginf=0) for x in (values, gradients))
    slopes = (gradients * setting.problem.scales)[:, :, free]
    return values * masks, slopes * masks[:, :, None]
