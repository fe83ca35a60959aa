"""Critical points of the least of smooth functions, followed from smooth energies to the corner.

``tau = min_k d_k`` has a corner wherever several ``d_k`` are least.  The smooth energy

    ``E_s = -(1/s) log sum_k exp(-s d_k)``,    ``tau - (log m) / s <= E_s <= tau``,

has the gradient ``sum_k w_k grad d_k`` with positive weights ``w`` that sum to 1.  Its critical
points of every index are found where ``s`` is small, followed while it grows, and their weights
tend to a stress.  The results are guesses, solved for and judged in
:mod:`~polycorner.models.disks.critical_points`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array

# The sharpness of the energies, in units of one over the length that the functions measure.
SOFTEST, SHARPEST, GROWTH = 10.0, 1e5, 1.2
# Random starts reach critical points only of soft energies; branches appear at a middle sharpness.
RANDOM_BELOW, COPIES_ABOVE, COPIES_BELOW, NEARLY_BELOW = 60.0, 30.0, 300.0, 2000.0
NEAR_COPIES, FAR_COPIES, NEARLY_COPIES, NEARLY_KEPT = 20, 8, 2, 40
STEP, STEPS, NEWTON_STEPS, PATIENCE = 0.1, 30, 12, 6
# Slopes: of a critical point (at sharpness 100), and of a point that may become one.
FLAT, NEARLY = 1e-9, 0.15
# Weights, as a fraction of the largest, that become a stress.
LOADED, NEARLY_LOADED = 1e-4, 3e-2


class GroupedFunctions(Protocol):
    """Functions in groups, each group reading few coordinates."""

    @property
    def reads(self) -> NDArray[np.intp]:
        """The coordinates that the functions of each group depend on, ``(g, k)``."""
        ...

    def derivatives(self, points: Array) -> tuple[Array, Array, Array]:
        """Return values ``(B, g, v)``, gradients ``(B, g, v, k)``, Hessians ``(B, g, v, k, k)``.

        Derivatives are by the coordinates of ``reads``; points have shape ``(B, n)``.
        """
        ...


@dataclass(frozen=True, eq=False)
class Smoothed:
    """``E_s`` at several points: values, gradients, Hessians, and the weights ``w``."""

    energy: Array
    gradient: Array
    hessian: Array
    weights: Array

    @property
    def slope(self) -> Array:
        """``|grad E_s|``."""
        return np.asarray(np.linalg.norm(self.gradient, axis=-1))


def smooth(functions: GroupedFunctions, points: Array, sharpness: float) -> Smoothed:
    """Evaluate ``E_s`` at points ``(B, n)``."""
    values, gradients, hessians = functions.derivatives(points)
    (count, n), reads = points.shape, functions.reads
    least = values.min(axis=(1, 2), keepdims=True)
    weights = np.exp(-sharpness * (values - least))
    total = weights.sum(axis=(1, 2), keepdims=True)
    weights /= total
    energy = (least - np.log(total) / sharpness)[:, 0, 0]
    pulls = weights[..., None] * gradients
    blocks = np.einsum("bgv,bgvij->bgij", weights, hessians)
    blocks -= sharpness * (np.swapaxes(pulls, 2, 3) @ gradients)
    gradient, hessian = np.zeros((count, n)), np.zeros((count, n, n))
    for pull, block, read in zip(
        np.moveaxis(pulls.sum(axis=2), 1, 0), np.moveaxis(blocks, 1, 0), reads, strict=True
    ):
        gradient[:, read] += pull
        hessian[:, read[:, None], read] += block
    hessian += sharpness * gradient[:, :, None] * gradient[:, None, :]
    return Smoothed(energy, gradient, hessian, np.reshape(weights, (count, -1)))


@dataclass(frozen=True, eq=False)
class NearlyCritical:
    """A critical point of a sharp energy, or nearly one.

    Attributes
    ----------
    point : (n,) array
        The point.
    sharpness : float
        Sharpness of the energy of which it is a critical point.
    loaded : float
        Weights above this fraction of the largest become a stress.
    hits : int
        Number of descents that ended there.
    """

    point: Array
    sharpness: float
    loaded: float
    hits: int


@dataclass(frozen=True, eq=False)
class _Population:
    """Points with slopes and numbers of descents that ended at each."""

    points: Array
    slopes: Array
    hits: NDArray[np.intp]

    def where(self, chosen: NDArray[np.bool_]) -> "_Population":
        return _Population(self.points[chosen], self.slopes[chosen], self.hits[chosen])

    def candidates(self, sharpness: float, loaded: float) -> list[NearlyCritical]:
        return [
            NearlyCritical(point, sharpness, loaded, int(hits))
            for point, hits in zip(self.points, self.hits, strict=True)
        ]

    def joined(self, other: "_Population") -> "_Population":
        return _Population(
            np.vstack([self.points, other.points]),
            np.append(self.slopes, other.slopes),
            np.append(self.hits, other.hits),
        )


def candidates(
    functions: GroupedFunctions,
    starts: Array,
    rng: np.random.Generator,
    moves: Callable[[Array, np.random.Generator], Array],
) -> list[NearlyCritical]:
    """Return guesses of critical points of ``tau``, some of them several times.

    At every sharpness what is known is followed, and disturbed copies of it look for branches
    that appear there.  Points where ``|grad E_s|`` has a small positive minimum are followed
    too: they turn into critical points of sharper energies, or, where an active function
    carries no stress, of ``tau`` alone.

    Parameters
    ----------
    functions : GroupedFunctions
        The ``d_k``.
    starts : (B, n) array
        Starts of the descents, spread over the softer energies.
    rng : numpy.random.Generator
        Disturbs the copies.
    moves : callable
        Disturbs points ``(N, n)`` by large steps of the model.
    """
    levels = SOFTEST * GROWTH ** np.arange(np.log(SHARPEST / SOFTEST) // np.log(GROWTH) + 1)
    shares = np.array_split(starts, int((levels < RANDOM_BELOW).sum()))
    nothing = starts[:0]
    known = nearly = _Population(nothing, np.empty(0), np.empty(0, dtype=np.intp))
    found: list[NearlyCritical] = []
    for level, sharpness in enumerate(levels):
        flat = FLAT * max(1.0, sharpness / 100)
        followed = _followed(functions, known, sharpness, flat)
        fresh = shares[level] if level < len(shares) else nothing
        aims = rng.integers(0, starts.shape[1], len(fresh))
        aimed = _aimed(functions, fresh, sharpness, flat, aims)
        tries = [fresh, nearly.points, known.points[followed.slopes > flat]]
        if COPIES_ABOVE < sharpness < COPIES_BELOW:
            tries.append(_near(known.points, NEAR_COPIES, sharpness, rng))
            tries.append(moves(np.repeat(known.points, FAR_COPIES, axis=0), rng))
        if sharpness < NEARLY_BELOW:
            tries.append(_near(nearly.points, NEARLY_COPIES, sharpness, rng))
        descended = _least_slope(functions, np.vstack(tries), sharpness, flat)
        reached = followed.joined(aimed).joined(descended)
        known = _told_apart(functions, reached.where(reached.slopes <= flat), sharpness)
        almost = (reached.slopes > flat) & (reached.slopes < NEARLY)
        nearly = _flattest(functions, reached.where(almost), sharpness)
        if sharpness < NEARLY_BELOW <= sharpness * GROWTH:
            found += nearly.candidates(sharpness, NEARLY_LOADED)
        if sharpness * GROWTH >= NEARLY_BELOW:
            nearly = nearly.where(np.zeros(len(nearly.points), dtype=bool))
    return found + known.candidates(float(levels[-1]), LOADED)


def _near(points: Array, copies: int, sharpness: float, rng: np.random.Generator) -> Array:
    """Return copies disturbed by a tenth to five times the width of the energy's features."""
    repeated = np.repeat(points, copies, axis=0)
    reach = 10 ** rng.uniform(-1, 0.7, (len(repeated), 1)) / sharpness
    return repeated + reach * rng.normal(size=repeated.shape)


def _followed(
    functions: GroupedFunctions, known: _Population, sharpness: float, flat: float
) -> _Population:
    """Follow critical points from one sharpness to the next by Newton's method in short steps."""
    points = known.points.copy()
    if not len(points):
        return known
    at = smooth(functions, points, sharpness)
    for _ in range(NEWTON_STEPS):
        if at.slope.max() < flat / 10:
            break
        curvature, axes = np.linalg.eigh(at.hessian)
        size = np.maximum(abs(curvature), 1e-6 * abs(curvature).max(axis=1, keepdims=True))
        along = np.einsum("bij,bi->bj", axes, at.gradient) * np.sign(curvature) / size
        points -= _capped(np.einsum("bij,bj->bi", axes, along), 1 / sharpness)
        at = smooth(functions, points, sharpness)
    return _Population(points, at.slope, known.hits)


def _aimed(
    functions: GroupedFunctions,
    starts: Array,
    sharpness: float,
    flat: float,
    aims: NDArray[np.intp],
) -> _Population:
    """Follow eigenvectors to critical points of given index.

    With the aim ``j`` the energy falls along the ``j`` eigenvectors that curve upwards most and
    grows along the others, so that only critical points of index ``j`` attract; 0 is an ascent.
    """
    points, n = starts.copy(), starts.shape[1]
    if not len(points):
        return _Population(points, np.empty(0), np.empty(0, dtype=np.intp))
    falls = np.arange(n) >= n - aims[:, None]
    at = smooth(functions, points, sharpness)
    gradient, hessian, slope = at.gradient, at.hessian, at.slope
    for _ in range(2 * STEPS):
        going = np.flatnonzero(slope > flat / 10)
        if not len(going):
            break
        curvature, axes = np.linalg.eigh(hessian[going])
        size = np.maximum(abs(curvature), 1e-6 * abs(curvature).max(axis=1, keepdims=True))
        along = np.einsum("bij,bi->bj", axes, gradient[going]) / size
        step = np.einsum("bij,bj->bi", axes, np.where(falls[going], -along, along))
        points[going] += _capped(step, STEP)
        at = smooth(functions, points[going], sharpness)
        gradient[going], hessian[going], slope[going] = at.gradient, at.hessian, at.slope
    return _Population(points, slope, np.ones(len(points), dtype=np.intp))


def _least_slope(
    functions: GroupedFunctions, starts: Array, sharpness: float, flat: float
) -> _Population:
    """Minimise ``|grad E_s|^2`` from every start with damped Gauss-Newton steps."""
    points, n = starts.copy(), starts.shape[1]
    if not len(points):
        return _Population(points, np.empty(0), np.empty(0, dtype=np.intp))
    at = smooth(functions, points, sharpness)
    gradient, hessian, slope = at.gradient, at.hessian, at.slope
    damping, stalled = np.full(len(points), 1e-2), np.zeros(len(points), dtype=int)
    for _ in range(STEPS):
        going = np.flatnonzero((slope > flat / 10) & (stalled < PATIENCE))
        if not len(going):
            break
        normal = hessian[going] @ hessian[going]
        mean = np.trace(normal, axis1=1, axis2=2) / n
        shift = ((damping[going] + 1e-12) * mean)[:, None, None] * np.eye(n)
        pull = hessian[going] @ gradient[going, :, None]
        step = _capped(-np.linalg.solve(normal + shift, pull)[..., 0], STEP)
        trial = points[going] + step
        at = smooth(functions, trial, sharpness)
        better = at.slope < slope[going] * (1 - 1e-4)
        taken = going[better]
        points[taken], slope[taken] = trial[better], at.slope[better]
        gradient[taken], hessian[taken] = at.gradient[better], at.hessian[better]
        damping[going] *= np.where(better, 0.2, 5.0)
        stalled[going] = np.where(better, 0, stalled[going] + 1)
    return _Population(points, slope, np.ones(len(points), dtype=np.intp))


def _capped(steps: Array, longest: float) -> Array:
    sizes = abs(steps).max(axis=1, keepdims=True)
    return np.asarray(steps * np.minimum(1, longest / np.maximum(sizes, 1e-300)))


def _told_apart(functions: GroupedFunctions, some: _Population, sharpness: float) -> _Population:
    """Keep one of those critical points that agree in energy and index."""
    if not len(some.points):
        return some
    at = smooth(functions, some.points, sharpness)
    index = (np.linalg.eigvalsh(at.hessian) > 1e-6 * sharpness**0.5).sum(axis=1)
    keys = np.stack([np.round(at.energy, 9), index], axis=1)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    hits = np.zeros(len(first), dtype=np.intp)
    np.add.at(hits, which.ravel(), some.hits)
    return _Population(some.points[first], some.slopes[first], hits)


def _flattest(functions: GroupedFunctions, some: _Population, sharpness: float) -> _Population:
    """Keep the points of least slope, one for each energy, and not too many."""
    if not len(some.points):
        return some
    order = np.argsort(some.slopes, kind="stable")
    energy = smooth(functions, some.points[order], sharpness).energy
    _, first = np.unique(np.round(energy, 5), return_index=True)
    kept = order[np.sort(first)][:NEARLY_KEPT]
    return _Population(some.points[kept], some.slopes[kept], some.hits[kept])
