"""Attraction between bodies: forces along the gradients of gaps that are small.

A pair pulls with the force ``a min(1, 1 - g/d)`` while its gap ``g`` at the midpoint of the step is
below the range ``d``.  Where bodies touch this presses them on each other, so that the impulse of
the contact, and friction with it, bear the attraction.
"""

from polycorner.motion.engine.contact_list import takes_part_of
from polycorner.motion.engine.families import family_of
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.rows import row_times


@compiled
def forget_attraction(model, mid):
    """Begin a step, in which no attraction is known yet."""
    for i in range(model.bodies):
        for c in range(model.dimension):
            mid.attraction[i, c] = 0.0


@compiled
def attract(model, mid, pair, begin, end, h):
    """Add the attraction at the contacts in a range to the impulses on bodies; whether any."""
    k, K, found = model.dimension, model.lanes, False
    for s in range(begin, end):
        i, j = pair.contact[s, 0], pair.contact[s, 1]
        family, gap = family_of(model, i, j), pair.gap[s]
        pair.attraction[s] = 0.0
        if gap >= model.pair_range[family]:
            continue
        share = 1.0 - max(gap, 0.0) / model.pair_range[family]
        pair.attraction[s], found = h * model.pair_attraction[family] * share, True
        for c in range(k):
            mid.attraction[i, c] -= pair.attraction[s] * pair.gradient[s, c]
            mid.attraction[j, c] -= pair.attraction[s] * pair.gradient[s, K + c]
    return found


@compiled
def book_attraction(model, work, contacts, sums):
    """Book the work of the attraction at all contacts, at the mean velocities of both bodies."""
    pair, velocity = work.pair, work.velocity
    for s in range(contacts):
        i, j = pair.contact[s, 0], pair.contact[s, 1]
        if pair.attraction[s] > 0.0 and takes_part_of(work.body, i, j):
            at = 2 * s * model.lanes
            before = row_times(model, pair.gradient, at, velocity.old, i, j)
            after = row_times(model, pair.gradient, at, velocity.new, i, j)
            sums[model.attraction_account] -= pair.attraction[s] * 0.5 * (before + after)
