"""Convex polygons of friction forces, from vertices or from a support function."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import reals, whole
from polycorner.kinds import checked
from polycorner.motion.convex_sets import (
    POLYGON,
    Code,
    ConvexSet,
    coefficient,
    length,
    over,
)
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT


@dataclass(frozen=True, init=False)
class ConvexPolygon(ConvexSet):
    """The convex polygon with given vertices.

    Parameters
    ----------
    vertices : (k, 2) array
        Points in any order, each on the boundary of their convex hull, which contains 0 and has
        an area.  They are stored counterclockwise from the lexicographically least; points on an
        edge are dropped.
    error : float, optional
        Largest distance from the polygon to the set that it encloses and approximates; default 0.

    Raises
    ------
    ValueError, TypeError
        If the points are not the vertices of a convex polygon around 0.

    Examples
    --------
    >>> diamond = ConvexPolygon([(0.3, 0), (0, 0.2), (-0.3, 0), (0, -0.2)])
    >>> diamond.support([1.0, 1.0]), diamond.gauge([0.3, 0.2])
    (0.3, 2.0)
    """

    vertices: tuple[tuple[float, float], ...]
    error: float

    def __init__(self, vertices: ArrayLike, error: float = 0.0) -> None:
        corners = _corners(vertices, "vertices")
        object.__setattr__(self, "vertices", tuple((float(x), float(y)) for x, y in corners))
        object.__setattr__(self, "error", coefficient("error", error))

    @property
    def code(self) -> Code:
        """Kind 4 with the vertices, counterclockwise."""
        return POLYGON, (0.0, 0.0, 0.0, 0.0), self.tips

    @property
    def tips(self) -> Array:
        """The vertices."""
        return np.array(self.vertices)

    @property
    def edges(self) -> tuple[Array, Array]:
        """Outward unit normals ``(k, 2)`` and distances ``(k,)`` from 0 of the edges."""
        normals, distances = _edges(self.tips)
        return normals, np.maximum(distances, 0.0)

    def _support(self, s: Array) -> Array:
        return np.asarray(_dots(s, self.tips).max(axis=-1))

    def _project(self, p: Array) -> Array:
        normals, distances = self.edges
        inside = (_dots(p, normals) <= distances).all(axis=-1, keepdims=True)
        starts = self.tips
        sides = np.roll(starts, -1, axis=0) - starts
        away = p[..., None, :] - starts
        along = np.clip((away * sides).sum(axis=-1) / (sides**2).sum(axis=-1), 0.0, 1.0)
        feet = starts + along[..., None] * sides
        # For distant points all distances agree up to rounding; their differences are computed.
        first = _pick(feet, length(p[..., None, :] - feet).argmin(axis=-1))
        away = (first[..., None, :] - feet) * (2 * p[..., None, :] - feet - first[..., None, :])
        foot = _pick(feet, away.sum(axis=-1).argmin(axis=-1))
        return np.where(inside, p, foot)

    def _gauge(self, p: Array) -> Array:
        normals, distances = self.edges
        return np.asarray(np.maximum(over(_dots(p, normals), distances).max(axis=-1), 0.0))

    @checked
    def covers(self, inner: ConvexSet) -> bool:
        """Whether the support of a set along the edges' normals stays within the edges."""
        normals, distances = self.edges
        slack = 10 * DEFAULT.rounding * abs(self.tips).max()
        return bool((inner.support(normals) <= distances + slack).all())


def from_support(h: Callable[[Array], float], directions: int = 64) -> ConvexPolygon:
    """Return the polygon ``{p : u_k.p <= h(u_k)}`` around a set with support function ``h``.

    The set touches each of the ``N`` lines, so it is at least as close to a vertex as the chord
    between the far ends of the two edges that meet there; the largest of these distances is the
    polygon's ``error``.  It decreases like ``N^-2`` for a smooth set, and like ``N^-1`` at a
    straight edge to which no ``u_k`` is normal.

    Parameters
    ----------
    h : function of a unit vector (2,)
        The support function.
    directions : int, optional
        Number ``N`` of directions ``u_k = (cos, sin)(2 pi k / N)``, at least 5.

    Raises
    ------
    ValueError, TypeError
        If the values are not those of a convex set with an area that contains 0.

    Examples
    --------
    >>> outer = from_support(lambda u: 0.3, directions=64)
    >>> round(outer.gauge([0.0, 0.3]), 12), outer.error < 0.002
    (1.0, True)
    """
    directions = whole("directions", directions, least=5)
    angles = math.tau / directions * np.arange(directions)
    u = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    heights = np.array([coefficient("h", h(direction)) for direction in u])
    turn, before, after = math.tau / directions, np.roll(heights, 1), np.roll(heights, -1)
    lengths = (before + after - 2 * math.cos(turn) * heights) / math.sin(turn)
    if (lengths < -1e-9 * heights.max()).any():
        k = int(lengths.argmin())
        msg = (
            "h: expected the support function of a convex set; got values at the directions "
            f"number {k - 1}, {k}, {k + 1} of {directions} that no convex set has"
        )
        raise ValueError(msg)
    reach = (after - math.cos(turn) * heights) / math.sin(turn)
    across = np.stack([-u[:, 1], u[:, 0]], axis=-1)
    corners = _corners(heights[:, None] * u + reach[:, None] * across, "h")
    lengths = np.maximum(lengths, 0.0)
    ahead = np.roll(lengths, -1)
    chords = np.sqrt(lengths**2 + ahead**2 + 2 * math.cos(turn) * lengths * ahead)
    gaps = lengths * ahead * math.sin(turn) / np.where(chords > 0, chords, 1.0)
    return ConvexPolygon(corners, error=float(gaps.max()))


def _dots(p: Array, vectors: Array) -> Array:
    """Return the scalar products ``(..., k)``, rounded alike for one vector and for many."""
    return np.asarray((p[..., None, :] * vectors).sum(axis=-1))


def _pick(points: Array, number: NDArray[np.intp]) -> Array:
    """Return for each row ``(..., k, 2)`` of points the one with the given number."""
    return np.take_along_axis(points, number[..., None, None], axis=-2)[..., 0, :]


def _edges(corners: Array) -> tuple[Array, Array]:
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=-1) / length(sides)[:, None]
    return normals, (normals * corners).sum(axis=-1)


def _corners(values: ArrayLike, argument: str) -> Array:
    """Return the corners of a convex polygon around 0, counterclockwise from the least.

    Sorted by their angle about the mean, the points of a convex polygon are in order; a point
    that lies within rounding on the line through its neighbours is dropped.
    """
    points = finite(reals(argument, values), argument)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
        msg = f"{argument}: expected at least three points, shape (k, 2); got shape {points.shape}"
        raise ValueError(msg)
    slack = 10 * DEFAULT.rounding * float(abs(points).max())
    around = points - points.mean(axis=0)
    corners = points[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    while len(corners) > 2:
        heights = _heights(corners)
        least = int(heights.argmin())
        if heights[least] < -slack:
            where = corners[least].tolist()
            msg = (
                f"{argument}: expected the vertices of a convex polygon; got {where} in its "
                "interior"
            )
            raise ValueError(msg)
        if heights[least] > slack:
            break
        corners = np.delete(corners, least, axis=0)
    if len(corners) < 3:
        msg = f"{argument}: expected a polygon with an area; got points on a line"
        raise ValueError(msg)
    if _edges(corners)[1].min() < -slack:
        msg = f"{argument}: expected a polygon that contains 0; got one that leaves it out"
        raise ValueError(msg)
    return np.roll(corners, -int(np.lexsort((corners[:, 1], corners[:, 0]))[0]), axis=0)


def _heights(corners: Array) -> Array:
    """Return the distance of each corner outward from the line through its neighbours."""
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    chord, side = after - before, corners - before
    spans = length(chord)
    across = chord[:, 1] * side[:, 0] - chord[:, 0] * side[:, 1]
    return np.asarray(across / np.where(spans > 0, spans, 1.0))
