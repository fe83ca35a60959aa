"""Contacts along the way: where the straight path of a body meets the boundary of a gap.

Within a step a body moves along two straight segments, with its velocity before the step and with
that after it.  On a segment a gap ``f`` is a function of time.  Between its ends it may vanish

- where it is negative at the end, or
- where it falls at the start and grows at the end, and the two tangents meet below zero: a convex
  function, such as the distance from a convex obstacle, vanishes nowhere else.

The first zero is found by Newton's method from the start, which for a convex function approaches
it from above, with bisection where there is a bracket.

The distance of two convex bodies is convex where they do not turn.  Where they do, with the angular
velocities ``w`` and points within the lengths ``r`` of their origins, the approach of any two
points along the normal at hand is at most that of the nearest ones and ``turn = 2 sum r |w|``:

    ``f(t + s) >= f(t) + (f'(t) - turn) s``.

By steps of this bound, as in conservative advancement, a path is followed past which nothing slips.
"""

import numpy as np

from polycorner.motion.engine.arrays import LIMITS, ROWS
from polycorner.motion.engine.bounds import acts
from polycorner.motion.engine.evaluation import evaluate_gaps, evaluate_pair
from polycorner.motion.engine.families import family_of, kind_of, pair_inputs
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.neighbours import (
    component,
    find_contact,
    pair_key,
    square_distance,
)
from polycorner.motion.engine.ties import evaluate_tie, form_of, rate_of_row, row_inputs

MOST_SEARCH = 80  # evaluations in the search for one contact
NEVER = np.inf
# What is known of a segment: it is free; up to an instant at which a gap is below zero; up to one.
CLEAR, DIPS, UNSURE = np.int64(0), np.int64(1), np.int64(2)

# Rows of what is evaluated on the way: at the start and at the midpoint with the velocity before;
# at the midpoint, half a step later and at the next midpoint with that after; in a search.
START, MIDDLE, NEXT, HALF, FULL, SEARCH = range(6)


@compiled
def gaps_at(model, path, scratch, base, velocity, i, j, t, row):
    """Evaluate all gaps, and their rates, at a time along straight paths.

    ``j < 0`` stands for the surroundings, or is :func:`tie_code` of a tie, whose limits they are.
    They are left in a row of ``scratch.way_gap`` and ``scratch.way_rate``.
    """
    k, gap, rate = model.dimension, scratch.way_gap[row], scratch.way_rate[row]
    if j < NONE:
        limits_at(model, path, scratch, base, velocity, tie_code(j), t, gap, rate)
        return
    for c in range(k):
        path.q[i, c] = base[i, c] + t * velocity[i, c]
    if j < 0:
        # Into arrays beside those of the midpoint, which the solution of the step still needs.  The
        # time matters to equations, which are looked at on the way from the midpoint only.
        evaluate_gaps(model, scratch, i, path.q, t, path.gap, path.gradient)
        first = model.first_gap[i]
        for g in range(model.first_gap[i + 1] - first):
            gap[g], rate[g] = path.gap[first + g], 0.0
            for c in range(k):
                rate[g] += path.gradient[first + g, c] * velocity[i, c]
        return
    for c in range(k):
        path.q[j, c] = base[j, c] + t * velocity[j, c]
    evaluate_pair(model, scratch, i, j, path.q, np.inf)
    family = family_of(model, i, j)
    first, n, m = model.first_read[family], pair_inputs(model, family), model.pair_gaps[family]
    for g in range(m):
        gap[g], rate[g] = scratch.values[n + g], 0.0
        for r in range(n):
            body = i if model.pair_reads[first + r, 0] == 0 else j
            c = model.pair_reads[first + r, 1]
            rate[g] += scratch.values[n + m + g * n + r] * velocity[body, c]


@compiled
def tie_code(t):
    """Return the number below those of bodies that stands for a tie, and the tie of such one."""
    return -2 - t


@compiled
def limits_at(model, path, scratch, base, velocity, t, time, gap, rate):
    """Evaluate the limits of a tie, and their rates, at a time along straight paths."""
    move_tied(model, path, base, velocity, t, time)
    evaluate_tie(model, scratch, t, path.q, 0.0)  # limits do not depend on the time
    for g in range(form_of(model, t, LIMITS)):
        gap[g] = scratch.values[row_inputs(model) + g]
        rate[g] = rate_of_row(model, scratch, t, g, velocity)


@compiled
def move_tied(model, path, base, velocity, t, time):
    """Move the bodies of a tie along straight paths."""
    for side in range(2):
        i = model.tie_bodies[t, side]
        for c in range(model.dimension if i >= 0 else ZERO):
            path.q[i, c] = base[i, c] + time * velocity[i, c]


@compiled
def equations_fail(model, work, t, h):
    """Return whether an equation of a tie does not hold at the next midpoint, by far."""
    tie, scratch = work.tie, work.scratch
    deep = 2.0 * model.bending * model.gap_unit
    missed = h * model.tolerance * work.body.island_speed[model.tie_bodies[t, 0]]
    move_tied(model, work.path, work.mid.q, work.velocity.new, t, h)
    evaluate_tie(model, scratch, t, work.path.q, tie.time[0] + h)
    for o in range(form_of(model, t, LIMITS), form_of(model, t, ROWS)):
        gap, following = tie.gap[model.tie_rows[t] + o], scratch.values[row_inputs(model) + o]
        if abs(following) > max(deep, abs(gap) + missed):
            return True
    return False


@compiled
def gap_at(model, path, scratch, base, velocity, i, j, g, t, out):
    """Evaluate one gap and its rate; see :func:`gaps_at`."""
    gaps_at(model, path, scratch, base, velocity, i, j, t, SEARCH)
    out[0], out[1] = scratch.way_gap[SEARCH, g], scratch.way_rate[SEARCH, g]


@compiled
def may_vanish(f0, rate0, f1, rate1, duration, slack):
    """Return whether a gap that is positive at the start may vanish on a segment."""
    if f1 < -slack:
        return True
    # So written that a rate that is not a number excludes the gap.
    if not rate0 < 0.0 < rate1:
        return False
    meet = (f1 - f0 - rate1 * duration) / (rate0 - rate1)
    return f0 + rate0 * meet < 0.0


@compiled
def turning(model, v, i, j, duration):
    """Return by how much more two points of bodies may approach in a time than the nearest do.

    ``j < 0`` stands for surroundings, which do not turn.
    """
    speed, rate = 0.0, 0.0
    for side in range(2 if j >= 0 else 1):
        body = j if side else i
        for c in range(model.dimension):
            lever = model.lever[kind_of(model, body), c]
            if lever > 0.0:
                speed += abs(v[body, c]) * lever
                rate += abs(v[body, c])
    # On a straight path quaternions grow, and with them the matrices that they stand for.
    return 2.0 * speed * (1.0 + duration * rate)


@compiled
def may_dip(f, rate, turn, duration, deep):
    """Return whether a gap may be below ``-deep`` on a segment, by the bound for what turns."""
    return turn > 0.0 and f + (rate - turn) * duration < -deep


@compiled
def first_dip(model, path, scratch, base, velocity, i, j, g, duration, turn, deep, out):
    """Follow an open gap along a segment; return what is known of it, and up to which instant.

    Dips down to ``deep`` may be overlooked.
    """
    t = 0.0
    for _ in range(MOST_SEARCH):
        gap_at(model, path, scratch, base, velocity, i, j, g, t, out)
        if out[0] < -0.5 * deep:
            return DIPS, t
        if not may_dip(out[0], out[1], turn, duration - t, deep):
            return CLEAR, duration
        t += (out[0] + deep) / (turn - out[1])
    return UNSURE, t


@compiled
def first_zero(model, path, scratch, base, velocity, i, j, g, duration, turn, slack, out):
    """Return when an open gap first vanishes on a segment, up to ``slack``, or a time before that.

    One that vanishes at the start is met if it falls there, and else once it has opened.
    """
    known = CLEAR
    if turn > 0.0:
        deep = 2.0 * model.bending * model.gap_unit
        known, duration = first_dip(
            model, path, scratch, base, velocity, i, j, g, duration, turn, deep, out
        )
    t = convex_zero(model, path, scratch, base, velocity, i, j, g, duration, slack, out)
    return duration if known == UNSURE and t == NEVER else t


@compiled
def convex_zero(model, path, scratch, base, velocity, i, j, g, duration, slack, out):
    """Return when an open gap that is convex, or below zero at the end, first vanishes."""
    gap_at(model, path, scratch, base, velocity, i, j, g, duration, out)
    f1, rate1 = out[0], out[1]
    gap_at(model, path, scratch, base, velocity, i, j, g, 0.0, out)
    f, rate, low = out[0], out[1], 0.0
    if f <= slack:
        if rate < 0.0 and may_vanish(0.0, rate, f1, rate1, duration, slack):
            return 0.0
        if f1 >= -slack:
            return NEVER
        low = duration
        # It starts on the boundary and is beyond it at the end: look back for an instant at which
        # it is open.
        while f <= slack and low > 1e-9 * duration:
            low *= 0.5
            gap_at(model, path, scratch, base, velocity, i, j, g, low, out)
            f = out[0]
        if f <= slack:
            return 0.0
    elif not may_vanish(f, rate, f1, rate1, duration, slack):
        return NEVER
    high, bracketed = duration, f1 < -slack
    for _ in range(MOST_SEARCH):
        # Newton steps of a convex gap stop short of the zero, so that the way up to there is free.
        t = low - f / rate if rate < 0.0 else NEVER
        if not t < high:
            if not bracketed:
                return NEVER
            t = 0.5 * (low + high)
        gap_at(model, path, scratch, base, velocity, i, j, g, t, out)
        # Half of it, so that rounding at this instant in the part that ends here does not make the
        # gap open again.
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
    index = find_contact(state, pair_key(model, state, i, j) * model.most_pair_gaps + g)
    return index >= 0 and state.pair_flags[index, 1] != 0


@compiled
def first_in_gap(model, state, mid, velocity, path, scratch, i, j, g, acting, turns, h, out):
    """Return when in a step an open gap vanishes; one that acts may do so after its middle.

    ``turns`` are :func:`turning` before and after the middle.

    Its values on the way, as in :func:`look_ahead`, exclude most gaps at once.
    """
    slack, half, t = model.zero_gap, 0.5 * h, NEVER
    if may_meet(model, scratch, g, START, MIDDLE, half, turns[0], slack):
        t = first_zero(model, path, scratch, state.q, state.v, i, j, g, half, turns[0], slack, out)
    # What acts is kept from closing by its impulse; only others can be met with the new velocity.
    if t == NEVER and not acting and may_meet(model, scratch, g, NEXT, HALF, half, turns[1], slack):
        t = half + first_zero(
            model, path, scratch, mid.q, velocity.new, i, j, g, half, turns[1], slack, out
        )
    return t


@compiled
def may_meet(model, scratch, g, first, last, duration, turn, slack):
    """Return whether a gap may vanish between two rows, or does so at the first."""
    gap, rate = scratch.way_gap, scratch.way_rate
    f0, rate0, f1, rate1 = gap[first, g], rate[first, g], gap[last, g], rate[last, g]
    deep = 2.0 * model.bending * model.gap_unit
    return (
        f0 <= slack
        or may_vanish(f0, rate0, f1, rate1, duration, slack)
        or may_dip(f0, rate0, turn, duration, deep)
    )


@compiled
def look_ahead(model, state, mid, velocity, path, scratch, i, j, h):
    """Evaluate gaps at the start, the midpoint and the end of a step, and at the next midpoint."""
    gaps_at(model, path, scratch, state.q, state.v, i, j, 0.0, START)
    gaps_at(model, path, scratch, state.q, state.v, i, j, 0.5 * h, MIDDLE)
    gaps_at(model, path, scratch, mid.q, velocity.new, i, j, 0.0, NEXT)
    gaps_at(model, path, scratch, mid.q, velocity.new, i, j, 0.5 * h, HALF)
    gaps_at(model, path, scratch, mid.q, velocity.new, i, j, h, FULL)


@compiled
def stay_apart(model, state, mid, velocity, i, j, h):
    """Return whether two bodies are too far apart to meet on the way to the next midpoint."""
    far, new = model.pair_reach[family_of(model, i, j)], velocity.new
    for d in range(3):
        # Half: with the velocity before they went half a step only.
        before = 0.5 * abs(component(model, state.v, i, d) - component(model, state.v, j, d))
        after = abs(component(model, new, i, d) - component(model, new, j, d))
        far += h * max(before, after)
    return square_distance(model, mid, i, j) > far * far


@compiled
def acceptable_length(model, state, work, h, out):
    """Return how long a part of a step may be: to the first contact, or half of it if one sinks."""
    body, neighbours = work.body, work.neighbours
    length = h
    for i in range(model.bodies):
        if state.alive[i] and body.awake[i] and model.first_gap[model.bodies] > 0:
            length = min(length, acceptable_to(model, state, work, i, NONE, h, out))
    for s in range(neighbours.status[0] if model.families > 0 else ZERO):
        i, j = neighbours.pairs[s, 0], neighbours.pairs[s, 1]
        if not (body.awake[i] and body.awake[j] and state.alive[i] and state.alive[j]):
            continue
        if not stay_apart(model, state, work.mid, work.velocity, i, j, h):
            length = min(length, acceptable_to(model, state, work, i, j, h, out))
    return length


@compiled
def acceptable_to(model, state, work, i, j, h, out):
    """Return how long a part of a step may be for the gaps of a body or of a pair."""
    manner, mid, velocity = work.manner, work.mid, work.velocity
    path, scratch = work.path, work.scratch
    deep, length, sunk = 2.0 * model.bending * model.gap_unit, h, False
    missed = h * model.tolerance * work.body.island_speed[i]  # shorter parts miss no less
    turns = (turning(model, state.v, i, j, h), turning(model, velocity.new, i, j, h))
    look_ahead(model, state, mid, velocity, path, scratch, i, j, h)
    first, family = model.first_gap[i], NONE if j < 0 else family_of(model, i, j)
    for g in range(model.first_gap[i + 1] - first if j < 0 else model.pair_gaps[family]):
        if j < 0:
            closed, bounce = state.touches[first + g] != 0, model.restitution[first + g]
        else:
            closed, bounce = touching(model, state, i, j, g), model.pair_restitution[family]
        acting = acts(
            model, manner, scratch.way_gap[NEXT, g], scratch.way_rate[MIDDLE, g], bounce, closed
        )
        if not closed:
            length = min(
                length,
                first_in_gap(
                    model, state, mid, velocity, path, scratch, i, j, g, acting, turns, h, out
                ),
            )
        if acting:
            following = scratch.way_gap[FULL, g]
            sunk = sunk or following < min(-deep, scratch.way_gap[NEXT, g] - missed)
            bilateral = j < 0 and first + g >= model.first_equation[i]
            sunk = sunk or (bilateral and following > deep)
    # A contact sinks by the square of the length: halves are a quarter as bad.
    if sunk and h > model.shortest_part * model.step:
        length = min(length, 0.5 * h)
    return length


@compiled
def acceptable_to_ties(model, state, work, h, out):
    """Return how long a part of a step may be for the ties of bodies."""
    length = h
    for t in range(model.ties):
        if work.body.awake[model.tie_bodies[t, 0]]:
            length = min(length, acceptable_to_tie(model, state, work, t, h, out))
    return length


@compiled
def acceptable_to_tie(model, state, work, t, h, out):
    """Return how long a part of a step may be for a tie; see :func:`acceptable_to`."""
    manner, mid, velocity = work.manner, work.mid, work.velocity
    path, scratch, i, code = work.path, work.scratch, model.tie_bodies[t, 0], tie_code(t)
    deep, length, limits = 2.0 * model.bending * model.gap_unit, h, form_of(model, t, LIMITS)
    missed = h * model.tolerance * work.body.island_speed[i]
    sunk = equations_fail(model, work, t, h)
    if limits > 0:
        look_ahead(model, state, mid, velocity, path, scratch, i, code, h)
    for g in range(limits):
        row = model.tie_rows[t] + g
        closed, bounce = state.tie_touches[row] != 0, model.tie_restitution[row]
        near, rate = scratch.way_gap[NEXT, g], scratch.way_rate[MIDDLE, g]
        acting = acts(model, manner, near, rate, bounce, closed)
        if not closed:
            first = first_in_gap(
                model, state, mid, velocity, path, scratch, i, code, g, acting, (0.0, 0.0), h, out
            )
            length = min(length, first)
        if acting:
            sunk = sunk or scratch.way_gap[FULL, g] < min(-deep, near - missed)
    if sunk and h > model.shortest_part * model.step:
        length = min(length, 0.5 * h)
    return length


@compiled
def release_time(before, now, release, h, time):
    """Return when a normal impulse vanishes if it falls on as from the last step to this one."""
    if now <= 0.0:
        return release
    # An impulse that grows does not vanish by itself: the contact opens at the end, as far as is
    # known.
    if before <= now:
        return time + (h if before > 0.0 else 0.5 * h)
    return time + min(0.5 * h + h * now / (before - now), 1.5 * h)
