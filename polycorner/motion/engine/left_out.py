"""Islands that are left out of a whole step, because it is too long for them.

These are islands

- whose residual is above the tolerance;
- in which an impact that is not slow acts where the bodies are not;
- whose bodies cross the boundary of a gap on their way, in and perhaps out again.

Islands of more than ``LARGE`` blocks are left out only if they are not solved, or if a body may
pass through something: in a dense heap there is always an impact, and the parts of a step, each
solved for the whole heap, would cost more than shorter steps for all.  Crowds need not be solved:
they are left out only where a body may pass through something, and their parts are swept.
"""

import numpy as np

from polycorner.motion.engine.arrays import CONTACTS, LIMITS, OWN_LIMIT
from polycorner.motion.engine.bounds import contact_of, is_slow
from polycorner.motion.engine.crowds import is_crowd
from polycorner.motion.engine.evaluation import evaluate_gaps
from polycorner.motion.engine.families import family_of
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.limit_blocks import mark_jumps
from polycorner.motion.engine.neighbours import bodies_of, speed_of, travel
from polycorner.motion.engine.partition import is_large, island_of, root_of
from polycorner.motion.engine.paths import (
    CLEAR,
    FULL,
    MIDDLE,
    NEXT,
    START,
    equations_fail,
    first_dip,
    gaps_at,
    may_dip,
    may_vanish,
    stay_apart,
    tie_code,
    touching,
    turning,
)
from polycorner.motion.engine.ties import form_of

SWEPT = 4  # what is left out is a crowd
CROWD = 2  # bodies beyond which those that are not fast need not be, either


@compiled
def slow_travel(model, members):
    """Return the scaled travel of a slow impact among so many bodies."""
    return model.near_many if members > CROWD else model.near


@compiled
def leave_out(model, state, work, blocks, h):
    """Leave out of a step the islands for which it does not do; return whether there are any."""
    manner, mid, body, island, pair = work.manner, work.mid, work.body, work.island, work.pair
    block, matrix = work.block, work.matrix
    N, joined, left = model.bodies, island.joined, island.cursor
    found = False
    for i in range(N):
        left[i] = 0
        first, last = island.start[i], island.start[i + 1]
        if last > first and not is_crowd(model, first, last):
            left[i] = 2 if island.residual[i] > model.tolerance else 0
        matrix.members[i] = 0
    for i in range(N):
        if body.awake[i]:
            matrix.members[island.parent[i]] += 1
    for i in range(N):
        if is_large(island, i):
            continue
        manner.near[0] = slow_travel(model, matrix.members[i])
        for s in range(island.start[i], island.start[i + 1]):
            b = block.order[s]
            if (
                block.rows[b] == 0
                and block.origin[b, 0] != OWN_LIMIT
                and strikes_early(model, state, manner, mid, pair, work.tie, block, b)
            ):
                left[i] |= 1
    mark_misses(model, state, work, left, h)
    if model.ties > 0:
        mark_tie_misses(model, state, work, left, h)
    if model.limits > 0:
        mark_jumps(model, state, work, left, h)
    for i in range(N):
        # A neighbour has marked it; only what is not solved leaves a large island out.
        if is_large(island, i) and left[i] == 1:
            left[i] = 0
        if left[i] and is_crowd(model, island.start[i], island.start[i + 1]):
            left[i] = SWEPT
        found = found or left[i]
    if not found:
        return False
    for i in range(N):
        state.cluster[i], joined[i] = NONE, island.parent[i] if left[island.parent[i]] else i
    for b in range(blocks):
        i, j = block.bodies[b, 0], block.bodies[b, 1]
        if j >= 0 and left[island_of(body, island, block, b)]:
            join(joined, i, j)
    for s in range(state.counts[CONTACTS]):  # piles of sleepers
        i, j = bodies_of(model, state, s)
        if state.pair_flags[s, 1] and not body.awake[i] and not body.awake[j]:
            join(joined, i, j)
    for t in range(model.ties):
        i, j = model.tie_bodies[t, 0], model.tie_bodies[t, 1]
        if j >= 0 and not body.awake[i]:  # nor is the other
            join(joined, i, j)
    for i in range(N):
        body.waits[i] = 0
    for i in range(N):
        if left[island.parent[i]] and body.awake[i]:
            r = root_of(joined, i)
            body.waits[r] = max(body.waits[r], left[island.parent[i]])
    for i in range(N):
        r = root_of(joined, i)
        if body.waits[r] and state.alive[i]:
            state.cluster[i] = r + (N if body.waits[r] == SWEPT else ZERO)
            state.elapsed[i] = 0.0
    for i in range(N):
        body.waits[i] = 0
        if state.cluster[i] >= 0:
            body.waits[i] = 1
            body.awake[i], body.evaluated[i], work.sleep.disturbed[i] = 0, 0, 0
    return True


@compiled
def join(forest, i, j):
    """Unite the sets of two bodies in a union-find forest."""
    x, y = root_of(forest, i), root_of(forest, j)
    forest[max(x, y)] = min(x, y)


@compiled
def strikes_early(model, state, manner, mid, pair, tie, block, b):
    """Return whether an open contact is pressed, and not slowly, where the bodies are not."""
    gap, closed, bounce = contact_of(model, state, mid, pair, tie, block, b)
    if closed or abs(gap) <= model.zero_gap:
        return False
    return not is_slow(model, manner, -block.impulse[b, 0] * block.delassus[b, 0], bounce)


@compiled
def rate_of(model, gradient, v, i, g):
    """Return the rate of a gap of a body at a velocity."""
    rate = 0.0
    for c in range(model.dimension):
        rate += gradient[g, c] * v[i, c]
    return rate


@compiled
def open_gap(model, gap):
    """Return a gap; one that just vanishes has to close by as much as curvature may close it."""
    if gap > model.zero_gap:
        return gap
    return gap + 2.0 * model.bending * model.gap_unit


@compiled
def body_misses(model, state, work, i, h):
    """Return whether a body crosses the boundary of an open gap, or sinks into a closed one.

    The way is that to the next midpoint; that to this one was examined in the step before, if this
    was a whole step.
    """
    mid, velocity, ahead = work.mid, work.velocity, work.ahead
    path, scratch = work.path, work.scratch
    deep = 2.0 * model.bending * model.gap_unit
    missed = h * model.tolerance * work.body.island_speed[i]
    for c in range(model.dimension):
        ahead.q[i, c] = mid.q[i, c] + h * velocity.new[i, c]
    evaluate_gaps(model, scratch, i, ahead.q, h, ahead.gap, ahead.gradient)
    if not state.watched[i]:
        evaluate_gaps(model, scratch, i, state.q, 0.0, path.gap, path.gradient)
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        f, following = mid.gap[g], ahead.gap[g]
        if state.touches[g]:
            opens = g >= model.first_equation[i] and following > deep
            if following < min(-deep, f - missed) or opens:
                return True
            continue
        rate = rate_of(model, mid.gradient, velocity.new, i, g)
        after = rate_of(model, ahead.gradient, velocity.new, i, g)
        if f > -model.zero_gap and may_vanish(open_gap(model, f), rate, following, after, h, deep):
            return True
        if not state.watched[i] and path.gap[g] > 0.0:
            before = rate_of(model, path.gradient, state.v, i, g)
            rate = rate_of(model, mid.gradient, state.v, i, g)
            if may_vanish(path.gap[g], before, f, rate, 0.5 * h, model.zero_gap):
                return True
    return body_turns_into(model, state, work, i, deep, h)


@compiled
def body_turns_into(model, state, work, i, deep, h):
    """Return whether a body that turns meets its surroundings on the way, or may do so."""
    mid, velocity, path, scratch = work.mid, work.velocity, work.path, work.scratch
    first, out = model.first_gap[i], scratch.image
    turn, before = turning(model, velocity.new, i, NONE, h), turning(model, state.v, i, NONE, h)
    if turn == 0.0 and before == 0.0:
        return False
    if not state.watched[i]:
        gaps_at(model, path, scratch, state.q, state.v, i, NONE, 0.0, START)
    for g in range(first, model.first_equation[i]):
        rate = rate_of(model, mid.gradient, velocity.new, i, g)
        if state.touches[g]:
            continue
        if mid.gap[g] > -model.zero_gap and may_dip(mid.gap[g], rate, turn, h, deep):
            known, _ = first_dip(
                model, path, scratch, mid.q, velocity.new, i, NONE, g - first, h, turn, deep, out
            )
            if known != CLEAR:
                return True
        f, rate = scratch.way_gap[START, g - first], scratch.way_rate[START, g - first]
        if not state.watched[i] and f > 0.0 and may_dip(f, rate, before, 0.5 * h, deep):
            known, _ = first_dip(
                model,
                path,
                scratch,
                state.q,
                state.v,
                i,
                NONE,
                g - first,
                0.5 * h,
                before,
                deep,
                out,
            )
            if known != CLEAR:
                return True
    return False


@compiled
def pair_misses(model, state, mid, velocity, path, scratch, i, j, h):
    """Return whether two bodies cross the boundary of an open gap; see :func:`body_misses`."""
    gap, rate, zero, out = scratch.way_gap, scratch.way_rate, model.zero_gap, scratch.image
    watched = state.watched[i] and state.watched[j]
    deep = 2.0 * model.bending * model.gap_unit
    turn, before = turning(model, velocity.new, i, j, h), turning(model, state.v, i, j, h)
    look_on(model, state, mid, velocity, path, scratch, i, j, watched, h)
    for g in range(model.pair_gaps[family_of(model, i, j)]):
        f0, rate0, f1, rate1 = gap[NEXT, g], rate[NEXT, g], gap[FULL, g], rate[FULL, g]
        misses = f0 > -zero and may_vanish(open_gap(model, f0), rate0, f1, rate1, h, deep)
        if f0 > -zero and not misses and may_dip(f0, rate0, turn, h, deep):
            known, _ = first_dip(
                model, path, scratch, mid.q, velocity.new, i, j, g, h, turn, deep, out
            )
            misses = known != CLEAR
        if not watched and not misses:
            f0, rate0, f1, rate1 = gap[START, g], rate[START, g], gap[MIDDLE, g], rate[MIDDLE, g]
            misses = f0 > 0.0 and may_vanish(f0, rate0, f1, rate1, 0.5 * h, zero)
            if f0 > 0.0 and not misses and may_dip(f0, rate0, before, 0.5 * h, deep):
                known, _ = first_dip(
                    model, path, scratch, state.q, state.v, i, j, g, 0.5 * h, before, deep, out
                )
                misses = known != CLEAR
        # Asked last: the search in the list of contacts costs more than the rest, and misses are
        # rare.
        if misses and not touching(model, state, i, j, g):
            return True
    return False


@compiled
def look_on(model, state, mid, velocity, path, scratch, i, j, watched, h):
    """Evaluate gaps on the way to the next midpoint, and on that to this one if not ``watched``."""
    gaps_at(model, path, scratch, mid.q, velocity.new, i, j, 0.0, NEXT)
    gaps_at(model, path, scratch, mid.q, velocity.new, i, j, h, FULL)
    if not watched:
        gaps_at(model, path, scratch, state.q, state.v, i, j, 0.0, START)
        gaps_at(model, path, scratch, state.q, state.v, i, j, 0.5 * h, MIDDLE)


@compiled
def passes(model, state, work, i, j, h):
    """Return whether a body of a large island may pass through another, or its surroundings.

    It does where a gap, open or not, gets deeper than half the thickness of the thinnest body.
    ``j < 0`` stands for the surroundings.
    """
    mid, velocity, path, scratch = work.mid, work.velocity, work.path, work.scratch
    watched = state.watched[i] and (j < 0 or state.watched[j])
    new, old, half = velocity.new, state.v, 0.5 * h
    turn, before = turning(model, new, i, j, h), turning(model, old, i, j, h)
    look_on(model, state, mid, velocity, path, scratch, i, j, watched, h)
    count = model.first_equation[i] - model.first_gap[i]
    if j >= 0:
        count = model.pair_gaps[family_of(model, i, j)]
    for g in range(count):
        if gets_deep(model, path, scratch, mid.q, new, i, j, g, NEXT, FULL, h, turn):
            return True
        if not watched and gets_deep(
            model, path, scratch, state.q, old, i, j, g, START, MIDDLE, half, before
        ):
            return True
    return False


@compiled
def gets_deep(model, path, scratch, base, v, i, j, g, first, last, duration, turn):
    """Return whether a gap gets deep on a segment, between two rows of what was evaluated."""
    gap, rate, deep = scratch.way_gap, scratch.way_rate, model.gap_unit
    f0, rate0, f1, rate1 = gap[first, g], rate[first, g], gap[last, g], rate[last, g]
    # One that is deep already can only be told of.
    if not f0 > -deep:
        return False
    if may_vanish(f0 + deep, rate0, f1 + deep, rate1, duration, 0.0):
        return True
    # The search reports what is half as deep, which must not be where it begins.
    if not (f0 > -0.5 * deep and may_dip(f0, rate0, turn, duration, deep)):
        return False
    known, _ = first_dip(
        model, path, scratch, base, v, i, j, g, duration, turn, deep, scratch.image
    )
    return known != CLEAR


@compiled
def far_enough(model, state, work, s, way, h):
    """Return whether two neighbours are too far apart to meet by so much scaled travel."""
    i, j = work.neighbours.pairs[s, 0], work.neighbours.pairs[s, 1]
    before = 0.5 * h * (speed_of(model, state.v, i) + speed_of(model, state.v, j))
    most = 2.0 * max(way, before) * max(1.0, model.gap_unit)
    return work.neighbours.least_gap[s] > most or stay_apart(
        model, state, work.mid, work.velocity, i, j, h
    )


@compiled
def find_passing(model, state, work, h):
    """Return two bodies, of those in motion, that may pass through each other, or -1 for both.

    The second is -1 where it is the surroundings.
    """
    body, neighbours = work.body, work.neighbours
    # What moves by less than half the thickness of the thinnest body cannot pass through any.
    if 2.0 * travel(model, body, h) <= 1.0:
        return NONE, NONE
    for i in range(model.bodies):
        fast = state.alive[i] and body.awake[i] and h * body.speed[i] > 1.0
        if fast and passes(model, state, work, i, NONE, h):
            return np.int64(i), NONE
    for s in range(neighbours.status[0] if model.families > 0 else ZERO):
        i, j = neighbours.pairs[s, 0], neighbours.pairs[s, 1]
        if not (state.alive[i] and state.alive[j] and (body.awake[i] or body.awake[j])):
            continue
        way = h * (body.speed[i] + body.speed[j])
        near = way > 1.0 and not far_enough(model, state, work, s, way, h)
        if near and passes(model, state, work, i, j, h):
            return i, j
    return NONE, NONE


@compiled
def mark_misses(model, state, work, left, h):
    """Mark the islands with bodies that cross the boundary of a gap on their way."""
    mid, velocity, body, path, island = work.mid, work.velocity, work.body, work.path, work.island
    neighbours, scratch = work.neighbours, work.scratch
    if model.first_gap[model.bodies] > 0:
        for i in range(model.bodies):
            if not (state.alive[i] and body.awake[i]):
                continue
            if is_large(island, island.parent[i]):
                if h * body.speed[i] > 1.0 and passes(model, state, work, i, NONE, h):
                    left[island.parent[i]] |= 2
            elif body_misses(model, state, work, i, h):
                left[island.parent[i]] |= 1
    # What moves by less than half the thickness of the thinnest body cannot pass through any.
    slow = min(model.near_many * model.gap_unit, 1.0)
    if model.families == 0 or 2.0 * travel(model, body, h) <= slow:
        return
    for s in range(neighbours.status[0]):
        i, j = neighbours.pairs[s, 0], neighbours.pairs[s, 1]
        if not (state.alive[i] and state.alive[j] and (body.awake[i] or body.awake[j])):
            continue
        way = h * (body.speed[i] + body.speed[j])
        large = is_large(island, island.parent[i]) and is_large(island, island.parent[j])
        if way <= (1.0 if large else slow) or far_enough(model, state, work, s, way, h):
            continue
        if large:
            misses = passes(model, state, work, i, j, h)
        else:
            misses = pair_misses(model, state, mid, velocity, path, scratch, i, j, h)
        if misses:
            left[island.parent[i]] |= 2 if large else 1
            left[island.parent[j]] |= 2 if large else 1


@compiled
def tie_misses(model, state, work, t, h):
    """Return whether bodies cross the boundary of a tie's limit; see :func:`body_misses`."""
    mid, velocity, path, scratch = work.mid, work.velocity, work.path, work.scratch
    gap, rate, zero = scratch.way_gap, scratch.way_rate, model.zero_gap
    i, j, code = model.tie_bodies[t, 0], model.tie_bodies[t, 1], tie_code(t)
    deep, limits = 2.0 * model.bending * model.gap_unit, form_of(model, t, LIMITS)
    missed = h * model.tolerance * work.body.island_speed[i]
    watched = state.watched[i] and (j < 0 or state.watched[j])
    if limits > 0:
        gaps_at(model, path, scratch, mid.q, velocity.new, i, code, 0.0, NEXT)
        gaps_at(model, path, scratch, mid.q, velocity.new, i, code, h, FULL)
    if limits > 0 and not watched:
        gaps_at(model, path, scratch, state.q, state.v, i, code, 0.0, START)
        gaps_at(model, path, scratch, state.q, state.v, i, code, 0.5 * h, MIDDLE)
    for g in range(limits):
        f0, rate0, f1, rate1 = gap[NEXT, g], rate[NEXT, g], gap[FULL, g], rate[FULL, g]
        if state.tie_touches[model.tie_rows[t] + g]:
            if f1 < min(-deep, f0 - missed):
                return True
            continue
        if f0 > -zero and may_vanish(open_gap(model, f0), rate0, f1, rate1, h, deep):
            return True
        f0, rate0, f1, rate1 = gap[START, g], rate[START, g], gap[MIDDLE, g], rate[MIDDLE, g]
        if not watched and f0 > 0.0 and may_vanish(f0, rate0, f1, rate1, 0.5 * h, zero):
            return True
    return equations_fail(model, work, t, h)


@compiled
def mark_tie_misses(model, state, work, left, h):
    """Mark the islands with ties of which :func:`tie_misses` tells."""
    body, island = work.body, work.island
    for t in range(model.ties):
        i = model.tie_bodies[t, 0]
        if body.awake[i] and not is_large(island, island.parent[i]):
            left[island.parent[i]] |= 1 if tie_misses(model, state, work, t, h) else 0
