"""Assembly of the blocks of a step, and solution of its islands, by all threads."""

from polycorner.motion.engine import codes
from polycorner.motion.engine.accounts import add_sums
from polycorner.motion.engine.arrays import (
    BOUNCES,
    CONTACTS,
    ISLANDS,
    PLASTIC,
    SETTLED,
    STRIPS,
    SWEEPS,
    UNPROJECTED,
)
from polycorner.motion.engine.attraction import book_attraction
from polycorner.motion.engine.blocks import (
    assemble_body_blocks,
    assemble_contacts,
    place_blocks,
    respond_to_rows,
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
from polycorner.motion.engine.impacts import share_without_gain
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.limit_blocks import assemble_limits
from polycorner.motion.engine.mean_slip import act_at_end
from polycorner.motion.engine.neighbours import detect_all, detection_distance, order_contacts
from polycorner.motion.engine.partition import find_islands, is_large
from polycorner.motion.engine.phases import items_of, share_out, share_range
from polycorner.motion.engine.rows import apply_impulses
from polycorner.motion.engine.signals import increase
from polycorner.motion.engine.sizes import AT_ONCE
from polycorner.motion.engine.tie_blocks import assemble_ties, evaluate_ties, predict_ties

MOST_CORRECTIONS = 8  # solutions of a step, at most, for the curvature of equations


@compiled
def evaluate_bodies(model, state, work, h, time, index):
    """Evaluate all bodies that are not asleep."""
    shared = work.shared
    shared.times[codes.TIME], shared.told[codes.STEP_INDEX] = time, index
    share_range(model, state, work, codes.EVALUATE, model.bodies, h)
    if model.ties > 0:
        evaluate_ties(model, state, work, h, time)


@compiled
def start_bodies(model, state, work, h):
    """Start all bodies from forces alone; return whether velocities and gaps are numbers."""
    shared = work.shared
    shared.finite[0] = 1
    share_range(model, state, work, codes.START, model.bodies, h)
    return shared.finite[0] != 0


@compiled
def detect_contacts(model, state, work, h, count):
    """Add the small gaps of all pairs with an awake body; return the contact count, or -1.

    Several threads count them first, so that it is known where which contact goes.
    """
    shared = work.shared
    pairs, limit = work.neighbours.status[0], detection_distance(model, work.body, h)
    if model.threads == 1 or pairs <= AT_ONCE:
        return detect_all(model, state, work, pairs, limit, h / model.step, count)
    shared.times[codes.DISTANCE] = limit
    share_range(model, state, work, codes.COUNT_GAPS, pairs, h)
    for item in range(items_of(pairs)):
        more, shared.found[item] = shared.found[item], count
        count += more
    # Contacts of sleepers, which are kept, need room as well.
    if count + state.counts[CONTACTS] > model.contact_room:
        return NONE
    share_range(model, state, work, codes.DETECT, pairs, h)
    return count


@compiled
def assemble_blocks(model, state, work, h, contacts, ascending):
    """Assemble the blocks of awake bodies and of contacts, and their islands; return how many.

    Contacts that were all found at once are ``ascending``.
    """
    body, shared = work.body, work.shared
    limit = shared.times[codes.DISTANCE] = detection_distance(model, body, h)
    share_range(model, state, work, codes.PREDICT, model.bodies, h)
    own = assemble_body_blocks(model, state, work, h, limit)
    if model.limits > 0:
        own = assemble_limits(model, state, work, h, own)
    first = own
    if model.ties > 0:
        first = assemble_ties(model, state, work, h, limit, own)
    order_contacts(model, state, work.pair, contacts, ascending)
    if work.manner.located[0]:  # contacts have blocks only if they are closed
        blocks = assemble_contacts(model, state, work, h, ZERO, contacts, first)
    else:
        # Every contact has all its blocks, so that threads know where theirs begin.
        blocks = place_blocks(model, work.pair, contacts, first)
        share_range(model, state, work, codes.ASSEMBLE, contacts, h)
    find_islands(model, body, work.island, work.block, blocks)
    start_blocks(model, work, blocks)
    if model.ties > 0:
        predict_ties(model, work, own, first, h)
    return blocks


@compiled
def start_blocks(model, work, blocks):
    """Apply the impulses from which the solution of a step starts, except in crowds."""
    velocity, island, block = work.velocity, work.island, work.block
    for i in range(model.bodies):
        if is_large(island, i):
            act_at_end(block, island.start[i], island.start[i + 1])
    if model.crowd_sweeps == 0:
        for b in range(blocks):
            apply_impulses(model, velocity, block, b, block.impulse[b, 0], block.impulse[b, 1])
        return
    for i in range(model.bodies):
        if not is_crowd(model, island.start[i], island.start[i + 1]):
            for s in range(island.start[i], island.start[i + 1]):
                b = block.order[s]
                respond_to_rows(model, work.mid, work.body, block, b)
                apply_impulses(model, velocity, block, b, block.impulse[b, 0], block.impulse[b, 1])


@compiled
def solve_islands(model, state, work, blocks, h, again):
    """Solve islands, perhaps ``again``; those whose gaps would close by curvature, twice.

    Equations are solved for until they hold at the next midpoint.  If forces depend on the
    velocity, that and curvature follow with them; see :func:`follow_curvature`.  Settled islands
    remain.  Crowds are swept once.
    """
    island, shared = work.island, work.shared
    starts = island.start
    most = 2 if model.equations == 0 and model.ties == 0 else MOST_CORRECTIONS
    if model.follows_velocity:
        most = 1
    for attempt in range(most):
        count = ZERO
        for i in range(model.bodies):
            if starts[i + 1] == starts[i] or island.stage[i] == SETTLED:
                continue
            if is_crowd(model, starts[i], starts[i + 1]):
                if attempt == 0:
                    sweep_crowd(model, state, work, i, h)
            elif attempt == 0 or island.curves_shut[i]:
                shared.to_solve[count] = i
                count += 1
        shared.told[codes.AGAIN] = 1 if again or attempt > 0 else 0
        share_out(model, state, work, codes.SOLVE, count)
        if attempt < most - 1 and not correct_curvature(model, state, work, blocks, h):
            break


@compiled
def sweep_crowd(model, state, work, i, h):
    """Sweep over the blocks of a crowd, which is not solved, as often as asked.

    It bounces by Newton's law, whatever the law of impact, and gains no energy by that; see
    :func:`limit_crowd`.
    """
    island, shared, crowd = work.island, work.shared, work.crowd
    divide_blocks(model, state, work, island.start[i], island.start[i + 1], h)
    strips = crowd.strips[STRIPS]
    shared.told[codes.ISLAND] = i
    share_range(model, state, work, codes.BEGIN, model.bodies, h)
    share_out(model, state, work, codes.COMPACT, strips)
    speed = shared.times[codes.SPEED] = greatest(shared.worst, strips)
    share_strips(model, state, work, codes.PRESS, strips)
    worst = sweep_all(model, state, work, strips)
    if crowd.strips[BOUNCES] and model.impact not in (UNPROJECTED, PLASTIC):
        worst = max(worst, limit_crowd(model, state, work, strips, h))
    share_range(model, state, work, codes.END, model.bodies, h)
    island.sunk[i] = NONE
    for t in range(strips):
        if shared.sunk[t] >= 0:
            island.sunk[i] = shared.sunk[t]
    increase(state.counts, ISLANDS, ONE)
    island.residual[i] = worst / speed if speed > 0.0 else 0.0


@compiled
def sweep_all(model, state, work, strips):
    """Sweep over all strips as often as asked; return the residual."""
    for _ in range(model.crowd_sweeps):
        share_strips(model, state, work, codes.SWEEP, strips)
    increase(state.counts, SWEEPS, model.crowd_sweeps)
    share_strips(model, state, work, codes.JUDGE, strips)
    return greatest(work.shared.worst, strips)


@compiled
def limit_crowd(model, state, work, strips, h):
    """Take back what bounces in a crowd gain; return the residual of the compression.

    As in :func:`~polycorner.motion.engine.island.limit_island`: impulses are mixed with those of
    sweeps in which contacts are plastic, such that contacts and friction do no work.
    """
    whole = gain_of_crowd(model, state, work, strips)
    if not whole > 0.0:
        return 0.0
    share_out(model, state, work, codes.COMPRESS, strips)
    share_range(model, state, work, codes.BEGIN, model.bodies, h)
    worst = sweep_all(model, state, work, strips)
    share_out(model, state, work, codes.KEEP, strips)
    lost, s = gain_of_crowd(model, state, work, strips), 1.0
    if whole > max(0.0, lost):
        half = mix_crowd(model, state, work, strips, h, 0.5)
        s = share_without_gain(lost, half, whole)
    mix_crowd(model, state, work, strips, h, s)
    return worst


@compiled
def gain_of_crowd(model, state, work, strips):
    """Return the work of the contacts of a crowd, which were judged."""
    share_out(model, state, work, codes.GAIN, strips)
    total = 0.0
    for t in range(strips):
        total += work.shared.gained[t]
    return total


@compiled
def mix_crowd(model, state, work, strips, h, share):
    """Set impulses between those of the compression and those of the whole; return their work."""
    work.shared.times[codes.SHARE] = share
    share_out(model, state, work, codes.MIX, strips)
    share_range(model, state, work, codes.BEGIN, model.bodies, h)
    share_strips(model, state, work, codes.PRESS, strips)
    share_strips(model, state, work, codes.JUDGE, strips)
    return gain_of_crowd(model, state, work, strips)


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
    share_range(model, state, work, codes.STORE, blocks, h)


@compiled
def observe(model, state, work, blocks, h, time):
    """Book the work of a step, and note what happened to its contacts."""
    work.shared.times[codes.TIME] = time
    # An open contact has no block in a part of a step, and must not keep that of the part before.
    forget_blocks(work.pair, work.neighbours.status[2])
    book(model, state, work, codes.OBSERVE, blocks, h)
    book(model, state, work, codes.BOOK, model.bodies, h)
    if model.attracts:
        book_attraction(model, work, work.neighbours.status[2], state.sums)


@compiled
def book(model, state, work, kind, count, h):
    """Let the items of a phase book work, which does not depend on who does them."""
    share_range(model, state, work, kind, count, h)
    if count > AT_ONCE:
        add_sums(state, work.shared, items_of(count))


@compiled
def list_contacts(model, state, work, log, h, time, count):
    """Update the list of contacts between bodies; return the number of events."""
    neighbours, pair = work.neighbours, work.pair
    added = list_blocks(pair, neighbours.status[2])
    mark_met(state, pair, neighbours.status[2])
    kept, count = keep_contacts(model, state, work.body, pair, log, h, time, count)
    work.shared.told[codes.SET_OFF] = kept
    share_range(model, state, work, codes.ADD, added, h)
    state.counts[CONTACTS] = kept + added
    sort_contacts(model, state, kept + added)
    return count


@compiled
def share_strips(model, state, work, kind, strips):
    """Do what is asked for the strips of even number, and then for those of odd number."""
    for odd in range(2):
        work.shared.told[codes.SET_OFF] = odd
        count = (strips + 1 - odd) // 2
        if kind == codes.SWEEP:
            count = (count + ABREAST - 1) // ABREAST
        share_out(model, state, work, kind, count)
