"""Walks on the set where some functions of a polyhedron stay zero.

A step goes along the tangent and is projected back to the set; the tangent is transported along,
so a walk on an edge follows it and a walk on a larger face goes straight ahead.  Functions that are
not held are monitored by their values *and* their slopes, so that a contact that closes and opens
again between two points, or just touches, is not missed.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from operator import attrgetter
from typing import TypeVar

import numpy as np

from polycorner.polyhedra.faces import HeldPoint, Stepper, projected
from polycorner.skeletons.singularities import (
    SingularPoint,
    dependent_between,
    part_of_way,
    singular_point,
)
from polycorner.spaces.manifold import Array

Point = TypeVar("Point")


def may_vanish(
    values: tuple[Array, Array], slopes: tuple[Array, Array], reach: Array, h: float
) -> list[int]:
    """Return which functions, with values and slopes at both ends of a step, may vanish in it.

    Those that end negative; and one that falls first and rises then, if the cubic through values
    and slopes comes near zero, or if slopes kept up over the step (``reach``) would let it.
    """
    (f0, f1), (slope0, slope1) = values, slopes
    turns = (slope0 < 0) & (slope1 >= 0)
    near = f0 + f1 < reach
    return [
        int(k)
        for k in np.flatnonzero((f1 < 0) | turns)
        if f1[k] < 0 or near[k] or dips(f0[k], f1[k], slope0[k], slope1[k], h)
    ]


def dips(f0: float, f1: float, slope0: float, slope1: float, h: float) -> bool:
    """Whether the cubic through values and slopes at both ends comes near zero in between.

    It falls first and rises at the end, so that it has one minimum there: where its slope, ``c +
    b t + a t^2`` with ``c < 0 <= a + b + c``, grows through zero.  The root is computed without
    cancellation: for ``b < 0``, where ``a >= -b - c > 0``, by a formula of its own.
    """
    f0, f1, c, last = float(f0), float(f1), float(h * slope0), float(h * slope1)
    if not c < 0:  # it was so small that it vanishes
        return False
    a, b = 3 * (2 * (f0 - f1) + c + last), 6 * (f1 - f0) - 4 * c - 2 * last
    root = math.hypot(b, 2 * math.sqrt(-a * c)) if a >= 0 else math.sqrt(max(b * b - 4 * a * c, 0))
    if b + root == 0:  # slopes so small that their product vanishes: it is constant
        return bool(f0 < 0.25 * min(f0, f1) + 1e-9)
    t = (root - b) / (2 * a) if b < 0 else -2 * c / (b + root)
    lowest = f0 + t * (c + t * (b / 2 + t * a / 3))
    return bool(lowest < 0.25 * min(f0, f1) + 1e-9)


def sign_change(
    value: Callable[[float], tuple[float, Point]],
    far: float = 1.0,
    enough: Callable[[Point, float, float], bool] | None = None,
) -> tuple[float, Point]:
    """Return where a function changes sign on ``[0, far]``, by the Illinois method.

    Where both ends have one sign, as by rounding, it is the end with the smaller value.

    ``enough``, of a point, the value there and the length of the interval that is left, may end
    the search before.
    """
    a, b = 0.0, far
    (fa, start), (fb, at) = value(a), value(b)
    small = 1e-15 * max(abs(fa), abs(fb))
    if abs(fb) <= small:
        return b, at
    # Rounding alone changes the sign of what is constant: nothing is looked for outside.
    if fa != 0 and (fa > 0) == (fb > 0):
        return (a, start) if abs(fa) < abs(fb) else (b, at)
    s, side = far, 0
    for _ in range(80):
        if b - a < 1e-15 or fb == fa:
            break
        s = (a * fb - b * fa) / (fb - fa)
        f, at = value(s)
        if abs(f) <= small:
            break
        if (f > 0) == (fb > 0):
            b, fb = s, f
            fa, side = (fa / 2 if side == 1 else fa), 1
        else:
            a, fa = s, f
            fb, side = (fb / 2 if side == -1 else fb), -1
        if b - a < 1e-14 or (enough is not None and enough(at, f, b - a)):
            break
    return s, at


# Ratio of the volumes of the held gradients at two points that lets one look for a singular point.
COLLAPSE = 0.5


class End(Enum):
    """End of a walk; the value is the predicate of a sentence."""

    CORNER = "a corner"
    CLOSED = "closes upon itself without a corner"
    INFINITY = "goes on beyond the extent that was asked for"
    CHART = "reaches the end of the chart: a function or a slope is not finite there"
    SINGULAR = "reaches a point where the held gradients become dependent"


@dataclass(frozen=True)
class Walk:
    """A walk along a face.

    Attributes
    ----------
    points : (k, n) array
        Its points, in coordinates that are not wrapped.
    last : HeldPoint
        Its end.
    tangent : (n,) array
        Scaled unit direction of arrival.
    end : End
        Reason for the end.
    length : float
        In scale units.
    """

    points: Array
    last: HeldPoint
    tangent: Array
    end: End
    length: float

    @property
    def arrival(self) -> Iterator[tuple[HeldPoint, frozenset[int]]]:
        """Yield the corner where it ends in the polyhedron, and what vanishes there, if so."""
        active = self.last.active() if self.end is End.CORNER else None
        if active is not None:
            yield self.last, active


def follow(
    start: HeldPoint,
    direction: Array,
    *,
    passive: frozenset[int] = frozenset(),
    home: bool = False,
    extent: float | None = None,
) -> Walk:
    """Walk from ``start`` in a scaled direction, holding ``start.kept``, to the first event.

    Parameters
    ----------
    start : HeldPoint
        A point where the held functions vanish.
    direction : (n,) array
        Initial direction; projected to the tangent space.
    passive : set of int
        Functions besides ``start.kept`` that vanish all along, being dependent on them.
    home : bool
        Whether to stop when the walk comes back to where it started.
    extent : float, optional
        Length after which the walk ends; default that of the quotient.
    """
    return _Follower(start, direction, passive, home=home, extent=extent).run()


class _Follower(Stepper[HeldPoint]):
    """The state of one walk."""

    def __init__(
        self, start: HeldPoint, direction: Array, passive: frozenset[int],
        *, home: bool, extent: float | None,
    ) -> None:  # fmt: skip
        self.quotient = quotient = start.quotient
        super().__init__(start, start.tangent(direction), quotient.options, quotient.scales)
        self.scales, self.out = quotient.scales, self.t
        self.start, self.home, self.blocked = start, home, False
        self.extent = quotient.extent if extent is None else extent
        held = passive.union(start.kept)
        self.watched = np.array([i for i in range(quotient.count) if i not in held], dtype=np.int64)
        implied = range(quotient.count, len(start.values))
        self.passive = sorted(passive.union(implied).difference(quotient.held(start.kept)))
        self.union = quotient.polyhedron.is_union
        negative = self.union & (start.values[self.watched] < 0)
        self.signs = np.where(negative, -1.0, 1.0)
        self.side = start.orientation(self.t)
        self.expected: SingularPoint | None = None

    def run(self) -> Walk:
        """Step to the first event."""
        h = self.options.first_step
        while True:
            taken = self._step(h)
            if isinstance(taken, End):
                return self._stopped(taken)
            point, t, h = taken
            # Singular points first: other functions may vanish there as well.
            met = [e for e in (self._dependent(point), self._event(point, t)) if e is not None]
            if met:
                here = self.point
                first = min(met, key=lambda e: round(part_of_way(here, point, e[0].q), 6))
                if first[0].active() is None and h > self.options.shortest_step and not self.union:
                    h /= 2  # several functions close where curves cross: on another of these
                    continue
                self.move(*first)
                return self._walk(End.CORNER)
            back = self._return(point) if self.home else None
            if back is not None:
                self.move(*back)
                return self._walk(End.CLOSED)
            self.move(point, t)
            # A passive function off zero shows that the curve is lost.
            if any(abs(point.distances[self.passive]) > self.quotient.tolerances.same):
                return self._walk(End.SINGULAR)
            if self.length > self.extent:
                return self._walk(End.INFINITY)
            h = self.next_step(h, self._longest())

    def place(self, point: HeldPoint) -> Array:
        """Return its coordinates."""
        return point.q

    def corrected(self, x: Array, across: Array, reach: float) -> HeldPoint | None:  # noqa: ARG002 - the shortest way is across
        """Return the nearest point of the face."""
        point = projected(self.quotient, x, self.point.kept, reach)
        if point is None:
            self.blocked |= not HeldPoint(self.quotient, x, self.point.kept).finite
        return point

    def move(self, point: HeldPoint, t: Array, *, bends: bool = True) -> None:
        """Go on to a point."""
        super().move(point, t, bends=bends and point.is_curve)
        self.side = point.orientation(t)

    def _longest(self) -> float:
        """Return the longest step: longer far out, short on small circles and where it turns."""
        away = abs(self.point.distances[self.watched])
        room = float(away.min(initial=self.extent))
        manifold = self.quotient.manifold
        turning = abs(self.t * manifold.scale_array / np.array(manifold.periods)).max()
        circle = 0.05 / turning if turning > 0 else math.inf
        longest = self.options.longest_step
        return max(longest, min(room / 2, longest * (1 + self.length / 20), circle))

    def _walk(self, end: End) -> Walk:
        points = np.array([point.q for point in self.passed])
        return Walk(points, self.point, self.t, end, self.length)

    def _step(self, h: float) -> tuple[HeldPoint, Array, float] | End:
        """Return the next point, the tangent there and the step that was accepted."""
        self.blocked = False
        for point, t, tried, fits in self.trials(h):
            flipped = point.orientation(t) * self.side < 0
            if flipped and self._dependent(point) is not None:
                return point, t, tried
            # After a short step the walk did not jump to another curve.
            if flipped and tried < self.quotient.tolerances.beside:
                return End.SINGULAR
            if fits and not flipped:
                return point, t, tried
        return End.CHART if self.blocked else End.SINGULAR

    def _stopped(self, end: End) -> Walk:
        """Return the walk where no step is possible: a tip where one is found within reach."""
        tip = singular_point(self.quotient, self.point.q, self.point.kept, self.options.tip)
        held = set(self.point.kept).union(self.passive)
        if tip is None and end is End.CHART and (self.point.active() or held) > held:
            tip = SingularPoint(self.quotient, self.point.q, self.point.kept)  # where roots end
        if tip is None or tip.active() is None:
            return self._walk(end)
        self.move(tip, self.t)
        return self._walk(End.CORNER)

    def _dependent(self, point: HeldPoint) -> tuple[HeldPoint, Array] | None:
        """Return a point of this step where the held gradients become dependent, and the tangent.

        Looked for where their volume falls or rises much, or their orientation changes; what is
        found beyond the step is kept for the next.
        """
        ends = [self.point, point]
        if len(self.passed) == 1:
            ends.insert(1, self.between(point, 0.5))
        volume = attrgetter("volume")
        low, high = min(ends, key=volume), max(ends, key=volume)
        flipped = point.orientation(self.t) * self.side < 0
        if low.volume < COLLAPSE * high.volume or flipped:
            reach = 2 * self.chord(point)
            self.expected = singular_point(self.quotient, low.q, self.point.kept, reach)
        found = dependent_between(self.point, point, self.expected)
        return None if found is None else (found, self.t)

    def _event(self, point: HeldPoint, t: Array) -> tuple[HeldPoint, Array] | None:
        """Return the first point where the face changes, and the tangent there; cut the step."""
        event: tuple[HeldPoint, Array] | None = None
        crossed: dict[int, HeldPoint | None] = {}
        while self.chord(point) > 0:
            ahead = [found for found in self._suspects(point, t) if found[0] not in crossed]
            if not ahead:
                break
            j, sign = ahead[0]
            where, crosses = self._closing(point, j, sign) or (None, False)
            crossed[j] = where if crosses else None
            if where is not None and self._matters(where):
                point, t = event = where, where.tangent(self.t)
        for j, where in crossed.items():
            if where is not None and self.chord(where) < self.chord(point):
                self.signs[self.watched == j] *= -1
        return event

    def _matters(self, where: HeldPoint) -> bool:
        """Whether the face changes here: in a union a zero may be irrelevant."""
        active = where.active() if self.union else None
        return active is None or not active <= set(self.point.kept).union(self.passive)

    def _suspects(self, point: HeldPoint, t: Array) -> list[tuple[int, float]]:
        """Return functions that change sign or may dip to zero in this step, and their signs.

        Those expected to vanish early come first, those that may only dip last.
        """
        here, there, rows = self.point, point, self.watched
        f0, f1 = self.signs * here.values[rows], self.signs * there.values[rows]
        slope0 = self.signs * (here.gradients[rows] @ self.t)
        slope1 = self.signs * (there.gradients[rows] @ t)
        reach = np.maximum(here.sizes[rows], there.sizes[rows]) * self.chord(point)
        found = may_vanish((f0, f1), (slope0, slope1), reach, self.chord(point))
        found.sort(key=lambda k: f0[k] / (f0[k] - f1[k]) if f1[k] < 0 < f0[k] else f1[k] >= 0)
        return [(int(rows[k]), float(self.signs[k])) for k in found]

    def _closing(self, point: HeldPoint, j: int, sign: float) -> tuple[HeldPoint, bool] | None:
        """Return where function ``j`` first reaches zero, and whether it crosses.

        A function that ends positive is followed to where its slope vanishes; there it touches
        (within the tolerance), has crossed before, or was only near.
        """
        end, far, zero = point, 1.0, self.quotient.tolerances.zero
        if sign * point.values[j] >= 0:

            def slope(s: float) -> tuple[float, HeldPoint]:
                at = self.between(point, s)
                return sign * float(at.gradients[j] @ at.tangent(self.t)), at

            narrow = 1e-3  # part of a step in which the slope bounds how far a function may fall

            def is_clear(at: HeldPoint, rate: float, part: float) -> bool:
                fall = 2 * abs(rate) * part * self.chord(point)
                size = zero * at.sizes[j]
                return part < narrow and bool(sign * at.values[j] - fall > size)

            far, end = sign_change(slope, enough=is_clear if self.point.is_curve else None)
            distance = sign * end.distances[j]
            if distance > zero:
                return None
            if distance >= -zero:
                return end, False

        def value(s: float) -> tuple[float, HeldPoint]:
            at = self.between(point, s)
            return sign * float(at.values[j]), at

        quick = self._crossing(point, j) if end is point and self.point.is_curve else None
        return quick or sign_change(value, far)[1], end is point

    def _crossing(self, point: HeldPoint, j: int) -> HeldPoint | None:
        """Return where ``j`` crosses zero, by Newton's method; None if that leaves the step."""
        f0, f1 = self.point.values[j], point.values[j]
        guess = self.guess(point, f0 / (f0 - f1))
        kept = [*self.point.kept, j]
        record = projected(self.quotient, guess, kept, self.chord(point))
        if record is None or record.condition < 1e-3:
            return None
        chord = (point.q - self.point.q) / self.scales
        s = float((record.q - self.point.q) / self.scales @ chord / (chord @ chord))
        return HeldPoint(self.quotient, record.q, self.point.kept) if 0 <= s <= 1 else None

    def _return(self, point: HeldPoint) -> tuple[HeldPoint, Array] | None:
        """Return where this step passes the start of the walk again, and the tangent there."""
        tolerances = self.quotient.tolerances
        near = 2 * self.quotient.separation(point.q, self.point.q)
        if self.length < 2 * self.chord(point) or abs(self._from_home(point.q)).max() > near:
            return None
        ahead = self._from_home(self.start.q + tolerances.difference * self.scales * self.out)

        def passed(s: float) -> tuple[float, HeldPoint]:
            at = self.between(point, s)
            return float(self._from_home(at.q) @ ahead), at

        if passed(0.0)[0] > 0 or passed(1.0)[0] < 0:
            return None
        _, nearest = sign_change(passed)
        same = abs(self._from_home(nearest.q)).max() < 100 * tolerances.zero
        return (nearest, nearest.tangent(self.t)) if same else None

    def _from_home(self, q: Array) -> Array:
        """Return the displacement from the start's orbit, by the invariants."""
        return self.quotient.displacement(q, self.start.q)
