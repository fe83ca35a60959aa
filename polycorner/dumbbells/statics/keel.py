"""The keel effect: regions of rest of a dumbbell on a tilted drum, and its turning points.

A dumbbell rolls more easily than it slides.  It stays at rest while the ratio of the force along
the wall to the force onto the wall lies in one convex set: the disc of radius ``mu_s``, cut by the
strip ``|ratio_r| <= mu_r`` in the direction of rolling.  The two cases of [GMBN] app. A are its
sides; they meet where ``sin epsilon = mu_r / mu_s``.  Three things differ from what is printed:

- The angle with the direction of rolling needs ``|cos| = |F_T . u_r| / |F_T|``.  Without ``|F_T|``
  the first case never occurs if ``mu_r sqrt(1 + mu_s^2) > mu_s^2``, as for the measured 0.1 and
  0.3, and no dumbbell would roll before it slides.
- Without the absolute value a dumbbell that is pulled against ``u_r`` would be held by ``mu_s``,
  and the region would not have the symmetry ``(phi, theta) -> (-phi, -theta)`` that the paper uses.
- The region is closed.  Its eastern boundary, the points that arbitrarily small turns of the drum
  carry out of the region, would be empty with the printed strict inequalities.

All angles are in radians.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.formulas import Family
from polycorner.toolkit import (
    Array,
    Checked,
    Value,
    cached_property,
    check_fields,
    checks,
    reals,
    scalar,
    source_key,
)

if TYPE_CHECKING:
    import sympy

# The effect of gravity on the dumbbell is described by the ratio of the force along the wall to the
# force onto the wall, in components along ``u_r = (-cos theta, sin theta)``, the direction of
# rolling, and along the axis ``u_s = (sin theta, cos theta)``, both in the developed plane ``(R
# phi, eta)`` ([GMBN] app. A).
#
# Of the printed formulas, the curve ``S``, the limit ``phi_s`` and ``|F_N| = cos alpha cos phi``
# are those derived here. Two are not. The angle between force and rolling has the cosine ``F_T .
# u_r / |F_T|``; the divisor is missing. The downward field is ``-grad z = F_T + F_N``, as in
# section 2 of the paper; the sign is missing.
#
# All angles are in radians.

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


BISECTIONS = 60  # these bracket an azimuth in a quarter turn to one unit in the last place


@dataclass(frozen=True)
class RestRegion(Checked):
    """All ``(phi, theta)`` at which friction holds a dumbbell: ``A`` or ``B`` of [GMBN] app. A.

    The dumbbell is short, its length small against the radius of the drum; for the region of one of
    finite length see :func:`rests`, which differs by a share of the order ``(l / 2 rho)^2``.

    Parameters
    ----------
    tilt : float
        Angle ``alpha`` of the drum's axis with the horizontal, ``|alpha| < pi/2``.
    rolling, sliding : float
        ``0 < mu_r <= mu_s``; the static ones give ``A``, the dynamic ones ``B``.
    """

    tilt: float
    rolling: float
    sliding: float

    def __post_init__(self) -> None:
        quarter = math.pi / 2
        tilt = checks.real("tilt", self.tilt, above=-quarter, below=quarter, unit="radians")
        sliding = checks.real("sliding", self.sliding, above=0)
        rolling = checks.real("rolling", self.rolling, above=0, most=sliding)
        for name, number in (("tilt", tilt), ("rolling", rolling), ("sliding", sliding)):
            object.__setattr__(self, name, number)
        super().__post_init__()

    @property
    def limit(self) -> float:
        """``phi_s``: no dumbbell rests at larger ``|phi|``; nan if none rests anywhere."""
        square = (self.sliding**2 - math.tan(self.tilt) ** 2) / (1 + self.sliding**2)
        return math.asin(math.sqrt(square)) if square >= 0 else math.nan

    def margin(self, phi: ArrayLike, theta: ArrayLike) -> Any:
        """Return the distance of the force ratio from leaving disc or strip; at least 0 at rest."""
        ratio = force_ratio(phi, theta, self.tilt)
        in_disc = self.sliding - np.hypot(ratio[..., 0], ratio[..., 1])
        margin = np.minimum(in_disc, self.rolling - abs(ratio[..., 0]))
        return scalar(np.where(np.cos(phi) > 0, margin, -np.inf))

    def contains(self, phi: ArrayLike, theta: ArrayLike) -> Any:
        """Return whether a dumbbell at rest stays there."""
        return self.margin(phi, theta) >= 0

    def azimuths(self, theta: ArrayLike) -> tuple[Any, Any]:
        """Return the least and the largest azimuth of rest for each heading; nan if there is none.

        All azimuths in between are azimuths of rest, too: ``|phi| <= phi_s`` and
        ``cos(theta) sin(phi) -+ mu_r cos(phi) <= (>=) tan(alpha) sin(theta)`` are each an interval.
        """
        low, high = self._ends(reals("theta", theta))
        west, east = low.max(axis=0), high.min(axis=0)
        empty = ~(west <= east)
        return scalar(np.where(empty, np.nan, west)), scalar(np.where(empty, np.nan, east))

    def eastern_boundary(self, theta: ArrayLike) -> Any:
        """Return the azimuth at which a turning drum carries a dumbbell out of the region."""
        return self.azimuths(theta)[1]

    def rolls_back(self, theta: ArrayLike) -> Any:
        """Return whether the dumbbell starts to roll westwards at the eastern boundary.

        Otherwise it slides, or rolls on down the axis of the drum.
        """
        heading = reals("theta", theta)
        high, found = self._ends(heading)[1], np.isfinite(self.eastern_boundary(heading))
        return scalar(found & (high[1] <= high[0]))

    def _ends(self, theta: Array) -> tuple[Array, Array]:
        """Return the intervals given by the disc and by both sides of the strip."""
        cosine = abs(np.cos(theta))
        sine = np.sin(theta) * np.where(np.cos(theta) < 0, -1.0, 1.0)
        lag = np.arctan2(self.rolling, cosine)
        level = math.tan(self.tilt) * sine / np.hypot(cosine, self.rolling)
        lift = np.arcsin(np.where(abs(level) <= 1, level, np.nan))
        limit = np.full_like(lift, self.limit)
        low = np.array([-limit, lag - lift - math.pi, lift - lag])
        high = np.array([limit, lift + lag, math.pi - lift - lag])
        return low, high


@dataclass(frozen=True)
class Turning(Value):
    """Turning points of a carried dumbbell of given headings; arrays like the headings.

    Attributes
    ----------
    upper : float or array
        Azimuth at which the drum's turning takes it out of ``A``.
    lower : float or array
        Azimuth at which it stops when rolling without inertia, the pull having fallen to the
        dynamic rolling resistance; nan if it does not stop.  There it enters ``B``, unless ``B`` is
        bounded by sliding at that heading: then it stops, and rests, before it.
    coasting : float or array
        Azimuth at which it stops once rolling resistance has used up the energy gained above
        ``lower``; nan if it rolls out of ``A`` or does not stop.
    rolls : bool or array
        Whether it leaves ``A`` by rolling back west.
    climb : float or array
        Rise in ``eta`` from ``upper`` to ``lower``, in units of the radius ``rho``.  Being carried
        takes ``(upper - lower) / omega``, so that it climbs at the mean speed
        ``omega rho tan(theta)``, whatever the friction and however far it coasts.
    """

    upper: Any
    lower: Any
    coasting: Any
    rolls: Any
    climb: Any


@dataclass(frozen=True)
class Keel(Checked):
    """Friction of a dumbbell in a tilted drum, before and after it starts to move.

    Parameters
    ----------
    tilt : float
        Angle ``alpha`` of the drum's axis, in radians.
    rolling, sliding : float
        Static coefficients ``mu_r <= mu_s``, as ratios of forces.
    rolling_dynamic, sliding_dynamic : float
        Dynamic coefficients, at most the static ones.

    Examples
    --------
    >>> keel = Keel(math.radians(7), 0.1, 0.3, 0.05, 0.2)
    >>> degrees = np.degrees(keel.onset.azimuths(math.radians(10)))
    >>> degrees.round(2).tolist()
    [-4.56, 7.03]
    """

    tilt: float
    rolling: float
    sliding: float
    rolling_dynamic: float
    sliding_dynamic: float

    def __post_init__(self) -> None:
        check_fields(self)
        with checks.about("rolling_dynamic, sliding_dynamic"):
            inner = self.arrest
        outer = self.onset
        if inner.rolling > outer.rolling or inner.sliding > outer.sliding:
            got = f"{inner.rolling}, {inner.sliding} above {outer.rolling}, {outer.sliding}"
            msg = f"rolling_dynamic, sliding_dynamic: expected at most the static ones; got {got}"
            raise ValueError(msg)
        super().__post_init__()

    @cached_property
    def onset(self) -> RestRegion:
        """``A``: a dumbbell at rest stays at rest."""
        return RestRegion(self.tilt, self.rolling, self.sliding)

    @cached_property
    def arrest(self) -> RestRegion:
        """``B``: a dumbbell at rest stays at rest even when nudged."""
        return RestRegion(self.tilt, self.rolling_dynamic, self.sliding_dynamic)

    @property
    def is_ordered(self) -> bool:
        """Whether ``mu_r_dyn < mu_r < tan(alpha) < mu_s_dyn < mu_s``, as in the experiment."""
        slope = math.tan(self.tilt)
        numbers = (self.rolling_dynamic, self.rolling, slope, self.sliding_dynamic, self.sliding)
        return all(a < b for a, b in pairwise(numbers))

    def turning(self, theta: ArrayLike) -> Turning:
        """Return the turning points of a dumbbell of heading ``theta``."""
        heading = reals("theta", theta)
        rolls = np.asarray(self.onset.rolls_back(heading))
        upper = np.asarray(self.onset.eastern_boundary(heading))
        # rolling balls do not slip, so on the axis static friction holds until it stops
        stopping = RestRegion(self.tilt, self.rolling_dynamic, self.sliding)
        lower = np.where(rolls, stopping.eastern_boundary(heading), np.nan)
        coasting = self._coasting(heading, upper, lower)
        climb = np.tan(heading) * (upper - lower)
        return Turning(*(scalar(x) for x in (upper, lower, coasting, rolls, climb)))

    def _coasting(self, theta: Array, upper: Array, lower: Array) -> Array:
        """Return where the energy gain, zero at ``upper``, largest at ``lower``, is zero again."""
        west = np.where(np.isfinite(lower), np.asarray(self.onset.azimuths(theta)[0]), np.nan)
        start = self._work(theta, upper)
        west = np.where(self._work(theta, west) < start, np.nan, west)
        east = lower
        for _ in range(BISECTIONS):
            middle = (west + east) / 2
            beyond = self._work(theta, middle) >= start
            west, east = np.where(beyond, middle, west), np.where(beyond, east, middle)
        return (west + east) / 2

    def _work(self, theta: Array, phi: Array) -> Array:
        """Return an integral of ``(ratio_r - mu_r) cos(phi)``, force less resistance, over phi."""
        turned = np.where(np.cos(theta) < 0, -1.0, 1.0)
        pull = math.tan(self.tilt) * np.sin(theta) * turned
        gained: Array = -np.cos(phi) * abs(np.cos(theta)) - phi * pull
        return gained - self.rolling_dynamic * np.sin(phi)


def rest_margin(phi: ArrayLike, theta: ArrayLike, region: RestRegion, slenderness: float) -> Any:
    """Return the margin by which friction holds a dumbbell of finite length; at least 0 at rest.

    Two balls press on the drum with their own loads ``N_1, N_2``; the torque of the weight on the
    heading has to be balanced by forces ``f_i``, ``|f_i| <= mu_s N_i``, and a rolling torque of at
    most ``mu_r r (N_1 + N_2)``.  The balances along ``u_r`` and of the torques determine the
    components of ``f_1`` and ``f_2`` along ``u_r``; these leave
    ``c_i = sqrt((mu_s N_i)^2 - f_ir^2)`` along the axis, where only the sum is determined: the
    dumbbell rests if ``|G_s| <= c_1 + c_2`` and ``|G_r| <= mu_r (N_1 + N_2)``.  The margin is the
    smaller slack over ``N_1 + N_2``.

    ``slenderness`` is ``kappa = l / (2 rho)``, ``0 <= kappa < 1``; at 0 the margin is that of
    ``region``, but for its scale inside the disc.  Loads are those of the weight alone: axial
    friction acts below the axis and moves a share ``r / l`` of itself from ball to ball.  That is
    neglected; it enters in second order and only where sliding bounds the region.
    """
    checks.real("slenderness", slenderness, least=0, below=1)
    force, loads, couple = _acting(phi, theta, region.tilt, slenderness)
    total = np.where((loads > 0).all(axis=-1), loads.sum(axis=-1), np.nan)
    across = abs(-force[..., :1] / 2 + couple[..., None] * np.array([-1, 1]))
    grip = region.sliding * loads
    spare = (grip - across).min(axis=-1)
    left = np.sqrt(np.maximum(grip**2 - across**2, 0.0)).sum(axis=-1) - abs(force[..., 1])
    slack = np.minimum(
        np.where(spare < 0, spare, left), region.rolling * total - abs(force[..., 0])
    )
    return scalar(slack / total)


def _acting(
    phi: ArrayLike, theta: ArrayLike, tilt: float, slenderness: float
) -> tuple[Array, Array, Array]:
    """Return gravity along ``u_r, u_s`` ``(..., 2)``, loads ``(..., 2)`` and yaw torque over ``l``.

    Forces in units of ``m g cos(alpha)``.
    """
    azimuth, heading = np.broadcast_arrays(reals("phi", phi), reals("theta", theta))
    at = np.stack([azimuth, 0 * azimuth, heading], axis=-1).reshape(-1, 3)
    sizes = 2 * slenderness, 1.0, 1.0, math.tan(tilt)
    slopes = drum_formulas.weight().evaluate(at, sizes, 1)[1]
    east, north, yaw = -slopes[:, 0].T
    moving = np.zeros((len(at), 6))
    moving[:, :2] = at[:, [0, 2]]
    (grip,) = drum_formulas.grip().evaluate(moving, (2 * slenderness, 0.0, 1.0, 0.0, 1.0))
    sine, cosine = np.sin(at[:, 2]), np.cos(at[:, 2])
    force = np.stack([sine * north - cosine * east, sine * east + cosine * north], axis=-1)
    loads = grip[:, [drum_formulas.GRIPS.index(f"load{k}") for k in (1, 2)]]
    couple = yaw / (2 * slenderness) if slenderness else 0 * yaw
    shape = azimuth.shape
    return force.reshape(*shape, 2), loads.reshape(*shape, 2), couple.reshape(shape)


def exact_eastern_boundary(theta: ArrayLike, region: RestRegion, slenderness: float) -> Any:
    """Return the azimuth at which a dumbbell of finite length is carried out of its region of rest.

    Found by bisection between the middle of the interval that ``region`` gives for a short one,
    where it has to rest (else nan), and the azimuth at which a ball would leave the drum.
    """
    heading = reals("theta", theta)
    inside = np.asarray(sum(region.azimuths(heading)) / 2)
    inside = np.where(rests(inside, heading, region, slenderness), inside, np.nan)
    outside = np.full_like(inside, math.acos(slenderness))
    for _ in range(BISECTIONS):
        middle = (inside + outside) / 2
        held = rests(middle, heading, region, slenderness)
        inside, outside = np.where(held, middle, inside), np.where(held, outside, middle)
    return scalar(inside)


def rests(phi: ArrayLike, theta: ArrayLike, region: RestRegion, slenderness: float) -> Any:
    """Return whether friction can hold a dumbbell of finite length; exact in ``kappa``."""
    return rest_margin(phi, theta, region, slenderness) >= 0
