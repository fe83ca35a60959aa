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
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells.statics.keel_formulas import force_ratio
from polycorner.toolkit import (
    Array,
    Checked,
    Value,
    cached_property,
    check_fields,
    checks,
    reals,
    scalar,
)

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
