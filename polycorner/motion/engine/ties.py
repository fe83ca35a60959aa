"""Ties of two bodies, or of a body and the world: their rows and forces, by kernels."""

import numpy as np

from polycorner.formulas.compilation import call_kernel, never_inline
from polycorner.motion.engine.arrays import (
    FORCE_KERNEL,
    LIMITS,
    ROW_KERNEL,
    ROWS,
    SETTLED,
    SLIP_KERNEL,
    SLIPS,
)
from polycorner.motion.engine.jit import ZERO, compiled


@compiled
def form_of(model, t, what):
    """Return what the form of a tie has: a kernel, or a number."""
    return model.tie_forms[model.tie_form[t], what]


@compiled
def row_inputs(model):
    """Return how many numbers the rows of a tie read: coordinates of two bodies, and the time."""
    return 2 * model.dimension + 1


@compiled
def slip_inputs(model):
    """Return how many numbers slips and forces of a tie read: velocities as well."""
    return 4 * model.dimension + 1


@compiled
def is_tied(model, i):
    """Return whether a body has ties."""
    return model.tie_start[i + 1] > model.tie_start[i]


@compiled
def are_apart(model, i, j):
    """Return whether two bodies have no contact with each other, because they are tied."""
    for s in range(model.apart_start[i], model.apart_start[i + 1]):
        if model.apart_from[s] == j:
            return True
    return False


@compiled
def read_bodies(model, scratch, t, q, at):
    """Write coordinates or velocities of both bodies among the values; the world has zeros."""
    k, i, j = model.dimension, model.tie_bodies[t, 0], model.tie_bodies[t, 1]
    for c in range(k):
        scratch.values[at + c] = q[i, c]
        scratch.values[at + k + c] = q[j, c] if j >= 0 else 0.0


@compiled
def call_tie(model, scratch, t, kernel, n, m):
    """Call a kernel of a tie for the first ``n`` values; ``m`` results and derivatives follow."""
    start = scratch.values.ctypes.data
    known = model.parameters.ctypes.data + 8 * model.tie_parameters[t]
    out, slopes = start + 8 * n, start + 8 * (n + m)
    call_kernel(form_of(model, t, kernel), start, known, out, slopes, start)


@compiled
def evaluate_tie(model, scratch, t, q, time):
    """Evaluate limits and equations of a tie and their gradients; they follow the values read."""
    if form_of(model, t, ROWS) > 0:
        read_bodies(model, scratch, t, q, ZERO)
        scratch.values[2 * model.dimension] = time
        call_tie(model, scratch, t, ROW_KERNEL, row_inputs(model), form_of(model, t, ROWS))


@compiled
def evaluate_rows(model, mid, tie, scratch, t):
    """Evaluate limits and equations of a tie at the midpoint of the step."""
    k, K, n, m = model.dimension, model.lanes, row_inputs(model), form_of(model, t, ROWS)
    evaluate_tie(model, scratch, t, mid.q, tie.time[0])
    for o in range(m):
        row, at = model.tie_rows[t] + o, n + m + o * n
        tie.gap[row], tie.rate[row] = scratch.values[n + o], scratch.values[at + 2 * k]
        for c in range(k):
            tie.gradient[row, c] = scratch.values[at + c]
            tie.gradient[row, K + c] = scratch.values[at + k + c]


@compiled
def evaluate_slips_of_tie(model, mid, tie, scratch, t, v):
    """Evaluate slips of a tie and their derivatives; they follow the values read.

    What moves at a given rate does so at the end of the step, as in surroundings.
    """
    k, n = model.dimension, slip_inputs(model)
    read_bodies(model, scratch, t, mid.q, ZERO)
    read_bodies(model, scratch, t, v, 2 * k)
    scratch.values[4 * k] = tie.time[0] + 0.5 * model.step
    call_tie(model, scratch, t, SLIP_KERNEL, n, form_of(model, t, SLIPS))


@compiled
def evaluate_tie_forces(model, mid, tie, scratch, t, v, h):
    """Evaluate the impulses of a tie's forces on both bodies, and its known loads, at velocities.

    They are kept by tie; :func:`add_tie_forces` adds them up body by body, so that each body has
    one sum in one order, whoever evaluates.
    """
    never_inline()
    k, n, values = model.dimension, slip_inputs(model), scratch.values
    if form_of(model, t, FORCE_KERNEL) == 0:
        return
    read_bodies(model, scratch, t, mid.q, ZERO)
    read_bodies(model, scratch, t, v, 2 * k)
    values[4 * k] = tie.time[0]
    call_tie(model, scratch, t, FORCE_KERNEL, n, ZERO)
    for c in range(2 * k):
        tie.force[t, c], tie.applied[t, c] = h * values[n + c], h * values[n + 2 * k + c]
    for x in range(model.tie_frictions[t], model.tie_frictions[t + 1]):
        load = values[n + 4 * k + x - model.tie_frictions[t]]
        tie.load[x] = max(0.0, h * load)


@compiled
def add_tie_forces(model, mid, tie, i):
    """Add the impulses of ties to those of the other forces on a body."""
    k = model.dimension
    for s in range(model.tie_start[i], model.tie_start[i + 1]):
        t, side = model.tie_sides[s] // 2, model.tie_sides[s] % 2 * k
        if form_of(model, t, FORCE_KERNEL) != 0:
            for c in range(k):
                mid.force[i, c] += tie.force[t, side + c]
                mid.applied[i, c] += tie.applied[t, side + c]


@compiled
def update_tie_forces(model, state, work, h):
    """Evaluate the forces of ties at the mean velocities of the step, except in settled islands."""
    for i in range(model.bodies):
        for c in range(model.dimension):
            work.body.v_mean[i, c] = 0.5 * (state.v[i, c] + work.velocity.new[i, c])
    for t in range(model.ties):
        i = model.tie_bodies[t, 0]
        if work.body.awake[i] and work.island.stage[work.island.parent[i]] != SETTLED:
            evaluate_tie_forces(model, work.mid, work.tie, work.scratch, t, work.body.v_mean, h)


@compiled
def tie_is_number(model, tie, i):
    """Return whether the limits and equations of a body's ties are numbers."""
    for s in range(model.tie_start[i], model.tie_start[i + 1]):
        t = model.tie_sides[s] // 2
        for row in range(model.tie_rows[t], model.tie_rows[t + 1]):
            if np.isnan(tie.gap[row]):
                return False
    return True


@compiled
def is_equation(model, t, row):
    """Return whether a row of a tie is an equation."""
    return row - model.tie_rows[t] >= form_of(model, t, LIMITS)


@compiled
def rate_of_row(model, scratch, t, o, v):
    """Return the rate at velocities of a row that was evaluated last, the time's part included."""
    k, n, m, values = model.dimension, row_inputs(model), form_of(model, t, ROWS), scratch.values
    i, j, at = model.tie_bodies[t, 0], model.tie_bodies[t, 1], n + m + o * n
    rate = values[at + 2 * k]
    for c in range(k):
        rate += values[at + c] * v[i, c]
        if j >= 0:
            rate += values[at + k + c] * v[j, c]
    return rate
