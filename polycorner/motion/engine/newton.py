"""Semismooth Newton steps on the natural map of an island."""

import numpy as np

from polycorner.motion.engine.gauss_seidel import (
    copy_impulses,
    recompute_velocities,
    residual,
    yielding_velocity,
)
from polycorner.motion.engine.island_matrix import (
    add_block,
    add_transposed,
    assemble_mass,
    row_product,
    solve_island_matrix,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.rows import apply_impulses, load_on
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import store, zeros

ROUND_NEWTON_STEPS = 20  # most Newton steps in a round
IDLE_NEWTON_STEPS = 6  # Newton steps without progress after which a round ends


@compiled
def linearise_block(block, search, scratch, b, softness, compliance):
    """Linearise the natural map of a block, whose residual was evaluated.

    ``search.derivative`` and ``search.constant`` get ``G`` and ``a`` of the Newton step
    ``dp = a - G J dv``.
    """
    u, derivative, constant = scratch.slip, search.derivative, search.constant
    yielding_velocity(block, b, compliance, u)
    if block.rows[b] > 0:
        linearise_friction(block, search, b, softness, u)
        return
    p, rho = block.impulse[b, 0], block.delassus[b, 3]
    if p - rho * u[0] <= 0.0 and not block.bilateral[b]:
        derivative[b, 4], constant[b, 0] = 0.0, -p
    else:
        stiffness = rho / softness
        derivative[b, 4], constant[b, 0] = stiffness, -stiffness * u[0]


@compiled
def is_loaded(block, search, b):
    """Return whether the impulses of a block that was linearised depend on velocities."""
    if block.rows[b] == 0:
        return search.derivative[b, 4] > 0.0
    return block.pressing[b] < 0 or load_on(block, b) > 0.0


@compiled
def change_impulses(block, search, b, normal, along, across, change):
    """Change the impulses of a block by ``a - G J dv``.

    ``J dv`` of the row that presses and of the block's own are given, for rows that there are;
    ``change`` gets what is added.
    """
    derivative, pressing, rows = search.derivative, block.pressing[b], max(1, block.rows[b])
    change[1] = 0.0
    for r in range(rows):
        change[r] = search.constant[b, r] - derivative[b, 4 + 3 * r] * along
        if pressing >= 0:
            change[r] -= derivative[b, 3 + 3 * r] * normal
        if rows == 2:
            change[r] -= derivative[b, 5 + 3 * r] * across
        block.impulse[b, r] += change[r]


@compiled
def linearise_friction(block, search, b, softness, u):
    """Linearise the natural map of one friction contact."""
    derivative, rho, out = search.derivative, block.delassus[b, 3], search.projection[b]
    d, pressing = block.rows[b], block.pressing[b]
    load = load_on(block, b)
    px, py = block.impulse[b, 0], block.impulse[b, 1] if d == 2 else 0.0
    zx, zy = px - rho * u[0], py - rho * u[1] if d == 2 else 0.0
    fx, fy = px - out[0], py - out[1] if d == 2 else 0.0
    d00, d01, d10, d11 = out[2], out[3], out[4], out[5]
    # The projection leaves numbers for the second row that do not belong to this contact.
    if d == 1:
        d01 = d10 = d11 = 0.0
    if pressing >= 0 and load > 0.0:  # the load changes as well
        # The load of an equation is the magnitude of its impulse, whose sign is in the derivative.
        pushes = block.impulse[pressing, 0] > 0.0 or not block.bilateral[pressing]
        per_load = (1.0 if pushes else -1.0) / load
        change = search.constant[pressing, 0] * per_load
        ex = out[0] - d00 * zx - d01 * zy
        ey = out[1] - d10 * zx - d11 * zy if d == 2 else 0.0
        fx -= ex * change
        fy -= ey * change
        stiff = derivative[pressing, 4] * per_load
        ex *= stiff
        ey *= stiff
    else:
        ex = ey = 0.0
    # the inverse of 1 - D + softness
    s00, s11 = 1.0 + softness - d00, 1.0 + softness - d11
    inverse = 1.0 / (s00 * s11 - d01 * d10)
    i00, i01, i10, i11 = s11 * inverse, d01 * inverse, d10 * inverse, s00 * inverse
    derivative[b, 3], derivative[b, 6] = i00 * ex + i01 * ey, i10 * ex + i11 * ey
    derivative[b, 4] = rho * (i00 * d00 + i01 * d10)
    derivative[b, 5] = rho * (i00 * d01 + i01 * d11)
    derivative[b, 7] = rho * (i10 * d00 + i11 * d10)
    derivative[b, 8] = rho * (i10 * d01 + i11 * d11)
    derivative[b, 0] = derivative[b, 1] = derivative[b, 2] = 0.0
    search.constant[b, 0], search.constant[b, 1] = -(i00 * fx + i01 * fy), -(i10 * fx + i11 * fy)


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
    velocity, block, search, scratch = work.velocity, work.block, work.search, work.scratch
    least, former, steps, idle = np.inf, np.inf, ZERO, 0
    while True:
        idle = 0 if worst < least else idle + 1
        if worst < least:
            least = worst
            copy_impulses(block, first, last, block.impulse, search.best)
        # Near the solution steps are quadratic and cost little: they go on as long as they pay.
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
            linearise_block(block, search, scratch, block.order[s], softness, compliance)
        if not take_step(model, work, first, last, n):
            break
        worst = residual(model, velocity, block, search, scratch, first, last, compliance)
        steps += ONE
    # So written that a residual that is not a number goes back, too.
    if not worst <= least:
        copy_impulses(block, first, last, search.best, block.impulse)
        recompute_velocities(model, velocity, block, first, last)
        least = residual(model, velocity, block, search, scratch, first, last, compliance)
    return steps, least


@compiled
def take_step(model, work, first, last, n):
    """Take a Newton step on an island that was linearised; return whether there is one."""
    block, search, matrix = work.block, work.search, work.matrix
    K, x = model.lanes, matrix.vector
    assemble_mass(model, work.mid, matrix, n, 1.0)
    for c in range(0, n * K, WIDTH):
        store(x, c, zeros())
    for s in range(first, last):
        b = block.order[s]
        if is_loaded(block, search, b):
            add_block(model, block, search, matrix, n, b)
        add_transposed(model, block, matrix, b, search.constant[b, 0], search.constant[b, 1], x)
    if not solve_island_matrix(model, matrix, n):
        return False
    for s in range(first, last):
        b = block.order[s]
        pressing, change = block.pressing[b], work.scratch.slip
        along = row_product(model, block, matrix, b, ZERO, x)
        across = row_product(model, block, matrix, b, ONE, x) if block.rows[b] == 2 else 0.0
        # A contact precedes the friction that it presses on, which needs this product.
        search.along[b] = along
        normal = search.along[pressing] if pressing >= 0 else 0.0
        change_impulses(block, search, b, normal, along, across, change)
        apply_impulses(model, work.velocity, block, b, change[0], change[1])
    return True
