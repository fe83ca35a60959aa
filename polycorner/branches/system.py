"""Fritz John points of an energy on the faces of a polyhedron that depends on a parameter.

Let ``f_i(q, t) >= 0`` and ``h_j(q, t) = 0`` be the functions of the set and ``E(q, t)`` the energy.
A point of the face ``A``, where the ``f_i`` of ``A`` and all ``h_j`` vanish, together with a ray of
multipliers ``mu``, is a Fritz John point if

==============================================  ===========================================
``mu_0 dE - sum mu_i df_i = 0``                 the gradients by ``q`` are related
``f_i = 0`` for ``i`` in ``A``, ``h_j = 0``     the point lies on the face
``|mu| = 1``                                    one multiple of each relation
==============================================  ===========================================

It is stationary with ``dE/df_i = mu_i / mu_0`` where ``mu_0 > 0``.  For almost all functions the
solutions ``(q, t, mu)`` are a curve for every face, also where the active gradients become
dependent (``mu_0 = 0``) and where one function more vanishes than there are coordinates: then the
point stays and ``mu`` moves.  On it lie the arcs with ``mu >= 0`` and all other ``f_i >= 0``; an
arc ends where one of these vanishes, and there exactly one arc of another face begins
([KojimaHirabayashi] sec. 4, [JJT]).
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import Tolerances
from polycorner.values import cached_property

Face = tuple[int, ...]  # positions of the inequalities that are held, in ascending order


class Derivatives(NamedTuple):
    """Values ``(M,)`` and derivatives of all rows by coordinates and the parameter."""

    values: Array
    gradients: Array
    hessians: Array


@dataclass(frozen=True, eq=False)
class FritzJohnSystem:
    """The equations for all faces of a polyhedron with one parameter, or several.

    Attributes
    ----------
    problem : Problem
        On the manifold of the coordinates, with the formulas' parameters as further coordinates.
    manifold : Manifold
        Of the coordinates alone.
    start : (p,) array
        Values of the formulas' parameters at the start of the interval, or of a rectangle.
    rates : (p, d) array
        Their derivatives by ``s``.
    length : float
        Of the interval, or of the sides of the rectangle, in units of ``s``.
    sizes : (M,) array
        Sizes by which the functions and the energy are divided.
    equations : tuple of int
        Rows of the equations that imply the others nearby.
    symmetry : Symmetry
    tolerances : Tolerances
    """

    problem: Problem
    manifold: Manifold
    start: Array
    rates: Array
    length: float
    sizes: Array
    equations: tuple[int, ...]
    symmetry: Symmetry
    tolerances: Tolerances

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return self.manifold.size

    @property
    def is_union(self) -> bool:
        """Whether the polyhedron is a union of pieces."""
        return self.problem.polyhedron.is_union

    @property
    def is_sparse(self) -> bool:
        """Whether matrices are sparse."""
        return False

    @property
    def others(self) -> int:
        """The number of equations."""
        return self.problem.rows - self.problem.inequalities - 1

    def place(self, u: Array) -> Array:
        """Return coordinates, not wrapped."""
        return u * self.manifold.scale_array

    @property
    def d(self) -> int:
        """The number of parameters."""
        return int(self.rates.shape[1])

    def values(self, s: Array | float) -> Array:
        """Return the values of the formulas' parameters."""
        return np.asarray(self.start + self.rates @ np.atleast_1d(s))

    def at(self, u: Array, s: Array | float) -> Derivatives:
        """Return values and derivatives of all functions by ``(u, s)``, divided by the sizes."""
        n, (p, d) = self.n, self.rates.shape
        q = np.concatenate([self.place(u), self.values(s)])
        values, gradients, hessians = self.problem.evaluate(q, 2)
        onto = np.zeros((n + p, n + d))
        onto[:n, :n], onto[n:, n:] = np.eye(n), self.rates
        size = self.sizes[:, None]
        return Derivatives(
            values / self.sizes,
            (gradients / size) @ onto,
            onto.T @ (hessians / size[:, :, None]) @ onto,
        )

    def sized(self, u: Array, s: Array | float) -> Array:
        """Return the sizes of all first and second derivatives, one for those that vanish."""
        values, *derivatives = self.at(u, s)
        first, second = (np.linalg.norm(d.reshape(len(d), -1), axis=1) for d in derivatives)
        # The curvature of a distance of parallel segments is none by which to measure it.
        level = np.append(abs(values[:-1]) + first[:-1], math.inf)
        bent = level <= self.tolerances.zero * second
        sizes = first + np.where(bent, second, np.minimum(second, level))
        return np.where(np.isfinite(sizes) & (sizes > 0), sizes, 1.0)

    def orbit(self, u: Array) -> Array:
        """Return the scaled tangent vectors of the continuous symmetries, ``(g, n)``."""
        if self.symmetry.tangents is None and not self.symmetry.fields:
            return np.zeros((0, self.n))
        return np.asarray(self.symmetry.directions(self.manifold, self.place(u)))

    def rows(self, face: Face) -> list[int]:
        """Return the rows that have multipliers on a face: its own, equations, the energy."""
        return [*face, *self.equations, self.problem.rows - 1]

    def guess(self, face: Face, u: Array, s: Array | float, mu: Array) -> Array:
        """Return the vector of unknowns ``(u, s, mu)`` on a face, of multipliers of all rows."""
        return np.concatenate([u, np.atleast_1d(s), mu[self.rows(face)]])

    def towards(self, x: Array) -> Array:
        """Return the unit vector of unknowns in which the parameter grows."""
        along = np.zeros(len(x))
        along[self.n] = 1.0
        return along

    def point(self, face: Face, x: Array) -> "FritzJohn":
        """Return the residual and the derivatives of the equations at a guess."""
        return FritzJohn(self, face, x)


class FritzJohn:
    """The equations of a face at a guess ``x = (u, s, mu)``.

    Attributes
    ----------
    u, s, mu
        The parts of the guess; ``mu`` are the multipliers of all rows, ``s`` the first parameter.
    both : (d,) array
        All parameters.
    left : (N,) array
        The residual.
    jacobian : (N, n + d + k) array
        Its derivative, and the rows that keep a step across the orbit.
    finite : bool
        Whether all are.
    """

    jacobian: Any

    def __init__(self, system: FritzJohnSystem, face: Face, x: Array) -> None:
        self.system, self.face, self.x = system, face, x
        n, p, rows = system.n, system.n + system.d, system.rows(face)
        self.u, self.s, self.both, own = x[:n], float(x[n]), x[n:p], x[p:]
        self.mu = np.zeros(system.problem.rows)
        self.mu[rows] = own
        self.known = system.at(self.u, self.both)
        values, gradients, hessians = self.known
        sign = np.where(np.arange(len(rows)) < len(rows) - 1, -1.0, 1.0)
        slopes, k = sign[:, None] * gradients[rows, :n], len(rows) - 1
        bent = np.einsum("i,ijk->jk", sign * own, hessians[rows])
        self.curvature = bent[:n, :n]
        self.orbit = unit_rows(system.orbit(self.u))
        g = len(self.orbit)
        self.left = np.concatenate(
            [own @ slopes, values[rows[:-1]], [(own @ own - 1) / 2], np.zeros(g)]
        )
        J = np.zeros((n + k + 1 + g, p + len(rows)))
        J[:n, :p], J[:n, p:] = bent[:n], slopes.T
        J[n : n + k, :p] = gradients[rows[:-1]]
        J[n + k, p:] = own
        J[n + k + 1 :, :n] = self.orbit
        self.jacobian = J
        self.finite = bool(np.isfinite(J).all() and np.isfinite(self.left).all())

    def moved(self, x: Array) -> Self:
        """Return the equations at another guess."""
        return type(self)(self.system, self.face, x)

    def turns(self, before: Self) -> float:
        """Return the angle by which what else belongs to a point has turned."""
        del before  # a subclass has more
        return 0.0

    def spectra(self) -> list[Array]:
        """Return numbers, ascending, of which none may change sign along a curve."""
        return [self.curvatures()]

    @property
    def bordered(self) -> Array:
        """The Jacobian with columns along the orbit, which make its rows independent."""
        across = np.zeros((len(self.jacobian), len(self.orbit)))
        across[: self.system.n] = self.orbit.T
        return np.hstack([self.jacobian, across])

    def apart(self, other: "FritzJohn") -> float:
        """Return how far another point is, with its multipliers."""
        manifold, place = self.system.manifold, self.system.place
        moved = manifold.chord(place(self.u), place(other.u)) / manifold.scale_array
        parts = (moved, self.mu - other.mu, self.both - other.both)
        return max(float(np.abs(part).max(initial=0.0)) for part in parts)

    def newton_step(self, row: Array, value: float) -> Array:
        """Return Newton's step for the equations and one more, with its derivatives and value."""
        matrix, left = np.vstack([self.jacobian, row]), np.append(self.left, value)
        rcond = self.system.tolerances.rounding
        return np.asarray(np.linalg.lstsq(matrix, -left, rcond=rcond)[0])

    @property
    def margin(self) -> float:
        """How far the point is from those where several curves may cross: a singular value."""
        return float(self.kernel()[0][1])

    def only_tangent(self) -> Array | None:
        """Return a unit vector along the curve, or None where several curves may cross."""
        return None if self.margin <= self.system.tolerances.dependent else self.kernel()[1][0]

    def is_fold(self, like: Array) -> bool:
        """Whether this is a regular point of a curve on which the parameter stays."""
        tolerances = self.system.tolerances
        if abs(self.left).max() > tolerances.zero or self.only_tangent() is None:
            return False
        # Beside a branch point the parameter nearly stays too, but so does all that is singular.
        least = tolerances.near * min(1.0, self.margin)
        return bool(abs(self.tangent(like)[self.system.n]) <= least)

    def kernel(self) -> tuple[Array, Array]:
        """Return singular values ``(N,)``, ascending, and their vectors, of the Jacobian."""
        _, values, vectors = np.linalg.svd(self.jacobian)
        extra = len(vectors) - len(values)
        values = np.concatenate([values, np.zeros(max(extra, 0))])
        return values[::-1], vectors[::-1]

    def tangent(self, like: Array | None = None) -> Array:
        """Return the unit vector along the curve, on the side of ``like``."""
        t = self.kernel()[1][0]
        return np.asarray(-t if like is not None and t @ like < 0 else t)

    @cached_property
    def spectrum(self) -> tuple[Array, Array]:
        """Curvatures along the face, and their directions as rows."""
        basis = self.along()
        values, vectors = np.linalg.eigh(basis.T @ self.curvature @ basis)
        return values, (basis @ vectors).T

    def along(self, also: Face = ()) -> Array:
        """Return orthonormal columns along the face, and along other functions' zeros."""
        rows = [*also, *self.system.rows(self.face)[:-1]]
        held = np.vstack([self.known.gradients[rows, : self.system.n], self.orbit])
        return null_space(unit_rows(held), self.system.tolerances.rank)

    def curvatures(self, also: Face = ()) -> Array:
        """Return eigenvalues of the Lagrangian's Hessian along the face, ascending."""
        if not also:
            return self.spectrum[0]
        basis = self.along(also)
        return np.asarray(np.linalg.eigvalsh(basis.T @ self.curvature @ basis))

    @property
    def index(self) -> int:
        """The number of negative curvatures along the face."""
        return len(self.falling)

    @property
    def definite(self) -> float:
        """How far the curvatures are from zero."""
        return float(abs(self.curvatures()).min(initial=math.inf))

    @property
    def falling(self) -> Array:
        """The directions along the face of negative curvature, ``(i, n)``."""
        values, vectors = self.spectrum
        return vectors[values < 0]

    def _watched_values(self) -> Array:
        system, m = self.system, self.system.problem.inequalities
        ends = [self.both, system.length - self.both]
        values = np.concatenate([self.known.values[:m], self.x[-1:], *ends])
        values[[*self.face]] = self.mu[[*self.face]]
        return values

    def watched(self) -> tuple[Array, Array]:
        """Return what must not be negative along an arc ``(m + 1 + 2 d,)``, and derivatives by x.

        These are, row by row, the values of the open inequalities and the multipliers of the held
        ones; the multiplier of the energy; and the parameters' distances from both ends.
        """
        n, p = self.system.n, self.system.n + self.system.d
        values, m, face = self._watched_values(), self.system.problem.inequalities, [*self.face]
        slopes = np.zeros((len(values), len(self.x)))
        slopes[:m, :p] = self.known.gradients[:m]
        slopes[face] = 0.0
        slopes[face, p + np.arange(len(face))] = 1.0
        slopes[m, -1] = 1.0
        slopes[m + 1 :, n:p] = np.vstack([np.eye(p - n), -np.eye(p - n)])
        return values, slopes
