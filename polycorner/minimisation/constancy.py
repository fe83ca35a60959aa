"""Evidence that an energy is constant along a locus: symmetries, and distances followed."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np

from polycorner.minimisation.germs import DirectedFace, bordered_system
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.polyhedron import Piece
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, Tolerances

RADII = (0.1, 1.0, 10.0, 100.0)  # of random points, in scale units
POINTS = 16  # at each radius
FEWEST = 8  # finite gradients of a function from which a symmetry is read
LAST = 128.0  # distance followed, in scale units
BENT = 0.05  # error of linear prediction, relative to the step, beyond which none is followed
CONSTANT = DEFAULT.rounding / 5  # relative change of the energy that counts as rounding
STEPS = 8  # of Newton's method
SMALLER = 16  # steps in place of one that may have been a jump


@lru_cache(maxsize=256)
def symmetric_directions(problem: Problem, rows: tuple[int, ...]) -> Array:
    """Return an orthonormal basis ``(n, t)`` of the directions in which nothing ever changes.

    The derivatives of the energy and of the functions in ``rows`` along them vanish identically:
    an analytic function that vanishes at random points vanishes with probability one.  Columns are
    compared each with its own size, so that a slow change is not taken for none.
    """
    return orthonormal(_combinations(_sampled(problem, rows)[1]))


@lru_cache(maxsize=256)
def _turning(problem: Problem, rows: tuple[int, ...]) -> Array:
    """Return the combinations of :func:`_fields` along which nothing ever changes."""
    points, gradients = _sampled(problem, rows)
    slopes = np.einsum("kmn,knf->kmf", gradients, _fields(problem, points))
    return _combinations(slopes)


def symmetric_tangents(problem: Problem, rows: tuple[int, ...], q: Array) -> Array:
    """Return an orthonormal basis ``(n, t)`` at ``q`` of motions along which nothing ever changes.

    They are :func:`symmetric_directions`, and motions of spheres and rotations beside them.
    """
    if not problem.polyhedron.manifold.factors:
        return symmetric_directions(problem, rows)
    return orthonormal(_fields(problem, q[None])[0] @ _turning(problem, rows))


def _fields(problem: Problem, points: Array) -> Array:
    """Return translations of lines and circles, and turns of spheres and rotations, ``(k, n, f)``.

    The turns are those in the planes of two coordinates: all isometries of the sphere, for
    quaternions the products with others from the left and from the right.
    """
    manifold = problem.polyhedron.manifold
    straight, turns = set(range(problem.dimension)), list[tuple[int, int]]()
    for factor in manifold.factors:
        places = range(factor.at.start, factor.at.stop)
        straight -= set(places)
        turns += combinations(places, 2)
    found = np.zeros((len(points), problem.dimension, len(straight) + len(turns)))
    found[:, sorted(straight), np.arange(len(straight))] = 1.0
    for f, (i, j) in enumerate(turns, len(straight)):
        found[:, i, f], found[:, j, f] = -points[:, j], points[:, i]
    return found


def _sampled(problem: Problem, rows: tuple[int, ...]) -> tuple[Array, Array]:
    """Return random points, and gradients of the energy and of functions there."""
    n, chosen = problem.dimension, [*rows, -1]
    generator = np.random.default_rng(0)
    directions = generator.normal(size=(len(RADII), POINTS, n))
    points = (np.array(RADII)[:, None, None] * directions).reshape(-1, n) * problem.scales
    points = problem.polyhedron.manifold.onto(points)
    with np.errstate(all="ignore"):
        return points, problem.evaluate(points, 1)[1][:, chosen]


def _combinations(slopes: Array) -> Array:
    """Return the combinations of columns ``(n, t)`` along which all slopes ``(k, m, n)`` vanish."""
    n, finite = slopes.shape[2], np.isfinite(slopes).all(axis=2)
    if (finite.sum(axis=0) < FEWEST).any():
        return np.empty((n, 0))
    found = slopes[finite]
    largest = abs(found).max(axis=1)
    found = found[largest > 0] / largest[largest > 0, None]
    sizes = abs(found).max(axis=0, initial=0.0)
    moving = sizes > 1e-150  # the square of a smaller size would underflow
    basis = np.eye(n)[:, ~moving]
    if moving.any():
        scaled = found[:, moving] / sizes[moving]
        _, singular, right = np.linalg.svd(scaled)
        level = int((singular > DEFAULT.rounding * singular[0]).sum())
        others = np.zeros((n, len(right) - level))
        others[moving] = right[level:].T / sizes[moving, None]
        basis = np.hstack([basis, others])
    return basis


def orthonormal(vectors: Array) -> Array:
    """Return an orthonormal basis of the span of columns, those of tiny remainder left out."""
    if not vectors.shape[1]:
        return vectors
    sizes = np.linalg.norm(vectors, axis=0)
    unit = vectors[:, sizes > 0] / sizes[sizes > 0]
    left, singular, _ = np.linalg.svd(unit, full_matrices=False)
    return np.asarray(left[:, singular > 1e-6])


def without(vectors: Array, removed: Array) -> Array:
    """Return an orthonormal basis of the span of columns projected off orthonormal ones."""
    rest = vectors - removed @ (removed.T @ vectors)
    return orthonormal(rest[:, np.linalg.norm(rest, axis=0) > 1e-6])


@dataclass(frozen=True)
class Constancy:
    """How far the energy was found constant along directions, and its largest change there."""

    reach: float
    change: float
    followed: bool

    @property
    def holds(self) -> bool:
        """Whether every direction was followed, and the energy is constant to rounding."""
        return self.followed and self.change <= CONSTANT


def constancy(
    problem: Problem,
    piece: Piece,
    q: Array,
    face: DirectedFace,
    tolerances: Tolerances,
    *,
    one_sided: bool,
    reference: float,
    least: float = 0.0,
) -> Constancy:
    """Follow the directions of a face both ways, by steps that double, until it ends or bends.

    Beyond a fold of the locus other stationary points would be followed.  Followed are the
    ``moving`` directions of the face and generic mixtures of them, one way only if ``one_sided``,
    inside the piece and on all equations.  With a positive ``least`` the first side that ends at a
    shorter distance, or on which the energy changes, is the last.
    """
    c = face.moving.shape[1]
    weights = np.eye(c)
    if c > 1:
        # An energy such as x y is constant along both axes: mixtures that no symmetry prefers see
        # it.
        mixed = np.sqrt([[2.0], [3.0], [5.0]]) ** np.arange(c)
        weights = np.vstack([weights, mixed / np.linalg.norm(mixed, axis=1)[:, None]])
    reach, change, followed = 0.0, 0.0, True
    for w in weights:
        far = 0.0
        for side in [w] if one_sided else [w, -w]:
            distance, moved = _followed(problem, piece, q, face, side, tolerances, reference)
            far, change = max(far, distance), max(change, moved)
            if distance < least or (least and change > CONSTANT):
                return Constancy(distance, change, followed=False)
        followed = followed and far > 0
        reach = far if not reach else min(reach, far)
    return Constancy(reach, change, followed)


def _followed(
    problem: Problem,
    piece: Piece,
    q: Array,
    face: DirectedFace,
    w: Array,
    tolerances: Tolerances,
    reference: float,
) -> tuple[float, float]:
    """Return the distance followed in one direction, and the largest relative change."""
    start = q / problem.scales
    guess = np.concatenate([start, face.multipliers])
    state = _corrected(problem, face, start, np.zeros(len(w)), guess)
    tangent = np.concatenate([face.moving @ w, np.zeros(len(face.multipliers))])
    # Not even at the point itself: multipliers, or the point, are not known well enough.
    if state is None:
        return 0.0, 0.0
    level = float(problem.energy.value(state[: len(q)] * problem.scales))
    size = abs(level) + reference
    reach, change, t = 0.0, 0.0, tolerances.beside
    while t <= LAST:
        step = t - reach
        guess = state + step * tangent
        found = _corrected(problem, face, start, t * w, guess)
        if found is None or abs((found - guess)[: len(q)]).max() > BENT * step:
            break
        values, gradients = problem.evaluate(found[: len(q)] * problem.scales, 1)
        inside = problem.holds(piece, values, gradients, tolerances.zero / 10)
        if not (inside and np.isfinite(values).all()):
            break
        pull = gradients[-1] - found[len(q) :] @ gradients[list(face.rows)]
        slope = abs(face.moving.T @ pull).max()
        # Rounding of coordinates grows with the distance, and with it that of values and slopes.
        moved = max(abs(values[-1] - level) / (1 + t) ** 2, slope / (1 + t))
        if moved > CONSTANT * size:
            there = _in_small_steps(problem, face, start, w, state, reach, t)
            same = tolerances.same * (1 + abs(found).max())
            if there is None or not abs(there - found).max() <= same:
                break  # the long step was a jump elsewhere
        change = max(change, float(moved) / size)
        # A secant of the last step: the next guess is better than along the first tangent.
        tangent = (found - state) / step
        state, reach, t = found, t, 2 * t
    return reach, change


def _in_small_steps(
    problem: Problem,
    face: DirectedFace,
    start: Array,
    w: Array,
    state: Array,
    begin: float,
    end: float,
) -> Array | None:
    """Return where small steps arrive; None where they jump, too."""
    before = here = state
    for t in np.linspace(begin, end, SMALLER + 1)[1:]:
        # Linear continuation; the first step has no other before it, and is not judged.
        guess = 2 * here - before
        there = _corrected(problem, face, start, t * w, guess)
        if there is None or (
            here is not before and abs(there - guess).max() > BENT * abs(there - here).max()
        ):
            return None
        before, here = here, there
    return here


def _corrected(
    problem: Problem, face: DirectedFace, start: Array, w: Array, state: Array
) -> Array | None:
    """Solve the stationarity conditions of the face at given values of its directions."""
    n, rows = len(start), list(face.rows)
    held = np.hstack([face.moving, face.still])
    target = np.concatenate([w, np.zeros(face.still.shape[1])])
    across = null_space(held.T, 1e-9) if held.size else np.eye(n)
    for _ in range(STEPS):
        values, gradients, hessians = problem.evaluate(state[:n] * problem.scales, 2)
        if not np.isfinite(hessians).all():
            return None
        lam, A = state[n:], gradients[rows]
        pull = gradients[-1] - lam @ A
        hessian = hessians[-1] - np.einsum("i,ijk->jk", lam, hessians[rows])
        residual = np.concatenate(
            [held.T @ (state[:n] - start) - target, values[rows], across.T @ pull]
        )
        matrix = bordered_system(hessian, A, held, across)
        step = np.linalg.lstsq(matrix, residual, rcond=1e-12)[0]
        state = state - step
        if abs(step[:n]).max() <= 1e-12 * (1 + abs(state[:n]).max()):
            return np.asarray(state)
    return np.asarray(state) if abs(step[:n]).max() <= 1e-9 * (1 + abs(state[:n]).max()) else None
