"""SciPy's sequential least-squares programming ([Kraft]), applied to one piece."""

from typing import Any

import numpy as np

from polycorner.minimisation.polishing import Endpoint, polished
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.polyhedron import Piece
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

STOPPED = (0, 8)  # SLSQP's exit codes for convergence, and for a line search without progress


def slsqp(problem: Problem, piece: Piece, q: Array, limit: int, tolerances: Tolerances) -> Endpoint:
    """Run SLSQP in scaled coordinates, the energy divided by its own size, and polish."""
    from scipy.optimize import minimize

    scales, m = problem.scales, problem.inequalities
    values, gradients, hessians = problem.evaluate(q, 2)
    size = float(max(abs(gradients[-1]).max(), abs(hessians[-1]).max())) or 1.0
    rows = sorted(piece)
    sections = list(range(m, problem.rows - 1))
    floor = float(values[-1])
    options: Any = {"ftol": 1e-15, "maxiter": limit}

    def constraint(kind: str, kept: list[int]) -> Any:
        return {
            "type": kind,
            "fun": lambda u: problem.evaluate(u * scales, 0)[0][kept],
            "jac": lambda u: problem.evaluate(u * scales, 1)[1][kept],
        }

    def energy(u: Array) -> float:
        return float(problem.evaluate(u * scales, 0)[0][-1] - floor) / size

    def slope(u: Array) -> Array:
        return np.asarray(problem.evaluate(u * scales, 1)[1][-1] / size)

    found = minimize(
        energy,
        q / scales,
        jac=slope,
        method="SLSQP",
        constraints=[constraint(k, kept) for k, kept in (("ineq", rows), ("eq", sections)) if kept],
        options=options,
    )
    point, stopped = found.x * scales, found.status in STOPPED
    return polished(problem, piece, q, point, int(found.nit), tolerances, stopped=stopped)
