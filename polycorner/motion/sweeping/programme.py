"""The convex programme of a step.

Of all displacements ``d`` with ``J d + c >= 0``, and ``= 0`` for equations, find the nearest to
``d_0`` in the metric ``G``, the inverse of the mobility ``B``.  It is ``d_0 + B J' lam`` with

``0 <= lam  perp  J d + c >= 0``,

which are the optimality conditions of ``min lam' J B J' lam / 2 + (J d_0 + c)' lam`` over
``lam >= 0``.  Sweeps of projected Gauss and Seidel and conjugate gradients with proportioning take
turns; neither ever increases the function.  What is left of the conditions is measured.
"""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.records import SWEEPS

ROUND, STRETCH = 4, 2000  # sweeps, and steps of gradients, in turn
CHECKED = 5  # steps of gradients between two looks at what is left
POWERS, MARGIN = 8, 1.1  # of the matrix, whose largest eigenvalue is a little above what they tell
PACE = 1.9  # length of a step of fixed length, over that eigenvalue: less than 2
STRIDE = 3  # its place in the work
IDLE, HELD = range(2)  # whether a row belongs to the programme


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
def apply(s, w, low, high, count, x, product):
    """Multiply numbers of rows by the programme's matrix ``J B J'``, scaled to a diagonal of 1.

    ``w.step`` is the displacement that belongs to them.
    """
    for i in range(low, high):
        for c in range(s.k):
            w.step[i, c] = 0.0
    for e in range(count):
        r = w.active[e]
        if x[r] != 0.0:
            push(s, w, r, x[r] / np.sqrt(w.size[r]), w.step)
    for e in range(count):
        r = w.active[e]
        if w.size[r] > 0.0:
            product[r] = along(s, w, r, w.step) / np.sqrt(w.size[r])


@compiled
def spread(s, w, low, high, count):
    """Return an upper estimate of the largest eigenvalue of the matrix, by its powers."""
    for e in range(count):
        r = w.active[e]
        w.course[r] = 1.0 if w.size[r] > 0.0 else 0.0
    largest = 1.0
    for _ in range(POWERS):
        apply(s, w, low, high, count, w.course, w.change)
        size = before = 0.0
        for e in range(count):
            r = w.active[e]
            size += w.change[r] * w.change[r] if w.size[r] > 0.0 else 0.0
            before += w.course[r] * w.course[r]
        if not size > 0.0 or not before > 0.0:
            return largest
        largest = max(largest, np.sqrt(size / before))
        for e in range(count):
            r = w.active[e]
            w.course[r] = w.change[r] / np.sqrt(size) if w.size[r] > 0.0 else 0.0
    return MARGIN * largest


@compiled
def slopes(s, w, count, fresh):
    """Set the slopes of the function by scaled forces; return two products that tell how to go.

    They are the squares of the slopes that forces of zero may follow, and the products of those
    that others may follow with how far they may do so.
    """
    bound = left = 0.0
    for e in range(count):
        r = w.active[e]
        if not w.size[r] > 0.0:
            continue
        root = np.sqrt(w.size[r])
        if fresh:
            w.slope[r] = (along(s, w, r, w.d) + w.shift[r]) / root
        slope, force = w.slope[r], w.force[r] * root
        if is_equation(s, r) or force > 0.0:
            kept = slope if is_equation(s, r) else min(slope, force / w.room[STRIDE])
            left += slope * kept
        elif slope < 0.0:
            bound += slope * slope
    return bound, left


@compiled
def head(s, w, count, zero):
    """Let the course follow the slopes of positive forces or, if told so, of those at zero."""
    for e in range(count):
        r = w.active[e]
        w.course[r] = 0.0
        if w.size[r] > 0.0:
            free = is_equation(s, r) or w.force[r] > 0.0
            if (not zero and free) or (zero and not free and w.slope[r] < 0.0):
                w.course[r] = w.slope[r]


@compiled
def move(s, w, low, high, count, length):
    """Change forces, slopes and displacements along the course, against it."""
    for e in range(count):
        r = w.active[e]
        if w.size[r] > 0.0:
            w.force[r] -= length * w.course[r] / np.sqrt(w.size[r])
            w.slope[r] -= length * w.change[r]
            if not is_equation(s, r):
                w.force[r] = max(0.0, w.force[r])
    for i in range(low, high):
        for c in range(s.k):
            w.d[i, c] -= length * w.step[i, c]


@compiled
def expand(s, w, count):
    """Change forces by a step of fixed length along the slopes, to zero at the least."""
    for e in range(count):
        r = w.active[e]
        if w.size[r] > 0.0 and (is_equation(s, r) or w.force[r] > 0.0):
            force = w.force[r] - w.room[STRIDE] * w.slope[r] / np.sqrt(w.size[r])
            if not is_equation(s, r):
                force = max(0.0, force)
            push(s, w, r, force - w.force[r], w.d)
            w.force[r] = force


@compiled
def descend(s, w, low, high, count, tolerance, steps):
    """Take steps of conjugate gradients with proportioning ([Dostal]); return how many.

    Gradients on the positive forces as long as those of the others are small beside them, and one
    step along the others where they are not.  A step that would make forces negative ends where the
    first vanishes, and one of fixed length along the slopes follows.
    """
    never_inline()
    w.room[STRIDE] = PACE / spread(s, w, low, high, count)
    bound, left = slopes(s, w, count, True)
    head(s, w, count, False)
    for done in range(steps):
        if done % CHECKED == 0 and residual(s, w, count) <= tolerance:
            return done
        zero = bound > left
        if zero:
            head(s, w, count, True)
        apply(s, w, low, high, count, w.course, w.change)
        bent = down = 0.0
        for e in range(count):
            r = w.active[e]
            if w.size[r] > 0.0:
                bent += w.course[r] * w.change[r]
                down += w.course[r] * w.slope[r]
        if not bent > 0.0:
            if not down > 0.0:
                return done
            bent = 0.0
        length, most = (down / bent if bent > 0.0 else np.inf), np.inf
        for e in range(count):
            r = w.active[e]
            if w.size[r] > 0.0 and w.course[r] > 0.0 and not is_equation(s, r):
                most = min(most, w.force[r] * np.sqrt(w.size[r]) / w.course[r])
        if min(length, most) == np.inf:
            return done
        move(s, w, low, high, count, min(length, most))
        if zero or length > most:
            if length > most:
                expand(s, w, count)
            bound, left = slopes(s, w, count, True)
            head(s, w, count, False)
            continue
        bound, left = slopes(s, w, count, False)
        turn = 0.0
        for e in range(count):
            r = w.active[e]
            if w.size[r] > 0.0 and (is_equation(s, r) or w.force[r] > 0.0):
                turn += w.slope[r] * w.change[r]
        for e in range(count):
            r = w.active[e]
            if w.size[r] > 0.0:
                free_row = is_equation(s, r) or w.force[r] > 0.0
                w.course[r] = (w.slope[r] if free_row else 0.0) - turn / bent * w.course[r]
    return steps


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
        done += descend(s, w, low, high, count, tolerance, min(STRETCH, s.sweeps - done))
        left = residual(s, w, count)
        if left <= tolerance:
            break
    st.counts[SWEEPS] += done
    return left
