"""Islands that neither sweeps nor Newton steps solve: paths from simpler problems.

Both start where the solution is not in doubt.  Compliant contacts are each for itself nearly, and
contacts whose friction has a known load are a convex problem, with one solution for the velocities
([Acary]).

The method of multipliers solves the convex problem: it converges from anywhere.
With known loads the impulses ``p`` minimise a convex function over a convex set ``C``.  A round
looks for those that minimise it with a term for the distance to the impulses ``q`` at hand
([Rockafellar76]).  Contacts then yield to the change of their impulses alone: these follow from the
velocities, ``p = proj(q - rho u / c)`` with the softness ``c``, and the velocities minimise

    1/2 (v - v_free)' M (v - v_free) + c / (2 rho) |proj(q - rho u / c)|^2,

for ``C`` a cone; for other sets likewise.  The function is convex with a continuous gradient:
Newton steps with a line search lead to its minimum.
"""

import numpy as np

from polycorner.motion.engine.arrays import LAST, NEWTON_STEPS
from polycorner.motion.engine.gauss_seidel import copy_impulses, recompute_velocities, residual
from polycorner.motion.engine.island_matrix import (
    add_block,
    add_transposed,
    assemble_mass,
    row_product,
    solve_island_matrix,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.newton import newton_steps
from polycorner.motion.engine.rows import load_on, slip_to_target, velocity_of
from polycorner.motion.engine.sets import project
from polycorner.motion.engine.signals import increase

STEPS_OF_ROUND = 25  # Newton steps of a round, at most
LINE_STEPS, FLAT = 20, 0.3  # trials of a line search, and how flat the function is where it ends
FIRST_COMPLIANCE, RIGID = 1e-2, 1e-10  # compliance at the start of a path, and at its end
FIRST_FACTOR, MOST_FACTOR, LEAST_FACTOR = 0.1, 0.03, 0.9  # of the compliance in a step of the path
EASY_STEPS = 8  # Newton steps up to which the next factor is smaller
LOAD_ROUNDS = 60  # convex problems, at most
IDLE_ROUNDS = 8  # of these without progress
MANY, FEW_ROUNDS = 600, 16  # blocks of a large island, and problems in it if steps may be divided
FIRST_YIELD, LEAST_YIELD, MOST_YIELD = 1e-1, 1e-7, 1e1  # softness of rounds of these
HARDER, EASY_ROUND = 0.1, 10  # factor of the softness after a round of few Newton steps
TRIED_YIELD, TRIED_ROUNDS = 1e-3, 3  # softness, and rounds, after which Newton's method is tried
EXACT = 0.1  # share of the residual to which a round is solved
GRIP = 1e3  # speed of slip that first loads stop, over that of the island
LEAST_CHANGE = 0.3  # share of the new loads that is taken over, at least


@compiled
def approach(model, work, first, last, n, softness, enough):
    """Find the velocities of a round, and its impulses; return the number of Newton steps.

    ``search.initial`` must be the impulses at hand.  The round ends where they would change the
    velocities of rows by no more than ``enough``, or after ``STEPS_OF_ROUND``.
    """
    velocity, block, search, matrix = work.velocity, work.block, work.search, work.matrix
    steps = ZERO
    while True:
        press_all(model, velocity, block, search, first, last, softness)
        if steps == STEPS_OF_ROUND or not find_direction(model, work, first, last, n):
            break
        largest = 0.0
        for s in range(first, last):
            b = block.order[s]
            for r in range(max(1, block.rows[b])):
                w = row_product(model, block, matrix, b, r, matrix.vector)
                search.constant[b, r] = w
                if search.derivative[b, 4] > 0.0:
                    largest = max(largest, abs(w))
        t = length_of_step(model, work, first, last, n, softness)
        for at in range(n):
            i = matrix.members[at]
            for c in range(model.dimension):
                velocity.new[i, c] += t * matrix.vector[at * model.lanes + c]
        steps += ONE
        if t == 1.0 and largest <= softness * enough:
            press_all(model, velocity, block, search, first, last, softness)
            break
    return steps


@compiled
def press_all(model, velocity, block, search, first, last, softness):
    """Find the impulses of all blocks from their velocities, and their derivatives."""
    for s in range(first, last):
        b = block.order[s]
        velocity_of(model, block, b, velocity.new, block.after[b])
        press(model, block, search, b, softness)


@compiled
def press(model, block, search, b, softness):
    """Find the impulses of a block from its velocities, and their derivative."""
    rho, derivative = block.delassus[b, 3] / softness, search.derivative
    x = search.initial[b, 0] - rho * slip_to_target(block, b, 0)
    for a in range(9):
        derivative[b, a] = 0.0
    block.impulse[b, 1] = 0.0
    if block.rows[b] == 0:
        acts = x > 0.0 or block.bilateral[b]
        block.impulse[b, 0] = x if acts else 0.0
        derivative[b, 4] = rho if acts else 0.0
        return
    out, two = search.projection[b], block.rows[b] == 2
    y = search.initial[b, 1] - rho * slip_to_target(block, b, 1) if two else 0.0
    project(model, block.set[b], x, y, load_on(block, b), out)
    block.impulse[b, 0], derivative[b, 4] = out[0], rho * out[2]
    if two:
        block.impulse[b, 1] = out[1]
        derivative[b, 5], derivative[b, 7] = rho * out[3], rho * out[4]
        derivative[b, 8] = rho * out[5]


@compiled
def find_direction(model, work, first, last, n):
    """Leave the Newton step of the velocities in ``matrix.vector``; return whether it is."""
    mid, velocity, block = work.mid, work.velocity, work.block
    search, matrix = work.search, work.matrix
    K, k, x = model.lanes, model.dimension, matrix.vector
    assemble_mass(model, mid, matrix, n, 1.0)
    for at in range(n):
        i = matrix.members[at]
        for c in range(K):
            x[at * K + c] = 0.0
        for c in range(k):
            for a in range(k):
                moved = velocity.new[i, a] - velocity.free[i, a]
                x[at * K + c] -= mid.mass[i, c, a] * moved
    for s in range(first, last):
        b = block.order[s]
        if search.derivative[b, 4] != 0.0 or search.derivative[b, 8] != 0.0:
            add_block(model, block, search, matrix, n, b)
        p, q = block.impulse[b, 0], block.impulse[b, 1]
        if p != 0.0 or q != 0.0:
            add_transposed(model, block, matrix, b, p, q, x)
    return solve_island_matrix(model, matrix, n)


@compiled
def length_of_step(model, work, first, last, n, softness):
    """Return how much of a Newton step to take: all, unless the function grows again before."""
    velocity, block, search = work.velocity, work.block, work.search
    matrix, scratch = work.matrix, work.scratch
    K, k, x = model.lanes, model.dimension, matrix.vector
    begin, more = 0.0, 0.0
    for at in range(n):
        i = matrix.members[at]
        for c in range(k):
            for a in range(k):
                m = x[at * K + c] * work.mid.mass[i, c, a]
                begin += m * (velocity.new[i, a] - velocity.free[i, a])
                more += m * x[at * K + a]
    start = begin - pull(model, block, search, scratch, first, last, softness, 0.0)
    low, high, t = 0.0, 1.0, 1.0
    at_low, at_high = start, 0.0
    for _ in range(LINE_STEPS):
        slope = begin + t * more - pull(model, block, search, scratch, first, last, softness, t)
        if abs(slope) <= -FLAT * start or (t == 1.0 and slope < 0.0):
            break
        if slope < 0.0:
            low, at_low = t, slope
        else:
            high, at_high = t, slope
        t = low - at_low * (high - low) / (at_high - at_low)
        # The secant alone creeps where the slope jumps; a tenth from both ends it shrinks the
        # interval.
        t = min(max(t, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    return t


@compiled
def pull(model, block, search, scratch, first, last, softness, t):
    """Return the products of a part of a Newton step with the impulses there."""
    total, out = 0.0, scratch.image
    for s in range(first, last):
        b = block.order[s]
        rho, wx = block.delassus[b, 3] / softness, search.constant[b, 0]
        x = search.initial[b, 0] - rho * (slip_to_target(block, b, 0) + t * wx)
        if block.rows[b] == 0:
            if x > 0.0 or block.bilateral[b]:
                total += wx * x
            continue
        if load_on(block, b) <= 0.0:
            continue
        two = block.rows[b] == 2
        wy = search.constant[b, 1] if two else 0.0
        y = search.initial[b, 1] - rho * (slip_to_target(block, b, 1) + t * wy) if two else 0.0
        project(model, block.set[b], x, y, load_on(block, b), out)
        total += wx * out[0] + wy * out[1]
    return total


@compiled
def continue_island(model, state, work, first, last, n, goal, softness):
    """Solve an island by continuation; return the residual.

    First the loads of friction are iterated; else the compliance of the contacts is taken from
    ``FIRST_COMPLIANCE`` to zero, from the impulses at hand; else from one to zero, from no
    impulses; else loads are iterated from those under which everything sticks.  If none of these
    leads to a solution, the impulses remain what they were.  Large islands for which shorter steps
    follow are given the first two attempts.
    """
    velocity, block, search, scratch = work.velocity, work.block, work.search, work.scratch
    copy_impulses(block, first, last, block.impulse, search.rigid)
    few = work.manner.remedy[0] != LAST and last - first > MANY
    for attempt in range(2 if few else 4):
        if attempt in (0, 3):
            grip = GRIP * goal / model.tolerance if attempt == 3 else 0.0
            iterate_loads(model, state, work, first, last, n, goal, softness, grip)
        elif attempt == 1:
            follow(model, state, work, first, last, n, goal, FIRST_COMPLIANCE)
        else:
            for s in range(first, last):
                block.impulse[block.order[s], 0] = block.impulse[block.order[s], 1] = 0.0
            recompute_velocities(model, velocity, block, first, last)
            follow(model, state, work, first, last, n, goal, 1.0)
        worst = residual(model, velocity, block, search, scratch, first, last, 0.0)
        if worst <= goal:
            return worst
        copy_impulses(block, first, last, search.rigid, block.impulse)
        recompute_velocities(model, velocity, block, first, last)
    return residual(model, velocity, block, search, scratch, first, last, 0.0)


@compiled
def follow(model, state, work, first, last, n, goal, compliance):
    """Solve an island for a compliance, and follow the solution to rigid contacts.

    Contacts yield by ``c p / rho``.  The compliance ``c`` is divided by more or less, as Newton's
    method converges.  Rigid contacts in closed loops leave impulses open, or nearly so: the path
    leads to those that a small compliance selects.
    """
    velocity, block, search, scratch = work.velocity, work.block, work.search, work.scratch
    factor, reached, trial = FIRST_FACTOR, np.inf, compliance
    while factor < LEAST_FACTOR:
        worst = residual(model, velocity, block, search, scratch, first, last, trial)
        steps, worst = newton_steps(model, work, first, last, n, goal, trial, trial, worst)
        increase(state.counts, NEWTON_STEPS, steps)
        if worst <= goal:
            reached = trial
            copy_impulses(block, first, last, block.impulse, search.initial)
            if (
                residual(model, velocity, block, search, scratch, first, last, 0.0) <= goal
                or reached <= RIGID
            ):
                return
            if steps < EASY_STEPS:
                factor = max(MOST_FACTOR, factor**1.5)
        elif reached == np.inf:
            return
        else:
            copy_impulses(block, first, last, search.initial, block.impulse)
            recompute_velocities(model, velocity, block, first, last)
            # Back to the last solution, and half as far from there, on the scale of powers.
            factor = np.sqrt(factor)
        trial = factor * reached


@compiled
def iterate_loads(model, state, work, first, last, n, goal, softness, grip):
    """Solve an island with known loads of friction, again and again with the loads that result.

    The first loads are those at hand, or stop a slip of the speed ``grip`` if it is not zero.  In
    Painleve's paradox only this start leads to the impulse that stops the slip.  Each problem is
    one round of :func:`approach`, which need not end at its solution; as rounds become harder, they
    do.  Where the loads go to and fro, only a share of their change is taken over.  From some of
    the impulses found, Newton's method is tried for the problem itself.
    """
    velocity, block, search, scratch = work.velocity, work.block, work.search, work.scratch
    share, former, best, idle, yielding = 1.0, np.inf, np.inf, 0, FIRST_YIELD
    worst, hard = residual(model, velocity, block, search, scratch, first, last, 0.0), 0
    few = work.manner.remedy[0] != LAST and last - first > MANY
    for _ in range(FEW_ROUNDS if few else LOAD_ROUNDS):
        detach_loads(block, first, last, share)
        if former == np.inf and grip > 0.0:
            grip_all(block, first, last, grip)
        copy_impulses(block, first, last, block.impulse, search.initial)
        enough = EXACT * max(goal, min(worst, goal / model.tolerance))
        steps = approach(model, work, first, last, n, yielding, enough)
        increase(state.counts, NEWTON_STEPS, steps)
        attach_loads(block, first, last)
        if steps == STEPS_OF_ROUND:
            copy_impulses(block, first, last, search.initial, block.impulse)
        recompute_velocities(model, velocity, block, first, last)
        worst = residual(model, velocity, block, search, scratch, first, last, 0.0)
        if steps == STEPS_OF_ROUND:
            # The round did not end: softer contacts make the next one easier.
            yielding /= HARDER
            if yielding > MOST_YIELD:
                return
            continue
        if yielding <= TRIED_YIELD:
            hard += 1
            if worst > goal and hard % TRIED_ROUNDS == 1:
                worst = try_newton(model, state, work, first, last, n, goal, softness, worst)
            idle = 0 if worst < 0.5 * best else idle + 1
            best = min(best, worst)
        if worst <= goal or idle == IDLE_ROUNDS:
            return
        # Loads that go to and fro between two problems meet in between.
        if worst > 0.5 * former:
            share = max(LEAST_CHANGE, 0.7 * share)
        former = worst
        if steps <= EASY_ROUND:
            yielding = max(LEAST_YIELD, HARDER * yielding)


@compiled
def try_newton(model, state, work, first, last, n, goal, softness, worst):
    """Try Newton's method from impulses, which remain if it fails; return the residual."""
    velocity, block, search, scratch = work.velocity, work.block, work.search, work.scratch
    copy_impulses(block, first, last, block.impulse, search.loaded)
    steps, least = newton_steps(model, work, first, last, n, goal, softness, 0.0, worst)
    increase(state.counts, NEWTON_STEPS, steps)
    if least <= goal:
        return least
    copy_impulses(block, first, last, search.loaded, block.impulse)
    recompute_velocities(model, velocity, block, first, last)
    return residual(model, velocity, block, search, scratch, first, last, 0.0)


@compiled
def grip_all(block, first, last, grip):
    """Give known loads to friction that stop a slip of this speed."""
    for s in range(first, last):
        b = block.order[s]
        if block.pressing[b] <= -2:
            block.load[b] = grip * block.delassus[b, 3]


@compiled
def detach_loads(block, first, last, share):
    """Turn the impulses that press on friction into known loads, a share of them newly."""
    for s in range(first, last):
        b = block.order[s]
        if block.pressing[b] >= 0:
            change = max(0.0, load_on(block, b)) - block.load[b]
            block.load[b] += share * change
            # Below -1 it tells a known load and still has the number of the block, so that nothing
            # has to be kept beside it.
            block.pressing[b] = -2 - block.pressing[b]


@compiled
def attach_loads(block, first, last):
    """Undo :func:`detach_loads`."""
    for s in range(first, last):
        b = block.order[s]
        if block.pressing[b] <= -2:
            block.pressing[b] = -2 - block.pressing[b]
