"""Analysis of the optimality conditions at a point of a large sparse polyhedron."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from polycorner.minimisation.conditions import Curvature, Multipliers
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.sparse.factorisation import lengths, rank, unit
from polycorner.minimisation.sparse.optimality import (
    FirstOrder,
    first_order,
    leads_down,
    multiplier_ranges,
    second_order,
)
from polycorner.minimisation.verdicts import Entrapment, Verdict
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Value, cached_property


@dataclass(frozen=True, eq=False)
class SparseLocal(Value):
    """Values and first derivatives at a point, in scaled coordinates; the energy's apart.

    Attributes
    ----------
    values : (M,) array
        Of all inequalities, then of all equations, then of the energy.
    rows : (M - 1, n) sparse array
    gradient : (n,) array
    hessian : (n, n) sparse array
        Of the energy.
    """

    problem: Problem
    point: Array
    values: Array
    rows: csr_array
    gradient: Array
    hessian: csr_array
    tolerances: Tolerances

    @classmethod
    def at(cls, problem: Problem, q: Array, tolerances: Tolerances) -> "SparseLocal":
        """Evaluate the functions of a problem at a point."""
        scaling = diags_array(problem.scales)
        values, rows = problem.sparse_rows.evaluate(q)
        terms, slopes = problem.sparse_energy.evaluate(q)
        bent = problem.sparse_energy.curvature(q, np.ones(len(terms)))
        return cls(
            problem,
            q,
            np.append(values, terms.sum()),
            csr_array(rows @ scaling),
            np.asarray(slopes.sum(axis=0) * problem.scales),
            csr_array(scaling @ bent @ scaling),
            tolerances,
        )

    @cached_property
    def reference(self) -> float:
        """The size of the energy: its largest first or second derivative in scaled coordinates."""
        bent = float(abs(self.hessian).max()) if self.hessian.nnz else 0.0
        return max(float(abs(self.gradient).max()), bent) or 1.0

    @property
    def small(self) -> float:
        """The size up to which a first derivative counts as zero."""
        return self.tolerances.stationary * self.reference

    @cached_property
    def away(self) -> Array:
        """Signed scaled distances ``f / |df|`` of inequalities and equations."""
        sizes = lengths(self.rows)
        values = self.values[:-1]
        far = np.where(values == 0, 0.0, np.copysign(np.inf, values))
        return np.asarray(np.divide(values, sizes, out=far, where=sizes > 0))


@dataclass(frozen=True, eq=False)
class SparseAnalysis(Value):
    """First and second order at a point of a sparse problem; :class:`Analysis` in the large.

    Attributes
    ----------
    verdict : Verdict
        What the conditions imply.
    active : tuple of int
        Rows of the active inequalities.
    first : FirstOrder
        Multipliers of unit gradients, and the rank.
    strong_positions : tuple of int
        Positions in ``active`` of positive multipliers.
    face_dimension : int
        Of the face of the strongly active functions, without ``unmoved`` coordinates, along which
        the energy is constant while weakly active functions allow them to move.
    unmoved : (r,) array of int
        Coordinates that neither the energy nor any strongly active function reads: rattlers.
    sizes : (k,) array
        Lengths of the gradients that were scaled to one.
    local : SparseLocal
        The derivatives all this was computed from.
    """

    verdict: Verdict
    active: tuple[int, ...]
    first: FirstOrder
    strong_positions: tuple[int, ...]
    face_dimension: int
    unmoved: NDArray[np.int64]
    sizes: Array
    local: SparseLocal
    obstacle: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the active inequalities."""
        names = self.local.problem.polyhedron.names
        return tuple([names[i] for i in self.active])

    @property
    def independent(self) -> bool:
        """Whether the gradients are linearly independent (LICQ)."""
        return self.first.independent

    @property
    def reference(self) -> float:
        """The size of the energy."""
        return self.local.reference

    @property
    def small_curvature(self) -> float:
        """Curvature that counts as zero."""
        return NEARLY_FLAT * self.local.small

    @property
    def multipliers(self) -> Multipliers:
        """Multipliers of unit gradients; ranges only where they are unique."""
        values, found = self.first.values, self.first
        unknown = np.full((2, len(values)), np.nan)
        lower, upper = (values, values) if found.independent else unknown
        unique = found.independent
        return Multipliers(values, lower, upper, found.exist, found.residual, unique)

    @property
    def named_multipliers(self) -> dict[str, float]:
        """``dE/df`` for each active function and equation."""
        held = (*self.names, *self.local.problem.polyhedron.equation_names)
        return dict(zip(held, (self.first.values / self.sizes).tolist(), strict=True))

    @property
    def named_ranges(self) -> dict[str, tuple[float, float]]:
        """The range of each multiplier; where it is not unique, from two linear programmes."""
        if self.independent:
            return {name: (value, value) for name, value in self.named_multipliers.items()}
        held = (*self.names, *self.local.problem.polyhedron.equation_names)
        local, k = self.local, len(self.active)
        dependent = local.tolerances.dependent
        numbers = [*self.active, *range(local.problem.inequalities, len(local.away))]
        rows = unit(csr_array(local.rows[numbers]))
        ends = multiplier_ranges(rows, k, local.gradient, self.first.values, dependent) / self.sizes
        return dict(zip(held, map(tuple, ends.T.tolist()), strict=True))

    @property
    def curvature(self) -> Curvature:
        """The second-order condition; at a corner there is none."""
        if self.face_dimension:
            self._refuse("eigenvalues of the curvature along a face")
        n = self.local.problem.dimension
        nothing = np.zeros((n, 0))
        return Curvature(np.empty(0), nothing, np.inf, nothing, decided=True)

    @property
    def signature(self) -> tuple[int, int, int]:
        """The lemma's ``(p, q, r)``; the ``r`` coordinates are those that nothing reads."""
        strict = {Verdict.STRICT_MINIMUM, Verdict.MINIMUM_ALONG_LOCUS, Verdict.WEAK_MINIMUM}
        if self.face_dimension and self.verdict not in strict:
            self._refuse("numbers of curved and flat directions")
        return len(self.strong_positions), self.face_dimension, len(self.unmoved)

    @property
    def entrapment(self) -> dict[str, Entrapment]:
        """The kind of entrapment in every direction."""
        if self.face_dimension:
            self._refuse("principal directions along a face")
        coordinates = self.local.problem.polyhedron.manifold.names
        names = self.names
        held = {names[i]: Entrapment.HALF_V for i in self.strong_positions}
        return held | {coordinates[i]: Entrapment.FREE for i in self.unmoved.tolist()}

    @property
    def flat_verified(self) -> bool:
        """Whether the energy is constant along coordinates that nothing reads."""
        return True

    @property
    def flat_change(self) -> float:
        """Its change there."""
        return 0.0

    def _refuse(self, what: str) -> None:
        msg = (
            f"{what} are not computed for a polyhedron of {self.local.problem.dimension} "
            "coordinates, where every matrix is sparse"
        )
        raise ValueError(msg)


def analyse_sparse(problem: Problem, q: Array, tolerances: Tolerances) -> SparseAnalysis:
    """Analyse a point of a polyhedron without unions, with sparse matrices throughout."""
    local = SparseLocal.at(problem, q, tolerances)
    m, zero = problem.inequalities, tolerances.zero
    active = np.flatnonzero(local.away[:m] <= zero)
    held = np.concatenate([active, np.arange(m, len(local.away))])
    matrix = csr_array(local.rows[held])
    outside = bool((local.away[:m] < -zero).any() or (abs(local.away[m:]) > zero).any())
    sizes = lengths(matrix)
    sizes = np.where(sizes > 0, sizes, 1.0)
    unit_rows = unit(matrix)
    small, k = local.small, len(active)
    first = first_order(unit_rows, k, local.gradient, small, tolerances)
    least = tolerances.stationary * abs(first.values).max(initial=0.0)
    strong = np.flatnonzero(first.values[:k] > least)
    carrying = unit_rows[np.concatenate([strong, np.arange(k, len(held))])]
    moved = _moved(local, carrying)
    carrying = csr_array(carrying[:, moved])
    whole = first.rank is not None and len(strong) == k
    own = first.rank if whole else rank(carrying, tolerances.rank)
    weights = np.zeros(len(local.away))
    weights[held] = first.values / sizes
    face = _Face(moved, carrying, weights, None if own is None else len(moved) - own)
    if outside:
        verdict, reason = Verdict.OUTSIDE, ""
    else:
        verdict, reason = _verdict(local, first, unit_rows, face, weak=len(strong) < k)
    kept = tuple(active.tolist()), first, tuple(strong.tolist())
    unmoved = np.setdiff1d(np.arange(problem.dimension), moved)
    dimension = len(moved) if face.dimension is None else face.dimension
    return SparseAnalysis(verdict, *kept, dimension, unmoved, sizes, local, reason)


@dataclass(frozen=True)
class _Face:
    """The face of strongly active functions in the coordinates that they and the energy read."""

    moved: NDArray[np.int64]
    rows: csr_array
    weights: Array
    dimension: int | None


def _moved(local: SparseLocal, carrying: csr_array) -> NDArray[np.int64]:
    """Return the coordinates that the energy or a strongly active function reads."""
    mask = local.problem.sparse_energy.used
    mask[carrying.indices] = True
    return np.flatnonzero(mask)


def _verdict(
    local: SparseLocal, first: FirstOrder, rows: csr_array, face: _Face, *, weak: bool
) -> tuple[Verdict, str]:
    """Return the verdict at a point of the polyhedron, and what could not be decided."""
    problem = local.problem
    inequalities = rows.shape[0] - len(problem.polyhedron.equations)
    if not first.exist:
        down = first.independent or leads_down(rows, inequalities, local.gradient)
        return (Verdict.NOT_STATIONARY if down else Verdict.NO_MULTIPLIER), ""
    if face.dimension is None:
        return Verdict.UNDECIDED, "the rank of the active gradients is not decided"
    found = Verdict.STRICT_MINIMUM
    if face.dimension:
        scaling = diags_array(problem.scales)
        bent = scaling @ problem.sparse_rows.curvature(local.point, face.weights) @ scaling
        hessian = csr_array(local.hessian - bent)[face.moved][:, face.moved]
        found = second_order(hessian, face.rows, NEARLY_FLAT * local.small)
    if found is not Verdict.STRICT_MINIMUM:
        return (Verdict.UNDECIDED if weak else found), ""
    if len(face.moved) < problem.dimension:
        return Verdict.MINIMUM_ALONG_LOCUS, ""
    return (Verdict.WEAK_MINIMUM if weak else found), ""
