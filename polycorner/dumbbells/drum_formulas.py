"""Formulas of motion in a rotating, tilted drum: slips, loads, weight, inertia, gaps.

A dumbbell has the coordinates ``phi``, ``eta``, ``theta`` and its spin ``psi`` about its own axis:
balls and rod are one rigid axle.  Velocities are those in the developed plane ``(rho phi, eta)``:
there ``w = (rho phi', eta')`` is the velocity of the centre, ``u_s = (sin theta, cos theta)`` the
axis and ``u_r = (-cos theta, sin theta)`` the direction of rolling ([GMBN] app. A).  Ball 1 is at
``e = -1`` along the axis, ball 2 at ``e = +1``.  The drum's curvature enters only through the
weight and the loads.  The spin is that relative to the axes ``u_r, u_s``, which turn as the
azimuth grows; the lowest points are ``r`` further out than the centres, so slip velocities differ
from those in the curved drum by a relative amount of order ``r / rho``.

=================  ==============================================================
``theta' > 0``     the axis turns from the meridian towards growing azimuth
``psi' > 0``       rolling without slip moves the centre along ``+u_r``
``surface``        ``omega rho``, the drum's surface moves towards growing azimuth
vertical           positive away from the wall, towards the axis of the drum
=================  ==============================================================
"""

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.formulas import Family
from polycorner.toolkit import Array, checks, source_key

if TYPE_CHECKING:
    import sympy

    Expressions = dict[str, sympy.Expr]
    Formulas = tuple[Expressions, Expressions]
    Vector = tuple[sympy.Expr, sympy.Expr]

Rub = Literal["ball_ball", "ball_rod", "rod_rod"]
BALLS = {1: -1, 2: 1}
SPEEDS = ("phi_dot", "eta_dot", "theta_dot", "psi_dot")
GRIPS = ("slip1_r", "slip1_s", "slip2_r", "slip2_s", "spin", "load1", "load2", "load")
PLACES = tuple(f"{name}{k}" for k in (1, 2) for name in ("phi", "eta", "theta"))
RATES = tuple(f"{name}{k}_dot" for k in (1, 2) for name in ("phi", "eta", "theta", "psi"))


@lru_cache(maxsize=1)
def grip() -> Family:
    """Return slip velocities and normal loads of a dumbbell on the drum.

    ``slip1_r``, ``slip1_s``, ``slip2_r``, ``slip2_s`` are the velocities of the balls' lowest
    points relative to the wall, along ``u_r`` and ``u_s`` (mm/s); ``spin`` is ``r psi'`` (mm/s);
    ``load1``, ``load2`` and their sum ``load`` press on the wall, in the unit of ``weight``.

    Reads ``phi theta phi_dot eta_dot theta_dot psi_dot``; parameters ``l r rho surface weight``
    with ``surface = omega rho`` and ``weight = m g cos alpha``, of one ball.
    """
    parameters = ("l", "r", "rho", "surface", "weight")
    return _family(GRIPS, ("phi", "theta", *SPEEDS), parameters, _grip)


@lru_cache(maxsize=1)
def weight() -> Family:
    """Return the ``potential`` energy of a dumbbell, zero on the axis of the drum at ``eta = 0``.

    Reads ``phi eta theta``; parameters ``l rho weight pull`` with ``weight = m g cos alpha`` and
    ``pull = m g sin alpha``, of one ball.
    """
    parameters = ("l", "rho", "weight", "pull")
    return _family(("potential",), ("phi", "eta", "theta"), parameters, _weight)


@lru_cache(maxsize=1)
def kinetic() -> Family:
    """Return the ``kinetic`` energy of a dumbbell with a massless rod.

    Reads ``phi_dot eta_dot theta_dot psi_dot``; parameters ``l r rho m``, ``m`` of one ball.
    """
    return _family(("kinetic",), SPEEDS, ("l", "r", "rho", "m"), _kinetic)


@lru_cache(maxsize=1)
def floors() -> Family:
    """Return the gaps ``floor1``, ``floor2`` between the balls and the bottom ``eta = 0``.

    Reads ``eta theta``; parameters ``l r``.
    """
    return _family(("floor1", "floor2"), ("eta", "theta"), ("l", "r"), _floors)


@lru_cache(maxsize=3)
def rubs(kind: Rub) -> Family:
    """Return the slip velocity between the surfaces of body 1 and body 2.

    ``tangential`` is the component along ``t = (-n_y, n_x)`` in the developed plane, ``n`` the
    unit normal from body 1 to body 2; ``vertical`` points away from the wall.  Both are linear in
    the velocities and in mm/s.  They refer to a point P half-way between the surfaces.

    ============  ==================================================================
    "ball_ball"   P in the middle between the centres
    "ball_rod"    ball of body 1, rod of body 2; ``n`` is perpendicular to the rod
    "rod_rod"     P where the axes cross, else in the middle between the dumbbells;
                  ``n`` is perpendicular to the bisector of the axes
    ============  ==================================================================

    Balls are thicker than rods, so two rods in the plane cannot touch before a ball touches a
    rod.  In the drum thin rods that cross can, one on the other; parallel rods that touch are the
    limiting case of rods as thick as balls.

    Reads ``PLACES`` and ``RATES`` (azimuths counted in the same turn); parameters
    ``l r t rho e1 e2``, ``e`` being -1 for ball 1 and +1 for ball 2.  ``e2`` is not used by
    "ball_rod", neither of them by "rod_rod".
    """
    formulas = {"ball_ball": _ball_ball, "ball_rod": _ball_rod, "rod_rod": _rod_rod}
    checks.choice("kind", kind, formulas)
    parameters = ("l", "r", "t", "rho", "e1", "e2")
    names = ("tangential", "vertical")
    return _family(names, PLACES + RATES, parameters, formulas[kind], kind)


def inertia(length: float, r: float, rho: float, m: float) -> Array:
    """Return the diagonal of the mass matrix for ``phi eta theta psi``, the Hessian of ``kinetic``.

    Lengths in mm, the mass ``m`` of one ball in g: entries in g mm^2 per squared radian, and in g
    for ``eta``.  There are no other entries.
    """
    at_rest, numbers = np.zeros(len(SPEEDS)), (length, r, rho, m)
    _, _, mass = kinetic().evaluate(at_rest, numbers, 2)
    return np.diagonal(mass[0]).copy()


def _family(
    names: tuple[str, ...],
    variables: tuple[str, ...],
    parameters: tuple[str, ...],
    formulas: "Callable[[], Formulas]",
    kind: str = "",
) -> Family:
    source = source_key(dumbbell_formulas.__name__, __name__)
    key = repr((source, kind, names, variables, parameters))
    return Family(names, variables, parameters, formulas, key)


def _symbols(*names: str) -> "list[sympy.Symbol]":
    import sympy

    return [sympy.Symbol(name, real=True) for name in names]


def _axes(theta: "sympy.Expr") -> "tuple[Vector, Vector]":
    """Return ``u_r`` and ``u_s``."""
    import sympy

    return (-sympy.cos(theta), sympy.sin(theta)), (sympy.sin(theta), sympy.cos(theta))


def _dot(u: "Vector", v: "Vector") -> "sympy.Expr":
    return u[0] * v[0] + u[1] * v[1]


def _at(offset: "Vector", velocity: "Vector", turning: "sympy.Expr") -> "Vector":
    """Return the velocity at an offset from the centre of a rigid body in the plane."""
    return velocity[0] + turning * offset[1], velocity[1] - turning * offset[0]


def _grip() -> "Formulas":
    import sympy

    phi, theta, *speeds = _symbols("phi", "theta", *SPEEDS)
    length, r, rho, surface, heavy = _symbols("l", "r", "rho", "surface", "weight")
    phi_dot, eta_dot, theta_dot, psi_dot = speeds
    rolling, axis = _axes(theta)
    sine, chord = _symbols("sine", "chord")
    definitions: Expressions = {"sine": length * sympy.sin(theta) / (2 * rho)}
    definitions["chord"] = sympy.sqrt(1 - sine**2)
    found: Expressions = {"spin": r * psi_dot, "load": 2 * heavy * sympy.cos(phi) * chord}
    velocity = (rho * phi_dot - surface, eta_dot)
    across, along = (sympy.expand(_dot(velocity, direction)) for direction in (rolling, axis))
    for k, e in BALLS.items():  # which turn about the centre, across the axis
        found[f"slip{k}_r"] = across - e * length * theta_dot / 2 - r * psi_dot
        found[f"slip{k}_s"] = along
        found[f"load{k}"] = heavy * (sympy.cos(phi) * chord - e * sympy.sin(phi) * sine)
    return definitions, found


def _weight() -> "Formulas":
    """Half the energy of two dumbbells at the same place, so that heights are written once."""
    phi, eta, theta, heavy, pull = _symbols("phi", "eta", "theta", "weight", "pull")
    heights = dumbbell_formulas.drum_energy().expression("height")
    here = {"phi1": phi, "phi2": phi, "theta1": theta, "theta2": theta, "R": 0, "w": 0}
    one = heights.subs({s: here[s.name] for s in heights.free_symbols if s.name in here}) / 2
    return {}, {"potential": heavy * one + 2 * pull * eta}


def _kinetic() -> "Formulas":
    """Kinetic energy of two balls that translate, rotate with the axis and spin about it."""
    import sympy

    theta, *speeds = _symbols("theta", *SPEEDS)
    length, r, rho, m = _symbols("l", "r", "rho", "m")
    phi_dot, eta_dot, theta_dot, psi_dot = speeds
    axis = _axes(theta)[1]
    total = sympy.S.Zero
    for e in BALLS.values():
        offset = (e * length / 2 * axis[0], e * length / 2 * axis[1])
        moving = _at(offset, (rho * phi_dot, eta_dot), theta_dot)
        turning = sympy.Rational(2, 5) * m * r**2 * (theta_dot**2 + psi_dot**2)
        total += (m * _dot(moving, moving) + turning) / 2
    return {}, {"kinetic": sympy.trigsimp(sympy.expand(total))}


def _floors() -> "Formulas":
    import sympy

    eta, theta, length, r = _symbols("eta", "theta", "l", "r")
    return {}, {f"floor{k}": eta + e * length * sympy.cos(theta) / 2 - r for k, e in BALLS.items()}


def _placed() -> "tuple[Vector, list[Vector], list[Vector]]":
    """Return the centre of body 2 relative to that of body 1, all ``u_r`` and all ``u_s``."""
    phi1, eta1, theta1, phi2, eta2, theta2, rho = _symbols(*PLACES, "rho")
    rolling, axes = zip(_axes(theta1), _axes(theta2), strict=True)
    return (rho * (phi2 - phi1), eta2 - eta1), list(rolling), list(axes)


def _rubbing(definitions: "Expressions") -> "Formulas":
    """Return the velocities from definitions of ``Px Py`` (relative to body 1) and ``nx ny``."""
    rho, point, normal = *_symbols("rho"), _symbols("Px", "Py"), _symbols("nx", "ny")
    apart, rolling, _ = _placed()
    tangential, vertical = [], []
    for k, centre in ((1, (0, 0)), (2, apart)):
        phi_dot, eta_dot, theta_dot, psi_dot = _symbols(*RATES[4 * k - 4 : 4 * k])
        offset = (point[0] - centre[0], point[1] - centre[1])
        moving = _at(offset, (rho * phi_dot, eta_dot), theta_dot)
        tangential.append(_dot(moving, (-normal[1], normal[0])))
        vertical.append(-psi_dot * _dot(offset, rolling[k - 1]))
    rates = {"tangential": tangential, "vertical": vertical}
    return definitions, {name: first - second for name, (first, second) in rates.items()}


def _ball_ball() -> "Formulas":
    import sympy

    length, first, second = _symbols("l", "e1", "e2")
    apart, _, (axis1, axis2) = _placed()
    x, y, distance = _symbols("x", "y", "distance")
    definitions: Expressions = {}
    for i, name in enumerate("xy"):
        start = length * first * axis1[i] / 2
        end = apart[i] + length * second * axis2[i] / 2
        definitions[name], definitions[f"P{name}"] = end - start, (start + end) / 2
    definitions["distance"] = sympy.sqrt(x**2 + y**2)
    return _rubbing(definitions | {"nx": x / distance, "ny": y / distance})


def _ball_rod() -> "Formulas":
    """``side`` is the coordinate across the rod of its axis, relative to the ball."""
    import sympy

    length, r, t, first = _symbols("l", "r", "t", "e1")
    apart, (_, across), (axis, _) = _placed()
    ball = (length * first * axis[0] / 2, length * first * axis[1] / 2)
    (side,) = _symbols("side")
    definitions: Expressions = {"side": _dot((apart[0] - ball[0], apart[1] - ball[1]), across)}
    sign = sympy.Piecewise((-1, side < 0), (1, True))
    reach = (side + sign * (r - t)) / 2
    for i, name in enumerate("xy"):
        definitions[f"n{name}"] = sign * across[i]
        definitions[f"P{name}"] = ball[i] + reach * across[i]
    return _rubbing(definitions)


def _rod_rod() -> "Formulas":
    """``c_1 + a u_1 = c_2 + b u_2``, where the axes cross, has ``a = along1 / sine``."""
    import sympy

    (length,) = _symbols("l")
    apart, rolling, axes = _placed()
    names = ("same", "mx", "my", "size", "side", "sine", "along1", "along2")
    same, mx, my, size, side, sine, *along = _symbols(*names)
    definitions: Expressions = {
        "same": sympy.Piecewise((-1, _dot(*axes) < 0), (1, True)),
        "mx": rolling[0][0] + same * rolling[1][0],
        "my": rolling[0][1] + same * rolling[1][1],
        "side": sympy.Piecewise((-1, apart[0] * mx + apart[1] * my < 0), (1, True)),
        "size": side * sympy.sqrt(mx**2 + my**2),
        "nx": mx / size,
        "ny": my / size,
        "sine": _dot(axes[0], rolling[1]),
        "along1": _dot(apart, rolling[1]),
        "along2": _dot(apart, rolling[0]),
    }
    inside = [2 * sympy.Abs(a) <= length * sympy.Abs(sine) for a in along]
    crossing = sympy.And(sympy.Abs(sine) > 0, *inside)
    for i, name in enumerate("xy"):
        cross = along[0] / sine * axes[0][i]
        definitions[f"P{name}"] = sympy.Piecewise((cross, crossing), (apart[i] / 2, True))
    return _rubbing(definitions)
