"""Points of a face where the gradients of the functions that it holds become dependent.

There curves cross or have cusps, and surfaces have apexes.  The point ``q`` and the relation ``mu``
solve together

    F(q) = 0,   DF(q)' mu = 0,   |mu| = 1,

one equation more than there are unknowns: for most functions no point does.  The method of Gauss
and Newton converges quadratically where two curves cross at an angle, and linearly at cusps and
contacts, where it is extrapolated ([Gov] sec. 4.1).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from polycorner.polyhedra.cones import unit_rows
from polycorner.polyhedra.faces import HeldPoint
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient
from polycorner.spaces.manifold import Array

STEPS = 60
# Distance from the chord of a step, relative to it, of a point on it.
ASIDE = 0.2
# Steps after which they must have halved, and size of a step at which they stop.
PATIENCE = 6
# Functions beside those of a face that may touch it.
NEAREST = 4
# How much less independent gradients must be at a singular point than beside it.
SUNK = 1e-2
# Range of the ratio of two steps in which convergence counts as linear.
LINEAR = (0.2, 0.9)


class SingularPoint(HeldPoint):
    """A point where the gradients of held functions and equations are dependent.

    Their values, and gradients that vanish but for rounding, are exactly zero.
    """

    def __init__(self, quotient: Quotient, q: Array, kept: Sequence[int]) -> None:
        super().__init__(quotient, q, kept)
        held = quotient.held(kept)
        self.values = self.values.copy()
        self.values[held] = 0.0
        sizes = np.linalg.norm(self.gradients, axis=1)
        bends = quotient.bent(q)[2]
        limit = quotient.tolerances.rank
        flat = [i for i in held if not sizes[i] > limit * np.linalg.norm(bends[i])]
        self.gradients = self.gradients.copy()
        self.gradients[flat] = 0.0

    def tangent(self, v: Array) -> Array:
        """Return the direction itself: there is no tangent space."""
        return np.asarray(v)

    def orientation(self, t: Array) -> float:
        """Return zero: held gradients and any direction are dependent."""
        return 0.0 * float(t[0])


def singular_point(
    quotient: Quotient, q: Array, kept: Sequence[int], reach: float
) -> SingularPoint | None:
    """Return the point near ``q`` where the held functions vanish with dependent gradients.

    None if there is none within ``reach`` scale units that is isolated.
    """
    held = quotient.held(kept)
    found = _solved(quotient, q, held, reach) if held else None
    if found is None or not _sinks(quotient, found[0], held):
        return None
    at, way = found
    scales, beside = quotient.scales, quotient.tolerances.beside
    for start in (at + beside * scales * way, at - beside * scales * way):
        other = _solved(quotient, start, held, 2 * beside)
        if other is not None and np.linalg.norm((other[0] - at) / scales) > beside / 10:
            return None  # dependent all along a curve
    return SingularPoint(quotient, at, kept)


def refined(point: EvaluatedPoint, active: frozenset[int], reach: float) -> EvaluatedPoint:
    """Return a corner with dependent gradients to rounding: the point itself if it is not found.

    Where the set folds, functions that vanish to rounding place a point only to its square root.
    """
    if isinstance(point, SingularPoint) or point.vanishing(active):
        return point
    found = _solved(point.quotient, point.q, point.quotient.held(sorted(active)), reach)
    return point if found is None else point.quotient.at(found[0])


def _solved(
    quotient: Quotient, q: Array, held: list[int], reach: float
) -> tuple[Array, Array] | None:
    """Return a solution of the equations, and the unit direction that changes them least."""
    scales, tolerances = quotient.scales, quotient.tolerances
    start = q
    last: Array = np.zeros(len(q))
    mu: Array = np.zeros(0)
    sizes: Array = np.zeros(0)
    limit, still = np.inf, tolerances.rounding / 10
    for k in range(STEPS):
        values, gradients, hessians = (part[held] for part in quotient.bent(q))
        if not (np.isfinite(gradients).all() and np.isfinite(hessians).all()):
            return None
        if not len(mu):
            sizes = np.linalg.norm(gradients, axis=1) + np.linalg.norm(hessians, axis=(1, 2))
            sizes[sizes == 0] = 1.0
            mu = np.linalg.svd(gradients / sizes[:, None])[0][:, -1]
        orbit = unit_rows(quotient.orbit(q))
        matrix, missed = _system(
            values / sizes, gradients / sizes[:, None], hessians / sizes[:, None, None], mu, orbit
        )
        full: Array = -np.asarray(np.linalg.lstsq(matrix, missed, rcond=1e-12)[0], np.float64)
        step, size = full[: len(q)], float(np.linalg.norm(full[: len(q)]))
        m = len(held)
        # A weighted sum is of the order of the square root of rounding where the set has a cusp.
        related = max(abs(missed[m:]).max(), size) < tolerances.dependent
        if abs(missed[:m]).max() < tolerances.rounding and related:
            return q + scales * step, _least(matrix[:, : len(q)], orbit)
        ratio = float(step @ last) / max(float(last @ last), 1e-300)
        linear = LINEAR[0] < ratio < LINEAR[1] and size * np.linalg.norm(last) < 1.01 * step @ last
        last = np.zeros(len(q)) if linear else step
        q = q + scales * step * (1 / (1 - ratio) if linear else 1.0)
        mu = np.asarray(mu + full[len(step) :])
        mu /= np.linalg.norm(mu)
        if np.linalg.norm((q - start) / scales) > reach or not still < size <= limit:
            return None
        if k % PATIENCE == PATIENCE - 1:
            limit = size / 2
    return None


def part_of_way(start: HeldPoint, end: HeldPoint, q: Array) -> float:
    """Return the part of the way from start to end at which ``q`` lies beside the chord."""
    scales = start.quotient.scales
    chord = (end.q - start.q) / scales
    return float((q - start.q) / scales @ chord / (chord @ chord))


def dependent_between(
    start: HeldPoint, end: HeldPoint, found: SingularPoint | None
) -> SingularPoint | None:
    """Return a point if it lies in the polyhedron, and on a step from start to end."""
    most = 1 + start.quotient.tolerances.same
    if found is None or not 0 < part_of_way(start, end, found.q) <= most:
        return None
    scales = start.quotient.scales
    chord, away = ((q - start.q) / scales for q in (end.q, found.q))
    aside = np.linalg.norm(away - part_of_way(start, end, found.q) * chord)
    return found if aside < ASIDE * np.linalg.norm(chord) and found.active() is not None else None


def _system(
    values: Array, gradients: Array, hessians: Array, mu: Array, orbit: Array
) -> tuple[Array, Array]:
    """Return the Jacobian of the equations, across the orbit, and their values."""
    k, n = gradients.shape
    across = np.eye(n) - np.linalg.pinv(orbit) @ orbit if len(orbit) else np.eye(n)
    matrix = np.zeros((k + n + 1, n + k))
    matrix[:k, :n] = gradients @ across
    matrix[k : k + n, :n] = across @ np.einsum("i,ijk->jk", mu, hessians) @ across
    matrix[k : k + n, n:] = across @ gradients.T
    matrix[-1, n:] = mu
    return matrix, np.concatenate([values, across @ gradients.T @ mu, [0.0]])


def _least(matrix: Array, orbit: Array) -> Array:
    """Return the unit vector orthogonal to the orbit that the matrix shortens most."""
    return np.asarray(np.linalg.svd(np.vstack([matrix, orbit]))[2][-1])


def _sinks(quotient: Quotient, q: Array, held: list[int]) -> bool:
    """Whether the gradients are more dependent at a point than beside it, along some axis."""
    beside = quotient.tolerances.beside * np.diag(quotient.scales)
    around = [quotient.at(p).gradients[held] for p in (*(q + beside), *(q - beside))]
    sizes = np.nanmax(np.linalg.norm(around, axis=2), axis=0)
    sizes[sizes == 0] = 1.0

    def independence(rows: Array) -> float:
        units = rows / sizes[:, None]
        return float(np.linalg.svd(units)[1][-1]) if np.isfinite(units).all() else 0.0

    return independence(quotient.at(q).gradients[held]) < SUNK * max(map(independence, around))


def singular_points(point: EvaluatedPoint, active: frozenset[int]) -> Iterator[SingularPoint]:
    """Yield points of the polyhedron near a point of a face where gradients become dependent.

    Those of the functions that vanish on the face, or of these and another of the nearest.
    """
    quotient, near = point.quotient, np.argsort(abs(point.distances[: point.quotient.count]))
    others = [int(j) for j in near if j not in active][:NEAREST]
    for held in (active, *(active | {j} for j in others)):
        found = singular_point(quotient, point.q, sorted(held), quotient.extent)
        there = None if found is None else found.active()
        if found is not None and there is not None and there >= held:
            yield found
