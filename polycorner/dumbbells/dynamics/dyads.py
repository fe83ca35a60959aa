"""Dyads driven by the rotating drum: headings, climbing, lifetimes, and what turns them.

Nested pairs start at chosen headings and move under noise, many in one simulation, far apart from
each other.  Their heading is compared with the minimiser of the energy, in which friction does not
occur ([GMBN] sec. 7); nothing is fitted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum, drum_of
from polycorner.dumbbells.dynamics.pairs import DumbbellLengths, chirality, gaps
from polycorner.dumbbells.dynamics.singles import APART, Mean
from polycorner.dumbbells.formulas import CONTACTS
from polycorner.dumbbells.pair import Chirality
from polycorner.motion import Noise, Solver, Trajectory, simulate
from polycorner.toolkit import SHORTEST_STEP, Array, Value, cached_property, real

Start = tuple[Chirality, float]
SOLVER = Solver(tolerance=1e-6, sweeps=300)
TOUCH = 0.01  # mm, below which a gap counts as a contact
CLEARANCE = 0.05  # mm, between the dumbbells of a pair at the start


def handedness(drum: DumbbellDrum, q: Array) -> NDArray[np.int64]:
    """Return the chirality of pairs: +1 right, -1 left, 0 not defined.

    By :func:`polycorner.dumbbells.dynamics.pairs.chirality`.

    Parameters
    ----------
    drum : DumbbellDrum
    q : (..., 2, k) array
        Placements of A and B, beginning with ``phi, eta, theta``.
    """
    return chirality(DumbbellLengths.of_drum(drum).balls(q).reshape(*q.shape[:-2], 4, 2))


@dataclass(frozen=True, eq=False)
class DyadPaths(Value):
    """Analysis of the trajectory of ``n`` pairs, far apart from each other.

    Attributes
    ----------
    trajectory : Trajectory
        Of dumbbells in a drum: 0 and 1 are the first pair, 2 and 3 the second, ...; pairs are
        multiples of ``APART`` apart along the axis.
    first, last : int or None, optional
        Numbers of the first of the ``2 n`` dumbbells and of that after the last; default all.
    """

    trajectory: Trajectory
    first: int | None = None
    last: int | None = None

    @cached_property
    def drum(self) -> DumbbellDrum:
        """The drum with the two dumbbells of one pair."""
        return replace(drum_of(self.trajectory), count=2)

    @property
    def noise(self) -> Noise:
        """The noise."""
        return self.trajectory.noise

    @property
    def times(self) -> Array:
        """Times of the records, ``(T,)``."""
        return self.trajectory.times

    @cached_property
    def q(self) -> Array:
        """``phi, eta, theta, psi`` of both dumbbells, ``(T, n, 2, 4)``.

        ``eta`` is counted from the multiple of ``APART`` at which the pair started.
        """
        path = self.trajectory
        q = path.q[:, self.first : self.last].reshape(len(path), -1, 2, 4).copy()
        q[..., 1] -= APART * np.round(q[0, :, :, 1].mean(axis=1) / APART)[:, None]
        q.setflags(write=False)
        return q

    @property
    def signs(self) -> NDArray[np.int64]:
        """+1 for pairs that start right-handed, or without a chirality, and -1 for others."""
        return np.where(self.hand[0] < 0, -1, 1)

    @cached_property
    def heading(self) -> Array:
        """Mean heading of each pair, ``(T, n)``, in rad; it follows the motion continuously."""
        return np.asarray(self.q[..., 2].mean(axis=-1))

    @cached_property
    def eta(self) -> Array:
        """Mean axial position, ``(T, n)``, in mm."""
        return np.asarray(self.q[..., 1].mean(axis=-1))

    @cached_property
    def azimuth(self) -> Array:
        """Mean azimuth, ``(T, n)``, in rad."""
        return np.asarray(self.q[..., 0].mean(axis=-1))

    @cached_property
    def shift(self) -> Array:
        """Shift of the dumbbells along their mean axis, ``(T, n)``, in mm."""
        apart = self.q[..., 1, :] - self.q[..., 0, :]
        across = self.drum.centre_radius * apart[..., 0]
        along = across * np.sin(self.heading) + apart[..., 1] * np.cos(self.heading)
        return np.asarray(np.abs(along))

    @cached_property
    def hand(self) -> NDArray[np.int64]:
        """Chirality, ``(T, n)``: +1 right, -1 left, 0 not defined."""
        return handedness(self.drum, self.q)

    @cached_property
    def contacts(self) -> NDArray[np.bool_]:
        """Mask of the nine gaps that are closed to within 0.01 mm, ``(T, n, 9)``."""
        return gaps(self.drum, self.q) < TOUCH

    def strata(self, *, after: float = 0.0, touch: float = TOUCH) -> dict[str, float]:
        """Return shares of time by the contacts that touch, commonest first.

        Ball-ball contacts count as ``ball``, ball-rod ones as ``rod`` and rod-rod as ``cross``, so
        the nested corner is ``ball rod rod``, whatever the numbering.  A gap below ``touch``, in
        mm, counts as a contact.
        """
        kinds = np.array([_kind(name) for name in CONTACTS])
        closed = gaps(self.drum, self.q[self.times >= after]) < touch
        closed = closed.reshape(-1, len(CONTACTS))
        names = [" ".join(sorted(kinds[row])) or "none" for row in closed]
        found = {name: names.count(name) / len(names) for name in set(names)}
        return dict(sorted(found.items(), key=lambda item: (-item[1], item[0])))

    @property
    def relaxation_time(self) -> float:
        """Time after which headings have come together to 1/e of their first spread, in s.

        The spread is the standard deviation over the pairs of one run that held to the end; inf if
        it remains larger, nan for fewer than two pairs.
        """
        heading = (self.signs * self.heading)[:, np.isinf(self.lifetimes)]
        if heading.shape[1] < 2:
            return math.nan
        spread = heading.std(axis=1)
        near = spread <= spread[0] / math.e
        return float(self.times[np.argmax(near)]) if near.any() else math.inf

    @property
    def lifetimes(self) -> Array:
        """Time for which each pair stayed close and kept its chirality, ``(n,)``; inf: to the end.

        Near means centres closer than ``l + 2 r`` in the developed plane.
        """
        sizes = DumbbellLengths.of_drum(self.drum)
        apart = sizes.apart(self.q[..., 0, :], self.q[..., 1, :])
        lost = (apart >= sizes.reach) | (self.hand != self.hand[0])
        when = self.times[np.argmax(lost, axis=0)]
        return np.where(lost.any(axis=0), when, math.inf)

    def climb_rates(self, *, after: float = 0.0) -> Array:
        """Return the mean rise per time from ``after`` on, ``(n,)``, in mm/s."""
        first = int(np.searchsorted(self.times, after))
        return np.asarray((self.eta[-1] - self.eta[first]) / (self.times[-1] - self.times[first]))


def _kind(contact: str) -> str:
    return {4: "ball", 3: "rod", 2: "cross"}[len(contact)]


def follow_dyads(
    drum: DumbbellDrum,
    starts: Sequence[Start],
    duration: float,
    *,
    noise: Noise | None = None,
    dt: float = 2e-3,
    interval: float = 0.1,
) -> DyadPaths:
    """Follow nested pairs from rest on the lowest line, all in one run with noise of their own.

    Parameters
    ----------
    drum : DumbbellDrum
        Its ``count`` is not used, and it has to be without bottom and top.
    starts : sequence of (str, float)
        Chirality and heading, in rad, of each pair.
    duration, dt, interval : float
        Time to simulate, step, and time between records, in s.
    """
    if drum.floor or math.isfinite(drum.top):
        msg = "drum: expected one without bottom and top, in which pairs are put far apart"
        raise ValueError(msg)
    if not starts:
        msg = "starts: expected at least one chirality and heading; got none"
        raise ValueError(msg)
    places = nested_places(drum, starts)
    return follow_pairs(drum, places, duration, noise=noise, dt=dt, interval=interval)


def nested_places(drum: DumbbellDrum, starts: Sequence[Start]) -> Array:
    """Return nested pairs on the lowest line, far apart along the axis, ``(2 n, 3)``."""
    nests = [drum.pair.nested(hand, heading=angle, clearance=CLEARANCE) for hand, angle in starts]
    places = np.concatenate([nest.reshape(2, 3) for nest in nests])
    places[:, 1] += APART * np.repeat(np.arange(len(starts)), 2)
    return places


def follow_pairs(
    drum: DumbbellDrum,
    places: ArrayLike,
    duration: float,
    *,
    noise: Noise | None = None,
    dt: float = 2e-3,
    interval: float = 0.1,
    solver: Solver = SOLVER,
) -> DyadPaths:
    """Follow pairs of dumbbells from rest at ``places``, ``(2 n, 3)``; see :class:`DyadPaths`."""
    real("dt", dt, least=SHORTEST_STEP, unit="s")
    many = replace(drum, count=len(np.asarray(places)))
    start, every = many.state(places), max(1, round(interval / dt))
    return DyadPaths(simulate(many, start, duration, dt, every=every, noise=noise, solver=solver))


def heading_at_shift(drum: DumbbellDrum, shift: float) -> float:
    """Return the heading, in degrees, of least energy of a right-handed pair with a given shift.

    Parallel dumbbells ``p = r + t`` across and ``s`` along their axis apart, in the trough:
    ``tan 2 theta = 2 s p / (s^2 + l^2 - p^2)``.  At the corner ``s = l - sqrt(4 r^2 - p^2)``; at
    the other end of the way along the rods, balls side by side, ``s = sqrt(4 r^2 - p^2)``.
    """
    p = drum.ball_radius + drum.rod_radius
    return math.degrees(math.atan2(2 * shift * p, shift**2 + drum.length**2 - p**2) / 2)


def minimiser_heading(drum: DumbbellDrum, *, azimuth: float = 0.0) -> float:
    """Return the heading, in degrees, at which the energy of a right-handed pair is least.

    ``azimuth``, in rad, holds the pair's mean azimuth there instead of at the lowest line.  Of a
    pair with its half-turn symmetry the energy is then ``cos(azimuth)`` times what it was, and the
    heading is the same.  A tilt pulls at all balls alike and does nothing while the mean is held.
    """
    import sympy

    from polycorner.minimisation import minimise
    from polycorner.polyhedra import AllOf, Polyhedron

    pair = replace(drum, count=2).pair
    start = pair.nested("R")
    domain = pair.polyhedron
    if azimuth:
        first, _, _, second, _, _ = pair.manifold.symbols
        held = sympy.sin((first + second) / 2 - azimuth)
        domain = Polyhedron(pair.manifold, AllOf(*domain.functions), {"azimuth": held})
        start = start + azimuth * np.array([1, 0, 0, 1, 0, 0])
    found = minimise(domain, pair.energy, start)
    return float(np.degrees(pair.heading(found.point)).mean())


# ----------------------------------------------------------------- turning by weight and by impacts

# A nested pair of heading ``theta`` is two parallel dumbbells, ``p = r + t`` across and ``s = l -
# sqrt(4 r^2 - p^2)`` along their axes apart. Its weight turns it towards the heading of least
# energy, as far as noise overcomes sliding friction. The higher dumbbell rolls against the lower
# one, and an impact at their inner ends turns both the same way: to more positive headings in
# right-handed pairs. This ends where both are equally high; beyond, the weight parts them.

FLAT = 1e7  # mm: radius of a drum that is as good as a plane
CONTACT = 1e-5  # mm between dumbbells before an impact
STEPS = 60  # in the time for which the dumbbells slide


def offsets(drum: DumbbellDrum) -> tuple[float, float]:
    """Return ``p`` and ``s`` of a nested pair, its dumbbells' distance across and along, in mm."""
    _, along, across = drum.pair.plane_corner()
    return across, along


def parting_heading(drum: DumbbellDrum) -> float:
    """Return the heading ``arctan(p/s)`` in degrees where both dumbbells are equally high.

    Beyond it the weight of the dumbbells no longer presses them against each other.
    """
    return math.degrees(math.atan2(*offsets(drum)))


def pressing(drum: DumbbellDrum, heading: float) -> float:
    """Return the force by which dumbbells press on each other, over the weight of a ball.

    It acts across their axes: ``(p cos(theta) - s sin(theta)) / rho`` near the lowest line, where
    both meet the same resistance to rolling.  ``heading`` in degrees, of right-handed pairs.
    """
    (across, along), theta = offsets(drum), math.radians(heading)
    return (across * math.cos(theta) - along * math.sin(theta)) / drum.centre_radius


def return_ratio(drum: DumbbellDrum) -> float:
    """Return how much faster a pair turns to its heading of least energy than a dumbbell to zero.

    If slips of any dumbbell turn it by the same mobility times the torque on it: small deviations
    decay ``sqrt((s^2 + l^2 - p^2)^2 + 4 s^2 p^2) / l^2`` times as fast, by the energy
    ``m g / (2 rho)`` times the sum of the squared distances of the balls from the lowest line.
    """
    across, along = offsets(drum)
    stretched = along**2 + drum.length**2 - across**2
    return math.hypot(stretched, 2 * along * across) / drum.length**2


@dataclass(frozen=True)
class ImpactTurn:
    """What one impact does to a pair in a plane.

    Attributes
    ----------
    turn : float
        Mean turn of the two dumbbells, in rad, positive for right-handed pairs.
    dissipated : float
        Energy that the impact itself dissipated, in nJ.
    """

    turn: float
    dissipated: float


def turn_by_impact(drum: DumbbellDrum, speed: float) -> ImpactTurn:
    """Return how far a right-handed pair turns if one dumbbell rolls against the other, at rest.

    ``speed`` in mm/s.  On a plane, from the impact until both have stopped.  The turn grows as the
    square of the speed over ``mu g``, ``mu`` being the dynamic coefficient of sliding.
    """
    plane = replace(
        drum, drum_radius=FLAT, count=2, tilt=0.0, spin=0.0, restitution=0.0, floor=False
    )
    places = plane.pair.nested("R", heading=0.0, clearance=CONTACT).reshape(2, 3)
    towards = math.copysign(1.0, places[1, 0] - places[0, 0])
    v = np.zeros((2, 4))
    v[0, 0], v[0, 3] = towards * speed / plane.centre_radius, -towards * speed / plane.ball_radius
    slide, roll = (abs(speed) / (mu[1] * GRAVITY) for mu in (plane.sliding, plane.rolling))
    duration = 2 * (slide + roll)
    start = plane.state(places, v)
    path = simulate(plane, start, duration, slide / STEPS, solver=SOLVER)
    turn = float((path.q[-1, :, 2] - path.q[0, :, 2]).mean())
    return ImpactTurn(turn, float(path.dissipated["impact"][-1]))


# ---------------------------------------------------------------------------- means of driven pairs

WINDOW = 5  # correlation times over which correlations are summed


@dataclass(frozen=True)
class Steady:
    """Behaviour of pairs of one length: means over time, then over the pairs that stayed together.

    Headings and azimuth in degrees, ``climb_rate`` in mm/s, ``shift`` in mm; signs are those for
    right-handed pairs (of left-handed ones, mirrored).

    Attributes
    ----------
    drum : DumbbellDrum
    chatter : float
        Amplitude of the noise.
    heading, shift, azimuth, climb_rate : Mean
    early, late : Mean
        The heading in both halves of the time.
    drift : Mean
        Late less early heading of each pair: where it is not zero, the heading has not settled.
    scatter : float
        Standard deviation of the heading in time.
    samples : float
        Effective number of independent headings, all pairs together: time over twice the
        integrated autocorrelation time (:func:`correlation_time`).
    held, count : int
        Pairs that held to the end, and all.
    minimiser : float
        Heading of the energy's minimiser.
    strata : mapping from str to float
        See :meth:`DyadPaths.strata`.
    """

    drum: DumbbellDrum
    chatter: float
    heading: Mean
    shift: Mean
    azimuth: Mean
    climb_rate: Mean
    early: Mean
    late: Mean
    drift: Mean
    scatter: float
    samples: float
    held: int
    count: int
    minimiser: float
    strata: dict[str, float]

    @property
    def settled(self) -> bool:
        """Whether both halves give the same heading to within two standard errors."""
        return abs(self.drift.value) <= 2 * self.drift.error


def steady(paths: DyadPaths, *, after: float) -> Steady:
    """Return time averages from ``after`` on, and their means over the pairs."""
    late = paths.times >= after
    if not late.any():
        msg = f"after: expected a time before the end, {paths.times[-1]:g} s; got {after:g}"
        raise ValueError(msg)
    sign = paths.signs
    held = np.isinf(paths.lifetimes)
    heading = np.degrees(sign * paths.heading[late])[:, held]
    half = max(1, len(heading) // 2)

    def averaged(values: Array) -> Mean:
        return Mean.of(values.mean(axis=0))

    return Steady(
        drum=paths.drum,
        chatter=paths.noise.chatter,
        heading=averaged(heading),
        shift=averaged(paths.shift[late][:, held]),
        azimuth=averaged(np.degrees(paths.azimuth[late][:, held])),
        climb_rate=Mean.of((sign * paths.climb_rates(after=after))[held]),
        early=averaged(heading[:half]),
        late=averaged(heading[half:]),
        drift=Mean.of(heading[half:].mean(axis=0) - heading[:half].mean(axis=0)),
        scatter=float(heading.std(axis=0).mean()) if held.any() else math.nan,
        samples=sum(len(one) / (2 * correlation_time(one)) for one in heading.T),
        held=int(held.sum()),
        count=len(held),
        minimiser=minimiser_heading(paths.drum),
        strata=paths.strata(after=after),
    )


def correlation_time(values: ArrayLike) -> float:
    """Return the integrated autocorrelation time of a series, in units of its interval.

    ``1/2 + sum_k c_k / c_0``, summed up to the first ``k`` that is five times the sum ([Sokal]); a
    mean over ``n`` values has the variance ``2 tau c_0 / n``.  A trend makes it long; it is at
    least 1/2, that of independent values.
    """
    x = np.asarray(values, dtype=np.float64)
    x = x - x.mean()
    padded = np.fft.rfft(x, 2 * len(x))
    correlations = np.fft.irfft(np.abs(padded) ** 2)[: len(x)]
    if not correlations[0] > 0.0:
        return 0.5 * len(x)
    sums = np.cumsum(correlations / correlations[0]) - 0.5
    enough = np.arange(len(x)) >= WINDOW * sums
    return max(0.5, float(sums[np.argmax(enough)])) if enough.any() else 0.5 * len(x)
