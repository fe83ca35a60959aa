"""Hypotheses of the theorem behind a proof, each decided on an enclosure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from typing import TYPE_CHECKING

from polycorner.intervals.balls import bounds, decimals, dot, matrix
from polycorner.intervals.enclosures import Undecided
from polycorner.minimisation import Problem
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.proofs.definite import pivots, tangent_form
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
    active : tuple of int
        Rows of the active inequalities.
    fields : tuple of Generator
        One for every gauge of the system.
    """

    problem: Problem
    system: System
    active: tuple[int, ...]
    fields: tuple[Generator, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the active inequalities, then of the equations."""
        d = self.problem.polyhedron
        return (*(d.names[i] for i in self.active), *d.equation_names)


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
    return found | {
        POSITIVE: _positive(claim, enclosure),
        INACTIVE: _inactive(claim, enclosure),
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


def _positive(claim: Claim, enclosure: Enclosure) -> ConditionResult:
    n = claim.system.dimension
    pairs = list(zip(claim.names, enclosure.solution[n:], strict=False))[: len(claim.active)]
    for name, value in pairs:
        if value < 0:
            return _failed(f"the multiplier of {name} lies in {shown(value)}")
    for name, value in pairs:
        if not value > 0:
            reason = f"{name} is weakly active, or the box too wide: its multiplier lies in "
            return _undecided(reason + shown(value))
    if not pairs:
        return _proved("no inequality is active")
    name, value = min(pairs, key=lambda pair: float(pair[1].lower()))
    return _proved(f"the smallest is that of {name}, in {shown(value)}")


def _inactive(claim: Claim, enclosure: Enclosure) -> ConditionResult:
    d = claim.problem.polyhedron
    others = [i for i in range(len(d.functions)) if i not in claim.active]
    if not others:
        return _membership(d, claim.active, [], [])
    waiting = [(tuple(enclosure.predictor.cell.reach), 0)]
    found: dict[Status, ConditionResult] = {}
    while waiting:
        reach, depth = waiting.pop()
        values = claim.system.formulas.values(enclosure.neighbourhood(reach), others)
        result = _membership(d, claim.active, others, values)
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


def _membership(
    d: Polyhedron, active: tuple[int, ...], others: "Sequence[int]", values: "Sequence[Ball]"
) -> ConditionResult:
    """Decide whether the active functions alone describe the set near the solution."""
    signs: list[int | None] = [0] * len(d.functions)
    for i, value in zip(others, values, strict=True):
        signs[i] = 1 if value > 0 else -1 if value < 0 else None
    agrees = _face_alone(d, signs, active)
    listed = dict(zip((d.names[i] for i in others), values, strict=True))
    if agrees is None:
        unknown = [name for name, v in listed.items() if not (v > 0 or v < 0)]
        name = unknown[0]
        reason = (
            f"{name} may vanish there without being needed (redundant, or weakly active), or the "
            f"box is too wide: it lies in {shown(listed[name])}"
        )
        return _undecided(reason)
    if not agrees:
        below = {name: v for name, v in listed.items() if v < 0 or d.is_union}
        name, value = min(below.items(), key=lambda item: abs(float(item[1].mid())))
        reason = f"{name} lies in {shown(value)}"
        if d.is_union:
            held = ", ".join(d.names[i] for i in active) or "nothing"
            reason = f"the tree requires more, or less, than {held} alone there: {reason}"
        return _failed(reason)
    if not listed:
        return _proved("every inequality is active")
    name, least = min(listed.items(), key=lambda item: abs(float(item[1].mid())))
    return _proved(f"the nearest to 0 is {name}, in {shown(least)}")


def _face_alone(d: Polyhedron, signs: "list[int | None]", active: tuple[int, ...]) -> bool | None:
    unknown = [i for i, sign in enumerate(signs) if sign is None]
    if not d.is_union:
        if -1 in signs:
            return False
        return None if unknown else True
    if len(unknown) > MOST_UNKNOWN:
        return None
    answers = set()
    for guess in product((-1, 0, 1), repeat=len(unknown)):
        tried = [0 if sign is None else sign for sign in signs]
        for i, sign in zip(unknown, guess, strict=True):
            tried[i] = sign
        answers.add(d.signs_to_pieces(tried) == [frozenset(active)])
    return answers.pop() if len(answers) == 1 else None


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
