"""Faces and edges of convex hulls in the plane and in space."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull

from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Facets(Value):
    """Faces of a hull with unit normals that point outwards; in the plane they are its edges.

    Attributes
    ----------
    faces : tuple of tuple of int
        The vertices of each face, counterclockwise seen from outside.
    normals : (f, d) array
    edges : tuple of (int, int, int, int)
        In space: two vertices of each edge, and the faces to its left and right, seen from
        outside on the way from the first vertex to the second.  In the plane none.
    """

    faces: tuple[tuple[int, ...], ...]
    normals: Array
    edges: tuple[tuple[int, int, int, int], ...]


def facets(points: Array) -> Facets:
    """Return faces and edges of the hull of vertices ``(k, d)``; polygons counterclockwise."""
    return _plane(points) if points.shape[1] == 2 else _space(points)


def _plane(points: Array) -> Facets:
    k = len(points)
    along = np.roll(points, -1, axis=0) - points
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Facets(tuple((i, (i + 1) % k) for i in range(k)), normals, ())


def _space(points: Array) -> Facets:
    size = float(np.ptp(points, axis=0).max())
    normals: list[Array] = []
    members: list[tuple[int, ...]] = []
    for plane in ConvexHull(points).equations:
        normal = plane[:3]
        height = points @ normal
        on = tuple(np.flatnonzero(height >= height.max() - DEFAULT.alike * size).tolist())
        # Qhull divides faces into triangles; those of one face have its vertices.
        if on not in members:
            members.append(on)
            normals.append(normal)
    faces = tuple(map(_round, members, normals, [points] * len(members)))
    left = {way: k for k, face in enumerate(faces) for way in pairwise((*face, face[0]))}
    edges = tuple((i, j, k, left[j, i]) for (i, j), k in left.items() if i < j)
    return Facets(faces, np.array(normals), edges)


def _round(members: tuple[int, ...], normal: Array, points: Array) -> tuple[int, ...]:
    """Return the vertices of a face counterclockwise around its normal."""
    away = points[list(members)] - points[list(members)].mean(axis=0)
    first = away[0] / np.linalg.norm(away[0])
    angles = np.arctan2(away @ np.cross(normal, first), away @ first)
    return tuple(members[i] for i in np.argsort(angles).tolist())
