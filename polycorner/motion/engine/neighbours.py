"""Detection of contacts between bodies that are neighbours."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import CONTACTS
from polycorner.motion.engine.evaluation import evaluate_pair
from polycorner.motion.engine.families import family_of, kind_of, pair_inputs
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled


@compiled
def position_of(model, state, i, a, time):
    """Return one component of a body's position, as a length, relative to the moving substrate.

    It is zero where there is none.
    """
    c = model.position[kind_of(model, i), a]
    if c < 0:
        return 0.0
    x = state.q[i, c] * model.units[kind_of(model, i), c]
    return x - model.substrate_speed * time if a == 0 else x


@compiled
def nearest(model, a, x):
    """Return a difference of positions to the nearest image."""
    period = model.period[a]
    return x - period * np.floor(x / period + 0.5) if period < np.inf else x


@compiled
def heap_sort(values, count):
    """Sort the first ``count`` numbers of an array in place."""
    never_inline()
    for top in range(count // 2 - 1, -count, -1):
        start, end = top, count
        # Both phases of the sort in one loop: negative numbers count what is left of the heap.
        if top < 0:  # the largest, on top, moves to the end
            end = count + top
            values[0], values[end] = values[end], values[0]
            start = 0
        while 2 * start + 1 < end:
            child = 2 * start + 1
            if child + 1 < end and values[child + 1] > values[child]:
                child += 1
            if values[start] >= values[child]:
                break
            values[start], values[child] = values[child], values[start]
            start = child


@compiled
def pair_key(model, state, i, j):
    """Return the number by which pairs of bodies are sorted: by the lower rank, then the higher."""
    one, two = state.rank[i], state.rank[j]
    return min(one, two) * model.bodies + max(one, two)


@compiled
def pair_of(model, state, key):
    """Return the bodies of a pair, the one with the lower number first."""
    one, two = state.body_of_rank[key // model.bodies], state.body_of_rank[key % model.bodies]
    return min(one, two), max(one, two)


@compiled
def bodies_of(model, state, s):
    """Return the bodies of a contact of the last step, the one with the lower number first."""
    return pair_of(model, state, state.keys[s] // model.most_pair_gaps)


@compiled
def is_near(model, state, mid, body, neighbours, s, limit):
    """Return whether a pair with an awake body may meet, and was not examined in this step yet.

    Bodies that wait are where they were, or already where they will be: nothing meets them.
    """
    a, b = neighbours.pairs[s, 0], neighbours.pairs[s, 1]
    if neighbours.examined[s] or not (body.awake[a] or body.awake[b]):
        return False
    # Set before the pair is refused, too: whoever wakes later in this step must not find the pair
    # again, and a gap that is not known counts as zero.
    neighbours.examined[s], neighbours.least_gap[s] = 1, 0.0
    if not (state.alive[a] and state.alive[b]) or body.waits[a] or body.waits[b]:
        return False
    reach = model.pair_reach[family_of(model, a, b)]
    return square_distance(model, mid, a, b) < (reach + limit) ** 2


@compiled
def count_gaps(model, mid, neighbours, scratch, slot, limit):
    """Return how many gaps of a pair are small; the least of all is kept."""
    count, least = ZERO, np.inf
    a, b = neighbours.pairs[slot, 0], neighbours.pairs[slot, 1]
    evaluate_pair(model, scratch, a, b, mid.q, limit)
    family = family_of(model, a, b)
    n = pair_inputs(model, family)
    for g in range(model.pair_gaps[family]):
        gap = scratch.values[n + g]
        count, least = count + (ONE if gap < limit else ZERO), min(least, gap)
    # Also where it is not small: pairs that stay apart are excluded by it from looking ahead.
    neighbours.least_gap[slot] = least
    return count


@compiled
def count_range(model, state, mid, body, neighbours, scratch, begin, end, limit):
    """Count the small gaps of some pairs; return how many there are."""
    count = ZERO
    for s in range(begin, end):
        near = is_near(model, state, mid, body, neighbours, s, limit)
        neighbours.meets[s] = (
            count_gaps(model, mid, neighbours, scratch, s, limit) if near else ZERO
        )
        count += neighbours.meets[s]
    return count


@compiled
def detect_counted(model, state, mid, neighbours, pair, scratch, begin, end, limit, share, count):
    """Add the small gaps of some pairs, which were counted, to the contacts after so many."""
    cursor = NONE
    for s in range(begin, end):
        if neighbours.meets[s]:
            count, cursor = detect_pair(
                model, state, mid, neighbours, pair, scratch, s, limit, share, count, cursor
            )


@compiled
def detect_all(model, state, work, pairs, limit, share, count):
    """Add the small gaps of all pairs to the contacts; return the contact count, or -1 if full."""
    mid, neighbours, pair, scratch = work.mid, work.neighbours, work.pair, work.scratch
    cursor = NONE
    for s in range(pairs):
        if is_near(model, state, mid, work.body, neighbours, s, limit):
            count, cursor = detect_pair(
                model, state, mid, neighbours, pair, scratch, s, limit, share, count, cursor
            )
            if count < 0:
                return NONE
    return count


@compiled
def detect_pair(model, state, mid, neighbours, pair, scratch, slot, limit, share, count, cursor):
    """Add the small gaps of a pair to the contacts; return the contact count, or -1 if full.

    The least of all its gaps is kept.  The cursor, which is returned as well, goes with the pairs
    through the list of the last step; both ascend.
    """
    a, b, least = neighbours.pairs[slot, 0], neighbours.pairs[slot, 1], np.inf
    K, values, family = model.lanes, scratch.values, family_of(model, a, b)
    read, n, m = model.first_read[family], pair_inputs(model, family), model.pair_gaps[family]
    evaluate_pair(model, scratch, a, b, mid.q, limit)
    for g in range(m):
        least = min(least, values[n + g])
        if values[n + g] < limit:
            # contacts between sleepers, which are kept, need room as well
            if count + state.counts[CONTACTS] >= model.contact_room:
                return NONE, cursor
            pair.contact[count, 0], pair.contact[count, 1], pair.contact[count, 2] = a, b, g
            pair.gap[count] = values[n + g]
            # Pairs ascend, and so do keys: one pass through the list of the last step finds all of
            # them.
            key = pair_key(model, state, a, b) * model.most_pair_gaps + g
            cursor = place_among(state, key) if cursor < 0 else advanced(state, cursor, key)
            index = cursor if has_key(state, cursor, key) else NONE
            pair.before[count] = index
            for c in range(state.pair_impulse.shape[1]):
                before = state.pair_impulse[index, c] if index >= 0 else 0.0
                pair.impulse[count, c] = before * share
            for c in range(2 * K):
                pair.gradient[count, c] = 0.0
            for r in range(n):
                c = model.pair_reads[read + r, 0] * K + model.pair_reads[read + r, 1]
                pair.gradient[count, c] = values[n + m + g * n + r]
            count += 1
    neighbours.least_gap[slot] = least
    return count, cursor


@compiled
def speed_of(model, v, i):
    """Return a bound of the speed of a body's points, relative to the moving substrate."""
    kind, speed = kind_of(model, i), 0.0
    for c in range(model.dimension):
        carried = model.substrate_speed if c == model.substrate_coordinate[kind] else 0.0
        speed += abs(v[i, c] * model.units[kind, c] - carried)
    return speed


@compiled
def travel(model, body, h):
    """Return how far the fastest body may move in a step."""
    fastest = 0.0
    for i in range(model.bodies):
        # Sleepers keep the speed that they had when they fell asleep.
        if body.awake[i]:
            fastest = max(fastest, body.speed[i])
    return h * fastest


@compiled
def detection_distance(model, body, h):
    """Return the gap up to which contacts are detected: any body may be hit by the fastest."""
    # Twice: for the way to the midpoint after this one, and for a body that comes the other way.
    return model.detection + 2.0 * travel(model, body, h)


@compiled
def component(model, of, i, d):
    """Return a component of a body's position or velocity, as a length; zero if there is none."""
    c = model.position[kind_of(model, i), d]
    return of[i, c] * model.units[kind_of(model, i), c] if c >= 0 else 0.0


@compiled
def square_distance(model, mid, a, b):
    """Return the squared distance of two bodies' positions at the midpoint."""
    far = 0.0
    for d in range(3):
        far += nearest(model, d, component(model, mid.q, a, d) - component(model, mid.q, b, d)) ** 2
    return far


@compiled
def find_contact(state, key):
    """Return the index of a contact in the sorted list of the last step, or -1."""
    place = place_among(state, key)
    return place if has_key(state, place, key) else NONE


@compiled
def place_among(state, key):
    """Return the index of the first contact of the last step whose key is not less than this."""
    low, high = ZERO, state.counts[CONTACTS]
    while low < high:
        middle = (low + high) // 2
        if state.keys[middle] < key:
            low = middle + ONE
        else:
            high = middle
    return low


@compiled
def advanced(state, place, key):
    """Return the same as :func:`place_among`, from a place that is not beyond it."""
    while place < state.counts[CONTACTS] and state.keys[place] < key:
        place += ONE
    return place


@compiled
def has_key(state, place, key):
    """Return whether the contact of the last step at an index has this key."""
    return place < state.counts[CONTACTS] and state.keys[place] == key


@compiled
def key_of(model, state, pair, slot):
    """Return the key of a contact between bodies: a number that sorts by bodies and gap."""
    a, b, g = pair.contact[slot, 0], pair.contact[slot, 1], pair.contact[slot, 2]
    return pair_key(model, state, a, b) * model.most_pair_gaps + g


@compiled
def order_contacts(model, state, pair, contacts, ascending):
    """Order contacts by key, if they are not ``ascending``: they were not all found at once."""
    keys = pair.sort_keys
    for s in range(contacts):
        pair.ranked[s] = s
    if ascending:
        return
    for s in range(contacts):
        # The index is the last digit of the key, so that the sort carries it along.
        keys[s] = key_of(model, state, pair, s) * contacts + s
    heap_sort(keys, contacts)
    for s in range(contacts):
        pair.ranked[s] = keys[s] % contacts
