"""Fritz John points of polyhedra with thousands of coordinates, by sparse matrices.

Steps and tangents are solutions of the bordered system, the index is an inertia
(:func:`~polycorner.minimisation.sparse.optimality.index_along`).  Where the index changes without
a fold, and where the energy's multiplier vanishes, the event is not decided.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse
from scipy.sparse import coo_array, csc_array, csr_array, diags_array

from polycorner.branches.system import Derivatives, Face, FritzJohn, FritzJohnSystem
from polycorner.formulas.rows import SparseRows
from polycorner.minimisation.parametric import raised, slots_of
from polycorner.minimisation.sparse.factorisation import factorised, lengths, solved, unit
from polycorner.minimisation.sparse.optimality import index_along
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

ITERATIONS = 4  # of inverse iteration
# Whose stubs know no blocks of several kinds.
stacked: Any = scipy.sparse.vstack
blocks: Any = scipy.sparse.block_array


@dataclass(frozen=True, eq=False)
class SparseSystem(FritzJohnSystem):
    """The equations for all faces, of a problem whose parameters are no coordinates.

    ``names`` are those of the formulas' parameters that change.
    """

    names: tuple[str, ...] = ()

    @property
    def is_sparse(self) -> bool:
        """Whether matrices are sparse."""
        return True

    @cached_property
    def _lifted(self) -> tuple[SparseRows, SparseRows, Array, Array]:
        """Constraints, terms of the energy, and values and rates of all parameters."""
        constraints, terms = self.problem.functions[:-1], self.problem.energy.terms
        slots = slots_of((*constraints, *terms))
        size = self.n + len(slots)
        rows, sums = (
            SparseRows.of(raised(some, slots, self.n), size) for some in (constraints, terms)
        )
        start, rates = (
            dict(zip(self.names, given.tolist(), strict=True))
            for given in (self.start, self.rates[:, 0])
        )
        values = np.array([start.get(name, value) for name, value in slots])
        return rows, sums, values, np.array([rates.get(name, 0.0) for name, _ in slots])

    def functions_at(self, u: Array, s: Array | float) -> tuple[Array, Any]:
        """Return values and gradients of all functions by ``(u, s)``, divided by the sizes."""
        rows, sums, start, rates = self._lifted
        q = np.concatenate([self.place(u), start + s * rates])
        values, slopes = rows.evaluate(q)
        terms, slope = sums.evaluate(q)
        whole = csr_array(stacked([slopes, csr_array(slope.sum(axis=0)[None])]) @ self._onto)
        return np.append(values, terms.sum()) / self.sizes, diags_array(1 / self.sizes) @ whole

    @cached_property
    def _onto(self) -> csr_array:
        """Derivatives of coordinates and parameters by ``(u, s)``."""
        rates = self._lifted[3]
        scales = diags_array(self.manifold.scale_array)
        return csr_array(blocks([[scales, None], [None, csr_array(rates[:, None])]]))

    def bent(self, u: Array, s: float, weights: Array) -> csr_array:
        """Return second derivatives by ``(u, s)`` of the sum of all functions, weighted."""
        rows, sums, start, rates = self._lifted
        q, w = np.concatenate([self.place(u), start + s * rates]), weights / self.sizes
        bent = rows.curvature(q, w[:-1]) + sums.curvature(q, np.full(sums.count, w[-1]))
        return csr_array(self._onto.T @ bent @ self._onto)

    def sized(self, u: Array, s: Array | float) -> Array:
        """Return the lengths of all gradients, one for those that vanish."""
        sizes = lengths(csr_array(self.functions_at(u, s)[1]))
        return np.where(np.isfinite(sizes) & (sizes > 0), sizes, 1.0)

    def point(self, face: Face, x: Array) -> "SparseFritzJohn":
        """Return the residual and the derivatives of the equations at a guess."""
        return SparseFritzJohn(self, face, x)


class SparseFritzJohn(FritzJohn):
    """The equations of a face at a guess, with sparse matrices."""

    system: SparseSystem
    jacobian: Any

    def __init__(self, system: SparseSystem, face: Face, x: Array) -> None:
        self.system, self.face, self.x = system, face, x
        n, rows = system.n, system.rows(face)
        self.u, self.s, self.both, own = x[:n], float(x[n]), x[n : n + 1], x[n + 1 :]
        self.mu = np.zeros(system.problem.rows)
        self.mu[rows] = own
        values, gradients = system.functions_at(self.u, self.s)
        self.known = Derivatives(values, gradients, np.zeros(0))
        sign = np.where(np.arange(len(rows)) < len(rows) - 1, -1.0, 1.0)
        weights = np.zeros(system.problem.rows)
        weights[rows] = sign * own
        bent = system.bent(self.u, self.s, weights)
        self.curvature = bent[:n, :n]
        held = csr_array(gradients[rows])
        slopes = diags_array(sign) @ held[:, :n]
        self.left = np.concatenate([own @ slopes, values[rows[:-1]], [(own @ own - 1) / 2]])
        self.held, self.orbit = held[:-1, :n], np.zeros((0, n))
        self.jacobian = csr_array(
            blocks([[bent[:n], slopes.T], [held[:-1], None], [None, csr_array(own[None])]])
        )
        finite = np.isfinite(self.jacobian.data).all() and np.isfinite(self.left).all()
        self.finite = bool(finite)

    def newton_step(self, row: Array, value: float) -> Array:
        """Return Newton's step for the equations and one more, with its derivatives and value."""
        return self._solve(row, -np.append(self.left, value))

    def _solve(self, row: Array, right: Array) -> Array:
        """Return the solution of the bordered system; NaN where it is singular."""
        more = row if isinstance(row, csr_array) else csr_array(row[None])
        found = solved(stacked([self.jacobian, more], format="csc"), right)
        return np.full(len(self.x), np.nan) if found is None else found

    def tangent(self, like: Array | None = None) -> Array:
        """Return the unit vector along the curve, on the side of ``like``."""
        row = self.system.towards(self.x) if like is None else like
        last = np.append(np.zeros(len(self.left)), 1.0)
        found = self._solve(row, last)
        return found / np.linalg.norm(found)

    @property
    def margin(self) -> float:
        """Not computed: the system bordered by two rows tells what is singular."""
        return 1.0

    def only_tangent(self) -> Array | None:
        """Return a unit vector along the curve, or None where several curves may cross."""
        # At folds the parameter stays, at events that persist the multipliers may.
        for row in (self.system.towards(self.x), np.ones(len(self.x))):
            last = np.append(np.zeros(len(self.left)), np.linalg.norm(row))
            found = self._solve(row, last)
            size = float(np.linalg.norm(found))
            if size < 1 / self.system.tolerances.near:
                return found / size
        return None

    @cached_property
    def index(self) -> int:
        """The number of negative curvatures along the face; -1 where it is not decided."""
        found = index_along(csr_array(self.curvature), unit(csr_array(self.held)))
        return -1 if found is None else found

    @cached_property
    def _least(self) -> Array:
        """The least singular value of the derivatives by all unknowns but the parameter, (1,).

        By inverse iteration; it vanishes where a curvature does.
        """
        n = self.system.n
        square = csc_array(self.jacobian[:, [*range(n), *range(n + 1, len(self.x))]])
        lu, x = factorised(square), np.ones(square.shape[0])
        if lu is None:
            return np.zeros(1)
        for _ in range(ITERATIONS):
            x = lu.solve(lu.solve(x / np.linalg.norm(x), trans="T"))
        return np.array([1 / math.sqrt(np.linalg.norm(x))])

    def curvatures(self, also: Face = ()) -> Array:
        """Return what vanishes where a curvature along the face does, ``(1,)``."""
        assert not also  # curves of events are those of small problems
        return self._least

    @property
    def definite(self) -> float:
        """How far the curvatures are from zero."""
        return float(self._least[0])

    def watched(self) -> tuple[Array, Any]:
        """Return what must not be negative along an arc, and its derivatives, sparse."""
        n, m = self.system.n, self.system.problem.inequalities
        face, width = np.array(self.face, dtype=int), len(self.x)
        gaps = coo_array(self.known.gradients[:m])
        kept = ~np.isin(gaps.coords[0], face)
        data: list[Any] = [gaps.data[kept], np.ones(len(face)), np.array([1.0, 1.0, -1.0])]
        rows: list[Any] = [gaps.coords[0][kept], face, np.array([m, m + 1, m + 2])]
        columns: list[Any] = [gaps.coords[1][kept], n + 1 + np.arange(len(face))]
        columns.append(np.array([width - 1, n, n]))
        entries: Any = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
        return self._watched_values(), csr_array(entries, shape=(m + 3, width))
