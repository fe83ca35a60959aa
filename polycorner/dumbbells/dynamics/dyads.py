"""Dyads driven by the rotating drum: their headings, climbing and lifetimes.

Nested pairs start at chosen headings and move under noise, many in one simulation, far apart from
each other.  Their heading is compared with the minimiser of the energy, in which friction does not
occur ([GMBN] sec. 7); nothing is fitted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.dumbbells.drum import DumbbellDrum, drum_of
from polycorner.dumbbells.dynamics.pairs import DumbbellLengths, chirality, gaps
from polycorner.dumbbells.dynamics.singles import APART
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
