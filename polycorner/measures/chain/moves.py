"""The chain: moves within a stratum, into one with a contact more, and into one with one fewer.

The stratum with the contacts ``I`` has the density ``pi_I`` with respect to its surface measure.
Let ``x`` be in the stratum with the contacts ``I + i`` and ``y`` in that with ``I``.  The way from
``x`` to ``y`` loses the contact: a normal vector along the lower stratum, of standard deviation
``sideways``, and a distance that is uniform between 0 and ``reach`` along ``n``, the direction in
which the contact opens, are added, and the sum is projected along the gradients of ``I`` at
``x``.  The way from ``y`` to ``x`` gains it: a normal vector along both the stratum and the
contact's level set is added, and the sum is projected along the gradients of ``I + i`` at ``y``.  A
tangent vector ``v`` leads to points of density ``p(v) |det(U^T V)|``, ``U`` and ``V`` bases of the
tangent spaces at both ends.  Both proposals are densities by the surface measures of the two
strata, so that

``pi_{I+i}(x) P_lose(x) q_lose(x, y) a(x, y) = pi_I(y) P_gain(y) q_gain(y, x) a(y, x)``

is detailed balance.  A move is refused where the way back does not lead to the point it came from
([ZHG], [HC20]).
"""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.formulas.intermediate import intermediate_code
from polycorner.formulas.records import RecordType, reader
from polycorner.measures.chain import records
from polycorner.measures.chain.frames import (
    compiled,
    cross,
    evaluate,
    extend,
    inclination,
    project,
)

BITS = records.BITS
system_at, chain_at = (
    reader(RecordType(f"chain.{name}", getattr(records, name).declared))
    for name in ("SYSTEM", "CHAIN")
)


@compiled
def uniform(stream):
    """Return a number between 0 and 1, by SplitMix64 ([Steele])."""
    x = np.uint64(stream[0]) + np.uint64(0x9E3779B97F4A7C15)
    stream[0] = np.int64(x)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return (np.float64((x ^ (x >> np.uint64(31))) >> np.uint64(11)) + 0.5) / 9007199254740992.0


@compiled
def draw(stream, v, deviation):
    """Fill a vector with normal numbers, by pairs ([Knuth] 3.4.1, the polar method)."""
    never_inline()
    for i in range(0, v.size, 2):
        size = 2.0
        while size >= 1.0:
            a, b = 2.0 * uniform(stream) - 1.0, 2.0 * uniform(stream) - 1.0
            size = a * a + b * b
        factor = deviation * np.sqrt(-2.0 * np.log(size) / size)
        v[i] = factor * a
        if i + 1 < v.size:
            v[i + 1] = factor * b


@compiled
def frame(s, rows, count, F, J, Q):
    """Fill the frame of held rows, equations first; return the logarithm of the density.

    Minus infinity where gradients are dependent.
    """
    never_inline()
    density = 0.0
    for i in range(count):
        size = extend(s, J[rows[i]], Q, i)
        if size == 0.0:
            return -np.inf
        if rows[i] < s.inequalities:
            density += s.weights[rows[i]] - (np.log(size) if s.sticky else 0.0)
    if s.charged:
        density -= F[s.rows - 1] / s.temperature
    return density


@compiled
def inside(s, rows, count, F, J):
    """Whether all inequalities that are not held are positive."""
    for i in range(s.inequalities):
        held = False
        for j in range(count):
            held = held or rows[j] == i
        if held:
            continue
        size = 0.0
        for k in range(J.shape[1]):
            size += J[i, k] * J[i, k]
        if not F[i] > s.zero * np.sqrt(size):
            return False
    return True


@compiled
def within_reach(s, rows, count, F, J, Q, found):
    """List the contacts that may be gained: those that are near along the stratum."""
    never_inline()
    total, equations = 0, s.rows - s.inequalities - s.charged
    if count - equations >= s.most:
        return 0
    for i in range(s.inequalities):
        held = False
        for j in range(count):
            held = held or rows[j] == i
        size = 0.0
        for k in range(J.shape[1]):
            size += J[i, k] * J[i, k]
        # The part of the gradient along the stratum is no longer than the gradient.
        if held or F[i] > s.reach * np.sqrt(size):
            continue
        across = extend(s, J[i], Q, count)
        if across > 0.0 and F[i] <= s.reach * across:
            found[total] = i
            total += 1
    return total


@compiled
def losable(s, rows, count, found):
    """List the positions of contacts that may be lost."""
    total, equations = 0, s.rows - s.inequalities - s.charged
    if count - equations <= s.least:
        return 0
    for i in range(equations, count):
        if not s.fixed[rows[i]]:
            found[total] = i
            total += 1
    return total


@compiled
def returns(s, u, target, rows, Q, count, F, J, A, b, work):
    """Whether projection from ``u`` leads to a point."""
    never_inline()
    if not project(s, u, rows, Q, count, F, J, A, b, work):
        return False
    away = 0.0
    for k in range(u.size):
        away = max(away, abs(u[k] - target[k]))
    return away <= s.same


@compiled
def step(s, move, stream, counts, U, F, J, Q, rows, count, density, v, w, A, b, found, work):
    """Propose a move; return whether it is accepted, with the new count and density.

    Entry 0 of the arrays is where the chain is, entry 1 what is proposed, entry 2 the way back.
    ``rows`` of both are equations first; the contact that is gained or lost is the last.
    """
    never_inline()
    n = v.size
    counts[move] += 1
    after = count
    ratio = 0.0
    if move == 0:
        if count == n:
            return False, count, density
        draw(stream, v, s.step)
        ratio = cross(v, Q[0], count) / (2.0 * s.step * s.step)
        lower = upper = count
    elif move == 1:
        choices = within_reach(s, rows[0], count, F[0], J[0], Q[0], found)
        if choices == 0:
            return False, count, density
        rows[0, count] = found[min(int(uniform(stream) * choices), choices - 1)]
        extend(s, J[0, rows[0, count]], Q[0], count)
        lower, upper, after = count + 1, count, count + 1
        draw(stream, v, s.sideways)
        ratio = cross(v, Q[0], lower) / (2.0 * s.sideways * s.sideways)
        ratio -= np.log(s.gain / choices) + np.log(s.reach)
    else:
        choices = losable(s, rows[0], count, found)
        if choices == 0:
            return False, count, density
        chosen = found[min(int(uniform(stream) * choices), choices - 1)]
        lost = rows[0, chosen]
        for i in range(chosen, count - 1):
            rows[0, i] = rows[0, i + 1]
        rows[0, count - 1] = lost
        frame(s, rows[0], count, F[0], J[0], Q[0])
        lower, upper, after = count, count - 1, count - 1
        draw(stream, v, s.sideways)
        ratio = cross(v, Q[0], lower) / (2.0 * s.sideways * s.sideways)
        ratio -= np.log(s.lose / choices) - np.log(s.reach)
        opened = s.reach * uniform(stream)
        for k in range(n):
            v[k] += opened * Q[0, upper, k]
    for i in range(lower):
        rows[1, i] = rows[0, i]
    for k in range(n):
        U[1, k] = U[0, k] + v[k]
    going = lower if move == 1 else upper
    if going:
        if not project(s, U[1], rows[1], Q[0], going, F[1], J[1], A, b, work):
            return False, count, density
    else:
        evaluate(s, U[1], F[1], J[1], work)
    if not inside(s, rows[1], after, F[1], J[1]):
        return False, count, density
    proposed = frame(s, rows[1], after, F[1], J[1], Q[1])
    if not proposed > -np.inf:
        return False, count, density
    # The way back.
    for k in range(n):
        w[k] = U[0, k] - U[1, k]
    back = upper
    if move == 0:
        ratio -= cross(w, Q[1], upper) / (2.0 * s.step * s.step)
    elif move == 1:
        opened = 0.0
        for k in range(n):
            opened += w[k] * Q[1, upper, k]
        if not 0.0 < opened <= s.reach:
            return False, count, density
        ratio -= cross(w, Q[1], lower) / (2.0 * s.sideways * s.sideways)
        for k in range(n):
            w[k] += opened * Q[1, upper, k]
        ratio += np.log(s.lose / losable(s, rows[1], after, found))
    else:
        choices = within_reach(s, rows[1], after, F[1], J[1], Q[1], found)
        known = False
        for i in range(choices):
            known = known or found[i] == rows[1, upper]
        if not known:
            return False, count, density
        extend(s, J[1, rows[1, upper]], Q[1], upper)
        ratio -= cross(w, Q[1], lower) / (2.0 * s.sideways * s.sideways)
        ratio += np.log(s.gain / choices)
        back = lower
    if move:
        turned = inclination(Q[0], Q[1], upper, A, b) - inclination(Q[0], Q[1], lower, A, b)
        ratio += turned if move == 1 else -turned
    if not np.log(uniform(stream)) < ratio + proposed - density:
        return False, count, density
    if back:
        for k in range(n):
            U[2, k] = U[1, k] + w[k]
        if not returns(s, U[2], U[0], rows[1], Q[1], back, F[2], J[2], A, b, work):
            return False, count, density
    counts[3 + move] += 1
    return True, after, proposed


@compiled
def run(system, chain):
    """Move a chain and record it; return whether it could begin."""
    s, c = system_at(system), chain_at(chain)
    n, m, M = c.u.size, s.inequalities, s.rows
    U, F, J = np.zeros((3, n)), np.zeros((3, M)), np.zeros((3, M, n))
    Q, rows = np.zeros((3, n + 1, n)), np.zeros((3, n + 1), np.int64)
    A, b, v, w = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(n)
    found, work = np.zeros(M + n, np.int64), np.zeros(s.size)
    count = 0
    for i in range(m, M - s.charged):
        rows[0, count] = i
        count += 1
    for i in range(m):
        if c.held[i] and count <= n:
            rows[0, count] = i
            count += 1
    if count > n:
        return (0,)
    for k in range(n):
        U[0, k] = c.u[k]
    evaluate(s, U[0], F[0], J[0], work)
    density = frame(s, rows[0], count, F[0], J[0], Q[0])
    if not density > -np.inf:
        return (0,)
    for record in range(c.points.shape[0]):
        for _ in range(c.every):
            choice = uniform(c.stream)
            move = 1 if choice < s.gain else (2 if choice < s.gain + s.lose else 0)
            before = count
            accepted, count, density = step(
                s, move, c.stream, c.counts, U, F, J, Q, rows, count, density, v, w, A, b,
                found, work,
            )  # fmt: skip
            if accepted:
                for k in range(n):
                    U[0, k] = U[1, k]
                for i in range(M):
                    F[0, i] = F[1, i]
                    for k in range(n):
                        J[0, i, k] = J[1, i, k]
                for i in range(count):
                    rows[0, i] = rows[1, i]
                    for k in range(n):
                        Q[0, i, k] = Q[1, i, k]
            elif move == 2:  # the lost contact was moved to the end
                frame(s, rows[0], before, F[0], J[0], Q[0])
        for k in range(n):
            c.points[record, k] = U[0, k] * s.scales[k]
        for i in range(count):
            if rows[0, i] < m:
                c.codes[record, rows[0, i] // BITS] |= np.int64(1) << (rows[0, i] % BITS)
    for k in range(n):
        c.u[k] = U[0, k]
    for i in range(m):
        c.held[i] = 0
    for i in range(count):
        if rows[0, i] < m:
            c.held[rows[0, i]] = 1
    return (1,)


def made() -> str:
    """Return the entry point as intermediate code."""
    return intermediate_code({"run": run}, arguments=2)
