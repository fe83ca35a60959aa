"""A whole step of all bodies; those for which it is too long take shorter ones.

After a step was solved, an island is left out of it (:func:`leave_out`)

- whose residual is above the tolerance;
- in which an impact that is not slow acts where the bodies are not;
- whose bodies cross the boundary of a gap on their way, in and perhaps out again.

Islands of more than ``LARGE`` blocks take whole steps: in a dense heap there is always an impact,
and the parts, each solved for the whole heap, would cost more than shorter steps for all.

Its bodies then do the same step in parts (:func:`refine`), in which a contact acts only if it is
closed.  A part ends where another contact closes, and an impact is a part of no length.  A part
that is not solved to the tolerance, or in which a contact sinks in, is halved.  The parts of an
island do not depend on other bodies.
"""

import numpy as np

from polycorner.motion.engine.arrays import (
    CONTACTS,
    DONE,
    EVENTS_FULL,
    OWN_GAP,
    PARTS,
    RESIDUAL,
    STEPS,
    SWEEPS,
    UNSOLVED,
)
from polycorner.motion.engine.blocks import is_slow
from polycorner.motion.engine.contact_list import FAILED, INSTANT, record
from polycorner.motion.engine.evaluation import evaluate_body, evaluate_gaps
from polycorner.motion.engine.gauss_seidel import residual
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.neighbours import ZERO_GAP, travel
from polycorner.motion.engine.partition import island_of, root_of
from polycorner.motion.engine.paths import (
    CURVATURE_DEPTH,
    acceptable_length,
    gap_at,
    may_vanish,
    touching,
)
from polycorner.motion.engine.sleep import stays_asleep, wake
from polycorner.motion.engine.stepping import attempt, commit

LARGE = 48  # blocks of an island beyond which it takes whole steps
SHORTEST_SOLVED = 1.0 / 16.0  # of a step, to which parts are halved to be solved
MOST_PARTS = 100_000  # of one step, beyond which the rest is done at once
MOST_SWEEPS, MEAN_SWEEPS = 1000, 50  # over islands, in all and for each part more, the same
MOST_TRIES = 100  # of one part


@compiled
def leave_out(model, state, work, blocks, h):
    """Leave out of a step the islands for which it does not do; return whether there are any."""
    N, joined, left = model.bodies, work.joined, work.cursor
    found = False
    for i in range(N):
        left[i] = 0
        if work.island_start[i + 1] > work.island_start[i]:
            left[i] = 2 if work.island_residual[i] > model.tolerance else 0
    for b in range(blocks):
        if work.block_rows[b] == 0 and strikes_early(model, state, work, b):
            left[island_of(work, b)] |= 1
    mark_misses(model, state, work, left, h)
    for i in range(N):
        if work.island_start[i + 1] - work.island_start[i] > LARGE and left[i] == 1:
            left[i] = 0
        found = found or left[i]
    if not found:
        return False
    for i in range(N):
        state.cluster[i], joined[i] = NONE, work.parent[i] if left[work.parent[i]] else i
    for b in range(blocks):
        i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
        if j >= 0 and left[island_of(work, b)]:
            join(joined, i, j)
    for s in range(state.counts[CONTACTS]):  # piles of sleepers
        pair = state.keys[s] // model.pair_gaps
        i, j = pair // N, pair % N
        if state.pair_flags[s, 1] and not work.awake[i] and not work.awake[j]:
            join(joined, i, j)
    for i in range(N):
        work.waits[i] = 0
    for i in range(N):
        if left[work.parent[i]] and work.awake[i]:
            work.waits[root_of(joined, i)] = 1
    for i in range(N):
        r = root_of(joined, i)
        if work.waits[r] and state.alive[i]:
            state.cluster[i], state.elapsed[i] = r, 0.0
    for i in range(N):
        work.waits[i] = 0
        if state.cluster[i] >= 0:
            work.waits[i] = 1
            work.awake[i], work.evaluated[i], work.disturbed[i] = 0, 0, 0
    return True


@compiled
def join(forest, i, j):
    """Unite the sets of two bodies in a union-find forest."""
    x, y = root_of(forest, i), root_of(forest, j)
    forest[max(x, y)] = min(x, y)


@compiled
def strikes_early(model, state, work, b):
    """Return whether an open contact is pressed, and not slowly, where the bodies are not."""
    g = work.origin[b, 2]
    if work.origin[b, 0] == OWN_GAP:
        i = work.origin[b, 1]
        gap, closed, bounce = work.gap[i, g], state.touches[i, g] != 0, model.restitution[g]
    else:
        index, bounce = work.contact_before[work.origin[b, 1]], model.pair_restitution
        gap = work.contact_gap[work.origin[b, 1]]
        closed = index >= 0 and state.pair_flags[index, 1] != 0
    if closed or abs(gap) <= ZERO_GAP * model.gap_unit:
        return False
    return not is_slow(model, -work.impulse[b, 0] * work.delassus[b, 0], bounce)


@compiled
def rate_of(model, gradient, v, i, g):
    """Return the rate of a gap of a body at a velocity."""
    rate = 0.0
    for c in range(model.dimension):
        rate += gradient[i, g, c] * v[i, c]
    return rate


@compiled
def body_misses(model, state, work, i, h):
    """Return whether a body crosses the boundary of an open gap, or sinks into a closed one.

    The way is that to the next midpoint; that to this one was examined in the step before, if this
    was a whole step.
    """
    deep, unit = 2.0 * CURVATURE_DEPTH * model.gap_unit, model.gap_unit
    for c in range(model.dimension):
        work.q_next[i, c] = work.q_mid[i, c] + h * work.v_new[i, c]
    evaluate_gaps(model, work, i, work.q_next, work.gap_next, work.gradient_next)
    if not state.watched[i]:
        evaluate_gaps(model, work, i, state.q, work.gap_path, work.gradient_path)
    for g in range(model.restitution.size):
        f, following = work.gap[i, g], work.gap_next[i, g]
        if state.touches[i, g]:
            if following < -deep or (g >= model.unilateral and following > deep):
                return True
            continue
        rate = rate_of(model, work.gradient, work.v_new, i, g)
        after = rate_of(model, work.gradient_next, work.v_new, i, g)
        if f > ZERO_GAP * unit and may_vanish(f, rate, following, after, h, deep):
            return True
        if not state.watched[i] and work.gap_path[i, g] > 0.0:
            before = rate_of(model, work.gradient_path, state.v, i, g)
            rate = rate_of(model, work.gradient, state.v, i, g)
            if may_vanish(work.gap_path[i, g], before, f, rate, 0.5 * h, ZERO_GAP * unit):
                return True
    return False


@compiled
def pair_misses(model, state, work, i, j, g, h):
    """Return whether two bodies cross the boundary of an open gap; see :func:`body_misses`."""
    out, unit = work.image, model.gap_unit
    gap_at(model, work, work.q_mid, work.v_new, i, j, g, 0.0, out)
    f, rate = out[0], out[1]
    gap_at(model, work, work.q_mid, work.v_new, i, j, g, h, out)
    deep = 2.0 * CURVATURE_DEPTH * unit
    if f > ZERO_GAP * unit and may_vanish(f, rate, out[0], out[1], h, deep):
        return True
    if state.watched[i] and state.watched[j]:
        return False
    gap_at(model, work, state.q, state.v, i, j, g, 0.0, out)
    f, rate = out[0], out[1]
    gap_at(model, work, state.q, state.v, i, j, g, 0.5 * h, out)
    return f > 0.0 and may_vanish(f, rate, out[0], out[1], 0.5 * h, ZERO_GAP * unit)


@compiled
def mark_misses(model, state, work, left, h):
    """Mark the islands with bodies that cross the boundary of a gap on their way."""
    if model.restitution.size > 0:
        for i in range(model.bodies):
            if state.alive[i] and work.awake[i] and body_misses(model, state, work, i, h):
                left[work.parent[i]] |= 1
    slow = model.near * model.gap_unit
    if model.pair_kernel == 0 or 2.0 * travel(model, work, h) <= slow:
        return
    for s in range(work.list_status[0]):
        i, j = work.neighbours[s, 0], work.neighbours[s, 1]
        if not (state.alive[i] and state.alive[j] and (work.awake[i] or work.awake[j])):
            continue
        if h * (work.speed[i] + work.speed[j]) <= slow:
            continue
        for g in range(model.pair_gaps):
            if not touching(model, state, i, j, g) and pair_misses(model, state, work, i, j, g, h):
                left[work.parent[i]] |= 1
                left[work.parent[j]] |= 1


@compiled
def worst_island(model, work):
    """Return the body that represents the worst island, and its residual."""
    where, worst = NONE, 0.0
    for i in range(model.bodies):
        if work.island_start[i + 1] > work.island_start[i] and work.island_residual[i] > worst:
            where, worst = np.int64(i), work.island_residual[i]
    return where, worst


@compiled
def record_failure(model, work, log, island, time, count):
    """Record where an island was not solved; return the number of events."""
    worst, place = -1.0, NONE
    for s in range(work.island_start[island], work.island_start[island + 1]):
        far = residual(model, work, s, s + 1, 0.0, work.slip, work.image)
        if far > worst:
            worst, place = far, work.order[s]
    b = work.pressing[place] if work.pressing[place] >= 0 else place
    i, j, g = work.block_bodies[b, 0], work.block_bodies[b, 1], work.origin[b, 2]
    if work.block_rows[b] > 0:
        g = NONE
    elif work.origin[b, 0] != OWN_GAP:
        i, j = work.contact[work.origin[b, 1], 0], work.contact[work.origin[b, 1], 1]
    return record(log, count, FAILED, i, j, g, time, work.impulse[b, 0])


@compiled
def gather(model, state, work, root, time, index):
    """Wake the bodies of a cluster, and let all others wait."""
    for i in range(model.bodies):
        inside = state.alive[i] and state.cluster[i] == root
        if inside:
            state.watched[i] = 0
        work.waits[i], work.evaluated[i], work.disturbed[i] = 0 if inside else 1, 0, 0
        if inside and state.asleep[i]:
            others = state.neighbour_impulse
            stays_asleep(model, state, work, i, others, model.step, time, index)  # books its work
            state.asleep[i] = 0
        work.awake[i] = 1 if inside else 0
        if not inside:
            for c in range(model.dimension):
                work.q_mid[i, c] = state.q[i, c]


@compiled
def solve_part(model, state, work, h, time, index):
    """Evaluate and solve a part of a step; return why it cannot be done, and its blocks."""
    set_time(model, time + 0.5 * h)
    for i in range(model.bodies):
        if state.alive[i] and work.awake[i]:
            evaluate_body(model, state, work, i, h, time + 0.5 * h, index)
    return attempt(model, state, work, h, time, index, True)


@compiled
def refine(model, state, work, log, root, index, count):
    """Do what is left of a step for the bodies of a cluster, in parts; return why it stopped."""
    H, begin = model.step, index * model.step
    gather(model, state, work, root, begin + 0.5 * H, index)
    work.located[0] = 1
    room = 2 * work.contact.shape[0] + model.bodies * (3 + model.restitution.size)
    next_length, exact, parts, spent = H, True, 0, state.counts[SWEEPS]
    while state.elapsed[root] < H:
        if count + room > log.entries.shape[0]:
            return EVENTS_FULL, count
        rest, time = H - state.elapsed[root], begin + state.elapsed[root]
        h, halved = min(next_length, rest), False
        blocks, island, worst = ZERO, NONE, 0.0
        tries = 0
        while True:
            if rest - h <= INSTANT * H:
                h = rest
            why, blocks = solve_part(model, state, work, h, time, index)
            if why != DONE:
                return why, count
            island, worst = worst_island(model, work)
            tries += 1
            if not exact or tries == MOST_TRIES:
                break
            if worst > model.tolerance and h > SHORTEST_SOLVED * H:
                h, halved = 0.5 * h, True
                continue
            length = acceptable_length(model, state, work, h, work.image)
            length = max(length, INSTANT * H)
            if length >= h:
                break
            h = length
        state.sums[RESIDUAL] = max(state.sums[RESIDUAL], worst)
        if worst > model.tolerance:
            state.counts[UNSOLVED] += 1
            count = record_failure(model, work, log, island, time + 0.5 * h, count)
            exact = False
        count = commit(model, state, work, log, blocks, h, time, index, True, count)
        parts += 1
        allowed = MOST_SWEEPS + MEAN_SWEEPS * parts
        if exact and (parts == MOST_PARTS or state.counts[SWEEPS] - spent > allowed):
            exact = False
            state.counts[UNSOLVED] += 1
            count = record(log, count, FAILED, root, NONE, NONE, time + h, 0.0)
        state.counts[PARTS] += 1
        state.elapsed[root] = H if h >= rest else state.elapsed[root] + h
        next_length = 2.0 * h if halved else H
    return DONE, count


@compiled
def count_residuals(model, state, work, log, time, count):
    """Note the residuals of the islands of a whole step, and record which are not solved."""
    for i in range(model.bodies):
        if work.island_start[i + 1] > work.island_start[i] and not work.waits[i]:
            state.sums[RESIDUAL] = max(state.sums[RESIDUAL], work.island_residual[i])
            if work.island_residual[i] > model.tolerance:
                state.counts[UNSOLVED] += 1
                count = record_failure(model, work, log, np.int64(i), time, count)
    return count


@compiled
def set_time(model, time):
    """Tell the formulas the time since the start."""
    if model.time_parameter >= 0:
        model.parameters[model.time_parameter] = model.start + time


@compiled
def step(model, state, work, log, count):
    """Advance all bodies by one step; return why it cannot be done, or DONE, and the events.

    A step that was left because there was no room is taken up where it was left.
    """
    h, index, left = model.step, state.counts[STEPS], False
    for i in range(model.bodies):
        left = left or state.cluster[i] >= 0
    if not left:
        time = index * h
        work.located[0] = 0
        for i in range(model.bodies):
            work.waits[i] = 0
        set_time(model, time + 0.5 * h)
        any_awake = wake(model, state, work, h, time + 0.5 * h, index)
        why, blocks = attempt(model, state, work, h, time, index, any_awake)
        if why != DONE:
            return why, count
        if any_awake and model.refines:
            left = leave_out(model, state, work, blocks, h)
        if any_awake:
            count = count_residuals(model, state, work, log, time + 0.5 * h, count)
        for i in range(model.bodies):
            state.watched[i] = 0 if work.waits[i] else 1
        count = commit(model, state, work, log, blocks, h, time, index, any_awake, count)
    if left:
        for i in range(model.bodies):
            if state.cluster[i] == i:
                why, count = refine(model, state, work, log, i, index, count)
                if why != DONE:
                    return why, count
                for j in range(model.bodies):
                    if state.cluster[j] == i:
                        state.cluster[j] = NONE
    state.counts[STEPS] = index + 1
    return DONE, count
