"""Feasible points near a given one: projections, and steps that lower the violation."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, eye_array

from polycorner.formulas.rows import Indices
from polycorner.minimisation.sparse.factorisation import Saddle
from polycorner.minimisation.sparse.nonlinear import Nonlinear, Point
from polycorner.minimisation.sparse.programmes import Linearised, elastic_step, quadratic_step
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH

AROUND = 100.0  # box of a step on a flat face, in units of the violation
FARTHEST = 10.0  # violation, in scale units, beyond which a projection is given up
NONE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Restored:
    """A feasible point, or the last point of a search whose violation is not zero.

    ``stationary`` says that no step lowers the violation there to first order.
    """

    at: Point
    feasible: bool
    stationary: bool = False


def violation(problem: Nonlinear, at: Point) -> Array:
    """Return the distances ``(M,)`` by which constraints are missed."""
    missed = abs(at.distances)
    m = problem.inequalities
    missed[:m] = np.maximum(-at.distances[:m], 0.0)
    return missed


def worst(problem: Nonlinear, at: Point) -> float:
    """Return the largest violation; infinite where anything is not finite."""
    return float(violation(problem, at).max(initial=0.0)) if at.is_finite else np.inf


def near(problem: Nonlinear, at: Point, reach: float) -> Indices:
    """Return the inequalities that a step in a box of the size ``reach`` can close."""
    m = problem.inequalities
    sums = abs(at.rows[:m]).sum(axis=1)
    return np.flatnonzero(at.distances[:m] <= 1.2 * reach * sums + problem.tolerances.zero)


def linearised(problem: Nonlinear, at: Point, kept: Indices, size: float) -> Linearised:
    """Return the programme of some inequalities at a point, with the energy in units of ``size``.

    What is missed by rounding counts as zero.
    """
    values = np.where(abs(at.distances) < problem.tolerances.zero, 0.0, at.distances)
    own, rows = problem.equations, at.rows
    return Linearised(
        values[kept],
        csr_array(rows[kept]),
        values[own],
        csr_array(rows[own]),
        at.gradient / size,
    )


def projected(
    problem: Nonlinear, at: Point, limit: int, held: Indices = NONE, *, onto: bool = False
) -> Point | None:
    """Return the point after Gauss-Newton steps onto the held functions and those that are missed.

    The steps end in the set, up to what counts as zero, as the solver of the programmes is no more
    accurate; with ``onto``, also where all held functions vanish.  None if they do not.
    """
    face, miss = held if onto else NONE, problem.tolerances.zero
    missed = np.zeros(len(at.distances), dtype=np.bool_)
    missed[problem.equations] = missed[held] = True
    for _ in range(limit):
        if worst(problem, at) <= miss and abs(at.distances[face]).max(initial=0.0) <= miss:
            return at
        missed |= violation(problem, at) > miss
        chosen, n = np.flatnonzero(missed), len(at.place)
        right = np.concatenate([np.zeros(n), -at.distances[chosen]])
        try:
            system = Saddle(eye_array(n), csr_array(at.rows[chosen]))
            change = system.solve(right, np.zeros(len(right)))
        except ValueError:
            return None
        if not np.isfinite(change).all():
            return None
        at = problem.at(at.place + change[:n])
        if not worst(problem, at) < FARTHEST:
            return None
    return at if worst(problem, at) <= miss else None


def restored(problem: Nonlinear, at: Point, limit: int) -> Restored:
    """Lower the sum of violations by elastic programmes in a trust region until it vanishes."""
    reach, miss = SEARCH.first_restoring, problem.tolerances.zero
    total = float(violation(problem, at).sum())
    for _ in range(limit):
        if worst(problem, at) < 1e-3:
            ended = projected(problem, at, 10)
            if ended is not None:
                return Restored(ended, feasible=True)
        kept = np.flatnonzero(at.distances[: problem.inequalities] <= 2.4 * reach + miss)
        kept = np.union1d(kept, near(problem, at, reach))
        model = linearised(problem, at, kept, 1.0)
        step = elastic_step(model, reach)
        if step is None:
            return Restored(at, feasible=False)
        left = np.maximum(-(model.values + model.rows @ step), 0.0).sum()
        left += abs(model.sections + model.section_rows @ step).sum()
        if total - left <= 100 * problem.tolerances.stationary * total:
            return Restored(at, feasible=False, stationary=True)
        trial = problem.at(at.place + step)
        after = float(violation(problem, trial).sum()) if trial.is_finite else np.inf
        size = float(abs(step).max())
        if after <= total - 0.1 * (total - left):
            at, total = trial, after
            reach = 2 * reach if size > 0.9 * reach else reach
        else:
            reach = 0.25 * min(reach, size)
        if reach < SEARCH.least_box:
            break
    return Restored(at, feasible=worst(problem, at) <= miss)


def inside(problem: Nonlinear, at: Point, held: Indices) -> Point:
    """Return the nearest point of the set where held functions vanish, if a few steps lead there.

    For a face that is flat, of which the point has been chosen by chance.
    """
    others = np.setdiff1d(np.arange(problem.inequalities), held)
    for _ in range(5):
        short = worst(problem, at)
        if short <= problem.tolerances.feasible:
            break
        reach = AROUND * short
        kept = others[at.distances[others] <= 10 * reach]
        model = Linearised(
            at.distances[kept],
            csr_array(at.rows[kept]),
            at.distances[held],
            csr_array(at.rows[held]),
            np.zeros(len(at.place)),
        )
        step = quadratic_step(model, csr_array(eye_array(len(at.place))), reach)
        if step is None:
            break
        at = problem.at(at.place + step.displacement)
    return at
