"""Bounds and equations that follow the curvature of gaps within a step."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import BENT, CHANGED, OWN_GAP, SETTLED
from polycorner.motion.engine.blocks import STRAIGHT
from polycorner.motion.engine.bounds import equation_offset
from polycorner.motion.engine.crowds import is_crowd
from polycorner.motion.engine.evaluation import evaluate_gaps, evaluate_pair_gaps, settled
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import speed_of
from polycorner.motion.engine.partition import island_of
from polycorner.motion.engine.paths import CURVATURE_DEPTH
from polycorner.motion.engine.rows import speed_at

MISSED = 1e-12  # scaled gap up to which an equation holds


@compiled
def correct_curvature(model, state, work, blocks, h):
    """Raise the velocity bounds of gaps that close by their curvature; return whether any does.

    The linearised gap misses what curvature adds within the step.  The bound becomes that of
    Newton's method for the gap itself.  Pairs of bodies are examined only if they move fast enough,
    and crowds are left as they are.
    """
    k, found = model.dimension, False
    for i in range(model.bodies):
        work.curves_shut[i] = 0
        work.speed[i] = speed_of(model, work.v_new, i)
        for c in range(k):
            work.q_next[i, c] = work.q_mid[i, c] + h * work.v_new[i, c]
    for i in range(model.bodies):
        if work.stage[i] != SETTLED and not in_crowd(model, work, i):
            work.curves_shut[i] = correct_island(model, work, i, h)
            found = found or work.curves_shut[i] != 0
    return found


@compiled
def in_crowd(model, work, i):
    """Return whether the island that a body represents is a crowd."""
    return is_crowd(model, work.island_start[i], work.island_start[i + 1])


@compiled
def correct_island(model, work, island, h):
    """Raise the velocity bounds of an island; return whether any; see above."""
    found, first, second = ZERO, NONE, NONE
    fast = np.sqrt(0.5 * CURVATURE_DEPTH) * model.gap_unit / h
    for s in range(work.island_start[island], work.island_start[island + 1]):
        b = work.order[s]
        if work.block_rows[b] > 0 or (model.follows_velocity and work.bound[b] == BENT):
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
            if not model.follows_velocity and bend_equation(
                model, work, b, gap, following, h, model.tolerance
            ):
                found = ONE
            continue
        target = min(0.0, gap - h * work.offset[b, 0] - work.block_load[b])
        if following < target - CURVATURE_DEPTH * model.gap_unit:
            work.block_load[b] = gap + h * (work.after[b, 0] - work.offset[b, 0]) - following
            work.offset[b, 0] = (gap - work.block_load[b] - target) / h
            work.bound[b] = BENT
            found = ONE
    return found


@compiled
def bend_equation(model, work, b, gap, following, h, share):
    """Correct an equation that does not hold at the next midpoint; return whether it does not.

    It does up to a share of what bodies travel.
    """
    never_inline()
    if h <= STRAIGHT * model.step:
        return False
    speed = speed_at(work, b)
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
    speed = speed_at(work, b)
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

    The bounds are those that :func:`correct_curvature` raises, now or before.  Their islands have
    changed.
    """
    k = model.dimension
    if correct_curvature(model, state, work, blocks, h):
        for i in range(model.bodies):
            if work.curves_shut[i]:
                work.stage[i] = CHANGED
    for i in range(model.bodies):
        for c in range(k):
            work.q_next[i, c] = work.q_mid[i, c] + h * work.v_new[i, c]
    first, second = NONE, NONE
    for b in range(blocks):
        if work.block_rows[b] > 0 or not (work.bilateral[b] or work.bound[b] == BENT):
            continue
        island = island_of(work, b)
        if work.stage[island] == SETTLED:
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
            changed = bend_equation(model, work, b, gap, following, h, share)
        else:
            changed = bend_bound(model, work, b, gap, following, h, share)
        if changed:
            work.stage[island] = CHANGED
