"""Mass, centre of mass and inertia of bodies of uniform density.

A rounded polygon consists of the polygon, a rectangle on every edge and a sector of a circle at
every vertex; a capsule in space of a cylinder and two half balls.  A rounded polyhedron consists of
the polyhedron, a prism on every face, a sector of a cylinder at every edge, and at every vertex the
part of a ball whose directions ``n`` are normals there.  These are a spherical polygon: its area is
the angle by which the faces miss ``2 pi`` at the vertex.  The tangential part of a constant vector
``e`` has the divergence ``-2 n.e`` on the sphere, and ``n_i`` times it ``e_i - 3 n_i n.e``, so that
the integrals of ``n`` and ``n n^T`` over the polygon are integrals along its sides, which are arcs.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from polycorner import checks
from polycorner.bodies.shapes import Body, Part
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked


@dataclass(frozen=True, eq=False)
class Mass(Checked):
    """How a rigid body resists forces and torques.

    Parameters
    ----------
    mass : float
    centre : (d,) array
        The centre of mass, in coordinates of the body.
    inertia : float or (3, 3) array
        Moment of inertia about the centre of mass: in the plane a number; in space the matrix in
        the axes of the body, or three principal moments about these.

    Raises
    ------
    ValueError
        For a mass that is not positive, and for moments that no body has: in space each principal
        moment is at most the sum of the others.
    """

    mass: float
    centre: Array
    inertia: Any = field(default=0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", checks.real("mass", self.mass, above=0))
        centre = checks.numbers("centre", self.centre, "2 or 3 numbers")
        if centre.shape not in {(2,), (3,)} or not np.isfinite(centre).all():
            refuse("centre", "2 or 3 finite numbers", self.centre)
        object.__setattr__(self, "centre", centre)
        if len(centre) == 2:
            inertia = checks.real("inertia", self.inertia, above=0)
            object.__setattr__(self, "inertia", inertia)
        else:
            object.__setattr__(self, "inertia", _tensor(self.inertia))
        super().__post_init__()


def _tensor(given: Any) -> Array:
    """Return a matrix of inertia ``(3, 3)``, or raise."""
    expected = "three moments or a symmetric 3 x 3 matrix"
    matrix = checks.numbers("inertia", given, expected)
    matrix = np.diag(matrix) if matrix.shape == (3,) else matrix
    if matrix.shape != (3, 3) or not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0):
        refuse("inertia", expected, given)
    low, middle, high = np.linalg.eigvalsh(matrix)
    if low <= 0 or high > (low + middle) * (1 + 1e-9):
        moments = ", ".join(f"{x:.6g}" for x in (low, middle, high))
        msg = (
            "inertia: expected positive principal moments, none larger than the sum of the others; "
            f"got {moments}"
        )
        raise ValueError(msg)
    return (matrix + matrix.T) / 2


@checked
def mass_of(body: Body, density: float = 1.0) -> Mass:
    """Return the mass of a body of uniform density, per area in the plane or volume in space.

    Parts that overlap count twice.
    """
    density = checks.real("density", density, above=0)
    pieces = [piece for part in body.parts.values() for piece in _pieces(part)]
    mass = sum(piece.amount for piece in pieces)
    centre = np.asarray(sum(piece.amount * piece.centre for piece in pieces)) / mass
    second = np.zeros((len(centre), len(centre)))
    for piece in pieces:
        away = piece.centre - centre
        second += piece.second + piece.amount * np.outer(away, away)
    second = (second + second.T) / 2  # where moments cancel, rounding errors need not
    inertia = np.trace(second) * np.eye(len(centre)) - second
    planar = len(centre) == 2
    with checks.about("density"):
        return Mass(density * mass, centre, density * (np.trace(second) if planar else inertia))


def stated_mass(name: str, body: Body, masses: Mapping[str, Any], density: float) -> Mass:
    """Return the mass of a body: as stated, of a uniform body of that mass, or of the density."""
    if name not in masses:
        return mass_of(body, density)
    mass = masses[name]
    if isinstance(mass, Real) and not isinstance(mass, bool):
        whole = checks.real(f"masses[{name!r}]", mass, above=0)
        return mass_of(body, whole / mass_of(body).mass)
    if not isinstance(mass, Mass):
        expected = "a number, or a Mass, such as Mass(1.0, [0.0, 0.0], 0.5)"
        refuse(f"masses[{name!r}]", expected, mass, TypeError)
    if len(mass.centre) != body.dimension:
        refuse(f"masses[{name!r}]", f"a centre of {body.dimension} numbers", mass)
    return mass


@dataclass(frozen=True)
class _Piece:
    """Area or volume, centroid, and second moments ``(d, d)`` about it: integrals of ``x x^T``."""

    amount: float
    centre: Array
    second: Array


def _pieces(part: Part) -> Iterator[_Piece]:
    if part.dimension == 2:
        yield from _planar(part)
    elif len(part.points) <= 2:
        yield _rod(part)
    else:
        yield from _polyhedral(part)


def _planar(part: Part) -> Iterator[_Piece]:
    points, r = part.points, part.radius
    for i in range(1, len(points) - 1):
        yield _simplex(points[[0, i, i + 1]])
    if r == 0:
        return
    if len(points) == 1:
        yield _Piece(math.pi * r**2, points[0], np.eye(2) * math.pi * r**4 / 4)
        return
    after = np.roll(points, -1, axis=0) - points
    for start, along in zip(points, after, strict=True):
        length = float(np.linalg.norm(along))
        t = along / length
        n = np.array([t[1], -t[0]])
        second = (np.outer(t, t) * length**2 + np.outer(n, n) * r**2) * length * r / 12
        yield _Piece(length * r, start + along / 2 + n * r / 2, second)
    ways = np.arctan2(after[:, 1], after[:, 0])
    for point, before, way in zip(points, np.roll(ways, 1), ways, strict=True):
        angle = (way - before) % math.tau
        bisector = before + angle / 2 - math.pi / 2
        yield _sector(point, r, angle, np.array([math.cos(bisector), math.sin(bisector)]))


def _sector(apex: Array, r: float, angle: float, b: Array) -> _Piece:
    """Return a sector of a circle about the direction ``b``."""
    area = angle * r**2 / 2
    away = 4 * r * math.sin(angle / 2) / (3 * angle)
    c = np.array([-b[1], b[0]])
    along, across = (r**4 / 8 * (angle + side * math.sin(angle)) for side in (1, -1))
    about_apex = np.outer(b, b) * along + np.outer(c, c) * across
    return _Piece(area, apex + away * b, about_apex - area * away**2 * np.outer(b, b))


def _simplex(corners: Array) -> _Piece:
    """Return a triangle or tetrahedron.

    The integral of ``x x^T`` about the centroid is ``V / ((d + 1) (d + 2))`` times its sum over the
    corners.
    """
    d = corners.shape[1]
    amount = abs(float(np.linalg.det(corners[1:] - corners[0]))) / math.factorial(d)
    centre = corners.mean(axis=0)
    away = corners - centre
    return _Piece(amount, centre, amount / ((d + 1) * (d + 2)) * away.T @ away)


def _rod(part: Part) -> _Piece:
    """Return a ball or a capsule in space."""
    r, points = part.radius, part.points
    ball = 4 * math.pi * r**3 / 3
    if len(points) == 1:
        return _Piece(ball, points[0], np.eye(3) * ball * r**2 / 5)
    along = points[1] - points[0]
    length = float(np.linalg.norm(along))
    u = along / length
    tube = math.pi * r**2 * length
    # The half balls' centroids are 3 r / 8 outside of the ends of the tube.
    axial = tube * length**2 / 12 + ball * (r**2 / 5 + length**2 / 4 + 3 * r * length / 8)
    radial = tube * r**2 / 4 + ball * r**2 / 5
    uu = np.outer(u, u)
    return _Piece(tube + ball, points.mean(axis=0), axial * uu + radial * (np.eye(3) - uu))


def _polyhedral(part: Part) -> Iterator[_Piece]:
    points, r, hull = part.points, part.radius, ConvexHull(part.points)
    middle, normals = points.mean(axis=0), hull.equations[:, :3]
    for triangle, n in zip(hull.simplices, normals, strict=True):
        yield _simplex(np.vstack([middle, points[triangle]]))
        if r > 0:
            yield _prism(points[triangle], r * n)
    if r == 0:
        return
    missing, first = np.full(len(points), math.tau), np.zeros_like(points)
    second = np.zeros((len(points), 3, 3))
    for face, triangle in enumerate(hull.simplices):
        for k, vertex in enumerate(triangle):
            a, b = np.delete(triangle, k)
            missing[vertex] -= _angle(points[a] - points[vertex], points[b] - points[vertex])
            other = hull.neighbors[face, k]  # across the side from a to b
            turn = _angle(normals[face], normals[other])
            if face < other and turn > DEFAULT.alike:
                both, along = normals[face] + normals[other], _unit(points[b] - points[a])
                yield _wedge(points[a], points[b], r, turn, _unit(both))
                for end, outward in ((a, along), (b, -along)):
                    first[end] -= turn / 2 * outward
                    second[end] -= math.tan(turn / 2) * np.outer(both, outward)
    for k, angle in enumerate(missing):
        amount = angle * r**3 / 3
        away, about = r**4 / 4 * first[k] / amount, r**5 / 15 * (angle * np.eye(3) + second[k])
        yield _Piece(amount, points[k] + away, about - amount * np.outer(away, away))


def _unit(u: Array) -> Array:
    return np.asarray(u / np.linalg.norm(u))


def _angle(u: Array, v: Array) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(u, v))), float(u @ v))


def _prism(corners: Array, up: Array) -> _Piece:
    """Return a prism on a triangle, of a height and direction normal to it."""
    area = float(np.linalg.norm(np.cross(*(corners[1:] - corners[0])))) / 2
    amount, centre = area * float(np.linalg.norm(up)), corners.mean(axis=0)
    away = corners - centre
    return _Piece(amount, centre + up / 2, amount / 12 * (away.T @ away + np.outer(up, up)))


def _wedge(start: Array, end: Array, r: float, angle: float, b: Array) -> _Piece:
    """Return the sector of a cylinder around a line, about the direction ``b``."""
    length, u = float(np.linalg.norm(end - start)), _unit(end - start)
    sector = _sector(np.zeros(2), r, angle, np.array([1.0, 0.0]))
    plane = np.array([b, np.cross(u, b)])
    amount = sector.amount * length
    second = length * plane.T @ sector.second @ plane + amount * length**2 / 12 * np.outer(u, u)
    return _Piece(amount, (start + end) / 2 + sector.centre @ plane, second)
