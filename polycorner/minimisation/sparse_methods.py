"""Descent and stationary points of faces in large polyhedra, with sparse matrices throughout."""

import numpy as np

from polycorner.minimisation.polishing import Endpoint
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.sparse.descent import descend
from polycorner.minimisation.sparse.faces import on_face
from polycorner.minimisation.sparse.nonlinear import Nonlinear
from polycorner.polyhedra.polyhedron import Piece
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

FARTHEST = 1e3  # longest step of Newton's method towards a chosen face, in scale units


def nonlinear(problem: Problem, tolerances: Tolerances) -> Nonlinear:
    """Return a problem as a sparse nonlinear programme."""
    terms, constraints = problem.sparse_energy, problem.sparse_rows
    return Nonlinear(terms, constraints, problem.inequalities, problem.scales, tolerances)


def sparse_descent(problem: Problem, q: Array, limit: int, tolerances: Tolerances) -> Endpoint:
    """Descend from ``q`` in a sparse polyhedron; see :mod:`.sparse.descent`."""
    end = descend(nonlinear(problem, tolerances), q / problem.scales, limit)
    return Endpoint(end.point * problem.scales, end.iterations, end.failure)


def sparse_on_face(
    problem: Problem, active: Piece, q: Array, tolerances: Tolerances
) -> tuple[Array, float]:
    """Apply Newton's method on a face; return the point and the length of the last step."""
    programme = nonlinear(problem, tolerances)
    held = np.concatenate([np.array(sorted(active), dtype=np.int64), programme.equations])
    found = on_face(programme, held, q / problem.scales, far=FARTHEST)
    if found is None:
        return q, np.inf
    return found.point * problem.scales, found.last_step
