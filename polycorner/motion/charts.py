"""Motion in coordinates about the centres of mass, of bodies that have their origin elsewhere.

A body whose centre of mass is at ``c`` in its own coordinates has it at ``X = x + R c``, with the
velocity ``V = x' + R' c``.  Its kinetic energy is ``m |V|^2 / 2`` and that of the rotation about
the centre ([LL] sec. 32), so that a free motion is ``V' = 0``.  In the place ``x`` of the origin it
is not uniform: a step that takes the force of inertia ``m w^2 R c`` in its middle, where that of
the whole step is ``m w^2 R c sin(h w / 2) / (h w / 2)`` in the plane, changes the momentum by
``m |c| h^3 w^4 / 24``, and goes along a straight line where the origin goes round an arc.  In ``X``
the mass of the centre is constant, and a step of the free motion is exact, whatever the spin.  So
motion is computed in ``X`` and told in ``x``: it does not depend on the origin.

``R`` is the quadratic form in quaternions that the formulas of gaps and energies have, so that
these are the same in both coordinates also where a quaternion is off the unit sphere: by rounding
or, at instants between two midpoints, by the sagitta.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array
from polycorner.values import Value, cached_property


@dataclass(frozen=True, eq=False)
class Offset(Value):
    """Bodies alike with a centre of mass that is not their origin.

    Attributes
    ----------
    places : (n, d) array of int
        Where the coordinates of their origins stand among those of all bodies.
    turns : (n, 1) or (n, 4) array of int
        And those of their orientations: an angle in the plane, a quaternion in space.
    centre : (d,) array
        Their centre of mass, in their own coordinates.
    """

    places: NDArray[np.int64]
    turns: NDArray[np.int64]
    centre: Array

    def arms(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return ``R c`` and its rate, ``(..., n, d)`` each, for all coordinates ``(..., D)``."""
        a, rate, c = q[..., self.turns], v[..., self.turns], self.centre
        if len(c) == 2:
            cosine, sine = np.cos(a), np.sin(a)
            arm = np.concatenate([cosine * c[0] - sine * c[1], sine * c[0] + cosine * c[1]], -1)
            return arm, rate * np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
        return _product(a, a, c), 2 * _product(a, rate, c)


def _product(a: Array, b: Array, c: Array) -> Array:
    """Return the bilinear form, symmetric in two quaternions, of which ``R c`` is the square."""
    (w, u), (s, t) = ((x[..., :1], x[..., 1:]) for x in (a, b))
    straight = (w * s - (u * t).sum(axis=-1, keepdims=True)) * c
    along = u * (t @ c)[..., None] + t * (u @ c)[..., None]
    found: Array = straight + along + np.cross(w * t + s * u, c)
    return found


@dataclass(frozen=True, eq=False)
class Chart(Value):
    """A system whose coordinates are about centres of mass, and how they follow from others.

    Attributes
    ----------
    build : callable
        Returns that system, with the same bodies, contacts and laws in the same order.
    offsets : sequence of Offset
    """

    build: Callable[[], Any]
    offsets: Sequence[Offset]

    @cached_property
    def system(self) -> Any:
        """The system in which motion is computed."""
        return self.build()

    def inward(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return coordinates and velocities there for those here, of any one shape."""
        return self._shifted(q, v, 1.0, q.size)

    def outward(self, q: Array, v: Array, size: int) -> tuple[Array, Array]:
        """Return those here for those there, of which each instant has ``size``."""
        return self._shifted(q, v, -1.0, size)

    def _shifted(self, q: Array, v: Array, sign: float, size: int) -> tuple[Array, Array]:
        places, speeds = (x.reshape(-1, size).copy() for x in (q, v))
        for offset in self.offsets:
            arms, rates = offset.arms(places, speeds)
            places[:, offset.places] += sign * arms
            speeds[:, offset.places] += sign * rates
        return places.reshape(q.shape), speeds.reshape(v.shape)
