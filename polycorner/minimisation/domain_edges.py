"""Searches that end at the edge of the domain of a formula, such as ``log(x)`` at ``x = 0``.

A point of the edge is one where a value or a derivative of first or second order is not finite,
and beside which a function is not defined.  A search that stops short of one is followed: the edge
``q*`` lies in a direction ``d`` in which the energy decreases, where the last finite point is found
by bisection.  How the energy tends to the edge is read off ``E(q* - s d)`` at distances ``s`` that
are halved: it falls without bound where the differences do not shrink, and tends to a limit where
they do, as those of ``s^p`` shrink by ``2^-p``.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.printing import names, number
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

SHORTEST = 1e-18  # length at which looking ahead starts, relative to the point's size
HALVINGS = 12
# Ratios of successive differences of the energy: below the first they have a sum, beyond the second
# they do not shrink.
SHRINKING, LASTING = 0.95, 1 - 1e-6


@dataclass(frozen=True, eq=False)
class DomainEdge:
    """The edge of a domain: the last point at which all is finite, and what happens there."""

    point: Array
    note: str


@np.errstate(all="ignore")
def domain_edge(
    problem: Problem, piece: Piece, q: Array, tolerances: Tolerances
) -> DomainEdge | None:
    """Return the edge of a domain at which a search has ended, or None where there is none."""
    rows = [*sorted(piece), *range(problem.inequalities, problem.rows)]
    values, gradients, hessians = problem.evaluate(q, 2)
    if not np.isfinite(values[rows[:-1]]).all():
        return None
    if not np.isfinite(values[-1]):
        note = f"The search ended on the edge of the domain of {_named(problem, rows[-1:])}"
        return DomainEdge(q, f"{note}, where it has no finite value.")
    for derivative, which in ((gradients, "first"), (hessians, "second")):
        rough = [row for row in rows if not np.isfinite(derivative[row]).all()]
        if rough:
            edge = _is_beside(problem, rows, q, tolerances.zero / 10)
            return _at_edge(problem, q, rough, which) if edge else None
    for way in _ways_down(problem, rows, values, gradients, tolerances.zero):
        found = _ahead(problem, rows, q, way, tolerances)
        if found is not None:
            return found
    return None


def _at_edge(problem: Problem, q: Array, rows: list[int], which: str) -> DomainEdge:
    note = (
        f"The search ended on the edge of the domain of {_named(problem, rows)}, where the value "
        f"is finite and the {which} derivatives are not."
    )
    return DomainEdge(q, note)


def _is_beside(problem: Problem, rows: list[int], q: Array, distance: float) -> bool:
    """Whether a function is not defined at a point beside ``q``."""
    steps = distance * np.maximum(abs(q), problem.scales) * np.eye(len(q))
    around = problem.evaluate(q + np.concatenate([steps, -steps]), 0)[0]
    return not bool(np.isfinite(around[:, rows]).all())


def _ways_down(
    problem: Problem, rows: list[int], values: Array, gradients: Array, closed: float
) -> Iterator[Array]:
    """Yield directions in which the energy decreases: freely, and along the contacts."""
    away = distances(values[:-1], gradients[:-1])
    contacts = [row for row in rows[:-1] if abs(away[row]) <= closed]
    for held in ([], contacts) if contacts else ([],):
        basis = null_space(gradients[held], 1e-8) if held else np.eye(problem.dimension)
        slope = basis @ (basis.T @ gradients[-1])
        size = float(np.linalg.norm(slope))
        if size > 0:
            yield -slope / size


def _ahead(
    problem: Problem, rows: list[int], q: Array, way: Array, tolerances: Tolerances
) -> DomainEdge | None:
    """Return the edge that lies shortly ahead, if the energy decreases all the way."""
    step = way * problem.scales
    size = max(1.0, float(abs(q / problem.scales).max()))
    ahead = size * SHORTEST * 2.0 ** np.arange(np.log2(tolerances.corner / SHORTEST))
    level = float(problem.energy.value(q))
    beyond = _is_beyond(problem, rows, q + ahead[:, None] * step, level)
    if not beyond.any():
        return _pole(problem, rows, q, way, tolerances)
    first = int(beyond.argmax())
    inside, outside = (0.0 if first == 0 else float(ahead[first - 1])), float(ahead[first])
    for _ in range(80):
        middle = (inside + outside) / 2
        out = _is_beyond(problem, rows, q + middle * step, level)
        inside, outside = (inside, middle) if out else (middle, outside)
    there = problem.evaluate(q + outside * step, 0)[0]
    between = np.linspace(0.0, inside, 17)
    path, slopes = problem.evaluate(q + between[:, None] * step, 1)[:2]
    if not _stays(problem, rows, path, slopes, tolerances.zero):
        return _pole(problem, rows, q, way, tolerances)
    edge = q + inside * step
    text, attained = _approach(problem, edge, step, tolerances.corner)
    missing = [row for row in rows if not np.isfinite(there[row])]
    if not missing and attained:
        return None  # a jump, or rounding
    missing = missing or rows[-1:]  # a pole, beyond which the energy is finite again
    note = f"The search ran to the edge of the domain of {_named(problem, missing)}; {text}."
    return DomainEdge(edge if attained else q, note)


def _pole(
    problem: Problem, rows: list[int], q: Array, way: Array, tolerances: Tolerances
) -> DomainEdge | None:
    """Return a pole of the energy ahead, on both sides of which it falls without bound.

    Of ``E = C t^-p`` at the distance ``t``, ``E'/E`` is ``p / t`` and ``E''/E'`` is
    ``(p + 1) / t``.
    """
    values, gradients, hessians = problem.evaluate(q, 2)
    slope, bend = float(gradients[-1] @ way), float(way @ hessians[-1] @ way)
    if not (slope < 0 and bend < 0 and values[-1] < 0):
        return None
    inverse = bend / slope - slope / values[-1]
    if not inverse > 1 / tolerances.corner:
        return None
    step = way * problem.scales
    between = np.linspace(0.0, 0.9 / inverse, 17)
    path, slopes = problem.evaluate(q + between[:, None] * step, 1)[:2]
    if not _stays(problem, rows, path, slopes, tolerances.zero):
        return None
    text, attained = _approach(problem, q + step / inverse, step, tolerances.corner)
    if attained:
        return None
    note = f"The search ran to the edge of the domain of {_named(problem, rows[-1:])}; {text}."
    return DomainEdge(q, note)


def _is_beyond(problem: Problem, rows: list[int], q: Array, level: float) -> NDArray[np.bool_]:
    """Whether a function has no value at points, or the energy is above a level."""
    values = problem.evaluate(q, 0)[0][..., rows]
    return np.asarray(~np.isfinite(values).all(axis=-1) | (values[..., -1] > level))


def _named(problem: Problem, rows: list[int]) -> str:
    return names(problem.functions[row].name for row in rows)


def _stays(problem: Problem, rows: list[int], values: Array, gradients: Array, miss: float) -> bool:
    """Whether points on the way to an edge lie in the set, ever lower."""
    m = problem.inequalities
    energies = values[:, -1]
    noise = 1e-14 * abs(energies[0])
    for point, slopes in zip(values, gradients, strict=True):
        away = distances(point[:-1], slopes[:-1])
        if any((away[i] < -miss) if i < m else (abs(away[i]) > miss) for i in rows[:-1]):
            return False
    return bool((np.diff(energies) <= noise).all())


def _approach(problem: Problem, edge: Array, step: Array, far: float) -> tuple[str, bool]:
    """Say how the energy behaves towards an edge; return whether its value there is finite."""
    near = far * 2.0 ** -np.arange(HALVINGS + 1)
    energies = problem.evaluate(edge - near[:, None] * step, 0)[0][:, -1]
    falls = -np.diff(energies)
    here = f"the energy decreases towards it, to {number(problem.energy.value(edge), 4)}"
    if not np.isfinite(falls).all() or not (falls[-4:] > 0).all():
        return here, True
    ratio = float((falls[-3:] / falls[-4:-1]).mean())
    if ratio >= LASTING:
        return (
            "towards it the energy falls without bound, by no less each time that the distance is "
            "halved"
        ), False
    if ratio >= SHRINKING:
        return f"{here}, and whether it has a limit is not seen", False
    limit = float(energies[-1] - falls[-1] * ratio / (1 - ratio))
    return f"the energy decreases towards it and tends to about {number(limit, 4)}", True
