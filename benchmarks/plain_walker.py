"""Rigid sphere clusters by a plain walk: NumPy, fixed steps, no event detection by derivatives.

Written without the package, after the description in M. Holmes-Cerfon, SIAM Review 58 (2016),
sec. 2: break a contact, follow the one-dimensional motion in fixed steps with Newton corrections,
stop at the first contact that closes, keep new clusters.  Clusters are distinguished by their
sorted distances.  A contact that touches without closing may be stepped over.
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STEP = 0.05
CLOSE = 1e-6


def clusters(count: int) -> list[Array]:
    """Return the rigid clusters reached from a stack of tetrahedra."""
    pairs = np.array(list(combinations(range(count), 2)))
    found = [stack(count)]
    keys = [key(found[0], pairs)]
    queue = list(found)
    while queue:
        x = queue.pop()
        touching = np.flatnonzero(gaps(x, pairs) < CLOSE)
        for broken in touching:
            y = walk(x, pairs, touching[touching != broken], broken)
            if y is not None and all(abs(key(y, pairs) - k).max() > 1e-4 for k in keys):
                found.append(y)
                keys.append(key(y, pairs))
                queue.append(y)
    return found


def walk(x: Array, pairs: Indices, kept: Indices, broken: int) -> Array | None:
    """Follow the motion that opens one contact; return where the next contact closes."""
    others = np.setdiff1d(np.arange(len(pairs)), kept)
    direction = null_direction(x, pairs, kept)
    if direction is None:
        return None
    opening = rows(x, pairs[[broken]])[0] @ direction
    direction *= np.sign(opening)
    for step in range(2000):
        y = newton(x + STEP * direction, pairs[kept])
        free = others if step else np.setdiff1d(others, [broken])
        closed = free[gaps(y, pairs[free]) < 0]
        if len(closed):
            return bisect(x, y, pairs, kept, closed)
        following = null_direction(y, pairs, kept)
        if following is None:
            return None
        direction = following * np.sign(following @ direction)
        x = y
    return None


def bisect(x: Array, y: Array, pairs: Indices, kept: Indices, closed: Indices) -> Array:
    """Return where the first of some contacts closes between two points."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        z = newton(x + middle * (y - x), pairs[kept])
        low, high = (low, middle) if gaps(z, pairs[closed]).min() < 0 else (middle, high)
    z = newton(x + low * (y - x), pairs[kept])
    return newton(z, pairs[np.flatnonzero(gaps(z, pairs) < CLOSE)])


def gaps(x: Array, pairs: Indices) -> Array:
    """Return distances minus one."""
    c = x.reshape(-1, 3)
    return np.linalg.norm(c[pairs[:, 0]] - c[pairs[:, 1]], axis=1) - 1


def rows(x: Array, pairs: Indices) -> Array:
    """Return the gradients of the gaps."""
    c = x.reshape(-1, 3)
    d = c[pairs[:, 0]] - c[pairs[:, 1]]
    d /= np.linalg.norm(d, axis=1)[:, None]
    out = np.zeros((len(pairs), len(c), 3))
    index = np.arange(len(pairs))
    out[index, pairs[:, 0]], out[index, pairs[:, 1]] = d, -d
    return out.reshape(len(pairs), -1)


def rigid(x: Array) -> Array:
    """Return the rigid motions."""
    c = x.reshape(-1, 3)
    axes = np.eye(3)
    shifts = [np.tile(e, len(c)) for e in axes]
    turns = [np.cross(e, c).ravel() for e in axes]
    return np.array(shifts + turns)


def null_direction(x: Array, pairs: Indices, kept: Indices) -> Array | None:
    """Return the motion that keeps some contacts, or None if there is not exactly one."""
    _, singular, right = np.linalg.svd(np.vstack([rows(x, pairs[kept]), rigid(x)]))
    rank = int((singular > 1e-8 * singular[0]).sum())
    return right[-1] if rank == len(x) - 1 else None


def newton(x: Array, pairs: Indices) -> Array:
    """Return the nearest point where all gaps of some pairs vanish."""
    for _ in range(20):
        value = gaps(x, pairs)
        if abs(value).max() < 1e-13:
            break
        x = x - np.linalg.lstsq(rows(x, pairs), value, rcond=None)[0]
    return x


def key(x: Array, pairs: Indices) -> Array:
    """Return the sorted distances."""
    return np.sort(gaps(x, pairs))


def stack(count: int) -> Array:
    """Return tetrahedra glued in a row: a rigid cluster for every count."""
    h = np.sqrt(2 / 3)
    c = [np.zeros(3), np.array([1.0, 0, 0]), np.array([0.5, np.sqrt(3) / 2, 0])]
    c.append(np.array([0.5, np.sqrt(3) / 6, h]))
    while len(c) < count:
        c.append(2 * sum(c[-3:]) / 3 - c[-4])
    return np.concatenate(c[:count])
