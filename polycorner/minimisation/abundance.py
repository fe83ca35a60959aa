"""Estimates of shares, and of the number of kinds, in a population from a sample."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from polycorner import checks
from polycorner.kinds import checked
from polycorner.values import Checked

NORMAL = 1.959963984540054  # half the 95 % interval of a normal distribution, in deviations
MISSED = 0.05  # probability from which on a kind may well have been missed


@dataclass(frozen=True)
class Richness(Checked):
    """An estimate of the number of kinds from a sample of independent draws; see :func:`richness`.

    Attributes
    ----------
    observed : int
        Number of kinds observed.
    draws : int
        Number of draws.
    singles, doubles : int
        Numbers of kinds observed once and twice.
    estimate : float
        Estimated number of all kinds.
    variance : float
        Variance of the estimate.
    interval : (float, float)
        Confidence interval of the number of kinds, at a nominal level of 95 %.
    """

    observed: int
    draws: int
    singles: int
    doubles: int
    estimate: float
    variance: float
    interval: tuple[float, float]

    @property
    def coverage(self) -> float:
        """Estimated share of the observed kinds in the distribution: ``1 - f1/n``.

        The estimator of Good and Turing ([Good]); 0 without draws.
        """
        return 1 - self.singles / self.draws if self.draws else 0.0

    @property
    def unseen(self) -> float:
        """Estimated number of kinds not observed."""
        return self.estimate - self.observed

    @property
    def overlooked(self) -> float:
        """Largest share of a kind that the draws miss with a probability of 5 % or more."""
        return 1 - MISSED ** (1 / self.draws) if self.draws else 1.0


@checked
def richness(counts: Iterable[int]) -> Richness:
    r"""Estimate the number of kinds in a population from the rare ones in a sample.

    With ``S`` kinds observed in ``n`` draws, ``f1`` of them once and ``f2`` of them twice, the
    bias-corrected estimate of Chao ([Chao]) is

    .. math:: S + \frac{n-1}{n} \frac{f_1 (f_1 - 1)}{2 (f_2 + 1)} .

    It is a lower bound: ``f1`` and ``f2`` carry no information on kinds so rare that hardly any of
    them was observed.  Its interval is log-normal in the number of unseen kinds ([Chao87]); with
    few draws for each kind it covers the truth less often than its nominal level.  Where the
    estimate is ``S``, a kind observed ``k`` times is assumed to be missed with the probability
    ``exp(-k)`` of a Poisson distribution of that mean.

    Parameters
    ----------
    counts : sequence of int
        How often each kind was observed, at least once.

    Raises
    ------
    TypeError, ValueError
        If a count is not a positive whole number.

    Examples
    --------
    >>> found = richness([12, 5, 2, 1, 1, 1])
    >>> round(found.estimate, 2), round(found.coverage, 2)
    (7.43, 0.86)
    """
    met = [checks.whole("counts", c, least=1) for c in counts]
    observed, n, f1, f2 = len(met), sum(met), met.count(1), met.count(2)
    if not n:
        return Richness(0, 0, 0, 0, 0.0, 0.0, (0.0, math.inf))
    k = (n - 1) / n
    unseen = k * f1 * (f1 - 1) / (2 * (f2 + 1))
    if unseen > 0:
        variance = unseen + k**2 * f1 * (2 * f1 - 1) ** 2 / (4 * (f2 + 1) ** 2)
        if f2:
            variance += k**2 * f1**2 * f2 * (f1 - 1) ** 2 / (4 * (f2 + 1) ** 4)
        else:
            variance -= k**2 * f1**4 / (4 * (observed + unseen))
        spread = math.exp(NORMAL * math.sqrt(math.log1p(variance / unseen**2)))
        interval = (observed + unseen / spread, observed + unseen * spread)
    else:
        variance, interval = _by_chance(met, n)
    return Richness(observed, n, f1, f2, observed + unseen, variance, interval)


def share_interval(count: int, draws: int) -> tuple[float, float]:
    """Return Wilson's interval of a share, at 95 %, from how many of some draws have it ([Wilson]).

    The shares ``p`` with ``(count/n - p)^2 <= z^2 p (1 - p)/n``.  It is not empty at 0 and at 1.
    """
    if not draws:
        return 0.0, 1.0
    seen, small = count / draws, NORMAL**2 / draws
    middle = (seen + small / 2) / (1 + small)
    reach = math.sqrt(small * seen * (1 - seen) + small**2 / 4) / (1 + small)
    # Rounding would miss both ends.
    return middle - reach if count else 0.0, middle + reach if count < draws else 1.0


def _by_chance(met: list[int], n: int) -> tuple[float, tuple[float, float]]:
    """Return variance and interval if each kind was missed with its Poisson probability."""
    observed = len(met)
    missed = math.fsum(math.exp(-c) for c in met)
    variance = missed - math.fsum(math.exp(-2 * c) for c in met)
    variance = max(0.0, variance - math.fsum(c * math.exp(-c) for c in met) ** 2 / n)
    seen = 1 - missed / observed
    middle, reach = observed / seen, NORMAL * math.sqrt(variance) / seen
    return variance, (max(float(observed), middle - reach), middle + reach)
