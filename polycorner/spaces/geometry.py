"""Points of products by their coordinates: images of a point, chords, and ways along vectors.

These maps are for algorithms: they do not check that points lie on spheres.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import reals, refuse
from polycorner.spaces.arguments import finite
from polycorner.spaces.embedding import Array
from polycorner.spaces.factors import NEAR, Factors, factors
from polycorner.values import Value, cached_property, read_only


class Geometry(Value):
    """A product of lines, circles, spheres and rotations, by its coordinates."""

    names: tuple[str, ...]
    periods: tuple[float, ...]
    scales: tuple[float, ...]
    spheres: tuple[tuple[str, ...], ...]
    rotations: tuple[tuple[str, ...], ...]

    @cached_property
    def factors(self) -> Factors:
        """The spheres and rotations, in the order of their coordinates."""
        return factors(self.names, self.spheres, self.rotations, self.periods, self.scales)

    @cached_property
    def scale_array(self) -> Array:
        """The scales as an array."""
        scales: Array = read_only(np.array(self.scales))
        return scales

    @cached_property
    def positions(self) -> dict[str, int]:
        """The position of every coordinate, by name."""
        return {name: i for i, name in enumerate(self.names)}

    @cached_property
    def everything(self) -> tuple[int, ...]:
        """The positions of all coordinates: one tuple, which functions of them all share."""
        return tuple(range(len(self.names)))

    @cached_property
    def circles(self) -> frozenset[int]:
        """The positions of the coordinates that are circles."""
        return frozenset(self._circles[0].tolist())

    @cached_property
    def _circles(self) -> tuple[NDArray[np.intp], Array]:
        """Positions and periods of the coordinates that are circles."""
        periods = np.array(self.periods, dtype=np.float64)
        positions = np.flatnonzero(periods < math.inf)
        return positions, periods[positions]

    def placed(self, points: Array, argument: str = "q") -> Array:
        """Return points ``(..., N)`` with vectors and quaternions normalised.

        Raises
        ------
        ValueError
            For lengths that differ from one by more than 1e-3.
        """
        self.factors.check(points, argument, NEAR)
        return self.onto(points)

    def onto(self, q: Array) -> Array:
        """Return the nearest points of the manifold; lines and circles stay as they are."""
        return self.factors.onto(q) if self.factors else q

    def canonical(self, points: Array) -> Array:
        """Return what :meth:`wrap` does, unchecked: vectors of length zero stay."""
        points = self._principal(points.copy())
        if self.factors:
            self.factors.wrap(points)
        return points

    def moved(self, q: Array, v: Array) -> Array:
        """Return what :meth:`shift` does, unchecked and without wrapping."""
        found = np.asarray(q + v)
        self.factors.shift(q, v, found)
        return found

    def chord(self, p: ArrayLike, q: ArrayLike) -> Array:
        """Return the shortest displacement from ``q`` to an image of ``p``, in coordinates.

        Images are points a period away on circles, and the negative quaternion of a rotation.
        """
        p, q = finite(reals("p", p), "p"), finite(reals("q", q), "q")
        for argument, array in (("p", p), ("q", q)):
            if array.shape[-1:] != (len(self.names),):
                refuse(argument, f"shape (..., {len(self.names)})", array.shape)
        return self._principal(self.image(p, q) - q)

    def image(self, p: Array, q: Array) -> Array:
        """Return ``p`` with the signs of its quaternions that bring it nearest to ``q``."""
        return self.factors.signs(p, q) * p if self.rotations else p

    def _principal(self, array: Array) -> Array:
        circles, periods = self._circles
        if circles.size:
            values = array[..., circles]
            array[..., circles] = values - periods * np.ceil(values / periods - 0.5)
        return array
