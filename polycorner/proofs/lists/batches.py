"""Small linear systems, many at a time, in floating point."""

from collections.abc import Callable
from contextlib import suppress

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
    columns = right[:, :, None]
    return _each(np.linalg.solve, np.full_like(columns, np.nan), matrix, columns)[:, :, 0]


def inverted(matrix: Array) -> Array:
    """Return the inverses ``(B, N, N)``, NaN for matrices that are singular."""
    return _each(np.linalg.inv, np.full_like(matrix, np.nan), matrix)


def _each(function: Callable[..., Array], found: Array, *arrays: Array) -> Array:
    """Put results of a function into an array, where the matrix is not singular."""
    fine = _regular(arrays[0])
    try:
        found[fine] = function(*(array[fine] for array in arrays))
    except np.linalg.LinAlgError:  # a pivot was zero after all: rounding decides that
        for k in np.flatnonzero(fine):
            with suppress(np.linalg.LinAlgError):
                found[k] = function(*(array[k] for array in arrays))
    return found


def _regular(matrix: Array) -> NDArray[np.bool_]:
    """Return which matrices are eliminated without a pivot of zero."""
    regular: NDArray[np.bool_] = np.linalg.slogdet(matrix)[0] != 0
    return regular
