"""Velocities, loads and impulses of single blocks."""

from polycorner.motion.engine.jit import compiled


@compiled
def velocity_of(model, work, b, v, out):
    """Evaluate the velocities ``J v + d`` of a block's rows."""
    k = model.dimension
    i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
    for r in range(max(1, work.block_rows[b])):
        value = work.offset[b, r]
        for c in range(k):
            value += work.jacobian[b, r, c] * v[i, c]
        if j >= 0:
            for c in range(k):
                value += work.jacobian[b, r, k + c] * v[j, c]
        out[r] = value


@compiled
def load_on(work, b):
    """Return the load on a friction contact: known, or an impulse, of an equation its magnitude."""
    pressing = work.pressing[b]
    if pressing < 0:
        return work.block_load[b]
    p = work.impulse[pressing, 0]
    return -p if p < 0.0 and work.bilateral[pressing] else p


@compiled
def apply_impulse(model, work, b, r, change):
    """Add an impulse of one row to the velocities of its bodies."""
    k = model.dimension
    i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
    if change == 0.0:
        return
    for c in range(k):
        work.v_new[i, c] += work.response[b, r, c] * change
    if j >= 0:
        for c in range(k):
            work.v_new[j, c] += work.response[b, r, k + c] * change
