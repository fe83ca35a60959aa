"""The smallest repair of a point that is not quite in a set, in exact numbers.

A sequence of linear programmes in doubles, in units of what is still violated, so that residuals of
any size are seen; residuals are computed in balls.  What it finds is proved or refused by
:mod:`~polycorner.proofs.membership`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.optimize import linprog

from polycorner.intervals.balls import ball, exact, middles, precision, solve_exactly
from polycorner.intervals.enclosures import Undecided
from polycorner.intervals.tapes import Box
from polycorner.polyhedra.cones import independent_rows
from polycorner.polyhedra.polyhedron import Piece
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.membership import Bounds, BoxPart, Signs, Violation
from polycorner.proofs.symbols import Symbols, evaluate
from polycorner.proofs.witnesses import Point
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value

MOST_STEPS, MOST_MARGINS, MOST_BRANCHES = 40, 6, 8
DIGITS_A_STEP = 5  # that a linear programme wins at least
MOST_TIGHTENED = 8  # times that inequalities without room become equations
MOST_PARTS = 64  # boxes that are examined to show that a set is empty
ROOM = 1000  # times the least step, that a step may take to lose less energy
FARTHEST = 1_000_000  # units of what is violated, that a step may take
DENOMINATORS = (1, 12, 120, 10_000, 1_000_000)  # of numbers taken for rational coordinates


@dataclass(frozen=True, eq=False)
class _Model(Value):
    """Functions to first order, by unit gradients in scale units, in units of what is violated.

    Columns of its programmes are the step, the energy lost, the largest entry of the step, and the
    margin of all inequalities.
    """

    rows: Array
    levels: Array
    fixed: Array
    offsets: Array
    slope: Array
    low: Array
    high: Array

    def solve(self, goal: int, limits: Mapping[int, tuple[float, float | None]]) -> Any:
        """Return HiGHS's result for the least lost energy (0), step (1) or negative margin (2)."""
        k, n = self.rows.shape
        eye, one, none = np.eye(n), np.ones((n, 1)), np.zeros((n, 1))
        table = np.vstack(
            [
                np.hstack([-self.rows, np.zeros((k, 2)), np.ones((k, 1))]),
                np.hstack([self.slope, [-1.0, 0.0, 0.0]]),
                np.hstack([eye, none, -one, none]),
                np.hstack([-eye, none, -one, none]),
            ]
        )
        cost = np.zeros(n + 3)
        cost[n + goal] = -1.0 if goal == 2 else 1.0
        sides = [*zip(self.low.tolist(), self.high.tolist(), strict=True)]
        most = {0: (0, None), 1: (0, None), 2: (0, 0), **limits}
        fixed = np.hstack([self.fixed, np.zeros((len(self.fixed), 3))])
        return linprog(
            cost, table, np.concatenate([self.levels, np.zeros(2 * n + 1)]),
            fixed if len(fixed) else None, -self.offsets if len(fixed) else None,
            [*sides, *(most[k] for k in range(3))],
            options={"primal_feasibility_tolerance": DEFAULT.feasible},
        )  # fmt: skip

    def step(self, margin: float, room: float) -> Array | None:
        """Return the least step, or the one that loses the least energy within some room."""
        n = self.rows.shape[1]
        limits: dict[int, tuple[float, float | None]] = {2: (margin, margin)}
        found = self.solve(1, limits).x
        if found is None:
            return None
        if self.slope.any():
            limits[1] = (0, max(room * found[n + 1], DEFAULT.zero))
            best = self.solve(0, limits).x
            if best is not None:
                limits[0] = (0, best[n] + DEFAULT.rounding * max(1.0, best[n]))
                least = self.solve(1, limits).x
                found = best if least is None else least
        return np.asarray(found[:n])


class Repair:
    """The search for a point of a set near a given one.

    Parameters
    ----------
    place : Signs
        The set and the energy.
    given : tuple of Fraction
        The given point.
    within : Fraction
        The largest change of a coordinate, in scale units.
    digits : int
        Digits up to which the repair is the smallest.
    costly : bool
        Whether the energy that is lost matters.
    """

    def __init__(
        self, place: Signs, given: Point, within: Fraction, digits: int, *, costly: bool
    ) -> None:
        self.place, self.given, self.within, self.costly = place, given, within, costly
        self.steps = MOST_STEPS + digits // DIGITS_A_STEP
        self.target = min(Fraction(1, 10**digits), within / 1000)

    def _values(self) -> list[float]:
        """Return all values at the given point, in doubles."""
        values: list[float] = self.place.problem.evaluate(_doubles(self.given), 0)[0].tolist()
        return values

    def run(self) -> tuple[Bounds, ...]:
        """Return bounds of the coordinates of a point of the set, or nothing."""
        values = self._values()
        if not np.isfinite(values).all():
            return ()
        branches = self.place.polyhedron.selections(values[: len(self.place.inequalities)])
        found = (self._in_branch(piece) for piece in branches[:MOST_BRANCHES])
        return next((region for region in found if region), ())

    def _in_branch(self, piece: Piece) -> tuple[Bounds, ...]:
        q, room, margins = self.given, float(ROOM), 0
        tight: frozenset[int] = frozenset()
        values, unit = self._misses(q, piece)
        for _ in range(self.steps):
            if unit is None:
                return ()
            if self._lies_in(q):
                return tuple([(x, x) for x in q])
            fine = unit <= self.target or room < 1
            scale = unit
            if fine:
                scale = (unit if q == self.given else max(unit, self.target)) * 10**margins
                margins += 1
            moved, tight = self._moved(q, piece - tight, tight, values, scale, room, fine=fine)
            if moved is None:
                return ()
            if fine:
                region = self._settled(moved, tight, ROOM * scale)
                if region or margins > MOST_MARGINS:
                    return region
                continue
            after, left = self._misses(moved, piece)
            if left is not None and left <= unit / 2:
                q, values, unit = moved, after, left
            else:
                room /= 10
        return ()

    def _misses(self, q: Point, piece: Piece) -> "tuple[dict[int, Any], Fraction | None]":
        """Return values, and a power of two above what functions miss over their gradients."""
        place = self.place
        rows = [*sorted(piece), *place.equations]
        sizes = np.linalg.norm(self._gradients(q)[rows], axis=1)
        with precision(place.bits):
            values = place.formulas.values(Box([ball(x) for x in q]), rows)
            worst = ball(0)
            for row, value, size in zip(rows, values, sizes.tolist(), strict=True):
                off = abs(value) if row in place.equations else (-value).max(ball(0))
                if not (off.is_finite() and np.isfinite(size)):
                    return {}, None
                if size > 0:
                    worst = worst.max((off / ball(size)).upper())
            most = exact(worst.upper())
        power = most.numerator.bit_length() - most.denominator.bit_length() + 1
        unit = Fraction(2) ** power if most else self.target
        return dict(zip(rows, values, strict=True)), unit

    def _gradients(self, q: Point) -> Array:
        return self.place.problem.evaluate(_doubles(q), 1)[1]

    def _lies_in(self, q: Point) -> bool:
        away = zip(q, self.given, self.place.scales, strict=True)
        if any(abs(x - y) > self.within * s for x, y, s in away):
            return False
        return bool(self.place.holds(self.place.signs(q)))

    def _moved(
        self,
        q: Point,
        piece: Piece,
        tight: frozenset[int],
        values: Mapping[int, Any],
        unit: Fraction,
        room: float,
        *,
        fine: bool,
    ) -> tuple[Point | None, frozenset[int]]:
        """Return the point after a step, and the inequalities that leave no room inside."""
        model, rows = self._model(q, piece, tight, values, unit)
        margin = 0.0
        for _ in range(MOST_TIGHTENED if fine else 0):
            found = model.solve(2, {2: (0, 1)})
            if found.x is None:
                return None, tight
            margin = float(found.x[-1]) / 2
            if margin > DEFAULT.same:
                break
            duals = found.ineqlin.marginals[: len(rows)]
            pressed = {i for i, y in zip(rows, duals.tolist(), strict=True) if y < -DEFAULT.rank}
            if not pressed:
                return None, tight
            tight |= pressed
            model, rows = self._model(q, piece - tight, tight, values, unit)
        step = model.step(margin, max(room, 1.0))
        if step is None:
            return None, tight
        moved = []
        for x, d, s in zip(q, step.tolist(), self.place.scales, strict=True):
            grid = Fraction(10) ** _power_of_ten((unit if fine else self.target) * s / 1000)
            moved.append(grid * round((x + Fraction(d) * unit * s) / grid) if d else x)
        return tuple(moved), tight

    def _model(
        self,
        q: Point,
        piece: Piece,
        tight: frozenset[int],
        values: Mapping[int, Any],
        unit: Fraction,
    ) -> tuple[_Model, list[int]]:
        gradients = self._gradients(q)
        sizes = np.linalg.norm(gradients, axis=1)
        units = gradients / np.where(sizes > 0, sizes, 1.0)[:, None]
        low, high = (np.array(side) for side in self._room(q, unit))
        reach = abs(units) @ np.maximum(abs(low), abs(high))

        def level(row: int) -> float:
            with precision(self.place.bits):
                return float((values[row] / ball(sizes[row]) / ball(unit)).mid())

        levels = {i: level(i) for i in (*piece, *tight, *self.place.equations) if sizes[i] > 0}
        rows = [i for i in sorted(piece) if i in levels and levels[i] <= reach[i] + 1]
        fixed = [i for i in (*sorted(tight), *self.place.equations) if i in levels]
        model = _Model(
            rows=units[rows],
            levels=np.array([levels[i] for i in rows]),
            fixed=units[fixed],
            offsets=np.array([levels[i] for i in fixed]),
            slope=units[-1] if self.costly else np.zeros(len(low)),
            low=low,
            high=high,
        )
        return model, rows

    def _room(self, q: Point, unit: Fraction) -> Iterator[list[float]]:
        """Yield how far coordinates may decrease and increase, less a little for rounding."""
        reach = self.within - self.target
        for sign in (-1, 1):
            away = zip(q, self.given, self.place.scales, strict=True)
            room = ((sign * reach + (g - x) / s) / unit for x, g, s in away)
            yield [float(max(Fraction(-FARTHEST), min(x, Fraction(FARTHEST)))) for x in room]

    # ---------------------------------------------------------------- points of equations

    def _settled(self, q: Point, tight: frozenset[int], near: Fraction) -> tuple[Bounds, ...]:
        """Return a point near ``q`` at which equations and inequalities without room vanish."""
        held = [*sorted(tight), *self.place.equations]
        if held:
            gradients = self._gradients(q)[held]
            sizes = np.linalg.norm(gradients, axis=1)
            units = gradients / np.where(sizes > 0, sizes, 1.0)[:, None]
            held = sorted(held[i] for i in independent_rows(units, DEFAULT.rank))
        for p in self._rational(q, held, near):
            if self._lies_in(p):
                return tuple([(x, x) for x in p])
        region = self.place.enclosed(q, held) if held else ()
        sides = zip(region, self.given, self.place.scales, strict=bool(region))
        if any(max(abs(a - x), abs(b - x)) > self.within * s for (a, b), x, s in sides):
            return ()
        return region

    def _rational(self, q: Point, held: Sequence[int], near: Fraction) -> Iterator[Point]:
        """Yield rational points that may be zeros of some functions."""
        yield q
        if held:
            newton = self._exact_step(q, held)
            if newton is not None:
                yield newton
            for most in DENOMINATORS:
                p = tuple([x.limit_denominator(most) for x in q])
                away = zip(p, q, self.place.scales, strict=True)
                if all(abs(x - y) <= near * s for x, y, s in away):
                    yield p

    def _exact_step(self, q: Point, held: Sequence[int]) -> Point | None:
        """Return the point after Newton's step in exact numbers, final for affine functions."""
        place, n = self.place, len(q)
        with precision(place.bits):
            forms = place.formulas.smooth(Box([ball(x) for x in q]), held)
            if isinstance(forms, Undecided):
                return None
            slopes = [forms.graph.derivative(f, j) for f in forms.outputs for j in range(n)]
            inputs = [algebra.number(x) for x in q]
            found = evaluate(forms.graph, [*forms.outputs, *slopes], inputs, Symbols())
        numbers = [None if p is None else algebra.constant(p) for p in found]
        if any(x is None for x in numbers):
            return None
        exactly = [x for x in numbers if x is not None]
        k = len(held)
        table = np.array([float(x) for x in exactly[k:]]).reshape(k, n)
        columns = independent_rows((table * place.problem.scales).T, DEFAULT.rank)
        rows = [[exactly[k + n * i + j] for j in columns] for i in range(k)]
        step = solve_exactly(rows, exactly[:k]) if len(columns) == k else None
        if step is None:
            return None
        moved = list(q)
        for j, x in zip(columns, step, strict=True):
            moved[j] -= x
        return tuple(moved)

    def violations(self, signs: Mapping[int, int], digits: int) -> tuple[Violation, ...]:
        """Return what the given point violates, in the branch that fails least."""
        values = self._values()[: len(self.place.inequalities)]
        piece = self.place.polyhedron.selections(values)[0]
        rows = [i for i in sorted(piece) if signs.get(i, 0) < 0]
        rows += [i for i in self.place.equations if signs.get(i, 0)]
        return self.place.violations(self.given, rows, digits)

    # ---------------------------------------------------------------------------- empty boxes

    def empty(self) -> tuple[str, ...]:
        """Return functions that do not hold together in the box, if that is shown."""
        sides = zip(self.given, self.place.scales, strict=True)
        waiting = [[(x - self.within * s, x + self.within * s) for x, s in sides]]
        used: set[int] = set()
        for _ in range(MOST_PARTS):
            if not waiting:
                names = self.place.formulas.names
                return tuple([names[i] for i in sorted(used)])
            box = waiting.pop()
            with precision(self.place.bits):
                part = self.place.part(box)
                refuted = [self._refuted(part, rows) for rows in part.pieces]
            if all(isinstance(some, list) for some in refuted):
                used |= {i for some in refuted if isinstance(some, list) for i in some}
                continue
            j = next(j for j in refuted if isinstance(j, int))
            low, high = box[j]
            halves = ((low, (low + high) / 2), ((low + high) / 2, high))
            waiting += [[*box[:j], half, *box[j + 1 :]] for half in halves]
        return ()

    def _refuted(self, part: BoxPart, rows: list[int]) -> list[int] | int:
        """Return functions that do not hold together in a box, or where to divide it."""
        one = part.violated(rows)
        if one is not None:
            return [one]
        kept, forms = part.smooth(rows)
        values, _ = forms.evaluate(Box(part.centre), 1)
        _, gradients = forms.evaluate(part.box, 1)
        halves = np.array([float(half) for half in part.halves])
        middle = middles(gradients)
        middle = middle.reshape(len(kept), len(halves)) * halves
        spread = np.array([[float(x.rad()) for x in row] for row in gradients])
        spread = spread.reshape(middle.shape) * halves
        sizes = np.linalg.norm(middle, axis=1)
        if not np.isfinite(spread.sum() + sizes.sum()) or not sizes.any():
            return int(halves.argmax())
        sizes[sizes == 0] = 1.0
        levels = middles(values) / sizes
        both = [i for i, row in enumerate(kept) if row in self.place.equations]
        table = np.vstack([middle / sizes[:, None], -(middle / sizes[:, None])[both]])
        heights = np.concatenate([levels, -levels[both]])
        n = len(halves)
        found = linprog(
            np.append(np.zeros(n), -1.0),
            np.hstack([-table, np.ones((len(table), 1))]), heights,
            bounds=[(-1, 1)] * n + [(None, 1)],
            options={"primal_feasibility_tolerance": DEFAULT.feasible},
        )  # fmt: skip
        if found.x is None:
            return int(halves.argmax())
        duals = -found.ineqlin.marginals
        duals[duals < DEFAULT.rank * duals.max(initial=0.0)] = 0.0
        weights = duals[: len(kept)]
        weights[both] -= duals[len(kept) :]
        weights /= sizes
        if part.refutes(kept, forms, [Fraction(w) for w in weights.tolist()]):
            return [row for row, w in zip(kept, weights.tolist(), strict=True) if w]
        return int((abs(weights) @ spread).argmax())


def _doubles(q: Point) -> Array:
    """Return the nearest doubles, infinite where there are none."""
    most = Fraction(np.finfo(np.float64).max)
    return np.array([float(x) if abs(x) <= most else np.inf for x in q])


def _power_of_ten(x: Fraction) -> int:
    """Return the exponent of a power of ten at most as large as a positive number."""
    power = (x.numerator.bit_length() - x.denominator.bit_length()) * 30103 // 100000 + 1
    while Fraction(10) ** power > x:
        power -= 1
    return power
