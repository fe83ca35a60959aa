"""Refinement of approximate minima to solutions of the KKT equations of a face; SLSQP with it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import Rows, unit_rows
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

STOPPED = (0, 8)  # SLSQP's exit codes for convergence, and for a line search without progress


@dataclass(frozen=True)
class Endpoint:
    """End point of a descent inside one piece of a polyhedron, with its failure, if any.

    ``note`` says in words what the search saw; ``flat`` that the second order seems to vanish.
    """

    point: Array
    iterations: int
    failure: Verdict | None
    note: str = ""
    flat: bool = False


def polished(
    problem: Problem,
    piece: Piece,
    start: Array,
    q: Array,
    iterations: int,
    tolerances: Tolerances,
    *,
    stopped: bool,
) -> Endpoint:
    """Solve the KKT equations of the face that carries an approximate minimum ``q``.

    It was found in a piece from ``start``; ``stopped`` says whether by the method's own test.
    """
    if not np.isfinite(q).all():
        q = start
    values, gradients = problem.evaluate(q, 1)
    lower = values[-1] < problem.energy.value(start)
    far = abs(q / problem.scales).max() > tolerances.unbounded
    # So far out distances are rounded: a point that the method takes for feasible is one.
    if far and lower and _violated(problem, piece, q, 1e-6) == frozenset():
        return Endpoint(start, iterations, Verdict.UNBOUNDED)
    if np.isfinite(values).all() and np.isfinite(gradients).all():
        # A method ends some way off its face: functions count as near that are much less than
        # active.
        face = _carrying(problem, piece, values, gradients, tolerances.beside)
        point = _on_face(problem, piece, q, face, tolerances)
        if point is not None:
            return Endpoint(point, iterations, None if stopped else Verdict.NOT_CONVERGED)
    # Where the end cannot be moved into the set, the start may: there is always some point to show.
    for origin in (q, start):
        reached, point = problem.restore(piece, origin)
        if reached and np.isfinite(problem.energy.value(point)):
            return Endpoint(point, iterations, Verdict.NOT_CONVERGED)
    return Endpoint(q, iterations, Verdict.INFEASIBLE)


def slsqp(problem: Problem, piece: Piece, q: Array, limit: int, tolerances: Tolerances) -> Endpoint:
    """Run SLSQP in scaled coordinates, the energy divided by its own size, and polish."""
    from scipy.optimize import minimize

    scales, m = problem.scales, problem.inequalities
    values, gradients, hessians = problem.evaluate(q, 2)
    size = float(max(abs(gradients[-1]).max(), abs(hessians[-1]).max())) or 1.0
    rows = sorted(piece)
    sections = list(range(m, problem.rows - 1))
    # SLSQP's tolerance is absolute: differences of a large energy would be lost in it.
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


def _on_face(
    problem: Problem, piece: Piece, q: Array, face: Piece, tolerances: Tolerances
) -> Array | None:
    """Return the stationary point near ``q`` of a face that is corrected on the way.

    Violated functions join the face; functions with negative multipliers leave it.
    """
    seen: set[Piece] = set()
    # Functions that join and leave in turn would go round for ever.
    while face not in seen:
        seen.add(face)
        point, last = problem.on_face(face, q)
        # Newton's method may settle at another stationary point, which was not the one that was
        # found.
        if not last < tolerances.settled or abs((point - q) / problem.scales).max() > 0.1:
            return None
        violated = _violated(problem, piece, point, tolerances.feasible)
        if violated is None or not np.isfinite(problem.energy.value(point)):
            return None
        negative = _negative(problem, face, point, tolerances)
        if not violated and not negative:
            return point
        # Violations first: multipliers say nothing at a point that is not in the set.
        face = (face | violated) if violated else face - negative
    return None


def _negative(problem: Problem, face: Piece, point: Array, tolerances: Tolerances) -> Piece:
    """Return the functions with negative multipliers, for a face with independent gradients."""
    _, gradients = problem.evaluate(point, 1)
    chosen = sorted(face)
    held = [*chosen, *range(problem.inequalities, problem.rows - 1)]
    rows = Rows(gradients[held], tolerances.rank / 100)
    # Multipliers are not unique: a negative one is no reason to open a contact.
    if not chosen or not rows.independent:
        return frozenset()
    weights = rows.weights(gradients[-1])[: len(chosen)]
    small = tolerances.multiplier * float(abs(gradients[-1]).max())
    return frozenset(i for i, weight in zip(chosen, weights, strict=True) if weight < -small)


def _carrying(
    problem: Problem, piece: Piece, values: Array, gradients: Array, reach: float
) -> Piece:
    """Return the nearly active functions with a share in the energy's gradient."""
    from scipy.optimize import nnls

    m = problem.inequalities
    away = distances(values[:-1], gradients[:-1])
    near = [i for i in sorted(piece) if away[i] <= reach]
    if not near:
        return frozenset()
    sections = unit_rows(gradients[m:-1])
    columns = np.vstack([unit_rows(gradients[near]), sections, -sections])
    shares, _ = nnls(columns.T, gradients[-1])
    size = abs(gradients[-1]).max()
    return frozenset(i for i, share in zip(near, shares, strict=False) if share > 1e-6 * size)


def _violated(problem: Problem, piece: Piece, q: Array, tolerance: float) -> Piece | None:
    """Return the inequalities of a piece that are violated at ``q``; None if an equation is."""
    values, gradients = problem.evaluate(q, 1)
    away = distances(values[:-1], gradients[:-1])
    m = problem.inequalities
    if not (abs(away[m:]) <= tolerance).all():
        return None
    return frozenset(i for i in piece if not away[i] >= -tolerance)
