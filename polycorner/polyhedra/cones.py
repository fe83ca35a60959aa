"""Linearised cones of active functions: ranks, null spaces, extreme rays.

Rows are gradients in scaled coordinates; the linearised cone is ``{d : A d >= 0, E d = 0}``.
"""

import numpy as np

from polycorner.errors import SolverError
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT


def unit_rows(matrix: Array) -> Array:
    """Return the rows divided by their lengths; zero rows stay zero."""
    sizes = np.sqrt(np.einsum("ij,ij->i", matrix, matrix))[:, None]
    return matrix / np.where(sizes > 0, sizes, 1.0)


class Rows:
    """Unit rows of a matrix ``(k, n)`` with their singular value decomposition.

    Singular values up to ``tolerance`` times the largest count as zero.

    Attributes
    ----------
    units : (k, n) array
        The rows divided by their lengths.
    singular : (min(k, n),) array
        The singular values, descending.
    rank : int
        Number of singular values above the tolerance.
    """

    def __init__(self, matrix: Array, tolerance: float) -> None:
        self.units = unit_rows(matrix)
        self._left, self.singular, self._right = np.linalg.svd(self.units)
        top = float(self.singular[0]) if self.singular.size else 0.0
        self.rank = int(np.count_nonzero(self.singular > tolerance * top)) if top > 0 else 0

    @property
    def independent(self) -> bool:
        """Whether the rows are linearly independent."""
        return self.rank == len(self.units)

    @property
    def null_space(self) -> Array:
        """Orthonormal basis, as columns ``(n, n - rank)``, of the null space."""
        return np.asarray(self._right[self.rank :].T)

    @property
    def relations(self) -> Array:
        """Orthonormal basis, as columns ``(k, k - rank)``, of the rows' linear relations."""
        return np.asarray(self._left[:, self.rank :])

    def truncated(self, level: float) -> Array:
        """Return the unit rows without the parts with singular values up to a level."""
        r = int((self.singular > level).sum())
        return np.asarray((self._left[:, :r] * self.singular[:r]) @ self._right[:r])

    def opening(self, k: int) -> Array:
        """Return the shortest vector with slope 1 along unit row ``k`` and 0 along the others."""
        r = self.rank
        return np.asarray(self._right[:r].T @ (self._left[k, :r] / self.singular[:r]))

    def weights(self, vector: Array) -> Array:
        """Return the shortest least-squares weights of the unit rows that sum to ``vector``."""
        r = self.rank
        parts = (self._right[:r] @ vector) / self.singular[:r]
        return np.asarray(self._left[:, :r] @ parts)


def rank(matrix: Array, tolerance: float) -> int:
    """Return the rank of the unit rows; see :class:`Rows`."""
    return Rows(matrix, tolerance).rank if matrix.size else 0


def null_space(matrix: Array, tolerance: float) -> Array:
    """Return an orthonormal basis of the vectors that the rows annihilate; see :class:`Rows`."""
    return Rows(matrix, tolerance).null_space if matrix.size else np.eye(matrix.shape[1])


def inward_direction(inequalities: Array, equations: Array) -> tuple[Array, float]:
    """Return the direction ``d``, ``|d_i| <= 1``, that enters the cone fastest, and its rate.

    The rate is ``max min_i a_i d``, at most 1, over unit rows subject to ``E d = 0``: positive
    exactly where the constraint qualification of Mangasarian and Fromovitz holds for the
    inequalities
    ([NW] sec. 12.6).
    """
    a, e = unit_rows(inequalities), unit_rows(equations)
    n = a.shape[1]
    found = linear_programme(
        np.array([0.0] * n + [-1.0]),
        np.hstack([-a, np.ones((len(a), 1))]),
        np.zeros(len(a)),
        bound=1.0,
        equations=np.hstack([e, np.zeros((len(e), 1))]),
    )
    return found[:n], float(found[n])


def linear_programme(
    cost: Array, rows: Array, limits: Array, *, bound: float, equations: Array | None = None
) -> Array:
    """Minimise ``cost.x`` subject to ``rows x <= limits``, ``equations x = 0``, ``|x_i| <= bound``.

    The caller makes sure that the programme is feasible; it is bounded by construction.

    Raises
    ------
    SolverError
        If HiGHS stops without a solution.
    """
    from scipy.optimize import linprog

    some = equations is not None and len(equations) > 0
    result = linprog(
        cost,
        A_ub=rows,
        b_ub=limits,
        A_eq=equations if some else None,
        b_eq=np.zeros(len(equations)) if some and equations is not None else None,
        bounds=[(-bound, bound)] * len(cost),
    )
    if result.x is None:
        msg = f"HiGHS found no solution of a small linear programme: {result.message}"
        raise SolverError(msg)
    return np.asarray(result.x)


def least_distance(rows: Array, least: Array) -> Array | None:
    """Return the shortest ``x`` with ``rows x >= least``; None if nothing satisfies that.

    Read off the residual of a non-negative least-squares problem ([LawsonHanson] ch. 23).
    """
    from scipy.optimize import nnls

    size = abs(least).max(initial=0.0)
    if not size > 0:
        return np.zeros(rows.shape[1])
    goal = np.zeros(rows.shape[1] + 1)
    goal[-1] = 1.0
    system = np.vstack([rows.T, least / size])
    try:
        weights, _ = nnls(system, goal)
    except RuntimeError:  # it did not converge
        return None
    rest = goal - system @ weights
    return np.asarray(-rest[:-1] / rest[-1] * size) if rest[-1] > DEFAULT.rounding else None


def independent_rows(matrix: Array, tolerance: float) -> list[int]:
    """Return positions of independent rows that span all rows, the best conditioned first.

    Gram-Schmidt with pivoting: the remainder of a row must be longer than ``tolerance``.
    """
    left = matrix
    chosen: list[int] = []
    while len(chosen) < min(matrix.shape):
        sizes = np.sqrt(np.einsum("ij,ij->i", left, left))
        best = int(np.argmax(sizes))
        if sizes[best] <= tolerance:
            break
        chosen.append(best)
        axis = left[best] / sizes[best]
        left = left - np.outer(left @ axis, axis)
    return chosen


def extreme_rays(rows: Array, tolerance: float) -> list[tuple[Array, frozenset[int]]]:
    """Return the extreme rays of the pointed cone ``{d : a_i d >= 0}`` and the rows tight on each.

    The double description method: the rays of a simplicial cone made of independent rows are the
    columns of an inverse; every further half-space keeps the rays inside it and adds one ray for
    every pair of adjacent rays that it separates.  Two rays are adjacent when the rows tight
    on both have rank ``n - 2`` ([FP] sec. 2).

    Parameters
    ----------
    rows : (m, n) array
        Normals, of rank ``n``.
    tolerance : float
        Slopes of unit rows along unit rays up to this count as zero.

    Returns
    -------
    list of (unit direction (n,), positions of the tight rows)
    """
    units = unit_rows(rows)
    n = units.shape[1]
    base = independent_rows(units, tolerance)
    rays = list(unit_rows(np.asarray(np.linalg.inv(units[base]).T)))
    seen = list(base)
    for i in (i for i in range(len(units)) if i not in base):
        slopes = [float(units[i] @ d) for d in rays]
        kept = [d for d, slope in zip(rays, slopes, strict=True) if slope >= -tolerance]
        up = [k for k, slope in enumerate(slopes) if slope > tolerance]
        down = [k for k, slope in enumerate(slopes) if slope < -tolerance]
        tight = [frozenset(j for j in seen if abs(units[j] @ d) <= tolerance) for d in rays]
        for p in up:
            for q in down:
                shared = sorted(tight[p] & tight[q])
                if len(shared) >= n - 2 and rank(units[shared], tolerance) == n - 2:
                    d = slopes[p] * rays[q] - slopes[q] * rays[p]
                    kept.append(d / np.linalg.norm(d))
        rays = kept
        seen.append(i)
    return [(d, frozenset(np.flatnonzero(abs(units @ d) <= tolerance).tolist())) for d in rays]
