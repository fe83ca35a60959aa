"""Approximate stationary points near boxes that are left, by Newton's method in doubles."""

from collections.abc import Sequence

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.spaces.manifold import Array

MOST_STEPS = 30
SETTLED = 1e-13  # length of a step in scale units at which the method ends
STRIDE = 0.5  # longest step in scale units
RELEVANT = 1e-6  # share of the largest force at which a function counts as active


def newton(
    problem: Problem, q: Array, active: Sequence[int], free: Sequence[int]
) -> tuple[Array, Array] | None:
    """Return a solution of the KKT equations of a face near ``q``, and its multipliers, or None.

    The multipliers are those of the active functions, then of the equations, with respect to
    scaled coordinates and unscaled functions alike: ``dE = sum lam_i df_i``.
    """
    rows = [*active, *range(problem.inequalities, problem.rows - 1)]
    n, k, scales = len(free), len(rows), problem.scales
    q = q.copy()
    lam = np.zeros(k)
    for step in range(MOST_STEPS):
        values, gradients, hessians = problem.evaluate(q, 2)
        if not (np.isfinite(values).all() and np.isfinite(hessians[[*rows, -1]]).all()):
            return None
        slopes, pull = gradients[rows][:, free], gradients[-1, free]
        if step == 0 and k:
            lam[:] = np.linalg.lstsq(slopes.T, pull, rcond=None)[0]
        bent = hessians[-1] - np.tensordot(lam, hessians[rows], 1)
        matrix = np.zeros((n + k, n + k))
        matrix[:n, :n] = bent[np.ix_(free, free)]
        matrix[:n, n:], matrix[n:, :n] = -slopes.T, slopes
        residual = np.concatenate([pull - lam @ slopes, values[rows]])
        try:
            change = np.linalg.solve(matrix, -residual)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(change).all():
            return None
        length = float(abs(change[:n]).max(initial=0.0))
        change *= min(1.0, STRIDE / length) if length else 1.0
        q[list(free)] += change[:n] * scales[list(free)]
        lam += change[n:]
        if length < SETTLED:
            return q, lam
    return None


def active_set(weights: Array, pulls: Array) -> list[int]:
    """Return the functions that balance the energy in the nearest combination of gradients.

    Parameters
    ----------
    weights : (m + 1,) array
        Weights of the gradients, the energy's last.
    pulls : (m + 1,) array
        Lengths of the gradients.
    """
    forces = weights * pulls
    most = forces.max(initial=0.0)
    return np.flatnonzero(forces[:-1] > RELEVANT * most).tolist() if most > 0 else []
