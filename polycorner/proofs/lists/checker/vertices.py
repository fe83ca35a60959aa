"""Regions with one common zero of some functions: corners."""

from typing import Any

from flint import arb, arb_mat

from .balls import (
    BESIDE,
    ZERO,
    definite,
    dot,
    hull,
    need,
    nothing,
    number,
    shown,
    sides,
    turn,
    zero,
)
from .problem import Problem


class Vertex:
    """A box in which functions have one common zero: by Krawczyk's operator, or by second order.

    At the zero other functions count as zero where they vanish up to ``2**-80``.
    """

    def __init__(self, p: Problem, record: dict[str, Any]) -> None:
        self.p, self.name, self.active = p, f"region {record}", frozenset(record["active"])
        need(self.active <= set(range(p.m)), self.name)
        self.rows = [*sorted(self.active), *range(p.m, p.m + p.k)]
        self.lower, self.upper = sides(record, ("lower", "upper"), p.n)
        self.critical: frozenset[int] = frozenset()
        self.tested = 0  # properties at the zero that are not shown, but tested
        if "exact" in record:
            unknowns = self.tip(record)
        else:
            need(len(self.rows) == len(p.free), f"{self.name}: the number of functions")
            box = [x for i, x in enumerate(hull(self.lower, self.upper)) if i in p.free]
            unknowns = zero(self.equations, box) or []
            need(unknowns or not p.free, f"{self.name}: no single common zero is shown")
        slack = [arb(0, 2.0**-70) * (1 + abs(x)) for x in unknowns]
        sharp = sides(record, ("sharp_lower", "sharp_upper"), len(p.free))
        near = [x + y for x, y in zip(hull(*sharp), slack, strict=True)]
        inside = all(x.contains(y) for x, y in zip(near, unknowns, strict=True))
        need(inside, f"{self.name}: the common zero is elsewhere")
        self.point = self.at(unknowns)
        ends = zip(self.lower, self.upper, self.point, strict=True)
        need(all(a <= x <= b for i, (a, b, x) in enumerate(ends) if i in p.free), self.name)
        self.outside = p.is_outside(self.point, p.free)
        self.far = p.is_outside(self.point, p.free, BESIDE)
        v = p.values(self.point)
        signs = p.signs(v)
        self.zeros = self.active | {i for i in range(p.m) if nothing(v[p.outputs[i]])}
        self.tested += sum(not shown(v[p.outputs[i]]) for i in self.zeros - self.active)
        self.unknown = {i for i in range(p.m) if signs[i] == 0} - self.zeros
        sets = p.open_sets(signs, self.zeros)
        self.matter = frozenset().union(*sets)
        self.listable = bool(sets) and self.active <= self.matter <= self.zeros
        self.absent = not (self.active <= self.matter or self.critical & self.matter)
        self.absent |= not sets

    def at(self, unknowns: list[arb]) -> list[arb]:
        known = dict(zip(self.p.free, unknowns, strict=True))
        return [known.get(i, x) for i, x in enumerate(self.p.anywhere)]

    def rows_at(self, unknowns: list[arb], order: int) -> Any:
        """Return values of the functions, and gradients and Hessians in the free coordinates."""
        v, memo, places = self.p.values(self.at(unknowns)), dict[int, Any](), self.p.free
        found = [self.p.forms(v, row, memo, 2) for row in self.rows]
        if None in found:
            return None
        slopes = [[g.get(i, ZERO) for i in places] for g, _ in found]
        pairs = [[(i, j) for j in places] for i in places]
        bends = [[[h.get(ij, ZERO) for ij in row] for row in pairs] for _, h in found]
        return ([v[self.p.outputs[row]] for row in self.rows], slopes, bends)[: order + 1]

    def equations(self, unknowns: list[arb]) -> Any:
        found = self.rows_at(unknowns, 1)
        return found or ([], [])

    def tip(self, record: dict[str, Any]) -> list[arb]:
        """Check that an exact point is the only common zero, by second order."""
        p = self.p
        point = [number(record["exact"][i]) for i in p.free]
        fixed = (number(x).contains(p.anywhere[i]) for i, x in enumerate(record["exact"]))
        need(all(i in p.free or same for i, same in enumerate(fixed)), self.name)
        box = [x for i, x in enumerate(hull(self.lower, self.upper)) if i in p.free]
        here, there = self.rows_at(point, 1), self.rows_at(box, 2)
        need(here and there, f"{self.name}: the functions are not smooth")
        (values, slopes), bends = here, there[2]
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

    def holds(self, lower: list[float], upper: list[float]) -> bool:
        ends = zip(self.lower, self.upper, strict=True)
        return all(
            a <= lower[i] and upper[i] <= b for i, (a, b) in enumerate(ends) if i in self.p.free
        )

    def same(self, other: "Vertex") -> bool | None:
        """Whether the zero is that of another region; None where that is not decided."""
        if other.active - self.zeros - self.unknown:
            return False
        ends = zip(self.point, other.lower, other.upper, self.p.periods, strict=True)
        known = [(x + turn(x, a, b, period), a, b) for x, a, b, period in ends]
        free = [known[i] for i in self.p.free]
        if any(x < a or x > b for x, a, b in free):
            return False
        inside = all(a <= x <= b for x, a, b in free)
        return True if inside and other.active <= self.zeros else None
