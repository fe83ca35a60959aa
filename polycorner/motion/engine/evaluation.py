"""Evaluation of bodies and gaps, by kernels called by address."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.motion.engine.arrays import CHANGED, SETTLED
from polycorner.motion.engine.families import coordinates_of, family_of, kind_of, pair_inputs
from polycorner.motion.engine.jit import ZERO, compiled
from polycorner.motion.engine.linear_algebra import add_square, invert, solve_spd
from polycorner.motion.engine.ties import add_tie_forces, tie_is_number, update_tie_forces

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
def mix(x):
    """Return a well-mixed 64-bit number: the finaliser of SplitMix64 ([Steele])."""
    x = np.uint64(x) + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@compiled
def gaussian(seed, when, body, which):
    """Return the standard normal number that belongs to a seed, a time, a body and an index."""
    key = mix(np.uint64(seed) ^ mix(np.uint64(when) ^ mix(np.uint64(body * 64 + which))))
    other = mix(key)
    unit = 1.0 / 9007199254740992.0
    first = (np.float64(key >> np.uint64(11)) + 0.5) * unit
    second = (np.float64(other >> np.uint64(11)) + 0.5) * unit
    return np.sqrt(-2.0 * np.log(first)) * np.cos(2.0 * np.pi * second)


@compiled
def held_integral(seed, held, begin, end, body, which):
    """Return the integral over time of ``xi_n``, which is constant on ``[n held, (n + 1) held)``.

    ``xi_n`` is the standard normal number that belongs to the seed, ``n``, the body and the index.
    Integrals over parts of an interval add up to that over the whole.
    """
    total = 0.0
    for n in range(np.int64(np.floor(begin / held)), np.int64(np.floor(end / held)) + 1):
        length = min(end, (n + 1) * held) - max(begin, n * held)
        if length > 0.0:
            total += length * gaussian(seed, n, body, which)
    return total


@compiled
def evaluate_forces(model, mid, scratch, i, v, h, mass):
    """Evaluate forces of a body at the midpoint, and its mass if asked for.

    Return where its loads are in values.
    """
    kind, values = kind_of(model, i), scratch.values
    k = coordinates_of(model, i)
    for c in range(k):
        values[c] = mid.q[i, c]
        values[k + c] = v[i, c]
    start, base = values.ctypes.data, model.parameters.ctypes.data
    known = base + 8 * model.force_parameters[kind]
    f0 = 2 * k
    call_kernel(model.force_kernel[kind], start, known, start + 8 * f0, start, start)
    upper = k * (k + 1) // 2
    # A constant mass matrix is inverted once: its first entry tells that this was done.
    if mass and not (model.constant_mass[kind] and mid.mass[i, 0, 0] > 0.0):
        invert(values, f0, k, mid.mass[i], mid.inverse_mass[i])
    at = f0 + upper
    for c in range(k):
        mid.force[i, c] = h * values[at + c]
        mid.applied[i, c] = h * values[at + k + c]
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
        return model.kicks[kind_of(model, i), c] / np.sqrt(model.kick_time) * drawn
    draw = gaussian(model.seed, index, i, KICK + c) * (h / model.step)
    return model.kicks[kind_of(model, i), c] * np.sqrt(model.step) * draw


@compiled
def evaluate_body(model, state, mid, scratch, i, h, time, index):
    """Evaluate forces, loads, slips and gaps of a body at the midpoint of the step."""
    kind = kind_of(model, i)
    for c in range(model.dimension):
        mid.q[i, c] = state.q[i, c] + 0.5 * h * state.v[i, c]
        mid.kick[i, c] = 0.0
        if model.kicks[kind, c] > 0.0:
            mid.kick[i, c] = random_impulse(model, i, c, h, time, index)
    # Before forces are evaluated, since these depend on the midpoint.
    if model.first_equation[i] < model.first_gap[i + 1]:
        approach_equations(model, mid, scratch, i)
    evaluate_place(model, state, mid, scratch, i, h, time)


@compiled
def evaluate_place(model, state, mid, scratch, i, h, time):
    """Evaluate forces, loads, slips and gaps of a body where its midpoint is."""
    kind, values = kind_of(model, i), scratch.values
    at = evaluate_forces(model, mid, scratch, i, state.v, h, True)
    if model.chatter > 0.0:
        when = np.int64(np.floor(time / model.correlation_time))
        for j in range(model.loads[kind]):
            # Drawn by the number of the interval, so that parts of a step and runs that resume meet
            # the same noise.
            factor = 1.0 + model.chatter * gaussian(model.seed, when, i, j)
            values[at + j] *= max(0.0, factor)
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        load = 0.0
        for j in range(model.loads[kind]):
            if model.load_sources[f, j]:
                load += values[at + j]
        mid.load[f] = max(0.0, h * load)
        if model.scatter[f] > 0.0 and state.sticks[f]:
            mid.load[f] *= drawn_threshold(model, i, f, state.stopped[f])
    begin_slips(model, state, mid, i)
    evaluate_slips(model, state, mid, scratch, i)
    evaluate_gaps(model, scratch, i, mid.q, 0.0, mid.gap, mid.gradient)


@compiled
def drawn_threshold(model, i, f, stop):
    """Return the factor of the threshold of a friction contact, drawn when it stopped."""
    drawn = gaussian(model.seed, -1 - stop, i, f - model.first_friction[i])
    return max(model.scatter_least[f], np.exp(model.scatter[f] * (drawn - 0.5 * model.scatter[f])))


@compiled
def begin_slips(model, state, mid, i):
    """Ask for the slips with which rest is proved; others wait until their contacts have blocks."""
    first, last = model.first_friction[i], model.first_friction[i + 1]
    for r in range(model.slip_start[first], model.slip_start[last]):
        mid.slip_known[r] = 0
    for f in range(first, last):
        g = model.pressing_gap[f]
        loaded = g < 0 or g >= model.first_equation[i] or state.normal[g] != 0.0
        rubs = state.friction[f, 0] != 0.0 or state.friction[f, 1] != 0.0
        mid.slip_wanted[f] = 1 if loaded or rubs else 0


@compiled
def asks_for_slips(model, mid, i, w0, m):
    """Return whether a kernel has slips of a body that are asked for and not yet known."""
    first = model.first_friction[i]
    row = model.slip_start[first]
    for o in range(w0, w0 + m):
        r = model.slip_places[o]
        if (
            r >= 0
            and mid.slip_wanted[first + model.slip_contacts[o]]
            and not mid.slip_known[row + r]
        ):
            return True
    return False


@compiled
def evaluate_slips(model, state, mid, scratch, i):
    """Evaluate slips of a body at the midpoint: derivatives by velocities, and what is left.

    Kernels are called for those that are asked for.
    """
    k, values = model.dimension, scratch.values
    kind, first = kind_of(model, i), model.slip_start[model.first_friction[i]]
    for call in range(model.first_slip_call[kind], model.first_slip_call[kind + 1]):
        n, m = model.slip_calls[call, 1], model.slip_calls[call, 2]
        r0, w0, j0 = model.slip_calls[call, 3], model.slip_calls[call, 4], n + m
        if not asks_for_slips(model, mid, i, w0, m):
            continue
        call_slips(model, scratch, i, call, mid.q, state.v)
        for o in range(m):
            # Kernels shared by several contacts have outputs that this body does not use.
            if model.slip_places[w0 + o] < 0:
                continue
            r = first + model.slip_places[w0 + o]
            mid.slip_known[r] = 1
            value = values[n + o]
            size = abs(value)
            for c in range(k):
                mid.slip_rows[r, c] = 0.0
            for a in range(n):
                c = model.slip_reads[r0 + a] - k
                if c >= 0:
                    slope = values[j0 + o * n + a]
                    mid.slip_rows[r, c] = slope
                    value -= slope * state.v[i, c]
                    size += abs(slope * state.v[i, c])
            # What cancels up to rounding is zero: otherwise a body on a substrate that rests would
            # creep, and never sleep.
            mid.slip_offset[r] = value if abs(value) > 1e-14 * size else 0.0


@compiled
def call_slips(model, scratch, i, call, q, v):
    """Call a kernel of slips of a body; slips and derivatives follow what is read."""
    k, values = model.dimension, scratch.values
    start, base = values.ctypes.data, model.parameters.ctypes.data
    n, m = model.slip_calls[call, 1], model.slip_calls[call, 2]
    address, known = model.slip_calls[call, 0], base + 8 * model.slip_calls[call, 5]
    for a in range(n):
        c = model.slip_reads[model.slip_calls[call, 3] + a]
        values[a] = q[i, c] if c < k else v[i, c - k]
    call_kernel(address, start, known, start + 8 * n, start + 8 * (n + m), start)


@compiled
def call_pair_slips(model, scratch, first, second, slip, q, v):
    """Call the kernel of slips at a gap of two bodies, in its order of them.

    Return where the slips of all laws stand among the values; they follow coordinates and
    velocities, and their derivatives follow them.
    """
    values, family = scratch.values, family_of(model, first, second)
    one, two = coordinates_of(model, first), coordinates_of(model, second)
    reads, last = pair_inputs(model, family), model.first_law[family + 1] - 1
    for a in range(reads):
        read = model.first_read[family] + a
        which = first if model.pair_reads[read, 0] == 0 else second
        values[a] = q[which, model.pair_reads[read, 1]]
    for c in range(one):
        values[reads + c] = v[first, c]
    for c in range(two):
        values[reads + one + c] = v[second, c]
    start, base = values.ctypes.data, model.parameters.ctypes.data
    v0 = reads + one + two
    j0 = v0 + model.law_start[last] + model.law_rows[last]
    known = base + 8 * model.pair_slips[slip, 2]
    told = scratch.told.ctypes.data
    call_kernel(model.pair_slips[slip, 0], start, known, start + 8 * v0, start + 8 * j0, told)
    return v0


@compiled
def approach_equations(model, mid, scratch, i):
    """Move the midpoint of a body onto its equations, if it is not there.

    After equal steps it is: this is needed at the start, and after shorter steps.  The steps are
    Gauss and Newton's, of least length in scaled coordinates; equations may be redundant.
    """
    never_inline()
    kind, A, x = kind_of(model, i), scratch.matrix, scratch.vector
    k, units = coordinates_of(model, i), model.units[kind]
    for _ in range(MOST_APPROACHES):
        evaluate_gaps(model, scratch, i, mid.q, 0.0, mid.gap, mid.gradient)
        worst = 0.0
        for c in range(k):
            x[c] = 0.0
            for a in range(k):
                # The small weight of the change makes the matrix definite where equations are
                # redundant, and the step the shortest one otherwise.
                A[c, a] = BENDING * units[c] ** 2 if a == c else 0.0
        for g in range(model.first_equation[i], model.first_gap[i + 1]):
            row, size = mid.gradient[g], 0.0
            for c in range(k):
                size += (row[c] / units[c]) ** 2
            if size > 0.0:
                worst = max(worst, abs(mid.gap[g]) / np.sqrt(size))
                # Rows have unit length in scaled coordinates, so that all equations weigh the same.
                add_square(A, row, 1.0 / size, k)
                for c in range(k):
                    x[c] -= mid.gap[g] / size * row[c]
        if not worst > ON_EQUATIONS or not solve_spd(A, x, k):
            return
        for c in range(k):
            mid.q[i, c] += x[c]


@compiled
def settled(model, body, i):
    """Return the change of a velocity, relative to the speed, that is none."""
    if not body.touched[i]:
        return CHANGE_FREE
    share = CHANGE_TOGETHER if body.touched[i] == TOGETHER else CHANGE_ALONE
    return max(CHANGE_FREE, share * model.tolerance)


@compiled
def update_forces(model, state, work, h):
    """Evaluate forces at the mean velocities of the step; where one changed, so has its island.

    Those of a body that change nothing remain as they are, so that its motion does not depend on
    how often other bodies are evaluated.
    """
    mid, velocity, body, island = work.mid, work.velocity, work.body, work.island
    k = model.dimension
    if model.ties > 0:
        update_tie_forces(model, state, work, h)
    for i in range(model.bodies):
        root = island.parent[i]
        if not (state.alive[i] and body.awake[i]) or island.stage[root] == SETTLED:
            continue
        for c in range(k):
            body.v_mean[i, c] = 0.5 * (state.v[i, c] + velocity.new[i, c])
            body.former_force[i, c] = mid.force[i, c]
        evaluate_forces(model, mid, work.scratch, i, body.v_mean, h, False)
        if model.ties > 0:
            add_tie_forces(model, mid, work.tie, i)
        change, speed = 0.0, 0.0
        for c in range(k):
            value = 0.0
            for a in range(k):
                difference = mid.force[i, a] - body.former_force[i, a]
                value += mid.inverse_mass[i, c, a] * difference
            unit = model.units[kind_of(model, i), c]
            change = max(change, abs(value) * unit)
            speed += (abs(velocity.new[i, c]) + abs(state.v[i, c])) * unit
        # As a change of velocity, not of force: what it means depends on the mass.
        if change > settled(model, body, i) * speed:
            island.stage[root] = CHANGED
            continue
        for c in range(k):
            mid.force[i, c] = body.former_force[i, c]


@compiled
def evaluate_gaps(model, scratch, i, q, later, gap, gradient):
    """Evaluate the gaps between a body and its surroundings, and their gradients.

    Equations with the time are those ``later`` than the midpoint by so much.  Their derivative by
    it stands in the lane after the coordinates, where all velocities are one.
    """
    values = scratch.values
    start, base = values.ctypes.data, model.parameters.ctypes.data
    kind, first, now = kind_of(model, i), model.first_gap[i], 0.0
    if model.timed and model.time_parameter[kind] >= 0:
        now = model.parameters[model.time_parameter[kind]] + later
    for call in range(model.first_gap_call[kind], model.first_gap_call[kind + 1]):
        address, n, m = model.gap_calls[call, 0], model.gap_calls[call, 1], model.gap_calls[call, 2]
        r0, w0, p0 = model.gap_calls[call, 3], model.gap_calls[call, 4], model.gap_calls[call, 5]
        for a in range(n):
            c = model.gap_reads[r0 + a]
            values[a] = q[i, c] if c < model.dimension else now
        j0 = n + m
        call_kernel(address, start, base + 8 * p0, start + 8 * n, start + 8 * j0, start)
        for o in range(m):
            if model.gap_places[w0 + o] >= 0:
                g = first + model.gap_places[w0 + o]
                gap[g] = values[n + o]
                for c in range(model.dimension + model.timed):
                    gradient[g, c] = 0.0
                for a in range(n):
                    gradient[g, model.gap_reads[r0 + a]] += values[j0 + o * n + a]


@compiled
def evaluate_pair(model, scratch, a, b, q, limit):
    """Evaluate the gaps of a pair of bodies, and the gradients of those below a limit.

    The scratch array gets the coordinates that the gaps read, the gaps, and their gradients.
    """
    scratch.told[0] = limit
    kernel = model.pair_kernel[family_of(model, a, b)]
    call_pair_kernel(model, scratch, kernel, a, b, q, scratch.told.ctypes.data)


@compiled
def evaluate_pair_gaps(model, scratch, a, b, q):
    """Evaluate the gaps of a pair of bodies alone, where :func:`evaluate_pair` leaves them."""
    call_pair_kernel(model, scratch, model.pair_values[family_of(model, a, b)], a, b, q, ZERO)


@compiled
def evaluate_wanted_gaps(model, scratch, a, b, q):
    """Evaluate the gaps of a pair of bodies that are not zero in ``scratch.wanted``, or more."""
    kernel, wanted = model.pair_values[family_of(model, a, b)], scratch.wanted.ctypes.data
    call_pair_kernel(model, scratch, kernel, a, b, q, wanted)


@compiled
def call_pair_kernel(model, scratch, kernel, a, b, q, told):
    """Call a kernel for two bodies; those that are no formulas are told something."""
    values, family = scratch.values, family_of(model, a, b)
    first, n, m = model.first_read[family], pair_inputs(model, family), model.pair_gaps[family]
    start, base = values.ctypes.data, model.parameters.ctypes.data
    for r in range(n):
        body = a if model.pair_reads[first + r, 0] == 0 else b
        values[r] = q[body, model.pair_reads[first + r, 1]]
    j0, p0 = n + m, model.pair_parameters[family]
    call_kernel(kernel, start, base + 8 * p0, start + 8 * n, start + 8 * j0, told)


@compiled
def start_body(model, state, work, i):
    """Set the free velocity, due to forces alone, of a body that is awake, and measure its speed.

    Bodies of settled islands remain as they were solved.  Where a velocity or a gap is not a
    number, ``shared.finite`` becomes zero.
    """
    mid, velocity, body, island = work.mid, work.velocity, work.body, work.island
    if not state.alive[i] or island.stage[island.parent[i]] == SETTLED:
        return
    k, kind, finite, speed = model.dimension, kind_of(model, i), True, 0.0
    for c in range(k):
        value = state.v[i, c]
        if body.awake[i]:
            for a in range(k):
                value += mid.inverse_mass[i, c, a] * (
                    mid.force[i, a] + mid.kick[i, a] + mid.attraction[i, a]
                )
        velocity.old[i, c] = state.v[i, c]
        velocity.free[i, c] = value
        velocity.new[i, c] = value
        finite = finite and np.isfinite(value)
    for c in range(k):
        # Speeds are relative to the substrate: a body carried along at rest has none, and
        # tolerances are multiples of speeds.
        unit, moves = model.units[kind, c], c == model.substrate_coordinate[kind]
        carried = model.substrate_speed / unit if moves else 0.0
        before = abs(state.v[i, c] - carried) * unit
        speed += max(before, abs(velocity.free[i, c] - carried) * unit)
    body.speed[i], body.island_speed[i] = speed, speed
    body.touched[i] = 0
    # Only crowds move bodies apart; nobody reads this array otherwise.
    for c in range(k if model.crowd_sweeps > 0 else 0):
        work.crowd.shift[i, c] = 0.0
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        # An infinite gap is far; one that is not a number would pass all comparisons as open.
        finite = finite and not np.isnan(mid.gap[g])
    if model.ties > 0:
        finite = finite and tie_is_number(model, work.tie, i)
    if not finite:
        work.shared.finite[0] = 0
