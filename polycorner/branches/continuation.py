"""Continuation along the curve of Fritz John points of a face, to the first event.

A step goes along the tangent and is corrected by Newton's method in the plane across it, so that
folds of the parameter are passed ([Gov] sec. 2).  Events are where something that is watched
vanishes, where a curvature along the face does, or where the curve comes back to its start.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeVar

import numpy as np

from polycorner.branches.branching import branch_point, curves
from polycorner.branches.system import FritzJohn
from polycorner.polyhedra.faces import Stepper
from polycorner.polyhedra.quotients import WalkOptions
from polycorner.skeletons.walks import may_vanish, sign_change
from polycorner.spaces.manifold import Array

P = TypeVar("P", bound=FritzJohn)


class Stop(Enum):
    """Why a continuation stopped; the value is the predicate of a sentence."""

    EVENT = "something vanishes"
    FLAT = "a curvature along the face vanishes"
    CLOSED = "it comes back to where it started"
    FAR = "it leaves the extent that was asked for"
    LOST = "no step is short enough"
    LONG = "it has taken the most steps"
    LINE = "the parameter stays while the point moves: equilibria are not isolated there"


@dataclass(frozen=True)
class Course(Generic[P]):
    """A part of a curve of Fritz John points.

    The first point and the last are included; ``tangent`` is that at the last one.
    """

    points: list[P]
    tangent: Array
    stop: Stop

    @property
    def last(self) -> P:
        """The end."""
        return self.points[-1]


def corrected(guess: P, across: Array, reach: float) -> P | None:
    """Return the point of the curve in the plane through a guess across a direction, or None.

    None too where Newton's method strays more than ``reach`` or needs more than eight steps.
    """
    at, start, last = guess, guess.x, math.inf
    for _ in range(8):
        if not at.finite:
            return None
        step = at.newton_step(across, float(across @ (at.x - start)))
        size, tolerances = float(np.linalg.norm(step)), at.system.tolerances
        at = at.moved(at.x + step)
        if np.linalg.norm(at.x - start) > reach or not at.finite:
            return None
        if size <= tolerances.settled or (size < tolerances.same and size > last / 2):
            return at if float(abs(at.left).max()) <= tolerances.zero else None
        last = size
    return None


def polished(at: P, j: int) -> P | None:
    """Return the point of the curve nearby where what is watched at ``j`` vanishes, or None."""
    start = at.x
    for _ in range(8):
        values, slopes = at.watched()
        step = at.newton_step(slopes[[j]], float(values[j]))
        at = at.moved(at.x + step)
        if not at.finite or np.linalg.norm(at.x - start) > at.system.tolerances.beside:
            return None
        if np.linalg.norm(step) <= at.system.tolerances.settled:
            return at
    return None


class _Continuation(Stepper[P]):
    def __init__(self, start: P, direction: Array, options: WalkOptions, extent: float) -> None:
        super().__init__(start, direction, options)
        self.system, self.out, self.extent = start.system, direction, extent
        values, slopes = start.watched()
        # Functions of a union may be negative; they are watched from the side on which they start.
        side = np.where(abs(values) <= self.system.tolerances.zero, slopes @ direction, values)
        self.signs = np.where(side < 0, -1.0, 1.0) if self.system.is_union else np.ones(len(side))

    def place(self, point: P) -> Array:
        """Return its unknowns."""
        return point.x

    def corrected(self, x: Array, across: Array, reach: float) -> P | None:
        """Return the point of the curve across a direction."""
        return corrected(self.point.moved(x), across, reach)

    def run(self) -> Course[P]:
        """Step to the first event."""
        h, turn = self.options.first_step, self.options.turn
        while True:
            if len(self.passed) > 2000:
                return self._course(Stop.LONG)
            fitting = (trial for trial in self.trials(h) if trial[-1])
            taken = next((one for one in fitting if one[0].turns(self.point) < turn), None)
            if taken is None:
                return self._course(Stop.LOST)
            point, t, h, _ = taken
            event = self._event(point, t)
            if event is not None:
                where, stop = event
                if stop is None:  # more happens between the points than one event
                    h = self.chord(point) / 2
                    if h > self.options.shortest_step:
                        continue
                    where, stop = point, Stop.LOST
                self.move(where, where.tangent(self.t))
                return self._course(stop)
            home = self._home(point)
            self.move(point, t)
            if home:
                return self._course(Stop.CLOSED)
            if np.linalg.norm(point.u - self.passed[0].u) > self.extent:
                return self._course(Stop.FAR)
            h = self.next_step(h, self.options.longest_step)

    def _course(self, stop: Stop) -> Course[P]:
        return Course(self.passed, self.t, stop)

    def _event(self, point: P, t: Array) -> tuple[P, Stop | None] | None:
        """Return the first point on the way to ``point`` where an event is; None if there is none.

        Without a stop where several curvatures change sign, so that shorter steps are needed.
        """
        found: list[tuple[float, P, Stop | None]] = []
        (f0, rows0), (f1, rows1) = self.point.watched(), point.watched()
        f0, d0 = self.signs * f0, self.signs * (rows0 @ self.t)
        f1, d1 = self.signs * f1, self.signs * (rows1 @ t)
        h = self.chord(point)
        # What vanishes at the start opens from there.
        zero = self.system.tolerances.zero
        begins = (abs(f0) <= zero) & (d0 > 0) if len(self.passed) == 1 else np.zeros(len(f0), bool)
        f0 = np.where(begins, 0.0, f0)
        for j in may_vanish((f0, f1), (d0, d1), abs(d0) * h + abs(d1) * h, h):
            where = self._zero(point, j, bool(begins[j]))
            if where is not None:
                found.append((*where, Stop.EVENT))
        found += self._flat(point, t)
        if not found:
            return None
        s, at, stop = min(found, key=lambda e: e[0])
        doubted = stop is not None and any(other is None for _, _, other in found)
        return at, None if doubted and not self._is_first(point, s) else stop

    def _is_first(self, point: P, s: float) -> bool:
        """Whether nothing seems to happen before a part of the way to a point."""
        del point
        return s < 0.5

    def _flat(self, point: P, t: Array) -> list[tuple[float, P, Stop | None]]:
        """Return where curvatures vanish on the way to a point.

        Without a stop where more than one does.
        """
        del t  # a subclass looks at it
        found: list[tuple[float, P, Stop | None]] = []
        for i, (here, there) in enumerate(zip(self.point.spectra(), point.spectra(), strict=True)):
            n0, n1 = int((here < 0).sum()), int((there < 0).sum())
            # It leaves a fold: the curvature has a sign only beyond.
            flat = abs(here).min(initial=math.inf) <= self.system.tolerances.near
            if n0 == n1 or (flat and len(self.passed) == 1):
                continue
            if abs(n0 - n1) > 1:
                found.append((0.5, point, None))
            else:
                found.append((*self._flattened(point, i, min(n0, n1)), Stop.FLAT))
        return found

    def _flattened(self, point: P, i: int, k: int) -> tuple[float, P]:
        """Return where the ``k``-th curvature on a face vanishes on the way to a point."""

        def value(s: float) -> tuple[float, P]:
            at = self._between(point, s)
            # Where gradients depend a direction less may be found to be free; it counts as stiff.
            return float([*at.spectra()[i], *np.ones(k + 1)][k]), at

        return sign_change(value)

    def _between(self, point: P, s: float) -> P:
        """Return the point of the curve a fraction of the way to another, or a guess of it."""
        guess, way = self.guess(point, s), self.way(point)
        found = self.corrected(guess, way / self.chord(point), self.chord(point))
        return point.moved(guess) if found is None else found

    def _zero(self, point: P, j: int, begins: bool) -> tuple[float, P] | None:
        """Return where what is watched at ``j`` first vanishes on the way to a point."""

        def value(s: float) -> tuple[float, P]:
            at = self._between(point, s)
            return float(sign * at.watched()[0][j]), at

        far, sign = 1.0, self.signs[j]
        if sign * point.watched()[0][j] >= 0:

            def slope(s: float) -> tuple[float, P]:
                at = self._between(point, s)
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

    def _home(self, point: P) -> bool:
        """Whether the step to a point passes the start of the curve again."""
        if len(self.passed) < 4:
            return False
        near, far = self.passed[0].x - self.point.x, self.passed[0].x - point.x
        chord = self.way(point)
        passes = near @ chord >= 0 > far @ chord and self.t @ self.out > 0
        aside = near - (near @ chord) / (chord @ chord) * chord
        # An arc deviates from its chord by an eighth of its turn.
        return bool(passes and np.linalg.norm(aside) < self.options.turn / 2 * self.chord(point))


Found = tuple[float, FritzJohn, Stop | None]  # part of the way, a point, what is there


class _ArcContinuation(_Continuation[FritzJohn]):
    def _event(self, point: FritzJohn, t: Array) -> tuple[FritzJohn, Stop | None] | None:
        if self._stays(point, t):
            return self.point, Stop.LINE
        event = super()._event(point, t)
        if event is None or event[1] is not Stop.EVENT:
            return event
        at = event[0]
        # Where gradients are dependent the face has a direction more.
        alike = len(at.curvatures()) == len(self.point.curvatures())
        if alike and self.chord(at) > self.system.tolerances.same:
            before = self._first_flat(at, at.tangent(self.t))
            if before is not None and before[2] is None:
                return at, None  # on the shorter way more is seen
        return event

    def _flat(self, point: FritzJohn, t: Array) -> list[Found]:
        """Return where a curvature vanishes or the parameter turns back on the way to a point."""
        found = self._first_flat(point, t)
        return [] if found is None else [found]

    def _stays(self, point: FritzJohn, t: Array) -> bool:
        """Whether only the point moves on the way to another, far enough to tell from a fold."""
        n, h = self.system.n, self.chord(point)
        moved = float(np.linalg.norm(point.u - self.point.u))
        change = max(abs(point.s - self.point.s) / h, abs(self.t[n]), abs(t[n]))
        return bool(moved > self.system.tolerances.beside and change <= self.system.tolerances.zero)

    def _first_flat(self, point: FritzJohn, t: Array) -> Found | None:
        """Return where a curvature vanishes on the way to a point, or the parameter turns back.

        Without a stop where more than one of these happens.  Both signs of the same curvatures may
        change at once at branch points, whose directions then change suddenly; and the parameter
        may turn twice, which a cubic through its values and slopes tells.
        """
        n, beside = self.system.n, self.system.tolerances.beside
        several: Found = (0.5, point, None)
        before, after = float(self.t[n]), float(t[n])
        change, h = point.s - self.point.s, self.chord(point)
        if len(self.passed) == 1 and (abs(before) <= beside or self.point.definite <= beside / 10):
            # It leaves a fold or a branch point: signs are those beyond.
            # The second step is looked at as all others are; the first one is short.
            turned = after * change < 0 and abs(after) > self.system.tolerances.same
            again = turned or not self._is_steady(point, (1 / 16, 1 / 4), point.index)
            return several if h > (beside if again else self.options.tip) else None
        # Where a corner stays and multipliers move, the parameter's change is rounding.
        moves = max(abs(before), abs(after)) > self.system.tolerances.same
        if before * after < 0 and moves:
            return self._confirmed(*self._turned(point, t), point)
        if self.system.is_sparse:
            return self._flat_sparsely(point, t)
        change_of_index = abs(self.point.index - point.index)
        if change_of_index == 1:
            k = min(self.point.index, point.index)
            return self._confirmed(*self._flattened(point, 0, k), point)
        if not change_of_index and self._same_directions(point):
            twice = (moves and _turns((h * before, h * after), change)) or self._dips(point, t)
            if not twice:
                return None
        if h > beside:
            return several
        branching = branch_point(point)
        return None if branching is None else (0.5, branching.at, Stop.FLAT)

    def _confirmed(self, s: float, at: FritzJohn, point: FritzJohn) -> Found | None:
        """Return an event of a curvature, or a request for shorter steps where it is none.

        None where it is the branch point from which the curve has just come.
        """
        # Else there is another event before.
        parts = (s / 2, 7 * s / 8, 0.999 * s)
        if self.chord(point) > self.system.tolerances.beside and not (
            self._is_steady(point, parts, self.point.index)
            and self._only_one_vanishes(self._between(point, parts[-1]))
        ):
            return 0.5, point, None
        if at.is_fold(self.t):
            return s, at, Stop.FLAT
        found = None if self.system.is_sparse else branch_point(at)
        if found is not None:
            same, beside = self.system.tolerances.same, self.system.tolerances.beside
            if self.length <= beside and np.linalg.norm(found.at.x - self.passed[0].x) <= same:
                return None
            # Near enough to tell by its direction along which curve it is reached.
            chord = self.chord(found.at)
            ahead = 2 * (found.at.x - self.point.x) / chord - self.t
            straight = math.cos(self.options.turn / 2) * float(np.linalg.norm(ahead))
            tangents = curves(found)[0]
            along = max((float(abs(v @ ahead)) for v in tangents), default=math.inf)
            if along >= straight or chord <= 2 * self.system.tolerances.near:
                return s, found.at, Stop.FLAT
            return 0.5, point, None
        if self.chord(point) > self.system.tolerances.beside:
            return 0.5, point, None
        exact = abs(at.left).max() <= self.system.tolerances.zero
        return s, at if exact else self.point, Stop.FLAT

    def _is_first(self, point: FritzJohn, s: float) -> bool:
        if self.chord(point) <= self.system.tolerances.beside:
            return True
        before = self._between(point, 0.999 * s)
        steady = self._is_steady(point, (s / 2, 7 * s / 8), before.index)
        alike = self.system.is_sparse or self._same_directions(before)
        return steady and before.index == self.point.index and alike

    def _is_steady(self, point: FritzJohn, parts: Iterable[float], index: int) -> bool:
        """Whether the index is the given one at parts of the way to a point."""
        return all(self._between(point, s).index == index for s in parts)

    def _flat_sparsely(self, point: FritzJohn, t: Array) -> Found | None:
        """Return where the index changes, by bisection; directions are not looked at."""
        if point.index == self.point.index:
            again = self.chord(point) > self.system.tolerances.beside and self._dips(point, t)
            return (0.5, point, None) if again else None

        def value(s: float) -> tuple[float, FritzJohn]:
            at = self._between(point, s)
            return 1.0 if at.index == self.point.index else -1.0, at

        def enough(_at: FritzJohn, _value: float, left: float) -> bool:
            return left < self.system.tolerances.same

        return self._confirmed(*sign_change(value, enough=enough), point)

    def _same_directions(self, point: FritzJohn) -> bool:
        """Whether the directions of negative curvature turn little on the way to a point."""
        one, two = self.point.falling, point.falling
        return bool(np.linalg.svd(one @ two.T, compute_uv=False).min(initial=1.0) > 0.5)

    def _only_one_vanishes(self, at: FritzJohn) -> bool:
        """Whether none but the curvature that vanishes just beyond a point may have before."""
        curvatures = at.curvatures()
        few = self.system.is_sparse or len(curvatures) < 2
        if few or self.chord(at) <= self.system.tolerances.beside:
            return True
        return not self._dips(at, at.tangent(self.t), besides=int(np.argmin(abs(curvatures))))

    def _dips(self, point: FritzJohn, t: Array, besides: int | None = None) -> bool:
        """Whether a curvature may have touched zero on the way to a point, ``besides`` one.

        That is so where a step has jumped from one curve through a branch point to another.
        """
        h, low = self.chord(point), self.point.curvatures()
        side, high = np.where(low < 0, -1.0, 1.0), point.curvatures()
        bends = self._bending(self.point, self.t), self._bending(point, t)
        f0, f1, out, back = (side * x for x in (low, high, h * bends[0], h * bends[1]))
        if besides is not None:
            f0, f1, out, back = (np.delete(x, besides) for x in (f0, f1, out, back))
        # Tangents show corners of the graph, and curvatures may change their order on the way.
        # They are followed half as far again, as the step may end just beyond the branch point.
        falls, rises = (out < 0) & (f0 + 1.5 * out < 0), (back > 0) & (f1 - 1.5 * back < 0)
        return bool(falls.any() and rises.any())

    def _bending(self, at: FritzJohn, t: Array) -> Array:
        """Return the derivatives of the curvatures along a tangent."""
        d = self.system.tolerances.difference
        ahead = at.moved(at.x + d * t)
        return np.asarray((ahead.curvatures() - at.curvatures()) / d)

    def _turned(self, point: FritzJohn, t: Array) -> tuple[float, FritzJohn]:
        """Return where the parameter turns back on the way to a point."""

        def value(s: float) -> tuple[float, FritzJohn]:
            at = self._between(point, s)
            return float(at.tangent((1 - s) * self.t + s * t)[self.system.n]), at

        return sign_change(value)


def _turns(slopes: tuple[float, float], change: float) -> bool:
    """Whether the cubic on ``[0, 1]`` with slopes of one sign and a change turns in between."""
    first, last = np.sign(slopes[0] + slopes[1]) * np.array(slopes)
    change *= float(np.sign(slopes[0] + slopes[1]))
    # The slope is  first + b s + a s^2.
    a, b = 3 * (first + last - 2 * change), 2 * (3 * change - 2 * first - last)
    return bool(b < 0 < a and -b < 2 * a and first < b * b / (4 * a))


def follow(start: P, direction: Array, options: WalkOptions, extent: float) -> Course[P]:
    """Follow the curve of Fritz John points through a point to the first event.

    It goes along the unit tangent ``direction``, and stops beyond ``extent`` from the start, in
    scale units.
    """
    arc = type(start) is FritzJohn or start.system.is_sparse
    kind: type[_Continuation[Any]] = _ArcContinuation if arc else _Continuation
    return kind(start, direction, options, extent).run()
