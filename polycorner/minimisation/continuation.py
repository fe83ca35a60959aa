"""Descents that go on from where they ended, at no minimum.

A wall that touches what the equations define, without cutting anything off, shortens every
linearised step towards the point of contact: where ``f >= 0`` has the gap ``t^2 / 2`` at the
distance ``t``, by half of it.  The steps converge to that point, whatever the energy does there.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from polycorner.minimisation.analysis import analyse
from polycorner.minimisation.evidence import steepest_descent
from polycorner.minimisation.polishing import Endpoint
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.tangency import STEPS
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import Rows
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

CONTACTS = 50  # from which a descent goes on
NEARLY = 1e-3  # singular value of unit gradients, relative to the largest, to be looked at


def go_on(
    problem: Problem,
    piece: Piece,
    end: Endpoint,
    descent: Callable[[Problem, Piece, Array, int], Endpoint],
    limit: int,
    tolerances: Tolerances,
) -> Endpoint:
    """Repeat a descent from lower points beside its end, as long as there are any."""
    for _ in range(CONTACTS):
        lower = _lower_point(problem, piece, end, tolerances)
        if lower is None:
            break
        further = descent(problem, piece, lower, limit)
        if not problem.energy.value(further.point) < problem.energy.value(end.point):
            break
        end = replace(further, iterations=end.iterations + further.iterations)
    return end


def _lower_point(
    problem: Problem, piece: Piece, end: Endpoint, tolerances: Tolerances
) -> Array | None:
    """Return a point of the piece that is lower than the end of a descent at a contact."""
    if end.failure not in {None, Verdict.NOT_CONVERGED}:
        return None
    values, gradients = problem.evaluate(end.point, 1)
    away, m = distances(values[:-1], gradients[:-1]), problem.inequalities
    near = [i for i in piece if away[i] <= tolerances.zero]
    numbers = [*near, *range(m, problem.rows - 1)]
    if not near or len(numbers) < 2 or not np.isfinite(gradients[numbers]).all():
        return None
    if Rows(gradients[numbers], NEARLY).independent:
        return None
    with np.errstate(all="ignore"):
        found = analyse(problem, end.point, tolerances, higher="followed")
    if found.verdict is not Verdict.NOT_STATIONARY or found.independent:
        return None
    rate, way = steepest_descent(found)
    for step in STEPS:
        reached, point = problem.restore(piece, end.point + step * way * problem.scales)
        if reached and problem.energy.value(point) < values[-1] - rate * step / 4:
            return point
    return None
