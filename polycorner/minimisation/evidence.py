"""Decisive directions at a point: steepest feasible descent, implied functions, least curvature."""

import numpy as np

from polycorner.minimisation.conditions import find_curvature
from polycorner.minimisation.findings import Analysis
from polycorner.polyhedra.cones import Rows, unit_rows
from polycorner.spaces.manifold import Array

PASSES = 60  # of Dinkelbach's method, which converges faster than linearly


def steepest_descent(a: Analysis) -> tuple[float, Array]:
    """Return the fastest rate of descent of the energy on the linearised cone, and its direction.

    By Moreau's decomposition, the part of ``dE`` that no admissible combination of active
    gradients balances is minus the direction times the rate.
    """
    from scipy.optimize import nnls

    slope, whole = a.local.gradients[-1], Rows(a.gradients, a.local.tolerances.rank)
    dependent = len(whole.units) > 0 and not whole.independent
    units = (
        whole.truncated(a.local.tolerances.rank * whole.singular[0]) if dependent else whole.units
    )
    units[list(a.blind)] = 0.0
    rows = np.vstack([units, -units[len(a.active) :]])
    rest = slope - (nnls(rows.T, slope)[0] @ rows if len(rows) else 0.0)
    rate = float(np.linalg.norm(rest))
    return rate, -rest / (rate or 1.0)


def implied_functions(a: Analysis) -> list[int]:
    """Return positions of active functions whose gradients lie in the cone of the others."""
    from scipy.optimize import nnls

    units, k = unit_rows(a.gradients), len(a.active)
    implied = 1e-3 * a.local.tolerances.rank
    found = []
    for i in (i for i in range(k) if i not in a.blind):
        rows = np.vstack([np.delete(units, i, axis=0), -units[k:]])
        if len(rows) and nnls(rows.T, units[i])[1] <= implied:
            found.append(i)
    return found


def least_curvature(a: Analysis) -> tuple[float, Array] | None:
    """Return the least value of the Lagrangian's Hessian on the critical cone and its direction.

    None if the cone is the origin.  Shifted by the value found last, the form has a least value of
    the sign of what is missing (Dinkelbach's method): zero exactly where that is the least.
    """
    values, vectors = a.curvature.values, a.curvature.vectors
    if not len(values):
        return None
    if not a.weak:
        return float(values[0]), oriented(vectors[:, 0])
    rows = a.local.gradients[list(a.weak)]
    least = float(values[0])
    for _ in range(PASSES):
        form = (vectors * (values - least)) @ vectors.T
        found = find_curvature(form, vectors, rows, a.small_curvature)
        if not np.isfinite(found.least):
            return None
        least += found.least
        if abs(found.least) <= a.small_curvature:
            break
    rates = np.einsum("ik,ij,jk->k", found.flat, form, found.flat)
    return least, found.flat[:, int(rates.argmin())]


def oriented(direction: Array) -> Array:
    """Return the one of two opposite directions whose largest component is positive."""
    return np.asarray(direction * np.sign(direction[abs(direction).argmax()]))
