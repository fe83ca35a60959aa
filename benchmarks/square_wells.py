"""Six spheres with square wells, by a plain Metropolis chain: the sticky limit from its definition.

Two spheres touch where ``0 <= |x|^2 - 1 <= width``; each contact has the factor ``kappa / width``,
and states with fewer than ten contacts are rejected.  Shares of states with twelve, eleven and ten
contacts are those of ``kappa^12 Z_0, kappa^11 Z_1, kappa^10 Z_2``, up to the order of the width.
"""

import math

import numba
import numpy as np
from numpy.typing import NDArray

from polycorner.measures.estimates import series_mean

LEAST = 10


@numba.njit  # type: ignore[untyped-decorator]
def turn(
    x: NDArray[np.float64], i: int, j: int, k: int, angle: float, y: NDArray[np.float64]
) -> None:
    """Write the place of a sphere after a turn about the line through two others."""
    u, v = x[k] - x[j], x[i] - x[j]
    u /= math.sqrt((u**2).sum())
    c, s, along = math.cos(angle), math.sin(angle), (u * v).sum() * (1 - math.cos(angle))
    y[0] = x[j, 0] + c * v[0] + s * (u[1] * v[2] - u[2] * v[1]) + along * u[0]
    y[1] = x[j, 1] + c * v[1] + s * (u[2] * v[0] - u[0] * v[2]) + along * u[1]
    y[2] = x[j, 2] + c * v[2] + s * (u[0] * v[1] - u[1] * v[0]) + along * u[2]


@numba.njit  # type: ignore[untyped-decorator]
def meets(
    x: NDArray[np.float64], i: int, y: NDArray[np.float64], width: float, new: NDArray[np.bool_]
) -> bool:
    """Write which others a sphere touches at a place; return whether it overlaps none."""
    for j in range(len(x)):
        gap = ((y - x[j]) ** 2).sum() - 1
        if j != i and gap < 0:
            return False
        new[j] = j != i and gap <= width
    return True


@numba.njit  # type: ignore[untyped-decorator]
def chain(
    x: NDArray[np.float64],
    width: float,
    factor: float,
    steps: int,
    rng: np.random.Generator,
    blocks: int,
) -> NDArray[np.int64]:
    """Return how many states had twelve, eleven and ten contacts in each of some blocks.

    One sphere is moved along an axis, or turned about the line through two others; lengths and
    angles are of all sizes from that of the well on.
    """
    n, touching = len(x), np.zeros((len(x), len(x)), np.bool_)
    new, y = np.empty(n, np.bool_), np.empty(3)
    for i in range(n):
        meets(x, i, x[i], width, touching[i])
    count = touching.sum() // 2
    counts = np.zeros((blocks, 3), np.int64)
    for step in range(steps):
        i, j, k = rng.integers(0, n), rng.integers(0, n), rng.integers(0, n)
        size = width / 10 * (20 / width) ** rng.random() * rng.normal()
        if i in (j, k) or j == k:
            y[:] = x[i]
            y[rng.integers(0, 3)] += size
        else:
            turn(x, i, j, k, size, y)
        if meets(x, i, y, width, new):
            change = new.sum() - touching[i].sum()
            if count + change >= LEAST and rng.random() < factor**change:
                touching[i], touching[:, i], x[i] = new, new, y
                count += change
        counts[step * blocks // steps, max(0, 12 - count)] += 1
    return counts


def ratios(width: float, steps: int, kappa: float = 15.0, seed: int = 1) -> dict[str, float]:
    """Return ``Z_1 / Z_0`` and ``Z_2 / Z_0`` of wells of a width, with their errors."""
    from polycorner.models import SphereCluster

    start = SphereCluster(6).stacked().reshape(6, 3) * (1 + width / 8)
    blocks = 100
    rng = np.random.default_rng(seed)
    counts = chain(start, width, kappa / width, steps, rng, blocks)[blocks // 10 :].astype(float)
    row = {"width": width, "steps": steps}
    for k in (1, 2):
        value = kappa**k * counts[:, k].sum() / counts[:, 0].sum()
        away = kappa**k * counts[:, k] - value * counts[:, 0]
        error = series_mean(away[None]).error / counts[:, 0].mean()
        row |= {f"Z{k}/Z0": value, f"error {k}": error}
    return row
