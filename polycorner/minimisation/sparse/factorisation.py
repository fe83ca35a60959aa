"""Solutions, ranks and inertias of sparse matrices from SuperLU factorisations."""

from typing import Any

import numpy as np
from scipy.sparse import block_array, csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu

from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

REFINEMENTS = 3  # steps of iterative refinement
MOST_REFINEMENTS = 20  # of a regularised system


def factorised(matrix: Any) -> Any | None:
    """Return SuperLU's factorisation of a square matrix, or None if it is singular."""
    try:
        return splu(csc_array(matrix))
    except RuntimeError:  # SuperLU says so of an exactly singular factor
        return None


def solved(matrix: Any, right: Array, *, transposed: bool = False) -> Array | None:
    """Solve ``A x = b`` (or ``A^T x = b``) with iterative refinement; None for a singular ``A``."""
    lu = factorised(matrix)
    return None if lu is None else refined(lu, matrix, right, transposed=transposed)


def refined(lu: Any, matrix: Any, right: Array, *, transposed: bool = False) -> Array | None:
    """Return the solution from a factorisation, its residual reduced by refinement."""
    way, applied = ("T", matrix.T) if transposed else ("N", matrix)
    x = lu.solve(right, trans=way)
    for _ in range(REFINEMENTS):
        # SuperLU pivots for sparsity as well: what accuracy that costs is won back here.
        x += lu.solve(right - applied @ x, trans=way)
    return x if np.isfinite(x).all() else None


def negative_eigenvalues(matrix: Any) -> int | None:
    """Return the number of negative eigenvalues of a symmetric matrix (Sylvester's inertia).

    They are the negative pivots of a factorisation that pivots on the diagonal alone; None where
    there is none, or where it is too inaccurate.
    """
    square = csc_array(matrix)
    try:
        lu = splu(
            square,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:
        return None
    pivots = lu.U.diagonal()
    # Pivots are those of a congruence only if rows and columns were exchanged alike.
    if not (lu.perm_r == lu.perm_c).all() or not np.isfinite(pivots).all():
        return None
    ones = np.ones(square.shape[0])
    x = lu.solve(ones)
    error = abs(square @ x - ones).max(initial=0.0)
    # The backward error of a factorisation whose pivots' signs are believed.
    size = 1.0 + float(abs(square).sum(axis=1).max()) * float(abs(x).max(initial=0.0))
    return int((pivots < 0).sum()) if error < 1000 * DEFAULT.rounding * size else None


def unit(matrix: csr_array) -> csr_array:
    """Return a matrix with rows of length one; zero rows stay as they are."""
    sizes = lengths(matrix)
    return csr_array(diags_array(1 / np.where(sizes > 0, sizes, 1.0)) @ matrix)


def lengths(matrix: csr_array) -> Array:
    """Return the lengths of the rows."""
    squares: Array = np.asarray(matrix.multiply(matrix).sum(axis=1), dtype=np.float64)
    sizes: Array = np.sqrt(squares.ravel())
    return sizes


def rank(matrix: csr_array, tolerance: float) -> int | None:
    """Return the number of singular values above ``tolerance``, rows scaled to length one.

    By the inertia of ``A A^T - tolerance^2`` (or ``A^T A``, if that is smaller).
    """
    if 0 in matrix.shape:
        return 0
    rows = unit(matrix)
    wide = rows.shape[0] <= rows.shape[1]
    gram = rows @ rows.T if wide else rows.T @ rows
    small = negative_eigenvalues(gram - tolerance**2 * eye_array(gram.shape[0]))
    return None if small is None else gram.shape[0] - small


def least_squares(rows: csr_array, gradient: Array) -> Array | None:
    """Return ``lam`` with the least ``|g - A^T lam|``, for independent rows ``A``."""
    k, n = rows.shape
    # The square system is much the smaller one.
    if k == n:
        return solved(rows, gradient, transposed=True)
    system = block_array([[eye_array(n), rows.T], [rows, None]], format="csc")
    x = solved(system, np.concatenate([gradient, np.zeros(k)]))
    return None if x is None else x[n:]


class Saddle:
    """The symmetric system ``[[H, A^T], [A, 0]]``, of any rank, by a factorisation nearby.

    SuperLU factorises ``[[H + r, A^T], [A, -r]]`` for an ``r`` that is the part ``relative`` of the
    largest entry, and refinement with the system
    itself removes what ``r`` changes ([NW] sec. 19.3, the proximal method of multipliers).  In the
    null space of the system the solution stays as it was at the start: dependent rows and
    directions without curvature do no harm, if there is a solution.

    Raises
    ------
    ValueError
        If the factorisation is singular all the same, or not finite.
    """

    def __init__(self, hessian: Any, rows: csr_array, *, relative: float = 1e-10) -> None:
        k, n = rows.shape
        self.size = n
        self.matrix = csc_array(block_array([[hessian, rows.T], [rows, csr_array((k, k))]]))
        shift = relative * max(1.0, float(abs(self.matrix).max()))
        shifts = np.concatenate([np.full(n, shift), np.full(k, -shift)])
        found = factorised(self.matrix + diags_array(shifts))
        if found is None:
            msg = "the matrix is singular"
            raise ValueError(msg)
        self.lu = found

    def solve(self, right: Array, start: Array) -> Array:
        """Return the solution that is reached from ``start``, ``(n + k,)``; an array of columns."""
        x, left = start, right - self.matrix @ start
        size = float(abs(left).max(initial=0.0))
        for _ in range(MOST_REFINEMENTS):
            nearer = x + self.lu.solve(left)
            after = right - self.matrix @ nearer
            less = float(abs(after).max(initial=0.0))
            if not less < size:
                break
            x, left, stalls = nearer, after, less > 0.5 * size
            size = less
            if stalls:
                break
        return x
