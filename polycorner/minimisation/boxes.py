"""The sign of a polynomial on the surface of a box, by branch and bound."""

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array

MAX_BOXES = 20_000  # of one pass
DEPTH = 30  # halvings of a box
APART = 0.05  # distance of zeros that are told apart
ZERO = 1e-9  # of the sum of coefficients: a value that is neither positive nor negative


def least_on_box(
    exponents: NDArray[np.int64], values: Array, half: int
) -> tuple[float, Array, list[Array]]:
    """Return the sign of the least value on ``max |w| = 1`` as a number, where, and zeros.

    The number is 0 where branch and bound cannot tell; the zeros are then the middles of the boxes
    that are left.
    """
    m = exponents.shape[1]
    limit = ZERO * abs(values).sum()
    middles, widths = _sides(m, half)
    best, where = np.inf, np.ones(m)
    for _ in range(DEPTH * max(1, m - 1)):
        terms = np.prod(middles[:, None, :] ** exponents, axis=2)
        heights = terms @ values
        if heights.min() < best:
            best, where = float(heights.min()), middles[int(heights.argmin())]
        if best < -limit:
            return -1.0, where, []
        reach = np.prod((abs(middles) + widths)[:, None, :] ** exponents, axis=2)
        left = heights - (reach - abs(terms)) @ abs(values) <= limit
        if not left.any():
            return 1.0, where, []
        middles, widths = middles[left], widths[left]
        if len(middles) > MAX_BOXES or widths.max() < 2.0**-DEPTH:
            break
        middles, widths = _halved(middles, widths)
    return 0.0, where, distinct(middles)


def _sides(m: int, half: int) -> tuple[Array, Array]:
    middles, widths = [], []
    for i in range(m):
        for side in (1.0, -1.0):
            if side < 0 and i < half:
                continue
            middle, width = np.zeros(m), np.ones(m)
            middle[:half], width[:half] = 0.5, 0.5
            middle[i], width[i] = side, 0.0
            middles.append(middle)
            widths.append(width)
    return np.array(middles), np.array(widths)


def _halved(middles: Array, widths: Array) -> tuple[Array, Array]:
    rows = np.arange(len(widths))
    axis = widths.argmax(axis=1)
    widths = widths.copy()
    widths[rows, axis] /= 2
    move = np.zeros_like(widths)
    move[rows, axis] = widths[rows, axis]
    return np.vstack([middles - move, middles + move]), np.vstack([widths, widths])


def distinct(points: Array | list[Array]) -> list[Array]:
    """Return one unit direction for each cluster of points, opposite ones as one."""
    found: list[Array] = []
    left = np.array(points)
    left /= np.linalg.norm(left, axis=1)[:, None]
    while len(left):
        ray = left[0]
        found.append(ray)
        apart = np.minimum(abs(left - ray).max(axis=1), abs(left + ray).max(axis=1))
        left = left[apart > APART]
        if len(found) > 2 * len(ray) + 4:
            return []
    return found
