"""A strict local minimum, from the conditions of first and second order at a point.

Let ``q`` be a point where

1. ``f_i = 0`` for some *active* inequalities ``A``, ``h_j = 0`` for equations ``B``, and
   ``dE = sum lam_i df_i + sum mu_j dh_j`` with ``lam_i > 0``;
2. all other equations hold; ``q`` is in the set, and every branch of the set that meets a
   neighbourhood asks for all of ``A``;
3. the Hessian of ``E - sum lam_i f_i - sum mu_j h_j`` is positive definite on the vectors that the
   gradients of ``A`` and ``B`` annihilate.

Then ``q`` is a strict local minimum of ``E`` on ``{f_A >= 0, h_B = 0}`` ([NW] thm 12.6), and so on
the set.  Modulo symmetries: fields annihilate ``E``, ``f_A`` and ``h_B``, the normals of sections
``n_k (q - c) = 0``, which the fields cross, join the gradients, and all is said on the section.

``q`` is the only zero of the equations of 1 in a box, by Krawczyk's operator, which shows too that
the matrix of their derivatives is regular on the box: the inertia of the Hessian in 3 is that in
the middle.  Or ``q`` is the centre itself, where the equations hold in rational numbers: there
functions may vanish without pressing, and ``A`` are those with ``lam_i > 0``.

``H`` is positive definite on ``{G d = 0}`` if ``H + t G^T G`` is positive definite for some ``t``.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from .algebra import Algebra, constant, number
from .balls import ZERO, NotShownError, column, definite, dot, hull, moved, need, places
from .rationals import decimals, ratios
from .statement import MOST_NAMED, StoredStatement, largest, zero_near

PIECES = 64  # into which a cell is bisected at most
STIFF = (0, 1, 10, 10**3, 10**6, 10**9)  # t, relative to second derivatives


class StoredMinimum(StoredStatement):
    """A strict local minimum of one problem."""

    def __init__(self, data: dict[str, Any]) -> None:
        super().__init__(data)
        p = self.p
        self.active = self.rows("active", 0, p.m)
        self.equations = self.rows("equations", p.m, self.energy)
        self.held = [*self.active, *self.equations]
        self.show()

    def show(self) -> None:
        """Check all hypotheses at the point of the file."""
        need(self.size == self.p.n, "a strict minimum has no parameters")
        self.centre = ratios(self.record["centre"], self.size, "centre")
        self.point = [arb(x) for x in self.centre]
        exact = Algebra(self.p, self.centre)
        lam = self.rational(exact)
        self.exact = lam is not None
        if lam is None:
            self.point = self.settled(self.point, [], [])
            self.pressing = self.active
        else:
            self.at_corner(exact, lam)
        self.value = self.p.values(self.point)[self.p.outputs[self.energy]]

    # -------------------------------------------------------------------------- in ball arithmetic

    def system(self, centre: Sequence[arb], parameters: Sequence[arb]) -> Any:
        """Return the equations of 1, by coordinates in scale units and multipliers."""
        n, normals = self.size, self.normals

        def equations(z: list[arb]) -> tuple[list[arb], list[list[arb]]]:
            q = [x * s for x, s in zip(z, self.scales, strict=False)]
            forms = self.forms([*q, *parameters], [*self.held, self.energy])
            weights = [*(-x for x in z[n : n + len(self.held)]), arb(1)]
            rows = [*(g for _, g, _ in forms[:-1]), *normals]
            table = [[row.get(i, ZERO) for i in range(n)] for row in rows]
            residual = [forms[-1][1].get(i, ZERO) for i in range(n)]
            for x, row in zip(z[n:], table, strict=True):
                residual = [r - x * g for r, g in zip(residual, row, strict=True)]
            away = [x - c for x, c in zip(q, centre, strict=True)]
            residual += [value for value, _, _ in forms[:-1]]
            residual += [dot([arb(x) for x in g.normal], away) for g in self.gauges]
            bent = self.lagrangian(weights, forms)
            above = [[*line, *(-row[i] for row in table)] for i, line in enumerate(bent)]
            jacobian = [*above, *([*row, *[ZERO] * len(rows)] for row in table)]
            if parameters and not all(x.is_exact() for x in parameters):
                # by mean values in the parameters, which are wide
                middle = [x.mid() for x in parameters]
                residual, _ = self.system(centre, middle)(z)
                for j, (x, c) in enumerate(zip(parameters, middle, strict=True), n):
                    rates = [dot(weights, [h.get((i, j), ZERO) for _, _, h in forms])
                             for i in range(n)]  # fmt: skip
                    rates += [g.get(j, ZERO) for _, g, _ in forms[:-1]]
                    rates += [ZERO] * len(normals)
                    residual = [r + g * (x - c) for r, g in zip(residual, rates, strict=True)]
            return residual, jacobian

        return equations

    def lagrangian(self, weights: Sequence[arb], forms: Sequence[Any]) -> list[list[arb]]:
        n = range(self.size)
        return [[dot(weights, [h.get((i, j), ZERO) for _, _, h in forms]) for j in n] for i in n]

    def settled(
        self, start: Sequence[arb], middle: Sequence[arb], whole: Sequence[arb]
    ) -> list[arb]:
        """Enclose the point for all values of the parameters, and check the hypotheses there."""
        n, held = self.size, len(self.held)
        lam = self.multipliers([*start, *middle])
        z = [x / s for x, s in zip(start, self.scales, strict=True)]
        system, around = (self.system(start, some) for some in (middle, whole))
        found = zero_near(system, [*z, *lam], around)
        fine = all(x > 0 for x in found[n : n + len(self.active)])
        need(fine, "multipliers are not shown to be positive")
        point = [x * s for x, s in zip(found, self.scales, strict=False)]
        self.check_place([*point, *whole], self.active, frozenset(self.active))
        mid = [x.mid() for x in point]
        weights = [x.mid() for x in found[n : n + held]]
        self.check_curvature([*mid, *middle], weights, self.held)
        return point

    def multipliers(self, q: Sequence[arb]) -> list[arb]:
        """Return multipliers that nearly solve the equations, of the sections as well."""
        forms = self.forms(q, [*self.held, self.energy])
        rows = [g for _, g, _ in forms]
        *table, pull = [[g.get(i, ZERO).mid() for i in range(self.size)] for g in rows]
        table += [[g.get(i, ZERO).mid() for i in range(self.size)] for g in self.normals]
        if not table:
            return []
        across = arb_mat(table)
        try:
            square = (across * across.transpose()).mid()
            found = square.solve(across * column(pull))
        except ZeroDivisionError:
            need(False, "the gradients of active functions are not shown to be independent")
        return [x.mid() for x in found.entries()]

    def check_place(
        self, box: Sequence[arb], pressing: Sequence[int], zeros: frozenset[int]
    ) -> None:
        """Check that the point is in the set, which asks for all functions that press."""
        p = self.p
        self.check_equations(box, self.equations)
        self.check_symmetries(box, [*pressing, *self.equations, self.energy])
        v = p.values(box)
        signs = p.signs(v)
        signs[p.m :] = [0] * p.k
        others = (i for i in range(p.m) if signs[i] == 0 and i not in zeros)
        zeros |= {i for i in others if self.follows(v, i, self.held)}
        sets = p.open_sets(signs)
        known = sets and any(u <= zeros for u in sets)
        if not known:
            some = sorted(frozenset().union(*sets) - zeros) if sets else []
            what = f": {self.named(some)} may vanish there" if some else ""
            need(False, f"the point is not shown to be in the set{what}")
        fine = all(u.issuperset(pressing) for u in sets)
        need(fine, "active functions are not asked for by every branch")

    def check_curvature(self, q: Sequence[arb], lam: Sequence[arb], held: Sequence[int]) -> None:
        forms = self.forms(q, [*held, self.energy])
        bent = arb_mat(self.lagrangian([*(-x for x in lam), arb(1)], forms))
        rows = [*(g for _, g, _ in forms[:-1]), *self.normals]
        table = [[g.get(i, ZERO) for i in range(self.size)] for g in rows]
        stiff = arb_mat(self.size, self.size)
        for row in table:
            normal = column(row)
            size = largest(row)
            stiff += normal * normal.transpose() * (1 / size**2 if size > 0 else ZERO)
        size = largest([x.mid() for x in bent.entries()]) + arb(2) ** -self.bits
        tried = ((bent + stiff * size * t).tolist() for t in STIFF)
        fine = any(map(definite, tried))
        need(fine, "second derivatives are not shown to be positive along the face")

    # ------------------------------------------------------------------------- in rational numbers

    def rational(self, exact: Algebra) -> list[fmpq] | None:
        """Return multipliers with which the equations of 1 hold exactly at the centre, or None."""
        n, nodes = self.size, [self.p.outputs[i] for i in (*self.held, self.energy)]
        if any(exact.value(node) != {} for node in nodes[:-1]):
            return None
        units = [[number(fmpq(int(i == j))) for i in range(n)] for j in range(n)]
        columns: list[list[Any]] = [
            [constant(x) for x in exact.slopes(unit, nodes)] for unit in units
        ]
        if any(None in column for column in columns):
            return None
        if not self.held:
            return [] if not any(column[0] != 0 for column in columns) else None
        g, e = fmpq_mat([c[:-1] for c in columns]), fmpq_mat([c[-1:] for c in columns])
        try:
            lam = (g.transpose() * g).solve(g.transpose() * e)
        except ZeroDivisionError:
            return None
        fine = g * lam == e and all(x >= 0 for x in lam.entries()[: len(self.active)])
        return list(lam.entries()) if fine else None

    def at_corner(self, exact: Algebra, lam: list[fmpq]) -> None:
        """Check the hypotheses at the centre."""
        p, pairs = self.p, list(zip(self.held, lam, strict=True))
        values = {i: constant(exact.value(p.outputs[i])) for i in range(p.m)}
        zeros = frozenset(i for i, x in values.items() if x is not None and x == 0)
        self.pressing = [i for i, x in pairs if x != 0 and i < p.m]
        finite = all(p.values(self.point)[p.outputs[i]].is_finite() for i in zeros)
        need(finite, "functions are not shown to be defined at the point")
        self.check_place(self.point, self.pressing, zeros)
        kept = [(i, x) for i, x in pairs if i >= p.m or x != 0]
        weights = [arb(x) for _, x in kept]
        self.check_curvature(self.point, weights, [i for i, _ in kept])

    # ------------------------------------------------------------------------------------- words

    def said(self) -> Iterator[str]:
        """Yield the parts of the statement."""
        away = [x - c for x, c in zip(self.point, self.centre, strict=True)]
        radius = ZERO if self.exact else largest(away)
        yield f"a strict local minimum {self.where(self.point, self.centre, radius)}"
        yield self.energies(self.value, self.value, self.exact)
        yield from self.modulo()
        if self.pressing:
            yield f"supported by {self.named(self.pressing)}"
        yield self.problem()


class StoredCells(StoredMinimum):
    """A strict local minimum for each value of some parameters, cell by cell.

    The file divides the box by a tree of splits, each node before its halves.  In each cell
    Krawczyk's operator shows, for all its parameters together, that the equations of 1 have one
    solution in a box of coordinates and multipliers, and the hypotheses are checked there.  As all
    matrices of their derivatives are regular on the box, the Hessian has one inertia along the
    face, which is that in the middle.  Cells for which this is not shown at once are bisected.
    """

    def show(self) -> None:
        """Check the tree, and the hypotheses in each cell."""
        count, record = self.p.n - self.size, self.record
        need(count, "a box of parameters has parameters")
        self.lower, self.upper = (
            [float.fromhex(text) for text in record[side]] for side in ("lower", "upper")
        )
        ends = list(zip(self.lower, self.upper, strict=True))
        fine = all(abs(a) < float("inf") and a < b < float("inf") for a, b in ends)
        need(len(ends) == count and fine, "sides of the box of parameters")
        self.pressing, self.cells = self.active, 0
        self.found: list[arb] = []
        waiting = [(self.lower, self.upper)]
        for node in record["tree"]:
            need(waiting, "the tree has too many nodes")
            lo, hi = waiting.pop()
            if "start" in node:
                start = [arb(x) for x in ratios(node["start"], self.size, "a start")]
                self.cover(start, lo, hi)
                self.cells += 1
            else:
                (axis,) = places([node["axis"]], count, "an axis")
                x = float.fromhex(node["at"])
                need(lo[axis] < x < hi[axis], f"a cell is split at {x}")
                waiting += [(moved(lo, axis, x), hi), (lo, moved(hi, axis, x))]
        need(not waiting, "the tree is incomplete")

    def cover(self, start: list[arb], lower: list[float], upper: list[float]) -> None:
        """Check a cell, or all parts of a bisection of it."""
        waiting = [(lower, upper)]
        for _ in range(PIECES):
            lo, hi = waiting.pop()
            middle = [0.5 * (a + b) for a, b in zip(lo, hi, strict=True)]
            whole = hull(lo, hi)
            try:
                point = self.settled(start, [arb(x) for x in middle], whole)
                (value,) = [self.p.values([*point, *whole])[self.p.outputs[self.energy]]]
                need(value.is_finite(), "the energy is not bounded")
            except NotShownError as error:
                reason = f"{error}"
                shares = [
                    (b - a) / (d - c)
                    for a, b, c, d in zip(lo, hi, self.lower, self.upper, strict=True)
                ]
                axis = shares.index(max(shares))
                need(lo[axis] < middle[axis] < hi[axis], reason)
                waiting += [
                    (moved(lo, axis, middle[axis]), hi), (lo, moved(hi, axis, middle[axis])),
                ]  # fmt: skip
                continue
            new: list[Any] = [*point, value]
            old = self.found or new
            self.found = [x.union(y) for x, y in zip(old, new, strict=True)]
            if not waiting:
                return
        need(False, f"a cell is not covered: {reason}")

    def said(self) -> Iterator[str]:
        """Yield the parts of the statement."""
        ends = zip(self.p.names[self.size :], self.lower, self.upper, strict=True)
        box = " and ".join(f"{name} from {a} to {b}" for name, a, b in ends)
        yield f"for all {box} there is a strict local minimum"
        *point, energy = [decimals(x, x) for x in self.found]
        if self.size <= MOST_NAMED:
            sides = zip(self.p.names, point, strict=False)
            yield ", ".join(f"{name} between {a} and {b}" for name, (a, b) in sides)
        yield f"its energy is between {energy[0]} and {energy[1]}"
        yield from self.modulo()
        if self.pressing:
            yield f"supported by {self.named(self.pressing)}"
        yield f"{self.cells} cells"
        yield self.problem()
