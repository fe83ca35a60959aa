"""Equilibrium of an island at rest, by an interior-point method."""

import numpy as np

from polycorner.motion.engine.arrays import NEWTON_STEPS
from polycorner.motion.engine.gauss_seidel import copy_impulses
from polycorner.motion.engine.island_matrix import (
    add_block,
    add_columns,
    add_transposed,
    assemble_mass,
    number_bodies,
    numbers_of,
    row_product,
    solve_island_matrix,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.resting_start import (
    BALANCE_TOLERANCE,
    TARGET_PRESSURE,
    contacts_remain,
    find_interior_start,
    imbalance,
    still_balance,
)
from polycorner.motion.engine.rows import add_row, copy_velocity, load_on, row_times
from polycorner.motion.engine.sets import INTERVAL, barrier, contains
from polycorner.motion.engine.signals import increase
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import load

INTERIOR_MARGIN = 1e-9  # relative distance from the boundary kept by all iterates
MAX_INTERIOR_STEPS = 25
CENTRING_STEPS = 2  # steps taken once forces balance, unless they nearly did at the start:
NEARLY_BALANCED = 10.0  # times the solver's tolerance
REGULARISATION = 1e-13  # weight of the mass matrix, relative to the stiffest block


@compiled
def assemble_interior(model, work, first, last, n, speed):
    """Assemble the Newton system of :func:`find_equilibrium`: matrix and right-hand side.

    ``work.derivative`` gets, for each block that carries load, the inverse of its Hessian (2 x 2);
    ``work.load_slope`` the change of its impulse with its load; ``work.schur_row``, for each
    unilateral contact, the row that is left of its normal when its friction is eliminated.
    """
    K, out, x = model.lanes, work.image, work.island_vector
    derivative, constant = work.derivative, work.constant
    stiffest = 0.0
    for s in range(first, last):
        b = work.order[s]
        for a in range(9):
            derivative[b, a] = 0.0
        if work.block_rows[b] == 0 and work.carries[b] > 0.0:
            p = work.impulse[b, 0]
            slope = 1.0 / (TARGET_PRESSURE * work.delassus[b, 3] * speed) - 1.0 / p
            derivative[b, 0] = 1.0 / (p * p)
            if work.bilateral[b]:  # the term of an equation in the sum is (n / n_0)^2 / 2
                derivative[b, 0] = (TARGET_PRESSURE * work.delassus[b, 3] * speed) ** -2.0
                slope = p * derivative[b, 0]
            constant[b, 0], constant[b, 1] = slope, slope
            for c in range(2 * K):
                work.schur_row[b, c] = work.jacobian[b, 0, c]
    for s in range(first, last):
        b = work.order[s]
        pressing, rows = work.pressing[b], work.block_rows[b]
        if rows == 0 or work.carries[b] == 0.0:
            continue
        load = load_on(work, b)
        barrier(model, work.block_set[b], load, work.impulse[b, 0], work.impulse[b, 1], out)
        if pressing >= 0 and work.impulse[pressing, 0] < 0.0:  # an equation that pulls
            out[0], out[4], out[5] = -out[0], -out[4], -out[5]
        flat = rows == 1 or model.set_kinds[work.block_set[b]] == INTERVAL
        if flat:
            x00, x01, x11 = 1.0 / out[6], 0.0, 0.0
        else:
            determinant = out[6] * out[8] - out[7] * out[7]
            x00, x01, x11 = out[8] / determinant, -out[7] / determinant, out[6] / determinant
        derivative[b, 4], derivative[b, 5], derivative[b, 7], derivative[b, 8] = x00, x01, x01, x11
        constant[b, 0], constant[b, 1] = out[1], out[2]
        stiffest = max(stiffest, max(x00, x11) * work.delassus[b, 4])
        if pressing < 0:
            continue
        t0, t1 = x00 * out[4] + x01 * out[5], x01 * out[4] + x11 * out[5]
        work.load_slope[b, 0], work.load_slope[b, 1] = t0, t1
        derivative[pressing, 0] += out[3] - t0 * out[4] - t1 * out[5]
        constant[pressing, 0] += out[0] - t0 * out[1] - t1 * out[2]
        constant[pressing, 1] += out[0]
        shift = 0 if work.block_bodies[pressing, 0] == work.block_bodies[b, 0] else K
        for c in range(2 * K):
            at = (c + shift) % (2 * K)
            work.schur_row[pressing, at] -= t0 * work.jacobian[b, 0, c]
            if rows == 2:
                work.schur_row[pressing, at] -= t1 * work.jacobian[b, 1, c]
    for s in range(first, last):
        b = work.order[s]
        if work.block_rows[b] == 0 and work.carries[b] > 0.0:
            stiffest = max(stiffest, 1.0 / (derivative[b, 0] * work.delassus[b, 3]))
    assemble_mass(model, work, n, REGULARISATION * stiffest)
    for s in range(first, last):
        b = work.order[s]
        if work.carries[b] == 0.0:
            continue
        if work.block_rows[b] > 0:
            add_block(model, work, n, b)
            g0, g1 = constant[b, 0], constant[b, 1]
            p0 = derivative[b, 4] * g0 + derivative[b, 5] * g1
            p1 = derivative[b, 7] * g0 + derivative[b, 8] * g1
            add_transposed(model, work, b, p0, p1, x)
        else:
            add_schur_complement(model, work, n, b)


@compiled
def add_schur_complement(model, work, n, b):
    """Add a contact, its friction eliminated, to the matrix and the right-hand side."""
    K, rows, at = model.lanes, work.schur_row, b * 2 * model.lanes
    share, (x, y) = 1.0 / work.derivative[b, 0], numbers_of(work, b)
    add_row(model, rows, at, share * work.constant[b, 0], work.island_vector, x, y)
    for d in range(0 if x >= 0 else K, 2 * K if y >= 0 else K, WIDTH):
        add_columns(model, work, n, b, d, rows, at, share * load(rows, at + d))


@compiled
def newton_direction(model, work, first, last):
    """Put the Newton direction of the impulses in ``work.best``; return its squared local norm."""
    x, best = work.island_vector, work.best
    derivative, constant = work.derivative, work.constant
    square = 0.0
    for s in range(first, last):
        b = work.order[s]
        best[b, 0], best[b, 1] = 0.0, 0.0
        if work.block_rows[b] > 0 or work.carries[b] == 0.0:
            continue
        first_number, second = numbers_of(work, b)
        at = b * 2 * model.lanes
        value = row_times(model, work.schur_row, at, x, first_number, second)
        best[b, 0] = (value - constant[b, 0]) / derivative[b, 0]
        square += best[b, 0] * (row_product(model, work, b, ZERO, x) - constant[b, 1])
    for s in range(first, last):
        b = work.order[s]
        pressing, rows = work.pressing[b], work.block_rows[b]
        if rows == 0 or work.carries[b] == 0.0:
            continue
        a0 = row_product(model, work, b, ZERO, x) - constant[b, 0]
        a1 = row_product(model, work, b, ONE, x) - constant[b, 1] if rows == 2 else 0.0
        best[b, 0] = derivative[b, 4] * a0 + derivative[b, 5] * a1
        best[b, 1] = derivative[b, 7] * a0 + derivative[b, 8] * a1
        if pressing >= 0:
            best[b, 0] -= work.load_slope[b, 0] * best[pressing, 0]
            best[b, 1] -= work.load_slope[b, 1] * best[pressing, 0]
        square += best[b, 0] * a0 + best[b, 1] * a1
    return square


@compiled
def in_interior(model, work, first, last, share):
    """Return whether impulses moved by a share of the Newton direction are interior."""
    p, best = work.impulse, work.best
    for s in range(first, last):
        b = work.order[s]
        if work.carries[b] == 0.0:
            continue
        x = p[b, 0] + share * best[b, 0]
        if work.block_rows[b] == 0:
            if not work.bilateral[b] and x <= INTERIOR_MARGIN * p[b, 0]:
                return False
            continue
        pressing = work.pressing[b]
        y = p[b, 1] + share * best[b, 1]
        load = work.block_load[b]
        if pressing >= 0:  # which keeps its sign
            load = p[pressing, 0] + share * best[pressing, 0]
            load = load if p[pressing, 0] > 0.0 else -load
        if load <= 0.0:
            return False
        if not contains(model, work.block_set[b], x, y, load, -INTERIOR_MARGIN):
            return False
    return True


@compiled
def interior_point_steps(model, state, work, first, last, n, speed, goal):
    """Take interior-point steps to balance and centrality; return whether forces balance."""
    p, best = work.impulse, work.best
    balanced_for, stuck, more = 0, 0, CENTRING_STEPS
    for trial in range(MAX_INTERIOR_STEPS):
        far = imbalance(model, work, first, last, n)
        if trial == 0 and far <= NEARLY_BALANCED * goal:
            more = 0
        if far <= BALANCE_TOLERANCE * goal:
            balanced_for += 1
        if balanced_for > more:
            return True
        assemble_interior(model, work, first, last, n, speed)
        if not solve_island_matrix(model, work, n):
            return balanced_for > 0
        increase(state.counts, NEWTON_STEPS, ONE)
        square = newton_direction(model, work, first, last)
        share, least = 1.0, 0.0
        if balanced_for > 0:
            if square < 0.1:
                return True
            least = 1.0 / (1.0 + np.sqrt(square))  # decreases and stays inside ([BV] sec. 9.6)
        while not in_interior(model, work, first, last, share):
            share *= 0.7
            if share < 1e-3:
                return balanced_for > 0
        if share < 1.0:
            share = max(least, 0.7 * share)
        stuck += 1 if share < 0.1 else 0
        if stuck == 2:
            return balanced_for > 0
        for s in range(first, last):
            b = work.order[s]
            for r in range(2):
                p[b, r] += share * best[b, r]
    return balanced_for > 0


@compiled
def find_equilibrium(model, state, work, first, last, speed):
    """Return whether an island can be at rest after the step; then its impulses are the proof.

    The velocities of rest are in ``work.v_rest``.  At rest nothing slips, so that De Saxce's term
    vanishes and the problem is convex: are there impulses in the sets that balance the forces?
    They are sought in the interior, at the minimum of ``sum n / n_0 - sum log(distance from the
    boundary)`` over the balanced ones, by Newton's method from an infeasible start ([BV] sec. 10.3;
    the first sum excludes forces that grow without bound in a jam; an equation has
    ``(n / n_0)^2 / 2`` instead, and its ``n`` keeps its sign where friction depends on it).
    Impulses far from the boundary can still balance when the loads change a little, so that the
    pile can sleep.
    """
    n = number_bodies(model, work, first, last)
    if n == 0:
        return False
    goal = model.tolerance * speed
    copy_impulses(work, first, last, work.impulse, work.initial)
    proved = False
    if contacts_remain(model, work, first, last, goal):
        proved = still_balance(model, work, first, last, n, goal)
        if not proved and find_interior_start(model, work, first, last, speed):
            proved = interior_point_steps(model, state, work, first, last, n, speed, goal)
    if not proved:
        copy_impulses(work, first, last, work.initial, work.impulse)
        return False
    for at in range(n):
        copy_velocity(model, work.v_rest, work.v_new, work.members[at])
    return True
