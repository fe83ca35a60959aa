"""Values and gradients of rows, wished velocities, and mobilities."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.records import LISTED


@compiled
def evaluate_calls(s, calls, reads, outputs, parameters, w, x, value, J, first, gradients):
    """Evaluate functions of one body's coordinates, and their gradients if asked for."""
    never_inline()
    start, base = w.buffer.ctypes.data, parameters.ctypes.data
    for call in range(calls.shape[0]):
        n, m = calls[call, 2], calls[call, 3]
        r0, w0, p0 = calls[call, 4], calls[call, 5], calls[call, 6]
        for a in range(n):
            w.buffer[a] = x[reads[r0 + a]]
        j0 = n + m
        code = calls[call, 1] if gradients else calls[call, 0]
        call_kernel(code, start, base + 8 * p0, start + 8 * n, start + 8 * j0, start)
        for o in range(m):
            if outputs[w0 + o] < 0:
                continue
            r = first + outputs[w0 + o]
            value[r] = w.buffer[n + o]
            if gradients:
                for c in range(s.k):
                    J[r, c] = 0.0
                for a in range(n):
                    J[r, reads[r0 + a]] += w.buffer[j0 + o * n + a]


@compiled
def evaluate_own(s, w, x, i, value, gradients):
    """Evaluate the gaps and equations of a body at a point."""
    first = i * (s.m + s.limits)
    evaluate_calls(
        s, s.calls, s.reads, s.outputs, s.parameters, w, x[i], value, w.J, first, gradients
    )


@compiled
def evaluate_limits(s, w, x, i, t, h):
    """Evaluate the limits of a body: rows ``a . d + h b >= 0`` for the displacement of a step."""
    k, L = s.k, s.limits
    n, start = 2 * k + 1, w.buffer.ctypes.data
    for c in range(k):
        w.buffer[c] = x[i, c]
        w.buffer[k + c] = 0.0
    w.buffer[2 * k] = t
    j0 = n + L
    call_kernel(s.limit_code, start, start, start + 8 * n, start + 8 * j0, start)
    for o in range(L):
        r = i * (s.m + L) + s.m + o
        w.value[r] = h * w.buffer[n + o]
        for c in range(k):
            w.J[r, c] = w.buffer[j0 + o * n + k + c]


@compiled
def square_distance(s, x, a, b):
    """Return the squared distance of the positions of two bodies, of the nearest images."""
    far = 0.0
    for axis in range(3):
        c = s.position[axis]
        if c >= 0:
            apart = (x[a, c] - x[b, c]) * s.units[c]
            period = s.period[axis]
            if period < np.inf:
                apart -= period * np.floor(apart / period + 0.5)
            far += apart * apart
    return far


@compiled
def evaluate_pairs(s, w, x, value, gradients):
    """Evaluate the gaps of all pairs of neighbours."""
    never_inline()
    k, n, m = s.k, s.pair_reads.shape[0], s.pair_gaps
    start, told = w.buffer.ctypes.data, w.room.ctypes.data + 16
    base = s.pair_parameters.ctypes.data
    first = s.bodies * (s.m + s.limits)
    for p in range(w.status[LISTED]):
        a, b = w.pairs[p, 0], w.pairs[p, 1]
        row = first + p * m
        for r in range(n):
            w.buffer[r] = x[a if s.pair_reads[r, 0] == 0 else b, s.pair_reads[r, 1]]
        j0 = n + m
        code = s.pair_codes[1] if gradients else s.pair_codes[0]
        call_kernel(code, start, base, start + 8 * n, start + 8 * j0, told)
        for g in range(m):
            value[row + g] = w.buffer[n + g]
            if gradients:
                for c in range(2 * k):
                    w.J[row + g, c] = 0.0
                for r in range(n):
                    c = s.pair_reads[r, 0] * k + s.pair_reads[r, 1]
                    w.J[row + g, c] += w.buffer[j0 + g * n + r]


@compiled
def evaluate(s, st, w, x, low, high, value, gradients):
    """Evaluate gaps and equations of some bodies, and of all pairs if these are all bodies."""
    for i in range(low, high):
        if st.alive[i]:
            evaluate_own(s, w, x, i, value, gradients)
    if high - low > 1:
        evaluate_pairs(s, w, x, value, gradients)


@compiled
def factorise(s, w, i):
    """Factorise the mobility of a body, and invert it; return whether it is definite."""
    k, B, L, G = s.k, w.mobility, w.factor, w.metric
    for r in range(k):
        for c in range(r + 1):
            total = B[i, r, c]
            for a in range(c):
                total -= L[i, r, a] * L[i, c, a]
            if r == c:
                if not total > 0.0:
                    return False
                L[i, r, r] = np.sqrt(total)
            else:
                L[i, r, c] = total / L[i, c, c]
    for column in range(k):
        for r in range(k):
            total = 1.0 if r == column else 0.0
            for a in range(r):
                total -= L[i, r, a] * G[i, a, column]
            G[i, r, column] = total / L[i, r, r]
        for r in range(k - 1, -1, -1):
            total = G[i, r, column]
            for a in range(r + 1, k):
                total -= L[i, a, r] * G[i, a, column]
            G[i, r, column] = total / L[i, r, r]
    return True


@compiled
def wished(s, w, x, i, t):
    """Set mobility and wished velocity of a body at a point; return whether they are finite."""
    never_inline()
    k, start = s.k, w.buffer.ctypes.data
    if s.mobility_code != 0:
        for c in range(k):
            w.buffer[c] = x[i, c]
        call_kernel(s.mobility_code, start, start, start + 8 * k, start, start)
        place = k
        for r in range(k):
            for c in range(r + 1):
                w.mobility[i, r, c] = w.mobility[i, c, r] = w.buffer[place]
                place += 1
        if not factorise(s, w, i):
            return False
    for c in range(k):
        w.flow[i, c] = 0.0
    if s.flow_code != 0:
        for c in range(k):
            w.buffer[c] = x[i, c]
        w.buffer[k] = t
        call_kernel(s.flow_code, start, start, start + 8 * (k + 1), start, start)
        for c in range(k):
            w.flow[i, c] = w.buffer[k + 1 + c]
    for c in range(k):
        w.u[i, c] = w.flow[i, c]
    if s.energy_calls.shape[0] > 0:
        energy_at(s, w, x, i, True)
        for r in range(k):
            for c in range(k):
                w.u[i, r] -= w.mobility[i, r, c] * w.J[w.J.shape[0] - 1, c]
    finite = True
    for c in range(k):
        finite = finite and np.isfinite(w.u[i, c])
    return finite


@compiled
def energy_at(s, w, x, i, gradient):
    """Return the energy of a body; its gradient is the last row."""
    last = w.J.shape[0] - 1
    evaluate_calls(
        s, s.energy_calls, s.energy_reads, s.energy_outputs, s.energy_parameters,
        w, x[i], w.trial, w.J, last, gradient,
    )  # fmt: skip
    return w.trial[last]
