"""The method of multipliers for islands with known loads of friction: it converges from anywhere.

With known loads the impulses ``p`` minimise a convex function over a convex set ``C``.  A round
looks for those that minimise it with a term for the distance to the impulses ``q`` at hand
([Rockafellar76]).  Contacts then yield to the change of their impulses alone: these follow from the
velocities, ``p = proj(q - rho u / c)`` with the softness ``c``, and the velocities minimise

    1/2 (v - v_free)' M (v - v_free) + c / (2 rho) |proj(q - rho u / c)|^2,

for ``C`` a cone; for other sets likewise.  The function is convex with a continuous gradient:
Newton steps with a line search lead to its minimum.
"""

from polycorner.motion.engine.island_matrix import (
    add_block,
    add_transposed,
    assemble_mass,
    row_product,
    solve_island_matrix,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.rows import load_on, velocity_of
from polycorner.motion.engine.sets import project

STEPS_OF_ROUND = 25  # Newton steps of a round, at most
LINE_STEPS, FLAT = 20, 0.3  # trials of a line search, and how flat the function is where it ends


@compiled
def approach(model, work, first, last, n, softness, enough):
    """Find the velocities of a round, and its impulses; return the number of Newton steps.

    ``work.initial`` must be the impulses at hand.  The round ends where they would change the
    velocities of rows by no more than ``enough``, or after ``STEPS_OF_ROUND``.
    """
    steps = ZERO
    while True:
        press_all(model, work, first, last, softness)
        if steps == STEPS_OF_ROUND or not find_direction(model, work, first, last, n):
            break
        largest = 0.0
        for s in range(first, last):
            b = work.order[s]
            for r in range(max(1, work.block_rows[b])):
                w = row_product(model, work, b, r, work.island_vector)
                work.constant[b, r] = w
                if work.derivative[b, 4] > 0.0:
                    largest = max(largest, abs(w))
        t = length_of_step(model, work, first, last, n, softness)
        for at in range(n):
            i = work.members[at]
            for c in range(model.dimension):
                work.v_new[i, c] += t * work.island_vector[at * model.lanes + c]
        steps += ONE
        if t == 1.0 and largest <= softness * enough:
            press_all(model, work, first, last, softness)
            break
    return steps


@compiled
def press_all(model, work, first, last, softness):
    """Find the impulses of all blocks from their velocities, and their derivatives."""
    for s in range(first, last):
        b = work.order[s]
        velocity_of(model, work, b, work.v_new, work.after[b])
        press(model, work, b, softness)


@compiled
def press(model, work, b, softness):
    """Find the impulses of a block from its velocities, and their derivative."""
    rho, derivative = work.delassus[b, 3] / softness, work.derivative
    x = work.initial[b, 0] - rho * work.after[b, 0]
    for a in range(9):
        derivative[b, a] = 0.0
    work.impulse[b, 1] = 0.0
    if work.block_rows[b] == 0:
        acts = x > 0.0 or work.bilateral[b]
        work.impulse[b, 0] = x if acts else 0.0
        derivative[b, 4] = rho if acts else 0.0
        return
    out, two = work.projection[b], work.block_rows[b] == 2
    y = work.initial[b, 1] - rho * work.after[b, 1] if two else 0.0
    project(model, work.block_set[b], x, y, load_on(work, b), out)
    work.impulse[b, 0], derivative[b, 4] = out[0], rho * out[2]
    if two:
        work.impulse[b, 1] = out[1]
        derivative[b, 5], derivative[b, 7] = rho * out[3], rho * out[4]
        derivative[b, 8] = rho * out[5]


@compiled
def find_direction(model, work, first, last, n):
    """Leave the Newton step of the velocities in ``work.island_vector``; return whether it is."""
    K, k, x = model.lanes, model.dimension, work.island_vector
    assemble_mass(model, work, n, 1.0)
    for at in range(n):
        i = work.members[at]
        for c in range(K):
            x[at * K + c] = 0.0
        for c in range(k):
            for a in range(k):
                moved = work.v_new[i, a] - work.v_free[i, a]
                x[at * K + c] -= work.mass[i, c, a] * moved
    for s in range(first, last):
        b = work.order[s]
        if work.derivative[b, 4] != 0.0 or work.derivative[b, 8] != 0.0:
            add_block(model, work, n, b)
        p, q = work.impulse[b, 0], work.impulse[b, 1]
        if p != 0.0 or q != 0.0:
            add_transposed(model, work, b, p, q, x)
    return solve_island_matrix(model, work, n)


@compiled
def length_of_step(model, work, first, last, n, softness):
    """Return how much of a Newton step to take: all, unless the function grows again before."""
    K, k, x = model.lanes, model.dimension, work.island_vector
    begin, more = 0.0, 0.0
    for at in range(n):
        i = work.members[at]
        for c in range(k):
            for a in range(k):
                m = x[at * K + c] * work.mass[i, c, a]
                begin += m * (work.v_new[i, a] - work.v_free[i, a])
                more += m * x[at * K + a]
    start = begin - pull(model, work, first, last, softness, 0.0)
    low, high, t = 0.0, 1.0, 1.0
    at_low, at_high = start, 0.0
    for _ in range(LINE_STEPS):
        slope = begin + t * more - pull(model, work, first, last, softness, t)
        if abs(slope) <= -FLAT * start or (t == 1.0 and slope < 0.0):
            break
        if slope < 0.0:
            low, at_low = t, slope
        else:
            high, at_high = t, slope
        t = low - at_low * (high - low) / (at_high - at_low)
        t = min(max(t, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    return t


@compiled
def pull(model, work, first, last, softness, t):
    """Return the products of a part of a Newton step with the impulses there."""
    total, out = 0.0, work.image
    for s in range(first, last):
        b = work.order[s]
        rho, wx = work.delassus[b, 3] / softness, work.constant[b, 0]
        x = work.initial[b, 0] - rho * (work.after[b, 0] + t * wx)
        if work.block_rows[b] == 0:
            if x > 0.0 or work.bilateral[b]:
                total += wx * x
            continue
        if load_on(work, b) <= 0.0:
            continue
        two = work.block_rows[b] == 2
        wy = work.constant[b, 1] if two else 0.0
        y = work.initial[b, 1] - rho * (work.after[b, 1] + t * wy) if two else 0.0
        project(model, work.block_set[b], x, y, load_on(work, b), out)
        total += wx * out[0] + wy * out[1]
    return total
