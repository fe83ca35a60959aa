"""Reduction of an energy on a face to a power series in its degenerate directions.

The splitting lemma ([GromollMeyer]; [GS] ch. I, the method of Lyapunov and Schmidt): near a point
where the Lagrangian's Hessian on the face is regular across directions ``B``, the point ``q(w)``
of the face that is stationary among those with ``B^T (q - q_0) = w`` is an analytic function, and
``r(w) = E(q(w))`` has the same type at 0 as the energy on the face: across ``B`` the energy
differs from it by squares.  With series ``q`` and ``lam`` right to degree ``k``, the Lagrangian
``E(q) - lam f(q)`` is right to degree ``2 k + 1``, as it is stationary in both.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.jets import EPSILON, Ring, function_series, ring
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import null_space
from polycorner.spaces.manifold import Array
from polycorner.values import Value

ROUNDING = 1e3  # propagated rounding errors below which a coefficient counts as zero
CLEAR = 1e3 * ROUNDING  # and above which it counts as different from zero
POINT = 4 * EPSILON  # relative rounding of a point's coordinates
MOVE = 0.01  # distance in scale units by which a degenerate point may be missed: searches are slow


@dataclass(frozen=True, eq=False)
class DirectedFace(Value):
    """Functions held on a face, with multipliers, and the directions in which it is followed.

    Attributes
    ----------
    rows : tuple of int
        Rows of the problem's functions; their gradients must be independent.
    multipliers : (p,) array
        ``dE/df`` of each; zero for those that are opened.
    opened : tuple of int
        Positions in ``rows`` of functions that are variables themselves: ``f = s``.
    moving : (n, c) array
        Orthonormal directions, in scaled coordinates, that are the other variables.
    still : (n, t) array
        Orthonormal directions across ``moving`` along which nothing changes.
    """

    rows: tuple[int, ...]
    multipliers: Array
    opened: tuple[int, ...]
    moving: Array
    still: Array

    @property
    def variables(self) -> int:
        """The number of variables: opened functions first, directions after them."""
        return len(self.opened) + int(self.moving.shape[1])


@dataclass(frozen=True, eq=False)
class Germ(Value):
    """The reduced energy ``r(w)``, its rounding errors, and the curve or surface ``q(w)``.

    Attributes
    ----------
    domain : Ring
        The ring of the series.
    coefficients, noise : (K,) array
        Of ``r``, without the constant; ``noise`` bounds rounding errors.
    points : (n, K') array
        Coefficients of ``q(w)`` in scaled coordinates, to a lower degree.
    """

    domain: Ring
    coefficients: Array
    noise: Array
    points: Array

    def point(self, w: Array) -> Array:
        """Return ``q(w)`` in scaled coordinates."""
        exponents = self.domain.exponents[: self.points.shape[1]]
        return np.asarray(self.points @ np.prod(w**exponents, axis=1))


def vague(germ: Germ, coefficients: Array, near: Array) -> NDArray[np.bool_]:
    """Return the mask of the coefficients that may vanish where all variables change a little."""
    sizes = abs(coefficients)
    return np.asarray(sizes <= germ.domain.shifted(sizes, near) - sizes)


def missed(germ: Germ, half: int, near: Array) -> Array:
    """Return ``near``, or more where the slope along a free variable is none for its curvature.

    At the distance ``h`` of a point of order ``p`` they are ``p h^(p-1)`` and ``p (p-1) h^(p-2)``.
    """
    powers, near = germ.domain.exponents, near.copy()
    for i in range(half, germ.domain.variables):
        alone = powers.sum(axis=1) == powers[:, i]
        slope, bend = (abs(germ.coefficients[alone & (powers[:, i] == k)][0]) for k in (1, 2))
        if 0 < slope < MOVE * bend:
            near[i] = max(near[i], germ.domain.order / 2 * slope / bend)
    return near


def reduce_energy(
    problem: Problem, q: Array, hessian: Array, face: DirectedFace, order: int
) -> Germ | None:
    """Return the energy on a face as a series of a degree in its degenerate directions.

    ``hessian`` is that of the Lagrangian at ``q``.  None where the linear system is singular.

    Raises
    ------
    NotAnalyticError
        Where a formula has no power series at the point.
    """
    system = _System.of(problem, q, hessian, face)
    if system is None:
        return None
    # A curve right to half of the degree suffices: its error enters the energy by its square.
    half = ring(face.variables, order // 2)
    curve, multipliers = system.solve(half)
    full = ring(face.variables, order)
    unknowns = _padded(curve, full), _padded(multipliers, full)
    value = system.lagrangian(full, *unknowns)
    value[0, 0] = 0.0
    # The point is rounded: coefficients are those of a point beside it.
    blur = np.full(face.variables, POINT * (1.0 + float(abs(q / problem.scales).max())))
    size = abs(value[0])
    missed = system.errors(half, curve, multipliers)
    if curve[:, 0, 1 + face.variables :].any():
        missed[1:] += EPSILON  # the directions are rounded: so is every coefficient of a bent curve
    lacking = abs(system.step(full, *unknowns))
    # Their product with the terms that the curve lacks has a degree that the energy still has.
    missed = np.concatenate([missed, lacking[:, half.size :].sum(axis=0)])
    noise = EPSILON * value[1] + full.shifted(size, blur) - size
    noise += system.size * full.mul(*[np.stack([missed, 0 * missed])] * 2)[0]
    return Germ(full, value[0], noise, curve[:, 0])


def _padded(series: Array, domain: Ring) -> Array:
    return np.pad(series, ((0, 0), (0, 0), (0, domain.size - series.shape[2])))


def bordered_system(hessian: Array, gradients: Array, held: Array, across: Array) -> Array:
    """Return the matrix of ``(held^T du, A du, across^T (H du - A^T dlam))``."""
    n, p, b = len(hessian), len(gradients), held.shape[1]
    matrix = np.zeros((n + p, n + p))
    matrix[:b, :n] = held.T
    matrix[b : b + p, :n] = gradients
    matrix[b + p :, :n] = across.T @ hessian
    matrix[b + p :, n:] = -across.T @ gradients.T
    return matrix


@dataclass(frozen=True, eq=False)
class _System(Value):
    """The stationarity conditions on a face, linearised at the point."""

    problem: Problem
    q: Array
    face: DirectedFace
    across: Array
    inverse: Array
    size: float

    @classmethod
    def of(cls, problem: Problem, q: Array, hessian: Array, face: DirectedFace) -> "_System | None":
        held = np.hstack([face.moving, face.still])
        across = null_space(held.T, 1e-9) if held.size else np.eye(problem.dimension)
        gradients = problem.evaluate(q, 1)[1][list(face.rows)]
        matrix = bordered_system(hessian, gradients, held, across)
        size = abs(matrix).max(axis=1, initial=0.0)
        # Rows have units of their own, and are compared once they are of one size.
        if not (size > 0).all() or np.linalg.cond(matrix / size[:, None]) > CLEAR**2:
            return None
        inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
        return cls(problem, q, face, across, inverse, float(abs(matrix).max()))

    def solve(self, domain: Ring) -> tuple[Array, Array]:
        """Return the series ``q(w)`` ``(n, 2, K)`` and ``lam(w)`` ``(p, 2, K)``.

        With the inverse of the linear part, every iteration makes one more degree right.
        """
        n = len(self.q)
        unknowns = np.zeros((n + len(self.face.rows), 2, 1))
        unknowns[:n, 0, 0] = self.q / self.problem.scales
        unknowns[n:, 0, 0] = self.face.multipliers
        # Twice more at the end: what rounding left of lower degrees is corrected.
        for degree in [*range(1, domain.order + 1), domain.order, domain.order]:
            known = ring(domain.variables, degree)
            unknowns = _padded(unknowns, known)
            unknowns[:, 0] -= self.step(known, unknowns[:n], unknowns[n:])
        return unknowns[:n], unknowns[n:]

    def step(self, domain: Ring, u: Array, multipliers: Array) -> Array:
        """Return what the linearised conditions subtract from the unknowns."""
        return np.asarray(self.inverse @ self._residual(domain, u, multipliers))

    def _functions(self, domain: Ring, u: Array, *, slopes: bool) -> list[list[Array]]:
        """Return the series of the face's functions, then of the energy."""
        problem, scales = self.problem, self.problem.scales
        everything = (*problem.polyhedron.functions, *problem.polyhedron.equations)
        chosen = [*(everything[row] for row in self.face.rows), problem.energy]
        q = [scale * x for scale, x in zip(scales, u, strict=True)]
        return function_series(chosen, q, domain, slopes=slopes)

    def _targets(self, domain: Ring) -> list[Array]:
        """Return what the face's functions are to be: zero, or variables."""
        opened = {position: i for i, position in enumerate(self.face.opened)}
        return [
            domain.variable(opened[k]) if k in opened else domain.constant(0.0)
            for k in range(len(self.face.rows))
        ]

    def _residual(self, domain: Ring, u: Array, multipliers: Array) -> Array:
        *functions, energy = self._functions(domain, u, slopes=True)
        scales = self.problem.scales[:, None]
        pull = np.array(energy[1:])[:, 0] * scales
        for lam, f in zip(multipliers, functions, strict=True):
            for row, slope in enumerate(f[1:]):
                pull[row] -= scales[row] * domain.mul(lam, slope)[0]
        shift = u[:, 0].copy()
        shift[:, 0] -= self.q / self.problem.scales
        held = np.hstack([self.face.moving, self.face.still]).T @ shift
        for i in range(self.face.moving.shape[1]):
            held[i] -= domain.variable(len(self.face.opened) + i)[0]
        closed = [f[0][0] - s[0] for f, s in zip(functions, self._targets(domain), strict=True)]
        closing = np.array(closed).reshape(len(closed), domain.size)
        return np.vstack([held, closing, self.across.T @ pull])

    def errors(self, domain: Ring, u: Array, multipliers: Array) -> Array:
        """Return bounds ``(K,)`` of the rounding errors of the unknowns, all added.

        As the Lagrangian is stationary in them, they change its value by their square.
        """
        *functions, energy = self._functions(domain, u, slopes=True)
        pull = np.array(energy[1:])[:, 1]
        for lam, f in zip(multipliers, functions, strict=True):
            for row, slope in enumerate(f[1:]):
                product = domain.mul(lam, slope)
                pull[row] += product[1] + abs(product[0])
        held = abs(np.hstack([self.face.moving, self.face.still])).T @ abs(u[:, 0])
        closing = np.array([f[0][1] for f in functions]).reshape(len(functions), domain.size)
        scaled = abs(self.across).T @ (pull * self.problem.scales[:, None])
        parts = abs(self.inverse) @ np.vstack([held, closing, scaled])
        return np.asarray(EPSILON * parts.sum(axis=0))

    def lagrangian(self, domain: Ring, u: Array, multipliers: Array) -> Array:
        """Return the series of ``E - lam (f - s)``."""
        *functions, energy = self._functions(domain, u, slopes=False)
        total = energy[0].copy()
        for lam, f, s in zip(multipliers, functions, self._targets(domain), strict=True):
            gap = f[0] - s
            # The target is exact: the error is that of the function alone.
            gap[1] = f[0][1]
            product = domain.mul(lam, gap)
            total[0] -= product[0]
            total[1] += product[1] + abs(product[0])
        return total
