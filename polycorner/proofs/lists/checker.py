"""Check a saved proof of a complete list of stationary points; needs python-flint and nothing else.

``python checker.py FILE [--sample K] [--jobs J]`` differentiates the stored program itself, walks
the stored subdivision and shows for every closed box, in ball arithmetic of 128 bits, that

- no point of the set lies in it; or
- each branch of the set has a direction in which all functions that may vanish increase and the
  energy decreases, tangent to the equations, for all elements of their generalised gradients
  ([Clarke] sec. 2.3); or the functions that may vanish are among those of a region that contains
  the box; or the box lies at a locus, and some direction along the coordinates on which the energy
  does not depend leads into the set; or
- a symmetry carries it into the domain and increases ``w . q``.

A box that is not shown at once is bisected.  Regions (boxes with one KKT point, all multipliers
positive) and loci (boxes with one zero of the derivative) are shown by Krawczyk's operator
([Neumaier] sec. 5.1); the list must consist of the regions whose point is in the set, stationary
there and not outside the domain.  That the symmetries preserve the functions is not proved but
tested at random points; that circles are circles is the meaning of the file and cannot be tested.
"""

import argparse
import json
import math
import random
import sys
import time
import zipfile
from array import array
from concurrent.futures import ProcessPoolExecutor
from itertools import islice, product

from flint import acb_mat, arb, arb_mat, ctx, fmpq

FORMAT = ["polycorner-stationary-list", 1]
BITS, PIECES, CHUNK, POINTS, NONE = 128, 4000, 500, 20, ({}, {})


class Refused(Exception):
    pass


def need(condition, message):
    if not condition:
        raise Refused(message)


# ----------------------------------------------------------------- formulas and their derivatives
def square(x):
    return (x.abs_lower() ** 2).union(x.abs_upper() ** 2)


def cut(y, x):  # the angle of (x, y), anything at the cut
    return arb.atan2(y, x) if x > 0 or y != 0 else arb(0, 3.1416)


def ordered(x, y):  # strictly: what is decided in a closed box is decided around it
    return True if x < y else False if x > y else None


def both(x, y):
    return False if x is False or y is False else None if None in (x, y) else True


def opposite(x):
    return None if x is None else not x


def power(x, y, shift):  # x ** (y - shift), which is not finite where it is not analytic
    return x ** (y - shift) if x > 0 or (y.is_exact() and y.is_integer()) else arb("nan")


def bell(x):
    return 2 * (-square(x)).exp() / arb.pi().sqrt()


VALUES = {
    "neg": arb.neg, "square": square, "add": arb.__add__, "sub": arb.__sub__, "mul": arb.__mul__,
    "div": arb.__truediv__, "pow": arb.__pow__, "atan2": cut, "lt": ordered, "le": ordered,
    "not": opposite, "and": both, "or": lambda x, y: opposite(both(opposite(x), opposite(y))),
    "select": lambda c, x, y: x.union(y) if c is None else x if c else y,
    **{name: getattr(arb, name) for name in ("sin cos tan asin acos atan sinh cosh tanh exp log"
                                             " sqrt erf").split()},
}  # fmt: skip
UNARY = {  # first and second derivative, from argument and value
    "neg": lambda x, y: (-1, 0),
    "square": lambda x, y: (2 * x, 2),
    "sqrt": lambda x, y: (1 / (2 * y), -1 / (4 * x * y)),
    "sin": lambda x, y: (x.cos(), -y),
    "cos": lambda x, y: (-x.sin(), -y),
    "tan": lambda x, y: (1 + y * y, 2 * y * (1 + y * y)),
    "asin": lambda x, y: (1 / (1 - x * x).sqrt(), x / (1 - x * x).sqrt() ** 3),
    "acos": lambda x, y: (-1 / (1 - x * x).sqrt(), -x / (1 - x * x).sqrt() ** 3),
    "atan": lambda x, y: (1 / (1 + square(x)), -2 * x / square(1 + square(x))),
    "sinh": lambda x, y: (x.cosh(), y),
    "cosh": lambda x, y: (x.sinh(), y),
    "tanh": lambda x, y: (1 - y * y, -2 * y * (1 - y * y)),
    "exp": lambda x, y: (y, y),
    "log": lambda x, y: (1 / x, -1 / square(x)),
    "erf": lambda x, y: (bell(x), -2 * x * bell(x)),
}


def angle(y, x):
    r = square(x) + square(y) if x > 0 or y != 0 else arb("nan")
    twist, bend = (y * y - x * x) / r**2, 2 * x * y / r**2
    return (x / r, -y / r), ((-bend, twist), (twist, bend))


def general(x, y):
    p, q, log = power(x, y, 1), power(x, y, 2), x.log()
    mixed = p * (1 + y * log)
    return (y * p, x * p * log), ((y * (y - 1) * q, mixed), (mixed, x * p * log**2))


BINARY = {
    "add": lambda x, y: ((1, 1), ((0, 0), (0, 0))),
    "sub": lambda x, y: ((1, -1), ((0, 0), (0, 0))),
    "mul": lambda x, y: ((y, x), ((0, 1), (1, 0))),
    "div": lambda x, y: ((1 / y, -x / square(y)), ((0, -1 / square(y)), (-1 / square(y), 2 * x / y**3))),
    "atan2": angle,
    "pow": general,
}  # fmt: skip


def chain(parts, first, second, order):
    """Return gradient and Hessian of an operation from those of its arguments, as dictionaries."""
    g, h = {}, {}
    for p, (slopes, bends) in zip(first, parts):
        for i, x in slopes.items():
            g[i] = g.get(i, 0) + p * x
        for ij, x in bends.items():
            h[ij] = h.get(ij, 0) + p * x
    if order > 1:
        for s, (a, b) in zip((s for row in second for s in row), product(parts, parts)):
            for (i, x), (j, y) in product(a[0].items(), b[0].items()) if type(s) is arb or s else ():
                h[i, j] = h.get((i, j), 0) + s * (square(x) if x is y else x * y)
    return g, h


# ------------------------------------------------------------------------- numbers, boxes, matrices
def number(text):
    """Return a ball for ``"3/2"``, ``"pi"``, ``"e"`` or ``"2 pi"``."""
    factor, *unit = text.replace("pi", " pi").split() if text != "pi" else ("1", "pi")
    if text == "e":
        return arb.const_e()
    return arb(fmpq(*map(int, factor.split("/")))) * (arb.pi() if unit == ["pi"] else 1)


def numbers(texts, count):
    found = [float.fromhex(text) for text in texts]
    need(len(found) == count and all(map(math.isfinite, found)), "numbers are missing or not finite")
    return found


def hull(lower, upper):
    return [arb(a).union(arb(b)) if a < b else arb(a) for a, b in zip(lower, upper)]


def changed(side, axis, position):
    return [*side[:axis], position, *side[axis + 1 :]]


def dot(x, y):
    return sum((a * b for a, b in zip(x, y)), arb(0))


def positive(rows):
    """Whether all symmetric matrices in an enclosure are positive definite."""
    if not rows:
        return True
    (pivot, *row), *rest = rows
    return bool(pivot > 0) and positive(
        [[x - r[0] * y / pivot for x, y in zip(r[1:], row)] for r in rest]
    )


def zero(equations, unknowns):
    """Return a small enclosure of the only zero in a box, by Krawczyk's operator, or None."""
    shown = False
    for _ in range(10):
        centre = [x.mid() for x in unknowns]
        here, there = equations(centre), equations(unknowns)
        if here is None or there is None:
            return None
        try:
            inverse = arb_mat(here[1]).mid().inv().mid()
        except ZeroDivisionError:
            return None
        apart = arb_mat([[x - c] for x, c in zip(unknowns, centre)])
        defect = arb_mat(len(centre), len(centre), 1) - inverse * arb_mat(there[1])
        moved = defect * apart - inverse * arb_mat([[r] for r in here[0]])
        image = [c + x for c, x in zip(centre, moved.entries())]
        if not shown and not all(x.contains_interior(y) for x, y in zip(unknowns, image)):
            return None
        shown = True
        unknowns = [y if y.rad() < x.rad() else x for x, y in zip(unknowns, image)]
    return unknowns


def negative_eigenvalues(rows):
    found = [x.real for x in acb_mat(arb_mat(rows)).eig(multiple=True)] if rows else []
    return sum(bool(x < 0) for x in found) if all(x < 0 or x > 0 for x in found) else None


def agrees(record, found):
    """Whether the enclosure that a file gives contains a much sharper one."""
    lower, upper = (numbers(record[f"sharp_{side}"], len(found)) for side in ("lower", "upper"))
    slack = arb(0, 1) / 2**70
    return all((x + slack * (1 + abs(x))).contains(y) for x, y in zip(hull(lower, upper), found))


class Problem:
    """The file's problem: programs, set, domain, regions, loci, symmetries."""

    def __init__(self, data):
        ctx.prec = BITS
        need(data["format"] == FORMAT, f"the format is {data['format']}, not {FORMAT}")
        self.m, self.k, self.n = data["inequalities"], data["equations"], len(data["coordinates"])
        self.outputs, self.nodes, self.known, self.positive = data["outputs"], [], {}, set()
        need(len(self.outputs) == self.m + self.k + 1, "the number of functions")
        for number, (op, *args) in enumerate(data["nodes"]):
            self._add(number, op, args)
        self.needs = [self._needed(output) for output in self.outputs]
        self.branches = {frozenset(branch) for branch in data["branches"]}
        need(all(0 <= i < self.m for branch in self.branches for i in branch), "a branch")
        self.lower, self.upper = (numbers(data["domain"][side], self.n) for side in ("lower", "upper"))
        need(all(a <= b for a, b in zip(self.lower, self.upper)), "the domain")
        self.free = [i for i in range(self.n) if self.lower[i] < self.upper[i]]
        need(data["fixed"] == [i for i in range(self.n) if i not in self.free], "fixed coordinates")
        self.periods = [p and number(p) for p in data["periods"]]
        self.regions = [Region(self, r) for r in data["regions"]]
        self.loci = [Locus(self, r) for r in data["loci"]]
        self.weights = [arb(w) for w in numbers(data["weights"], self.n)]
        self.symmetries = [Symmetry(self, g) for g in data["symmetries"]]

    def _add(self, place, op, args):
        if op == "const":
            self.known[place] = number(args[0])
        elif op == "var":
            need(0 <= args[0] < self.n, "a variable")
        else:
            need(op in VALUES and all(0 <= a < place for a in args), f"the operation {op}")
            if op == "mul" and args[0] == args[1]:
                op, args = "square", args[:1]
        positive = [a in self.positive for a in args]
        if op in {"square", "exp", "cosh", "sqrt"} or (op in {"add", "mul", "div"} and all(positive)) or (
            op == "select" and all(positive[1:])) or (op == "const" and self.known[place] >= 0):
            self.positive.add(place)
        self.nodes.append((op, args))

    def _needed(self, output):
        """Return the nodes on whose derivatives those of an output depend, in order."""
        seen, waiting = set(), [output]
        while waiting:
            a = waiting.pop()
            op, args = self.nodes[a]
            if a not in seen and op != "const":
                seen.add(a)
                waiting += args[1:] if op == "select" else args if op != "var" else []
        return sorted(seen)

    def continuous(self, select):
        """Whether both branches agree where the two numbers compared are equal (min, abs, ...)."""
        (op, args), (yes, no) = self.nodes[self.nodes[select][1][0]], self.nodes[select][1][1:]
        if op == "not":
            op, args = self.nodes[args[0]]
        if op not in {"lt", "le"}:
            return False
        base = args[0] if self.nodes[args[0]][0] == "const" else args[1]

        def there(a):
            op, given = self.nodes[a]
            if a in args:
                return base
            if op == "neg" and there(given[0]) in self.known and self.known[there(given[0])] == 0:
                return there(given[0])
            if op == "select" and self.nodes[given[0]][0] in {"lt", "le"}:
                x, y = (there(b) for b in self.nodes[given[0]][1])
                if x == y:
                    return there(given[1 if self.nodes[given[0]][0] == "le" else 2])
                if x in self.known and y in self.known and self.known[x] != self.known[y]:
                    return there(given[1 if self.known[x] < self.known[y] else 2])
            return a

        return there(yes) == there(no)

    def values(self, box):
        v = []
        for place, (op, args) in enumerate(self.nodes):
            if op == "const":
                v.append(self.known[place])
            elif op == "var":
                v.append(box[args[0]])
            elif op == "sqrt" and not v[args[0]] > 0:
                top = v[args[0]].abs_upper().sqrt()
                v.append(arb(0).union(top) if args[0] in self.positive else arb("nan"))
            else:
                v.append(VALUES[op](*[v[a] for a in args]))
        return v

    def slopes(self, v, row, memo, order=1):
        """Return generalised gradient and Hessian of a function, or None."""
        for a in self.needs[row]:
            if a in memo:
                continue
            op, args = self.nodes[a]
            parts = [memo.get(b, NONE) for b in args]
            if op == "var":
                memo[a] = ({args[0]: arb(1)}, {})
            elif op == "select":
                c, (_, yes, no) = v[args[0]], parts
                memo[a] = self._hull(a, yes, no, order) if c is None else yes if c else no
            elif None in parts:
                memo[a] = None
            elif len(args) == 1:
                f, ff = UNARY[op](v[args[0]], v[a])
                memo[a] = chain(parts, (f,), ((ff,),), order)
            else:
                memo[a] = chain(parts, *BINARY[op](*[v[b] for b in args]), order)
        return memo.get(self.outputs[row], NONE)

    def _hull(self, select, yes, no, order):
        if None in (yes, no) or order > 1 or not self.continuous(select):
            return None
        zero, (f, _), (g, _) = arb(0), yes, no
        return {i: f.get(i, zero).union(g.get(i, zero)) for i in f | g}, {}

    def value(self, v, row):
        return v[self.outputs[row]]

    def open_sets(self, v, vanishing=frozenset()):
        """Return what has to hold in each branch, of functions that may vanish; least sets only."""
        rows = [self.value(v, i) for i in range(self.m + self.k)]
        if any(h > 0 or h < 0 for h in rows[self.m :]):
            return []
        below = {i for i in range(self.m) if rows[i] < 0} - vanishing
        above = {i for i in range(self.m) if rows[i] > 0} - vanishing
        sets = {branch - above for branch in self.branches if not branch & below}
        return [u for u in sets if not any(other < u for other in sets)]

    # ------------------------------------------------------------------------------------- boxes
    def closed(self, lower, upper, hints):
        """Whether a box or all pieces of a bisection are shown to hold no unlisted point."""
        fixed = [i for i in range(self.n) if i not in self.free]
        hints = [[arb(x) for x in hint] for hint in hints if not any(hint[i] for i in fixed)]
        waiting = [(lower, upper)]
        for _ in range(PIECES):
            lo, hi = waiting.pop()
            if not self.shown(lo, hi, hints):
                axis = max(self.free, key=lambda i: (hi[i] - lo[i]) / (self.upper[i] - self.lower[i]),
                           default=None)
                if axis is None:
                    return False
                middle = 0.5 * (lo[axis] + hi[axis])
                if not lo[axis] < middle < hi[axis]:
                    return False
                waiting += [(lo, changed(hi, axis, middle)), (changed(lo, axis, middle), hi)]
            if not waiting:
                return True
        return False

    def shown(self, lo, hi, hints):
        if any(g.carries(self, lo, hi) for g in self.symmetries):
            return True
        v, memo = self.values(hull(lo, hi)), {}
        regions = [r for r in self.regions if r.holds(lo, hi)]
        loci = [r for r in self.loci if r.holds(lo, hi)]

        def closes(u):
            if any(u <= r.active for r in regions):
                return True
            directions = self.tangents(v, memo, hints)
            if any(self.grow(v, memo, u, w) and self.along(v, memo, -1, w) < 0 for w in directions):
                return True
            return any(
                not u or any(all(h[i] == 0 for i in place.z) and self.grow(v, memo, u, h) for h in hints)
                for place in loci
            )

        return all(closes(u) for u in self.open_sets(v))

    def grow(self, v, memo, rows, w):
        return all(self.along(v, memo, row, w) > 0 for row in rows)

    def along(self, v, memo, row, w):
        found = self.slopes(v, row % len(self.outputs), memo)
        return arb("nan") if found is None else dot(found[0].values(), [w[i] for i in found[0]])

    def tangents(self, v, memo, hints):
        """Return directions changed so that they are tangent to the equations."""
        if not self.k or not hints:
            return hints
        found = [self.slopes(v, self.m + j, memo) for j in range(self.k)]
        if None in found:
            return []
        rows = arb_mat([[g.get(i, arb(0)) for i in self.free] for g, _ in found])
        across, changes = rows.mid().transpose(), []
        for h in hints:
            try:
                y = (rows * across).solve(-rows * arb_mat([[h[i]] for i in self.free]))
            except ZeroDivisionError:
                continue
            change = dict(zip(self.free, (across * y).entries()))
            changes.append([h[i] + change.get(i, 0) for i in range(self.n)])
        return changes


class Region:
    """A box with one KKT point on a face, all multipliers positive."""

    def __init__(self, p, record):
        self.active, self.free, self.name = frozenset(record["active"]), p.free, f"region {record}"
        need(self.active <= set(range(p.m)), f"{self.name}: active functions")
        self.lower, self.upper = (numbers(record[side], p.n) for side in ("lower", "upper"))
        self.rows = [*sorted(self.active), *range(p.m, p.m + p.k), p.m + p.k]
        equations = self.equations(p)
        for growth in (1, 3, 10):
            start = self.start(p, growth)
            found = start and zero(equations, start)
            if found:
                break
        need(found, f"{self.name}: no single solution with positive multipliers is shown")
        need(agrees(record, found), f"{self.name}: the solution is elsewhere")
        bordered = [[x if i < len(p.free) else -x for x in row] for i, row in enumerate(equations(found)[1])]
        negative = negative_eigenvalues(bordered)
        self.index = None if negative is None else negative - len(self.rows) + 1
        self.point = list(map(arb, p.lower))
        for i, x in zip(p.free, found):
            self.point[i] = x
        branches = p.open_sets(p.values(self.point), self.active)
        self.stationary = branches == [self.active]
        self.settled = self.stationary or not branches or any(u < self.active for u in branches)
        self.outside = any(x < a or x > b for x, a, b in zip(self.point, p.lower, p.upper))

    def holds(self, lower, upper):
        return all(a <= b for a, b in zip(self.lower, lower)) and all(a <= b for a, b in zip(upper, self.upper))

    def start(self, p, growth):
        """Return the box with an enclosure of the multipliers on it; None if one may be dependent."""
        box = hull(self.lower, self.upper)
        v, memo = p.values(box), {}
        found = [p.slopes(v, row, memo, 2) for row in self.rows]
        if None in found:
            return None
        *rows, energy = [[g.get(i, arb(0)) for i in self.free] for g, _ in found]
        multipliers = []
        if rows:
            try:
                middle = arb_mat(rows).mid()
                left = (middle * middle.transpose()).inv().mid() * middle
                square = left * arb_mat(rows).transpose()
                multipliers = square.solve(left * arb_mat([[x] for x in energy])).entries()
            except ZeroDivisionError:
                return None
        if not all(x > 0 for x in multipliers[: len(self.active)]):
            return None
        wider = [x + arb(0, 1) * (growth * x.rad() + abs(x) / 2**100 + arb(2) ** -100) for x in multipliers]
        return [*(box[i] for i in self.free), *wider]

    def equations(self, p):
        def evaluated(unknowns):
            q, n = list(map(arb, p.lower)), len(p.free)
            for i, x in zip(p.free, unknowns):
                q[i] = x
            v, memo = p.values(q), {}
            found = [p.slopes(v, row, memo, 2) for row in self.rows]
            if None in found:
                return None
            weights = [*(-lam for lam in unknowns[n:]), arb(1)]
            slopes = [[g.get(i, arb(0)) for i in p.free] for g, _ in found]
            bent = [[dot(weights, [h.get((i, j), arb(0)) for _, h in found]) for j in p.free] for i in p.free]
            residual = [dot(weights, column) for column in zip(*slopes)]
            rows = slopes[:-1]
            jacobian = [[*b, *(-row[i] for row in rows)] for i, b in enumerate(bent)]
            jacobian += [[*row, *[arb(0)] * len(rows)] for row in rows]
            return [*residual, *(p.value(v, row) for row in self.rows[:-1])], jacobian

        return evaluated

    def same(self, other, p):
        """Whether two regions have one point: this one's is in the other region, turned."""
        turned = [
            x + turns(arb(a).union(arb(b)), x, period)
            for x, a, b, period in zip(self.point, other.lower, other.upper, p.periods)
        ]
        return self.active == other.active and all(
            a <= x and x <= b for x, a, b in zip(turned, other.lower, other.upper)
        )

    def differs(self, other, p):
        gaps = ((x - y, period) for x, y, period in zip(self.point, other.point, p.periods))
        return any(
            not (d / period).contains_integer() if period else not d.contains(0) for d, period in gaps
        )


def turns(target, x, period):
    """Return the multiple of a period that brings ``x`` next to the middle of an interval."""
    return round(float((target.mid() - x.mid()) / period)) * period if period else arb(0)


class Locus:
    """A box of coordinates ``z`` with one zero of the energy's derivative, which reads no others."""

    def __init__(self, p, record):
        self.z, name = record["z"], f"locus {record}"
        read = {p.nodes[a][1][0] for a in p.needs[-1] if p.nodes[a][0] == "var"}
        need(not p.k and set(self.z) <= set(p.free) and read & set(p.free) <= set(self.z), name)
        self.lower, self.upper = (numbers(record[side], len(self.z)) for side in ("lower", "upper"))
        start = hull(self.lower, self.upper)
        equations = self.equations(p)
        found = zero(equations, start)
        need(found and agrees(record, found), f"{name}: no single zero there is shown")
        whole = arb_mat(equations(start)[1])
        form = whole.transpose() * (whole.mid() + whole.mid().transpose())
        need(positive((form + form.transpose()).tolist()), f"{name}: the energy may not descend to it")
        self.index = negative_eigenvalues(equations(found)[1])
        need(self.index == record["index"], f"{name}: the index is {self.index}")
        self.outside = any(x < p.lower[i] or x > p.upper[i] for i, x in zip(self.z, found))

    def holds(self, lower, upper):
        return all(
            a <= lower[i] and upper[i] <= b for i, a, b in zip(self.z, self.lower, self.upper)
        )

    def equations(self, p):
        def evaluated(unknowns):
            q = list(map(arb, p.lower))
            for i, x in zip(self.z, unknowns):
                q[i] = x
            found = p.slopes(p.values(q), p.m + p.k, {}, 2)
            return found and (
                [found[0].get(i, arb(0)) for i in self.z],
                [[found[1].get((i, j), arb(0)) for j in self.z] for i in self.z],
            )

        return evaluated


class Symmetry:
    """A map ``q -> signs * q[order] + shifts * periods`` that preserves the problem."""

    def __init__(self, p, record):
        self.order, self.signs = record["order"], record["signs"]
        name = f"symmetry {record}"
        need(sorted(self.order) == list(range(p.n)) and set(self.signs) <= {1, -1}, name)
        need(all(p.periods[i] is p.periods[j] or p.periods[i] and p.periods[j] and p.periods[i].overlaps(p.periods[j])
                 for i, j in enumerate(self.order)), name)
        self.shifts = []
        for text, period in zip(record["shifts"], p.periods):
            need(period or number(text) == 0, name)
            self.shifts.append(number(text) * (period or 1))
        back = [arb(0)] * p.n
        for w, s, i in zip(p.weights, self.signs, self.order):
            back[i] = w * s
        self.slopes = [b - w for b, w in zip(back, p.weights)]
        self._test(p, name)

    def image(self, q):
        return [s * q[i] + shift for s, i, shift in zip(self.signs, self.order, self.shifts)]

    def carries(self, p, lo, hi):
        """Whether a box is carried into the domain and ``w . q`` increases on it."""
        q = hull(lo, hi)
        steps = [turns(arb(a).union(arb(b)), x, period)
                 for x, a, b, period in zip(self.image(q), p.lower, p.upper, p.periods)]
        moved = [
            s * arb(side[i]) + shift + step
            for side in (lo, hi)
            for s, i, shift, step in zip(self.signs, self.order, self.shifts, steps)
        ]
        if not all(a <= x and x <= b for x, a, b in zip(moved, p.lower * 2, p.upper * 2)):
            return False
        return dot(self.slopes, q) + dot(p.weights, [a + b for a, b in zip(self.shifts, steps)]) > 0

    def _test(self, p, name):
        draw, seen = random.Random(1), []
        for _ in range(50 * POINTS):
            q = [arb(draw.uniform(a, b)) for a, b in zip(p.lower, p.upper)]
            found = [[p.value(v, row) for row in range(len(p.outputs))] for v in (p.values(q), p.values(self.image(q)))]
            if all(x.is_finite() for row in found for x in row) and len(seen) < POINTS:
                seen.append(found)
        need(len(seen) == POINTS, f"{name}: too few points where all functions are defined")

        def alike(i, j, sides=(1, 1), signs=(1,)):
            return any(all(pair[sides[0]][i].overlaps(s * pair[sides[1]][j]) for pair in seen) for s in signs)

        def first(i, sides, signs=(1,), rows=range(p.m)):
            return next((j for j in rows if alike(i, j, sides, signs)), -1)

        equations = range(p.m, p.m + p.k)
        need(alike(-1, -1, (0, 1)), f"{name}: changes the energy")
        need(all(first(i, (1, 0), (1, -1), equations) >= 0 for i in equations), f"{name}: changes an equation")
        here, there = ({frozenset(first(i, (side, 0)) for i in b) for b in p.branches} for side in (0, 1))
        need(here == there, f"{name}: changes the set")


# ------------------------------------------------------------------------------------------- files
def contents(path):
    with zipfile.ZipFile(path) as archive:
        data = json.loads(archive.read("problem.json"))
        parts = []
        for name, kind in (("tree", "b"), ("positions", "d"), ("counts", "B"), ("directions", "f")):
            parts.append(array(kind, archive.read(f"{name}.bin")))
            if sys.byteorder == "big":
                parts[-1].byteswap()
    return data, parts


def leaves(p, codes, positions, counts, directions):
    """Yield number, sides and directions of the closed boxes."""
    waiting, places, rows, closed = [(p.lower, p.upper)], iter(positions), 0, 0
    for code in codes:
        need(waiting, "the tree has too many nodes")
        lo, hi = waiting.pop()
        if code >= 0:
            position = next(places, math.nan)
            need(code < p.n and lo[code] < position < hi[code], f"a box is split at {position}")
            waiting += [(changed(lo, code, position), hi), (lo, changed(hi, code, position))]
        elif code == -1:
            need(closed < len(counts), "the number of closed boxes")
            end = rows + counts[closed]
            yield closed, lo, hi, [directions[r * p.n : (r + 1) * p.n] for r in range(rows, end)]
            rows, closed = end, closed + 1
        else:
            need(code == -2, f"a node is {code}")
    need(not waiting and next(places, None) is None, "the tree is incomplete")
    need(closed == len(counts) and rows * p.n == len(directions), "the number of directions")


def listed(p, data):
    """Check the claimed list against the regions."""
    claimed = {point["region"]: point["index"] for point in data["points"]}
    need(len(claimed) == len(data["points"]) and set(claimed) <= set(range(len(p.regions))), "the list")
    for k, region in enumerate(p.regions):
        if k in claimed:
            need(region.stationary and not region.outside, f"{region.name}: is no stationary point")
            need(claimed[k] == region.index, f"{region.name}: the index is {region.index}")
            others = [p.regions[j] for j in claimed if j < k]
            need(all(region.differs(other, p) for other in others), f"{region.name}: is listed twice")
        elif not region.outside:
            need(region.settled, f"{region.name}: may be a stationary point")
            known = any(region.same(p.regions[j], p) for j in claimed)
            need(not region.stationary or known, f"{region.name}: its point is not listed")


WORKER = []


def begin(path):
    WORKER[:] = [Problem(contents(path)[0])]


def failing(chunk):
    return next((leaf for leaf in chunk if not WORKER[0].closed(*leaf[1:])), None)


def check(path, sample, jobs):
    data, parts = contents(path)
    begin(path)
    p, (total, opened) = WORKER[0], (parts[0].count(code) for code in (-1, -2))
    listed(p, data)
    need(opened == data["open"], f"{opened} boxes are open, not {data['open']}")
    some = sample is not None and sample < total
    wanted = set(random.Random(0).sample(range(total), sample)) if some else None
    stream = (leaf for leaf in leaves(p, *parts) if wanted is None or leaf[0] in wanted)
    chunks = iter(lambda: list(islice(stream, CHUNK)), [])
    done, started = 0, time.monotonic()
    with ProcessPoolExecutor(jobs, initializer=begin, initargs=(path,)) as pool:
        while wave := list(islice(chunks, 4 * jobs)):
            bad = next(filter(None, (map if jobs == 1 else pool.map)(failing, wave)), None)
            need(not bad, bad and f"leaf {bad[0]}: {list(zip(*bad[1:3]))}")
            done += sum(map(len, wave))
            print(f"{done} of {total} leaves, {time.monotonic() - started:.0f} s", file=sys.stderr)
    points, loci = len(data["points"]), sum(not place.outside for place in p.loci)
    parts = [f"{points} stationary points", *([f"{loci} loci"] if p.loci else [])]
    parts += [f"{total} leaves" if wanted is None else f"A SAMPLE of {sample} of {total} leaves"]
    parts += [f"complete outside {opened} open boxes" if opened else "no open box"]
    if p.symmetries:
        parts.append(f"up to {len(p.symmetries)} symmetries, which were tested at random points only")
    return f"verified: {', '.join(parts)}"


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("file")
    parser.add_argument("--sample", type=int, metavar="K", help="check K leaves drawn at random")
    parser.add_argument("--jobs", type=int, default=1, metavar="J", help="processes")
    given = parser.parse_args(arguments)
    try:
        verdict, code = check(given.file, given.sample, given.jobs), 0
    except Refused as error:
        verdict, code = f"NOT VERIFIED: {error}", 1
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OSError, zipfile.BadZipFile) as error:
        verdict, code = f"NOT VERIFIED: the file is malformed: {error!r}", 1
    print(verdict)
    return code


if __name__ == "__main__":
    sys.exit(main())
