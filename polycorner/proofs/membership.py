"""Whether points lie in a set, exactly; and sets that are empty near a point, with proof.

Let ``D`` be a tree of inequalities ``f_i >= 0`` with equations ``h_j = 0``.

*A rational point.*  Every sign is decided by ball arithmetic, at rising precision, or, where the
number may be zero, by exact algebra (:mod:`~polycorner.proofs.symbols`).  No tolerance is involved.

*An enclosed point.*  Equations may have no rational zeros near the point.  Krawczyk's test encloses
a common zero of independent functions in as many coordinates, the others are rational; functions in
their ideal vanish there as well, and the rest are positive on the enclosure.

*No point in a box.*  A piece of ``D`` in a box ``B`` about ``c`` is empty if one of its functions
is negative on ``B``, or if weights ``y``, nonnegative on inequalities, give

``sum_i y_i f_i(c) + sum_a |(sum_i y_i g_i)_a| r_a < 0``,

where ``g_i`` encloses the gradient on ``B`` and ``r`` are the half sides: by the mean value theorem
``sum y_i f_i < 0`` on ``B``, but it is nonnegative on ``D``.  The same follows from gradients at
``c`` with ``sum_ab |(sum_i y_i H_i)_ab| r_a r_b / 2`` added, where ``H_i`` encloses second
derivatives on ``B``: Taylor's theorem for the sum, in which they may cancel.  Boxes are divided
where this is not shown, and ``D`` has no point in ``B`` if every piece is empty in every part.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, nan
from typing import Any

from polycorner.intervals.balls import Ball, ball, between, bounds, decimals, dot, exact, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box, Tape
from polycorner.minimisation import Problem
from polycorner.printing import Printed, Sheet, facts, listed
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.exact import implied
from polycorner.proofs.growth import Examination
from polycorner.proofs.rattlers import reads
from polycorner.proofs.symbols import Symbols, evaluate
from polycorner.proofs.witnesses import Point, UnshownError, Witness
from polycorner.values import Checked, Value, cached_property

MOST_DOUBLINGS = 3  # of the precision, while a sign is open
SHOWN_DIGITS = 6  # of values in tables
Bounds = tuple[Fraction, Fraction]


@dataclass(frozen=True, eq=False)
class Violation(Checked):
    """A function that a point violates, and by how much.

    Attributes
    ----------
    name : str
        The inequality, which is negative, or the equation, which is not zero.
    value : (str, str)
        Bounds of its value, in decimals rounded outwards.
    distance : (str, str) or None
        Bounds of its value over the length of its gradient, in scale units: to first order the
        distance to where it vanishes, with the sign of the value.  None where the gradient is not
        shown to be different from zero.
    """

    name: str
    value: tuple[str, str]
    distance: tuple[str, str] | None


@dataclass(frozen=True, eq=False)
class Membership(Checked, Printed):
    """Whether a given point lies in a set, and a point of the set near it, both proved.

    Attributes
    ----------
    names : tuple of str
        The coordinates.
    given : tuple of Fraction
        The given point, exactly; a floating-point number is the dyadic fraction it represents.
    inside : bool or None
        Whether it lies in the set; None where that is not decided.
    violations : tuple of Violation
        The functions that it violates; in a union, those of the branch that fails least.
        The farthest first.
    region : tuple of (Fraction, Fraction)
        Bounds of the coordinates of a point of the set; equal where a coordinate is exactly
        rational.  Empty without such a point.
    moved : Fraction or None
        Upper bound of the largest change of a coordinate, in scale units.
    energy, energy_given : (str, str) or None
        Bounds of the energy at the point of the set, and at the given point, in decimals rounded
        outwards; None without an energy, or where it is not bounded.
    empty : tuple of str
        Functions that no point within the distance satisfies together, where that is proved.
    within : Fraction
        The distance, in scale units, in each coordinate.
    reason : str
        What is not decided, in a sentence; empty if nothing is open.
    """

    names: tuple[str, ...]
    given: Point
    inside: bool | None
    violations: tuple[Violation, ...]
    region: tuple[Bounds, ...]
    moved: Fraction | None
    energy: tuple[str, str] | None
    energy_given: tuple[str, str] | None
    empty: tuple[str, ...]
    within: Fraction
    reason: str

    @property
    def point(self) -> Point | None:
        """The point of the set, if all its coordinates are exactly rational."""
        return None if self.enclosed or not self.region else tuple([low for low, _ in self.region])

    @property
    def enclosed(self) -> tuple[str, ...]:
        """The coordinates of the point that are enclosed only: equations determine them."""
        sides = zip(self.names, self.region, strict=bool(self.region))
        return tuple([name for name, (low, high) in sides if low < high])

    def __repr__(self) -> str:
        """Return whether the given point is inside, and what was found near it."""
        where = {True: "inside", False: "outside", None: "undecided"}[self.inside]
        if self.empty:
            return f"Membership({where}; the set is empty nearby)"
        found = "no point found" if self.moved is None else f"moved by {_short(self.moved)}"
        return f"Membership({where}; {found})"

    def _sheet(self) -> Sheet:
        """Return the verdict, the violated functions, and the energies."""
        verdict = {True: "in the set", False: "not in the set", None: "undecided"}[self.inside]
        rows: list[tuple[str, str]] = [("given point", verdict)]
        if self.energy_given:
            rows.append(("its energy", _interval(self.energy_given)))
        if self.region:
            kind = "enclosed" if self.enclosed else "rational"
            rows.append(("point of the set", f"{kind}, moved by {_short(self.moved)} scale units"))
            if self.energy:
                rows.append(("its energy", _interval(self.energy)))
        if self.empty:
            away = f"within {_short(self.within)} scale units"
            some = ", ".join(self.empty)
            rows.append(("point of the set", f"none {away}: {some} do not hold together there"))
        if self.reason:
            rows.append(("open", self.reason))
        table = [
            (v.name, _middle(v.value), _middle(v.distance) if v.distance else "unknown")
            for v in self.violations
        ]
        head = ("function", "value", "distance")
        shown = listed("violated at the given point", head, table, len(table), (1, 2))
        return Sheet("Membership", (facts(rows), shown))


def _short(x: Fraction | None) -> str:
    return decimals(x or Fraction(0), x or Fraction(0), 3)[1]


def _interval(sides: tuple[str, str]) -> str:
    return sides[0] if sides[0] == sides[1] else f"between {sides[0]} and {sides[1]}"


def _middle(sides: tuple[str, str]) -> str:
    middle = (Fraction(sides[0]) + Fraction(sides[1])) / 2
    return decimals(middle, middle, SHOWN_DIGITS)[0]


class Signs:
    """A polyhedron and an energy about a point: signs, enclosures and refutations.

    ``bits`` is the working precision.
    """

    def __init__(self, problem: Problem, bits: int) -> None:
        self.problem, self.bits = problem, bits
        polyhedron = problem.polyhedron
        self.polyhedron = polyhedron
        self.formulas = Formulas(problem.functions, polyhedron.manifold)
        self.inequalities = range(problem.inequalities)
        self.equations = range(problem.inequalities, problem.rows - 1)
        self.rows = range(problem.rows - 1)

    @cached_property
    def scales(self) -> tuple[Fraction, ...]:
        """The scales, exactly."""
        return tuple([Fraction(s) for s in self.problem.scales.tolist()])

    def signs(self, q: Point, rows: Sequence[int] | None = None) -> dict[int, int]:
        """Return signs of functions at a rational point; without those that are not decided."""
        found: dict[int, int] = {}
        left = list(self.rows if rows is None else rows)
        bits = self.bits
        for doubling in range(MOST_DOUBLINGS + 1):
            with precision(bits):
                values = self.formulas.values(Box([ball(x) for x in q]), left)
                open_rows = []
                for row, value in zip(left, values, strict=True):
                    if value > 0 or value < 0:
                        found[row] = 1 if value > 0 else -1
                    elif doubling or not value.is_finite():
                        open_rows.append(row)
                    else:
                        number = self._number(row, q)
                        if number is None:
                            open_rows.append(row)
                        else:
                            found[row] = (number > 0) - (number < 0)
            left, bits = open_rows, 2 * bits
            if not left:
                break
        return found

    def _number(self, row: int, q: Point) -> Fraction | None:
        """Return a value, which is known to be defined, where exact algebra makes it rational."""
        inputs = [algebra.number(x) for x in q]
        output = self.formulas.outputs[row]
        (value,) = evaluate(self.formulas.graph, [output], inputs, Symbols())
        return None if value is None else algebra.constant(value)

    def holds(self, signs: Mapping[int, int]) -> bool | None:
        """Whether a point lies in the set, from signs of its functions; None if that is open."""
        if any(signs.get(row, 0) for row in self.equations):
            return False
        least, most = (
            self.polyhedron.signs_to_pieces([signs.get(i, other) for i in self.inequalities])
            for other in (-1, 1)
        )
        if not most:
            return False
        return True if least and all(row in signs for row in self.equations) else None

    def value(self, region: Sequence[Bounds], row: int, digits: int) -> tuple[str, str] | None:
        """Return decimal bounds of a function at an enclosed point; None where it is unbounded."""
        q = tuple([low for low, _ in region])
        with precision(self.bits):
            (value,) = self.formulas.values(Box([between(*side) for side in region]), [row])
            if not value.is_finite():
                return None
            rational = all(low == high for low, high in region)
            number = self._number(row, q) if rational else None
            return decimals(*(bounds(value) if number is None else (number, number)), digits)

    def violations(self, q: Point, rows: Sequence[int], digits: int) -> tuple[Violation, ...]:
        """Return by how much functions miss at a rational point, the farthest first."""
        found: list[tuple[float, Violation]] = []
        with precision(self.bits << MOST_DOUBLINGS):  # as where signs are decided
            box = Box([ball(x) for x in q])
            for row, value in zip(rows, self.formulas.values(box, rows), strict=True):
                number = self._number(row, q) if value.is_finite() else None
                sides = bounds(value) if number is None else (number, number)
                away = value / self._slope(box, row)
                distance = decimals(*bounds(away), digits) if away.is_finite() else None
                shown = Violation(self.formulas.names[row], decimals(*sides, digits), distance)
                found.append((float(abs(away).mid()) if distance else inf, shown))
        return tuple([shown for _, shown in sorted(found, key=lambda pair: -pair[0])])

    def _slope(self, box: Box, row: int) -> "Ball":
        """Return the length of a gradient in scale units; NaN where it is not known."""
        forms = self.formulas.smooth(box, (row,))
        if isinstance(forms, Undecided):
            return ball(nan)
        read = sorted(reads(self.formulas, row))
        (f,) = forms.outputs
        tape = Tape(forms.graph, [forms.graph.derivative(f, j) for j in read])
        found = tape.run(box)
        scaled = [found[k] * ball(self.scales[j]) for k, j in zip(tape.outputs, read, strict=True)]
        return dot(scaled, scaled).sqrt()

    # -------------------------------------------------------------------------- enclosed points

    def enclosed(self, q: Point, held: Sequence[int]) -> tuple[Bounds, ...]:
        """Return bounds of a point of the set at which some functions vanish, or nothing.

        Coordinates that they read and that Krawczyk's test does not determine are those of ``q``,
        rounded to the working precision; the others are those of ``q``.
        """
        read = frozenset[int]().union(*(reads(self.formulas, row) for row in held))
        with precision(self.bits):
            start = [exact(ball(x).mid()) if j in read else x for j, x in enumerate(q)]
            witness = Witness(1, q, tuple(start), (), tuple(held), (), Fraction(0), {}, ())
            try:
                box = Examination(self.problem, self.formulas, witness).inner_box()
            except UnshownError:
                return ()
            values = self.formulas.values(box, self.rows)
            signs = dict.fromkeys(held, 0)
            left = [row for row in self.rows if row not in signs]
            for row in list(left):
                if values[row] > 0 or values[row] < 0:
                    signs[row] = 1 if values[row] > 0 else -1
                    left.remove(row)
            # Algebra may take long, and is of use only where no function fails.
            if self.holds(signs) is None:
                some = (i for i in left if values[i].is_finite())
                signs |= {i: 0 for i in some if implied(self.formulas, held, i)}
            if not self.holds(signs):
                return ()
            sides = zip(start, box.hull, strict=True)
            return tuple([bounds(y) if j in read else (x, x) for j, (x, y) in enumerate(sides)])

    # ------------------------------------------------------------------------------- empty boxes

    def part(self, sides: Sequence[Bounds]) -> "BoxPart":
        """Return what enclosures say of a box; the working precision is set by the caller."""
        centre = [ball((low + high) / 2) for low, high in sides]
        halves = [ball((high - low) / 2) for low, high in sides]
        hull = [c + ball(0, 1) * r for c, r in zip(centre, halves, strict=True)]
        values = self.formulas.values(Box(hull), self.rows)
        return BoxPart(self, centre, halves, Box(hull), values)


@dataclass(frozen=True, eq=False)
class BoxPart(Value):
    """A box, and the values of all functions on it."""

    place: Signs
    centre: "list[Ball]"
    halves: "list[Ball]"
    box: Box
    values: "list[Ball]"

    @cached_property
    def pieces(self) -> list[list[int]]:
        """The set in the box as a union: rows that have to hold, positive ones left out."""
        m = len(self.place.inequalities)
        signs = [1 if value > 0 else 0 for value in self.values[:m]]
        pieces = self.place.polyhedron.signs_to_pieces(signs)
        return [[*sorted(piece), *self.place.equations] for piece in pieces]

    def violated(self, rows: Sequence[int]) -> int | None:
        """Return a function that no point of the box satisfies, or None."""
        m = len(self.place.inequalities)
        return next(
            (i for i in rows if self.values[i] < 0 or (i >= m and self.values[i] > 0)), None
        )

    def smooth(self, rows: Sequence[int]) -> tuple[list[int], SmoothForms]:
        """Return the rows that are smooth on the box, and their functions."""
        formulas = self.place.formulas
        kept, forms = list(rows), formulas.smooth(self.box, rows)
        if isinstance(forms, Undecided):
            kept = [i for i in rows if not isinstance(formulas.smooth(self.box, [i]), Undecided)]
            forms = formulas.smooth(self.box, kept)
        assert not isinstance(forms, Undecided)
        return kept, forms

    def refutes(self, rows: Sequence[int], forms: SmoothForms, weights: Sequence[Fraction]) -> bool:
        """Whether weights of smooth functions show that they do not hold together in the box."""
        if any(y < 0 and i in self.place.inequalities for i, y in zip(rows, weights, strict=True)):
            return False
        y = [ball(w) for w in weights]
        values, slopes = forms.evaluate(Box(self.centre), 1)
        _, gradients = forms.evaluate(self.box, 1)
        most = dot(y, values)
        first = [abs(dot(y, column)) for column in zip(*gradients, strict=True)]
        if most + dot(first, self.halves) < 0:
            return True
        level = [abs(dot(y, column)) for column in zip(*slopes, strict=True)]
        return bool(most + dot(level, self.halves) + self._bend(rows, forms, y) < 0)

    def _bend(self, rows: Sequence[int], forms: SmoothForms, y: "Sequence[Ball]") -> "Ball":
        """Return a bound of the second-order remainder of a weighted sum."""
        d, graph, terms = forms.graph.derivative, self.place.formulas, list[Any]()
        for row, f, weight in zip(rows, forms.outputs, y, strict=True):
            read = sorted(reads(graph, row)) if not weight.is_zero() else []
            terms += [(d(d(f, i), j), weight, (i, j)) for i in read for j in read if i <= j]
        tape = Tape(forms.graph, [node for node, *_ in terms])
        found = tape.run(self.box)
        total: dict[tuple[int, int], Ball] = {}
        for slot, (_, weight, pair) in zip(tape.outputs, terms, strict=True):
            total[pair] = total.get(pair, ball(0)) + weight * found[slot]
        sizes = (
            abs(h) * self.halves[i] * self.halves[j] / (2 if i == j else 1)
            for (i, j), h in total.items()
        )
        return sum(sizes, ball(0))
