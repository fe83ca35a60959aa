"""Sleeping bodies: when they are checked, and what wakes them."""

import numpy as np

from polycorner.motion.engine.arrays import (
    APPLIED_WORK,
    CONTACTS,
    PAIR_FRICTION,
    PAIR_GAP,
    SUBSTRATE_WORK,
)
from polycorner.motion.engine.evaluation import evaluate_body
from polycorner.motion.engine.families import kind_of
from polycorner.motion.engine.island_sleep import PRESSED, presses, settle_islands, wake_mates
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.neighbours import bodies_of
from polycorner.motion.engine.partition import island_of, root_of
from polycorner.motion.engine.paths import release_time
from polycorner.motion.engine.rest import (
    SLEEP_MARGIN,
    comes_to_rest,
    holds,
    load_of,
    remains_at_rest,
)
from polycorner.motion.engine.sets import contains

LONGEST_SLEEP = np.int64(50)  # most steps between two checks of a sleeper
NEVER = np.int64(2**40)  # steps until a check that is not needed


@compiled
def wake(model, state, work, h, time, index):
    """Wake the sleepers whose forces no longer balance; return whether any body is awake.

    Bodies that are not asleep have been evaluated.

    A sleeper with friction to spare is not checked until the reserve could be used up, at the rate
    at which its forces changed before the last check.
    """
    mid, body, sleep, scratch = work.mid, work.body, work.sleep, work.scratch
    any_awake = False
    for i in range(model.bodies):
        body.awake[i], body.evaluated[i], sleep.disturbed[i] = 0, 0, 0
        if not state.alive[i]:
            continue
        # Its midpoint is needed by neighbours that are awake.
        if state.asleep[i] and (state.check_due[i] > index or state.pile[i] > 0):
            for c in range(model.dimension):
                mid.q[i, c] = state.q[i, c] + 0.5 * h * state.v[i, c]
            continue
        if not state.asleep[i]:
            body.evaluated[i], body.awake[i], any_awake = 1, 1, True
        elif not stays_asleep(model, state, mid, body, sleep, scratch, i, h, time, index):
            body.awake[i], any_awake = 1, True
    if any_awake and model.families > 0:
        wake_piles(model, state, work, h, time, index)
    if any_awake:
        wake_mates(model, state, work, h, time, index)
    return any_awake


@compiled
def wake_piles(model, state, work, h, time, index):
    """Wake the whole pile at rest around each body that woke; see :func:`find_equilibrium`."""
    mid, body, sleep, island, scratch = work.mid, work.body, work.sleep, work.island, work.scratch
    N, root, disturbed, moving = model.bodies, island.parent, sleep.disturbed, island.cursor
    woken = False
    for i in range(N):
        root[i] = i
        disturbed[i], moving[i] = 0, 0
        woken = woken or (state.asleep[i] and body.awake[i])
    if not woken:
        return
    for s in range(state.counts[CONTACTS]):
        if state.pair_flags[s, 1]:
            i, j = bodies_of(model, state, s)
            x, y = root_of(root, i), root_of(root, j)
            root[max(x, y)] = min(x, y)
    for i in range(N):
        if state.alive[i]:
            r = root_of(root, i)
            if not state.rests[i]:
                moving[r] = 1
            if state.asleep[i] and body.awake[i]:
                disturbed[r] = 1
    for i in range(N):
        r = root_of(root, i)
        if state.alive[i] and not body.awake[i] and disturbed[r] and not moving[r]:
            if not body.evaluated[i]:
                stays_asleep(model, state, mid, body, sleep, scratch, i, h, time, index)
            body.awake[i] = 1


@compiled
def stays_asleep(model, state, mid, body, sleep, scratch, i, h, time, index):
    """Evaluate a body; return whether it stays asleep, and book the work on it since."""
    body.evaluated[i] = 1
    evaluate_body(model, state, mid, scratch, i, h, time, index)
    # It was woken in this step already; only its evaluation was wanted.
    if not state.asleep[i]:
        return False
    if state.pile[i]:  # without velocity, and so without work
        state.booked_to[i] = index
        return True
    asleep = remains_at_rest(model, state, mid, sleep, scratch, i, state.neighbour_impulse)
    steps = index - state.booked_to[i]
    if steps > 0:  # by the trapezoidal rule, if there is a new value
        # A body that wakes has no impulses of rest in this step: those of the last check count for
        # all steps since.
        share = 0.5 * steps if asleep else 0.0
        for f in range(model.first_friction[i], model.first_friction[i + 1]):
            for r in range(model.slip_start[f + 1] - model.slip_start[f]):
                before, now = state.booked_friction[f, r], sleep.proof_friction[f, r]
                p = (steps - share) * before + share * now
                state.sums[SUBSTRATE_WORK] -= p * mid.slip_offset[model.slip_start[f] + r]
                if asleep:
                    state.booked_friction[f, r] = now
        for c in range(model.dimension):
            before, now = state.booked_applied[i, c], mid.applied[i, c]
            mean = (steps - share) * before + share * now
            state.sums[APPLIED_WORK] += mean * state.v[i, c]
            if asleep:
                state.booked_applied[i, c] = now
        state.booked_to[i] = index
    return asleep


@compiled
def next_check(model, state, mid, sleep, i, h, index):
    """Return the step in which a sleeper is checked again."""
    rate, still = 0.0, model.still[i] != 0
    for c in range(model.dimension):
        still = still and state.v[i, c] == 0.0
    if still:  # its step is the same for ever, until a body that is awake touches it
        return index + NEVER
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        load = load_of(model, mid, sleep.proof_normal, i, f)
        if load <= 0.0:
            continue
        x, y = sleep.proof_friction[f, 0], sleep.proof_friction[f, 1]
        if not contains(model, model.friction_sets[f, 0], x, y, load * (1.0 - SLEEP_MARGIN), 0.0):
            return index + 1
        change = abs(x - state.friction[f, 0]) + abs(y - state.friction[f, 1])
        rate = max(rate, change / load)
    if model.follows_time:
        return index + 1
    steps = LONGEST_SLEEP
    if rate * LONGEST_SLEEP > 0.1 * SLEEP_MARGIN:
        # A tenth of the reserve: the rate is that of the last change only.
        steps = np.int64(0.1 * SLEEP_MARGIN / rate)
    for c in range(model.dimension):
        # Forces that are drawn anew in each step have no rate.
        if model.kicks[kind_of(model, i), c] > 0.0:
            return index + 1
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        # Impulses of contacts depend on each other; only known loads change slowly by themselves.
        if holds(model, sleep.proof_normal, i, g):
            return index + 1
    if model.chatter > 0.0:  # the next draw comes at a known time
        now = np.floor((index + 0.5) * h / model.correlation_time)
        while steps > 0 and np.floor((index + steps + 0.5) * h / model.correlation_time) != now:
            steps -= 1
    return index + 1 + steps


@compiled
def wake_neighbours(model, state, work, blocks, h, time, index):
    """Sum the impulses of neighbours on each body; wake those not at rest under them.

    Sleepers on which an island acts that is not solved wake up, too.
    """
    mid, body, sleep = work.mid, work.body, work.sleep
    island, block, scratch = work.island, work.block, work.scratch
    k, N = model.dimension, model.bodies
    if not model.may_rest:
        return False  # nothing sleeps
    for i in range(N):
        sleep.disturbed[i] = 0
        for c in range(k):
            sleep.neighbour_impulse[i, c] = mid.attraction[i, c]
    for s in range(state.counts[CONTACTS]):
        i, j = bodies_of(model, state, s)
        if body.awake[i] or body.awake[j]:
            piled = state.pile[i] > 0 or state.pile[j] > 0
            seen = 1 | PRESSED if piled and presses(model, state, s) else 1
            sleep.disturbed[i] |= seen
            sleep.disturbed[j] |= seen
            continue
        for c in range(k):
            sleep.neighbour_impulse[i, c] += state.pair_action[s, c]
            sleep.neighbour_impulse[j, c] += state.pair_action[s, k + c]
    for b in range(blocks):
        if block.origin[b, 0] in (PAIR_GAP, PAIR_FRICTION):
            for side in range(2):
                i = block.bodies[b, side]
                solved = island.residual[island_of(body, island, block, b)] <= model.tolerance
                # An island that is not solved has no impulses that could prove anything: its
                # sleepers wake.
                sleep.disturbed[i] |= 1 if solved else 2
                for r in range(max(1, block.rows[b])):
                    p = block.impulse[b, r]
                    # Most contacts of a heap are open.
                    if p == 0.0:
                        continue
                    sleep.disturbed[i] |= PRESSED
                    for c in range(k):
                        slope = block.jacobian[b, r, side * model.lanes + c]
                        sleep.neighbour_impulse[i, c] += slope * p
    woken = False
    for i in range(N):
        if state.pile[i]:
            if sleep.disturbed[i] > 1 and not (body.awake[i] or body.waits[i]):
                body.awake[i], woken = 1, True
        elif sleep.disturbed[i] and state.alive[i] and not (body.awake[i] or body.waits[i]):
            if not body.evaluated[i]:
                stays_asleep(model, state, mid, body, sleep, scratch, i, h, time, index)
            if sleep.disturbed[i] & 2 or not remains_at_rest(
                model, state, mid, sleep, scratch, i, sleep.neighbour_impulse
            ):
                body.awake[i] = 1
                woken = True
    if woken:
        wake_mates(model, state, work, h, time, index)
    return woken


@compiled
def settle(model, state, work, h, index):
    """Give bodies that came to rest exactly the velocity of rest; update sleepers."""
    mid, body, sleep = work.mid, work.body, work.sleep
    k = model.dimension
    rest = work.scratch.rest_velocity
    for i in range(model.bodies):
        if not state.alive[i]:
            continue
        if body.awake[i]:
            state.rests[i] = state.asleep[i] = state.pile[i] = 0
            if model.may_rest and comes_to_rest(model, state, work, i, rest):
                state.rests[i] = 1
        if body.awake[i] or sleep.disturbed[i]:
            for c in range(k):
                state.neighbour_impulse[i, c] = sleep.neighbour_impulse[i, c]
        if body.awake[i]:
            state.booked_to[i], state.check_due[i] = index + 1, index + 1
        # What proves rest becomes the state, from which the next proof starts.
        if state.asleep[i] and body.evaluated[i] and not state.pile[i]:
            if not body.awake[i]:
                state.booked_to[i] = index + 1
                state.check_due[i] = next_check(model, state, mid, sleep, i, h, index)
            for f in range(model.first_friction[i], model.first_friction[i + 1]):
                for r in range(2):
                    state.friction[f, r] = sleep.proof_friction[f, r]
                    state.booked_friction[f, r] = sleep.proof_friction[f, r]
            for c in range(k):
                state.booked_applied[i, c] = mid.applied[i, c]
            for g in range(model.first_gap[i], model.first_gap[i + 1]):
                before, now = state.normal[g], sleep.proof_normal[g]
                release = release_time(before, now, state.release[g], h, index * h)
                state.normal[g], state.pressed[g] = now, now
                state.release[g] = release
    if model.may_rest and not work.manner.located[0]:
        settle_islands(model, state, work)
