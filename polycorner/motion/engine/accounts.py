"""Work that is done in a step, by cause."""

from polycorner.motion.engine.arrays import (
    APPLIED_WORK,
    DISSIPATED,
    NOISE_WORK,
    PAIR_FRICTION,
    PENETRATION,
    SUBSTRATE_WORK,
)
from polycorner.motion.engine.contact_list import takes_part
from polycorner.motion.engine.jit import compiled


@compiled
def book_block(model, work, b, sums):
    """Book the work of a block."""
    if not takes_part(work, b):
        return
    if work.block_rows[b] == 0:
        if not work.bilateral[b]:
            after = work.after[b, 0] - work.offset[b, 0]
            sums[DISSIPATED] -= work.impulse[b, 0] * 0.5 * (work.before[b, 0] + after)
        return
    rubs, f = work.origin[b, 0] == PAIR_FRICTION, work.origin[b, 2]
    cause = model.pair_causes[f] if rubs else model.friction_causes[f]
    for r in range(work.block_rows[b]):
        slip = 0.5 * (work.before[b, r] + work.offset[b, r] + work.after[b, r])
        sums[DISSIPATED + cause] -= work.impulse[b, r] * slip
        sums[SUBSTRATE_WORK] -= work.impulse[b, r] * work.offset[b, r]


@compiled
def book_body(model, state, work, i, sums):
    """Book the work of applied and random forces on a body; on a sleeper, that of the substrate."""
    if not (state.alive[i] and (work.awake[i] or work.evaluated[i])):
        return
    for c in range(model.dimension):
        mean = 0.5 * (state.v[i, c] + work.v_new[i, c])
        sums[APPLIED_WORK] += mean * work.applied[i, c]
        sums[NOISE_WORK] += mean * work.kick[i, c]
    if not work.awake[i] and work.evaluated[i]:
        for f in range(model.frictions):
            for r in range(model.slip_start[f + 1] - model.slip_start[f]):
                drift = work.slip_offset[i, model.slip_start[f] + r]
                sums[SUBSTRATE_WORK] -= work.proof_friction[i, f, r] * drift


@compiled
def add_sums(state, work, items):
    """Add what several items booked, in their order."""
    for item in range(items):
        for a in range(state.sums.size):
            if a == PENETRATION:
                state.sums[a] = max(state.sums[a], work.booked[item, a])
            else:
                state.sums[a] += work.booked[item, a]
