"""Blocks of a step: the rows of contacts, equations and friction, their velocities and impulses."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import (
    AT_END,
    AT_MEAN,
    OWN_FRICTION,
    OWN_GAP,
    OWN_LIMIT,
    PAIR_FRICTION,
    PAIR_GAP,
    PLAIN,
    SETTLED,
    SMALL,
    TIE_GAP,
)
from polycorner.motion.engine.bounds import (
    STRAIGHT,
    acts,
    curvature_change,
    equation_offset,
    least_velocity,
    least_velocity_of,
)
from polycorner.motion.engine.evaluation import (
    ALONE,
    TOGETHER,
    call_pair_slips,
    evaluate_gaps,
    evaluate_slips,
    evaluate_wanted_gaps,
)
from polycorner.motion.engine.families import coordinates_of, family_of, pair_inputs
from polycorner.motion.engine.jit import NONE, ONE, TWO, ZERO, compiled
from polycorner.motion.engine.mean_slip import aim
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


@compiled
def finish_block(model, mid, velocity, body, block, b):
    """Compute ``J v``, and responses unless the block may be of a crowd, which needs none."""
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    for r in range(max(1, block.rows[b])):
        at = row_at(model, b, r)
        block.before[b, r] = row_times(model, block.jacobian, at, velocity.old, i, j)
        block.free[b, r] = row_times(model, block.jacobian, at, velocity.free, i, j)
    # Which blocks are of a crowd is known only when islands are found: others respond then.
    if model.crowd_sweeps == 0:
        respond_to_rows(model, mid, body, block, b)


@compiled
def respond_to_rows(model, mid, body, block, b):
    """Compute ``M^-1 J'`` and the Delassus matrix of a block."""
    rows, J, responses = max(1, block.rows[b]), block.jacobian, block.response
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    for r in range(rows):
        at = row_at(model, b, r)
        respond(model, mid, body, block, at, ZERO, i)
        if j >= 0:
            respond(model, mid, body, block, at, model.lanes, j)
    one, other = row_at(model, b, ZERO), row_at(model, b, ONE)
    sides = ONE if j < 0 else TWO
    top = d00 = rows_product(model, J, one, responses, one, sides)
    d01 = d11 = 0.0
    if rows == 2:
        d01 = rows_product(model, J, one, responses, other, sides)
        d11 = rows_product(model, J, other, responses, other, sides)
        top = 0.5 * (d00 + d11) + np.sqrt((0.5 * (d00 - d11)) ** 2 + d01 * d01)
    block.delassus[b, 0], block.delassus[b, 1], block.delassus[b, 2] = d00, d01, d11
    # A row that moves nothing, as between two sleepers, gets a step length all the same, that
    # nobody divides by zero.
    top = top if top > 0.0 else 1.0
    block.delassus[b, 3], block.delassus[b, 4] = 1.0 / top, top


@compiled
def respond(model, mid, body, block, at, side, i):
    """Compute the part of ``M^-1 J'`` of a row that belongs to one of its bodies."""
    k, K, J = model.dimension, model.lanes, block.jacobian
    for c in range(0, K, WIDTH):
        value = zeros()
        # A sleeper has infinite mass: it is not moved, and what acts on it is judged afterwards.
        if body.awake[i]:
            for a in range(k):
                slope = entry(J, at + side + a)
                value = value + slope * load(mid.inverse_mass, (i * k + a) * K + c)
        store(block.response, at + side + c, value)


@compiled
def is_independent(model, mid, scratch, i, g):
    """Return whether an equation of a body does not follow from those before it.

    The gradients of those that do not are made orthonormal with the inverse mass matrix.
    """
    never_inline()
    k, start = model.dimension, model.first_gap[i]
    row, square, left = scratch.equation_rows[g - start], 0.0, 0.0
    for c in range(k):
        row[c] = mid.gradient[g, c]
    for other in range(model.first_equation[i], g + 1):
        product = 0.0
        # Equations that were left out before have no direction of their own to be taken away.
        base = scratch.equation_rows[other - start]
        for c in range(k):
            for a in range(k):
                product += base[c] * mid.inverse_mass[i, c, a] * row[a]
        if other == g:
            left = product
        elif scratch.own_block[other - start] >= 0:
            for c in range(k):
                row[c] -= product * base[c]
    for c in range(k):
        for a in range(k):
            square += mid.gradient[g, c] * mid.inverse_mass[i, c, a] * mid.gradient[g, a]
    if not left > model.dependent**2 * square:
        return False
    for c in range(k):
        row[c] /= np.sqrt(left)
    return True


@compiled
def new_block(block, b, first, second, rows):
    """Initialise a block without its Jacobian."""
    block.bodies[b, 0], block.bodies[b, 1], block.rows[b] = first, second, rows
    # All that is not set for every kind of block: numbers of blocks change from step to step.
    block.bilateral[b], block.pressing[b], block.bound[b] = ZERO, -1, PLAIN
    block.load[b] = block.returned[b] = 0.0
    block.law[b] = AT_END
    for r in range(2):
        block.offset[b, r] = block.target[b, r] = 0.0
        block.impulse[b, r] = 0.0


@compiled
def touch_tied(body, block, b):
    """Note that the bodies of a tie are touched: velocities are solved for that hold them."""
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    body.touched[i] = max(body.touched[i], ALONE)
    if j >= 0:
        body.touched[j] = max(body.touched[j], ALONE)


@compiled
def kind_of_bound(model, closed, reached):
    """Return whether the gap of a closed contact is so small an error that it may be left."""
    return SMALL if closed and abs(reached) < model.touching else PLAIN


@compiled
def add_body_blocks(model, state, work, i, h, limit, count):
    """Append the blocks of a body's contacts with its surroundings; return the block count."""
    manner, mid, velocity, body, ahead = work.manner, work.mid, work.velocity, work.body, work.ahead
    block, scratch = work.block, work.scratch
    share, start, bound = h / model.step, model.first_gap[i], model.first_equation[i]
    block_of, predicted = scratch.own_block, False
    for g in range(start, model.first_gap[i + 1]):
        block_of[g - start] = -1
        at, gap = g * model.lanes, mid.gap[g]
        before = row_times(model, mid.gradient, at, velocity.old, i, NONE)
        free = row_times(model, mid.gradient, at, velocity.free, i, NONE)
        closed = state.touches[g] != 0
        close = gap + h * min(before, free, 0.0) < limit
        if manner.located[0]:
            close = acts(model, manner, gap, before, model.restitution[g], closed)
        if g >= bound:
            close = closed = is_independent(model, mid, scratch, i, g)
        if not close and not closed:
            state.normal[g], state.pressed[g] = 0.0, 0.0
            continue
        if not predicted:
            # Only for bodies with a contact: the evaluation costs as much as that of the midpoint.
            evaluate_gaps(model, scratch, i, ahead.q, h, ahead.gap, ahead.gradient)
            predicted = True
        b = count
        count += 1
        block_of[g - start] = b
        new_block(block, b, i, NONE, ZERO)
        copy_lanes(model, mid.gradient, at, block.jacobian, row_at(model, b, ZERO))
        change = 0.0
        if g >= bound:
            # In an instant nothing curves, and a change over h would be rounding over next to
            # nothing.
            if h > STRAIGHT * model.step:
                change = ahead.gap[g] - gap - h * before
            block.offset[b, 0] = equation_offset(model, gap, change, h)
            block.bilateral[b], block.bounces[b] = ONE, ZERO
        else:
            if closed or not manner.located[0]:
                change = curvature_change(model, gap, before, ahead.gap[g], h)
            body.touched[i] = ALONE
            least, block.bounces[b] = least_velocity(
                model, manner, gap, closed, before, free, change, model.restitution[g], h
            )
            block.offset[b, 0] = -least
            block.law[b] = AT_END if closed and not block.bounces[b] else AT_MEAN
            block.bound[b] = kind_of_bound(model, closed, gap + change)
        block.load[b] = -change
        block.origin[b, 0], block.origin[b, 1], block.origin[b, 2] = OWN_GAP, i, g
        block.impulse[b, 0] = state.normal[g] * share
        finish_block(model, mid, velocity, body, block, b)
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        pressing = model.pressing_gap[f]
        if pressing >= 0 and block_of[pressing - start] >= 0:
            mid.slip_wanted[f] = 1
    evaluate_slips(model, state, mid, scratch, i)
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        pressing = model.pressing_gap[f]
        presses = block_of[pressing - start] if pressing >= 0 else NONE
        if presses < 0 and (pressing >= 0 or mid.load[f] <= 0.0):
            state.friction[f, 0], state.friction[f, 1] = 0.0, 0.0
            state.sticks[f] = 0
            continue
        b = count
        count += 1
        first = model.slip_start[f]
        new_block(block, b, i, NONE, model.slip_start[f + 1] - first)
        body.touched[i] = ALONE
        for r in range(block.rows[b]):
            block.offset[b, r] = mid.slip_offset[first + r]
            block.impulse[b, r] = state.friction[f, r] * share
            at = (first + r) * model.lanes
            copy_lanes(model, mid.slip_rows, at, block.jacobian, row_at(model, b, r))
        block.set[b] = model.friction_sets[f, 0 if state.sticks[f] else 1]
        if pressing >= 0:
            block.pressing[b] = presses
        else:
            block.load[b] = mid.load[f]
        block.origin[b, 0], block.origin[b, 1], block.origin[b, 2] = OWN_FRICTION, i, f
        finish_block(model, mid, velocity, body, block, b)
        if model.friction_turns[f]:
            aim(model, velocity, block, b, state.sticks[f], h)
    return count


@compiled
def add_pair_blocks(model, state, work, contact, h, count):
    """Append the blocks of a contact between two bodies; return the block count."""
    manner, velocity, body = work.manner, work.velocity, work.body
    pair, block = work.pair, work.block
    K = model.lanes
    i, j, g = pair.contact[contact, 0], pair.contact[contact, 1], pair.contact[contact, 2]
    rows, at = pair.gradient, contact * 2 * K
    before = row_times(model, rows, at, velocity.old, i, j)
    free = row_times(model, rows, at, velocity.free, i, j)
    index, gap = pair.before[contact], pair.gap[contact]
    closed = index >= 0 and state.pair_flags[index, 1] != 0
    family = family_of(model, i, j)
    bounce = model.pair_restitution[family]
    if manner.located[0] and not acts(model, manner, gap, before, bounce, closed):
        return count
    n = count
    new_block(block, n, i, j, ZERO)
    body.touched[i] = body.touched[j] = TOGETHER
    copy_lanes(model, rows, at, block.jacobian, row_at(model, n, ZERO))
    copy_lanes(model, rows, at + K, block.jacobian, row_at(model, n, ZERO) + K)
    change = 0.0
    if closed or not manner.located[0]:
        change = curvature_change(model, gap, before, work.scratch.pair_gap[g], h)
    least, block.bounces[n] = least_velocity(
        model, manner, gap, closed, before, free, change, bounce, h
    )
    block.offset[n, 0] = -least
    block.law[n] = AT_END if closed and not block.bounces[n] else AT_MEAN
    block.load[n] = -change
    block.bound[n] = kind_of_bound(model, closed, gap + change)
    block.origin[n, 0], block.origin[n, 1], block.origin[n, 2] = PAIR_GAP, contact, g
    block.impulse[n, 0] = pair.impulse[contact, 0]
    finish_block(model, work.mid, velocity, body, block, n)
    if model.first_law[family] == model.first_law[family + 1]:
        return count + 1
    return add_friction(model, state, work, contact, n, h)


@compiled
def add_friction(model, state, work, contact, pressing, h):
    """Append the blocks of friction at a contact after that which presses; return the count."""
    mid, pair, block = work.mid, work.pair, work.block
    K, values = model.lanes, work.scratch.values
    i, j, g = pair.contact[contact, 0], pair.contact[contact, 1], pair.contact[contact, 2]
    family = family_of(model, i, j)
    slip, reads = model.first_pair_slip[family] + g, pair_inputs(model, family)
    turns = model.pair_slips[slip, 3] != 0
    first_law, last_law = model.first_law[family], model.first_law[family + 1]
    # One kernel serves both orders of two bodies, so that a pair has the same bits whichever comes
    # first.
    first, second = (j, i) if model.pair_slips[slip, 1] else (i, j)
    one, two = coordinates_of(model, first), coordinates_of(model, second)
    v0 = call_pair_slips(model, work.scratch, first, second, slip, mid.q, state.v)
    j0 = v0 + model.law_start[last_law - 1] + model.law_rows[last_law - 1]
    index = pair.before[contact]
    stuck = state.pair_flags[index, 0] if index >= 0 else ZERO
    for f in range(first_law, last_law):
        b = pressing + 1 + f - first_law
        new_block(block, b, first, second, model.law_rows[f])
        for r in range(block.rows[b]):
            row = model.law_start[f] + r
            value = values[v0 + row]
            for c in range(K):  # another block may have stood here, of bodies of other kinds
                block.jacobian[b, r, c] = block.jacobian[b, r, K + c] = 0.0
            for c in range(one + two):
                slope = values[j0 + row * v0 + reads + c]
                block.jacobian[b, r, c if c < one else K + c - one] = slope
                value -= slope * values[reads + c]
            block.offset[b, r] = value
            block.impulse[b, r] = pair.impulse[contact, 1 + row]
        held = stuck >> (f - first_law) & 1
        block.set[b] = model.pair_sets[f, 0 if held else 1]
        block.pressing[b] = pressing
        block.origin[b, 0], block.origin[b, 1], block.origin[b, 2] = PAIR_FRICTION, contact, f
        finish_block(model, mid, work.velocity, work.body, block, b)
        if turns:
            aim(model, work.velocity, block, b, held, h)
    return pressing + 1 + last_law - first_law


@compiled
def assemble_body_blocks(model, state, work, h, limit):
    """Assemble the blocks of all awake bodies and their surroundings; return their number."""
    body = work.body
    blocks = ZERO
    for i in range(model.bodies):
        if state.alive[i] and body.awake[i] and not body.apart[i]:
            blocks = add_body_blocks(model, state, work, i, h, limit, blocks)
    return blocks


@compiled
def place_blocks(model, pair, contacts, first):
    """Note where the blocks of each contact begin, the first at a place; return where they end."""
    for s in range(contacts):
        contact = pair.ranked[s]
        family = family_of(model, pair.contact[contact, 0], pair.contact[contact, 1])
        pair.first_block[s] = first
        first += 1 + model.first_law[family + 1] - model.first_law[family]
    return first


@compiled
def is_between(pair, contact, first, second):
    """Return whether a contact is one of two bodies."""
    return pair.contact[contact, 0] == first and pair.contact[contact, 1] == second


@compiled
def assemble_contacts(model, state, work, h, begin, end, blocks):
    """Assemble the blocks of a range of contacts in their order; return the block count."""
    pair, scratch = work.pair, work.scratch
    first, second = NONE, NONE
    for s in range(begin, end):
        contact = pair.ranked[s]
        # Contacts of one pair follow each other: its gaps are evaluated once.
        if not is_between(pair, contact, first, second):
            first, second = pair.contact[contact, 0], pair.contact[contact, 1]
            last = s + 1
            while last < end and is_between(pair, pair.ranked[last], first, second):
                last += 1
            for t in range(s, last):
                scratch.wanted[pair.contact[pair.ranked[t], 2]] = 1.0
            evaluate_wanted_gaps(model, scratch, first, second, work.ahead.q)
            n = pair_inputs(model, family_of(model, first, second))
            for t in range(s, last):
                g = pair.contact[pair.ranked[t], 2]
                scratch.pair_gap[g], scratch.wanted[g] = scratch.values[n + g], 0.0
        blocks = add_pair_blocks(model, state, work, contact, h, blocks)
    return blocks


@compiled
def renew_blocks(model, state, work, blocks, h):
    """Start blocks that were solved from their impulses, with new velocities after forces alone.

    The least velocities that contacts allow follow, unless they were changed for other reasons.
    Settled islands remain.
    """
    manner, mid, velocity = work.manner, work.mid, work.velocity
    body, island = work.body, work.island
    pair, block = work.pair, work.block
    for b in range(blocks):
        if island.stage[island_of(body, island, block, b)] == SETTLED:
            continue
        i, j = block.bodies[b, 0], block.bodies[b, 1]
        if block.origin[b, 0] >= TIE_GAP:
            touch_tied(body, block, b)
        elif j >= 0:
            body.touched[i] = body.touched[j] = TOGETHER
        elif not block.bilateral[b]:
            body.touched[i] = max(body.touched[i], ALONE)
        former = block.free[b, 0]
        for r in range(max(1, block.rows[b])):
            at = row_at(model, b, r)
            block.free[b, r] = row_times(model, block.jacobian, at, velocity.free, i, j)
        limits = block.origin[b, 0] == OWN_LIMIT  # corrected by themselves
        if block.rows[b] == 0 and not (block.bilateral[b] or limits):
            least = least_velocity_of(
                model, state, manner, mid, pair, work.tie, block, b, former, h
            )
            # Only a bound that is still that of the velocities before: others were moved on
            # purpose, by curvature or at rest.
            if block.offset[b, 0] == -least:
                block.offset[b, 0] = -least_velocity_of(
                    model, state, manner, mid, pair, work.tie, block, b, block.free[b, 0], h
                )
        apply_impulses(model, velocity, block, b, block.impulse[b, 0], block.impulse[b, 1])


@compiled
def predict_body(model, state, work, i, h, limit):
    """Predict the next midpoint of a body, and note whether it is far from its surroundings.

    That is asked only where there may be crowds: most of their bodies are.
    """
    manner, mid, velocity, body = work.manner, work.mid, work.velocity, work.body
    for c in range(model.dimension):
        work.ahead.q[i, c] = mid.q[i, c] + h * state.v[i, c]
    if model.crowd_sweeps > 0 and state.alive[i] and body.awake[i]:
        body.apart[i] = 1 if is_apart(model, state, manner, mid, velocity, i, h, limit) else 0


@compiled
def is_apart(model, state, manner, mid, velocity, i, h, limit):
    """Return whether a body has no block with its surroundings; then they press on it no more."""
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        if model.pressing_gap[f] < 0 and mid.load[f] > 0.0:
            return False
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        at = g * model.lanes
        before = row_times(model, mid.gradient, at, velocity.old, i, NONE)
        free = row_times(model, mid.gradient, at, velocity.free, i, NONE)
        close = mid.gap[g] + h * min(before, free, 0.0) < limit
        # The same conditions as in :func:`add_body_blocks`, so that leaving a body out changes no
        # bit.
        bilateral = g >= model.first_equation[i]
        if bilateral or close or state.touches[g] != 0 or manner.located[0]:
            return False
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        state.normal[g], state.pressed[g] = 0.0, 0.0
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        state.friction[f, 0], state.friction[f, 1] = 0.0, 0.0
        state.sticks[f] = 0
    return True
