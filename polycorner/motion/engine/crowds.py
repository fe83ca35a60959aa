"""Islands of very many blocks, whose steps need not be solved: sweeps over strips of bodies.

The blocks of such an island are divided among parallel strips, at least as wide as bodies reach.
A block belongs to the first strip of its bodies, so that it acts on bodies of this strip and the
next one only: strips of even number, and those of odd number, can be swept side by side.  What
comes out depends on the strips, and not on how many threads there are.

A sweep goes to contact after contact with all others fixed, the strips of even number first, and
changes an impulse by more than would solve the contact (successive over-relaxation).  All sweeps go
the same way: backwards after forwards would begin with the strips that were swept last.  Contacts
have a compact form (:mod:`~polycorner.motion.engine.compact`).  After few sweeps a step is not
solved.  The method is
that of contact dynamics with a fixed number of iterations ([Unger]): as loads spread over a few
contacts in each sweep, a heap is a little soft, and it is the softer the deeper it is.  Overlaps
that result are taken away little by little, by changes of place.
"""

import numpy as np

from polycorner.motion.engine.codes import WATCHED
from polycorner.motion.engine.compact import (
    compact_contact,
    judge_contact,
    press_contact,
    relax_contact,
    separate_contact,
)
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import detection_distance, nearest
from polycorner.motion.engine.partition import is_pressed_by_former
from polycorner.motion.engine.sizes import STRIPS

CROWD = 1024  # blocks beyond which an island is a crowd
ABREAST = 4  # strips that take turns


@compiled
def is_crowd(model, first, last):
    """Return whether so many blocks are swept a few times only."""
    return model.crowd_sweeps > 0 and last - first > CROWD


@compiled
def place_of(model, work, i, axis):
    """Return a component of a body's position, as a length; zero if there is only the other.

    Where positions repeat it is between minus and plus half a period.
    """
    c = model.position[axis]
    if axis == 0 and model.position[1] == c:
        return 0.0
    return nearest(model, axis, work.q_mid[i, c] * model.units[c])


@compiled
def extent_of(model, state, work, axis):
    """Return the least component of all positions, and by how much the largest exceeds it.

    Where positions repeat, that is a period.  Where one is not finite, it is infinite.
    """
    if model.period[axis] < np.inf:
        return -0.5 * model.period[axis], model.period[axis]
    least, largest = np.inf, -np.inf
    for i in range(model.bodies):
        if state.alive[i]:
            x = place_of(model, work, i, axis)
            if not np.isfinite(x):
                return 0.0, np.inf
            least, largest = min(least, x), max(largest, x)
    return least, largest - least


@compiled
def divide_bodies(model, state, work, h):
    """Divide bodies among strips across the longer extent; return how many there are.

    Where positions repeat, the first strip follows the last one, and their number is even.
    """
    axis, least, extent = 0, 0.0, 0.0
    for a in range(2):
        low, length = extent_of(model, state, work, a)
        if length > extent:
            axis, least, extent = a, low, length
    reach = model.reach + detection_distance(model, work, h)
    strips = ONE
    if 0.0 < extent < np.inf:
        strips = max(ONE, min(np.int64(STRIPS), np.int64(extent / reach)))
    work.strips[1] = ZERO
    if model.period[axis] < np.inf and strips > 1:
        strips -= strips % 2
        work.strips[1] = ONE
    for i in range(model.bodies):
        work.body_strip[i] = 0
        if state.alive[i] and strips > 1:
            t = np.int64((place_of(model, work, i, axis) - least) / extent * strips)
            work.body_strip[i] = min(strips - 1, t)
    return strips


@compiled
def strip_of(work, i, j, strips):
    """Return the strip of a block that acts on these bodies, of which the second may be -1: none.

    It is the one that the other body's strip follows; -1 if they are not next to each other.
    """
    one = work.body_strip[i]
    two = one if j < 0 else work.body_strip[j]
    low, high = min(one, two), max(one, two)
    if high - low <= 1:
        return low
    return high if work.strips[1] and high - low == strips - 1 else NONE


@compiled
def sort_by_strip(work, count, strips):
    """Sort the first entries of ``work.unsorted``, whose strips are known, by these."""
    starts, cursor, target = work.strip_start, work.strip_cursor, work.compact_order
    for t in range(strips + 1):
        starts[t] = 0
    for s in range(count):
        starts[work.strip[s] + 1] += 1
    for t in range(strips):
        starts[t + 1] += starts[t]
        cursor[t] = starts[t]
    for s in range(count):
        t = work.strip[s]
        target[cursor[t]] = work.unsorted[s]
        cursor[t] += 1


@compiled
def divide_blocks(model, state, work, first, last, h):
    """Order the compact contacts of an island by strips, which start at ``work.strip_start``.

    Where bodies touch that are not near each other, there is a single strip.
    """
    count, s, apart = ZERO, first, False
    strips = divide_bodies(model, state, work, h)
    work.told[WATCHED] = 0
    while s < last:
        b, pressed = work.order[s], ZERO
        if s + 1 < last and work.order[s + 1] == b + 1 and is_pressed_by_former(work, b + 1):
            pressed = ONE
        if work.block_rows[b] > 0:
            work.told[WATCHED] = 1
        t = strip_of(work, work.block_bodies[b, 0], work.block_bodies[b, 1], strips)
        work.unsorted[count], work.strip[count], apart = 2 * b + pressed, t, apart or t < 0
        count += 1
        s += 1 + pressed
    work.strips[0] = ONE if apart else strips
    for t in range(count if apart else ZERO):
        work.strip[t] = ZERO
    sort_by_strip(work, count, work.strips[0])


@compiled
def compact_strip(model, state, work, t):
    """Write the compact contacts of a strip; return the largest velocity of their rows."""
    speed = 0.0
    for r in range(work.strip_start[t], work.strip_start[t + 1]):
        code = work.compact_order[r]
        speed = max(speed, compact_contact(model, state, work, r, code // 2, code % 2 == 1))
    return speed


@compiled
def press_strip(model, work, t):
    """Apply the impulses from which a step starts."""
    for r in range(work.strip_start[t], work.strip_start[t + 1]):
        press_contact(model, work, r)


@compiled
def sweep_strips(model, work, item, odd):
    """Solve the contacts of a few strips of even or of odd number one after the other.

    The strips take turns, contact by contact: as nothing in one waits for another, the processor
    works on several at once.
    """
    starts, longest, begin = work.strip_start, ZERO, 2 * ABREAST * item + odd
    end = min(begin + 2 * ABREAST, work.strips[0])
    for t in range(begin, end, 2):
        longest = max(longest, starts[t + 1] - starts[t])
    for s in range(longest):
        for t in range(begin, end, 2):
            if s < starts[t + 1] - starts[t]:
                relax_contact(model, work, starts[t] + s)


@compiled
def judge_strip(model, work, t):
    """Move bodies apart that overlap in a strip, and return its residual."""
    worst = 0.0
    for r in range(work.strip_start[t], work.strip_start[t + 1]):
        separate_contact(model, work, r)
        worst = max(worst, judge_contact(model, work, r))
    return worst
