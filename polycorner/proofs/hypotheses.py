"""Hypotheses of the theorem behind a proof, each decided on the enclosed solution of a claim."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from typing import TypeVar

from polycorner.intervals.balls import Ball, bounds, decimals, dot
from polycorner.intervals.enclosures import Undecided
from polycorner.minimisation import Problem
from polycorner.proofs.definite import is_regular, pivots, positive_on_cone, tangent_form
from polycorner.proofs.exact import ExactPoint, implied, recognised
from polycorner.proofs.invariance import Generator, annihilated, slope_bounds
from polycorner.proofs.kkt import Enclosure, KKTSystem
from polycorner.values import cached_property

T = TypeVar("T")

MOST_UNKNOWN = 4  # functions of unknown sign up to which all their signs are tried in a tree
MOST_HALVINGS = 8  # of a cell, to decide the signs of inactive functions
UNIQUE = "unique solution"
INDEPENDENT = "independent gradients"
SYMMETRIC = "exact symmetry"
POSITIVE = "multipliers positive"
INACTIVE = "inactive gaps positive"
CURVED = "reduced Hessian positive definite"


class Status(StrEnum):
    """Status of a condition in a proof.

    It is proved, or failed (proved to be violated, so that the enclosed point is no minimum), at
    the point or for all parameters of a cell; or undecided.  Over a box of parameters a condition
    that is violated on some cells, not on all, failed in part.
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


def proved(reason: str) -> ConditionResult:
    """Return the result of a condition that holds."""
    return ConditionResult(Status.PROVED, reason)


def failed(reason: str) -> ConditionResult:
    """Return the result of a condition that is violated."""
    return ConditionResult(Status.FAILED, reason)


def undecided(reason: str) -> ConditionResult:
    """Return the result of a condition that is open."""
    return ConditionResult(Status.UNDECIDED, reason)


@dataclass(frozen=True, eq=False)
class Claim:
    """The claim that a face carries a minimum: its KKT system, modulo symmetries.

    There is a field for every gauge of the system.
    """

    problem: Problem
    system: KKTSystem
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

    @property
    def stated(self) -> tuple[str, ...]:
        """These names but those of equations that normalise vectors and quaternions."""
        return tuple(name for name in self.names if name not in self.problem.polyhedron.hidden)

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
    """A claim and the enclosure of its solution, with the zeros that algebra shows there.

    Nothing is asked of algebra for a claim that is refuted already.
    """

    claim: Claim
    enclosure: Enclosure
    refuted: bool = False

    @cached_property
    def exactly(self) -> ExactPoint | None:
        """The solution, where it is recognised."""
        return recognised(self.enclosure)

    @cached_property
    def weak(self) -> tuple[int, ...]:
        """Positions of the inequalities held whose multipliers are shown to be 0."""
        n, k = self.claim.system.dimension, len(self.claim.active)
        values = self.enclosure.solution[n : n + k]
        open_ones = [i for i, value in enumerate(values) if value.contains(0)]
        if not open_ones or self.exactly is None:
            return ()
        unknowns = self.exactly.unknowns[n:]
        return tuple(i for i in open_ones if not unknowns[i])

    def vanishes(self, row: int) -> bool:
        """Whether a function that is defined at the solution is shown to be 0 there."""
        if self.refuted:
            return False
        formulas = self.claim.system.formulas
        known = self.exactly is not None and self.exactly.vanishes(formulas, row)
        return known or self.claim.implied(row)


def shown(number: "Ball", digits: int = 3) -> str:
    """Return a ball as a short interval of decimals."""
    if not number.is_finite():
        return "(-inf, inf)"
    lower, upper = decimals(*bounds(number), digits)
    return f"[{lower}, {upper}]"


def inside(solved: Solved) -> ConditionResult:
    """Decide whether the functions that are not held are positive, or exactly zero and not needed.

    A cell of parameters is divided until they are on every part of it, or on none.
    """
    claim, enclosure = solved.claim, solved.enclosure
    if not claim.others:
        return _membership(solved, [])

    def decide(values: "Sequence[Ball]") -> tuple[ConditionResult, bool]:
        result = _membership(solved, values)
        return result, result.status is Status.UNDECIDED

    found: dict[Status, ConditionResult] = {}
    for result in _on_parts(claim, enclosure, decide):
        found[result.status] = result
        if result.status is Status.UNDECIDED:
            return result
        if len(found) > 1:
            return undecided(f"true on a part of the cell only: {found[Status.FAILED].reason}")
    return next(iter(found.values()))


def _on_parts(
    claim: Claim, enclosure: Enclosure, decide: "Callable[[Sequence[Ball]], tuple[T, bool]]"
) -> Iterator[T]:
    """Yield what values of the other functions say on parts of a cell, halved while it is open."""
    waiting = [(tuple(enclosure.predictor.cell.reach), 0)]
    while waiting:
        reach, depth = waiting.pop()
        values = claim.system.formulas.values(enclosure.neighbourhood(reach), claim.others)
        result, is_open = decide(values)
        if is_open and reach and depth < MOST_HALVINGS:
            waiting += [(half, depth + 1) for half in _halves(reach)]
        else:
            yield result


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
    signs = {i: sign(solved, i, value) for i, value in listed.items()}
    agrees = _face_holds(claim, signs)
    if agrees is None:
        row = next((i for i, sign in signs.items() if sign is None), None)
        if row is None:
            zeros = claim.named([i for i, sign in signs.items() if sign == 0])
            return undecided(f"the tree has branches of {', '.join(zeros)}, which are 0 there")
        reason = (
            f"{claim.named([row])[0]} may vanish there without being needed (redundant, or weakly "
            f"active), or the box is too wide: it lies in {shown(listed[row])}"
        )
        return undecided(reason)
    if not agrees:
        below = {i: v for i, v in listed.items() if v < 0 or (d.is_union and signs[i])}
        below = below or {i: v for i, v in listed.items() if signs[i]}
        row, value = min(below.items(), key=lambda item: abs(float(item[1].mid())))
        reason = f"{claim.named([row])[0]} lies in {shown(value)}"
        if d.is_union:
            held = ", ".join(d.names[i] for i in claim.active) or "nothing"
            reason = f"the tree requires more, or less, than {held} alone there: {reason}"
        return failed(reason)
    return proved(_why_inside(claim, listed, signs))


def sign(solved: Solved, row: int, value: "Ball") -> int | None:
    """Return the sign of a function from its enclosure, 0 where algebra shows it; or None."""
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
    positive = _positive(Solved(claim, enclosure))
    solved = Solved(claim, enclosure, positive.status is Status.FAILED)
    return found | {
        POSITIVE: positive,
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
    fields = [field.at(box.hull) for field in claim.fields]
    known = [f for f in fields if not isinstance(f, Undecided)]
    sections = [[dot(gauge, f) for f in known] for gauge in claim.system.gauges]
    listed = "; ".join(map(str, claim.fields))
    if len(known) == len(fields) and is_regular(sections):
        reason = f"energy and active functions are constant along {listed}, across the section"
        return proved(reason)
    return undecided(f"{listed} may be tangent to the section chosen across it")


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


def closed_on(claim: Claim, enclosure: Enclosure) -> list[int]:
    """Return the functions that are not held and may vanish, for some parameters of a cell.

    The cell is divided until they do not, as in :func:`inside`.
    """

    def decide(values: "Sequence[Ball]") -> tuple[set[int], bool]:
        some = {i for i, x in zip(claim.others, values, strict=True) if not (x > 0 or x < 0)}
        return some, bool(some)

    return sorted(set[int]().union(*_on_parts(claim, enclosure, decide)))


def of_a_choice(
    claim: Claim, closed: Sequence[int], found: Mapping[str, ConditionResult]
) -> Mapping[str, ConditionResult]:
    """Return what is known where a claim leaves out functions that may vanish at its point.

    These may support a minimum as well, so that a condition that is violated refutes none.
    """
    if not closed:
        return found
    about = f"{', '.join(claim.named(closed))} may support as well, in another choice of functions"
    return {
        name: undecided(f"{result.reason}; {about}") if result.status is Status.FAILED else result
        for name, result in found.items()
    }
