"""First- and second-order optimality conditions at a point of one piece of a polyhedron.

With ``g`` the gradient of the energy and ``a_i`` the gradients of active functions, all in scaled
coordinates, the conditions are those of [NW] ch. 12:

- first order: ``g = sum lam_i a_i + sum mu_j e_j`` with ``lam_i >= 0``;
- second order: ``d^T (H_E - sum lam_i H_i) d > 0`` for every ``d != 0`` of the critical cone
  ``{a_i d = 0 where lam_i > 0, a_i d >= 0 where lam_i = 0, e_j d = 0}``.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from polycorner.polyhedra.cones import Rows, linear_programme, null_space, unit_rows
from polycorner.spaces.manifold import Array
from polycorner.values import Value

MAX_WEAK = 10  # weakly active functions up to which the critical cone's faces are enumerated
# A curvature up to this multiple of the tolerance is not trusted, as it is positive beside an
# inflection, too; the direction is then treated as flat.
NEARLY_FLAT = 30.0


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
    """

    values: Array
    lower: Array
    upper: Array
    exist: bool
    residual: float

    @property
    def unique(self) -> bool:
        """Whether the multipliers are unique."""
        return bool((self.upper - self.lower <= 1e-7 * (1 + abs(self.values).max(initial=0))).all())

    def complementary(self, away: Array, small: float) -> bool:
        """Whether every product of a multiplier and its scaled gap is small."""
        if not self.exist:
            return True
        return bool((abs(self.values[: len(away)] * away) <= small).all())


def find_multipliers(rows: Rows, k: int, gradient: Array, small: float, most: float) -> Multipliers:
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
    """
    values = rows.weights(gradient) if len(rows.units) else np.empty(0)
    if rows.independent:
        residual = float(abs(gradient - values @ rows.units).max(initial=0))
        exist = residual <= small and bool((values[:k] >= -small).all())
        return Multipliers(values, values, values, exist, residual)
    return _central_multipliers(rows, k, gradient, values, small, most)


def _central_multipliers(
    rows: Rows, k: int, gradient: Array, least: Array, small: float, most: float
) -> Multipliers:
    """Decide existence for dependent gradients by non-negative least squares; find the ranges."""
    from scipy.optimize import nnls

    units = rows.units
    split, distance = nnls(np.vstack([units, -units[k:]]).T, gradient)
    values = split[: len(units)].copy()
    values[k:] -= split[len(units) :]
    residual = float(abs(gradient - values @ units).max())
    if distance > small or abs(values).max() > most:
        return Multipliers(least, least, least, exist=False, residual=residual)
    lower, upper, centre = _ranges(rows.relations, k, values)
    return Multipliers(centre, lower, upper, exist=True, residual=residual)


def _ranges(free: Array, k: int, values: Array) -> tuple[Array, Array, Array]:
    """Return the least, the largest and a central choice; ``free`` spans the relations."""
    count = len(values)
    largest = max(1e-300, float(abs(values).max()))
    bound = 1e6
    start = values / largest
    slack = np.maximum(start[:k], 0.0)
    lower, upper, vertices = start.copy(), start.copy(), []
    for i in range(count):
        for side, target in ((1.0, lower), (-1.0, upper)):
            change = linear_programme(side * free[i], -free[:k], slack, bound=bound)
            target[i] = start[i] + free[i] @ change
            if abs(change).max() < 0.5 * bound:
                vertices.append(start + free @ change)
            elif abs(target[i]) >= 0.1 * bound:
                target[i] = -side * np.inf
    centre = np.mean(vertices, axis=0) if vertices else start
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
        Least value of the form on unit vectors of the critical cone, ``inf`` if the cone is 0;
        where the form is positive on the whole tangent space, the least there, a lower bound.
    flat : (n, r) array
        Unit directions of the cone in which the form vanishes, or very nearly.
    decided : bool
        False when there are too many weakly active functions to enumerate the cone's faces.
    """

    values: Array
    vectors: Array
    least: float
    flat: Array
    decided: bool


def find_curvature(hessian: Array, basis: Array, weak: Array, small: float) -> Curvature:
    """Minimise the form of ``hessian`` on ``{d in span(basis), weak d >= 0, |d| = 1}``.

    Without weak rows the least value is the least eigenvalue on the null space.  With them the
    minimum lies in the relative interior of some face of the cone and is an eigenvector there,
    so enumerating faces and eigenvectors is exact.
    """
    values, inner = np.linalg.eigh(basis.T @ hessian @ basis)
    vectors = basis @ inner
    if not len(weak) or (len(values) and values[0] > NEARLY_FLAT * small):
        flat = vectors[:, (values >= -small) & (values <= NEARLY_FLAT * small)]
        least = float(values[0]) if len(values) else np.inf
        return Curvature(values, vectors, least, flat, decided=True)
    if len(weak) > MAX_WEAK:
        return Curvature(values, vectors, np.nan, np.empty((len(hessian), 0)), decided=False)
    least, flat = _least_on_cone(hessian, basis, unit_rows(weak), small)
    return Curvature(values, vectors, least, flat, decided=True)


def _least_on_cone(hessian: Array, basis: Array, weak: Array, small: float) -> tuple[float, Array]:
    least = np.inf
    flat: list[Array] = []
    for size in range(len(weak) + 1):
        for chosen in combinations(range(len(weak)), size):
            face = basis @ null_space(weak[list(chosen)] @ basis, 1e-6)
            if not face.shape[1]:
                continue
            values, inner = np.linalg.eigh(face.T @ hessian @ face)
            for value, group in _clusters(values, small):
                direction = _member(face @ inner[:, group], weak)
                if direction is None:
                    continue
                least = min(least, value)
                if -small <= value <= NEARLY_FLAT * small:
                    flat.append(direction)
    return least, np.array(flat).T if flat else np.empty((len(hessian), 0))


def _clusters(values: Array, small: float) -> list[tuple[float, list[int]]]:
    """Group nearly equal eigenvalues, whose eigenvectors are not determined one by one."""
    groups: list[list[int]] = []
    for i, value in enumerate(values):
        if groups and value - values[groups[-1][-1]] <= small:
            groups[-1].append(i)
        else:
            groups.append([i])
    return [(float(values[group[0]]), group) for group in groups]


def _member(vectors: Array, weak: Array) -> Array | None:
    """Return a vector of the span with ``weak d >= 0``, or None if there is only 0."""
    edge = 1e-9
    if vectors.shape[1] == 1:
        column = vectors[:, 0]
        for sign in (1.0, -1.0):
            if (sign * weak @ column >= -edge).all():
                return np.asarray(sign * column)
        return None
    for i in range(vectors.shape[1]):
        for sign in (1.0, -1.0):
            cost = np.zeros(vectors.shape[1])
            cost[i] = -sign
            found = linear_programme(cost, -weak @ vectors, np.zeros(len(weak)), bound=1.0)
            if sign * found[i] > 1e-6:
                direction = vectors @ found
                return np.asarray(direction / np.linalg.norm(direction))
    return None
