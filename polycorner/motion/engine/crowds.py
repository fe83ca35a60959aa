"""Islands of very many blocks, whose steps need not be solved: sweeps over strips of bodies.

The blocks of such an island are divided among parallel strips, at least as wide as bodies reach.
A block belongs to the first strip of its bodies, so that it acts on bodies of this strip and the
next one only: strips of even number, and those of odd number, can be swept side by side.  What
comes out depends on the strips, and not on how many threads there are.

A sweep goes to contact after contact with all others fixed, the strips of even number first, and
changes an impulse by more than would solve the contact (successive over-relaxation).  All sweeps go
the same way: backwards after forwards would begin with the strips that were swept last.  Contacts
have a compact form (:mod:`~polycorner.motion.engine.compact`).  After few sweeps a step is not
solved.  The method is that of contact dynamics with a fixed number of iterations ([Unger]): as
loads spread over a few contacts in each sweep, a heap is a little soft, and it is the softer the
deeper it is.  Overlaps that result are taken away little by little, by changes of place.

Contacts are listed, detected, assembled and booked pair by pair, in the order of the *ranks* of
their bodies.  Where this is an order in space, what one phase of a step writes the next one reads
in the same order, and no cache has to hold all of it.  Bodies mix: ranks are renewed from time to
time, in steps that their numbers tell, so that motions that were saved and loaded remain the same.
"""

import numpy as np

from polycorner.motion.engine import codes
from polycorner.motion.engine.arrays import AROUND, BOUNCES, CONTACTS, STRIPS, WATCHED
from polycorner.motion.engine.compact import (
    compact_contact,
    compress_contact,
    gain_contact,
    judge_contact,
    keep_contact,
    mix_contact,
    press_contact,
    relax_contact,
    separate_contact,
)
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import (
    bodies_of,
    component,
    detection_distance,
    heap_sort,
    key_of,
    nearest,
)
from polycorner.motion.engine.partition import is_pressed_by_former
from polycorner.motion.engine.sizes import MOST_STRIPS

CROWD = 1024  # blocks beyond which an island is a crowd
ABREAST = 4  # strips that take turns
PERIOD = 128  # steps for which ranks hold
COLUMNS, LEVELS = 1024, 2**20  # across the longer extent, at most; along each of them


@compiled
def is_crowd(model, first, last):
    """Return whether so many blocks are swept a few times only."""
    return model.crowd_sweeps > 0 and last - first > CROWD


@compiled
def place_of(model, mid, i, axis):
    """Return a component of a body's position, as a length; zero if there is none.

    Where positions repeat it is between minus and plus half a period.
    """
    return nearest(model, axis, component(model, mid.q, i, axis))


@compiled
def extent_of(model, state, mid, axis):
    """Return the least component of all positions, and by how much the largest exceeds it.

    Where positions repeat, that is a period.  Where one is not finite, it is infinite.
    """
    if model.period[axis] < np.inf:
        return -0.5 * model.period[axis], model.period[axis]
    least, largest = np.inf, -np.inf
    for i in range(model.bodies):
        if state.alive[i]:
            x = place_of(model, mid, i, axis)
            # Strips of an infinite extent cannot be numbered; the step then ends with a reason.
            if not np.isfinite(x):
                return 0.0, np.inf
            least, largest = min(least, x), max(largest, x)
    return least, largest - least


@compiled
def divide_bodies(model, state, mid, body, crowd, h):
    """Divide bodies among strips across the longer extent; return how many there are.

    Where positions repeat, the first strip follows the last one, and their number is even.
    """
    axis, least, extent = 0, 0.0, 0.0
    for a in range(2):
        low, length = extent_of(model, state, mid, a)
        if length > extent:
            axis, least, extent = a, low, length
    reach = model.reach + detection_distance(model, body, h)
    strips = ONE
    if 0.0 < extent < np.inf:
        strips = max(ONE, min(np.int64(MOST_STRIPS), np.int64(extent / reach)))
    crowd.strips[AROUND] = ZERO
    if model.period[axis] < np.inf and strips > 1:
        # The first strip follows the last, and two of odd number must not be next to each other.
        strips -= strips % 2
        crowd.strips[AROUND] = ONE
    for i in range(model.bodies):
        crowd.body_strip[i] = 0
        if state.alive[i] and strips > 1:
            t = np.int64((place_of(model, mid, i, axis) - least) / extent * strips)
            crowd.body_strip[i] = min(strips - 1, t)
    return strips


@compiled
def strip_of(crowd, i, j, strips):
    """Return the strip of a block that acts on these bodies, of which the second may be -1: none.

    It is the one that the other body's strip follows; -1 if they are not next to each other.
    """
    one = crowd.body_strip[i]
    two = one if j < 0 else crowd.body_strip[j]
    low, high = min(one, two), max(one, two)
    # Of the two strips that a block touches the lower one does it, so that blocks of even strips
    # share no body.
    if high - low <= 1:
        return low
    return high if crowd.strips[AROUND] and high - low == strips - 1 else NONE


@compiled
def sort_by_strip(island, crowd, count, strips):
    """Sort the first entries of ``island.unsorted``, whose strips are known, by these."""
    starts, cursor, target = crowd.strip_start, crowd.strip_cursor, crowd.order
    for t in range(strips + 1):
        starts[t] = 0
    for s in range(count):
        starts[crowd.strip[s] + 1] += 1
    for t in range(strips):
        starts[t + 1] += starts[t]
        cursor[t] = starts[t]
    for s in range(count):
        t = crowd.strip[s]
        target[cursor[t]] = island.unsorted[s]
        cursor[t] += 1


@compiled
def divide_blocks(model, state, work, first, last, h):
    """Order the compact contacts of an island by strips, which start at ``crowd.strip_start``.

    Where bodies touch that are not near each other, there is a single strip.
    """
    island, block, crowd = work.island, work.block, work.crowd
    count, s, apart = ZERO, first, False
    strips = divide_bodies(model, state, work.mid, work.body, crowd, h)
    crowd.strips[WATCHED] = crowd.strips[BOUNCES] = 0
    while s < last:
        b, pressed = block.order[s], ZERO
        # A contact and its friction are relaxed one after the other: together they read their
        # bodies once.
        if s + 1 < last and block.order[s + 1] == b + 1 and is_pressed_by_former(block, b + 1):
            pressed = ONE
        if block.rows[b] > 0:
            crowd.strips[WATCHED] = 1
        elif block.bounces[b]:
            crowd.strips[BOUNCES] = 1
        t = strip_of(crowd, block.bodies[b, 0], block.bodies[b, 1], strips)
        island.unsorted[count], crowd.strip[count], apart = 2 * b + pressed, t, apart or t < 0
        count += 1
        s += 1 + pressed
    # A block between strips that are apart would be swept by two threads: then one strip holds all.
    crowd.strips[STRIPS] = ONE if apart else strips
    for t in range(count if apart else ZERO):
        crowd.strip[t] = ZERO
    sort_by_strip(island, crowd, count, crowd.strips[STRIPS])


@compiled
def compact_strip(model, state, work, t):
    """Write the compact contacts of a strip; return the largest velocity of their rows."""
    crowd = work.crowd
    speed = 0.0
    for r in range(crowd.strip_start[t], crowd.strip_start[t + 1]):
        code = crowd.order[r]
        speed = max(speed, compact_contact(model, state, work, r, code // 2, code % 2 == 1))
    return speed


@compiled
def press_strip(model, crowd, t):
    """Apply the impulses from which a step starts."""
    for r in range(crowd.strip_start[t], crowd.strip_start[t + 1]):
        press_contact(model, crowd, r)


@compiled
def sweep_strips(model, block, crowd, scratch, item, odd):
    """Solve the contacts of a few strips of even or of odd number one after the other.

    The strips take turns, contact by contact: as nothing in one waits for another, the processor
    works on several at once.
    """
    starts, longest, begin = crowd.strip_start, ZERO, 2 * ABREAST * item + odd
    end = min(begin + 2 * ABREAST, crowd.strips[STRIPS])
    for t in range(begin, end, 2):
        longest = max(longest, starts[t + 1] - starts[t])
    for s in range(longest):
        for t in range(begin, end, 2):
            if s < starts[t + 1] - starts[t]:
                relax_contact(model, block, crowd, scratch, starts[t] + s)


@compiled
def judge_strip(model, block, crowd, scratch, t):
    """Move bodies apart that overlap in a strip.

    Return its residual, and the block of a contact that is sunk in, or -1.
    """
    worst, sunk = 0.0, NONE
    for r in range(crowd.strip_start[t], crowd.strip_start[t + 1]):
        if separate_contact(model, crowd, r):
            sunk = crowd.order[r] // 2
        worst = max(worst, judge_contact(model, block, crowd, scratch, r))
    return worst, sunk


@compiled
def gain_strip(block, crowd, t):
    """Return the work of the contacts of a strip, which were judged."""
    work = 0.0
    for r in range(crowd.strip_start[t], crowd.strip_start[t + 1]):
        work += gain_contact(block, crowd, r)
    return work


@compiled
def change_strip(block, crowd, t, kind, share):
    """Let the contacts of a strip be plastic, keep their impulses as such, or mix these."""
    for r in range(crowd.strip_start[t], crowd.strip_start[t + 1]):
        if kind == codes.COMPRESS:
            compress_contact(block, crowd, r)
        elif kind == codes.KEEP:
            keep_contact(block.compressed, block, crowd, r)
        else:
            mix_contact(block, crowd, r, share)


@compiled
def renew_ranks(model, state, manner, mid, neighbours, pair, index):
    """Rank bodies by columns across the longer extent if this is the step for it."""
    if model.crowd_sweeps == 0 or manner.located[0] or index % PERIOD != 0:
        return
    least, extent = extent_of(model, state, mid, 0)
    low, height = extent_of(model, state, mid, 1)
    axis = 0 if extent > height else 1
    if axis == 1:
        least, extent, low, height = low, height, least, extent
    if not 0.0 < extent < np.inf or not height < np.inf:
        return
    columns, N = max(1, min(COLUMNS, np.int64(extent / model.reach))), model.bodies
    for i in range(N):
        # Bodies that have left come last.
        column, level = columns, np.int64(0)
        if state.alive[i]:
            column = np.int64((place_of(model, mid, i, axis) - least) / extent * columns)
            if height > 0.0:
                up = (place_of(model, mid, i, 1 - axis) - low) / height
                level = np.int64(up * (LEVELS - 1))
        pair.sort_keys[i] = (column * LEVELS + level) * N + i
    heap_sort(pair.sort_keys, N)
    remember_contacts(model, state, pair)
    for s in range(N):
        i = pair.sort_keys[s] % N
        state.rank[i], state.body_of_rank[s] = s, i
    sort_remembered(model, state, pair)
    neighbours.status[1] = 0


@compiled
def remember_contacts(model, state, pair):
    """Copy the contacts of the last step to where those of this step are going to be."""
    for s in range(state.counts[CONTACTS]):
        i, j = bodies_of(model, state, s)
        pair.contact[s, 0], pair.contact[s, 1] = i, j
        pair.contact[s, 2] = state.keys[s] % model.most_pair_gaps
        pair.gap[s] = state.pair_release[s]
        pair.before[s] = 2 * state.pair_flags[s, 0] + state.pair_flags[s, 1]
        for a in range(state.pair_impulse.shape[1]):
            pair.impulse[s, a] = state.pair_impulse[s, a]
        for a in range(2 * model.dimension):
            pair.gradient[s, a] = state.pair_action[s, a]


@compiled
def sort_remembered(model, state, pair):
    """Write the contacts of the last step in the order of the new ranks."""
    count, keys = state.counts[CONTACTS], pair.sort_keys
    for s in range(count):
        keys[s] = key_of(model, state, pair, s) * count + s
    heap_sort(keys, count)
    for t in range(count):
        s = keys[t] % count
        state.keys[t], state.pair_release[t] = keys[t] // count, pair.gap[s]
        state.pair_flags[t, 0] = pair.before[s] // 2
        state.pair_flags[t, 1] = pair.before[s] % 2
        for a in range(state.pair_impulse.shape[1]):
            state.pair_impulse[t, a] = pair.impulse[s, a]
        for a in range(2 * model.dimension):
            state.pair_action[t, a] = pair.gradient[s, a]
