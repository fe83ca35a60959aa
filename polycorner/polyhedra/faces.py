"""Faces: the points where some functions vanish, and the way to them from points nearby.

In scaled coordinates ``u = q / scales`` let ``f`` be the functions that are held, each divided by
the length of its gradient, and ``A`` their derivative.  The shortest step to the zeros of the
linearised functions is ``d = -A^+ f`` (Gauss and Newton), orthogonal to the orbit of the symmetry.
Where the gradients are independent at the solution the steps converge to it quadratically ([NW]
sec. 10.3), so that a step below the square root of the rounding error is the last; where they are
dependent convergence is linear, and directions along which ``A`` is small are cut off.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from scipy.linalg.lapack import dgeqrf, dorgqr, dormqr, dtrtrs

from polycorner.polyhedra.cones import independent_rows, unit_rows
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient, WalkOptions
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

NEWTON = 8
STEPS = 50  # where gradients may be dependent
WORK = 64  # floats that LAPACK may use to apply reflections to one vector


class HeldPoint(EvaluatedPoint):
    """A point with an orthonormal frame of the held functions' gradients.

    Attributes
    ----------
    kept : tuple of int
        Inequalities that are held at zero, with independent gradients.
    finite : bool
        Whether values and gradients are finite; otherwise nothing else is defined.
    condition : float
        Smallest diagonal entry of the triangular factor of the unit gradients: zero where they
        are dependent.
    volume : float
        Volume of the parallelepiped of the held gradients and the orbit.
    """

    def __init__(
        self, quotient: Quotient, q: Array, kept: Sequence[int], orbit: Array | None = None
    ) -> None:
        values, gradients = quotient.evaluated(q)
        super().__init__(quotient, q, values, gradients, orbit)
        self.kept = tuple(kept)
        self._factorise()
        if len(self.orbit) and not self.condition > quotient.tolerances.dependent:
            # Orbits are smaller at some points: motions about a line do not move what lies on it.
            self.orbit = self.orbit[
                independent_rows(unit_rows(self.orbit), quotient.tolerances.rank)
            ]
            self._factorise()

    @classmethod
    def placed(cls, quotient: Quotient, q: Array, kept: Sequence[int]) -> Self:
        """Return a point where given functions are held."""
        return cls(quotient, q, kept)

    def _factorise(self) -> None:
        held = self.quotient.held(self.kept)
        rows = self.gradients[held]
        rows = np.concatenate([rows, self.orbit]) if len(self.orbit) else rows
        sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
        total = float(self.values.sum() + sizes.sum())
        self.finite = math.isfinite(total) and float(sizes.min(initial=1.0)) > 0
        self.condition, self.volume = 0.0, 0.0
        self._target = np.zeros(len(rows) if self.finite else 0)
        if self.finite:
            self._target[: len(held)] = -self.values[held] / sizes[: len(held)]
            self._factor, self._reflectors, *_ = dgeqrf((rows / sizes[:, None]).T, overwrite_a=True)
            diagonal = abs(self._factor.diagonal())
            self.condition = float(diagonal.min(initial=1.0))
            self.volume = float(diagonal.prod() * sizes.prod())

    @cached_property
    def _normal(self) -> Array:
        """Orthonormal columns that span the held gradients and the orbit."""
        count = len(self._reflectors)
        return np.asarray(dorgqr(self._factor[:, :count], self._reflectors)[0])

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_normal"}

    def tangent(self, v: Array) -> Array:
        """Return the unit vector nearest to ``v`` along which the held functions stay zero."""
        t = v - self._normal @ (self._normal.T @ v)
        return np.asarray(t / max(math.sqrt(float(t @ t)), 1e-300))

    def correction(self) -> Array:
        """Return the shortest scaled step to the zeros of the linearised held functions."""
        count = len(self._reflectors)
        step = np.zeros((len(self.q), 1))
        if count:
            found, info = dtrtrs(self._factor, self._target, trans=1)
            if info:
                msg = "the gradients of the held functions are dependent"
                raise np.linalg.LinAlgError(msg)
            step[:count, 0] = found[:count]
            step = dormqr("L", "N", self._factor[:, :count], self._reflectors, step, WORK)[0]
        return np.asarray(step[:, 0])

    def truncated(self, along: Array | None) -> Array:
        """Return :meth:`correction` without directions along which the gradients are small.

        The step is combined of the columns of ``along``, by default of all directions.
        """
        matrix = self.matrix(self.kept)
        matrix = matrix if along is None else matrix @ along
        step = np.linalg.lstsq(matrix, self._target, rcond=self.quotient.tolerances.rank)[0]
        return np.asarray(step if along is None else along @ step)

    @property
    def is_curve(self) -> bool:
        """Whether the held functions leave a curve, modulo the symmetry."""
        return len(self._target) + 1 == len(self.q)

    def orientation(self, t: Array) -> float:
        """Return the sign of the determinant of held gradients and tangent, where it is square."""
        if not self.is_curve:
            return 1.0
        frame = np.vstack([self._normal.T, t])
        return float(np.sign(np.linalg.det(frame) * np.diagonal(self._factor).prod()))


class Arrival(NamedTuple):
    """Where the way to a face ended: a point, and whether the last step was rounding there."""

    point: HeldPoint
    settled: bool


def project(
    quotient: Quotient,
    q: Array,
    kept: Sequence[int],
    *,
    along: Array | None = None,
    reach: float = math.inf,
    stride: float = math.inf,
    steps: int = STEPS,
    dependent: bool = True,
) -> Arrival:
    """Move a point onto a face by the shortest steps, orthogonal to the orbit through it.

    Parameters
    ----------
    quotient : Quotient
        The polyhedron modulo its symmetry.
    q : (n,) array
        A point nearby.
    kept : sequence of int
        The functions that vanish, besides the equations that are solved.
    along : (n, r) array, optional
        Scaled directions that the steps are combined of; by default all.
    reach : float, optional
        Longest way, in scale units.
    stride : float, optional
        Longest step, in scale units; longer ones are shortened.
    steps : int, optional
        The most steps.
    dependent : bool, optional
        Whether the way goes on where gradients are dependent, by steps without the directions
        along which they are small.

    Returns
    -------
    Arrival
        Not settled where a value or a derivative is not finite, beyond the reach, after the last
        step, and where gradients are dependent if that is not allowed.
    """
    tolerances, scales = quotient.tolerances, quotient.scales
    moved, last, orbit = 0.0, math.inf, None
    for _ in range(steps):
        point = HeldPoint(quotient, q, kept, orbit)
        orbit = point.orbit
        # Smaller diagonal entries of the triangular factor are rounding.
        singular = point.condition < tolerances.rounding / 10
        if not point.finite or (singular and not dependent):
            return Arrival(point, settled=False)
        step = point.truncated(along) if dependent else point.correction()
        size = math.sqrt(float(step @ step))
        moved += size
        if moved > reach:
            return Arrival(point, settled=False)
        still = size <= tolerances.rounding or (size < tolerances.settled and size > last / 2)
        if still and not dependent:
            return Arrival(point if last == math.inf else HeldPoint(quotient, q, kept), True)
        q, last = q + scales * (step if size <= stride else step * (stride / size)), size
        # Where gradients are independent the step after one as short is rounding.
        if still or (not dependent and size < tolerances.settled * min(1.0, point.condition)):
            point = HeldPoint(quotient, q, kept)
            return Arrival(point, point.finite)
    still = size <= tolerances.settled / 10  # a step so short need not be taken
    return Arrival(HeldPoint(quotient, point.q if still else q, kept), still)


def projected(
    quotient: Quotient, q: Array, kept: Sequence[int], reach: float, steps: int = NEWTON
) -> HeldPoint | None:
    """Return the nearest point where the held functions, independent ones, vanish.

    None if Newton's method does not converge within ``reach`` scale units of ``q``.
    """
    found = project(quotient, q, kept, reach=reach, steps=steps, dependent=False)
    return found.point if found.settled else None


# ------------------------------------------------------------------------------- steps along curves


class Followed(Protocol):
    """A point of a curve, or of a set along which one walks straight ahead."""

    def tangent(self, like: Array, /) -> Array:
        """Return the unit vector along it on the side of, or nearest to, another."""


P = TypeVar("P", bound=Followed)


class Stepper(ABC, Generic[P]):
    """The state of a walk from point to point ([Gov] sec. 2).

    A step of length ``h`` goes ``h t + h^2 b / 2`` ahead and is corrected, by ``reach h`` at most.
    It is halved until the tangent turns less than ``turn`` and the point is no farther off the old
    tangent than the turn explains (:class:`WalkOptions`).

    Attributes
    ----------
    point : Followed
        The last point.
    t, bend : array
        The unit tangent there, and how it turns.
    passed : list of Followed
        All points.
    length : float
    """

    def __init__(
        self, start: P, tangent: Array, options: WalkOptions, units: Array | float = 1.0
    ) -> None:
        self.options, self.units = options, units
        self.point, self.t, self.bend = start, tangent, np.zeros(len(tangent))
        self.passed, self.length = [start], 0.0

    @abstractmethod
    def place(self, point: P) -> Array:
        """Return the coordinates of a point, which are to be divided by the units."""

    @abstractmethod
    def corrected(self, x: Array, across: Array, reach: float) -> P | None:
        """Return a point of the curve within reach, or None."""

    def trials(self, h: float) -> Iterator[tuple[P, Array, float, bool]]:
        """Yield points ahead at shorter and shorter steps, tangents, and whether they will do."""
        options = self.options
        while h > options.shortest_step:
            ahead = self.place(self.point) + h * self.units * (self.t + h / 2 * self.bend)
            point = self.corrected(ahead, self.t, options.reach * h)
            if point is not None:
                t = point.tangent(self.t)
                turn = math.acos(min(1.0, float(t @ self.t)))
                off = float(np.linalg.norm(self.way(point) - h * self.t))
                # A larger deviation than the turn explains: another curve of the same functions.
                fits = turn < options.turn and off <= h * (options.arc * turn + options.stray)
                yield point, t, h, fits
            h /= 2

    def next_step(self, h: float, longest: float) -> float:
        """Return the length of the step after one of length ``h``."""
        options, bend = self.options, float(np.linalg.norm(self.bend))
        return min(options.growth * h, longest, options.ease * options.turn / max(bend, 1e-300))

    def move(self, point: P, t: Array, *, bends: bool = True) -> None:
        """Go on to a point; a tangent that was only transported has no bend."""
        chord = self.chord(point)
        self.length += chord
        self.bend = (t - self.t) / chord if bends and chord > 0 else self.bend
        self.point, self.t = point, t
        self.passed.append(point)

    def way(self, point: P) -> Array:
        """Return the displacement to a point."""
        return np.asarray((self.place(point) - self.place(self.point)) / self.units)

    def chord(self, point: P) -> float:
        """Return its length."""
        return float(np.linalg.norm(self.way(point)))

    def guess(self, point: P, s: float) -> Array:
        """Return a fraction ``s`` of the way to a point, on the cubic with the tangents."""
        way, h = self.way(point), self.chord(point)
        out, back = h * self.t - way, h * point.tangent(self.t) - way
        part = s * (way + (1 - s) * ((1 - s) * out - s * back))
        return np.asarray(self.place(self.point) + self.units * part)

    def between(self, point: P, s: float, reach: float = math.inf) -> P:
        """Return the point of the curve a fraction of the way to another."""
        way = self.way(point)
        found = self.corrected(self.guess(point, s), way / np.linalg.norm(way), reach)
        return point if found is None else found
