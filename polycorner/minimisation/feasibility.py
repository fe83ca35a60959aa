"""Feasible points from starts outside, as least squares of the violation.

Where repeated linearisation (the compiled projection) finds no point of a piece
``{f_i >= 0, h_j = 0}``, the violation

    ``phi(q) = |v(q)|^2 / 2``,   ``v = (max(0, -f_i) / |df_i|, h_j / |dh_j|)``,

with the lengths of the gradients at the start, is minimised by a trust-region method of
Gauss-Newton type, which is globally convergent to stationary points of ``phi`` ([NW] thm. 10.3):
``phi`` is continuously differentiable, with ``d phi = v . dv``, although ``v`` is not.  Either
``phi`` tends to zero, or the limit is a stationary point with ``phi > 0``, from which no direction
lowers the violation to first order: this is the evidence that there is no feasible point nearby.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.polyhedron import Piece
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, Tolerances

EVALUATIONS = 400  # limit of each least-squares minimisation
REFINEMENTS = 30  # steps of Newton's method at the end
MOVES = (1e-2, 1.0, 10.0, 10.0, 100.0, 100.0)  # random steps off a stationary point, in scale units


@dataclass(frozen=True, eq=False)
class Approach:
    """The end of a search for a feasible point.

    Attributes
    ----------
    point : (n,) array
        A feasible point, or the point of least violation that was found.
    feasible : bool
        Whether the point is feasible.
    stationary : bool
        Whether the violation, if any, has a stationary point there.
    """

    point: Array
    feasible: bool
    stationary: bool


def approach(
    problem: Problem, piece: Piece, q: Array, tolerances: Tolerances = DEFAULT
) -> Approach:
    """Search a feasible point of a piece at which the energy is finite, from outside."""
    rows = [*sorted(piece), *range(problem.inequalities, problem.rows - 1)]
    violation = _Violation(problem, rows, q)
    u = start = q / problem.scales
    if not np.isfinite(violation.residuals(start)).all():
        return Approach(q, feasible=False, stationary=False)
    for u in violation.ends(start):
        reached, point = problem.restore(piece, u * problem.scales)
        if reached and np.isfinite(problem.energy.value(point)):
            return Approach(point, feasible=True, stationary=False)
    stationary = violation.is_stationary(u, 100 * tolerances.stationary)
    return Approach(u * problem.scales, feasible=False, stationary=stationary)


class _Violation:
    """The vector ``v`` of scaled violations and its Jacobian, in scaled coordinates."""

    def __init__(self, problem: Problem, rows: list[int], start: Array) -> None:
        self.problem, self.rows = problem, rows
        self.signed = np.array([i < problem.inequalities for i in rows])
        values, gradients = problem.evaluate(start, 1)
        sizes = np.linalg.norm(gradients[rows], axis=1)
        # Fixed at the start, so that the violation stays differentiable.
        self.weights = np.where(np.isfinite(sizes) & (sizes > 0), 1 / np.where(sizes, sizes, 1), 1)
        self.domain = bool(np.isfinite(values[-1]))  # the energy's, to be kept

    def residuals(self, u: Array) -> Array:
        (values,) = self.problem.evaluate(u * self.problem.scales, 0)
        v: Array = values[self.rows] * self.weights
        if self.domain and not np.isfinite(values[-1]):
            # The search turns back where the energy is not defined, if it was at the start.
            v = v + np.nan
        return np.where(self.signed, np.minimum(v, 0), v)

    def jacobian(self, u: Array) -> Array:
        values, gradients = self.problem.evaluate(u * self.problem.scales, 1)
        violated = ~self.signed | (values[self.rows] < 0)
        rows: Array = gradients[self.rows] * (self.weights * violated)[:, None]
        return rows

    def ends(self, u: Array) -> Iterator[Array]:
        """Yield ends of minimisations, ever lower.

        A stationary point of the violation may be a saddle of it, or lie beside a set that is not
        empty elsewhere; random steps of several lengths lead away.  In a long valley only Newton's
        method comes to the end.
        """
        rng = np.random.default_rng(0)
        u, size = self.least(u)
        yield u
        # From shorter to longer: a saddle is left by the first, another part of space needs the
        # last.
        for move in MOVES:
            other, less = self.least(u + move * rng.standard_normal(u.size))
            if less < size:
                u, size = other, less
                yield u
        yield self.refined(u)

    def least(self, u: Array) -> tuple[Array, float]:
        """Minimise the violation from ``u``; return the end and the size of the violation."""
        from scipy.optimize import least_squares

        if not np.isfinite(self.residuals(u)).all() or not np.isfinite(self.jacobian(u)).all():
            return u, np.inf
        least: Any = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}
        try:
            with np.errstate(all="ignore"):
                end = least_squares(
                    self.residuals, u, self.jacobian, x_scale="jac", max_nfev=EVALUATIONS, **least
                )
        except ValueError:  # on the way, derivatives were not finite or overflowed in products
            return u, np.inf
        return end.x, float(np.sqrt(2 * end.cost))

    def refined(self, u: Array) -> Array:
        """Return a nearby stationary point by Newton's method, or the last point that is better.

        The Hessian of ``|v|^2 / 2`` is ``dv^T dv + sum v_i d^2 v_i``.  Least squares without the
        second term converge slowly where the violation is large and curved.
        """
        slope = self.slope(u)
        for _ in range(REFINEMENTS):
            if not np.isfinite(slope).all() or not slope.any():
                break
            v, rows = self.residuals(u), self.jacobian(u)
            hessians = self.problem.evaluate(u * self.problem.scales, 2)[2][self.rows]
            curved = rows.T @ rows + np.tensordot(v * self.weights, hessians, axes=1)
            if not np.isfinite(curved).all():
                break
            after = u - np.linalg.lstsq(curved, slope, rcond=1e-12)[0]
            left = self.slope(after)
            # Newton's method seeks any stationary point, saddles included: it must not lead far
            # away.
            if not np.linalg.norm(left) < np.linalg.norm(slope):
                break
            u, slope = after, left
        return u

    def slope(self, u: Array) -> Array:
        """Return the gradient of ``|v|^2 / 2``."""
        return np.asarray(self.residuals(u) @ self.jacobian(u))

    def is_stationary(self, u: Array, small: float) -> bool:
        slope, size = abs(self.slope(u)).max(initial=0.0), np.linalg.norm(self.residuals(u))
        return bool(slope <= small * size)
