"""Rigid bodies: unions of rounded convex hulls, in the plane and in space.

A part is the set of points within ``radius`` of the convex hull of a few ``points``: a disc or a
ball about one point, a capsule about two, a convex polygon or polyhedron, rounded or not.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from polycorner import checks
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.printing import few
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, Value, cached_property

Turn = float | Rotation


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
    """Return faces of a polyhedron: triangles of Qhull, joined with the next ones in their plane.

    Two triangles are in one plane if neither's last corner is off the plane of the other.  They
    are compared side by side, so that faces that are nearly flat are divided one way or another.
    """
    hull, size = ConvexHull(points), float(np.ptp(points, axis=0).max())
    heights = hull.equations[:, :3] @ points.T + hull.equations[:, 3:]
    heights -= heights.max(axis=1, keepdims=True)
    first = list(range(len(heights)))  # of the triangles of a face the one with the least number

    def root(k: int) -> int:
        while first[k] != k:
            k = first[k]
        return k

    for k, beside in enumerate(hull.neighbors.tolist()):
        for other in beside:
            off = min(
                heights[k][hull.simplices[other]].min(), heights[other][hull.simplices[k]].min()
            )
            if off >= -DEFAULT.alike * size:
                first[max(root(k), root(other))] = min(root(k), root(other))
    roots = [root(k) for k in range(len(heights))]
    starts = [*dict.fromkeys(roots)]
    normals = hull.equations[starts, :3]
    members = [
        tuple(
            sorted(
                {
                    i
                    for k, t in zip(roots, hull.simplices.tolist(), strict=True)
                    if k == s
                    for i in t
                }
            )
        )
        for s in starts
    ]
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


def hull_distance(first: Array, second: Array) -> float:
    """Return the distance of the hulls of points ``(k, d)`` and ``(l, d)``.

    With the differences ``p`` of vertices, ``sum_i x_i p_i`` divided by ``sum_i x_i`` is the least
    where ``|sum_i x_i p_i|^2 + (sum_i x_i - 1)^2`` is, over all ``x >= 0`` ([LawsonHanson] ch. 23).
    """
    from scipy.optimize import nnls

    differences = (first[:, None] - second).reshape(-1, first.shape[1])
    size = float(abs(differences).max()) or 1.0
    rows = np.vstack([differences.T / size, np.ones(len(differences))])
    weights, _ = nnls(rows, np.append(np.zeros(first.shape[1]), 1.0))
    return float(np.linalg.norm(differences.T @ weights)) / float(weights.sum())


@dataclass(frozen=True, eq=False)
class Part(Checked):
    """The points within ``radius`` of the convex hull of ``points``.

    Attributes
    ----------
    points : (k, d) array
        One point, two, or the vertices of a hull that has an interior; in the plane they go
        round counterclockwise.
    radius : float
        At least zero; positive for one point or two.
    """

    points: Array
    radius: float

    @property
    def dimension(self) -> int:
        """The dimension ``d`` of the space around it, 2 or 3."""
        return int(self.points.shape[1])

    @cached_property
    def facets(self) -> Facets | None:
        """The faces and edges of the hull; None for one point or two."""
        return facets(self.points) if len(self.points) > 2 else None

    @cached_property
    def thickness(self) -> float:
        """Half its least width across a face, with the radius."""
        if self.facets is None:
            return self.radius
        heights = self.points @ self.facets.normals.T
        return self.radius + float(np.ptp(heights, axis=0).min()) / 2

    @property
    def described(self) -> str:
        """The shape in words."""
        k, plane = len(self.points), self.dimension == 2
        if k == 1:
            return f"{'disc' if plane else 'ball'} of radius {self.radius:g}"
        if k == 2:
            return f"capsule of radius {self.radius:g}"
        rounded = f", rounded by {self.radius:g}" if self.radius else ""
        return f"{'polygon' if plane else 'polyhedron'} of {k} vertices{rounded}"

    def moved(self, by: Array, matrix: Array) -> "Part":
        """Return it turned about the origin, then shifted."""
        return Part(self.points @ matrix.T + by, self.radius)


@dataclass(frozen=True, eq=False)
class Body(Checked):
    """A rigid body: the union of its parts, in coordinates of its own.

    :func:`disc`, :func:`capsule`, :func:`polygon`, :func:`sphere`, :func:`polytope` and
    :func:`compound` make bodies.  A placement turns the body about its origin and shifts it.

    Attributes
    ----------
    parts : mapping from str to Part
        By name; the only part of a simple body has the name ``""``.
    """

    parts: dict[str, Part]

    def __repr__(self) -> str:
        """Return the shape in words."""
        return f"Body({self.described})"

    @property
    def described(self) -> str:
        """The shape in words."""
        shapes = [part.described for part in self.parts.values()]
        return shapes[0] if len(shapes) == 1 else f"{len(shapes)} parts: {few(shapes)}"

    @property
    def dimension(self) -> int:
        """The dimension of the space around it, 2 or 3."""
        return next(iter(self.parts.values())).dimension

    @cached_property
    def size(self) -> float:
        """The radius of the smallest ball about the origin that contains it."""
        return max(
            float(np.linalg.norm(part.points, axis=1).max()) + part.radius
            for part in self.parts.values()
        )

    @cached_property
    def markers(self) -> Array:
        """The points of all parts, ``(m, d)``."""
        return np.concatenate([part.points for part in self.parts.values()])

    @cached_property
    def axis(self) -> Array | None:
        """A unit vector along the line through the origin that contains all points, or None.

        The body is a surface of revolution about this line.  All points at the origin: zero.  It
        leads to the first of the farthest points, those of equal length but for rounding.
        """
        lengths = np.linalg.norm(self.markers, axis=1)
        if lengths.max() == 0:
            return np.zeros(self.dimension)
        far = int(np.argmax(lengths >= (1 - DEFAULT.alike) * lengths.max()))
        along: Array = self.markers[far] / lengths[far]
        away = self.markers - np.outer(self.markers @ along, along)
        return along if np.linalg.norm(away, axis=1).max() <= DEFAULT.alike * self.size else None

    def moved(self, by: ArrayLike | None = None, turn: Turn | None = None) -> "Body":
        """Return the body turned about the origin, then shifted.

        Parameters
        ----------
        by : (d,) array, optional
        turn : float or scipy.spatial.transform.Rotation, optional
            An angle in radians, counterclockwise, in the plane; a rotation in space.
        """
        d = self.dimension
        shift = np.zeros(d) if by is None else _points("by", [by], d)[0]
        return self.carried(shift, turning(turn, d))

    def carried(self, origin: Array, matrix: Array) -> "Body":
        """Return the body with its origin elsewhere, turned by a matrix ``(d, d)``."""
        return Body({name: part.moved(origin, matrix) for name, part in self.parts.items()})

    @checked
    def same(self, other: "Body") -> bool:
        """Whether two bodies have equal parts in the same order, up to rounding."""
        if len(self.parts) != len(other.parts) or self.dimension != other.dimension:
            return False
        pairs = zip(self.parts.values(), other.parts.values(), strict=True)
        return all(
            a.points.shape == b.points.shape
            and np.allclose(a.points, b.points, rtol=0, atol=DEFAULT.alike * self.size)
            and math.isclose(a.radius, b.radius, rel_tol=DEFAULT.alike)
            for a, b in pairs
        )


def turning(turn: Turn | None, dimension: int) -> Array:
    """Return the matrix ``(d, d)`` of an angle or a rotation."""
    if turn is None:
        return np.eye(dimension)
    if dimension == 3:
        rotation = checks.instance("turn", turn, Rotation, "Rotation.from_rotvec([0, 0, 0.5])")
        matrix: Array = rotation.as_matrix()
        return matrix
    angle = checks.real("turn", turn)
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


@shown
def disc(radius: float, at: ArrayLike = (0.0, 0.0)) -> Body:
    """Return a disc in the plane.

    Parameters
    ----------
    radius : float
    at : (2,) array, optional
        Its centre; default the body's origin.
    """
    return _simple(_points("at", [at], 2), checks.real("radius", radius, above=0))


@shown
def sphere(radius: float, at: ArrayLike = (0.0, 0.0, 0.0)) -> Body:
    """Return a ball in space; parameters as for :func:`disc`."""
    return _simple(_points("at", [at], 3), checks.real("radius", radius, above=0))


@shown
def capsule(start: ArrayLike, end: ArrayLike, radius: float) -> Body:
    """Return the points within ``radius`` of a segment, in the plane or in space.

    Parameters
    ----------
    start, end : (2,) or (3,) array
        The ends of the segment, the centres of the two caps.
    radius : float
    """
    points = checks.numbers("start", start, "2 or 3 numbers")
    ends = _points("end", [_points("start", [points], points.size)[0], end], points.size)
    if np.array_equal(*ends):
        refuse("end", "a point other than start; disc and sphere have one centre", end)
    return _simple(ends, checks.real("radius", radius, above=0))


@shown
def polygon(vertices: ArrayLike, radius: float = 0.0) -> Body:
    """Return a convex polygon in the plane.

    Parameters
    ----------
    vertices : (k, 2) array
        In their order around it, clockwise or not.
    radius : float, optional
        The points up to this far away belong to it as well; default 0, sharp corners.

    Raises
    ------
    ValueError
        If the polygon is not convex, or has no interior.

    Examples
    --------
    >>> math.isclose(polygon([[0, 0], [1, 0], [1, 1], [0, 1]]).size, math.sqrt(2))
    True
    """
    points = _points("vertices", vertices, 2)
    if len(points) < 3:
        refuse("vertices", "at least three", vertices)
    if _turns(points)[0].sum() < 0:
        points = points[::-1]
    turns, ways = _turns(points)
    flat = DEFAULT.alike * np.ptp(points, axis=0).max() ** 2
    if turns.min() <= flat:
        k = int(np.argmin(turns))
        place = ", ".join(f"{x:g}" for x in points[k])
        wrong = "outwards" if turns[k] < -flat else "by no angle"
        msg = (
            "vertices: expected the vertices of a convex polygon in order; "
            f"got a turn {wrong} at ({place})"
        )
        raise ValueError(msg)
    if np.mod(np.diff(ways, append=ways[0]), math.tau).sum() > 1.5 * math.tau:
        msg = "vertices: expected the vertices of a convex polygon in order; got a star"
        raise ValueError(msg)
    return _simple(points, checks.real("radius", radius, least=0))


def _turns(points: Array) -> tuple[Array, Array]:
    """Return how much a polygon turns left at each vertex, as areas, and its edges' headings."""
    after = np.roll(points, -1, axis=0) - points
    before = np.roll(after, 1, axis=0)
    turns = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return turns, np.arctan2(after[:, 1], after[:, 0])


@shown
def polytope(vertices: ArrayLike, radius: float = 0.0) -> Body:
    """Return a convex polyhedron in space.

    Parameters
    ----------
    vertices : (k, 3) array
        In any order.
    radius : float, optional
        As for :func:`polygon`.

    Raises
    ------
    ValueError
        If one of the points is no vertex of the convex hull of all, or this has no interior.
    """
    points = _points("vertices", vertices, 3)
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        refuse("vertices", "the vertices of a polyhedron that has an interior", vertices)
    inner = sorted(set(range(len(points))) - set(hull.vertices.tolist()))
    if inner:
        place = ", ".join(f"{x:g}" for x in points[inner[0]])
        msg = (
            f"vertices: expected the vertices of a convex polyhedron; got ({place}), which is none"
        )
        raise ValueError(msg)
    return _simple(points, checks.real("radius", radius, least=0))


@checked
def compound(bodies: Sequence[Body] | dict[str, Body]) -> Body:
    """Return one rigid body that consists of several.

    Parameters
    ----------
    bodies : sequence of Body, or mapping from str to Body
        In the coordinates of the whole (:meth:`Body.moved`); they may overlap.  Names become those
        of the parts; those of a sequence are ``"1"``, ``"2"``, ...

    Examples
    --------
    >>> rod = capsule([-8, 0, 0], [8, 0, 0], 1.5)
    >>> ends = {"1": sphere(3, at=[-8, 0, 0]), "2": sphere(3, at=[8, 0, 0])}
    >>> dumbbell = compound({**ends, "rod": rod})
    >>> list(dumbbell.parts), dumbbell.size
    (['1', '2', 'rod'], 11.0)
    """
    named = bodies if isinstance(bodies, dict) else dict(zip(_numbers(), bodies, strict=False))
    if not named:
        refuse("bodies", "at least one body", bodies)
    parts: dict[str, Part] = {}
    for name, body in named.items():
        checks.instance("bodies", body, Body, "disc(1.0)")
        for inner, part in body.parts.items():
            parts[f"{name}.{inner}" if inner else name] = part
    if len({part.dimension for part in parts.values()}) > 1:
        refuse("bodies", "all in the plane or all in space", [*named])
    return Body(parts)


def _numbers() -> Any:
    k = 0
    while True:
        k += 1
        yield str(k)


def _simple(points: Array, radius: float) -> Body:
    return Body({"": Part(points, radius)})


def _points(argument: str, given: Any, dimension: int) -> Array:
    """Return finite points ``(k, d)``, or raise."""
    expected = f"points of {dimension} finite numbers" if dimension in (2, 3) else "2 or 3 numbers"
    points = checks.numbers(argument, given, expected)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or points.shape[1] != dimension:
        refuse(argument, expected, given)
    if not np.isfinite(points).all():
        refuse(argument, expected, given)
    return points
