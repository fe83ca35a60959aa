"""Sparse nonlinear programmes: a sum of energies on a set of functions of few coordinates each."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array

from polycorner.formulas.rows import Indices, SparseRows
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.sparse.factorisation import lengths
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Value, cached_property


@dataclass(frozen=True, eq=False)
class Point(Value):
    """Values and first derivatives at a point of a programme, in scaled coordinates.

    Attributes
    ----------
    place : (n,) array
        The point.
    distances : (M,) array
        ``f_i / |df_i|``: signed distances to first order, of inequalities and then equations.
    rows : (M, n) sparse array
        Unit gradients.
    sizes : (M,) array
        Lengths of the gradients, one where they vanish.
    energy : float
    gradient : (n,) array
        Of the energy.
    """

    place: Array
    distances: Array
    rows: csr_array
    sizes: Array
    energy: float
    gradient: Array

    @property
    def is_finite(self) -> bool:
        """Whether everything at the point has a finite value."""
        parts = (self.distances, self.rows.data, self.gradient)
        return bool(np.isfinite(self.energy)) and all(np.isfinite(part).all() for part in parts)


@dataclass(frozen=True, eq=False)
class Nonlinear(Value):
    """A problem as the sparse programme ``min sum_t e_t(u)``, ``f_i(u) >= 0``, ``h_j(u) = 0``.

    ``u = q / scales``; the terms of the energy, and the constraints one after the other, are rows
    of few coordinates each.
    """

    problem: Problem
    tolerances: Tolerances

    @cached_property
    def terms(self) -> SparseRows:
        """The ``e_t``."""
        return self.problem.sparse_energy

    @cached_property
    def constraints(self) -> SparseRows:
        """The ``f_i``, then the ``h_j``."""
        return self.problem.sparse_rows

    @property
    def inequalities(self) -> int:
        """The number ``m`` of the ``f_i``."""
        return self.problem.inequalities

    @property
    def scales(self) -> Array:
        """The scales of the coordinates."""
        return self.problem.scales

    @property
    def equations(self) -> Indices:
        """Positions of the equations among the constraints."""
        return np.arange(self.inequalities, self.constraints.count)

    @cached_property
    def _scaling(self) -> csr_array:
        return csr_array(diags_array(self.scales))

    def energy(self, u: Array) -> float:
        """Return the energy."""
        return float(self.terms.values(u * self.scales).sum())

    def values(self, u: Array) -> Array:
        """Return the values ``(M,)`` of the constraints."""
        return self.constraints.values(u * self.scales)

    def at(self, u: Array) -> Point:
        """Return values and first derivatives."""
        values, jacobian = self.constraints.evaluate(u * self.scales)
        terms, slopes = self.terms.evaluate(u * self.scales)
        rows = csr_array(jacobian @ self._scaling)
        sizes = lengths(rows)
        sizes = np.where(sizes > 0, sizes, 1.0)
        units = csr_array(diags_array(1 / sizes) @ rows)
        slope = np.asarray(slopes.sum(axis=0)) * self.scales
        return Point(u, values / sizes, units, sizes, float(terms.sum()), slope)

    def hessian(self, at: Point, multipliers: Array, *, convex: bool = False) -> csr_array:
        """Return ``d^2 E - sum lam_i d^2 f_i`` for multipliers ``(M,)`` of unit gradients.

        ``convex`` leaves the negative eigenvalues of every summand out.
        """
        q, ones = at.place * self.scales, np.ones(self.terms.count)
        bent = self.terms.curvature(q, ones, convex=convex)
        weights = -multipliers / at.sizes
        bent = bent + self.constraints.curvature(q, weights, convex=convex)
        return csr_array(self._scaling @ bent @ self._scaling)
