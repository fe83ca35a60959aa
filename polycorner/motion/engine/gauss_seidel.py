"""Gauss-Seidel sweeps over the blocks of an island."""

import numpy as np

from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.rows import (
    apply_impulses,
    copy_velocity,
    load_on,
    slip_to_target,
    velocity_of,
)
from polycorner.motion.engine.sets import contains, project

EXACT = 1e-12  # determinant of two rows, over the product of their squares, to solve for both


@compiled
def relax_block(model, velocity, block, scratch, b):
    """Solve one block with all others fixed; return its residual, as a speed."""
    u, out = scratch.slip, scratch.image
    pressing = block.pressing[b]
    if (
        pressing >= 0
        and load_on(block, b) <= 0.0
        and block.impulse[b, 0] == 0.0
        and block.impulse[b, 1] == 0.0
    ):
        return 0.0
    velocity_of(model, block, b, velocity.new, u)
    rho, norm = block.delassus[b, 3], block.delassus[b, 4]
    if block.rows[b] == 0:
        p = block.impulse[b, 0]
        new = p - u[0] * rho
        # So written that what is not a number becomes zero, and the sweep goes on.
        if not (new > 0.0 or block.bilateral[b]):
            new = 0.0
        if new != p:
            apply_impulses(model, velocity, block, b, new - p, 0.0)
            block.impulse[b, 0] = new
        return abs(new - p) * norm
    load = load_on(block, b)
    shape = block.set[b]
    x, y = block.impulse[b, 0], block.impulse[b, 1]
    u[0], u[1] = u[0] - block.target[b, 0], u[1] - block.target[b, 1]
    if block.rows[b] == 1:
        project(model, shape, x - u[0] * rho, 0.0, load, out)
        far = abs(out[0] - x) * norm
        if out[0] != x:
            apply_impulses(model, velocity, block, b, out[0] - x, 0.0)
            block.impulse[b, 0] = out[0]
        return far
    project(model, shape, x - u[0] * rho, y - u[1] * rho, load, out)
    far = np.sqrt((out[0] - x) ** 2 + (out[1] - y) ** 2) * norm
    d00, d01, d11 = block.delassus[b, 0], block.delassus[b, 1], block.delassus[b, 2]
    # Sticking is solved exactly; only what slides needs the projection, whose step suits the
    # stiffer direction only.
    determinant = d00 * d11 - d01 * d01
    if load > 0.0 and determinant > EXACT * d00 * d11:
        sx = x - (d11 * u[0] - d01 * u[1]) / determinant
        sy = y - (d00 * u[1] - d01 * u[0]) / determinant
        if contains(model, shape, sx, sy, load, 0.0):
            out[0], out[1] = sx, sy
    apply_impulses(model, velocity, block, b, out[0] - x, out[1] - y)
    block.impulse[b, 0], block.impulse[b, 1] = out[0], out[1]
    return far


@compiled
def yielding_velocity(block, b, compliance, u):
    """Evaluate ``J v + d - c + e p / rho``: the velocities of rows that yield to their impulses.

    ``block.after`` must be ``J v + d``; ``e`` is the compliance.
    """
    for r in range(max(1, block.rows[b])):
        u[r] = slip_to_target(block, b, r)
        if compliance > 0.0:
            u[r] += compliance * block.impulse[b, r] * block.delassus[b, 4]


@compiled
def block_residual(model, block, search, scratch, b, compliance):
    """Return the residual of a block's natural map, as a speed, from ``block.after``.

    For friction, ``search.projection`` gets the projection and its derivative.  What is not a
    number has the residual inf.
    """
    u, rho, norm = scratch.slip, block.delassus[b, 3], block.delassus[b, 4]
    yielding_velocity(block, b, compliance, u)
    if block.rows[b] == 0:
        far = abs(u[0])
        if not block.bilateral[b]:
            far = abs(max(0.0, block.impulse[b, 0] - u[0] * rho) - block.impulse[b, 0]) * norm
        return far if far < np.inf else np.inf
    out, two = search.projection[b], block.rows[b] == 2
    y = block.impulse[b, 1] - u[1] * rho if two else 0.0
    project(model, block.set[b], block.impulse[b, 0] - u[0] * rho, y, load_on(block, b), out)
    far = abs(out[0] - block.impulse[b, 0]) * norm
    across = abs(out[1] - block.impulse[b, 1]) * norm if two else 0.0
    return max(far, across) if far < np.inf and across < np.inf else np.inf


@compiled
def residual(model, velocity, block, search, scratch, first, last, compliance):
    """Return the largest residual of the natural map over the blocks of an island, as a speed.

    The velocities of the blocks' rows are left in ``block.after``.
    """
    worst = 0.0
    for s in range(first, last):
        b = block.order[s]
        velocity_of(model, block, b, velocity.new, block.after[b])
        worst = max(worst, block_residual(model, block, search, scratch, b, compliance))
    return worst


@compiled
def copy_impulses(block, first, last, source, target):
    """Copy impulses, or offsets, of the blocks of an island."""
    for s in range(first, last):
        b = block.order[s]
        for r in range(2):
            target[b, r] = source[b, r]


@compiled
def recompute_velocities(model, velocity, block, first, last):
    """Compute the velocities of an island from its impulses."""
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i >= 0:
                copy_velocity(model, velocity.free, velocity.new, i)
    for s in range(first, last):
        b = block.order[s]
        apply_impulses(model, velocity, block, b, block.impulse[b, 0], block.impulse[b, 1])
