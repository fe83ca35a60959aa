"""Blocks of limits on velocities, and where limits jump.

A limit ``f(q, v, t) >= 0`` is a block of one row: its impulse ``p >= 0`` acts along the gradient
``df/dv`` at the midpoint and the mean velocity of the step, and is complementary to the value of
``f`` at the end, at ``q_M + h v+ / 2`` and ``v+``.  In an instant the gradient is that at ``v+``,
so that an impact projects the velocity onto the limit in the metric of the masses.  An equation
holds at the midpoint and the mean velocity, by which its impulse does no work ([MP]); in an
instant, at ``v+``.  Rows are divided by the length of the gradient by scaled velocities, so that
limits of any unit count alike.

A limit has a block where it acted before, or would be passed without.
"""

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.arrays import CHANGED, OWN_LIMIT, SETTLED
from polycorner.motion.engine.blocks import (
    finish_block,
    new_block,
    respond_to_rows,
    touch_tied,
)
from polycorner.motion.engine.bounds import BRIEF, INSTANT, STRAIGHT
from polycorner.motion.engine.families import coordinates_of, kind_of
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.limits import (
    ROUNDING,
    call_limits,
    evaluate_limits,
    is_passed,
    limit_bend,
    limit_size,
    limit_slope,
    limit_value,
)
from polycorner.motion.engine.linear_algebra import solve_spd
from polycorner.motion.engine.rows import row_at, row_times, speed_at

MOST_HALVES = 80  # of the way to a jump of a limit
MOST_LANDINGS = 30  # Newton steps of a projection onto a limit


@compiled
def begin_limits(model, work, time):
    """Let no limit be wanted that did not act before; ``time`` is that of the midpoint."""
    work.limit.time[0] = model.start + time
    for g in range(model.limits):
        work.limit.wanted[g] = 0


@compiled
def assemble_limits(model, state, work, h, count):
    """Append the blocks of the limits of awake bodies; return the block count."""
    limit, block = work.limit, work.block
    for i in range(model.bodies):
        taken = state.alive[i] and work.body.awake[i]
        for g in range(model.first_limit[i], model.first_limit[i + 1]):
            limit.block_of[g], limit.holds[g] = NONE, 0
            equation = g >= model.first_nonholonomic[i]
            if not (taken and (equation or state.limit_acts[g] or limit.wanted[g])):
                continue
            new_block(block, count, i, NONE, ZERO)
            block.origin[count, 0], block.origin[count, 1] = OWN_LIMIT, i
            block.origin[count, 2] = g
            block.bilateral[count], block.bounces[count] = ONE if equation else ZERO, ZERO
            if not write_limit(model, work, count, h, 0.0):
                continue
            limit.block_of[g] = count
            touch_tied(work.body, block, count)
            share = h / model.step * block.load[count]
            block.impulse[count, 0] = state.limit_force[g] * share
            finish_block(model, work.mid, work.velocity, work.body, block, count)
            count += ONE
    return count


@compiled
def write_limit(model, work, b, h, pushed):
    """Write the row and the offset of a limit's block at the velocities at hand.

    ``pushed`` is the impulse in them.  Return whether the limit has a gradient.
    """
    never_inline()
    mid, limit, velocity, block, scratch = (
        work.mid,
        work.limit,
        work.velocity,
        work.block,
        work.scratch,
    )
    i, g, K = block.bodies[b, 0], block.origin[b, 2], model.lanes
    old, new, now, instant = velocity.old, velocity.new, limit.time[0], h <= STRAIGHT * model.step
    share = 1.0 if instant else 0.5
    if block.bilateral[b]:
        share = 0.0  # its gradient does not depend on velocities
    elif instant and model.limit_bends[kind_of(model, i)] != 0:
        new = limit.landing
        land_on_limit(model, work, b, h, pushed)
    evaluate_limits(model, scratch, i, mid.q, new, 0.0, old, new, share, now)
    size = limit_size(model, scratch, i, g)
    if not size > 0.0:
        return False
    at, terms, rest = row_at(model, b, ZERO), 0.0, limit_value(model, scratch, i, g)
    for c in range(K):
        slope = 0.0
        if c < coordinates_of(model, i):
            slope = limit_slope(model, scratch, i, g, c)
            moving = slope * (old[i, c] + share * (new[i, c] - old[i, c]))
            rest -= moving
            terms += abs(moving)
        block.jacobian[b, 0, c] = slope / size
        limit.row[g, c] = slope / size
    limit.holds[g] = 1 if abs(rest) <= ROUNDING * terms else 0
    block.load[b] = size
    before = row_times(model, block.jacobian, at, old, i, NONE)
    if block.bilateral[b]:
        mean = limit_value(model, scratch, i, g) / size
        block.offset[b, 0] = (mean if instant else 2.0 * mean) - before
        return True
    evaluate_limits(model, scratch, i, mid.q, new, 0.5 * h, new, new, 0.0, now + 0.5 * h)
    after = 0.0
    for c in range(coordinates_of(model, i)):
        after += block.jacobian[b, 0, c] * new[i, c]
    block.offset[b, 0] = limit_value(model, scratch, i, g) / size - after
    return True


@compiled
def land_on_limit(model, work, b, h, pushed):
    """Find where an impact projects a velocity onto a curved limit, in the metric of the masses.

    The velocity is the one at hand without the impulse ``pushed`` of the limit.  Newton's method
    for ``M (v - v_0) = p df/dv`` and ``f(v) = 0`` begins there; for a concave ``f`` its matrix
    ``M - p d2f/dv2`` is definite.
    """
    never_inline()
    mid, block, scratch = work.mid, work.block, work.scratch
    i, g, v, A, x = (
        block.bodies[b, 0],
        block.origin[b, 2],
        work.limit.landing,
        scratch.matrix,
        scratch.vector,
    )
    new, k, p = work.velocity.new, coordinates_of(model, i), 0.0
    first, along = scratch.rest_velocity, 0.0
    for c in range(k):
        v[i, c] = new[i, c]
        if pushed != 0.0:
            v[i, c] -= pushed * block.response[b, 0, c]
        first[c] = v[i, c]
    now = work.limit.time[0] + 0.5 * h
    for _ in range(MOST_LANDINGS):
        evaluate_limits(model, scratch, i, mid.q, new, 0.5 * h, v, v, 0.0, now)
        value = limit_value(model, scratch, i, g)
        if p == 0.0 and value >= 0.0:
            return
        call_limits(model, scratch, i, model.limit_bends[kind_of(model, i)])
        begin_landing(model, work, i, g, p)
        for c in range(k):
            x[c] = limit_slope(model, scratch, i, g, c)
        if not solve_spd(A, x, k):
            return
        steep, along = 0.0, 0.0
        for c in range(k):
            answer = x[c]
            steep += limit_slope(model, scratch, i, g, c) * answer
            work.limit.row[g, c] = answer
        begin_landing(model, work, i, g, p)
        for c in range(k):
            x[c] = p * limit_slope(model, scratch, i, g, c)
            for a in range(k):
                x[c] -= mid.mass[i, c, a] * (v[i, a] - first[a])
        if not (steep > 0.0 and solve_spd(A, x, k)):
            return
        for c in range(k):
            along += limit_slope(model, scratch, i, g, c) * x[c]
        more, size, change = -(value + along) / steep, 0.0, 0.0
        p += more
        for c in range(k):
            unit, step = model.units[kind_of(model, i), c], x[c] + more * work.limit.row[g, c]
            v[i, c] += step
            change, size = change + abs(step) * unit, size + abs(first[c]) * unit
        if change <= ROUNDING * size:
            return


@compiled
def begin_landing(model, work, i, g, p):
    """Write ``M - p d2f/dv2`` of a limit that was evaluated."""
    for c in range(coordinates_of(model, i)):
        for a in range(coordinates_of(model, i)):
            bend = limit_bend(model, work.scratch, i, g, c, a)
            work.scratch.matrix[c, a] = work.mid.mass[i, c, a] - p * bend


@compiled
def follow_limits(model, state, work, blocks, h):
    """Correct the blocks of limits to the velocities that were found; their islands have changed.

    Return whether a limit without a block would be passed: then it is wanted.
    """
    limit, island, found = work.limit, work.island, False
    for i in range(model.bodies):
        first, end = model.first_limit[i], model.first_limit[i + 1]
        if first == end or not (state.alive[i] and work.body.awake[i]):
            continue
        root = island.parent[i]
        if island.stage[root] == SETTLED or island.residual[root] > model.tolerance:
            continue
        for g in range(first, model.first_nonholonomic[i]):
            b = limit.block_of[g]
            if b >= 0:
                if renew_limit(model, work, b, h):
                    island.stage[root] = CHANGED
            elif not limit.wanted[g]:
                evaluate_end(model, work, i, h)
                if is_passed(model, work.scratch, i, g, work.velocity.new):
                    limit.wanted[g], found = 1, True
    return found


@compiled
def evaluate_end(model, work, i, h):
    """Evaluate the limits of a body at the end of a step."""
    new, time = work.velocity.new, work.limit.time[0] + 0.5 * h
    evaluate_limits(model, work.scratch, i, work.mid.q, new, 0.5 * h, new, new, 0.0, time)


@compiled
def renew_limit(model, work, b, h):
    """Write the block of a limit anew if it is not that of the velocities found; return whether."""
    block, i, at = work.block, work.block.bodies[b, 0], row_at(model, b, ZERO)
    former, p = block.after[b, 0], block.impulse[b, 0]
    kind, turned = kind_of(model, i), 0.0
    g, rows = block.origin[b, 2], work.limit.row
    if not write_limit(model, work, b, h, p):
        return False
    # The row that the solution was found with is still that of the response.
    velocity = work.velocity
    after = block.offset[b, 0] + row_times(model, block.jacobian, at, velocity.new, i, NONE)
    for c in range(model.dimension):
        answer = 0.0
        for a in range(model.dimension):
            answer += work.mid.inverse_mass[i, c, a] * rows[g, a]
        turned += abs(answer - block.response[b, 0, c]) * model.units[kind, c]
    missed = abs(after - former) if p > 0.0 or after < 0.0 else 0.0
    if missed + abs(p) * turned <= ROUNDING * speed_at(work.body, block, b):
        return False
    block.before[b, 0] = row_times(model, block.jacobian, at, velocity.old, i, NONE)
    respond_to_rows(model, work.mid, work.body, block, b)
    return True


@compiled
def along_limit(model, state, work, i, g, last, h, time):
    """Return a limit at a time of the step, with the velocity before it, over its gradient.

    The way is that of this velocity to the midpoint, and that of ``last`` from there.
    """
    old, scratch, later = work.velocity.old, work.scratch, time - 0.5 * h
    now = work.limit.time[0] + later
    if later <= 0.0:
        evaluate_limits(model, scratch, i, state.q, old, time, old, old, 0.0, now)
    else:
        evaluate_limits(model, scratch, i, work.mid.q, last, later, old, old, 0.0, now)
    size = limit_size(model, scratch, i, g)
    return limit_value(model, scratch, i, g) / size if size > 0.0 else 0.0


@compiled
def find_jump(model, state, work, i, g, last, h, out):
    """Return whether a limit jumps on a way, by more than what is slow; out: between which times.

    Both are zero where it is passed at the start.
    """
    slow = work.manner.near[0] * model.gap_unit / model.step
    low, high, never = 0.0, h, 0.25 * INSTANT * model.step
    before = along_limit(model, state, work, i, g, last, h, low)
    middle = along_limit(model, state, work, i, g, last, h, 0.5 * h)
    after = along_limit(model, state, work, i, g, last, h, high)
    out[0] = out[1] = 0.0
    if before < -slow:
        return True
    # A smooth limit changes alike in both halves of a step.
    if not abs(before - 2.0 * middle + after) > slow:
        return False
    for _ in range(MOST_HALVES):
        if high - low <= never:
            break
        time = 0.5 * (low + high)
        value = along_limit(model, state, work, i, g, last, h, time)
        if abs(value - before) > abs(after - value):
            high, after = time, value
        else:
            low, before = time, value
    out[0], out[1] = low, high
    return abs(after - before) > slow


@compiled
def limit_jumps(model, state, work, i, g, h, out):
    """Return whether a limit that acts, or would be passed, jumps in a step; see :func:`find_jump`.

    The ways are those of forces alone and of the solution.
    """
    if g >= model.first_nonholonomic[i] or not (state.limit_acts[g] or work.limit.wanted[g]):
        return False
    free, new = work.velocity.free, work.velocity.new
    return find_jump(model, state, work, i, g, free, h, out) or find_jump(
        model, state, work, i, g, new, h, out
    )


@compiled
def mark_jumps(model, state, work, left, h):
    """Mark the islands with bodies of which a limit jumps in the step."""
    for i in range(model.bodies):
        for g in range(model.first_limit[i], model.first_limit[i + 1]):
            out = work.scratch.image
            if work.body.awake[i] and limit_jumps(model, state, work, i, g, h, out):
                left[work.island.parent[i]] |= 1


@compiled
def acceptable_to_limits(model, state, work, h):
    """Return how long a part of a step may be: to just before a limit jumps, or an instant."""
    length, out = h, work.scratch.image
    for i in range(model.bodies):
        for g in range(model.first_limit[i], model.first_limit[i + 1]):
            if work.body.awake[i] and limit_jumps(model, state, work, i, g, h, out):
                length = min(length, length_to_jump(model, h, out))
    return length


@compiled
def length_to_jump(model, h, out):
    """Return the length of the part of a step before a limit jumps.

    One that jumps at once is followed over an instant, in the first half of which it jumps.
    """
    instant, brief = INSTANT * model.step, BRIEF * model.step
    if out[0] > instant and h > brief:
        # Shorter by more than an instant: nothing shorter is left of a step.
        return min(out[0], h - 2.0 * instant)
    short = max(instant, 4.0 * out[1])
    return h if h <= max(2.0 * short, brief) else short
