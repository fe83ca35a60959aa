"""Semismooth Newton steps on the natural map of an island."""

import numpy as np

from polycorner.motion.engine.band import (
    add_block,
    add_transposed_row,
    assemble_mass,
    row_product,
    solve_band,
)
from polycorner.motion.engine.blocks import apply_impulse, load_on
from polycorner.motion.engine.gauss_seidel import (
    copy_impulses,
    recompute_velocities,
    residual,
    yielding_velocity,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.sets import project

ROUND_NEWTON_STEPS = 20  # most Newton steps in a round
IDLE_NEWTON_STEPS = 6  # Newton steps without progress after which a round ends


@compiled
def newton_steps(model, work, first, last, n, width, goal, softness, compliance, worst, u, out):
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
    size, x = n * model.dimension, work.island_vector
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
            or (idle == IDLE_NEWTON_STEPS and compliance == 0.0)
            or steps == ROUND_NEWTON_STEPS
        ):
            break
        former = worst
        linearise(model, work, first, last, n, width, softness, compliance, u, out)
        if not solve_band(work.band, x, size, width, work.envelope):
            break
        for s in range(first, last):
            update_block(model, work, work.order[s], x)
        steps += ONE
        worst = residual(model, work, first, last, compliance, u, out)
    if worst > least:
        copy_impulses(work, first, last, work.best, work.impulse)
        recompute_velocities(model, work, first, last)
        least = residual(model, work, first, last, compliance, u, out)
    return steps, least


@compiled
def update_block(model, work, b, x):
    """Change the impulses of a block by a Newton step; see :func:`newton_steps`."""
    derivative, pressing, rows = work.derivative, work.pressing[b], max(1, work.block_rows[b])
    normal = row_product(model, work, pressing, ZERO, x) if pressing >= 0 else 0.0
    along = row_product(model, work, b, ZERO, x)
    across = row_product(model, work, b, ONE, x) if rows == 2 else 0.0
    for r in range(rows):
        change = work.constant[b, r] - derivative[b, 4 + 3 * r] * along
        if pressing >= 0:
            change -= derivative[b, 3 + 3 * r] * normal
        if rows == 2:
            change -= derivative[b, 5 + 3 * r] * across
        work.impulse[b, r] += change
        apply_impulse(model, work, b, r, change)


@compiled
def linearise(model, work, first, last, n, width, softness, compliance, u, out):
    """Linearise the natural map of an island; see :func:`newton_steps`.

    ``work.derivative`` and ``work.constant`` get ``G`` and ``a`` of each block.
    """
    derivative, constant, x = work.derivative, work.constant, work.island_vector
    assemble_mass(model, work, n, width)
    for c in range(n * model.dimension):
        x[c] = 0.0
    for s in range(first, last):
        b = work.order[s]
        yielding_velocity(work, b, compliance, u)
        rho = work.delassus[b, 3]
        if work.block_rows[b] == 0:
            p = work.impulse[b, 0]
            if p - rho * u[0] <= 0.0 and not work.bilateral[b]:
                derivative[b, 4], constant[b, 0] = 0.0, -p
            else:
                derivative[b, 4], constant[b, 0] = rho / softness, -rho * u[0] / softness
        else:
            linearise_friction(model, work, b, softness, u, out)
        if work.block_rows[b] == 0:
            loaded = derivative[b, 4] > 0.0
        else:
            loaded = work.pressing[b] < 0 or load_on(work, b) > 0.0
        if loaded:
            add_block(model, work, b, width)
        for r in range(max(1, work.block_rows[b])):
            add_transposed_row(model, work, b, r, constant[b, r], x)


@compiled
def linearise_friction(model, work, b, softness, u, out):
    """Linearise the natural map of one friction contact."""
    derivative, rho = work.derivative, work.delassus[b, 3]
    d, pressing = work.block_rows[b], work.pressing[b]
    load = load_on(work, b)
    px, py = work.impulse[b, 0], work.impulse[b, 1] if d == 2 else 0.0
    zx, zy = px - rho * u[0], py - rho * u[1] if d == 2 else 0.0
    project(model, work.block_set[b], zx, zy, load, out)
    fx, fy = px - out[0], py - out[1] if d == 2 else 0.0
    d00, d01, d10, d11 = out[2], out[3], out[4], out[5]
    if d == 1:
        d01 = d10 = d11 = 0.0
    if pressing >= 0 and load > 0.0:  # the load changes as well
        per_load = load if work.impulse[pressing, 0] > 0.0 else -load
        change = work.constant[pressing, 0] / per_load
        ex = out[0] - d00 * zx - d01 * zy
        ey = out[1] - d10 * zx - d11 * zy if d == 2 else 0.0
        fx -= ex * change
        fy -= ey * change
        stiff = derivative[pressing, 4] / per_load
        ex *= stiff
        ey *= stiff
    else:
        ex = ey = 0.0
    # the inverse of 1 - D + softness
    s00, s11 = 1.0 + softness - d00, 1.0 + softness - d11
    determinant = s00 * s11 - d01 * d10
    i00, i01, i10, i11 = s11 / determinant, d01 / determinant, d10 / determinant, s00 / determinant
    derivative[b, 3], derivative[b, 6] = i00 * ex + i01 * ey, i10 * ex + i11 * ey
    derivative[b, 4] = rho * (i00 * d00 + i01 * d10)
    derivative[b, 5] = rho * (i00 * d01 + i01 * d11)
    derivative[b, 7] = rho * (i10 * d00 + i11 * d10)
    derivative[b, 8] = rho * (i10 * d01 + i11 * d11)
    derivative[b, 0] = derivative[b, 1] = derivative[b, 2] = 0.0
    work.constant[b, 0], work.constant[b, 1] = -(i00 * fx + i01 * fy), -(i10 * fx + i11 * fy)
