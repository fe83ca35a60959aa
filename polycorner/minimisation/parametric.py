"""KKT equations of a face, with the parameters of the formulas as variables.

The equations

- ``dE - sum lam_i df_i = 0``,
- ``f_i = 0`` for the active functions and the equations of the set,

are linearised in the point, the multipliers and the parameters at once.  All derivatives are those
of compiled kernels whose variables are coordinates and parameters alike, so they are exact.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.spaces.manifold import Array, Manifold

# The derivatives of the formulas' parameters, by name, by each parameter.
Rates = Mapping[str, Mapping[str, float]]

SINGULAR = 1e-13  # reciprocal condition number of a matrix that counts as singular


@dataclass(frozen=True, eq=False)
class Linear:
    """The KKT equations to first order; rows are the active functions, and last the energy.

    Attributes
    ----------
    values : (k,) array
        The active functions and equations.
    gradients : (k + 1, n) array
        Derivatives by scaled coordinates.
    drift : (k + 1, p) array
        Derivatives by the parameters.
    curvature : (n, n) array
        The Lagrangian's Hessian.
    turning : (n, p) array
        Derivatives of the Lagrangian's gradient by the parameters.
    """

    values: Array
    gradients: Array
    drift: Array
    curvature: Array
    turning: Array

    def free_directions(self, certificate: Certificate) -> Array:
        """Return the directions along the face in which the second order vanishes, ``(n, r)``."""
        flat = NEARLY_FLAT * certificate.analysis.small_curvature
        basis = null_space(self.gradients[:-1], certificate.rank_tolerance)
        values, vectors = np.linalg.eigh(basis.T @ self.curvature @ basis)
        return np.asarray(basis @ vectors[:, abs(values) <= flat])

    def solve(self, free: Array, reference: float) -> tuple[Array, Array, Array] | None:
        """Return derivatives of scaled coordinates and multipliers, and slopes along ``free``.

        The slopes, ``(r, p)``, are relative to the summands they are differences of.  Gradients are
        scaled to unit length and energies by ``reference``, so that the condition number of the
        matrix is meaningful; None if it is singular.
        """
        rows, (n, p) = self.gradients[:-1], self.turning.shape
        sizes, k = np.linalg.norm(rows, axis=1), len(rows)
        matrix = bordered(self.curvature / reference, np.vstack([unit_rows(rows), free.T]))
        if not np.linalg.cond(matrix) < 1 / SINGULAR:
            return None
        right = np.zeros((len(matrix), p))
        right[:n] = -self.turning / reference
        right[n : n + k] = -self.drift[:-1] / sizes[:, None]
        found = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
        summands = abs(matrix[:n]) @ abs(found) + abs(right[:n])
        slopes = abs(found[n + k :]) / np.maximum(summands.max(axis=0), np.finfo(float).tiny)
        return found[:n], reference * found[n : n + k] / sizes[:, None], slopes


def bordered(hessian: Array, rows: Array) -> Array:
    """Return the matrix ``[[H, -A^T], [A, 0]]``."""
    corner = np.zeros((len(rows), len(rows)))
    return np.block([[hessian, -rows.T], [rows, corner]])


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
        d = problem.polyhedron
        held = (*(d.functions[i] for i in certificate.analysis.active), *d.equations)
        self.names = tuple(f.name for f in held)
        self.slots = slots_of((*held, problem.energy))
        self._scales = problem.scales
        self._values = np.array([value for _, value in self.slots])
        self._bundle = self._bind((*held, problem.energy))

    def _bind(self, functions: Sequence[SmoothFunction]) -> Bundle:
        places = tuple(f"q{i}" for i in range(len(self._scales)))
        manifold = Manifold((*places, *(f"p{j}" for j in range(len(self.slots)))))
        used: dict[Family, set[str]] = {}
        for f in functions:
            used.setdefault(f.family, set()).add(f.member_name)
        lifted = []
        for f in functions:
            family = lifted_family(f.family, frozenset(used[f.family]))
            own = [self.slots[s] for s in zip(f.family.parameters, f.parameters, strict=True)]
            reads = [*(places[i] for i in f.reads), *(f"p{j}" for j in own)]
            lifted.append(SmoothFunction.member(family, f.member_name, manifold, reads=reads))
        return Bundle(manifold, lifted)

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
        n, scales = len(self._scales), self._scales
        at = np.concatenate([q, self._values + changes])
        values, gradients, hessians = self._bundle.evaluate(at, 2)
        weights = np.append(-multipliers, 1.0)
        curved = np.einsum("i,ijk->jk", weights, hessians[:, :n, :n])
        mixed = (hessians[:, :n, n:] * scales[:, None]) @ directions
        return Linear(
            values=values[:-1],
            gradients=gradients[:, :n] * scales,
            drift=gradients[:, n:] @ directions,
            curvature=curved * np.outer(scales, scales),
            turning=np.einsum("i,ijp->jp", weights, mixed),
        )


def slots_of(functions: Iterable[SmoothFunction]) -> dict[tuple[str, float], int]:
    """Return a place for every parameter of functions, by its name and value."""
    slots: dict[tuple[str, float], int] = {}
    for f in functions:
        for slot in zip(f.family.parameters, f.parameters, strict=True):
            slots.setdefault(slot, len(slots))
    return slots


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
