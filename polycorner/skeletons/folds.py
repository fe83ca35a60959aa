"""Folds: corners where the active gradients have one relation and leave one direction free.

Let ``f_1, ..., f_m`` be the active functions, ``sum w_i grad f_i = 0`` their only relation, ``d``
the only direction along which all their slopes vanish, in the quotient, and ``Q`` the quadratic
form ``sum w_i v' H_i v / 2``.  If ``Q(d)`` is not zero, say positive, then the values ``y_i`` of
``f_i`` and a coordinate ``t`` along ``d`` satisfy, to leading order,

    sum w_i y_i = t^2 + sum S_kl y_k y_l,

the sum on the right over the functions with ``w_k = w_l = 0``, and the set ``y >= 0`` is folded
along ``w . y = 0`` ([AGV] sec. 1).  Where every ``S_kk`` is positive, only functions with positive
weights open alone:

| functions that open | signs of their weights | what leaves the corner |
|---|---|---|
| ``k`` | + | an edge for each sign of ``t`` |
| ``j, k`` | +, + | for each sign of ``t`` a face between the edges of ``j`` and ``k`` |
| ``j, k`` | +, 0 or - | a face between the two edges of ``j`` |

Clusters of spheres that are rigid to second order only are of this kind, and circles that touch.
Where ``S_kk`` is zero, the relation persists while ``f_k`` opens: part of a cluster stays singular
as the rest moves.  Such an edge is noted, not followed.  Two functions of weight zero with negative
``S_kl`` may open on a face around the corner that no edge bounds: not sought.
"""

from itertools import combinations

import numpy as np

from polycorner.polyhedra.cones import Rows, null_space, unit_rows
from polycorner.polyhedra.strata import RANK_TOLERANCE
from polycorner.skeletons.points import EvaluatedPoint, projected
from polycorner.skeletons.vertex_figures import Ray, Sector, VertexFigure, curvature
from polycorner.spaces.manifold import Array

# Distances in scale units at which the edges are looked for.
DISTANCES = (3e-3, 1e-3, 3e-4)


def fold_figure(
    point: EvaluatedPoint, active: frozenset[int], rank: int, full: int
) -> VertexFigure | None:
    """Return the rays and sectors at a fold; None where the corner is none, or not clearly.

    Parameters
    ----------
    point : EvaluatedPoint
        The corner.
    active : set of int
        Functions that vanish there.
    rank, full : int
        Rank of their gradients in the quotient, and its dimension.
    """
    rows = sorted(active)
    if point.quotient.polyhedron.is_union or len(rows) != full or rank != full - 1:
        return None
    frame = null_space(point.matrix([]), RANK_TOLERANCE)
    held = Rows(unit_rows(point.gradients[rows]) @ frame, RANK_TOLERANCE)
    weights, flex = held.relations[:, 0], held.null_space
    weights = np.where(abs(weights) > RANK_TOLERANCE, weights, 0.0)
    bend = float(curvature(point, rows, weights, flex)[0, 0])
    if abs(bend) <= RANK_TOLERANCE:
        return None
    weights = weights * np.sign(bend)
    persistent = _persistent(point, rows, held, weights)
    if persistent is None:
        return None
    for distance in DISTANCES:
        rays = _rays(point, rows, weights, frame @ flex[:, 0], distance)
        if rays is not None:
            sectors = _sectors(rows, weights, persistent)
            return VertexFigure(rank, full, rays, sectors, _notes(point, rows, persistent))
    return None


def _persistent(
    point: EvaluatedPoint, rows: list[int], held: Rows, weights: Array
) -> set[int] | None:
    """Return the functions of weight zero with ``S_kk = 0``, by position in ``rows``.

    None if some ``S_kk`` is negative.
    """
    free = np.flatnonzero(weights == 0)
    directions = [held.null_space[:, 0], *(held.opening(int(k)) for k in free)]
    form = curvature(point, rows, weights, np.transpose(directions))
    own = np.diagonal(form)[1:] - form[0, 1:] ** 2 / form[0, 0]
    if (own < -RANK_TOLERANCE).any():
        return None
    return set(free[own <= RANK_TOLERANCE].tolist())


def _notes(point: EvaluatedPoint, rows: list[int], persistent: set[int]) -> tuple[str, ...]:
    every = point.quotient.polyhedron.names
    names = ", ".join(every[i] for i in rows)
    return tuple(
        f"the edge that opens {every[rows[k]]} out of the singular corner {names} has dependent "
        f"gradients: not followed"
        for k in sorted(persistent)
    )


def _rays(
    point: EvaluatedPoint, rows: list[int], weights: Array, flex: Array, distance: float
) -> tuple[Ray, ...] | None:
    """Return two rays for every positive weight, one after the other; None if one is not found."""
    quotient = point.quotient
    scales = quotient.polyhedron.manifold.scale_array
    rays = []
    for k in np.flatnonzero(weights > 0):
        held = [row for row in rows if row != rows[k]]
        for way in (flex, -flex):
            sample = projected(quotient, point.q + distance * scales * way, held, distance / 2)
            if sample is None or sample.active() != frozenset(held):
                return None
            rays.append(Ray(way, frozenset(held), sample, distance))
    return tuple(rays)


def _sectors(rows: list[int], weights: Array, persistent: set[int]) -> tuple[Sector, ...]:
    """Return the sectors that no edge with dependent gradients bounds.

    Their rays are counted as :func:`_rays` returns them.
    """
    opening = np.flatnonzero(weights > 0).tolist()
    first = {k: 2 * i for i, k in enumerate(opening)}
    sectors = []
    for j, k in combinations(range(len(rows)), 2):
        face = frozenset(rows).difference((rows[j], rows[k]))
        ends = [first[i] for i in (j, k) if i in first]
        if len(ends) == 2:
            sectors += [Sector((ends[0] + side, ends[1] + side), face) for side in (0, 1)]
        elif ends and not persistent.intersection((j, k)):
            sectors.append(Sector((ends[0], ends[0] + 1), face))
    return tuple(sectors)
