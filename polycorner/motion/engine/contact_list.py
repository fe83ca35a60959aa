"""Contacts between steps, and events."""

import numpy as np

from polycorner.motion.engine.arrays import (
    AT_END,
    CONTACTS,
    LEFT_OVER,
    OWN_FRICTION,
    OWN_GAP,
    OWN_LIMIT,
    PAIR_GAP,
    PENETRATION,
    STEPS,
    TIE_FRICTION,
    TIE_GAP,
)
from polycorner.motion.engine.bounds import BRIEF, contact_of, will_bounce
from polycorner.motion.engine.families import family_of
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.limits import evaluate_limits, limit_value
from polycorner.motion.engine.mean_slip import goes_on_sticking
from polycorner.motion.engine.neighbours import bodies_of, key_of
from polycorner.motion.engine.paths import release_time

MADE, LOST, IMPACT = np.int64(0), np.int64(1), np.int64(2)  # as in EventKind
REST, MOTION, EXIT, FAILED = np.int64(3), np.int64(4), np.int64(5), np.int64(6)
ACTED, CEASED = np.int64(8), np.int64(9)


@compiled
def takes_part(body, block, b):
    """Return whether a block acts on a body that is solved for."""
    return takes_part_of(body, block.bodies[b, 0], block.bodies[b, 1])


@compiled
def takes_part_of(body, i, j):
    """Return whether one of two bodies, of which the second may be -1, is solved for."""
    return body.awake[i] or (j >= 0 and body.awake[j])


@compiled
def store_impulses(model, state, pair, block, begin, end, h):
    """Store the impulses of blocks: for the next step, or as the start of another round of it.

    Those of a shorter step are stored as what they would be in a whole one, those of an instant
    not at all.
    """
    share = h / model.step
    if share <= BRIEF:
        return
    for b in range(begin, end):
        kind, i, f = block.origin[b, 0], block.origin[b, 1], block.origin[b, 2]
        if kind == OWN_GAP:
            state.normal[f] = block.impulse[b, 0] / share
        elif kind == PAIR_GAP:
            pair.impulse[i, 0] = block.impulse[b, 0]
        elif kind == TIE_GAP:
            state.tie_normal[f] = block.impulse[b, 0] / share
        elif kind == OWN_LIMIT:
            state.limit_force[f] = block.impulse[b, 0] / (share * block.load[b])
        for r in range(block.rows[b]):
            if kind == OWN_FRICTION:
                state.friction[f, r] = block.impulse[b, r] / share
            elif kind == TIE_FRICTION:
                state.tie_friction[f, r] = block.impulse[b, r] / share
            else:
                pair.impulse[i, 1 + model.law_start[f] + r] = block.impulse[b, r]


@compiled
def record(log, count, kind, i, j, which, time, value):
    """Record an event; return the number of events."""
    log.entries[count, 0], log.entries[count, 1] = kind, i
    log.entries[count, 2], log.entries[count, 3] = j, which
    log.numbers[count, 0], log.numbers[count, 1] = time, value
    return count + 1


@compiled
def classify(model, block, b, was, gap, bounce, h, time, out):
    """Compare a contact with what it was; out: whether it touches, the event or -1, its time.

    One that closes in the next step and bounces there does not touch before.
    """
    closes = block.load[b] / h
    after = block.after[b, 0] - block.offset[b, 0] - closes
    strikes = block.impulse[b, 0] > 0.0 and block.bounces[b]
    limit = model.parting if was else model.touching
    forced = block.free[b, 0] - block.before[b, 0]
    arrives = not was and will_bounce(model, after, forced, bounce, h)
    touches = gap + h * after <= limit and not (strikes or arrives)
    out[0], out[1], out[2] = 1.0 if touches else 0.0, -1.0, time + h
    if strikes and not was:
        out[1] = IMPACT
    elif touches and not was:
        out[1] = MADE
    elif was and not touches:
        out[1] = LOST


@compiled
def observe_block(model, state, work, b, h, time, sums):
    """Note whether a contact touches, and whether it was made, lost or has bounced, and when.

    For friction with the surroundings, note whether it sticks.
    """
    body, pair, block, event = work.body, work.pair, work.block, work.event
    event.happened[b] = NONE
    kind, i, g = block.origin[b, 0], block.origin[b, 1], block.origin[b, 2]
    if not takes_part(body, block, b):
        return
    if kind == OWN_FRICTION:
        held = state.sticks[g]
        state.sticks[g] = 1 if goes_on_sticking(model, body, block, b) else 0
        if state.sticks[g] and not held:
            state.stopped[g] = state.counts[STEPS] + 1
        if state.sticks[g] and model.friction_turns[g] and block.law[b] == AT_END:
            state.sticks[g] = LEFT_OVER
    elif kind == TIE_FRICTION:
        state.tie_sticks[g] = 1 if goes_on_sticking(model, body, block, b) else 0
    if kind == OWN_LIMIT:
        observe_limit(model, state, work, b, h, time)
        return
    # Friction and equations neither open nor close.
    if block.rows[b] > 0 or block.bilateral[b]:
        return
    out, share, before = work.scratch.image, h / model.step, block.before[b, 0]
    gap, was, bounce = contact_of(model, state, work.mid, pair, work.tie, block, b)
    if kind == OWN_GAP:
        pressed, release = state.pressed[g], state.release[g]
    elif kind == TIE_GAP:
        pressed, release = state.tie_pressed[g], state.tie_release[g]
    else:
        pair.block_of[i] = b
        index = pair.before[i]
        pressed = state.pair_impulse[index, 0] if index >= 0 else 0.0
        release = state.pair_release[index] if index >= 0 else time
    sums[PENETRATION] = max(sums[PENETRATION], -gap)
    classify(model, block, b, was, gap, bounce, h, time, out)
    release = release_time(pressed * share, block.impulse[b, 0], release, h, time)
    if out[1] >= 0.0:
        when = out[2]
        if out[1] == LOST:
            when = min(release, when)
        elif before < 0.0:
            # Gaps are those of the midpoint, from where bodies go on as before until the next one.
            when = min(time + 0.5 * h + max(gap, 0.0) / -before, time + 1.5 * h)
        elif work.manner.located[0]:
            when = time + 0.5 * h
        if out[1] == MADE and block.impulse[b, 0] <= 0.0:
            release = when
        event.happened[b], event.time[b] = np.int64(out[1]), when
    if kind == OWN_GAP:
        state.touches[g] = 1 if out[0] > 0.0 else 0
        state.release[g] = release
        if share > BRIEF:
            state.pressed[g] = block.impulse[b, 0] / share
    elif kind == TIE_GAP:
        state.tie_touches[g], state.tie_release[g] = 1 if out[0] > 0.0 else 0, release
        if share > BRIEF:
            state.tie_pressed[g] = block.impulse[b, 0] / share
    else:
        block.origin[b, 3] = 1 if out[0] > 0.0 else 0
        event.release[b] = release


@compiled
def observe_limit(model, state, work, b, h, time):
    """Note whether a limit on velocities acts, and whether it began or ceased to, and when."""
    block, event, old = work.block, work.event, work.velocity.old
    i, g, p = block.bodies[b, 0], block.origin[b, 2], block.impulse[b, 0]
    if block.bilateral[b]:
        return
    acts, was, share = p > 0.0, state.limit_acts[g] != 0, h / model.step
    force = p / (share * block.load[b])
    release = release_time(state.limit_before[g], force, state.limit_release[g], h, time)
    if was and not acts:
        event.happened[b], event.time[b] = CEASED, min(release, time + h)
    if acts and not was:
        start = work.limit.time[0] - 0.5 * h
        evaluate_limits(model, work.scratch, i, state.q, old, 0.0, old, old, 0.0, start)
        first = limit_value(model, work.scratch, i, g) / block.load[b]
        passed = first - (block.free[b, 0] + block.offset[b, 0])  # by forces alone
        part = min(1.0, max(0.0, first / passed)) if passed > 0.0 else 0.0
        event.happened[b], event.time[b] = ACTED, time + part * h
    state.limit_acts[g], state.limit_release[g] = 1 if acts else 0, release
    if share > BRIEF:
        state.limit_before[g] = force


@compiled
def place_of(model, pair, block, b):
    """Return the bodies, the second may be -1, and the number of the gap of a block, for events.

    Limits and equations of ties, and limits on velocities, have the numbers of their names.
    """
    kind, s, g = block.origin[b, 0], block.origin[b, 1], block.origin[b, 2]
    if kind == OWN_GAP:
        return s, NONE, g
    if kind == TIE_GAP:
        return model.tie_bodies[s, 0], model.tie_bodies[s, 1], model.tie_names[g]
    if kind == OWN_LIMIT:
        return s, NONE, model.limit_names[g]
    return pair.contact[s, 0], pair.contact[s, 1], g


@compiled
def record_contacts(model, pair, block, event, log, blocks, count):
    """Record contacts made, lost and bounced; return the number of events."""
    for b in range(blocks):
        # Block by block afterwards, not by the threads that observed: events stand in one order.
        if event.happened[b] >= 0:
            i, j, g = place_of(model, pair, block, b)
            when, impulse = event.time[b], block.impulse[b, 0]
            count = record(log, count, event.happened[b], i, j, g, when, impulse)
    return count


@compiled
def forget_blocks(pair, contacts):
    """Forget which blocks the contacts had."""
    for s in range(contacts):
        pair.block_of[s] = NONE


@compiled
def list_blocks(pair, contacts):
    """List the blocks of this step's contacts by key; return their number."""
    size = 0
    for s in range(contacts):
        b = pair.block_of[pair.ranked[s]]
        if b >= 0:
            pair.sort_keys[size] = b
            size += 1
    return size


@compiled
def mark_met(state, pair, contacts):
    """Mark the contacts of the last step that are found in this one."""
    for s in range(state.counts[CONTACTS]):
        pair.met[s] = 0
    for s in range(contacts):
        if pair.block_of[s] >= 0 and pair.before[s] >= 0:
            pair.met[pair.before[s]] = 1


@compiled
def keep_contacts(model, state, body, pair, log, h, time, count):
    """Keep the contacts between two sleepers, record those lost; return list size and events."""
    k, size = model.dimension, ZERO
    for s in range(state.counts[CONTACTS]):
        if pair.met[s]:
            continue
        i, j = bodies_of(model, state, s)
        # Not found although somebody is awake: it is open now, or one of them has left.
        if body.awake[i] or body.awake[j] or not (state.alive[i] and state.alive[j]):
            if state.pair_flags[s, 1]:
                g = state.keys[s] % model.most_pair_gaps
                count = record(log, count, LOST, i, j, g, time + h, 0.0)
            continue
        state.keys[size], state.pair_release[size] = state.keys[s], time + 0.5 * h
        for a in range(state.pair_impulse.shape[1]):
            state.pair_impulse[size, a] = state.pair_impulse[s, a]
        for a in range(2):
            state.pair_flags[size, a] = state.pair_flags[s, a]
        for a in range(2 * k):
            state.pair_action[size, a] = state.pair_action[s, a]
        size += 1
    return size, count


@compiled
def add_contacts(model, state, body, pair, block, event, begin, end, kept, share):
    """Add some of this step's contacts to the list, with their impulses, after those kept."""
    k, K = model.dimension, model.lanes
    for s in range(begin, end):
        b, size = pair.sort_keys[s], kept + s
        state.keys[size] = key_of(model, state, pair, block.origin[b, 1])
        state.pair_release[size] = event.release[b]
        lasting = 1.0 / share if share > BRIEF else 0.0
        state.pair_impulse[size, 0] = block.impulse[b, 0] * lasting
        state.pair_flags[size, 0] = 0
        for a in range(k if model.may_rest else ZERO):
            p = state.pair_impulse[size, 0]
            if model.attracts:
                p -= pair.attraction[block.origin[b, 1]] * lasting
            state.pair_action[size, a] = block.jacobian[b, 0, a] * p
            state.pair_action[size, k + a] = block.jacobian[b, 0, K + a] * p
        family = family_of(model, block.bodies[b, 0], block.bodies[b, 1])
        for law in range(model.first_law[family], model.first_law[family + 1]):
            which = law - model.first_law[family]
            f = b + 1 + which
            if goes_on_sticking(model, body, block, f):
                state.pair_flags[size, 0] |= ONE << which
            one, two = ZERO, K
            if block.bodies[f, 0] != block.bodies[b, 0]:
                one, two = K, ZERO
            for r in range(block.rows[f]):
                p = block.impulse[f, r] * lasting
                state.pair_impulse[size, 1 + model.law_start[law] + r] = p
                for a in range(k if model.may_rest else ZERO):
                    state.pair_action[size, a] += block.jacobian[f, r, one + a] * p
                    state.pair_action[size, k + a] += block.jacobian[f, r, two + a] * p
        state.pair_flags[size, 1] = block.origin[b, 3]


@compiled
def sort_contacts(model, state, size):
    """Sort contacts by key, by insertion: they are nearly sorted already."""
    for s in range(1, size):
        t = s
        while t > 0 and state.keys[t - 1] > state.keys[t]:
            state.keys[t - 1], state.keys[t] = state.keys[t], state.keys[t - 1]
            x = state.pair_release[t]
            state.pair_release[t] = state.pair_release[t - 1]
            state.pair_release[t - 1] = x
            for a in range(state.pair_impulse.shape[1]):
                x = state.pair_impulse[t, a]
                state.pair_impulse[t, a] = state.pair_impulse[t - 1, a]
                state.pair_impulse[t - 1, a] = x
            for a in range(2 * model.dimension):
                x = state.pair_action[t, a]
                state.pair_action[t, a] = state.pair_action[t - 1, a]
                state.pair_action[t - 1, a] = x
            for a in range(2):
                y = state.pair_flags[t, a]
                state.pair_flags[t, a] = state.pair_flags[t - 1, a]
                state.pair_flags[t - 1, a] = y
            t -= 1
