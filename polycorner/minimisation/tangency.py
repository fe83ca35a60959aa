"""Active functions that nearly touch each other: what a point near their corner tells of it.

Let unit gradients at a point have a singular value ``s``, derivatives bounded by ``K``, and let the
functions miss zero by ``m``.  If ``K m < s^2 / 2``, they vanish together at a distance less than
``s / K``, where that singular value is still positive (the theorem of Kantorovich, [OR] sec.
12.6).  Otherwise the gradients may be dependent at the corner, however independent they are
beside it: at the distance ``d`` of a simple contact, ``s ~ d`` and ``m ~ d^2 / 2``.
"""

import numpy as np

from polycorner.minimisation.evidence import steepest_descent
from polycorner.minimisation.findings import Analysis, Local
from polycorner.polyhedra.cones import Rows

STEPS = (0.1, 0.01, 0.001)  # relative to radii of curvature, at which a way down is sought


def unresolved(local: Local, numbers: list[int], rows: Rows) -> float:
    """Return a level of singular values that may vanish at the corner, 0 where there are none.

    Half of Kantorovich's bound is used: two functions that bend apart reach the bound itself.
    """
    if rows.rank < 2:
        return 0.0
    sizes = np.linalg.norm(local.gradients[numbers], axis=1)
    miss = float(np.linalg.norm(local.values[numbers] / sizes))
    level = 2.0 * np.sqrt(bend(local, numbers) * miss)
    return level if rows.singular[rows.rank - 1] <= level else 0.0


def bend(local: Local, numbers: list[int]) -> float:
    """Return a bound of the derivative of unit gradients."""
    sizes = np.linalg.norm(local.gradients[numbers], axis=1)
    return float(np.linalg.norm(local.hessians[numbers] / sizes[:, None, None]))


def falls_on_set(a: Analysis) -> bool:
    """Whether points of the set itself lie in the steepest direction, lower at its rate when near.

    Dependent gradients do not exclude a way down, as those of two equal equations: the linearised
    cone is then that of the set all the same.
    """
    local, problem = a.local, a.local.problem
    rate, way = steepest_descent(a)
    if rate <= local.small:
        return False
    numbers = [n for i, n in enumerate([*a.active, *local.sections]) if i not in a.blind]
    unit = 1.0 / max(1.0, bend(local, numbers))
    smaller = problem.with_independent_equations(
        frozenset(a.active), [local.point], local.tolerances
    )
    everything, miss = frozenset(range(smaller.inequalities)), local.tolerances.zero / 10
    for step in unit * np.array(STEPS):
        ahead = local.point + step * way * problem.scales
        reached, point = smaller.restore(everything, ahead)
        moved = float(np.linalg.norm((point - ahead) / problem.scales))
        fall = float(local.values[-1] - problem.energy.value(point))
        if not (reached and moved <= step / 4 and problem.equations_hold(point, miss)):
            return False
        if step < STEPS[0] * unit and not fall >= rate * step / 2:
            return False
    return True
