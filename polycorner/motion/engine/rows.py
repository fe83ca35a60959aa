"""Rows of blocks: their products with velocities, and their impulses.

A row has ``model.lanes`` numbers for each of two bodies: those of its coordinates, and zeros up to
whole vectors; so have all velocities that it is multiplied by.
"""

from polycorner.motion.engine.jit import ZERO, compiled
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import load, store, total, zeros


@compiled
def row_at(model, b, r):
    """Return where a row of a block stands among the Jacobians or responses."""
    return (2 * b + r) * 2 * model.lanes


@compiled
def row_times(model, rows, at, v, i, j):
    """Return the product of a row with the velocities of bodies ``i`` and ``j`` (-1: none)."""
    K, value = model.lanes, zeros()
    if i >= 0:
        for c in range(0, K, WIDTH):
            value = value + load(rows, at + c) * load(v, i * K + c)
    if j >= 0:
        for c in range(0, K, WIDTH):
            value = value + load(rows, at + K + c) * load(v, j * K + c)
    return total(value)


@compiled
def terms_square(model, rows, at, v, i, j):
    """Return the sum of the squares of the terms of :func:`row_times`."""
    K, value = model.lanes, zeros()
    for side in range(2):
        body = j if side else i
        for c in range(0, K if body >= 0 else ZERO, WIDTH):
            term = load(rows, at + side * K + c) * load(v, body * K + c)
            value = value + term * term
    return total(value)


@compiled
def rows_product(model, first, at, second, other, sides):
    """Return the product of two rows over so many bodies."""
    value = zeros()
    for c in range(0, sides * model.lanes, WIDTH):
        value = value + load(first, at + c) * load(second, other + c)
    return total(value)


@compiled
def add_row(model, rows, at, factor, v, i, j):
    """Add a multiple of a row to the velocities of bodies ``i`` and ``j`` (-1: none)."""
    K = model.lanes
    if i >= 0:
        for c in range(0, K, WIDTH):
            store(v, i * K + c, load(v, i * K + c) + factor * load(rows, at + c))
    if j >= 0:
        for c in range(0, K, WIDTH):
            store(v, j * K + c, load(v, j * K + c) + factor * load(rows, at + K + c))


@compiled
def add_rows(model, block, rows, b, f, g, v, i, j):
    """Add ``f`` times the first row of a block and ``g`` times the second, if there is one."""
    at = row_at(model, b, 0)
    if block.rows[b] == 2:
        add_two_rows(model, rows, at, f, at + 2 * model.lanes, g, v, i, j)
    else:
        add_row(model, rows, at, f, v, i, j)


@compiled
def add_two_rows(model, rows, at, f, other, g, v, i, j):
    """Add multiples of two rows to the velocities of bodies ``i`` and ``j`` (-1: none)."""
    K = model.lanes
    for side in range(2):
        body = j if side else i
        if body < 0:
            continue
        for c in range(0, K, WIDTH):
            more = f * load(rows, at + side * K + c) + g * load(rows, other + side * K + c)
            store(v, body * K + c, load(v, body * K + c) + more)


@compiled
def copy_lanes(model, source, at, target, to):
    """Copy the numbers of one body from one array to another, from and to these places."""
    for c in range(0, model.lanes, WIDTH):
        store(target, to + c, load(source, at + c))


@compiled
def copy_velocity(model, source, target, i):
    """Copy the velocity of body ``i``."""
    copy_lanes(model, source, i * model.lanes, target, i * model.lanes)


@compiled
def velocity_of(model, block, b, v, out):
    """Evaluate the velocities ``J v + d`` of a block's rows."""
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    for r in range(max(1, block.rows[b])):
        product = row_times(model, block.jacobian, row_at(model, b, r), v, i, j)
        out[r] = block.offset[b, r] + product


@compiled
def load_on(block, b):
    """Return the load on a friction contact: known, or an impulse, of an equation its magnitude."""
    pressing = block.pressing[b]
    if pressing < 0:
        return block.load[b]
    p = block.impulse[pressing, 0] + block.returned[pressing]
    return -p if p < 0.0 and block.bilateral[pressing] else p


@compiled
def apply_impulses(model, velocity, block, b, along, across):
    """Add impulses of the rows of a block to the velocities of its bodies."""
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    if along != 0.0 or across != 0.0:
        add_rows(model, block, block.response, b, along, across, velocity.new, i, j)


@compiled
def speed_at(body, block, b):
    """Return the largest velocity in the island of a block."""
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    return body.island_speed[i] if j < 0 else max(body.island_speed[i], body.island_speed[j])


@compiled
def slip_to_target(block, b, r):
    """Return the velocity of a row that the law of its block reads, ``u - c``."""
    return block.after[b, r] - block.target[b, r]


@compiled
def sticks(model, body, block, b):
    """Return whether a friction contact sticks: its slip is ``c`` within the solver's accuracy."""
    slip = abs(slip_to_target(block, b, 0))
    slip += abs(slip_to_target(block, b, 1)) if block.rows[b] == 2 else 0.0
    return slip <= 2.0 * model.tolerance * speed_at(body, block, b)
