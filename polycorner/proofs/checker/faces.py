"""Regions with one KKT point, and loci, by Krawczyk's operator."""

from typing import Any

from flint import arb, arb_mat

from .balls import (
    BESIDE,
    ZERO,
    definite,
    dot,
    hull,
    moved,
    need,
    negatives,
    nothing,
    shown,
    sides,
    turn,
    zero,
)
from .problem import StoredProblem

MOST_UNKNOWNS = 600  # of a point, with its multipliers
MOST_ENTRIES = 10**7  # of the second derivatives by the coordinates of a point
HALVINGS = 6  # of a region, in whose parts multipliers are enclosed


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
        middle = arb_mat(rows).mid()
        try:
            left = (middle * middle.transpose()).inv().mid() * middle
            form = left * arb_mat(rows).transpose()
            found = form.solve(left * arb_mat([[x] for x in energy])).entries()
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
