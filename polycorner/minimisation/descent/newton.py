"""Newton's method on the KKT equations of a face."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.minimisation.descent.evaluation import evaluate, lagrangian_hessian, normalised_rows
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import (
    add_multiple,
    identity,
    largest,
    largest_entry,
    solve_truncated,
    svd,
)

RANK = 1e-8  # singular values below this fraction of the largest count as zero


@compiled
def add_tangential_step(d, L, g, V, s, cut, reference):
    """Add to ``d`` the shortest Newton step in the face's tangent space, where ``s <= cut``."""
    never_inline()
    n, count = d.size, 0
    Z = np.empty((n, n))
    for j in range(n):
        if s[j] <= cut:
            for k in range(n):
                Z[count, k] = V[k, j]
            count += 1
    if count == 0:
        return
    LZ, reduced, pull = np.zeros((count, n)), np.zeros((count, count)), np.zeros(count)
    for a in range(count):
        for i in range(n):
            for k in range(n):
                LZ[a, i] += L[i, k] * Z[a, k]
        for i in range(n):
            pull[a] -= Z[a, i] * g[i] + LZ[a, i] * d[i]
        for c in range(count):
            for i in range(n):
                reduced[a, c] += LZ[a, i] * Z[c, i]
    p = solve_truncated(reduced, pull, 1e-9 * reference)
    for a in range(count):
        add_multiple(d, p[a], Z[a])


@compiled
def polish(problem, on, m, held, u, F, J, H, size):
    """Newton's method on the KKT equations of the face where the rows ``on`` and equations vanish.

    The components of ``u`` along the rows of ``held`` are kept fixed.  With dependent gradients or
    flat directions the step is the shortest least-squares solution.  Returns the multipliers by
    row and the length of the last step.
    """
    never_inline()
    n, total = u.size, F.size - 1
    lam = np.zeros(total)
    last = np.inf
    for _ in range(60):
        evaluate(problem, u, F, J, H, size, True)
        rows, b, keep, sizes = normalised_rows(F, J, on, m)
        kept = rows.shape[0]
        A = np.zeros((kept + held.shape[0], n))
        for k in range(n):
            for j in range(kept):
                A[j, k] = rows[j, k]
            for j in range(held.shape[0]):
                A[kept + j, k] = held[j, k]
        g = J[total]
        for i in range(total):
            lam[i] = 0.0
        V, s = identity(n), np.zeros(n)
        d = np.zeros(n)
        if A.shape[0]:
            U, s, V = svd(A)
            # Multipliers and the step across the face from one factorisation of its rows; what is
            # below the cut is left at zero, so that both are the shortest.
            cut = RANK * largest(s)
            for c in range(n):
                if s[c] > cut:
                    slope = miss = 0.0
                    for k in range(n):
                        slope += V[k, c] * g[k] / s[c]
                    for j in range(b.size):
                        miss += U[j, c] * b[j] / s[c]
                    for j in range(b.size):
                        lam[keep[j]] += U[j, c] * slope / sizes[j]
                    for k in range(n):
                        d[k] -= V[k, c] * miss
        else:
            cut = 0.0
        L = lagrangian_hessian(H, lam)
        add_tangential_step(d, L, g, V, s, cut, max(largest_entry(L), largest_entry(H[total])))
        step = largest(d)
        # Not on the way to a point nearby: the caller goes on without Newton's method.
        if not np.isfinite(step) or step > 1e3:
            return lam, np.inf
        # Rounding errors do not shrink quadratically; without this the loop would chase them.
        if (step >= 0.5 * last and step < 1e-9) or step <= 1e-16:
            break
        add_multiple(u, 1.0, d)
        last = step
    evaluate(problem, u, F, J, H, size, True)
    return lam, step
