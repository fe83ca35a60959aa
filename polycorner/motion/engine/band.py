"""The matrix of an island, and its solution.

Bodies are enumerated so that the matrix is a narrow band.  Each body has as many rows as lanes.
They reach from the first to the last body that elimination may touch, and stand one after the other
in ``work.band``.  Four rows are eliminated at a time, in vectors.
"""

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.rows import add_rows, row_at, row_times
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import entry, load, store, total, zeros


@compiled
def number_bodies(model, state, work, first, last):
    """Enumerate the bodies of an island; return their number, or 0 if there is no room.

    The order is breadth-first from the lowest ([CM]).
    """
    n, done = ZERO, ZERO
    members, local, ring, chain = work.members, work.number, work.first_side, work.next_side
    lowest, known = NONE, NONE
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i < 0 or i == known:
                continue
            known, local[i], ring[i] = i, NONE, NONE
            along = state.q[i, model.position[1]]
            if work.awake[i] and (lowest < 0 or along < state.q[lowest, model.position[1]]):
                lowest = i
    for s in range(last - 1, first - 1, -1):
        b = work.order[s]
        i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
        if j >= 0 and work.block_rows[b] == 0:
            chain[b, 1], ring[j] = ring[j], 2 * b + 1
            chain[b, 0], ring[i] = ring[i], 2 * b
    members[0], local[lowest], n = lowest, ZERO, ONE
    while done < n:
        at = ring[members[done]]
        done += ONE
        while at >= 0:
            other = work.block_bodies[at // 2, 1 - at % 2]
            if other >= 0 and work.awake[other] and local[other] < 0:
                members[n], local[other] = other, n
                n += ONE
            at = chain[at // 2, at % 2]
    find_envelope(work, first, last, n)
    size = place_rows(model.lanes, work.row_begin, work.row_end, work.line, n)
    return n if size <= work.band.size else ZERO


@compiled
def find_envelope(work, first, last, n):
    """Find between which bodies the rows of each body reach, with what elimination fills in."""
    begin, end = work.row_begin, work.row_end
    for at in range(n):
        begin[at], end[at] = at, at + 1
    for s in range(first, last):
        x, y = numbers_of(work, work.order[s])
        if x >= 0 and y >= 0:
            low = min(x, y)
            end[low] = max(end[low], max(x, y) + 1)
    fill_in(begin, end, n)


@compiled
def fill_in(begin, end, n):
    """Extend the rows of bodies by what elimination fills in."""
    for at in range(n):
        for i in range(at + 1, end[at]):
            end[i], begin[i] = max(end[i], end[at]), min(begin[i], at)


@compiled
def place_rows(K, begin, end, line, n):
    """Find where column 0 of each body's first row would stand; return the length of the matrix."""
    size = ZERO
    for at in range(n):
        line[at] = size - begin[at] * K
        size += (end[at] - begin[at]) * K * K
    return size


@compiled
def numbers_of(work, b):
    """Return the numbers of a block's bodies in their island, or -1."""
    i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
    x = work.number[i] if work.awake[i] else NONE
    return x, work.number[j] if j >= 0 and work.awake[j] else NONE


@compiled
def eliminate_within(A, b, j, at, stride, last):
    """Make four rows from row and column ``j`` upper triangular; return whether this is possible.

    Reciprocals of the pivots take their places.
    """
    for r in range(WIDTH):
        pivot = A[at + r * stride + j + r]
        if not abs(pivot) > 0.0:
            return False
        for s in range(r + 1, WIDTH):
            f = A[at + s * stride + j + r] / pivot
            if f != 0.0:
                for c in range(j, last, WIDTH):
                    line = at + s * stride + c
                    store(A, line, load(A, line) - f * load(A, at + r * stride + c))
                b[j + s] -= f * b[j + r]
        A[at + r * stride + j + r] = 1.0 / pivot
    return True


@compiled
def find_factors(A, f, j, at, stride, below, step):
    """Find the multiples of four pivot rows in four others; return whether any is not zero."""
    found = False
    for x in range(WIDTH):
        for r in range(WIDTH):
            value = A[below + x * step + j + r]
            for s in range(r):
                value -= f[WIDTH * x + s] * A[at + s * stride + j + r]
            value *= A[at + r * stride + j + r]
            f[WIDTH * x + r] = value
            found = found or value != 0.0
    return found


@compiled
def solve_band(A, b, n, K, begin, end, line, f):
    """Solve ``A x = b`` in place for ``n`` bodies of ``K`` rows; see :func:`find_envelope`.

    The symmetric part of ``A`` is definite or nearly so, hence rows are not exchanged.  ``f`` has
    room for sixteen factors.  Return whether no pivot is zero.
    """
    never_inline()
    for body in range(n):
        stride, last = (end[body] - begin[body]) * K, end[body] * K
        for j in range(body * K, body * K + K, WIDTH):
            at = line[body] + (j - body * K) * stride
            if not eliminate_within(A, b, j, at, stride, last):
                return False
            for i in range(j + WIDTH, last, WIDTH):
                to = i // K
                step = (end[to] - begin[to]) * K
                below = line[to] + (i - to * K) * step
                if not find_factors(A, f, j, at, stride, below, step):
                    continue
                for c in range(j + WIDTH, last, WIDTH):
                    p0, p1 = load(A, at + c), load(A, at + stride + c)
                    p2, p3 = load(A, at + 2 * stride + c), load(A, at + 3 * stride + c)
                    for x in range(WIDTH):
                        here, g = below + x * step + c, WIDTH * x
                        first, second = f[g] * p0 + f[g + 1] * p1, f[g + 2] * p2 + f[g + 3] * p3
                        store(A, here, load(A, here) - (first + second))
                for x in range(WIDTH):
                    g = WIDTH * x
                    first, second = f[g] * b[j] + f[g + 1] * b[j + 1], f[g + 2] * b[j + 2]
                    b[i + x] -= first + (second + f[g + 3] * b[j + 3])
    for body in range(n - 1, -1, -1):
        stride, last = (end[body] - begin[body]) * K, end[body] * K
        for j in range(body * K + K - WIDTH, body * K - 1, -WIDTH):
            for r in range(WIDTH - 1, -1, -1):
                at = line[body] + (j + r - body * K) * stride
                value = zeros()
                for c in range(j + WIDTH, last, WIDTH):
                    value = value + load(A, at + c) * load(b, c)
                left = b[j + r] - total(value)
                for s in range(r + 1, WIDTH):
                    left -= A[at + j + s] * b[j + s]
                b[j + r] = left * A[at + j + r]
    return True


@compiled
def assemble_mass(model, work, n, weight):
    """Set the matrix of an island to multiples of the mass matrices, and of 1 in unused lanes."""
    k, K, A = model.dimension, model.lanes, work.band
    for at in range(n):
        i, begin, end = work.members[at], work.row_begin[at] * K, work.row_end[at] * K
        for x in range(K):
            line = work.line[at] + x * (end - begin)
            for c in range(begin, end, WIDTH):
                store(A, line + c, zeros())
            if x >= k:
                A[line + at * K + x] = 1.0
                continue
            for c in range(0, K, WIDTH):
                store(A, line + at * K + c, weight * load(work.mass, (i * k + x) * K + c))


@compiled
def add_block(model, work, b):
    """Add ``J' G J`` of a block to the matrix of its island.

    ``G`` stands in ``work.derivative``, row by row, for three rows: that of the contact that
    presses on the block, which is zero, and the block's own.
    """
    K, J, G = model.lanes, work.jacobian, work.derivative
    pressing, two = work.pressing[b], work.block_rows[b] == 2
    one, other, swap = row_at(model, b, ZERO), row_at(model, b, ONE), ZERO
    if pressing >= 0 and work.block_bodies[pressing, 0] != work.block_bodies[b, 0]:
        swap = K
    x, y = numbers_of(work, b)
    for d in range(0 if x >= 0 else K, 2 * K if y >= 0 else K, WIDTH):
        along, across = G[b, 4] * load(J, one + d), zeros()
        if two:
            along = along + G[b, 5] * load(J, other + d)
            across = G[b, 7] * load(J, one + d) + G[b, 8] * load(J, other + d)
        if pressing >= 0:
            at = row_at(model, pressing, ZERO) + (d + swap) % (2 * K)
            along = along + G[b, 3] * load(J, at)
            across = across + G[b, 6] * load(J, at)
        add_columns(model, work, x, y, d, J, one, along)
        if two:
            add_columns(model, work, x, y, d, J, other, across)


@compiled
def add_columns(model, work, x, y, d, rows, at, weighted):
    """Add the products of a row over bodies ``x`` and ``y`` with four entries of another one.

    These entries begin with number ``d``.
    """
    K, A = model.lanes, work.band
    column = x * K + d if d < K else y * K + d - K
    for left in range(2):
        row = x if left == 0 else y
        if row < 0:
            continue
        place = work.line[row] + column
        step = (work.row_end[row] - work.row_begin[row]) * K
        for c in range(model.dimension):
            slope = entry(rows, at + left * K + c)
            store(A, place + c * step, load(A, place + c * step) + slope * weighted)


@compiled
def add_transposed(model, work, b, f, g, target):
    """Add ``J' (f, g)`` of a block to a vector over the bodies of its island."""
    x, y = numbers_of(work, b)
    add_rows(model, work, work.jacobian, b, f, g, target, x, y)


@compiled
def row_product(model, work, b, r, vector):
    """Return ``J x`` of one row for a vector over the bodies of an island."""
    x, y = numbers_of(work, b)
    return row_times(model, work.jacobian, row_at(model, b, r), vector, x, y)
