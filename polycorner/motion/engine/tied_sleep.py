"""Sleep of tied bodies, which sleep and wake with all that they are tied to.

Impulses of their surroundings alone prove nothing of tied bodies.  What does is that a step is a
map: where an island of bodies has exactly the velocity zero, is where it was, and its solved step
leaves it at that, friction sticking and nothing depending on the time, the next step is the same
step, and so are all that follow, until something else acts on one of the bodies.
"""

import numpy as np

from polycorner.motion.engine.evaluation import evaluate_body
from polycorner.motion.engine.families import kind_of
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.rest import REST_FACTOR
from polycorner.motion.engine.rows import load_on, sticks
from polycorner.motion.engine.ties import (
    add_tie_forces,
    evaluate_rows,
    evaluate_tie_forces,
    is_tied,
)

# What an island of tied bodies lacks for sleep: nothing; only to have been at rest for a step.
RESTS, SLOWS, MOVES = range(3)

# A sleeper on which something presses that is awake: a bit of `disturbed`.  A tied one that was
# evaluated with its ties: a value of `evaluated`.
PRESSED, WITH_TIES = 4, 2


@compiled
def wake_together(model, state):
    """Let no tied body sleep while one that it is tied to does not."""
    for p in range(model.components):
        begin, end = model.component_bodies[p], model.component_bodies[p + 1]
        asleep = True
        for s in range(begin, end):
            asleep = asleep and state.asleep[model.component_body[s]] != 0
        for s in range(begin, ZERO if asleep else end):
            state.asleep[model.component_body[s]] = 0


@compiled
def wake_tied(model, state, work, h, time, index):
    """Wake all sleepers that are tied to bodies that woke, and evaluate them."""
    for p in range(model.components):
        begin, end = model.component_bodies[p], model.component_bodies[p + 1]
        first, woken = model.component_body[begin], False
        for s in range(begin, end):
            woken = woken or work.body.awake[model.component_body[s]] != 0
        if woken and state.asleep[first] and work.body.evaluated[first] != WITH_TIES:
            wake_component(model, state, work, p, h, time, index)


@compiled
def wake_component(model, state, work, p, h, time, index):
    """Wake bodies that hang together by ties, and evaluate them and their ties."""
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
def settle_tied(model, state, work):
    """Let islands of tied bodies that have come to rest sleep; see above.

    Other bodies of the island have to sleep by their own proof.
    """
    body, island, velocity = work.body, work.island, work.velocity
    lacks = island.cursor
    for i in range(model.bodies):
        solved = island.start[i] == island.start[i + 1] or island.residual[i] <= model.tolerance
        lacks[i] = RESTS if solved else MOVES
    for p in range(model.components):
        for s in range(model.component_bodies[p], model.component_bodies[p + 1]):
            i = model.component_body[s]
            if body.awake[i] and not model.component_rests[p]:
                lacks[island.parent[i]] = MOVES
    for i in range(model.bodies):
        if state.alive[i] and body.awake[i]:
            r = island.parent[i]
            lacks[r] = max(lacks[r], what_lacks(model, state, work, i))
    for i in range(model.bodies):
        r = island.parent[i]
        if not (state.alive[i] and body.awake[i] and is_tied(model, i)) or lacks[r] == MOVES:
            continue
        if lacks[r] == RESTS and not grips(model, work, r):
            lacks[r] = SLOWS
        for c in range(model.dimension):
            velocity.new[i, c] = 0.0
        state.rests[i] = 1
        if lacks[r] == RESTS:
            state.asleep[i] = 1


@compiled
def what_lacks(model, state, work, i):
    """Return what a body lacks for the sleep of its island."""
    if not is_tied(model, i):
        return RESTS if state.asleep[i] else MOVES
    far, moved = 0.0, False
    for c in range(model.dimension):
        unit = model.units[kind_of(model, i), c]
        far = max(far, abs(state.v[i, c]) * unit, abs(work.velocity.new[i, c]) * unit)
        moved = moved or state.v[i, c] != 0.0 or work.mid.q[i, c] != state.q[i, c]
    if not far <= REST_FACTOR * model.tolerance * work.body.island_speed[i]:
        return MOVES
    return SLOWS if moved else RESTS


@compiled
def grips(model, work, r):
    """Return whether all friction in an island that carries sticks on what does not move."""
    block = work.block
    for s in range(work.island.start[r], work.island.start[r + 1]):
        b = np.int64(block.order[s])
        if block.rows[b] > 0 and load_on(block, b) > 0.0:
            still = block.offset[b, 0] == 0.0 and (block.rows[b] < 2 or block.offset[b, 1] == 0.0)
            if not (still and sticks(model, work.body, block, b)):
                return False
    return True
