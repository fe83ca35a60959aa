"""Velocity bounds: how fast a gap may close in a step, and which contacts act in one."""

from polycorner.motion.engine.arrays import OWN_GAP, TIE_GAP
from polycorner.motion.engine.families import family_of
from polycorner.motion.engine.jit import ONE, ZERO, compiled

INSTANT = 1e-9  # of a step: the shortest part, for an impact
BRIEF = 4.0 * INSTANT  # of a step: parts whose impulses say nothing about the forces that follow
STRAIGHT = 1e-6  # of a step: parts in which nothing curves or turns


@compiled
def curvature_change(model, gap, before, following, h):
    """Return the change of a gap by curvature alone where bodies slide or roll past each other."""
    change = following - gap - h * before
    # Where the gap moves mostly by its velocity, its linearisation does: a correction would only
    # add the noise of the prediction.
    if abs(change) <= model.zero_gap or abs(h * before) > 4.0 * abs(change):
        return 0.0
    return change


@compiled
def slow_gap(model, manner, bounce):
    """Return the travel in a step up to which impacts need not be located."""
    return (manner.near[0] if bounce == 0.0 else model.slow_bounce) * model.gap_unit


@compiled
def is_slow(model, manner, before, bounce):
    """Return whether a gap closes at a velocity at which impacts need not be located."""
    return -before * model.step <= slow_gap(model, manner, bounce)


@compiled
def acts(model, manner, gap, before, bounce, closed):
    """Return whether a contact acts in a located step: it is closed, or about to close slowly."""
    if closed or gap <= model.zero_gap:
        return True
    return gap <= slow_gap(model, manner, bounce) and is_slow(model, manner, before, bounce)


@compiled
def will_bounce(model, before, forced, bounce, h):
    """Return whether a contact that closes bounces, faster than forces close it in a whole step.

    Without this bound a ball would bounce for ever in smaller and smaller arcs.
    """
    return before < 0.0 and -bounce * before > abs(forced) * (model.step / h)


@compiled
def least_velocity(model, manner, gap, closed, before, free, change, bounce, h):
    """Return the least normal velocity that a contact allows after the step; whether it bounces.

    Forces act for half of the step before a bounce, and for half of it afterwards.
    """
    if manner.located[0] and (closed or gap <= model.zero_gap):
        # In a located step a contact that acts is closed: what is left of its gap is not to be
        # closed again.
        gap = min(gap, 0.0)
    forced = free - before
    if gap + h * free < 0.0 and will_bounce(model, before, forced, bounce, h):
        return 0.5 * (forced - bounce * (free + before)), ONE
    reached = gap + change
    # Depth that is rounding is not corrected: contacts at rest would be pushed apart and fall back.
    if -model.zero_gap < reached < 0.0:
        return 0.0, ZERO
    if reached < 0.0:  # separated no faster than by forces and curvature within a step
        return min(-reached / h, abs(forced) + abs(change) / h), ZERO
    return -reached / (model.step if manner.located[0] else h), ZERO


@compiled
def equation_offset(model, gap, change, h):
    """Return ``d`` of the velocity ``J v + d = 0`` that keeps an equation where it is.

    The midpoint is on it already: the equation holds at the next one if all steps are equal.
    """
    return change / h + gap / model.step


@compiled
def contact_of(model, state, mid, pair, tie, block, b):
    """Return gap, whether it was closed, and restitution of the contact of a block."""
    i, g = block.origin[b, 1], block.origin[b, 2]
    if block.origin[b, 0] == OWN_GAP:
        return mid.gap[g], state.touches[g] != 0, model.restitution[g]
    if block.origin[b, 0] == TIE_GAP:
        return tie.gap[g], state.tie_touches[g] != 0, model.tie_restitution[g]
    index = pair.before[i]
    bounce = model.pair_restitution[family_of(model, block.bodies[b, 0], block.bodies[b, 1])]
    return pair.gap[i], index >= 0 and state.pair_flags[index, 1] != 0, bounce


@compiled
def least_velocity_of(model, state, manner, mid, pair, tie, block, b, free, h):
    """Return the least normal velocity that the contact of a block allows."""
    gap, closed, bounce = contact_of(model, state, mid, pair, tie, block, b)
    change, before = -block.load[b], block.before[b, 0]
    least, _ = least_velocity(model, manner, gap, closed, before, free, change, bounce, h)
    return least
