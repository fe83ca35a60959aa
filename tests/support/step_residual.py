"""By how much a velocity and impulses fail the inclusion of a step, from its definition."""

from collections.abc import Sequence

import numpy as np
from step_inclusion import StepProblem

from polycorner.motion.convex_sets import ConvexSet
from polycorner.spaces.manifold import Array

NO_LOAD = 1e-100  # a load so small that impulses per load may overflow


def natural_residual(
    problem: StepProblem, velocity: Array, normal: Array, friction: Sequence[Array]
) -> float:
    """Return the largest part by which a step's inclusion fails, relative to the step's speed.

    The parts are the natural maps of the three lines of :mod:`step_inclusion`, as
    square roots of energies:

    .. code-block:: text

        |v - v_free - M^-1 (J' lam + sum_b B_b' p_b)|_M
        |lam_i - max(0, lam_i - (J_i v - bound_i) / w_i)| sqrt(w_i),     w_i = J_i M^-1 J_i'
        |p_b - proj(p_b - (B_b v + d_b) / w_b)| sqrt(w_b),   onto L_b C_b,   w_b = |B_b M^-1 B_b'|

    They vanish together exactly at the solutions ([Acary]).

    Parameters
    ----------
    problem : StepProblem
    velocity : (n,) array
        ``v+``.
    normal : (m,) array
        Impulses of the unilateral contacts.
    friction : sequence of (d,) array
        Impulses of the friction blocks, in order.

    Returns
    -------
    float
        Without unit; 0 for a step in which nothing moves.
    """
    v = np.asarray(velocity, dtype=float)
    total = problem.normals.T @ normal
    for block, p in zip(problem.blocks, friction, strict=True):
        total = total + block.matrix.T @ p
    momentum = problem.mass @ (v - problem.v_free) - total
    parts = [_root(float(momentum @ np.linalg.solve(problem.mass, momentum)))]
    for row, bound, lam in zip(problem.normals, problem.bounds, normal, strict=True):
        w = compliance(problem, row[None])
        parts.append(abs(lam - max(0.0, lam - (row @ v - bound) / w)) * _root(w))
    for block, p in zip(problem.blocks, friction, strict=True):
        w = compliance(problem, block.matrix)
        load = block.load if block.owner < 0 else normal[block.owner]
        aim = p - (block.matrix @ v + block.drift) / w
        parts.append(float(np.linalg.norm(p - nearest(block.shape, load, aim))) * _root(w))
    worst = float(max(parts))
    return worst / speed(problem, v) if worst > 0 else 0.0


def nearest(shape: ConvexSet, load: float, impulse: Array) -> Array:
    """Return the point of ``load C`` nearest to an impulse."""
    if load <= NO_LOAD:
        return np.zeros(len(impulse))
    return np.asarray(load * shape.project(impulse / load))


def compliance(problem: StepProblem, rows: Array) -> float:
    """Return the largest velocity along rows ``(d, n)`` that a unit impulse along them makes.

    Rows that are zero have none, and get 1.
    """
    w = float(np.linalg.norm(rows @ np.linalg.solve(problem.mass, rows.T), 2))
    return w if w > 0 else 1.0


def speed(problem: StepProblem, velocity: Array) -> float:
    """Return the largest speed of a step, as the square root of an energy.

    Of the velocity, of the free velocity, of what this fails a bound by, and of its slips.
    """
    free = problem.v_free
    speeds = [_root(float(v @ problem.mass @ v)) for v in (velocity, free)]
    for row, bound in zip(problem.normals, problem.bounds, strict=True):
        speeds.append(float(bound - row @ free) / _root(compliance(problem, row[None])))
    for block in problem.blocks:
        slip = float(np.linalg.norm(block.matrix @ free + block.drift))
        speeds.append(slip / _root(compliance(problem, block.matrix)))
    return max(speeds)


def _root(value: float) -> float:
    return float(np.sqrt(max(0.0, value)))
