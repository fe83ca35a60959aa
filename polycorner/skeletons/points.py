"""Points where some functions of a polyhedron vanish, and tangents there.

Newton's method returns to the set with the shortest corrections, orthogonal to the orbits of the
symmetry.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgeqrf, dorgqr, dormqr, dtrtrs

from polycorner.polyhedra.cones import independent_rows, null_space, unit_rows
from polycorner.polyhedra.equations import independent_equations
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import distances, evaluated, local_pieces
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Value, cached_property

# Smallest diagonal entry of a triangular factor of unit gradients that is not rounding.
SINGULAR = 1e-14
NEWTON = 8
WORK = 64  # floats that LAPACK may use to apply reflections to one vector
# Tolerances within which a gradient must keep its direction.
VICINITY = 10.0


@dataclass(frozen=True)
class Quotient:
    """A polyhedron modulo its symmetry, with the tolerances of a search.

    Attributes
    ----------
    polyhedron : Polyhedron
        The set.
    symmetry : Symmetry
        The symmetry to divide by.
    tolerances : Tolerances
        What counts as zero, equal and dependent.
    extent : float
        Length, in scale units, after which a walk counts as unbounded.
    equations : tuple of int
        Positions of equations with independent gradients that imply the others nearby: those that
        are solved.  Walks only watch that the others stay zero.
    """

    polyhedron: Polyhedron
    symmetry: Symmetry
    tolerances: Tolerances
    extent: float
    equations: tuple[int, ...]

    @classmethod
    def near(
        cls,
        polyhedron: Polyhedron,
        symmetry: Symmetry,
        tolerances: Tolerances,
        extent: float,
        points: Iterable[Array],
    ) -> "Quotient":
        """Return it with the equations that are independent near some points."""
        equations = independent_equations(polyhedron, points)
        return cls(polyhedron, symmetry, tolerances, extent, equations)

    @property
    def count(self) -> int:
        """The number of inequalities; equations have the positions after them."""
        return len(self.polyhedron.functions)

    def held(self, rows: Iterable[int]) -> list[int]:
        """Return the positions of given inequalities and of the equations that are solved."""
        return [*rows, *self.equations]

    def at(self, q: Array) -> "EvaluatedPoint":
        """Return values, gradients and orbit at a point."""
        return EvaluatedPoint(self, q, *evaluated(self.polyhedron, q))


class EvaluatedPoint:
    """A point with values and scaled gradients of all functions, and the orbit through it."""

    def __init__(
        self,
        quotient: Quotient,
        q: Array,
        values: Array,
        gradients: Array,
        orbit: Array | None = None,
    ) -> None:
        self.quotient, self.q, self.values, self.gradients = quotient, q, values, gradients
        if orbit is None:
            orbit = quotient.symmetry.directions(quotient.polyhedron.manifold, q)
        self.orbit = orbit

    @cached_property
    def distances(self) -> Array:
        """Signed distances ``f / |grad f|`` in scale units."""
        return distances(self.values, self.gradients)

    @property
    def sizes(self) -> Array:
        """Lengths of the scaled gradients."""
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", self.gradients, self.gradients)))

    def active(self) -> frozenset[int] | None:
        """Return the functions that vanish and matter here; None outside the polyhedron."""
        quotient = self.quotient
        zero = quotient.tolerances.zero
        found = local_pieces(quotient.polyhedron, self.values, self.gradients, zero)
        return frozenset().union(*found) if found else None

    def matrix(self, rows: Sequence[int]) -> Array:
        """Return unit gradients of given functions, of the equations, and the orbit."""
        return unit_rows(np.vstack([self.gradients[self.quotient.held(rows)], self.orbit]))

    @property
    def frame(self) -> Array:
        """Orthonormal columns that span the directions across equations and orbit."""
        return null_space(self.matrix([]), self.quotient.tolerances.rank)

    def basis(self, rows: Iterable[int]) -> list[int]:
        """Return rows whose gradients span those of all rows, modulo equations and orbit."""
        others = sorted(rows)
        slopes = unit_rows(self.gradients[others]) @ self.frame
        chosen = independent_rows(slopes, self.quotient.tolerances.rank)
        return sorted(others[i] for i in chosen)

    def vanishing(self, rows: Iterable[int]) -> list[int]:
        """Return which of some functions have no direction here.

        Their gradients vanish, or change by more than their own lengths within a few tolerances,
        so that rounding decides the direction.
        """
        quotient, others = self.quotient, sorted(rows)
        reach = VICINITY * quotient.tolerances.zero
        steps = reach * unit_rows(self.gradients[others])
        steps[~steps.any(axis=1)] = reach
        nearby = self.q + steps * quotient.polyhedron.manifold.scale_array
        moved = [
            evaluated(quotient.polyhedron, q)[1][row] for row, q in zip(others, nearby, strict=True)
        ]
        return [
            row
            for row, gradient in zip(others, moved, strict=True)
            if np.linalg.norm(gradient - self.gradients[row]) >= np.linalg.norm(self.gradients[row])
        ]


class HeldPoint(EvaluatedPoint):
    """A point with an orthonormal frame of the held functions' gradients.

    Attributes
    ----------
    kept : list of int
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
        values, gradients = evaluated(quotient.polyhedron, q)
        super().__init__(quotient, q, values, gradients, orbit)
        self.kept = list(kept)
        self._factorise()
        if len(self.orbit) and not self.condition > quotient.tolerances.dependent:
            # Orbits are smaller at some points: motions about a line do not move what lies on it.
            self.orbit = self.orbit[
                independent_rows(unit_rows(self.orbit), quotient.tolerances.rank)
            ]
            self._factorise()

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


@dataclass(frozen=True, eq=False)
class Sample(Value):
    """A point without its values: coordinates, and the functions that are held there.

    Thousands are kept and sent to workers; values, gradients and frame are computed again.
    """

    q: Array
    kept: tuple[int, ...]

    @classmethod
    def of(cls, point: HeldPoint) -> "Sample":
        """Return that of a point."""
        return cls(point.q, tuple(point.kept))

    def at(self, quotient: Quotient) -> HeldPoint:
        """Return the point."""
        return HeldPoint(quotient, self.q, self.kept)


def projected(
    quotient: Quotient, q: Array, kept: Sequence[int], reach: float, steps: int = NEWTON
) -> HeldPoint | None:
    """Return the nearest point where the held functions vanish.

    None if Newton's method does not converge within ``reach`` scale units of ``q``, or meets
    values that are not finite.  A step shorter than the square root of the rounding error is
    the last: convergence is quadratic.  All steps are orthogonal to the orbit through the guess.
    """
    scales, tolerances = quotient.polyhedron.manifold.scale_array, quotient.tolerances
    settled = tolerances.settled
    moved, last, orbit = 0.0, math.inf, None
    for _ in range(steps):
        frame = HeldPoint(quotient, q, kept, orbit)
        orbit = frame.orbit
        if not frame.finite or frame.condition < SINGULAR:
            return None
        step = frame.correction()
        size = math.sqrt(float(step @ step))
        moved += size
        if moved > reach:
            return None
        if size <= tolerances.rounding or (size < settled and size > last / 2):
            return frame if last == math.inf else HeldPoint(quotient, q, kept)
        q, last = q + scales * step, size
        if size < settled * min(1.0, frame.condition):
            frame = HeldPoint(quotient, q, kept)
            return frame if frame.finite else None
    return HeldPoint(quotient, frame.q, kept) if size <= settled / 10 else None
