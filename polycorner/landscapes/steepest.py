"""Steepest descent inside a polyhedron by short steps.

A step of the length ``s`` is the displacement nearest to ``-s dE/|dE|``, in scale units, that the
linearised functions of a branch allow, as in Moreau's catching-up algorithm ([Moreau]): contacts
that the energy presses on close and stay closed, others open.
"""

from dataclasses import dataclass

import numpy as np

from polycorner.minimisation.feasibility import approach
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import least_distance, unit_rows
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

MOST = 1000  # steps
GROWTH = 1.5  # of a step after one that was accepted
FINEST = 0.01  # of the stride: shorter steps end the descent


@dataclass(frozen=True, eq=False)
class Slope:
    """Energy, downhill direction, distances and normals of walls at a point, in scale units."""

    problem: Problem
    point: Array
    height: float
    downhill: Array
    away: Array
    normals: Array

    @classmethod
    def at(cls, problem: Problem, q: Array) -> "Slope":
        """Return what is seen from a point."""
        values, gradients = problem.evaluate(q, 1)
        down = -gradients[-1] / (float(np.linalg.norm(gradients[-1])) or 1.0)
        away, normals = distances(values[:-1], gradients[:-1]), unit_rows(gradients[:-1])
        return cls(problem, q, float(values[-1]), down, away, normals)

    @property
    def pieces(self) -> list[Piece]:
        """The branches that hold here, or fail least."""
        d, m = self.problem.polyhedron, self.problem.inequalities
        if not d.is_union:
            return [frozenset(range(m))]
        return d.selections(self.away[:m].tolist(), DEFAULT.same)

    def way(self, length: float, *, whole: bool = False) -> tuple[Array, Piece]:
        """Return the step that leads down farthest, and the branch in which it does.

        Where the energy presses on walls it is shorter than ``length``, unless the ``whole`` length
        is asked for, and the energy does slope along them.
        """
        ways = [(self._allowed(sorted(piece), length), piece) for piece in self.pieces]
        step, piece = max(ways, key=lambda way: float(way[0] @ self.downhill))
        size = float(np.linalg.norm(step))
        if whole and DEFAULT.same * length < size < length:
            step = self._allowed(sorted(piece), length * length / size)
            step *= min(1.0, length / float(np.linalg.norm(step)))
        return step, piece

    def _allowed(self, piece: list[int], length: float) -> Array:
        """Return the step nearest to the downhill one that is allowed; no step if none is."""
        m = self.problem.inequalities
        near = [i for i in piece if self.away[i] < 2 * length]
        rows = [*near, *range(m, len(self.away))]
        normals, away = self.normals[rows], self.away[rows]
        if len(away) > len(near):
            normals = np.vstack([normals, -self.normals[m:]])
            away = np.append(away, -self.away[m:])
        free = length * self.downhill
        more = least_distance(normals, -away - normals @ free)
        return 0 * free if more is None else free + more


def steepest(
    problem: Problem, start: Array, stride: float, most: int = MOST, *, whole: bool = False
) -> list[Array]:
    """Return the points of a steepest descent, until it stalls near a stationary point.

    The first is the start, or a point of the set nearby; there are none if the set is not reached.
    Energies decrease.  No step is longer than ``stride``, in scale units.  It stalls, too, where
    the energy slopes along walls a hundred times less than into them, unless ``whole`` steps are
    asked for, which are as long there.
    """
    inside = _inside(problem, start)
    if inside is None:
        return []
    here = Slope.at(problem, inside)
    points, step = [here.point], stride
    way, piece = here.way(step, whole=whole)
    while len(points) < most and step > FINEST * stride:
        if not np.linalg.norm(way) > FINEST * step:
            break
        reached, point = problem.restore(piece, here.point + way * problem.scales)
        there = Slope.at(problem, point)
        onward = there.way(step, whole=whole)
        # A reversed direction means that a valley was stepped over.
        if reached and there.height < here.height and way @ onward[0] >= 0:
            here, last, step = there, step, min(GROWTH * step, stride)
            points.append(point)
            way, piece = onward if step == last else here.way(step, whole=whole)
        else:
            step /= 2
            way, piece = here.way(step, whole=whole)
    return points


def _inside(problem: Problem, start: Array) -> Array | None:
    """Return a point of the set near the start, if one is found."""
    pieces = Slope.at(problem, start).pieces
    for piece in pieces:
        reached, point = problem.restore(piece, start)
        if reached:
            return point
    found = (approach(problem, piece, start) for piece in pieces)
    return next((end.point for end in found if end.feasible), None)
