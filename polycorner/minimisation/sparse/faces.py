"""Newton's method for a corner of a polyhedron with thousands of coordinates."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from polycorner.minimisation.sparse.factorisation import factorised, least_squares, refined
from polycorner.spaces.manifold import Array

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
    leaves the neighbourhood, or meets a singular matrix.
    """
    last = np.inf
    values, rows = held(q)
    for _ in range(MOST_STEPS):
        lu = factorised(rows)
        change = None if lu is None else refined(lu, rows, -values)
        if lu is None or change is None or abs(change).max(initial=0.0) > FAR:
            return None
        size = float(abs(change).max(initial=0.0))
        if size >= last and size < 1e-9:
            break  # rounding: the point before is as good
        q, last = q + change, size
        values, rows = held(q)
    lam = least_squares(rows, gradient)
    return None if lam is None else FacePoint(q, lam, last, float(abs(values).max(initial=0.0)))
