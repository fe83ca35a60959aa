"""The compiled core of :func:`~polycorner.minimisation.methods.minimise`.

Everything Numba compiles stands in this one file, because Numba's disk cache notices changes of
the file a function stands in and of no other.

All vectors are in scaled coordinates ``u = q / scales``.  A problem is a tuple of flat arrays

=========  ==============================================================================
table      (G, 7) int64: addresses of a kernel's point routines with and without Hessians, its
           variables, its outputs, where its reads, rows and parameters start
reads      coordinate read by each variable of each call
rows       row of the system each output goes to, or -1
parameters numbers, call after call
scales     (n,)
=========  ==============================================================================

Rows: ``m`` inequalities ``f >= 0``, then the equations ``h = 0``, then the energy.
"""

import numpy as np
from numba import njit

from polycorner.formulas.compilation import call_kernel, never_inline

CONVERGED, INFEASIBLE, UNBOUNDED, STALLED = 0, 1, 2, 3

FEASIBLE = 1e-10  # scaled distance by which a constraint may be missed during the descent
EXACT = 1e-13  # and after the last Newton iterations
FIRST_CAP = 0.5  # longest first step, in scale units
PATIENCE = 20  # steps after which active functions, too, are curved up across
FAR = 1e8  # a descent that goes farther is called unbounded
CURVED = 1e-8  # relative curvature below which a stationary point is a saddle
RANK = 1e-8  # singular values below this fraction of the largest count as zero


@njit(cache=True)
def evaluate(problem, u, F, J, H, size, second):
    """Fill values (M,), scaled gradients (M, n) and, if asked, scaled Hessians (M, n, n)."""
    never_inline()
    table, reads, rows, parameters, scales = problem
    work = np.empty(size)
    start, base = work.ctypes.data, parameters.ctypes.data
    for call in range(table.shape[0]):
        curved, straight, k, m, r0, w0, p0 = table[call]
        address = curved if second else straight
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
    work[0] = 0.0


@njit(cache=True)
def add_multiple(y, a, x):
    """Add ``a x`` to ``y`` in place.  Loops compile ten times faster than array expressions."""
    never_inline()
    for i in range(y.size):
        y[i] += a * x[i]


@njit(cache=True)
def plus(x, a, y):
    """Return ``x + a y``."""
    never_inline()
    z = np.empty(x.size)
    for i in range(x.size):
        z[i] = x[i] + a * y[i]
    return z


@njit(cache=True)
def identity(n):
    """Return the unit matrix."""
    never_inline()
    eye = np.zeros((n, n))
    for i in range(n):
        eye[i, i] = 1.0
    return eye


@njit(cache=True)
def length(v):
    """Return the Euclidean length."""
    total = 0.0
    for x in v:
        total += x * x
    return np.sqrt(total)


@njit(cache=True)
def largest(a):
    """Return the largest absolute entry of a vector."""
    never_inline()
    top = 0.0
    for x in a:
        top = max(top, abs(x))
    return top


@njit(cache=True)
def largest_entry(A):
    """Return the largest absolute entry of a matrix."""
    never_inline()
    top = 0.0
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            top = max(top, abs(A[i, j]))
    return top


@njit(cache=True)
def svd(A):
    """Return ``(U, s, V)`` with ``A = U diag(s) V^T``, V square, by one-sided Jacobi rotations."""
    never_inline()
    m, n = A.shape
    W, V = A.copy(), identity(n)
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


@njit(cache=True)
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


@njit(cache=True)
def cholesky(B, L):
    """Factor ``B = L L^T`` in place of L; return whether every pivot is safely positive."""
    never_inline()
    n = B.shape[0]
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


@njit(cache=True)
def forward(L, b):
    """Return the solution of ``L x = b``."""
    never_inline()
    x = b.copy()
    for i in range(x.size):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    return x


@njit(cache=True)
def backward(L, b):
    """Return the solution of ``L^T x = b``."""
    never_inline()
    x = b.copy()
    for i in range(x.size - 1, -1, -1):
        for k in range(i + 1, x.size):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
    return x


@njit(cache=True)
def project_out(Q, R, count, w):
    """Split ``w`` into ``Q y + rest`` over an orthonormal basis; return ``(rest, R^-1 y)``."""
    never_inline()
    rest, y = w.copy(), np.zeros(count)
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


@njit(cache=True)
def basis(W, active, count, Q, R):
    """Orthonormalise the active rows of ``W`` by Gram-Schmidt with one repetition."""
    never_inline()
    for j in range(count):
        rest, _, y = project_out(Q, R, j, W[active[j]])
        for k in range(j):
            R[k, j] = y[k]
        R[j, j] = length(rest)
        for k in range(rest.size):
            Q[k, j] = rest[k] / R[j, j]


@njit(cache=True)
def slack(A, b, x, i):
    """Return ``A_i x + b_i``."""
    total = b[i]
    for k in range(x.size):
        total += A[i, k] * x[k]
    return total


@njit(cache=True)
def most_violated(A, b, x, is_active, start, stop, equations):
    """Return the inactive row that fails most, as inequality or equation, or -1."""
    never_inline()
    chosen, worst = -1, 0.0
    for i in range(start, stop):
        if is_active[i]:
            continue
        miss = slack(A, b, x, i)
        miss = -abs(miss) if equations else miss
        if miss < worst - 1e-13 * max(1.0, abs(b[i])):
            chosen, worst = i, miss
    return chosen


@njit(cache=True)
def quadratic(L, g, A, b, equations):
    """Minimise ``g.d + |L^T d|^2 / 2`` subject to ``A d + b >= 0``, the last rows ``= 0``.

    Dual active-set method ([GI]): start from the free minimum, add the most violated row, step in
    primal and dual together, drop rows whose multiplier would change sign.

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
    count, failed = np.int64(0), False
    for _ in range(20 * (rows + n) + 20):
        p = most_violated(A, b, x, is_active, rows - equations, rows, True)
        if p < 0:
            p = most_violated(A, b, x, is_active, np.int64(0), rows - equations, False)
        if p < 0:
            break
        sign[p] = -1.0 if slack(A, b, x, p) > 0 else 1.0
        for k in range(n):
            W[p, k] *= sign[p]
        while True:
            basis(W, active, count, Q, R)
            rest, r, _ = project_out(Q, R, count, W[p])
            size = length(rest)
            independent = size > 1e-10 * length(W[p])
            step, drop = np.inf, -1
            for j in range(count):
                a = active[j]
                if a < rows - equations and r[j] > 1e-14 and lam[a] / r[j] < step:
                    step, drop = lam[a] / r[j], j
            full = np.inf
            if independent:
                full = -sign[p] * slack(A, b, x, p) / (size * size)
            if not independent and drop < 0:
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
            count -= 1
        if failed:
            break
    for i in range(rows):
        lam[i] *= sign[i]
    return not failed, x, lam


@njit(cache=True)
def violation(F, J, use, m):
    """Return the largest scaled distance by which a used constraint is missed."""
    never_inline()
    worst = 0.0
    for i in range(F.size - 1):
        miss = abs(F[i]) if i >= m else (-F[i] if use[i] else 0.0)
        if np.isnan(F[i]) and (i >= m or use[i]):
            return np.inf
        if miss > 0.0:
            size = length(J[i])
            worst = max(worst, miss / size if size > 0.0 else np.inf)
    return worst


@njit(cache=True)
def system(F, J, use, m):
    """Return the used rows, normalised to unit gradients: ``A``, ``b``, their numbers and sizes."""
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
    return A, b, keep, sizes


@njit(cache=True)
def least_violation(A, b, equations):
    """Return a damped Gauss-Newton step for rows that cannot all be met to first order."""
    never_inline()
    n = A.shape[1]
    G, g = np.zeros((n, n)), np.zeros(n)
    for k in range(n):
        G[k, k] = 1e-3
    for i in range(A.shape[0]):
        if b[i] < 0.0 or i >= A.shape[0] - equations:
            for k in range(n):
                g[k] -= A[i, k] * b[i]
                for j in range(n):
                    G[k, j] += A[i, k] * A[i, j]
    return solve_truncated(G, g, 0.0)


@njit(cache=True)
def project(problem, use, m, u, F, J, H, size, limit):
    """Move ``u`` to the nearest feasible point by repeated linearisation; return success."""
    never_inline()
    n, equations = u.size, F.size - 1 - m
    eye, zero = identity(n), np.zeros(n)
    evaluate(problem, u, F, J, H, size, False)
    worst = violation(F, J, use, m)
    for _ in range(limit):
        if worst <= FEASIBLE:
            return True
        A, b, _, _ = system(F, J, use, m)
        count = min(equations, b.size)
        feasible, d, _ = quadratic(eye, zero, A, b, count)
        if not feasible:
            d = least_violation(A, b, count)
        reach = largest(d)
        if not reach > 0.0:
            return False
        factor = min(1.0, 0.5 / reach)
        improved = False
        for _ in range(12):
            trial = plus(u, factor, d)
            evaluate(problem, trial, F, J, H, size, False)
            after = violation(F, J, use, m)
            if after < worst * (1.0 - 0.1 * factor) or after <= FEASIBLE:
                for k in range(n):
                    u[k] = trial[k]
                worst = after
                improved = True
                break
            factor *= 0.4
        if not improved:
            return False
    return worst <= FEASIBLE


@njit(cache=True)
def crosses_wall(problem, use, m, u, d, F, J, H, size):
    """Whether the straight way ``u -> u + d`` leaves the set between samples half a unit apart."""
    never_inline()
    samples = min(64, int(np.ceil(2.0 * largest(d))))
    for k in range(1, samples):
        evaluate(problem, plus(u, k / samples, d), F, J, H, size, False)
        if not violation(F, J, use, m) <= 0.5:
            return True
    return False


@njit(cache=True)
def lagrangian_hessian(H, lam):
    """Return the Hessian of ``E - sum lam f``."""
    never_inline()
    n = H.shape[1]
    L = np.empty((n, n))
    for a in range(n):
        for c in range(n):
            L[a, c] = H[lam.size, a, c]
            for i in range(lam.size):
                if lam[i] != 0.0:
                    L[a, c] -= lam[i] * H[i, a, c]
    return L


@njit(cache=True)
def finite(J, H, lam, last):
    """Whether the gradients and the Hessians that count are finite, as at the end of a chart."""
    never_inline()
    for i in range(last + 1):
        for a in range(J.shape[1]):
            if not np.isfinite(J[i, a]):
                return False
            for b in range(J.shape[1]):
                if (i == last or lam[i] != 0.0) and not np.isfinite(H[i, a, b]):
                    return False
    return True


@njit(cache=True)
def convexified(B, g, A, L):
    """Factor ``B``, made definite: curved up across the rows of ``A``, then along the identity.

    What is added across the gradients of equations does not change a step along their section;
    multiples of the identity, in a geometric sequence, are added only if that is not enough.
    """
    never_inline()
    n = B.shape[0]
    across, shift = 0.0, 1e-6 * max(largest_entry(B), largest(g))
    if shift < 1e-300:
        shift = 1e-300 if shift > 0.0 else 1.0
    while True:
        C = B.copy()
        for i in range(n):
            C[i, i] += shift
            for k in range(n):
                for j in range(A.shape[0]):
                    C[i, k] += across * A[j, i] * A[j, k]
        if cholesky(C, L):
            return
        if across == 0.0 and A.shape[0] > 0:
            across = 10.0 * n * largest_entry(B)
        else:
            shift *= 8.0


@njit(cache=True)
def add_tangential_step(d, L, g, V, s, cut, reference):
    """Add to ``d`` the shortest Newton step along the face, the null space of its gradients."""
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


@njit(cache=True)
def polish(problem, on, m, held, u, F, J, H, size):
    """Newton's method on the KKT equations of the face where the rows ``on`` and equations vanish.

    The components of ``u`` along the rows of ``held`` stay as they are.

    Dependent gradients and flat directions are met by pseudo-inverses: the shortest step.
    Returns the multipliers by row and the last step's length.
    """
    never_inline()
    n, total = u.size, F.size - 1
    lam = np.zeros(total)
    last = np.inf
    for _ in range(60):
        evaluate(problem, u, F, J, H, size, True)
        rows, b, keep, sizes = system(F, J, on, m)
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
        if not np.isfinite(step) or step > 1e3:
            return lam, np.inf
        if (step >= 0.5 * last and step < 1e-9) or step <= 1e-16:
            break
        add_multiple(u, 1.0, d)
        last = step
    evaluate(problem, u, F, J, H, size, True)
    return lam, step


@njit(cache=True)
def steepest_curve(F, J, H, lam, on, m, direction):
    """Return the least curvature of the Lagrangian along the face, relative, and its direction."""
    never_inline()
    n, total = H.shape[1], lam.size
    A, b, _, _ = system(F, J, on, m)
    V, s = identity(n), np.zeros(n)
    cut = 0.0
    if b.size:
        _, s, V = svd(A)
        cut = RANK * largest(s)
    L = lagrangian_hessian(H, lam)
    reference = max(largest_entry(L), largest_entry(H[total])) + 1e-300
    M = np.zeros((n, n))
    for a in range(n):
        for c in range(n):
            if s[a] <= cut and s[c] <= cut:
                for i in range(n):
                    for k in range(n):
                        M[a, c] += V[i, a] * L[i, k] * V[k, c]
        # Shifted to be definite, so that singular vectors are eigenvectors; off the face, large.
        M[a, a] += 2.0 * n * reference
        if s[a] > cut:
            M[a, a] += 2.0 * n * reference
    _, _, W = svd(M)
    least, chosen = np.inf, 0
    for j in range(n):
        value = 0.0
        for a in range(n):
            for c in range(n):
                value += W[a, j] * M[a, c] * W[c, j]
        value -= 2.0 * n * reference
        if value < least:
            least, chosen = value, j
    for i in range(n):
        direction[i] = 0.0
        for a in range(n):
            direction[i] += V[i, a] * W[a, chosen]
    return least / reference


@njit(cache=True)
def finished(problem, use, on, m, u, F, J, H, size, energy):
    """Polish a copy of ``u``: 3 a rest, 2 a saddle, 1 not stationary, 0 higher or outside.

    Returns that number, the point, the multipliers and the direction of least curvature.
    """
    never_inline()
    v, rows, direction = u.copy(), on.copy(), np.zeros(u.size)
    for _ in range(4):
        lam, step = polish(problem, rows, m, np.zeros((0, u.size)), v, F, J, H, size)
        if not step < 1e-8 or largest(plus(v, -1.0, u)) > 0.5:
            return 0, v, lam, direction
        added = False
        for i in range(m):
            if use[i] and not rows[i] and F[i] < -EXACT * length(J[i]):
                rows[i] = added = True
        if not added:
            break
    last = F.size - 1
    reference = max(largest(J[last]), largest_entry(H[last]))
    pull = J[last].copy()
    stationary = True
    for i in range(F.size - 1):
        add_multiple(pull, -lam[i], J[i])
        if i < m and rows[i] and lam[i] * length(J[i]) < -1e-9 * reference:
            stationary = False
    higher = F[last] > energy + 1e-9 * (abs(energy) + reference)
    if higher or violation(F, J, use, m) > FEASIBLE:
        return 0, v, lam, direction
    if not (stationary and largest(pull) <= 1e-9 * reference):
        return 1, v, lam, direction
    for i in range(m):
        # A function without a multiplier holds nothing: the energy may fall as its contact opens.
        rows[i] = rows[i] and lam[i] * length(J[i]) > 1e-9 * reference
    if steepest_curve(F, J, H, lam, rows, m, direction) >= -CURVED:
        return 3, v, lam, direction
    # A saddle that was left must not draw the descent back, not even by a rounding error.
    return (2 if F[last] <= energy else 0), v, lam, direction


@njit(cache=True)
def leave(problem, use, on, m, v, direction, F, J, H, size):
    """Move ``v`` off a saddle, to a feasible lower point along its direction; return success.

    A straight step first; where the set bulges, which leaves it behind, along the face instead.
    """
    never_inline()
    evaluate(problem, v, F, J, H, size, False)
    energy = F[F.size - 1]
    along = np.zeros((1, v.size))
    along[0] = direction / length(direction)
    for k in range(48):
        step = 0.1 * 0.5 ** (k // 4) * (1.0 - 2.0 * (k % 2))
        trial = plus(v, step, direction)
        if k % 4 < 2:
            reached = project(problem, use, m, trial, F, J, H, size, np.int64(6))
        else:
            _, last = polish(problem, on, m, along, trial, F, J, H, size)
            reached = last < 1e-8 and violation(F, J, use, m) <= FEASIBLE
        if reached and F[F.size - 1] < energy:
            for i in range(v.size):
                v[i] = trial[i]
            return True
    return False


@njit(cache=True)
def probe(problem, on, use, m, rows, u, directions, held, steps, size):
    """Follow directions along a face; return the largest change, or infinity.

    The change is that of the energy, or its slope along the span of ``held`` (orthonormal rows,
    which span the directions) on the face.  Each step is corrected by Newton's method on the
    face with the components along ``held`` fixed.  Steps that leave the set of the used rows are
    skipped; a direction that cannot be followed at all counts as infinite.
    """
    n = u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    evaluate(problem, u, F, J, H, size, False)
    energy, worst = F[rows - 1], 0.0
    for j in range(directions.shape[0]):
        followed = False
        for step in steps:
            guess = plus(u, step, directions[j])
            q = guess.copy()
            lam, last = polish(problem, on, m, held, q, F, J, H, size)
            if not last < 1e-8 or largest(plus(q, -1.0, guess)) > 0.1 * abs(step):
                return np.inf
            if violation(F, J, use, m) <= FEASIBLE:
                followed = True
                worst = max(worst, abs(F[rows - 1] - energy))
                for r in range(held.shape[0]):
                    slope = 0.0
                    for k in range(n):
                        pull = J[rows - 1, k]
                        for i in range(rows - 1):
                            pull -= lam[i] * J[i, k]
                        slope += held[r, k] * pull
                    worst = max(worst, abs(slope))
        if not followed:
            return np.inf
    return worst


@njit(cache=True)
def descend(problem, use, m, rows, u, size, limit):
    """Descend from ``u`` inside the set of the used rows; never through a wall.

    Every iterate is feasible and lower than the one before: a step of sequential quadratic
    programming, shortened to the cap, brought back to the set by projection, halved until the
    energy falls.  When the active rows settle, Newton's method on their KKT equations ends it.

    Returns
    -------
    status, iterations, u, multipliers
    """
    n = u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    L = np.zeros((n, n))
    lam, on, before = np.zeros(rows - 1), np.zeros(m, np.bool_), np.zeros(m, np.bool_)
    u = u.copy()
    origin = u.copy()
    if not project(problem, use, m, u, F, J, H, size, np.int64(100)) or not np.isfinite(
        F[rows - 1]
    ):
        return INFEASIBLE, 0, u, lam
    nothing, section = np.zeros(m, np.bool_), np.zeros((0, n))
    cap = FIRST_CAP
    for iteration in range(1, limit + 1):
        evaluate(problem, u, F, J, H, size, True)
        energy, g = F[rows - 1], J[rows - 1].copy()
        if not finite(J, H, lam, rows - 1):
            return STALLED, iteration, u, lam
        if rows - 1 > m or iteration > PATIENCE:
            section, _, _, _ = system(F, J, on if iteration > PATIENCE else nothing, m)
        convexified(lagrangian_hessian(H, lam), g, section, L)
        A, b, keep, sizes = system(F, J, use, m)
        for j in range(b.size):
            if abs(b[j]) < FEASIBLE:
                b[j] = 0.0
        _, d, mult = quadratic(L, g, A, b, rows - 1 - m)
        for i in range(rows - 1):
            lam[i] = 0.0
        for i in range(m):
            before[i], on[i] = on[i], False
        for j in range(b.size):
            lam[keep[j]] = mult[j] / sizes[j]
            if keep[j] < m and mult[j] > 0.0:
                on[keep[j]] = True
        reach = largest(d)
        settled = True
        for i in range(m):
            settled = settled and on[i] == before[i]
        if reach < 1e-9 or (reach < 0.5 and settled):
            good, v, exact, way = finished(problem, use, on, m, u, F, J, H, size, energy)
            if good == 3:
                return CONVERGED, iteration, v, exact
            if good == 2 and leave(problem, use, on, m, v, way, F, J, H, size):
                for k in range(n):
                    u[k] = v[k]
                continue
            if reach < 1e-9:
                return STALLED, iteration, v if good else u, lam
        slope = 0.0
        for k in range(n):
            slope += g[k] * d[k]
        factor = min(1.0, cap / reach)
        accepted = False
        for _ in range(40):
            trial = plus(u, factor, d)
            blocked = factor * reach > 0.5 and crosses_wall(
                problem, use, m, u, plus(trial, -1.0, u), F, J, H, size
            )
            if not blocked and project(problem, use, m, trial, F, J, H, size, np.int64(6)):
                slack = 1e-15 * (abs(energy) + largest(g))
                if F[rows - 1] <= energy + 1e-4 * factor * slope + slack:
                    accepted = True
                    break
            factor *= 0.5
        if not accepted:
            good, v, exact, way = finished(problem, use, on, m, u, F, J, H, size, energy)
            if good == 2 and leave(problem, use, on, m, v, way, F, J, H, size):
                for k in range(n):
                    u[k] = v[k]
                continue
            return (CONVERGED if good >= 2 else STALLED), iteration, v if good else u, exact
        if factor * reach >= 0.99 * cap:
            cap *= 2.0
        else:
            cap = max(FIRST_CAP, factor * reach)
        u = trial
        if largest(plus(u, -1.0, origin)) > FAR:
            return UNBOUNDED, iteration, u, lam
    return STALLED, limit, u, lam


@njit(cache=True)
def restore(problem, use, m, rows, u, size):
    """Bring a copy of ``u`` to the set; return whether that succeeded, and the point."""
    n = u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    v = u.copy()
    return project(problem, use, m, v, F, J, H, size, np.int64(100)), v


@njit(cache=True)
def on_face(problem, on, m, rows, u, size):
    """Polish a copy of ``u`` on the face where the rows ``on`` vanish; see :func:`polish`."""
    n = u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    v = u.copy()
    lam, step = polish(problem, on, m, np.zeros((0, n)), v, F, J, H, size)
    return v, lam, step
