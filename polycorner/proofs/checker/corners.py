"""Proof of a list of corners: why each box has no others."""

import random
from typing import Any

from flint import arb, arb_mat

from .algebra import Algebra, TooMuchError, total
from .balls import ZERO, column, different, dot, hull, need, nothing, number
from .faces import StoredVertex
from .problem import StoredProblem
from .proof import StoredProof
from .symmetries import POINTS, symmetries

SHIFT = 2.0**-30


class StoredCorners(StoredProof):
    """The problem of a file, with regions and symmetries."""

    kind = "corners"

    def energies(self) -> list[arb]:
        return []

    def __init__(self, data: dict[str, Any]) -> None:
        self.p = p = StoredProblem(data)
        different(data["regions"], "a region is stated")
        self.regions = [StoredVertex(p, r) for r in data["regions"]]
        self.tested = sum(vertex.tested for vertex in self.regions)
        relations = [StoredRelation(p, r) for r in data["relations"]]
        self.related = [relation.rows for relation in relations]
        self.unproved = len({r.rows for r in relations if not r.proved})
        self.symmetries, self.periodic = symmetries(p, data)

    def shown(self, lo: list[float], hi: list[float], _: list[list[arb]]) -> bool:
        """Whether a box is closed rightly."""
        if any(g.carries(lo, hi) for g in self.symmetries):
            return True
        box = StoredBox(self.p, lo, hi)
        signs = self.p.signs(box.v)
        if self.known(box, signs):
            return True
        closer = [s or self.p.sign(box.v, row, box.memo, lo, hi) for row, s in enumerate(signs)]
        return closer != signs and self.known(box, closer)

    def known(self, box: "StoredBox", signs: list[int]) -> bool:
        """Whether all corners in a box are known, from the sets of functions that may vanish.

        Each set vanishes nowhere, or at a known point only, or has independent gradients and too
        few of them to isolate a point; or a smaller set is of the first two kinds; or a function is
        a combination of others.
        """
        p = self.p
        some = sorted(frozenset().union(*p.open_sets(signs)))
        if not p.open_sets(signs):
            return True
        around = [v for v in self.regions if v.holds(box.lo, box.hi)]
        zeros = {tuple(sorted(v.active)) for v in around}
        criticals = {(i,) for v in around for i in v.critical}
        top, level = len(p.free) - p.k, {tuple[int, ...]()}
        for size in range(top + 1):
            alive = set[tuple[int, ...]]()
            for rows in level:
                if any(some.issubset(rows) for some in self.related):
                    continue
                every = [*rows, *range(p.m, p.m + p.k)]
                if every and (rows in zeros or box.incompatible(every)):
                    continue
                if size == top or (every and not (rows in criticals or box.independent(every))):
                    return False
                alive.add(rows)
            larger = {(*rows, j) for rows in alive for j in some if not rows or j > rows[-1]}
            level = {
                s for s in larger if all((*s[:i], *s[i + 1 :]) in alive for i in range(size + 1))
            }
        return bool(top >= 0)

    def compare(self, vertex: Any, point: dict[str, Any]) -> None:
        active = sorted(vertex.matter)
        need(active == point["active"], f"{vertex.name}: {active} are active")


class StoredRelation:
    """A linear relation between inequalities and equations, at random points or by algebra."""

    def __init__(self, p: StoredProblem, record: dict[str, Any]) -> None:
        name, weights = f"relation {record}", [number(text) for text in record["weights"]]
        different(record["rows"], f"{name}: a function is stated")  # it would cancel itself
        self.rows = frozenset(record["rows"])
        fine = (
            self.rows
            and self.rows <= set(range(p.m))
            and all(w != 0 for w in weights[: len(record["rows"])])
        )
        need(fine and len(weights) == len(record["rows"]) + p.k, name)
        every, draw = [*record["rows"], *range(p.m, p.m + p.k)], random.Random(1)
        self.proved = self.vanishes(Algebra(p), record["weights"], every)
        for _ in range(POINTS):
            q = [arb(draw.uniform(a, b)) for a, b in zip(p.lower, p.upper, strict=True)]
            values = [p.values(q)[p.outputs[row]] for row in every]
            need(nothing(dot(weights, values)), f"{name}: is none")

    def vanishes(self, algebra: Algebra, weights: list[str], every: list[int]) -> bool:
        """Whether algebra shows that the combination is 0."""
        whole = dict[Any, Any]()
        for text, row in zip(weights, every, strict=True):
            value = algebra.value(algebra.p.outputs[row])
            if value is None:
                return False
            try:
                whole = total(whole, algebra.product(algebra.leaf("const", text), value))
            except TooMuchError:
                return False
        return not whole


class StoredBox:
    """Enclosures of functions on a box."""

    def __init__(self, p: StoredProblem, lo: list[float], hi: list[float]) -> None:
        self.p, self.lo, self.hi = p, lo, hi
        self.hull, self.memo = hull(lo, hi), dict[int, Any]()
        self.v = p.values(self.hull)
        self.middle = [arb(0.5 * (a + b)) for a, b in zip(lo, hi, strict=True)]
        self.at = p.values(self.middle)

    def gradients(self, rows: list[int]) -> list[list[arb]] | None:
        found = [self.p.forms(self.v, row, self.memo) for row in rows]
        if None in found:
            return None
        slopes = [[g.get(i, ZERO) for i in self.p.free] for g, _ in found]
        return slopes if all(x.is_finite() for g in slopes for x in g) else None

    def independent(self, rows: list[int]) -> bool:
        """Whether the gradients of functions are independent on the whole box."""
        slopes = self.gradients(rows)
        if slopes is None or len(rows) > len(self.p.free):
            return False
        try:
            (arb_mat(slopes) * arb_mat(slopes).mid().transpose()).inv()
        except ZeroDivisionError:
            return False
        return True

    def incompatible(self, rows: list[int]) -> bool:
        """Whether functions do not vanish together, by the mean value form of combinations."""
        slopes = self.gradients(rows)
        if slopes is None:
            return False
        away = [self.hull[i] - self.middle[i] for i in self.p.free]
        values = arb_mat([[self.at[self.p.outputs[row]]] for row in rows])
        moved = [[x * a.abs_upper() for x, a in zip(g, away, strict=True)] for g in slopes]
        middle = arb_mat(moved).mid()
        square = (middle * middle.transpose()).tolist()
        shift = sum((square[i][i] for i in range(len(rows))), ZERO) * SHIFT
        for i in range(len(rows)):
            square[i][i] += shift
        try:
            inverse = arb_mat(square).mid().inv().mid()
        except ZeroDivisionError:
            return False
        for weights in (inverse, (middle.transpose() * inverse).mid()):
            sums = weights * values + weights * arb_mat(slopes) * column(away)
            if any(x > 0 or x < 0 for x in sums.entries()):
                return True
        return False
