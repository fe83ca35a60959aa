"""The band matrix of an island, and its solution."""

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.sizes import PADDING
from polycorner.motion.engine.vectors import WIDTH, load, store


@compiled
def number_bodies(model, state, work, first, last):
    """Enumerate the bodies of an island; return their number and the half-bandwidth.

    The order is breadth-first from the lowest ([CM]), so that the matrix is a narrow band.  If it
    does not fit in the workspace, 0 is returned.
    """
    k, n, done, reach = model.dimension, ZERO, ZERO, ZERO
    members, local, ring, chain = work.members, work.number, work.first_side, work.next_side
    lowest = NONE
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i >= 0:
                local[i], ring[i] = NONE, NONE
                along = state.q[i, model.position[1]]
                if work.awake[i] and (lowest < 0 or along < state.q[lowest, model.position[1]]):
                    lowest = i
    for s in range(last - 1, first - 1, -1):
        b = work.order[s]
        for side in range(2):
            i = work.block_bodies[b, side]
            if i >= 0 and work.block_rows[b] == 0:
                chain[b, side], ring[i] = ring[i], 2 * b + side
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
    for s in range(first, last):
        i, j = work.block_bodies[work.order[s], 0], work.block_bodies[work.order[s], 1]
        if i >= 0 and j >= 0 and work.awake[i] and work.awake[j]:
            reach = max(reach, abs(local[i] - local[j]))
    width = (reach + 1) * k - 1
    if n * k * row_length(width) > work.band.size:
        n = ZERO
    return n, width


@compiled
def row_length(width):
    """Return the length of a row of the band matrix: the band, and zeros for the last vector."""
    return 2 * width + 1 + PADDING


@compiled
def solve_band(A, b, n, width, reach):
    """Solve ``A x = b`` in place for a band matrix; row ``i`` starts with column ``i - width``.

    The symmetric part of ``A`` is definite or nearly so, hence rows are not exchanged.  The array
    ``reach`` is filled in: row ``j`` ends before ``reach[j]``, and so does column ``j`` below the
    diagonal.
    """
    never_inline()
    find_envelope(A, n, width, reach)
    stride = row_length(width)
    for j in range(n):
        pivot = A[j * stride + width]
        if not abs(pivot) > 0.0:
            return False
        last, inverse = reach[j], 1.0 / pivot
        above = j * stride + width - j
        for i in range(j + 1, last):
            below = i * stride + width - i
            f = A[below + j] * inverse
            reach[i] = max(reach[i], last)
            if f != 0.0:
                for c in range(j + 1, last, WIDTH):
                    store(A, below + c, load(A, below + c) - f * load(A, above + c))
                b[i] -= f * b[j]
    for i in range(n - 1, -1, -1):
        at = i * stride + width - i
        value = b[i]
        for c in range(i + 1, reach[i]):
            value -= A[at + c] * b[c]
        b[i] = value / A[at + i]
    return True


@compiled
def find_envelope(A, n, width, reach):
    """Find where the rows and columns of a band matrix end; see :func:`solve_band`."""
    stride = row_length(width)
    for i in range(n):
        at = i * stride + width - i
        last = min(n, i + width + 1)
        while last > i + 1 and A[at + last - 1] == 0.0:
            last -= 1
        reach[i] = last
        first = max(0, i - width)
        while first < i and A[at + first] == 0.0:
            first += 1
        for j in range(first, i):
            reach[j] = max(reach[j], i + 1)


@compiled
def assemble_mass(model, work, n, width):
    """Set the band matrix of an island to the mass matrices of its bodies."""
    k, stride = model.dimension, row_length(width)
    for a in range(n * k * stride):
        work.band[a] = 0.0
    for at in range(n):
        i = work.members[at]
        for x in range(k):
            for y in range(k):
                work.band[(at * k + x) * stride + width + y - x] = work.mass[i, x, y]


@compiled
def add_block(model, work, b, width):
    """Add ``J' G J`` of a block to the band matrix.

    ``G`` stands in ``work.derivative``, row by row, for three rows: that of the contact that
    presses on the block, which is zero, and the block's own.
    """
    k, stride = model.dimension, row_length(width)
    stacked, weighted = work.stacked, work.weighted
    derivative, pressing = work.derivative, work.pressing[b]
    sides = 2 if work.block_bodies[b, 1] >= 0 else 1
    rows = max(1, work.block_rows[b])
    start = 0 if pressing >= 0 else 1
    if pressing >= 0:
        swap = sides == 2 and work.block_bodies[pressing, 0] != work.block_bodies[b, 0]
        for x in range(sides * k):
            stacked[0, x] = work.jacobian[pressing, 0, (x + k if x < k else x - k) if swap else x]
    for r in range(rows):
        for x in range(sides * k):
            stacked[1 + r, x] = work.jacobian[b, r, x]
    for r in range(1, 1 + rows):
        for x in range(sides * k):
            value = 0.0
            for c in range(start, 1 + rows):
                value += derivative[b, 3 * r + c] * stacked[c, x]
            weighted[r, x] = value
    for side in range(sides):
        i = work.block_bodies[b, side]
        if not work.awake[i]:
            continue
        for other in range(sides):
            j = work.block_bodies[b, other]
            if not work.awake[j]:
                continue
            for x in range(k):
                row = work.number[i] * k + x
                at = row * stride + width - row + work.number[j] * k
                for y in range(k):
                    value = 0.0
                    for r in range(1, 1 + rows):
                        value += stacked[r, side * k + x] * weighted[r, other * k + y]
                    work.band[at + y] += value


@compiled
def add_transposed_row(model, work, b, r, value, target):
    """Add ``value J'`` of one row to a vector over the bodies of an island."""
    k = model.dimension
    for side in range(2):
        i = work.block_bodies[b, side]
        if i >= 0 and work.awake[i]:
            for x in range(k):
                target[work.number[i] * k + x] += value * work.jacobian[b, r, side * k + x]


@compiled
def row_product(model, work, b, r, vector):
    """Return ``J x`` of one row for a vector over the bodies of an island."""
    k, value = model.dimension, 0.0
    for side in range(2):
        i = work.block_bodies[b, side]
        if i >= 0 and work.awake[i]:
            for x in range(k):
                value += work.jacobian[b, r, side * k + x] * vector[work.number[i] * k + x]
    return value
