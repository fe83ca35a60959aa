"""The matrix of an island, and its solution by sparse elimination.

The matrix has a block of ``K x K`` numbers, ``K`` the lanes of a body, for each body and for each
two that share an entry.  In ``matrix.entries`` the blocks of the diagonal come first, in the order
of elimination; then for each entry of :mod:`~polycorner.motion.engine.ordering` the one above the
diagonal; then, in the same order, those below.
"""

from polycorner.formulas.compilation import never_inline
from polycorner.motion.engine.families import coordinates_of
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.ordering import eliminate_all, find_neighbours, list_bodies
from polycorner.motion.engine.rows import add_rows, row_at, row_times
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import entry, load, store, zeros


@compiled
def number_bodies(model, body, block, graph, matrix, first, last):
    """Find the order in which bodies of an island are eliminated; return how many there are.

    Return 0 if there is no room for the matrix.
    """
    never_inline()
    n = list_bodies(body, block, graph, matrix, first, last)
    if not (
        find_neighbours(body, block, graph, matrix, first, last, n)
        and eliminate_all(graph, matrix, n)
    ):
        return ZERO
    for v in range(n):
        i = graph.listed[v]
        matrix.members[matrix.place[v]], matrix.number[i] = i, matrix.place[v]
    for s in range(first, last):
        b = block.order[s]
        x, y = numbers_of(block, matrix, b)
        block.entry[b] = find_entry(matrix, min(x, y), max(x, y)) if x >= 0 and y >= 0 else NONE
    return n


@compiled
def find_entry(matrix, row, column):
    """Return the number of an entry above the diagonal."""
    low, high = matrix.row_start[row], matrix.row_start[row + 1]
    while low < high:
        middle = (low + high) // 2
        if matrix.columns[middle] < column:
            low = middle + ONE
        else:
            high = middle
    return low


@compiled
def numbers_of(block, matrix, b):
    """Return the numbers of a block's bodies in their island; -1 for sleepers and no body."""
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    return matrix.number[i], matrix.number[j] if j >= 0 else NONE


@compiled
def eliminate_within(A, x, p, above, begin, end, K):
    """Make the diagonal block of a body upper triangular; return whether no pivot is zero.

    Its rows in the entries from ``begin`` to ``end`` and its part of the right-hand side follow.
    Reciprocals of the pivots take their places, and zeros those of what is eliminated.
    """
    size = K * K
    for r in range(K):
        line = p * size + r * K
        pivot = A[line + r]
        # So written that a pivot that is not a number is refused as well.
        if not abs(pivot) > 0.0:
            return False
        for s in range(r + 1, K):
            here = p * size + s * K
            factor = A[here + r] / pivot
            if factor == 0.0:
                continue
            for c in range(0, K, WIDTH):
                store(A, here + c, load(A, here + c) - factor * load(A, line + c))
            A[here + r] = 0.0
            for e in range(begin, end):
                at, to = above + e * size + r * K, above + e * size + s * K
                for c in range(0, K, WIDTH):
                    store(A, to + c, load(A, to + c) - factor * load(A, at + c))
            x[p * K + s] -= factor * x[p * K + r]
        # The reciprocal, since every later use divides by the pivot.
        A[line + r] = 1.0 / pivot
    return True


@compiled
def find_factors(A, block, triangle, K):
    """Replace a block by the multiples of the rows of an upper triangular one that make it up."""
    for r in range(K):
        line = block + r * K
        for s in range(K):
            row = triangle + s * K
            factor = A[line + s] * A[row + s]
            if factor != 0.0:
                # From the vector that holds column s: what is left of it are factors, or is
                # subtracted zero times, as the triangle has zeros there.
                for c in range(s // WIDTH * WIDTH, K, WIDTH):
                    store(A, line + c, load(A, line + c) - factor * load(A, row + c))
            A[line + s] = factor


@compiled
def subtract_product(A, to, left, right, K):
    """Subtract the product of two blocks from a third one."""
    # Four rows at once: each row of the right-hand block is then read once for all of them, and
    # four sums run side by side.
    for r in range(0, K, WIDTH):
        one, a = to + r * K, left + r * K
        for c in range(0, K, WIDTH):
            first, second = load(A, one + c), load(A, one + K + c)
            third, fourth = load(A, one + 2 * K + c), load(A, one + 3 * K + c)
            for s in range(K):
                row = load(A, right + s * K + c)
                first = first - entry(A, a + s) * row
                second = second - entry(A, a + K + s) * row
                third = third - entry(A, a + 2 * K + s) * row
                fourth = fourth - entry(A, a + 3 * K + s) * row
            store(A, one + c, first)
            store(A, one + K + c, second)
            store(A, one + 2 * K + c, third)
            store(A, one + 3 * K + c, fourth)


@compiled
def subtract_image(A, at, x, source, target, K):
    """Subtract the product of a block and a part of a vector from another part."""
    for r in range(K):
        value = 0.0
        for c in range(K):
            value += A[at + r * K + c] * x[source + c]
        x[target + r] -= value


@compiled
def solve_triangle(A, at, x, place, K):
    """Solve for a part of a vector with an upper triangular block."""
    for r in range(K - 1, -1, -1):
        value = x[place + r]
        for c in range(r + 1, K):
            value -= A[at + r * K + c] * x[place + c]
        x[place + r] = value * A[at + r * K + r]


@compiled
def solve_matrix(A, x, n, K, row_start, columns):
    """Solve a system in place for ``n`` bodies: ``x`` is the right-hand side, then the solution.

    The symmetric part of the matrix is definite or nearly so, hence rows are not exchanged.  Return
    whether no pivot is zero.
    """
    never_inline()
    size = K * K
    above, below = n * size, (n + row_start[n]) * size
    for p in range(n):
        begin, end = row_start[p], row_start[p + 1]
        if not eliminate_within(A, x, p, above, begin, end, K):
            return False
        for e in range(begin, end):
            find_factors(A, below + e * size, p * size, K)
            subtract_image(A, below + e * size, x, p * K, columns[e] * K, K)
        for e in range(begin, end):
            j = columns[e]
            upper, lower = above + e * size, below + e * size
            subtract_product(A, j * size, lower, upper, K)
            # Rows ascend, so that entries of the row of j are found by going on from the last one.
            there = row_start[j]
            for other in range(e + 1, end):
                while columns[there] < columns[other]:
                    there += 1
                subtract_product(A, above + there * size, lower, above + other * size, K)
                subtract_product(A, below + there * size, below + other * size, upper, K)
    for p in range(n - 1, -1, -1):
        for e in range(row_start[p], row_start[p + 1]):
            subtract_image(A, above + e * size, x, columns[e] * K, p * K, K)
        solve_triangle(A, p * size, x, p * K, K)
    return True


@compiled
def solve_island_matrix(model, matrix, n):
    """Solve the system of an island for ``matrix.vector`` in place; return if it has been."""
    x, K = matrix.vector, model.lanes
    # The derivative by the time stands in a row of its own: its velocity is given, no unknown.
    for p in range(n if model.timed else ZERO):
        x[p * K + model.dimension] = 0.0
    return solve_matrix(matrix.entries, x, n, K, matrix.row_start, matrix.columns)


@compiled
def assemble_mass(model, mid, matrix, n, weight):
    """Set the matrix of an island to multiples of the mass matrices, and of 1 in unused lanes."""
    k, K, A = model.dimension, model.lanes, matrix.entries
    for at in range(0, (n + 2 * matrix.row_start[n]) * K * K, WIDTH):
        store(A, at, zeros())
    for p in range(n):
        i = matrix.members[p]
        own = coordinates_of(model, i)
        for x in range(K):
            line = (p * K + x) * K
            # Unused lanes have equations of their own, 1 x = 0: the elimination needs no exception
            # for them.
            if x >= own:
                A[line + x] = 1.0
                continue
            for c in range(0, K, WIDTH):
                store(A, line + c, weight * load(mid.mass, (i * k + x) * K + c))


@compiled
def block_at(matrix, n, row, column, e):
    """Return the number of the block of two bodies in the matrix; ``e`` is their entry."""
    if row == column:
        return row
    return n + e if row < column else n + matrix.row_start[n] + e


@compiled
def add_block(model, block, search, matrix, n, b):
    """Add ``J' G J`` of a block to the matrix of its island.

    ``G`` stands in ``search.derivative``, row by row, for three rows: that of the contact that
    presses on the block, which is zero, and the block's own.
    """
    K, J, G = model.lanes, block.jacobian, search.derivative
    pressing, two = block.pressing[b], block.rows[b] == 2
    one, other, swap = row_at(model, b, ZERO), row_at(model, b, ONE), ZERO
    if pressing >= 0 and block.bodies[pressing, 0] != block.bodies[b, 0]:
        # Friction may know its bodies the other way round than the contact that presses on it.
        swap = K
    x, y = numbers_of(block, matrix, b)
    for d in range(0 if x >= 0 else K, 2 * K if y >= 0 else K, WIDTH):
        along, across = G[b, 4] * load(J, one + d), zeros()
        if two:
            along = along + G[b, 5] * load(J, other + d)
            across = G[b, 7] * load(J, one + d) + G[b, 8] * load(J, other + d)
        if pressing >= 0:
            at = row_at(model, pressing, ZERO) + (d + swap) % (2 * K)
            along = along + G[b, 3] * load(J, at)
            across = across + G[b, 6] * load(J, at)
        add_columns(model, block, matrix, n, b, d, J, one, along)
        if two:
            add_columns(model, block, matrix, n, b, d, J, other, across)


@compiled
def add_columns(model, block, matrix, n, b, d, rows, at, weighted):
    """Add the products of a row over the bodies of a block with four entries of another one.

    These entries begin with number ``d``.
    """
    K, A = model.lanes, matrix.entries
    x, y = numbers_of(block, matrix, b)
    column, lane = (x, d) if d < K else (y, d - K)
    for left in range(2):
        row = x if left == 0 else y
        if row < 0:
            continue
        place = block_at(matrix, n, row, column, block.entry[b]) * K * K + lane
        for c in range(model.dimension):
            slope = entry(rows, at + left * K + c)
            store(A, place + c * K, load(A, place + c * K) + slope * weighted)


@compiled
def add_transposed(model, block, matrix, b, f, g, target):
    """Add ``J' (f, g)`` of a block to a vector over the bodies of its island."""
    x, y = numbers_of(block, matrix, b)
    add_rows(model, block, block.jacobian, b, f, g, target, x, y)


@compiled
def row_product(model, block, matrix, b, r, vector):
    """Return ``J x`` of one row for a vector over the bodies of an island."""
    x, y = numbers_of(block, matrix, b)
    return row_times(model, block.jacobian, row_at(model, b, r), vector, x, y)
