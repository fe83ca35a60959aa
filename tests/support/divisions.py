"""Rigid clusters of spheres divided into two rigid parts, up to rotations."""

from itertools import combinations, permutations

import numpy as np

from polycorner import skeleton
from polycorner.models import SphereCluster


def divisions(first, second):
    """How often a rigid cluster of spheres is two clusters in each of which all spheres touch.

    Mirror images count as different, exchanges of spheres within a part do not; those of the two
    parts neither, if they are equal.
    """
    model = SphereCluster(first + second)
    found = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    known = []
    for corner in found.corners:
        for mirror in (1, -1):
            centres = corner.point.reshape(-1, 3) * [1, 1, mirror]
            for some in combinations(range(len(centres)), first):
                rest = [k for k in range(len(centres)) if k not in some]
                parts = centres[list(some)], centres[rest]
                if all(map(touches_all, parts)) and not any(same(parts, x) for x in known):
                    known.append(parts)
    return len(known)


def touches_all(part):
    return all(abs(np.linalg.norm(a - b) - 1) < 1e-6 for a, b in combinations(part, 2))


def same(one, two):
    """Whether a rotation carries two parts to two others."""
    orders = [one] if len(one[0]) != len(one[1]) else [one, one[::-1]]
    target = np.concatenate(two)
    target = target - target.mean(axis=0)
    for parts in orders:
        for p in permutations(parts[0]):
            for q in permutations(parts[1]):
                points = np.array([*p, *q])
                points = points - points.mean(axis=0)
                u, _, vt = np.linalg.svd(points.T @ target)
                u[:, -1] *= np.sign(np.linalg.det(u @ vt))
                if np.abs(points @ u @ vt - target).max() < 1e-5:
                    return True
    return False
