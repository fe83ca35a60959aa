"""Dense linear algebra for small systems: norms, factorisations and least squares.

Loops compile ten times faster here than array expressions.
"""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.minimisation.descent.jit import compiled


@compiled
def add_multiple(y, a, x):
    """Add ``a x`` to ``y`` in place.  Loops compile ten times faster than array expressions."""
    never_inline()
    for i in range(y.size):
        y[i] += a * x[i]


@compiled
def plus(x, a, y):
    """Return ``x + a y``."""
    never_inline()
    z = np.empty(x.size)
    for i in range(x.size):
        z[i] = x[i] + a * y[i]
    return z


@compiled
def identity(n):
    """Return the unit matrix."""
    never_inline()
    eye = np.zeros((n, n))
    for i in range(n):
        eye[i, i] = 1.0
    return eye


@compiled
def length(v):
    """Return the Euclidean length."""
    total = 0.0
    for x in v:
        total += x * x
    return np.sqrt(total)


@compiled
def magnitude(x):
    """Return the absolute value; infinite for what is no number, which comparisons would hide."""
    return np.inf if np.isnan(x) else abs(x)


@compiled
def largest(a):
    """Return the largest absolute entry of a vector; infinite if one is no number."""
    never_inline()
    top = 0.0
    for x in a:
        top = max(top, magnitude(x))
    return top


@compiled
def largest_entry(A):
    """Return the largest absolute entry of a matrix; infinite if one is no number."""
    never_inline()
    top = 0.0
    for i in range(A.shape[0]):
        top = max(top, largest(A[i]))
    return top


@compiled
def svd(A):
    """Return ``(U, s, V)`` with ``A = U diag(s) V^T``, V square, by one-sided Jacobi rotations."""
    never_inline()
    m, n = A.shape
    W, V = A.copy(), identity(n)
    # Columns below rounding are zero: between two of them an angle has no meaning.
    negligible = 1e-32 * m * n * largest_entry(A) ** 2
    for _ in range(60):
        turned = False
        for i in range(n - 1):
            for j in range(i + 1, n):
                a = b = c = 0.0
                for k in range(m):
                    a += W[k, i] * W[k, i]
                    b += W[k, j] * W[k, j]
                    c += W[k, i] * W[k, j]
                if abs(c) <= 1e-15 * np.sqrt(a * b) or min(a, b) <= negligible:
                    continue
                turned = True
                # The smaller of the two angles that make the columns orthogonal.
                zeta = (b - a) / (2.0 * c)
                t = (1.0 if zeta >= 0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / np.sqrt(1.0 + t * t)
                sine = cosine * t
                for k in range(m):
                    x, y = W[k, i], W[k, j]
                    W[k, i], W[k, j] = cosine * x - sine * y, sine * x + cosine * y
                for k in range(n):
                    x, y = V[k, i], V[k, j]
                    V[k, i], V[k, j] = cosine * x - sine * y, sine * x + cosine * y
        if not turned:
            break
    s = np.empty(n)
    for j in range(n):
        s[j] = length(W[:, j])
        if s[j] > 0.0:
            for k in range(m):
                W[k, j] /= s[j]
    return W, s, V


@compiled
def solve_truncated(A, b, cut):
    """Return the shortest least-squares solution of ``A x = b``, singular values below cut zero."""
    never_inline()
    U, s, V = svd(A)
    x = np.zeros(A.shape[1])
    for j in range(s.size):
        if s[j] > cut:
            weight = 0.0
            for k in range(b.size):
                weight += U[k, j] * b[k]
            weight /= s[j]
            for k in range(x.size):
                x[k] += weight * V[k, j]
    return x


@compiled
def cholesky(B, L):
    """Factor ``B = L L^T`` in place of L; return whether every pivot is safely positive."""
    never_inline()
    n = B.shape[0]
    # A pivot of the size of its rounding error would make a step of any length.
    floor = 1e-14 * largest_entry(B)
    for i in range(n):
        for j in range(i + 1):
            total = B[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                if not total > floor:
                    return False
                L[i, i] = np.sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    return True


@compiled
def forward(L, b):
    """Return the solution of ``L x = b``."""
    never_inline()
    x = b.copy()
    for i in range(x.size):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    return x


@compiled
def backward(L, b):
    """Return the solution of ``L^T x = b``."""
    never_inline()
    x = b.copy()
    for i in range(x.size - 1, -1, -1):
        for k in range(i + 1, x.size):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
    return x
