"""Steps along curves: a predictor along the tangent, which is then corrected onto the curve."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar

import numpy as np

from polycorner.polyhedra.quotients import WalkOptions
from polycorner.spaces.manifold import Array


class Followed(Protocol):
    """A point of a curve, or of a set along which one walks straight ahead."""

    def tangent(self, like: Array, /) -> Array:
        """Return the unit vector along it on the side of, or nearest to, another."""


P = TypeVar("P", bound=Followed)


class Stepper(ABC, Generic[P]):
    """The state of a walk from point to point ([Gov] sec. 2).

    A step of length ``h`` goes ``h t + h^2 b / 2`` ahead and is corrected, by ``reach h`` at most.
    It is halved until the tangent turns less than ``turn`` and the point is no farther off the old
    tangent than the turn explains (:class:`WalkOptions`).

    Attributes
    ----------
    point : Followed
        The last point.
    t, bend : array
        The unit tangent there, and how it turns.
    passed : list of Followed
        All points.
    length : float
    """

    def __init__(
        self, start: P, tangent: Array, options: WalkOptions, units: Array | float = 1.0
    ) -> None:
        self.options, self.units = options, units
        self.point, self.t, self.bend = start, tangent, np.zeros(len(tangent))
        self.passed, self.length = [start], 0.0

    @abstractmethod
    def place(self, point: P) -> Array:
        """Return the coordinates of a point, which are to be divided by the units."""

    @abstractmethod
    def corrected(self, x: Array, across: Array, reach: float) -> P | None:
        """Return a point of the curve within reach, or None."""

    def trials(self, h: float) -> Iterator[tuple[P, Array, float, bool]]:
        """Yield points ahead at shorter and shorter steps, tangents, and whether they will do."""
        options = self.options
        while h > options.shortest_step:
            ahead = self.place(self.point) + h * self.units * (self.t + h / 2 * self.bend)
            point = self.corrected(ahead, self.t, options.reach * h)
            if point is not None:
                t = point.tangent(self.t)
                turn = math.acos(min(1.0, float(t @ self.t)))
                off = float(np.linalg.norm(self.way(point) - h * self.t))
                # A larger deviation than the turn explains: another curve of the same functions.
                fits = turn < options.turn and off <= h * (options.arc * turn + options.stray)
                yield point, t, h, fits
            h /= 2

    def next_step(self, h: float, longest: float) -> float:
        """Return the length of the step after one of length ``h``."""
        options, bend = self.options, float(np.linalg.norm(self.bend))
        return min(options.growth * h, longest, options.ease * options.turn / max(bend, 1e-300))

    def move(self, point: P, t: Array, *, bends: bool = True) -> None:
        """Go on to a point; a tangent that was only transported has no bend."""
        chord = self.chord(point)
        self.length += chord
        self.bend = (t - self.t) / chord if bends and chord > 0 else self.bend
        self.point, self.t = point, t
        self.passed.append(point)

    def way(self, point: P) -> Array:
        """Return the displacement to a point."""
        return np.asarray((self.place(point) - self.place(self.point)) / self.units)

    def chord(self, point: P) -> float:
        """Return its length."""
        return float(np.linalg.norm(self.way(point)))

    def guess(self, point: P, s: float) -> Array:
        """Return a fraction ``s`` of the way to a point, on the cubic with the tangents."""
        way, h = self.way(point), self.chord(point)
        out, back = h * self.t - way, h * point.tangent(self.t) - way
        part = s * (way + (1 - s) * ((1 - s) * out - s * back))
        return np.asarray(self.place(self.point) + self.units * part)

    def between(self, point: P, s: float, reach: float = math.inf) -> P:
        """Return the point of the curve a fraction of the way to another."""
        way = self.way(point)
        found = self.corrected(self.guess(point, s), way / np.linalg.norm(way), reach)
        return point if found is None else found
