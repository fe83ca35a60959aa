"""Small dense symmetric systems."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.jit import compiled


@compiled
def invert(upper, at, k, mass, out):
    """Invert a symmetric positive definite matrix; its upper triangle begins at ``upper[at]``.

    The result is not a number where the matrix is not definite.
    """
    never_inline()
    # Most bodies have diagonal mass matrices; these keep exact zeros, and cost no elimination.
    diagonal = True
    for i in range(k):
        for j in range(i, k):
            out[i, j] = out[j, i] = upper[at]
            mass[i, j] = mass[j, i] = upper[at]
            if j > i and upper[at] != 0.0:
                diagonal = False
            at += 1
    if diagonal:
        for i in range(k):
            out[i, i] = 1.0 / out[i, i] if out[i, i] > 0.0 else np.nan
        return
    for j in range(k):  # Gauss-Jordan in place: a definite matrix has positive pivots
        pivot = out[j, j] if out[j, j] > 0.0 else np.nan
        out[j, j] = 1.0
        for c in range(k):
            out[j, c] /= pivot
        for i in range(k):
            if i != j:
                factor = out[i, j]
                out[i, j] = 0.0
                for c in range(k):
                    out[i, c] -= factor * out[j, c]


@compiled
def factorise(A, k):
    """Replace the lower triangle of ``A`` by Cholesky's factor; return whether it is definite."""
    top = 0.0
    for c in range(k):
        top = max(top, A[c, c])
    for j in range(k):
        pivot = A[j, j]
        for a in range(j):
            pivot -= A[j, a] * A[j, a]
        # What cancels to rounding is no direction of its own; the second bound is for rows that are
        # nearly zero, in which rounding of other rows remains.
        if pivot <= 1e-13 * A[j, j] or pivot <= 1e-26 * top:
            return False
        pivot = np.sqrt(pivot)
        A[j, j] = pivot
        for i in range(j + 1, k):
            value = A[i, j]
            for a in range(j):
                value -= A[i, a] * A[j, a]
            A[i, j] = value / pivot
    return True


@compiled
def solve_spd(A, b, k):
    """Solve ``A x = b`` in place by Cholesky's method; return whether ``A`` is definite."""
    never_inline()
    if not factorise(A, k):
        return False
    for i in range(k):
        value = b[i]
        for a in range(i):
            value -= A[i, a] * b[a]
        b[i] = value / A[i, i]
    for i in range(k - 1, -1, -1):
        value = b[i]
        for a in range(i + 1, k):
            value -= A[a, i] * b[a]
        b[i] = value / A[i, i]
    return True


@compiled
def add_square(A, row, weight, k):
    """Add ``weight row row'`` to the lower triangle of ``A``."""
    for i in range(k):
        f = weight * row[i]
        # Rows of contacts with surroundings are mostly zeros.
        if f != 0.0:
            for j in range(i + 1):
                A[i, j] += f * row[j]
