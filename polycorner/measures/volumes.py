"""Volumes and moments of D and of its sublevel sets, by randomised low-discrepancy points.

A share of a box is the mean of an indicator over points.  Sobol points with random scrambling are
uniformly distributed each, so that the mean over them is unbiased, and means of independent
scramblings give its error ([Owen]).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.kinds import checked
from polycorner.measures.estimates import Estimate
from polycorner.measures.weighting import PLAIN, Weighting, posed
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.progress import Progress, silent
from polycorner.spaces.manifold import Array
from polycorner.values import Checked


@dataclass(frozen=True, eq=False)
class Volume(Checked):
    """The volume of a set and the moments of points in it.

    Attributes
    ----------
    volume : Estimate
        In the units of the coordinates; of vectors and rotations uniformly distributed, as a share.
    mean : tuple of Estimate
        Of every coordinate.
    covariance : (n, n) array
        Of the coordinates.
    """

    volume: Estimate
    mean: tuple[Estimate, ...]
    covariance: Array


@checked
def volume(
    polyhedron: Polyhedron,
    box: ArrayLike,
    *,
    levels: Sequence[float] = (math.inf,),
    weighting: Weighting = PLAIN,
    points: int = 2**14,
    replicates: int = 16,
    rng: np.random.Generator | int | None = None,
    progress: Progress = silent,
) -> tuple[Volume, ...]:
    """Return volume and moments of a polyhedron in a box, and of sublevel sets ``{E <= c}`` there.

    Parameters
    ----------
    polyhedron : Polyhedron
        Without equations.
    box : (n, 2) array
        Bounds of the coordinates.
    levels : sequence of float, optional
        The values ``c``; the whole polyhedron by default.
    weighting : Weighting, optional
        Its energy; stickiness and temperature are not used.
    points, replicates : int, optional
        Points of a scrambling, a power of two, and how many scramblings there are.
    rng : Generator or int, optional
        Random numbers, or a seed.
    progress : callable, optional
        Told the number of scramblings.

    Returns
    -------
    tuple of Volume
        One for each level.  Mean and covariance are NaN where no point was met.

    Raises
    ------
    TypeError, ValueError
        For equations, levels without an energy, and other arguments.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y})
    >>> (found,) = volume(D, [(-1.5, 1.5), (0.0, 2.0)], rng=1)
    >>> abs(found.volume.value - 8 * 2**0.5 / 3) < 4 * found.volume.error
    True
    """
    from scipy.stats import qmc

    manifold = polyhedron.manifold
    if polyhedron.equations:
        checks.refuse("polyhedron", "no equations", polyhedron)
    bounds = checks.reals("box", box)
    if bounds.shape != (manifold.size, 2) or not (bounds[:, 0] < bounds[:, 1]).all():
        checks.refuse("box", f"({manifold.size}, 2) increasing bounds", bounds)
    checks.whole("points", points, least=2, most=2**30)
    checks.whole("replicates", replicates, least=2, most=checks.MOST)
    if points & (points - 1):
        checks.refuse("points", "a power of two", points)
    energy = posed(weighting, polyhedron)
    if energy is None and tuple(levels) != (math.inf,):
        checks.refuse("levels", "none without an energy", levels)
    generator = checks.generator("rng", rng)
    sums = np.zeros((len(levels), replicates, 1 + manifold.size))
    second = np.zeros((len(levels), manifold.size, manifold.size))
    for k in range(replicates):
        shares = qmc.Sobol(manifold.size, rng=generator).random(points)
        q = bounds[:, 0] + shares * (bounds[:, 1] - bounds[:, 0])
        q = q[polyhedron.implicit(q) >= 0]
        heights = np.full(len(q), -math.inf) if energy is None else energy.value(q)
        for i, level in enumerate(levels):
            inside = q[heights <= level]
            sums[i, k, 0], sums[i, k, 1:] = len(inside), inside.sum(axis=0)
            second[i] += inside.T @ inside
        progress(k + 1, replicates, "scramblings")
    unit = float(np.prod(bounds[:, 1] - bounds[:, 0])) / points
    several = zip(sums, second, strict=True)
    return tuple(_summary(first, moments, unit, points) for first, moments in several)


def _summary(sums: Array, second: Array, unit: float, points: int) -> Volume:
    """Return volume and moments from counts and sums ``(r, 1 + n)`` of replicates."""
    total, scale = sums.sum(axis=0), math.sqrt(len(sums))
    size, box = float(sums[:, 0].mean() * unit), unit * points
    error = float(sums[:, 0].std(ddof=1) * unit / scale)
    found = Estimate(size, error, _worth(size * (box - size), error))
    if not total[0]:
        none = Estimate(math.nan, math.nan, 0.0)
        return Volume(found, (none,) * (len(total) - 1), np.full(second.shape, math.nan))
    mean = total[1:] / total[0]
    covariance = second / total[0] - np.outer(mean, mean)
    # Of a ratio, to first order.
    away = (sums[:, 1:] - mean * sums[:, :1]) / sums[:, 0].mean()
    errors = (away.std(axis=0, ddof=1) / scale).tolist()
    several = zip(mean.tolist(), errors, covariance.diagonal().tolist(), strict=True)
    means = tuple(Estimate(m, e, _worth(v, e)) for m, e, v in several)
    return Volume(found, means, covariance)


def _worth(variance: float, error: float) -> float:
    """Return how many independent numbers have the same error of their mean."""
    return variance / error**2 if error else math.inf
