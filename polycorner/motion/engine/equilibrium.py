"""Equilibrium of an island at rest, by an interior-point method.

First it is asked which contacts can carry at the velocities of rest, and where to begin.
"""

import numpy as np

from polycorner.motion.engine.arrays import NEWTON_STEPS, OWN_LIMIT
from polycorner.motion.engine.families import kind_of
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
from polycorner.motion.engine.rest import REST_FACTOR, SLEEP_MARGIN
from polycorner.motion.engine.rows import add_row, copy_velocity, load_on, row_times, velocity_of
from polycorner.motion.engine.sets import INTERVAL, barrier, contains
from polycorner.motion.engine.signals import increase
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import load

TARGET_PRESSURE = 0.2  # n_0, as a share of the impulse that would stop a body
START_MARGIN = 0.1  # relative distance from the boundary of the sets at the start
BALANCE_TOLERANCE = 1e-1  # of the solver's tolerance, to which forces balance
STILL_BALANCED = 0.5  # the same, for impulses of the step before
INTERIOR_MARGIN = 1e-9  # relative distance from the boundary kept by all iterates
MAX_INTERIOR_STEPS = 25
CENTRING_STEPS = 2  # steps taken once forces balance, unless they nearly did at the start:
NEARLY_BALANCED = 10.0  # times the solver's tolerance
REGULARISATION = 1e-13  # weight of the mass matrix, relative to the stiffest block


@compiled
def contacts_remain(model, velocity, block, search, scratch, first, last, goal):
    """Return whether no contact that carries load slips, opens or closes at the velocities of rest.

    ``search.carries`` gets which blocks can carry load at rest: those of contacts that neither open
    nor close, where gaps that count as touching are zero.  Bounds close to what rest requires
    are moved there, whatever the outcome: otherwise piles missed the tolerance a third more often,
    and one jam twitched for seconds.
    """
    u = scratch.slip
    for s in range(first, last):
        b = block.order[s]
        pressing = block.pressing[b]
        velocity_of(model, block, b, velocity.rest, u)
        if block.rows[b] == 0:
            near = REST_FACTOR * goal
            if not block.bilateral[b] and block.origin[b, 0] != OWN_LIMIT:
                near = max(near, model.touching / model.step)
            if u[0] < -near or (block.bilateral[b] and u[0] > near):
                return False
            search.carries[b] = 0.0
            if u[0] <= near:  # closed
                search.carries[b] = 1.0
                block.offset[b, 0] -= u[0]
            continue
        search.carries[b] = search.carries[pressing] if pressing >= 0 else 1.0
        if search.carries[b] > 0.0 and (
            abs(u[0] - block.target[b, 0]) > REST_FACTOR * goal
            or (block.rows[b] == 2 and abs(u[1] - block.target[b, 1]) > REST_FACTOR * goal)
        ):
            return False
    return True


@compiled
def imbalance(model, mid, velocity, block, matrix, first, last, n):
    """Return how far the velocities after all impulses are from rest, as a speed.

    ``M (v_rest - v_free) - J' p`` is left in ``matrix.vector``.
    """
    k, K, x, p = model.dimension, model.lanes, matrix.vector, block.impulse
    far = 0.0
    for at in range(n):
        i = matrix.members[at]
        for c in range(k):
            value = 0.0
            for a in range(k):
                value += mid.mass[i, c, a] * (velocity.rest[i, a] - velocity.free[i, a])
            x[at * K + c] = value
        for c in range(k, K):
            x[at * K + c] = 0.0
    for s in range(first, last):
        b = block.order[s]
        add_transposed(model, block, matrix, b, -p[b, 0], -p[b, 1], x)
    for at in range(n):
        i = matrix.members[at]
        for c in range(k):
            value = 0.0
            for a in range(k):
                value += mid.inverse_mass[i, c, a] * x[at * K + a]
            far = max(far, abs(value) * model.units[kind_of(model, i), c])
    return far


@compiled
def still_balance(model, work, first, last, n, goal):
    """Return whether the impulses at hand prove rest: they balance the forces, in their sets.

    In most steps of a pile at rest those of the step before do.
    """
    mid, velocity, block, matrix = work.mid, work.velocity, work.block, work.matrix
    p = block.impulse
    for s in range(first, last):
        b = block.order[s]
        # A contact that may open at rest must not be needed for it.
        if work.search.carries[b] == 0.0:
            if p[b, 0] != 0.0 or p[b, 1] != 0.0:
                return False
        elif block.rows[b] > 0 and not contains(
            model, block.set[b], p[b, 0], p[b, 1], load_on(block, b), 0.0
        ):
            return False
    return imbalance(model, mid, velocity, block, matrix, first, last, n) <= STILL_BALANCED * goal


@compiled
def find_interior_start(model, block, search, scratch, first, last, speed):
    """Find impulses in the interior of their sets; return whether there are any."""
    out = scratch.image
    for s in range(first, last):
        b = block.order[s]
        shape = block.set[b]
        if search.carries[b] == 0.0:
            block.impulse[b, 0], block.impulse[b, 1] = 0.0, 0.0
            continue
        if block.rows[b] == 0:
            p, least = block.impulse[b, 0], TARGET_PRESSURE * block.delassus[b, 3] * speed
            # Large enough that all friction has an interior; the first steps bring it down.
            p = np.copysign(max(abs(p), least), p) if block.bilateral[b] else max(p, least)
            block.impulse[b, 0] = p
            continue
        load = load_on(block, b)
        if model.set_kinds[shape] == INTERVAL or block.rows[b] == 1:
            # Such sets have one direction: what is left of a second one would never be found
            # inside.
            block.impulse[b, 1] = 0.0
        tries = 0
        while not contains(
            model, shape, block.impulse[b, 0], block.impulse[b, 1], load, -START_MARGIN
        ):
            tries += 1
            # Shrunk rather than set to zero: impulses of the step before are nearly those of this
            # one.
            share = 0.8 if tries < 20 else 0.0
            block.impulse[b, 0] *= share
            block.impulse[b, 1] *= share
            if tries > 20:
                return False
        barrier(model, shape, load, block.impulse[b, 0], block.impulse[b, 1], out)
        if not (load > 0.0 and out[6] < np.inf):  # no interior
            return False
    return True


@compiled
def assemble_interior(model, work, first, last, n, speed):
    """Assemble the Newton system of :func:`find_equilibrium`: matrix and right-hand side.

    ``search.derivative`` gets, for each block that carries load, the inverse of its Hessian, 2 x 2;
    ``search.load_slope`` the change of its impulse with its load; ``search.schur_row``, for each
    unilateral contact, the row that is left of its normal when its friction is eliminated.
    """
    block, search, matrix = work.block, work.search, work.matrix
    K, out, x = model.lanes, work.scratch.image, matrix.vector
    derivative, constant = search.derivative, search.constant
    stiffest = 0.0
    for s in range(first, last):
        b = block.order[s]
        for a in range(9):
            derivative[b, a] = 0.0
        if block.rows[b] == 0 and search.carries[b] > 0.0:
            p = block.impulse[b, 0]
            slope = 1.0 / (TARGET_PRESSURE * block.delassus[b, 3] * speed) - 1.0 / p
            derivative[b, 0] = 1.0 / (p * p)
            if block.bilateral[b]:  # the term of an equation in the sum is (n / n_0)^2 / 2
                derivative[b, 0] = (TARGET_PRESSURE * block.delassus[b, 3] * speed) ** -2.0
                slope = p * derivative[b, 0]
            constant[b, 0], constant[b, 1] = slope, slope
            for c in range(2 * K):
                search.schur_row[b, c] = block.jacobian[b, 0, c]
    for s in range(first, last):
        b = block.order[s]
        pressing, rows = block.pressing[b], block.rows[b]
        if rows == 0 or search.carries[b] == 0.0:
            continue
        load = load_on(block, b)
        barrier(model, block.set[b], load, block.impulse[b, 0], block.impulse[b, 1], out)
        if pressing >= 0 and block.impulse[pressing, 0] < 0.0:  # an equation that pulls
            out[0], out[4], out[5] = -out[0], -out[4], -out[5]
        flat = rows == 1 or model.set_kinds[block.set[b]] == INTERVAL
        if flat:
            x00, x01, x11 = 1.0 / out[6], 0.0, 0.0
        else:
            determinant = out[6] * out[8] - out[7] * out[7]
            x00, x01, x11 = out[8] / determinant, -out[7] / determinant, out[6] / determinant
        derivative[b, 4], derivative[b, 5], derivative[b, 7], derivative[b, 8] = x00, x01, x01, x11
        constant[b, 0], constant[b, 1] = out[1], out[2]
        stiffest = max(stiffest, max(x00, x11) * block.delassus[b, 4])
        # A known load does not change: there is nothing to eliminate.
        if pressing < 0:
            continue
        t0, t1 = x00 * out[4] + x01 * out[5], x01 * out[4] + x11 * out[5]
        search.load_slope[b, 0], search.load_slope[b, 1] = t0, t1
        derivative[pressing, 0] += out[3] - t0 * out[4] - t1 * out[5]
        constant[pressing, 0] += out[0] - t0 * out[1] - t1 * out[2]
        constant[pressing, 1] += out[0]
        shift = 0 if block.bodies[pressing, 0] == block.bodies[b, 0] else K
        for c in range(2 * K):
            at = (c + shift) % (2 * K)
            search.schur_row[pressing, at] -= t0 * block.jacobian[b, 0, c]
            if rows == 2:
                search.schur_row[pressing, at] -= t1 * block.jacobian[b, 1, c]
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] == 0 and search.carries[b] > 0.0:
            stiffest = max(stiffest, 1.0 / (derivative[b, 0] * block.delassus[b, 3]))
    assemble_mass(model, work.mid, matrix, n, REGULARISATION * stiffest)
    for s in range(first, last):
        b = block.order[s]
        if search.carries[b] == 0.0:
            continue
        if block.rows[b] > 0:
            add_block(model, block, search, matrix, n, b)
            g0, g1 = constant[b, 0], constant[b, 1]
            p0 = derivative[b, 4] * g0 + derivative[b, 5] * g1
            p1 = derivative[b, 7] * g0 + derivative[b, 8] * g1
            add_transposed(model, block, matrix, b, p0, p1, x)
        else:
            add_schur_complement(model, block, search, matrix, n, b)


@compiled
def add_schur_complement(model, block, search, matrix, n, b):
    """Add a contact, its friction eliminated, to the matrix and the right-hand side."""
    K, rows, at = model.lanes, search.schur_row, b * 2 * model.lanes
    share, (x, y) = 1.0 / search.derivative[b, 0], numbers_of(block, matrix, b)
    add_row(model, rows, at, share * search.constant[b, 0], matrix.vector, x, y)
    for d in range(0 if x >= 0 else K, 2 * K if y >= 0 else K, WIDTH):
        add_columns(model, block, matrix, n, b, d, rows, at, share * load(rows, at + d))


@compiled
def newton_direction(model, block, search, matrix, first, last):
    """Put the Newton direction of the impulses in ``search.best``; return its squared norm."""
    x, best = matrix.vector, search.best
    derivative, constant = search.derivative, search.constant
    square = 0.0
    for s in range(first, last):
        b = block.order[s]
        best[b, 0], best[b, 1] = 0.0, 0.0
        # Contacts first: the friction that they press on depends on their change.
        if block.rows[b] > 0 or search.carries[b] == 0.0:
            continue
        first_number, second = numbers_of(block, matrix, b)
        at = b * 2 * model.lanes
        value = row_times(model, search.schur_row, at, x, first_number, second)
        best[b, 0] = (value - constant[b, 0]) / derivative[b, 0]
        square += best[b, 0] * (row_product(model, block, matrix, b, ZERO, x) - constant[b, 1])
    for s in range(first, last):
        b = block.order[s]
        pressing, rows = block.pressing[b], block.rows[b]
        if rows == 0 or search.carries[b] == 0.0:
            continue
        a0 = row_product(model, block, matrix, b, ZERO, x) - constant[b, 0]
        a1 = row_product(model, block, matrix, b, ONE, x) - constant[b, 1] if rows == 2 else 0.0
        best[b, 0] = derivative[b, 4] * a0 + derivative[b, 5] * a1
        best[b, 1] = derivative[b, 7] * a0 + derivative[b, 8] * a1
        if pressing >= 0:
            best[b, 0] -= search.load_slope[b, 0] * best[pressing, 0]
            best[b, 1] -= search.load_slope[b, 1] * best[pressing, 0]
        square += best[b, 0] * a0 + best[b, 1] * a1
    return square


@compiled
def in_interior(model, block, search, first, last, share):
    """Return whether impulses moved by a share of the Newton direction are interior."""
    p, best = block.impulse, search.best
    for s in range(first, last):
        b = block.order[s]
        if search.carries[b] == 0.0:
            continue
        x = p[b, 0] + share * best[b, 0]
        if block.rows[b] == 0:
            if not block.bilateral[b] and x <= INTERIOR_MARGIN * p[b, 0]:
                return False
            continue
        pressing = block.pressing[b]
        y = p[b, 1] + share * best[b, 1]
        load = block.load[b]
        if pressing >= 0:  # which keeps its sign
            load = p[pressing, 0] + share * best[pressing, 0]
            load = load if p[pressing, 0] > 0.0 else -load
        if load <= 0.0:
            return False
        if not contains(model, block.set[b], x, y, load, -INTERIOR_MARGIN):
            return False
    return True


@compiled
def interior_point_steps(model, state, work, first, last, n, speed, goal):
    """Take interior-point steps to balance and centrality; return whether forces balance."""
    mid, velocity, block = work.mid, work.velocity, work.block
    search, matrix = work.search, work.matrix
    p, best = block.impulse, search.best
    balanced_for, stuck, more = 0, 0, CENTRING_STEPS
    for trial in range(MAX_INTERIOR_STEPS):
        far = imbalance(model, mid, velocity, block, matrix, first, last, n)
        if trial == 0 and far <= NEARLY_BALANCED * goal:
            more = 0
        # Balance first, centrality afterwards: the first balanced impulses are a proof, but may lie
        # so near the boundary that the next load change breaks it.
        if far <= BALANCE_TOLERANCE * goal:
            balanced_for += 1
        if balanced_for > more:
            return True
        assemble_interior(model, work, first, last, n, speed)
        if not solve_island_matrix(model, matrix, n):
            return balanced_for > 0
        increase(state.counts, NEWTON_STEPS, ONE)
        square = newton_direction(model, block, search, matrix, first, last)
        share, least = 1.0, 0.0
        if balanced_for > 0:
            if square < 0.1:
                return True
            least = 1.0 / (1.0 + np.sqrt(square))  # decreases and stays inside ([BV] sec. 9.6)
        while not in_interior(model, block, search, first, last, share):
            share *= 0.7
            if share < 1e-3:
                return balanced_for > 0
        if share < 1.0:
            # Not all the way to the boundary, from which the next steps would be short.
            share = max(least, 0.7 * share)
        stuck += 1 if share < 0.1 else 0
        # Two short steps in a row of trials tell that there is no interior ahead; piles that cannot
        # rest are recognised by this, and cost little.
        if stuck == 2:
            return balanced_for > 0
        for s in range(first, last):
            b = block.order[s]
            for r in range(2):
                p[b, r] += share * best[b, r]
    return balanced_for > 0


@compiled
def leaves_reserve(model, block, b):
    """Return whether friction that carries leaves a share of its set unused."""
    load, p = load_on(block, b), block.impulse
    return load <= 0.0 or contains(model, block.set[b], p[b, 0], p[b, 1], load, -SLEEP_MARGIN)


@compiled
def all_leave_reserves(model, block, first, last):
    """Return whether all friction of an island leaves a share of its sets unused."""
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] > 0 and not leaves_reserve(model, block, b):
            return False
    return True


@compiled
def resists(model, work, first, last, n):
    """Return whether contacts that carry resist the whole motion of an island.

    A motion ``v`` that none of their rows sees, such as that of a box on ice, would go on for ever:
    rest must not swallow it.  With ``A`` the sum of the squares of all rows, each over its entry of
    the Delassus matrix, and ``e`` small, ``v' M (A + e M)^-1 M v`` is at least the energy of such a
    part over ``e``, and otherwise that of ``v`` over the least eigenvalue of ``A``.
    """
    block, search, matrix, velocity = work.block, work.search, work.matrix, work.velocity
    k, K, mid, G = model.dimension, model.lanes, work.mid, work.search.derivative
    assemble_mass(model, mid, matrix, n, REGULARISATION)
    for s in range(first, last):
        b = block.order[s]
        loaded = block.bilateral[b] or block.impulse[b, 0] > 0.0
        if block.rows[b] > 0:
            loaded = load_on(block, b) > 0.0
        if not (loaded and search.carries[b] > 0.0):
            continue
        for a in range(9):
            G[b, a] = 0.0
        G[b, 4] = G[b, 8] = block.delassus[b, 3]
        add_block(model, block, search, matrix, n, b)
    energy, response = 0.0, 0.0
    for again in range(2):
        for at in range(n):
            i = matrix.members[at]
            for c in range(K):
                value = 0.0
                for a in range(k if c < k else 0):
                    value += mid.mass[i, c, a] * velocity.new[i, a]
                if again:
                    response += value * matrix.vector[at * K + c]
                else:
                    energy += value * velocity.new[i, c]
                    matrix.vector[at * K + c] = value
        if not again and not solve_island_matrix(model, matrix, n):
            return False
    return response * np.sqrt(REGULARISATION) <= energy


@compiled
def find_equilibrium(model, state, work, first, last, speed, stops):
    """Return whether an island can be at rest after the step; then its impulses are the proof.

    The velocities of rest are in ``velocity.rest``.  At rest nothing slips, so that De Saxce's term
    vanishes and the problem is convex: are there impulses in the sets that balance the forces?
    They are sought in the interior, at the minimum of ``sum n / n_0 - sum log(distance from the
    boundary)`` over the balanced ones, by Newton's method from an infeasible start ([BV] sec. 10.3;
    the first sum excludes forces that grow without bound in a jam; an equation has
    ``(n / n_0)^2 / 2`` instead, and its ``n`` keeps its sign where friction depends on it).
    Impulses far from the boundary can still balance when the loads change a little, so that the
    pile can sleep.  What moves ``stops`` only if friction has a reserve and nothing moves freely.
    """
    velocity, block, search = work.velocity, work.block, work.search
    matrix, scratch = work.matrix, work.scratch
    n = number_bodies(model, work.body, block, work.graph, matrix, first, last)
    if n == 0:
        return False
    goal = model.tolerance * speed
    copy_impulses(block, first, last, block.impulse, search.initial)
    proved = False
    if contacts_remain(model, velocity, block, search, scratch, first, last, goal):
        proved = still_balance(model, work, first, last, n, goal)
        # They may have used up friction that others leave in reserve.
        proved = proved and (stops == 0 or all_leave_reserves(model, block, first, last))
        if not proved and find_interior_start(model, block, search, scratch, first, last, speed):
            proved = interior_point_steps(model, state, work, first, last, n, speed, goal)
    if proved and stops != 0:
        proved = all_leave_reserves(model, block, first, last)
        proved = proved and resists(model, work, first, last, n)
    if not proved:
        copy_impulses(block, first, last, search.initial, block.impulse)
        return False
    for at in range(n):
        copy_velocity(model, velocity.rest, velocity.new, matrix.members[at])
    return True
