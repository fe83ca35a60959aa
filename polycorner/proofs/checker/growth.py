"""A local minimum between two energies, from the growth of the energy around a point.

Let ``D = {f_i >= 0, h_j = 0}``, ``S`` some inequalities, ``B`` some equations, and let the *core*
``u`` be the coordinates that the energy ``E``, ``S`` or ``B`` read; the others, ``r``, rattle.  The
file gives a centre ``c``, a point ``p``, weights ``lam``, the box ``U = {|u - c| <= R}`` (largest
entries, in scale units) and a box ``R'`` of ``r``; ``N = U x R'``.  ``G`` are the gradients of
``S`` and ``B`` by rows and ``e`` is that of ``E``, enclosed on ``N``.

Order 1.  Let ``P`` be near ``G (G^T G)^-1`` with ``|I - G^T P| = k < 1`` (row sums) and
``t = k / (1 - k)``, let ``m = lam + P (s +- t |s|)`` with ``s = e - G^T lam`` be positive on ``S``,
``P'_ia = |P_ia| + t sum_b |P_ib|`` and ``kappa = min m_i / P'_ia`` over ``S``.  Then on
``{f_S >= 0, h_B = 0}`` in ``N``: ``E(q) >= E(c) - delta + kappa |u - c|``, with
``delta = sum_S 2 m_i max(f_i(c), 0) + sum_B (|m_j| + kappa max_a P'_ja) |h_j(c)|``.
*Proof.*  For ``d = u - c``, ``f(u) = f(c) + G~ d`` and ``E(u) = E(c) + e~ d`` by mean values.  For
``|v|_1 <= kappa`` the weights ``w = lam + P (G~^T P)^-1 (e~ - G~^T lam - v)`` solve
``G~^T w = e~ - v`` and lie in ``[0, 2 m]`` on ``S``.  So ``(e~ - v) d = sum w_i (f_i(u) - f_i(c))``
is at least ``-delta``; take ``v = kappa sign(d_a)`` at the largest ``|d_a|``.

Order 2.  Let ``H`` be the Hessian of ``L = E - sum lam_i f_i - sum mu_j h_j``, ``f_i <= F_i`` on
``N``, ``w_i = lam_i / F_i`` on ``S`` and any ``w_j > 0`` on ``B``; let
``H + sum w_i g_i g_i^T - sigma I`` be positive definite on ``N``, and ``eps >= |dL(c)|``.  Then
``E(q) >= E(c) - delta - eps |d| + sigma |d|^2 / 2``, ``delta = sum |lam_i f_i(c)| + w_i f_i(c)^2``.
*Proof.*  ``lam_i f_i >= w_i f_i^2 >= w_i ((g~ d)^2 / 2 - f_i(c)^2)`` for ``0 <= f_i <= F_i``.

Theorem.  Let ``p`` in ``D`` lie inside ``N``, ``gap >= E(p) - E(c) + delta``, and
``rho = gap / kappa``, or ``(eps + sqrt(eps^2 + 2 sigma gap)) / sigma``, be less than ``R``; let
functions that read ``r`` be positive on ``{|u - c| <= rho} x R'``.  Then some ``(u*, r)`` with
``|u* - c| <= rho`` is a local minimum for every ``r`` inside ``R'``, with an energy between
``E(c) - delta`` (less ``eps^2 / (2 sigma)``) and ``E(p)``.  *Proof.*  A lowest point of ``D`` in
``N`` has ``|u* - c| <= rho``, as ``p`` is in ``D``; ``r`` may be replaced.

Nothing else (order 1, no union).  Let ``Z`` be the functions not positive on ``N``, none of which
reads ``r``; ``w`` a direction, made tangent to ``B``, with ``g_i w >= eta_i > 0`` on ``Z``;
``T >= max(e w, 0)``; ``h`` the sums of sizes of second derivatives; ``M = h_E + T max h_i / eta_i +
sum |mu_j| h_j``.  If ``phi(x) = kappa x - gap - M (x + |p - c|)^2 / 2`` is positive at ``x0`` and
``R1``, stationary points with ``|u - c| <= R1`` have ``|u - c| < x0``.  *Proof.*  At one,
``e = sum nu_i g_i + sum mu_j h_j'`` with ``nu >= 0`` on active functions and
``sum nu_i eta_i <= T``.  Taylor's theorem for ``E - nu f - mu h`` from ``q`` to ``p`` gives
``E(q) <= E(p) + M |q - p|^2 / 2``, so ``phi(|u - c|) <= 0``; but ``phi`` is concave.

If ``f_S`` and ``h_B`` vanish at ``c`` exactly, and ``c`` is in ``D``, then ``p = c``, ``gap = 0``
in order 1: ``c`` is a strict minimum in ``u``.  In a union ``S`` belongs to all branches that meet
``N``.  Modulo symmetries, sections ``n_k (q - c) = 0`` join ``B``; all is said on the section.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from flint import arb, arb_mat

from .algebra import Algebra, constant
from .balls import ZERO, column, definite, dot, need, square
from .rationals import decimal, ratio, ratios
from .statement import PART, StoredStatement, largest, least, upper, zero_near

SHARES = (0.5, 0.1, 0.01)  # of the least eigenvalue, that are tried as sigma
HEAVY = (10, 10**3, 10**6)  # weights of equations relative to second derivatives
STEPS = 200  # tries for the distances of the last theorem
SHRINK = 0.9


class StoredGrowth(StoredStatement):
    """A minimum that lies between two energies."""

    def __init__(self, data: dict[str, Any]) -> None:
        super().__init__(data)
        p, record = self.p, self.record
        need(self.size == p.n, "a minimum between energies has no parameters")
        self.order = record["order"]
        need(type(self.order) is int and self.order in {1, 2}, f"the order is {self.order}")
        self.supports = self.rows("supports", 0, p.m)
        self.equations = self.rows("equations", p.m, self.energy)
        self.held = [*self.supports, *self.equations]
        self.centre, self.inner, self.direction = (
            ratios(record[name], self.size, name) for name in ("centre", "inner", "direction")
        )
        lam = ratios(record["weights"], len(self.held), "weights")
        self.lam = [arb(x) for x in lam]
        self.reach = ratio(record["reach"])
        read = (p.reads(row) for row in (*self.held, self.energy))
        normal = (i for g in self.gauges for i, x in enumerate(g.normal) if x != 0)
        self.core = sorted(frozenset(normal).union(*read))
        self.room = {j: ratio(x) for j, x in record["room"]}
        self.loose = [j for j in range(self.size) if j not in self.core]
        need(sorted(self.room) == self.loose and len(self.room) == len(record["room"]), "the room")
        need(self.reach > 0 and all(x > 0 for x in self.room.values()), "sides are positive")
        self.show()

    def box(self, radius: Any) -> list[arb]:
        """Return the points whose core lies within a radius, in the room of the rest."""
        half = [self.room.get(j, radius) for j in range(self.size)]
        return [
            arb(c) + PART * x * s
            for c, x, s in zip(self.centre, half, self.scales, strict=True)
        ]  # fmt: skip

    def dense(self, form: Any) -> tuple[arb, list[arb], list[list[arb]]]:
        value, g, h = form
        slopes = [g.get(i, ZERO) for i in self.core]
        return value, slopes, [[h.get((i, j), ZERO) for j in self.core] for i in self.core]

    def show(self) -> None:
        """Check all hypotheses."""
        p, whole = self.p, self.box(self.reach)
        need(self.core, "the energy reads no coordinate")
        for j, period in enumerate(p.periods):
            narrow = period is None or 2 * self.reach * self.scales[j] < period / 2
            need(narrow, "the box is half a period wide")
        v = p.values(whole)
        signs = p.signs(v)
        signs[p.m :] = [0] * p.k
        self.pieces = p.open_sets(signs)
        need(self.pieces, "the set does not meet the box")
        every = all(self.supports_in(piece) for piece in self.pieces)
        need(every, "functions that support are not asked for by every branch")
        self.check_equations(whole, self.equations)
        self.closed = sorted(frozenset().union(*self.pieces) - set(self.supports))
        rows = [*self.held, *self.closed, self.energy]
        self.check_symmetries(whole, rows)
        self.forms_there = [self.dense(form) for form in self.forms(whole, rows)]
        self.forms_here = [self.dense(f) for f in self.forms([arb(x) for x in self.centre], rows)]
        self.tops = [v[p.outputs[i]] for i in self.supports]
        self.kappa = self.sigma = self.eps = ZERO
        (self.spread if self.order == 1 else self.bend)()
        self.strict = self.order == 1 and self.is_corner()
        self.between()
        others = [
            i for i in range(p.m) if signs[i] <= 0 and p.reads(i).intersection(self.loose)
        ]  # fmt: skip
        near = p.values(self.box(self.radius))
        for i in others:
            fine = near[p.outputs[i]] > 0
            need(fine, f"{self.named([i])} is not shown to leave room to what rattles")
        self.alone = self.nothing_else()

    def supports_in(self, piece: frozenset[int]) -> bool:
        return piece.issuperset(self.supports)

    def gradients(self, forms: Sequence[Any]) -> list[list[arb]]:
        """Return the rows of ``S``, ``B`` and the sections."""
        rows = [g for _, g, _ in forms[: len(self.held)]]
        return [*rows, *([n.get(i, ZERO) for i in self.core] for n in self.normals)]

    # ------------------------------------------------------------------------------------ growth

    def spread(self) -> None:
        """Set ``kappa`` and ``delta`` of order 1."""
        n, count, held = len(self.core), len(self.supports), len(self.held)
        need(self.supports, "no function supports")
        middle = arb_mat(self.gradients(self.forms_here)).mid()
        try:
            p = (middle * (middle.transpose() * middle).inv()).mid()
        except ZeroDivisionError:
            need(False, "the gradients of the functions that support do not span")
        across = arb_mat(self.gradients(self.forms_there)).transpose()
        defect = (arb_mat(n, n, 1) - across * p).tolist()
        k = largest([sum(map(abs, row), ZERO) for row in defect])
        need(k < 1, "the gradients of the functions that support are not shown to span")
        t = k / (1 - k)
        lam = [*self.lam, *[ZERO] * len(self.gauges)]
        slope = column(self.forms_there[-1][1])
        rest = (slope - across * column(lam)).entries()
        most = largest(rest)
        moved = p * arb_mat([[x + PART * t * most] for x in rest])
        m = [x + y for x, y in zip(lam, moved.entries(), strict=True)]
        need(all(x > 0 for x in m[:count]), "multipliers are not shown to be positive on the box")
        rows = p.tolist()
        spreads = [largest(row) + t * sum(map(abs, row), ZERO) for row in rows]
        self.kappa = least([x / s for x, s in zip(m[:count], spreads, strict=False)])
        delta = ZERO
        for i in range(held):
            value = self.forms_here[i][0]
            if i < count:
                delta += 2 * m[i] * value.max(ZERO)
            else:
                delta += (abs(m[i]) + self.kappa * spreads[i]) * abs(value)
        self.delta = upper(delta)

    def bend(self) -> None:
        """Set ``sigma``, ``eps`` and ``delta`` of order 2."""
        n, count = len(self.core), len(self.supports)
        fine = all(x > 0 for x in self.lam[:count])
        need(fine, "multipliers are not positive")
        stiff = [x / f.upper() for x, f in zip(self.lam, self.tops, strict=False)]
        fine = all(x > 0 and x.is_finite() for x in stiff)
        need(fine, "functions that support are not bounded on the box")
        weights = [*(-x for x in self.lam), *[ZERO] * len(self.closed), arb(1)]
        bends = [h for _, _, h in self.forms_there]
        form = [[dot(weights, [h[i][j] for h in bends]) for j in range(n)] for i in range(n)]
        rows, free = self.gradients(self.forms_there), len(self.equations) + len(self.gauges)
        size = largest([x.mid() for row in form for x in row]) + 1
        for heavy in HEAVY:
            all_stiff = [*stiff, *[heavy * size] * free]
            if self.is_stiff(form, rows, all_stiff) or not free:
                break
        need(self.sigma > 0, "second derivatives are not shown to be positive on the box")
        slopes = [g for _, g, _ in self.forms_here]
        pull = [dot(weights, column) for column in zip(*slopes, strict=True)]
        self.eps = upper(sum(map(square, pull), ZERO).sqrt())
        delta = ZERO
        for i, (x, w) in enumerate(zip(self.lam, all_stiff, strict=False)):
            value = self.forms_here[i][0]
            delta += abs(x * value) + w * square(value)
        self.delta = upper(delta)

    def is_stiff(
        self, form: list[list[arb]], rows: list[list[arb]], weights: Sequence[arb]
    ) -> bool:
        """Find ``sigma``: transform to nearly the unit matrix first, then add ``w g g^T``.

        Errors of ``w g g^T`` would couple directions of very different stiffness.
        """
        middle = arb_mat(form).mid()
        for w, row in zip(weights, rows, strict=True):
            normal = column([x.mid() for x in row])
            middle += normal * normal.transpose() * w.mid()
        turn = inverse_root(middle.mid().tolist())
        if turn is None:
            return False
        t = arb_mat(turn)
        metric = t * t.transpose()
        bent = t * arb_mat(form) * t.transpose()
        for w, row in zip(weights, rows, strict=True):
            along = (t * column(row)).entries()
            bent += arb_mat(
                [[w * (square(x) if i == j else x * y) for j, y in enumerate(along)]
                 for i, x in enumerate(along)]
            )  # fmt: skip
        most = (t.transpose() * t).trace()  # near the trace of the inverse
        for share in SHARES:
            sigma = (arb(share) / most).lower()
            if sigma > 0 and definite((bent - metric * sigma).tolist()):
                self.sigma = sigma
                return True
        return False

    # ----------------------------------------------------------------------------------- theorem

    def is_corner(self) -> bool:
        """Whether ``f_S`` and ``h_B`` vanish at the centre and it lies in the set, exactly."""
        exact = Algebra(self.p, self.centre)
        values = [exact.value(self.p.outputs[i]) for i in (*self.held, *self.closed)]
        if any(value != {} for value in values[: len(self.held)]):
            return False
        pairs = zip(self.closed, map(constant, values[len(self.held) :]), strict=True)
        fine = {i for i, x in pairs if x is not None and x >= 0}
        return any(piece <= fine.union(self.supports) for piece in self.pieces)

    def between(self) -> None:
        """Set the bounds of the energy and the radius."""
        p, energy = self.p, self.forms_here[-1][0]
        self.above, gap, self.apart = energy, ZERO, ZERO
        if not self.strict:
            inner = self.inner_point()
            v = p.values(inner)
            known = {i for i in range(p.m) if v[p.outputs[i]] >= 0}
            need(any(u <= known for u in self.pieces), "the inner point is not in the set")
            away = [
                (x - c) / s for x, c, s in zip(inner, self.centre, self.scales, strict=True)
            ]  # fmt: skip
            self.apart = largest([away[j] for j in self.core])
            inside = all(abs(away[j]) < x for j, x in self.room.items())
            need(self.apart < self.reach and inside, "the inner point is not inside the box")
            self.above = v[p.outputs[self.energy]]
            gap = upper(self.above - energy + self.delta)
        self.gap, self.below = gap, energy - (ZERO if self.strict else self.delta)
        if self.order == 2:
            root = (square(self.eps) + 2 * self.sigma * gap).sqrt()
            self.radius = upper((self.eps + root) / self.sigma)
            self.below -= square(self.eps) / (2 * self.sigma)
        else:
            self.radius = upper(gap / self.kappa)
        need(self.radius < self.reach, "the minimum may lie at the sides of the box")

    def inner_point(self) -> list[arb]:
        """Enclose ``p``: equations and sections determine as many of its coordinates."""
        found = [arb(x) for x in self.inner]
        if not (self.equations or self.gauges):
            return found

        def conditions(q: list[arb]) -> tuple[list[arb], list[list[arb]]]:
            forms = self.forms(q, self.equations)
            values = [value for value, _, _ in forms]
            for gauge in self.gauges:
                away = [x - c for x, c in zip(q, self.centre, strict=True)]
                values.append(dot([arb(x) for x in gauge.normal], away))
            slopes = [*(g for _, g, _ in forms), *self.normals]
            return values, [[g.get(j, ZERO) for j in range(self.size)] for g in slopes]

        places = pivots(conditions(found)[1])

        def at(x: list[arb]) -> list[arb]:
            moved = dict(zip(places, x, strict=True))
            return [moved[j] * s if j in moved else q
                    for j, (q, s) in enumerate(zip(found, self.scales, strict=True))]  # fmt: skip

        def system(x: list[arb]) -> tuple[list[arb], list[list[arb]]]:
            values, rows = conditions(at(x))
            return values, [[row[j] for j in places] for row in rows]

        start = [found[j].mid() / self.scales[j] for j in places]
        solved = zero_near(system, start)
        return at(solved)

    def nothing_else(self) -> tuple[arb, arb] | None:
        """Return ``x0`` and ``R1``, or None where the theorem says nothing."""
        reads_loose = any(self.p.reads(i).intersection(self.loose) for i in self.closed)
        if self.order == 2 or len(self.pieces) > 1 or len(self.p.branches) > 1 or reads_loose:
            return None
        count, k = len(self.supports), len(self.equations)
        sums = [sum((abs(x) for row in h for x in row), ZERO) for _, _, h in self.forms_there]
        some = [*range(count), *range(count + k, len(sums))]
        first = arb_mat([self.forms_there[i][1] for i in some])
        way = arb_mat([[arb(self.direction[j])] for j in self.core])
        rates, through = first * way, arb_mat(len(some), 0)
        if k:
            rows = arb_mat([self.forms_there[i][1] for i in range(count, count + k)])
            y = rows.mid().transpose()
            try:
                through = first * y * (rows * y).inv()
            except ZeroDivisionError:
                return None
            rates = rates - through * (rows * way)
        *etas, pull = rates.entries()
        if not all(eta > 0 for eta in etas):
            return None
        pull = upper(pull)
        m = sums[-1] + pull * largest([sums[i] / eta for i, eta in zip(some, etas, strict=False)])
        for j in range(k):
            shares = [abs(through[i, j]) / eta for i, eta in enumerate(etas)]
            mu = abs(through[len(etas), j]) + pull * largest(shares)
            m += mu * sums[count + j]
        m = upper(m)

        def phi(x: arb) -> bool:
            grown = self.kappa * x - self.gap
            return bool(grown - m * square(x + self.apart) / 2 > 0)

        outer = next((x for x in ladder(arb(self.reach).lower(), SHRINK) if phi(x)), None)
        start = (self.radius * 1.01).upper()
        inner = ZERO if self.strict else next((x for x in ladder(start, 2) if phi(x)), None)
        return None if outer is None or inner is None or not inner < outer else (inner, outer)

    # ------------------------------------------------------------------------------------- words

    def said(self) -> Iterator[str]:
        """Yield the parts of the statement."""
        widest, narrowest = max(self.scales), min(self.scales)
        kind = "a strict local minimum" if self.strict else "a local minimum"
        point = [arb(c) for c in self.centre]
        yield f"{kind} {self.where(point, self.centre, (self.radius * widest).upper())}"
        yield self.energies(self.below, self.above, self.strict)
        if self.alone:
            inner, outer = self.alone
            reach = decimal(outer * narrowest, 3, False)
            if self.strict:
                yield f"no other stationary point lies within {reach}"
            else:
                inside = decimal(inner * widest, 3, True)
                yield f"all stationary points within {reach} lie within {inside}"
        yield from self.modulo()
        if self.loose:
            sides = ", ".join(
                f"{self.p.names[j]} (side {decimal(arb(2 * x * self.scales[j]), 3, False)})"
                for j, x in sorted(self.room.items())
            )
            yield f"for all values of what rattles: {sides}"
        if self.supports:
            yield f"supported by {self.named(self.supports)}"
        if self.closed:
            yield f"{self.named(self.closed)} may vanish in the box around it"
        yield self.problem()


# ------------------------------------------------------------------------------------- numbers


def ladder(x: arb, factor: float) -> Iterator[arb]:
    for _ in range(STEPS):
        yield x
        x = (x * factor).mid()


def pivots(rows: Sequence[Sequence[arb]]) -> list[int]:
    """Return as many columns as rows, in which these are independent at their middle."""
    left = [[x.mid() for x in row] for row in rows]
    found: list[int] = []
    for k in range(len(left)):
        entries = [(float(abs(x)), i, j) for i, row in enumerate(left[k:], k)
                   for j, x in enumerate(row) if j not in found]  # fmt: skip
        size, i, j = max(entries, default=(0.0, 0, 0))
        need(size > 0, "equations and sections are not shown to be independent")
        left[k], left[i] = left[i], left[k]
        for row in left[k + 1 :]:
            factor = (row[j] / left[k][j]).mid()
            row[:] = [(x - factor * y).mid() for x, y in zip(row, left[k], strict=True)]
        found.append(j)
    return found


def inverse_root(form: list[list[arb]]) -> list[list[arb]] | None:
    """Return nearly a triangular ``T`` with ``T A T^T = I``; None for a matrix that has none."""
    n = len(form)
    t = [[arb(int(i == j)) for j in range(n)] for i in range(n)]
    left = [list(row) for row in form]
    for k in range(n):
        pivot = left[k][k].mid()
        if not pivot > 0:
            return None
        for i in range(k + 1, n):
            factor = (left[i][k] / pivot).mid()
            left[i] = [(x - factor * y).mid() for x, y in zip(left[i], left[k], strict=True)]
            t[i] = [(x - factor * y).mid() for x, y in zip(t[i], t[k], strict=True)]
        root = (1 / pivot.sqrt()).mid()
        t[k] = [(x * root).mid() for x in t[k]]
    return t
