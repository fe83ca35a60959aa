"""What statements about single points have in common: a program, numbers, symmetries, words."""

from collections.abc import Iterator, Sequence
from json import dumps
from typing import Any

from flint import arb, arb_mat, ctx, fmpq

from .algebra import Algebra, constant
from .balls import ZERO, NotShownError, column, dot, krawczyk, need, places, zero
from .problem import StoredProgram
from .rationals import decimal, decimals, ratios

PROOF = ["polycorner-proof", 1]
PART = arb(0, 1)
STEPS = 100  # of Newton's method at most
SLACK = 16  # last binary digits that an enclosure covers at least
INFLATIONS = 6  # of a box in which a zero is sought
FEWEST_BITS, MOST_BITS = 64, 40_000
MOST_NAMED, MOST_LETTERS = 8, 80  # functions that are named, coordinates of points, letters


class StoredGauge:
    """A vector field along which nothing changes, and the normal of a section that it crosses."""

    def __init__(self, p: StoredProgram, record: dict[str, Any], size: int) -> None:
        self.nodes = places(record["field"], len(p.nodes), "components of a field")
        need(len(self.nodes) == size and p.truths.isdisjoint(self.nodes), "components of a field")
        self.normal = ratios(record["normal"], size, "a normal")
        rows = range(len(p.outputs), len(p.outputs) + size)
        p.outputs += self.nodes
        p.needs += [p.needed(node) for node in self.nodes]
        self.rows = list(rows)


class StoredStatement:
    """The problem of a file and the numbers from which a statement about it is shown.

    Functions are numbered: inequalities, equations, then the energy.
    """

    centre: Sequence[fmpq] = ()

    def __init__(self, data: dict[str, Any]) -> None:
        self.record = record = data["evidence"]
        self.bits = record["bits"]
        fine = type(self.bits) is int and FEWEST_BITS <= self.bits <= MOST_BITS
        need(fine, f"the working precision is {self.bits} bits")
        self.p = p = StoredProgram(data, self.bits)
        self.labels = data["functions"]
        need(all(isinstance(x, str) for x in self.labels), "names of functions are texts")
        parameters = places(data["parameters"], p.n, "parameters")
        self.size = p.n - len(parameters)  # coordinates; parameters are the last inputs
        need(parameters == [*range(self.size, p.n)], "parameters are the last inputs")
        self.energy = p.m + p.k
        self.scales = ratios(record["scales"], self.size, "scales")
        need(all(s > 0 for s in self.scales), "scales are positive")
        self.gauges = [StoredGauge(p, g, self.size) for g in record["gauges"]]
        self.algebra = Algebra(p)

    # ------------------------------------------------------------------------------------ numbers

    def rows(self, name: str, first: int, last: int) -> list[int]:
        found = places(self.record[name], last, name)
        need(all(i >= first for i in found) and len({*found}) == len(found), name)
        return found

    def forms(self, box: Sequence[arb], rows: Sequence[int]) -> Any:
        """Return values, gradients and Hessians of smooth functions on a box, in scale units."""
        v, memo, found = self.p.values(box), dict[int, Any](), []
        units = [*self.scales, *[1] * (self.p.n - self.size)]  # parameters have none
        for row in rows:
            form = self.p.forms(v, row, memo, 2)
            finite = form and all(x.is_finite() for part in form for x in part.values())
            value = v[self.p.outputs[row]]
            name = self.named([row]) if row <= self.energy else "a field"
            need(finite and value.is_finite(), f"{name} is not shown to be smooth on the box")
            gradient = {i: x * units[i] for i, x in form[0].items()}
            hessian = {(i, j): x * units[i] * units[j] for (i, j), x in form[1].items()}
            found.append((value, gradient, hessian))
        return found

    # ---------------------------------------------------------------------------------- symmetries

    def follows(self, v: Sequence[Any], row: int, held: Sequence[int]) -> bool:
        """Whether a function, defined where its values are ``v``, vanishes wherever others do."""
        outputs = self.p.outputs
        finite = v[outputs[row]].is_finite()
        return finite and self.algebra.combines(outputs[row], [outputs[i] for i in held])

    def check_equations(self, box: Sequence[arb], held: Sequence[int]) -> None:
        """Check that equations that are left out follow from others."""
        v = self.p.values(box)
        for row in range(self.p.m, self.energy):
            fine = row in held or self.follows(v, row, held)
            need(fine, f"{self.named([row])} needs algebra that this checker does not do")

    def check_symmetries(self, box: Sequence[arb], rows: Sequence[int]) -> None:
        """Check that functions do not change along the fields, which cross their sections."""
        crossings = []
        for gauge in self.gauges:
            along = [self.algebra.value(node) for node in gauge.nodes]
            need(None not in along, "a field needs algebra that this checker does not do")
            nodes = [self.p.outputs[row] for row in rows]
            changes = self.algebra.slopes([*along, *[{}] * (self.p.n - self.size)], nodes)
            for row, change in zip(rows, changes, strict=True):
                fine = change == {}
                need(fine, f"{self.named([row])} is not shown to be constant along a field")
            field = [value for value, _, _ in self.forms(box, gauge.rows)]
            crossings.append([dot([arb(x) for x in g.normal], field) for g in self.gauges])
        try:
            arb_mat(crossings).inv() if crossings else None
        except ZeroDivisionError:
            need(False, "the fields are not shown to cross the section")

    @property
    def normals(self) -> list[dict[int, arb]]:
        """The normals of the sections, in scale units."""
        return [
            {i: arb(x) * self.scales[i] for i, x in enumerate(g.normal) if x != 0}
            for g in self.gauges
        ]

    # --------------------------------------------------------------------------------------- words

    def said(self) -> Iterator[str]:
        """Yield the parts of the statement."""
        raise NotImplementedError

    def field(self, gauge: StoredGauge) -> str:
        pairs = zip(self.p.names, map(self.algebra.value, gauge.nodes), strict=False)
        terms = ((self.algebra.words(u), f"d/d{name}") for name, u in pairs if u)
        return " + ".join(d if word == "1" else f"({word}) {d}" for word, d in terms)

    def named(self, rows: Sequence[int]) -> str:
        """Return quoted names of functions, which say nothing; of many the first ones."""
        shown = ", ".join(dumps(self.labels[i][:MOST_LETTERS]) for i in rows[:MOST_NAMED])
        return f"{shown} and {len(rows) - MOST_NAMED} more" if len(rows) > MOST_NAMED else shown

    def modulo(self) -> list[str]:
        return [f"modulo {self.field(gauge)}" for gauge in self.gauges]

    def problem(self) -> str:
        p = self.p
        return f"{self.size} coordinates, {p.m} inequalities, {p.k} equations"

    def where(self, point: Sequence[arb], exact: Sequence[fmpq], radius: arb) -> str:
        """Return a place in words: exactly, or near the point of the file."""
        few = len(exact) <= MOST_NAMED
        if radius == 0:
            known = few and max(map(len, map(str, exact))) <= MOST_LETTERS
            pairs = zip(self.p.names, exact, strict=False)
            listed = ", ".join(f"{name} = {x}" for name, x in pairs)
            return f"exactly at {listed if known else 'the point of the file'}"
        middle = (decimal(x.mid(), 6, False) for x in point)
        near = ", ".join(f"{name} = {x}" for name, x in zip(self.p.names, middle, strict=False))
        beside = f"near {near}, " if few else ""
        within = f"within {decimal(radius, 3, True)} of the point of the file"
        return f"{beside}{within} in every coordinate"

    def energies(self, lower: arb, upper: arb, exactly: bool) -> str:
        """Return the energy in words."""
        exact = Algebra(self.p, self.centre).value(self.p.outputs[self.energy]) if exactly else None
        x = constant(exact)
        if x is not None and len(str(x)) <= MOST_LETTERS:
            return f"its energy is {x}"
        low, high = decimals(lower, upper)
        return f"its energy is between {low} and {high}"


def approach(system: Any, start: Sequence[arb]) -> list[arb]:
    """Return an approximate zero near a point, by Newton's steps."""
    x, last = list(start), arb("inf")
    for _ in range(STEPS):
        moved = [step.mid() for step in newton(system, x)]
        x = [(a - b).mid() for a, b in zip(x, moved, strict=True)]
        size = largest(moved)
        if not size < last / 2:
            break
        last = size
    return x


def zero_near(system: Any, start: Sequence[arb], around: Any = None) -> list[arb]:
    """Enclose a zero near a point: Newton's steps, then Krawczyk's operator.

    For systems with parameters ``around`` is that for all of their values.
    """
    x, around = approach(system, start), around or system
    tiny = arb(2) ** (SLACK - ctx.prec)
    moved = [step.abs_upper() + (1 + a.abs_upper()) * tiny
             for a, step in zip(x, newton(around, x), strict=True)]  # fmt: skip
    for _ in range(INFLATIONS):
        box = [a + PART * 2 * r for a, r in zip(x, moved, strict=True)]
        found = zero(around, box)
        if found is not None:
            return found
        moved = [r.max(y.abs_upper()) for r, y in zip(moved, image(around, x, box), strict=True)]
    msg = "no single solution of the equations is enclosed"
    raise NotShownError(msg)


def image(system: Any, x: list[arb], box: list[arb]) -> list[arb]:
    """Return the displacements from ``x`` to which Krawczyk's operator maps those of a box."""
    found = krawczyk(system(x), system(box), [b - a for a, b in zip(x, box, strict=True)])
    need(all(y.is_finite() for y in found), "the equations are not finite")
    return found


def newton(system: Any, x: list[arb]) -> list[arb]:
    values, jacobian = system([a.mid() for a in x])
    try:
        steps = arb_mat(jacobian).mid().inv().mid() * column(values)
    except ZeroDivisionError:
        msg = "the equations are not shown to be independent"
        raise NotShownError(msg) from None
    found = list(steps.entries())
    need(all(step.is_finite() for step in found), "the equations are not finite")
    return found


def upper(x: arb) -> arb:
    """Return the upper bound of a number that is not negative."""
    return x.upper() if x.upper() > 0 else ZERO


def largest(numbers: Sequence[arb]) -> arb:
    """Return an upper bound of sizes."""
    found = ZERO
    for x in numbers:
        found = found.max(x.abs_upper())
    return found


def least(numbers: Sequence[arb]) -> arb:
    """Return a lower bound."""
    first, *rest = [x.lower() for x in numbers]
    for x in rest:
        first = first.min(x)
    return first
