"""Assembly of the blocks of a step, and solution of its islands, by all threads."""

from polycorner.motion.engine.accounts import add_sums
from polycorner.motion.engine.arrays import CONTACTS, ISLANDS, SETTLED, SWEEPS
from polycorner.motion.engine.blocks import (
    assemble_body_blocks,
    assemble_contacts,
    respond_to_rows,
)
from polycorner.motion.engine.codes import (
    ADD,
    AGAIN,
    ASSEMBLE,
    BEGIN,
    BOOK,
    COMPACT,
    COUNT_GAPS,
    DETECT,
    DISTANCE,
    END,
    EVALUATE,
    ISLAND,
    JUDGE,
    OBSERVE,
    PREDICT,
    PRESS,
    SET_OFF,
    SOLVE,
    SPEED,
    START,
    STEP_INDEX,
    STORE,
    SWEEP,
    TIME,
)
from polycorner.motion.engine.contact_list import (
    forget_blocks,
    keep_contacts,
    list_blocks,
    mark_met,
    sort_contacts,
)
from polycorner.motion.engine.crowds import ABREAST, divide_blocks, is_crowd
from polycorner.motion.engine.curvature import correct_curvature
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import detect_all, detection_distance, order_contacts
from polycorner.motion.engine.partition import find_islands
from polycorner.motion.engine.phases import items_of, share_out, share_range
from polycorner.motion.engine.rows import apply_impulses
from polycorner.motion.engine.signals import increase
from polycorner.motion.engine.sizes import AT_ONCE

MOST_CORRECTIONS = 8  # solutions of a step, at most, for the curvature of equations


@compiled
def evaluate_bodies(model, state, work, h, time, index):
    """Evaluate all bodies that are not asleep."""
    work.told_times[TIME], work.told[STEP_INDEX] = time, index
    share_range(model, state, work, EVALUATE, model.bodies, h)


@compiled
def start_bodies(model, state, work, h):
    """Start all bodies from forces alone; return whether velocities and gaps are numbers."""
    work.finite[0] = 1
    share_range(model, state, work, START, model.bodies, h)
    return work.finite[0] != 0


@compiled
def detect_contacts(model, state, work, h, count):
    """Add the small gaps of all pairs with an awake body; return the contact count, or -1.

    Several threads count them first, so that it is known where which contact goes.
    """
    pairs, limit = work.list_status[0], detection_distance(model, work, h)
    if model.threads == 1 or pairs <= AT_ONCE:
        return detect_all(model, state, work, pairs, limit, h / model.step, count)
    work.told_times[DISTANCE] = limit
    share_range(model, state, work, COUNT_GAPS, pairs, h)
    for item in range(items_of(pairs)):
        more, work.found[item] = work.found[item], count
        count += more
    if count + state.counts[CONTACTS] > model.contact_room:
        return NONE
    share_range(model, state, work, DETECT, pairs, h)
    return count


@compiled
def assemble_blocks(model, state, work, h, contacts, ascending):
    """Assemble the blocks of awake bodies and of contacts, and their islands; return how many.

    Contacts that were all found at once are ``ascending``.
    """
    limit = work.told_times[DISTANCE] = detection_distance(model, work, h)
    share_range(model, state, work, PREDICT, model.bodies, h)
    first = assemble_body_blocks(model, state, work, h, limit)
    order_contacts(model, state, work, contacts, ascending)
    if work.located[0]:  # contacts have blocks only if they are closed
        blocks = assemble_contacts(model, state, work, h, ZERO, contacts, first)
    else:
        blocks = first + (1 + model.pair_laws) * contacts
        work.told[SET_OFF] = first
        share_range(model, state, work, ASSEMBLE, contacts, h)
    find_islands(model, work, blocks)
    start_blocks(model, work, blocks)
    return blocks


@compiled
def start_blocks(model, work, blocks):
    """Apply the impulses from which the solution of a step starts, except in crowds."""
    if model.crowd_sweeps == 0:
        for b in range(blocks):
            apply_impulses(model, work, b, work.impulse[b, 0], work.impulse[b, 1])
        return
    for i in range(model.bodies):
        if not is_crowd(model, work.island_start[i], work.island_start[i + 1]):
            for s in range(work.island_start[i], work.island_start[i + 1]):
                b = work.order[s]
                respond_to_rows(model, work, b)
                apply_impulses(model, work, b, work.impulse[b, 0], work.impulse[b, 1])


@compiled
def solve_islands(model, state, work, blocks, h, again):
    """Solve islands, perhaps ``again``; those whose gaps would close by curvature, twice.

    Equations are solved for until they hold at the next midpoint.  If forces depend on the
    velocity, that and curvature follow with them; see :func:`follow_curvature`.  Settled islands
    remain.  Crowds are swept once.
    """
    starts = work.island_start
    most = 2 if model.unilateral == model.restitution.size else MOST_CORRECTIONS
    if model.follows_velocity:
        most = 1
    for attempt in range(most):
        count = ZERO
        for i in range(model.bodies):
            if starts[i + 1] == starts[i] or work.stage[i] == SETTLED:
                continue
            if is_crowd(model, starts[i], starts[i + 1]):
                if attempt == 0:
                    sweep_crowd(model, state, work, i, h)
            elif attempt == 0 or work.curves_shut[i]:
                work.to_solve[count] = i
                count += 1
        work.told[AGAIN] = 1 if again or attempt > 0 else 0
        share_out(model, state, work, SOLVE, count)
        if attempt < most - 1 and not correct_curvature(model, state, work, blocks, h):
            break


@compiled
def sweep_crowd(model, state, work, i, h):
    """Sweep over the blocks of a crowd, which is not solved, as often as asked."""
    divide_blocks(model, state, work, work.island_start[i], work.island_start[i + 1], h)
    strips = work.strips[0]
    work.told[ISLAND] = i
    share_range(model, state, work, BEGIN, model.bodies, h)
    share_out(model, state, work, COMPACT, strips)
    speed = work.told_times[SPEED] = greatest(work.worst, strips)
    share_strips(model, state, work, PRESS, strips)
    for _ in range(model.crowd_sweeps):
        share_strips(model, state, work, SWEEP, strips)
    share_strips(model, state, work, JUDGE, strips)
    share_range(model, state, work, END, model.bodies, h)
    increase(state.counts, ISLANDS, ONE)
    increase(state.counts, SWEEPS, model.crowd_sweeps)
    work.island_residual[i] = greatest(work.worst, strips) / speed if speed > 0.0 else 0.0


@compiled
def greatest(values, count):
    """Return the greatest of the first numbers of an array, none of which is negative."""
    most = 0.0
    for t in range(count):
        most = max(most, values[t])
    return most


@compiled
def store_all_impulses(model, state, work, blocks, h):
    """Store the impulses of all blocks; see :func:`store_impulses`."""
    share_range(model, state, work, STORE, blocks, h)


@compiled
def observe(model, state, work, blocks, h, time):
    """Book the work of a step, and note what happened to its contacts."""
    work.told_times[TIME] = time
    forget_blocks(work, work.list_status[2])
    book(model, state, work, OBSERVE, blocks, h)
    book(model, state, work, BOOK, model.bodies, h)


@compiled
def book(model, state, work, kind, count, h):
    """Let the items of a phase book work, which does not depend on who does them."""
    share_range(model, state, work, kind, count, h)
    if count > AT_ONCE:
        add_sums(state, work, items_of(count))


@compiled
def list_contacts(model, state, work, log, h, time, count):
    """Update the list of contacts between bodies; return the number of events."""
    added = list_blocks(work, work.list_status[2])
    mark_met(state, work, work.list_status[2])
    kept, count = keep_contacts(model, state, work, log, h, time, count)
    work.told[SET_OFF] = kept
    share_range(model, state, work, ADD, added, h)
    state.counts[CONTACTS] = kept + added
    sort_contacts(model, state, kept + added)
    return count


@compiled
def share_strips(model, state, work, kind, strips):
    """Do what is asked for the strips of even number, and then for those of odd number."""
    for odd in range(2):
        work.told[SET_OFF] = odd
        count = (strips + 1 - odd) // 2
        if kind == SWEEP:
            count = (count + ABREAST - 1) // ABREAST
        share_out(model, state, work, kind, count)
