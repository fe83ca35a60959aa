"""Contacts between steps, and events."""

import numpy as np

from polycorner.motion.engine.arrays import CONTACTS, OWN_FRICTION, OWN_GAP, PAIR_GAP, PENETRATION
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import TOUCHING, key_of, pair_of
from polycorner.motion.engine.paths import release_time
from polycorner.motion.engine.rows import sticks

PARTING = 100.0 * TOUCHING  # scaled gap beyond which a contact is lost
MADE, LOST, IMPACT = np.int64(0), np.int64(1), np.int64(2)  # as in EventKind
INSTANT = 1e-9  # of a step: the shortest part, for an impact
REST, MOTION, EXIT, FAILED = np.int64(3), np.int64(4), np.int64(5), np.int64(6)


@compiled
def takes_part(work, b):
    """Return whether a block acts on a body that is solved for."""
    j = work.block_bodies[b, 1]
    return work.awake[work.block_bodies[b, 0]] or (j >= 0 and work.awake[j])


@compiled
def store_impulses(model, state, work, begin, end, h):
    """Store the impulses of blocks: for the next step, or as the start of another round of it.

    Those of a shorter step are stored as what they would be in a whole one, those of an instant
    not at all.
    """
    share = h / model.step
    if share <= INSTANT:
        return
    for b in range(begin, end):
        kind, i, f = work.origin[b, 0], work.origin[b, 1], work.origin[b, 2]
        if kind == OWN_GAP:
            state.normal[i, f] = work.impulse[b, 0] / share
        elif kind == PAIR_GAP:
            work.contact_impulse[i, 0] = work.impulse[b, 0]
        for r in range(work.block_rows[b]):
            if kind == OWN_FRICTION:
                state.friction[i, f, r] = work.impulse[b, r] / share
            else:
                work.contact_impulse[i, 1 + model.pair_slip_start[f] + r] = work.impulse[b, r]


@compiled
def record(log, count, kind, i, j, which, time, value):
    """Record an event; return the number of events."""
    log.entries[count, 0], log.entries[count, 1] = kind, i
    log.entries[count, 2], log.entries[count, 3] = j, which
    log.numbers[count, 0], log.numbers[count, 1] = time, value
    return count + 1


@compiled
def classify(work, b, was, gap, h, time, scale, out):
    """Compare a contact with what it was; out: whether it touches, the event or -1, its time."""
    closes = work.block_load[b] / h
    after = work.after[b, 0] - work.offset[b, 0] - closes
    strikes = work.impulse[b, 0] > 0.0 and work.bounces[b]
    touches = gap + h * after <= (PARTING if was else TOUCHING) * scale and not strikes
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
    work.happened[b] = NONE
    kind, i, g = work.origin[b, 0], work.origin[b, 1], work.origin[b, 2]
    if not takes_part(work, b):
        return
    if kind == OWN_FRICTION:
        state.sticks[i, g] = 1 if sticks(model, work, b) else 0
    if work.block_rows[b] > 0 or work.bilateral[b]:
        return
    out, share, before = work.image, h / model.step, work.before[b, 0]
    if kind == OWN_GAP:
        gap, was = work.gap[i, g], state.touches[i, g] != 0
        pressed, release = state.pressed[i, g], state.release[i, g]
    else:
        work.block_of[i] = b
        gap, index = work.contact_gap[i], work.contact_before[i]
        was = index >= 0 and state.pair_flags[index, 1] != 0
        pressed = state.pair_impulse[index, 0] if index >= 0 else 0.0
        release = state.pair_release[index] if index >= 0 else time
    sums[PENETRATION] = max(sums[PENETRATION], -gap)
    classify(work, b, was, gap, h, time, model.gap_unit, out)
    release = release_time(pressed * share, work.impulse[b, 0], release, h, time)
    if out[1] >= 0.0:
        when = out[2]
        if out[1] == LOST:
            when = min(release, when)
        elif before < 0.0:
            when = min(time + 0.5 * h + max(gap, 0.0) / -before, time + 1.5 * h)
        elif work.located[0]:
            when = time + 0.5 * h
        if out[1] == MADE and work.impulse[b, 0] <= 0.0:
            release = when
        work.happened[b], work.event_time[b] = np.int64(out[1]), when
    if kind == OWN_GAP:
        state.touches[i, g] = 1 if out[0] > 0.0 else 0
        state.release[i, g] = release
        if share > INSTANT:
            state.pressed[i, g] = work.impulse[b, 0] / share
    else:
        work.origin[b, 3] = 1 if out[0] > 0.0 else 0
        work.release[b] = release


@compiled
def record_contacts(work, log, blocks, count):
    """Record contacts made, lost and bounced; return the number of events."""
    for b in range(blocks):
        if work.happened[b] >= 0:
            i, j, g = work.origin[b, 1], NONE, work.origin[b, 2]
            if work.origin[b, 0] != OWN_GAP:
                i, j = work.contact[work.origin[b, 1], 0], work.contact[work.origin[b, 1], 1]
            when, impulse = work.event_time[b], work.impulse[b, 0]
            count = record(log, count, work.happened[b], i, j, g, when, impulse)
    return count


@compiled
def forget_blocks(work, contacts):
    """Forget which blocks the contacts had."""
    for s in range(contacts):
        work.block_of[s] = NONE


@compiled
def list_blocks(work, contacts):
    """List the blocks of this step's contacts by key; return their number."""
    size = 0
    for s in range(contacts):
        b = work.block_of[work.ranked[s]]
        if b >= 0:
            work.sort_keys[size] = b
            size += 1
    return size


@compiled
def mark_met(state, work, contacts):
    """Mark the contacts of the last step that are found in this one."""
    for s in range(state.counts[CONTACTS]):
        work.met[s] = 0
    for s in range(contacts):
        if work.block_of[s] >= 0 and work.contact_before[s] >= 0:
            work.met[work.contact_before[s]] = 1


@compiled
def keep_contacts(model, state, work, log, h, time, count):
    """Keep the contacts between two sleepers, record those lost; return list size and events."""
    k, size = model.dimension, ZERO
    for s in range(state.counts[CONTACTS]):
        if work.met[s]:
            continue
        i, j = pair_of(model, state, state.keys[s] // model.pair_gaps)
        if work.awake[i] or work.awake[j] or not (state.alive[i] and state.alive[j]):
            if state.pair_flags[s, 1]:
                g = state.keys[s] % model.pair_gaps
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
def add_contacts(model, state, work, begin, end, kept, share):
    """Add some of this step's contacts to the list, with their impulses, after those kept."""
    k, K = model.dimension, model.lanes
    for s in range(begin, end):
        b, size = work.sort_keys[s], kept + s
        state.keys[size] = key_of(model, state, work, work.origin[b, 1])
        state.pair_release[size] = work.release[b]
        lasting = 1.0 / share if share > INSTANT else 0.0
        state.pair_impulse[size, 0] = work.impulse[b, 0] * lasting
        state.pair_flags[size, 0] = 0
        for a in range(k if model.may_rest else ZERO):
            p = state.pair_impulse[size, 0]
            state.pair_action[size, a] = work.jacobian[b, 0, a] * p
            state.pair_action[size, k + a] = work.jacobian[b, 0, K + a] * p
        for law in range(model.pair_laws):
            f = b + 1 + law
            if sticks(model, work, f):
                state.pair_flags[size, 0] |= ONE << law
            one, two = ZERO, K
            if work.block_bodies[f, 0] != work.block_bodies[b, 0]:
                one, two = K, ZERO
            for r in range(work.block_rows[f]):
                p = work.impulse[f, r] * lasting
                state.pair_impulse[size, 1 + model.pair_slip_start[law] + r] = p
                for a in range(k if model.may_rest else ZERO):
                    state.pair_action[size, a] += work.jacobian[f, r, one + a] * p
                    state.pair_action[size, k + a] += work.jacobian[f, r, two + a] * p
        state.pair_flags[size, 1] = work.origin[b, 3]


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
