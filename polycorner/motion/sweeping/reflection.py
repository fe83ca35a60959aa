"""The random displacement of a step, and its reflection."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.accounts import log_event
from polycorner.motion.sweeping.displacements import (
    CORRECTED,
    begin,
    ends_of,
    set_ends,
    tolerance_of,
    violated,
)
from polycorner.motion.sweeping.draws import compiled, normal
from polycorner.motion.sweeping.pieces import choose, count_unions
from polycorner.motion.sweeping.programme import HELD, IDLE, along, is_equation, prepare, solve
from polycorner.motion.sweeping.records import CORRECTIONS, DONE, FAILED, NOISE, UNSOLVED
from polycorner.motion.sweeping.rows import energy_at, evaluate


@compiled
def jostle(s, st, w, log, low, high, t, index, events):
    """Add the random displacement of a step, reflected where it leads outside.

    Returns the number of events.
    """
    never_inline()
    k, h = s.k, s.step
    if s.energy_calls.shape[0] > 0:
        for i in range(low, high):
            if st.alive[i]:
                st.sums[NOISE] -= energy_at(s, w, st.q, i, False)
    size = np.sqrt(2.0 * s.noise * h)
    for i in range(low, high):
        for c in range(k):
            w.wish[i, c] = 0.0
        for e in range(k if st.alive[i] else 0):
            drawn = size * normal(s.seed, index, (i * k + e) * 2)
            for c in range(e, k):
                w.wish[i, c] += w.factor[i, c, e] * drawn
    turned = False
    for _ in range(2):  # the reflected point may be outside elsewhere: then it is projected
        code, count = project(s, st, w, low, high)
        if code == FAILED:
            st.counts[UNSOLVED] += 1
            events = log_event(log, events, FAILED, low, -1, -1, t + 0.5 * h, 0.0)
            break
        acts = False
        for e in range(count):
            r = w.active[e]
            acts = acts or (w.force[r] > 0.0 and not is_equation(s, r))
        if not acts or turned:
            break
        turned = True
        for i in range(low, high):
            for c in range(k):
                w.wish[i, c] = w.d[i, c]
        for e in range(count):
            r = w.active[e]
            if not is_equation(s, r):
                mirror(s, w, r)
    for i in range(low, high):
        for c in range(k):
            st.q[i, c] += w.d[i, c]
    if s.energy_calls.shape[0] > 0:
        for i in range(low, high):
            if st.alive[i]:
                st.sums[NOISE] += energy_at(s, w, st.q, i, False)
    return events


@compiled
def mirror(s, w, r):
    """Add the displacement that a force has caused once more."""
    k, a, b = s.k, w.owner[r, 0], w.owner[r, 1]
    for c in range(k):
        w.wish[a, c] += w.M[r, c] * w.force[r]
        if b >= 0:
            w.wish[b, c] += w.M[r, k + c] * w.force[r]


@compiled
def project(s, st, w, low, high):
    """Find the displacement to the nearest point of the set; forces begin at zero.

    Returns whether it was found, and the count of rows.
    """
    never_inline()
    unions, per = count_unions(s), s.m + s.limits
    a, b, c, d = ends_of(s, w, low, high)
    for r in range(a, b):
        g = r % per
        w.on[r] = 1 if g < s.m and (g >= s.inequalities or s.always[g]) else 0
        w.listed[r], w.force[r] = IDLE, 0.0
    for r in range(c, d):
        w.listed[r], w.force[r] = IDLE, 0.0
    if unions > 0:
        begin(s, st, w, low, high)
    for i in range(low, high):
        for c_ in range(s.k):
            w.d[i, c_] = w.wish[i, c_]
        for u in range(unions):
            w.chosen[i, u] = -1
        for g in range(s.inequalities, s.m):
            w.listed[i * per + g] = IDLE
    count = 0
    if s.m > s.inequalities:
        for i in range(low, high):
            for g in range(s.inequalities, s.m if st.alive[i] else s.inequalities):
                w.listed[i * per + g] = HELD
                w.active[count] = i * per + g
                count += 1
    tolerance = tolerance_of(s, st, w, low, high)
    for _ in range(CORRECTED):
        for i in range(low, high if unions > 0 else low):
            if st.alive[i]:
                choose(s, st, w, i, False)
        set_ends(s, st, w, low, high, 1.0)
        evaluate(s, st, w, w.x, low, high, w.trial, True)
        for e in range(count):
            prepare(s, w, w.active[e])
        count = violated(s, st, w, low, high, count, w.trial, False)
        holds = True
        for e in range(count):
            r = w.active[e]
            w.shift[r] = w.trial[r] - along(s, w, r, w.d)
            acts = w.force[r] > 0.0 or is_equation(s, r)
            if (abs(w.trial[r]) if acts else -w.trial[r]) > s.zero * w.norm[r]:
                holds = False
        if holds:
            return DONE, count
        left = solve(s, st, w, low, high, count, tolerance)
        st.counts[CORRECTIONS] += 1
        if not left < np.inf:
            return FAILED, count
    return FAILED, count
