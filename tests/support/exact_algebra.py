"""Linear algebra with fractions: plain elimination, nothing rounded."""

from fractions import Fraction
from math import lcm

ZERO = Fraction(0)


def reduced(rows):
    """Return the reduced row echelon form and its pivot columns."""
    rows, pivots = [list(row) for row in rows], []
    width = len(rows[0]) if rows else 0
    for column in range(width):
        top = len(pivots)
        found = next((i for i in range(top, len(rows)) if rows[i][column]), None)
        if found is None:
            continue
        rows[top], rows[found] = rows[found], rows[top]
        rows[top] = [x / rows[top][column] for x in rows[top]]
        for i in range(len(rows)):
            if i != top and rows[i][column]:
                rows[i] = [x - rows[i][column] * y for x, y in zip(rows[i], rows[top], strict=True)]
        pivots.append(column)
    return rows, pivots


def null_space(rows, n):
    """Return a basis of what the rows annihilate."""
    form, pivots = reduced(rows)
    basis = []
    for free in (k for k in range(n) if k not in pivots):
        vector = [Fraction(int(k == free)) for k in range(n)]
        for row, pivot in zip(form, pivots, strict=False):
            vector[pivot] = -row[free]
        basis.append(vector)
    return basis


def solved(matrix, right):
    """Return one solution, whether it is the only one; None where there is none."""
    width = len(matrix[0])
    form, pivots = reduced([[*row, b] for row, b in zip(matrix, right, strict=True)])
    if width in pivots:
        return None
    x = [ZERO] * width
    for row, pivot in zip(form, pivots, strict=False):
        x[pivot] = row[width]
    return x, len(pivots) == width


def applied(matrix, x):
    return [sum((a * b for a, b in zip(row, x, strict=True)), ZERO) for row in matrix]


def restricted(form, basis):
    images = [applied(form, v) for v in basis]
    return [[sum((a * b for a, b in zip(u, w, strict=True)), ZERO) for w in images] for u in basis]


def inertia(form):
    """Return how many positive and negative directions a symmetric form has, by congruences."""
    rows = [list(row) for row in form]
    positive = negative = 0
    while rows:
        k = next((i for i in range(len(rows)) if rows[i][i]), None)
        if k is None:
            pair = next(
                ((i, j) for i, row in enumerate(rows) for j, x in enumerate(row) if x), None
            )
            if pair is None:
                break
            i, j = pair
            rows[i] = [x + y for x, y in zip(rows[i], rows[j], strict=True)]
            for row in rows:
                row[i] += row[j]
            k = i
        pivot = rows[k][k]
        positive, negative = positive + (pivot > 0), negative + (pivot < 0)
        rows = [
            [rows[i][j] - rows[i][k] * rows[k][j] / pivot for j in range(len(rows)) if j != k]
            for i in range(len(rows))
            if i != k
        ]
    return positive, negative


def combined(basis, weights):
    return [
        sum((w * v[i] for w, v in zip(weights, basis, strict=True)), ZERO)
        for i in range(len(basis[0]))
    ]


def span(row, bounds):
    """Return the range of a linear form on a box."""
    ends = [sorted((a * lower, a * upper)) for a, (lower, upper) in zip(row, bounds, strict=True)]
    return sum((e[0] for e in ends), ZERO), sum((e[1] for e in ends), ZERO)


def whole(vector):
    """Return the shortest multiple of a vector with whole entries."""
    common = lcm(*(x.denominator for x in vector))
    return tuple(x * common for x in vector)
