"""Contacts along the way: where the straight path of a body meets the boundary of a gap.

Within a step a body moves along two straight segments, with its velocity before the step and with
that after it.  On a segment a gap ``f`` is a function of time.  Between its ends it may vanish

- where it is negative at the end, or
- where it falls at the start and grows at the end, and the two tangents meet below zero: a convex
  function, such as the distance from a convex obstacle, vanishes nowhere else.

The first zero is found by Newton's method from the start, which for a convex function approaches
it from above, with bisection where there is a bracket.
"""

import numpy as np

from polycorner.motion.engine.blocks import acts
from polycorner.motion.engine.evaluation import evaluate_gaps, evaluate_pair
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.neighbours import ZERO_GAP, find_contact

CURVATURE_DEPTH = 1e-4  # scaled depth to which a gap may close by its curvature within a step
SHORTEST_PART = 1.0 / 4096.0  # of a step, to which parts are halved
MOST_SEARCH = 80  # evaluations in the search for one contact
NEVER = np.inf


@compiled
def gap_at(model, work, base, velocity, i, j, g, t, out):
    """Evaluate a gap, and its rate, at a time along straight paths; ``j < 0``: surroundings."""
    k = model.dimension
    for c in range(k):
        work.q_path[i, c] = base[i, c] + t * velocity[i, c]
    out[1] = 0.0
    if j < 0:
        evaluate_gaps(model, work, i, work.q_path, work.gap_path, work.gradient_path)
        out[0] = work.gap_path[i, g]
        for c in range(k):
            out[1] += work.gradient_path[i, g, c] * velocity[i, c]
        return
    for c in range(k):
        work.q_path[j, c] = base[j, c] + t * velocity[j, c]
    evaluate_pair(model, work, i, j, work.q_path)
    n, m = model.pair_reads.shape[0], model.pair_gaps
    out[0] = work.scratch[n + g]
    for r in range(n):
        body = i if model.pair_reads[r, 0] == 0 else j
        out[1] += work.scratch[n + m + g * n + r] * velocity[body, model.pair_reads[r, 1]]


@compiled
def may_vanish(f0, rate0, f1, rate1, duration, slack):
    """Return whether a gap that is positive at the start may vanish on a segment."""
    if f1 < -slack:
        return True
    if not rate0 < 0.0 < rate1:
        return False
    meet = (f1 - f0 - rate1 * duration) / (rate0 - rate1)
    return f0 + rate0 * meet < 0.0


@compiled
def first_zero(model, work, base, velocity, i, j, g, duration, slack, out):
    """Return when an open gap first vanishes on a segment, up to ``slack``.

    One that vanishes at the start is met if it falls there, and else once it has opened.
    """
    gap_at(model, work, base, velocity, i, j, g, duration, out)
    f1, rate1 = out[0], out[1]
    gap_at(model, work, base, velocity, i, j, g, 0.0, out)
    f, rate, low = out[0], out[1], 0.0
    if f <= slack:
        if rate < 0.0 and may_vanish(0.0, rate, f1, rate1, duration, slack):
            return 0.0
        if f1 >= -slack:
            return NEVER
        low = duration
        while f <= slack and low > 1e-9 * duration:
            low *= 0.5
            gap_at(model, work, base, velocity, i, j, g, low, out)
            f = out[0]
        if f <= slack:
            return 0.0
    elif not may_vanish(f, rate, f1, rate1, duration, slack):
        return NEVER
    high, bracketed = duration, f1 < -slack
    for _ in range(MOST_SEARCH):
        t = low - f / rate if rate < 0.0 else NEVER
        if not t < high:
            if not bracketed:
                return NEVER
            t = 0.5 * (low + high)
        gap_at(model, work, base, velocity, i, j, g, t, out)
        if abs(out[0]) <= 0.5 * slack:
            return t
        if out[0] > 0.0:
            low, f, rate = t, out[0], out[1]
        else:
            high, bracketed = t, True
    return low


@compiled
def touching(model, state, i, j, g):
    """Return whether two bodies touched at the end of the last step."""
    index = find_contact(state, (i * model.bodies + j) * model.pair_gaps + g)
    return index >= 0 and state.pair_flags[index, 1] != 0


@compiled
def first_in_gap(model, state, work, i, j, g, acting, h, out):
    """Return when in a step an open gap vanishes; one that acts may do so after its middle."""
    slack, half = ZERO_GAP * model.gap_unit, 0.5 * h
    t = first_zero(model, work, state.q, state.v, i, j, g, half, slack, out)
    if t == NEVER and not acting:
        t = half + first_zero(model, work, work.q_mid, work.v_new, i, j, g, half, slack, out)
    return t


@compiled
def sinks(model, work, i, j, g, h, out):
    """Return whether a contact overlaps, or an equation does not hold, at the next midpoint."""
    gap_at(model, work, work.q_mid, work.v_new, i, j, g, h, out)
    deep = 2.0 * CURVATURE_DEPTH * model.gap_unit
    return out[0] < -deep or (j < 0 and g >= model.unilateral and out[0] > deep)


@compiled
def acceptable_length(model, state, work, h, out):
    """Return how long a part of a step may be: to the first contact, or half of it if one sinks."""
    length, sunk = h, False
    for i in range(model.bodies):
        if not (state.alive[i] and work.awake[i]):
            continue
        for g in range(model.restitution.size):
            closed = state.touches[i, g] != 0
            gap_at(model, work, work.q_mid, state.v, i, NONE, g, 0.0, out)
            acting = acts(model, out[0], out[1], model.restitution[g], closed)
            if not closed:
                t = first_in_gap(model, state, work, i, NONE, g, acting, h, out)
                length = min(length, t)
            if acting:
                sunk = sunk or sinks(model, work, i, NONE, g, h, out)
    for s in range(work.list_status[0] if model.pair_kernel != 0 else ZERO):
        i, j = work.neighbours[s, 0], work.neighbours[s, 1]
        if not (work.awake[i] and work.awake[j] and state.alive[i] and state.alive[j]):
            continue
        for g in range(model.pair_gaps):
            closed = touching(model, state, i, j, g)
            gap_at(model, work, work.q_mid, state.v, i, j, g, 0.0, out)
            acting = acts(model, out[0], out[1], model.pair_restitution, closed)
            if not closed:
                length = min(length, first_in_gap(model, state, work, i, j, g, acting, h, out))
            if acting:
                sunk = sunk or sinks(model, work, i, j, g, h, out)
    if sunk and h > SHORTEST_PART * model.step:
        length = min(length, 0.5 * h)
    return length


@compiled
def release_time(before, now, release, h, time):
    """Return when a normal impulse vanishes if it falls on as from the last step to this one."""
    if now <= 0.0:
        return release
    if before <= now:
        return time + (h if before > 0.0 else 0.5 * h)
    return time + min(0.5 * h + h * now / (before - now), 1.5 * h)
