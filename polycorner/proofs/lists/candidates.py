"""Approximate stationary points near boxes that are left, by Newton's method in doubles."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.batches import bordered, solved
from polycorner.spaces.manifold import Array

MOST_STEPS = 30
SETTLED = 1e-13  # length of a step in scale units at which the method ends
STRIDE = 0.5  # longest step in scale units
RELEVANT = 1e-6  # share of the largest force at which a function counts as active


def newton(
    problem: Problem,
    q: Array,
    active: Sequence[int],
    free: Sequence[int],
    reach: ArrayLike = np.inf,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return solutions of the KKT equations of a face near some points, and multipliers.

    Parameters
    ----------
    problem : Problem
    q : (B, n) array
        Starting points.
    active : sequence of int
        Inequalities that vanish on the face.
    free : sequence of int
        Coordinates that are unknowns.
    reach : (B,) array, optional
        How far from the start in scale units a solution may be; the method is ended at points that
        are twice as far.

    Returns
    -------
    points : (B, n) array
    multipliers : (B, k) array
        Those of the active functions, then of the equations, with respect to scaled coordinates
        and unscaled functions alike: ``dE = sum lam_i df_i``.
    found : (B,) array of bool
        Where the method has settled.
    """
    rows = [*active, *range(problem.inequalities, problem.rows - 1)]
    n, k, units = len(free), len(rows), problem.scales[list(free)]
    start, reach = q, np.broadcast_to(reach, len(q))
    q, lam, found = q.copy(), np.zeros((len(q), k)), np.zeros(len(q), dtype=np.bool_)
    going = np.arange(len(q))
    for step in range(MOST_STEPS):
        values, gradients, hessians = problem.evaluate(q[going], 2)
        fine = np.isfinite(values).all(axis=1)
        fine &= np.isfinite(hessians[:, [*rows, -1]]).all(axis=(1, 2, 3))
        going, values = going[fine], values[fine][:, rows]
        slopes, pull = gradients[fine][:, rows][:, :, free], gradients[fine, -1][:, free]
        bends = hessians[fine][:, [*rows, -1]][:, :, free][:, :, :, free]
        if step == 0 and k:
            lam[going] = _balancing(slopes, pull)
        weights = lam[going]
        bent = bends[:, -1] - np.einsum("bk,bkij->bij", weights, bends[:, :-1])
        residual = np.concatenate([pull - np.einsum("bk,bki->bi", weights, slopes), values], axis=1)
        change = solved(bordered(bent, slopes), -residual)
        length = abs(change[:, :n]).max(axis=1, initial=0.0)
        with np.errstate(divide="ignore"):
            change *= np.minimum(1.0, STRIDE / length)[:, None]
        fine = np.isfinite(change).all(axis=1)
        going, change, length = going[fine], change[fine], length[fine]
        q[going[:, None], list(free)] += change[:, :n] * units
        lam[going] += change[:, n:]
        away = abs((q[going] - start[going])[:, free] / units).max(axis=1, initial=0.0)
        found[going[(length < SETTLED) & (away <= reach[going])]] = True
        going = going[(length >= SETTLED) & (away <= 2 * reach[going])]
        if not going.size:
            break
    return q, lam, found


def _balancing(slopes: Array, pull: Array) -> Array:
    """Return the multipliers ``(B, k)`` with which gradients ``(B, k, n)`` balance a pull best."""
    found = np.zeros(slopes.shape[:2])
    for b, (rows, right) in enumerate(zip(slopes, pull, strict=True)):
        found[b] = np.linalg.lstsq(rows.T, right, rcond=None)[0]
    return found


def active_sets(weights: Array, pulls: Array) -> NDArray[np.bool_]:
    """Return the functions ``(B, m)`` that balance the energy in nearest combinations.

    Parameters
    ----------
    weights : (B, m + 1) array
        Weights of the gradients, the energy's last.
    pulls : (B, m + 1) array
        Lengths of the gradients.
    """
    forces = weights * pulls
    most = forces.max(axis=1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore"):
        return np.asarray((forces[:, :-1] > RELEVANT * most) & (most > 0))
