"""Attempts at a proof: faces of a certificate, claims about them, their KKT points enclosed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, islice

import numpy as np

from polycorner.intervals.balls import GUARD_BITS, Ball, ball, bits_for, middles, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Certificate, Entrapment
from polycorner.polyhedra.cones import Rows, independent_rows, unit_rows
from polycorner.proofs.hypotheses import (
    INACTIVE,
    Claim,
    ConditionResult,
    Status,
    check_hypotheses,
    of_a_choice,
    without_enclosure,
)
from polycorner.proofs.invariance import (
    Generator,
    annihilated,
    generators,
    slope_bounds,
    translations,
)
from polycorner.proofs.kkt import FIRST_BITS, SUBJECT, Enclosure, KKTSystem, enclose, newton
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

MOST_SUBSETS = 1000  # of one size that are examined
MOST_FACES = 8  # on which a proof is tried
BRIEF_FACES = 3  # where something is proved already
MOST_DOUBLINGS = 3  # of the precision, until every condition is decided
MOST_SINGULAR = 1  # of the precision, where the equations seem to be singular
PROVED = 3  # the rank of an attempt at which nothing is left open
FAR = f"{SUBJECT} near the point"


@dataclass(frozen=True, eq=False)
class Posed:
    """A claim, approximate unknowns, and the result for declared fields that are no symmetries."""

    claim: Claim
    start: "list[Ball]"
    refused: ConditionResult | None


def faces(certificate: Certificate) -> Iterator[tuple[int, ...]]:
    """Return sets of rows that may carry the energy's gradient, likeliest first.

    A minimum on a larger set is one on any part of it that contains the point, so that functions
    outside a face need only hold at the point.  Tried are, where gradients are independent, the
    functions whose multipliers are not zero; where they are dependent, every independent set with
    positive multipliers; then all sets of active functions, the largest first.
    """
    for sections in _sections(certificate):
        for contacts in _contacts(certificate, sections):
            yield (*contacts, *sections)


def _sections(certificate: Certificate) -> Iterator[tuple[int, ...]]:
    """Return sets of equations: independent ones first, then all of them."""
    analysis, m = certificate.analysis, certificate.problem.inequalities
    gradients = analysis.gradients[len(analysis.active) :]
    every = tuple(range(m, m + len(gradients)))
    chosen = independent_rows(unit_rows(gradients), certificate.rank_tolerance) if every else []
    if len(chosen) < len(every):
        yield tuple(m + i for i in sorted(chosen))
    yield every


def _contacts(certificate: Certificate, sections: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    analysis, m = certificate.analysis, certificate.problem.inequalities
    active, k = analysis.active, len(analysis.active)
    small, slope = analysis.local.small, analysis.local.gradients[-1]
    units = unit_rows(analysis.gradients)
    held = [k + row - m for row in sections]
    if analysis.independent:
        values = analysis.multipliers.values[:k]
        yield tuple(i for i, value in zip(active, values, strict=True) if abs(value) > small)
    else:
        for chosen in _subsets(range(k), units.shape[1]):
            rows = Rows(units[[*chosen, *held]], certificate.rank_tolerance)
            if rows.independent and _carries(rows, len(chosen), slope, small):
                yield tuple(active[i] for i in chosen)
    yield from _subsets(active, units.shape[1] - len(held))


def _subsets(rows: Sequence[int], most: int) -> Iterator[tuple[int, ...]]:
    """Return subsets of at most ``most`` rows, the largest first."""
    for size in range(min(len(rows), most), -1, -1):
        yield from islice(combinations(rows, size), MOST_SUBSETS)


def _carries(rows: Rows, size: int, slope: Array, small: float) -> bool:
    """Whether the energy's gradient is a combination of rows, the first ``size`` of them > 0."""
    weights = rows.weights(slope) if len(rows.units) else np.empty(0)
    rest = slope - weights @ rows.units
    return bool((weights[:size] > small).all() and abs(rest).max() <= small)


def pose_claim(
    certificate: Certificate,
    face: tuple[int, ...],
    declared: Sequence[Generator],
    formulas: Formulas,
    parameters: Sequence[float] = (),
) -> Posed | Undecided:
    """Pose the KKT system of a face at a certificate's point, with gauges for its symmetries."""
    problem, rows = certificate.problem, face
    point = tuple(certificate.point.tolist())
    with precision(FIRST_BITS):
        box = Box([ball(x) for x in (*point, *parameters)])
        forms = formulas.smooth(box, (*rows, problem.rows - 1))
        if isinstance(forms, Undecided):
            return forms
        kept, refused = _invariant(forms, declared, box)
        for basis in translations(forms):
            kept += generators(problem.polyhedron.manifold, [basis])
        fields, gauges = _independent(kept, box, problem.scales, certificate.rank_tolerance)
        system = KKTSystem(formulas, rows, gauges, point, _units(certificate, rows, gauges))
        multipliers = _multipliers(certificate, rows)
        start = [ball(x) for x in (*point, *multipliers, *[0.0] * len(gauges))]
    return Posed(Claim(problem, system, fields), start, refused)


def _units(
    certificate: Certificate, rows: Sequence[int], gauges: Sequence[Sequence[float]]
) -> tuple[float, ...]:
    """Return the units of coordinates and multipliers; see :class:`KKTSystem`."""
    problem = certificate.problem
    _, gradients = problem.evaluate(certificate.point, 1)
    normals = [*gradients[list(rows)], *(np.array(gauge) * problem.scales for gauge in gauges)]
    sizes = [float(np.linalg.norm(normal)) for normal in normals]
    pull = certificate.analysis.local.reference
    multipliers = [pull / size if 0 < size < np.inf else pull for size in sizes]
    finite = [unit if 0 < unit < np.inf else 1.0 for unit in multipliers]
    return (*problem.scales.tolist(), *finite)


def _multipliers(certificate: Certificate, rows: Sequence[int]) -> list[float]:
    _, gradients = certificate.problem.evaluate(certificate.point, 1)
    if not rows or not np.isfinite(gradients).all():
        return [0.0] * len(rows)
    found, *_ = np.linalg.lstsq(gradients[list(rows)].T, gradients[-1])
    return list(found.tolist())


def _invariant(
    forms: SmoothForms, declared: Sequence[Generator], box: Box
) -> tuple[list[Generator], ConditionResult | None]:
    """Return the declared fields that are symmetries, and the result for one that is not."""
    kept: list[Generator] = []
    refused: ConditionResult | None = None
    for field in declared:
        if all(annihilated(forms, field)):
            kept.append(field)
        elif any(slope != 0 for slope in slope_bounds(forms, field, box)):
            reason = f"energy or active functions change along {field}"
            refused = ConditionResult(Status.FAILED, reason)
        else:
            reason = f"exact algebra does not show that nothing changes along {field}"
            refused = refused or ConditionResult(Status.UNDECIDED, reason)
    return kept, refused


def _independent(
    fields: Sequence[Generator], box: Box, scales: Array, rank_tolerance: float
) -> tuple[tuple[Generator, ...], tuple[tuple[float, ...], ...]]:
    """Return fields with independent vectors at the point, and a normal for each.

    ``rank_tolerance`` is the sine of the angle up to which a field depends on the others.
    """
    chosen: list[Generator] = []
    units: list[Array] = []
    gauges: list[tuple[float, ...]] = []
    for field in fields:
        values = field.at(box.hull)
        if isinstance(values, Undecided):
            continue
        vector = middles(values) / scales
        size = float(np.linalg.norm(vector))
        if not 0 < size < np.inf:
            continue
        rest = vector / size
        for unit in units:
            rest = rest - (rest @ unit) * unit
        if np.linalg.norm(rest) > rank_tolerance:
            chosen.append(field)
            units.append(rest / np.linalg.norm(rest))
            normal = vector / scales
            gauges.append(tuple((normal / abs(normal).max()).tolist()))
    return tuple(chosen), tuple(gauges)


@dataclass(frozen=True, eq=False)
class Attempt:
    """Claim, enclosure and conditions for one face.

    Attributes
    ----------
    face : tuple of int
        The rows held: active functions, then equations.
    posed : Posed or Undecided
        The claim that the face carries a minimum, or why it could not be posed.
    enclosure : Enclosure or Undecided
        Its KKT point enclosed, or why not.
    found : mapping from str to ConditionResult
        The conditions.
    bits : int
        Working precision in binary digits.
    """

    face: tuple[int, ...]
    posed: Posed | Undecided
    enclosure: Enclosure | Undecided
    found: Mapping[str, ConditionResult]
    bits: int

    @property
    def open(self) -> bool:
        """Whether a condition is undecided."""
        return any(result.status is Status.UNDECIDED for result in self.found.values())

    @property
    def proved(self) -> bool:
        """Whether nothing is left open."""
        return self.rank == PROVED

    @property
    def settled(self) -> bool:
        """Whether the claim is proved or refuted."""
        return self.proved or any(x.status is Status.FAILED for x in self.found.values())

    @property
    def rank(self) -> int:
        """How much is known: nothing, a point, a point of the set, a minimum."""
        if isinstance(self.enclosure, Undecided):
            return 0
        if all(result.status is Status.PROVED for result in self.found.values()):
            return 3
        return 2 if self.found[INACTIVE].status is Status.PROVED else 1


def attempt(
    certificate: Certificate,
    fields: Sequence[Generator],
    formulas: Formulas,
    digits: int,
    *,
    brief: bool = False,
) -> Attempt:
    """Prove a minimum on one of the faces that may carry the energy's gradient.

    Where none is proved, the first at whose point most is known is returned.  Functions that are
    active within the certificate's tolerance but violated at the KKT point of a face join it for
    another attempt.  A brief attempt tries few faces, and precision is not doubled.
    """
    most, doublings = (BRIEF_FACES, 0) if brief else (MOST_FACES, MOST_DOUBLINGS)
    best: Attempt | None = None
    tried: set[tuple[int, ...]] = set()
    waiting = faces(certificate)
    while len(tried) < most and (face := next(waiting, None)) is not None:
        if face in tried:
            continue
        tried.add(face)
        result = _on_face(certificate, face, fields, formulas, digits, doublings)
        if best is None or result.rank > best.rank:
            best = result
        if result.proved:
            break
        missed = _missed(certificate, result, formulas)
        if missed:
            waiting = chain([tuple(sorted((*face, *missed)))], waiting)
    assert best is not None
    return best


def _missed(certificate: Certificate, result: Attempt, formulas: Formulas) -> list[int]:
    """Return the active functions that are violated at the KKT point of a face."""
    others = [i for i in certificate.analysis.active if i not in result.face]
    if isinstance(result.enclosure, Undecided) or not others:
        return []
    with precision(result.bits):
        values = formulas.values(result.enclosure.neighbourhood(), others)
    return [i for i, value in zip(others, values, strict=True) if value < 0]


def _on_face(
    certificate: Certificate,
    face: tuple[int, ...],
    fields: Sequence[Generator],
    formulas: Formulas,
    digits: int,
    most: int,
) -> Attempt:
    """Enclose the KKT point of a face and check it, with more and more bits until all is decided.

    Their number is doubled at most ``most`` times.
    """
    bits = bits_for(digits)
    posed = pose_claim(certificate, face, fields, formulas)
    if isinstance(posed, Undecided):
        return Attempt(face, posed, posed, without_enclosure(posed), bits)
    best: Attempt | None = None
    others = [i for i in certificate.analysis.active if i not in face]
    for doublings in range(most + 1):
        enclosure = _enclosed(certificate, posed, bits)
        with precision(bits):
            found = _checked(posed, enclosure)
            if others and not isinstance(enclosure, Undecided):
                values = formulas.values(enclosure.neighbourhood(), others)
                closed = [i for i, value in zip(others, values, strict=True) if not value > 0]
                found = of_a_choice(posed.claim, closed, found)
            result = Attempt(face, posed, enclosure, found, bits)
            if best is None or result.rank >= best.rank:
                best = result
            if isinstance(enclosure, Undecided):
                if doublings >= MOST_SINGULAR or enclosure.name != SUBJECT:
                    break
            elif not result.open and _sharp(enclosure, digits):
                break
        bits = 2 * bits + GUARD_BITS
    assert best is not None
    return best


def _checked(posed: Posed, enclosure: Enclosure | Undecided) -> Mapping[str, ConditionResult]:
    if isinstance(enclosure, Undecided):
        return without_enclosure(enclosure, symmetric=bool(posed.claim.fields))
    return check_hypotheses(posed.claim, enclosure)


def _enclosed(certificate: Certificate, posed: Posed, bits: int) -> Enclosure | Undecided:
    """Enclose the solution near the certificate's point."""
    system = posed.claim.system
    centre = newton(system, posed.start, bits=bits)
    if isinstance(centre, Undecided):
        return _explained(certificate, centre)
    away = _distance(certificate, centre)
    if not away <= Tolerances.of(certificate.tolerance).beside:
        return Undecided(
            FAR, f"the nearest solution found is {away:.1e} scale units from the point"
        )
    with precision(bits):
        found = enclose(system, centre, bits=bits)
    return _explained(certificate, found) if isinstance(found, Undecided) else found


def _distance(certificate: Certificate, z: "list[Ball]") -> float:
    scales = certificate.problem.scales.tolist()
    pairs = zip(z, certificate.point.tolist(), scales, strict=False)
    return max(abs(float(x) - float(q)) / float(s) for x, q, s in pairs)


def _sharp(enclosure: Enclosure, digits: int) -> bool:
    """Whether every unknown is enclosed to ``digits`` digits, relative to itself.

    Where it is smaller than ``least`` units, they are relative to its unit.
    """
    units = enclosure.predictor.system.units
    small = ball(10) ** -digits
    return all(
        x.rad() <= small * (x.abs_lower() + 1e-10 * unit)
        for x, unit in zip(enclosure.solution, units, strict=True)
    )


def _explained(certificate: Certificate, open_: Undecided) -> Undecided:
    """Add hints from the certificate at why the equations may be singular."""
    hints = []
    if not certificate.licq:
        hints.append("the gradients of the active functions are nearly dependent")
    flat = [label for label, kind in certificate.entrapment.items() if kind is Entrapment.FREE]
    if flat:
        hints.append(f"the energy is flat along {', '.join(flat)}")
    return Undecided(open_.name, "; ".join([open_.reason, *hints]))
