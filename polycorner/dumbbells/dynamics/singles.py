"""Single dumbbells in the rotating drum: onsets and ends of slips, climbing.

Zigzags are computed from trajectories of :class:`polycorner.dumbbells.drum.DumbbellDrum`, which
does not assume the keel effect, and are compared with the regions of rest of
:mod:`polycorner.dumbbells.statics.keel` ([GMBN] sec. 4, app. A).  Many dumbbells move in one
simulation, far apart from each other.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.statics.keel import Keel, exact_eastern_boundary
from polycorner.motion import EventKind, Noise, Solver, Trajectory, simulate
from polycorner.toolkit import Array, reals

APART = 1e4  # mm along the drum, so that dumbbells of one run never meet
STRIDE = 10  # steps between records; shorter rests count as parts of one slip


@dataclass(frozen=True, eq=False)
class Zigzag:
    """The slips of one dumbbell: each from rest on the drum to the next rest, in time.

    Angles in rad, lengths in mm, times in s; ``n`` slips.

    Attributes
    ----------
    starts, stops : (n,) array
        Times at which it begins to move and comes to rest.
    upper, lower : (n,) array
        Azimuths at those times.
    heading : (n,) array
        Heading before the slip.
    turn : (n,) array
        Change of the heading in the slip.
    rise : (n,) array
        Change of ``eta`` in the slip.
    """

    starts: Array
    stops: Array
    upper: Array
    lower: Array
    heading: Array
    turn: Array
    rise: Array

    def __len__(self) -> int:
        """Return the number of slips."""
        return len(self.starts)

    @property
    def width(self) -> Array:
        """Azimuth rolled down in each slip, ``(n,)``."""
        return self.upper - self.lower

    @property
    def climb_rate(self) -> float:
        """Mean speed along ``eta`` over the whole zigzags, in mm/s; nan for fewer than two slips.

        From the first onset to the last.
        """
        if len(self) < 2:
            return math.nan
        return float(self.rise[:-1].sum() / (self.starts[-1] - self.starts[0]))


@dataclass(frozen=True)
class Mean:
    """A mean over an ensemble with its standard error, nan for fewer than two members."""

    value: float
    error: float
    count: int

    @classmethod
    def of(cls, values: ArrayLike) -> "Mean":
        """Return the mean of the finite entries among ``values``."""
        array = np.ravel(np.asarray(values, dtype=np.float64))
        array = array[np.isfinite(array)]
        n = len(array)
        error = float(array.std(ddof=1)) / math.sqrt(n) if n > 1 else math.nan
        return cls(float(array.mean()) if n else math.nan, error, n)

    @property
    def deviation(self) -> float:
        """Standard deviation of the members."""
        return self.error * math.sqrt(self.count)

    def __rmul__(self, factor: float) -> "Mean":
        """Return the mean of the members times a number."""
        return Mean(factor * self.value, abs(factor) * self.error, self.count)

    def __str__(self) -> str:
        """Write ``value +- error``."""
        return f"{self.value:.4g} ± {self.error:.2g} ({self.count})"


def keel_of(drum: DumbbellDrum) -> Keel:
    """Return the keel formulas with the drum's tilt and coefficients of friction."""
    (rolling, rolling_dynamic), (sliding, sliding_dynamic) = drum.rolling, drum.sliding
    return Keel(drum.tilt, rolling, sliding, rolling_dynamic, sliding_dynamic)


def onset_azimuths(drum: DumbbellDrum, headings: ArrayLike) -> Array:
    """Return the azimuths at which dumbbells begin to move, by the formula for their length.

    The eastern boundary of the paper's region ``A``; for ``spin < 0`` the western one, which is the
    eastern one of ``-theta`` mirrored.
    """
    sign = -1.0 if drum.spin < 0 else 1.0
    kappa = drum.length / (2 * drum.centre_radius)
    theta = sign * reals("headings", headings)
    return sign * np.asarray(exact_eastern_boundary(theta, keel_of(drum).onset, kappa))


def follow(
    drum: DumbbellDrum,
    headings: ArrayLike,
    duration: float,
    *,
    azimuth: float = 0.0,
    noise: Noise | None = None,
    dt: float = 1e-3,
) -> Trajectory:
    """Follow single dumbbells of given headings, carried by the drum from ``azimuth``.

    All are in one run, each far from the others, with noise of its own.

    Parameters
    ----------
    drum : DumbbellDrum
        Its ``count`` is not used, and it has to be without bottom and top.
    headings : (N,) array
        In rad.
    duration, dt : float
        Time and step, in s.
    """
    if drum.floor or math.isfinite(drum.top):
        msg = "drum: expected one without bottom and top, in which dumbbells are put far apart"
        raise ValueError(msg)
    theta = np.atleast_1d(reals("headings", headings))
    q = np.stack([np.full_like(theta, azimuth), APART * np.arange(len(theta)), theta], axis=-1)
    many = replace(drum, count=len(theta))
    return simulate(many, many.state(q), duration, dt, every=STRIDE, noise=noise, solver=Solver())


def zigzags(trajectory: Trajectory, spin: float) -> tuple[Zigzag, ...]:
    """Return the slips of every dumbbell of a trajectory.

    On the drum a dumbbell moves with ``phi' = spin`` alone, so azimuths at onset and stop follow
    from the nearest record at rest, exactly.  Rests shorter than two records are not resolved:
    the slips before and after are one.
    """
    times, dt = trajectory.times, trajectory.dt
    gap = 2 * float(times[1] - times[0])
    found = []
    for body in range(trajectory.q.shape[1]):
        slips = _merged(_intervals(trajectory, body), gap)
        edges = np.array(slips).reshape(-1, 2)
        before = np.searchsorted(times, edges[:, 0] + dt / 2) - 1
        after = np.searchsorted(times, edges[:, 1] - dt / 2)
        first, last = (trajectory.q[i, body].copy() for i in (before, after))
        first[:, 0] += spin * (edges[:, 0] - times[before])
        last[:, 0] -= spin * (times[after] - edges[:, 1])
        change = last - first
        upper, heading, lower = first[:, 0], first[:, 2], last[:, 0]
        starts, stops = edges.T
        found.append(Zigzag(starts, stops, upper, lower, heading, change[:, 2], change[:, 1]))
    return tuple(found)


def _intervals(trajectory: Trajectory, body: int) -> list[tuple[float, float]]:
    """Return the intervals in which a body moved, from events, without one that is still open."""
    began: float | None = None
    slips = []
    for event in trajectory.events:
        if event.bodies != (body,):
            continue
        if event.kind == EventKind.MOTION:
            began = event.time
        elif event.kind == EventKind.REST and began is not None:
            slips.append((began, event.time))
            began = None
    return slips


def _merged(slips: list[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    if not slips:
        return []
    breaks = [k + 1 for k, (a, b) in enumerate(pairwise(slips)) if b[0] - a[1] >= gap]
    return [(slips[i][0], slips[j - 1][1]) for i, j in pairwise([0, *breaks, len(slips)])]


def keel_ratio(drum: DumbbellDrum, heading: float, *, duration: float = 60.0) -> float:
    """Return the climb rate relative to that of a perfect keel, ``omega rho tan(theta)``.

    One without noise, averaged over the second half of the time.
    """
    path = follow(drum, heading, duration)
    half = len(path) // 2
    (eta, phi) = path.q[[half, -1], 0, 1], path.q[[half, -1], 0, 0]
    time = path.times[-1] - path.times[half]
    carried = drum.centre_radius * (drum.spin * time - (phi[1] - phi[0]))
    return float((eta[1] - eta[0]) / (carried * math.tan(heading)))
