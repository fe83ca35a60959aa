"""Minimum or not where the second order vanishes at a point with weakly active functions.

The zeros of the form on the critical cone are followed:

1. positive semidefinite on the face: a strict minimum without the weak functions is one with them;
2. zeros that are isolated rays, the form growing to first order into the cone from each: along each
   the energy is reduced on the face of the weak functions that stay closed, on one side;
3. otherwise the weak functions are themselves variables that are not negative.
"""

from dataclasses import replace

import numpy as np

from polycorner.minimisation.constancy import constancy, symmetric_directions, without
from polycorner.minimisation.copositivity import cone_rays
from polycorner.minimisation.degeneracy import (
    MOST,
    Decision,
    Situation,
    classify,
    concluded,
    decide_free,
    falls,
    follow_only,
    follow_zeros,
    no_decision,
    order_for,
    symmetric,
    tangent_of,
)
from polycorner.minimisation.germs import CLEAR, ROUNDING, missed, reduce_energy, vague
from polycorner.minimisation.jets import NotAnalyticError
from polycorner.minimisation.signs import Sign, Signed, signed
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import unit_rows
from polycorner.spaces.manifold import Array


def decide(s: Situation) -> Decision:
    """Decide a point whose second order vanishes; undecided where mathematics here cannot."""
    try:
        return _decide_weak(s) if s.weak else decide_free(s, s.flat)
    except NotAnalyticError as error:
        reason = f"a formula is not analytic at the point: {error}"
        return no_decision(s, reason) if s.weak else follow_only(s, reason)


def _decide_weak(s: Situation) -> Decision:
    basis = s.tangent(s.rows)
    values, vectors = np.linalg.eigh(basis.T @ s.hessian @ basis)
    relaxed = None
    if not len(values) or values[0] >= -s.small_curvature:
        relaxed = decide_free(s, basis @ vectors[:, values <= s.nearly])
        if relaxed.verdict is Verdict.STRICT_MINIMUM:
            return replace(relaxed, verdict=Verdict.WEAK_MINIMUM)
        if relaxed.verdict is Verdict.MINIMUM_ALONG_LOCUS and _stays(s, relaxed):
            return relaxed
    by_rays = _decide_rays(s, basis)
    if by_rays is not None:
        return by_rays
    return _decide_opened(s)


def _stays(s: Situation, found: Decision) -> bool:
    """Whether a locus found without the weak functions can be followed among them."""
    gradients = unit_rows(s.problem.evaluate(s.point, 1)[1][list(s.weak)])
    for way in (*s.flat.T, found.direction, -found.direction):
        if (gradients @ way >= -1e-9).all():
            face = s.face((), way[:, None])
            if constancy(
                s.problem,
                s.piece,
                s.point,
                face,
                s.tolerances,
                one_sided=True,
                reference=s.reference,
            ).holds:
                return True
    return False


def _decide_rays(s: Situation, basis: Array) -> Decision | None:
    """Decide along zeros that are isolated rays; None where they are not."""
    gradients = unit_rows(s.problem.evaluate(s.point, 1)[1][list(s.weak)])
    lines, rays, simplicial = cone_rays(gradients @ basis, s.tolerances.rank)
    if not simplicial or not s.flat.shape[1]:
        return None
    rays = basis @ rays
    least = 100 * s.tolerances.curvature * max(1e-300, float(abs(s.hessian).max()))
    parts = []
    for way in s.flat.T:
        shut = gradients @ way <= 1e-7
        if shut.all():
            return None  # a line of the cone
        climbs = rays[:, shut].T @ s.hessian @ way
        closed = tuple(row for row, tight in zip(s.weak, shut, strict=True) if tight)
        inner = s.tangent(s.rows + closed)
        levels = np.linalg.eigvalsh(inner.T @ s.hessian @ inner)
        if (climbs <= least).any() or (levels <= s.nearly).sum() != 1:
            return None
        if lines.shape[1] and abs(way @ basis @ lines).max() > 1 - 1e-9:
            return None
        parts.append(_on_ray(s, closed, way))
    return _least_favourable(parts)


def _on_ray(s: Situation, closed: tuple[int, ...], way: Array) -> Decision:
    """Decide along one ray, on the face of the weak functions that stay closed."""
    face = s.face(closed, way[:, None])
    everywhere = symmetric_directions(s.problem, face.rows)
    if not without(way[:, None], everywhere).shape[1]:
        return symmetric(way[:, None])
    germ = reduce_energy(s.problem, s.point, s.hessian, face, order_for(1))
    if germ is None:
        return no_decision(s, "the conditions across a direction are singular")
    coefficients = germ.coefficients.copy()
    coefficients[1] = 0.0 if abs(coefficients[1]) <= s.small else coefficients[1]
    order, direction = germ.domain.order, tangent_of(germ, np.ones(1))
    passing = vague(germ, coefficients, missed(germ, 0, s.near(face)))
    for degree in range(1, order + 1):
        c, noise = coefficients[degree], germ.noise[degree]
        if abs(c) <= ROUNDING * noise:
            continue
        if abs(c) <= CLEAR * noise or degree == 1:
            return no_decision(s, "the first term cannot be told from rounding", order)
        firm = coefficients[degree:][~passing[degree:] & (abs(coefficients[degree:]) > 0)]
        if passing[degree] and len(firm) and firm[0] * c < 0:
            return no_decision(s, "the first term would vanish a little further on", order)
        verdict = Verdict.WEAK_MINIMUM if c > 0 else Verdict.SADDLE
        if c < 0 and not (s.exact or falls(s, germ, signed(Sign.NEGATIVE, degree, np.ones(1)))):
            return no_decision(s, "the energy decreases on a face that may leave the polyhedron")
        return Decision(verdict, degree, order, direction, "")
    zero = Signed(Sign.ZERO, 1, np.ones(1), (1,), np.ones((1, 1)))
    return follow_zeros(face, s, germ, zero)


def _least_favourable(parts: list[Decision]) -> Decision:
    """Return the decision of several rays together."""
    ranks = (
        Verdict.SADDLE,
        Verdict.UNDECIDED,
        Verdict.MINIMUM_ALONG_LOCUS,
        Verdict.WEAK_MINIMUM,
    )
    return min(parts, key=lambda part: ranks.index(part.verdict))


def _decide_opened(s: Situation) -> Decision:
    """Decide with the weak functions as variables that are not negative."""
    rows = s.rows + s.weak
    gradients = s.problem.evaluate(s.point, 1)[1][list(rows)]
    if np.linalg.matrix_rank(unit_rows(gradients), tol=s.tolerances.rank) < len(rows):
        return no_decision(s, "weakly active functions depend on each other")
    inner = s.tangent(rows)
    values, vectors = np.linalg.eigh(inner.T @ s.hessian @ inner)
    flat = inner @ vectors[:, values <= s.nearly]
    moving = without(flat, symmetric_directions(s.problem, rows)) if flat.size else flat
    face = s.face(s.weak, moving, opened=True)
    if face.variables > MOST:
        return no_decision(s, f"more than {MOST} weak functions and degenerate directions")
    germ = reduce_energy(s.problem, s.point, s.hessian, face, order_for(face.variables))
    if germ is None:
        return no_decision(s, "the conditions across these directions are singular")
    found = classify(germ, len(s.weak), s.small, s.near(face), s.tolerances.same)
    if found.sign is Sign.ZERO and not len(found.zeros):
        unit = np.linalg.lstsq(germ.points[:, 1 : 1 + face.variables], s.flat, rcond=1e-9)[0].T
        unit = np.where(abs(unit) <= 1e-7 * abs(unit).max(axis=1)[:, None], 0.0, unit)
        found = replace(found, zeros=np.asarray(unit, dtype=np.float64))
    decision = concluded(s, face, germ, found, locus=bool(face.still.shape[1]))
    strict = decision.verdict is Verdict.STRICT_MINIMUM
    return replace(decision, verdict=Verdict.WEAK_MINIMUM) if strict else decision
