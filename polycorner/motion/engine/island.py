"""Solution of an island of touching bodies."""

import numpy as np

from polycorner.motion.engine import codes
from polycorner.motion.engine.arrays import (
    DIVIDED,
    ISLANDS,
    LAST,
    NEWTON,
    NEWTON_STEPS,
    OWN_FRICTION,
    OWN_LIMIT,
    PLASTIC,
    POISSON,
    SMALL,
    STRONGE,
    SWEEPS,
    TIE_GAP,
)
from polycorner.motion.engine.bounds import INSTANT
from polycorner.motion.engine.continuation import MANY, continue_island
from polycorner.motion.engine.equilibrium import find_equilibrium
from polycorner.motion.engine.families import coordinates_of, kind_of
from polycorner.motion.engine.gauss_seidel import copy_impulses, relax_block, residual
from polycorner.motion.engine.impacts import (
    begin_expansion,
    compress,
    end_expansion,
    gain,
    go_back,
    has_bounces,
    mix,
    only_contact,
    promise,
    set_of,
    strike_alone,
)
from polycorner.motion.engine.island_matrix import number_bodies
from polycorner.motion.engine.island_sleep import stops
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.limits import ROUNDING
from polycorner.motion.engine.linear_algebra import add_square, solve_spd
from polycorner.motion.engine.newton import newton_steps
from polycorner.motion.engine.partition import island_of
from polycorner.motion.engine.rest import find_rest_velocity, keeps_contacts, keeps_limits
from polycorner.motion.engine.rows import copy_velocity, load_on, sticks, velocity_of
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
    manner, velocity, block = work.manner, work.velocity, work.block
    search, scratch = work.search, work.scratch
    goal, worst = model.tolerance * speed, np.inf
    n = number_bodies(model, work.body, block, work.graph, work.matrix, first, last)
    small = 0 < n * model.lanes <= FEW_LANES
    direct = n > 0 and (again or (small and last - first > FEW))
    enough = SPARE * goal if small else goal
    aim = goal  # of Newton steps, which go on to a share of it
    if model.limits > 0 and has_limit(block, first, last):
        enough = min(enough, ROUNDING * speed)
        aim = min(goal, enough / SPARE)
    worst = residual(model, velocity, block, search, scratch, first, last, 0.0)
    # The impulses of the step before may do: most islands of a heap at rest end here.
    if worst <= enough:
        return worst
    hard = min(MAX_SOFTNESS, FIRST_SOFTNESS * model.tolerance)
    rounds, done, former = 0, 0, np.inf
    while rounds == 0 or (worst > goal and done < model.sweeps):
        if rounds == 1:
            leave_errors(model, block, first, last, speed)
        if not direct or rounds > 0:
            for _ in range(FIRST_SWEEPS if rounds == 0 else ROUND_SWEEPS):
                worst = 0.0
                for s in range(first, last):
                    worst = max(worst, relax_block(model, velocity, block, scratch, block.order[s]))
                done += 1
                if worst <= enough:
                    break
            worst = residual(model, velocity, block, search, scratch, first, last, 0.0)
        if worst > enough and n > 0:
            phase = rounds % CYCLE_ROUNDS
            # Softer contacts have larger regions in which Newton steps converge; hard ones every
            # third round, since only these solve the island.
            softness = hard if phase == 0 or rounds == 1 else MAX_SOFTNESS * 3.0**phase
            steps, worst = newton_steps(model, work, first, last, n, aim, softness, 0.0, worst)
            increase(state.counts, NEWTON_STEPS, steps)
            if worst > goal and rounds == 1:
                if may_rest and rests(model, state, work, first, last, speed):
                    worst = residual(model, velocity, block, search, scratch, first, last, 0.0)
                    break
                if manner.remedy[0] == DIVIDED and last - first <= MANY:
                    break
                worst = continue_island(model, state, work, first, last, n, goal, hard)
                if worst > goal and manner.remedy[0] != LAST:
                    break
            if phase == CYCLE_ROUNDS - 1:
                if worst > 0.5 * former:
                    break
                former = worst
        rounds += 1
    increase(state.counts, SWEEPS, done)
    return worst


@compiled
def has_limit(block, first, last):
    """Return whether a limit on velocities is in an island: velocities keep it up to rounding."""
    found = False
    for s in range(first, last):
        found = found or block.origin[block.order[s], 0] == OWN_LIMIT
    return found


@compiled
def solve_acting(model, state, work, first, last, speed, again, may_rest):
    """Solve an island for the blocks that may act; return the residual.

    In a heap most contacts remain open.  Those that do not press and will not have used up most of
    their gaps are left out, and looked at afterwards: they are added, and the island solved again,
    where they would be violated.
    """
    velocity, block, search = work.velocity, work.block, work.search
    acting, goal = last, model.tolerance * speed
    if last - first > CROWD:
        acting = gather_acting(model, velocity, block, search, first, last)
    while True:
        worst, before = 0.0, acting
        if acting > first:
            worst = iterate(model, state, work, first, acting, speed, again, may_rest)
        for s in range(before, last):
            b = block.order[s]
            velocity_of(model, block, b, velocity.new, block.after[b])
            if block.rows[b] == 0:
                worst = max(worst, -block.after[b, 0])
                if block.after[b, 0] < -goal:
                    acting = move_forward(block, search, s, acting)
        if acting == before:
            return worst
        for s in range(acting, last):
            b = block.order[s]
            if block.rows[b] > 0 and search.carries[block.pressing[b]]:
                acting = move_forward(block, search, s, acting)
        # Most of it is solved: Newton steps from here are better than sweeps.
        again = True


@compiled
def gather_acting(model, velocity, block, search, first, last):
    """Bring the blocks that may act to the front of an island; return where the others begin."""
    for s in range(first, last):
        b = block.order[s]
        velocity_of(model, block, b, velocity.new, block.after[b])
        search.carries[b] = 1.0
        if block.rows[b] == 0 and not block.bilateral[b] and block.impulse[b, 0] == 0.0:
            search.carries[b] = block.after[b, 0] < NEARLY_OPEN * max(0.0, block.offset[b, 0])
    for s in range(first, last):
        b = block.order[s]
        if block.pressing[b] >= 0 and (block.impulse[b, 0] != 0.0 or block.impulse[b, 1] != 0.0):
            # Friction that acts keeps its contact, though that does not press at the moment.
            search.carries[block.pressing[b]] = 1.0
    acting = first
    for s in range(first, last):
        b = block.order[s]
        pressing = block.pressing[b]
        if search.carries[b] if pressing < 0 else search.carries[pressing]:
            acting = move_forward(block, search, s, acting)
    return acting


@compiled
def move_forward(block, search, s, acting):
    """Move a block to the end of those that act; return their new end."""
    b = block.order[s]
    block.order[s], block.order[acting] = block.order[acting], b
    search.carries[b] = 1.0
    return acting + 1


@compiled
def leave_errors(model, block, first, last, speed):
    """Let small errors of closed gaps be, and what ties in closed loops ask too much.

    Equations that follow from others agree with them up to curvature only: forces that are to
    make up for the difference would grow without bound.  Curvature is corrected afterwards.
    """
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] > 0:
            continue
        if block.bilateral[b]:
            if block.origin[b, 0] == TIE_GAP and abs(block.after[b, 0]) < model.dependent * speed:
                block.offset[b, 0] -= block.after[b, 0]
        elif block.bound[b] == SMALL:
            block.offset[b, 0] = 0.0


@compiled
def switch_reversed_slips(model, body, block, search, first, last):
    """Give the static set to contacts whose slip reversed; return whether any was switched.

    Slip that reverses within a step was zero within it, where the static set decides whether the
    contact slips again.
    """
    found = False
    for s in range(first, last):
        b = block.order[s]
        # Once in a step: a contact that switched to and fro would never end.
        if block.rows[b] == 0 or search.reversed[b]:
            continue
        along = 0.0
        for r in range(block.rows[b]):
            along += (block.before[b, r] + block.offset[b, r]) * block.after[b, r]
        # What sticks may still go on to slip, where its slip is stopped at the end of the step.
        if along < 0.0 and not sticks(model, body, block, b):
            search.reversed[b] = 1
            shape = set_of(model, block, b, 0)
            if shape != block.set[b]:
                block.set[b] = shape
                found = True
    return found


@compiled
def begin_island(state, body, block, search, first, last):
    """Return the speed of an island after forces alone, and whether all its bodies are at rest."""
    speed, at_rest = 0.0, True
    for s in range(first, last):
        b = block.order[s]
        search.reversed[b] = 0
        for r in range(max(1, block.rows[b])):
            speed = max(speed, abs(block.free[b, r] + block.offset[b, r]))
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i >= 0 and body.awake[i]:  # sleepers may touch several islands
                body.island_speed[i] = max(body.island_speed[i], speed)
                at_rest = at_rest and state.rests[i] != 0
    increase(state.counts, ISLANDS, ONE)
    return speed, at_rest


@compiled
def solve_island(model, state, work, first, last, again):
    """Solve the blocks ``order[first:last]``; return the residual relative to the speeds.

    For an island at rest, first a feasibility problem is solved; see :func:`find_equilibrium`.
    What is not, but all but stands still, may be stopped; see
    :mod:`~polycorner.motion.engine.island_sleep`.
    """
    velocity, block, search, scratch = work.velocity, work.block, work.search, work.scratch
    speed, at_rest = begin_island(state, work.body, block, search, first, last)
    proved, root = work.island.proved, island_of(work.body, work.island, block, block.order[first])
    proved[root] = 0
    if speed == 0.0:  # no motion and no force
        for s in range(first, last):
            for r in range(2):
                block.impulse[block.order[s], r] = block.after[block.order[s], r] = 0.0
        for s in range(first, last):
            for side in range(2):
                i = block.bodies[block.order[s], side]
                if i >= 0:
                    copy_velocity(model, velocity.free, velocity.new, i)
        return 0.0
    if at_rest and rests(model, state, work, first, last, speed):
        proved[root] = 1 if stops(model, state, work, first, last) else 0
        return residual(model, velocity, block, search, scratch, first, last, 0.0) / speed
    bounces = model.impact != PLASTIC and has_bounces(block, first, last)
    if bounces and model.impact in (POISSON, STRONGE):
        compress(block, first, last)
    worst = solve_slipping(model, state, work, first, last, speed, again, not at_rest)
    solved = worst <= model.tolerance * speed
    if solved and not (at_rest or bounces) and stops(model, state, work, first, last):
        proved[root] = 1
        return residual(model, velocity, block, search, scratch, first, last, 0.0) / speed
    if keeps_grip(model, state, work, first, last, speed, solved):
        worst = residual(model, velocity, block, search, scratch, first, last, 0.0)
    if model.impact in (POISSON, STRONGE):
        worst = max(worst, expand_island(model, state, work, first, last, speed, bounces))
    elif bounces and model.impact == NEWTON:
        worst = max(worst, limit_island(model, state, work, first, last, speed))
    return worst / speed


@compiled
def solve_slipping(model, state, work, first, last, speed, again, may_rest):
    """Solve an island, again where slip reverses; return the residual."""
    while True:
        worst = solve_acting(model, state, work, first, last, speed, again, may_rest)
        if worst > model.tolerance * speed or not switch_reversed_slips(
            model, work.body, work.block, work.search, first, last
        ):
            return worst


@compiled
def expand_island(model, state, work, first, last, speed, bounces):
    """Let an island expand after a compression; return the residual of the expansion."""
    velocity, block, h = work.velocity, work.block, work.shared.times[codes.LENGTH]
    # As :func:`store_impulses` tells an impact.
    instant = h / model.step <= INSTANT
    if not (bounces or instant):
        return 0.0
    worst, contact, friction = 0.0, NONE, NONE
    if model.impact == STRONGE:
        contact, friction = only_contact(block, first, last)
    if contact >= 0:
        strike_alone(model, state, work, first, last, contact, friction)
    else:
        lost = gain(model, velocity, block, first, last)
        if begin_expansion(model, state, work, first, last, h, instant):
            worst = solve_slipping(model, state, work, first, last, speed, False, False)
            end_expansion(model, work, first, last)
            go_back(model, velocity, block, first, last, lost)
    promise(model, velocity, block, first, last)
    return worst


@compiled
def limit_island(model, state, work, first, last, speed):
    """Take back what an impact by Newton's law gains; return the residual of its compression."""
    velocity, block = work.velocity, work.block
    if not gain(model, velocity, block, first, last) > 0.0:
        return 0.0
    copy_impulses(block, first, last, block.impulse, block.expanded)
    compress(block, first, last)
    worst = solve_slipping(model, state, work, first, last, speed, True, False)
    copy_impulses(block, first, last, block.impulse, block.compressed)
    lost = gain(model, velocity, block, first, last)
    mix(model, velocity, block, first, last, 1.0)
    go_back(model, velocity, block, first, last, lost)
    promise(model, velocity, block, first, last)
    return worst


@compiled
def rests(model, state, work, first, last, speed):
    """Return whether an island that hardly moves can be at rest after the step; then it is.

    Where it sticks in closed loops, the errors of its gaps cannot all be corrected at once without
    forces that grow without bound: nothing but rest solves the step.
    """
    mid, velocity, block, scratch = work.mid, work.velocity, work.block, work.scratch
    k, v, rest = model.dimension, velocity.rest, scratch.rest_velocity
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i < 0:
                continue
            for c in range(k):
                v[i, c] = state.v[i, c]
            if not work.body.awake[i]:
                continue
            still = state.rests[i] and keeps_limits(model, work.limit, i, state.v[i])
            if still and keeps_contacts(model, mid, state.normal, i, state.v[i]):
                continue
            if not find_rest_velocity(model, mid, work.limit, scratch, state.normal, i, rest):
                return False
            for c in range(k):
                far = abs(velocity.new[i, c] - rest[c]) * model.units[kind_of(model, i), c]
                # A body that was not at rest may be stopped only where it hardly moves: rest must
                # not swallow a motion.
                if not state.rests[i] and far > SLOW * speed:
                    return False
                v[i, c] = rest[c]
    # At rest no slip is left at the end of the step.
    copy_impulses(block, first, last, block.target, work.search.rigid)
    for s in range(first, last):
        block.target[block.order[s], 0] = block.target[block.order[s], 1] = 0.0
    if find_equilibrium(model, state, work, first, last, speed, ZERO):
        return True
    copy_impulses(block, first, last, work.search.rigid, block.target)
    return False


@compiled
def keeps_grip(model, state, work, first, last, speed, solved):
    """Return whether an island of one body that stuck, and now slips or is not solved, can stick.

    Then the impulses that hold it, and its velocity, are the solution.  Where loads depend on
    friction, slip can solve a step that sticking solves as well: what stuck goes on to stick.
    """
    velocity, block, search = work.velocity, work.block, work.search
    i = block.bodies[block.order[first], 0]
    if not (
        loses_grip(model, state, work.body, block, first, last, i, solved)
        and find_grip_velocity(model, velocity, block, work.scratch, first, last, i)
    ):
        return False
    copy_impulses(block, first, last, block.offset, search.rigid)
    if find_equilibrium(model, state, work, first, last, speed, ZERO):
        return True
    # It moves bounds to where rest would have them; the solution at hand is of those before.
    copy_impulses(block, first, last, search.rigid, block.offset)
    return False


@compiled
def loses_grip(model, state, body, block, first, last, i, solved):
    """Return whether all friction of a body stuck before the step, and some slips after it.

    Where the step is not solved it counts as slipping.  The velocities after the step must have
    been evaluated.
    """
    slips = False
    for s in range(first, last):
        b = block.order[s]
        # Several bodies may stick and slip in many ways; the question is only asked of one.
        if block.bodies[b, 1] >= 0 or block.origin[b, 0] > OWN_FRICTION:
            return False
        if block.origin[b, 0] != OWN_FRICTION or load_on(block, b) <= 0.0:
            continue
        if not state.sticks[block.origin[b, 2]]:
            return False
        slips = slips or not solved or not sticks(model, body, block, b)
    return slips


@compiled
def find_grip_velocity(model, velocity, block, scratch, first, last, i):
    """Find the velocity of a body at which its loaded blocks neither slip nor open.

    It is that of least squares; :func:`find_equilibrium` checks that nothing slips at it.
    """
    k, A, x = coordinates_of(model, i), scratch.matrix, scratch.rest_velocity
    for c in range(k):
        x[c] = 0.0
        for a in range(k):
            A[c, a] = 0.0
    for s in range(first, last):
        b = block.order[s]
        loaded = block.bilateral[b] or block.impulse[b, 0] > 0.0
        if block.rows[b] > 0:
            loaded = load_on(block, b) > 0.0
        if not loaded:
            continue
        for r in range(max(1, block.rows[b])):
            row, offset = block.jacobian[b, r, :k], block.offset[b, r] - block.target[b, r]
            if model.timed:
                offset += block.jacobian[b, r, model.dimension]
            add_square(A, row, 1.0, k)
            for c in range(k):
                x[c] -= offset * row[c]
    if not solve_spd(A, x, k):
        return False
    for c in range(k):
        velocity.rest[i, c] = x[c]
    return True
