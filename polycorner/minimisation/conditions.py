"""First- and second-order optimality conditions at a point of one piece of a polyhedron.

With ``g`` the gradient of the energy and ``a_i`` the gradients of active functions, all in scaled
coordinates, the conditions are those of [NW] ch. 12:

- first order: ``g = sum lam_i a_i + sum mu_j e_j`` with ``lam_i >= 0``;
- second order: ``d^T (H_E - sum lam_i H_i) d > 0`` for every ``d != 0`` of the critical cone
  ``{a_i d = 0 where lam_i > 0, a_i d >= 0 where lam_i = 0, e_j d = 0}``.
"""

from dataclasses import dataclass, replace

import numpy as np

from polycorner.minimisation.copositivity import least_directions
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.polyhedra.cones import Rows, linear_programme, unit_rows
from polycorner.spaces.manifold import Array
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Multipliers(Value):
    """Multipliers of unit gradients, in units of energy per scale unit.

    Attributes
    ----------
    values : (k,) array
        Inequalities first, equations after them.
    lower, upper : (k,) array
        The range of each over the set of all multipliers; equal when they are unique.
    exist : bool
        Whether the conditions of first order hold with these values.
    residual : float
        Largest component of ``g - sum lam_i a_i``.
    unique : bool
        Whether there are no others.
    """

    values: Array
    lower: Array
    upper: Array
    exist: bool
    residual: float
    unique: bool

    def spread(self, positions: list[int], count: int) -> "Multipliers":
        """Return these as multipliers of ``count`` functions, zero for all others."""
        whole = np.zeros((3, count))
        whole[:, positions] = self.values, self.lower, self.upper
        return replace(self, values=whole[0], lower=whole[1], upper=whole[2])


def find_multipliers(
    rows: Rows, k: int, gradient: Array, small: float, most: float, dependent: float
) -> Multipliers:
    """Return multipliers of unit gradients; central ones where they are not unique.

    Parameters
    ----------
    rows : Rows
        Gradients of the active functions, then of the equations.
    k : int
        Number of inequalities among them.
    gradient : (n,) array
        Gradient of the energy.
    small : float
        Residuals and negative multipliers up to this size count as zero.
    most : float
        Largest size accepted for multipliers of dependent gradients: next to a cusp, huge
        multipliers exist only because the gradients are not exactly dependent.
    dependent : float
        Relative range of multipliers up to which they are unique.
    """
    values = rows.weights(gradient) if len(rows.units) else np.empty(0)
    if rows.independent:
        residual = float(abs(gradient - values @ rows.units).max(initial=0))
        exist = residual <= small and bool((values[:k] >= -small).all())
        return Multipliers(values, values, values, exist, residual, unique=True)
    return _central_multipliers(rows, k, gradient, values, small, most, dependent)


def _central_multipliers(
    rows: Rows,
    k: int,
    gradient: Array,
    least: Array,
    small: float,
    most: float,
    dependent: float,
) -> Multipliers:
    """Decide existence for dependent gradients by non-negative least squares; find the ranges."""
    from scipy.optimize import nnls

    units = rows.units
    # Equations have multipliers of either sign: two columns of opposite directions.
    split, distance = nnls(np.vstack([units, -units[k:]]).T, gradient)
    values = split[: len(units)].copy()
    values[k:] -= split[len(units) :]
    residual = float(abs(gradient - values @ units).max())
    if distance > small or abs(values).max() > most:
        return Multipliers(least, least, least, exist=False, residual=residual, unique=True)
    lower, upper, centre = _ranges(rows.relations, k, values)
    if abs(gradient - centre @ units).max() > max(small, residual):
        centre = values  # over so long a way, nearly dependent rows are not dependent
    unique = bool((upper - lower <= dependent * (1 + abs(centre).max())).all())
    return Multipliers(centre, lower, upper, exist=True, residual=residual, unique=unique)


def _ranges(free: Array, k: int, values: Array) -> tuple[Array, Array, Array]:
    """Return the least, the largest and a central choice; ``free`` spans the relations."""
    count = len(values)
    # In units of the largest multiplier, so that the bound of the programmes means `endless`.
    largest = max(1e-300, float(abs(values).max()))
    bound = 1e6
    start = values / largest
    slack = np.maximum(start[:k], 0.0)
    lower, upper, vertices = start.copy(), start.copy(), []
    for i in range(count):
        for side, target in ((1.0, lower), (-1.0, upper)):
            change = linear_programme(side * free[i], -free[:k], slack, bound=bound)
            target[i] = start[i] + free[i] @ change
            # A vertex, where the programme was not stopped by its bound.
            if abs(change).max() < 0.5 * bound:
                vertices.append(start + free @ change)
            elif abs(target[i]) >= 0.1 * bound:
                target[i] = -side * np.inf
    centre = np.mean(vertices, axis=0) if vertices else start
    for some in (lower, upper, centre):
        some[:k] = np.maximum(some[:k], 0.0)  # as inequalities have it, but for rounding
    return lower * largest, upper * largest, centre * largest


@dataclass(frozen=True, eq=False)
class Curvature(Value):
    """The second-order condition on a critical cone.

    Attributes
    ----------
    values : (k,) array
        Eigenvalues of the Lagrangian's Hessian on the tangent space of the strongly active
        functions and equations, ascending.
    vectors : (n, k) array
        Their orthonormal eigenvectors, in scaled coordinates.
    least : float
        Least value found on unit vectors of the critical cone, of the sign of the least one, and
        ``inf`` if the cone is 0; without weak functions, or where the form is positive on the
        whole tangent space, the least there.
    flat : (n, r) array
        Unit directions of the cone in which the form vanishes, or very nearly; all others are sums.
    decided : bool
        False when the cone has too many extreme rays for its form to be decided.
    """

    values: Array
    vectors: Array
    least: float
    flat: Array
    decided: bool


def find_curvature(
    hessian: Array,
    basis: Array,
    weak: Array,
    small: float,
    left: Array | None = None,
    reach: float = 0.0,
) -> Curvature:
    """Minimise the form of ``hessian`` on ``{d in span(basis), weak d >= 0, |d| = 1}``.

    Without weak rows the least value is the least eigenvalue on the null space.  With them the
    sign of the least value is that of the form's copositivity on the cone's extreme rays; see
    :mod:`~polycorner.minimisation.copositivity`.

    Where it is given what is left of the gradient, no curvature is trusted at which Newton's step,
    the one over the other, is longer than ``reach``: at a degenerate point nearby, both vanish.
    """
    form = basis.T @ hessian @ basis
    values, inner = np.linalg.eigh(form)
    vectors = basis @ inner
    if not len(weak):
        level = (values >= -small) & (values <= NEARLY_FLAT * small)
        if left is not None and len(values):
            level |= (values > 0) & (abs(left @ vectors) > reach * values)
        least = float(values[0]) if len(values) else np.inf
        return Curvature(values, vectors, least, vectors[:, level], decided=True)
    # Positive on the whole face: no cone in it needs to be looked at.
    if len(values) and values[0] > NEARLY_FLAT * small:
        return Curvature(values, vectors, float(values[0]), vectors[:, :0], decided=True)
    rows = unit_rows(weak) @ basis
    least, zeros, decided = least_directions(form, rows, small, NEARLY_FLAT * small)
    return Curvature(values, vectors, least, basis @ zeros, decided=decided)
