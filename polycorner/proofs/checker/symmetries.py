"""Symmetries of a problem, tested at random points."""

import random
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from flint import arb

from .balls import different, dot, hull, need, number, turn
from .problem import StoredProblem

POINTS = 20


class StoredSymmetry:
    """A map ``q -> signs * q[order] + shifts * periods``."""

    def __init__(
        self, p: StoredProblem, record: dict[str, Any], weights: list[str], name: str = ""
    ) -> None:
        self.p, self.name = p, name or f"symmetry {record}"
        self.order, self.signs = record["order"], record["signs"]
        need(sorted(self.order) == [*range(p.n)] and set(self.signs) <= {1, -1}, self.name)
        pairs = [(p.periods[i], period) for i, period in zip(self.order, p.periods, strict=True)]
        need(all(a is b or (a and b and a.overlaps(b)) for a, b in pairs), self.name)
        shifts = list(zip(record["shifts"], p.periods, strict=True))
        self.shifts = [number(shift) * (period or 0) for shift, period in shifts]
        parts = [Fraction(shift) % 1 if period else 0 for shift, period in shifts]
        self.key = (self.order, self.signs, parts)
        self.weights = [arb(float.fromhex(w)) for w in weights]
        self.growth = [-w for w in self.weights]
        for w, s, i in zip(self.weights, self.signs, self.order, strict=True):
            self.growth[i] += s * w
        self.test()

    def image(self, q: Sequence[arb]) -> list[arb]:
        return [s * q[i] + x for s, i, x in zip(self.signs, self.order, self.shifts, strict=True)]

    def carries(self, lower: list[float], upper: list[float]) -> bool:
        """Whether a box is carried into the domain and ``w . q`` increases everywhere on it."""
        p, box = self.p, hull(lower, upper)
        ends = list(zip(p.lower, p.upper, strict=True))
        image = zip(self.image(box), ends, p.periods, strict=True)
        turns = [turn(x, *end, period) for x, end, period in image]
        for side in (lower, upper):
            corner = zip(self.image([arb(x) for x in side]), turns, ends, strict=True)
            if not all(a <= x + t <= b for x, t, (a, b) in corner):
                return False
        added = [a + b for a, b in zip(self.shifts, turns, strict=True)]
        return dot(self.growth, box) + dot(self.weights, added) > 0

    @property
    def is_identity(self) -> bool:
        order, signs, parts = self.key
        return order == [*range(self.p.n)] and set(signs) <= {1} and not any(parts)

    def test(self) -> None:
        """Check at random points that functions go to functions and the set to itself."""
        p, draw, pairs = self.p, random.Random(1), []
        for _ in range(50 * POINTS):
            q = [arb(draw.uniform(a, b)) for a, b in zip(p.lower, p.upper, strict=True)]
            found = [[v[row] for row in p.outputs] for v in map(p.values, (q, self.image(q)))]
            if all(x.is_finite() for row in found for x in row):
                pairs.append(found)
            if len(pairs) == POINTS:
                break
        need(len(pairs) == POINTS, f"{self.name}: the functions are defined almost nowhere")

        def first(side: int, i: int, rows: Sequence[int], sign: int = 1) -> int:
            same = (all(x[side][i].overlaps(sign * x[0][j]) for x in pairs) for j in rows)
            return next((j for j, fits in zip(rows, same, strict=True) if fits), -1)

        m, h, energy = range(p.m), range(p.m, p.m + p.k), p.m + p.k
        kept = first(1, energy, [energy]) >= 0
        kept &= all(max(first(1, i, h), first(1, i, h, -1)) >= 0 for i in h)
        sets = [{frozenset(first(side, i, m) for i in b) for b in p.branches} for side in (0, 1)]
        need(kept and sets[0] == sets[1], f"{self.name}: changes the problem")


def periodic(p: StoredProblem, weights: list[str]) -> Iterator[StoredSymmetry]:
    """Yield the turns by whole periods, which have to preserve the problem."""
    for i, name in enumerate(p.names):
        if p.periods[i] is not None:
            shifts = ["1" if k == i else "0" for k in range(p.n)]
            turns = {"order": [*range(p.n)], "signs": [1] * p.n, "shifts": shifts}
            yield StoredSymmetry(p, turns, weights, f"period of {name}")


def symmetries(p: StoredProblem, data: dict[str, Any]) -> list[StoredSymmetry]:
    """Return the symmetries of a file, each once; see that coordinates have their periods."""
    list(periodic(p, data["weights"]))
    found = [StoredSymmetry(p, record, data["weights"]) for record in data["symmetries"]]
    different([g.key for g in found], "a symmetry is stated")
    need(not any(g.is_identity for g in found), "the identity is listed as a symmetry")
    return found
