"""Attempts at a proof: enclosures of the KKT points of the faces of a certificate."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.minimisation import Certificate, Entrapment
from polycorner.proofs.claims import Posed, faces, pose_claim
from polycorner.proofs.invariance import Generator
from polycorner.proofs.kkt import SUBJECT, newton
from polycorner.proofs.krawczyk import Enclosure, enclose

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

BITS_PER_DIGIT = 3.3220
GUARD_BITS = 64
NEARBY = 1e-3  # distance of the exact solution from a certificate's point, in scale units
LEAST_SIZE = 1e-10  # size in units below which digits are relative to the unit


@dataclass(frozen=True, eq=False)
class Attempt:
    """Claim and enclosure for one face.

    Attributes
    ----------
    face : tuple of int
        The active functions.
    posed : Posed or Undecided
        The claim that the face carries a minimum, or why it could not be posed.
    enclosure : Enclosure or Undecided
        Its KKT point enclosed, or why not.
    bits : int
        Working precision in binary digits.
    """

    face: tuple[int, ...]
    posed: Posed | Undecided
    enclosure: Enclosure | Undecided
    bits: int


def attempt(
    certificate: Certificate, fields: Sequence[Generator], formulas: Formulas, digits: int
) -> Attempt:
    """Enclose the KKT point of a face that carries the energy.

    With dependent gradients there may be several such faces; preferred is the first at whose point
    the signs of all other functions are decided.
    """
    first: Attempt | None = None
    for face in faces(certificate):
        result, decided = _on_face(certificate, face, fields, formulas, digits)
        if decided:
            return result
        if first is None or isinstance(first.enclosure, Undecided):
            first = result
    assert first is not None
    return first


def _on_face(
    certificate: Certificate,
    face: tuple[int, ...],
    fields: Sequence[Generator],
    formulas: Formulas,
    digits: int,
) -> tuple[Attempt, bool]:
    """Enclose the KKT point of a face; return also whether all other signs are decided.

    Functions that are active within the certificate's tolerance but violated at the KKT point join
    the face for another attempt.
    """
    active = certificate.analysis.active
    while True:
        posed = pose_claim(certificate, face, fields, formulas)
        if isinstance(posed, Undecided):
            return Attempt(face, posed, posed, bits_for(digits)), False
        enclosure, bits = _enclosed(certificate, posed, digits)
        result = Attempt(face, posed, enclosure, bits)
        if isinstance(enclosure, Undecided):
            return result, False
        others = [i for i in active if i not in face]
        with precision(bits):
            values = formulas.values(enclosure.neighbourhood(), others)
        missed = [i for i, value in zip(others, values, strict=True) if value < 0]
        if not missed:
            return result, all(value > 0 for value in values)
        face = tuple(sorted((*face, *missed)))


def bits_for(digits: int) -> int:
    """Return the working precision in binary digits for a number of decimal digits."""
    return ceil(digits * BITS_PER_DIGIT) + GUARD_BITS


def _enclosed(
    certificate: Certificate, posed: Posed, digits: int
) -> tuple[Enclosure | Undecided, int]:
    """Enclose the solution, with a higher precision if the first is not sufficient."""
    system = posed.claim.system
    bits = bits_for(digits)
    for last in (False, True):
        centre = newton(system, posed.start, bits=bits)
        if isinstance(centre, Undecided):
            return _explained(certificate, centre), bits
        away = _distance(certificate, centre)
        if not away <= NEARBY:
            reason = f"the nearest solution found is {away:.1e} scale units from the point"
            return Undecided(SUBJECT, reason), bits
        with precision(bits):
            found = enclose(system, centre, bits=bits)
            if isinstance(found, Enclosure) and (last or _sharp(found, digits)):
                return found, bits
        if last:
            break
        bits = 2 * bits + GUARD_BITS
    return _explained(certificate, found) if isinstance(found, Undecided) else found, bits


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


def _explained(certificate: Certificate, undecided: Undecided) -> Undecided:
    """Add hints from the certificate at why the equations may be singular."""
    hints = []
    if not certificate.licq:
        hints.append("the gradients of the active functions are nearly dependent")
    flat = [label for label, kind in certificate.entrapment.items() if kind is Entrapment.FREE]
    if flat:
        hints.append(f"the energy is flat along {', '.join(flat)}")
    return Undecided(undecided.name, "; ".join([undecided.reason, *hints]))
