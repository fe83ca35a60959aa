"""Minimum or not where the second order vanishes: higher orders along curved directions.

On the face of the strongly active functions the energy is reduced to a power series in the
directions in which the second order vanishes (:mod:`~polycorner.minimisation.germs`), whose
sign near 0 decides (:mod:`~polycorner.minimisation.signs`).  By metric regularity of the face, a
point is a minimum on the polyhedron if it is one on the face: off it, the energy grows to first
order, faster than anything changes on it.
"""

from dataclasses import dataclass, replace

import numpy as np

from polycorner.minimisation.constancy import (
    Constancy,
    constancy,
    orthonormal,
    symmetric_directions,
    without,
)
from polycorner.minimisation.germs import (
    CLEAR,
    MOVE,
    ROUNDING,
    Face,
    Germ,
    missed,
    reduce_energy,
    vague,
)
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.signs import Sign, Signed, sign_near_zero, signed
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Value

ORDERS = {1: 16, 2: 10, 3: 8, 4: 6}  # degree of the series by its number of variables
ORDER, MOST = 4, 12  # the degree beyond, and the most variables
FAR = 0.5  # distance in scale units over which constancy suffices in brief


@dataclass(frozen=True, eq=False)
class Situation(Value):
    """A stationary point at which the second order vanishes in some directions.

    Attributes
    ----------
    problem, tolerances, point, piece
        The problem, the tolerances, the point, and the inequalities that hold near it.
    rows : tuple of int
        Strongly active functions with independent gradients, and equations.
    multipliers : (p,) array
        ``dE/df`` of each.
    exact : bool
        Whether the face of ``rows`` lies in the polyhedron, as far as weak functions allow;
        otherwise it only contains the true face.
    weak : tuple of int
        Active functions with zero multipliers.
    hessian : (n, n) array
        Of the Lagrangian, in scaled coordinates.
    flat : (n, r) array
        Directions of the critical cone in which its form vanishes.
    reference, small, small_curvature, nearly : float
        The size of the energy, and of first and second derivatives that count as zero.
    brief : bool
        Whether constancy over a distance suffices, without a series.
    """

    problem: Problem
    tolerances: Tolerances
    point: Array
    piece: Piece
    rows: tuple[int, ...]
    multipliers: Array
    exact: bool
    weak: tuple[int, ...]
    hessian: Array
    flat: Array
    reference: float
    small: float
    small_curvature: float
    nearly: float
    brief: bool

    def tangent(self, rows: tuple[int, ...]) -> Array:
        """Return an orthonormal basis of the directions tangent to functions."""
        gradients = self.problem.evaluate(self.point, 1)[1]
        if not rows:
            return np.eye(len(self.point))
        return null_space(gradients[list(rows)], self.tolerances.rank)

    def near(self, face: Face) -> Array:
        """Return how much each variable of a face may differ within the tolerance of the point."""
        opened = self.problem.evaluate(self.point, 1)[1][[face.rows[i] for i in face.opened]]
        sizes = np.concatenate([np.linalg.norm(opened, axis=1), np.ones(face.moving.shape[1])])
        return np.asarray(self.small / self.reference * sizes)

    def face(self, closed: tuple[int, ...], moving: Array, *, opened: bool = False) -> Face:
        """Return the face on which further functions are closed, or opened as variables."""
        rows = self.rows + closed
        multipliers = np.concatenate([self.multipliers, np.zeros(len(closed))])
        still = symmetric_directions(self.problem, rows)
        still = without(still, moving) if moving.shape[1] else still
        positions = tuple(range(len(self.rows), len(rows))) if opened else ()
        return Face(rows, multipliers, positions, moving, still)


@dataclass(frozen=True, eq=False)
class Decision(Value):
    """What higher orders decide.

    Attributes
    ----------
    verdict : Verdict
        Minimum, minimum along a locus, saddle or undecided.
    degree : int
        Degree of the terms that decide, 0 where none does.
    order : int
        Degree to which the energy was expanded, 0 where it was not.
    direction : (n,) array
        Where they decide, tangent to the curve followed, in scaled coordinates.
    reason : str
        What stands in the way where nothing is decided; how constancy is known.
    followed : Constancy or None
        How far a locus was followed.
    """

    verdict: Verdict
    degree: int
    order: int
    direction: Array
    reason: str
    followed: Constancy | None = None


def undecided(n: int, reason: str, order: int = 0) -> Decision:
    """Return that nothing is decided in ``n`` dimensions, and why."""
    return Decision(Verdict.UNDECIDED, 0, order, np.zeros(n), reason)


def no_decision(s: Situation, reason: str, order: int = 0) -> Decision:
    """Return that nothing is decided, and why."""
    return undecided(len(s.point), reason, order)


def order_for(variables: int) -> int:
    """Return the degree to which a series in so many variables is computed."""
    return ORDERS.get(variables, ORDER)


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
    if s.brief:
        seen = constancy(
            s.problem,
            s.piece.difference(s.weak),
            s.point,
            face,
            s.tolerances,
            one_sided=False,
            reference=1e-300,  # where an energy decays, its own size tells that it changes
            least=FAR,
        )
        if seen.holds:
            return Decision(Verdict.MINIMUM_ALONG_LOCUS, 0, 0, moving[:, 0], "followed", seen)
    germ = reduce_energy(s.problem, s.point, s.hessian, face, order_for(moving.shape[1]))
    if germ is None:
        return no_decision(s, "the conditions across these directions are singular")
    found = classify(germ, 0, s.small, s.near(face), s.tolerances.same)
    return concluded(s, face, germ, found, locus=bool(still.shape[1]))


def symmetric(flat: Array) -> Decision:
    """Conclude along directions in which nothing ever changes."""
    reason = "nothing changes along it anywhere: all derivatives vanish at random points"
    return Decision(
        Verdict.MINIMUM_ALONG_LOCUS, 0, 0, flat[:, 0], reason, Constancy(np.inf, 0.0, followed=True)
    )


def concluded(
    s: Situation, face: Face, germ: Germ, found: Signed, *, locus: bool = False
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


def follow_zeros(face: Face, s: Situation, germ: Germ, found: Signed) -> Decision:
    """Follow the zeros of a reduced energy that is not negative."""
    half, order = len(face.opened), germ.domain.order
    whole = found.degree == 0 and not half
    ways = [(face, False)] if whole else [(_arc(face, s, germ, z), True) for z in found.zeros]
    seen = [
        constancy(
            s.problem, s.piece, s.point, arc, s.tolerances, one_sided=side, reference=s.reference
        )
        for arc, side in ways
    ]
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
    seen = constancy(
        s.problem, s.piece, s.point, face, s.tolerances, one_sided=False, reference=s.reference
    )
    if not seen.holds:
        return no_decision(s, reason)
    reason = f"{reason}; constant to rounding as far as it was followed"
    direction = face.moving[:, 0]
    return Decision(Verdict.MINIMUM_ALONG_LOCUS, 0, 0, direction, reason, seen)


def _arc(face: Face, s: Situation, germ: Germ, zero: Array) -> Face:
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
    miss, fall = s.tolerances.zero / 10, 10 * s.tolerances.rounding * (abs(level) + s.reference)
    for t in 0.5 ** np.arange(1, 20):
        u = germ.point(t ** np.array(found.weights) * found.direction)
        values, gradients = s.problem.evaluate(u * s.problem.scales, 1)
        away = distances(values[:-1], gradients[:-1])
        m = s.problem.inequalities
        inside = (away[sorted(s.piece)] >= -miss).all() and (abs(away[m:]) <= miss).all()
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
