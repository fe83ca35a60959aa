"""Forces on a dumbbell lying in a tilted drum, derived from the height of the wall.

The effect of gravity on the dumbbell is described by the ratio of the force along the wall to the
force onto the wall, in components along ``u_r = (-cos theta, sin theta)``, the direction of
rolling, and along the axis ``u_s = (sin theta, cos theta)``, both in the developed plane
``(R phi, eta)`` ([GMBN] app. A).

Of the printed formulas, the curve ``S``, the limit ``phi_s`` and ``|F_N| = cos alpha cos phi`` are
those derived here.  Two are not.  The angle between force and rolling has the cosine
``F_T . u_r / |F_T|``; the divisor is missing.  The downward field is ``-grad z = F_T + F_N``, as in
section 2 of the paper; the sign is missing.

All angles are in radians.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.formulas import Family
from polycorner.toolkit import Array, reals, scalar, source_key

if TYPE_CHECKING:
    import sympy


TORQUE_SYMBOLS = ("theta", "rho", "weight", "kappa")


@dataclass(frozen=True)
class Derivation:
    """The formulas of [GMBN] app. A as SymPy expressions in ``phi eta theta alpha rho mu``.

    Attributes
    ----------
    height : sympy.Expr
        ``z`` on the surface.
    tangent, normal : tuple of sympy.Expr, sympy.Expr
        ``F_T = -grad z`` along ``phi`` and ``eta``, and the pressure ``|F_N|`` on the wall.
    ratio : tuple of sympy.Expr
        ``F_T / |F_N|`` along ``u_r`` and ``u_s``.
    cosine : sympy.Expr
        Cosine of the angle between ``F_T`` and ``u_r``.
    curve : sympy.Expr
        Heading of the curve ``S``, on which the force has no component along ``u_r``.
    limit : sympy.Expr
        ``phi_s``, beyond which friction ``mu`` holds no dumbbell.
    gravity, lever : sympy.Expr
        Torque of the weight towards larger headings, and torque of two forces along ``u_r`` equal
        to the loads, pushing against ``u_r``: unit ``m g cos alpha l^2 / (2 rho)``, ``m`` of one
        ball, for a dumbbell of length ``l = 2 kappa rho``.
    """

    height: "sympy.Expr"
    tangent: "tuple[sympy.Expr, sympy.Expr]"
    normal: "sympy.Expr"
    ratio: "tuple[sympy.Expr, sympy.Expr]"
    cosine: "sympy.Expr"
    curve: "sympy.Expr"
    limit: "sympy.Expr"
    gravity: "sympy.Expr"
    lever: "sympy.Expr"


@lru_cache(maxsize=1)
def derivation() -> Derivation:
    """Derive the formulas from the height ``z = eta sin alpha - rho cos alpha cos phi``."""
    import sympy

    symbols = sympy.symbols("phi eta theta alpha rho mu", real=True)
    phi, eta, theta, alpha, rho, mu = symbols
    height = eta * sympy.sin(alpha) - rho * sympy.cos(alpha) * sympy.cos(phi)
    east, north = -sympy.diff(height, phi) / rho, -sympy.diff(height, eta)
    normal = -sympy.diff(height, rho)
    rolling = -sympy.cos(theta) * east + sympy.sin(theta) * north
    axial = sympy.sin(theta) * east + sympy.cos(theta) * north
    size = sympy.sqrt(east**2 + north**2)
    # rolling = a cos(theta) - b sin(theta), which vanishes at tan(theta) = a / b
    a, b = rolling.subs(theta, 0), -rolling.subs(theta, sympy.pi / 2)
    square = sympy.Symbol("square", real=True)
    reach = (size**2 - (mu * normal) ** 2).subs(sympy.cos(phi) ** 2, 1 - square)
    (least,) = sympy.solve(reach.subs(sympy.sin(phi) ** 2, square), square)
    return Derivation(
        height,
        (east, north),
        normal,
        (sympy.simplify(rolling / normal), sympy.simplify(axial / normal)),
        rolling / size,
        sympy.atan(sympy.simplify(a / b)),
        sympy.asin(sympy.sqrt(sympy.simplify(least))),
        *_torques(),
    )


def _torques() -> "tuple[sympy.Expr, sympy.Expr]":
    import sympy

    theta, rho, weight, kappa = (sympy.Symbol(s, real=True) for s in TORQUE_SYMBOLS)
    length, unit = 2 * kappa * rho, 2 * kappa**2 * rho * weight
    longer = {sympy.Symbol("l", real=True): length}
    potential = drum_formulas.weight().expression("potential").subs(longer)
    first, second = (drum_formulas.grip().expression(f"load{k}").subs(longer) for k in (1, 2))
    lever = sympy.expand(second - first) * length / 2
    return -sympy.diff(potential, theta) / unit, lever / unit


@lru_cache(maxsize=1)
def family() -> Family:
    """Return ``ratio_r``, ``ratio_s``, ``gravity``, ``lever`` of ``phi theta``, compiled.

    Parameters ``alpha kappa``; see :class:`Derivation`.
    """
    names = ("ratio_r", "ratio_s", "gravity", "lever")
    variables, parameters = ("phi", "theta"), ("alpha", "kappa")
    modules = (dumbbell_formulas.__name__, drum_formulas.__name__, __name__)
    key = repr((source_key(*modules), names))

    def formulas() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
        d = derivation()
        return {}, dict(zip(names, (*d.ratio, d.gravity, d.lever), strict=True))

    return Family(names, variables, parameters, formulas, key)


def force_ratio(phi: ArrayLike, theta: ArrayLike, tilt: float) -> Array:
    """Return ``F_T / |F_N|`` along ``u_r`` and ``u_s``, shape ``(..., 2)``."""
    return _evaluated(phi, theta, tilt, 0.0)[..., :2]


def rolling_cosine(phi: ArrayLike, theta: ArrayLike, tilt: float) -> Any:
    """Return the cosine of the angle between force and ``u_r``; 0 where there is no force."""
    return scalar(_cosine(force_ratio(phi, theta, tilt)))


def s_curve(phi: ArrayLike, tilt: float) -> Any:
    """Return the heading of the line of steepest descent, ``arctan(sin phi / tan alpha)``.

    Gravity does not make a dumbbell that lies along it roll.
    """
    return scalar(np.arctan2(np.sin(reals("phi", phi)), math.tan(tilt)))


def net_torque(
    phi: ArrayLike, theta: ArrayLike, tilt: float, friction: float, slenderness: float = 0.0
) -> Any:
    """Return the torque towards larger headings on a dumbbell that slides down the slope.

    Its balls move as the force points, and friction, ``friction`` times the load on each ball,
    points against it; the lower ball bears the larger load.  The torques of weight and friction
    add up to ``-sin(theta) (cos(phi) cos(theta) + mu sin(phi) cos(angle))`` for a short
    dumbbell, in units of ``m g cos(alpha) l^2 / (2 rho)`` with ``m`` of one ball.  Where it has the
    sign of ``theta``, between the curve ``S`` and ``|theta| = pi/2``, headings grow: the hatched
    region of [GMBN] app. A, which does not say to which motion its torque refers.  At rest and
    while rolling, friction balances the torque and the heading does not change.

    ``slenderness`` is ``l / (2 rho)``.
    """
    found = _evaluated(phi, theta, tilt, slenderness)
    return scalar(found[..., 2] + friction * found[..., 3] * _cosine(found[..., :2]))


def _evaluated(phi: ArrayLike, theta: ArrayLike, tilt: float, slenderness: float) -> Array:
    first, second = np.broadcast_arrays(reals("phi", phi), reals("theta", theta))
    (found,) = family().evaluate(np.stack([first, second], axis=-1), (tilt, slenderness))
    return found


def _cosine(ratio: Array) -> Array:
    size = np.hypot(ratio[..., 0], ratio[..., 1])
    return np.divide(ratio[..., 0], size, out=np.zeros_like(size), where=size > 0)
