"""Strictly convex quadratic programmes by the dual active-set method ([GI])."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import add_multiple, backward, forward, length


@compiled
def project_out(Q, R, count, w):
    """Split ``w`` into ``Q y + rest`` over an orthonormal basis; return ``(rest, R^-1 y, y)``."""
    never_inline()
    rest, y = w.copy(), np.zeros(count)
    # Twice: one pass of Gram and Schmidt loses orthogonality where rows are nearly dependent.
    for _ in range(2):
        for j in range(count):
            part = 0.0
            for k in range(w.size):
                part += Q[k, j] * rest[k]
            y[j] += part
            for k in range(w.size):
                rest[k] -= part * Q[k, j]
    r = y.copy()
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            r[i] -= R[i, k] * r[k]
        r[i] /= R[i, i]
    return rest, r, y


@compiled
def orthonormalise(W, active, known, count, Q, R):
    """Orthonormalise the active rows of ``W`` by Gram-Schmidt with one reorthogonalisation.

    The first ``known`` of them are so already.
    """
    never_inline()
    for j in range(known, count):
        rest, _, y = project_out(Q, R, j, W[active[j]])
        for k in range(j):
            R[k, j] = y[k]
        R[j, j] = length(rest)
        for k in range(rest.size):
            Q[k, j] = rest[k] / R[j, j]


@compiled
def slack(A, b, x, i):
    """Return ``A_i x + b_i``."""
    total = b[i]
    for k in range(x.size):
        total += A[i, k] * x[k]
    return total


@compiled
def most_violated(A, b, x, is_active, start, stop, equations):
    """Return the most violated inactive row among ``start:stop``, or -1."""
    never_inline()
    chosen, worst = -1, 0.0
    for i in range(start, stop):
        if is_active[i]:
            continue
        miss = slack(A, b, x, i)
        # An equation is violated on either side.
        miss = -abs(miss) if equations else miss
        if miss < worst - 1e-13 * max(1.0, abs(b[i])):
            chosen, worst = i, miss
    return chosen


@compiled
def solve_quadratic(L, g, A, b, equations):
    """Minimise ``g.d + |L^T d|^2 / 2`` subject to ``A d + b >= 0``, the last rows ``= 0``.

    Dual active-set method ([GI]): start from the unconstrained minimum, add the most violated
    row, step in primal and dual variables together, drop rows whose multiplier would change sign.
    ``L`` is the Cholesky factor of the Hessian.

    Returns
    -------
    feasible, d (n,), multipliers (rows,)
    """
    never_inline()
    rows, n = A.shape
    W = np.empty((rows, n))
    for i in range(rows):
        w = forward(L, A[i])
        for k in range(n):
            W[i, k] = w[k]
    x = np.zeros(n)
    add_multiple(x, -1.0, backward(L, forward(L, g)))
    lam, sign = np.zeros(rows), np.zeros(rows)
    active, is_active = np.empty(rows + 1, np.int64), np.zeros(rows, np.bool_)
    Q, R = np.zeros((n, n)), np.zeros((n, n))
    count, known, failed = np.int64(0), np.int64(0), False
    for _ in range(20 * (rows + n) + 20):
        p = most_violated(A, b, x, is_active, rows - equations, rows, True)
        # Equations first: they never leave the active set again.
        if p < 0:
            p = most_violated(A, b, x, is_active, np.int64(0), rows - equations, False)
        if p < 0:
            break
        # An equation that is violated from above enters as the inequality turned round.
        sign[p] = -1.0 if slack(A, b, x, p) > 0 else 1.0
        for k in range(n):
            W[p, k] *= sign[p]
        while True:
            orthonormalise(W, active, known, count, Q, R)
            known = count
            rest, r, _ = project_out(Q, R, count, W[p])
            size = length(rest)
            independent = count < n and size > 1e-10 * length(W[p])
            step, drop = np.inf, -1
            for j in range(count):
                a = active[j]
                if a < rows - equations and r[j] > 1e-14 and lam[a] / r[j] < step:
                    step, drop = lam[a] / r[j], j
            full = np.inf
            if independent:
                full = -sign[p] * slack(A, b, x, p) / (size * size)
            # The row is a combination of active ones that cannot give way: no feasible point.
            if drop < 0 and not full < np.inf:
                failed = True
                break
            move = min(step, full)
            if independent:
                add_multiple(x, move, backward(L, rest))
            for j in range(count):
                lam[active[j]] -= move * r[j]
            lam[p] += move
            if full <= step:
                active[count] = p
                is_active[p] = True
                count += 1
                break
            is_active[active[drop]] = False
            lam[active[drop]] = 0.0
            for j in range(drop, count - 1):
                active[j] = active[j + 1]
            count, known = count - 1, drop
        if failed:
            break
    for i in range(rows):
        lam[i] *= sign[i]
    return not failed, x, lam
