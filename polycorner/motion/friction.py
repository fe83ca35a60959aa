"""Convex sets of friction forces per unit load.

A dry contact under the load ``L`` holds any force in ``L C``; when it slips at the velocity ``s``
it answers with the force of ``L C`` that dissipates most, so that ``-s`` lies in the normal cone
of ``L C`` at the force ([Moreau]).  A time step uses of ``C`` its

    support     h(s) = max {s.p : p in C},    the power ``L h(-s)`` that slip dissipates,
    projection  the point of C nearest to p,
    gauge       min {t >= 0 : p in t C},      at most 1 exactly on C,

with ``p - project(p)`` the proximal point of ``h`` at ``p`` ([MoreauProx], [Rockafellar] sec. 31)
and support and gauge polar to each other, ``s.p <= h(s) gauge(p)`` ([Rockafellar] sec. 15).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import reals, whole
from polycorner.kinds import checked
from polycorner.motion.convex_sets import (
    CUT_DISC,
    DISC,
    ELLIPSE,
    INTERVAL,
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

__all__ = [
    "CUT_DISC",
    "DISC",
    "ELLIPSE",
    "INTERVAL",
    "POLYGON",
    "ConvexPolygon",
    "ConvexSet",
    "CutDisc",
    "Disc",
    "Ellipse",
    "Interval",
    "from_support",
]


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


@dataclass(frozen=True, init=False)
class Interval(ConvexSet):
    """Friction in one direction: ``C = [lower, upper]``, or ``[-mu, mu]``.

    Raises
    ------
    ValueError, TypeError
        Unless either ``mu >= 0`` or both ends with ``lower <= 0 <= upper`` are given.

    Examples
    --------
    >>> Interval(0.3).project([0.5]).tolist()
    [0.3]
    >>> Interval(lower=-0.1, upper=0.3).support([-2.0])
    0.2
    """

    dimension: ClassVar[int] = 1
    lower: float
    upper: float

    def __init__(
        self, mu: float | None = None, *, lower: float | None = None, upper: float | None = None
    ) -> None:
        if mu is not None and lower is None and upper is None:
            end = coefficient("mu", mu)
            start = 0.0 - end
        elif mu is None and lower is not None and upper is not None:
            start, end = 0.0 - coefficient("lower", lower, -1), coefficient("upper", upper)
        else:
            msg = (
                "Interval: expected either mu or both lower and upper; got "
                f"mu={mu!r}, lower={lower!r}, upper={upper!r}"
            )
            raise ValueError(msg)
        object.__setattr__(self, "lower", start)
        object.__setattr__(self, "upper", end)

    @property
    def code(self) -> Code:
        """Kind 0 with ``lower, upper``."""
        return INTERVAL, (self.lower, self.upper, 0.0, 0.0), np.empty((0, 2))

    @property
    def tips(self) -> Array:
        """The two ends."""
        return np.array([[self.lower], [self.upper]])

    def _support(self, s: Array) -> Array:
        return np.maximum(self.lower * s[..., 0], self.upper * s[..., 0])

    def _project(self, p: Array) -> Array:
        return np.clip(p, self.lower, self.upper)

    def _gauge(self, p: Array) -> Array:
        return np.maximum(over(p[..., 0], self.upper), over(-p[..., 0], -self.lower))


@dataclass(frozen=True)
class Disc(ConvexSet):
    """Coulomb's isotropic friction ``C = {|p| <= mu}`` with ``mu >= 0``.

    Raises
    ------
    ValueError, TypeError
        If ``mu`` is not a finite number, at least 0.

    Examples
    --------
    >>> Disc(0.5).project([3.0, 4.0]).tolist()
    [0.3, 0.4]
    >>> Disc(0.5).support([3.0, 4.0])
    2.5
    """

    mu: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu", coefficient("mu", self.mu))

    @property
    def code(self) -> Code:
        """Kind 1 with ``mu``."""
        return DISC, (self.mu, 0.0, 0.0, 0.0), np.empty((0, 2))

    @property
    def tips(self) -> Array:
        """The ends of two radii along the axes."""
        return self.mu * np.eye(2)

    def _support(self, s: Array) -> Array:
        return self.mu * length(s)

    def _project(self, p: Array) -> Array:
        return _onto_disc(p, self.mu)

    def _gauge(self, p: Array) -> Array:
        return over(length(p), self.mu)


@dataclass(frozen=True)
class Ellipse(ConvexSet):
    """Orthotropic friction ``C = {(p_1 / mu_1)^2 + (p_2 / mu_2)^2 <= 1}``.

    Raises
    ------
    ValueError, TypeError
        If a half-axis is not a finite number, at least 0.

    Examples
    --------
    >>> Ellipse(0.4, 0.3).support([1.0, 1.0])
    0.5
    """

    mu_1: float
    mu_2: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu_1", coefficient("mu_1", self.mu_1))
        object.__setattr__(self, "mu_2", coefficient("mu_2", self.mu_2))

    @property
    def code(self) -> Code:
        """Kind 2 with ``mu_1, mu_2``."""
        return ELLIPSE, (self.mu_1, self.mu_2, 0.0, 0.0), np.empty((0, 2))

    @property
    def tips(self) -> Array:
        """The ends of the half-axes."""
        return np.diag([self.mu_1, self.mu_2])

    def _support(self, s: Array) -> Array:
        return np.hypot(self.mu_1 * s[..., 0], self.mu_2 * s[..., 1])

    def _project(self, p: Array) -> Array:
        outside = self._gauge(p) > 1
        result = p.copy()
        result[outside] = _onto_ellipse(p[outside], np.array([self.mu_1, self.mu_2]))
        return result

    def _gauge(self, p: Array) -> Array:
        return np.hypot(over(abs(p[..., 0]), self.mu_1), over(abs(p[..., 1]), self.mu_2))


@dataclass(frozen=True)
class CutDisc(ConvexSet):
    """A disc cut by a strip, ``C = {|p| <= mu, |p_1| <= width}``.

    A ball that can roll along the first axis yields there at ``width``, its rolling friction, and
    slides at ``mu``.  With ``width >= mu`` the set is the disc.

    Raises
    ------
    ValueError, TypeError
        If ``mu`` or ``width`` is not a finite number, at least 0.

    Examples
    --------
    >>> CutDisc(0.5, 0.3).project([1.0, 1.0]).tolist()
    [0.3, 0.4]
    """

    mu: float
    width: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu", coefficient("mu", self.mu))
        object.__setattr__(self, "width", coefficient("width", self.width))

    @property
    def corner(self) -> Array:
        """The point of the first quadrant where the strip's edge meets the circle."""
        w = min(self.width, self.mu)
        return np.array([w, math.sqrt((self.mu - w) * (self.mu + w))])

    @property
    def code(self) -> Code:
        """Kind 3 with ``mu, min(width, mu)``."""
        return CUT_DISC, (self.mu, min(self.width, self.mu), 0.0, 0.0), np.empty((0, 2))

    @property
    def tips(self) -> Array:
        """The corner and the top: along the arc between them, gauges of ellipses are monotone."""
        return np.array([self.corner, [0.0, self.mu]])

    def _support(self, s: Array) -> Array:
        # The maximiser is on the arc if that of the disc lies in the strip, else at the corner.
        size, across = length(s), abs(s[..., 0])
        c, top = self.corner
        on_arc = self.mu * across <= c * size
        return np.where(on_arc, self.mu * size, c * across + top * abs(s[..., 1]))

    def _project(self, p: Array) -> Array:
        # 1. p is in C.  2. The nearest point of the disc is in the strip: it is on the arc.
        # 3. The nearest point of the strip is in the disc: it is on a straight edge.
        # 4. Neither: p is in the normal cone of a corner.
        c, top = self.corner
        disc, strip = _onto_disc(p, self.mu), p.copy()
        strip[..., 0] = np.clip(p[..., 0], -c, c)
        on_arc = (abs(disc[..., 0]) <= c)[..., None]
        on_edge = (abs(p[..., 1]) <= top)[..., None]
        corner = np.copysign([c, top], p)
        inside = (self._gauge(p) <= 1)[..., None]
        return np.asarray(np.select([inside, on_arc, on_edge], [p, disc, strip], corner))

    def _gauge(self, p: Array) -> Array:
        return np.maximum(over(length(p), self.mu), over(abs(p[..., 0]), self.width))


def _onto_disc(p: Array, radius: float) -> Array:
    size = length(p)[..., None]
    return np.where(size <= radius, p, radius * (p / np.where(size > 0, size, 1.0)))


def _onto_ellipse(p: Array, axes: Array) -> Array:
    """Return the points of an ellipse nearest to points ``(k, 2)`` outside.

    They are ``a_i^2 p_i / (t + a_i^2)`` with ``sum (a_i p_i / (t + a_i^2))^2 = 1``.  That sum is
    convex and decreasing in ``t``: from below the root, where one term alone is 1, Newton's method
    increases ``t`` monotonically until rounding stops it.
    """
    if axes.min() == 0:  # a segment or a point
        return np.clip(p, -axes, axes)
    squares, weights = axes**2, axes * abs(p)
    t = np.maximum((weights - squares).max(axis=-1), 0.0)[:, None]
    rising = np.ones(len(p), dtype=bool)
    while rising.any():
        terms = (weights / (t + squares)) ** 2
        slope = 2 * (terms / (t + squares)).sum(axis=-1)
        higher = t + ((terms.sum(axis=-1) - 1) / slope)[:, None]
        rising = (higher > t)[:, 0]
        t = np.where(rising[:, None], higher, t)
    return np.asarray(squares * (p / (t + squares)))
