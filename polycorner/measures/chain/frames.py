"""Values and gradients of a system, orthonormal frames of held gradients, and projection."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.formulas.linking import linked

NEWTON = 20  # steps

compiled = linked(error_model="numpy")


@compiled
def evaluate(s, u, F, J, work):
    """Fill values ``(M,)`` and scaled gradients ``(M, n)``."""
    never_inline()
    table, reads, rows, scales = s.calls, s.reads, s.outputs, s.scales
    start, base = work.ctypes.data, s.parameters.ctypes.data
    for call in range(table.shape[0]):
        k, m = table[call, 1], table[call, 2]
        r0, w0, p0 = table[call, 3], table[call, 4], table[call, 5]
        for i in range(k):
            work[i] = u[reads[r0 + i]] * scales[reads[r0 + i]]
        j0 = k + m
        end = start + 8 * (j0 + m * k)
        call_kernel(table[call, 0], start, base + 8 * p0, start + 8 * k, start + 8 * j0, end)
        for o in range(m):
            row = rows[w0 + o]
            if row < 0:
                continue
            F[row] = work[k + o]
            for i in range(k):
                J[row, reads[r0 + i]] = work[j0 + o * k + i] * scales[reads[r0 + i]]


@compiled
def extend(s, gradient, Q, count):
    """Add a gradient to an orthonormal frame ``Q[:count]``; return its part across the frame.

    Zero where it is not independent: then nothing is added.  Twice is enough: Gram and Schmidt.
    """
    never_inline()
    n = gradient.size
    size = across = 0.0
    for k in range(n):
        Q[count, k] = gradient[k]
        size += gradient[k] * gradient[k]
    for _ in range(2):
        for i in range(count):
            along = 0.0
            for k in range(n):
                along += Q[i, k] * Q[count, k]
            for k in range(n):
                Q[count, k] -= along * Q[i, k]
    for k in range(n):
        across += Q[count, k] * Q[count, k]
    if not across > s.singular * s.singular * size:
        return 0.0
    across = np.sqrt(across)
    for k in range(n):
        Q[count, k] /= across
    return across


@compiled
def cross(v, Q, count):
    """Remove from a vector its part along a frame, and return the square of what is left."""
    total = 0.0
    for i in range(count):
        along = 0.0
        for k in range(v.size):
            along += Q[i, k] * v[k]
        for k in range(v.size):
            v[k] -= along * Q[i, k]
    for k in range(v.size):
        total += v[k] * v[k]
    return total


@compiled
def eliminate(A, b, count):
    """Solve ``A x = b`` in place, ``x`` in ``b``; return the logarithm of ``|det A|``."""
    never_inline()
    volume = 0.0
    for i in range(count):
        pivot = i
        for r in range(i + 1, count):
            if abs(A[r, i]) > abs(A[pivot, i]):
                pivot = r
        if not abs(A[pivot, i]) > 0.0:
            return -np.inf
        if pivot != i:
            for c in range(count):
                A[i, c], A[pivot, c] = A[pivot, c], A[i, c]
            b[i], b[pivot] = b[pivot], b[i]
        volume += np.log(abs(A[i, i]))
        for r in range(i + 1, count):
            factor = A[r, i] / A[i, i]
            if factor != 0.0:
                for c in range(i + 1, count):
                    A[r, c] -= factor * A[i, c]
                b[r] -= factor * b[i]
    for i in range(count - 1, -1, -1):
        for c in range(i + 1, count):
            b[i] -= A[i, c] * b[c]
        b[i] /= A[i, i]
    return volume


@compiled
def inclination(P, Q, count, A, b):
    """Return the logarithm of the product of cosines of the angles between two frames' spans.

    It is that of their complements: the tangent spaces of a stratum at two points.
    """
    for i in range(count):
        b[i] = 0.0
        for j in range(count):
            A[i, j] = 0.0
            for k in range(P.shape[1]):
                A[i, j] += P[i, k] * Q[j, k]
    return eliminate(A, b, count)


@compiled
def project(s, u, rows, Q, count, F, J, A, b, work):
    """Move ``u`` along a frame to where given functions vanish; return whether it is there.

    Newton's method for ``f(u + Q^T a) = 0``.  Values and gradients are those at the end.
    """
    never_inline()
    n = u.size
    for _ in range(NEWTON):
        evaluate(s, u, F, J, work)
        away = 0.0
        for i in range(count):
            size = 0.0
            for k in range(n):
                size += J[rows[i], k] * J[rows[i], k]
            if not size > 0.0:
                return False
            away = max(away, abs(F[rows[i]]) / np.sqrt(size))
        if away <= s.settled:
            return True
        if not away < np.inf:
            return False
        for i in range(count):
            b[i] = -F[rows[i]]
            for j in range(count):
                A[i, j] = 0.0
                for k in range(n):
                    A[i, j] += J[rows[i], k] * Q[j, k]
        if not eliminate(A, b, count) > -np.inf:
            return False
        for j in range(count):
            for k in range(n):
                u[k] += b[j] * Q[j, k]
    return False
