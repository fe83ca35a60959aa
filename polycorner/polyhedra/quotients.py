"""Polyhedra modulo their symmetry, and points with the values of all functions there."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.polyhedra.cones import independent_rows, null_space, unit_rows
from polycorner.polyhedra.equations import independent_equations
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import distances, evaluated, local_pieces
from polycorner.polyhedra.symmetry import Symmetry, orbit_directions
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT, Tolerances
from polycorner.values import Checked, Value, cached_property

# Tolerances within which a gradient must keep its direction.
VICINITY = 10.0


@dataclass(frozen=True)
class WalkOptions(Checked):
    """The steps of walks in a skeleton, and the distances at which corners are looked at.

    Lengths are in the scale units of the manifold; about a singular corner, in the radius of a
    small sphere.  The defaults are for sets whose features are of the size of the scales.

    Attributes
    ----------
    first_step, longest_step, shortest_step : float
        Steps of a walk: at its start, at most near the start, and at least: one that has to be
        shorter ends the walk.
    growth : float
        Longest step over the one before.
    reach : float
        Longest correction, relative to the step.
    turn : float
        Largest turn of the tangent in a step, in radians.
    ease : float
        Part of it that a step is planned for.
    arc, stray : float
        Deviation from the tangent, relative to the step, that is allowed for each radian of the
        turn (a circle deviates by half of it), and besides; a larger one leads to another curve.
    tip : float
        Distance from the end of a walk at which a singular point is looked for.
    distances : (float, float, float)
        Distances from a singular corner, decreasing, at which its edges are looked for.
    samples : tuple of float
        The same for a regular corner; those below ten tolerances are left out.
    radii : tuple of float
        Radii of the spheres about a singular corner, of which two in succession must agree.
    link_extent : float
        Length, in radii, after which a walk on such a sphere ends.
    least_patch : float
        Radius of the smallest patch of a net that covers a face.
    reached : float
        Distance from zero that minimisation reaches, and at which a start is moved in.
    definite : float
        Eigenvalue of a second derivative, relative to the largest, that is not taken for zero.
    straight : float
        Deviation from 1 of the cosine between two directions up to which they are one.

    Raises
    ------
    TypeError, ValueError
        Unless all are positive, ``shortest_step < first_step <= longest_step``, the turn is less
        than a right angle, and distances, samples and radii decrease.

    See Also
    --------
    polycorner.skeleton : which takes them as ``options``.
    """

    first_step: float = 0.2
    longest_step: float = 0.5
    shortest_step: float = 1e-7
    growth: float = 1.6
    reach: float = 0.3
    turn: float = 0.25
    ease: float = 0.8
    arc: float = 0.75
    stray: float = 0.01
    tip: float = 1e-2
    distances: tuple[float, float, float] = (3e-3, 1e-3, 3e-4)
    samples: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    radii: tuple[float, ...] = (1e-2, 3e-3, 3e-4, 3e-5)
    link_extent: float = 30.0
    least_patch: float = 1e-4
    reached: float = 1e-5
    definite: float = 1e-3
    straight: float = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in vars(self).items():
            if isinstance(value, list | tuple | np.ndarray):
                several = tuple(checks.real(name, x, above=0) for x in value)
                if not several or any(x <= y for x, y in pairwise(several)):
                    checks.refuse(name, "decreasing numbers", several)
                object.__setattr__(self, name, several)
            else:
                checks.real(name, value, above=0)
        checks.real("turn", self.turn, below=math.pi / 2)
        steps = self.shortest_step, self.first_step, self.longest_step
        if not steps[0] < steps[1] <= steps[2]:
            checks.refuse("shortest_step, first_step, longest_step", "ascending numbers", steps)

    @classmethod
    def careful(cls) -> Self:
        """Return those with half the steps, turns and distances."""
        usual = vars(cls())
        kept = {"growth", "reach", "ease", "arc", "link_extent", "reached", "definite", "straight"}
        halved = {name: np.asarray(x) / 2 for name, x in usual.items() if name not in kept}
        return cls(**{name: x.tolist() for name, x in halved.items()})


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
    options : WalkOptions
        Steps of walks.
    """

    polyhedron: Polyhedron
    symmetry: Symmetry = field(default_factory=Symmetry)
    tolerances: Tolerances = DEFAULT
    extent: float = math.inf
    equations: tuple[int, ...] = ()
    options: WalkOptions = WalkOptions()

    def near(self, points: Iterable[Array]) -> "Quotient":
        """Return it with the equations that are independent near some points."""
        return replace(self, equations=independent_equations(self.polyhedron, points))

    @property
    def manifold(self) -> Manifold:
        """The manifold of the points."""
        return self.polyhedron.manifold

    @property
    def scales(self) -> Array:
        """The scales of the coordinates."""
        return self.polyhedron.manifold.scale_array

    @property
    def count(self) -> int:
        """The number of inequalities; equations have the positions after them."""
        return len(self.polyhedron.functions)

    def held(self, rows: Iterable[int]) -> list[int]:
        """Return the positions of given inequalities and of the equations that are solved."""
        return [*rows, *self.equations]

    def written(self, rows: Iterable[int]) -> str:
        """Return the names of inequalities for a sentence."""
        return ", ".join(self.polyhedron.names[i] for i in sorted(rows))

    def at(self, q: Array) -> "EvaluatedPoint":
        """Return values, gradients and orbit at a point."""
        return EvaluatedPoint.placed(self, q, ())

    def evaluated(self, q: Array) -> tuple[Array, Array]:
        """Return values and scaled gradients of all functions."""
        return evaluated(self.polyhedron, q)

    def bent(self, q: Array) -> tuple[Array, Array, Array]:
        """Return values and scaled first and second derivatives of all functions."""
        values, gradients, hessians = self.polyhedron.bundle.evaluate(q, 2)
        return values, gradients * self.scales, hessians * np.outer(self.scales, self.scales)

    def orbit(self, q: Array) -> Array:
        """Return the scaled tangent vectors of the orbit through a point, ``(g, n)``."""
        return orbit_directions(self.symmetry, self.manifold, q)

    def displacement(self, p: Array, q: Array) -> Array:
        """Return the displacement from one continuous orbit to another, by the invariants."""
        return self.symmetry.displacement(self.manifold, p, q)

    def separation(self, p: Array, q: Array) -> float:
        """Return how far the continuous orbits of two points are apart, in scale units."""
        return self.symmetry.separation(self.manifold, p, q)

    def images(self, q: Array) -> list[Array]:
        """Return a point and its images under the finite group."""
        return [element.apply(q) for element in self.symmetry.group]

    @cached_property
    def _circles(self) -> tuple[NDArray[np.bool_], Array]:
        """Mask of the coordinates that are circles, and their radii in scale units."""
        periods = np.array(self.manifold.periods)
        closed = np.isfinite(periods)
        return closed, periods[closed] / math.tau / self.scales[closed]

    def place(self, q: Array) -> Array:
        """Return coordinates that separate the orbits of the continuous symmetries."""
        if self.symmetry.invariants is not None:
            return self.symmetry.invariants(q)
        u = q / self.scales
        closed, radii = self._circles
        turn, lines = u[closed] / radii, ~closed
        turned = [radii * np.cos(turn), radii * np.sin(turn)]
        for factor in self.manifold.factors:
            if factor.turns:
                lines[factor.at] = False
                turned.append(factor.even(q) / self.scales[factor.at.start])
        return np.concatenate([u[lines], *turned])


class EvaluatedPoint:
    """A point with values and scaled gradients of all functions, and the orbit through it."""

    kept: Sequence[int] = ()

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
            orbit = quotient.orbit(q)
        self.orbit = orbit

    @classmethod
    def placed(cls, quotient: Quotient, q: Array, kept: Sequence[int]) -> Self:  # noqa: ARG003 - none is held
        """Return a point."""
        return cls(quotient, q, *quotient.evaluated(q))

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
        found = local_pieces(quotient.polyhedron, self.distances, quotient.tolerances.zero)
        return frozenset().union(*found) if found else None

    def matrix(self, rows: Sequence[int]) -> Array:
        """Return unit gradients of given functions, of the equations, and the orbit."""
        return unit_rows(np.vstack([self.gradients[self.quotient.held(rows)], self.orbit]))

    @property
    def frame(self) -> Array:
        """Orthonormal columns that span the directions across equations and orbit."""
        return null_space(self.matrix([]), self.quotient.tolerances.rank)

    def slopes(self, rows: Sequence[int]) -> Array:
        """Return unit gradients of given functions in the frame, ``(k, r)``."""
        return unit_rows(self.gradients[list(rows)]) @ self.frame

    def basis(self, rows: Iterable[int]) -> list[int]:
        """Return rows whose gradients span those of all rows, modulo equations and orbit."""
        others = sorted(rows)
        chosen = independent_rows(self.slopes(others), self.quotient.tolerances.rank)
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
        nearby = self.q + steps * quotient.scales
        moved = [quotient.evaluated(q)[1][row] for row, q in zip(others, nearby, strict=True)]
        return [
            row
            for row, gradient in zip(others, moved, strict=True)
            if np.linalg.norm(gradient - self.gradients[row]) >= np.linalg.norm(self.gradients[row])
        ]


P = TypeVar("P", bound=EvaluatedPoint)


@dataclass(frozen=True, eq=False)
class Sample(Value, Generic[P]):
    """A point without its values: coordinates, what is held there, and the kind of point.

    Thousands are kept and sent to workers; values, gradients and frame are computed again.
    """

    q: Array
    kept: tuple[int, ...]
    kind: type[P]

    @classmethod
    def of(cls, point: P) -> "Sample[P]":
        """Return that of a point."""
        return Sample(point.q, tuple(point.kept), type(point))

    def at(self, quotient: Quotient) -> P:
        """Return the point."""
        return self.kind.placed(quotient, self.q, self.kept)
