"""Continuation along the curve of Fritz John points of a face, to the first event.

A step goes along the tangent and is corrected by Newton's method in the plane across it, so that
folds of the parameter are passed ([Gov] sec. 2).  Events are where something that is watched
vanishes, where a curvature along the face does, or where the curve comes back to its start.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from polycorner.branches.system import Face, FritzJohn, FritzJohnSystem
from polycorner.polyhedra.quotients import WalkOptions
from polycorner.skeletons.sign_changes import may_vanish, sign_change
from polycorner.spaces.manifold import Array


class Stop(Enum):
    """Why a continuation stopped; the value is the predicate of a sentence."""

    EVENT = "something vanishes"
    FLAT = "a curvature along the face vanishes"
    CLOSED = "it comes back to where it started"
    FAR = "it leaves the extent that was asked for"
    LOST = "no step is short enough"
    LONG = "it has taken the most steps"


@dataclass(frozen=True)
class Course:
    """A part of a curve of Fritz John points.

    Attributes
    ----------
    points : list of FritzJohn
        Its points, the first and the last included.
    tangent : array
        At the last one.
    stop : Stop
    """

    points: list[FritzJohn]
    tangent: Array
    stop: Stop

    @property
    def last(self) -> FritzJohn:
        """The end."""
        return self.points[-1]


def corrected(
    system: FritzJohnSystem,
    face: Face,
    x: Array,
    across: Array,
    reach: float,
    *,
    steps: int = 8,
) -> FritzJohn | None:
    """Return the point of the curve in the plane through ``x`` across a direction, or None.

    None too where Newton's method strays more than ``reach`` or needs more than ``steps``.
    """
    at, start, last = system.point(face, x), x, math.inf
    for _ in range(steps):
        if not at.finite:
            return None
        matrix = np.vstack([at.jacobian, across])
        left = np.append(at.left, across @ (at.x - start))
        step = np.linalg.lstsq(matrix, -left, rcond=None)[0]
        size = float(np.linalg.norm(step))
        at = system.point(face, at.x + step)
        if np.linalg.norm(at.x - start) > reach or not at.finite:
            return None
        if size <= system.tolerances.settled or (size < system.tolerances.same and size > last / 2):
            return at if float(abs(at.left).max()) <= system.tolerances.zero else None
        last = size
    return None


def polished(at: FritzJohn, j: int, *, steps: int = 8) -> FritzJohn | None:
    """Return the point of the curve nearby where what is watched at ``j`` vanishes, or None."""
    start = at.x
    for _ in range(steps):
        values, slopes = at.watched()
        matrix, left = np.vstack([at.jacobian, slopes[j]]), np.append(at.left, values[j])
        step = np.linalg.lstsq(matrix, -left, rcond=at.system.tolerances.rounding)[0]
        at = at.system.point(at.face, at.x + step)
        if not at.finite or np.linalg.norm(at.x - start) > at.system.tolerances.beside:
            return None
        if np.linalg.norm(step) <= at.system.tolerances.settled:
            return at
    return None


class _Continuation:
    def __init__(
        self, start: FritzJohn, direction: Array, options: WalkOptions, extent: float, most: int
    ) -> None:
        self.system, self.face, self.options = start.system, start.face, options
        self.start, self.out, self.extent, self.most = start, direction, extent, most
        self.at, self.t, self.bend = start, direction, np.zeros(len(direction))
        self.points, self.length = [start], 0.0
        values, slopes = start.watched()
        # Functions of a union may be negative; they are watched from the side on which they start.
        side = np.where(abs(values) <= self.system.tolerances.zero, slopes @ direction, values)
        self.signs = np.where(side < 0, -1.0, 1.0) if self.system.is_union else np.ones(len(side))

    def run(self) -> Course:
        """Step to the first event."""
        h = self.options.first_step
        while True:
            if len(self.points) > self.most:
                return self._way(Stop.LONG)
            taken = self._step(h)
            if taken is None:
                return self._way(Stop.LOST)
            point, t, h = taken
            event = self._event(point, t)
            if event is not None:
                where, stop = event
                if stop is None:  # two curvatures vanish between the points
                    h = self._chord(point) / 2
                    if h > self.options.shortest_step:
                        continue
                    where, stop = point, Stop.LOST
                self._move(where, where.tangent(self.t))
                return self._way(stop)
            home = self._home(point)
            self._move(point, t)
            if home:
                return self._way(Stop.CLOSED)
            if np.linalg.norm(point.u - self.points[0].u) > self.extent:
                return self._way(Stop.FAR)
            h = min(1.6 * h, self.options.longest_step)
            h = min(h, 0.8 * self.options.turn / max(float(np.linalg.norm(self.bend)), 1e-3))

    def _way(self, stop: Stop) -> Course:
        return Course(self.points, self.t, stop)

    def _move(self, point: FritzJohn, t: Array) -> None:
        chord = self._chord(point)
        self.length += chord
        self.bend = (t - self.t) / chord if chord > 0 else self.bend
        self.at, self.t = point, t
        self.points.append(point)

    def _chord(self, point: FritzJohn) -> float:
        return float(np.linalg.norm(point.x - self.at.x))

    def _step(self, h: float) -> tuple[FritzJohn, Array, float] | None:
        while h > self.options.shortest_step:
            ahead = self.at.x + h * (self.t + h / 2 * self.bend)
            point = corrected(self.system, self.face, ahead, self.t, 0.3 * h)
            if point is not None:
                t = point.tangent(self.t)
                turn = math.acos(min(1.0, float(t @ self.t)))
                off = float(np.linalg.norm(point.x - self.at.x - h * self.t))
                if turn < self.options.turn and off <= h * (0.75 * turn + self.options.stray):
                    return point, t, h
            h /= 2
        return None

    def _between(self, point: FritzJohn, t: Array, s: float) -> FritzJohn:
        """Return the point of the curve a fraction of the way to another."""
        chord, h = point.x - self.at.x, self._chord(point)
        out, back = h * self.t - chord, h * t - chord
        guess = self.at.x + s * (chord + (1 - s) * ((1 - s) * out - s * back))
        found = corrected(self.system, self.face, guess, chord / h, h)
        return point if found is None else found

    def _event(self, point: FritzJohn, t: Array) -> tuple[FritzJohn, Stop | None] | None:
        """Return the first point on the way to ``point`` where an event is; None if there is none.

        Without a stop where several curvatures change sign, so that shorter steps are needed.
        """
        found: list[tuple[float, FritzJohn, Stop | None]] = []
        (f0, rows0), (f1, rows1) = self.at.watched(), point.watched()
        f0, d0 = self.signs * f0, self.signs * (rows0 @ self.t)
        f1, d1 = self.signs * f1, self.signs * (rows1 @ t)
        h = self._chord(point)
        # What vanishes at the start opens from there.
        zero = self.system.tolerances.zero
        begins = (abs(f0) <= zero) & (d0 > 0) if len(self.points) == 1 else np.zeros(len(f0), bool)
        f0 = np.where(begins, 0.0, f0)
        for j in may_vanish((f0, f1), (d0, d1), abs(d0) * h + abs(d1) * h, h):
            where = self._zero(point, t, j, bool(begins[j]))
            if where is not None:
                found.append((*where, Stop.EVENT))
        n0, n1 = self._negative(self.at), self._negative(point)
        if len(self.points) == 1 and self._is_flat(self.at):
            n0 = n1  # it leaves a fold: the curvature has a sign only beyond
        if n0 != n1:
            if abs(n0 - n1) > 1:
                found.append((0.5, point, None))
            else:
                found.append((*self._flattened(point, t, min(n0, n1)), Stop.FLAT))
        if not found:
            return None
        _, at, stop = min(found, key=lambda e: e[0])
        return at, stop

    def _flattened(self, point: FritzJohn, t: Array, k: int) -> tuple[float, FritzJohn]:
        """Return where the ``k``-th curvature vanishes on the way to a point."""

        def value(s: float) -> tuple[float, FritzJohn]:
            at = self._between(point, t, s)
            return float(at.curvatures()[k]), at

        return sign_change(value)

    def _is_flat(self, at: FritzJohn) -> bool:
        return bool(abs(at.curvatures()).min(initial=math.inf) <= self.system.tolerances.near)

    def _negative(self, at: FritzJohn) -> int:
        return int((at.curvatures() < 0).sum())

    def _zero(
        self, point: FritzJohn, t: Array, j: int, begins: bool
    ) -> tuple[float, FritzJohn] | None:
        """Return where what is watched at ``j`` first vanishes on the way to a point."""

        def value(s: float) -> tuple[float, FritzJohn]:
            at = self._between(point, t, s)
            return float(sign * at.watched()[0][j]), at

        far, sign = 1.0, self.signs[j]
        if sign * point.watched()[0][j] >= 0:

            def slope(s: float) -> tuple[float, FritzJohn]:
                at = self._between(point, t, s)
                return float(sign * at.watched()[1][j] @ at.tangent(self.t)), at

            far, end = sign_change(slope)
            if float(sign * end.watched()[0][j]) > 0:
                return None
        if begins:  # from a point at which it has opened
            low = far
            while low > self.system.tolerances.same and value(low)[0] <= 0:
                low /= 2
            if value(low)[0] <= 0:
                return None
            s, at = sign_change(lambda x: value(low + x * (far - low)))
            s = low + s * (far - low)
        else:
            s, at = sign_change(value, far)

        exact = polished(at, j)
        return s, at if exact is None else exact

    def _home(self, point: FritzJohn) -> bool:
        """Whether the step to a point passes the start of the curve again."""
        if len(self.points) < 4:
            return False
        near, far = self.start.x - self.at.x, self.start.x - point.x
        chord = point.x - self.at.x
        passes = near @ chord >= 0 > far @ chord and self.t @ self.out > 0
        aside = near - (near @ chord) / (chord @ chord) * chord
        return bool(passes and np.linalg.norm(aside) < 0.1 * self._chord(point))


def follow(
    start: FritzJohn,
    direction: Array,
    options: WalkOptions,
    *,
    extent: float = math.inf,
    most: int = 2000,
) -> Course:
    """Follow the curve of Fritz John points through a point to the first event.

    Parameters
    ----------
    start : FritzJohn
    direction : array
        Unit tangent in which to go.
    options : WalkOptions
    extent : float, optional
        Distance from the start, in scale units, beyond which it stops.
    most : int, optional
        Steps, at most.
    """
    return _Continuation(start, direction, options, extent, most).run()
