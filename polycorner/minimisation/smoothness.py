"""Points at which the optimality conditions do not apply: kinks and infinite derivatives.

The conditions assume functions that are twice continuously differentiable at the point.  Formulas
with ``Abs``, ``Min``, ``Max`` or ``Piecewise`` need not be: across a kink a derivative jumps by an
amount that does not depend on how near the two sides are, while the change of a continuous one
tends to zero with the distance.
"""

from collections.abc import Iterable

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.spaces.manifold import Array

REACH = 1e-5  # distance of the far points compared, in scale units
NEARER = 16  # ratio of the distances of far and near points
STEADY = 0.5  # a change that shrinks by less than this between far and near points is a jump
ROUNDING = 1e-9  # relative size below which a change is rounding
WAYS = 8  # pairs of opposite points


def obstacle(
    problem: Problem, q: Array, gradients: Array, hessians: Array, active: Iterable[int]
) -> str:
    """Return why the conditions do not apply at a point; empty if they do.

    They need the derivatives of the energy, the equations and the active functions.  An infinite
    derivative of another function matters where the function is not defined on all sides: there
    the point lies at the edge of its domain.

    Parameters
    ----------
    problem : Problem
    q : (n,) array
        The point.
    gradients, hessians : arrays
        Derivatives of all rows of the problem there.
    active : iterable of int
        The active functions.
    """
    rows = [*sorted(active), *range(problem.inequalities, problem.rows)]
    for order, derivative in (("first", gradients), ("second", hessians)):
        infinite = ~np.isfinite(derivative.reshape(len(derivative), -1)).all(axis=1)
        for row in np.flatnonzero(infinite).tolist():
            if row in rows or not _is_defined_around(problem, q, row):
                return f"the {order} derivatives of {problem.functions[row].name} are not finite"
    kinked = [row for row in rows if problem.functions[row].kinks]
    return _jump(problem, q, (gradients, hessians), kinked) if kinked else ""


def _is_defined_around(problem: Problem, q: Array, row: int) -> bool:
    return bool(np.isfinite(problem.evaluate(q + _beside(problem), 0)[0][:, row]).all())


def _beside(problem: Problem) -> Array:
    """Return steps to far and near points on opposite sides."""
    ways = np.cos(np.outer(np.arange(1, WAYS + 1), np.sqrt(np.arange(1, problem.dimension + 1))))
    ways *= REACH * problem.scales / np.linalg.norm(ways, axis=1, keepdims=True)
    return np.concatenate([ways, -ways, ways / NEARER, -ways / NEARER])


def _jump(problem: Problem, q: Array, here: tuple[Array, Array], rows: list[int]) -> str:
    """Return which derivative of which function jumps across a point."""
    beside = problem.evaluate(q + _beside(problem), 2)[1:]
    for order, derivative, there in zip(("first", "second"), here, beside, strict=True):
        changes = abs(there - derivative).reshape(2, 2 * WAYS, *there.shape[1:])
        for row in rows:
            far, near = changes[:, :, row].reshape(2, -1).max(axis=1)
            if not near <= max(STEADY * far, ROUNDING * abs(there[:, row]).max()):
                f = problem.functions[row]
                return f"the {order} derivatives of {f.name} jump ({', '.join(f.kinks)})"
    return ""
