"""Restoration of feasibility by repeated linearisation; segments that leave the set."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.minimisation.descent.evaluation import (
    FEASIBLE,
    equations_among,
    evaluate,
    normalised_rows,
    violation,
)
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import identity, largest, plus, solve_truncated
from polycorner.minimisation.descent.quadratic_programme import solve_quadratic


@compiled
def least_violation(A, b, equations):
    """Return a damped Gauss-Newton step for linearised rows without a common solution."""
    never_inline()
    n = A.shape[1]
    G, g = np.zeros((n, n)), np.zeros(n)
    for k in range(n):
        # Damped: rows that contradict each other may ask for steps without end.
        G[k, k] = 1e-3
    for i in range(A.shape[0]):
        if b[i] < 0.0 or i >= A.shape[0] - equations:
            for k in range(n):
                g[k] -= A[i, k] * b[i]
                for j in range(n):
                    G[k, j] += A[i, k] * A[i, j]
    return solve_truncated(G, g, 0.0)


@compiled
def project(problem, use, m, u, F, J, H, size, limit):
    """Project ``u`` onto the set by repeated linearisation, in place; return success."""
    never_inline()
    n = u.size
    eye, zero = identity(n), np.zeros(n)
    evaluate(problem, u, F, J, H, size, False)
    worst = violation(F, J, use, m)
    for _ in range(limit):
        if worst <= FEASIBLE:
            return True
        A, b, keep, _ = normalised_rows(F, J, use, m)
        count = equations_among(keep, m)
        feasible, d, _ = solve_quadratic(eye, zero, A, b, count)
        if not feasible:
            d = least_violation(A, b, count)
        reach = largest(d)
        if not reach > 0.0:
            return False
        # Linearisations hold over half a scale at most.
        factor = min(1.0, 0.5 / reach)
        improved = False
        for _ in range(12):
            trial = plus(u, factor, d)
            evaluate(problem, trial, F, J, H, size, False)
            after = violation(F, J, use, m)
            # Armijo's condition on the largest violation, which a full step would remove.
            if after < worst * (1.0 - 0.1 * factor) or after <= FEASIBLE:
                for k in range(n):
                    u[k] = trial[k]
                worst = after
                improved = True
                break
            factor *= 0.4
        if not improved:
            return False
    return worst <= FEASIBLE


@compiled
def crosses_wall(problem, use, m, u, d, F, J, H, size):
    """Whether the segment ``u`` to ``u + d`` leaves the set, sampled half a scale unit apart."""
    never_inline()
    samples = int(min(64.0, np.ceil(2.0 * largest(d))))
    for k in range(1, samples):
        evaluate(problem, plus(u, k / samples, d), F, J, H, size, False)
        if not violation(F, J, use, m) <= 0.5:
            return True
    return False
