"""Small linear systems, many at a time, in floating point."""

import numpy as np
from numpy.typing import NDArray

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
    fine, found = _regular(matrix), np.full_like(right, np.nan)
    found[fine] = np.linalg.solve(matrix[fine], right[fine][:, :, None])[:, :, 0]
    return found


def inverted(matrix: Array) -> Array:
    """Return the inverses ``(B, N, N)``, NaN for matrices that are singular."""
    fine, found = _regular(matrix), np.full_like(matrix, np.nan)
    found[fine] = np.linalg.inv(matrix[fine])
    return found


def _regular(matrix: Array) -> NDArray[np.bool_]:
    """Return which matrices are eliminated without a pivot of zero."""
    regular: NDArray[np.bool_] = np.linalg.slogdet(matrix)[0] != 0
    return regular
