"""Hypotheses of the theorem behind a proof, each decided on an enclosure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

from polycorner.intervals.balls import bounds, decimals, dot, matrix
from polycorner.intervals.enclosures import Undecided
from polycorner.minimisation import Problem
from polycorner.proofs.definite import pivots, tangent_form
from polycorner.proofs.exact import ExactPoint, implied, recognised
from polycorner.proofs.invariance import Generator, annihilated, slope_bounds
from polycorner.proofs.kkt import System
from polycorner.proofs.krawczyk import Enclosure

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

UNIQUE = "unique solution"
INDEPENDENT = "independent gradients"
SYMMETRIC = "exact symmetry"
POSITIVE = "multipliers positive"
INACTIVE = "inactive gaps positive"
CURVED = "reduced Hessian positive definite"

MOST_UNKNOWN = 4  # functions of unknown sign up to which all their signs are tried in a tree
MOST_HALVINGS = 8  # of a cell, to decide the signs of inactive functions


class Status(StrEnum):
    """Status of a condition in a proof.

    It is proved, or failed (proved to be violated), at the point or for all parameters of a cell;
    or undecided.  Over a box of parameters a condition that is violated on some cells, not on all,
    failed in part.
    """

    PROVED = "proved"
    FAILED = "failed"
    PARTLY = "failed in part"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class ConditionResult:
    """Status of a condition, and the reason."""

    status: Status
    reason: str


def _proved(reason: str) -> ConditionResult:
    return ConditionResult(Status.PROVED, reason)


def _failed(reason: str) -> ConditionResult:
    return ConditionResult(Status.FAILED, reason)


def _undecided(reason: str) -> ConditionResult:
    return ConditionResult(Status.UNDECIDED, reason)


@dataclass(frozen=True, eq=False)
class Claim:
    """The claim that a face carries a minimum: its KKT system, modulo symmetries.

    Attributes
    ----------
    problem : Problem
        The polyhedron and the energy.
    system : System
        The KKT equations of the face.
    fields : tuple of Generator
        One for every gauge of the system.
    """

    problem: Problem
    system: System
    fields: tuple[Generator, ...]

    @property
    def active(self) -> tuple[int, ...]:
        """Rows of the active inequalities."""
        return tuple(i for i in self.system.held if i < self.problem.inequalities)

    @property
    def others(self) -> tuple[int, ...]:
        """Rows of the inequalities and equations that the system does not hold."""
        return tuple(i for i in range(self.problem.rows - 1) if i not in self.system.held)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the active inequalities, then of the equations."""
        return self.named(self.system.held)

    def named(self, rows: Sequence[int]) -> tuple[str, ...]:
        """Return the names of some rows."""
        d = self.problem.polyhedron
        names = (*d.names, *d.equation_names)
        return tuple(names[i] for i in rows)

    def implied(self, row: int) -> bool:
        """Whether a function vanishes wherever those of the system do."""
        if row not in self._implied:
            self._implied[row] = implied(self.system.formulas, self.system.held, row)
        return self._implied[row]

    @cached_property
    def _implied(self) -> dict[int, bool]:
        return {}


@dataclass(frozen=True, eq=False)
class Solved:
    """A claim and the enclosure of its solution, with the zeros that algebra shows there."""

    claim: Claim
    enclosure: Enclosure

    @cached_property
    def exactly(self) -> ExactPoint | None:
        """The solution, where it is recognised."""
        return recognised(self.enclosure)

    def vanishes(self, row: int) -> bool:
        """Whether a function that is defined at the solution is shown to be 0 there."""
        formulas = self.claim.system.formulas
        known = self.exactly is not None and self.exactly.vanishes(formulas, row)
        return known or self.claim.implied(row)


def without_enclosure(
    undecided: Undecided, *, symmetric: bool = False
) -> dict[str, ConditionResult]:
    """Return the results if there is no enclosure: nothing is decided."""
    others = [INDEPENDENT, *([SYMMETRIC] if symmetric else []), POSITIVE, INACTIVE, CURVED]
    nothing = _undecided("there is no enclosure of a solution to check it on")
    return {
        UNIQUE: _undecided(str(undecided)),
        **dict.fromkeys(others, nothing),
    }


def check_hypotheses(claim: Claim, enclosure: Enclosure) -> dict[str, ConditionResult]:
    """Decide every condition on an enclosure."""
    found = {
        UNIQUE: _proved(f"Krawczyk's operator maps a box of {claim.system.size} unknowns inside"),
        INDEPENDENT: _proved(
            f"{', '.join(claim.names)}: rows of a regular KKT matrix"
            if claim.names
            else "no function is active",
        ),
    }
    if claim.fields:
        found[SYMMETRIC] = _symmetric(claim, enclosure)
    solved = Solved(claim, enclosure)
    return found | {
        POSITIVE: _positive(solved),
        INACTIVE: _inactive(solved),
        CURVED: _curved(claim, enclosure),
    }


def shown(number: "Ball", digits: int = 3) -> str:
    """Return a ball as a short interval of decimals."""
    if not number.is_finite():
        return "(-inf, inf)"
    lower, upper = decimals(*bounds(number), digits)
    return f"[{lower}, {upper}]"


# ---------------------------------------------------------------------------------------- symmetry


def _symmetric(claim: Claim, enclosure: Enclosure) -> ConditionResult:
    linear, box = enclosure.linear, enclosure.neighbourhood()
    names = (*claim.names, "the energy")
    for field in claim.fields:
        constant = annihilated(linear.forms, field)
        if not all(constant):
            name = names[constant.index(False)]
            slopes = slope_bounds(linear.forms, field, box)
            if any(slope != 0 for slope in slopes):
                return _failed(f"{name} changes along {field}")
            return _undecided(
                f"exact algebra does not show that {name} is constant along {field}",
            )
    sections = []
    for gauge in claim.system.gauges:
        fields = [field.at(box.hull) for field in claim.fields]
        sections.append([dot(gauge, f) if not isinstance(f, Undecided) else f for f in fields])
    listed = "; ".join(map(str, claim.fields))
    if _regular(sections):
        reason = f"energy and active functions are constant along {listed}, across the section"
        return _proved(reason)
    return _undecided(f"{listed} may be tangent to the section chosen across it")


def _regular(rows: "list[list[Ball | Undecided]]") -> bool:
    if any(isinstance(x, Undecided) for row in rows for x in row):
        return False
    try:
        matrix(rows).inv()
    except ZeroDivisionError:
        return False
    return True


# ------------------------------------------------------------------------------------- first order


def _positive(solved: Solved) -> ConditionResult:
    claim, n = solved.claim, solved.claim.system.dimension
    values = solved.enclosure.solution[n:]
    pairs = list(zip(claim.names, values, strict=False))[: len(claim.active)]
    for name, value in pairs:
        if value < 0:
            return _failed(f"the multiplier of {name} lies in {shown(value)}")
    for k, (name, value) in enumerate(pairs):
        if not value > 0:
            if solved.exactly and not solved.exactly.unknowns[n + k]:
                return _undecided(f"{name} is weakly active: its multiplier is exactly 0")
            reason = f"{name} is weakly active, or the box too wide: its multiplier lies in "
            return _undecided(reason + shown(value))
    if not pairs:
        return _proved("no inequality is active")
    name, value = min(pairs, key=lambda pair: float(pair[1].lower()))
    return _proved(f"the smallest is that of {name}, in {shown(value)}")


def _inactive(solved: Solved) -> ConditionResult:
    claim, enclosure = solved.claim, solved.enclosure
    if not claim.others:
        return _membership(solved, [])
    waiting = [(tuple(enclosure.predictor.cell.reach), 0)]
    found: dict[Status, ConditionResult] = {}
    while waiting:
        reach, depth = waiting.pop()
        values = claim.system.formulas.values(enclosure.neighbourhood(reach), claim.others)
        result = _membership(solved, values)
        if result.status is Status.UNDECIDED and reach and depth < MOST_HALVINGS:
            waiting += [(half, depth + 1) for half in _halves(reach)]
            continue
        found[result.status] = result
        if result.status is Status.UNDECIDED:
            return result
        if len(found) > 1:
            return _undecided(f"true on a part of the cell only: {found[Status.FAILED].reason}")
    return next(iter(found.values()))


def _halves(reach: "tuple[Ball, ...]") -> "Iterator[tuple[Ball, ...]]":
    """Return the two halves of a box, divided across its widest side."""
    widest = max(range(len(reach)), key=lambda a: float(reach[a].rad()))
    side = reach[widest]
    for end in (side.lower(), side.upper()):
        yield (*reach[:widest], side.mid().union(end), *reach[widest + 1 :])


def _membership(solved: Solved, values: "Sequence[Ball]") -> ConditionResult:
    """Decide whether the point is in the set, and the set in that of the functions held.

    A sign of None is open; a function shown to be exactly 0 may be of any sign nearby.
    """
    claim = solved.claim
    d = claim.problem.polyhedron
    listed = dict(zip(claim.others, values, strict=True))
    signs = {i: _sign(solved, i, value) for i, value in listed.items()}
    agrees = _face_holds(claim, signs)
    if agrees is None:
        row = next((i for i, sign in signs.items() if sign is None), None)
        if row is None:
            zeros = claim.named([i for i, sign in signs.items() if sign == 0])
            return _undecided(f"the tree has branches of {', '.join(zeros)}, which are 0 there")
        reason = (
            f"{claim.named([row])[0]} may vanish there without being needed (redundant, or weakly "
            f"active), or the box is too wide: it lies in {shown(listed[row])}"
        )
        return _undecided(reason)
    if not agrees:
        below = {i: v for i, v in listed.items() if v < 0 or (d.is_union and signs[i])}
        below = below or {i: v for i, v in listed.items() if signs[i]}
        row, value = min(below.items(), key=lambda item: abs(float(item[1].mid())))
        reason = f"{claim.named([row])[0]} lies in {shown(value)}"
        if d.is_union:
            held = ", ".join(d.names[i] for i in claim.active) or "nothing"
            reason = f"the tree requires more, or less, than {held} alone there: {reason}"
        return _failed(reason)
    return _proved(_why_inside(claim, listed, signs))


def _sign(solved: Solved, row: int, value: "Ball") -> int | None:
    if value > 0 or value < 0:
        return 1 if value > 0 else -1
    return 0 if value.is_finite() and solved.vanishes(row) else None


def _why_inside(claim: Claim, listed: "dict[int, Ball]", signs: dict[int, int | None]) -> str:
    if not listed:
        return "every inequality is active"
    parts = []
    zeros = claim.named([i for i, sign in signs.items() if sign == 0])
    if zeros:
        parts.append(f"{', '.join(zeros)}: exactly 0 there, and not needed for a minimum")
    away = [i for i, sign in signs.items() if sign]
    if away:
        nearest = min(away, key=lambda i: abs(float(listed[i].mid())))
        parts.append(
            f"the nearest to 0 is {claim.named([nearest])[0]}, in {shown(listed[nearest])}"
        )
    return "; ".join(parts)


def _face_holds(claim: Claim, signs: dict[int, int | None]) -> bool | None:
    """Whether every branch of the tree near the point asks for all active functions, and one is."""
    d, m = claim.problem.polyhedron, claim.problem.inequalities
    dropped = [sign for i, sign in signs.items() if i >= m]
    if any(dropped):
        return False  # an equation that does not hold
    all_signs = [signs.get(i, 0) for i in range(m)]
    unknown = [i for i, sign in enumerate(all_signs) if sign is None]
    if not d.is_union:
        if -1 in all_signs:
            return False
        return None if unknown or None in dropped else True
    if len(unknown) > MOST_UNKNOWN or None in dropped:
        return None
    answers = set()
    for guess in product((-1, 0, 1), repeat=len(unknown)):
        tried = [0 if sign is None else sign for sign in all_signs]
        for i, sign in zip(unknown, guess, strict=True):
            tried[i] = sign
        answers.add(_pieces_hold(d.signs_to_pieces(tried), frozenset(claim.active)))
    return answers.pop() if len(answers) == 1 else None


def _pieces_hold(pieces: Sequence[frozenset[int]], active: frozenset[int]) -> bool | None:
    """Whether every piece asks for all active functions; None where others may imply them."""
    if all(piece >= active for piece in pieces):
        return bool(pieces)
    return False if any(piece < active for piece in pieces) else None


# ------------------------------------------------------------------------------------ second order


def _curved(claim: Claim, enclosure: Enclosure) -> ConditionResult:
    linear = enclosure.start
    form = tangent_form(linear.curvature, linear.rows, claim.system.scales)
    if form is None:
        return _undecided("the tangent space of the face could not be enclosed")
    if not form:
        return _proved("the face is a point: no tangent direction is left")
    found = pivots(form)
    last = found[-1]
    if last < 0:
        return _failed(f"a pivot lies in {shown(last)}, in scaled coordinates")
    if len(found) < len(form) or not last > 0:
        reason = "flat in a direction that is no declared symmetry, or the box is too wide: "
        return _undecided(f"{reason}a pivot lies in {shown(last)}")
    least = min(found, key=lambda pivot: float(pivot.lower()))
    return _proved(f"the smallest of {len(form)} pivots lies in {shown(least)}")
