"""Directions in which an energy decreases while constraints grow, for whole boxes at a time.

Let ``g_0`` be the negative gradient of the energy and ``g_1, ..., g_k`` the gradients of the
functions that may vanish in a box, all enclosed on it.  If some ``v`` has ``v . g > 0`` for every
element of every enclosure, and ``dh . v = 0`` for the equations, then at each point of the box that
lies in the set, a curve in the set leaves along ``v`` and the energy decreases along it: none of
these points is stationary.  By Gordan's theorem of the alternative ([Mangasarian] sec. 2.4) such a
``v`` exists for the middles ``a_i`` of the enclosures unless 0 lies in their convex hull; with
radii ``rho_i`` in the Euclidean norm it exists if and only if the convex hull of ``a_i / rho_i``
has no point in the unit ball, and the point of the hull nearest to 0 is one.  It is found by the
algorithm of Mitchell, Dem'yanov and Malozemov [MDM], which ends as soon as it has an answer.  If
there is none in the units of the coordinates, others are tried, along which enclosures are as wide.

The search for ``v`` is ordinary floating-point arithmetic; what is verified is verified with bounds
of all rounding errors: a sum of ``n`` products is off by at most ``(n + 2) 2^-52`` times the sum of
their magnitudes, underflow excluded, which a summand of ``2^-1000`` covers ([Higham] sec. 3.1).
"""

import numpy as np

from polycorner.formulas.linking import linked
from polycorner.proofs.lists.entries import TINY, UNIT

compiled = linked()

MOST_ROUNDS = np.int64(400)
LEAST_WIDTH = 1e-4  # of enclosures along a coordinate, relative to the widest
LEAST_RADIUS = 1e-9  # relative to the gradient: nearer than this 0 counts as in the hull


@compiled
def lower_product(v, spread, low, high):
    """Return a lower bound of ``u . g`` for ``|u - v| <= spread`` and ``low <= g <= high``."""
    total, size = 0.0, 0.0
    for j in range(v.size):
        largest = max(abs(low[j]), abs(high[j]))
        part = v[j] * (low[j] if v[j] > 0.0 else high[j]) if v[j] != 0.0 else 0.0
        total += part - (spread[j] * largest if spread[j] > 0.0 else 0.0)
        size += (abs(v[j]) + spread[j]) * largest if abs(v[j]) + spread[j] > 0.0 else 0.0
    return total - (2 * v.size + 4) * UNIT * size - TINY


@compiled
def nearest(a, count, v, w, target):
    """Move ``v = sum w_i a_i`` towards the point of the convex hull that is nearest to 0.

    End when ``min a_i . v > target |v|`` (True), or when ``|v| <= target`` (False).
    """
    n = v.size
    w[:count] = 1.0 / count
    for j in range(n):
        v[j] = 0.0
        for i in range(count):
            v[j] += a[i, j] / count
    for _ in range(MOST_ROUNDS):
        square = 0.0
        for j in range(n):
            square += v[j] * v[j]
        size = np.sqrt(square)
        if size <= target:
            return False
        least, most, lowest, highest = 0, -1, np.inf, -np.inf
        for i in range(count):
            along = 0.0
            for j in range(n):
                along += a[i, j] * v[j]
            if along < lowest:
                least, lowest = i, along
            if w[i] > 0.0 and along > highest:
                most, highest = i, along
        if lowest > target * size:
            return True
        gap = highest - lowest
        if gap <= 1e-12 * square:
            return False
        apart = 0.0
        for j in range(n):
            apart += (a[most, j] - a[least, j]) ** 2
        share = min(w[most], gap / apart)
        w[most] -= share
        w[least] += share
        for j in range(n):
            v[j] += share * (a[least, j] - a[most, j])
    return False


@compiled
def orthonormal(low, high, first, scales, basis):
    """Orthonormalise the middles of the scaled gradients of the equations; False if dependent."""
    n = scales.size
    for k in range(basis.shape[0]):
        before = 0.0
        for j in range(n):
            basis[k, j] = 0.5 * (low[first + k, j] + high[first + k, j]) * scales[j]
            before += basis[k, j] ** 2
        for _ in range(2):
            for i in range(k):
                along = 0.0
                for j in range(n):
                    along += basis[i, j] * basis[k, j]
                for j in range(n):
                    basis[k, j] -= along * basis[i, j]
        size = 0.0
        for j in range(n):
            size += basis[k, j] ** 2
        if not size > 1e-20 * before:
            return False
        for j in range(n):
            basis[k, j] /= np.sqrt(size)
    return True


@compiled
def tangent_spread(low, high, first, scales, basis, v, spread):
    """Bound the change of ``v`` that makes it tangent to the equations everywhere in the box.

    With ``C`` the scaled ``basis`` as columns and ``R`` an approximate inverse of ``dh C``, the
    equation ``dh (v + C y) = 0`` has a solution with ``|y| <= |R dh v| / (1 - |I - R dh C|)`` in
    the maximum norm if the denominator is positive.  Return whether it is.
    """
    k, n = basis.shape
    middle = np.zeros((k, k))
    for i in range(k):
        for c in range(k):
            for j in range(n):
                entry = 0.5 * (low[first + i, j] + high[first + i, j])
                middle[i, c] += entry * basis[c, j] * scales[j]
    inverse = np.zeros((k, k))
    if not inverted(middle, inverse):
        return False
    defect, residual = 0.0, 0.0
    for i in range(k):
        row = 0.0
        for c in range(k):
            bound = 0.0
            for s in range(k):
                bound += abs(inverse[i, s]) * product_defect(
                    low[first + s], high[first + s], scales, basis[c], middle[s, c]
                )
            exact, size = (1.0 if i == c else 0.0), 1.0
            for s in range(k):
                exact -= inverse[i, s] * middle[s, c]
                size += abs(inverse[i, s] * middle[s, c])
            row += bound + abs(exact) + (k + 3) * UNIT * size
        defect = max(defect, row)
        along = 0.0
        for s in range(k):
            along += abs(inverse[i, s]) * magnitude(low[first + s], high[first + s], v)
        residual = max(residual, along)
    defect = defect * (1 + 16 * n * UNIT) + TINY
    if not defect < 0.9:
        return False
    reach = residual / (1 - defect) * (1 + 64 * n * UNIT) + TINY
    for j in range(n):
        total = 0.0
        for c in range(k):
            total += abs(basis[c, j]) * scales[j]
        spread[j] = total * reach * (1 + 16 * n * UNIT)
    return True


@compiled
def product_defect(low, high, scales, column, middle):
    """Bound ``|g . c - middle|`` for ``low <= g <= high`` and the scaled column ``c``."""
    radius, centre, size = 0.0, 0.0, 0.0
    for j in range(column.size):
        c = column[j] * scales[j]
        m = 0.5 * (low[j] + high[j])
        radius += abs(c) * max(high[j] - m, m - low[j])
        centre += m * c
        size += abs(m * c)
    return (radius + abs(centre - middle) + (column.size + 4) * UNIT * size) * (
        1 + 16 * column.size * UNIT
    )


@compiled
def magnitude(low, high, v):
    """Bound ``|g . v|`` for ``low <= g <= high``."""
    below, above, size = 0.0, 0.0, 0.0
    for j in range(v.size):
        if v[j] != 0.0:
            p, q = v[j] * low[j], v[j] * high[j]
            below += min(p, q)
            above += max(p, q)
            size += max(abs(p), abs(q))
    return max(abs(below), abs(above)) + (v.size + 3) * UNIT * size + TINY


@compiled
def inverted(a, inverse):
    """Invert a small matrix by elimination with pivots; False where it is singular."""
    k = a.shape[0]
    left = a.copy()
    for i in range(k):
        inverse[i, i] = 1.0
    for c in range(k):
        p = c
        for i in range(c + 1, k):
            if abs(left[i, c]) > abs(left[p, c]):
                p = i
        if not abs(left[p, c]) > 0.0:
            return False
        for j in range(k):
            left[c, j], left[p, j] = left[p, j], left[c, j]
            inverse[c, j], inverse[p, j] = inverse[p, j], inverse[c, j]
        pivot = left[c, c]
        for j in range(k):
            left[c, j] /= pivot
            inverse[c, j] /= pivot
        for i in range(k):
            if i != c:
                factor = left[i, c]
                for j in range(k):
                    left[i, j] -= factor * left[c, j]
                    inverse[i, j] -= factor * inverse[c, j]
    return True


@compiled
def adapted(low, high, rows, count, scales, units):
    """Set units in which the enclosures are about as wide along each coordinate.

    A ball in these units then holds little more than the enclosures.  Widths count relative to the
    length of their gradient.
    """
    n, widest = scales.size, 0.0
    units[:] = 0.0
    for i in range(count):
        size = TINY
        for j in range(n):
            size += (0.5 * (low[rows[i], j] + high[rows[i], j]) * scales[j]) ** 2
        for j in range(n):
            width = 0.5 * (high[rows[i], j] - low[rows[i], j]) * scales[j] / np.sqrt(size)
            units[j] = max(units[j], width)
            widest = max(widest, width)
    for j in range(n):
        units[j] = scales[j] / (units[j] + LEAST_WIDTH * widest + TINY)


@compiled
def one(low, high, mask, equations, scales, energy_sign, a, rho, rows, basis, v, spread, w, units):
    """Find and verify a direction for one box and branch; see :func:`directions`.

    In the units that are given, or else in units that are adapted to the enclosures.
    """
    if attempt(low, high, mask, equations, scales, energy_sign, a, rho, rows, basis, v, spread, w):
        return True
    count = np.int64(energy_sign != 0.0)
    for k in range(mask.size):
        count += mask[k]
    if count < 2:
        return False
    adapted(low, high, rows, count, scales, units)
    return attempt(
        low, high, mask, equations, units, energy_sign, a, rho, rows, basis, v, spread, w
    )


@compiled
def attempt(low, high, mask, equations, scales, energy_sign, a, rho, rows, basis, v, spread, w):
    """Find and verify a direction that is nearly as far as possible from failing, in some units."""
    m, n = mask.size, scales.size
    if equations and not orthonormal(low, high, m, scales, basis):
        return False
    count = 0
    for k in range(m + 1):
        row = m + equations if k == m else k
        if (k < m and not mask[k]) or (k == m and energy_sign == 0.0):
            continue
        sign = energy_sign if k == m else 1.0
        size, radius = 0.0, 0.0
        for j in range(n):
            a[count, j] = sign * 0.5 * (low[row, j] + high[row, j]) * scales[j]
            radius += (0.5 * (high[row, j] - low[row, j]) * scales[j]) ** 2
            size += a[count, j] ** 2
        if not (radius < np.inf and size < np.inf):
            return False
        for i in range(equations):
            along = 0.0
            for j in range(n):
                along += a[count, j] * basis[i, j]
            for j in range(n):
                a[count, j] -= along * basis[i, j]
        rho[count] = np.sqrt(radius) + LEAST_RADIUS * np.sqrt(size) + TINY
        for j in range(n):
            a[count, j] /= rho[count]
        rows[count] = row
        count += 1
    if count == 0:
        return True
    found = nearest(a, count, v, w, 1.0)
    for k in range(count):
        w[k] /= rho[k]
    if not found:
        return False
    largest = 0.0
    for j in range(n):
        largest = max(largest, abs(v[j]))
    for j in range(n):
        v[j] = float(np.float32(v[j] / largest * scales[j]))  # as it is stored
        spread[j] = 0.0
    if equations and not tangent_spread(low, high, m, scales, basis, v, spread):
        return False
    for k in range(count):
        if k == count - 1 and energy_sign < 0.0:
            bound = lower_product(-v, spread, low[rows[k]], high[rows[k]])
        else:
            bound = lower_product(v, spread, low[rows[k]], high[rows[k]])
        if not bound > 0.0:
            return False
    return True
