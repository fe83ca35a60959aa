"""Symmetries of a problem, shown by exact algebra or tested at random points."""

import random
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from flint import arb, fmpq

from .algebra import Algebra, Polynomial, total
from .algebra import number as exactly
from .balls import different, dot, hull, need, number, turn
from .problem import StoredProblem
from .rationals import ratio

POINTS = 20
EVEN, ODD = ("cos", "cosh", "abs"), ("sin", "tan", "sinh", "tanh", "asin", "atan", "erf", "inverse")
QUARTERS = {"sin": ("sin", "cos"), "cos": ("cos", "sin")}  # after a quarter of a turn


class TurnedAlgebra(Algebra):
    """Algebra that knows even and odd functions, quarters of turns, and images of coordinates."""

    moving: Any = None

    def at(self, g: Any) -> "TurnedAlgebra":
        """Return the algebra at the image of a point, with the same symbols."""
        found = TurnedAlgebra(self.p)
        found.keys, found.places, found.work, found.moving = self.keys, self.places, self.work, g
        return found

    def leaf(self, op: str, given: Any) -> Polynomial:
        g = self.moving
        if op != "var" or g is None:
            return super().leaf(op, given)
        image = total({}, self.symbol("var", g.order[given]), g.signs[given])
        period = g.periods[given]
        if period is None:
            return image
        share = exactly(ratio(g.turns[given]))
        return total(image, self.product(share, super().leaf("const", period)))

    def symbol(self, op: str, *given: Any) -> Polynomial:
        factor = 1
        if op in {"min", "max"}:
            given = tuple(sorted(given, key=lambda u: sorted(u.items())))
        if op in QUARTERS:
            pi = next(iter(super().symbol("pi")))
            quarters = int((2 * given[0].get(pi, fmpq(0)) + fmpq(1, 2)).floor())
            given = (total(given[0], {pi: fmpq(1, 2)}, -quarters),)
            factor = -1 if quarters % 4 in ({1, 2} if op == "cos" else {2, 3}) else 1
            op = QUARTERS[op][quarters % 2]
        if op in {*EVEN, *ODD} and given[0] and given[0][min(given[0])] < 0:
            given, factor = (total({}, given[0], -1),), -factor if op in ODD else factor
        return total({}, super().symbol(op, *given), factor)


class StoredSymmetry:
    """A map ``q -> signs * q[order] + shifts * periods``."""

    def __init__(
        self,
        p: StoredProblem,
        record: dict[str, Any],
        data: dict[str, Any],
        algebra: TurnedAlgebra,
        name: str = "",
    ) -> None:
        weights, self.periods, self.turns = data["weights"], data["periods"], record["shifts"]
        self.p, self.name = p, name or f"symmetry {record}"
        self.order, self.signs = record["order"], record["signs"]
        need(sorted(self.order) == [*range(p.n)] and set(self.signs) <= {1, -1}, self.name)
        pairs = [(p.periods[i], period) for i, period in zip(self.order, p.periods, strict=True)]
        need(all(a is b or (a and b and a.overlaps(b)) for a, b in pairs), self.name)
        shifts = list(zip(record["shifts"], p.periods, strict=True))
        for i in p.parameters:  # what is listed are points for one value of them
            kept = (self.order[i], self.signs[i], shifts[i][0]) == (i, 1, "0")
            need(name or kept, f"{self.name}: moves a parameter")
        self.shifts = [number(shift) * (period or 0) for shift, period in shifts]
        parts = [Fraction(shift) % 1 if period else 0 for shift, period in shifts]
        self.key = (self.order, self.signs, parts)
        self.weights = [arb(float.fromhex(w)) for w in weights]
        self.growth = [-w for w in self.weights]
        for w, s, i in zip(self.weights, self.signs, self.order, strict=True):
            self.growth[i] += s * w
        self.proved = self.keeps(algebra)
        if not self.proved:
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

        def alike(side: int, i: int, j: int, sign: int) -> bool:
            return all(x[side][i].overlaps(sign * x[0][j]) for x in pairs)

        need(self.is_kept(alike), f"{self.name}: changes the problem")

    def is_kept(self, alike: Callable[[int, int, int, int], bool]) -> bool:
        """Whether functions go to functions and the set to itself.

        ``alike(side, i, j, sign)`` compares a function, of side 1 its image, with ``sign f_j``.
        """

        def first(side: int, i: int, rows: Sequence[int], sign: int = 1) -> int:
            return next((j for j in rows if alike(side, i, j, sign)), -1)

        p = self.p
        m, h, energy = range(p.m), range(p.m, p.m + p.k), p.m + p.k
        kept = first(1, energy, [energy]) >= 0
        kept &= all(max(first(1, i, h), first(1, i, h, -1)) >= 0 for i in h)
        sets = [{frozenset(first(side, i, m) for i in b) for b in p.branches} for side in (0, 1)]
        return kept and sets[0] == sets[1] and not any(-1 in b for b in sets[1])

    def keeps(self, algebra: "TurnedAlgebra") -> bool:
        """Whether algebra shows that the problem is the same."""
        moved = algebra.at(self)
        found = [[a.value(output) for output in self.p.outputs] for a in (algebra, moved)]
        algebra.work = moved.work
        known = all(isinstance(u, dict) for row in found for u in row)
        return known and self.is_kept(
            lambda side, i, j, sign: found[side][i] == total({}, found[0][j], sign)
        )


def symmetries(p: StoredProblem, data: dict[str, Any]) -> tuple[list[StoredSymmetry], list[str]]:
    """Return the symmetries of a file, each once, and coordinates whose periods are only tested.

    Turns by whole periods have to preserve the problem as well.
    """
    algebra, tested = TurnedAlgebra(p), list[str]()
    for i, name in enumerate(p.names):
        if p.periods[i] is not None:
            shifts = ["1" if k == i else "0" for k in range(p.n)]
            turn = {"order": [*range(p.n)], "signs": [1] * p.n, "shifts": shifts}
            if not StoredSymmetry(p, turn, data, algebra, f"period of {name}").proved:
                tested.append(name)
    found = [StoredSymmetry(p, record, data, algebra) for record in data["symmetries"]]
    different([g.key for g in found], "a symmetry is stated")
    need(not any(g.is_identity for g in found), "the identity is listed as a symmetry")
    return found, tested
