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
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

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
from polycorner.motion.polygons import ConvexPolygon, from_support
from polycorner.spaces.manifold import Array

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
