"""What an analysis of the optimality conditions at a point has found."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NoReturn, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from polycorner.minimisation.conditions import Curvature, Multipliers, find_curvature
from polycorner.minimisation.constancy import Constancy
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.sparse.factorisation import lengths, unit
from polycorner.minimisation.sparse.optimality import multiplier_ranges
from polycorner.minimisation.verdicts import Entrapment, Verdict
from polycorner.polyhedra.cones import Rows, null_space, rank, unit_rows
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Value, cached_property

T = TypeVar("T")
Higher = Literal["series", "followed", "none"]  # how orders beyond the second are seen
OPEN = 10  # a product of multiplier and gap beyond so many tolerances is not rounding
PASSES = 60  # of Dinkelbach's method, which converges faster than linearly


@dataclass(frozen=True, eq=False)
class Local(Value):
    """Derivatives at a point, in scaled coordinates, and the tolerances in force there.

    Attributes
    ----------
    problem, point, tolerances
    values : (M,) array
        Of all inequalities, then of all equations, then of the energy.
    gradients : (M, n) array, or (M - 1, n) sparse array
        In the same order; as a sparse array without the energy's.
    slope : (n,) array
        The energy's.
    hessians : (M, n, n) array, or (n, n) sparse array
        Of all of them; as a sparse array, of the energy alone.
    higher : str
        How orders beyond the second are seen.
    """

    problem: Problem
    point: Array
    tolerances: Tolerances
    values: Array
    gradients: Any
    slope: Array
    hessians: Any
    higher: Higher = "series"

    @classmethod
    def at(
        cls, problem: Problem, q: Array, tolerances: Tolerances, higher: Higher = "series"
    ) -> "Local":
        """Evaluate the functions of a problem at a point, as full matrices."""
        values, gradients, hessians = problem.evaluate(q, 2)
        return cls(problem, q, tolerances, values, gradients, gradients[-1], hessians, higher)

    @classmethod
    def sparsely_at(cls, problem: Problem, q: Array, tolerances: Tolerances) -> "Local":
        """Evaluate the functions of a problem at a point, as sparse matrices."""
        scaling = diags_array(problem.scales)
        values, rows = problem.sparse_rows.evaluate(q)
        terms, slopes = problem.sparse_energy.evaluate(q)
        bent = problem.sparse_energy.curvature(q, np.ones(len(terms)))
        return cls(
            problem,
            q,
            tolerances,
            np.append(values, terms.sum()),
            csr_array(rows @ scaling),
            np.asarray(slopes.sum(axis=0) * problem.scales),
            csr_array(scaling @ bent @ scaling),
        )

    @cached_property
    def reference(self) -> float:
        """The size of the energy: its largest first or second derivative in scaled coordinates."""
        if isinstance(self.hessians, csr_array):
            bent = float(abs(self.hessians).max()) if self.hessians.nnz else 0.0
        else:
            bent = float(abs(self.hessians[-1]).max())
        return max(float(abs(self.slope).max()), bent) or 1.0

    @property
    def small(self) -> float:
        """The size up to which a first derivative counts as zero."""
        return self.tolerances.stationary * self.reference

    @property
    def sections(self) -> range:
        """Rows of the equations."""
        return range(self.problem.inequalities, len(self.values) - 1)

    @cached_property
    def away(self) -> Array:
        """Signed scaled distances ``f / |df|`` of inequalities and equations."""
        values = self.values[:-1]
        if not isinstance(self.gradients, csr_array):
            return distances(values, self.gradients[:-1])
        sizes = lengths(self.gradients)
        far = np.where(values == 0, 0.0, np.copysign(np.inf, values))
        return np.asarray(np.divide(values, sizes, out=far, where=sizes > 0))

    def without(self, weights: Array) -> Array:
        """Return the gradient of the energy without those of the constraints, weighted."""
        if isinstance(self.gradients, csr_array):
            return np.asarray(self.slope - self.gradients.T @ weights)
        left = self.slope.copy()
        for row in np.flatnonzero(weights):
            left -= weights[row] * self.gradients[row]
        return left


@dataclass(frozen=True, eq=False)
class Decision(Value):
    """What higher orders decide.

    Attributes
    ----------
    verdict : Verdict
        Minimum, minimum along a locus, saddle or undecided.
    degree : int
        Degree of the terms that decide, 0 where none does.
    order : int
        Degree to which the energy was expanded, 0 where it was not.
    direction : (n,) array
        Where they decide, tangent to the curve followed, in scaled coordinates.
    reason : str
        What stands in the way where nothing is decided; how constancy is known.
    followed : Constancy or None
        How far a locus was followed.
    """

    verdict: Verdict
    degree: int
    order: int
    direction: Array
    reason: str
    followed: Constancy | None = None


def undecided(n: int, reason: str, order: int = 0) -> Decision:
    """Return that nothing is decided in ``n`` dimensions, and why."""
    return Decision(Verdict.UNDECIDED, 0, order, np.zeros(n), reason)


@dataclass(frozen=True, eq=False)
class FaceSize(Value):
    """The dimension of a face whose curvature is known by inertia alone, and what nothing reads.

    Attributes
    ----------
    dimension : int
        Of the face of the strongly active functions, without ``unmoved`` coordinates, along which
        the energy is constant while weakly active functions allow them to move.
    unmoved : (r,) array of int
        Coordinates that neither the energy nor any strongly active function reads: rattlers.
    """

    dimension: int
    unmoved: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Analysis(Value):
    """First and second order at a point, in scaled coordinates.

    Attributes
    ----------
    verdict : Verdict
        What the conditions imply.
    active : tuple of int
        Rows of the active inequalities of the piece that decides.
    gradients : (k + e, n) array, full or sparse
        Gradients of the active inequalities, then of the equations.
    rank : int or None
        Of these, as unit rows; None where it cannot be decided.
    multipliers : Multipliers
        Of unit gradients.
    independent : bool
        Whether the gradients are linearly independent (LICQ).
    strong_positions : tuple of int
        Positions in ``active`` of an independent set of functions with positive multipliers.
    weak : tuple of int
        Rows with zero multipliers.
    second : Curvature or FaceSize
        The second-order condition; with sparse matrices, the dimension of the face.
    reference : float
        The size of the energy, as far as it is finite; see :attr:`Local.reference`.
    small_curvature : float
        Curvature that counts as zero.
    local : Local
        The derivatives all this was computed from.
    blind : tuple of int
        Positions of functions whose gradients vanish; the analysis is without them.
    decision : Decision or None
        What higher orders decide where the second order vanishes.
    obstacle : str
        Why the conditions do not apply at the point; empty if they do.
    """

    verdict: Verdict
    active: tuple[int, ...]
    gradients: Any
    rank: int | None
    multipliers: Multipliers
    independent: bool
    strong_positions: tuple[int, ...]
    weak: tuple[int, ...]
    second: Curvature | FaceSize
    reference: float
    small_curvature: float
    local: Local
    blind: tuple[int, ...] = ()
    decision: Decision | None = None
    obstacle: str = ""

    @cached_property
    def sizes(self) -> Array:
        """Lengths of the gradients, one where they vanish."""
        rows = self.gradients
        found = lengths(rows) if isinstance(rows, csr_array) else np.linalg.norm(rows, axis=1)
        return np.where(found > 0, found, 1.0)

    @property
    def curvature(self) -> Curvature:
        """The second-order condition; with sparse matrices, at a corner there is none."""
        if isinstance(self.second, Curvature):
            return self.second
        if self.second.dimension:
            self._refuse("eigenvalues of the curvature along a face")
        nothing = np.zeros((len(self.local.point), 0))
        return Curvature(np.empty(0), nothing, np.inf, nothing, decided=True)

    @property
    def signature(self) -> tuple[int, int, int]:
        """The lemma's ``(p, q, r)``."""
        if isinstance(self.second, FaceSize):
            if self.second.dimension and not self.verdict.is_minimum:
                self._refuse("numbers of curved and flat directions")
            return len(self.strong_positions), self.second.dimension, len(self.second.unmoved)
        values = self.second.values
        free = int((abs(values) <= self.small_curvature).sum())
        return len(self.strong_positions), len(values) - free, free

    @property
    def flat_verified(self) -> bool:
        """Whether the energy is constant wherever the second order vanishes."""
        if isinstance(self.second, FaceSize) or not self.second.flat.shape[1]:
            return True
        followed = self.decision.followed if self.decision is not None else None
        return followed is not None and followed.holds

    @property
    def flat_change(self) -> float:
        """Its largest relative change there; infinite where directions were not followed."""
        if isinstance(self.second, FaceSize) or not self.second.flat.shape[1]:
            return 0.0
        followed = self.decision.followed if self.decision is not None else None
        return followed.change if followed is not None and followed.followed else np.inf

    @cached_property
    def entrapment(self) -> dict[str, Entrapment]:
        """The kind of entrapment in every direction."""
        if isinstance(self.second, FaceSize) and self.second.dimension:
            self._refuse("principal directions along a face")
        return dict(_entrapment(self))

    def _refuse(self, what: str) -> NoReturn:
        msg = (
            f"{what} are not computed for a polyhedron of {len(self.local.point)} "
            "coordinates, where every matrix is sparse"
        )
        raise ValueError(msg)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the active inequalities."""
        names = self.local.problem.polyhedron.names
        return tuple([names[i] for i in self.active])

    @property
    def held_names(self) -> tuple[str, ...]:
        """Names of the active inequalities, then of the equations."""
        return self.names + self.local.problem.polyhedron.equation_names

    def by_name(self, values: Array) -> dict[str, float]:
        """Return multipliers of unit gradients as multipliers ``dE/df`` of the functions."""
        return dict(zip(self.held_names, (values / self.sizes).tolist(), strict=True))

    def stated(self, by_name: Mapping[str, T]) -> dict[str, T]:
        """Return the entries but those of the equations that normalise vectors."""
        return self.local.problem.stated(by_name)

    @property
    def named_multipliers(self) -> dict[str, float]:
        """``dE/df`` for each active function and equation."""
        return self.by_name(self.multipliers.values)

    @property
    def named_ranges(self) -> dict[str, tuple[float, float]]:
        """The least and the largest value of each multiplier; from linear programmes if sparse."""
        found, k = self.multipliers, len(self.active)
        ends = np.array([found.lower, found.upper])
        if isinstance(self.gradients, csr_array) and not self.independent:
            dependent = self.local.tolerances.dependent
            rows = unit(self.gradients)
            ends = multiplier_ranges(rows, k, self.local.slope, found.values, dependent)
        return dict(zip(self.held_names, map(tuple, (ends / self.sizes).T.tolist()), strict=True))

    @property
    def open_positions(self) -> list[int]:
        """Positions of active functions whose gap is too large for their multiplier."""
        if not self.multipliers.exist:
            return []
        k = len(self.active)
        product = abs(self.multipliers.values[:k] * self.local.away[list(self.active)])
        return np.flatnonzero(product > OPEN * self.local.small).tolist()

    @property
    def stationary(self) -> bool:
        """Whether the first-order conditions hold, complementarity included."""
        return self.multipliers.exist and not self.open_positions


def _entrapment(a: Analysis) -> Iterator[tuple[str, Entrapment]]:
    local, multipliers, small = a.local, a.multipliers, a.small_curvature
    names = local.problem.polyhedron.names
    for position in a.strong_positions:
        yield names[a.active[position]], Entrapment.HALF_V
    for position, row in enumerate(a.active):
        if multipliers.values[position] < -local.small:
            yield names[row], Entrapment.NONE
    coordinates = local.problem.polyhedron.manifold.names
    if isinstance(a.second, FaceSize):
        yield from ((coordinates[i], Entrapment.FREE) for i in a.second.unmoved.tolist())
        return
    if multipliers.residual > local.small:
        return  # not stationary on the face: its curvature there is no entrapment
    curvature = a.second
    curved = curvature.vectors[:, curvature.values > small]
    held: list[int] = []
    for row in a.weak:
        slopes = local.gradients[[*held, row]] @ curved
        if rank(slopes, local.tolerances.rank) > len(held):
            held.append(row)
            yield names[row], Entrapment.HALF_U
    inner = curved
    if held:
        inner = curved @ null_space(local.gradients[held] @ curved, local.tolerances.rank)
    others = (
        (inner, Entrapment.U),
        (curvature.vectors[:, abs(curvature.values) <= small], Entrapment.FREE),
        (curvature.vectors[:, curvature.values < -small], Entrapment.NONE),
    )
    taken = dict.fromkeys((names[row] for row in a.active), 1)
    for vectors, kind in others:
        for vector in vectors.T:
            label = _direction_name(vector, coordinates)
            taken[label] = taken.get(label, 0) + 1
            yield label if taken[label] == 1 else f"{label} ({taken[label]})", kind


def _direction_name(vector: Array, names: tuple[str, ...]) -> str:
    """Name a direction after the coordinates that change by at least half the largest change."""
    top = abs(vector).max()
    large = [i for i in range(len(vector)) if abs(vector[i]) >= 0.5 * top]
    sign = np.sign(vector[large[0]])
    words = [("+" if vector[i] * sign > 0 else "-") + names[i] for i in large]
    return "".join(words).removeprefix("+")


def steepest_descent(a: Analysis) -> tuple[float, Array]:
    """Return the fastest rate of descent of the energy on the linearised cone, and its direction.

    By Moreau's decomposition, the part of ``dE`` that no admissible combination of active
    gradients balances is minus the direction times the rate.
    """
    from scipy.optimize import nnls

    slope, whole = a.local.slope, Rows(a.gradients, a.local.tolerances.rank)
    dependent = len(whole.units) > 0 and not whole.independent
    units = (
        whole.truncated(a.local.tolerances.rank * whole.singular[0]) if dependent else whole.units
    )
    units[list(a.blind)] = 0.0
    rows = np.vstack([units, -units[len(a.active) :]])
    rest = slope - (nnls(rows.T, slope)[0] @ rows if len(rows) else 0.0)
    rate = float(np.linalg.norm(rest))
    return rate, -rest / (rate or 1.0)


def implied_functions(a: Analysis) -> list[int]:
    """Return positions of active functions whose gradients lie in the cone of the others."""
    from scipy.optimize import nnls

    units, k = unit_rows(a.gradients), len(a.active)
    implied = 1e-3 * a.local.tolerances.rank
    found = []
    for i in (i for i in range(k) if i not in a.blind):
        rows = np.vstack([np.delete(units, i, axis=0), -units[k:]])
        if len(rows) and nnls(rows.T, units[i])[1] <= implied:
            found.append(i)
    return found


def least_curvature(a: Analysis) -> tuple[float, Array] | None:
    """Return the least value of the Lagrangian's Hessian on the critical cone and its direction.

    None if the cone is the origin.  Shifted by the value found last, the form has a least value of
    the sign of what is missing (Dinkelbach's method): zero exactly where that is the least.
    """
    values, vectors = a.curvature.values, a.curvature.vectors
    if not len(values):
        return None
    if not a.weak:
        return float(values[0]), oriented(vectors[:, 0])
    rows = a.local.gradients[list(a.weak)]
    least = float(values[0])
    for _ in range(PASSES):
        form = (vectors * (values - least)) @ vectors.T
        found = find_curvature(form, vectors, rows, a.small_curvature)
        if not np.isfinite(found.least):
            return None
        least += found.least
        if abs(found.least) <= a.small_curvature:
            break
    rates = np.einsum("ik,ij,jk->k", found.flat, form, found.flat)
    return least, found.flat[:, int(rates.argmin())]


def oriented(direction: Array) -> Array:
    """Return the one of two opposite directions whose largest component is positive."""
    return np.asarray(direction * np.sign(direction[abs(direction).argmax()]))
