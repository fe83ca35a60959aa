"""Work that is done in a step, by cause."""

from polycorner.motion.engine.arrays import (
    APPLIED_WORK,
    DISSIPATED,
    DRIVE_WORK,
    NOISE_WORK,
    OWN_LIMIT,
    PAIR_FRICTION,
    PENETRATION,
    SUBSTRATE_WORK,
    TIE_FRICTION,
    TIE_GAP,
)
from polycorner.motion.engine.contact_list import takes_part
from polycorner.motion.engine.jit import compiled


@compiled
def book_block(model, body, tie, block, b, sums):
    """Book the work of a block."""
    if not takes_part(body, block, b):
        return
    if block.origin[b, 0] == OWN_LIMIT:
        after = block.after[b, 0] - block.offset[b, 0]
        account = model.limit_accounts[block.origin[b, 2]]
        sums[account] += block.impulse[b, 0] * 0.5 * (block.before[b, 0] + after)
        return
    if block.rows[b] == 0:
        # What an equation with the time does, at the mean velocity; others do no work.
        if model.timed and block.bilateral[b] and block.jacobian[b, 0, model.dimension] != 0.0:
            after = block.after[b, 0] - block.offset[b, 0]
            mean = 0.5 * (block.before[b, 0] + after) - block.jacobian[b, 0, model.dimension]
            sums[DRIVE_WORK] += block.impulse[b, 0] * mean
        if not block.bilateral[b]:
            after = block.after[b, 0] - block.offset[b, 0]
            sums[DISSIPATED] -= block.impulse[b, 0] * 0.5 * (block.before[b, 0] + after)
        elif block.origin[b, 0] == TIE_GAP:
            sums[DRIVE_WORK] -= block.impulse[b, 0] * tie.rate[block.origin[b, 2]]
        return
    kind, f = block.origin[b, 0], block.origin[b, 2]
    if kind == PAIR_FRICTION:
        cause = model.pair_causes[f]
    elif kind == TIE_FRICTION:
        cause = model.tie_causes[f]
    else:
        cause = model.friction_causes[f]
    for r in range(block.rows[b]):
        slip = 0.5 * (block.before[b, r] + block.offset[b, r] + block.after[b, r])
        sums[DISSIPATED + cause] -= block.impulse[b, r] * slip
        sums[SUBSTRATE_WORK] -= block.impulse[b, r] * block.offset[b, r]


@compiled
def book_body(model, state, mid, velocity, body, sleep, i, sums):
    """Book the work of applied and random forces on a body; on a sleeper, that of the substrate."""
    if not (state.alive[i] and (body.awake[i] or body.evaluated[i])):
        return
    for c in range(model.dimension):
        # With the mean velocity the work of constant forces is the change of energy, exactly.
        mean = 0.5 * (state.v[i, c] + velocity.new[i, c])
        sums[APPLIED_WORK] += mean * mid.applied[i, c]
        sums[NOISE_WORK] += mean * mid.kick[i, c]
    if not body.awake[i] and body.evaluated[i]:
        for f in range(model.first_friction[i], model.first_friction[i + 1]):
            for r in range(model.slip_start[f + 1] - model.slip_start[f]):
                drift = mid.slip_offset[model.slip_start[f] + r]
                sums[SUBSTRATE_WORK] -= sleep.proof_friction[f, r] * drift


@compiled
def add_sums(state, shared, items):
    """Add what several items booked, in their order."""
    for item in range(items):
        for a in range(state.sums.size):
            # The only one that is no sum.
            if a == PENETRATION:
                state.sums[a] = max(state.sums[a], shared.booked[item, a])
            else:
                state.sums[a] += shared.booked[item, a]
