"""Islands that neither sweeps nor Newton steps solve: paths from simpler problems.

Both start where the solution is not in doubt.  Compliant contacts are each for itself nearly, and
contacts whose friction has a known load are a convex problem, with one solution for the velocities
([Acary]).
"""

import numpy as np

from polycorner.motion.engine.arrays import LAST, NEWTON_STEPS
from polycorner.motion.engine.gauss_seidel import copy_impulses, recompute_velocities, residual
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.multipliers import STEPS_OF_ROUND, approach
from polycorner.motion.engine.newton import newton_steps
from polycorner.motion.engine.rows import load_on
from polycorner.motion.engine.signals import increase

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
def continue_island(model, state, work, first, last, n, goal, softness):
    """Solve an island by continuation; return the residual.

    First the loads of friction are iterated; else the compliance of the contacts is taken from
    ``FIRST_COMPLIANCE`` to zero, from the impulses at hand; else from one to zero, from no
    impulses; else loads are iterated from those under which everything sticks.  If none of these
    leads to a solution, the impulses remain what they were.  Large islands for which shorter steps
    follow are given the first two attempts.
    """
    copy_impulses(work, first, last, work.impulse, work.rigid)
    few = work.remedy[0] != LAST and last - first > MANY
    for attempt in range(2 if few else 4):
        if attempt in (0, 3):
            grip = GRIP * goal / model.tolerance if attempt == 3 else 0.0
            iterate_loads(model, state, work, first, last, n, goal, softness, grip)
        elif attempt == 1:
            follow(model, state, work, first, last, n, goal, FIRST_COMPLIANCE)
        else:
            for s in range(first, last):
                work.impulse[work.order[s], 0] = work.impulse[work.order[s], 1] = 0.0
            recompute_velocities(model, work, first, last)
            follow(model, state, work, first, last, n, goal, 1.0)
        worst = residual(model, work, first, last, 0.0)
        if worst <= goal:
            return worst
        copy_impulses(work, first, last, work.rigid, work.impulse)
        recompute_velocities(model, work, first, last)
    return residual(model, work, first, last, 0.0)


@compiled
def follow(model, state, work, first, last, n, goal, compliance):
    """Solve an island for a compliance, and follow the solution to rigid contacts.

    Contacts yield by ``c p / rho``.  The compliance ``c`` is divided by more or less, as Newton's
    method converges.  Rigid contacts in closed loops leave impulses open, or nearly so: the path
    leads to those that a small compliance selects.
    """
    factor, reached, trial = FIRST_FACTOR, np.inf, compliance
    while factor < LEAST_FACTOR:
        worst = residual(model, work, first, last, trial)
        steps, worst = newton_steps(model, work, first, last, n, goal, trial, trial, worst)
        increase(state.counts, NEWTON_STEPS, steps)
        if worst <= goal:
            reached = trial
            copy_impulses(work, first, last, work.impulse, work.initial)
            if residual(model, work, first, last, 0.0) <= goal or reached <= RIGID:
                return
            if steps < EASY_STEPS:
                factor = max(MOST_FACTOR, factor**1.5)
        elif reached == np.inf:
            return
        else:
            copy_impulses(work, first, last, work.initial, work.impulse)
            recompute_velocities(model, work, first, last)
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
    share, former, best, idle, yielding = 1.0, np.inf, np.inf, 0, FIRST_YIELD
    worst, hard = residual(model, work, first, last, 0.0), 0
    few = work.remedy[0] != LAST and last - first > MANY
    for _ in range(FEW_ROUNDS if few else LOAD_ROUNDS):
        detach_loads(work, first, last, share)
        if former == np.inf and grip > 0.0:
            grip_all(work, first, last, grip)
        copy_impulses(work, first, last, work.impulse, work.initial)
        enough = EXACT * max(goal, min(worst, goal / model.tolerance))
        steps = approach(model, work, first, last, n, yielding, enough)
        increase(state.counts, NEWTON_STEPS, steps)
        attach_loads(work, first, last)
        if steps == STEPS_OF_ROUND:
            copy_impulses(work, first, last, work.initial, work.impulse)
        recompute_velocities(model, work, first, last)
        worst = residual(model, work, first, last, 0.0)
        if steps == STEPS_OF_ROUND:
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
        if worst > 0.5 * former:
            share = max(LEAST_CHANGE, 0.7 * share)
        former = worst
        if steps <= EASY_ROUND:
            yielding = max(LEAST_YIELD, HARDER * yielding)


@compiled
def try_newton(model, state, work, first, last, n, goal, softness, worst):
    """Try Newton's method from impulses, which remain if it fails; return the residual."""
    copy_impulses(work, first, last, work.impulse, work.loaded)
    steps, least = newton_steps(model, work, first, last, n, goal, softness, 0.0, worst)
    increase(state.counts, NEWTON_STEPS, steps)
    if least <= goal:
        return least
    copy_impulses(work, first, last, work.loaded, work.impulse)
    recompute_velocities(model, work, first, last)
    return residual(model, work, first, last, 0.0)


@compiled
def grip_all(work, first, last, grip):
    """Give known loads to friction that stop a slip of this speed."""
    for s in range(first, last):
        b = work.order[s]
        if work.pressing[b] <= -2:
            work.block_load[b] = grip * work.delassus[b, 3]


@compiled
def detach_loads(work, first, last, share):
    """Turn the impulses that press on friction into known loads, a share of them newly."""
    for s in range(first, last):
        b = work.order[s]
        if work.pressing[b] >= 0:
            change = max(0.0, load_on(work, b)) - work.block_load[b]
            work.block_load[b] += share * change
            work.pressing[b] = -2 - work.pressing[b]


@compiled
def attach_loads(work, first, last):
    """Undo :func:`detach_loads`."""
    for s in range(first, last):
        b = work.order[s]
        if work.pressing[b] <= -2:
            work.pressing[b] = -2 - work.pressing[b]
