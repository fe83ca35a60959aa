"""Periodic boxes: the images of bodies, and which of them can touch."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies.shapes import Body, Part
from polycorner.checks import refuse
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value, cached_property

# The gap of two bodies jumps where their displacement is half a multiple of the period; they are
# no longer than this part of it, so that the gap is well above zero there.
CLEAR = 0.9


@dataclass(frozen=True, eq=False)
class Lattice(Value):
    """The displacements by whole periods along the axes.

    Attributes
    ----------
    lengths : (d,) array
        The periods; ``inf`` along axes without.
    """

    lengths: Array

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """The periodic axes."""
        return tuple(np.flatnonzero(np.isfinite(self.lengths)).tolist())

    @cached_property
    def directions(self) -> Array:
        """Unit vectors along the periodic axes, ``(k, d)``."""
        return np.eye(len(self.lengths))[list(self.axes)]

    def counts(self, reach: float) -> tuple[int, ...]:
        """Return how many images of a pair can touch along each axis.

        As many periods are more than ``2 reach`` long, where ``reach`` is the largest displacement
        at which the two touch.
        """
        return tuple([math.ceil(max(1.0, 2 * reach / (CLEAR * length))) for length in self.lengths])

    def turns(self, bodies: Sequence[Body], fixed: Sequence[Body]) -> tuple[int, ...]:
        """Return by how many periods coordinates go round: a multiple of the counts of pairs."""
        counts = map(self.counts, reaches(bodies, fixed))
        return tuple(map(math.lcm, (1,) * len(self.lengths), *counts))

    def shift(self, whole: tuple[int, ...]) -> Array:
        """Return the displacement by whole numbers of periods, ``(d,)``."""
        found = np.zeros(len(self.lengths))
        for axis in self.axes:
            found[axis] = whole[axis] * self.lengths[axis]
        return found

    def images(self, counts: tuple[int, ...]) -> list[tuple[int, ...]]:
        """Return every displacement by whole periods modulo ``counts`` of them; zero first."""
        return [
            tuple(k - m if 2 * k > m else k for k, m in zip(some, counts, strict=True))
            for some in product(*map(range, counts))
        ]

    def shorter(self, reach: float) -> Iterator[tuple[int, ...]]:
        """Yield one of every two opposite displacements that are shorter than ``reach``."""
        most = [math.floor(reach / length) for length in self.lengths]
        for whole in product(*(range(-m, m + 1) for m in most)):
            if whole > (0,) * len(whole) and np.linalg.norm(self.shift(whole)) < reach:
                yield whole

    def copies(self, body: Body, low: Array, high: Array) -> Iterator[Body]:
        """Yield the images of a body in its place that may reach into a box."""
        parts = body.parts.values()
        least = np.min([part.points.min(axis=0) - part.radius for part in parts], axis=0)
        most = np.max([part.points.max(axis=0) + part.radius for part in parts], axis=0)
        ranges = [
            range(math.ceil((a - most[k]) / t), math.floor((b - least[k]) / t) + 1)
            if math.isfinite(t)
            else (0,)
            for k, (a, b, t) in enumerate(zip(low, high, self.lengths, strict=True))
        ]
        for whole in product(*ranges):
            yield body.moved(self.shift(whole))


def reaches(bodies: Sequence[Body], fixed: Sequence[Body]) -> list[float]:
    """Return for all pairs of which one moves the largest displacement at which they touch."""
    still = [radius(p.points, [p]) for body in fixed for p in body.parts.values()]
    moving = [radius(body.markers, [*body.parts.values()]) for body in bodies]
    return [a + b for a, b in [*combinations(moving, 2), *product(moving, still)]]


def lattice(given: Any, dimension: int) -> Lattice:
    """Return the lattice of the lengths of a periodic box, or raise."""
    if given is None:
        return Lattice(np.full(dimension, math.inf))
    expected = f"{dimension} lengths > 0, or None for a direction without"
    several = isinstance(given, Sequence) or (isinstance(given, np.ndarray) and given.ndim == 1)
    if isinstance(given, str | bytes) or not several or len(given) != dimension:
        refuse("period", expected, given)
    lengths = [
        math.inf
        if length is None
        else checks.real("period", _plain(length), above=0, infinite=True)
        for length in given
    ]
    return Lattice(np.array(lengths))


def _plain(length: ArrayLike) -> Any:
    """Return a NumPy number as a Python one."""
    return length.item() if isinstance(length, np.generic) else length


def middle(points: Array) -> Array:
    """Return the mean of points, exactly zero where it is so up to rounding."""
    found = np.asarray(points.mean(axis=0))
    return np.where(abs(found) > DEFAULT.alike * abs(points).max(), found, 0.0)


def radius(points: Array, parts: Sequence[Part]) -> float:
    """Return the radius of a ball about the middle of points that contains parts."""
    centre = middle(points)
    return max(
        float(np.linalg.norm(part.points - centre, axis=1).max()) + part.radius for part in parts
    )
