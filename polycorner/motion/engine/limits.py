"""Values and gradients of limits on velocities, ``f(q, v, t) >= 0``, and of their equations."""

import numpy as np

from polycorner.formulas.compilation import call_kernel
from polycorner.motion.engine.families import coordinates_of, kind_of
from polycorner.motion.engine.jit import compiled

ROUNDING = 1e-13  # of the terms of a limit, up to which it holds


@compiled
def evaluate_limits(model, scratch, i, q, way, ahead, v, change, share, time):
    """Evaluate the limits of a body at the place ``q + ahead way`` and ``v + share change``.

    Values and derivatives are left in ``scratch.values``: see :func:`limit_value` and
    :func:`limit_slope`.
    """
    k, values = coordinates_of(model, i), scratch.values
    for c in range(k):
        values[c] = q[i, c] + ahead * way[i, c]
        values[k + c] = v[i, c] + share * (change[i, c] - v[i, c])
    values[2 * k] = time
    call_limits(model, scratch, i, model.limit_kernel[kind_of(model, i)])


@compiled
def call_limits(model, scratch, i, kernel):
    """Call a kernel for the limits of a body, whose arguments are in place."""
    n, start = 2 * coordinates_of(model, i) + 1, scratch.values.ctypes.data
    m, base = model.first_limit[i + 1] - model.first_limit[i], model.parameters.ctypes.data
    out = start + 8 * n
    call_kernel(kernel, start, base, out, out + 8 * m, out + 8 * m * (1 + n))


@compiled
def limit_value(model, scratch, i, which):
    """Return the value of a limit of a body that was evaluated, by its number among those."""
    return scratch.values[2 * coordinates_of(model, i) + 1 + which - model.first_limit[i]]


@compiled
def limit_slope(model, scratch, i, which, c):
    """Return the derivative of a limit of a body by its velocity ``c``."""
    k, first = coordinates_of(model, i), model.first_limit[i]
    n, m = 2 * k + 1, model.first_limit[i + 1] - first
    return scratch.values[n + m + (which - first) * n + k + c]


@compiled
def limit_bend(model, scratch, i, which, c, a):
    """Return a second derivative of a limit by velocities, after a call that found these."""
    k, first = coordinates_of(model, i), model.first_limit[i]
    n, m = 2 * k + 1, model.first_limit[i + 1] - first
    return scratch.values[n + m * (1 + n) + (which - first) * n * n + (k + c) * n + k + a]


@compiled
def limit_size(model, scratch, i, which):
    """Return the length of the gradient of a limit by scaled velocities."""
    square, kind = 0.0, kind_of(model, i)
    for c in range(coordinates_of(model, i)):
        square += (limit_slope(model, scratch, i, which, c) / model.units[kind, c]) ** 2
    return np.sqrt(square)


@compiled
def is_passed(model, scratch, i, which, v):
    """Return whether a velocity is beyond a limit that was evaluated there, by more than rounding.

    What is not a number is not.
    """
    value, along, terms = limit_value(model, scratch, i, which), 0.0, 0.0
    for c in range(coordinates_of(model, i)):
        part = limit_slope(model, scratch, i, which, c) * v[i, c]
        along += part
        terms += abs(part)
    return value < -ROUNDING * (terms + abs(value - along))
