"""The convex programme of a step.

Of all displacements ``d`` with ``J d + c >= 0``, and ``= 0`` for equations, find the nearest to
``d_0`` in the metric ``G``, the inverse of the mobility ``B``.  It is ``d_0 + B J' lam`` with

``0 <= lam  perp  J d + c >= 0``,

which are the optimality conditions of ``min lam' J B J' lam / 2 + (J d_0 + c)' lam`` over
``lam >= 0``.  Sweeps of projected Gauss and Seidel find the rows that act, and conjugate gradients
on these rows solve what is left, up to the first force that vanishes; neither ever increases the
function ([MT91]).  What is left of the conditions is measured after each round.
"""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.records import SWEEPS

ROUND = 4  # sweeps between two solutions on the rows that act
SHARE = 0.1  # of the tolerance, to which these are solved
IDLE, HELD, ACTS = range(3)  # whether a row belongs to the programme, and whether it acts


@compiled
def is_equation(s, r):
    """Return whether a row is an equation."""
    place = r % (s.m + s.limits) if s.m + s.limits > 0 else 0
    return r < s.bodies * (s.m + s.limits) and s.inequalities <= place < s.m


@compiled
def is_limit(s, r):
    """Return whether a row is a limit on velocities."""
    per = s.m + s.limits
    return per > 0 and r < s.bodies * per and r % per >= s.m


@compiled
def prepare(s, w, r):
    """Set what a row needs: the mobility times its gradient, and its sizes."""
    k, a, b = s.k, w.owner[r, 0], w.owner[r, 1]
    size = norm = 0.0
    for side in range(1 if b < 0 else 2):
        body, first = (a if side == 0 else b), side * k
        for c in range(k):
            total = 0.0
            for e in range(k):
                total += w.mobility[body, c, e] * w.J[r, first + e]
            w.M[r, first + c] = total
            size += total * w.J[r, first + c]
            norm += (w.J[r, first + c] / s.units[c]) ** 2
    w.size[r], w.norm[r] = size, np.sqrt(norm)


@compiled
def along(s, w, r, d):
    """Return the change of a row's function under a displacement, to first order."""
    k, a, b = s.k, w.owner[r, 0], w.owner[r, 1]
    total = 0.0
    for c in range(k):
        total += w.J[r, c] * d[a, c]
    if b >= 0:
        for c in range(k):
            total += w.J[r, k + c] * d[b, c]
    return total


@compiled
def push(s, w, r, force, d):
    """Add what a force on a row does to displacements."""
    k, a, b = s.k, w.owner[r, 0], w.owner[r, 1]
    for c in range(k):
        d[a, c] += w.M[r, c] * force
    if b >= 0:
        for c in range(k):
            d[b, c] += w.M[r, k + c] * force


@compiled
def sweep(s, w, count):
    """Solve every row for its own force, one after the other."""
    for e in range(count):
        r = w.active[e]
        if not w.size[r] > 0.0:
            continue
        force = w.force[r] - (along(s, w, r, w.d) + w.shift[r]) / w.size[r]
        if force < 0.0 and not is_equation(s, r):
            force = 0.0
        change = force - w.force[r]
        if change != 0.0:
            w.force[r] = force
            push(s, w, r, change, w.d)


@compiled
def residual(s, w, count):
    """Return what is left of the conditions, as a length: the largest of all rows."""
    worst = 0.0
    for e in range(count):
        r = w.active[e]
        if not w.norm[r] > 0.0:
            continue
        left = along(s, w, r, w.d) + w.shift[r]
        if left > 0.0 and not is_equation(s, r):
            left = min(left, w.force[r] * w.size[r])
        worst = max(worst, abs(left) / w.norm[r])
    return worst


@compiled
def descend(s, w, low, high, count, tolerance):
    """Take conjugate gradients on the rows that act, up to the first force that vanishes."""
    never_inline()
    k, product = s.k, 0.0
    for e in range(count):
        r = w.active[e]
        acts = w.size[r] > 0.0 and (w.force[r] > 0.0 or is_equation(s, r))
        w.listed[r], w.course[r] = (ACTS if acts else HELD), 0.0
        if acts:
            w.slope[r] = -(along(s, w, r, w.d) + w.shift[r])
            w.course[r] = w.slope[r] / w.size[r]
            product += w.slope[r] * w.course[r]
    for _ in range(count):
        if not product > 0.0:
            return
        for i in range(low, high):
            for c in range(k):
                w.step[i, c] = 0.0
        for e in range(count):
            r = w.active[e]
            if w.listed[r] == ACTS:
                push(s, w, r, w.course[r], w.step)
        bent = 0.0
        for e in range(count):
            r = w.active[e]
            if w.listed[r] == ACTS:
                bent += w.course[r] * along(s, w, r, w.step)
        if not bent > 0.0:
            return
        length, blocked = product / bent, -1
        for e in range(count):
            r = w.active[e]
            falls = w.listed[r] == ACTS and not is_equation(s, r)
            if falls and w.force[r] + length * w.course[r] < 0.0:
                length, blocked = -w.force[r] / w.course[r], r
        for e in range(count):
            r = w.active[e]
            if w.listed[r] == ACTS:
                w.force[r] += length * w.course[r]
                if not is_equation(s, r):
                    w.force[r] = max(0.0, w.force[r])
        for i in range(low, high):
            for c in range(k):
                w.d[i, c] += length * w.step[i, c]
        if blocked >= 0:
            w.force[blocked] = 0.0
            return
        former, product, worst = product, 0.0, 0.0
        for e in range(count):
            r = w.active[e]
            if w.listed[r] == ACTS:
                w.slope[r] -= length * along(s, w, r, w.step)
                product += w.slope[r] * w.slope[r] / w.size[r]
                worst = max(worst, abs(w.slope[r]) / w.norm[r])
        if worst <= tolerance:
            return
        for e in range(count):
            r = w.active[e]
            if w.listed[r] == ACTS:
                w.course[r] = w.slope[r] / w.size[r] + product / former * w.course[r]


@compiled
def solve(s, st, w, low, high, count, tolerance):
    """Solve the programme of the active rows; return what is left of its conditions.

    ``wish`` is the displacement that is wanted; forces begin where they are.
    """
    never_inline()
    for i in range(low, high):
        for c in range(s.k):
            w.d[i, c] = w.wish[i, c]
    for e in range(count):
        r = w.active[e]
        if w.force[r] != 0.0:
            push(s, w, r, w.force[r], w.d)
    left, done = np.inf, 0
    while done < s.sweeps:
        for _ in range(ROUND):
            sweep(s, w, count)
        done += ROUND
        left = residual(s, w, count)
        if left <= tolerance or not left < np.inf:
            break
        descend(s, w, low, high, count, SHARE * tolerance)
    st.counts[SWEEPS] += done
    return left
