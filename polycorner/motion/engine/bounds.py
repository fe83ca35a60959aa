"""Velocity bounds: how fast a gap may close in a step, and which contacts act in one."""

from polycorner.motion.engine.arrays import OWN_GAP
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import ZERO_GAP

ELASTIC = 1e-6  # scaled travel in a step up to which an impact that bounces is slow


@compiled
def curvature_change(gap, before, following, h, scale):
    """Return the change of a gap by curvature alone where bodies slide or roll past each other."""
    change = following - gap - h * before
    if abs(change) <= ZERO_GAP * scale or abs(h * before) > 4.0 * abs(change):
        return 0.0
    return change


@compiled
def is_slow(model, work, before, bounce):
    """Return whether a gap closes at a velocity at which impacts need not be located."""
    return -before * model.step <= (work.near[0] if bounce == 0.0 else ELASTIC) * model.gap_unit


@compiled
def acts(model, work, gap, before, bounce, closed):
    """Return whether a contact acts in a located step: it is closed, or about to close slowly."""
    if closed or gap <= ZERO_GAP * model.gap_unit:
        return True
    near = work.near[0] if bounce == 0.0 else ELASTIC
    return gap <= near * model.gap_unit and is_slow(model, work, before, bounce)


@compiled
def least_velocity(model, work, gap, closed, before, free, change, bounce, h):
    """Return the least normal velocity that a contact allows after the step; whether it bounces.

    Forces act for half of the step before a bounce, and for half of it afterwards.
    """
    if work.located[0] and (closed or gap <= ZERO_GAP * model.gap_unit):
        gap = min(gap, 0.0)
    forced = free - before
    if gap + h * free < 0.0 and before < 0.0 and -bounce * before > abs(forced) * (model.step / h):
        return 0.5 * (forced - bounce * (free + before)), ONE
    reached = gap + change
    if -ZERO_GAP * model.gap_unit < reached < 0.0:
        return 0.0, ZERO
    if reached < 0.0:  # separated no faster than by forces and curvature within a step
        return min(-reached / h, abs(forced) + abs(change) / h), ZERO
    return -reached / (model.step if work.located[0] else h), ZERO


@compiled
def equation_offset(model, gap, change, h):
    """Return ``d`` of the velocity ``J v + d = 0`` that keeps an equation where it is.

    The midpoint is on it already: the equation holds at the next one if all steps are equal.
    """
    return change / h + gap / model.step


@compiled
def least_velocity_of(model, state, work, b, free, h):
    """Return the least normal velocity that the contact of a block allows."""
    i, g = work.origin[b, 1], work.origin[b, 2]
    if work.origin[b, 0] == OWN_GAP:
        gap, closed, bounce = work.gap[i, g], state.touches[i, g] != 0, model.restitution[g]
    else:
        index, bounce = work.contact_before[i], model.pair_restitution
        gap, closed = work.contact_gap[i], index >= 0 and state.pair_flags[index, 1] != 0
    change, before = -work.block_load[b], work.before[b, 0]
    least, _ = least_velocity(model, work, gap, closed, before, free, change, bounce, h)
    return least
