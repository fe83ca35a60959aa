"""Bounds and equations that follow the curvature of gaps within a step."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import (
    BENT,
    CHANGED,
    OWN_GAP,
    OWN_LIMIT,
    SETTLED,
    TIE_GAP,
)
from polycorner.motion.engine.bounds import STRAIGHT, equation_offset
from polycorner.motion.engine.crowds import is_crowd
from polycorner.motion.engine.evaluation import evaluate_gaps, evaluate_pair_gaps, settled
from polycorner.motion.engine.families import family_of, pair_inputs
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.mean_slip import stop_slips
from polycorner.motion.engine.neighbours import speed_of
from polycorner.motion.engine.partition import island_of
from polycorner.motion.engine.paths import tie_code
from polycorner.motion.engine.rows import speed_at
from polycorner.motion.engine.ties import evaluate_tie, row_inputs

MISSED = 1e-12  # scaled gap up to which an equation holds


@compiled
def correct_curvature(model, state, work, blocks, h):
    """Raise the velocity bounds of gaps that close by their curvature; return whether any does.

    So it is with friction whose slip stops, which then has to vanish at the end of the step.
    The linearised gap misses what curvature adds within the step.  The bound becomes that of
    Newton's method for the gap itself.  Pairs of bodies are examined only if they move fast enough,
    and crowds are left as they are.
    """
    velocity, island = work.velocity, work.island
    k, found = model.dimension, False
    for i in range(model.bodies):
        island.curves_shut[i] = 0
        work.body.speed[i] = speed_of(model, velocity.new, i)
        for c in range(k):
            work.ahead.q[i, c] = work.mid.q[i, c] + h * velocity.new[i, c]
    for i in range(model.bodies):
        if island.stage[i] != SETTLED and not in_crowd(model, island, i):
            island.curves_shut[i] = correct_island(model, work, i, h)
            # Impulses that were not found do not tell what sticks.
            found_all = island.residual[i] <= model.tolerance
            if found_all and stop_slips(model, work, island.start[i], island.start[i + 1], h):
                island.curves_shut[i] = 1
            found = found or island.curves_shut[i] != 0
    return found


@compiled
def in_crowd(model, island, i):
    """Return whether the island that a body represents is a crowd."""
    return is_crowd(model, island.start[i], island.start[i + 1])


@compiled
def correct_island(model, work, root, h):
    """Raise the velocity bounds of an island; return whether any; see above."""
    body, ahead, island = work.body, work.ahead, work.island
    block, scratch = work.block, work.scratch
    found, first, second, tied = ZERO, NONE, NONE, NONE
    # Curvature closes a gap by the square of the travel; below this speed by too little to matter.
    fast = np.sqrt(0.5 * model.bending) * model.gap_unit / h
    for s in range(island.start[root], island.start[root + 1]):
        b = block.order[s]
        # With forces that follow the velocity, a bent bound is followed by
        # :func:`follow_curvature`: two corrections would chase each other.
        if block.rows[b] > 0 or (model.follows_velocity and block.bound[b] == BENT):
            continue
        if block.origin[b, 0] == OWN_LIMIT:
            continue
        i, g = block.bodies[b, 0], block.origin[b, 2]
        if block.origin[b, 0] == OWN_GAP:
            # After a pair `first` is one of its bodies, whose own gaps are not evaluated here yet.
            if i != first or second != NONE:
                evaluate_gaps(model, scratch, i, ahead.q, h, ahead.gap, ahead.gradient)
            first, second, tied = i, NONE, NONE
            gap, following = work.mid.gap[g], ahead.gap[g]
        elif block.origin[b, 0] == TIE_GAP:
            if block.origin[b, 1] != tied:
                look_at_tie(model, work, block.origin[b, 1], h)
            first, second, tied = NONE, NONE, block.origin[b, 1]
            gap, following = work.tie.gap[g], following_of(model, scratch, tied, g)
        else:
            j = block.bodies[b, 1]
            if body.speed[i] + body.speed[j] <= fast:
                continue
            if i != first or j != second:
                evaluate_pair_gaps(model, scratch, i, j, ahead.q)
            first, second, tied = i, j, NONE
            gap = work.pair.gap[block.origin[b, 1]]
            following = scratch.values[pair_inputs(model, family_of(model, i, j)) + g]
        if block.bilateral[b]:
            if not model.follows_velocity and bend_equation(
                model, body, block, b, gap, following, h, model.tolerance
            ):
                found = ONE
            continue
        # A gap that is closed too far already need not open by more than the step was asked for.
        target = min(0.0, gap - h * block.offset[b, 0] - block.load[b])
        if following < target - model.bending * model.gap_unit:
            block.load[b] = gap + h * (block.after[b, 0] - block.offset[b, 0]) - following
            block.offset[b, 0] = (gap - block.load[b] - target) / h
            block.bound[b] = BENT
            found = ONE
    return found


@compiled
def look_at_tie(model, work, t, h):
    """Evaluate a tie at the next midpoint."""
    evaluate_tie(model, work.scratch, t, work.ahead.q, work.tie.time[0] + h)


@compiled
def following_of(model, scratch, t, row):
    """Return the value of a row of the tie that was evaluated last."""
    return scratch.values[row_inputs(model) + row - model.tie_rows[t]]


@compiled
def bend_equation(model, body, block, b, gap, following, h, share):
    """Correct an equation that does not hold at the next midpoint; return whether it does not.

    It does up to a share of what bodies travel.
    """
    never_inline()
    # In an instant nothing curves.
    if h <= STRAIGHT * model.step:
        return False
    speed = speed_at(body, block, b)
    missed = abs(following - gap + h * gap / model.step)
    if missed <= MISSED * model.gap_unit + share * h * speed:
        return False
    block.load[b] = gap + h * (block.after[b, 0] - block.offset[b, 0]) - following
    block.offset[b, 0] = equation_offset(model, gap, -block.load[b], h)
    return True


@compiled
def bend_bound(model, body, block, b, gap, following, h, share):
    """Correct the bound of a contact whose gap curves otherwise; return whether it does."""
    never_inline()
    speed = speed_at(body, block, b)
    closing = gap + h * (block.after[b, 0] - block.offset[b, 0]) - following
    more = closing - block.load[b]
    if abs(more) <= MISSED * model.gap_unit + share * h * speed:
        return False
    block.load[b] = closing
    block.offset[b, 0] -= more / h
    return True


@compiled
def follow_curvature(model, state, work, blocks, h):
    """Correct equations and bounds that curve otherwise than they were solved for.

    The bounds are those that :func:`correct_curvature` raises, now or before.  Their islands have
    changed.
    """
    mid, body, ahead = work.mid, work.body, work.ahead
    island, block, scratch = work.island, work.block, work.scratch
    k = model.dimension
    if correct_curvature(model, state, work, blocks, h):
        for i in range(model.bodies):
            if island.curves_shut[i]:
                island.stage[i] = CHANGED
    for i in range(model.bodies):
        for c in range(k):
            ahead.q[i, c] = mid.q[i, c] + h * work.velocity.new[i, c]
    first, second = NONE, NONE
    for b in range(blocks):
        if block.rows[b] > 0 or not (block.bilateral[b] or block.bound[b] == BENT):
            continue
        if block.origin[b, 0] == OWN_LIMIT:
            continue
        root = island_of(body, island, block, b)
        if island.stage[root] == SETTLED:
            continue
        i, j, g = block.bodies[b, 0], block.bodies[b, 1], block.origin[b, 2]
        share, away = settled(model, body, i), i != first or j != second
        if block.origin[b, 0] == TIE_GAP:
            t, j = block.origin[b, 1], tie_code(block.origin[b, 1])
            if i != first or j != second:
                look_at_tie(model, work, t, h)
            gap, following = work.tie.gap[g], following_of(model, scratch, t, g)
        elif j < 0:
            if away:
                evaluate_gaps(model, scratch, i, ahead.q, h, ahead.gap, ahead.gradient)
            gap, following = mid.gap[g], ahead.gap[g]
        else:
            if away:
                evaluate_pair_gaps(model, scratch, i, j, ahead.q)
            gap = work.pair.gap[block.origin[b, 1]]
            following = scratch.values[pair_inputs(model, family_of(model, i, j)) + g]
        first, second = i, j
        if block.bilateral[b]:
            changed = bend_equation(model, body, block, b, gap, following, h, share)
        else:
            changed = bend_bound(model, body, block, b, gap, following, h, share)
        if changed:
            island.stage[root] = CHANGED
