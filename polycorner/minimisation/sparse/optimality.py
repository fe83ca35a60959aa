"""Optimality conditions of first and second order with sparse matrices."""

from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import block_array, csr_array, eye_array, hstack

from polycorner.minimisation.conditions import Multipliers
from polycorner.minimisation.sparse.factorisation import (
    Saddle,
    least_squares,
    negative_eigenvalues,
    rank,
)
from polycorner.minimisation.sparse.programmes import Linearised, step
from polycorner.minimisation.verdicts import Verdict
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

PENALTY = 1e4  # of directions that leave the face, in units of the largest curvature


def first_order(
    rows: csr_array, inequalities: int, gradient: Array, small: float, tolerances: Tolerances
) -> tuple[Multipliers, int | None]:
    """Return the multipliers of unit gradients ``g = A^T lam``, and the rank of ``A``.

    Where they are not unique, those whose least is the largest, without their ranges.  The rank is
    None where it cannot be decided.
    """
    found = rank(rows, tolerances.rank)
    k = rows.shape[0]
    if found == k:
        lam = least_squares(rows, gradient) if k else np.empty(0)
    else:
        lam = _central(rows, inequalities, gradient)
    solved, lam = lam is not None, np.zeros(k) if lam is None else lam
    residual = float(abs(gradient - rows.T @ lam).max(initial=0.0)) if solved else np.inf
    least = float(lam[:inequalities].min(initial=0.0))
    negative = -tolerances.stationary * abs(lam).max(initial=0.0)
    exist, ends = residual <= small and least >= negative, lam if found == k else lam + np.nan
    return Multipliers(lam, ends, ends, exist, residual, unique=found == k), found


def _central(rows: csr_array, inequalities: int, gradient: Array) -> Array | None:
    """Return multipliers with ``lam_i >= t`` for the largest ``t``, by HiGHS."""
    k = rows.shape[0]
    scale = float(abs(gradient).max(initial=0.0)) or 1.0
    beside: Any = hstack  # whose stubs know no sparse and full blocks side by side
    most = beside([-eye_array(inequalities, k), np.ones((inequalities, 1))], format="csr")
    balance = beside([rows.T, csr_array((rows.shape[1], 1))], format="csr")
    cost = np.append(np.zeros(k), -1.0)
    solve: Any = linprog
    found = solve(
        cost,
        A_ub=most if inequalities else None,
        b_ub=np.zeros(inequalities) if inequalities else None,
        A_eq=balance,
        b_eq=gradient / scale,
        bounds=[*[(None, None)] * k, (None, 1.0)],
    )
    return found.x[:k] * scale if found.status == 0 else None


def basic_multipliers(rows: csr_array, inequalities: int, gradient: Array) -> Array | None:
    """Return multipliers ``lam_i >= 0`` of independent rows with the least ``sum |g - A^T lam|``.

    By HiGHS's interior-point method with crossover, which ends at a corner.
    """
    k, n = rows.shape
    scale = float(abs(gradient).max(initial=0.0)) or 1.0
    beside: Any = hstack
    balance = beside([rows.T, eye_array(n), -eye_array(n)], format="csr")
    cost = np.concatenate([np.zeros(k), np.ones(2 * n)])
    signs = [(0, None)] * inequalities + [(None, None)] * (k - inequalities) + [(0, None)] * (2 * n)
    solve: Any = linprog
    found = solve(cost, A_eq=balance, b_eq=gradient / scale, bounds=signs, method="highs-ipm")
    return found.x[:k] * scale if found.status == 0 else None


def multiplier_ranges(
    rows: csr_array, inequalities: int, gradient: Array, values: Array, dependent: float
) -> Array:
    """Return the least and the largest value ``(2, k)`` of each multiplier of unit gradients.

    A multiplier is determined if no state of self-stress, ``A^T z = 0``, contains it.  Random ones
    contain all that are in any, with entries beyond ``dependent``; for these HiGHS solves two
    linear programmes each.
    """
    ends = np.array([values, values])
    k, scale = len(values), float(abs(gradient).max(initial=0.0)) or 1.0
    stresses = Saddle(eye_array(k), csr_array(rows.T))
    probes = np.random.default_rng(0).standard_normal((k, 2))
    right = np.vstack([probes, np.zeros((rows.shape[1], 2))])
    stress = stresses.solve(right, np.zeros_like(right))[:k]
    signs = [(0, None)] * inequalities + [(None, None)] * (k - inequalities)
    solve: Any = linprog
    for i in np.flatnonzero(abs(stress).max(axis=1) > dependent):
        for row, sign in enumerate((1.0, -1.0)):
            cost = np.zeros(k)
            cost[i] = sign
            found = solve(cost, A_eq=rows.T, b_eq=gradient / scale, bounds=signs)
            ends[row, i] = found.x[i] * scale if found.status == 0 else -sign * np.inf
    return ends


def leads_down(rows: csr_array, inequalities: int, gradient: Array) -> bool:
    """Whether a direction leads into the polyhedron and lowers the energy to first order.

    Into it is where the functions grow by a thousandth per scale unit, at least.
    """
    empty = np.full(inequalities, -1e-3), rows[:inequalities]
    sections = np.zeros(rows.shape[0] - inequalities), rows[inequalities:]
    at = Linearised(*empty, *sections, gradient)
    found = step(at, np.ones(len(gradient)))
    return found is not None and float(gradient @ found.displacement) < 0


def second_order(hessian: Any, rows: csr_array, small: float) -> Verdict:
    """Return what the curvature of the Lagrangian on ``{A d = 0}`` implies, by Sylvester's law.

    For any ``delta > 0``, ``[[H - small, A^T], [A, -delta]]`` has as many negative eigenvalues as
    ``A`` has rows only if ``H - small + A^T A / delta`` is positive, and ``H`` then is on the face.
    ``[[H + small, A^T], [A, delta]]`` has more of them only if ``H + small - A^T A / delta`` is
    negative on a space of larger dimension, which the face meets.
    """
    k, delta = rows.shape[0], _corner(hessian)
    if _negative(hessian, rows, -small, -delta) == k:
        return Verdict.STRICT_MINIMUM
    lower = _negative(hessian, rows, small, delta)
    return Verdict.SADDLE if lower is not None and lower > k else Verdict.UNDECIDED


def nondegenerate(hessian: csr_array, rows: csr_array, small: float) -> bool:
    """Whether no curvature along ``{A d = 0}`` is between ``-small`` and ``small``.

    ``[[H - c, A^T], [A, -delta]]`` has the same number of negative eigenvalues for both.
    """
    delta = _corner(hessian)
    least = _negative(hessian, rows, small, -delta)
    return least is not None and least == _negative(hessian, rows, -small, -delta)


def index_along(hessian: csr_array, rows: csr_array) -> int | None:
    """Return the number of negative eigenvalues along ``{A d = 0}``, or None if undecided."""
    found = _negative(hessian, rows, 0.0, -_corner(hessian))
    return None if found is None else found - rows.shape[0]


def _corner(hessian: Any) -> float:
    return 1.0 / (PENALTY * (float(abs(hessian).max()) or 1.0))


def _negative(hessian: Any, rows: csr_array, level: float, corner: float) -> int | None:
    """Return the number of negative eigenvalues of ``[[H + level, A^T], [A, corner]]``."""
    n, k = hessian.shape[0], rows.shape[0]
    moved = hessian + level * eye_array(n)
    if not k:
        return negative_eigenvalues(moved)
    system = block_array([[moved, rows.T], [rows, corner * eye_array(k)]], format="csc")
    return negative_eigenvalues(system)
