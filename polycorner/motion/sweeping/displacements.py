"""The displacement of a step without noise."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.pieces import FREE, MET, choose, count_unions
from polycorner.motion.sweeping.programme import (
    HELD,
    IDLE,
    along,
    is_equation,
    is_limit,
    prepare,
    solve,
)
from polycorner.motion.sweeping.records import (
    CORRECTIONS,
    DONE,
    FAILED,
    LISTED,
    NOT_FINITE,
    PROGRAMMES,
    RESIDUAL,
    SPLIT,
    UNSOLVED,
)
from polycorner.motion.sweeping.rows import evaluate, evaluate_limits, wished

CORRECTED = 30  # most corrections of the end of a step


@compiled
def ends_of(s, w, low, high):
    """Return where the rows of some bodies begin and end, and where those of pairs do."""
    per, last = s.m + s.limits, s.bodies * (s.m + s.limits)
    pairs = w.status[LISTED] * s.pair_gaps if high - low > 1 else 0
    return low * per, high * per, last, last + pairs


@compiled
def add_row(s, w, r, count):
    """Add a row to the programme, unless it is in it; return the new count."""
    if w.listed[r] != IDLE:
        return count
    w.listed[r] = HELD
    w.active[count] = r
    prepare(s, w, r)
    return count + 1


@compiled
def travel_of(s, w, low, high):
    """Return the longest displacement that is wished, as a length."""
    most = 0.0
    for i in range(low, high):
        for c in range(s.k):
            most = max(most, abs(w.wish[i, c]) * s.units[c])
    return most


@compiled
def tolerance_of(s, st, w, low, high):
    """Return to which scaled length the programme of a step is solved."""
    far = 1.0
    for i in range(low, high):
        for c in range(s.k):
            far = max(far, abs(st.q[i, c]) * s.units[c])
    return max(min(s.tolerance * travel_of(s, w, low, high), 0.5 * s.zero), s.rounding * far)


@compiled
def start_rows(s, st, w, low, high):
    """Empty the programme, but for equations, limits, and rows that acted; return their count."""
    a, b, c, d = ends_of(s, w, low, high)
    count = 0
    for r in range(a, b):
        w.listed[r] = IDLE
    for r in range(c, d):
        w.listed[r] = IDLE
    per = s.m + s.limits
    for i in range(low, high):
        if not st.alive[i]:
            continue
        for r in range(i * per, (i + 1) * per):
            if r - i * per >= s.inequalities or (w.on[r] and w.force[r] > 0.0):
                count = add_row(s, w, r, count)
    for r in range(c, d):
        if w.force[r] > 0.0:
            count = add_row(s, w, r, count)
    return count


@compiled
def fails(s, w, r, value, ahead):
    """Return whether a row that is not in the programme is negative, now or at the end."""
    if w.listed[r] != IDLE:
        return False
    return value[r] + (along(s, w, r, w.d) if ahead else 0.0) < 0.0


@compiled
def violated(s, st, w, low, high, count, value, ahead):
    """Add rows that fail: gaps that are negative, after the displacement to first order or now."""
    a, b, c, d = ends_of(s, w, low, high)
    for r in range(a, b):
        if w.on[r] and st.alive[w.owner[r, 0]] and fails(s, w, r, value, ahead):
            count = add_row(s, w, r, count)
            w.shift[r], w.force[r] = value[r], 0.0
    for r in range(c, d):
        alive = st.alive[w.owner[r, 0]] and st.alive[w.owner[r, 1]]
        if alive and fails(s, w, r, value, ahead):
            count = add_row(s, w, r, count)
            w.shift[r], w.force[r] = value[r], 0.0
    return count


@compiled
def wish_at(s, st, w, x, low, high, t, h):
    """Set the displacement that is wished at a point and a time; return whether it is finite."""
    finite = True
    for i in range(low, high):
        if st.alive[i]:
            finite = wished(s, w, x, i, t) and finite
            if s.limits > 0:
                evaluate_limits(s, w, x, i, t, h)
                for o in range(s.limits):
                    r = i * (s.m + s.limits) + s.m + o
                    w.shift[r] = w.value[r]
            for c in range(s.k):
                w.wish[i, c] = h * w.u[i, c]
        else:
            for c in range(s.k):
                w.wish[i, c] = 0.0
    return finite


@compiled
def begin(s, st, w, low, high):
    """Evaluate functions where bodies are, and what tells how far they are from unions' ends."""
    evaluate(s, st, w, st.q, low, high, w.before, True)
    if count_unions(s) > 0:
        a, b, _, _ = ends_of(s, w, low, high)
        for r in range(a, b):
            prepare(s, w, r)


@compiled
def predict(s, st, w, low, high, t, h):
    """Find the displacement to first order, with gradients at the start.

    Returns the count of rows, or -1 where something is not finite.
    """
    never_inline()
    if not wish_at(s, st, w, st.q, low, high, t, h):
        return -1
    begin(s, st, w, low, high)
    count = start_rows(s, st, w, low, high)
    for e in range(count):
        r = w.active[e]
        if not is_limit(s, r):
            w.shift[r] = w.before[r]
    # Only the middle of the step is taken from here, and forces to begin with.
    rough = np.sqrt(s.tolerance) * travel_of(s, w, low, high)
    tolerance = max(tolerance_of(s, st, w, low, high), rough)
    while True:
        solve(s, st, w, low, high, count, tolerance)
        more = violated(s, st, w, low, high, count, w.before, True)
        if more == count:
            return count
        count = more


@compiled
def set_ends(s, st, w, low, high, whole):
    """Set points after a part of the displacement."""
    for i in range(low, high):
        for c in range(s.k):
            w.x[i, c] = st.q[i, c] + whole * w.d[i, c]


@compiled
def correct(s, st, w, low, high, t, h, count):
    """Find the displacement with gradients and wishes at its middle, so that gaps hold at its end.

    Returns the count of rows, what is left of the conditions, and whether gaps hold.
    """
    never_inline()
    set_ends(s, st, w, low, high, 0.5)
    if not wish_at(s, st, w, w.x, low, high, t + 0.5 * h, h):
        return -1, 0.0, False
    evaluate(s, st, w, w.x, low, high, w.trial, True)
    for e in range(count):
        prepare(s, w, w.active[e])
    tolerance, left = tolerance_of(s, st, w, low, high), np.inf
    for trial in range(CORRECTED):
        set_ends(s, st, w, low, high, 1.0)
        evaluate(s, st, w, w.x, low, high, w.trial, False)
        more = violated(s, st, w, low, high, count, w.trial, False)
        holds = trial > 0
        for e in range(more):
            r = w.active[e]
            if is_limit(s, r):
                continue
            w.shift[r] = w.trial[r] - along(s, w, r, w.d)
            acts = w.force[r] > 0.0 or is_equation(s, r)
            if (abs(w.trial[r]) if acts else -w.trial[r]) > s.zero * w.norm[r]:
                holds = False
        count = more
        if holds:
            return count, left, True
        left = solve(s, st, w, low, high, count, tolerance)
        st.counts[CORRECTIONS] += 1
        if not left <= 2.0 * tolerance:
            break
    return count, left, False


@compiled
def displace(s, st, w, low, high, t, h, ask):
    """Find the displacement of a step of some bodies, ``w.d``.

    Returns why it stopped, and the count of rows in the programme.
    """
    unions, per = count_unions(s), s.m + s.limits
    for i in range(low, high):
        for g in range(s.m):
            w.on[i * per + g] = 1 if s.always[g] or g >= s.inequalities else 0
        for o in range(s.limits):
            w.on[i * per + s.m + o] = 1
        for u in range(unions):
            w.chosen[i, u] = -1
    while True:
        count = predict(s, st, w, low, high, t, h)
        if count < 0:
            return NOT_FINITE, 0
        count, left, holds = correct(s, st, w, low, high, t, h, count)
        if count < 0:
            return NOT_FINITE, 0
        again = False
        for i in range(low, high):
            if st.alive[i] and unions > 0:
                found = choose(s, st, w, i, ask)
                if found == MET:
                    return SPLIT, 0
                again = again or found != FREE
        if not again:
            break
    st.counts[PROGRAMMES] += 1
    far = travel_of(s, w, low, high)
    st.sums[RESIDUAL] = max(st.sums[RESIDUAL], left / far if far > 0.0 and left < np.inf else 0.0)
    if not holds or not left <= 2.0 * tolerance_of(s, st, w, low, high):
        st.counts[UNSOLVED] += 1
        return FAILED, count
    return DONE, count
