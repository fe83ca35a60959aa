"""A step of first-order motion, and its entry points."""

from polycorner.formulas.compilation import never_inline
from polycorner.formulas.intermediate import intermediate_code
from polycorner.formulas.records import RecordType, reader
from polycorner.motion.sweeping import records
from polycorner.motion.sweeping.accounts import (
    finish,
    leave,
    load_forces,
    log_event,
    save_forces,
)
from polycorner.motion.sweeping.admission import admit_some
from polycorner.motion.sweeping.displacements import displace
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.neighbours import farthest, list_neighbours
from polycorner.motion.sweeping.pieces import count_unions, opens
from polycorner.motion.sweeping.records import (
    DONE,
    EVENTS_FULL,
    FAILED,
    IS_LISTED,
    NOT_FINITE,
    PAIRS_FULL,
    PART,
    PARTS,
    ROOM,
    SPLIT,
    STEPS,
)
from polycorner.motion.sweeping.reflection import jostle

REDONE = -1  # a step that needs a longer list of neighbours

system_at, state_at, work_at, log_at = (
    reader(RecordType(f"sweeping.{name}", getattr(records, name).declared))
    for name in ("SYSTEM", "STATE", "WORK", "LOG")
)


@compiled
def step_of(s, st, w, log, low, high, t, index, events):
    """Take a step of some bodies; return why it stopped, and the number of events."""
    left, now, ask = s.step, t, s.noise == 0.0
    single = high - low == 1 and ask and count_unions(s) > 0
    while left > 0.0:
        h = left
        why, count = displace(s, st, w, low, high, now, h, ask)
        if single and why == DONE:
            part = opens(s, st, w, low)
            if s.shortest < part < 1.0 and (1.0 - part) * h > s.shortest * s.step:
                h *= part
                why, count = displace(s, st, w, low, high, now, h, ask)
                st.counts[PARTS] += 1
        if why in (NOT_FINITE, SPLIT):
            w.room[PART] = (now - t + w.room[PART] * h) / s.step
            return why, events
        if why == FAILED:
            events = log_event(log, events, FAILED, low, -1, -1, now + 0.5 * h, 0.0)
        events = finish(s, st, w, log, low, high, now, h, count, events)
        now, left = now + h, left - h
    if s.noise > 0.0:
        events = jostle(s, st, w, log, low, high, t, index, events)
    return DONE, events


@compiled
def step(s, st, w, log, index, events):
    """Take a step of all bodies; return why it stopped, and the number of events.

    Where it stops, the state is that before.
    """
    never_inline()
    N, t = s.bodies, s.start + index * s.step
    together = s.pair_gaps > 0 and N > 1
    if together:
        room = max(s.detection, w.room[ROOM])
        known = w.status[IS_LISTED] and farthest(s, st, w, st.q) <= 0.25 * room
        if not known and not list_neighbours(s, st, w, st.q, room):
            return PAIRS_FULL, events
    load_forces(s, st, w)
    remember(s, st, w)
    before = events
    for low in range(1 if together else N):
        high = N if together else low + 1
        if not together and not st.alive[low]:
            continue
        for r in range(w.force.shape[0] if together else 0):
            w.former[r] = w.force[r]
        if not together:
            for r in range(low * (s.m + s.limits), high * (s.m + s.limits)):
                w.former[r] = w.force[r]
        why, events = step_of(s, st, w, log, low, high, t, index, events)
        if why != DONE:
            restore(s, st, w)
            return why, before
    if together and farthest(s, st, w, st.q) > 0.5 * w.room[ROOM]:
        w.room[ROOM] = 8.0 * farthest(s, st, w, st.q)
        w.status[IS_LISTED] = 0
        restore(s, st, w)
        return REDONE, before
    if s.exit_coordinate >= 0:
        for i in range(N):
            if st.alive[i]:
                passed = w.former_q[i, s.exit_coordinate]
                events = leave(s, st, w, log, i, passed, t, index, events)
    if s.noise > 0.0:
        for r in range(w.force.shape[0]):
            w.force[r] = 0.0
    if not save_forces(s, st, w):
        restore(s, st, w)
        return PAIRS_FULL, before
    return DONE, events


@compiled
def remember(s, st, w):
    """Keep what a step may change before it is known whether it is done."""
    for i in range(s.bodies):
        w.former_rests[i] = st.rests[i]
        for c in range(s.k):
            w.former_q[i, c] = st.q[i, c]
    for place in range(st.sums.shape[0]):
        w.former_sums[place] = st.sums[place]


@compiled
def restore(s, st, w):
    """Put back what a step has changed."""
    for i in range(s.bodies):
        st.rests[i] = w.former_rests[i]
        for c in range(s.k):
            st.q[i, c] = w.former_q[i, c]
    for place in range(st.sums.shape[0]):
        st.sums[place] = w.former_sums[place]


@compiled
def begin_work(s, w):
    """Set owners of rows and mobilities that are constant."""
    per = s.m + s.limits
    for i in range(s.bodies):
        for r in range(i * per, (i + 1) * per):
            w.owner[r, 0], w.owner[r, 1] = i, -1
        for r in range(s.k):
            for c in range(s.k):
                w.mobility[i, r, c] = s.mobility[r, c]
                w.metric[i, r, c] = s.metric[r, c]
                w.factor[i, r, c] = s.factor[r, c]


@compiled
def advance(system, state, work, log, steps):
    """Advance by several steps; return why it stopped, and how many steps and events."""
    s, st, w, entries = system_at(system), state_at(state), work_at(work), log_at(log)
    begin_work(s, w)
    events, done = 0, 0
    room = entries.entries.shape[0] - event_room(s, w)
    while done < steps:
        if events > room:
            return EVENTS_FULL, done, events
        why, events = step(s, st, w, entries, st.counts[STEPS], events)
        if why == REDONE:
            continue
        if why != DONE:
            return why, done, events
        st.counts[STEPS] += 1
        done += 1
        for i in range(s.bodies):
            for u in range(count_unions(s)):
                w.forced[i, u] = -1
    return DONE, done, events


@compiled
def event_room(s, w):
    """Return how many events a step may have."""
    return 4 * (w.force.shape[0] + 3 * s.bodies)


@compiled
def admit(system, state, work, log, steps):
    """Set the velocities that contacts and limits admit at the present place and time.

    They are ``v`` of the work, the wishes ``u``; forces are those of rows.
    """
    s, st, w = system_at(system), state_at(state), work_at(work)
    begin_work(s, w)
    N, t = s.bodies, s.start + steps * s.step
    together = s.pair_gaps > 0 and N > 1
    w.status[IS_LISTED] = 0
    if together and not list_neighbours(s, st, w, st.q, max(s.detection, w.room[ROOM])):
        return PAIRS_FULL, 0, 0
    load_forces(s, st, w)
    for low in range(1 if together else N):
        high = N if together else low + 1
        if not together and not st.alive[low]:
            continue
        if not admit_some(s, st, w, low, high, t):
            return NOT_FINITE, 0, 0
    return DONE, 0, 0


def made() -> str:
    """Return the entry points as intermediate code."""
    return intermediate_code({"advance": advance, "admit": admit}, arguments=5)
