"""Base class of the convex sets of friction forces; see :mod:`polycorner.motion.friction`."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import reals
from polycorner.kinds import checked
from polycorner.spaces.arguments import finite, scalar
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

INTERVAL, DISC, ELLIPSE, CUT_DISC, POLYGON = range(5)
Code = tuple[int, tuple[float, float, float, float], Array]


class ConvexSet(ABC):
    """A compact convex set ``C`` of forces per unit load that contains 0.

    Forces and slip velocities are arrays ``(d,)`` or batches ``(..., d)``, ``d = dimension``;
    forces per unit load have no unit.

    Raises
    ------
    ValueError, TypeError
        By every method, if an argument is not made of finite reals or its last axis is not
        ``d`` long.
    """

    dimension: ClassVar[int] = 2

    @property
    @abstractmethod
    def code(self) -> Code:
        """The set as plain numbers ``(kind, four numbers, vertices (k, 2))`` for compiled code.

        ========  =================  ==========================
        kind      set                numbers
        ========  =================  ==========================
        0         ``Interval``       ``lower, upper``
        1         ``Disc``           ``mu``
        2         ``Ellipse``        ``mu_1, mu_2``
        3         ``CutDisc``        ``mu, min(width, mu)``
        4         ``ConvexPolygon``  none; counterclockwise vertices
        ========  =================  ==========================
        """

    def support(self, s: ArrayLike) -> Any:
        """Return ``h(s) = max {s.p : p in C}``, in the unit of ``s``; a batch for a batch."""
        return scalar(self._support(self._vectors(s, "s")))

    def project(self, p: ArrayLike) -> Array:
        """Return the point of ``C`` nearest to ``p``: ``p`` itself, bit for bit, inside.

        The nearest point of ``a C`` is ``a * project(p / a)`` for ``a > 0``.
        """
        return self._project(self._vectors(p, "p"))

    def gauge(self, p: ArrayLike) -> Any:
        """Return ``min {t >= 0 : p in t C}``: at most 1 on ``C``, ``inf`` outside its cone."""
        return scalar(self._gauge(self._vectors(p, "p")))

    def contains(self, p: ArrayLike, tolerance: float = 0.0) -> Any:
        """Whether ``p`` is within the distance ``tolerance`` (default: none) of ``C``."""
        away = self._vectors(p, "p")
        away = away - self._project(away)
        return scalar(length(away) <= coefficient("tolerance", tolerance))

    def within(self, other: "ConvexSet") -> bool:
        """Whether ``C`` is a subset of another set, up to rounding; exact for all five kinds.

        A polygon contains a set whose support along the edges' normals does not exceed the
        edges' distances; the other kinds contain a set whose ``tips`` they contain.

        Raises
        ------
        TypeError, ValueError
            If ``other`` is not a friction set of the same dimension.
        """
        if not isinstance(other, ConvexSet):
            msg = f"other: expected a friction set; got {type(other).__name__}"
            raise TypeError(msg)
        if other.dimension != self.dimension:
            msg = (
                f"other: expected a set of dimension {self.dimension}; got dimension "
                f"{other.dimension}"
            )
            raise ValueError(msg)
        return other.covers(self)

    @property
    @abstractmethod
    def tips(self) -> Array:
        """Points ``(k, d)`` of ``C`` that decide whether another set contains ``C``.

        An interval, a disc, an ellipse or a cut disc contains ``C`` exactly if it contains them.
        """

    @checked
    def covers(self, inner: "ConvexSet") -> bool:
        """Whether another set of the same dimension is a subset of ``C``, up to rounding."""
        return bool((self._gauge(inner.tips) <= 1 + 10 * DEFAULT.rounding).all())

    @abstractmethod
    def _support(self, s: Array) -> Array: ...

    @abstractmethod
    def _project(self, p: Array) -> Array: ...

    @abstractmethod
    def _gauge(self, p: Array) -> Array: ...

    def _vectors(self, values: ArrayLike, argument: str) -> Array:
        array = reals(argument, values)
        if array.ndim == 0 or array.shape[-1] != self.dimension:
            msg = f"{argument}: expected shape (..., {self.dimension}); got shape {array.shape}"
            raise ValueError(msg)
        return finite(array, argument)


def coefficient(argument: str, value: Any, sign: int = 1) -> float:
    """Return the magnitude of a finite number that has the given sign or is zero."""
    number = reals(argument, value)
    if number.ndim or not np.isfinite(number) or sign * number < 0:
        side = "at least" if sign > 0 else "at most"
        msg = f"{argument}: expected a finite number, {side} 0; got {value!r}"
        raise ValueError(msg)
    return abs(float(number))


def over(values: Array, size: Array | float) -> Array:
    """Return ``values / size``; where the size is 0, ``inf`` for a positive value and else 0."""
    some = np.asarray(size) > 0
    ratio = values / np.where(some, size, 1.0)
    return np.where(some, ratio, np.where(values > 0, math.inf, 0.0))


def length(p: Array) -> Array:
    """Return Euclidean lengths of vectors ``(..., d)``; squares would over- and underflow."""
    return np.asarray(np.hypot.reduce(p, axis=-1))


def in_words(laws: Iterable[tuple[str, ConvexSet, ConvexSet]]) -> str:
    """Return laws of friction in words: of each its kind, its static and its dynamic set."""
    return "; ".join(
        f"{kind} {sticks}" + (f", then {slides}" if slides != sticks else "")
        for kind, sticks, slides in laws
    )
