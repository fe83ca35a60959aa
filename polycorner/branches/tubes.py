"""Curves of Fritz John points in balls: tubes that contain exactly one piece of one curve.

The unknowns on a face are ``x = (q, p, mu)``: the coordinates, the formulas' parameters on their
line, and multipliers of the functions that are held and of the energy, the functions divided by
sizes.  The equations are those of :mod:`~polycorner.branches.system` with the sum of the
inequalities' multipliers and the energy's, which is 1, in place of their length; and a *pin*,
``c (x - a) = delta``, that cuts the curve.

A tube is what Krawczyk's test (:mod:`~polycorner.proofs.kkt`) shows for all ``delta`` of an
interval: for each of them there is exactly one solution near a line, and the Jacobian with the pin
is regular on all that is near.  So the solutions are one curve, over ``delta``, whose velocity
``x'`` solves ``J x' = (0, 1)`` and whose acceleration solves ``J x'' = -F''(x', x')``.  Folds and
points at which gradients become dependent are nothing special.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from polycorner.branches.mirrors import Image, Mirror
from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.system import Face
from polycorner.intervals.balls import (
    Ball,
    ball,
    balls,
    column,
    current_precision,
    dot,
    entries,
    matrix,
    precision,
    square,
)
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.kkt import (
    Cell,
    Enclosure,
    Equations,
    Linearisation,
    defect,
    enclose,
    lagrangian,
    newton,
)
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

PIN = "the pin of a tube"  # the last input, which no formula reads


@dataclass(frozen=True, eq=False)
class Setting:
    """What all faces share.

    Attributes
    ----------
    formulas : Formulas
        Inequalities, equations, energy; inputs are coordinates, parameters and the pin.
    inequalities : int
    equations : tuple of int
        Rows of the equations that imply the others.
    start, rates : tuple of Fraction
        The formulas' parameters at ``t = 0`` and their derivatives by ``t``.
    weights : tuple of float
        By which the functions are multiplied.
    units : tuple of float
        Of coordinates and parameters.
    images : tuple of Image
        Finite symmetries.
    """

    formulas: Formulas
    inequalities: int
    equations: tuple[int, ...]
    start: tuple[Fraction, ...]
    rates: tuple[Fraction, ...]
    weights: tuple[float, ...]
    units: tuple[float, ...]
    images: tuple[Image, ...] = ()

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return self.formulas.dimension

    @property
    def moved(self) -> int:
        """The parameter that moves most: its place among the unknowns."""
        return self.n + max(range(len(self.rates)), key=lambda k: abs(self.rates[k]))

    def time(self, p: "Sequence[Ball]") -> "Ball":
        """Return ``t`` for the parameters."""
        k = self.moved - self.n
        return (p[k] - ball(self.start[k])) / ball(self.rates[k])

    def at_time(self, t: Fraction) -> "list[Ball]":
        """Return the parameters at a value of ``t``."""
        return [ball(a + t * r) for a, r in zip(self.start, self.rates, strict=True)]

    def held(self, face: Face) -> tuple[int, ...]:
        """Return the rows that have multipliers beside the energy's."""
        return (*face, *self.equations)


@dataclass(frozen=True, eq=False)
class CurveSystem:
    """The equations of a face with a pin, as those of :class:`~polycorner.proofs.kkt.KKTSystem`.

    Attributes
    ----------
    setting : Setting
    face : tuple of int
    normal, anchor : tuple of Ball
        ``c`` and ``a``.
    gap : int
        A function that vanishes in place of the pin; -1 for none.
    mirror : Mirror, optional
        The odd equations, which hold wherever the odd unknowns vanish, are replaced by these.
    """

    setting: Setting
    face: Face
    normal: "tuple[Ball, ...]" = ()
    anchor: "tuple[Ball, ...]" = ()
    gap: int = -1
    mirror: Mirror | None = None

    @property
    def dimension(self) -> int:
        """The number of coordinates and parameters."""
        return len(self.setting.units)

    @cached_property
    def weights(self) -> "list[Ball]":
        """By which the functions are multiplied, exactly."""
        return [ball(self.setting.weights[row]) for row in self.rows]

    @cached_property
    def counted(self) -> "list[Ball]":
        """The summands' coefficients in the sum of multipliers that is 1."""
        return [ball(int(row not in self.setting.equations)) for row in self.rows]

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """The rows that have multipliers, the energy last."""
        return (*self.setting.held(self.face), len(self.setting.formulas.names) - 1)

    @cached_property
    def units(self) -> tuple[float, ...]:
        """Unit of each unknown."""
        return (*self.setting.units, *[1.0] * len(self.rows))

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return self.dimension + len(self.rows)

    def at(self, z: "Sequence[Ball]", p: "Sequence[Ball]" = ()) -> Linearisation | Undecided:
        """Return the equations and their derivatives on boxes of unknowns and the pin's value."""
        return self.linear(z, Box([*z[: self.dimension], *(p or [ball(0)])]))

    def linear(self, z: "Sequence[Ball]", box: Box) -> Linearisation | Undecided:
        """Return the same where a joint enclosure is given."""
        setting, d, n = self.setting, self.dimension, self.setting.n
        read = (*self.rows, self.gap) if self.gap >= 0 else self.rows
        forms = setting.formulas.smooth(box, read)
        if isinstance(forms, Undecided):
            return forms
        values, gradients, hessians = forms.evaluate(box, 2)
        k, mu = len(self.rows) - 1, z[d:]
        slopes = self._signed([g[:n] for g in gradients[: k + 1]])
        slope, bent = lagrangian(
            self._signed_weights(mu), gradients[: k + 1], hessians[: k + 1], range(n), range(d)
        )
        zero, counted = ball(0), self.counted
        none = [zero] * (k + 1)
        line, line_rows = self._line(z)
        if self.gap >= 0:
            left, pin = values[k + 1], [*gradients[k + 1][:d], *none]
        else:
            away = [x - a for x, a in zip(z, self.anchor, strict=True)]
            left, pin = dot(self.normal, away) - sum(box.hull[d:]), list(self.normal)
        jacobian = [
            *([*bent[a], *(s[a] for s in slopes)] for a in range(n)),
            *([*g[:d], *none] for g in gradients[:k]),
            *line_rows,
            [*[zero] * d, *counted],
            pin,
        ]
        residual = [*slope, *values[:k], *line, dot(counted, mu) - 1, left]
        if self.mirror is not None:
            residual, jacobian = self._even(self.mirror, z, residual, jacobian)
        return Linearisation(
            residual=residual,
            jacobian=jacobian,
            drift=[*([zero] for _ in jacobian[1:]), [ball(-1)]],
            energy=values[k],
            rows=[g[:n] for g in gradients[:k]],
            curvature=[row[:n] for row in bent],
            forms=forms,
        )

    @staticmethod
    def _even(
        mirror: Mirror, z: "Sequence[Ball]", left: "list[Ball]", rows: "list[list[Ball]]"
    ) -> "tuple[list[Ball], list[list[Ball]]]":
        """Return even equations, and odd unknowns in place of the odd ones."""
        left, odd = mirror.sides(left), mirror.parts(z)
        rows = [list(row) for row in zip(*map(mirror.sides, zip(*rows, strict=True)), strict=True)]
        for (i, j, s), (_, row, _) in zip(mirror.unknowns, mirror.equations, strict=True):
            left[row], rows[row] = odd[j], [ball(0)] * len(z)
            rows[row][j] = ball(1)
            if i != j:
                rows[row][i], rows[row][j] = ball(0.5), ball(-s) / 2
        return left, rows

    def turned(
        self, z: "Sequence[Ball]", along: "Sequence[Ball]", box: Box
    ) -> "list[list[Ball]] | Undecided":
        """Return the second derivatives of the equations, one of them along a vector.

        The slopes of the box are ``along``.
        """
        d, n, k = self.dimension, self.setting.n, len(self.rows) - 1
        forms = self.setting.formulas.smooth(box, self.rows)
        if isinstance(forms, Undecided):
            return forms
        (_, _, hessians), (_, slopes, bent) = forms.slopes(box)
        weights, growth = self._signed_weights(z[d:]), self._signed_weights(along[d:])
        signed = self._signed([[x[0] for x in g] for g in slopes])
        rows = [
            [dot(weights, [h[a][j][0] for h in bent]) + dot(growth, [h[a][j] for h in hessians])
             for j in range(d)] + [row[a] for row in signed]
            for a in range(n)
        ]  # fmt: skip
        none = [ball(0)] * len(self.rows)
        rows += [[*(x[0] for x in g[:d]), *none] for g in slopes[:k]]
        return rows + [[ball(0)] * self.size for _ in range(self.size - len(rows))]

    def third(
        self, z: "Sequence[Ball]", along: "Sequence[Ball]", box: Box
    ) -> "list[Ball] | Undecided":
        """Return the third derivative of the equations along a vector that keeps the parameters."""
        d, n, k = self.dimension, self.setting.n, len(self.rows) - 1
        forms = self.setting.formulas.smooth(box, self.rows)
        if isinstance(forms, Undecided):
            return forms
        _, (_, _, bent, last) = forms.slopes(box, 3)
        weights, growth = self._signed_weights(z[d:]), self._signed_weights(along[d:])
        v = along[:n]
        twice = [[dot([x[0] for x in row[:n]], v) for row in h] for h in bent]
        thrice = [[dot([dot([x[0] for x in r], v) for r in rows], v) for rows in h] for h in last]
        found = [dot(weights, [g[a] for g in thrice]) + 3 * dot(growth, [g[a] for g in twice])
                 for a in range(n)]  # fmt: skip
        found += [dot(g, v) for g in twice[:k]]
        return found + [ball(0)] * (self.size - len(found))

    def second(
        self, z: "Sequence[Ball]", tangents: "Sequence[Sequence[Ball]]", box: Box
    ) -> "list[Ball] | Undecided":
        """Return the second derivative of the equations along ``tangents``, ``F''(x', x')``."""
        along = [row[0] for row in tangents]
        rows = self.turned(z, along, box)
        if isinstance(rows, Undecided):
            return rows
        found = [dot(row, along) for row in rows]
        if self.mirror is not None:
            found = self.mirror.sides(found)
            for row in self.mirror.odd_equations:
                found[row] = ball(0)
        return found

    def bend(
        self, z: "Sequence[Ball]", tangents: "Sequence[Sequence[Ball]]", box: Box
    ) -> "list[Ball] | Undecided":
        """Return the second-order remainder of the equations along a predictor."""
        found = self.second(z, tangents, box)
        if isinstance(found, Undecided):
            return found
        return [x * square(box.reach[0]) / 2 for x in found]

    def _signed_weights(self, mu: "Sequence[Ball]") -> "list[Ball]":
        w = self.weights
        return [*(-m * x for m, x in zip(mu[:-1], w[:-1], strict=True)), mu[-1] * w[-1]]

    def _signed(self, slopes: "list[list[Ball]]") -> "list[list[Ball]]":
        signs = self._signed_weights([ball(1)] * len(self.rows))
        return [[sign * x for x in row] for sign, row in zip(signs, slopes, strict=True)]

    def _line(self, z: "Sequence[Ball]") -> "tuple[list[Ball], list[list[Ball]]]":
        """Return what keeps the parameters on their line: ``r_k (p_j - a_j) = r_j (p_k - a_k)``."""
        setting = self.setting
        left, rows, k = [], [], setting.moved
        for j, (a, r) in enumerate(zip(setting.start, setting.rates, strict=True), setting.n):
            if j != k:
                most, base = setting.rates[k - setting.n], setting.start[k - setting.n]
                left.append(ball(most) * (z[j] - ball(a)) - ball(r) * (z[k] - ball(base)))
                row = [ball(0)] * self.size
                row[j], row[k] = ball(most), ball(-r)
                rows.append(row)
        return left, rows

    def pinned(self, normal: Sequence[Any], anchor: Sequence[Any]) -> "CurveSystem":
        """Return the same equations with another pin."""
        pin, at = (tuple([ball(x) for x in some]) for some in (normal, anchor))
        return replace(self, normal=pin, anchor=at)

    def coordinate(self, place: int, value: Any = 0) -> "CurveSystem":
        """Return the same equations with one unknown at a value."""
        normal, anchor = [0] * self.size, [0] * self.size
        normal[place], anchor[place] = 1, value
        return self.pinned(normal, anchor)

    def closing(self, gap: int) -> "CurveSystem":
        """Return the same equations with a function that vanishes, without a pin."""
        return CurveSystem(self.setting, self.face, gap=gap)


@dataclass(frozen=True, eq=False)
class Tube:
    """A piece of a curve, and a neighbourhood without any other.

    The enclosure is one over the interval of ``delta``.
    """

    enclosure: Enclosure

    @property
    def system(self) -> CurveSystem:
        """The equations with the tube's pin."""
        system: Any = self.enclosure.predictor.system
        assert isinstance(system, CurveSystem)
        return system

    @property
    def face(self) -> Face:
        """The inequalities that are held."""
        return self.system.face

    @property
    def solution(self) -> "list[Ball]":
        """Enclosures of all unknowns along the tube."""
        return self.enclosure.solution

    @cached_property
    def box(self) -> Box:
        """A joint enclosure of the points, the parameters and ``delta``."""
        predictor = self.enclosure.predictor
        return predictor.box(self.enclosure.remainder)

    @cached_property
    def velocity(self) -> "list[Ball] | None":
        """Enclosures of the derivatives of all unknowns by ``delta``."""
        return self._solved([*[ball(0)] * (self.system.size - 1), ball(1)])

    @cached_property
    def acceleration(self) -> "list[Ball] | None":
        """Enclosures of the second derivatives of all unknowns by ``delta``."""
        x, v, d = self.solution, self.velocity, self.system.dimension
        if v is None:
            return None
        box = Box(self.box.hull, x[:d], [[s] for s in v[:d]], [ball(0)])
        box = Box(box.hull, box.hull, [*box.slopes, [ball(1)]], box.reach)
        found = self.system.second(x, [[s] for s in v], box)
        return None if isinstance(found, Undecided) else self._solved([-y for y in found])

    def _solved(self, right: "list[Ball]") -> "list[Ball] | None":
        backwards = self.enclosure.preconditioner
        try:
            near = backwards * matrix(self.enclosure.linear.jacobian)
            return entries(near.solve(backwards * column(right)))
        except ZeroDivisionError:
            return None

    def values(self, rows: Sequence[int]) -> "list[Ball]":
        """Return enclosures of functions along the tube."""
        return self.system.setting.formulas.values(self.box, rows)

    def rate(self, row: int) -> "Ball | None":
        """Return an enclosure of a function's derivative by ``delta``, None without one."""
        forms, v = self.system.setting.formulas.smooth(self.box, [row]), self.velocity
        if isinstance(forms, Undecided) or v is None:
            return None
        (slope,) = forms.evaluate(self.box, 1)[1]
        return dot(slope[: self.system.dimension], v[: self.system.dimension])

    def place(self, x: "Sequence[Ball]") -> "tuple[Ball, list[Ball]]":
        """Return ``delta`` of a box of unknowns, and how far it is from the tube's axis."""
        system, predictor = self.system, self.enclosure.predictor
        away = [a - b for a, b in zip(x, system.anchor, strict=True)]
        delta = dot(system.normal, away)
        apart = zip(x, predictor.centre, predictor.tangents, strict=True)
        return delta, [a - c - t[0] * delta for a, c, t in apart]

    def contains(self, x: "Sequence[Ball]") -> bool:
        """Whether a box of unknowns lies where no solutions are but those of the tube."""
        delta, apart = self.place(x)
        (reach,), candidate = self.enclosure.predictor.cell.reach, self.enclosure.candidate
        return reach.contains(delta) and all(
            w.contains(a) for w, a in zip(candidate, apart, strict=True)
        )

    def covers(self, x: "Sequence[Ball]") -> bool:
        """Return whether the same is shown of a box that may be larger than the tube's.

        Between a box and the tube no matrix in the Jacobian is singular if ``|I - Y J| w < w``
        there for some ``w``; two solutions with the same ``delta`` would contradict the mean value
        theorem.
        """
        delta, apart = self.place(x)
        e, system = self.enclosure, self.system
        if not e.predictor.cell.reach[0].contains(delta):
            return False
        if self.contains(x):
            return True
        least = [unit * ball(2) ** (-current_precision() // 2) for unit in system.units]
        wide = [
            ball(0, (abs(a.union(k)) + small).upper())
            for a, k, small in zip(apart, e.remainder, least, strict=True)
        ]
        part = e.predictor.part([delta])
        linear = system.linear(part.unknowns(wide), part.box(wide))
        if isinstance(linear, Undecided):
            return False
        units = [ball(0, unit) for unit in system.units]
        moved = entries(defect(linear.jacobian, e.preconditioner) * column(units))
        return all(abs(y) < unit for y, unit in zip(moved, system.units, strict=True))


def tube(
    system: CurveSystem, one: Array, two: Array, options: BranchProofOptions
) -> Tube | Undecided:
    """Return the tube from one approximate point of the curve to another."""
    units = np.array(system.units)
    chord = (two - one) / units
    middle = (one + two) / 2
    pinned = system.pinned((chord / (chord @ chord) / units).tolist(), middle.tolist())
    return tube_about(pinned, middle, 0.5 + options.overlap, options.bits)


def tube_about(system: CurveSystem, middle: Array, reach: float, bits: int) -> Tube | Undecided:
    """Return the tube about an approximate point of the curve, for a reach of the pin."""
    centre = newton(system, balls(middle), [ball(0)], bits=bits)
    if isinstance(centre, Undecided):
        return centre
    cell = Cell([ball(0)], [ball(0, reach)])
    found = enclose(system, centre, cell, bits=bits)
    return found if isinstance(found, Undecided) else Tube(found)


def point(system: Equations, near: "Sequence[Ball]", bits: int) -> Enclosure | Undecided:
    """Return the enclosure of the point that a pin or a gap selects.

    With twice the digits, so that it is narrow beside the tubes that have to contain it.
    """
    with precision(2 * bits):
        centre = newton(system, near, bits=2 * bits)
        if isinstance(centre, Undecided):
            return centre
        return enclose(system, centre, bits=2 * bits)


def joined(one: Tube, two: Tube, at: Array, bits: int) -> bool:
    """Whether two tubes are pieces of one curve, run through in the same sense near a point."""
    system = one.system.pinned(one.system.normal, at.tolist())
    shared = point(system, balls(at), bits)
    if isinstance(shared, Undecided):
        return False
    # On a whole tube near a branch point the derivative's enclosure is too wide to have a sign.
    velocity = Tube(shared).velocity
    if velocity is None:
        return False
    onwards = dot(two.system.normal, velocity)
    return one.contains(shared.solution) and two.contains(shared.solution) and bool(onwards > 0)
