"""Check a saved list of stationary points and its proof; needs python-flint and nothing else.

``python checker.py FILE [--sample K] [--jobs J]`` differentiates the program in the file itself,
walks the subdivision and shows of every closed box, in ball arithmetic of 128 bits, that

- no point of the set lies in it; or
- in each branch of the set, some stored direction, made tangent to the equations, increases all
  functions that may vanish and decreases the energy, for all elements of their generalised
  gradients ([Clarke] sec. 2.3); or the functions that may vanish are active in a region around the
  box; or the box is at a locus, and a direction along the other coordinates leads into the set; or
- a symmetry carries it into the domain and increases ``w . q``.

Boxes for which this is not shown at once are bisected.  Krawczyk's operator ([Neumaier] sec. 5.1)
shows that a region has one KKT point with positive multipliers, and a locus one zero of the
derivative of the energy in the coordinates that it depends on.  The list must consist of all
regions whose point is stationary and not outside the domain, with their indices.

What is shown is about the problem that the file states.  That its symmetries preserve this problem
is tested at random points and not proved.
"""

import argparse
import json
import math
import random
import sys
import time
import zipfile
from array import array
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import islice, product
from typing import Any

from flint import acb_mat, arb, arb_mat, ctx, fmpq

FORMAT = ["polycorner-stationary-list", 1]
BITS, PIECES, CHUNK, POINTS, STEPS = 128, 4000, 500, 20, 10
ZERO, NAN = arb(0), arb("nan")


class RefusedError(Exception):
    """Something in the file could not be shown."""


def need(condition: object, message: str) -> None:
    if not condition:
        raise RefusedError(message)


# ------------------------------------------------------------ operations and their derivatives


def ordered(x: arb, y: arb) -> bool | None:
    """Compare strictly: what is decided on a closed box is decided around each of its points."""
    return True if x < y else False if x > y else None


def opposite(x: bool | None) -> bool | None:
    return None if x is None else not x


def both(x: bool | None, y: bool | None) -> bool | None:
    return False if x is False or y is False else None if None in {x, y} else True


def chosen(first: bool | None, x: arb, y: arb) -> arb:
    return x.union(y) if first is None else x if first else y


def square(x: arb) -> arb:
    return (x.abs_lower() ** 2).union(x.abs_upper() ** 2)


def off_cut(y: arb, x: arb, value: arb, otherwise: arb) -> arb:
    return value if x > 0 or y != 0 else otherwise


def power(x: arb, y: arb) -> arb:
    return x**y if x > 0 or (y.is_exact() and y.is_integer()) else NAN


def bell(x: arb) -> arb:
    return 2 * (-square(x)).exp() / arb.pi().sqrt()


def angle(y: arb, x: arb, r: arb) -> tuple[arb, ...]:
    bend, twist = 2 * x * y / r**2, (square(y) - square(x)) / r**2
    return x / r, -y / r, -bend, twist, bend


ALIKE = ("neg", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "erf")  # fmt: skip  # noqa: E501
# fmt: off
VALUES: dict[str, Callable[..., Any]] = {
    **{name: getattr(arb, name) for name in ALIKE}, "square": square, "abs": abs,
    "add": arb.__add__, "sub": arb.__sub__, "mul": arb.__mul__, "div": arb.__truediv__,
    "pow": arb.__pow__, "atan2": lambda y, x: off_cut(y, x, arb.atan2(y, x), arb(0, 3.2)),
    "min": arb.min, "max": arb.max, "lt": ordered, "le": ordered, "not": opposite, "and": both,
    "or": lambda x, y: opposite(both(opposite(x), opposite(y))), "select": chosen,
}
SLOPES: dict[str, Callable[..., Any]] = {  # f', f'' or f_x, f_y, f_xx, f_xy, f_yy of the arguments
    "neg": lambda _: (-1, 0), "square": lambda x: (2 * x, 2), "log": lambda x: (1 / x, -1 / x**2),
    "abs": lambda x: (-1, 0) if x < 0 else (1, 0) if x > 0 else (arb(0, 1), NAN),
    "sqrt": lambda x: (0.5 / x.sqrt(), -0.25 / x.sqrt() ** 3), "exp": lambda x: (x.exp(), x.exp()),
    "sin": lambda x: (x.cos(), -x.sin()), "cos": lambda x: (-x.sin(), -x.cos()),
    "tan": lambda x: (1 + square(x.tan()), 2 * x.tan() * (1 + square(x.tan()))),
    "asin": lambda x: (1 / (1 - square(x)).sqrt(), x / (1 - square(x)).sqrt() ** 3),
    "acos": lambda x: (-1 / (1 - square(x)).sqrt(), -x / (1 - square(x)).sqrt() ** 3),
    "atan": lambda x: (1 / (1 + square(x)), -2 * x / (1 + square(x)) ** 2),
    "sinh": lambda x: (x.cosh(), x.sinh()), "cosh": lambda x: (x.sinh(), x.cosh()),
    "tanh": lambda x: (1 - square(x.tanh()), -2 * x.tanh() * (1 - square(x.tanh()))),
    "erf": lambda x: (bell(x), -2 * x * bell(x)),
    "add": lambda *_: (1, 1, 0, 0, 0), "sub": lambda *_: (1, -1, 0, 0, 0),
    "mul": lambda x, y: (y, x, 0, 1, 0),
    "div": lambda x, y: (1 / y, -x / y**2, 0, -1 / y**2, 2 * x / y**3),
    "pow": lambda x, y: (
        y * power(x, y - 1), x**y * x.log(), y * (y - 1) * power(x, y - 2),
        x ** (y - 1) * (1 + y * x.log()), x**y * x.log() ** 2),
    "atan2": lambda y, x: angle(y, x, off_cut(y, x, square(x) + square(y), NAN)),
}
# fmt: on


def unite(x: dict[int, arb], y: dict[int, arb]) -> dict[int, arb]:
    return {i: x.get(i, ZERO).union(y.get(i, ZERO)) for i in x | y}


def chain(slopes: tuple[Any, ...], parts: list[Any], order: int) -> tuple[Any, Any]:
    """Return gradient and Hessian of an operation from those of its arguments, as dictionaries."""
    g, h = dict[int, Any](), dict[tuple[int, int], Any]()
    for p, (gradient, hessian) in zip(slopes, parts, strict=False):
        for i, x in gradient.items():
            g[i] = g.get(i, ZERO) + p * x
        for ij, x in hessian.items():
            h[ij] = h.get(ij, ZERO) + p * x
    places = [(0, 0)] if len(parts) == 1 else [(0, 0), (0, 1), (1, 1)]
    for p, (a, b) in zip(slopes[len(parts) :], places, strict=True) if order > 1 else ():
        for (i, x), (j, y) in product(parts[a][0].items(), parts[b][0].items()):
            for ij in {(a, b): (i, j), (b, a): (j, i)}.values():
                h[ij] = h.get(ij, ZERO) + p * (square(x) if x is y else x * y)
    return g, h


# ------------------------------------------------------------------------- numbers, boxes, matrices


def number(text: str) -> arb:
    """Return a ball for ``"3/2"``, ``"pi"``, ``"e"`` or ``"2 pi"``."""
    *factors, last = text.split()
    units = {"pi": arb.pi(), "e": arb.const_e()}
    ratios = factors if last in units else [last]
    ratio = arb(fmpq(*map(int, ratios[0].split("/")))) if ratios else arb(1)
    return ratio * units.get(last, arb(1))


def sides(record: dict[str, Any], names: Sequence[str], count: int) -> list[list[float]]:
    """Return sides of a box in a record, as doubles."""
    found = [[float.fromhex(text) for text in record[name]] for name in names]
    fine = all(len(side) == count and all(map(math.isfinite, side)) for side in found)
    need(fine and all(a <= b for a, b in zip(*found, strict=True)), f"{record}: sides of a box")
    return found


def hull(lower: Sequence[float], upper: Sequence[float]) -> list[arb]:
    return [arb(a).union(arb(b)) for a, b in zip(lower, upper, strict=True)]


def moved(side: Sequence[float], axis: int, position: float) -> list[float]:
    return [*side[:axis], position, *side[axis + 1 :]]


def dot(x: Sequence[Any], y: Sequence[Any]) -> arb:
    return sum((a * b for a, b in zip(x, y, strict=True)), ZERO)


def turn(x: arb, lower: float, upper: float, period: arb | None) -> arb:
    """Return the multiple of a period that brings ``x`` nearest to the middle of an interval."""
    away = (arb(lower) + arb(upper)) / 2 - x
    return round(float((away / period).mid())) * period if period else ZERO


def definite(rows: list[list[arb]]) -> bool:
    """Whether all symmetric matrices in an enclosure are positive definite, by elimination."""
    if not rows:
        return True
    (pivot, *row), *rest = rows
    left = [[x - r[0] * y / pivot for x, y in zip(r[1:], row, strict=True)] for r in rest]
    return pivot > 0 and definite(left)


def zero(equations: Callable[..., Any], unknowns: list[arb]) -> list[arb] | None:
    """Return a small enclosure of the only zero in a box by Krawczyk's operator, or None."""
    shown = False
    for _ in range(STEPS):
        centre = [x.mid() for x in unknowns]
        here, there = equations(centre), equations(unknowns)
        try:
            inverse = arb_mat(here[1]).mid().inv().mid()
        except (TypeError, ZeroDivisionError):
            return None
        apart = arb_mat([[x - c] for x, c in zip(unknowns, centre, strict=True)])
        defect = arb_mat(len(centre), len(centre), 1) - inverse * arb_mat(there[1])
        steps = defect * apart - inverse * arb_mat([[r] for r in here[0]])
        image = [c + x for c, x in zip(centre, steps.entries(), strict=True)]
        pairs = list(zip(unknowns, image, strict=True))
        if not shown and not all(x.contains_interior(y) for x, y in pairs):
            return None
        shown, unknowns = True, [y if y.rad() < x.rad() else x for x, y in pairs]
    return unknowns


# ------------------------------------------------------------------------------------- the problem


class Problem:
    """The problem of a file, with regions, loci and symmetries."""

    def __init__(self, data: dict[str, Any]) -> None:
        ctx.prec = BITS
        need(data["format"] == FORMAT, f"the format is {data['format']}, not {FORMAT}")
        self.n, self.m, self.k = (len(data["coordinates"]), data["inequalities"], data["equations"])
        need(self.m >= 0 and self.k >= 0, "numbers of functions")
        self.nodes: list[tuple[str, list[Any]]] = []
        self.known: dict[int, arb] = {}
        self.positive: set[int] = set()
        for op, *args in data["nodes"]:
            self.add(op, args)
        self.outputs: list[int] = data["outputs"]
        need(len(self.outputs) == self.m + self.k + 1, "there is one output for each function")
        self.needs = [self.needed(output) for output in self.outputs]
        self.branches = {frozenset(branch) for branch in data["branches"]}
        need(all(0 <= i < self.m for branch in self.branches for i in branch), "branches")
        self.lower, self.upper = sides(data["domain"], ("lower", "upper"), self.n)
        self.anywhere = hull(self.lower, self.upper)
        self.widths = [b - a for a, b in zip(self.lower, self.upper, strict=True)]
        self.free = [i for i in range(self.n) if self.widths[i] > 0]
        need(data["fixed"] == [i for i in range(self.n) if i not in self.free], "fixed coordinates")
        self.periods = [number(p) if p else None for p in data["periods"]]
        self.regions = [Face(self, r, self.free, r["active"]) for r in data["regions"]]
        self.loci = [Face(self, r, r["z"], None) for r in data["loci"]]
        self.symmetries = [Symmetry(self, g, data["weights"]) for g in data["symmetries"]]

    def add(self, op: str, args: list[Any]) -> None:
        place = len(self.nodes)
        if op == "const":
            self.known[place] = number(args[0])
        else:
            need(op in {"var", *VALUES}, f"the operation {op}")
            bound = self.n if op == "var" else place
            need(all(type(a) is int and 0 <= a < bound for a in args), f"{op} of {args}")
        if op == "mul" and args[0] == args[1]:
            op, args = "square", args[:1]
        sums = op in {"add", "mul", "div"} and self.positive.issuperset(args)
        if sums or op in {"square", "abs", "exp"} or (op == "const" and self.known[place] >= 0):
            self.positive.add(place)  # nowhere negative, whatever a ball says
        self.nodes.append((op, args))

    def needed(self, output: int) -> list[int]:
        """Return the nodes on whose derivatives those of an output depend, in order."""
        seen: set[int] = set()
        waiting = [output]
        while waiting:
            op, args = self.nodes[a := waiting.pop()]
            if a not in seen and op != "const":
                seen.add(a)
                waiting += [] if op == "var" else args[1:] if op == "select" else args
        return sorted(seen)

    def values(self, box: Sequence[arb]) -> list[Any]:
        v: list[Any] = []
        for place, (op, args) in enumerate(self.nodes):
            if op in {"const", "var"}:
                v.append(box[args[0]] if op == "var" else self.known[place])
            elif op == "sqrt" and not v[args[0]] > 0:
                root = ZERO.union(v[args[0]].abs_upper().sqrt())
                v.append(root if args[0] in self.positive else NAN)
            else:
                v.append(VALUES[op](*[v[a] for a in args]))
        return v

    def forms(self, v: list[Any], row: int, memo: dict[int, Any], order: int = 1) -> Any:
        """Return generalised gradient and Hessian of a function; None where there may be none."""
        for a in self.needs[row]:
            if a in memo:
                continue
            op, args = self.nodes[a]
            parts = [memo.get(b, ({}, {})) for b in args]
            if op == "var":
                memo[a] = {args[0]: arb(1)}, {}
            elif op in {"select", "min", "max"}:
                first = v[args[0]] if op == "select" else ordered(*[v[b] for b in args])
                (x, y), hulls = parts[-2:], op != "select" and order == 1 and None not in parts
                if first is None:
                    memo[a] = (unite(x[0], y[0]), {}) if hulls else None
                else:
                    memo[a] = x if first == (op != "max") else y
            else:
                slopes = SLOPES[op](*[v[b] for b in args])
                memo[a] = None if None in parts else chain(slopes, parts, order)
        return memo.get(self.outputs[row], ({}, {}))

    def signs(self, v: list[Any]) -> list[int]:
        """Return the signs of inequalities and equations, 0 where they are not decided."""
        rows = (v[output] for output in self.outputs[:-1])
        return [1 if x > 0 else -1 if x < 0 else 0 for x in rows]

    def sign(self, v: list[Any], row: int, memo: Any, lo: list[float], hi: list[float]) -> int:
        """Return the sign of a function that is monotone in all coordinates, from two corners."""
        found = self.forms(v, row, memo)
        slopes = [found[0].get(i, ZERO) if found else NAN for i in range(self.n)]
        if all(x >= 0 or x <= 0 for x in slopes):
            for s, (a, b) in ((1, (lo, hi)), (-1, (hi, lo))):
                corner = [arb(y if x >= 0 else z) for x, y, z in zip(slopes, a, b, strict=True)]
                if s * self.values(corner)[self.outputs[row]] > 0:
                    return s
        return 0

    def open_sets(self, signs: list[int], zeros: frozenset[int] = frozenset()) -> list[Any]:
        """Return the functions that have to hold in each branch and may vanish; least sets only."""
        if any(signs[self.m :]):
            return []
        below, above = ({i for i in range(self.m) if signs[i] == s} - zeros for s in (-1, 1))
        sets = {branch - above for branch in self.branches if not branch & below}
        return [u for u in sets if not any(smaller < u for smaller in sets)]

    def closed(self, lower: list[float], upper: list[float], hints: list[Any]) -> bool:
        """Whether a box is closed rightly, or every piece of a bisection of it."""
        ways = [[arb(x) for x in h] for h in hints]
        ways = [h for h in ways if all(h[i] == 0 or self.widths[i] for i in range(self.n))]
        waiting = [(lower, upper)]
        for _ in range(PIECES):
            lo, hi = waiting.pop()
            if not self.shown(lo, hi, ways):
                shares = [(hi[i] - lo[i]) / self.widths[i] for i in self.free]
                axis = self.free[shares.index(max(shares))] if shares else 0
                middle = 0.5 * (lo[axis] + hi[axis])
                if not lo[axis] < middle < hi[axis]:
                    return False
                waiting += [(lo, moved(hi, axis, middle)), (moved(lo, axis, middle), hi)]
            if not waiting:
                return True
        return False

    def shown(self, lo: list[float], hi: list[float], ways: list[list[arb]]) -> bool:
        """Whether a box is closed rightly."""
        if any(g.carries(lo, hi) for g in self.symmetries):
            return True
        v, memo = self.values(hull(lo, hi)), dict[int, Any]()
        signs, turned = self.signs(v), list[Any]()
        regions, loci = ([f for f in all_ if f.holds(lo, hi)] for all_ in (self.regions, self.loci))

        def grows(row: int, w: list[arb]) -> arb:
            found = self.forms(v, row, memo)
            return dot([*found[0].values()], [w[i] for i in found[0]]) if found else NAN

        def leads(u: frozenset[int], w: list[arb]) -> bool:
            return all(grows(i, w) > 0 for i in u)

        def left(u: frozenset[int]) -> bool:
            if any(u <= region.active for region in regions):
                return True
            turned[:] = turned or self.tangents(v, memo, ways)
            if any(grows(-1, w) < 0 and leads(u, w) for w in turned):
                return True
            along = (w for w in ways if loci and all(w[i] == 0 for i in loci[0].places))
            return bool(loci) and (not u or any(leads(u, w) for w in along))

        if all(map(left, self.open_sets(signs))):
            return True
        closer = [s or self.sign(v, row, memo, lo, hi) for row, s in enumerate(signs)]
        return closer != signs and all(map(left, self.open_sets(closer)))

    def tangents(self, v: list[Any], memo: dict[int, Any], ways: list[list[arb]]) -> list[Any]:
        """Return ``w + C y`` with ``dh (w + C y) = 0``, for all elements of the enclosed ``dh``."""
        found = [self.forms(v, row, memo) for row in range(self.m, self.m + self.k)]
        if None in found or not found:
            return [] if found else ways
        rows = arb_mat([[g.get(i, ZERO) for i in self.free] for g, _ in found])
        across, changed = rows.mid().transpose(), []
        for w in ways:
            try:
                y = (rows * across).solve(-rows * arb_mat([[w[i]] for i in self.free]))
            except ZeroDivisionError:
                return []
            change = dict(zip(self.free, (across * y).entries(), strict=True))
            changed.append([x + change.get(i, ZERO) for i, x in enumerate(w)])
        return changed


class Face:
    """A region, or a locus: a box with one KKT point on a face, all multipliers positive.

    Of a locus the face is the whole space of the coordinates that the energy depends on.
    """

    def __init__(self, p: Problem, record: dict[str, Any], places: list[int], active: Any) -> None:
        self.p, self.places, self.active = p, places, frozenset(active or ())
        self.name = f"{'locus' if active is None else 'region'} {record}"
        need(self.active <= set(range(p.m)) and set(places) <= set(p.free), self.name)
        self.rows = [*sorted(self.active), *range(p.m, p.m + p.k + 1)]
        count = p.n if active is not None else len(places)
        self.lower, self.upper = sides(record, ("lower", "upper"), count)
        if active is not None:
            self.lower, self.upper = (
                [side[i] for i in places] for side in (self.lower, self.upper)
            )
        sharp = sides(record, ("sharp_lower", "sharp_upper"), len(places) + len(self.rows) - 1)
        starts = filter(None, map(self.start, (1, 4, 16)))
        solved = next(filter(None, (zero(self.equations, start) for start in starts)), None)
        need(solved, f"{self.name}: no single solution with positive multipliers is shown")
        self.unknowns: list[arb] = solved or []
        slack = [arb(0, 2.0**-70) * (1 + abs(x)) for x in self.unknowns]
        near = [x + y for x, y in zip(hull(*sharp), slack, strict=True)]
        inside = all(x.contains(y) for x, y in zip(near, self.unknowns, strict=True))
        need(inside, f"{self.name}: the solution is elsewhere")
        self.index = self.negative()
        need(record["index"] in {None, self.index}, f"{self.name}: the index is {self.index}")
        self.point = self.at(self.unknowns)
        whole = [period is not None and p.widths[i] >= period for i, period in enumerate(p.periods)]
        some = [(x, p.lower[i], p.upper[i]) for i, x in enumerate(self.point) if not whole[i]]
        self.outside = any(x < a or x > b for x, a, b in some)
        branches = p.open_sets(p.signs(p.values(self.point)), self.active)
        self.stationary = branches == [self.active]
        self.absent = not branches or any(u < self.active for u in branches)
        if active is None:
            self.descends()

    def at(self, unknowns: list[arb]) -> list[arb]:
        """Return all coordinates; those that are no unknowns may be anywhere in the domain."""
        known = dict(zip(self.places, unknowns, strict=False))
        return [known.get(i, x) for i, x in enumerate(self.p.anywhere)]

    def holds(self, lower: list[float], upper: list[float]) -> bool:
        ends = zip(self.lower, self.upper, self.places, strict=True)
        return all(a <= lower[i] and upper[i] <= b for a, b, i in ends)

    def rows_at(self, unknowns: list[arb]) -> Any:
        """Return values of the functions, and gradients and Hessians in the free coordinates."""
        v, memo = self.p.values(self.at(unknowns)), dict[int, Any]()
        found = [self.p.forms(v, row, memo, 2) for row in self.rows]
        if None in found:
            return None
        slopes = [[g.get(i, ZERO) for i in self.places] for g, _ in found]
        pairs = [[(i, j) for j in self.places] for i in self.places]
        bends = [[[h.get(ij, ZERO) for ij in row] for row in pairs] for _, h in found]
        return [v[self.p.outputs[row]] for row in self.rows], slopes, bends

    def start(self, growth: int) -> list[arb] | None:
        """Return the box, and more than an enclosure of the multipliers at all of its points."""
        box = hull(self.lower, self.upper)
        found = self.rows_at(box)
        if not found or len(self.rows) == 1:
            return box if found else None
        *rows, energy = found[1]
        middle = arb_mat(rows).mid()
        try:
            left = (middle * middle.transpose()).inv().mid() * middle
            form = left * arb_mat(rows).transpose()
            multipliers = form.solve(left * arb_mat([[x] for x in energy])).entries()
        except ZeroDivisionError:
            return None
        more = [x + arb(0, 1) * (growth * x.rad() + (abs(x) + 1) / 2**100) for x in multipliers]
        return [*box, *more] if all(x > 0 for x in multipliers[: len(self.active)]) else None

    def equations(self, unknowns: list[arb]) -> Any:
        """Return the residual of the KKT equations and their Jacobian."""
        found = self.rows_at(unknowns)
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
        """Return the negative eigenvalues on the tangent space: each row adds one of each sign."""
        n, (_, jacobian) = len(self.places), self.equations(self.unknowns)
        units = [arb(7 * i + 9) / (3 * i + 8) for i in range(len(jacobian))]
        # a symmetric matrix of the same inertia, whose eigenvalues are not multiple by structure
        signed = [
            (u if i < n else -u, row)
            for i, (u, row) in enumerate(zip(units, jacobian, strict=True))
        ]
        form = [[u * w * x for w, x in zip(units, row, strict=True)] for u, row in signed]
        try:
            found = [x.real for x in acb_mat(arb_mat(form)).eig()] if form else []
        except ValueError:
            return None
        decided = all(x < 0 or x > 0 for x in found)
        return sum(x < 0 for x in found) - len(self.rows) + 1 if decided else None

    def descends(self) -> None:
        """Check that ``v = -C (z - z*)`` descends at a locus, and that nothing else is read."""
        read = {self.p.nodes[a][1][0] for a in self.p.needs[-1] if self.p.nodes[a][0] == "var"}
        fine = not self.p.k and {i for i in read if i in self.p.free} <= set(self.places)
        whole = arb_mat(self.equations(hull(self.lower, self.upper))[1])
        form = whole.transpose() * (whole.mid() + whole.mid().transpose())
        need(fine and definite((form + form.transpose()).tolist()), f"{self.name}: no descent")

    def same(self, other: "Face") -> bool | None:
        """Whether two regions have one point: whether this one's lies in the other region."""
        if self.active != other.active:
            return False
        ends = zip(self.places, other.lower, other.upper, strict=True)
        places = ((self.point[i], a, b, self.p.periods[i]) for i, a, b in ends)
        known = [(x + turn(x, a, b, period), a, b) for x, a, b, period in places]
        inside = all(a <= x <= b for x, a, b in known)
        return True if inside else False if any(x < a or x > b for x, a, b in known) else None


class Symmetry:
    """A map ``q -> signs * q[order] + shifts * periods``."""

    def __init__(self, p: Problem, record: dict[str, Any], weights: list[str]) -> None:
        self.p, self.name, self.order, self.signs = (
            p,
            f"symmetry {record}",
            *(record[key] for key in ("order", "signs")),
        )
        need(sorted(self.order) == [*range(p.n)] and set(self.signs) <= {1, -1}, self.name)
        pairs = [(p.periods[i], period) for i, period in zip(self.order, p.periods, strict=True)]
        need(all(a is b or (a and b and a.overlaps(b)) for a, b in pairs), self.name)
        shifts = zip(record["shifts"], p.periods, strict=True)
        self.shifts = [number(shift) * (period or 0) for shift, period in shifts]
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


# ----------------------------------------------------------------------------------------- the file


def contents(path: str) -> tuple[dict[str, Any], list[Any]]:
    kinds, parts = {"tree": "b", "positions": "d", "counts": "B", "directions": "f"}, []
    with zipfile.ZipFile(path) as archive:
        for name, kind in kinds.items():
            parts.append(array(kind, archive.read(f"{name}.bin")))
            if sys.byteorder == "big":
                parts[-1].byteswap()
        return json.loads(archive.read("problem.json")), parts


def leaves(p: Problem, codes: Any, positions: Any, counts: Any, directions: Any) -> Iterator[Any]:
    """Yield number, sides and directions of the closed boxes."""
    waiting, places, rows, closed = [(p.lower, p.upper)], iter(positions), 0, 0
    for code in codes:
        need(waiting, "the tree has too many nodes")
        lo, hi = waiting.pop()
        if code >= 0:
            x = next(places, math.nan)
            need(code < p.n and lo[code] < x < hi[code], f"a box is split at {x}")
            waiting += [(moved(lo, code, x), hi), (lo, moved(hi, code, x))]
        elif code == -1:
            need(closed < len(counts), "there are more closed boxes than counts")
            end = rows + counts[closed]
            yield closed, lo, hi, [directions[r * p.n : (r + 1) * p.n] for r in range(rows, end)]
            rows, closed = end, closed + 1
        else:
            need(code == -2, f"a node is {code}")
    need(not waiting and next(places, None) is None, "the tree is incomplete")
    need(closed == len(counts) and rows * p.n == len(directions), "the number of directions")


def check_list(p: Problem, data: dict[str, Any]) -> None:
    """Check that all regions with stationary points are listed, each point once."""
    claimed = [p.regions[point["region"]] for point in data["points"]]
    for k, face in enumerate(claimed):
        need(face.stationary and not face.outside, f"{face.name}: is no stationary point")
        need(face.index == data["points"][k]["index"], f"{face.name}: the index is {face.index}")
        need(all(face.same(f) is False for f in claimed[:k]), f"{face.name}: is listed twice")
    for k, face in enumerate(p.regions):
        known = face.outside or face.absent or k in data["open_points"]
        need(known or any(face.same(f) for f in claimed), f"{face.name}: is not listed")


WORKER: list[Problem] = []


def begin(path: str) -> None:
    WORKER[:] = [Problem(contents(path)[0])]


def failing(chunk: list[Any]) -> Any:
    return next((leaf for leaf in chunk if not WORKER[0].closed(*leaf[1:])), None)


def check(path: str, sample: int | None, jobs: int) -> str:
    """Check a file; return the verdict."""
    (data, parts), started, done = contents(path), time.monotonic(), 0
    begin(path)
    p, (total, opened) = WORKER[0], (parts[0].count(code) for code in (-1, -2))
    check_list(p, data)
    need(opened == data["open"], f"{opened} boxes are open, not {data['open']}")
    count = total if sample is None else min(sample, total)
    wanted = range(total) if count == total else set(random.Random(0).sample(range(total), count))
    stream = (leaf for leaf in leaves(p, *parts) if leaf[0] in wanted)
    chunks = iter(lambda: list(islice(stream, CHUNK)), [])
    with ProcessPoolExecutor(jobs, initializer=begin, initargs=(path,)) as pool:
        while wave := list(islice(chunks, 4 * jobs)):
            found = (map if jobs == 1 else pool.map)(failing, wave)
            bad = next(filter(None, found), None)
            need(not bad, f"leaf {bad and (bad[0], [*zip(*bad[1:3], strict=True)])}")
            done += sum(map(len, wave))
            line = f"{done} of {count} leaves, {time.monotonic() - started:.0f} s"
            print(line, file=sys.stderr)
    said = [f"{len(data['points'])} stationary points"]
    said += [f"{len(data['open_points'])} that may be"] if data["open_points"] else []
    said += [f"{sum(not f.outside for f in p.loci)} loci"] if p.loci else []
    said += [f"{total} leaves" if count == total else f"ONLY A SAMPLE of {count} of {total} leaves"]
    said += [f"complete outside {opened} open boxes" if opened else "no open box"]
    said += [f"up to {len(p.symmetries)} symmetries (tested, not proved)"] if p.symmetries else []
    return f"verified: {', '.join(said)}"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Check a saved list of stationary points.")
    parser.add_argument("file")
    parser.add_argument("--sample", type=int, metavar="K", help="check K leaves drawn at random")
    parser.add_argument("--jobs", type=int, default=1, metavar="J", help="processes")
    given = parser.parse_args(arguments)
    try:
        print(check(given.file, given.sample, given.jobs))
    except RefusedError as error:
        print(f"NOT VERIFIED: {error}")
        return 1
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        OSError,
        TypeError,
        ValueError,
        zipfile.BadZipFile,
    ) as error:
        print(f"NOT VERIFIED: the file is malformed: {error!r}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
