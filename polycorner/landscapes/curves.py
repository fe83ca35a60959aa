"""Short curves on faces and straight pieces of paths, verified in ball arithmetic.

**Curves.**  Let ``p`` be an enclosed point where some functions ``f_H`` vanish, ``d`` a vector and
``N`` a matrix with ``f_H' N`` regular on ``Q``, a box that contains ``p + t d + N y`` for
``0 <= t <= T`` and ``|y_j| <= rho_j``.  On ``Q`` let ``Y'`` enclose ``-(f_H' N)^-1 f_H' d``.  If
``T |Y'_j| < rho_j``, the equation ``f_H(p + t d + N y) = 0`` has a solution ``y(t)`` with
``y(0) = 0`` that stays in ``Q``, because it solves ``y' = -(f_H' N)^-1 f_H' d`` and is too slow to
leave.  The curve ``c(t) = p + t d + N y(t)`` has the tangent ``d + N y'``, which is enclosed on
``Q``, and

``(E o c)'' = c'^T (E'' - sum lam_i f_i'') c'``, where ``lam f_H' N = E' N``.

If ``p`` is a KKT point of ``f_H`` and this is negative on ``Q``, then ``E < E(p)`` along the
curve, but for its start, and the curve leaves along a direction in which the Lagrangian's Hessian
is negative on the face: where its index is 1, those for ``d`` and for ``-d`` are on the two sides.

**Straight pieces.**  On ``a + t (b - a)`` let ``|s| <= S`` for the second derivative ``s`` of a
function along it.  Then ``f >= (1-t) f(a) + t f(b) - S t (1-t) / 2``.  With equations the piece is
a guide only: where ``h(a + t (b - a) + x + N y) = 0`` has exactly one solution ``|y_j| <= rho_j``
for all ``t`` and all ``|x_i| <= r``, the solutions are connected, and bounds are those along the
straight piece, changed by at most ``sum_j |f' N_j| rho_j``.  Pieces follow each other where a
solution for the end of one is one for the start of the next, as vertices differ from solutions by
less than ``r``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from polycorner.intervals.balls import Ball, ball, balls, dot, matrix, middles, precision, square
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation.problem import Problem
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value, cached_property

BITS = 106
MOST_HALVINGS = 6  # of a straight piece before it is given up


@dataclass(frozen=True, eq=False)
class Spot(Value):
    """An enclosed point of the set.

    Attributes
    ----------
    box : tuple of Ball
        It contains the point.
    zeros : frozenset of int
        Inequalities that vanish there.
    top : float
        An upper bound of the energy on the curve that ends there.
    """

    box: "tuple[Ball, ...]"
    zeros: frozenset[int]
    top: float = inf

    @cached_property
    def middle(self) -> Array:
        """A point near it, ``(n,)``."""
        return middles(self.box)


class Curves:
    """Verified pieces of paths in the set of a problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.m, self.n = problem.inequalities, problem.dimension
        self.formulas = Formulas(problem.functions, problem.polyhedron.manifold)
        self.equations = tuple(range(self.m, problem.rows - 1))
        self.energy = problem.rows - 1
        # Vertices of paths and points of the set differ by no more than this.
        self.off = DEFAULT.rounding * problem.scales

    def value(self, box: "Sequence[Ball]") -> "Ball":
        """Return the energy on a box."""
        return self.formulas.values(Box(list(box)), [self.energy])[0]

    def lows(self, box: "Sequence[Ball]") -> Array:
        """Return lower bounds of the inequalities on a box, ``(m,)``."""
        values = self.formulas.values(Box(list(box)), range(self.m))
        return np.array([float(v.lower()) if v.is_finite() else -np.inf for v in values])

    # ---------------------------------------------------------------------------- curves on faces

    def curve(
        self,
        start: Spot,
        held: frozenset[int],
        along: Array,
        length: float,
        *,
        bent: bool = False,
        rising: frozenset[int] = frozenset(),
        ceiling: "Ball | None" = None,
    ) -> Spot | None:
        """Return the end of a curve from a point, if it is verified.

        Parameters
        ----------
        start : Spot
        held : frozenset of int
            Inequalities that stay 0; the equations do so in any case.
        along : (n,) array
            ``d``.
        length : float
            ``T``.
        bent : bool
            The start is a KKT point of what is held, and the energy shall curve downwards.
        rising : frozenset of int
            Other inequalities that vanish at the start and shall increase.
        ceiling : Ball, optional
            What the energy shall stay below; not needed if ``bent``.  Without it and without
            ``bent`` the energy shall decrease from the start.
        """
        rows = (*sorted(held), *self.equations)
        with precision(BITS):
            frame = self._frame(start.middle, rows)
            if frame is None:
                return None
            ends = self._ends(start, rows, frame, along, length)
            if ends is None:
                return None
            y, rho = ends
            hull = [
                x + ball(length / 2, length / 2) * float(d)
                + dot([ball(0, r) for r in rho], [ball(c) for c in line])
                for x, d, line in zip(start.box, along.tolist(), frame.tolist(), strict=True)
            ]  # fmt: skip
            tangent = self._tangent(hull, rows, frame, along, length, rho, bent)
            if tangent is None:
                return None
            speed, bend = tangent
            if not self._descends(hull, speed, bend, bent, ceiling):
                return None
            if not self._rise(hull, speed, sorted(rising)):
                return None
            lows = self.lows(hull)
            lows[[*held, *rising]] = 0.0
            if not self.problem.polyhedron.implicit_of(lows) >= 0:
                return None
            end = self._end(start, rows, frame, along, length, y, rho, held)
            if end is None or not all(
                float(x.rad()) <= off / 2 for x, off in zip(end.box, self.off, strict=True)
            ):
                return None
            return replace(end, top=above(self.value(hull)))

    def _frame(self, q: Array, rows: Sequence[int]) -> Array | None:
        """Return ``N``, ``(n, k)``, with ``f_H' N`` near the unit matrix."""
        slopes = self.problem.evaluate(q, 1)[1][list(rows)]
        if not np.isfinite(slopes).all():
            return None
        return np.asarray(np.linalg.pinv(slopes) * self.problem.scales[:, None])

    def _ends(
        self, start: Spot, rows: Sequence[int], frame: Array, along: Array, length: float
    ) -> tuple[Array, list[float]] | None:
        """Return ``y(T)`` and reaches ``rho``, guessed by Newton's method."""
        y = np.zeros(len(rows))
        for _ in range(12):
            values = self.problem.evaluate(start.middle + length * along + frame @ y, 0)[0]
            step = values[list(rows)]
            if not np.isfinite(step).all():
                return None
            y -= step
        sizes = abs(frame).max(axis=0, initial=0.0)
        least = DEFAULT.rounding * self.problem.scales.max() / np.where(sizes > 0, sizes, 1.0)
        # One component may be small by chance at the end: bounds of all depend on the largest.
        widest = (abs(y) * sizes).max(initial=0.0) / np.where(sizes > 0, sizes, 1.0)
        return y, (4.0 * widest + least).tolist()

    def _tangent(
        self,
        hull: "list[Ball]",
        rows: Sequence[int],
        frame: Array,
        along: Array,
        length: float,
        rho: Sequence[float],
        bent: bool,
    ) -> "tuple[list[Ball], Ball | None] | None":
        """Return enclosures of the tangent, and of the energy's second derivative if asked for."""
        forms = self.formulas.smooth(Box(hull), (*rows, self.energy))
        if isinstance(forms, Undecided):
            return None
        found = forms.evaluate(Box(hull), 2 if bent else 1)
        gradients, d = found[1], balls(along)
        columns = [[ball(x) for x in column] for column in frame.T.tolist()]
        k, speed = len(rows), d
        inverse = None
        if k:
            inverse = _inverse([[dot(g, c) for c in columns] for g in gradients[:k]])
            if inverse is None:
                return None
            drift = [dot(line, [-dot(g, d) for g in gradients[:k]]) for line in inverse]
            if not all(abs(length * y) < r for y, r in zip(drift, rho, strict=True)):
                return None
            speed = [x + dot(drift, [c[i] for c in columns]) for i, x in enumerate(d)]
        if not bent:
            return speed, None
        pulls = [dot(gradients[k], c) for c in columns]
        lam = [dot(pulls, [line[j] for line in inverse]) for j in range(k)] if inverse else []
        weights = [*(-x for x in lam), ball(1)]
        total = ball(0)
        for w, hessian in zip(weights, found[2], strict=True):
            total += w * dot(speed, [dot(line, speed) for line in hessian])
        return speed, total

    def _descends(
        self,
        hull: "list[Ball]",
        speed: "list[Ball]",
        bend: "Ball | None",
        bent: bool,
        ceiling: "Ball | None",
    ) -> bool:
        if bent:
            return bend is not None and bool(bend < 0)
        if ceiling is not None:
            return bool(self.value(hull) < ceiling)
        return self._rise(hull, [-v for v in speed], [self.energy])

    def _rise(self, hull: "list[Ball]", speed: "list[Ball]", rows: Sequence[int]) -> bool:
        """Whether functions increase along a curve on a box."""
        if not rows:
            return True
        forms = self.formulas.smooth(Box(hull), rows)
        if isinstance(forms, Undecided):
            return False
        return all(bool(dot(g, speed) > 0) for g in forms.evaluate(Box(hull), 1)[1])

    def _end(
        self,
        start: Spot,
        rows: Sequence[int],
        frame: Array,
        along: Array,
        length: float,
        y: Array,
        rho: Sequence[float],
        held: frozenset[int],
    ) -> Spot | None:
        """Return the end of a curve that is shown to exist."""
        base = [x + length * ball(d) for x, d in zip(start.box, along.tolist(), strict=True)]

        def at(offsets: "Sequence[Ball]") -> "list[Ball]":
            lines = frame.tolist()
            return [
                b + dot(offsets, [ball(c) for c in line])
                for b, line in zip(base, lines, strict=True)
            ]

        if not rows:
            return Spot(tuple(base), held)
        middle = balls(y)
        residual = self.formulas.values(Box(at(middle)), rows)
        reach = [
            ball(0, 4 * abs(r).upper() + ball(2) ** (8 - BITS) * ball(size))
            for r, size in zip(residual, rho, strict=True)
        ]
        box = at([a + b for a, b in zip(middle, reach, strict=True)])
        forms = self.formulas.smooth(Box(box), rows)
        if isinstance(forms, Undecided):
            return None
        gradients = forms.evaluate(Box(box), 1)[1]
        columns = [[ball(x) for x in column] for column in frame.T.tolist()]
        image = []
        for j, g in enumerate(gradients):
            apart = [dot(g, c) - int(i == j) for i, c in enumerate(columns)]
            image.append(-residual[j] - dot(apart, reach))
        if not all(r.contains_interior(x) for r, x in zip(reach, image, strict=True)):
            return None
        sharp = [a + b for a, b in zip(middle, image, strict=True)]
        if not all(abs(x) < r for x, r in zip(sharp, rho, strict=True)):
            return None
        return Spot(tuple(at(sharp)), held)

    # ----------------------------------------------------------------------------- straight pieces

    def straight(
        self, a: Array, b: Array, ceiling: "Ball", halvings: int = MOST_HALVINGS
    ) -> list[Array] | None:
        """Return points from ``a`` to ``b``, the first left out, if a path near them is verified.

        It lies in the set and below a ceiling.
        """
        with precision(BITS):
            if self._piece(a, b, ceiling):
                return [b]
        if not halvings:
            return None
        middle = self.restored(0.5 * (a + b)) if self.equations else 0.5 * (a + b)
        first = self.straight(a, middle, ceiling, halvings - 1)
        second = first and self.straight(middle, b, ceiling, halvings - 1)
        return [*first, *second] if first and second else None

    def restored(self, q: Array) -> Array:
        """Return a point on the equations near another one."""
        rows = list(self.equations)
        for _ in range(6 if rows else 0):
            values, slopes = self.problem.evaluate(q, 1)
            q = q - (np.linalg.pinv(slopes[rows]) @ values[rows]) * self.problem.scales
        return q

    def _piece(self, a: Array, b: Array, ceiling: "Ball") -> bool:
        # Turns by whole periods are rounded, too.
        slack = [ball(0, x) for x in (self.off + 8 * np.spacing(abs(a))).tolist()]
        ends = [[ball(x) + s for x, s in zip(q.tolist(), slack, strict=True)] for q in (a, b)]
        hull = [x.union(y) for x, y in zip(*ends, strict=True)]
        # Ends may move by the slack, each for itself; along equations both by the same.
        step = [y - x for x, y in zip(*ends, strict=True)]
        if self.equations:
            step = [ball(y) - ball(x) for x, y in zip(a.tolist(), b.tolist(), strict=True)]
        tube: list[list[Ball]] = []  # the columns of N times rho
        if self.equations:
            found = self._tube(a, b, ends, hull, step)
            if found is None:
                return False
            tube = found
            hull = [h + sum((c[i] for c in tube), ball(0)) for i, h in enumerate(hull)]
        lows = self.lows(hull)
        values = [self.formulas.values(Box(end), range(self.m)) for end in ends]
        # Only what is not decided by its range, and may hold, is looked at along the piece.
        near = [
            i for i in np.flatnonzero(~(lows > 0)).tolist()
            if values[0][i] > 0 and values[1][i] > 0
        ]  # fmt: skip
        forms = self.formulas.smooth(Box(hull), (*near, self.energy))
        if isinstance(forms, Undecided):
            return False
        _, gradients, hessians = forms.evaluate(Box(hull), 2)
        bends = [dot(step, [dot(line, step) for line in h]) for h in hessians]
        swing = [sum((abs(dot(g, c)) for c in tube), ball(0)) for g in gradients]
        for k, i in enumerate(near):
            bound = _least(values[0][i], values[1][i], bends[k]) - swing[k]
            lows[i] = float(bound.lower()) if bound.is_finite() else -np.inf
        if not self.problem.polyhedron.implicit_of(lows) >= 0:
            return False
        heights = [self.value(end) for end in ends]
        top = -_least(-heights[0], -heights[1], -bends[-1]) + swing[-1]
        return bool(top < ceiling)

    def _tube(
        self,
        a: Array,
        b: Array,
        ends: "list[list[Ball]]",
        hull: "list[Ball]",
        step: "list[Ball]",
    ) -> "list[list[Ball]] | None":
        """Return the columns of ``N`` times ``[-rho, rho]``, or None if that is not shown."""
        rows = self.equations
        frame = self._frame(a, rows)
        if frame is None:
            return None
        columns = [[ball(x) for x in column] for column in frame.T.tolist()]
        values = [self.formulas.values(Box(end), rows) for end in ends]
        forms = self.formulas.smooth(Box(hull), rows)
        if isinstance(forms, Undecided):
            return None
        bends = [
            dot(step, [dot(line, step) for line in h]) for h in forms.evaluate(Box(hull), 2)[2]
        ]
        # The solutions at the ends, so near to the vertices that pieces join.
        for vertex in (a, b):
            found = self.formulas.values(Box(balls(vertex)), rows)
            sizes = [2 * abs(x).upper() for x in found]
            if not all(
                dot(sizes, [abs(c[i]) for c in columns]) <= off
                for i, off in enumerate(self.off.tolist())
            ):
                return None
        # Values along the straight piece, then reaches that are larger by far.
        flat = [
            abs(x).upper() + abs(y).upper() + abs(s).upper() / 8
            for x, y, s in zip(*values, bends, strict=True)
        ]
        rho = [ball(0, 2 * ball(f)) for f in flat]
        wide = [h + dot(rho, [c[i] for c in columns]) for i, h in enumerate(hull)]
        forms = self.formulas.smooth(Box(wide), rows)
        if isinstance(forms, Undecided):
            return None
        gradients = forms.evaluate(Box(wide), 1)[1]
        for j, g in enumerate(gradients):
            apart = [dot(g, c) - int(i == j) for i, c in enumerate(columns)]
            image = ball(0, ball(flat[j])) - dot(apart, rho)
            if not rho[j].contains_interior(image):
                return None
        return [[r * x for x in c] for r, c in zip(rho, columns, strict=True)]


def _inverse(rows: "list[list[Ball]]") -> "list[list[Ball]] | None":
    """Return an enclosure of the inverses of all matrices in a matrix of balls."""
    try:
        found: Any = matrix(rows).inv()
    except ZeroDivisionError:
        return None
    return [list(line) for line in found.tolist()]


def _least(a: "Ball", b: "Ball", bend: "Ball") -> "Ball":
    """Return a lower bound of ``(1-t) a + t b - t (1-t) s / 2`` for ``s`` up to a bend.

    Without ``s > 0`` that is the lesser end; with it the parabola's vertex, if it is in between.
    """
    lesser = a if a.lower() < b.lower() else b
    if not bend.is_finite():
        return bend
    s = bend.upper()
    if not s > 0 or abs(b - a) >= s / 2:
        return lesser.lower()
    return ((a + b) / 2 - s / 8 - square(b - a) / (2 * s)).lower()


def above(x: "Ball") -> float:
    """Return a double that is not below a ball."""
    high = float(x.upper())
    return high if ball(high) >= x.upper() else float(np.nextafter(high, np.inf))


def under(x: "Ball") -> float:
    """Return a double that is not above a ball."""
    return -above(-x)
