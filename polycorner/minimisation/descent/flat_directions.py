"""Change of the energy along directions in which its second order vanishes."""

import numpy as np

from polycorner.minimisation.descent.evaluation import FEASIBLE, evaluate, violation
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import largest, plus
from polycorner.minimisation.descent.newton import polish


@compiled
def probe(problem, on, use, m, rows, u, directions, held, steps, size):
    """Follow directions along a face; return the largest change of the energy or its slope.

    The slope is that along the span of ``held`` (orthonormal rows spanning the directions) on the
    face.  Each step is corrected by Newton's method on the face with the components along
    ``held`` fixed.  Steps that leave the piece are skipped; the result is infinite if a direction
    cannot be followed at all.
    """
    n = u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    evaluate(problem, u, F, J, H, size, False)
    energy, worst = F[rows - 1], 0.0
    for j in range(directions.shape[0]):
        followed = False
        for step in steps:
            guess = plus(u, step, directions[j])
            q = guess.copy()
            lam, last = polish(problem, on, m, held, q, F, J, H, size)
            if not last < 1e-8 or largest(plus(q, -1.0, guess)) > 0.1 * abs(step):
                return np.inf
            if violation(F, J, use, m) <= FEASIBLE:
                followed = True
                worst = max(worst, abs(F[rows - 1] - energy))
                for r in range(held.shape[0]):
                    slope = 0.0
                    for k in range(n):
                        pull = J[rows - 1, k]
                        for i in range(rows - 1):
                            pull -= lam[i] * J[i, k]
                        slope += held[r, k] * pull
                    worst = max(worst, abs(slope))
        if not followed:
            return np.inf
    return worst
