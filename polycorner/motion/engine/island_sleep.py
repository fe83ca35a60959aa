"""Sleep of islands, whose bodies sleep and wake together.

Impulses of its surroundings alone prove nothing of a body that lies on others, or is tied to them.
What does is that a step is a map.  *Theorem*: let the bodies of an island have the velocity zero,
and let forces, gaps and slips be functions of places and velocities, not of the time.  The midpoint
of the step is then the place where they are, and the step asks for ``v`` and impulses ``p`` with

    M v = h f + J' p,    p_i >= 0,  u_i = g_i / h + J_i v >= 0,  p_i u_i = 0    for contacts,
                         p_b in L_b C_b,  -u_b in the normal cone of L_b C_b    for friction,

with ``C_b`` of what sticks.  Rest, ``v = 0``, solves it if and only if no gap is negative, friction
that carries has no slip at rest, and the loads lie in the cone of the closed contacts,

    -h f = J' p   for some p with  p_i >= 0,  p_i = 0 where g_i > 0,  p_b in L_b C_b:

every element of ``C_b`` is a force that contacts which do not slip can have.  None of this changes
while bodies stay where they are, so rest by the same impulses solves the next step as well, and by
induction every one until another body acts on one of the island.

That the loads are in the cone is shown by
:func:`~polycorner.motion.engine.equilibrium.find_equilibrium`, up to half the solver's tolerance of
the speeds that forces give in a step; gaps up to ``MotionOptions.touching`` count as zero; and
friction must leave a share of its sets in reserve, ``SLEEP_MARGIN``, so that impulses which balance
exactly are in the cone as well.  An island is stopped (:func:`stops`) where contacts resist all of
its motion, and velocities before and after the step are below this share of the speeds that forces
give in a step, so that the reserve alone would stop what slips within about a step, or below the
accuracy of the solution.  Of tied bodies it is enough that the solved step leaves them at rest
within the solver's accuracy.

What falls asleep together is a *pile*.  All of it wakes where an impulse of a body that is awake
acts on one of it, or what one of it lay on wakes.  Nothing sleeps by this whose forces, gaps or
slips follow the time, as those of walls that move, or are drawn, that has limits on velocities, or
among bodies that attract each other.
"""

import numpy as np

from polycorner.motion.engine.equilibrium import find_equilibrium
from polycorner.motion.engine.evaluation import evaluate_body
from polycorner.motion.engine.families import kind_of
from polycorner.motion.engine.gauss_seidel import copy_impulses
from polycorner.motion.engine.jit import ONE, compiled
from polycorner.motion.engine.rest import REST_FACTOR, SLEEP_MARGIN
from polycorner.motion.engine.rows import load_on, sticks
from polycorner.motion.engine.ties import (
    add_tie_forces,
    evaluate_rows,
    evaluate_tie_forces,
    is_tied,
)

# What an island lacks for sleep: nothing; only to have been at rest for a step; rest.
RESTS, SLOWS, MOVES = range(3)

# A sleeper on which something presses that is awake: a bit of `disturbed`.  A tied one that was
# evaluated with its ties: a value of `evaluated`.
PRESSED, WITH_TIES = 4, 2


@compiled
def stops(model, state, work, first, last):
    """Return whether the velocity zero solves the step of an island that hardly moves; then it is.

    What hardly moves has done so before the step, too: a blow ends in an impact, not in rest.  A
    threshold on velocities alone would stop a disc that begins to roll down a slope.
    """
    velocity, body, block, search = work.velocity, work.body, work.block, work.search
    pace = 0.0
    if not model.may_rest:
        return False
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i < 0:
                continue
            for c in range(model.dimension):
                velocity.rest[i, c] = state.v[i, c]
            if not body.awake[i]:
                continue
            forced = far = 0.0
            for c in range(model.dimension):
                velocity.rest[i, c], unit = 0.0, model.units[kind_of(model, i), c]
                forced = max(forced, abs(velocity.free[i, c]) * unit)
                far = max(far, abs(state.v[i, c]) * unit, abs(velocity.new[i, c]) * unit)
            near = max(SLEEP_MARGIN * forced, model.tolerance * body.island_speed[i])
            if not (model.still[i] and far <= near):
                return False
            pace = max(pace, forced)
    # Where it cannot, the solution at hand is that of the bounds before.
    copy_impulses(block, first, last, block.offset, search.loaded)
    copy_impulses(block, first, last, block.target, search.rigid)
    for s in range(first, last):  # at rest no slip is left at the end of the step
        block.target[block.order[s], 0] = block.target[block.order[s], 1] = 0.0
    if find_equilibrium(model, state, work, first, last, pace, ONE):
        return True
    copy_impulses(block, first, last, search.loaded, block.offset)
    copy_impulses(block, first, last, search.rigid, block.target)
    return False


@compiled
def disperse(model, state, i):
    """Let no body of the pile of a body sleep any longer."""
    pile = state.pile[i]
    if pile == 0:
        return
    for j in range(model.bodies):
        if state.pile[j] == pile:
            state.pile[j] = state.asleep[j] = 0


@compiled
def wake_mates(model, state, work, h, time, index):
    """Wake the piles of bodies that woke, and evaluate them; the same for ties."""
    body, woken = work.body, work.island.cursor
    for i in range(model.bodies):
        woken[i] = 0
    for i in range(model.bodies):
        if state.pile[i] > 0 and body.awake[i]:
            woken[state.pile[i] - 1] = 1
    for i in range(model.bodies):
        p = state.pile[i]
        if p > 0 and woken[p - 1] and not body.waits[i]:
            body.awake[i] = 1
            if not body.evaluated[i]:
                body.evaluated[i] = 1
                evaluate_body(model, state, work.mid, work.scratch, i, h, time, index)
    for p in range(model.components):
        i = model.component_body[model.component_bodies[p]]
        if body.awake[i] and state.asleep[i] and body.evaluated[i] != WITH_TIES:
            wake_component(model, state, work, p, h, time, index)


@compiled
def wake_component(model, state, work, p, h, time, index):
    """Evaluate bodies that hang together by ties, with their ties."""
    mid, tie, scratch = work.mid, work.tie, work.scratch
    for s in range(model.component_bodies[p], model.component_bodies[p + 1]):
        i = model.component_body[s]
        work.body.awake[i], work.body.evaluated[i] = ONE, WITH_TIES
        evaluate_body(model, state, mid, scratch, i, h, time, index)
    for s in range(model.component_ties[p], model.component_ties[p + 1]):
        t = model.component_tie[s]
        evaluate_rows(model, mid, tie, scratch, t)
        evaluate_tie_forces(model, mid, tie, scratch, t, state.v, h)
    for s in range(model.component_bodies[p], model.component_bodies[p + 1]):
        add_tie_forces(model, mid, tie, model.component_body[s])


@compiled
def presses(model, state, s):
    """Return whether a listed contact acts."""
    act = False
    for c in range(2 * model.dimension):
        act = act or state.pair_action[s, c] != 0.0
    return act


@compiled
def settle_islands(model, state, work):
    """Let islands that have come to rest sleep; see above.

    Bodies that sleep by a proof of their own go on doing so.
    """
    body, island, velocity = work.body, work.island, work.velocity
    lacks, found = island.cursor, model.ties > 0
    for r in range(model.bodies):
        solved = island.start[r] == island.start[r + 1] or island.residual[r] <= model.tolerance
        lacks[r] = RESTS if solved else MOVES
        found = found or island.proved[r] != 0
    if not found:
        return
    for i in range(model.bodies):
        if state.alive[i] and body.awake[i]:
            r = island.parent[i]
            lacks[r] = max(lacks[r], what_lacks(model, state, work, i, r))
    for r in range(model.bodies):
        if island.parent[r] == r and lacks[r] != MOVES and body.awake[r]:
            lacks[r] = max(lacks[r], what_blocks_lack(model, state, work, r))
    for i in range(model.bodies):
        r = island.parent[i]
        if not (state.alive[i] and body.awake[i]) or lacks[r] == MOVES or state.asleep[i]:
            continue
        for c in range(model.dimension):
            velocity.new[i, c] = 0.0
        state.rests[i] = 1
        if lacks[r] == RESTS:
            state.asleep[i], state.pile[i] = 1, r + 1


@compiled
def what_lacks(model, state, work, i, r):
    """Return what a body lacks for the sleep of the island that ``r`` represents."""
    tied = is_tied(model, i)
    if state.asleep[i]:
        return RESTS
    if not (model.still[i] and (tied or work.island.proved[r])):
        return MOVES
    far, moved = 0.0, False
    for c in range(model.dimension):
        unit = model.units[kind_of(model, i), c]
        far = max(far, abs(work.velocity.new[i, c]) * unit)
        if tied:
            far = max(far, abs(state.v[i, c]) * unit)
        moved = moved or state.v[i, c] != 0.0 or work.mid.q[i, c] != state.q[i, c]
    near = REST_FACTOR * model.tolerance * work.body.island_speed[i] if tied else 0.0
    if not far <= near:
        return MOVES
    return SLOWS if moved else RESTS


@compiled
def what_blocks_lack(model, state, work, r):
    """Return what the contacts of an island lack: all friction sticks on what does not move."""
    block, island, body = work.block, work.island, work.body
    for s in range(island.start[r], island.start[r + 1]):
        b = np.int64(block.order[s])
        if block.rows[b] > 0 and load_on(block, b) > 0.0:
            still = block.offset[b, 0] == 0.0 and (block.rows[b] < 2 or block.offset[b, 1] == 0.0)
            if not (still and sticks(model, body, block, b)):
                return SLOWS
        for side in range(2):
            j = block.bodies[b, side]
            if j >= 0 and not body.awake[j]:
                for c in range(model.dimension):
                    if state.v[j, c] != 0.0:
                        return SLOWS
    return RESTS
