"""Regions with one common zero of some functions: corners."""

from typing import Any

from flint import arb, arb_mat

from .balls import (
    definite,
    dot,
    hull,
    need,
    nothing,
    number,
    shown,
    sides,
    zero,
)
from .faces import StoredRegion
from .problem import StoredProblem


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
