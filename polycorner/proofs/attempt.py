"""Attempts at a proof: enclosures of the KKT points of the faces of a certificate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import ceil
from typing import TYPE_CHECKING

from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.minimisation import Certificate, Entrapment
from polycorner.proofs.claims import Posed, faces, pose_claim
from polycorner.proofs.hypotheses import INACTIVE, check_hypotheses, without_enclosure
from polycorner.proofs.invariance import Generator
from polycorner.proofs.kkt import SUBJECT, newton
from polycorner.proofs.krawczyk import Enclosure, enclose
from polycorner.proofs.statements import Claim, ConditionResult, Status, undecided
from polycorner.tolerances import Tolerances

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

BITS_PER_DIGIT = 3.3220
GUARD_BITS = 64
MOST_FACES = 8  # on which a proof is tried
MOST_DOUBLINGS = 3  # of the precision, until every condition is decided
MOST_SINGULAR = 1  # of the precision, where the equations seem to be singular
PROVED = 3  # the rank of an attempt at which nothing is left open
FAR = f"{SUBJECT} near the point"
LEAST_SIZE = 1e-10  # size in units below which digits are relative to the unit


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
    def rank(self) -> int:
        """How much is known: nothing, a point, a point of the set, a minimum."""
        if isinstance(self.enclosure, Undecided):
            return 0
        if all(result.status is Status.PROVED for result in self.found.values()):
            return 3
        return 2 if self.found[INACTIVE].status is Status.PROVED else 1


def attempt(
    certificate: Certificate, fields: Sequence[Generator], formulas: Formulas, digits: int
) -> Attempt:
    """Prove a minimum on one of the faces that may carry the energy's gradient.

    Where none is proved, the first at whose point most is known is returned.  Functions that are
    active within the certificate's tolerance but violated at the KKT point of a face join it for
    another attempt.
    """
    best: Attempt | None = None
    tried: set[tuple[int, ...]] = set()
    waiting = faces(certificate)
    while len(tried) < MOST_FACES and (face := next(waiting, None)) is not None:
        if face in tried:
            continue
        tried.add(face)
        result = _on_face(certificate, face, fields, formulas, digits)
        if best is None or result.rank > best.rank:
            best = result
        if result.rank == PROVED:
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
) -> Attempt:
    """Enclose the KKT point of a face and check it, with more and more bits until all is decided.

    Their number is doubled at most ``MOST_DOUBLINGS`` times.
    """
    bits = bits_for(digits)
    posed = pose_claim(certificate, face, fields, formulas)
    if isinstance(posed, Undecided):
        return Attempt(face, posed, posed, without_enclosure(posed), bits)
    best: Attempt | None = None
    others = [i for i in certificate.analysis.active if i not in face]
    for doublings in range(MOST_DOUBLINGS + 1):
        enclosure = _enclosed(certificate, posed, bits)
        with precision(bits):
            found = _checked(posed, enclosure)
            if others and not isinstance(enclosure, Undecided):
                found = _of_a_choice(posed.claim, others, enclosure, found)
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


def _of_a_choice(
    claim: Claim, others: Sequence[int], enclosure: Enclosure, found: Mapping[str, ConditionResult]
) -> Mapping[str, ConditionResult]:
    """Return what is known where a face leaves out active functions, which may support as well.

    Where these are positive nothing else can, and a condition that is violated refutes the
    minimum; elsewhere the functions of another choice may meet it.
    """
    values = claim.system.formulas.values(enclosure.neighbourhood(), others)
    closed = [i for i, value in zip(others, values, strict=True) if not value > 0]
    if not closed:
        return found
    about = f"{', '.join(claim.named(closed))} may support as well, in another choice of functions"
    return {
        name: undecided(f"{result.reason}; {about}") if result.status is Status.FAILED else result
        for name, result in found.items()
    }


def bits_for(digits: int) -> int:
    """Return the working precision in binary digits for a number of decimal digits."""
    return ceil(digits * BITS_PER_DIGIT) + GUARD_BITS


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
    """Whether every unknown is enclosed to ``digits`` digits, relative to itself or its unit."""
    units = enclosure.predictor.system.units
    small = ball(10) ** -digits
    return all(
        x.rad() <= small * (x.abs_lower() + LEAST_SIZE * unit)
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
