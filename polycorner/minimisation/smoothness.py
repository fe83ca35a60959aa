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
from polycorner.tolerances import Tolerances

NEARER = 16  # ratio of the distances of far and near points
STEADY = 0.5  # a change that shrinks by less than this between far and near points is a jump
WAYS = 8  # pairs of opposite points


def obstacle(
    problem: Problem,
    q: Array,
    gradients: Array,
    hessians: Array,
    active: Iterable[int],
    tolerances: Tolerances,
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
    tolerances : Tolerances
    """
    rows = [*sorted(active), *range(problem.inequalities, problem.rows)]
    beside = q + _beside(problem, 10 * tolerances.difference)
    for order, derivative in (("first", gradients), ("second", hessians)):
        infinite = ~np.isfinite(derivative.reshape(len(derivative), -1)).all(axis=1)
        for row in np.flatnonzero(infinite).tolist():
            if row in rows or not np.isfinite(problem.evaluate(beside, 0)[0][:, row]).all():
                return f"the {order} derivatives of {problem.functions[row].name} are not finite"
    kinked = [row for row in rows if problem.functions[row].kinks]
    here = gradients, hessians
    return _jump(problem, beside, here, kinked, tolerances.alike) if kinked else ""


def _beside(problem: Problem, reach: float) -> Array:
    """Return steps to points as far as ``reach``, in scale units, and near, on opposite sides."""
    ways = np.cos(np.outer(np.arange(1, WAYS + 1), np.sqrt(np.arange(1, problem.dimension + 1))))
    ways *= reach * problem.scales / np.linalg.norm(ways, axis=1, keepdims=True)
    return np.concatenate([ways, -ways, ways / NEARER, -ways / NEARER])


def _jump(
    problem: Problem, points: Array, here: tuple[Array, Array], rows: list[int], rounding: float
) -> str:
    """Return which derivative of which function jumps across a point."""
    beside = problem.evaluate(points, 2)[1:]
    for order, derivative, there in zip(("first", "second"), here, beside, strict=True):
        changes = abs(there - derivative).reshape(2, 2 * WAYS, *there.shape[1:])
        for row in rows:
            far, near = changes[:, :, row].reshape(2, -1).max(axis=1)
            if not near <= max(STEADY * far, rounding * abs(there[:, row]).max()):
                f = problem.functions[row]
                return f"the {order} derivatives of {f.name} jump ({', '.join(f.kinks)})"
    return ""
