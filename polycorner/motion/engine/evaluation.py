"""Evaluation of bodies and gaps, by kernels called by address."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.motion.engine.arrays import CHANGED, SETTLED
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.linear_algebra import add_square, invert, solve_spd
from polycorner.motion.engine.random import gaussian, held_integral

# How a body is touched: by its surroundings only, or by other bodies as well.
ALONE, TOGETHER = range(1, 3)

# Change of a velocity, relative to the speed, below which forces that depend on it are settled: for
# bodies that nothing touches; and over the tolerance, for those that touch no other, and that do.
CHANGE_FREE, CHANGE_ALONE, CHANGE_TOGETHER = 1e-14, 1e-2, 1.0
ON_EQUATIONS = 1e-10  # scaled distance up to which a body is on its equations
MOST_APPROACHES = 8  # Newton steps onto them
BENDING = 1e-8  # weight of the change of place, relative to the equations
KICK = 32  # index of the first random impulse; those below are of chattering loads


@compiled
def evaluate_forces(model, work, i, v, h, mass):
    """Evaluate forces of a body at the midpoint, and its mass if asked for.

    Return where its loads are in scratch.
    """
    k, scratch = model.dimension, work.scratch
    for c in range(k):
        scratch[c] = work.q_mid[i, c]
        scratch[k + c] = v[i, c]
    start, base = scratch.ctypes.data, model.parameters.ctypes.data
    f0 = 2 * k
    call_kernel(model.force_kernel, start, base, start + 8 * f0, start, start)
    upper = k * (k + 1) // 2
    if mass and not (model.constant_mass and work.mass[i, 0, 0] > 0.0):
        invert(scratch, f0, k, work.mass[i], work.inverse_mass[i])
    at = f0 + upper
    for c in range(k):
        work.force[i, c] = h * scratch[at + c]
        work.applied[i, c] = h * scratch[at + k + c]
    return at + 2 * k


@compiled
def random_impulse(model, i, c, h, time, index):
    """Return the random impulse on a coordinate in a step or part with the midpoint ``time``.

    It is white, ``sigma sqrt(step)`` times a number for each whole step, or the integral of a force
    that is held, ``sigma / sqrt(kick_time)`` times a number for each interval of that length.
    """
    if model.kick_time > 0.0:
        begin, end = time - 0.5 * h, time + 0.5 * h
        drawn = held_integral(model.seed, model.kick_time, begin, end, i, KICK + c)
        return model.kicks[c] / np.sqrt(model.kick_time) * drawn
    draw = gaussian(model.seed, index, i, KICK + c) * (h / model.step)
    return model.kicks[c] * np.sqrt(model.step) * draw


@compiled
def evaluate_body(model, state, work, i, h, time, index):
    """Evaluate forces, loads, slips and gaps of a body at the midpoint of the step."""
    k, F, scratch = model.dimension, model.frictions, work.scratch
    for c in range(k):
        work.q_mid[i, c] = state.q[i, c] + 0.5 * h * state.v[i, c]
        work.kick[i, c] = 0.0
        if model.kicks[c] > 0.0:
            work.kick[i, c] = random_impulse(model, i, c, h, time, index)
    if model.unilateral < model.restitution.size:
        approach_equations(model, work, i)
    at = evaluate_forces(model, work, i, state.v, h, True)
    if model.chatter > 0.0:
        when = np.int64(np.floor(time / model.correlation_time))
        for j in range(model.loads):
            factor = 1.0 + model.chatter * gaussian(model.seed, when, i, j)
            scratch[at + j] *= max(0.0, factor)
    for f in range(F):
        load = 0.0
        for j in range(model.loads):
            if model.load_sources[f, j]:
                load += scratch[at + j]
        work.load[i, f] = max(0.0, h * load)
    evaluate_slips(model, state, work, i)
    evaluate_gaps(model, work, i, work.q_mid, work.gap, work.gradient)


@compiled
def evaluate_slips(model, state, work, i):
    """Evaluate the slips of a body at the midpoint: derivatives by velocities, and what is left."""
    k, scratch = model.dimension, work.scratch
    start, base = scratch.ctypes.data, model.parameters.ctypes.data
    for call in range(model.slip_kernels):
        address, n, m = (
            model.slip_calls[call, 0],
            model.slip_calls[call, 1],
            model.slip_calls[call, 2],
        )
        r0, w0, p0 = model.slip_calls[call, 3], model.slip_calls[call, 4], model.slip_calls[call, 5]
        for a in range(n):
            c = model.slip_reads[r0 + a]
            scratch[a] = work.q_mid[i, c] if c < k else state.v[i, c - k]
        j0 = n + m
        call_kernel(address, start, base + 8 * p0, start + 8 * n, start + 8 * j0, start)
        for o in range(m):
            r = model.slip_places[w0 + o]
            if r < 0:
                continue
            value = scratch[n + o]
            size = abs(value)
            for c in range(k):
                work.slip_rows[i, r, c] = 0.0
            for a in range(n):
                c = model.slip_reads[r0 + a] - k
                if c >= 0:
                    slope = scratch[j0 + o * n + a]
                    work.slip_rows[i, r, c] = slope
                    value -= slope * state.v[i, c]
                    size += abs(slope * state.v[i, c])
            work.slip_offset[i, r] = value if abs(value) > 1e-14 * size else 0.0


@compiled
def approach_equations(model, work, i):
    """Move the midpoint of a body onto its equations, if it is not there.

    After equal steps it is: this is needed at the start, and after shorter steps.  The steps are
    Gauss and Newton's, of least length in scaled coordinates; equations may be redundant.
    """
    never_inline()
    k, A, x = model.dimension, work.body_matrix, work.body_vector
    for _ in range(MOST_APPROACHES):
        evaluate_gaps(model, work, i, work.q_mid, work.gap, work.gradient)
        worst = 0.0
        for c in range(k):
            x[c] = 0.0
            for a in range(k):
                A[c, a] = BENDING * model.units[c] ** 2 if a == c else 0.0
        for g in range(model.unilateral, model.restitution.size):
            row, size = work.gradient[i, g], 0.0
            for c in range(k):
                size += (row[c] / model.units[c]) ** 2
            if size > 0.0:
                worst = max(worst, abs(work.gap[i, g]) / np.sqrt(size))
                add_square(A, row, 1.0 / size, k)
                for c in range(k):
                    x[c] -= work.gap[i, g] / size * row[c]
        if not worst > ON_EQUATIONS or not solve_spd(A, x, k):
            return
        for c in range(k):
            work.q_mid[i, c] += x[c]


@compiled
def settled(model, work, i):
    """Return the change of a velocity, relative to the speed, that is none."""
    if not work.touched[i]:
        return CHANGE_FREE
    share = CHANGE_TOGETHER if work.touched[i] == TOGETHER else CHANGE_ALONE
    return max(CHANGE_FREE, share * model.tolerance)


@compiled
def update_forces(model, state, work, h):
    """Evaluate forces at the mean velocities of the step; where one changed, so has its island.

    Those of a body that change nothing remain as they are, so that its motion does not depend on
    how often other bodies are evaluated.
    """
    k = model.dimension
    for i in range(model.bodies):
        island = work.parent[i]
        if not (state.alive[i] and work.awake[i]) or work.stage[island] == SETTLED:
            continue
        for c in range(k):
            work.v_mean[i, c] = 0.5 * (state.v[i, c] + work.v_new[i, c])
            work.former_force[i, c] = work.force[i, c]
        evaluate_forces(model, work, i, work.v_mean, h, False)
        change, speed = 0.0, 0.0
        for c in range(k):
            value = 0.0
            for a in range(k):
                difference = work.force[i, a] - work.former_force[i, a]
                value += work.inverse_mass[i, c, a] * difference
            change = max(change, abs(value) * model.units[c])
            speed += (abs(work.v_new[i, c]) + abs(state.v[i, c])) * model.units[c]
        if change > settled(model, work, i) * speed:
            work.stage[island] = CHANGED
            continue
        for c in range(k):
            work.force[i, c] = work.former_force[i, c]


@compiled
def evaluate_gaps(model, work, i, q, gap, gradient):
    """Evaluate the gaps between a body and its surroundings, and their gradients."""
    scratch = work.scratch
    start, base = scratch.ctypes.data, model.parameters.ctypes.data
    for call in range(model.gap_kernels):
        address, n, m = model.gap_calls[call, 0], model.gap_calls[call, 1], model.gap_calls[call, 2]
        r0, w0, p0 = model.gap_calls[call, 3], model.gap_calls[call, 4], model.gap_calls[call, 5]
        for a in range(n):
            scratch[a] = q[i, model.gap_reads[r0 + a]]
        j0 = n + m
        call_kernel(address, start, base + 8 * p0, start + 8 * n, start + 8 * j0, start)
        for o in range(m):
            g = model.gap_places[w0 + o]
            if g >= 0:
                gap[i, g] = scratch[n + o]
                for c in range(model.dimension):
                    gradient[i, g, c] = 0.0
                for a in range(n):
                    gradient[i, g, model.gap_reads[r0 + a]] += scratch[j0 + o * n + a]


@compiled
def evaluate_pair(model, work, a, b, q):
    """Evaluate the gaps of a pair of bodies and their gradients.

    The scratch array gets the coordinates that the gaps read, the gaps, and their gradients.
    """
    call_pair_kernel(model, work, model.pair_kernel, a, b, q)


@compiled
def evaluate_pair_gaps(model, work, a, b, q):
    """Evaluate the gaps of a pair of bodies alone, where :func:`evaluate_pair` leaves them."""
    call_pair_kernel(model, work, model.pair_values, a, b, q)


@compiled
def call_pair_kernel(model, work, kernel, a, b, q):
    """Call a kernel for two bodies."""
    scratch, n, m = work.scratch, model.pair_inputs, model.pair_gaps
    start, base = scratch.ctypes.data, model.parameters.ctypes.data
    for r in range(n):
        body = a if model.pair_reads[r, 0] == 0 else b
        scratch[r] = q[body, model.pair_reads[r, 1]]
    j0, p0 = n + m, model.pair_parameters
    call_kernel(kernel, start, base + 8 * p0, start + 8 * n, start + 8 * j0, start)


@compiled
def start_body(model, state, work, i):
    """Set the free velocity, due to forces alone, of a body that is awake, and measure its speed.

    Bodies of settled islands remain as they were solved.  Where a velocity or a gap is not a
    number, ``work.finite`` becomes zero.
    """
    if not state.alive[i] or work.stage[work.parent[i]] == SETTLED:
        return
    k, finite, speed = model.dimension, True, 0.0
    for c in range(k):
        value = state.v[i, c]
        if work.awake[i]:
            for a in range(k):
                value += work.inverse_mass[i, c, a] * (work.force[i, a] + work.kick[i, a])
        work.v_old[i, c] = state.v[i, c]
        work.v_free[i, c] = value
        work.v_new[i, c] = value
        finite = finite and np.isfinite(value)
    for c in range(k):
        carried = model.substrate_speed / model.units[c] if c == model.position[0] else 0.0
        before = abs(state.v[i, c] - carried) * model.units[c]
        speed += max(before, abs(work.v_free[i, c] - carried) * model.units[c])
    work.speed[i], work.island_speed[i] = speed, speed
    work.touched[i] = 0
    for c in range(k if model.crowd_sweeps > 0 else 0):
        work.shift[i, c] = 0.0
    for g in range(model.restitution.size):
        finite = finite and not np.isnan(work.gap[i, g])
    if not finite:
        work.finite[0] = 0
