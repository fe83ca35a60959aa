"""Velocities of rigid motions ``w + omega x p``, as numbers and as formulas."""

from typing import Any

import numpy as np

from polycorner.bodies.frames import Frame
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT


def spin(omega: Array, d: int) -> Array:
    """Return the matrix of ``p -> omega x p``."""
    if d == 2:
        return np.array([[0.0, -omega[0]], [omega[0], 0.0]])
    x, y, z = omega
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def velocity(p: Array) -> Array:
    """Return the matrix that takes ``(w, omega)`` to ``w + omega x p``."""
    if len(p) == 2:
        return np.column_stack([np.eye(2), [-p[1], p[0]]])
    return np.hstack([np.eye(3), -spin(p, 3)])


def reduced(basis: Array) -> Array:
    """Return a basis in reduced echelon form, so that simple motions come out as such."""
    reduced, row = basis.copy(), 0
    for column in range(basis.shape[1]):
        if row == len(reduced):
            break
        pivot = row + int(np.argmax(abs(reduced[row:, column])))
        if abs(reduced[pivot, column]) <= DEFAULT.alike:
            continue
        reduced[[row, pivot]] = reduced[[pivot, row]]
        reduced[row] /= reduced[row, column]
        others = np.arange(len(reduced)) != row
        reduced[others] -= np.outer(reduced[others, column], reduced[row])
        row += 1
    return np.where(abs(reduced) <= DEFAULT.alike, 0.0, reduced)


def number(x: float) -> Any:
    """Return a number for formulas, exact where it is whole."""
    import sympy

    return sympy.Integer(int(x)) if x == int(x) else sympy.Float(x)


def carried(motion: list[Any], point: Any) -> list[Any]:
    """Return ``w + omega x p`` as formulas."""
    if len(point) == 2:
        (a, b, turn), (x, y) = motion, point
        return [a - turn * y, b + turn * x]
    a, b, c, wx, wy, wz = motion
    x, y, z = point
    return [a + wy * z - wz * y, b + wz * x - wx * z, c + wx * y - wy * x]


def turned(frame: Frame, omega: list[Any], symbols: Any) -> list[Any]:
    """Return the velocities of the coordinates of an orientation, ``omega`` in axes of space."""
    if frame is Frame.TURNED:
        return omega
    if frame is Frame.AXIAL:
        return carried([0, 0, 0, *omega], symbols)
    return _quaternion(omega, symbols, 1) if frame is Frame.ROTATED else []


def turned_within(omega: list[Any], symbols: Any) -> list[Any]:
    """Return the velocity of a quaternion, ``omega`` in axes of the body."""
    return _quaternion(omega, symbols, -1)


def _quaternion(omega: list[Any], symbols: Any, side: int) -> list[Any]:
    """Return ``(0, omega) a / 2`` for side 1, ``a (0, omega) / 2`` for side -1."""
    w, *v = symbols
    across = carried([0, 0, 0, *omega], v)
    real = -sum(o * x for o, x in zip(omega, v, strict=True))
    turning = [w * o + side * c for o, c in zip(omega, across, strict=True)]
    return [part / 2 for part in (real, *turning)]
