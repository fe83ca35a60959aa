"""Claims to be proved: the face of a certificate, its symmetries and approximate unknowns."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from typing import TYPE_CHECKING

import numpy as np

from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Certificate
from polycorner.polyhedra.cones import Rows, independent_rows, unit_rows
from polycorner.proofs.invariance import (
    Generator,
    annihilated,
    generators,
    slope_bounds,
    translations,
)
from polycorner.proofs.kkt import FIRST_BITS, KKTSystem
from polycorner.proofs.statements import Claim, ConditionResult, Status

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball
    from polycorner.spaces.manifold import Array

MOST_SUBSETS = 1000  # of one size that are examined


@dataclass(frozen=True, eq=False)
class Posed:
    """A claim, approximate unknowns, and the result for declared fields that are no symmetries.

    Attributes
    ----------
    claim : Claim
        What is to be proved.
    start : list of Ball
        Approximate unknowns of its system.
    refused : ConditionResult or None
        The result for a declared field that is not a symmetry, if there is one.
    """

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


def _carries(rows: Rows, size: int, slope: "Array", small: float) -> bool:
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
    fields: Sequence[Generator], box: Box, scales: "Array", rank_tolerance: float
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
        vector = np.array([float(x.mid()) for x in values]) / scales
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
