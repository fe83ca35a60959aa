"""Rods in the plane, as segments with a radius: distances from their definitions."""

import numpy as np


def of_point(p, a, b):
    """Distance of points from segments."""
    u = b - a
    t = np.clip(((p - a) * u).sum(-1) / (u * u).sum(-1), 0, 1)
    return np.linalg.norm(p - a - t[..., None] * u, axis=-1)


def beside(a, b, p):
    u, v = b - a, p - a
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def distance(one, other, half):
    """Distance of the axes of two rods at ``x, y, angle``, 0 where they cross."""
    ends = []
    for q in (one, other):
        along = half * np.stack([np.cos(q[..., 2]), np.sin(q[..., 2])], axis=-1)
        ends += [q[..., :2] - along, q[..., :2] + along]
    a, b, c, d = np.broadcast_arrays(*ends)
    least = np.min([of_point(a, c, d), of_point(b, c, d), of_point(c, a, b), of_point(d, a, b)], 0)
    crossed = (beside(a, b, c) * beside(a, b, d) < 0) & (beside(c, d, a) * beside(c, d, b) < 0)
    return np.where(crossed, 0.0, least)
