"""Critical sizes at which the dyad's corner ceases to be a minimum, and the branches beyond.

At the corner three contacts are closed: the inner balls touch each other, and each of them the
other's rod.  The thicker the rods, the less the inner balls overlap along the axis; at a critical
thickness the line between their centres lies across the drum, and neither presses on a rod any
more.  There the corner meets a mountain pass, where the inner balls lie side by side and nothing
else touches; beyond it both are gone, and the pair slides apart along the drum.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER
from polycorner.minimisation import Certificate, Verdict, certify, crossing, stationary_on
from polycorner.toolkit import Array, Value, checked, checks

if TYPE_CHECKING:
    import sympy

Parameter = Literal["rod_radius", "length"]
Station = tuple[float, Certificate]  # a value of the parameter, and the corner there

SYMBOLS = {"rod_radius": "t", "length": "l"}  # their symbols in the formulas
STATIONS = 33
LONGEST = 100.0  # largest length, in ball radii, searched for a critical one
HALVINGS = 40
BESIDE = 1e-4  # distance, in ball radii, from a critical value at which the corner is classified


@dataclass(frozen=True)
class Critical(Value):
    """A pair at whose corner multipliers vanish.

    Attributes
    ----------
    parameter : str
        The size that was varied: ``rod_radius`` or ``length``.
    value : float
        Its critical value, in mm.
    pair : DumbbellPair
        The pair with that value.
    certificate : Certificate
        The corner there.
    contacts : tuple of str
        The contacts whose multipliers vanish.
    minimum_below, minimum_above : bool
        Whether the corner is a minimum just below and just above the critical value.
    """

    parameter: str
    value: float
    pair: DumbbellPair
    certificate: Certificate
    contacts: tuple[str, ...]
    minimum_below: bool
    minimum_above: bool


@checked
def critical_rod_radius(pair: DumbbellPair) -> float | None:
    """Return the rod radius, in mm, at which the dyad's corner stops being a minimum.

    With thinner rods it is a minimum wherever it lies in ``D``; with thicker rods it is not one.
    The pair's own rod radius does not matter.  In the plane and in every drum the value is
    ``2 r sqrt(1 - r^2/l^2) - r`` (:func:`plane_critical_formula`); here it is computed from the
    model.  None if no multiplier changes sign, as for ``l = 2 r``.

    In drums of less than about 2.1 ball radii the point may already be a saddle within its face
    for thinner rods; ``critical_corner(pair).minimum_below`` says whether it is.

    Examples
    --------
    >>> pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
    >>> critical_rod_radius(pair), 6 * math.sqrt(1 - (3 / 16) ** 2) - 3
    (2.8935876, 2.8935876)
    """
    found = critical_corner(pair, "rod_radius")
    return None if found is None else found.value


@checked
def critical_length(pair: DumbbellPair) -> float | None:
    """Return the least length, in mm, at which the dyad's corner is a minimum.

    It is ``2 r^2 / sqrt(4 r^2 - (r + t)^2)``.  None if that is at most two ball radii (rods up to
    ``(sqrt(3) - 1) r``, whose corner is a minimum at every length at which it lies in ``D``), more
    than a hundred ball radii (rods almost as thick as balls), or too long for the drum.
    """
    found = critical_corner(pair, "length")
    return None if found is None else found.value


def critical_corner(
    pair: DumbbellPair, parameter: Parameter = "rod_radius", chirality: Chirality = "R"
) -> Critical | None:
    """Follow the corner with a growing parameter to the first value where a multiplier vanishes.

    The corner is computed at a number of values of ``parameter``, ``"rod_radius"`` or ``"length"``;
    where a multiplier changes sign from one to the next, Newton's method solves the equations of
    the face together with ``lam = 0``.
    """
    checks.choice("parameter", parameter, SYMBOLS)
    values = _stations(pair, parameter)
    corners = [_corner(replace(pair, **{parameter: value}), chirality) for value in values]
    for below, above in pairwise(zip(values, corners, strict=True)):
        for contact in CORNER:
            found = _between(pair, parameter, contact, below, above)
            if found is not None:
                return _critical(pair, parameter, *found, (values[0], values[-1]))
    return None


def _corner(pair: DumbbellPair, chirality: Chirality, start: Array | None = None) -> Certificate:
    """Certify the point of the three-contact face where the energy is stationary."""
    near = pair.nested(chirality, clearance=0.0) if start is None else start
    return stationary_on(pair.polyhedron, pair.energy, near, CORNER)


def _stations(pair: DumbbellPair, parameter: Parameter) -> list[float]:
    """Return increasing values of a parameter, denser where rods are nearly as thick as balls."""
    r = pair.ball_radius
    if parameter == "rod_radius":
        return [r * (1 - share) for share in np.geomspace(0.99, 1e-9, STATIONS).tolist()]
    longest = min(2 * pair.centre_radius, LONGEST * r)
    lengths: list[float] = np.geomspace(2 * r, longest, STATIONS).tolist()
    return lengths


def _regular(found: Certificate) -> bool:
    """Whether a corner lies in ``D`` without further contacts."""
    return found.search is None and set(found.active) == set(CORNER)


def _between(
    pair: DumbbellPair, parameter: Parameter, contact: str, below: Station, above: Station
) -> tuple[float, Array] | None:
    """Return where a multiplier vanishes between two values, and the corner there.

    Between two corners in ``D`` it has to change sign; if the corner at one of the two values is
    not in ``D``, the search is still tried.
    """
    for _ in range(HALVINGS):
        ends = [station for station in (below, above) if _regular(station[1])]
        signs = {station[1].multipliers[contact] > 0 for station in ends}
        if not ends or (len(ends) == 2 and len(signs) == 1):
            return None
        for value, start in ends:
            found = crossing(start, contact, SYMBOLS[parameter])
            if found is not None and below[0] <= value + found.change <= above[0]:
                there = replace(pair, **{parameter: value + found.change})
                if _regular(certify(there.polyhedron, there.energy, found.point)):
                    return value + found.change, found.point
        if len(ends) == 1:
            return None
        middle = (below[0] + above[0]) / 2
        between = _corner(replace(pair, **{parameter: middle}), "R", below[1].point)
        same = between.multipliers.get(contact, 0.0) * below[1].multipliers[contact] > 0
        below, above = ((middle, between), above) if same else (below, (middle, between))
    return None


def _critical(
    pair: DumbbellPair,
    parameter: Parameter,
    value: float,
    point: Array,
    ends: tuple[float, float],
) -> Critical:
    there = replace(pair, **{parameter: value})
    certificate = certify(there.polyhedron, there.energy, point)
    weak = {certificate.problem.polyhedron.names[i] for i in certificate.analysis.weak}
    aside = min(BESIDE * pair.ball_radius, (value - ends[0]) / 2, (ends[1] - value) / 2)
    below, above = (
        _corner(replace(pair, **{parameter: value + step}), "R", point).is_minimum
        for step in (-aside, aside)
    )
    contacts = tuple(name for name in CORNER if name in weak)
    return Critical(parameter, value, there, certificate, contacts, below, above)


def plane_critical_formula(unknown: Parameter = "rod_radius") -> "sympy.Expr":
    """Return the critical rod radius ``t(r, l)`` or length ``l(r, t)`` in the plane, derived.

    With ``s`` the overlap of the inner balls along the axis and ``p = sqrt(4 r^2 - s^2) = r + t``
    the distance of the axes, the equations ``dE = sum lam df`` at the corner are solved for the
    multipliers.  Those of both ball-rod contacts contain ``s cos(theta) - p sin(theta)``, the axial
    component of the line between the inner balls; where it vanishes, stationarity in the heading
    becomes ``l s = 2 r^2``.

    The heading there is ``arcsin(r/l)``, and the outer balls lie on the lowest line.  The same
    values hold in every drum: with inner balls ``2 r`` apart across the drum and outer ones on the
    lowest line, the angle between that line and a rod is ``arccos(r/l)`` in space, too.
    """
    import sympy

    checks.choice("unknown", unknown, SYMBOLS)
    length, r, t, s, p = sympy.symbols("l r t s p", positive=True)
    sine, cosine = sympy.symbols("sine cosine", real=True)
    pressing, turning = _corner_balance(length, s, p, sine, cosine)
    across = {sine: s, cosine: p}  # up to a factor: both expressions are homogeneous in the two
    if sympy.expand(pressing.subs(across)) != 0:
        msg = "the multiplier of a ball-rod contact lacks the factor that the derivation needs"
        raise AssertionError(msg)
    slope = sympy.expand(turning.subs(across) / p).subs(p**2, 4 * r**2 - s**2)
    (overlap,) = sympy.solve(slope, s)
    if unknown == "rod_radius":
        return 2 * r * sympy.sqrt(1 - (overlap / (2 * r)) ** 2) - r
    (found,) = sympy.solve(overlap - s, length)
    return found.subs(s, sympy.sqrt(4 * r**2 - (r + t) ** 2))


def _corner_balance(
    length: "sympy.Symbol",
    s: "sympy.Symbol",
    p: "sympy.Symbol",
    sine: "sympy.Symbol",
    cosine: "sympy.Symbol",
) -> "tuple[sympy.Expr, sympy.Expr]":
    """Return the multiplier of a ball-rod contact and the remaining torque at the corner.

    The axes are along the dumbbells, so that the heading only turns the trough: the lateral
    position of a point is ``cosine x + sine y``.
    """
    import sympy

    q = sympy.symbols("x1 y1 a1 x2 y2 a2", real=True)
    ball = {}
    for name, k, end in (("A1", 0, -1), ("A2", 0, 1), ("B1", 3, -1), ("B2", 3, 1)):
        arm = end * length / 2
        ball[name] = sympy.Matrix(
            [q[k] + arm * sympy.sin(q[k + 2]), q[k + 1] + arm * sympy.cos(q[k + 2])]
        )
    between = ball["A2"] - ball["B1"]
    rods = {"A": ball["A2"] - ball["A1"], "B": ball["B2"] - ball["B1"]}
    distances = sympy.Matrix(
        [
            sympy.sqrt(between.dot(between)),
            sympy.Matrix.hstack(between, rods["B"]).det() / length,
            sympy.Matrix.hstack(between, rods["A"]).det() / length,
        ]
    )
    energy = sympy.Matrix([sum((cosine * b[0] + sine * b[1]) ** 2 for b in ball.values()) / 2])
    half = (-p / 2, (length - s) / 2, 0)
    corner = dict(zip(q, (*(-x for x in half), *half), strict=True))
    lam = sympy.symbols("lam1:4")
    balance = (energy.jacobian(q) - sympy.Matrix([lam]) * distances.jacobian(q)).subs(corner)
    found = sympy.solve([balance[3], balance[4], balance[2] - balance[5]], lam, dict=True)[0]
    return found[lam[1]], balance[2].subs(found)


# ------------------------------------------------------------------------- the pass beside it


def mountain_pass(pair: DumbbellPair, chirality: Chirality = "R") -> Certificate:
    """Return the stationary point at which only the inner balls touch, side by side.

    Its heading is ``arcsin(r/l)`` in the plane, ``sin(theta) = (2 rho/l) sin(arcsin(r/rho)/2)`` in
    a drum, and the outer balls lie on the lowest line, whatever the rods.  While the rods are
    thinner than critical it is a saddle, the pass from the corner to falling apart; thicker ones
    would overlap with the balls (verdict ``OUTSIDE``).
    """
    r, half = pair.ball_radius, pair.length / 2
    if pair.is_plane:
        sine, lateral = r / pair.length, r / 2
    else:
        lateral = math.asin(r / pair.centre_radius) / 2
        sine = pair.centre_radius * math.sin(lateral) / half
    heading = math.asin(sine)
    along = half * math.cos(heading)
    point = np.array([lateral, -along, heading, -lateral, along, heading])
    start = point if chirality == "R" else pair.mirror(point)
    return stationary_on(pair.polyhedron, pair.energy, start, CORNER[:1])


def escape_barrier(pair: DumbbellPair, chirality: Chirality = "R") -> float | None:
    """Return the energy of the pass above the corner; None if the corner is no minimum.

    In mm of height, weights of balls counting one (in the plane mm^2, times ``1/rho``).  It is an
    upper bound of the energy that frees the pair; that no other way out is lower is proved for a
    pair by :func:`~polycorner.dumbbells.pair_landscape`.
    """
    rest, top = _corner(pair, chirality), mountain_pass(pair, chirality)
    if not rest.is_minimum or top.verdict is Verdict.OUTSIDE:
        return None
    return top.energy - rest.energy


@dataclass(frozen=True, eq=False)
class Branch(Value):
    """Stationary points of a pair over its rod radius.

    Attributes
    ----------
    rods : (k,) array
        Rod radii in mm.
    headings : (k,) array
        In degrees.
    gaps : (k,) array
        The smaller gap between a ball and the other's rod, in mm.
    energies : (k,) array
        Above that of the pair end to end on the lowest line.
    minimum : (k,) array of bool
        Whether it is a minimum.
    equilibrium : (k,) array of bool
        Whether it lies in ``D`` and no multiplier is negative: a minimum or a saddle.
    """

    rods: Array
    headings: Array
    gaps: Array
    energies: Array
    minimum: NDArray[np.bool_]
    equilibrium: NDArray[np.bool_]


def branches(pair: DumbbellPair, rods: Iterable[float]) -> tuple[Branch, Branch]:
    """Return the corner and the pass over rod radii in mm: the two branches that meet."""
    models = [replace(pair, rod_radius=float(rod)) for rod in rods]
    corners = [_corner(model, "R") for model in models]
    return _branch(models, corners), _branch(models, [mountain_pass(model) for model in models])


def _branch(models: list[DumbbellPair], found: list[Certificate]) -> Branch:
    places = [models[0].polyhedron.names.index(name) for name in CORNER[1:]]
    kinds = [certificate.verdict for certificate in found]
    each = list(zip(models, found, strict=True))
    return Branch(
        rods=np.array([model.rod_radius for model in models]),
        headings=np.array([math.degrees(model.heading(c.point)[0]) for model, c in each]),
        gaps=np.array([model.polyhedron.values(c.point)[places].min() for model, c in each]),
        energies=np.array([c.energy - m.energy.value(m.end_to_end()) for m, c in each]),
        minimum=np.array([kind.is_minimum for kind in kinds]),
        equilibrium=np.array([kind.is_minimum or kind is Verdict.SADDLE for kind in kinds]),
    )
