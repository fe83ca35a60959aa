"""Items near saddles, that negative curvature closes in a search for minima alone."""

import numpy as np
from numpy.typing import NDArray

from polycorner.proofs.lists.boxes import Boxes
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.intermediate import bent
from polycorner.proofs.lists.settings import Setting
from polycorner.spaces.manifold import Array


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
    kinds, kind = np.unique(masks, axis=0, return_inverse=True)
    for number, mask in enumerate(kinds):
        rows = [*np.flatnonzero(mask).tolist(), *range(m, setting.problem.rows)]
        at = np.flatnonzero(kind.ravel() == number)
        at = at[smooth[place[at]][:, rows].all(axis=1)]
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
    flat = np.eye(len(free)) - left.transpose(0, 2, 1) @ slopes[:, :-1]
    weights = np.concatenate([-lam, np.ones((len(at), 1))], axis=1)
    bent_form = flat.transpose(0, 2, 1) @ np.einsum("bk,bkij->bij", weights, bends) @ flat
    values, vectors = np.linalg.eigh(0.5 * (bent_form + bent_form.transpose(0, 2, 1)))
    likely = np.flatnonzero(values[:, 0] < 0)
    at, start = at[likely], (vectors[likely, :, 0] * units).astype(np.float32).astype(np.float64)
    sides = tuple(side[at] for side in (g_lo, g_hi, h_lo, h_hi))
    found[at] = bent(sides, left[likely] * units, start)
    directions[at[:, None], free] = start
    return found, directions
