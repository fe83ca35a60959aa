"""Cones cut out by the gradients of active functions.

Rows are gradients in scaled coordinates; the linearised cone is ``{d : A d >= 0, E d = 0}``.
"""

import numpy as np

from polycorner.geometry.manifold import Array


def unit_rows(matrix: Array) -> Array:
    """Return the rows divided by their lengths; zero rows stay zero."""
    sizes = np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.divide(matrix, sizes, out=np.zeros_like(matrix), where=sizes > 0)


def rank(matrix: Array, tolerance: float) -> int:
    """Return the number of singular values of the unit rows above ``tolerance`` times the largest."""
    if not matrix.size:
        return 0
    singular = np.linalg.svd(unit_rows(matrix), compute_uv=False)
    return int((singular > tolerance * max(singular[0], 1e-300)).sum()) if singular[0] > 0 else 0


def null_space(matrix: Array, tolerance: float) -> Array:
    """Return an orthonormal basis, as columns ``(n, k)``, of what the rows annihilate."""
    n = matrix.shape[1]
    if not matrix.size:
        return np.eye(n)
    _, singular, rows = np.linalg.svd(unit_rows(matrix))
    kept = int((singular > tolerance * max(singular[0], 1e-300)).sum()) if singular[0] > 0 else 0
    return rows[kept:].T


def inward_direction(inequalities: Array, equations: Array) -> tuple[Array, float]:
    """Return the direction ``d``, ``|d_i| <= 1``, that enters the cone fastest, and its rate.

    The rate is ``max min_i a_i d`` over unit rows subject to ``E d = 0``: positive exactly where
    the constraint qualification of Mangasarian and Fromovitz holds for the inequalities
    ([NW] sec. 12.6).
    """
    from scipy.optimize import linprog

    a, e = unit_rows(inequalities), unit_rows(equations)
    n = a.shape[1]
    result = linprog(
        np.array([0.0] * n + [-1.0]),
        A_ub=np.hstack([-a, np.ones((len(a), 1))]),
        b_ub=np.zeros(len(a)),
        A_eq=np.hstack([e, np.zeros((len(e), 1))]) if len(e) else None,
        b_eq=np.zeros(len(e)) if len(e) else None,
        bounds=[(-1.0, 1.0)] * (n + 1),
        method="highs",
    )
    return result.x[:n], float(-result.fun)
