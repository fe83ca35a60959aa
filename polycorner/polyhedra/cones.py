"""Cones cut out by the gradients of active functions.

Rows are gradients in scaled coordinates; the linearised cone is ``{d : A d >= 0, E d = 0}``.
"""

import numpy as np

from polycorner.errors import SolverError
from polycorner.geometry.manifold import Array


def unit_rows(matrix: Array) -> Array:
    """Return the rows divided by their lengths; zero rows stay zero."""
    sizes = np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.asarray(np.divide(matrix, sizes, out=np.zeros_like(matrix), where=sizes > 0))


def rank(matrix: Array, tolerance: float) -> int:
    """Return how many singular values of the unit rows exceed ``tolerance`` times the largest."""
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
    a, e = unit_rows(inequalities), unit_rows(equations)
    n = a.shape[1]
    found = linear_programme(
        np.array([0.0] * n + [-1.0]),
        np.hstack([-a, np.ones((len(a), 1))]),
        np.zeros(len(a)),
        bound=1.0,
        equations=np.hstack([e, np.zeros((len(e), 1))]),
    )
    return found[:n], float(found[n])


def linear_programme(
    cost: Array, rows: Array, limits: Array, *, bound: float, equations: Array | None = None
) -> Array:
    """Minimise ``cost.x`` subject to ``rows x <= limits``, ``equations x = 0``, ``|x_i| <= bound``.

    The caller makes sure that the programme is feasible; it is bounded by construction.

    Raises
    ------
    SolverError
        If HiGHS stops without a solution.
    """
    from scipy.optimize import linprog

    some = equations is not None and len(equations) > 0
    result = linprog(
        cost,
        A_ub=rows,
        b_ub=limits,
        A_eq=equations if some else None,
        b_eq=np.zeros(len(equations)) if some and equations is not None else None,
        bounds=[(-bound, bound)] * len(cost),
    )
    if result.x is None:
        msg = f"HiGHS found no solution of a small linear programme: {result.message}"
        raise SolverError(msg)
    return np.asarray(result.x)
