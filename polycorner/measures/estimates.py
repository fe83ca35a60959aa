"""Means of correlated series, their errors, and how many independent numbers they are worth.

The integrated autocorrelation time of a series is ``tau = 1 + 2 sum_t rho_t``, ``rho_t`` its
autocorrelation at lag ``t``; of ``N`` numbers ``N / tau`` are effective.  For a reversible chain
sums ``rho_2t + rho_2t+1`` of neighbours are positive and decrease; the sum ends where an estimate
is no longer positive, and is kept from increasing before ([Geyer] sec. 3.3).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.printing import number
from polycorner.spaces.manifold import Array
from polycorner.values import Checked


@dataclass(frozen=True)
class Estimate(Checked):
    """A number with its error.

    Attributes
    ----------
    value : float
    error : float
        Its standard deviation.
    effective : float
        The number of independent points it is worth.
    """

    value: float
    error: float
    effective: float

    def __str__(self) -> str:
        """Return the value and its error."""
        return f"{number(self.value, 6)} +- {self.error:.1g}"


def series_mean(values: Array | NDArray[np.bool_]) -> Estimate:
    """Return the mean of several chains ``(c, k)`` of one length.

    Autocovariances are about the mean of all chains, so that chains that differ raise the error.
    """
    chains, length = values.shape
    mean = float(values.mean())
    away = values - mean
    variance = float((away**2).mean())
    total = chains * length
    if variance == 0.0:
        return Estimate(mean, 0.0, float(total))
    size = 1 << (2 * length - 1).bit_length()
    covariance = np.zeros(length)
    for row in away:
        covariance += np.fft.irfft(abs(np.fft.rfft(row, size)) ** 2, size)[:length]
    rho = covariance / (chains * length * variance)
    pairs = rho[: length - length % 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    kept = np.minimum.accumulate(pairs[: ends[0] if len(ends) else None])
    time = max(2 * float(kept.sum()) - 1, 1 / total)
    effective = min(total / time, float(total) ** 2)
    return Estimate(mean, math.sqrt(variance / effective), effective)


def ratio_of_means(above: NDArray[np.bool_], below: NDArray[np.bool_]) -> Estimate:
    """Return the share of one set over that of another, which was met; to first order."""
    share = float(below.mean())
    value = float(above.mean()) / share
    away = series_mean(above - value * below)
    return Estimate(value, away.error / share, away.effective)
