"""The list of pairs of bodies that may touch."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.records import IS_LISTED, LISTED, ROOM
from polycorner.motion.sweeping.rows import square_distance


@compiled
def sort_by(values, order, count):
    """Sort positions in an array by their values, and equal ones by number: a heap sort."""
    never_inline()
    for top in range(count // 2 - 1, -count, -1):
        start, end = top, count
        if top < 0:  # the largest, on top, moves to the end
            end = count + top
            order[0], order[end] = order[end], order[0]
            start = 0
        while 2 * start + 1 < end:
            child = 2 * start + 1
            if child + 1 < end and comes_before(values, order[child], order[child + 1]):
                child += 1
            if not comes_before(values, order[start], order[child]):
                break
            order[start], order[child] = order[child], order[start]
            start = child


@compiled
def comes_before(values, a, b):
    """Return whether one of two positions is the first."""
    return values[a] < values[b] or (values[a] == values[b] and a < b)


@compiled
def list_neighbours(s, st, w, x, room):
    """List the pairs within reach and some room; return whether there are places for them.

    Bodies are sorted along the first axis of their positions, and each is compared with those
    that follow within the distance.  The list is by bodies, so that steps do not depend on when it
    was made.
    """
    never_inline()
    N, axis, limit = s.bodies, 0 if s.position[0] >= 0 else 1, s.reach + room
    c, period, alive = s.position[axis], s.period[axis], 0
    for i in range(N):
        w.along[i] = np.inf
        if st.alive[i]:
            at = x[i, c] * s.units[c]
            w.along[i] = at - period * np.floor(at / period) if period < np.inf else at
            alive += 1
        w.order[i] = i
        for component in range(s.k):
            w.listed_at[i, component] = x[i, component]
    sort_by(w.along, w.order, N)
    count = 0
    for first in range(alive):
        i = w.order[first]
        for later in range(1, alive):
            at, turn = first + later, 0.0
            if at >= alive:
                if not period < np.inf:
                    break
                at, turn = at - alive, period
            j = w.order[at]
            if w.along[j] + turn - w.along[i] >= limit:
                break
            # In a short box a pair is met both ways round.
            if turn > 0.0 and w.along[i] - w.along[j] < limit:
                continue
            if square_distance(s, x, i, j) < limit * limit:
                if count >= w.pairs.shape[0]:
                    return False
                w.pairs[count, 0], w.pairs[count, 1] = min(i, j), max(i, j)
                count += 1
    order_pairs(w.pairs, count, N)
    w.status[LISTED], w.status[IS_LISTED], w.room[ROOM] = count, 1, room
    return True


@compiled
def order_pairs(pairs, count, N):
    """Sort pairs by their bodies: a heap sort in place."""
    never_inline()
    for top in range(count // 2 - 1, -count, -1):
        start, end = top, count
        if top < 0:
            end = count + top
            swap(pairs, 0, end)
            start = 0
        while 2 * start + 1 < end:
            child = 2 * start + 1
            if child + 1 < end and key_of_pair(pairs, child, N) < key_of_pair(pairs, child + 1, N):
                child += 1
            if key_of_pair(pairs, start, N) >= key_of_pair(pairs, child, N):
                break
            swap(pairs, start, child)
            start = child


@compiled
def key_of_pair(pairs, p, N):
    """Return the number by which pairs are sorted."""
    return pairs[p, 0] * N + pairs[p, 1]


@compiled
def swap(pairs, a, b):
    """Exchange two pairs."""
    pairs[a, 0], pairs[b, 0] = pairs[b, 0], pairs[a, 0]
    pairs[a, 1], pairs[b, 1] = pairs[b, 1], pairs[a, 1]


@compiled
def farthest(s, st, w, x):
    """Return how far positions are from where pairs were listed."""
    most = 0.0
    for i in range(s.bodies):
        if st.alive[i]:
            far = 0.0
            for axis in range(3):
                c = s.position[axis]
                if c >= 0:
                    far += ((x[i, c] - w.listed_at[i, c]) * s.units[c]) ** 2
            most = max(most, far)
    return np.sqrt(most)
