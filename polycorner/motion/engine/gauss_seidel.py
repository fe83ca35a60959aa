"""Gauss-Seidel sweeps over the blocks of an island."""

import numpy as np

from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.rows import apply_impulses, copy_velocity, load_on, velocity_of
from polycorner.motion.engine.sets import contains, project

EXACT = 1e-12  # determinant of two rows, over the product of their squares, to solve for both


@compiled
def relax_block(model, work, b):
    """Solve one block with all others fixed; return its residual, as a speed."""
    u, out = work.slip, work.image
    pressing = work.pressing[b]
    if (
        pressing >= 0
        and load_on(work, b) <= 0.0
        and work.impulse[b, 0] == 0.0
        and work.impulse[b, 1] == 0.0
    ):
        return 0.0
    velocity_of(model, work, b, work.v_new, u)
    rho, norm = work.delassus[b, 3], work.delassus[b, 4]
    if work.block_rows[b] == 0:
        p = work.impulse[b, 0]
        new = p - u[0] * rho
        if not (new > 0.0 or work.bilateral[b]):
            new = 0.0
        if new != p:
            apply_impulses(model, work, b, new - p, 0.0)
            work.impulse[b, 0] = new
        return abs(new - p) * norm
    load = load_on(work, b)
    shape = work.block_set[b]
    x, y = work.impulse[b, 0], work.impulse[b, 1]
    if work.block_rows[b] == 1:
        project(model, shape, x - u[0] * rho, 0.0, load, out)
        far = abs(out[0] - x) * norm
        if out[0] != x:
            apply_impulses(model, work, b, out[0] - x, 0.0)
            work.impulse[b, 0] = out[0]
        return far
    project(model, shape, x - u[0] * rho, y - u[1] * rho, load, out)
    far = np.sqrt((out[0] - x) ** 2 + (out[1] - y) ** 2) * norm
    d00, d01, d11 = work.delassus[b, 0], work.delassus[b, 1], work.delassus[b, 2]
    determinant = d00 * d11 - d01 * d01
    if load > 0.0 and determinant > EXACT * d00 * d11:
        sx = x - (d11 * u[0] - d01 * u[1]) / determinant
        sy = y - (d00 * u[1] - d01 * u[0]) / determinant
        if contains(model, shape, sx, sy, load, 0.0):
            out[0], out[1] = sx, sy
    apply_impulses(model, work, b, out[0] - x, out[1] - y)
    work.impulse[b, 0], work.impulse[b, 1] = out[0], out[1]
    return far


@compiled
def yielding_velocity(work, b, compliance, u):
    """Evaluate ``J v + d + c p / rho``: the velocities of rows that yield to their impulses.

    ``work.after`` must be ``J v + d``.
    """
    for r in range(max(1, work.block_rows[b])):
        u[r] = work.after[b, r]
        if compliance > 0.0:
            u[r] += compliance * work.impulse[b, r] * work.delassus[b, 4]


@compiled
def block_residual(model, work, b, compliance):
    """Return the residual of a block's natural map, as a speed, from ``work.after``.

    For friction, ``work.projection`` gets the projection and its derivative.  What is not a number
    has the residual inf.
    """
    u, rho, norm = work.slip, work.delassus[b, 3], work.delassus[b, 4]
    yielding_velocity(work, b, compliance, u)
    if work.block_rows[b] == 0:
        far = abs(u[0])
        if not work.bilateral[b]:
            far = abs(max(0.0, work.impulse[b, 0] - u[0] * rho) - work.impulse[b, 0]) * norm
        return far if far < np.inf else np.inf
    out, two = work.projection[b], work.block_rows[b] == 2
    y = work.impulse[b, 1] - u[1] * rho if two else 0.0
    project(model, work.block_set[b], work.impulse[b, 0] - u[0] * rho, y, load_on(work, b), out)
    far = abs(out[0] - work.impulse[b, 0]) * norm
    across = abs(out[1] - work.impulse[b, 1]) * norm if two else 0.0
    return max(far, across) if far < np.inf and across < np.inf else np.inf


@compiled
def residual(model, work, first, last, compliance):
    """Return the largest residual of the natural map over the blocks of an island, as a speed.

    The velocities of the blocks' rows are left in ``work.after``.
    """
    worst = 0.0
    for s in range(first, last):
        b = work.order[s]
        velocity_of(model, work, b, work.v_new, work.after[b])
        worst = max(worst, block_residual(model, work, b, compliance))
    return worst


@compiled
def copy_impulses(work, first, last, source, target):
    """Copy the impulses of an island."""
    for s in range(first, last):
        b = work.order[s]
        for r in range(2):
            target[b, r] = source[b, r]


@compiled
def recompute_velocities(model, work, first, last):
    """Compute the velocities of an island from its impulses."""
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i >= 0:
                copy_velocity(model, work.v_free, work.v_new, i)
    for s in range(first, last):
        b = work.order[s]
        apply_impulses(model, work, b, work.impulse[b, 0], work.impulse[b, 1])
