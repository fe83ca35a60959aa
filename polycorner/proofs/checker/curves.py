"""Curves of Fritz John points over a parameter, and tubes that contain one piece of one curve.

Functions are ``f_i >= 0``, ``h_j = 0`` and the energy ``E``, of coordinates ``q`` and a parameter
``t``, each multiplied by a positive weight.  On a face ``A`` the unknowns are ``x = (q, t, mu)``:

==============================================================  ===================================
``mu_0 dE - sum_A mu_i df_i - sum nu_j dh_j = 0``               derivatives by ``q``
``f_i = 0`` for ``i`` in ``A``, ``h_j = 0``                     the point is on the face
``sum_A mu_i + mu_0 = 1``                                       one multiple of each relation
==============================================================  ===================================

one equation less than there are unknowns.  A *pin* ``c (x - a) = delta`` joins them.  A tube is a
box ``z_0 + z_1 delta + W`` for ``delta`` between ``-r`` and ``r`` in which Krawczyk's operator
shows that they have exactly one solution for each ``delta``, and that all matrices of derivatives
``J`` are regular: the solutions are one curve, whose velocity is given by ``J x' = (0, 1)`` and
whose acceleration by ``J x'' = -F''(x', x')``.
"""

from collections.abc import Callable, Sequence
from typing import Any

from flint import arb, arb_mat, ctx

from .balls import NAN, ZERO, NotShownError, column, dot, need, square
from .jets import Jet
from .problem import StoredProgram
from .rationals import ratios
from .statement import PART, SLACK, approach, zero_near

OVERLAP = arb(0.125)  # of a tube beyond its ends, as a part of the way between them
MOST_UNKNOWNS = 200
INFLATIONS, GROWTH = 6, arb(1.3)  # of the box in which solutions are alone
GAIN = 0.7  # ratio of sides with which a box is narrowed again

Equations = Callable[[Sequence[arb]], tuple[list[arb], list[list[arb]]]]


class StoredFamily:
    """Functions of coordinates and a parameter, which is the last input, on an interval."""

    def __init__(self, p: StoredProgram, data: dict[str, Any]) -> None:
        self.p, self.n, self.energy = p, p.n - 1, p.m + p.k
        need(data["parameters"] == [self.n] and self.n > 0, "the parameter is the last input")
        need(p.periods[-1] is None, "the parameter has no period")
        need(p.branches == {frozenset(range(p.m))}, "the set is the intersection of all functions")
        self.low, self.high = (float.fromhex(text) for text in data["interval"])
        need(float("-inf") < self.low < self.high < float("inf"), "ends of the interval")
        some = ratios(data["weights"], self.energy + 1, "weights")
        need(all(w > 0 for w in some), "weights are positive")
        self.weights = [arb(w) for w in some]
        scales = ratios(data["scales"], p.n, "scales")
        need(all(s > 0 for s in scales), "scales are positive")
        self.scales = [arb(s) for s in scales]

    def forms(self, box: Sequence[arb], rows: Sequence[int]) -> Any:
        """Return values of nodes, and of some functions values, gradients and Hessians."""
        v, memo, found = self.p.values(box), dict[int, Any](), []
        for row in rows:
            form, value = self.p.forms(v, row, memo, 2), v[self.p.outputs[row]]
            fine = form and all(x.is_finite() for part in form for x in part.values())
            need(fine and value.is_finite(), "a function is not shown to be smooth on a box")
            found.append((value, *form))
        return v, memo, found

    def bends(
        self, box: Sequence[arb], rows: Sequence[int], along: Sequence[arb], order: int = 1
    ) -> list[list[dict[tuple[int, int], Any]]]:
        """Return Hessians of some functions, and their derivatives along a direction."""
        v, memo, found = self.forms(box, rows)
        jets: list[Any] = list(v)
        for a, form in memo.items():
            if form is not None and isinstance(v[a], arb):
                slope = sum((x * along[i] for i, x in form[0].items()), ZERO)
                jets[a] = Jet(v[a], slope)
                if order > 1:
                    bent = (x * along[i] * along[j] for (i, j), x in form[1].items())
                    jets[a] = Jet(jets[a], Jet(slope, sum(bent, ZERO)))
        changes, turned = dict[int, Any](), [[hessian for _, _, hessian in found]]
        some: Any
        for row in rows:
            self.p.forms(jets, row, changes, 2)
        forms: Any = [changes.get(self.p.outputs[row]) or ({}, {}) for row in rows]
        some = [{ij: x for ij, x in form[1].items() if isinstance(x, Jet)} for form in forms]
        for _ in range(order):
            some = [{ij: x.slope for ij, x in h.items() if isinstance(x, Jet)} for h in some]
            turned.append([{ij: first(x) for ij, x in h.items()} for h in some])
        fine = all(x.is_finite() for hessians in turned for h in hessians for x in h.values())
        need(fine, "a function is not shown to be smooth")
        return turned


class StoredFace:
    """The equations of a face."""

    def __init__(self, family: StoredFamily, active: Sequence[int]) -> None:
        p = family.p
        self.family, self.active = family, tuple(active)
        self.n, self.d = family.n, p.n
        need(len(active) + p.k <= self.n, "more functions are held than there are coordinates")
        self.rows = [*active, *range(p.m, family.energy + 1)]
        self.size = self.d + len(self.rows)
        need(self.size <= MOST_UNKNOWNS, "these are too many unknowns for this checker")
        signs = [*[-1] * (len(self.rows) - 1), 1]
        self.signed = [s * family.weights[row] for s, row in zip(signs, self.rows, strict=True)]
        self.counted = [arb(int(not p.m <= row < family.energy)) for row in self.rows]
        self.units = [*family.scales, *[arb(1)] * len(self.rows)]

    def at(self, x: Sequence[arb]) -> tuple[list[arb], list[list[arb]]]:
        """Return the equations and their derivatives, without a pin."""
        n, d, mu = self.n, self.d, x[self.d :]
        _, _, found = self.family.forms(x[:d], self.rows)
        pairs = list(zip(self.signed, found, strict=True))
        slopes = [[s * g.get(i, ZERO) for i in range(d)] for s, (_, g, _) in pairs]
        weights = [s * m for s, m in zip(self.signed, mu, strict=True)]
        bent = [ZERO] * n * d
        for w, (_, _, h) in zip(weights, found, strict=True):
            for (i, j), y in h.items():
                if i < n:
                    bent[i * d + j] += w * y
        residual = [dot(mu, [row[i] for row in slopes]) for i in range(n)]
        residual += [s * value for s, (value, _, _) in pairs[:-1]]
        none = [ZERO] * len(self.rows)
        jacobian = [[*bent[i * d : i * d + d], *(row[i] for row in slopes)] for i in range(n)]
        jacobian += [[*row, *none] for row in slopes[:-1]]
        return (
            [*residual, dot(self.counted, mu) - 1],
            [*jacobian, [*[ZERO] * d, *self.counted]],
        )

    def turned(self, x: Sequence[arb], v: Sequence[arb]) -> list[list[arb]]:
        """Return the second derivatives of the equations, one of them along ``v``."""
        n, d = self.n, self.d
        hessians, turned = self.family.bends(x[:d], self.rows, v[:d])
        bent, slopes = [ZERO] * n * d, list[list[arb]]()
        for s, m, dm, h, th in zip(self.signed, x[d:], v[d:], hessians, turned, strict=True):
            slope = [ZERO] * d
            for (i, j), y in h.items():
                slope[i] += s * y * v[j]
                if i < n:
                    bent[i * d + j] += s * dm * y
            for (i, j), y in th.items():
                if i < n:
                    bent[i * d + j] += s * m * y
            slopes.append(slope)
        rows = [[*bent[i * d : i * d + d], *(row[i] for row in slopes)] for i in range(n)]
        rows += [[*row, *[ZERO] * len(self.rows)] for row in slopes[:-1]]
        return [*rows, [ZERO] * self.size]

    def second(self, x: Sequence[arb], v: Sequence[arb]) -> list[arb]:
        """Return the second derivative of the equations along ``v``, and 0 for the pin."""
        return [*(dot(row, v) for row in self.turned(x, v)), ZERO]

    def third(self, x: Sequence[arb], v: Sequence[arb]) -> list[arb]:
        """Return the third derivative of the equations along ``v``, which keeps the parameter."""
        n, d = self.n, self.d
        _, turned, twice = self.family.bends(x[:d], self.rows, v[:d], 2)
        total, lengths = [ZERO] * n, list[arb]()
        for s, m, dm, h, th in zip(self.signed, x[d:], v[d:], turned, twice, strict=True):
            lengths.append(s * sum((y * v[i] * v[j] for (i, j), y in h.items()), ZERO))
            for part, weight in ((h, 3 * s * dm), (th, s * m)):
                for (i, j), y in part.items():
                    if i < n:
                        total[i] += weight * y * v[j]
        return [*total, *lengths[:-1], ZERO]

    def pinned(self, normal: Sequence[arb], anchor: Sequence[arb]) -> Equations:
        """Return the equations with a pin."""

        def equations(x: Sequence[arb]) -> tuple[list[arb], list[list[arb]]]:
            residual, jacobian = self.at(x)
            away = [a - b for a, b in zip(x, anchor, strict=True)]
            return [*residual, dot(normal, away)], [*jacobian, list(normal)]

        return equations

    def fixed(self, place: int, value: arb) -> Equations:
        """Return the equations with one unknown at a value."""
        normal = [arb(int(i == place)) for i in range(self.size)]
        return self.pinned(normal, [value] * self.size)

    def kernel(self, x: Sequence[arb]) -> list[arb]:
        """Return a vector that the derivatives nearly annihilate, of length 1 in units."""
        _, jacobian = self.at([y.mid() for y in x])
        # of any row that completes the matrix to a regular one
        row = [arb(5 * i + 3) / (2 * i + 7) / u for i, u in enumerate(self.units)]
        last = arb_mat([[ZERO]] * (self.size - 1) + [[arb(1)]])
        try:
            found = arb_mat([*jacobian, row]).mid().solve(last).entries()
        except ZeroDivisionError:
            need(False, "the equations are not shown to have one curve at an event")
        size = sum((square(y / u) for y, u in zip(found, self.units, strict=True)), ZERO).sqrt()
        return [(y / size).mid() for y in found]

    def velocity(self, x: Sequence[arb], along: Sequence[arb]) -> list[arb]:
        """Enclose the velocity of the curve at a solution, by a pin along a direction."""
        normal = [y / u**2 for y, u in zip(along, self.units, strict=True)]
        _, jacobian = self.at(x)
        return solved([*jacobian, normal], [*[ZERO] * (self.size - 1), arb(1)])


def first(x: Any) -> arb:
    """Return the number that a jet is at the point itself."""
    return first(x.value) if isinstance(x, Jet) else x


def solved(rows: list[list[arb]], right: Sequence[arb]) -> list[arb]:
    """Enclose the solution of a linear system, of which all matrices are regular."""
    try:
        backwards = arb_mat(rows).mid().inv().mid()
        form = backwards * arb_mat(rows)
        return list(form.solve(backwards * column(right)).entries())
    except ZeroDivisionError:
        msg = "equations are not shown to be regular"
        raise NotShownError(msg) from None


class Tube:
    """A piece of the curve of a face, and a neighbourhood in which there is no other."""

    def __init__(
        self, face: StoredFace, normal: Sequence[arb], anchor: Sequence[arb], reach: arb
    ) -> None:
        self.face, self.normal, self.anchor, self.reach = face, normal, anchor, reach
        self.memo = dict[int, Any]()
        system = face.pinned(normal, anchor)
        self.centre = approach(system, anchor)
        values, jacobian = system(self.centre)
        try:
            self.backwards = arb_mat(jacobian).mid().inv().mid()
        except ZeroDivisionError:
            need(False, "the equations are not shown to be regular")
        last = face.size - 1
        self.tangent = [self.backwards[i, last] for i in range(face.size)]
        delta = PART * reach
        self.line = [c + t * delta for c, t in zip(self.centre, self.tangent, strict=True)]
        moved = (arb_mat(jacobian) * column(self.tangent)).entries()
        moved[last] -= 1
        half = ZERO.union(reach**2 / 2)
        bend = face.second(self.line, self.tangent)
        left = [v + m * delta + b * half for v, m, b in zip(values, moved, bend, strict=True)]
        self.enclose(-(self.backwards * column(left)))

    @classmethod
    def between(cls, face: StoredFace, one: Sequence[arb], two: Sequence[arb]) -> "Tube":
        """Return the tube from one point near the curve to another."""
        normal, middle = chord(face, one, two)
        return cls(face, normal, middle, arb(0.5) + OVERLAP)

    @classmethod
    def about(cls, face: StoredFace, x: Sequence[arb], along: Sequence[arb], reach: arb) -> "Tube":
        """Return the tube about a point of the curve, in a direction."""
        normal = [(y / u**2).mid() for y, u in zip(along, face.units, strict=True)]
        return cls(face, normal, [y.mid() for y in x], reach)

    def enclose(self, base: arb_mat) -> None:
        """Find a box that Krawczyk's operator maps into its interior."""
        unit, image = arb_mat(self.face.size, self.face.size, 1), list(base.entries())
        least = [u * arb(2) ** (SLACK - ctx.prec) for u in self.face.units]
        for _ in range(INFLATIONS):
            need(all(y.is_finite() for y in image), "the equations are not finite on a tube")
            box = [PART * (GROWTH * y.abs_upper() + s) for y, s in zip(image, least, strict=True)]
            rows = self.derivatives([a + b for a, b in zip(self.line, box, strict=True)])
            form = self.backwards * arb_mat(rows)
            image = (base + (unit - form) * column(box)).entries()
            if all(x.contains_interior(y) for x, y in zip(box, image, strict=True)):
                self.alone, self.rows = box, rows
                self.x = [a + b for a, b in zip(self.line, image, strict=True)]
                self.rest = image
                return
        need(False, "no single curve is enclosed in a tube")

    def derivatives(self, x: Sequence[arb]) -> list[list[arb]]:
        return [*self.face.at(x)[1], list(self.normal)]

    def place(self, x: Sequence[arb]) -> arb:
        """Return ``delta`` of points."""
        return dot(self.normal, [a - b for a, b in zip(x, self.anchor, strict=True)])

    def contains(self, x: Sequence[arb]) -> bool:
        """Whether all solutions in a box of unknowns are on the curve of the tube."""
        delta = self.place(x)
        axis = [c + t * delta for c, t in zip(self.centre, self.tangent, strict=True)]
        apart = zip(self.alone, x, axis, strict=True)
        return bool(abs(delta) <= self.reach) and all(w.contains(a - b) for w, a, b in apart)

    def narrowed(self, x: list[arb], steps: int) -> list[arb]:
        """Enclose the solutions in a box of unknowns more closely; empty if there are none.

        For any matrix ``Y`` and a point ``m`` of the box they are in ``m - Y F(m) + (I - Y J) (X
        - m)``, the pin being at the values of ``delta`` that the box has.
        """
        unit = arb_mat(self.face.size, self.face.size, 1)
        for _ in range(steps):
            middle = [y.mid() for y in x]
            try:
                values, rows = self.face.at(middle)[0], self.derivatives(x)
            except NotShownError:
                return x
            away = arb_mat([[a - b] for a, b in zip(x, middle, strict=True)])
            pin = -dot(self.normal, away.entries())
            moved = (unit - self.backwards * arb_mat(rows)) * away
            moved -= self.backwards * column((*values, pin))
            new = [a + b for a, b in zip(middle, moved.entries(), strict=True)]
            if not all(a.overlaps(b) for a, b in zip(x, new, strict=True)):
                return []
            old, x = x, [a.intersection(b) for a, b in zip(x, new, strict=True)]
            if all(a.rad() > GAIN * b.rad() for a, b in zip(x, old, strict=True)):
                break
        return x

    def covers(self, x: Sequence[arb]) -> bool:
        """Whether all solutions in a box are on the curve, which may be farther away.

        The derivatives are regular on a box that contains them and the curve for the same
        ``delta``: two solutions would contradict the mean value theorem.
        """
        delta = self.place(x)
        if not abs(delta) <= self.reach:
            return False
        ends = zip(self.centre, self.tangent, self.rest, strict=True)
        curve = [c + t * delta + k for c, t, k in ends]
        try:
            rows = self.derivatives([a.union(b) for a, b in zip(x, curve, strict=True)])
            (self.backwards * arb_mat(rows)).inv()
        except (NotShownError, ZeroDivisionError):
            return False
        return True

    # ------------------------------------------------------------------------------ along the curve

    @property
    def velocity(self) -> list[arb]:
        """Enclosures of the derivatives of the unknowns by ``delta``."""
        if not hasattr(self, "_velocity"):
            self._velocity = solved(self.rows, [*[ZERO] * (self.face.size - 1), arb(1)])
        return self._velocity

    def velocity_at(self, x: Sequence[arb]) -> list[arb]:
        """Enclose the velocity at a point of the curve, by the pin of this tube."""
        return solved(self.derivatives(x), [*[ZERO] * (self.face.size - 1), arb(1)])

    def acceleration(self) -> list[arb]:
        """Enclose the second derivatives of the unknowns by ``delta``."""
        bend = self.face.second(self.x, self.velocity)
        return solved(self.rows, [-y for y in bend])

    @property
    def values(self) -> list[Any]:
        """Enclosures of all nodes of the program along the curve."""
        if not hasattr(self, "_values"):
            self._values = self.face.family.p.values(self.x[: self.face.d])
        return self._values

    def rate(self, row: int) -> arb:
        """Enclose the derivative of a function along the curve, NaN if it may have none."""
        found = self.face.family.p.forms(self.values, row, self.memo)
        if found is None:
            return NAN
        return sum((y * self.velocity[i] for i, y in found[0].items()), ZERO)

    def value(self, row: int) -> arb:
        """Enclose a function along the curve, in mean value form where that is needed."""
        p = self.face.family.p
        found: arb = self.values[p.outputs[row]]
        if found > 0 or found < 0:
            return found
        rate = self.rate(row)
        if not rate.is_finite():
            return found
        middle: arb = p.values(self.point()[: self.face.d])[p.outputs[row]]
        return middle + PART * self.reach * rate

    def point(self) -> list[arb]:
        """Enclose the unknowns at ``delta = 0``."""
        if not hasattr(self, "_point"):
            self._point = zero_near(self.face.pinned(self.normal, self.anchor), self.centre)
            need(self.contains(self._point), "a point of a tube is elsewhere")
        return self._point


def chord(face: StoredFace, one: Sequence[arb], two: Sequence[arb]) -> tuple[list[arb], list[arb]]:
    """Return the normal of the pin that grows by 1 from one point to another, and the middle."""
    way = [b - a for a, b in zip(one, two, strict=True)]
    scaled = [y / u**2 for y, u in zip(way, face.units, strict=True)]
    size = dot(way, scaled).mid()
    need(size > 0, "two points of an arc are the same")
    middle = [((a + b) / 2).mid() for a, b in zip(one, two, strict=True)]
    return [(y / size).mid() for y in scaled], middle


def between(face: StoredFace, one: Sequence[arb], two: Sequence[arb]) -> list[arb]:
    """Return a point near the curve between two others."""
    normal, middle = chord(face, one, two)
    return approach(face.pinned(normal, middle), middle)
