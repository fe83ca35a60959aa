"""Distances and overlaps of rounded hulls from their definitions, slowly."""

import numpy as np
from scipy.optimize import linprog, nnls
from scipy.spatial import ConvexHull

HEAVY = 1e4


def distance(a, b):
    """The distance of the hulls of points ``(k, d)`` and ``(m, d)``; zero if they meet.

    The least ``|a x - b y|`` over weights ``x, y >= 0`` that add up to one, the sums as rows of a
    large weight; one more step, in the weights that are positive, removes what that costs.
    """
    k, m = len(a), len(b)
    size = max(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max(), np.abs(a - b.mean(axis=0)).max())
    sums = np.zeros((2, k + m))
    sums[0, :k] = sums[1, k:] = 1.0
    rows = np.vstack([np.hstack([a.T, -b.T]) / size, HEAVY * sums])
    weights, _ = nnls(rows, np.append(np.zeros(a.shape[1]), [HEAVY, HEAVY]), maxiter=1000)
    x, y = weights[:k] / weights[:k].sum(), weights[k:] / weights[k:].sum()
    first, second = a[x > 1e-12], b[y > 1e-12]
    return float(_between_flats(first, second))


def _between_flats(a, b):
    """The distance of the affine hulls of points."""
    edges = np.vstack([a[1:] - a[0], b[1:] - b[0]])
    away = a[0] - b[0]
    if len(edges):
        away = away - edges.T @ np.linalg.lstsq(edges.T, away, rcond=None)[0]
    return np.linalg.norm(away)


def depth(a, b):
    """The radius of the largest ball inside both hulls, negative by how much there is none."""
    half_spaces = np.vstack([ConvexHull(a).equations, ConvexHull(b).equations])
    d = a.shape[1]
    # normal . x + offset <= -t for all faces
    rows = np.hstack([half_spaces[:, :d], np.ones((len(half_spaces), 1))])
    bounds = [(None, None)] * (d + 1)
    found = linprog([*np.zeros(d), -1.0], A_ub=rows, b_ub=-half_spaces[:, d], bounds=bounds)
    return -found.fun


def margin(one, two):
    """How far two parts in their places are apart: the distance of rounded ones, minus a depth."""
    radius = one.radius + two.radius
    if radius == 0:
        inside = depth(one.points, two.points)
        return -inside if inside > 0 else distance(one.points, two.points)
    return distance(one.points, two.points) - radius
