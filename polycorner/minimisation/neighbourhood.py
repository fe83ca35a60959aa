"""What the neighbourhood of a point says of the conditions at it.

*Kinks*.  The conditions assume functions that are twice continuously differentiable at the point.
Formulas with ``Abs``, ``Min``, ``Max`` or ``Piecewise`` need not be: across a kink a derivative
jumps by an amount that does not depend on how near the two sides are, while the change of a
continuous one tends to zero with the distance.

*Inflections*.  Near one of any order the curvature is positive on one side, however small: a search
ends beside it.  Curvatures count that are the same beside the point as at it.

*Contacts*.  Let unit gradients at a point have a singular value ``s``, derivatives bounded by
``K``, and let the functions miss zero by ``m``.  If ``K m < s^2 / 2``, they vanish together at a
distance less than ``s / K``, where that singular value is still positive (the theorem of
Kantorovich, [OR] sec. 12.6).  Otherwise the gradients may be dependent at the corner, however
independent they are beside it: at the distance ``d`` of a simple contact, ``s ~ d`` and
``m ~ d^2 / 2``.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.constancy import without
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.findings import Analysis, Local, steepest_descent
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import Rows
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH, Tolerances

NEARER = 16  # ratio of the distances of far and near points
STEADY = 0.5  # a change that shrinks by less than this between far and near points is a jump
WAYS = 8  # pairs of opposite points
FAINT = 1e-3  # curvature, relative to the largest, up to which one is looked at
FARTHEST = 0.01  # scale units up to which Newton's step says how far a degenerate point may be


# --------------------------------------------------------------- kinks


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
    """
    rows = [*sorted(active), *range(problem.inequalities, problem.rows)]
    kinked = [row for row in rows if problem.functions[row].kinks]
    known = np.isfinite(gradients).all() and np.isfinite(hessians).all()
    if known and not kinked:
        return ""
    # Beyond the rounding of difference quotients, near enough that a smooth derivative changes
    # little.
    beside = q + _beside(problem, 10 * tolerances.difference)
    for order, derivative in (("first", gradients), ("second", hessians)):
        infinite = ~np.isfinite(derivative.reshape(len(derivative), -1)).all(axis=1)
        for row in np.flatnonzero(infinite).tolist():
            if row in rows or not np.isfinite(problem.evaluate(beside, 0)[0][:, row]).all():
                return f"the {order} derivatives of {problem.functions[row].name} are not finite"
    here = gradients, hessians
    return _jump(problem, beside, here, kinked, tolerances.alike) if kinked else ""


def _beside(problem: Problem, reach: float) -> Array:
    """Return steps to points as far as ``reach``, in scale units, and near, on opposite sides."""
    # Directions without symmetry, so that none of them runs along a kink of a simple formula.
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
            # The largest of all: a jump shows on one side of the kink only.
            far, near = changes[:, :, row].reshape(2, -1).max(axis=1)
            if not near <= max(STEADY * far, rounding * abs(there[:, row]).max()):
                f = problem.functions[row]
                return f"the {order} derivatives of {f.name} jump ({', '.join(f.kinks)})"
    return ""


# --------------------------------------------------------------- inflections


def steady(a: Analysis) -> Analysis:
    """Count as flat what bends up here and not as much a little further on.

    Looked at are the direction that bends most and those that bend much less, but not so little
    that all of them are flat.
    """
    curvature, nearly = a.curvature, NEARLY_FLAT * a.small_curvature
    values, vectors = curvature.values, curvature.vectors
    if not len(values) or values[-1] <= 0:
        return a
    tried = (values > nearly) & (values <= FAINT * values[-1])
    # The stiffest direction: where even that is not steady, no curvature is to be trusted.
    tried[-1] = True
    level = _changes(a, tried)
    if not level.any():
        return a
    flat = without(np.hstack([curvature.flat, vectors[:, level]]), np.zeros((len(vectors), 0)))
    return replace(a, second=replace(curvature, flat=flat))


def is_steady(a: Analysis, *, least: float) -> bool:
    """Whether the largest curvature and those beyond ``least`` are as much a little further on."""
    sizes = abs(a.curvature.values)
    if not sizes.any():
        return True
    tried = (sizes > least) | (sizes == sizes.max())
    return not _changes(a, tried).any()


def _changes(a: Analysis, tried: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask of the directions tried in which the curvature changes beside the point.

    At the distance ``h`` from where curvature and slope vanish together as ``h^(p - 2)`` and
    ``h^(p - 1)``, Newton's step has the length ``h / (p - 1)``.
    """
    values, ways = a.curvature.values[tried], a.curvature.vectors[:, tried].T
    local, gradients = a.local, a.gradients
    numbers = [*a.active, *local.sections]
    with np.errstate(all="ignore"):
        # Of a vanishing gradient the multiplier is 0, and 0 / 0 would spoil all shares.
        sizes = np.maximum(np.sqrt((gradients * gradients).sum(axis=1)), 1e-300)
        shares = a.multipliers.values / sizes
        left = local.slope - shares @ gradients
        newton = abs(ways @ left) / abs(values)
        newton[np.isnan(newton)] = 0.0
        reach = local.tolerances.difference * (1 + abs(local.point / local.problem.scales).max())
        lengths = np.minimum(np.maximum(2 * newton, reach), max(reach, FARTHEST))
        ahead = ways * lengths[:, None]
        points = local.point + np.concatenate([ahead, -ahead]) * local.problem.scales
        hessians = local.problem.evaluate(points, 2)[2][:, [*numbers, -1]]
        both = np.concatenate([ways, ways])
        bends = (both[:, None, None] @ hessians @ both[:, None, :, None])[:, :, 0, 0]
        moved = bends[:, -1] - bends[:, :-1] @ shares
        changed = abs(moved.reshape(2, -1) - values) > 0.5 * abs(values)
    level = np.zeros(len(tried), dtype=np.bool_)
    level[tried] = changed.any(axis=0)
    return level


# --------------------------------------------------------------- contacts


def unresolved(local: Local, numbers: list[int], rows: Rows) -> float:
    """Return a level of singular values that may vanish at the corner, 0 where there are none.

    Half of Kantorovich's bound is used: two functions that bend apart reach the bound itself.
    """
    if rows.rank < 2:
        return 0.0
    sizes = np.linalg.norm(local.gradients[numbers], axis=1)
    miss = float(np.linalg.norm(local.values[numbers] / sizes))
    level = 2.0 * np.sqrt(bend(local, numbers, sizes) * miss)
    return level if rows.singular[rows.rank - 1] <= level else 0.0


def bend(local: Local, numbers: list[int], sizes: Array) -> float:
    """Return a bound of the derivative of unit gradients, of which are given the sizes."""
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
    sizes = np.linalg.norm(local.gradients[numbers], axis=1)
    unit = 1.0 / max(1.0, bend(local, numbers, sizes))
    smaller = problem.with_independent_equations(
        frozenset(a.active), [local.point], local.tolerances
    )
    everything, miss = frozenset(range(smaller.inequalities)), local.tolerances.zero / 10
    for step in unit * np.array(SEARCH.pushes):
        ahead = local.point + step * way * problem.scales
        reached, point = smaller.restore(everything, ahead)
        moved = float(np.linalg.norm((point - ahead) / problem.scales))
        fall = float(local.values[-1] - problem.energy.value(point))
        values, gradients = problem.evaluate(point, 1)
        held = problem.holds(frozenset(), values, gradients, miss)
        # A correction as long as the step may have undone it.
        if not (reached and moved <= step / 4 and held):
            return False
        if step < SEARCH.pushes[0] * unit and not fall >= rate * step / 2:
            return False
    return True
