"""KKT equations of a face, with the parameters of the formulas as variables.

The equations

- ``dE - sum lam_i df_i = 0``,
- ``f_i = 0`` for the active functions and the equations of the set,

are linearised in the point, the multipliers and the parameters at once.  All derivatives are those
of compiled kernels whose variables are coordinates and parameters alike, so they are exact.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import SparseRows
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.findings import Analysis, FaceSize
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.sparse.factorisation import Saddle, lengths
from polycorner.minimisation.sparse.optimality import nondegenerate
from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import cached_property

# The derivatives of the formulas' parameters, by name, by each parameter.
Rates = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class Linear:
    """The KKT equations of a face to first order, in scaled coordinates.

    Attributes
    ----------
    values : (k,) array
        The active functions and equations.
    rows : (k, n) array, full or sparse
        Their gradients.
    slope : (n,) array
        The energy's.
    drift : (k + 1, p) array
        Derivatives by the parameters of the functions, and last of the energy.
    curvature : (n, n) array, full or sparse
        The Lagrangian's Hessian.
    turning : (n, p) array
        Derivatives of the Lagrangian's gradient by the parameters.
    """

    values: Array
    rows: Any
    slope: Array
    drift: Array
    curvature: Any
    turning: Array

    def free_directions(self, certificate: Certificate) -> Array:
        """Return the directions along the face in which the second order vanishes, ``(n, r)``.

        With sparse matrices, the coordinates that nothing reads.
        """
        second = certificate.found.second
        if isinstance(second, FaceSize):
            return csr_array(eye_array(len(self.slope)))[:, second.unmoved].toarray()
        flat = NEARLY_FLAT * certificate.analysis.small_curvature
        basis = null_space(self.rows, certificate.rank_tolerance)
        values, vectors = np.linalg.eigh(basis.T @ self.curvature @ basis)
        return np.asarray(basis @ vectors[:, abs(values) <= flat])

    def solve(self, a: Analysis, free: Array) -> tuple[Array, Array, NDArray[np.bool_]] | None:
        """Return derivatives of scaled coordinates and multipliers, and which are no solution.

        Those are of parameters along whose change the energy slopes along ``free``.  Gradients
        are scaled to unit length and energies by their size; None if the matrix is singular.
        """
        if isinstance(a.second, FaceSize):
            return self._solve_sparsely(a, a.second)
        (k, n), p, reference = self.rows.shape, self.turning.shape[1], a.reference
        sizes = np.linalg.norm(self.rows, axis=1)
        matrix = bordered(self.curvature / reference, np.vstack([unit_rows(self.rows), free.T]))
        if not np.linalg.cond(matrix) < 1 / a.local.tolerances.rounding:
            return None
        right = np.zeros((len(matrix), p))
        right[:n] = -self.turning / reference
        right[n : n + k] = -self.drift[:-1] / sizes[:, None]
        found = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
        # The slopes along free directions, relative to the summands they are differences of.
        summands = abs(matrix[:n]) @ abs(found) + abs(right[:n])
        slopes = abs(found[n + k :]) / np.maximum(summands.max(axis=0), np.finfo(float).tiny)
        sloping = (slopes > a.local.tolerances.stationary).any(axis=0)
        return found[:n], reference * found[n : n + k] / sizes[:, None], sloping

    def _solve_sparsely(
        self, a: Analysis, face: FaceSize
    ) -> tuple[Array, Array, NDArray[np.bool_]] | None:
        n, reference, sizes = len(self.slope), a.reference, lengths(self.rows)
        units = csr_array(diags_array(1 / sizes) @ self.rows)
        hessian = csr_array(self.curvature / reference)
        moved = np.setdiff1d(np.arange(n), face.unmoved)
        small = a.small_curvature / reference
        if not nondegenerate(hessian[moved][:, moved], csr_array(units[:, moved]), small):
            return None
        right = np.vstack([-self.turning / reference, -self.drift[:-1] / sizes[:, None]])
        system = Saddle(hessian, units)
        found = system.solve(right, np.zeros_like(right))
        left = abs(right - system.matrix @ found).max(axis=0, initial=0.0)
        size = np.maximum(abs(right).max(axis=0, initial=0.0), np.finfo(float).tiny)
        sloping = left > a.local.tolerances.stationary * size
        return found[:n], -reference * found[n:] / sizes[:, None], sloping


def bordered(hessian: Array, rows: Array) -> Array:
    """Return the matrix ``[[H, -A^T], [A, 0]]``."""
    corner = np.zeros((len(rows), len(rows)))
    return np.block([[hessian, -rows.T], [rows, corner]])


@dataclass(frozen=True)
class _Raised:
    """A function whose parameters are variables, after the coordinates."""

    family: Family
    member_name: str
    reads: tuple[int, ...]
    parameters: tuple[float, ...] = ()


class Lifted:
    """Active functions, equations and energy of a certificate, with parameters as variables.

    Attributes
    ----------
    names : tuple of str
        Names of the active functions, then of the equations.
    slots : dict from (str, float) to int
        Index among the additional variables, by a parameter's name and value.
    """

    def __init__(self, certificate: Certificate) -> None:
        problem = certificate.problem
        d, self._sparse = problem.polyhedron, problem.is_sparse
        held = (*(d.functions[i] for i in certificate.found.active), *d.equations)
        terms = problem.energy.terms if self._sparse else (problem.energy,)
        self.names = tuple(f.name for f in held)
        self.slots = slots_of((*held, *terms))
        self._scales = problem.scales
        self._values = np.array([value for _, value in self.slots])
        self._functions = raised((*held, *terms), self.slots, len(self._scales))

    @cached_property
    def _bundle(self) -> Bundle:
        variables = len(self._scales) + len(self.slots)
        return Bundle(Manifold(tuple(f"q{i}" for i in range(variables))), self._functions)

    def directions(self, rates: Rates) -> Array:
        """Return the derivatives of the slots by the parameters, ``(s, p)``."""
        rows = [[moved.get(name, 0.0) for moved in rates.values()] for name, _ in self.slots]
        return np.array(rows, dtype=np.float64).reshape(len(self.slots), len(rates))

    def linearise(self, q: Array, changes: Array, multipliers: Array, directions: Array) -> Linear:
        """Return the equations to first order.

        Parameters
        ----------
        q : (n,) array
            The point.
        changes : (s,) array
            Differences of the parameters from their values in the certificate.
        multipliers : (k,) array
            ``dE/df``.
        directions : (s, p) array
            Derivatives of the slots by the parameters.
        """
        at = np.concatenate([q, self._values + changes])
        if self._sparse:
            return self._linearise_sparsely(at, multipliers, directions)
        n, scales = len(self._scales), self._scales
        values, gradients, hessians = self._bundle.evaluate(at, 2)
        weights = np.append(-multipliers, 1.0)
        curved = np.einsum("i,ijk->jk", weights, hessians[:, :n, :n])
        mixed = (hessians[:, :n, n:] * scales[:, None]) @ directions
        scaled = gradients[:, :n] * scales
        return Linear(
            values=values[:-1],
            rows=scaled[:-1],
            slope=scaled[-1],
            drift=gradients[:, n:] @ directions,
            curvature=curved * np.outer(scales, scales),
            turning=np.einsum("i,ijp->jp", weights, mixed),
        )

    def _linearise_sparsely(self, at: Array, multipliers: Array, directions: Array) -> Linear:
        n, k, scaling = len(self._scales), len(self.names), diags_array(self._scales)
        faces, terms = (
            SparseRows.of(some, len(at)) for some in (self._functions[:k], self._functions[k:])
        )
        values, jacobian = faces.evaluate(at)
        slope = np.asarray(terms.evaluate(at)[1].sum(axis=0))
        bent = terms.curvature(at, np.ones(terms.count)) - faces.curvature(at, multipliers)
        return Linear(
            values=values,
            rows=csr_array(jacobian[:, :n] @ scaling),
            slope=slope[:n] * self._scales,
            drift=np.vstack([jacobian[:, n:] @ directions, slope[n:] @ directions]),
            curvature=csr_array(scaling @ bent[:n, :n] @ scaling),
            turning=scaling @ (bent[:n, n:] @ directions),
        )


def slots_of(functions: Iterable[SmoothFunction]) -> dict[tuple[str, float], int]:
    """Return a place for every parameter of functions, by its name and value."""
    slots: dict[tuple[str, float], int] = {}
    for f in functions:
        for slot in zip(f.family.parameters, f.parameters, strict=True):
            slots.setdefault(slot, len(slots))
    return slots


def raised(
    functions: Sequence[SmoothFunction], slots: Mapping[tuple[str, float], int], n: int
) -> list[_Raised]:
    """Return functions of ``n`` coordinates and of the slots after them."""
    used: dict[Family, set[str]] = {}
    for f in functions:
        used.setdefault(f.family, set()).add(f.member_name)
    families = {family: lifted_family(family, frozenset(used[family])) for family in used}
    found = []
    for f in functions:
        own = [n + slots[slot] for slot in zip(f.family.parameters, f.parameters, strict=True)]
        found.append(_Raised(families[f.family], f.member_name, (*f.reads, *own)))
    return found


@lru_cache(maxsize=256)
def lifted_family(
    family: Family, used: frozenset[str], chosen: frozenset[str] | None = None
) -> Family:
    """Return the used functions of a family as functions of its variables and parameters.

    With ``chosen``, only these parameters become variables.
    """
    lifted = tuple(p for p in family.parameters if chosen is None or p in chosen)
    if not lifted:
        return family
    names = tuple(name for name in family.names if name in used)
    key = repr(("parameters are variables", names, family.identity, lifted))
    rest = tuple(p for p in family.parameters if p not in lifted)
    symbols, held = family.variables + lifted, family.stationary
    return Family(names, symbols, rest, family.formulas, key, family.unit, stationary=held)


def lifted_problem(problem: Problem, names: Sequence[str]) -> Problem:
    """Return a problem with some parameters as additional coordinates.

    Raises
    ------
    ValueError
        If a parameter has the name of a coordinate.
    """
    d = problem.polyhedron
    taken = [name for name in names if name in d.manifold.names]
    if taken:
        checks.refuse("parameters", "names that no coordinate has", ", ".join(taken))
    extended = d.manifold * Manifold(tuple(names), (math.inf,) * len(names))
    functions = [_lifted(f, extended, frozenset(names)) for f in problem.functions]
    m = problem.inequalities
    stated = functions[m : m + len(d.stated)]  # those that normalise vectors come with the manifold
    return pose(Polyhedron(extended, _tree(d.tree, functions[:m]), stated), functions[-1])


def problem_with(problem: Problem, values: Mapping[str, float]) -> Problem:
    """Return a problem with other values of some parameters."""
    d, m = problem.polyhedron, problem.inequalities
    manifold = d.manifold
    functions = [
        SmoothFunction.member(
            f.family,
            f.member_name,
            manifold,
            parameters=[
                values.get(name, value)
                for name, value in zip(f.family.parameters, f.parameters, strict=True)
            ],
            reads=[manifold.names[i] for i in f.reads],
            label=f.name,
        )
        for f in problem.functions
    ]
    stated = functions[m : m + len(d.stated)]
    return pose(Polyhedron(manifold, _tree(d.tree, functions[:m]), stated), functions[-1])


def _lifted(f: SmoothFunction, manifold: Manifold, chosen: frozenset[str]) -> SmoothFunction:
    family = lifted_family(f.family, frozenset({f.member_name}), chosen)
    own = tuple(p for p in f.family.parameters if p in chosen)
    values = dict(zip(f.family.parameters, f.parameters, strict=True))
    return SmoothFunction.member(
        family,
        f.member_name,
        manifold,
        parameters=[values[p] for p in family.parameters],
        reads=[*(manifold.names[i] for i in f.reads), *own],
        label=f.name,
    )


def _tree(tree: Any, functions: list[SmoothFunction]) -> Any:
    if isinstance(tree, int):
        return functions[tree]
    kind = AnyOf if tree.union else AllOf
    return kind(*[_tree(child, functions) for child in tree.children])


def partial_derivatives(function: SmoothFunction, point: Array, rates: Rates) -> Array:
    """Return the partial derivatives ``(p,)`` of a function by parameters at a fixed point."""
    family = function.family
    if not family.parameters:
        return np.zeros(len(rates))
    everything = lifted_family(family, frozenset({function.member_name}))
    inputs = Manifold(tuple(f"u{i}" for i in range(len(everything.variables))))
    f = SmoothFunction.member(everything, function.member_name, inputs, reads=inputs.names)
    slopes = f.gradient([*point[list(function.reads)], *function.parameters])
    own = dict(zip(family.parameters, slopes[len(function.reads) :].tolist(), strict=True))
    return np.array(
        [sum(rate * own.get(name, 0.0) for name, rate in moved.items()) for moved in rates.values()]
    )


def check_rates(certificate: Certificate, parameters: Iterable[str] | Rates | None) -> Rates:
    """Return parameters with their rates, after checking every name.

    A name stands for itself; None stands for all parameters with one value in the whole problem.
    """
    problem = certificate.problem
    if parameters is None:
        known = problem.parameter_values.items()
        parameters = [name for name, values in known if len(values) == 1]
    texts = not isinstance(parameters, str) and all(isinstance(name, str) for name in parameters)
    if not texts:
        checks.refuse("parameters", "a list of names or a mapping", parameters, TypeError)
    if not isinstance(parameters, Mapping):
        parameters = {name: {name: 1.0} for name in parameters}
    for moved in parameters.values():
        if not isinstance(moved, Mapping):
            checks.refuse("parameters", "a mapping from names to rates", parameters, TypeError)
    used = list(dict.fromkeys(name for moved in parameters.values() for name in moved))
    if not used:
        known_names = ", ".join(problem.parameter_values) or "none"
        checks.refuse("parameters", f"names among {known_names}", parameters)
    problem.check_parameters(used)
    return {name: dict(moved) for name, moved in parameters.items()}
