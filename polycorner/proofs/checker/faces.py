"""Regions with one point: of KKT equations, held to first order, or a common zero; and loci."""

from typing import Any

from flint import arb, arb_mat

from .balls import (
    BESIDE,
    ZERO,
    column,
    definite,
    dot,
    fitted,
    hull,
    moved,
    need,
    negatives,
    nothing,
    number,
    shown,
    sides,
    turn,
    zero,
)
from .problem import StoredProblem

MOST_UNKNOWNS = 600  # of a point, with its multipliers
MOST_ENTRIES = 10**7  # of the second derivatives by the coordinates of a point
HALVINGS = 6  # of a region, in whose parts multipliers are enclosed
NEAR = 2.0**-30  # reach of the box in which a point is sought that functions hold


class StoredRegion:
    """A region, or a locus: a box with one KKT point on a face, all multipliers positive.

    Of a locus the face is the whole space of the coordinates that the energy depends on.
    """

    tested = 0  # properties at the point that are not shown, but tested

    def __init__(
        self, p: StoredProblem, record: dict[str, Any], places: list[int], active: Any
    ) -> None:
        self.p, self.places, self.active = p, places, frozenset(active or ())
        self.name = f"{'locus' if active is None else 'region'} {record}"
        fine = self.active <= set(range(p.m)) and set(places) <= set(p.free)
        need(fine and len({*places}) == len(places), self.name)
        self.rows = [*sorted(self.active), *range(p.m, p.m + p.k + 1)]
        self.limit()
        count = p.n if active is not None else len(places)
        self.lower, self.upper = sides(record, ("lower", "upper"), count)
        if active is not None:
            self.lower, self.upper = (
                [side[i] for i in places] for side in (self.lower, self.upper)
            )
        sharp = sides(record, ("sharp_lower", "sharp_upper"), len(places) + len(self.rows) - 1)
        starts = (start for start in map(self.start, (1, 4, 16)) if start is not None)
        tried = (zero(self.equations, start) for start in starts)
        solved = next((found for found in tried if found is not None), None)
        shown = solved is not None
        need(shown, f"{self.name}: no single solution with positive multipliers is shown")
        self.unknowns: list[arb] = solved or []
        self.placed(sharp, record, self.negative(), self.active)
        if active is None:
            self.descends()
            need(self.index is not None, f"{self.name}: the index is not decided")
            sample = record["sample"]
            fine = sample is None or self.meets(record)
            need(fine, f"{self.name}: the sample is not in the set")
            self.met = sample is not None and not self.far

    def limit(self) -> None:
        """Refuse what would take too much work and memory."""
        size, more = len(self.places), len(self.rows)
        fine = size + more <= MOST_UNKNOWNS and more * size**2 <= MOST_ENTRIES
        need(fine, f"{self.name}: these are too many coordinates and functions for this checker")

    def placed(
        self, sharp: list[list[float]], record: dict[str, Any], index: Any, given: frozenset[int]
    ) -> None:
        """Decide whether the point is in the set; the ``given`` functions are shown to vanish."""
        p, signs = self.p, self.located(sharp, given)
        self.index = index
        need(record["index"] in {None, self.index}, f"{self.name}: the index is {self.index}")
        self.branches = branches = p.open_sets(signs, self.zeros)
        sure = any(u <= self.zeros for u in branches)
        self.stationary = sure and all(self.active <= u for u in branches)
        self.free = any(u <= self.active for u in branches)  # all others are positive in one
        self.listable = self.stationary and not (p.minima_only and self.index != 0)
        self.absent = not branches or any(u < self.active for u in branches)
        self.absent |= p.minima_only and bool(self.index) and self.free

    def located(self, sharp: list[list[float]], given: frozenset[int]) -> list[int]:
        """Place the point by its unknowns; return the signs of all functions there.

        Functions that are not ``given`` count as zero where they vanish up to ``2**-80``.
        """
        p = self.p
        slack = [arb(0, 2.0**-70) * (1 + abs(x)) for x in self.unknowns]
        near = [x + y for x, y in zip(hull(*sharp), slack, strict=True)]
        # Of wide sets of solutions, for all values of parameters, this enclosure may be the wider.
        fits = arb.overlaps if p.parameters else arb.contains
        known = all(fits(x, y) for x, y in zip(near, self.unknowns, strict=True))
        need(known, f"{self.name}: the solution is elsewhere")
        self.point = self.at(self.unknowns)
        self.inside = p.inside(self.point, self.places)
        self.outside = self.inside is False
        self.far = not p.inside(self.point, self.places, BESIDE)
        v = p.values(self.point)
        signs = p.signs(v)
        self.zeros = given | {i for i in range(p.m) if nothing(v[p.outputs[i]])}
        self.tested += sum(not shown(v[p.outputs[i]]) for i in self.zeros - given)
        self.unknown = {i for i in range(p.m) if signs[i] == 0} - self.zeros
        return signs

    def at(self, unknowns: list[arb], middle: bool = False) -> list[arb]:
        """Return all coordinates; others may be anywhere in the domain, or are in its middle."""
        known = dict(zip(self.places, unknowns, strict=False))
        rest = [x.mid() for x in self.p.anywhere] if middle else self.p.anywhere
        return [known.get(i, x) for i, x in enumerate(rest)]

    def holds(self, lower: list[float], upper: list[float]) -> bool:
        ends = zip(self.lower, self.upper, self.places, strict=True)
        return all(a <= lower[i] and upper[i] <= b for a, b, i in ends)

    def rows_at(self, unknowns: list[arb], middle: bool = False) -> Any:
        """Return values of the functions, and gradients and Hessians in the free coordinates."""
        v, memo = self.p.values(self.at(unknowns, middle)), dict[int, Any]()
        found = [self.p.forms(v, row, memo, 2) for row in self.rows]
        if None in found:
            return None
        slopes = [[g.get(i, ZERO) for i in self.places] for g, _ in found]
        pairs = [[(i, j) for j in self.places] for i in self.places]
        bends = [[[h.get(ij, ZERO) for ij in row] for row in pairs] for _, h in found]
        return [v[self.p.outputs[row]] for row in self.rows], slopes, bends

    def vanishing(self, unknowns: list[arb]) -> Any:
        """Return values and gradients of the functions alone."""
        found = self.rows_at(unknowns)
        return found[:2] if found else ([], [])

    def start(self, growth: int) -> list[arb] | None:
        """Return the box, and more than an enclosure of the multipliers at all of its points."""
        multipliers = self.multipliers(self.lower, self.upper, HALVINGS)
        if multipliers is None:
            return None
        more = [x + arb(0, 1) * (growth * x.rad() + (abs(x) + 1) / 2**100) for x in multipliers]
        return [*hull(self.lower, self.upper), *more]

    def multipliers(self, lower: list[float], upper: list[float], halvings: int) -> Any:
        """Enclose the multipliers in a box, bisected where needed; None if any may be negative."""
        found = self.rows_at(hull(lower, upper))
        if found and len(self.rows) == 1:
            return []
        shown = self.solved(found[1]) if found else None
        if shown or not halvings:
            return shown
        widths = [b - a for a, b in zip(lower, upper, strict=True)]
        shares = [w / self.p.widths[i] for w, i in zip(widths, self.places, strict=True)]
        axis = shares.index(max(shares))
        middle = 0.5 * (lower[axis] + upper[axis])
        first = self.multipliers(lower, moved(upper, axis, middle), halvings - 1)
        second = first and self.multipliers(moved(lower, axis, middle), upper, halvings - 1)
        return second and [x.union(y) for x, y in zip(first, second, strict=True)]

    def solved(self, slopes: list[list[arb]]) -> list[arb] | None:
        """Enclose the solutions of ``sum lam_i g_i = dE``; None if some may not be positive."""
        *rows, energy = slopes
        try:
            found = fitted(arb_mat(rows).transpose(), column(energy))
        except ZeroDivisionError:
            return None
        return found if all(x > 0 for x in found[: len(self.active)]) else None

    def equations(self, unknowns: list[arb], middle: bool = False) -> Any:
        """Return the residual of the KKT equations and their Jacobian."""
        found = self.rows_at(unknowns, middle)
        if found is None:
            return None
        values, slopes, bends = found
        weights = [*(-x for x in unknowns[len(self.places) :]), arb(1)]
        residual = [dot(weights, column) for column in zip(*slopes, strict=True)]
        bent = [
            [dot(weights, entry) for entry in zip(*b, strict=True)]
            for b in zip(*bends, strict=True)
        ]
        rows = slopes[:-1]
        above = [[*b, *(-row[i] for row in rows)] for i, b in enumerate(bent)]
        return [*residual, *values[:-1]], [*above, *([*row, *[ZERO] * len(rows)] for row in rows)]

    def negative(self) -> int | None:
        """Return the negative eigenvalues on the tangent space: each row adds one of each sign.

        Krawczyk's operator shows that all Jacobians are regular: they have the inertia of one.
        """
        exact = [x.mid() for x in self.unknowns]
        n, (_, jacobian) = len(self.places), self.equations(exact, middle=True)
        # multiplied by -1 in the rows of the multipliers it is symmetric
        form = [row if i < n else [-x for x in row] for i, row in enumerate(jacobian)]
        found = negatives(form)
        return None if found is None else found - len(self.rows) + 1

    def descends(self) -> None:
        """Check that ``v = -C (z - z*)`` descends at a locus, and that nothing else is read."""
        read = {self.p.nodes[a][1][0] for a in self.p.needs[-1] if self.p.nodes[a][0] == "var"}
        fine = not self.p.k and {i for i in read if i in self.p.free} <= set(self.places)
        whole = arb_mat(self.equations(hull(self.lower, self.upper))[1])
        form = whole.transpose() * (whole.mid() + whole.mid().transpose())
        need(fine and definite((form + form.transpose()).tolist()), f"{self.name}: no descent")

    def meets(self, record: dict[str, Any]) -> bool:
        """Whether the sample, with the coordinates of the locus instead, is in the set."""
        sample = sides(record, ("sample", "sample"), self.p.n)[0]
        moved = set(self.p.free) - set(self.places)
        if not self.p.inside([arb(x) for x in sample], sorted(moved)):
            return False
        q = [arb(x) if i in moved else self.point[i] for i, x in enumerate(sample)]
        signs = self.p.signs(self.p.values(q))
        return any(all(signs[i] > 0 for i in branch) for branch in self.p.branches)

    def same(self, other: "StoredRegion") -> bool | None:
        """Whether two regions have one point: whether this one's lies in the other region."""
        alike, full = self.active == other.active, len(other.rows) > len(self.p.free)
        for one, two in ((self, other), (other, self)):
            if not alike and one.active - two.zeros - two.unknown:
                return False
        inside = self.lies_in(other)
        if inside is False:
            return False
        return True if inside and (alike or (full and other.active <= self.zeros)) else None

    def lies_in(self, other: "StoredRegion") -> bool | None:
        """Whether the point lies in the box of another region; None where it is not decided."""
        ends = zip(self.places, other.lower, other.upper, strict=True)
        places = ((self.point[i], a, b, self.p.periods[i]) for i, a, b in ends)
        known = [(x + turn(x, a, b, period), a, b) for x, a, b, period in places]
        if any(x < a or x > b for x, a, b in known):
            return False
        return True if all(a <= x <= b for x, a, b in known) else None


class StoredPin(StoredRegion):
    """A box without stationary points but one, at which the active functions vanish.

    The set is one intersection without equations.  For ``i`` of the active functions, the energy
    ``E`` and the coordinates ``j``, reach ``r_j``, let ``R_i`` bound half of ``|f_i''|`` over
    displacements within the reach.  Weights ``mu >= 0`` with ``sum mu_i df_i = dE + s t e_j`` at
    the point for all ``j`` and ``s = 1, -1``, ``df_i u > 0`` in the box, and
    ``t r_j > sum mu_i R_i + 2 R_E + max(R_i / df_i u) dE u`` leave no other stationary point.
    """

    def __init__(self, p: StoredProblem, record: dict[str, Any]) -> None:
        self.p, self.places, self.active = p, p.free, frozenset(record["active"])
        self.name, n, corner = f"region of {record['active']}", len(p.free), {*record["corner"]}
        plain = not p.k and not p.parameters
        need(plain and len(p.branches) == 1, f"{self.name}: not of one intersection")
        # A function that the set does not ask for may be negative in it, and hold nothing.
        fine = corner <= self.active and all(self.active <= b for b in p.branches)
        fine = fine and len(corner) == n
        need(fine, f"{self.name}: the functions")
        ends = sides(record, ("lower", "upper"), p.n)
        self.lower, self.upper = ([side[i] for i in p.free] for side in ends)
        sharp = sides(record, ("sharp_lower", "sharp_upper"), n + len(self.active))
        self.rows = [*sorted(self.active), p.m]
        self.limit()
        self.rows = sorted(corner)
        start = [x + arb(0, NEAR) * (1 + abs(x)) for x in hull(*sharp)[:n]]
        point = zero(self.vanishing, start)
        need(point, f"{self.name}: no single common zero is shown")
        self.rows = [*sorted(self.active), p.m]
        self.unknowns = [*(point or []), *self.shown(record, point or [])]
        self.placed(sharp, record, 0, frozenset(corner))
        need(self.active <= self.zeros, f"{self.name}: not all functions vanish")

    def shown(self, record: dict[str, Any], point: list[arb]) -> list[arb]:
        """Check the inequality; return positive multipliers."""
        n, count = len(self.places), len(self.active)
        box = hull(self.lower, self.upper)
        here, there = self.rows_at(point), self.rows_at(box)
        need(here and there, f"{self.name}: the functions are not smooth")
        steps, into, weights = (
            [arb(float.fromhex(x)) for x in record[name]] for name in ("steps", "into", "weights")
        )
        fine = len(steps) == 2 * n and len(into) == n and len(weights) == 2 * n * count
        need(fine and all(t > 0 for t in steps), f"{self.name}: the numbers")
        exact = self.exact(here[1], steps, arb_mat(2 * n, count, weights))
        reach = [(x - y).abs_upper() for x, y in zip(box, point, strict=True)]
        around = all(x.contains(y) for x, y in zip(box, point, strict=True))
        need(around, f"{self.name}: the box is elsewhere")
        pairs = [(i, j, a * b / 2) for i, a in enumerate(reach) for j, b in enumerate(reach)]
        *bends, bend = [sum((h[i][j].abs_upper() * r for i, j, r in pairs), ZERO) for h in there[2]]
        *grows, pull = [dot(g, into) for g in there[1]]
        need(all(x > 0 for x in grows), f"{self.name}: no direction increases all functions")
        most = pull.upper() if pull.upper() > 0 else ZERO
        lost = [r / x * most for r, x in zip(bends, grows, strict=True)]
        for k, (t, mu) in enumerate(zip(steps, exact, strict=True)):
            kept = t * reach[k % n] - dot(mu, bends) - 2 * bend
            need(all(x >= 0 for x in mu), f"{self.name}: a negative weight")
            need(all(kept > x for x in lost), f"{self.name}: not held in all of the box")
        total = [ZERO] * count
        for j in range(n):
            up, down = steps[j], steps[n + j]
            both = zip(total, exact[j], exact[n + j], strict=True)
            total = [m + (down * a + up * b) / ((up + down) * n) for m, a, b in both]
        return total

    def exact(self, slopes: list[list[arb]], steps: list[arb], weights: arb_mat) -> Any:
        """Return the weights with which the gradients add up exactly."""
        *rows, pull = slopes
        n, g = len(pull), arb_mat(rows)
        wanted = [list(pull) for _ in steps]
        for k, t in enumerate(steps):
            wanted[k][k % n] += t if k < n else -t
        try:
            change = (arb_mat(wanted) - weights * g) * (g.mid().transpose() * g).inv()
        except ZeroDivisionError:
            need(False, f"{self.name}: the gradients may be dependent")
        return (weights + change * g.mid().transpose()).tolist()


class StoredVertex(StoredRegion):
    """A box in which functions have one common zero: by Krawczyk's operator, or by second order."""

    def __init__(self, p: StoredProblem, record: dict[str, Any]) -> None:
        self.p, self.places, self.active = p, p.free, frozenset(record["active"])
        self.name = f"region {record}"
        need(self.active <= set(range(p.m)), self.name)
        self.rows = [*sorted(self.active), *range(p.m, p.m + p.k)]
        self.limit()
        ends = sides(record, ("lower", "upper"), p.n)
        self.lower, self.upper = ([side[i] for i in p.free] for side in ends)
        self.critical: frozenset[int] = frozenset()
        if "exact" in record:
            self.unknowns = self.tip(record)
        else:
            need(len(self.rows) == len(p.free), f"{self.name}: the number of functions")
            self.unknowns = zero(self.vanishing, hull(self.lower, self.upper)) or []
            need(self.unknowns or not p.free, f"{self.name}: no single common zero is shown")
        sharp = sides(record, ("sharp_lower", "sharp_upper"), len(p.free))
        signs = self.located(sharp, self.active)
        around = zip(self.lower, self.upper, self.unknowns, strict=True)
        need(all(a <= x <= b for a, b, x in around), self.name)
        sets = p.open_sets(signs, self.zeros)
        self.matter = frozenset().union(*sets)
        self.listable = bool(sets) and self.active <= self.matter <= self.zeros
        self.absent = not (self.active <= self.matter or self.critical & self.matter)
        self.absent |= not sets

    def tip(self, record: dict[str, Any]) -> list[arb]:
        """Check that an exact point is the only common zero, by second order."""
        p = self.p
        point = [number(record["exact"][i]) for i in p.free]
        fixed = (number(x).contains(p.anywhere[i]) for i, x in enumerate(record["exact"]))
        need(all(i in p.free or same for i, same in enumerate(fixed)), self.name)
        box = hull(self.lower, self.upper)
        here, there = self.rows_at(point), self.rows_at(box)
        need(here and there, f"{self.name}: the functions are not smooth")
        (values, slopes, _), bends = here, there[2]
        shares = [number(text) for text in record["combination"]]
        weight, n = arb(float.fromhex(record["weight"])), range(len(point))
        zeros = [*values, *(dot(shares, column) for column in zip(*slopes, strict=True))]
        need(all(map(nothing, zeros)), f"{self.name}: no common zero with dependent gradients")
        away = [x - c for x, c in zip(box, point, strict=True)]
        factors = [x / 2 + weight * dot(g, away) / 2 for x, g in zip(shares, slopes, strict=True)]
        columns = list(zip(*slopes, strict=True))
        form = [
            [
                dot(factors, [h[i][j] for h in bends]) + weight * dot(columns[i], columns[j])
                for j in n
            ]
            for i in n
        ]
        twice = [[form[i][j] + form[j][i] for j in n] for i in n]
        need(definite(twice), f"{self.name}: the common zero is not isolated")
        self.critical = frozenset(record["critical"])
        need(self.critical <= self.active and (not p.k or not self.critical), self.name)
        for i in self.critical:
            place = self.rows.index(i)
            zeros += slopes[place]
            try:
                arb_mat(bends[place]).inv()
            except ZeroDivisionError:
                need(False, f"{self.name}: a second derivative may be singular")
        need(all(map(nothing, zeros)), f"{self.name}: a gradient does not vanish")
        self.tested += sum(not shown(x) for x in zeros)
        return point

    def same(self, other: StoredRegion) -> bool | None:
        """Whether the zero is that of another region; None where that is not decided."""
        if other.active - self.zeros - self.unknown:
            return False
        inside = self.lies_in(other)
        return inside if inside is False or (inside and other.active <= self.zeros) else None
