"""Solution of the islands of a step."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import ISLANDS, NEWTON_STEPS, OWN_FRICTION, OWN_GAP, SWEEPS
from polycorner.motion.engine.band import number_bodies
from polycorner.motion.engine.blocks import STRAIGHT
from polycorner.motion.engine.bounds import equation_offset
from polycorner.motion.engine.continuation import MANY, continue_island
from polycorner.motion.engine.equilibrium import find_equilibrium
from polycorner.motion.engine.evaluation import evaluate_gaps, evaluate_pair_gaps, settled
from polycorner.motion.engine.gauss_seidel import relax_block, residual
from polycorner.motion.engine.grip import keeps_grip
from polycorner.motion.engine.jit import NONE, compiled
from polycorner.motion.engine.neighbours import speed_of
from polycorner.motion.engine.newton import newton_steps
from polycorner.motion.engine.partition import island_of
from polycorner.motion.engine.paths import CURVATURE_DEPTH
from polycorner.motion.engine.rest import find_rest_velocity, keeps_contacts
from polycorner.motion.engine.rows import copy_velocity

FIRST_SOFTNESS = 1e2  # relative softness of contacts in Newton steps, over the tolerance
MAX_SOFTNESS = 1e-2  # its largest value; further rounds multiply this by powers of three
CYCLE_ROUNDS = 3
MOST_CORRECTIONS = 8  # solutions of a step, at most, for the curvature of equations
MISSED = 1e-12  # scaled gap up to which an equation holds
FIRST_SWEEPS, ROUND_SWEEPS = 2, 10  # in the first round, and in others
SMALL = 8  # lanes of a small island
FEW = 8  # blocks of a small island up to which sweeps, which may be exact, come first
SPARE = 1e-2  # share of the tolerance to which small islands are solved if possible
BENT = 2  # of a velocity bound: it was raised for the curvature of its gap
SLOW = 1e-4  # of the speeds that forces give: bodies that may be at rest


@compiled
def iterate(model, state, work, first, last, speed, sweeps, again):
    """Solve an island by rounds of Gauss-Seidel sweeps and Newton steps; return the residual.

    Small islands, which cost little, are solved more exactly than asked, and begin with Newton
    steps if they have more than a few blocks; so do islands that are solved ``again``, from a
    solution that is nearly theirs.  Where a round does not do, the small errors of
    closed gaps are left as they are: contacts that stick in closed loops cannot correct all of
    them, and would jam.  Where the next does not do either, the island is given up if its step may
    be divided, which costs less unless it is large; if not, the solution is continued from that of
    simpler problems.  After that contacts are made softer from round to round, and hard again.  It
    ends when the residual has reached its goal, when ``sweeps`` are done, or when a cycle of rounds
    has not halved the residual.
    """
    goal, worst = model.tolerance * speed, np.inf
    n = number_bodies(model, state, work, first, last)
    small = 0 < n * model.lanes <= SMALL
    direct = n > 0 and (again or (small and last - first > FEW))
    enough = SPARE * goal if small else goal
    worst = residual(model, work, first, last, 0.0)
    if worst <= enough:
        return worst
    hard = min(MAX_SOFTNESS, FIRST_SOFTNESS * model.tolerance)
    rounds, done, former = 0, 0, np.inf
    while rounds == 0 or (worst > goal and done < sweeps):
        if rounds == 1:
            leave_errors(work, first, last)
        if not direct or rounds > 0:
            for _ in range(FIRST_SWEEPS if rounds == 0 else ROUND_SWEEPS):
                worst = 0.0
                for s in range(first, last):
                    worst = max(worst, relax_block(model, work, work.order[s]))
                done += 1
                if worst <= enough:
                    break
            worst = residual(model, work, first, last, 0.0)
        if worst > enough and n > 0:
            phase = rounds % CYCLE_ROUNDS
            softness = hard if phase == 0 or rounds == 1 else MAX_SOFTNESS * 3.0**phase
            steps, worst = newton_steps(model, work, first, last, n, goal, softness, 0.0, worst)
            state.counts[NEWTON_STEPS] += steps
            if worst > goal and rounds == 1:
                if work.may_divide[0] == 1 and last - first <= MANY:
                    break
                worst = continue_island(model, state, work, first, last, n, goal, hard)
                if worst > goal and work.may_divide[0]:
                    break
            if phase == CYCLE_ROUNDS - 1:
                if worst > 0.5 * former:
                    break
                former = worst
        rounds += 1
    state.counts[SWEEPS] += done
    return worst


@compiled
def leave_errors(work, first, last):
    """Let small errors of closed gaps be."""
    for s in range(first, last):
        b = work.order[s]
        if work.block_rows[b] == 0 and work.is_error[b] == 1:
            work.offset[b, 0] = 0.0


@compiled
def switch_reversed_slips(model, state, work, first, last):
    """Give the static set to contacts whose slip reversed; return whether any was switched.

    Slip that reverses within a step was zero within it, where the static set decides whether the
    contact slips again.
    """
    found = False
    for s in range(first, last):
        b = work.order[s]
        if work.block_rows[b] == 0 or work.reversed[b]:
            continue
        along = 0.0
        for r in range(work.block_rows[b]):
            along += (work.before[b, r] + work.offset[b, r]) * work.after[b, r]
        if along < 0.0:
            work.reversed[b] = 1
            kind, f = work.origin[b, 0], work.origin[b, 2]
            shape = model.friction_sets[f, 0] if kind == OWN_FRICTION else model.pair_sets[0]
            if shape != work.block_set[b]:
                work.block_set[b] = shape
                found = True
    return found


@compiled
def solve_island(model, state, work, first, last, again):
    """Solve the blocks ``order[first:last]``; return the residual relative to the speeds.

    For an island at rest, first a feasibility problem is solved; see :func:`find_equilibrium`.
    """
    speed, at_rest = 0.0, True
    for s in range(first, last):
        b = work.order[s]
        work.reversed[b] = 0
        for r in range(max(1, work.block_rows[b])):
            speed = max(speed, abs(work.free[b, r] + work.offset[b, r]))
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i >= 0:
                work.island_speed[i] = max(work.island_speed[i], speed)
                if work.awake[i] and not state.rests[i]:
                    at_rest = False
    state.counts[ISLANDS] += 1
    if speed == 0.0:  # no motion and no force
        for s in range(first, last):
            for r in range(2):
                work.impulse[work.order[s], r] = work.after[work.order[s], r] = 0.0
        for s in range(first, last):
            for side in range(2):
                i = work.block_bodies[work.order[s], side]
                if i >= 0:
                    copy_velocity(model, work.v_free, work.v_new, i)
        return 0.0
    if at_rest and rests(model, state, work, first, last, speed):
        return residual(model, work, first, last, 0.0) / speed
    while True:
        worst = iterate(model, state, work, first, last, speed, model.sweeps, again)
        if worst > model.tolerance * speed or not switch_reversed_slips(
            model, state, work, first, last
        ):
            break
    if (
        worst > model.tolerance * speed
        and not at_rest
        and rests(model, state, work, first, last, speed)
    ):
        worst = residual(model, work, first, last, 0.0)
    solved = worst <= model.tolerance * speed
    if keeps_grip(model, state, work, first, last, speed, solved):
        worst = residual(model, work, first, last, 0.0)
    return worst / speed


@compiled
def rests(model, state, work, first, last, speed):
    """Return whether an island that hardly moves can be at rest after the step; then it is.

    Where it sticks in closed loops, the errors of its gaps cannot all be corrected at once without
    forces that grow without bound: nothing but rest solves the step.
    """
    k, v, rest = model.dimension, work.v_rest, work.rest_velocity
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i < 0:
                continue
            for c in range(k):
                v[i, c] = state.v[i, c]
            if state.rests[i] and not keeps_contacts(model, work, state.normal, i, state.v[i]):
                return False  # the velocity of rest changes from place to place
            if not work.awake[i] or state.rests[i]:
                continue
            if not find_rest_velocity(model, work, state.normal, i, rest):
                return False
            for c in range(k):
                if abs(work.v_new[i, c] - rest[c]) * model.units[c] > SLOW * speed:
                    return False
                v[i, c] = rest[c]
    return find_equilibrium(model, state, work, first, last, speed)


@compiled
def solve_islands(model, state, work, blocks, h, again):
    """Solve all islands, perhaps ``again``; those whose gaps would close by curvature, twice.

    Equations are solved for until they hold at the next midpoint, here if forces do not depend on
    the velocity; if they do, see :func:`follow_curvature`.
    """
    starts = work.island_start
    here = model.unilateral < model.restitution.size and not model.follows_velocity
    most = MOST_CORRECTIONS if here else 2
    for attempt in range(most):
        for i in range(model.bodies):
            if starts[i + 1] > starts[i] and (attempt == 0 or work.curves_shut[i]):
                work.island_residual[i] = solve_island(
                    model, state, work, starts[i], starts[i + 1], again or attempt > 0
                )
        if attempt == most - 1 or not correct_curvature(model, state, work, blocks, h):
            break


@compiled
def correct_curvature(model, state, work, blocks, h):
    """Raise the velocity bounds of gaps that close by their curvature; return whether any does.

    The linearised gap misses what curvature adds within the step.  The bound becomes that of
    Newton's method for the gap itself.  Pairs of bodies are examined only if they move fast enough.
    """
    k, found = model.dimension, False
    for i in range(model.bodies):
        work.curves_shut[i] = 0
        for c in range(k):
            work.q_next[i, c] = work.q_mid[i, c] + h * work.v_new[i, c]
        work.speed[i] = speed_of(model, work.v_new, i)
    fast = np.sqrt(0.5 * CURVATURE_DEPTH) * model.gap_unit / h
    first, second = NONE, NONE
    for b in range(blocks):
        if work.block_rows[b] > 0:
            continue
        i, g = work.block_bodies[b, 0], work.origin[b, 2]
        if work.origin[b, 0] == OWN_GAP:
            if i != first:
                evaluate_gaps(model, work, i, work.q_next, work.gap_next, work.gradient_next)
            first, second = i, NONE
            gap, following = work.gap[i, g], work.gap_next[i, g]
        else:
            j = work.block_bodies[b, 1]
            if work.speed[i] + work.speed[j] <= fast:
                continue
            if i != first or j != second:
                evaluate_pair_gaps(model, work, i, j, work.q_next)
            first, second = i, j
            gap = work.contact_gap[work.origin[b, 1]]
            following = work.scratch[model.pair_inputs + g]
        if work.bilateral[b]:
            if model.follows_velocity:
                continue
            if bend_equation(model, work, b, gap, following, h, model.tolerance):
                work.curves_shut[island_of(work, b)] = 1
                found = True
            continue
        target = min(0.0, gap - h * work.offset[b, 0] - work.block_load[b])
        if following < target - CURVATURE_DEPTH * model.gap_unit:
            work.block_load[b] = gap + h * (work.after[b, 0] - work.offset[b, 0]) - following
            work.offset[b, 0] = (gap - work.block_load[b] - target) / h
            work.is_error[b] = BENT
            work.curves_shut[island_of(work, b)] = 1
            found = True
    return found


@compiled
def bend_equation(model, work, b, gap, following, h, share):
    """Correct an equation that does not hold at the next midpoint; return whether it does not.

    It does up to a share of what bodies travel.
    """
    never_inline()
    if h <= STRAIGHT * model.step:
        return False
    speed = work.island_speed[work.block_bodies[b, 0]]
    missed = abs(following - gap + h * gap / model.step)
    if missed <= MISSED * model.gap_unit + share * h * speed:
        return False
    work.block_load[b] = gap + h * (work.after[b, 0] - work.offset[b, 0]) - following
    work.offset[b, 0] = equation_offset(model, gap, -work.block_load[b], h)
    return True


@compiled
def bend_bound(model, work, b, gap, following, h, share):
    """Correct the bound of a contact whose gap curves otherwise; return whether it does."""
    never_inline()
    speed = work.island_speed[work.block_bodies[b, 0]]
    closing = gap + h * (work.after[b, 0] - work.offset[b, 0]) - following
    more = closing - work.block_load[b]
    if abs(more) <= MISSED * model.gap_unit + share * h * speed:
        return False
    work.block_load[b] = closing
    work.offset[b, 0] -= more / h
    return True


@compiled
def follow_curvature(model, state, work, blocks, h):
    """Correct equations and bounds that curve otherwise than they were solved for.

    The bounds are those that :func:`correct_curvature` raised.  Return whether there are any.
    """
    k, found = model.dimension, False
    for i in range(model.bodies):
        for c in range(k):
            work.q_next[i, c] = work.q_mid[i, c] + h * work.v_new[i, c]
    first, second = NONE, NONE
    for b in range(blocks):
        if work.block_rows[b] > 0 or not (work.bilateral[b] or work.is_error[b] == BENT):
            continue
        i, j, g = work.block_bodies[b, 0], work.block_bodies[b, 1], work.origin[b, 2]
        share, away = settled(model, work, i), i != first or j != second
        if j < 0:
            if away:
                evaluate_gaps(model, work, i, work.q_next, work.gap_next, work.gradient_next)
            gap, following = work.gap[i, g], work.gap_next[i, g]
        else:
            if away:
                evaluate_pair_gaps(model, work, i, j, work.q_next)
            gap = work.contact_gap[work.origin[b, 1]]
            following = work.scratch[model.pair_inputs + g]
        first, second = i, j
        if work.bilateral[b]:
            found = bend_equation(model, work, b, gap, following, h, share) or found
        else:
            found = bend_bound(model, work, b, gap, following, h, share) or found
    return found
