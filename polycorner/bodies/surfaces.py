"""Outlines and surfaces of parts: polygons in the plane, triangles in space."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from polycorner.bodies.shapes import Part
from polycorner.spaces.manifold import Array

ARC = 65  # points of a full circle of an outline
BALL = 300  # points of a ball
RING = 32  # points around a capsule

Triangles = tuple[Array, NDArray[np.int64], Array]


def outline(part: Part, wider: float = 0.0) -> Array:
    """Return the hull of circles around the points, counterclockwise ``(k, 2)``.

    ``wider`` is added to the radius.
    """
    radius = part.radius + wider
    if radius == 0:
        return part.points
    angles = np.linspace(0, math.tau, ARC)
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    cloud = (part.points[:, None] + circle).reshape(-1, 2)
    return np.asarray(cloud[ConvexHull(cloud).vertices])


def surface(part: Part) -> Triangles:
    """Return vertices ``(V, 3)``, outward triangles ``(F, 3)`` and unit normals ``(V, 3)``.

    Normals are those of the true surface: smooth where it is, and of one face each at sharp edges.
    """
    if part.radius == 0:
        return _faces(part)
    around = _directions(part)
    cloud = (part.points[:, None] + part.radius * around).reshape(-1, 3)
    normals = np.tile(around, (len(part.points), 1))
    hull = ConvexHull(cloud)
    used, faces = np.unique(hull.simplices, return_inverse=True)
    corners = cloud[hull.simplices]
    inwards = np.einsum("fi,fi->f", _across(corners), hull.equations[:, :3]) < 0
    faces = faces.reshape(-1, 3).astype(np.int64)
    faces[inwards] = faces[inwards, ::-1]
    return cloud[used], faces, normals[used]


def flat(part: Part) -> Triangles:
    """Return the triangles of a part of the plane, at the height zero, as :func:`surface` does."""
    rim = outline(part)
    k = np.arange(1, len(rim) - 1)
    vertices = np.column_stack([rim, np.zeros(len(rim))])
    return vertices, np.column_stack([0 * k, k, k + 1]), np.tile([0.0, 0.0, 1.0], (len(rim), 1))


def joined(several: list[Triangles]) -> Triangles:
    """Return triangles together, in one array each."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _, _ in several)])
    faces = [some + start for (_, some, _), start in zip(several, starts, strict=False)]
    vertices, normals = ([one[k] for one in several] for k in (0, 2))
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(normals)


def _faces(part: Part) -> Triangles:
    assert part.facets is not None, "one point or two have a radius"
    made = []
    for face, normal in zip(part.facets.faces, part.facets.normals, strict=True):
        k = np.arange(1, len(face) - 1)
        corners = part.points[list(face)]
        made.append((corners, np.column_stack([0 * k, k, k + 1]), np.tile(normal, (len(face), 1))))
    return joined(made)


def _directions(part: Part) -> Array:
    """Return unit vectors: along a spiral, and those in which the surface has flat parts."""
    k = np.arange(BALL) + 0.5
    height, angle = 1 - 2 * k / BALL, k * math.pi * (3 - math.sqrt(5))
    width = np.sqrt(1 - height**2)
    spiral = np.column_stack([width * np.cos(angle), width * np.sin(angle), height])
    if part.facets is not None:
        return np.concatenate([part.facets.normals, spiral])
    if len(part.points) == 1:
        return spiral
    along = part.points[1] - part.points[0]
    first = np.cross(along, np.eye(3)[np.argmin(abs(along))])
    second = np.cross(along, first)
    turn = np.linspace(0, math.tau, RING, endpoint=False)[:, None]
    sides = [one / np.linalg.norm(one) for one in (first, second)]
    return np.concatenate([np.cos(turn) * sides[0] + np.sin(turn) * sides[1], spiral])


def _across(corners: Array) -> Array:
    """Return a normal of each triangle ``(f, 3, 3)``, twice its area long."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
