"""What a step leaves: places, forces from one step to the next, events, and work."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.draws import compiled, uniform
from polycorner.motion.sweeping.programme import along, is_equation
from polycorner.motion.sweeping.records import DRAG, LISTED, PAIRS, PENETRATION, WISH

MADE, LOST, REST, MOTION, EXIT = 0, 1, 3, 4, 5  # the numbers of the kinds of events


@compiled
def log_event(log, events, kind, a, b, contact, time, impulse):
    """Log an event; return the new number of events."""
    log.entries[events, 0], log.entries[events, 1] = kind, a
    log.entries[events, 2], log.entries[events, 3] = b, contact
    log.numbers[events, 0], log.numbers[events, 1] = time, impulse
    return events + 1


@compiled
def load_forces(s, st, w):
    """Give the rows the forces that they had in the last step; those of pairs by their keys."""
    own, G, cursor = s.bodies * (s.m + s.limits), s.pair_gaps, 0
    for r in range(own):
        w.force[r], w.touches[r], w.since[r] = s.step * st.force[r], st.touches[r], st.since[r]
    for p in range(w.status[LISTED]):
        for g in range(G):
            r = own + p * G + g
            w.owner[r, 0], w.owner[r, 1] = w.pairs[p, 0], w.pairs[p, 1]
            key = (w.pairs[p, 0] * s.bodies + w.pairs[p, 1]) * G + g
            while cursor < st.counts[PAIRS] and st.keys[cursor] < key:
                cursor += 1
            w.force[r], w.touches[r], w.since[r] = 0.0, 0, 0.0
            if cursor < st.counts[PAIRS] and st.keys[cursor] == key:
                w.force[r] = s.step * st.pair_force[cursor]
                w.touches[r], w.since[r] = st.pair_touches[cursor], st.pair_since[cursor]


@compiled
def save_forces(s, st, w):
    """Keep the forces of rows, of pairs those that act or touch; return whether there is room."""
    own, G, count = s.bodies * (s.m + s.limits), s.pair_gaps, 0
    for r in range(own):
        st.force[r], st.touches[r], st.since[r] = w.force[r] / s.step, w.touches[r], w.since[r]
    for p in range(w.status[LISTED]):
        for g in range(G):
            r = own + p * G + g
            if w.force[r] > 0.0 or w.touches[r]:
                if count >= st.keys.shape[0]:
                    return False
                st.keys[count] = (w.pairs[p, 0] * s.bodies + w.pairs[p, 1]) * G + g
                st.pair_force[count] = w.force[r] / s.step
                st.pair_touches[count], st.pair_since[count] = w.touches[r], w.since[r]
                count += 1
    st.counts[PAIRS] = count
    return True


@compiled
def observe(s, w, log, r, t, h, events):
    """Note whether a row touches, and since when its force has vanished; return the events.

    A contact closes where its gap would vanish without its own force, and opens where its force,
    told by its mean over this step and the last one, would change its sign.
    """
    per, own = s.m + s.limits, s.bodies * (s.m + s.limits)
    contact = r % per if r < own else s.m + (r - own) % s.pair_gaps
    gap, touched = w.trial[r], w.touches[r]
    touches = w.on[r] if r < own else 1
    near = touches and gap <= s.touching * w.norm[r] and w.norm[r] > 0.0
    if touched and w.force[r] == 0.0 and w.former[r] > 0.0:
        pull = max(gap, 0.0) / w.size[r] if w.size[r] > 0.0 else 0.0
        w.since[r] = t - 0.5 * h + h * w.former[r] / (w.former[r] + pull)
    if w.listed[r] and near and not touched:
        way = along(s, w, r, w.d) - w.size[r] * w.force[r]
        part = -w.before[r] / way if way < 0.0 else 0.0
        time = t + h * min(1.0, max(0.0, part))
        events = log_event(log, events, MADE, w.owner[r, 0], w.owner[r, 1], contact, time, 0.0)
        log.numbers[events - 1, 1] = w.force[r]
        w.touches[r], w.since[r] = 1, time
    elif touched and (not touches or (w.force[r] == 0.0 and gap > s.parting * w.norm[r])):
        time = min(max(w.since[r], 0.0), t + h) if w.former[r] == 0.0 or touches else t
        events = log_event(log, events, LOST, w.owner[r, 0], w.owner[r, 1], contact, time, 0.0)
        w.touches[r] = 0
    return events


@compiled
def book(s, st, w, i, h):
    """Book what the wished velocity works and what drag dissipates in a step."""
    if not h > 0.0:
        return
    for r in range(s.k):
        total = 0.0
        for c in range(s.k):
            total += w.metric[i, r, c] * w.d[i, c]
        st.sums[DRAG] += w.d[i, r] * total / h
        st.sums[WISH] += w.flow[i, r] * total


@compiled
def finish(s, st, w, log, low, high, t, h, count, events):
    """Move bodies to the end of a step, and note its events; return their number."""
    never_inline()
    per, own = s.m + s.limits, s.bodies * (s.m + s.limits)
    if s.noise == 0.0:
        for i in range(low, high):
            for r in range(i * per, i * per + s.inequalities if st.alive[i] else i * per):
                events = observe(s, w, log, r, t, h, events)
        for r in range(own, own + w.status[LISTED] * s.pair_gaps if high - low > 1 else own):
            events = observe(s, w, log, r, t, h, events)
    for e in range(count):
        r = w.active[e]
        if not is_equation(s, r) and r % max(per, 1) < s.m and w.norm[r] > 0.0:
            st.sums[PENETRATION] = max(st.sums[PENETRATION], -w.trial[r])
    for i in range(low, high):
        if not st.alive[i]:
            continue
        book(s, st, w, i, h)
        most = 0.0
        for c in range(s.k):
            most = max(most, abs(w.d[i, c]) * s.units[c])
            st.q[i, c] += w.d[i, c]
        still = s.noise == 0.0 and most <= s.zero
        if still and not st.rests[i]:
            events = log_event(log, events, REST, i, -1, -1, t + h, 0.0)
        if st.rests[i] and not still:
            events = log_event(log, events, MOTION, i, -1, -1, t, 0.0)
        st.rests[i] = 1 if still else 0
    return events


@compiled
def leave(s, st, w, log, i, before, t, index, events):
    """Let a body leave that passes a limit in a step; return the number of events.

    With noise it may pass between two steps: as a Brownian bridge does.
    """
    c, h = s.exit_coordinate, s.step
    ahead, now = s.exit_limit - before, s.exit_limit - st.q[i, c]
    passes = now < 0.0
    if not passes and s.noise > 0.0:
        spread = 2.0 * s.noise * h * w.mobility[i, c, c]
        chance = np.exp(-2.0 * ahead * now / spread) if ahead > 0.0 else 1.0
        passes = uniform(s.seed, index, i * s.k * 2 + 1) < chance
    if passes:
        st.alive[i] = 0
        events = log_event(log, events, EXIT, i, -1, -1, t + h, 0.0)
    return events
