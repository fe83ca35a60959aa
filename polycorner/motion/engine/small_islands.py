"""Newton steps on small islands: of at most eight velocities, in vectors of that length.

All rows of an island's Jacobian are gathered in one dense array, padded by zeros.
"""

from polycorner.motion.engine.gauss_seidel import block_residual
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.linearisation import change_impulses, is_loaded
from polycorner.motion.engine.vectors import WIDTH, dot, load, store, zeros

ROWS = 64  # of a small island, at most


@compiled
def number_few(model, work, first, last):
    """Enumerate the bodies of an island if it is small; return their number, else 0."""
    n, rows = ZERO, ZERO
    for s in range(first, last):
        b = work.order[s]
        rows += max(ONE, work.block_rows[b])
        for side in range(2):
            i = work.block_bodies[b, side]
            if i < 0 or not work.awake[i]:
                continue
            known = False
            for at in range(n):
                known = known or work.members[at] == i
            if known:
                continue
            if (n + 1) * model.dimension > WIDTH:
                return ZERO
            work.members[n], work.number[i] = i, n
            n += ONE
    return n if rows <= ROWS else ZERO


@compiled
def gather(model, work, first, last, n):
    """Gather the free velocities and the rows of a small island.

    Bodies that sleep keep their velocities, which count as offsets of the rows.
    """
    k, row = model.dimension, ZERO
    jacobian, response = work.small_jacobian, work.small_response
    store(work.small_free, 0, zeros())
    for at in range(n):
        for c in range(k):
            work.small_free[at * k + c] = work.v_free[work.members[at], c]
    for s in range(first, last):
        b = work.order[s]
        work.first_row[b] = row
        for r in range(max(1, work.block_rows[b])):
            store(jacobian, WIDTH * row, zeros())
            store(response, WIDTH * row, zeros())
            offset = work.offset[b, r]
            for side in range(2):
                i = work.block_bodies[b, side]
                if i < 0:
                    continue
                at = WIDTH * row + work.number[i] * k
                for c in range(k):
                    slope = work.jacobian[b, r, side * k + c]
                    if work.awake[i]:
                        jacobian[at + c] = slope
                        response[at + c] = work.response[b, r, side * k + c]
                    else:
                        offset += slope * work.v_new[i, c]
            work.small_offset[row] = offset
            row += ONE


@compiled
def scatter(model, work, n):
    """Give the bodies of a small island its velocities."""
    k = model.dimension
    for at in range(n):
        for c in range(k):
            work.v_new[work.members[at], c] = work.small_velocity[at * k + c]


@compiled
def small_residual(model, work, first, last, compliance):
    """Return the largest residual of a small island that was gathered, like ``residual``.

    Its velocities are computed from its impulses.
    """
    v, worst = load(work.small_free, 0), 0.0
    for s in range(first, last):
        b = work.order[s]
        row = work.first_row[b]
        v = v + work.impulse[b, 0] * load(work.small_response, WIDTH * row)
        if work.block_rows[b] == 2:
            v = v + work.impulse[b, 1] * load(work.small_response, WIDTH * (row + 1))
    store(work.small_velocity, 0, v)
    for s in range(first, last):
        b = work.order[s]
        row = work.first_row[b]
        for r in range(max(1, work.block_rows[b])):
            product = dot(load(work.small_jacobian, WIDTH * (row + r)), v)
            work.after[b, r] = product + work.small_offset[row + r]
        worst = max(worst, block_residual(model, work, b, compliance))
    return worst


@compiled
def small_step(model, work, first, last, n):
    """Take a Newton step on a small island that was linearised; return whether there is one."""
    assemble(model, work, first, last, n)
    if not solve(work.small_matrix, work.small_vector, n * model.dimension):
        return False
    x = load(work.small_vector, 0)
    for s in range(first, last):
        b = work.order[s]
        row, pressing = work.first_row[b], work.pressing[b]
        normal = across = 0.0
        if pressing >= 0:
            normal = dot(load(work.small_jacobian, WIDTH * work.first_row[pressing]), x)
        along = dot(load(work.small_jacobian, WIDTH * row), x)
        if work.block_rows[b] == 2:
            across = dot(load(work.small_jacobian, WIDTH * (row + 1)), x)
        change_impulses(work, b, normal, along, across, work.slip)
    return True


@compiled
def assemble(model, work, first, last, n):
    """Assemble the matrix ``M + J' G J`` of a small island, and ``J' a``."""
    k, matrix, rows, G = model.dimension, work.small_matrix, work.small_jacobian, work.derivative
    for x in range(WIDTH):
        store(matrix, WIDTH * x, zeros())
    for at in range(n):
        i = work.members[at]
        for x in range(k):
            for y in range(k):
                matrix[WIDTH * (at * k + x) + at * k + y] = work.mass[i, x, y]
    total = zeros()
    for s in range(first, last):
        b = work.order[s]
        row, pressing, two = work.first_row[b], work.pressing[b], work.block_rows[b] == 2
        one = load(rows, WIDTH * row)
        total = total + work.constant[b, 0] * one
        if two:
            total = total + work.constant[b, 1] * load(rows, WIDTH * (row + 1))
        if not is_loaded(work, b):
            continue
        along, across = G[b, 4] * one, zeros()
        if two:
            along = along + G[b, 5] * load(rows, WIDTH * (row + 1))
            across = G[b, 7] * one + G[b, 8] * load(rows, WIDTH * (row + 1))
        if pressing >= 0:
            presses = load(rows, WIDTH * work.first_row[pressing])
            along = along + G[b, 3] * presses
            across = across + G[b, 6] * presses
        for x in range(n * k):
            line = load(matrix, WIDTH * x) + rows[WIDTH * row + x] * along
            if two:
                line = line + rows[WIDTH * (row + 1) + x] * across
            store(matrix, WIDTH * x, line)
    store(work.small_vector, 0, total)


@compiled
def solve(matrix, b, n):
    """Solve ``A x = b`` in place, without exchange of rows; return whether no pivot is zero."""
    for j in range(n):
        pivot = matrix[WIDTH * j + j]
        if not abs(pivot) > 0.0:
            return False
        line, inverse = load(matrix, WIDTH * j), 1.0 / pivot
        matrix[WIDTH * j + j] = inverse
        for i in range(j + 1, n):
            f = matrix[WIDTH * i + j] * inverse
            store(matrix, WIDTH * i, load(matrix, WIDTH * i) - f * line)
            b[i] -= f * b[j]
    for j in range(n - 1, -1, -1):
        b[j] *= matrix[WIDTH * j + j]
        for i in range(j):
            b[i] -= matrix[WIDTH * i + j] * b[j]
    return True
