"""Scales of badly scaled problems, estimated from the data where a descent has stalled.

A descent measures steps in the manifold's scales.  Where these are far from the sizes over which
the functions vary, steps are short and curvatures drown in rounding errors.  A stalled descent goes
on from where it is, in scales that are estimated there, until one converges:

* ``sqrt(max_j |L_jj| / |L_ii|)`` with ``L`` the Hessian of the Lagrangian, which makes the diagonal
  of the scaled Hessian constant ([NW] sec. 2.2); where ``L`` is flat, the magnitude below;
* ``|q_i|``, the magnitude of the coordinate, where it is larger than the manifold's scale.
"""

from collections.abc import Iterator

import numpy as np

from polycorner.minimisation.descent import statuses
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.polyhedron import Piece
from polycorner.printing import number
from polycorner.spaces.manifold import Array

End = tuple[int, int, Array, Array]  # status, iterations, point, multipliers
FLAT = 1e-14  # diagonal entry, relative to the largest, below which a coordinate is flat
UNEVEN = 1e3  # ratio of estimated scales, in the manifold's, for which a flat end is doubted
PATIENCE = 100  # a lower limit on the steps is meant to cut the descent short


def rescaled(problem: Problem, piece: Piece, limit: int, end: End) -> tuple[int, int, Array]:
    """Let a descent go on in estimated scales that stalled, or where it is flat and uneven.

    Returns
    -------
    status, iterations, point
        Of the first descent that converges to a point as low, otherwise those given; iterations
        are those of all.
    """
    status, spent, q, multipliers = end
    if status == statuses.STALLED and spent >= limit and limit < PATIENCE:
        return status, spent, q
    for scales in estimated_scales(problem, q, multipliers):
        even = np.ptp(np.log(scales / problem.scales)) < np.log(UNEVEN)
        if even and status == statuses.UNEVEN:
            break
        ended, more, point, _ = problem.descend(piece, q, limit, scales)
        spent += more
        lower = problem.energy.value(point) <= problem.energy.value(q)
        if lower and ended in (statuses.CONVERGED, statuses.LEVEL, statuses.UNEVEN):
            return ended, spent, point
    return status, spent, q


def estimated_scales(problem: Problem, q: Array, multipliers: Array) -> Iterator[Array]:
    """Yield scales ``(n,)`` at ``q``, where the energy's multipliers by row are given."""
    magnitudes = np.maximum(abs(q), problem.scales)
    bends = problem.evaluate(q, 2)[2].diagonal(axis1=1, axis2=2)
    with np.errstate(all="ignore"):
        sizes = abs(bends[-1] - multipliers @ bends[:-1]) / problem.scales**2
    if np.isfinite(sizes).all() and sizes.max() > 0:
        flat = sizes <= FLAT * sizes.max()
        yield np.where(flat, magnitudes, np.sqrt(sizes.max() / np.where(flat, 1.0, sizes)))
    yield magnitudes


def advice(problem: Problem, q: Array) -> str:
    """Return in words which scales of the manifold the curvatures at a point suggest, if others."""
    scales = next(estimated_scales(problem, q, np.zeros(problem.rows - 1)))
    if not np.isfinite(scales).all() or np.ptp(np.log(scales / problem.scales)) < np.log(UNEVEN):
        return (
            "No other scales of single coordinates suggest themselves; more steps may help "
            "(max_iterations)."
        )
    shown = ", ".join(number(scale, 2) for scale in scales / scales.min() * problem.scales.min())
    return f"A manifold with scales=({shown}) would suit the curvatures there."
