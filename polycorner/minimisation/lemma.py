"""Residuals of the optimality conditions, and the hypotheses of the minimisation lemma."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycorner.minimisation.findings import Analysis
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.sparse_analysis import SparseAnalysis, SparseLocal
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked


@dataclass(frozen=True)
class Residuals(Checked):
    """Deviations from the first-order conditions at a point; all dimensionless.

    Attributes
    ----------
    infeasibility : float
        Scaled distance by which the polyhedron is missed.
    stationarity : float
        Largest component of ``dE - sum lam df`` in scaled coordinates, relative to the size of the
        energy there: its largest first or second derivative.
    complementarity : float
        Largest ``|lam_i f_i|``, relative to the same size.
    """

    infeasibility: float
    stationarity: float
    complementarity: float

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.infeasibility, self.stationarity, self.complementarity)


@dataclass(frozen=True)
class Condition(Checked):
    """One hypothesis of the minimisation lemma ([GMBN] app. C), checked.

    Attributes
    ----------
    statement : str
        What is required.
    holds : bool
        Whether it does.
    figure : float
        The number that decides it.
    """

    statement: str
    holds: bool
    figure: float


def residuals_at(problem: Problem, q: Array, multipliers: Mapping[str, float]) -> Residuals:
    """Return the residuals of the first-order conditions with given multipliers ``dE/df``."""
    if problem.is_sparse:
        return _sparse_residuals(problem, q, multipliers)
    d, m = problem.polyhedron, problem.inequalities
    values, gradients, hessians = problem.evaluate(q, 2)
    pull, product = gradients[-1].copy(), 0.0
    for row, name in enumerate((*d.names, *d.equation_names)):
        if name in multipliers:
            pull -= multipliers[name] * gradients[row]
            product = max(product, abs(multipliers[name] * float(values[row])))
    away = distances(values[:-1], gradients[:-1])
    short = -d.implicit_of(away[:m]) if m else 0.0
    reference = max(abs(gradients[-1]).max(), abs(hessians[-1]).max()) or 1.0
    pull, reference = (np.full(1, np.nan), 1.0) if not np.isfinite(reference) else (pull, reference)
    return Residuals(
        infeasibility=float(max(0.0, short, abs(away[m:]).max(initial=0.0))),
        stationarity=float(abs(pull).max() / reference),
        complementarity=float(product / reference),
    )


def _sparse_residuals(problem: Problem, q: Array, multipliers: Mapping[str, float]) -> Residuals:
    d, m = problem.polyhedron, problem.inequalities
    local = SparseLocal.at(problem, q, DEFAULT)
    weights = np.array([multipliers.get(name, 0.0) for name in (*d.names, *d.equation_names)])
    pull = local.gradient - local.rows.T @ weights
    return Residuals(
        infeasibility=float(
            max(0.0, -local.away[:m].min(initial=0.0), abs(local.away[m:]).max(initial=0.0))
        ),
        stationarity=float(abs(pull).max() / local.reference),
        complementarity=float(abs(weights * local.values[:-1]).max() / local.reference),
    )


def hypotheses(a: Analysis | SparseAnalysis) -> tuple[Condition, ...]:
    """Return the four hypotheses of the minimisation lemma, each with its deciding number."""
    held = a.multipliers.values[[*a.strong_positions]]
    curved = a.curvature.values[abs(a.curvature.values) > a.small_curvature]
    least = float(curved.min()) if len(curved) else float("inf")
    return (
        Condition(
            "(1) the energy grows to first order as each of the p contacts opens",
            bool((held > 0).all()) and a.multipliers.exist,
            float(held.min(initial=np.inf)),
        ),
        Condition(
            "(2) its other first derivatives vanish (relative size)",
            a.multipliers.exist,
            a.multipliers.residual / a.reference,
        ),
        Condition(
            "(3) its second derivatives in the q directions are positive definite",
            least > 0,
            least,
        ),
        Condition(
            "(4) it does not depend on the remaining r coordinates",
            a.flat_verified,
            a.flat_change,
        ),
    )
