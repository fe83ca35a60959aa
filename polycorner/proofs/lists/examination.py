"""Examination of some boxes with what is known at the time; nothing else is read or changed.

An *item* is a box and a branch that points of the set in it may lie in.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polycorner.proofs.lists.branches import Mask, items, merged
from polycorner.proofs.lists.contraction import narrowed
from polycorner.proofs.lists.images import dropped
from polycorner.proofs.lists.intermediate import bent, covered, directions
from polycorner.proofs.lists.known import Setting
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array


@dataclass
class Rest:
    """Items that were not closed at first.

    Attributes
    ----------
    items : (R,) array of int
        Their numbers.
    weights : (R, m + 1) array
        Weights with which the gradients nearly cancel, the energy's last.
    pulls : (R, m + 1) array
        Lengths of the scaled gradients in the middle.
    smooth : (R,) array of bool
        Whether their functions are continuous with bounded gradients on the box.
    low, high : (R, m + k + 1, n) arrays
        Enclosures of gradients; empty where no loci are possible.
    """

    items: NDArray[np.intp]
    weights: Array
    pulls: Array
    smooth: Mask
    low: Array
    high: Array


@dataclass
class Examined:
    """Boxes, and why their items are closed.

    Attributes
    ----------
    images : (I,) array of int
        Numbers in the tree of boxes that a symmetry carries to others; they are left out below.
    boxes : Boxes
    where : (I,) array of int
        The box of each item.
    masks : (I, m) array of bool
        Functions that may vanish in the box and have to hold in the branch.
    done : (I,) array of bool
        Items that are closed.
    directed : (I,) array of bool
        Those that a direction closes.
    v : (I, n) array
        The directions.
    inner : (2, B, n) array
        Narrower sides of the boxes that are open, beyond which no point of the set lies.
    rest : Rest
    further : list of (int, (T, n) array)
        Boxes that several directions close, one for each set of functions, and these.
    """

    images: NDArray[np.int64]
    boxes: Boxes
    where: NDArray[np.intp]
    masks: Mask
    done: Mask
    directed: Mask
    v: Array
    inner: Array
    rest: Rest
    further: list[tuple[int, Array]] = field(default_factory=list)

    @property
    def open_items(self) -> NDArray[np.intp]:
        """Positions in ``rest`` of the items that are still open."""
        return np.flatnonzero(~self.done[self.rest.items])


def without_images(setting: Setting, boxes: Boxes) -> tuple[NDArray[np.int64], Boxes]:
    """Return the nodes of boxes that a symmetry carries to others, and the other boxes."""
    if not setting.motions:
        return boxes.nodes[:0], boxes
    gone = dropped(boxes.lower, boxes.upper, setting.motions, setting.weights, setting.domain)
    return boxes.nodes[gone], boxes.part(~gone)


def examine(setting: Setting, sharp: bool, boxes: Boxes) -> Examined:
    """Close what can be closed in some boxes; ``sharp``: by second derivatives, too."""
    images, boxes = without_images(setting, boxes)
    problem, k = setting.problem, setting.equations
    m = problem.inequalities
    v_lo, v_hi, g_lo, g_hi = setting.functions.gradients(boxes.lower, boxes.upper, monotone=True)
    meets = np.all((v_lo[:, m : m + k] <= 0) & (v_hi[:, m : m + k] >= 0), axis=1)
    meets &= v_lo[:, -1] <= setting.cap
    where, masks = items(setting.conj, v_hi[:, :m] < 0, v_lo[:, :m] > 0)
    where, masks = where[meets[where]], masks[meets[where]]
    if setting.critical:
        where, masks = merged(where, masks)
    units = setting.domain.units
    found, v, weights = directions((g_lo, g_hi), where, masks, k, units, -1.0)
    # Cheap bounds first: they close most boxes, and mean values need second derivatives.
    left = np.flatnonzero(~found)
    if sharp and left.size:
        which = np.unique(where[left])
        # Written in place: all later tests of these boxes use the sharper bounds as well.
        g_lo[which], g_hi[which] = setting.functions.mean_value_gradients(
            boxes.lower[which], boxes.upper[which]
        )
        found[left], v[left], weights[left] = directions(
            (g_lo, g_hi), where[left], masks[left], k, units, -1.0
        )
    continuous = setting.functions.continuous(boxes.lower, boxes.upper)
    smooth: Mask = np.all(continuous[where, :m] | ~masks, axis=1)
    smooth &= np.all(continuous[where, m:], axis=1)
    # A direction shows nothing where a function may jump, or have no bounded slope.
    found &= smooth
    rest = np.flatnonzero(~found)
    with np.errstate(all="ignore"):
        steep = 0.5 * (g_lo[where[rest]] + g_hi[where[rest]]) * problem.scales
        pulls = np.linalg.norm(steep[:, [*range(m), -1]], axis=2)
    # Gradients of the items are kept for loci alone; elsewhere they would fill the memory.
    some = where[rest] if setting.may_have_loci else where[:0]
    kept = Rest(rest, weights[rest], pulls, smooth[rest], g_lo[some], g_hi[some])
    inner = np.stack([boxes.lower, boxes.upper])
    examined = Examined(images, boxes, where, masks, found.copy(), found, v, inner, kept)
    reconsider(setting, examined)
    # Last, as it evaluates Hessians over what all other tests have left.
    if sharp and setting.minima_only:
        at = examined.rest.items[examined.open_items]
        saddles, v[at] = without_minima(setting, boxes, where[at], masks[at])
        examined.done[at[saddles]] = examined.directed[at[saddles]] = True
    left = np.unique(where[~examined.done])
    examined.inner[:, left] = narrowed(
        boxes.part(left), [side[left] for side in (v_lo, v_hi, g_lo, g_hi)],
        continuous[left], setting.conj, k,
    )  # fmt: skip
    return examined


def reconsider(setting: Setting, examined: Examined, regions: int = 0, loci: int = 0) -> None:
    """Close items in regions and at loci that are known, but for the first ones of both."""
    rest, boxes, known = examined.rest, examined.boxes, setting.known
    at = rest.items[examined.open_items]
    if at.size and len(known.regions) > regions:
        inside = covered(
            (boxes.lower, boxes.upper),
            examined.where[at],
            examined.masks[at],
            *known.sides(regions),
        )
        examined.done[at[inside]] = True
    z = list(setting.reads)
    units = setting.domain.units.copy()
    # A direction into the set along the other coordinates: the energy does not change with these.
    units[z] = 0.0
    for place in known.loci[loci:]:
        near = np.all(boxes.lower[:, z] > place.lower, axis=1)
        near &= np.all(boxes.upper[:, z] < place.upper, axis=1)
        left = examined.open_items
        left = left[near[examined.where[rest.items[left]]] & rest.smooth[left]]
        at = rest.items[left]
        if at.size:
            into, u, _ = directions(
                (rest.low[left], rest.high[left]),
                np.arange(len(left)),
                examined.masks[at],
                setting.equations,
                units,
                0.0,
            )
            examined.done[at[into]] = True
            # Without functions the locus closes the box by itself, and no direction is needed.
            stored = into & examined.masks[at].any(axis=1)
            examined.directed[at[stored]] = True
            examined.v[at[stored]] = u[stored]


def without_minima(
    setting: Setting, boxes: Boxes, where: NDArray[np.intp], masks: Mask
) -> tuple[NDArray[np.bool_], Array]:
    """Return which items contain no local minimum, and the directions ``(I, n)`` that show it."""
    m, n = setting.problem.inequalities, setting.problem.dimension
    found, directions = np.zeros(len(where), dtype=np.bool_), np.zeros((len(where), n))
    if not len(where):
        return found, directions
    which, place = np.unique(where, return_inverse=True)
    low, high = boxes.lower[which], boxes.upper[which]
    bounds = setting.functions.mean_value_gradients(low, high, hessians=True)
    smooth = setting.functions.differentiable(low, high)
    # Items with the same functions have arrays of one shape, and are treated together.
    kinds, kind = np.unique(masks, axis=0, return_inverse=True)
    for number, mask in enumerate(kinds):
        rows = [*np.flatnonzero(mask).tolist(), *range(m, setting.problem.rows)]
        at = np.flatnonzero(kind.ravel() == number)
        at = at[smooth[place[at]][:, rows].all(axis=1)]
        # With as many functions as coordinates nothing is tangent to all of them.
        if at.size and len(rows) <= len(setting.domain.free):
            parts = tuple([side[place[at]][:, rows] for side in bounds])
            found[at], directions[at] = _bent(setting, parts)
    return found, directions


def _bent(setting: Setting, bounds: tuple[Array, ...]) -> tuple[NDArray[np.bool_], Array]:
    """Return the same for items with the same rows, by bounds of their derivatives."""
    free, units = list(setting.domain.free), setting.domain.units[list(setting.domain.free)]
    g_lo, g_hi = (side[:, :, free] for side in bounds[:2])
    h_lo, h_hi = (side[:, :, free][:, :, :, free] for side in bounds[2:])
    found = np.zeros(len(g_lo), dtype=np.bool_)
    directions = np.zeros((len(g_lo), setting.problem.dimension))
    fine = np.isfinite(g_hi - g_lo).all(axis=(1, 2)) & np.isfinite(h_hi - h_lo).all(axis=(1, 2, 3))
    at = np.flatnonzero(fine)
    if not at.size:
        return found, directions
    slopes = 0.5 * (g_lo[at] + g_hi[at]) * units
    bends = 0.5 * (h_lo[at] + h_hi[at]) * np.outer(units, units)
    left = np.linalg.pinv(slopes[:, :-1].transpose(0, 2, 1))
    lam = np.einsum("bij,bj->bi", left, slopes[:, -1])
    # The projector onto the tangent space; its complement adds eigenvalues 0, never negative ones.
    flat = np.eye(len(free)) - left.transpose(0, 2, 1) @ slopes[:, :-1]
    weights = np.concatenate([-lam, np.ones((len(at), 1))], axis=1)
    bent_form = flat.transpose(0, 2, 1) @ np.einsum("bk,bkij->bij", weights, bends) @ flat
    values, vectors = np.linalg.eigh(0.5 * (bent_form + bent_form.transpose(0, 2, 1)))
    likely = np.flatnonzero(values[:, 0] < 0)
    # Rounded to what the tree stores, before the test: the checker sees these very numbers.
    at, start = at[likely], (vectors[likely, :, 0] * units).astype(np.float32).astype(np.float64)
    sides = tuple(side[at] for side in (g_lo, g_hi, h_lo, h_hi))
    found[at] = bent(sides, left[likely] * units, start)
    directions[at[:, None], free] = start
    return found, directions
