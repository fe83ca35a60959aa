"""Values and derivatives of a problem at a point, its normalised rows and their violation."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import length

FEASIBLE = 1e-10  # scaled constraint violation allowed during the descent
HUGE = 1e250  # derivatives beyond overflow in products


@compiled
def evaluate(problem, u, F, J, H, size, second):
    """Fill values (M,), scaled gradients (M, n) and, if asked, scaled Hessians (M, n, n)."""
    never_inline()
    table, reads, rows, parameters, scales = problem
    work = np.empty(size)
    start, base = work.ctypes.data, parameters.ctypes.data
    for call in range(table.shape[0]):
        address, k, m = table[call, 0 if second else 1], table[call, 2], table[call, 3]
        r0, w0, p0 = table[call, 4], table[call, 5], table[call, 6]
        for i in range(k):
            c = reads[r0 + i]
            work[i] = u[c] * scales[c]
        j0 = k + m
        h0 = j0 + m * k
        call_kernel(address, start, base + 8 * p0, start + 8 * k, start + 8 * j0, start + 8 * h0)
        for o in range(m):
            row = rows[w0 + o]
            if row < 0:
                continue
            F[row] = work[k + o]
            for i in range(k):
                a = reads[r0 + i]
                J[row, a] = work[j0 + o * k + i] * scales[a]
                if second:
                    for j in range(k):
                        b = reads[r0 + j]
                        H[row, a, b] = work[h0 + (o * k + i) * k + j] * scales[a] * scales[b]
    # Used once more, so that the array lives until the kernels have read it by its address.
    work[0] = 0.0


@compiled
def violation(F, J, use, m):
    """Return the largest scaled violation of the constraints in use; infinite off their domain."""
    never_inline()
    worst = 0.0
    for i in range(F.size - 1):
        miss = abs(F[i]) if i >= m else (-F[i] if use[i] else 0.0)
        if not np.isfinite(F[i]) and (i >= m or use[i]):
            return np.inf
        if miss > 0.0:
            size = length(J[i])
            worst = max(worst, miss / size if 0.0 < size < np.inf else np.inf)
    return worst


@compiled
def normalised_rows(F, J, use, m):
    """Return the rows in use, scaled to unit gradients: ``A``, ``b``, row numbers and lengths."""
    never_inline()
    total = F.size - 1
    keep = np.empty(total, np.int64)
    count = 0
    for i in range(total):
        if (i >= m or use[i]) and length(J[i]) > 0.0:
            keep[count] = i
            count += 1
    A, b, sizes = np.empty((count, J.shape[1])), np.empty(count), np.empty(count)
    for j in range(count):
        sizes[j] = length(J[keep[j]])
        for k in range(J.shape[1]):
            A[j, k] = J[keep[j], k] / sizes[j]
        b[j] = F[keep[j]] / sizes[j]
    return A, b, keep[:count].copy(), sizes


@compiled
def equations_among(keep, m):
    """Return how many of some rows are equations, the last ones: those without gradient are not."""
    count = 0
    for row in keep:
        count += 1 if row >= m else 0
    return count


@compiled
def lagrangian_hessian(H, lam):
    """Return the Hessian of ``E - sum lam f``."""
    never_inline()
    L = H[lam.size].copy()
    for i in range(lam.size):
        if lam[i] != 0.0:
            for a in range(L.shape[0]):
                for c in range(L.shape[1]):
                    L[a, c] -= lam[i] * H[i, a, c]
    return L


@compiled
def all_finite(J, H, lam, last):
    """Whether all gradients, and the Hessians with a nonzero multiplier, are finite."""
    never_inline()
    for i in range(last + 1):
        curved = i == last or lam[i] != 0.0
        for a in range(J.shape[1]):
            if not np.isfinite(J[i, a]):
                return False
            if curved:
                for b in range(J.shape[1]):
                    if not np.isfinite(H[i, a, b]):
                        return False
    return True
