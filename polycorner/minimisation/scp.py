"""Sequential convex programming with cvxpy and Clarabel, applied to one piece.

Each step minimises a convex model of the energy over the linearised polyhedron inside a trust
region ([BV] ch. 4, [NW] ch. 18).
"""

from dataclasses import dataclass
from threading import RLock
from typing import Any

import cvxpy as cp
import numpy as np

from polycorner.errors import SolverError
from polycorner.minimisation.polishing import Endpoint, polished
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import unit_rows
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH, Tolerances

# cvxpy numbers the variables of all threads by one counter, and warns of inaccurate solutions;
# filters that silence warnings are those of all threads, too.

ONE_AT_A_TIME = RLock()  # to be held while programmes are stated


def solve(programme: Any) -> bool:
    """Solve a programme, perhaps inaccurately; return whether its variables have values."""
    import cvxpy as cp

    with ONE_AT_A_TIME:
        try:
            data, chain, inverse = programme.get_problem_data(cp.CLARABEL, solver_opts={})
            found = chain.solve_via_data(programme, data, warm_start=True)
        except cp.error.SolverError:
            return False  # numerical failure on these data
        solution = chain.invert(found, inverse)
        if solution.status in cp.settings.ERROR:
            return False
        programme.unpack(solution)
    return solution.status in cp.settings.SOLUTION_PRESENT


PENALTY = 10.0  # initial weight of the constraint violation in the merit function


@dataclass(frozen=True)
class ConvexStep:
    """The convex programme of one step, with cvxpy parameters for its data.

    ``minimise g.d + |R d|^2 / 2 + penalty * (slack)`` subject to ``A d + b + slack >= 0``,
    ``C d + c = excess``, ``|d_i| <= radius``; slack and excess are the violations.
    """

    step: cp.Variable
    inequality: tuple[cp.Parameter, cp.Parameter]
    equation: tuple[cp.Parameter, cp.Parameter]
    gradient: cp.Parameter
    root: cp.Parameter
    radius: cp.Parameter
    penalty: cp.Parameter
    programme: cp.Problem
    contacts: cp.Constraint | None

    @classmethod
    def stated(cls, n: int, inequalities: int, equations: int) -> "ConvexStep":
        """State the programme for ``n`` coordinates."""
        step = cp.Variable(n)
        gradient, root, radius = cp.Parameter(n), cp.Parameter((n, n)), cp.Parameter(nonneg=True)
        penalty = cp.Parameter(nonneg=True)
        a, b = cp.Parameter((max(inequalities, 1), n)), cp.Parameter(max(inequalities, 1))
        c, h = cp.Parameter((max(equations, 1), n)), cp.Parameter(max(equations, 1))
        slack, excess = (
            cp.Variable(max(inequalities, 1), nonneg=True),
            cp.Variable(max(equations, 1)),
        )
        cost = gradient @ step + cp.sum_squares(root @ step) / 2
        rules = [cp.norm_inf(step) <= radius]
        contacts = None
        if inequalities:
            contacts = a @ step + b + slack >= 0
            rules.append(contacts)
            cost += penalty * cp.sum(slack)
        if equations:
            rules.append(c @ step + h == excess)
            cost += penalty * cp.norm1(excess)
        programme = cp.Problem(cp.Minimize(cost), rules)
        return cls(step, (a, b), (c, h), gradient, root, radius, penalty, programme, contacts)

    def solve(self) -> tuple[Array, Array] | None:
        """Return the step and the multipliers of the inequalities, or None if there is no step."""
        if cp.CLARABEL not in cp.installed_solvers():
            msg = "cvxpy does not find the solver Clarabel; install the package clarabel"
            raise SolverError(msg)
        # An inaccurate step does no harm: it is accepted only if the merit decreases.
        if not solve(self.programme):
            return None
        duals = np.zeros(0) if self.contacts is None else np.asarray(self.contacts.dual_value)
        return np.asarray(self.step.value), duals


def scp(problem: Problem, piece: Piece, q: Array, limit: int, tolerances: Tolerances) -> Endpoint:
    """Run sequential convex programming and polish its result."""
    point, iterations, settled = sequential_convex(problem, piece, q, limit)
    return polished(problem, piece, q, point, iterations, tolerances, stopped=settled)


def sequential_convex(
    problem: Problem, piece: Piece, q: Array, limit: int
) -> tuple[Array, int, bool]:
    """Return the last point, the number of programmes solved, and whether the steps converged.

    Rows are scaled to unit gradients and the energy to its own size.  A step is accepted if
    energy plus penalty decreases, otherwise the trust region shrinks; the penalty grows as the
    multipliers approach it.
    """
    kept = [*sorted(piece), *range(problem.inequalities, problem.rows - 1)]
    count, scales = len(piece), problem.scales
    # cvxpy numbers its variables with a global counter, and is not safe in threads.
    with ONE_AT_A_TIME:
        model = ConvexStep.stated(problem.dimension, count, len(kept) - count)
    values, gradients, hessians = problem.evaluate(q, 2)
    size = float(max(abs(gradients[-1]).max(), abs(hessians[-1]).max())) or 1.0
    duals = np.zeros(count)
    penalty, radius, idle = PENALTY, SEARCH.first_box, 0
    for iteration in range(1, limit + 1):
        lengths = np.linalg.norm(gradients[kept], axis=1)
        lengths[lengths == 0] = 1.0
        rows = gradients[kept] / lengths[:, None]
        weights = _weights(rows, gradients[-1] / size, duals)
        # An exact penalty has to be larger than every multiplier, or the merit falls off the set.
        penalty = max(penalty, 3 * float(abs(weights).max(initial=0.0)))
        merit = _merit(values, gradients, kept, count, size, penalty)
        _load(model, values, gradients, kept, lengths, size, count, radius)
        curvature = hessians[-1] / size
        for row, length, weight in zip(kept, lengths, weights, strict=True):
            curvature = curvature - weight / length * hessians[row]
        model.root.value, model.penalty.value = _square_root(curvature), penalty
        solved = model.solve() if np.isfinite(curvature).all() else None
        if solved is None:
            return q, iteration, False
        step, duals = solved
        trial = _corrected(problem, q + step * scales, kept, count)
        after = problem.evaluate(trial, 2)
        new_merit = _merit(after[0], after[1], kept, count, size, penalty)
        reach = float(abs(step).max())
        gained = merit - new_merit
        idle = idle + 1 if abs(gained) <= 1e-13 * (1 + abs(merit)) else 0
        if np.isfinite(new_merit) and gained >= -1e-14 * (1 + abs(merit)):
            q, (values, gradients, hessians) = trial, after
            radius = min(2 * radius, 1.0) if reach > 0.9 * radius else radius
            # Polishing does the rest: Newton's method converges from here in a few steps.
            if reach < 1e-7 or idle > 1:
                return q, iteration, True
        else:
            radius = 0.25 * min(radius, reach)
        if radius < SEARCH.least_box:
            return q, iteration, True
    return q, limit, False


def _corrected(problem: Problem, trial: Array, kept: list[int], count: int) -> Array:
    """Return a trial point moved, to first order, onto the constraints it violates.

    Without this second-order correction the merit function rejects long steps along curved
    constraints ([NW] sec. 15.5, the Maratos effect).
    """
    values, gradients = problem.evaluate(trial, 1)
    away = distances(values[kept], gradients[kept])
    failed = np.flatnonzero(np.concatenate([away[:count] < 0, away[count:] != 0]))
    if not failed.size or not np.isfinite(away[failed]).all():
        return trial
    rows = unit_rows(gradients[kept][failed])
    correction = np.linalg.lstsq(rows, -away[failed], rcond=1e-8)[0]
    return np.asarray(trial + correction * problem.scales)


def _weights(rows: Array, slope: Array, duals: Array) -> Array:
    """Return least-squares multipliers of the equations and the rows with positive duals."""
    count = len(duals)
    chosen = [*np.flatnonzero(duals > 1e-6).tolist(), *range(count, len(rows))]
    weights = np.zeros(len(rows))
    if chosen:
        weights[chosen] = np.linalg.lstsq(rows[chosen].T, slope, rcond=1e-8)[0]
    weights[:count] = np.maximum(weights[:count], 0.0)
    return weights


def _load(
    model: ConvexStep,
    values: Array,
    gradients: Array,
    kept: list[int],
    lengths: Array,
    size: float,
    count: int,
    radius: float,
) -> None:
    rows, offsets = gradients[kept] / lengths[:, None], values[kept] / lengths
    if count:
        model.inequality[0].value, model.inequality[1].value = rows[:count], offsets[:count]
    if len(kept) > count:
        model.equation[0].value, model.equation[1].value = rows[count:], offsets[count:]
    model.gradient.value, model.radius.value = gradients[-1] / size, radius


def _merit(
    values: Array, gradients: Array, kept: list[int], count: int, size: float, penalty: float
) -> float:
    away = distances(values[kept], gradients[kept])
    short = np.maximum(-away[:count], 0.0).sum() + abs(away[count:]).sum()
    return float(values[-1] / size + penalty * short)


def _square_root(matrix: Array) -> Array:
    """Return ``R`` with ``R^T R`` the nearest safely positive form."""
    values, vectors = np.linalg.eigh(matrix)
    # A model without curvature in some direction has no minimiser but on the trust region.
    floor = 1e-6 * max(1.0, abs(values).max())
    return np.asarray(np.sqrt(np.maximum(values, floor))[:, None] * vectors.T)
