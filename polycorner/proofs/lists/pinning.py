"""Search for points that redundant functions hold to first order, near boxes that are left."""

from math import comb

import numpy as np

from polycorner.proofs.lists.attempts import WIDER, Attempts
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.examination import Examined
from polycorner.proofs.lists.known import Known
from polycorner.proofs.lists.pinned import Pinned, pinned
from polycorner.proofs.lists.redundancy import MOST_ITEMS, MOST_SETS, largest_sets, starts
from polycorner.proofs.lists.settings import Setting
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

NEWTON = 6  # steps towards a point where all functions of a box vanish
STRAY = 4.0  # sides of a box that such a point may be away from its middle
PINS = -2  # before the functions of such a point, where it is tried in vain


def pin(setting: Setting, known: Known, e: Examined, attempts: Attempts) -> None:
    """Look for points that are held to first order, near open boxes that were just tried.

    In boxes where more functions may vanish than can be independent.
    """
    free, units = list(setting.domain.free), setting.problem.scales
    left = e.open_items
    counts = e.masks[e.rest.items[left]].sum(axis=1)
    tried = e.boxes.since[e.where[e.rest.items[left]]] == 0
    left = left[e.rest.smooth[left] & (counts > len(free)) & tried][:MOST_ITEMS]
    if len(setting.conj) > 1 or setting.equations or setting.domain.parameters or not left.size:
        return
    items = e.rest.items[left]
    boxes, masks = e.boxes.part(e.where[items]), e.masks[items]
    widths = ((boxes.upper - boxes.lower) / units)[:, free].max(axis=1)
    q = boxes.middles
    for _ in range(NEWTON):
        values, slopes = _vanishing(setting, q, masks)
        step = np.clip(np.einsum("bij,bj->bi", np.linalg.pinv(slopes), -values), -1, 1)
        q[:, free] += step * units[free]
    values, slopes = _vanishing(setting, q, masks)
    sizes = abs(slopes).max(axis=(1, 2), initial=0.0)
    fine = abs(values).max(axis=1, initial=0.0) <= DEFAULT.feasible * sizes
    fine &= (abs(q - boxes.middles) / units)[:, free].max(axis=1) <= STRAY * widths
    for i in np.flatnonzero(fine):
        rows, reach = tuple(np.flatnonzero(masks[i]).tolist()), WIDER * float(widths[i])
        if _is_pinned(known, q[i], masks[i]) or attempts.failed.has((PINS, *rows), q[i], reach):
            continue
        region = pinned(setting.vertices, setting.problem.rows - 1, q[i], slopes[i], reach)
        if region is None or not set(rows) <= set(region.active):
            attempts.failed.add((PINS, *rows), q[i], reach)
        else:
            if comb(len(rows), len(free)) <= MOST_SETS:  # listed with as few functions as possible
                sets = largest_sets(setting, known, e, items[i])
                attempts.run(starts(setting, e, e.where[items[i]], sets))
            known.add(region)


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
