"""Hypotheses of the theorem behind a proof, each decided on an enclosure."""

from typing import TYPE_CHECKING

from polycorner.intervals.balls import dot, matrix
from polycorner.intervals.enclosures import Undecided
from polycorner.proofs.definite import pivots, positive_on_cone, tangent_form
from polycorner.proofs.invariance import annihilated, slope_bounds
from polycorner.proofs.krawczyk import Enclosure
from polycorner.proofs.membership import inside, sign
from polycorner.proofs.statements import (
    Claim,
    ConditionResult,
    Solved,
    failed,
    proved,
    shown,
    undecided,
)

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

UNIQUE = "unique solution"
INDEPENDENT = "independent gradients"
SYMMETRIC = "exact symmetry"
POSITIVE = "multipliers positive"
INACTIVE = "inactive gaps positive"
CURVED = "reduced Hessian positive definite"


def without_enclosure(reason: Undecided, *, symmetric: bool = False) -> dict[str, ConditionResult]:
    """Return the results if there is no enclosure: nothing is decided."""
    others = [INDEPENDENT, *([SYMMETRIC] if symmetric else []), POSITIVE, INACTIVE, CURVED]
    nothing = undecided("there is no enclosure of a solution to check it on")
    return {
        UNIQUE: undecided(str(reason)),
        **dict.fromkeys(others, nothing),
    }


def check_hypotheses(claim: Claim, enclosure: Enclosure) -> dict[str, ConditionResult]:
    """Decide every condition on an enclosure."""
    found = {
        UNIQUE: proved(f"Krawczyk's operator maps a box of {claim.system.size} unknowns inside"),
        INDEPENDENT: proved(
            f"{', '.join(claim.stated)}: rows of a regular KKT matrix"
            if claim.stated
            else "no function is active",
        ),
    }
    if claim.fields:
        found[SYMMETRIC] = _symmetric(claim, enclosure)
    solved = Solved(claim, enclosure)
    return found | {
        POSITIVE: _positive(solved),
        INACTIVE: inside(solved),
        CURVED: _curved(solved),
    }


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
                return failed(f"{name} changes along {field}")
            return undecided(
                f"exact algebra does not show that {name} is constant along {field}",
            )
    sections = []
    for gauge in claim.system.gauges:
        fields = [field.at(box.hull) for field in claim.fields]
        sections.append([dot(gauge, f) if not isinstance(f, Undecided) else f for f in fields])
    listed = "; ".join(map(str, claim.fields))
    if _regular(sections):
        reason = f"energy and active functions are constant along {listed}, across the section"
        return proved(reason)
    return undecided(f"{listed} may be tangent to the section chosen across it")


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
            return failed(f"the multiplier of {name} lies in {shown(value)}")
    for k, (name, value) in enumerate(pairs):
        if not value > 0 and k not in solved.weak:
            reason = f"{name} is weakly active, or the box too wide: its multiplier lies in "
            return undecided(reason + shown(value))
    if not pairs:
        return proved("no inequality is active")
    weak = ", ".join(pairs[k][0] for k in solved.weak)
    parts = [f"exactly 0 for {weak}"] if weak else []
    strong = [pair for k, pair in enumerate(pairs) if k not in solved.weak]
    if strong:
        name, value = min(strong, key=lambda pair: float(pair[1].lower()))
        parts.append(f"the smallest is that of {name}, in {shown(value)}")
    return proved("; ".join(parts))


# ------------------------------------------------------------------------------------ second order


def _curved(solved: Solved) -> ConditionResult:
    linear, scales = solved.enclosure.start, solved.claim.system.scales
    form = tangent_form(linear.curvature, linear.rows, scales)
    if form is None:
        return undecided("the tangent space of the face could not be enclosed")
    found = pivots(form)
    positive = len(found) == len(form) and all(pivot > 0 for pivot in found)
    if solved.weak or not positive:
        outside = [] if positive else _outside(solved)
        if solved.weak or outside:
            return _curved_on_cone(solved, outside)
    if not form:
        return proved("the face is a point: no tangent direction is left")
    if positive:
        least = min(found, key=lambda pivot: float(pivot.lower()))
        return proved(f"the smallest of {len(form)} pivots lies in {shown(least)}")
    if found[-1] < 0:
        return failed(f"a pivot lies in {shown(found[-1])}, in scaled coordinates")
    reason = "flat in a direction that is no declared symmetry, or the box is too wide: "
    return undecided(f"{reason}a pivot lies in {shown(found[-1])}")


def _outside(solved: Solved) -> list[int]:
    """Return the inequalities outside the face that are exactly 0 at the solution.

    None in a union, where a branch may not ask for them; modulo a symmetry, along which they may
    change; nor over a cell of parameters.
    """
    claim, box = solved.claim, solved.enclosure.neighbourhood()
    rows = [i for i in claim.others if i < claim.problem.inequalities]
    united = claim.problem.polyhedron.is_union
    if united or claim.fields or solved.enclosure.predictor.cell.reach:
        return []
    values = claim.system.formulas.values(box, rows)
    return [i for i, value in zip(rows, values, strict=True) if sign(solved, i, value) == 0]


def _curved_on_cone(solved: Solved, outside: list[int]) -> ConditionResult:
    """Decide positivity on the critical cone, along which weakly active functions do not decrease.

    These are the functions held whose multipliers are 0, and those ``outside`` the face.
    """
    claim, linear = solved.claim, solved.enclosure.linear
    scales, box = claim.system.scales, solved.enclosure.neighbourhood()
    slopes = [linear.rows[k] for k in solved.weak]
    if outside:
        forms = claim.system.formulas.smooth(box, outside)
        if isinstance(forms, Undecided):
            return undecided(str(forms))
        slopes += [row[: len(scales)] for row in forms.evaluate(box, 1)[1]]
    strong = [row for k, row in enumerate(linear.rows) if k not in solved.weak]
    weak = claim.named([claim.active[k] for k in solved.weak] + outside)
    if positive_on_cone(linear.curvature, strong, slopes, scales):
        return proved(f"positive in all directions in which {', '.join(weak)} do not decrease")
    return undecided(f"not shown to be positive where {', '.join(weak)} do not decrease")
