"""Islands that stuck as a whole: they go on to stick while forces can hold them.

Where loads depend on friction, slip can solve a step that sticking solves as well.
"""

from polycorner.motion.engine.arrays import OWN_FRICTION, PAIR_FRICTION
from polycorner.motion.engine.equilibrium import find_equilibrium
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.linear_algebra import add_square, solve_spd
from polycorner.motion.engine.rows import load_on, sticks


@compiled
def keeps_grip(model, state, work, first, last, speed, solved):
    """Return whether an island of one body that stuck, and now slips or is not solved, can stick.

    Then the impulses that hold it, and its velocity, are the solution.
    """
    i = work.block_bodies[work.order[first], 0]
    return (
        loses_grip(model, state, work, first, last, i, solved)
        and find_grip_velocity(model, work, first, last, i)
        and find_equilibrium(model, state, work, first, last, speed)
    )


@compiled
def loses_grip(model, state, work, first, last, i, solved):
    """Return whether all friction of a body stuck before the step, and some slips after it.

    Where the step is not solved it counts as slipping.  The velocities after the step must have
    been evaluated.
    """
    slips = False
    for s in range(first, last):
        b = work.order[s]
        if work.block_bodies[b, 1] >= 0 or work.origin[b, 0] == PAIR_FRICTION:
            return False
        if work.origin[b, 0] != OWN_FRICTION or load_on(work, b) <= 0.0:
            continue
        if not state.sticks[i, work.origin[b, 2]]:
            return False
        slips = slips or not solved or not sticks(model, work, b)
    return slips


@compiled
def find_grip_velocity(model, work, first, last, i):
    """Find the velocity of a body at which its loaded blocks neither slip nor open.

    It is that of least squares; :func:`find_equilibrium` checks that nothing slips at it.
    """
    k, A, x = model.dimension, work.body_matrix, work.rest_velocity
    for c in range(k):
        x[c] = 0.0
        for a in range(k):
            A[c, a] = 0.0
    for s in range(first, last):
        b = work.order[s]
        loaded = work.bilateral[b] or work.impulse[b, 0] > 0.0
        if work.block_rows[b] > 0:
            loaded = load_on(work, b) > 0.0
        if not loaded:
            continue
        for r in range(max(1, work.block_rows[b])):
            row = work.jacobian[b, r, :k]
            add_square(A, row, 1.0, k)
            for c in range(k):
                x[c] -= work.offset[b, r] * row[c]
    if not solve_spd(A, x, k):
        return False
    for c in range(k):
        work.v_rest[i, c] = x[c]
    return True
