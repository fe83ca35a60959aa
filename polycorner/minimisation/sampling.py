"""Start points of a multi-start search, given or sampled from a box."""

from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.checks import reals
from polycorner.minimisation.problem import Problem
from polycorner.spaces.manifold import Array

# Bounds for each coordinate; None for a whole circle or sphere.
Box = Sequence[tuple[float, float] | None]

TRIES = 10_000  # samples a start before they are moved into the polyhedron instead
RESTORED = 100  # samples a start that are moved before a box is reported to miss the polyhedron


def start_points(
    problem: Problem, starts: Any, box: Box | None, rng: np.random.Generator | int | None
) -> Array:
    """Return the start points ``(k, n)``, given or sampled, after checking them."""
    manifold = problem.polyhedron.manifold
    if isinstance(starts, Real):
        count = checks.whole("starts", starts, least=1, most=checks.MOST)
        return _sampled(problem, count, *_bounds(problem, box), checks.generator("rng", rng))
    if box is not None:
        msg = f"box: expected None with starts given as points; got {box!r}"
        raise ValueError(msg)
    points = manifold.points(np.atleast_2d(reals("starts", starts)), "starts")
    points = manifold.placed(points, "starts")
    if points.ndim != 2 or not len(points):
        msg = f"starts: expected points of shape (k, {problem.dimension}); got {points.shape}"
        raise ValueError(msg)
    finite = np.isfinite(problem.energy.value(points))
    if not finite.all():
        k = int((~finite).argmax())
        msg = f"starts: expected points with a finite energy; it is not finite at starts[{k}]"
        raise ValueError(msg)
    return points


def _sampled(
    problem: Problem, count: int, low: Array, high: Array, rng: np.random.Generator
) -> Array:
    """Return uniform samples with satisfied inequalities and a finite energy.

    Where none satisfies them, as in a set without interior, samples are moved into branches.
    """
    d = problem.polyhedron
    found = np.empty((0, problem.dimension))
    tries = 0
    while len(found) < count:
        q = rng.uniform(low, high, (4 * count, problem.dimension))
        q = d.manifold.factors.scattered(q, rng) if d.manifold.factors else q
        inside = (d.implicit(q) >= 0) & np.isfinite(problem.energy.value(q))
        found = np.concatenate([found, q[inside]])
        tries += len(q)
        if tries > TRIES * (len(found) + 1):
            return _moved(problem, count, tries, (low, high), rng)
    return found[:count]


def _moved(
    problem: Problem, count: int, tries: int, box: tuple[Array, Array], rng: np.random.Generator
) -> Array:
    """Return points of the set in a box, restored from uniform samples, a random branch each."""
    d, (low, high) = problem.polyhedron, box
    pieces = d.signs_to_pieces([0] * len(d.functions))
    found: list[Array] = []
    for _ in range(RESTORED * count):
        q = rng.uniform(low, high)
        q = d.manifold.factors.scattered(q, rng) if d.manifold.factors else q
        reached, point = problem.restore(pieces[rng.integers(len(pieces))], q)
        aside = d.manifold.difference(point, np.clip(point, low, high))
        if reached and not aside.any() and np.isfinite(problem.energy.value(point)):
            found.append(point)
        if len(found) == count:
            return np.array(found)
    msg = f"box: expected one that meets the polyhedron; {len(found)} of {tries} points do"
    raise ValueError(msg)


def _bounds(problem: Problem, box: Any) -> tuple[Array, Array]:
    """Return the lower and the upper bounds of a box."""
    manifold = problem.polyhedron.manifold
    given = [None] * problem.dimension if box is None else box
    if not isinstance(given, Sequence | np.ndarray) or _length(given) != problem.dimension:
        msg = (
            f"box: expected bounds (low, high) for each of {', '.join(manifold.names)}; got {box!r}"
        )
        raise ValueError(msg)
    bounds, curved = [], {name for f in manifold.factors for name in f.names}
    for name, period, pair in zip(manifold.names, manifold.periods, given, strict=True):
        circle = pair is None and np.isfinite(period)
        if name in curved and pair is not None:
            msg = f"box: expected None for {name}, sampled from the whole sphere; got {pair!r}"
            raise ValueError(msg)
        bound = (-period / 2, period / 2) if circle else (0, 1) if name in curved else pair
        if not _is_interval(bound):
            msg = f"box: expected low < high for {name}, to sample points; got {pair!r}"
            raise ValueError(msg)
        bounds.append(bound)
    low, high = np.array(bounds, dtype=np.float64).T
    return low, high


def _length(several: Any) -> int:
    return 0 if isinstance(several, np.ndarray) and not several.ndim else len(several)


def _is_interval(pair: Any) -> bool:
    if not isinstance(pair, Sequence | np.ndarray) or _length(pair) != 2:
        return False
    if not all(isinstance(x, Real) and np.isfinite(float(x)) for x in pair):
        return False
    return float(pair[0]) < float(pair[1])
