"""Semismooth Newton steps on the natural map of an island."""

import numpy as np

from polycorner.motion.engine.gauss_seidel import (
    copy_impulses,
    recompute_velocities,
    residual,
)
from polycorner.motion.engine.island_matrix import (
    add_block,
    add_transposed,
    assemble_mass,
    row_product,
    solve_island_matrix,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.linearisation import change_impulses, is_loaded, linearise_block
from polycorner.motion.engine.rows import apply_impulses
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import store, zeros

ROUND_NEWTON_STEPS = 20  # most Newton steps in a round
IDLE_NEWTON_STEPS = 6  # Newton steps without progress after which a round ends


@compiled
def newton_steps(model, work, first, last, n, goal, softness, compliance, worst):
    """Take semismooth Newton steps on the natural map; return their number and the least residual.

    The map is ``p - proj(p - rho u)`` with the velocities ``u = J v + d`` of the rows; its
    derivative involves that of the projection and, for friction, also that of its load ([Acary]).
    The steps ``dp = a - G J dv`` of the blocks are substituted into ``M dv = J' dp``: the system
    that is solved is as large as the velocities, not as the impulses.  All contacts are slightly
    softened, so that redundant ones have a solution; this also damps the steps, as in the method of
    multipliers, of which this is one step ([Rockafellar76]).  The impulses of the least residual
    are kept.  The residual must have been evaluated before.  With a ``compliance`` the contacts
    yield; see :func:`yielding_velocity`.
    """
    least, former, steps, idle = np.inf, np.inf, ZERO, 0
    while True:
        idle = 0 if worst < least else idle + 1
        if worst < least:
            least = worst
            copy_impulses(work, first, last, work.impulse, work.best)
        settled = worst <= goal and worst > 0.1 * former
        if (
            settled
            or worst <= 1e-2 * goal
            or (idle >= IDLE_NEWTON_STEPS and (compliance == 0.0 or least <= goal))
            or steps == ROUND_NEWTON_STEPS
        ):
            break
        former = worst
        for s in range(first, last):
            linearise_block(work, work.order[s], softness, compliance)
        if not take_step(model, work, first, last, n):
            break
        worst = residual(model, work, first, last, compliance)
        steps += ONE
    if not worst <= least:
        copy_impulses(work, first, last, work.best, work.impulse)
        recompute_velocities(model, work, first, last)
        least = residual(model, work, first, last, compliance)
    return steps, least


@compiled
def take_step(model, work, first, last, n):
    """Take a Newton step on an island that was linearised; return whether there is one."""
    K, x = model.lanes, work.island_vector
    assemble_mass(model, work, n, 1.0)
    for c in range(0, n * K, WIDTH):
        store(x, c, zeros())
    for s in range(first, last):
        b = work.order[s]
        if is_loaded(work, b):
            add_block(model, work, n, b)
        add_transposed(model, work, b, work.constant[b, 0], work.constant[b, 1], x)
    if not solve_island_matrix(model, work, n):
        return False
    for s in range(first, last):
        b = work.order[s]
        pressing, change = work.pressing[b], work.slip
        along = row_product(model, work, b, ZERO, x)
        across = row_product(model, work, b, ONE, x) if work.block_rows[b] == 2 else 0.0
        work.along[b] = along
        normal = work.along[pressing] if pressing >= 0 else 0.0
        change_impulses(work, b, normal, along, across, change)
        apply_impulses(model, work, b, change[0], change[1])
    return True
