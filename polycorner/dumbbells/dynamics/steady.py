"""Means of driven pairs: over time, and over the pairs that stayed together."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.dyads import DyadPaths, minimiser_heading
from polycorner.dumbbells.dynamics.singles import Mean
from polycorner.toolkit import Array

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
