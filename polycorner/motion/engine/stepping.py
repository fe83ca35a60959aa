"""A step of the bodies that are awake: its solution, and what follows from it.

There are ``N`` identical bodies with ``k`` coordinates each; a system that is not repeated is one
body.  Their equations of motion, gaps and slip velocities are kernels called by address.  The
unknowns of a step are impulses in *blocks*: a unilateral contact or an equation is a block of one
row, a friction contact one of one or two.  Each block knows the bodies it acts on, its Jacobian
and, for friction, the block of the contact that presses on it.  A step

1. drifts half a step, onto the equations, evaluates the bodies, and wakes those that can no longer
   remain at rest (:mod:`~polycorner.motion.engine.sleep`);
2. assembles the blocks of the awake bodies and of the contacts between them, and partitions them
   into islands;
3. solves each island by Gauss-Seidel sweeps over the blocks and Newton's method on the natural map
   ``p = proj(p - rho u)`` ([Acary]); for an island at rest, an equilibrium is sought first;
4. gives bodies at rest within the solver's accuracy exactly the velocity of rest; a body at rest
   whose impulses are in balance and in their sets falls asleep, and is only checked thereafter;
5. records events, books work, and drifts the other half of the step.

Bodies for which this does not do take shorter steps: :mod:`polycorner.motion.engine.refinement`.
"""

import numpy as np

from polycorner.motion.engine.arrays import (
    CHANGED,
    CONTACTS,
    CONTACTS_FULL,
    DONE,
    NOT_FINITE,
    SETTLED,
    SOLVED,
)
from polycorner.motion.engine.attraction import attract, forget_attraction
from polycorner.motion.engine.blocks import renew_blocks
from polycorner.motion.engine.contact_list import EXIT, MOTION, REST, record, record_contacts
from polycorner.motion.engine.crowds import is_crowd, renew_ranks
from polycorner.motion.engine.curvature import follow_curvature
from polycorner.motion.engine.evaluation import update_forces
from polycorner.motion.engine.families import kind_of
from polycorner.motion.engine.island_sleep import disperse
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.limit_blocks import begin_limits, follow_limits
from polycorner.motion.engine.neighbour_list import list_neighbours, outdated
from polycorner.motion.engine.neighbours import bodies_of
from polycorner.motion.engine.sleep import settle, wake_neighbours
from polycorner.motion.engine.solution import (
    assemble_blocks,
    detect_contacts,
    list_contacts,
    observe,
    solve_islands,
    start_bodies,
    store_all_impulses,
)

FORCE_ROUNDS = 30  # solutions of a step, at most, with forces at its mean velocity


@compiled
def solve(model, state, work, h, time, index, solved):
    """Solve a step for the bodies that are awake and those that they wake.

    If ``solved`` blocks were solved before, with other forces, they remain, and start from the
    impulses found.  Return whether all contacts fit in the workspace, and the number of blocks.
    """
    manner, mid, body = work.manner, work.mid, work.body
    island, neighbours, pair = work.island, work.neighbours, work.pair
    contacts, blocks = neighbours.status[2] if solved else ZERO, solved
    if model.families > 0 and not solved:
        renew_ranks(model, state, manner, mid, neighbours, pair, index)
        if outdated(model, state, body, neighbours, h, time) and not list_neighbours(
            model, state, body, island, neighbours, pair, h, time
        ):
            return False, blocks
        for s in range(neighbours.status[0]):
            neighbours.examined[s] = 0
    while True:
        found = contacts
        if solved:
            renew_blocks(model, state, work, blocks, h)
        else:
            if model.families > 0:
                contacts = detect_contacts(model, state, work, h, contacts)
                if contacts < 0:
                    return False, blocks
                if model.attracts and attract(model, mid, pair, found, contacts, h):
                    start_bodies(model, state, work, h)
            blocks = assemble_blocks(model, state, work, h, contacts, found == 0)
        solve_islands(model, state, work, blocks, h, solved > 0)
        store_all_impulses(model, state, work, blocks, h)
        if model.families == 0 or not wake_neighbours(
            model, state, work, blocks, h, time + 0.5 * h, index
        ):
            break
        unsettle(model, island)
        start_bodies(model, state, work, h)
        # Bodies that woke bring new blocks: all are assembled anew.
        solved = ZERO
    neighbours.status[2] = contacts
    return True, blocks


@compiled
def unsettle(model, island):
    """Let all islands be solved."""
    for i in range(model.bodies):
        island.stage[i], island.proved[i] = SOLVED, 0


@compiled
def next_round(model, island):
    """Let the islands be solved again that have changed; return whether there are any.

    Crowds are left as they are.
    """
    found = False
    for i in range(model.bodies):
        crowd = is_crowd(model, island.start[i], island.start[i + 1])
        changed = island.stage[i] == CHANGED and not crowd
        island.stage[i] = SOLVED if changed else SETTLED
        found = found or changed
    return found


@compiled
def unsolved(model, island):
    """Return whether an island is not solved to the tolerance."""
    for i in range(model.bodies):
        if island.start[i + 1] > island.start[i] and (island.residual[i] > model.tolerance):
            return True
    return False


@compiled
def attempt(model, state, work, h, time, index, any_awake):
    """Solve a step for the velocities of the bodies that are awake, which have been evaluated.

    Forces that depend on the velocity are those of its mean over the step, for which it is solved
    several times, except for islands that have settled.  A part of a step that is not solved is
    left at that.  Return why it cannot be done, or DONE, and the number of blocks.
    """
    island = work.island
    blocks = ZERO
    unsettle(model, island)
    if model.attracts:
        forget_attraction(model, work.mid)
    if model.limits > 0:
        begin_limits(model, work, time + 0.5 * h)
    for trial in range(FORCE_ROUNDS):
        if not start_bodies(model, state, work, h):
            return NOT_FINITE, blocks
        if not any_awake:
            break
        fits, blocks = solve(model, state, work, h, time, index, blocks)
        if not fits:
            return CONTACTS_FULL, blocks
        # Forces need not follow in a part that is going to be halved.
        if not model.follows_velocity or (work.manner.located[0] and unsolved(model, island)):
            break
        follow_curvature(model, state, work, blocks, h)
        # Not after the last solution, so that blocks are those that were solved for.
        if model.limits > 0 and trial < FORCE_ROUNDS - 1:
            passed = follow_limits(model, state, work, blocks, h)
            update_forces(model, state, work, h)
            if passed:  # new blocks: all are assembled anew
                unsettle(model, island)
                blocks = ZERO
                continue
        else:
            update_forces(model, state, work, h)
        if not next_round(model, island):
            break
    for i in range(model.bodies):
        for c in range(model.dimension):
            if state.alive[i] and not np.isfinite(work.velocity.new[i, c]):
                return NOT_FINITE, blocks
    return DONE, blocks


@compiled
def commit(model, state, work, log, blocks, h, time, index, any_awake, count):
    """Book, record and make a step that was solved; return the number of events."""
    body, sleep = work.body, work.sleep
    k, N = model.dimension, model.bodies
    # Before velocities change: it compares with the state before the step.
    observe(model, state, work, blocks, h, time)
    if any_awake:
        count = record_contacts(model, work.pair, work.block, work.event, log, blocks, count)
        if model.families > 0:
            count = list_contacts(model, state, work, log, h, time, count)
    for i in range(N):
        sleep.rested[i] = state.rests[i]
    settle(model, state, work, h, index)
    for i in range(N):
        if not state.alive[i] or body.waits[i]:
            continue
        if body.awake[i] and state.rests[i] != sleep.rested[i]:
            kind = REST if state.rests[i] else MOTION
            when = time + h if state.rests[i] else time
            count = record(log, count, kind, i, NONE, NONE, when, 0.0)
        for c in range(k):
            if body.awake[i]:
                state.v[i, c] = work.velocity.new[i, c]
            state.q[i, c] = work.mid.q[i, c] + 0.5 * h * state.v[i, c]
            if model.crowd_sweeps > 0 and body.awake[i]:
                state.q[i, c] += work.crowd.shift[i, c]
        leaving, limit = (
            model.exit_coordinate[kind_of(model, i)],
            model.exit_limit[kind_of(model, i)],
        )
        if leaving >= 0 and state.q[i, leaving] > limit:
            state.alive[i] = 0
            count = record(log, count, EXIT, i, NONE, NONE, time + h, 0.0)
            for s in range(state.counts[CONTACTS]):
                one, two = bodies_of(model, state, s)
                if i in (one, two):
                    # What it held up has to be asked at once whether it still rests.
                    state.check_due[one] = state.check_due[two] = 0
                    for other in (one, two):
                        disperse(model, state, other)
                        state.asleep[other] = 0
    return count
