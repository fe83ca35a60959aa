"""Pitchforks: branch points at which a symmetry breaks.

Let ``g`` be an involution, a signed permutation of coordinates that keeps the energy and takes the
functions of a face ``A`` to functions of ``A``, and ``x = s + a`` with ``g s = s``, ``g a = -a``
for the unknowns of the face, of which ``g`` permutes the multipliers. The equations have even and
odd parts, ``F(g x) = g F(x)``, and as the odd ones vanish with ``a``,

    ``F_odd(s + a) = A(s, a) a``,  ``A(s, a) = int_0^1 F_odd'(s + r a) dr``.

*The trunk.*  Solutions with ``a = 0`` are those of the even equations: a tube shows one curve of
them, on which ``t`` grows and nothing that is watched vanishes.

*The arms.*  For ``a = e u``, with one coordinate of ``u`` equal to 1, the equations

    ``F_even(s + e u) = 0``,  ``A(s, e u) u = 0``,  ``u_k = 1``

are even in ``e``.  Krawczyk's operator shows that for each ``e`` of an interval about 0 there is
one solution in a box, and that their derivatives by ``(s, u)`` are regular.  By ``e^2/2`` they have
the derivatives ``F_even''(u, u)`` and ``F_odd'''(u, u, u) / 3`` at points between ``s - e u`` and
``s + e u``; so that of ``t`` along the solutions is enclosed, and is not 0.  The two signs of ``e``
are two arcs, and ``e = 0`` is the branch point.

*Nothing else.*  Of a box of unknowns with ``t`` and ``a_k`` in the intervals: solutions with ``a =
0`` are on the trunk.  Others have ``A(s, a) a = 0``; the matrices of ``A`` have independent columns
beside that of ``a_k``, so that ``a_k`` is not 0 and ``u = a / a_k`` is enclosed.  On all that
lies between ``(s, u)`` and the arms, ``|e| <= |a_k|``, the derivatives of the equations above are
regular: ``(s, u)`` is the point of an arm.  For ``a = 0`` it follows in this way that the trunk has
no other point in the tube with ``A(s, 0) u = 0``.

*Regular points, and multipliers.*  Beside the branch point ``F'`` has a kernel of dimension 1 on
trunk and arms, along which ``t`` grows: KKT matrices are regular there, and the index stays the
same.  At the branch point the kernel has dimension 2, spanned by the trunk's velocity, with ``t' >
0``, and ``u``, with the coordinate ``u_k = 1``: no change of multipliers alone is in it.  So they
are unique, those of equilibria nearby are nearly the same, and such equilibria lie in the box.
"""

from collections.abc import Callable, Sequence
from typing import Any

from flint import arb, arb_mat

from .arcs import StoredArc, Watched
from .balls import ZERO, NotShownError, column, dot, fitted, need, square
from .curves import Equations, StoredFace, StoredFamily, Tube, solved
from .statement import PART, zero_near

WIDER = (4.0, 2.0, 1.25, 1.01)  # ratios of what is shown to the distances of ends of arcs
EVEN = arb(2) ** -24  # odd parts of points on the trunk, in units, at most

Pair = tuple[int, int, int]


class Mirror:
    """An involution on the unknowns and equations of a face, in adapted coordinates.

    Of unknowns ``i < j`` that are exchanged with the sign ``s``, ``y_i = (x_i + s x_j) / 2`` is
    even and ``y_j = (x_i - s x_j) / 2`` odd. The equations correspond to the unknowns.
    """

    def __init__(self, face: StoredFace, g: Any) -> None:
        n, active = face.n, face.active
        moved = [g.functions[i] for i in active]
        need({*moved} == {*active}, "the symmetry does not keep the face of a branch point")
        m, weights = face.family.p.m, face.family.weights
        pairs = [
            *zip(active, moved, strict=True),
            *((m + j, m + k) for j, (k, _) in enumerate(g.equations)),
        ]
        same = all(bool(weights[i] == weights[k]) for i, k in pairs)
        need(same, "weights of functions that are exchanged differ")
        past = n + len(active)
        order = [*g.order[:n], *(n + active.index(i) for i in moved)]
        order += [past + k for k, _ in g.equations]
        signs = [*g.signs[:n], *[1] * len(active), *(s for _, s in g.equations)]
        need(
            all(order[j] == i and signs[i] == signs[j] for i, j in enumerate(order)),
            "the symmetry of a branch point is no involution",
        )
        self.equations = [
            (i, j, s) for i, (j, s) in enumerate(zip(order, signs, strict=True))
            if i < j or (i == j and s < 0)
        ]  # fmt: skip
        self.unknowns = [(i + (i >= n), j + (j >= n), s) for i, j, s in self.equations]
        self.odd = [j for _, j, _ in self.unknowns]
        self.odd_equations = [j for _, j, _ in self.equations]

    def point(self, y: Sequence[arb], eps: Any) -> list[arb]:
        """Return ``s + eps u``."""
        x = list(y)
        for i, j, s in self.unknowns:
            x[i], x[j] = y[i] + eps * y[j], s * (y[i] - eps * y[j])
            if i == j:
                x[j] = eps * y[j]
        return x

    def vector(self, y: Sequence[arb]) -> list[arb]:
        """Return ``u``."""
        u = [ZERO] * len(y)
        for i, j, s in self.unknowns:
            u[i], u[j] = y[j], y[j] if i == j else -s * y[j]
        return u

    @staticmethod
    def halves(x: Sequence[arb], pairs: Sequence[Pair]) -> list[arb]:
        """Return adapted coordinates, or even and odd parts of equations."""
        y = list(x)
        for i, j, s in pairs:
            if i != j:
                y[i], y[j] = (x[i] + s * x[j]) / 2, (x[i] - s * x[j]) / 2
        return y

    def parts(self, x: Sequence[arb]) -> list[arb]:
        return self.halves(x, self.unknowns)

    def sides(self, left: Sequence[arb]) -> list[arb]:
        return self.halves(left, self.equations)

    def adapted(self, rows: list[list[arb]]) -> list[list[arb]]:
        """Return derivatives of even and odd equations by adapted coordinates."""
        doubled = [self.parts(row) for row in rows]
        for row in doubled:
            for i, j, _ in self.unknowns:
                if i != j:
                    row[i], row[j] = 2 * row[i], 2 * row[j]
        columns = [self.sides(column) for column in zip(*doubled, strict=True)]
        return [list(row) for row in zip(*columns, strict=True)]


class EvenFace(StoredFace):
    """The even equations of a face, with the odd unknowns in place of the odd equations."""

    def __init__(self, face: StoredFace, mirror: Mirror) -> None:
        super().__init__(face.family, face.active)
        self.mirror = mirror

    def at(self, x: Sequence[arb]) -> tuple[list[arb], list[list[arb]]]:
        left, rows = super().at(x)
        mirror, odd = self.mirror, self.mirror.parts(x)
        left = mirror.sides(left)
        rows = [list(row) for row in zip(*map(mirror.sides, zip(*rows, strict=True)), strict=True)]
        unit = [[arb(int(i == j)) for i in range(self.size)] for j in range(self.size)]
        for (_, j, _), (_, row, _) in zip(mirror.unknowns, mirror.equations, strict=True):
            left[row], rows[row] = odd[j], [mirror.parts(column)[j] for column in unit]
        return left, rows

    def second(self, x: Sequence[arb], v: Sequence[arb]) -> list[arb]:
        found = self.mirror.sides(super().second(x, v))
        return [ZERO if row in self.mirror.odd_equations else y for row, y in enumerate(found)]


class StoredPitchfork:
    """A branch point, and a neighbourhood in which all solutions are on four curves."""

    def __init__(self, ends: Sequence[tuple[StoredArc, int]], g: Any) -> None:
        self.face = face = ends[0][0].face
        self.family: StoredFamily = face.family
        self.mirror = mirror = Mirror(face, g)
        self.near = [arc.near(side) for arc, side in ends]
        self.evens = [self.is_even(x) for x in self.near]
        need(sorted(self.evens) == [False, False, True, True], "two arcs are symmetric at a branch")
        one, two = (x for x, even in zip(self.near, self.evens, strict=True) if not even)
        off = mirror.parts(one)
        sizes = [(float((off[j] / face.units[j]).abs_upper()), j) for j in mirror.odd if j < face.n]
        need(sizes, "the symmetry keeps all coordinates")
        self.way = max(sizes)[1]
        start = mirror.parts([(a + b) / 2 for a, b in zip(one, two, strict=True)])
        for j in mirror.odd:
            start[j] = off[j] / off[self.way]
        self.y = zero_near(self.divided(ZERO), [x.mid() for x in start])
        self.centre = mirror.point(self.y, 0)
        self.arms, self.eps, self.grows = self.shown(self.arms_of)
        self.trunk: Tube = self.shown(self.trunk_of)
        self.close(ends)
        arms = mirror.point(self.arms, PART * self.eps)
        self.x = [a.union(b) for a, b in zip(arms, self.trunk.x, strict=True)]

    def is_even(self, x: Sequence[arb]) -> bool:
        y = self.mirror.parts(x)
        return all(abs(y[j]) < EVEN * self.face.units[j] for j in self.mirror.odd)

    # ------------------------------------------------------------------------------- the equations

    def divided(self, eps: arb) -> Equations:
        """Return the equations of the arms for all ``|e|`` up to a bound."""
        mirror, face, way = self.mirror, self.face, self.way
        odd, half = mirror.odd_equations, ZERO.union(square(eps) / 2)

        def equations(y: Sequence[arb]) -> tuple[list[arb], list[list[arb]]]:
            u = mirror.vector(y)
            left, rows = face.at(mirror.point(y, 0))
            even, along = mirror.sides(left), mirror.sides([dot(row, u) for row in rows])
            change = self.change(y, eps)
            found = [along[r] if r in odd else even[r] for r in range(face.size - 1)]
            found = [x + half * z for x, z in zip(found, change, strict=True)]
            return [*found, y[way] - 1], self.derivatives(y, eps)

        return equations

    def change(self, y: Sequence[arb], eps: arb) -> list[arb]:
        """Return the derivatives of the equations by ``e^2 / 2``."""
        mirror, face = self.mirror, self.face
        x, u, odd = mirror.point(y, PART * eps), mirror.vector(y), mirror.odd_equations
        second, third = mirror.sides(face.second(x, u)[:-1]), mirror.sides(face.third(x, u))
        return [third[r] / 3 if r in odd else second[r] for r in range(face.size - 1)]

    def derivatives(self, y: Sequence[arb], eps: arb) -> list[list[arb]]:
        """Return the derivatives of the equations by ``(s, u)``."""
        mirror, face = self.mirror, self.face
        x, u = mirror.point(y, PART * eps), mirror.vector(y)
        rows, turned = mirror.adapted(face.at(x)[1]), mirror.adapted(face.turned(x, u))
        for r, (row, more) in enumerate(zip(rows, turned, strict=True)):
            for c in range(face.size):
                if r in mirror.odd_equations and c not in mirror.odd:
                    row[c] = more[c]
                elif r not in mirror.odd_equations and c in mirror.odd:
                    row[c] *= PART * eps
        return [*rows, [arb(int(c == self.way)) for c in range(face.size)]]

    # ------------------------------------------------------------------------------ the four curves

    @staticmethod
    def shown(curve: Callable[[float], Any]) -> Any:
        """Return trunk or arms, as far beyond the ends of arcs as is shown."""
        reason = NotShownError()
        for factor in WIDER:
            try:
                return curve(factor)
            except NotShownError as error:
                reason = error
        raise reason

    def arms_of(self, factor: float) -> tuple[list[arb], arb, bool]:
        """Return the arms in adapted coordinates, how far they go, and whether ``t`` grows."""
        mirror, face, w = self.mirror, self.face, Watched(self.family)
        eps = arb(0)
        for x, even in zip(self.near, self.evens, strict=True):
            eps = eps if even else eps.max((factor * abs(mirror.parts(x)[self.way])).mid())
        centre = [x.mid() for x in self.y]
        arms = zero_near(self.divided(ZERO), centre, self.divided(eps))
        x = mirror.point(arms, PART * eps)
        v = self.family.p.values(x[: face.d])
        others = (v[self.family.p.outputs[i]] for i in range(w.m) if i not in face.active)
        t, mu = x[face.n], x[face.d : face.d + len(face.active)]
        fine = all(y > 0 for y in (*others, *mu, x[-1], t - w.low, w.high - t))
        need(fine, "something may vanish on the arms of a branch point")
        change = [*self.change(arms, eps), ZERO]
        rate = solved(self.derivatives(arms, eps), [-y for y in change])[face.n]
        need(rate > 0 or rate < 0, "the parameter is not shown to change along the arms")
        return arms, eps, bool(rate > 0)

    def trunk_of(self, factor: float) -> Tube:
        """Return the tube of symmetric points, along which ``t`` grows."""
        face, w = EvenFace(self.face, self.mirror), Watched(self.family)
        along = face.kernel(self.centre)
        along = along if along[face.n] > 0 else [-y for y in along]
        normal, reach = [y / u**2 for y, u in zip(along, face.units, strict=True)], ZERO
        for x, even in zip(self.near, self.evens, strict=True):
            away = dot(normal, [a - b for a, b in zip(x, self.centre, strict=True)])
            reach = reach.max((factor * abs(away)).mid()) if even else reach
        tube = Tube.about(face, self.centre, along, reach)
        need(tube.contains(self.centre), "the branch point is not shown to be symmetric")
        need(all(y > 0 for y in w.values(tube)), "something may vanish on the trunk")
        need(self.alone(self.mirror.parts(tube.x)), "the trunk may branch twice")
        return tube

    def alone(self, y: list[arb]) -> bool:
        """Whether all solutions ``s + a`` in a box with ``a != 0`` are on the arms.

        Or, where ``a`` is 0 in the box, all with ``A(s, 0) u = 0`` are the branch point.
        """
        mirror, way = self.mirror, self.way
        rows = mirror.adapted(self.face.at(mirror.point(y, ZERO.union(arb(1))))[1])
        places = [(j, r) for (_, j, _), (_, r, _) in
                  zip(mirror.unknowns, mirror.equations, strict=True)]  # fmt: skip
        units, others, hull = self.face.units, [c for c in mirror.odd if c != way], list(y)
        hull[way] = arb(1)
        try:
            if others:
                form = arb_mat(
                    [[units[j] * rows[r][c] * units[c] for c in others] for j, r in places]
                )
                u = fitted(form, column([-units[j] * rows[r][way] for j, r in places]))
                for c, x in zip(others, u, strict=True):
                    hull[c] = x * units[c]
            hull = [a.union(b) for a, b in zip(hull, self.arms, strict=True)]
            jacobian = arb_mat(self.derivatives(hull, y[way].abs_upper()))
            (jacobian.mid().inv().mid() * jacobian).inv()
        except (NotShownError, ZeroDivisionError):
            return False
        return True

    def covers(self, x: Sequence[arb]) -> bool:
        """Whether all solutions in a box of unknowns are on the four curves."""
        y = self.mirror.parts(x)
        if not abs(y[self.way]) <= self.eps:
            return False
        odd = y[self.way] > 0 or y[self.way] < 0
        return bool(odd or self.trunk.covers(self.mirror.point(y, 0))) and self.alone(y)

    @staticmethod
    def narrowed(x: list[arb], steps: int) -> list[arb]:
        """Return a box as it is: the equations of the face are not regular about a branch point."""
        del steps
        return x

    def close(self, ends: Sequence[tuple[StoredArc, int]]) -> None:
        """Check that each of the four curves is the beginning of one arc."""
        sides = {(True, -1): 1, (True, 1): 0}
        sides |= {(False, -1): int(not self.grows), (False, 1): int(not self.grows)}
        found, way = list[list[arb]](), self.way
        for near, even, (_, side) in zip(self.near, self.evens, ends, strict=True):
            if even:
                x = zero_near(self.trunk.face.pinned(self.trunk.normal, near), near)
                place = self.trunk.place(x) - self.trunk.place(self.centre)
                fine = self.trunk.contains(x)
            else:
                units = [[arb(int(i == j)) for j in range(len(near))] for i in range(len(near))]
                normal = [self.mirror.parts(unit)[way] for unit in units]
                x = zero_near(self.face.pinned(normal, near), near)
                place, fine = self.mirror.parts(x)[way], self.covers(x)
            need(fine and (place > 0 or place < 0), "an arc is not shown to come from its branch")
            need(sides.pop((even, 1 if place > 0 else -1), None) == side, "arcs at a pitchfork")
            found.append(x)
        for x, (arc, side) in zip(found, ends, strict=True):
            arc.close(side, x)
