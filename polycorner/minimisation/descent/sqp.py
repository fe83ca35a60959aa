"""Descent by sequential quadratic programming with feasible iterates ([NW] ch. 18)."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.minimisation.descent.evaluation import (
    FEASIBLE,
    HUGE,
    all_finite,
    equations_among,
    evaluate,
    lagrangian_hessian,
    normalised_rows,
)
from polycorner.minimisation.descent.feasibility import crosses_wall, project
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import cholesky, largest, largest_entry, plus
from polycorner.minimisation.descent.quadratic_programme import solve_quadratic
from polycorner.minimisation.descent.stationarity import (
    FLAT,
    MINIMUM,
    REJECTED,
    SADDLE,
    classify,
    leave_flat,
    leave_saddle,
    leave_tangency,
)
from polycorner.minimisation.descent.statuses import (
    CONVERGED,
    INFEASIBLE,
    LEVEL,
    STALLED,
    UNBOUNDED,
    UNEVEN,
)

CURVELESS = 1e-14  # diagonal entry, relative to the largest, below which a coordinate is flat
SPREAD = 1e3  # ratio of scales beyond which they are uneven
FIRST_CAP = 0.5  # longest first step, in scale units
PATIENCE = 20  # steps after which convexification may use the active inequalities, too
FAR = 1e8  # distance from the start, in scale units, beyond which a descent is unbounded


@compiled
def convexified(B, g, A, L):
    """Fill ``L`` with the Cholesky factor of ``B`` made positive definite.

    First a multiple of ``A^T A`` is added, which does not change a step tangential to the rows of
    ``A``; then, only if needed, multiples of the identity in a geometric sequence.  Returns whether
    numbers are small enough for that.
    """
    never_inline()
    n = B.shape[0]
    if not max(largest_entry(B), largest(g)) < HUGE:
        return False
    # Relative to the problem's size, so that the unit of energy does not matter.
    across, shift = 0.0, 1e-6 * max(largest_entry(B), largest(g))
    if shift < 1e-300:
        shift = 1e-300 if shift > 0.0 else 1.0
    while shift < HUGE:
        C = B.copy()
        for i in range(n):
            C[i, i] += shift
            for k in range(n):
                for j in range(A.shape[0]):
                    C[i, k] += across * A[j, i] * A[j, k]
        if cholesky(C, L):
            return True
        # Once, and large: a curvature that is negative across the rows only is cured by it, and
        # the step along them stays Newton's.
        if across == 0.0 and A.shape[0] > 0:
            across = 10.0 * n * largest_entry(B)
        else:
            shift *= 8.0
    return False


@compiled
def leaves(problem, use, on, m, v, outcome, ways, F, J, H, size, energy):
    """Move ``v`` off a saddle or a flat point to a lower one; return whether there was one."""
    never_inline()
    if outcome == SADDLE:
        return leave_saddle(problem, use, on, m, v, ways[0], F, J, H, size, energy)
    return outcome == FLAT and leave_flat(problem, use, on, m, v, ways, F, J, H, size, energy)


@compiled
def is_uneven(problem, v, lam, F, J, H, size):
    """Return whether the scales that curvatures ask for differ very much; see ``rescaling``."""
    never_inline()
    evaluate(problem, v, F, J, H, size, True)
    L, scales = lagrangian_hessian(H, lam), problem[4]
    top = 0.0
    for i in range(v.size):
        top = max(top, abs(L[i, i]) / scales[i] ** 2)
    low, high = np.inf, 0.0
    for i in range(v.size):
        # In natural units: what the scale would be if it were chosen here.
        bend = abs(L[i, i]) / scales[i] ** 2
        flat = not bend > CURVELESS * top
        scale = max(1.0, abs(v[i])) if flat else np.sqrt(top / bend) / scales[i]
        low, high = min(low, scale), max(high, scale)
    return not high < SPREAD * low


@compiled
def descend(problem, use, m, rows, u, size, limit):
    """Descend from ``u`` inside the piece given by ``use``, never through a wall.

    Every iterate is feasible and lower than the one before: a step of sequential quadratic
    programming is limited in length, projected onto the set and halved until the energy decreases.
    Once the active set is stable, Newton's method on its KKT equations finishes the descent.

    Returns
    -------
    status, iterations, u, multipliers
    """
    n = u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    L = np.zeros((n, n))
    lam, on, before = np.zeros(rows - 1), np.zeros(m, np.bool_), np.zeros(m, np.bool_)
    u = u.copy()
    origin = u.copy()
    # A start may lie far outside; later steps begin next to the set and need few linearisations.
    if not project(problem, use, m, u, F, J, H, size, np.int64(100)) or not np.isfinite(
        F[rows - 1]
    ):
        return INFEASIBLE, 0, u, lam
    nothing, section = np.zeros(m, np.bool_), np.zeros((0, n))
    cap = FIRST_CAP
    for iteration in range(1, limit + 1):
        evaluate(problem, u, F, J, H, size, True)
        energy, g = F[rows - 1], J[rows - 1].copy()
        if not all_finite(J, H, lam, rows - 1):
            return STALLED, iteration, u, lam
        # Contacts come and go at first: convexified across them, a step that opens one is short.
        if rows - 1 > m or iteration > PATIENCE:
            section, _, _, _ = normalised_rows(F, J, on if iteration > PATIENCE else nothing, m)
        # With the multipliers of the last step: this step's are not known before it is solved.
        if not convexified(lagrangian_hessian(H, lam), g, section, L):
            return STALLED, iteration, u, lam
        A, b, keep, sizes = normalised_rows(F, J, use, m)
        for j in range(b.size):
            # Within the tolerance a row is a contact: else steps would go into rounding errors.
            if abs(b[j]) < FEASIBLE:
                b[j] = 0.0
        _, d, mult = solve_quadratic(L, g, A, b, equations_among(keep, m))
        for i in range(rows - 1):
            lam[i] = 0.0
        for i in range(m):
            before[i], on[i] = on[i], False
        for j in range(b.size):
            lam[keep[j]] = mult[j] / sizes[j]
            if keep[j] < m and mult[j] > 0.0:
                on[keep[j]] = True
        reach = largest(d)
        settled = True
        for i in range(m):
            settled = settled and on[i] == before[i]
        # Near the end, or with the contacts of the step before: Newton's method may finish.
        if reach < 1e-9 or (reach < 0.5 and settled):
            outcome, v, exact, ways = classify(problem, use, on, m, u, F, J, H, size, energy)
            if outcome == MINIMUM:
                return CONVERGED, iteration, v, exact
            if leaves(problem, use, on, m, v, outcome, ways, F, J, H, size, energy):
                for k in range(n):
                    u[k] = v[k]
                continue
            if outcome == FLAT:
                uneven = is_uneven(problem, v, exact, F, J, H, size)
                return (UNEVEN if uneven else LEVEL), iteration, v, exact
            if reach < 1e-9:
                if leave_tangency(problem, use, on, m, u, F, J, H, size, energy):
                    continue
                return STALLED, iteration, v if outcome != REJECTED else u, lam
        slope = 0.0
        for k in range(n):
            slope += g[k] * d[k]
        # The quadratic model is not trusted farther than the steps before it have been right.
        factor = min(1.0, cap / reach)
        accepted = False
        for _ in range(40):
            trial = plus(u, factor, d)
            # Shorter steps cannot jump over a forbidden region of the size of a scale.
            blocked = factor * reach > 0.5 and crosses_wall(
                problem, use, m, u, plus(trial, -1.0, u), F, J, H, size
            )
            if not blocked and project(problem, use, m, trial, F, J, H, size, np.int64(6)):
                # At the bottom a decrease is smaller than the rounding error of the energy.
                rounding = 1e-15 * (abs(energy) + largest(g))
                if F[rows - 1] <= energy + 1e-4 * factor * slope + rounding:
                    accepted = True
                    break
            factor *= 0.5
        if not accepted:
            # No shorter step is lower either: this is a stationary point, or nothing can be said.
            outcome, v, exact, ways = classify(problem, use, on, m, u, F, J, H, size, energy)
            if leaves(problem, use, on, m, v, outcome, ways, F, J, H, size, energy):
                for k in range(n):
                    u[k] = v[k]
                continue
            if outcome < SADDLE and leave_tangency(problem, use, on, m, u, F, J, H, size, energy):
                continue
            return (
                (CONVERGED if outcome >= SADDLE else STALLED),
                iteration,
                v if outcome != REJECTED else u,
                exact,
            )
        if factor * reach >= 0.99 * cap:
            cap *= 2.0
        else:
            cap = max(FIRST_CAP, factor * reach)
        u = trial
        if largest(plus(u, -1.0, origin)) > FAR:
            return UNBOUNDED, iteration, u, lam
    return STALLED, limit, u, lam
