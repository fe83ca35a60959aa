"""Solution of an island of touching bodies."""

import numpy as np

from polycorner.motion.engine.arrays import (
    DIVIDED,
    ISLANDS,
    LAST,
    NEWTON_STEPS,
    OWN_FRICTION,
    SMALL,
    SWEEPS,
)
from polycorner.motion.engine.continuation import MANY, continue_island
from polycorner.motion.engine.equilibrium import find_equilibrium
from polycorner.motion.engine.gauss_seidel import relax_block, residual
from polycorner.motion.engine.grip import keeps_grip
from polycorner.motion.engine.island_matrix import number_bodies
from polycorner.motion.engine.jit import ONE, compiled
from polycorner.motion.engine.newton import newton_steps
from polycorner.motion.engine.rest import find_rest_velocity, keeps_contacts
from polycorner.motion.engine.rows import copy_velocity, velocity_of
from polycorner.motion.engine.signals import increase

FIRST_SOFTNESS = 1e2  # relative softness of contacts in Newton steps, over the tolerance
MAX_SOFTNESS = 1e-2  # its largest value; further rounds multiply this by powers of three
CYCLE_ROUNDS = 3
FIRST_SWEEPS, ROUND_SWEEPS = 2, 10  # in the first round, and in others
FEW_LANES = 8  # of a small island
FEW = 8  # blocks of a small island up to which sweeps, which may be exact, come first
CROWD = 64  # blocks beyond which those that do not act are left out
NEARLY_OPEN = 0.2  # share of a gap that has to be left for a contact not to act
SPARE = 1e-2  # share of the tolerance to which small islands are solved if possible
SLOW = 1e-4  # of the speeds that forces give: bodies that may be at rest


@compiled
def iterate(model, state, work, first, last, speed, again, may_rest):
    """Solve an island by rounds of Gauss-Seidel sweeps and Newton steps; return the residual.

    Small islands, which cost little, are solved more exactly than asked, and begin with Newton
    steps if they have more than a few blocks; so do islands that are solved ``again``, from a
    solution that is nearly theirs.  Where a round does not do, the small errors of
    closed gaps are left as they are: contacts that stick in closed loops cannot correct all of
    them, and would jam.  Where the next does not do either, the island is given up if its step may
    be divided, which costs less unless it is large; if not, the solution is continued from that of
    simpler problems.  Before, an island that may rest is asked whether it can.  After that contacts
    are made softer from round to round, and hard again.  It ends when the residual has reached its
    goal, when ``model.sweeps`` are done, or when a cycle of rounds has not halved the residual.
    """
    goal, worst = model.tolerance * speed, np.inf
    n = number_bodies(model, work, first, last)
    small = 0 < n * model.lanes <= FEW_LANES
    direct = n > 0 and (again or (small and last - first > FEW))
    enough = SPARE * goal if small else goal
    worst = residual(model, work, first, last, 0.0)
    if worst <= enough:
        return worst
    hard = min(MAX_SOFTNESS, FIRST_SOFTNESS * model.tolerance)
    rounds, done, former = 0, 0, np.inf
    while rounds == 0 or (worst > goal and done < model.sweeps):
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
            increase(state.counts, NEWTON_STEPS, steps)
            if worst > goal and rounds == 1:
                if may_rest and rests(model, state, work, first, last, speed):
                    worst = residual(model, work, first, last, 0.0)
                    break
                if work.remedy[0] == DIVIDED and last - first <= MANY:
                    break
                worst = continue_island(model, state, work, first, last, n, goal, hard)
                if worst > goal and work.remedy[0] != LAST:
                    break
            if phase == CYCLE_ROUNDS - 1:
                if worst > 0.5 * former:
                    break
                former = worst
        rounds += 1
    increase(state.counts, SWEEPS, done)
    return worst


@compiled
def solve_acting(model, state, work, first, last, speed, again, may_rest):
    """Solve an island for the blocks that may act; return the residual.

    In a heap most contacts remain open.  Those that do not press and will not have used up most of
    their gaps are left out, and looked at afterwards: they are added, and the island solved again,
    where they would be violated.
    """
    acting, goal = last, model.tolerance * speed
    if last - first > CROWD:
        acting = gather_acting(model, work, first, last)
    while True:
        worst, before = 0.0, acting
        if acting > first:
            worst = iterate(model, state, work, first, acting, speed, again, may_rest)
        for s in range(before, last):
            b = work.order[s]
            velocity_of(model, work, b, work.v_new, work.after[b])
            if work.block_rows[b] == 0:
                worst = max(worst, -work.after[b, 0])
                if work.after[b, 0] < -goal:
                    acting = move_forward(work, s, acting)
        if acting == before:
            return worst
        for s in range(acting, last):
            b = work.order[s]
            if work.block_rows[b] > 0 and work.carries[work.pressing[b]]:
                acting = move_forward(work, s, acting)
        again = True


@compiled
def gather_acting(model, work, first, last):
    """Bring the blocks that may act to the front of an island; return where the others begin."""
    for s in range(first, last):
        b = work.order[s]
        velocity_of(model, work, b, work.v_new, work.after[b])
        work.carries[b] = 1.0
        if work.block_rows[b] == 0 and not work.bilateral[b] and work.impulse[b, 0] == 0.0:
            work.carries[b] = work.after[b, 0] < NEARLY_OPEN * max(0.0, work.offset[b, 0])
    for s in range(first, last):
        b = work.order[s]
        if work.pressing[b] >= 0 and (work.impulse[b, 0] != 0.0 or work.impulse[b, 1] != 0.0):
            work.carries[work.pressing[b]] = 1.0
    acting = first
    for s in range(first, last):
        b = work.order[s]
        pressing = work.pressing[b]
        if work.carries[b] if pressing < 0 else work.carries[pressing]:
            acting = move_forward(work, s, acting)
    return acting


@compiled
def move_forward(work, s, acting):
    """Move a block to the end of those that act; return their new end."""
    b = work.order[s]
    work.order[s], work.order[acting] = work.order[acting], b
    work.carries[b] = 1.0
    return acting + 1


@compiled
def leave_errors(work, first, last):
    """Let small errors of closed gaps be."""
    for s in range(first, last):
        b = work.order[s]
        if work.block_rows[b] == 0 and work.bound[b] == SMALL:
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
            shape = model.friction_sets[f, 0] if kind == OWN_FRICTION else model.pair_sets[f, 0]
            if shape != work.block_set[b]:
                work.block_set[b] = shape
                found = True
    return found


@compiled
def begin_island(state, work, first, last):
    """Return the speed of an island after forces alone, and whether all its bodies are at rest."""
    speed, at_rest = 0.0, True
    for s in range(first, last):
        b = work.order[s]
        work.reversed[b] = 0
        for r in range(max(1, work.block_rows[b])):
            speed = max(speed, abs(work.free[b, r] + work.offset[b, r]))
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i >= 0 and work.awake[i]:  # sleepers may touch several islands
                work.island_speed[i] = max(work.island_speed[i], speed)
                at_rest = at_rest and state.rests[i] != 0
    increase(state.counts, ISLANDS, ONE)
    return speed, at_rest


@compiled
def solve_island(model, state, work, first, last, again):
    """Solve the blocks ``order[first:last]``; return the residual relative to the speeds.

    For an island at rest, first a feasibility problem is solved; see :func:`find_equilibrium`.
    """
    speed, at_rest = begin_island(state, work, first, last)
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
        worst = solve_acting(model, state, work, first, last, speed, again, not at_rest)
        if worst > model.tolerance * speed or not switch_reversed_slips(
            model, state, work, first, last
        ):
            break
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
            if not work.awake[i]:
                continue
            if state.rests[i] and keeps_contacts(model, work, state.normal, i, state.v[i]):
                continue
            if not find_rest_velocity(model, work, state.normal, i, rest):
                return False
            for c in range(k):
                far = abs(work.v_new[i, c] - rest[c]) * model.units[c]
                if not state.rests[i] and far > SLOW * speed:
                    return False
                v[i, c] = rest[c]
    return find_equilibrium(model, state, work, first, last, speed)
