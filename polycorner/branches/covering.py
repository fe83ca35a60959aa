"""Boxes of coordinates and the parameter that hold no equilibria but those on known curves.

A box is closed for a face ``A`` if some direction decreases the energy and increases all functions
of ``A`` on the whole box (:mod:`~polycorner.proofs.lists.directions`), as then no positive
multipliers on ``A`` relate the gradients; or if all solutions with such multipliers lie where a
tube shows that there are no others (:meth:`~polycorner.branches.tubes.Tube.covers`).  By
Caratheodory's theorem every equilibrium has positive multipliers on a face with independent
gradients: a box is closed if it is for all sets of at most ``n`` functions that may vanish in it.
A direction for a set serves its subsets.

At an event curves of several faces cross, of which only parts are equilibria.  A tube about the
event counts where everything that vanishes there is shown to be monotone along it: on one side it
is then infeasible, and on the other the arc that leaves, if nothing else vanishes along the tube.
"""

import math
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from polycorner.branches.enclosed_arcs import Watched
from polycorner.branches.enclosed_events import EnclosedEvent, Through, about_event
from polycorner.branches.pitchforks import Pitchfork
from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.system import Face
from polycorner.branches.tubes import CurveSystem, Setting, Tube
from polycorner.intervals.balls import (
    Ball,
    ball,
    between,
    column,
    constant,
    entries,
    identity,
    left_inverse,
    matrix,
    middles,
    midpoints,
)
from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Undecided
from polycorner.minimisation.problem import Problem
from polycorner.progress import Progress
from polycorner.proofs.files import period
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.faces import outward
from polycorner.proofs.lists.intermediate import directions
from polycorner.spaces.manifold import Array


def event_tubes(
    setting: Setting, event: EnclosedEvent, watched: Watched, options: BranchProofOptions
) -> Iterator[Tube]:
    """Yield tubes about an event, one for each face, the widest that are shown."""
    for curve in event.curves:
        reach = options.widest
        for _ in range(options.halvings):
            found = _about(setting, curve, watched, reach, options.bits)
            if found is not None:
                yield found
                break
            reach /= 2


def _about(
    setting: Setting, curve: Through, watched: Watched, reach: float, bits: int
) -> Tube | None:
    system = CurveSystem(setting, curve.face)
    middle = middles(curve.at)
    found = about_event(system, middle, curve.direction, reach, bits)
    if isinstance(found, Undecided) or not found.contains(curve.at):
        return None
    values = watched.values(found)
    functions = values[: watched.energy + 1]
    if any(x < 0 for x in functions):
        return found
    rates = [watched.rate(found, k) for k in curve.weak]
    known = [r for r in rates if r is not None and not r.contains(0)]
    if len(known) < len(rates):
        return None
    if len({bool(r > 0) for r in known}) > 1:  # no side is feasible
        return found
    return found if all(x > 0 for k, x in enumerate(functions) if k not in curve.weak) else None


class Cover:
    """Branch and bound over a box of coordinates and the interval of the parameter."""

    def __init__(
        self,
        setting: Setting,
        lifted: Problem,
        tubes: Sequence[Tube | Pitchfork],
        sides: tuple[Array, Array],
        options: BranchProofOptions,
    ) -> None:
        self.setting, self.options, self.sides = setting, options, sides
        self.m, self.n = setting.inequalities, setting.n
        self.equations = lifted.rows - 1 - self.m
        self.functions = BoxFunctions(lifted.functions, lifted.polyhedron.manifold)
        self.periods = lifted.polyhedron.manifold.periods[: self.n]
        self.units = np.append(setting.units[: self.n], (sides[1][-1] - sides[0][-1]) / 5)
        # Boxes by size: met, looked at with the tubes, and closed or narrowed there.
        self.met, self.tried, self.gained = Counter[int](), Counter[int](), Counter[int]()
        self.tubes: dict[Face, list[tuple[Tube | Pitchfork, Array, Array]]] = {}
        for one in tubes:
            hull = [*one.solution[: self.n], setting.time(one.solution[self.n :])]
            ends = np.array([[float(x.lower()), float(x.upper())] for x in hull]).T
            self.tubes.setdefault(one.face, []).append((one, *ends))

    def run(self, progress: Progress) -> Array:
        """Return the boxes that are left open, ``(k, 2, n + 1)``."""
        waiting = [np.stack([side[None] for side in self.sides])[:, 0]]
        left: list[Array] = []
        seen, started = 0, time.monotonic()
        while waiting:
            if (
                seen >= self.options.max_boxes
                or time.monotonic() - started > self.options.max_seconds
            ):
                left += waiting
                break
            some = np.array(waiting[-self.options.at_once :])
            del waiting[-self.options.at_once :]
            seen += len(some)
            for box in self._open(some):
                widths = (box[1] - box[0]) / self.units
                k = int(widths.argmax())
                if widths[k] <= self.options.resolution:
                    left.append(box)
                    continue
                middle = (box[0, k] + box[1, k]) / 2
                for side in (0, 1):
                    half = box.copy()
                    half[1 - side, k] = middle
                    waiting.append(half)
            progress(float(seen), None, f"{len(waiting)} boxes wait")
        return np.array(left).reshape(len(left), 2, self.n + 1)

    def _sides(self, boxes: Array) -> tuple[Array, Array]:
        """Return the boxes with the formulas' parameters in place of the parameter."""
        low, high = boxes[:, 0], boxes[:, 1]
        parts = []
        for a, r in zip(self.setting.start, self.setting.rates, strict=True):
            ends = np.array(
                [[_outward(a + Fraction(t) * r) for t in row] for row in boxes[:, :, -1]]
            )
            parts.append((ends.min(axis=(1, 2)), ends.max(axis=(1, 2))))
        lows, highs = (np.array(side).T for side in zip(*parts, strict=True))
        return np.hstack([low[:, :-1], lows]), np.hstack([high[:, :-1], highs])

    def _open(self, boxes: Array) -> Iterator[Array]:
        """Yield those boxes that are not closed, or what is left of them."""
        m, k = self.m, self.equations
        lower, upper = self._sides(boxes)
        v_lo, v_hi, g_lo, g_hi = self.functions.gradients(lower, upper, monotone=True)
        meets = ((v_lo[:, m : m + k] <= 0) & (v_hi[:, m : m + k] >= 0)).all(axis=1)
        meets &= ~(v_hi[:, :m] < 0).any(axis=1)
        open_ = np.flatnonzero(meets)
        masks: Mask = np.logical_not(v_lo[:, :m] > 0)
        smooth: Mask = np.all(self.functions.continuous(lower, upper), axis=1)
        for sharp in (False, True):
            if sharp and open_.size:
                g_lo[open_], g_hi[open_] = self.functions.mean_value_gradients(
                    lower[open_], upper[open_]
                )
            found = self._directed((g_lo, g_hi), open_, masks[open_])
            open_ = open_[~(found & smooth[open_])]
        for b in open_.tolist():
            slopes = g_lo[b : b + 1], g_hi[b : b + 1]
            left: Array | None = boxes[b]
            size = math.frexp(float(((boxes[b, 1] - boxes[b, 0]) / self.units).max()))[1]
            if smooth[b] and self._is_worth_it(size):
                left = self._left(boxes[b], lower[b], upper[b], slopes, masks[b])
                self.gained[size] += left is None or bool((left != boxes[b]).any())
            if left is not None:
                yield left

    def _is_worth_it(self, size: int) -> bool:
        """Whether a box is worth being looked at with the tubes, by its size as a power of two.

        All are at first; of a size of which that has brought something too seldom, some.
        """
        self.met[size] += 1
        seldom = self.options.patience
        often = self.tried[size] <= seldom * max(1, self.gained[size])
        if not often and self.met[size] % seldom:
            return False
        self.tried[size] += 1
        return True

    def _directed(self, slopes: tuple[Array, Array], where: NDArray[np.intp], masks: Mask) -> Mask:
        own = tuple(np.ascontiguousarray(g[:, :, : self.n]) for g in slopes)
        units = np.array(self.setting.units[: self.n])
        found, _, _ = directions((own[0], own[1]), where, masks, self.equations, units, -1.0)
        return found

    def _left(
        self, box: Array, lower: Array, upper: Array, slopes: tuple[Array, Array], mask: Array
    ) -> Array | None:
        """Return a box with all equilibria of a box that may not lie on known curves, or None."""
        may = np.flatnonzero(mask).tolist()
        if len(may) > self.options.most_open:
            return box
        sizes = range(min(len(may), self.n - len(self.setting.equations)) + 1)
        faces = [face for size in sizes for face in combinations(may, size)]
        masks = np.zeros((len(faces), self.m), dtype=np.bool_)
        for row, face in zip(masks, faces, strict=True):
            row[list(face)] = True
        found = self._directed(slopes, np.zeros(len(faces), dtype=np.intp), masks)
        hull = [between(a, b) for a, b in zip(lower.tolist(), upper.tolist(), strict=True)]
        left: list[Array] = []
        for face in (faces[k] for k in np.flatnonzero(~found)):
            x = self._narrowed(face, hull)
            if x is None:
                return box
            if x and not any(t.covers(self._turned(x, t)) for t in self._near(face, x)):
                left.append(self._sharp(x))
        if not left:
            return None
        every = np.array(left)
        ends = (
            np.maximum(every[:, 0].min(axis=0), box[0]),
            np.minimum(every[:, 1].max(axis=0), box[1]),
        )
        return np.array(ends)

    def _sharp(self, x: "list[Ball]") -> Array:
        """Return the box of coordinates and parameter of some unknowns."""
        setting = self.setting
        ends = [outward(b) for b in (*x[: self.n], setting.time(x[self.n : len(setting.units)]))]
        return np.array(ends).T

    def _narrowed(self, face: Face, hull: "list[Ball]") -> "list[Ball] | None":
        """Enclose the solutions of a face's equations in a box; empty if none, None if unbounded.

        For any matrix ``Y`` they are in ``c - Y F(c) + (I - Y J) (X - c)``.
        """
        mu = self._multipliers(face, hull)
        if not mu:
            return mu
        system, x = CurveSystem(self.setting, face).coordinate(0), [*hull, *mu]
        for _ in range(self.options.narrowings):
            linear, centre = system.at(x), midpoints(x)
            there = system.at(centre)
            if isinstance(linear, Undecided) or isinstance(there, Undecided):
                return x
            rows = linear.jacobian[:-1]
            units = np.array(system.units)
            middle = middles(rows) * units
            if not np.isfinite(middle).all():
                return x
            backwards = matrix((np.linalg.pinv(middle) * units[:, None]).tolist())
            away = column([a - c for a, c in zip(x, centre, strict=True)])
            moved = (
                -(backwards * column(there.residual[:-1]))
                + (identity(len(x)) - backwards * matrix(rows)) * away
            )
            new = _common(x, [c + y for c, y in zip(centre, entries(moved), strict=True)])
            if not new:
                return []
            gain = max(
                float(a.rad()) / max(float(b.rad()), np.finfo(float).tiny)
                for a, b in zip(new, x, strict=True)
            )
            x = new
            if gain > self.options.gain:
                break
        return x

    def _near(self, face: Face, x: "list[Ball]") -> list[Tube | Pitchfork]:
        """Return the tubes of a face that meet a box."""
        found, box = list[Tube | Pitchfork](), self._sharp(x)
        for one, low, high in self.tubes.get(face, []):
            shift = np.zeros(self.n + 1)
            for i, p in enumerate(self.periods):
                if np.isfinite(p):
                    shift[i] = p * np.rint((low[i] + high[i] - box[0, i] - box[1, i]) / 2 / p)
            if (box[0] + shift <= high).all() and (box[1] + shift >= low).all():
                found.append(one)
        return found

    def _turned(self, hull: "list[Ball]", one: Tube | Pitchfork) -> "list[Ball]":
        """Return a box with whole turns added around circles, to where a tube is."""
        result = list(hull)
        for i, p in enumerate(self.periods):
            if np.isfinite(p):
                turns = round(float(one.solution[i].mid() - hull[i].mid()) / p)
                result[i] += turns * _period(p)
        return result

    def _multipliers(self, face: Face, hull: "list[Ball]") -> "list[Ball] | None":
        """Enclose multipliers, of sum 1, on a box; empty if there are none, None if unbounded."""
        system = CurveSystem(self.setting, face).coordinate(0)
        linear = system.at([*hull, *[ball(0)] * len(system.rows)])
        if isinstance(linear, Undecided):
            return None
        n, d = self.n, system.dimension
        rows = [*(row[d:] for row in linear.jacobian[:n]), linear.jacobian[-2][d:]]
        left = left_inverse(rows)
        if left is None:
            return None
        base = entries(left * column([*[ball(0)] * n, ball(1)]))
        off = (identity(len(base)) - left * matrix(rows)).tolist()
        norm = max(sum((abs(x) for x in row), ball(0)).upper() for row in off)
        signed = [row not in self.setting.equations for row in system.rows]
        unit = ball(0.5, 0.5)
        if norm < 1:
            most = max(abs(x).upper() for x in base) / (1 - norm)
            mu = [unit if sign else ball(0, most.upper()) for sign in signed]
        elif all(signed):
            mu = [unit] * len(base)
        else:
            return None
        moved = entries(matrix(off) * column(mu))
        return _common(mu, [b + x for b, x in zip(base, moved, strict=True)])


def _common(one: "Sequence[Ball]", two: "Sequence[Ball]") -> "list[Ball]":
    """Return the intersection of two boxes; empty if they have none."""
    pairs = list(zip(one, two, strict=True))
    return [a.intersection(b) for a, b in pairs] if all(a.overlaps(b) for a, b in pairs) else []


def _period(value: float) -> "Ball":
    """Return a finite period exactly."""
    share, *unit = (period(value) or "").split()
    return ball(Fraction(share)) * (constant("pi") if unit else ball(1))


def _outward(x: Fraction) -> tuple[float, float]:
    near = float(x)
    exact = Fraction(near) == x
    return (near, near) if exact else (np.nextafter(near, -np.inf), np.nextafter(near, np.inf))
