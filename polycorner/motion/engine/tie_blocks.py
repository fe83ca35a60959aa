"""Blocks of ties, and the way of tied bodies onto their equations."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import LIMITS, ROWS, SLIPS, TIE_FRICTION, TIE_GAP
from polycorner.motion.engine.blocks import (
    finish_block,
    kind_of_bound,
    new_block,
    touch_tied,
)
from polycorner.motion.engine.bounds import (
    STRAIGHT,
    acts,
    curvature_change,
    equation_offset,
    least_velocity,
)
from polycorner.motion.engine.evaluation import (
    BENDING,
    MOST_APPROACHES,
    ON_EQUATIONS,
    TOGETHER,
    evaluate_gaps,
    evaluate_place,
)
from polycorner.motion.engine.families import kind_of
from polycorner.motion.engine.island_matrix import (
    add_block,
    add_transposed,
    number_bodies,
    solve_island_matrix,
)
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.rows import copy_lanes, row_at, row_times
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.ties import (
    add_tie_forces,
    evaluate_rows,
    evaluate_slips_of_tie,
    evaluate_tie,
    evaluate_tie_forces,
    form_of,
    is_equation,
    row_inputs,
    slip_inputs,
)
from polycorner.motion.engine.vectors import store, zeros


@compiled
def evaluate_ties(model, state, work, h, time):
    """Evaluate the ties of bodies that neither wait nor sleep, at midpoints on their equations.

    The bodies themselves have been evaluated; those that are moved are evaluated anew.
    """
    mid, tie, body, scratch = work.mid, work.tie, work.body, work.scratch
    tie.time[0] = model.start + time
    for t in range(model.ties):
        if is_evaluated(state, body, model.tie_bodies[t, 0]):
            evaluate_rows(model, mid, tie, scratch, t)
    for p in range(model.components):
        # Component by component, so that bodies do not depend on others that they are not tied to.
        if is_evaluated(state, body, model.component_body[model.component_bodies[p]]):
            approach_component(model, state, work, p, h, time)
    for t in range(model.ties):
        if is_evaluated(state, body, model.tie_bodies[t, 0]):
            evaluate_tie_forces(model, mid, tie, scratch, t, state.v, h)
    for i in range(model.bodies):
        if is_evaluated(state, body, i):
            add_tie_forces(model, mid, tie, i)


@compiled
def is_evaluated(state, body, i):
    """Return whether a body neither waits nor sleeps."""
    return not body.waits[i] and not state.asleep[i]


@compiled
def is_off(model, tie, p):
    """Return whether an equation of a component of ties does not hold at the midpoint."""
    for s in range(model.component_ties[p], model.component_ties[p + 1]):
        t = model.component_tie[s]
        for row in range(model.tie_rows[t] + form_of(model, t, LIMITS), model.tie_rows[t + 1]):
            size = square_of(
                model, tie.gradient[row], model.tie_bodies[t, 0], model.tie_bodies[t, 1]
            )
            if not abs(tie.gap[row]) <= ON_EQUATIONS * np.sqrt(size):
                return True
    return False


@compiled
def square_of(model, row, i, j):
    """Return the square of a gradient by scaled coordinates of one body, or of two."""
    size = 0.0
    for c in range(model.dimension):
        size += (row[c] / model.units[kind_of(model, i), c]) ** 2
        if j >= 0:
            size += (row[model.lanes + c] / model.units[kind_of(model, j), c]) ** 2
    return size


@compiled
def approach_component(model, state, work, p, h, time):
    """Move the midpoints of tied bodies onto their equations, if they are not there.

    As :func:`~polycorner.motion.engine.evaluation.approach_equations` does for one body, with the
    matrix of an island; equations of the bodies themselves remain.
    """
    never_inline()
    if not is_off(model, work.tie, p):
        return
    mid, tie, body, block = work.mid, work.tie, work.body, work.block
    search, matrix, x = work.search, work.matrix, work.matrix.vector
    begin, end = model.component_bodies[p], model.component_bodies[p + 1]
    for s in range(begin, end):
        body.awake[model.component_body[s]] = 1  # as it will be found
    for _ in range(MOST_APPROACHES):
        count, worst = collect_equations(model, work, p)
        if not worst > ON_EQUATIONS:
            break
        n = number_bodies(model, body, block, work.graph, matrix, ZERO, count)
        if n == 0:
            break
        begin_matrix(model, matrix, n)
        for b in range(count):
            add_block(model, block, search, matrix, n, b)
            push = -search.derivative[b, 4] * block.load[b]
            add_transposed(model, block, matrix, b, push, 0.0, x)
        if not solve_island_matrix(model, matrix, n):
            break
        for at in range(n):
            i = matrix.members[at]
            for c in range(model.dimension):
                mid.q[i, c] += x[at * model.lanes + c]
        for s in range(model.component_ties[p], model.component_ties[p + 1]):
            evaluate_rows(model, mid, tie, work.scratch, model.component_tie[s])
    for s in range(begin, end):
        evaluate_place(model, state, mid, work.scratch, model.component_body[s], h, time)


@compiled
def collect_equations(model, work, p):
    """Write the equations of tied bodies as blocks; return their number, and the worst distance."""
    mid, tie, block, count, worst = work.mid, work.tie, work.block, ZERO, 0.0
    for s in range(model.component_bodies[p], model.component_bodies[p + 1]):
        i = model.component_body[s]
        first, end = model.first_equation[i], model.first_gap[i + 1]
        if first < end:
            evaluate_gaps(model, work.scratch, i, mid.q, 0.0, mid.gap, mid.gradient)
        for g in range(first, end):
            new_block(block, count, i, NONE, ZERO)
            at = g * model.lanes
            copy_lanes(model, mid.gradient, at, block.jacobian, row_at(model, count, ZERO))
            worst = max(worst, weigh(model, work, count, mid.gap[g]))
            count += ONE
    for s in range(model.component_ties[p], model.component_ties[p + 1]):
        t = model.component_tie[s]
        for row in range(model.tie_rows[t] + form_of(model, t, LIMITS), model.tie_rows[t + 1]):
            new_block(block, count, model.tie_bodies[t, 0], model.tie_bodies[t, 1], ZERO)
            copy_row(model, tie, block, row, count)
            worst = max(worst, weigh(model, work, count, tie.gap[row]))
            count += ONE
    return count, worst


@compiled
def weigh(model, work, b, value):
    """Give an equation its weight, by which all count alike; return how far it is from holding."""
    block, derivative = work.block, work.search.derivative
    size = square_of(model, block.jacobian[b, 0], block.bodies[b, 0], block.bodies[b, 1])
    block.order[b], block.load[b] = b, value
    derivative[b, 4] = 1.0 / size if size > 0.0 else 0.0
    return abs(value) / np.sqrt(size) if size > 0.0 else 0.0


@compiled
def begin_matrix(model, matrix, n):
    """Set the matrix of an island to the weight of a change of place, and its vector to zero."""
    K, A = model.lanes, matrix.entries
    for at in range(0, (n + 2 * matrix.row_start[n]) * K * K, WIDTH):
        store(A, at, zeros())
    for at in range(0, n * K, WIDTH):
        store(matrix.vector, at, zeros())
    for v in range(n):
        kind = kind_of(model, matrix.members[v])
        for c in range(K):
            inside = c < model.dimension
            A[(v * K + c) * K + c] = BENDING * model.units[kind, c] ** 2 if inside else 1.0


@compiled
def copy_row(model, tie, block, row, b):
    """Copy the gradient of a row of a tie to a block."""
    at, to = 2 * row * model.lanes, row_at(model, b, ZERO)
    copy_lanes(model, tie.gradient, at, block.jacobian, to)
    copy_lanes(model, tie.gradient, at + model.lanes, block.jacobian, to + model.lanes)


@compiled
def assemble_ties(model, state, work, h, limit, count):
    """Append the blocks of the ties of awake bodies; return the block count."""
    for p in range(model.components):
        first = model.component_body[model.component_bodies[p]]
        if model.component_closed[p] and work.body.awake[first]:
            choose_equations(model, work, p)
    for t in range(model.ties):
        if work.body.awake[model.tie_bodies[t, 0]]:
            count = add_rows_of_tie(model, state, work, t, h, limit, count)
            if model.tie_frictions[t + 1] > model.tie_frictions[t]:
                count = add_friction_of_tie(model, state, work, t, h, count)
    return count


@compiled
def choose_equations(model, work, p):
    """Mark the equations of a closed component of ties that do not follow from those before them.

    As :func:`~polycorner.motion.engine.blocks.is_independent` does for one body; equations of the
    bodies themselves come first.
    """
    never_inline()
    mid, tie, k, count = work.mid, work.tie, model.dimension, ZERO
    begin, end = model.component_bodies[p], model.component_bodies[p + 1]
    n, number = (end - begin) * k, work.matrix.number
    for s in range(begin, end):
        i = model.component_body[s]
        number[i] = s - begin
        for g in range(model.first_equation[i], model.first_gap[i + 1]):
            begin_row(tie, count * n, n)
            for c in range(k):
                tie.basis[count * n + (s - begin) * k + c] = mid.gradient[g, c]
            count += ONE if adds_direction(model, work, begin, n, count) else ZERO
    for s in range(model.component_ties[p], model.component_ties[p + 1]):
        t = model.component_tie[s]
        i, j = model.tie_bodies[t, 0], model.tie_bodies[t, 1]
        for row in range(model.tie_rows[t] + form_of(model, t, LIMITS), model.tie_rows[t + 1]):
            begin_row(tie, count * n, n)
            for c in range(k):
                tie.basis[count * n + number[i] * k + c] = tie.gradient[row, c]
                if j >= 0:
                    at = count * n + number[j] * k + c
                    tie.basis[at] = tie.gradient[row, model.lanes + c]
            tie.kept[row] = ONE if adds_direction(model, work, begin, n, count) else ZERO
            count += tie.kept[row]


@compiled
def begin_row(tie, at, n):
    """Begin a gradient of a component with zeros."""
    for a in range(n):
        tie.basis[at + a] = 0.0


@compiled
def answer_row(model, work, begin, n, at):
    """Find ``M^-1 J'`` of a gradient of a component; return ``J M^-1 J'``."""
    tie, k, square = work.tie, model.dimension, 0.0
    for s in range(n // k):
        i = model.component_body[begin + s]
        for c in range(k):
            value = 0.0
            for a in range(k):
                value += work.mid.inverse_mass[i, c, a] * tie.basis[at + s * k + a]
            tie.answer[at + s * k + c] = value
            square += value * tie.basis[at + s * k + c]
    return square


@compiled
def adds_direction(model, work, begin, n, count):
    """Return whether a gradient is independent of those before; then make it orthonormal."""
    tie, at = work.tie, count * n
    square = answer_row(model, work, begin, n, at)
    for other in range(0, at, n):
        product = 0.0
        for a in range(n):
            product += tie.answer[other + a] * tie.basis[at + a]
        for a in range(n):
            tie.basis[at + a] -= product * tie.basis[other + a]
    left = answer_row(model, work, begin, n, at)
    if not left > model.dependent**2 * square:
        return False
    for a in range(n):
        tie.basis[at + a] /= np.sqrt(left)
        tie.answer[at + a] /= np.sqrt(left)
    return True


@compiled
def add_rows_of_tie(model, state, work, t, h, limit, count):
    """Append the blocks of a tie's limits and equations; return the block count."""
    manner, velocity, body, tie, block = work.manner, work.velocity, work.body, work.tie, work.block
    i, j, n = model.tie_bodies[t, 0], model.tie_bodies[t, 1], row_inputs(model)
    predicted = False
    for o in range(form_of(model, t, ROWS)):
        row = model.tie_rows[t] + o
        gap, at, equation = tie.gap[row], 2 * row * model.lanes, is_equation(model, t, row)
        before = row_times(model, tie.gradient, at, velocity.old, i, j)
        free = row_times(model, tie.gradient, at, velocity.free, i, j)
        closed, bounce = state.tie_touches[row] != 0, model.tie_restitution[row]
        close = closed or gap + h * min(before, free, 0.0) < limit
        if equation:
            close = tie.kept[row] != 0
        elif manner.located[0]:
            close = acts(model, manner, gap, before, bounce, closed)
        tie.block_of[row] = count if close else NONE
        if not close:
            state.tie_normal[row], state.tie_pressed[row] = 0.0, 0.0
            continue
        b, change = count, h * tie.rate[row]
        count += ONE
        new_block(block, b, i, j, ZERO)
        copy_row(model, tie, block, row, b)
        block.origin[b, 0], block.origin[b, 1], block.origin[b, 2] = TIE_GAP, t, row
        if equation:
            # Until :func:`predict_ties` knows more; in an instant there is nothing else.
            block.offset[b, 0] = equation_offset(model, gap, change, h)
            block.bilateral[b], block.bounces[b] = ONE, ZERO
            touch_tied(body, block, b)
        else:
            if not predicted:
                evaluate_tie(model, work.scratch, t, work.ahead.q, tie.time[0] + h)
                predicted = True
            if closed or not manner.located[0]:
                following = work.scratch.values[n + o]
                change = curvature_change(model, gap, before, following, h)
            body.touched[i] = TOGETHER
            if j >= 0:
                body.touched[j] = TOGETHER
            least, block.bounces[b] = least_velocity(
                model, manner, gap, closed, before, free, change, bounce, h
            )
            block.offset[b, 0] = -least
            block.bound[b] = kind_of_bound(model, closed, gap + change)
        block.load[b] = -change
        block.impulse[b, 0] = state.tie_normal[row] * (h / model.step)
        finish_block(model, work.mid, velocity, body, block, b)
    return count


@compiled
def predict_ties(model, work, begin, end, h):
    """Let equations of ties curve as at the velocities with which the solution of a step starts.

    With the impulses of the last step these are so near to those after this one that the step need
    not be solved again, as a rule.
    """
    mid, velocity, ahead, block, tied = work.mid, work.velocity, work.ahead, work.block, NONE
    if h <= STRAIGHT * model.step:
        return
    for i in range(model.bodies):
        for c in range(model.dimension):
            ahead.q[i, c] = mid.q[i, c] + h * velocity.new[i, c]
    for b in range(begin, end):
        if not block.bilateral[b]:
            continue
        t, row = block.origin[b, 1], block.origin[b, 2]
        if t != tied:
            evaluate_tie(model, work.scratch, t, ahead.q, work.tie.time[0] + h)
            tied = t
        i, j, gap = block.bodies[b, 0], block.bodies[b, 1], work.tie.gap[row]
        along = row_times(model, block.jacobian, row_at(model, b, ZERO), velocity.new, i, j)
        following = work.scratch.values[row_inputs(model) + row - model.tie_rows[t]]
        change = following - gap - h * along
        block.offset[b, 0] = equation_offset(model, gap, change, h)
        block.load[b] = -change


@compiled
def add_friction_of_tie(model, state, work, t, h, count):
    """Append the blocks of friction of a tie where something presses; return the block count."""
    mid, tie, block, values = work.mid, work.tie, work.block, work.scratch.values
    k, K, n, evaluated = model.dimension, model.lanes, slip_inputs(model), False
    i, j, share = model.tie_bodies[t, 0], model.tie_bodies[t, 1], h / model.step
    for x in range(model.tie_frictions[t], model.tie_frictions[t + 1]):
        pressing = model.tie_pressing[x]
        if pressing >= 0:
            pressing = tie.block_of[model.tie_rows[t] + pressing]
        if pressing < 0 and (model.tie_pressing[x] >= 0 or tie.load[x] <= 0.0):
            state.tie_friction[x, 0], state.tie_friction[x, 1] = 0.0, 0.0
            state.tie_sticks[x] = 0
            continue
        if not evaluated:
            evaluate_slips_of_tie(model, mid, tie, work.scratch, t, state.v)
            evaluated = True
        b = count
        count += ONE
        new_block(block, b, i, j, model.tie_slip_rows[x])
        for r in range(block.rows[b]):
            o = model.tie_slip_start[x] + r
            at = n + form_of(model, t, SLIPS) + o * n + 2 * k
            drift, size = values[n + o], abs(values[n + o])
            for c in range(2 * k):
                slope, speed = values[at + c], values[2 * k + c]
                block.jacobian[b, r, c if c < k else K + c - k] = slope
                drift -= slope * speed
                size += abs(slope * speed)
            # As in :func:`evaluate_slips`: what cancels up to rounding is zero.
            block.offset[b, r] = drift if abs(drift) > 1e-14 * size else 0.0
            block.impulse[b, r] = state.tie_friction[x, r] * share
        block.set[b] = model.tie_sets[x, 0 if state.tie_sticks[x] else 1]
        block.pressing[b], block.load[b] = pressing, tie.load[x]
        block.origin[b, 0], block.origin[b, 1], block.origin[b, 2] = TIE_FRICTION, t, x
        touch_tied(work.body, block, b)
        finish_block(model, mid, work.velocity, work.body, block, b)
    return count
