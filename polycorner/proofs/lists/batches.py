"""Small linear systems, many at a time, in floating point."""

import numpy as np

from polycorner.spaces.manifold import Array


def bordered(bent: Array, rows: Array) -> Array:
    """Return the Jacobians of KKT equations, from Hessians ``(B, n, n)`` and rows ``(B, k, n)``."""
    n, k = bent.shape[1], rows.shape[1]
    found = np.zeros((len(bent), n + k, n + k))
    found[:, :n, :n], found[:, n:, :n] = bent, rows
    found[:, :n, n:] = -rows.transpose(0, 2, 1)
    return found


def solved(matrix: Array, right: Array) -> Array:
    """Return the solutions ``(B, N)`` of linear systems, NaN for those that are singular."""
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0], dtype=np.float64)
    except np.linalg.LinAlgError:
        if len(matrix) == 1:
            return np.full_like(right, np.nan)
        halves = np.array_split(np.arange(len(matrix)), 2)
        return np.concatenate([solved(matrix[half], right[half]) for half in halves])


def inverted(matrix: Array) -> Array:
    """Return the inverses ``(B, N, N)``, NaN for matrices that are singular."""
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        if len(matrix) == 1:
            return np.full_like(matrix, np.nan)
        halves = np.array_split(np.arange(len(matrix)), 2)
        return np.concatenate([inverted(matrix[half]) for half in halves])
