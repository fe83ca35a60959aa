"""Slow, independent counts of minima: roots of polynomials, and floods of a grid."""

import itertools

import numpy as np


def minima_on_interval(polynomial, low, high):
    """Return the local minima of a polynomial on ``[low, high]``: roots of its slope, and ends.

    Also the least size of what decides: slopes at the ends, curvatures at the roots.
    """
    slope = polynomial.deriv()
    roots = slope.roots()
    inside = [r.real for r in roots if abs(r.imag) < 1e-9 and low < r.real < high]
    curvatures = [slope.deriv()(x) for x in inside]
    ends = [slope(low), slope(high)]
    found = [x for x, curvature in zip(inside, curvatures, strict=True) if curvature > 0]
    found += [low] * int(ends[0] > 0) + [high] * int(ends[1] < 0)
    room = [abs(a - b) for a, b in itertools.combinations([*inside, low, high], 2)]
    return found, min(map(abs, [*curvatures, *ends, *room]))


def flooded(heights):
    """Return where water collects on a grid, and how deep it gets before it runs over.

    ``heights`` is ``(a, b)``, infinite where there is no ground.  Cells are flooded from the
    lowest up; a component that meets a lower one ends there.  Returns ``[(cell, depth), ...]``.
    """
    shape = heights.shape
    flat = heights.ravel()
    parent = np.full(flat.size, -1)
    depths = []

    def root(k):
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    around = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    for k in np.argsort(flat, kind="stable"):
        if not np.isfinite(flat[k]):
            break
        parent[k] = k
        row, column = divmod(int(k), shape[1])
        for i, j in around:
            if not (0 <= row + i < shape[0] and 0 <= column + j < shape[1]):
                continue
            other = (row + i) * shape[1] + column + j
            if parent[other] < 0:
                continue
            one, two = root(k), root(other)
            if one != two:
                high, low = (one, two) if flat[one] >= flat[two] else (two, one)
                depths.append((divmod(int(high), shape[1]), flat[k] - flat[high]))
                parent[high] = low
    lowest = {root(int(k)) for k in np.flatnonzero(parent >= 0)}
    return [(cell, depth) for cell, depth in depths if depth > 0] + [
        (divmod(k, shape[1]), np.inf) for k in lowest
    ]


def orbit_count(points, maps):
    """Return how many orbits points fall into under maps that carry them to one another."""
    left = {tuple(p) for p in points}
    orbits = 0
    while left:
        orbits += 1
        reached = [left.pop()]
        while reached:
            p = reached.pop()
            for move in maps:
                image = tuple(move(np.array(p)))
                if image in left:
                    left.remove(image)
                    reached.append(image)
    return orbits
