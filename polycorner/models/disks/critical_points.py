"""Critical points of the least of smooth functions, judged from the definition.

``q`` is critical for ``tau = min_k d_k`` when some convex combination of the gradients of the
functions that are least there vanishes: a stress in equilibrium ([BBK] sec. 3).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.polyhedra.cones import Rows, extreme_rays, linear_programme, null_space
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

# (B, n) points and an order to values (B, m), gradients (B, m, n), Hessians (B, m, n, n).
Functions = Callable[[Array, int], tuple[Array, ...]]

REACH, NEWTON_STEPS, CENTRING_STEPS = 0.1, 12, 60


@dataclass(frozen=True, eq=False)
class CriticalPoint:
    """A critical point of ``tau = min_k d_k``, judged from the definition.

    Attributes
    ----------
    point : (n,) array
        The point.
    value : float
        ``tau`` there.
    active : (a,) array of int
        The functions that are least there.
    stress : (a,) array
        ``lam >= 0`` with ``sum lam_k grad d_k = 0`` and ``sum lam_k = 1``; see :func:`balance`.
    stresses : int
        Number of independent solutions of either sign on the support of ``stress``.
    index, nullity : int
        Number of positive and of zero eigenvalues of ``sum lam_k hess d_k`` on the directions
        that the stressed gradients and the symmetries annihilate.
    degenerate : bool
        Whether an active function carries no stress, or some other stress has more zero
        eigenvalues, so that ``tau`` need not grow along every direction that the index counts.
    """

    point: Array
    value: float
    active: NDArray[np.intp]
    stress: Array
    stresses: int
    index: int
    nullity: int
    degenerate: bool


def solved(
    functions: Functions, point: Array, chosen: NDArray[np.intp], weights: Array
) -> Array | None:
    """Solve ``d_k = tau``, ``sum lam_k grad d_k = 0`` for the chosen functions, near a point.

    None where Newton's method does not converge nearby; see :func:`judged` for the rest.
    """
    m, n = len(chosen), len(point)
    level = functions(point[None], 0)[0][0, chosen].mean()
    x = np.concatenate([point, [level], weights / weights.sum()])
    residual = np.full(1, np.inf)
    for _ in range(NEWTON_STEPS):
        d, g, h = (part[0, chosen] for part in functions(x[None, :n], 2))
        stress = x[n + 1 :]
        residual = np.concatenate([d - x[n], stress @ g, [stress.sum() - 1]])
        if abs(residual).max() < DEFAULT.rounding:
            break
        jacobian = np.zeros((m + n + 1, n + 1 + m))
        jacobian[:m, :n], jacobian[:m, n] = g, -1
        jacobian[m : m + n, :n] = np.einsum("k,kij->ij", stress, h)
        jacobian[m : m + n, n + 1 :] = g.T
        jacobian[-1, n + 1 :] = 1
        # Singular values that vanish at the solution, where functions are more than their rank,
        # are small near it; steps along them would not converge.
        x = x - np.linalg.lstsq(jacobian, residual, rcond=1e-4)[0]
    near = abs(x[:n] - point).max() < REACH
    return x[:n] if near and abs(residual).max() < DEFAULT.held else None


def judged(functions: Functions, point: Array, symmetries: Array) -> CriticalPoint | None:
    """Return the critical point at a point; None where it is not critical.

    Functions within ``1e-9`` of the least are active, and must agree to ``1e-11``; the stress
    must balance to ``1e-9``.

    Parameters
    ----------
    functions : callable
        The ``d_k``.
    point : (n,) array
        The point.
    symmetries : (t, n) array
        Directions along which no ``d_k`` changes.
    """
    values, gradients, hessians = (part[0] for part in functions(point[None], 2))
    value = float(values.min())
    active = np.flatnonzero(values <= value + DEFAULT.level)
    if np.ptp(values[active]) > DEFAULT.held:
        return None
    stress, stresses = balance(gradients[active])
    if not stresses:
        return None
    loaded = stress > 0
    free = null_space(np.vstack([gradients[active[loaded]], symmetries]), DEFAULT.dependent)
    forms = np.einsum("in,kij,jm->knm", free, hessians[active[loaded]], free)
    index = _positive(np.tensordot(stress[loaded], forms, 1))
    fewest = min(
        _positive(np.tensordot(extreme, forms, 1))
        for extreme in extreme_stresses(gradients[active[loaded]])
    )
    degenerate = bool(fewest < index or not loaded.all())
    nullity = free.shape[1] - index
    return CriticalPoint(point, value, active, stress, stresses, index, nullity, degenerate)


def _positive(form: Array) -> int:
    curvature = np.linalg.eigvalsh(form)
    return int((curvature > DEFAULT.dependent * max(1.0, abs(form).max(initial=0.0))).sum())


def balance(gradients: Array) -> tuple[Array, int]:
    """Return the central ``lam >= 0`` with ``sum lam_k grad d_k = 0`` and ``sum lam_k = 1``.

    Central means positive wherever any solution is, and with the largest product there: where
    solutions are many, symmetries of the gradients are symmetries of it.

    Parameters
    ----------
    gradients : (a, n) array
        One in each row, none of them zero.

    Returns
    -------
    stress : (a,) array
        Zeros when there is no solution.
    stresses : int
        Number of independent solutions of either sign on its support; 0 without a solution.
    """
    count = len(gradients)
    stress, one, nothing = np.zeros(count), np.eye(count), np.zeros((count, count))
    # Maximise sum s over 0 <= s <= 1, s <= mu, sum mu_k grad d_k = 0: the optimal s_k is 1 where
    # mu_k can be positive and 0 elsewhere.
    found = linear_programme(
        np.repeat([0.0, -1.0], count),
        np.block([[-one, one], [nothing, one], [nothing, -one]]),
        np.repeat([0.0, 1.0, 0.0], count),
        bound=1e4,
        equations=np.hstack([gradients.T, np.zeros_like(gradients.T)]),
    )
    loaded = found[count:] > 0.5
    if not loaded.any():
        return stress, 0
    rows = gradients[loaded]
    relations = _relations(rows)
    central = _central(relations, found[:count][loaded])
    if central is None or abs(central @ rows).max() > DEFAULT.level:
        return stress, 0
    stress[loaded] = central
    return stress, relations.shape[1]


def extreme_stresses(gradients: Array) -> list[Array]:
    """Return the stresses ``lam >= 0``, ``sum lam_k grad d_k = 0`` that are not sums of others.

    Every stress is a sum of multiples of them; each sums to 1.
    """
    relations = _relations(gradients)
    stresses = [relations @ ray for ray, _ in extreme_rays(relations, DEFAULT.dependent)]
    return [stress / stress.sum() for stress in stresses]


def _relations(gradients: Array) -> Array:
    """Return a basis, as columns, of the weights whose combination of the gradients is zero."""
    sizes = np.linalg.norm(gradients, axis=1)
    return np.asarray(Rows(gradients, DEFAULT.dependent).relations / sizes[:, None])


def _central(relations: Array, start: Array) -> Array | None:
    """Maximise ``sum log lam`` over ``lam = relations w``, ``sum lam = 1``, by Newton's method."""
    weights = np.linalg.lstsq(relations, start)[0]
    stress = relations @ weights
    if not len(weights) or stress.min() <= 0:
        return None
    weights = weights / stress.sum()
    along = null_space(relations.sum(axis=0)[None], DEFAULT.dependent)
    for _ in range(CENTRING_STEPS if along.shape[1] else 0):
        inner = (relations @ along) / (relations @ weights)[:, None]
        step = np.linalg.lstsq(inner, np.ones(len(inner)))[0]
        decrement = float(np.linalg.norm(inner @ step))
        weights = weights + along @ step / (1 + decrement)
        if decrement < 10 * DEFAULT.rounding:
            break
    return np.asarray(relations @ weights)
