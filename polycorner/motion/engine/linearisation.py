"""Linearisation of the natural map of single blocks."""

from polycorner.motion.engine.gauss_seidel import yielding_velocity
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.rows import load_on


@compiled
def linearise_block(work, b, softness, compliance):
    """Linearise the natural map of a block, whose residual was evaluated.

    ``work.derivative`` and ``work.constant`` get ``G`` and ``a`` of the Newton step
    ``dp = a - G J dv``.
    """
    u, derivative, constant = work.slip, work.derivative, work.constant
    yielding_velocity(work, b, compliance, u)
    if work.block_rows[b] > 0:
        linearise_friction(work, b, softness, u)
        return
    p, rho = work.impulse[b, 0], work.delassus[b, 3]
    if p - rho * u[0] <= 0.0 and not work.bilateral[b]:
        derivative[b, 4], constant[b, 0] = 0.0, -p
    else:
        stiffness = rho / softness
        derivative[b, 4], constant[b, 0] = stiffness, -stiffness * u[0]


@compiled
def is_loaded(work, b):
    """Return whether the impulses of a block that was linearised depend on velocities."""
    if work.block_rows[b] == 0:
        return work.derivative[b, 4] > 0.0
    return work.pressing[b] < 0 or load_on(work, b) > 0.0


@compiled
def change_impulses(work, b, normal, along, across, change):
    """Change the impulses of a block by ``a - G J dv``.

    ``J dv`` of the row that presses and of the block's own are given, for rows that there are;
    ``change`` gets what is added.
    """
    derivative, pressing, rows = work.derivative, work.pressing[b], max(1, work.block_rows[b])
    change[1] = 0.0
    for r in range(rows):
        change[r] = work.constant[b, r] - derivative[b, 4 + 3 * r] * along
        if pressing >= 0:
            change[r] -= derivative[b, 3 + 3 * r] * normal
        if rows == 2:
            change[r] -= derivative[b, 5 + 3 * r] * across
        work.impulse[b, r] += change[r]


@compiled
def linearise_friction(work, b, softness, u):
    """Linearise the natural map of one friction contact."""
    derivative, rho, out = work.derivative, work.delassus[b, 3], work.projection[b]
    d, pressing = work.block_rows[b], work.pressing[b]
    load = load_on(work, b)
    px, py = work.impulse[b, 0], work.impulse[b, 1] if d == 2 else 0.0
    zx, zy = px - rho * u[0], py - rho * u[1] if d == 2 else 0.0
    fx, fy = px - out[0], py - out[1] if d == 2 else 0.0
    d00, d01, d10, d11 = out[2], out[3], out[4], out[5]
    if d == 1:
        d01 = d10 = d11 = 0.0
    if pressing >= 0 and load > 0.0:  # the load changes as well
        per_load = (1.0 if work.impulse[pressing, 0] > 0.0 else -1.0) / load
        change = work.constant[pressing, 0] * per_load
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
    work.constant[b, 0], work.constant[b, 1] = -(i00 * fx + i01 * fy), -(i10 * fx + i11 * fy)
