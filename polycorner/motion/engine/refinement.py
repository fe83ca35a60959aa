"""A whole step of all bodies; those for which it is too long take shorter ones.

After a step was solved, some islands are left out of it
(:mod:`~polycorner.motion.engine.left_out`).  They then do the same step in parts (:func:`refine`),
in which a contact acts only if it is closed.  A part ends where another contact closes, and an
impact is a part of no length.  A part that is not solved to the tolerance, or in which a contact
sinks in, is halved.  The parts of an island do not depend on other bodies.  Those of a crowd are
swept as its whole steps are, and halved while a body may pass through another.
"""

import numpy as np

from polycorner.formulas.compilation import call_kernel
from polycorner.motion.engine.arrays import (
    DIVIDED,
    DONE,
    EVENTS_FULL,
    HALVED,
    LAST,
    PARTS,
    RESIDUAL,
    STEPS,
    SWEEPS,
    UNSOLVED,
)
from polycorner.motion.engine.bounds import INSTANT
from polycorner.motion.engine.contact_list import FAILED, place_of, record
from polycorner.motion.engine.crowds import is_crowd
from polycorner.motion.engine.evaluation import evaluate_body
from polycorner.motion.engine.gauss_seidel import residual
from polycorner.motion.engine.island_sleep import disperse
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.left_out import find_passing, leave_out, slow_travel
from polycorner.motion.engine.limit_blocks import acceptable_to_limits
from polycorner.motion.engine.paths import acceptable_length, acceptable_to_ties
from polycorner.motion.engine.sleep import stays_asleep, wake
from polycorner.motion.engine.solution import evaluate_bodies
from polycorner.motion.engine.stepping import attempt, commit
from polycorner.motion.engine.tie_blocks import evaluate_ties

SHORTEST_SOLVED = 1.0 / 16.0  # of a step, to which parts are halved to be solved
MOST_PARTS = 100_000  # of one step, beyond which the rest is done at once
MOST_SWEEPS, MEAN_SWEEPS = 1000, 50  # over islands, in all and for each try more, the same
MOST_TRIES = 100  # of one part


@compiled
def worst_island(model, island):
    """Return the body that represents the worst island, and its residual."""
    where, worst = NONE, 0.0
    for i in range(model.bodies):
        if island.start[i + 1] > island.start[i] and island.residual[i] > worst:
            where, worst = np.int64(i), island.residual[i]
    return where, worst


@compiled
def record_failure(model, work, log, root, time, count):
    """Record where an island was not solved; return the number of events.

    Of a crowd this is known: it is recorded where bodies are sunk into each other.
    """
    velocity, island, pair = work.velocity, work.island, work.pair
    block, search, scratch = work.block, work.search, work.scratch
    if is_crowd(model, island.start[root], island.start[root + 1]):
        b = island.sunk[root]
        if b < 0:
            return count
        i, j, g = place_of(model, pair, block, b)
        return record(log, count, FAILED, i, j, g, time, block.impulse[b, 0])
    worst, place = -1.0, NONE
    for s in range(island.start[root], island.start[root + 1]):
        far = residual(model, velocity, block, search, scratch, s, s + 1, 0.0)
        if far > worst:
            worst, place = far, block.order[s]
    b = block.pressing[place] if block.pressing[place] >= 0 else place
    i, j, g = block.bodies[b, 0], block.bodies[b, 1], NONE
    if block.rows[b] == 0:
        i, j, g = place_of(model, pair, block, b)
    return record(log, count, FAILED, i, j, g, time, block.impulse[b, 0])


@compiled
def gather(model, state, work, root, time, index):
    """Wake the bodies of a cluster, and let all others wait."""
    mid, body, sleep, scratch = work.mid, work.body, work.sleep, work.scratch
    members = 0
    for i in range(model.bodies):
        inside = state.alive[i] and state.cluster[i] == root
        members += 1 if inside else 0
        if inside:
            state.watched[i] = 0
        body.waits[i], body.evaluated[i], sleep.disturbed[i] = 0 if inside else 1, 0, 0
        if inside and state.asleep[i]:
            # It stays what it is here; what counts is that its work is booked.
            stays_asleep(model, state, mid, body, sleep, scratch, i, model.step, time, index)
            disperse(model, state, i)
            state.asleep[i] = 0
        body.awake[i] = 1 if inside else 0
        # Others wait where they are at the beginning of the step.
        if not inside:
            for c in range(model.dimension):
                mid.q[i, c] = state.q[i, c]
    work.manner.near[0] = slow_travel(model, members)


@compiled
def solve_part(model, state, work, h, time, index):
    """Evaluate and solve a part of a step; return why it cannot be done, and its blocks."""
    mid, scratch = work.mid, work.scratch
    set_time(model, time + 0.5 * h)
    for i in range(model.bodies):
        if state.alive[i] and work.body.awake[i]:
            evaluate_body(model, state, mid, scratch, i, h, time + 0.5 * h, index)
    if model.ties > 0:
        evaluate_ties(model, state, work, h, time + 0.5 * h)
    return attempt(model, state, work, h, time, index, True)


@compiled
def refine(model, state, work, log, cluster, index, count):
    """Do what is left of a step for the bodies of a cluster, in parts; return why it stopped."""
    manner = work.manner
    H, begin = model.step, index * model.step
    root, swept = cluster % model.bodies, cluster >= model.bodies
    gather(model, state, work, cluster, begin + 0.5 * H, index)
    next_length, exact, parts, tried, spent = H, not swept, 0, 0, state.counts[SWEEPS]
    if swept:  # in a whole one something passes
        next_length = 0.5 * H
    first, second = NONE, NONE
    while state.elapsed[root] < H:
        if count > model.event_room:
            return EVENTS_FULL, count
        manner.located[0] = 1 if exact else 0  # what is left is done as a whole step is
        rest, time = H - state.elapsed[root], begin + state.elapsed[root]
        h, halved = min(next_length, rest), False
        blocks, where, worst = ZERO, NONE, 0.0
        tries = 0
        while True:
            # No part is left that is shorter than an instant: its impulses could not be stored.
            if rest - h <= INSTANT * H:
                h = rest
            manner.remedy[0] = HALVED if exact and h > SHORTEST_SOLVED * H else LAST
            why, blocks = solve_part(model, state, work, h, time, index)
            if why != DONE:
                return why, count
            where, worst = worst_island(model, work.island)
            tries += 1
            if swept:
                first, second = find_passing(model, state, work, h)
                if first >= 0 and h > model.shortest_part * H:
                    h, halved = 0.5 * h, True
                    continue
            if not exact or tries == MOST_TRIES:
                break
            if worst > model.tolerance and h > SHORTEST_SOLVED * H:
                h, halved = 0.5 * h, True
                continue
            length = acceptable_length(model, state, work, h, work.scratch.image)
            if model.ties > 0:
                length = min(length, acceptable_to_ties(model, state, work, h, work.scratch.image))
            if model.limits > 0:
                length = min(length, acceptable_to_limits(model, state, work, h))
            length = max(length, INSTANT * H)
            if length >= h:
                break
            h, halved = length, length == 0.5 * h
        state.sums[RESIDUAL] = max(state.sums[RESIDUAL], worst)
        if worst > model.tolerance:
            state.counts[UNSOLVED] += 1
            count = record_failure(model, work, log, where, time + 0.5 * h, count)
            exact = False
        if first >= 0:
            count = record(log, count, FAILED, first, second, NONE, time + h, 0.0)
        count = commit(model, state, work, log, blocks, h, time, index, True, count)
        parts, tried = parts + 1, tried + tries
        # Chattering impacts, as of a ball that comes to rest in a wedge, would go on for ever: what
        # has cost too much is done at once.
        allowed = MOST_SWEEPS + MEAN_SWEEPS * tried
        if exact and (parts == MOST_PARTS or state.counts[SWEEPS] - spent > allowed):
            exact = False
            state.counts[UNSOLVED] += 1
            count = record(log, count, FAILED, root, NONE, NONE, time + h, 0.0)
        state.counts[PARTS] += 1
        state.elapsed[root] = H if h >= rest else state.elapsed[root] + h
        # A part halved for its own sake grows again; one that ends at an impact says nothing of the
        # next.
        next_length = 2.0 * h if halved or swept else H
    return DONE, count


@compiled
def count_residuals(model, state, work, log, time, count):
    """Note the residuals of the islands of a whole step, and record which are not solved."""
    island = work.island
    for i in range(model.bodies):
        if island.start[i + 1] > island.start[i] and not work.body.waits[i]:
            state.sums[RESIDUAL] = max(state.sums[RESIDUAL], island.residual[i])
            if island.residual[i] > model.tolerance:
                state.counts[UNSOLVED] += 1
                count = record_failure(model, work, log, np.int64(i), time, count)
    return count


@compiled
def set_time(model, time):
    """Tell the formulas the time, and what depends on nothing else."""
    base = model.parameters.ctypes.data
    for kind in range(model.kinds):
        at, signals = model.time_parameter[kind], model.signal_kernel[kind]
        if at >= 0:
            model.parameters[at] = model.start + time
            if signals != 0:
                known = base + 8 * model.signal_parameters[kind]
                call_kernel(signals, base + 8 * at, known, base + 8 * (at + 1), base, base)


@compiled
def step(model, state, work, log, count):
    """Advance all bodies by one step; return why it cannot be done, or DONE, and the events.

    A step that was left because there was no room is taken up where it was left.
    """
    manner, body = work.manner, work.body
    h, index, left = model.step, state.counts[STEPS], False
    for i in range(model.bodies):
        left = left or state.cluster[i] >= 0
    if not left:
        time = index * h
        manner.located[0], manner.remedy[0] = 0, DIVIDED if model.refines else LAST
        for i in range(model.bodies):
            body.waits[i] = 0
        set_time(model, time + 0.5 * h)
        evaluate_bodies(model, state, work, h, time + 0.5 * h, index)
        any_awake = wake(model, state, work, h, time + 0.5 * h, index)
        why, blocks = attempt(model, state, work, h, time, index, any_awake)
        if why != DONE:
            return why, count
        if any_awake and model.refines:
            left = leave_out(model, state, work, blocks, h)
        if any_awake:
            count = count_residuals(model, state, work, log, time + 0.5 * h, count)
        for i in range(model.bodies):
            # After parts the next step starts with other velocities than those that were looked
            # ahead with.
            state.watched[i] = 0 if body.waits[i] else 1
        count = commit(model, state, work, log, blocks, h, time, index, any_awake, count)
    if left:
        manner.remedy[0] = LAST
        for i in range(model.bodies):
            cluster = state.cluster[i]
            if cluster >= 0 and cluster % model.bodies == i:
                why, count = refine(model, state, work, log, cluster, index, count)
                if why != DONE:
                    return why, count
                for j in range(model.bodies):
                    if state.cluster[j] == cluster:
                        state.cluster[j] = NONE
    state.counts[STEPS] = index + 1
    return DONE, count
