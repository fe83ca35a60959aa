"""Blocks of a step: the rows of contacts, equations and friction, their velocities and impulses."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.motion.engine.arrays import (
    OWN_FRICTION,
    OWN_GAP,
    PAIR_FRICTION,
    PAIR_GAP,
    PLAIN,
    SETTLED,
    SMALL,
)
from polycorner.motion.engine.bounds import (
    acts,
    curvature_change,
    equation_offset,
    least_velocity,
    least_velocity_of,
)
from polycorner.motion.engine.evaluation import (
    ALONE,
    TOGETHER,
    evaluate_gaps,
    evaluate_pair_gaps,
)
from polycorner.motion.engine.jit import NONE, ONE, TWO, ZERO, compiled
from polycorner.motion.engine.neighbours import TOUCHING
from polycorner.motion.engine.partition import island_of
from polycorner.motion.engine.rows import (
    apply_impulses,
    copy_lanes,
    row_at,
    row_times,
    rows_product,
)
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import entry, load, store, zeros

DEPENDENT = 1e-4  # sine of the angle to other equations below which one follows from them
STRAIGHT = 1e-6  # of a step: parts in which the curvature of equations is nothing


@compiled
def finish_block(model, work, b):
    """Compute ``J v``, and responses unless the block may be of a crowd, which needs none."""
    i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
    for r in range(max(1, work.block_rows[b])):
        at = row_at(model, b, r)
        work.before[b, r] = row_times(model, work.jacobian, at, work.v_old, i, j)
        work.free[b, r] = row_times(model, work.jacobian, at, work.v_free, i, j)
    if model.crowd_sweeps == 0:
        respond_to_rows(model, work, b)


@compiled
def respond_to_rows(model, work, b):
    """Compute ``M^-1 J'`` and the Delassus matrix of a block."""
    rows, J, responses = max(1, work.block_rows[b]), work.jacobian, work.response
    i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
    for r in range(rows):
        at = row_at(model, b, r)
        respond(model, work, at, ZERO, i)
        if j >= 0:
            respond(model, work, at, model.lanes, j)
    one, other = row_at(model, b, ZERO), row_at(model, b, ONE)
    sides = ONE if j < 0 else TWO
    top = d00 = rows_product(model, J, one, responses, one, sides)
    d01 = d11 = 0.0
    if rows == 2:
        d01 = rows_product(model, J, one, responses, other, sides)
        d11 = rows_product(model, J, other, responses, other, sides)
        top = 0.5 * (d00 + d11) + np.sqrt((0.5 * (d00 - d11)) ** 2 + d01 * d01)
    work.delassus[b, 0], work.delassus[b, 1], work.delassus[b, 2] = d00, d01, d11
    top = top if top > 0.0 else 1.0
    work.delassus[b, 3], work.delassus[b, 4] = 1.0 / top, top


@compiled
def respond(model, work, at, side, i):
    """Compute the part of ``M^-1 J'`` of a row that belongs to one of its bodies."""
    k, K, J = model.dimension, model.lanes, work.jacobian
    for c in range(0, K, WIDTH):
        value = zeros()
        if work.awake[i]:
            for a in range(k):
                slope = entry(J, at + side + a)
                value = value + slope * load(work.inverse_mass, (i * k + a) * K + c)
        store(work.response, at + side + c, value)


@compiled
def is_independent(model, work, i, g):
    """Return whether an equation of a body does not follow from those before it.

    The gradients of those that do not are made orthonormal with the inverse mass matrix.
    """
    never_inline()
    k, row = model.dimension, work.equation_rows[g]
    square, left = 0.0, 0.0
    for c in range(k):
        row[c] = work.gradient[i, g, c]
    for other in range(model.unilateral, g + 1):
        product = 0.0
        base = work.equation_rows[other]
        for c in range(k):
            for a in range(k):
                product += base[c] * work.inverse_mass[i, c, a] * row[a]
        if other == g:
            left = product
        elif work.own_block[other] >= 0:
            for c in range(k):
                row[c] -= product * base[c]
    for c in range(k):
        for a in range(k):
            square += work.gradient[i, g, c] * work.inverse_mass[i, c, a] * work.gradient[i, g, a]
    if not left > DEPENDENT**2 * square:
        return False
    for c in range(k):
        row[c] /= np.sqrt(left)
    return True


@compiled
def new_block(work, b, first, second, rows):
    """Initialise a block without its Jacobian."""
    work.block_bodies[b, 0], work.block_bodies[b, 1], work.block_rows[b] = first, second, rows
    work.bilateral[b], work.pressing[b] = ZERO, -1
    work.block_load[b] = 0.0
    for r in range(2):
        work.offset[b, r] = 0.0
        work.impulse[b, r] = 0.0


@compiled
def kind_of_bound(model, closed, reached):
    """Return whether the gap of a closed contact is so small an error that it may be left."""
    return SMALL if closed and abs(reached) < TOUCHING * model.gap_unit else PLAIN


@compiled
def add_body_blocks(model, state, work, i, h, limit, count):
    """Append the blocks of a body's contacts with its surroundings; return the block count."""
    m, share = model.restitution.size, h / model.step
    block_of, predicted = work.own_block, False
    for g in range(m):
        block_of[g] = -1
        at, gap = (i * m + g) * model.lanes, work.gap[i, g]
        before = row_times(model, work.gradient, at, work.v_old, i, NONE)
        free = row_times(model, work.gradient, at, work.v_free, i, NONE)
        closed = state.touches[i, g] != 0
        close = gap + h * min(before, free, 0.0) < limit
        if work.located[0]:
            close = acts(model, work, gap, before, model.restitution[g], closed)
        if g >= model.unilateral:
            close = closed = is_independent(model, work, i, g)
        if not close and not closed:
            state.normal[i, g], state.pressed[i, g] = 0.0, 0.0
            continue
        if not predicted:
            evaluate_gaps(model, work, i, work.q_next, work.gap_next, work.gradient_next)
            predicted = True
        b = count
        count += 1
        block_of[g] = b
        new_block(work, b, i, NONE, ZERO)
        copy_lanes(model, work.gradient, at, work.jacobian, row_at(model, b, ZERO))
        change = 0.0
        if g >= model.unilateral:
            if h > STRAIGHT * model.step:
                change = work.gap_next[i, g] - gap - h * before
            work.bound[b] = PLAIN
            work.offset[b, 0] = equation_offset(model, gap, change, h)
            work.bilateral[b], work.bounces[b] = ONE, ZERO
        else:
            if closed or not work.located[0]:
                change = curvature_change(gap, before, work.gap_next[i, g], h, model.gap_unit)
            work.touched[i] = ALONE
            least, work.bounces[b] = least_velocity(
                model, work, gap, closed, before, free, change, model.restitution[g], h
            )
            work.offset[b, 0] = -least
            work.bound[b] = kind_of_bound(model, closed, gap + change)
        work.block_load[b] = -change
        work.origin[b, 0], work.origin[b, 1], work.origin[b, 2] = OWN_GAP, i, g
        work.impulse[b, 0] = state.normal[i, g] * share
        finish_block(model, work, b)
    for f in range(model.frictions):
        pressing = model.pressing_gap[f]
        if (pressing < 0 and work.load[i, f] <= 0.0) or (pressing >= 0 and block_of[pressing] < 0):
            state.friction[i, f, 0], state.friction[i, f, 1] = 0.0, 0.0
            state.sticks[i, f] = 0
            continue
        b = count
        count += 1
        first = model.slip_start[f]
        new_block(work, b, i, NONE, model.slip_start[f + 1] - first)
        work.touched[i] = ALONE
        for r in range(work.block_rows[b]):
            work.offset[b, r] = work.slip_offset[i, first + r]
            work.impulse[b, r] = state.friction[i, f, r] * share
            at = (i * model.slip_start[model.frictions] + first + r) * model.lanes
            copy_lanes(model, work.slip_rows, at, work.jacobian, row_at(model, b, r))
        work.block_set[b] = model.friction_sets[f, 0 if state.sticks[i, f] else 1]
        if pressing >= 0:
            work.pressing[b] = block_of[pressing]
        else:
            work.block_load[b] = work.load[i, f]
        work.origin[b, 0], work.origin[b, 1], work.origin[b, 2] = OWN_FRICTION, i, f
        finish_block(model, work, b)
    return count


@compiled
def add_pair_blocks(model, state, work, contact, h, count):
    """Append the blocks of a contact between two bodies; return the block count."""
    K = model.lanes
    i, j, g = work.contact[contact, 0], work.contact[contact, 1], work.contact[contact, 2]
    rows, at = work.contact_gradient, contact * 2 * K
    before = row_times(model, rows, at, work.v_old, i, j)
    free = row_times(model, rows, at, work.v_free, i, j)
    index, gap = work.contact_before[contact], work.contact_gap[contact]
    closed = index >= 0 and state.pair_flags[index, 1] != 0
    if work.located[0] and not acts(model, work, gap, before, model.pair_restitution, closed):
        return count
    n = count
    new_block(work, n, i, j, ZERO)
    work.touched[i] = work.touched[j] = TOGETHER
    copy_lanes(model, rows, at, work.jacobian, row_at(model, n, ZERO))
    copy_lanes(model, rows, at + K, work.jacobian, row_at(model, n, ZERO) + K)
    change = 0.0
    if closed or not work.located[0]:
        change = curvature_change(gap, before, work.pair_gap_next[g], h, model.gap_unit)
    least, work.bounces[n] = least_velocity(
        model, work, gap, closed, before, free, change, model.pair_restitution, h
    )
    work.offset[n, 0] = -least
    work.block_load[n] = -change
    work.bound[n] = kind_of_bound(model, closed, gap + change)
    work.origin[n, 0], work.origin[n, 1], work.origin[n, 2] = PAIR_GAP, contact, g
    work.impulse[n, 0] = work.contact_impulse[contact, 0]
    finish_block(model, work, n)
    return count + 1 if model.pair_laws == 0 else add_friction(model, state, work, contact, n)


@compiled
def add_friction(model, state, work, contact, pressing):
    """Append the blocks of friction at a contact after that which presses; return the count."""
    k, K, scratch, reads = model.dimension, model.lanes, work.scratch, model.pair_inputs
    i, j, g = work.contact[contact, 0], work.contact[contact, 1], work.contact[contact, 2]
    address, p0, starts = model.pair_slips[g, 0], model.pair_slips[g, 2], model.pair_slip_start
    first, second = (j, i) if model.pair_slips[g, 1] else (i, j)
    for a in range(reads):
        body = first if model.pair_reads[a, 0] == 0 else second
        scratch[a] = work.q_mid[body, model.pair_reads[a, 1]]
    for c in range(k):
        scratch[reads + c], scratch[reads + k + c] = state.v[first, c], state.v[second, c]
    start, base = scratch.ctypes.data, model.parameters.ctypes.data
    v0 = reads + 2 * k
    j0 = v0 + starts[model.pair_laws]
    call_kernel(address, start, base + 8 * p0, start + 8 * v0, start + 8 * j0, start)
    index = work.contact_before[contact]
    stuck = state.pair_flags[index, 0] if index >= 0 else ZERO
    for f in range(model.pair_laws):
        b = pressing + 1 + f
        new_block(work, b, first, second, starts[f + 1] - starts[f])
        for r in range(work.block_rows[b]):
            row = starts[f] + r
            value = scratch[v0 + row]
            for c in range(2 * k):
                slope = scratch[j0 + row * v0 + reads + c]
                work.jacobian[b, r, c if c < k else K + c - k] = slope
                value -= slope * scratch[reads + c]
            work.offset[b, r] = value
            work.impulse[b, r] = work.contact_impulse[contact, 1 + row]
        work.block_set[b] = model.pair_sets[f, 0 if stuck >> f & 1 else 1]
        work.pressing[b] = pressing
        work.origin[b, 0], work.origin[b, 1], work.origin[b, 2] = PAIR_FRICTION, contact, f
        finish_block(model, work, b)
    return pressing + 1 + model.pair_laws


@compiled
def assemble_body_blocks(model, state, work, h, limit):
    """Assemble the blocks of all awake bodies and their surroundings; return their number."""
    blocks = ZERO
    for i in range(model.bodies):
        if state.alive[i] and work.awake[i] and not work.apart[i]:
            blocks = add_body_blocks(model, state, work, i, h, limit, blocks)
    return blocks


@compiled
def assemble_contacts(model, state, work, h, begin, end, blocks):
    """Assemble the blocks of a range of contacts in their order; return the block count."""
    first, second = NONE, NONE
    for s in range(begin, end):
        contact = work.ranked[s]
        if work.contact[contact, 0] != first or work.contact[contact, 1] != second:
            first, second = work.contact[contact, 0], work.contact[contact, 1]
            evaluate_pair_gaps(model, work, first, second, work.q_next)
            for g in range(model.pair_gaps):
                work.pair_gap_next[g] = work.scratch[model.pair_inputs + g]
        blocks = add_pair_blocks(model, state, work, contact, h, blocks)
    return blocks


@compiled
def renew_blocks(model, state, work, blocks, h):
    """Start blocks that were solved from their impulses, with new velocities after forces alone.

    The least velocities that contacts allow follow, unless they were changed for other reasons.
    Settled islands remain.
    """
    for b in range(blocks):
        if work.stage[island_of(work, b)] == SETTLED:
            continue
        i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
        if j >= 0:
            work.touched[i] = work.touched[j] = TOGETHER
        elif not work.bilateral[b]:
            work.touched[i] = max(work.touched[i], ALONE)
        former = work.free[b, 0]
        for r in range(max(1, work.block_rows[b])):
            at = row_at(model, b, r)
            work.free[b, r] = row_times(model, work.jacobian, at, work.v_free, i, j)
        if work.block_rows[b] == 0 and not work.bilateral[b]:
            least = least_velocity_of(model, state, work, b, former, h)
            if work.offset[b, 0] == -least:
                work.offset[b, 0] = -least_velocity_of(model, state, work, b, work.free[b, 0], h)
        apply_impulses(model, work, b, work.impulse[b, 0], work.impulse[b, 1])
