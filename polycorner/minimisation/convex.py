"""Convex programmes, stated in cvxpy and solved by Clarabel, for any number of threads.

cvxpy numbers the variables of all threads by one counter, and warns of inaccurate solutions;
filters that silence warnings are those of all threads, too.
"""

from threading import RLock
from typing import Any

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
