"""Newton's method on faces and corners of a polyhedron with thousands of coordinates."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, eye_array

from polycorner.formulas.rows import Indices
from polycorner.minimisation.sparse.factorisation import (
    Saddle,
    factorised,
    least_squares,
    refined,
)
from polycorner.minimisation.sparse.nonlinear import Nonlinear, Point
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

MOST_STEPS = 20
FAR = 0.3  # in scale units: a step this long has left the neighbourhood of the face's point

Evaluate = Callable[[Array], tuple[Array, csr_array]]


@dataclass(frozen=True)
class FacePoint:
    """A stationary point of a face: multipliers ``g = A^T lam``, last step, largest ``|f_i|``."""

    point: Array
    multipliers: Array
    last_step: float
    residual: float


def on_corner(held: Evaluate, gradient: Array, q: Array) -> FacePoint | None:
    """Solve ``f(q) = 0`` for as many functions as coordinates, then ``A^T lam = g``.

    Newton's method converges quadratically at a corner with independent gradients; None where it
    leaves the neighbourhood, meets a singular matrix, or has not settled, as at a multiple root.
    """
    last, short = np.inf, DEFAULT.settled / 10
    values, rows = held(q)
    for _ in range(MOST_STEPS):
        lu = factorised(rows)
        change = None if lu is None else refined(lu, rows, -values)
        if lu is None or change is None or abs(change).max(initial=0.0) > FAR:
            return None
        size = float(abs(change).max(initial=0.0))
        if size >= last and size < short:
            break  # rounding: the point before is as good
        q, last = q + change, size
        values, rows = held(q)
    if last > short:
        return None
    # At a corner multipliers follow from the point, and take no part in Newton's method.
    lam = least_squares(rows, gradient)
    return None if lam is None else FacePoint(q, lam, last, float(abs(values).max(initial=0.0)))


def on_face(
    problem: Nonlinear, held: Indices, u: Array, *, far: float = FAR, near: Array | None = None
) -> FacePoint | None:
    """Solve ``dE = sum lam_i df_i``, ``f_i = 0`` for the held functions by Newton's method.

    From multipliers of least squares, those nearest to ``near`` where there are many, each step
    solves

        ``[[H, A^T], [A, 0]] (d, -lam) = (-g, -f)``

    with the Hessian ``H`` of the Lagrangian; gradients may be dependent, and directions flat.
    Multipliers are those of unit gradients; None where a step is longer than ``far``, or nothing
    is finite.
    """
    last = step = np.inf
    at = problem.at(u)
    lam = multipliers_on(at, held, near)
    for _ in range(MOST_STEPS):
        solved = None if lam is None or not at.is_finite else newton_step(problem, at, held, lam)
        if solved is None or not abs(solved[0]).max(initial=0.0) <= far:
            return None
        change, lam = solved
        step = float(abs(change).max(initial=0.0))
        if (step >= 0.5 * last and step < 1e-9) or step <= 1e-16:
            break  # rounding: the point before is as good
        at, last = problem.at(at.place + change), step
    # Where there are many, near those of Newton's method, as its Hessian belongs to these.
    final = multipliers_on(at, held, lam)
    if final is None or not is_stationary(problem, at, held, final):
        return None
    residual = float(abs(at.distances[held]).max(initial=0.0))
    return FacePoint(at.place, final, step, residual)


def is_stationary(problem: Nonlinear, at: Point, held: Indices, lam: Array) -> bool:
    """Whether the gradient of the energy is that of the held functions, as far as is resolved.

    A step in the null space of a singular system is zero without being Newton's.
    """
    left = abs(at.gradient - at.rows[held].T @ lam).max(initial=0.0)
    small = problem.tolerances.stationary
    return bool(left <= small * _size(at, _lagrangian(problem, at, held, lam)))


def _lagrangian(problem: Nonlinear, at: Point, held: Indices, lam: Array) -> csr_array:
    everywhere = np.zeros(len(at.distances))
    everywhere[held] = lam
    return problem.hessian(at, everywhere)


def _size(at: Point, hessian: csr_array) -> float:
    return max(float(abs(at.gradient).max(initial=0.0)), float(abs(hessian).max())) or 1.0


def newton_step(
    problem: Nonlinear, at: Point, held: Indices, lam: Array
) -> tuple[Array, Array] | None:
    """Return Newton's step on a face, and the multipliers after it."""
    rows = csr_array(at.rows[held])
    hessian = _lagrangian(problem, at, held, lam)
    size = _size(at, hessian)
    n = len(at.gradient)
    # The energy in units of its size, so that one regularisation suits all blocks.
    right = np.concatenate([-at.gradient / size, -at.distances[held]])
    start = np.concatenate([np.zeros(n), -lam / size])
    try:
        found = Saddle(hessian / size, rows).solve(right, start)
    except ValueError:
        return None
    return (found[:n], -found[n:] * size) if np.isfinite(found).all() else None


def multipliers_on(at: Point, held: Indices, near: Array | None = None) -> Array | None:
    """Return multipliers of least squares; where there are many, those nearest to given ones."""
    n = len(at.gradient)
    rows = csr_array(at.rows[held])
    size = float(abs(at.gradient).max(initial=0.0)) or 1.0
    right = np.concatenate([at.gradient / size, np.zeros(len(held))])
    start = np.concatenate([np.zeros(n), np.zeros(len(held)) if near is None else near / size])
    try:
        found = Saddle(eye_array(n), rows).solve(right, start)
    except ValueError:
        return None
    return found[n:] * size if np.isfinite(found).all() else None
