"""Minimum or not where the second order vanishes: higher orders along curved directions.

On the face of the strongly active functions the energy is reduced to a power series in the
directions in which the second order vanishes (:mod:`~polycorner.minimisation.germs`), whose
sign near 0 decides (:mod:`~polycorner.minimisation.signs`).  By metric regularity of the face, a
point is a minimum on the polyhedron if it is one on the face: off it, the energy grows to first
order, faster than anything changes on it.

With weakly active functions the zeros of the form on the critical cone are followed:

1. positive semidefinite on the face: a strict minimum without the weak functions is one with them;
2. zeros that are isolated rays, the form growing to first order into the cone from each: along each
   the energy is reduced on the face of the weak functions that stay closed, on one side;
3. otherwise the weak functions are themselves variables that are not negative.
"""

from dataclasses import dataclass, replace

import numpy as np

from polycorner.minimisation.conditions import cone_rays
from polycorner.minimisation.constancy import (
    Constancy,
    constancy,
    orthonormal,
    symmetric_directions,
    without,
)
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.findings import Analysis, Decision, Local, undecided
from polycorner.minimisation.germs import (
    CLEAR,
    MOVE,
    ROUNDING,
    DirectedFace,
    Germ,
    missed,
    reduce_energy,
    vague,
)
from polycorner.minimisation.jets import NotAnalyticError
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.signs import Sign, Signed, sign_near_zero, signed
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.polyhedra.polyhedron import Piece
from polycorner.spaces.manifold import Array
from polycorner.values import Value

ORDERS = {1: 16, 2: 10, 3: 8, 4: 6}  # degree of the series by its number of variables
ORDER, MOST = 4, 12  # the degree beyond, and the most variables
FAR = 0.5  # distance in scale units over which constancy suffices in brief


@dataclass(frozen=True, eq=False)
class Situation(Value):
    """A stationary point at which the second order vanishes in some directions.

    Attributes
    ----------
    analysis : Analysis
        First and second order there.
    piece : frozenset of int
        The inequalities that hold near it.
    rows : tuple of int
        Strongly active functions with independent gradients, and equations.
    multipliers : (p,) array
        ``dE/df`` of each.
    exact : bool
        Whether the face of ``rows`` lies in the polyhedron, as far as weak functions allow;
        otherwise it only contains the true face.
    hessian : (n, n) array
        Of the Lagrangian, in scaled coordinates.
    flat : (n, r) array
        Directions of the critical cone in which its form vanishes.
    """

    analysis: Analysis
    piece: Piece
    rows: tuple[int, ...]
    multipliers: Array
    exact: bool
    hessian: Array
    flat: Array

    @property
    def local(self) -> Local:
        """The derivatives at the point."""
        return self.analysis.local

    @property
    def problem(self) -> Problem:
        """The problem."""
        return self.analysis.local.problem

    @property
    def weak(self) -> tuple[int, ...]:
        """Active functions with zero multipliers."""
        return self.analysis.weak

    @property
    def nearly(self) -> float:
        """Curvature up to which a direction is treated as flat."""
        return NEARLY_FLAT * self.analysis.small_curvature

    def follow(self, face: DirectedFace, *, one_sided: bool) -> Constancy:
        """Follow the directions of a face as far as the energy is constant."""
        local, sided = self.local, one_sided
        place = self.problem, self.piece, local.point, face, local.tolerances
        return constancy(*place, one_sided=sided, reference=local.reference)

    def tangent(self, rows: tuple[int, ...]) -> Array:
        """Return an orthonormal basis of the directions tangent to functions."""
        return null_space(self.local.gradients[list(rows)], self.local.tolerances.rank)

    def near(self, face: DirectedFace) -> Array:
        """Return how much each variable of a face may differ within the tolerance of the point."""
        opened = self.local.gradients[[face.rows[i] for i in face.opened]]
        sizes = np.concatenate([np.linalg.norm(opened, axis=1), np.ones(face.moving.shape[1])])
        return np.asarray(self.local.small / self.local.reference * sizes)

    def face(self, closed: tuple[int, ...], moving: Array, *, opened: bool = False) -> DirectedFace:
        """Return the face on which further functions are closed, or opened as variables."""
        rows = self.rows + closed
        multipliers = np.concatenate([self.multipliers, np.zeros(len(closed))])
        still = symmetric_directions(self.problem, rows)
        still = without(still, moving) if moving.shape[1] else still
        positions = tuple(range(len(self.rows), len(rows))) if opened else ()
        return DirectedFace(rows, multipliers, positions, moving, still)


def no_decision(s: Situation, reason: str, order: int = 0) -> Decision:
    """Return that nothing is decided, and why."""
    return undecided(len(s.local.point), reason, order)


def order_for(variables: int) -> int:
    """Return the degree to which a series in so many variables is computed."""
    return ORDERS.get(variables, ORDER)


def decide(s: Situation) -> Decision:
    """Decide a point whose second order vanishes; undecided where mathematics here cannot."""
    try:
        return _decide_weak(s) if s.weak else decide_free(s, s.flat)
    except NotAnalyticError as error:
        reason = f"a formula is not analytic at the point: {error}"
        return no_decision(s, reason) if s.weak else follow_only(s, reason)


# --------------------------------------------------------------- without weak functions


def decide_free(s: Situation, flat: Array) -> Decision:
    """Decide by the energy on the face alone, reduced to the given flat directions."""
    still = symmetric_directions(s.problem, s.rows)
    moving = without(flat, still)
    if not moving.shape[1]:
        return symmetric(orthonormal(flat))
    if moving.shape[1] > MOST:
        return no_decision(s, f"the second order vanishes in more than {MOST} directions")
    face = s.face((), moving)
    if s.local.higher == "followed":
        seen = constancy(
            s.problem,
            s.piece.difference(s.weak),
            s.local.point,
            face,
            s.local.tolerances,
            one_sided=False,
            reference=1e-300,  # where an energy decays, its own size tells that it changes
            least=FAR,
        )
        if seen.holds:
            return Decision(Verdict.MINIMUM_ALONG_LOCUS, 0, 0, moving[:, 0], "followed", seen)
    germ = reduce_energy(s.problem, s.local.point, s.hessian, face, order_for(moving.shape[1]))
    if germ is None:
        return no_decision(s, "the conditions across these directions are singular")
    found = classify(germ, 0, s.local.small, s.near(face), s.local.tolerances.same)
    return concluded(s, face, germ, found, locus=bool(still.shape[1]))


def symmetric(flat: Array) -> Decision:
    """Conclude along directions in which nothing ever changes."""
    reason = "nothing changes along it anywhere: all derivatives vanish at random points"
    return Decision(
        Verdict.MINIMUM_ALONG_LOCUS, 0, 0, flat[:, 0], reason, Constancy(np.inf, 0.0, followed=True)
    )


def concluded(
    s: Situation, face: DirectedFace, germ: Germ, found: Signed, *, locus: bool = False
) -> Decision:
    """Return the decision that the sign of a reduced energy implies."""
    order = germ.domain.order
    direction = tangent_of(germ, found.direction)
    if found.sign is Sign.POSITIVE:
        verdict = Verdict.MINIMUM_ALONG_LOCUS if locus else Verdict.STRICT_MINIMUM
        return Decision(verdict, found.degree, order, direction, "")
    if found.sign is Sign.NEGATIVE:
        if s.exact or falls(s, germ, found):
            return Decision(Verdict.SADDLE, found.degree, order, direction, "")
        reason = "the energy decreases on a face that may leave the polyhedron"
        return replace(no_decision(s, reason, order), degree=found.degree, direction=direction)
    if found.sign is Sign.UNKNOWN:
        return no_decision(s, "the terms of lowest degree have zeros that were not resolved", order)
    return follow_zeros(face, s, germ, found)


def follow_zeros(face: DirectedFace, s: Situation, germ: Germ, found: Signed) -> Decision:
    """Follow the zeros of a reduced energy that is not negative."""
    half, order = len(face.opened), germ.domain.order
    whole = found.degree == 0 and not half
    ways = [(face, False)] if whole else [(_arc(face, s, germ, z), True) for z in found.zeros]
    seen = [s.follow(arc, one_sided=side) for arc, side in ways]
    together = Constancy(
        min(c.reach for c in seen), max(c.change for c in seen), all(c.followed for c in seen)
    )
    reason = "constant to the degree of the series, but not over larger distances"
    if together.holds:
        reason = "constant to the degree of the series, and to rounding as far as it was followed"
    elif not together.followed:
        reason = "constant to the degree of the series; the locus could not be followed"
    verdict = Verdict.MINIMUM_ALONG_LOCUS if together.holds else Verdict.UNDECIDED
    direction = ways[0][0].moving[:, 0]
    return Decision(verdict, found.degree, order, direction, reason, together)


def follow_only(s: Situation, reason: str) -> Decision:
    """Decide without a series, by whether the energy is constant as far as it is followed."""
    face = s.face((), without(s.flat, symmetric_directions(s.problem, s.rows)))
    seen = s.follow(face, one_sided=False)
    if not seen.holds:
        return no_decision(s, reason)
    reason = f"{reason}; constant to rounding as far as it was followed"
    direction = face.moving[:, 0]
    return Decision(Verdict.MINIMUM_ALONG_LOCUS, 0, 0, direction, reason, seen)


def _arc(face: DirectedFace, s: Situation, germ: Germ, zero: Array) -> DirectedFace:
    """Return the face that carries a zero, with its direction: opened functions at zero close."""
    half = len(face.opened)
    open_rows = [face.rows[i] for i, w in zip(face.opened, zero[:half], strict=True) if w > 0]
    closed = tuple(row for row in face.rows[len(s.rows) :] if row not in open_rows)
    return s.face(closed, tangent_of(germ, zero)[:, None])


def tangent_of(germ: Germ, w: Array) -> Array:
    """Return the unit tangent of the reduced surface in a direction of the variables."""
    m = germ.domain.variables
    way = germ.points[:, 1 : 1 + m] @ w
    return np.asarray(way / (np.linalg.norm(way) or 1.0))


def falls(s: Situation, germ: Germ, found: Signed) -> bool:
    """Whether the energy is seen to decrease at a feasible point of the curve."""
    level = float(
        s.problem.energy.value(germ.point(np.zeros(len(found.direction))) * s.problem.scales)
    )
    miss, fall = (
        s.local.tolerances.zero / 10,
        10 * s.local.tolerances.rounding * (abs(level) + s.local.reference),
    )
    for t in 0.5 ** np.arange(1, 20):
        u = germ.point(t ** np.array(found.weights) * found.direction)
        values, gradients = s.problem.evaluate(u * s.problem.scales, 1)
        inside = s.problem.holds(s.piece, values, gradients, miss)
        if inside and values[-1] < level - fall:
            return True
    return False


# --------------------------------------------------------------- zero or not


def classify(germ: Germ, half: int, small: float, near: Array, same: float) -> Signed:
    """Return the sign of a reduced energy near 0, its first ``half`` variables not negative.

    A coefficient counts as zero within the rounding errors propagated to it, and as different
    from zero only clearly beyond.  The degenerate point may have been missed a little, another one
    by ``same``: where all variables are free, the series is moved to the point at which the terms
    below those that decide vanish.  Otherwise terms decide nothing that would vanish a little
    further on, at a distance ``near`` in every variable.
    """
    domain, m = germ.domain, germ.domain.variables
    coefficients, noise = germ.coefficients.copy(), germ.noise
    if half:
        near = missed(germ, half, near)
        coefficients[(domain.degrees == 1) & (abs(coefficients) <= small)] = 0.0
    found = []
    for degree in range(2, domain.order + 1):
        here = domain.degrees == degree
        if not (abs(coefficients[here]) > CLEAR * noise[here]).any():
            continue
        moved = (coefficients, noise) if half else _centred(germ, degree, same)
        if moved is None:
            continue
        below = (domain.degrees < degree) & (domain.degrees > 0)
        gone = (abs(moved[0][below]) <= ROUNDING * moved[1][below]).all()
        if gone and (abs(moved[0][here]) > CLEAR * moved[1][here]).any():
            found.append(_sign(germ, *moved, half, near))
    if found:  # near a point of higher degree, a lower one may seem to decide
        agree = len({each.sign for each in found}) == 1
        return found[0] if agree else signed(Sign.UNKNOWN, 0, np.zeros(m))
    if (abs(coefficients) <= ROUNDING * noise).all():
        return Signed(Sign.ZERO, 0, np.eye(m)[0], (1,) * m, np.vstack([np.eye(m), -np.eye(m)]))
    return signed(Sign.UNKNOWN, 0, np.zeros(m))


def _sign(germ: Germ, coefficients: Array, noise: Array, half: int, near: Array) -> Signed:
    """Return the sign of the terms that are not rounding; uncertain terms must not matter."""
    clear = np.where(abs(coefficients) > CLEAR * noise, coefficients, 0.0)
    possible = np.where(abs(coefficients) > ROUNDING * noise, coefficients, 0.0)
    clear[0] = possible[0] = 0.0
    found = sign_near_zero(germ.domain, clear, half)
    firm = np.where(vague(germ, clear, near), 0.0, clear) if half else clear
    for other in (possible, firm):
        if (other != clear).any() and sign_near_zero(germ.domain, other, half).sign != found.sign:
            return signed(Sign.UNKNOWN, 0, found.direction)
    quadratic = not clear[germ.domain.degrees > 2].any()
    if found.sign is Sign.UNKNOWN and half and quadratic:
        return replace(found, sign=Sign.ZERO, degree=2)
    return found


def _centred(germ: Germ, degree: int, same: float) -> tuple[Array, Array] | None:
    """Move a series to where the terms of one degree less vanish; None where that is far."""
    domain, m = germ.domain, germ.domain.variables
    coefficients, noise = germ.coefficients, germ.noise
    lower, here = domain.degrees == degree - 1, domain.degrees == degree
    total = np.zeros(m)
    for _ in range(4):
        if degree == 1 or (abs(coefficients[lower]) <= noise[lower]).all():
            break
        form = np.where(here, coefficients, 0.0)
        slopes = np.array([domain.derivative(form, i)[lower] for i in range(m)]).T
        move = np.linalg.lstsq(slopes, -coefficients[lower], rcond=1e-8)[0]
        total += move
        if abs(total).max() > (same if degree == 2 else MOVE):
            return None
        inverse = np.linalg.pinv(slopes, rcond=1e-8)
        unsure = abs(inverse) @ noise[lower]
        blur = sum(domain.derivative(abs(coefficients), i) * unsure[i] for i in range(m))
        noise = domain.shifted(noise, abs(move)) + blur
        coefficients = domain.shifted(coefficients, move)
    return coefficients, noise


# --------------------------------------------------------------- with weak functions


def _decide_weak(s: Situation) -> Decision:
    basis = s.tangent(s.rows)
    values, vectors = np.linalg.eigh(basis.T @ s.hessian @ basis)
    relaxed = None
    if not len(values) or values[0] >= -s.analysis.small_curvature:
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
    gradients = unit_rows(s.local.gradients[list(s.weak)])
    for way in (*s.flat.T, found.direction, -found.direction):
        if (gradients @ way >= -1e-9).all():
            face = s.face((), way[:, None])
            if s.follow(face, one_sided=True).holds:
                return True
    return False


def _decide_rays(s: Situation, basis: Array) -> Decision | None:
    """Decide along zeros that are isolated rays; None where they are not."""
    gradients = unit_rows(s.local.gradients[list(s.weak)])
    lines, rays, simplicial = cone_rays(gradients @ basis, s.local.tolerances.rank)
    if not simplicial or not s.flat.shape[1]:
        return None
    rays = basis @ rays
    least = 100 * s.local.tolerances.curvature * max(1e-300, float(abs(s.hessian).max()))
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
    germ = reduce_energy(s.problem, s.local.point, s.hessian, face, order_for(1))
    if germ is None:
        return no_decision(s, "the conditions across a direction are singular")
    coefficients = germ.coefficients.copy()
    coefficients[1] = 0.0 if abs(coefficients[1]) <= s.local.small else coefficients[1]
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
    gradients = s.local.gradients[list(rows)]
    if np.linalg.matrix_rank(unit_rows(gradients), tol=s.local.tolerances.rank) < len(rows):
        return no_decision(s, "weakly active functions depend on each other")
    inner = s.tangent(rows)
    values, vectors = np.linalg.eigh(inner.T @ s.hessian @ inner)
    flat = inner @ vectors[:, values <= s.nearly]
    moving = without(flat, symmetric_directions(s.problem, rows)) if flat.size else flat
    face = s.face(s.weak, moving, opened=True)
    if face.variables > MOST:
        return no_decision(s, f"more than {MOST} weak functions and degenerate directions")
    germ = reduce_energy(s.problem, s.local.point, s.hessian, face, order_for(face.variables))
    if germ is None:
        return no_decision(s, "the conditions across these directions are singular")
    found = classify(germ, len(s.weak), s.local.small, s.near(face), s.local.tolerances.same)
    if found.sign is Sign.ZERO and not len(found.zeros):
        unit = np.linalg.lstsq(germ.points[:, 1 : 1 + face.variables], s.flat, rcond=1e-9)[0].T
        unit = np.where(abs(unit) <= 1e-7 * abs(unit).max(axis=1)[:, None], 0.0, unit)
        found = replace(found, zeros=np.asarray(unit, dtype=np.float64))
    decision = concluded(s, face, germ, found, locus=bool(face.still.shape[1]))
    strict = decision.verdict is Verdict.STRICT_MINIMUM
    return replace(decision, verdict=Verdict.WEAK_MINIMUM) if strict else decision
