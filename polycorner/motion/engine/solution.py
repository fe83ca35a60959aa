"""Assembly of the blocks of a step, and solution of its islands, by all threads."""

from polycorner.motion.engine.arrays import CONTACTS, SETTLED, SWEEPS
from polycorner.motion.engine.blocks import (
    assemble_body_blocks,
    assemble_contacts,
    order_contacts,
)
from polycorner.motion.engine.codes import (
    ADD,
    AGAIN,
    ASSEMBLE,
    BACKWARDS,
    EVALUATE,
    JUDGE,
    SEPARATE,
    SET_OFF,
    SOLVE,
    STEP_INDEX,
    STORE,
    SWEEP,
)
from polycorner.motion.engine.contact_list import keep_contacts, list_blocks, sort_contacts
from polycorner.motion.engine.crowds import divide_blocks, divide_contacts, is_crowd
from polycorner.motion.engine.curvature import correct_curvature
from polycorner.motion.engine.island import begin_island
from polycorner.motion.engine.jit import ZERO, compiled
from polycorner.motion.engine.phases import share_out, share_range
from polycorner.motion.engine.rows import apply_impulses
from polycorner.motion.engine.signals import increase

MOST_CORRECTIONS = 8  # solutions of a step, at most, for the curvature of equations


@compiled
def evaluate_bodies(model, state, work, h, time, index):
    """Evaluate all bodies that are not asleep."""
    work.told_times[1], work.told[STEP_INDEX] = time, index
    share_range(model, state, work, EVALUATE, model.bodies, h)


@compiled
def assemble_blocks(model, state, work, h, contacts):
    """Assemble the blocks of all awake bodies and of all contacts detected; return their number."""
    first = assemble_body_blocks(model, state, work, h)
    order_contacts(model, work, contacts)
    divide_contacts(model, state, work, h, contacts)
    if work.located[0]:  # contacts have blocks only if they are closed
        blocks = assemble_contacts(model, state, work, h, ZERO, contacts, first)
    else:
        blocks = first + (1 + model.pair_laws) * contacts
        work.told[SET_OFF] = first
        share_range(model, state, work, ASSEMBLE, contacts, h)
    for b in range(blocks):
        apply_impulses(model, work, b, work.impulse[b, 0], work.impulse[b, 1])
    return blocks


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
    """Sweep over the blocks of a crowd, which is not solved, as often as asked.

    The last sweep goes forward, so that friction follows the contact that presses on it and is in
    its set.
    """
    first, last = work.island_start[i], work.island_start[i + 1]
    speed, _ = begin_island(state, work, first, last)
    strips = work.strips[0]
    divide_blocks(work, first, last)
    for left in range(model.crowd_sweeps - 1, -1, -1):
        work.told[BACKWARDS] = left % 2
        share_strips(model, state, work, SWEEP, strips, left % 2)
    share_strips(model, state, work, SEPARATE, strips, ZERO)
    increase(state.counts, SWEEPS, model.crowd_sweeps)
    share_out(model, state, work, JUDGE, strips)
    worst = 0.0
    for t in range(strips):
        worst = max(worst, work.worst[t])
    work.island_residual[i] = worst / speed if speed > 0.0 else 0.0


@compiled
def store_all_impulses(model, state, work, blocks, h):
    """Store the impulses of all blocks; see :func:`store_impulses`."""
    share_range(model, state, work, STORE, blocks, h)


@compiled
def list_contacts(model, state, work, log, h, time, count):
    """Update the list of contacts between bodies; return the number of events."""
    added = list_blocks(work, work.list_status[2])
    kept, count = keep_contacts(model, state, work, log, added, h, time, count)
    work.told[SET_OFF] = kept
    share_range(model, state, work, ADD, added, h)
    state.counts[CONTACTS] = kept + added
    sort_contacts(model, state, kept + added)
    return count


@compiled
def share_strips(model, state, work, kind, strips, begin):
    """Do what is asked for the strips of even and of odd number; ``begin``: with which of these."""
    for half in range(2):
        odd = (begin + half) % 2
        work.told[SET_OFF] = odd
        share_out(model, state, work, kind, (strips + 1 - odd) // 2)
