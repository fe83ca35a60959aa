"""The velocities that contacts and limits admit at one instant."""

from polycorner.motion.sweeping.displacements import ends_of, travel_of, wish_at
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.pieces import count_unions, holding, union_value
from polycorner.motion.sweeping.programme import (
    HELD,
    IDLE,
    along,
    is_equation,
    is_limit,
    prepare,
    solve,
)
from polycorner.motion.sweeping.rows import evaluate


@compiled
def admit_some(s, st, w, low, high, t):
    """Set the velocities of some bodies; return whether all is finite."""
    per, unions = s.m + s.limits, count_unions(s)
    a, b, c, d = ends_of(s, w, low, high)
    if not wish_at(s, st, w, st.q, low, high, t, 1.0):
        return False
    evaluate(s, st, w, st.q, low, high, w.before, True)
    for r in range(a, b):
        w.on[r] = 1 if r % per >= s.inequalities or s.always[r % per] else 0
        w.listed[r] = IDLE
        prepare(s, w, r)
    for r in range(c, d):
        w.on[r], w.listed[r] = 1, IDLE
        prepare(s, w, r)
    for i in range(low, high):
        for u in range(unions):
            w.chosen[i, u] = -1
    while True:
        count = 0
        for r in range(a, b):
            count = add_touching(s, st, w, r, count)
        for r in range(c, d):
            count = add_touching(s, st, w, r, count)
        tolerance = max(s.tolerance * s.tolerance, s.rounding) * travel_of(s, w, low, high)
        solve(s, st, w, low, high, count, tolerance)
        again = False
        for i in range(low, high):
            for u in range(unions if st.alive[i] else 0):
                again = keep(s, w, i, u, tolerance) or again
        if not again:
            break
    for i in range(low, high):
        for component in range(s.k):
            w.v[i, component] = w.d[i, component] if st.alive[i] else 0.0
    return True


@compiled
def add_touching(s, st, w, r, count):
    """Add a row that touches, or is an equation or a limit; return the new count."""
    a, b = w.owner[r, 0], w.owner[r, 1]
    if w.listed[r] != IDLE:
        return count
    if not w.on[r] or not st.alive[a] or (b >= 0 and not st.alive[b]):
        w.force[r] = 0.0
        return count
    if is_limit(s, r) or is_equation(s, r) or w.before[r] <= s.touching * w.norm[r]:
        w.listed[r], w.force[r] = HELD, 0.0
        if not is_limit(s, r):
            w.shift[r] = 0.0
        w.active[count] = r
        return count + 1
    w.force[r] = 0.0
    return count


@compiled
def keep(s, w, i, u, tolerance):
    """Choose a piece where a velocity leaves a union; return whether one was chosen."""
    first = i * (s.m + s.limits)
    if w.chosen[i, u] >= 0 or union_value(s, w, w.before, first, u) > s.touching:
        return False
    count = holding(s, w, w.before, first, u)
    for e in range(count):
        admitted, p = True, w.meeting[e]
        for place in range(s.row_of_piece[p], s.row_of_piece[p + 1]):
            r = first + s.rows[place]
            if w.before[r] <= s.touching * w.norm[r]:
                admitted = admitted and along(s, w, r, w.d) >= -tolerance * w.norm[r]
        if admitted:
            return False
    w.chosen[i, u] = w.meeting[0]
    for place in range(s.row_of_piece[w.meeting[0]], s.row_of_piece[w.meeting[0] + 1]):
        w.on[first + s.rows[place]] = 1
    return True
