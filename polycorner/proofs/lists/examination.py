"""Examination of some boxes with what is known at the time; nothing else is read or changed.

An *item* is a box and a branch that points of the set in it may lie in.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.proofs.lists.boxes import Boxes
from polycorner.proofs.lists.branches import Mask, items
from polycorner.proofs.lists.contraction import narrowed
from polycorner.proofs.lists.images import dropped
from polycorner.proofs.lists.intermediate import covered, directions
from polycorner.proofs.lists.known import Known
from polycorner.proofs.lists.saddles import without_minima
from polycorner.proofs.lists.settings import Setting
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

    @property
    def open_items(self) -> NDArray[np.intp]:
        """Positions in ``rest`` of the items that are still open."""
        return np.flatnonzero(~self.done[self.rest.items])


def examine(setting: Setting, known: Known, sharp: bool, boxes: Boxes) -> Examined:
    """Close what can be closed in some boxes; ``sharp``: by second derivatives, too."""
    gone = np.zeros(len(boxes), dtype=np.bool_)
    if setting.motions:
        gone = dropped(boxes.lower, boxes.upper, setting.motions, setting.weights, setting.domain)
    images, boxes = boxes.nodes[gone], boxes.part(~gone)
    problem, k = setting.problem, setting.equations
    m = problem.inequalities
    v_lo, v_hi, g_lo, g_hi = setting.functions.gradients(boxes.lower, boxes.upper, monotone=True)
    meets = np.all((v_lo[:, m : m + k] <= 0) & (v_hi[:, m : m + k] >= 0), axis=1)
    where, masks = items(setting.conj, v_hi[:, :m] < 0, v_lo[:, :m] > 0)
    where, masks = where[meets[where]], masks[meets[where]]
    units = setting.domain.units
    found, v, weights = directions((g_lo, g_hi), where, masks, k, units, -1.0)
    left = np.flatnonzero(~found)
    if sharp and left.size:
        which = np.unique(where[left])
        g_lo[which], g_hi[which] = setting.functions.mean_value_gradients(
            boxes.lower[which], boxes.upper[which]
        )
        found[left], v[left], weights[left] = directions(
            (g_lo, g_hi), where[left], masks[left], k, units, -1.0
        )
    continuous = setting.functions.continuous(boxes.lower, boxes.upper)
    smooth: Mask = np.all(continuous[where, :m] | ~masks, axis=1)
    smooth &= np.all(continuous[where, m:], axis=1)
    found &= smooth
    rest = np.flatnonzero(~found)
    with np.errstate(all="ignore"):
        steep = 0.5 * (g_lo[where[rest]] + g_hi[where[rest]]) * problem.scales
        pulls = np.linalg.norm(steep[:, [*range(m), -1]], axis=2)
    some = where[rest] if setting.may_have_loci else where[:0]
    kept = Rest(rest, weights[rest], pulls, smooth[rest], g_lo[some], g_hi[some])
    inner = np.stack([boxes.lower, boxes.upper])
    examined = Examined(images, boxes, where, masks, found.copy(), found, v, inner, kept)
    reconsider(setting, known, examined)
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


def reconsider(
    setting: Setting, known: Known, examined: Examined, regions: int = 0, loci: int = 0
) -> None:
    """Close items in regions and at loci that are known, but for the first ones of both."""
    rest, boxes = examined.rest, examined.boxes
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
            stored = into & examined.masks[at].any(axis=1)
            examined.directed[at[stored]] = True
            examined.v[at[stored]] = u[stored]
