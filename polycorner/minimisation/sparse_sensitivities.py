"""Derivatives of stationary points by parameters, with sparse matrices throughout.

The equations are those of :mod:`~polycorner.minimisation.parametric`; coordinates that nothing
reads are the free directions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array

from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import SparseRows
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.parametric import Rates, lifted_family, slots_of
from polycorner.minimisation.sparse.factorisation import Saddle, lengths
from polycorner.minimisation.sparse.optimality import nondegenerate
from polycorner.minimisation.sparse_analysis import SparseAnalysis
from polycorner.minimisation.verdicts import Verdict
from polycorner.spaces.manifold import Array


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of a point by ``p`` parameters.

    Attributes
    ----------
    names : tuple of str
        The active functions and the equations.
    point, multipliers : (n, p), (k, p) array
    energy, envelope : (p,) array
    free : (n, r) array
        The coordinates that nothing reads.
    """

    names: tuple[str, ...]
    point: Array
    multipliers: Array
    energy: Array
    envelope: Array
    free: Array


@dataclass(frozen=True)
class _Lifted:
    """A function whose parameters are variables, after the coordinates."""

    family: Family
    member_name: str
    reads: tuple[int, ...]
    parameters: tuple[float, ...] = ()


def lifted_rows(
    functions: Sequence[SmoothFunction], slots: dict[tuple[str, float], int], n: int
) -> SparseRows:
    """Return functions of ``n`` coordinates, and after them of the parameters in their slots."""
    lifted: list[SmoothFunction | _Lifted] = []
    for f in functions:
        if not f.family.parameters:
            lifted.append(f)
            continue
        own = [n + slots[slot] for slot in zip(f.family.parameters, f.parameters, strict=True)]
        family = lifted_family(f.family, frozenset({f.member_name}))
        lifted.append(_Lifted(family, f.member_name, (*f.reads, *own)))
    return SparseRows.of(lifted, n + len(slots))


def sparse_obstacle(analysis: SparseAnalysis) -> str:
    """Return why the implicit function theorem does not apply, or an empty string."""
    if analysis.verdict in {Verdict.OUTSIDE, Verdict.DOMAIN_EDGE}:
        return str(analysis.verdict.value)
    if not analysis.independent:
        return "the gradients of the active functions are dependent"
    if analysis.first.residual > analysis.local.small:
        return "the energy is not stationary on the face of its active functions"
    weak = np.setdiff1d(np.arange(len(analysis.active)), analysis.strong_positions)
    if len(weak):
        first = analysis.names[int(weak[0])]
        return f"the multiplier of {first} is zero, so that derivatives are one-sided"
    return ""


def sparse_derivatives(certificate: Certificate, rates: Rates) -> Derivatives | str:
    """Solve the linearised KKT equations; return a sentence instead where that is impossible."""
    problem, analysis = certificate.problem, certificate.found
    assert isinstance(analysis, SparseAnalysis)
    d, n, scales = problem.polyhedron, problem.dimension, problem.scales
    held = (*(d.functions[i] for i in analysis.active), *d.equations)
    slots = slots_of((*held, *problem.energy.terms))
    directions = csr_array(
        np.array(
            [[moved.get(name, 0.0) for moved in rates.values()] for name, _ in slots], dtype=float
        ).reshape(len(slots), len(rates))
    )
    at = np.concatenate([certificate.point, [value for _, value in slots]])
    faces, terms = lifted_rows(held, slots, n), lifted_rows(problem.energy.terms, slots, n)
    weights = np.array(list(analysis.named_multipliers.values()))
    jacobian, slopes = faces.evaluate(at)[1], terms.evaluate(at)[1]
    slope = np.asarray(slopes.sum(axis=0))
    bent = terms.curvature(at, np.ones(terms.count)) - faces.curvature(at, weights)
    scaling = diags_array(scales)
    rows = csr_array(jacobian[:, :n] @ scaling)
    sizes, reference = lengths(rows), analysis.reference
    units = csr_array(diags_array(1 / sizes) @ rows)
    hessian = csr_array(scaling @ bent[:n, :n] @ scaling / reference)
    drift = (jacobian[:, n:] @ directions).toarray()
    turning = (scaling @ (bent[:n, n:] @ directions)).toarray()
    moved = np.setdiff1d(np.arange(n), analysis.unmoved)
    small = analysis.small_curvature / reference
    if not nondegenerate(hessian[moved][:, moved], csr_array(units[:, moved]), small):
        return "the second order vanishes in a direction that is not free"
    right = np.vstack([-turning / reference, -drift / sizes[:, None]])
    system = Saddle(hessian, units)
    found = system.solve(right, np.zeros_like(right))
    left = abs(right - system.matrix @ found).max(axis=0, initial=0.0)
    size = np.maximum(abs(right).max(axis=0, initial=0.0), np.finfo(float).tiny)
    sloping = left > certificate.tolerances.stationary * size  # there is no solution
    if sloping.any():
        name = list(rates)[int(np.flatnonzero(sloping)[0])]
        return f"the energy does not stay constant along the free coordinates as {name} changes"
    still = slope[n:] @ directions
    point = found[:n] * scales[:, None]
    return Derivatives(
        names=(*analysis.names, *d.equation_names),
        point=point,
        multipliers=-reference * found[n:] / sizes[:, None],
        energy=still + slope[:n] @ point,
        envelope=still - weights @ drift,
        free=csr_array(eye_array(n))[:, analysis.unmoved].toarray(),
    )
