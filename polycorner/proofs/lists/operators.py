"""Krawczyk's operator, inertia and multipliers, in ball arithmetic."""

from typing import TYPE_CHECKING

import numpy as np

from polycorner.intervals.balls import ball, column, entries, exact, identity, matrix

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball, Matrix

BITS = 128
SLACK = 16  # last binary digits of a multiplier that its enclosure covers at least


def krawczyk(
    residual: "list[Ball]",
    jacobian: "list[list[Ball]]",
    inverse: "Matrix",
    unknowns: "list[Ball]",
    centre: "list[Ball]",
) -> "list[Ball]":
    """Return ``c - Y F(c) + (I - Y J) (Z - c)``."""
    defect = identity(len(unknowns)) - inverse * matrix(jacobian)
    apart = [x - c for x, c in zip(unknowns, centre, strict=True)]
    moved = entries(defect * column(apart) - inverse * column(residual))
    return [c + x for c, x in zip(centre, moved, strict=True)]


def wider(x: "Ball") -> "Ball":
    """Return a ball twice as wide, and by a little more."""
    return x + ball(0, x.rad() + abs(x) * ball(2) ** (SLACK - BITS))


def inertia(rows: "list[list[Ball]]") -> tuple[int, int] | None:
    """Return the numbers of negative and positive eigenvalues of a symmetric matrix of balls."""
    if not rows:  # nothing may move
        return 0, 0
    middle = np.array([[float(x.mid()) for x in row] for row in rows])
    if not np.isfinite(middle).all():
        return None
    unit = np.sqrt(np.maximum(abs(middle).max(axis=1), 1e-300))
    vectors = np.linalg.eigh((middle + middle.T) / 2 / np.outer(unit, unit))[1] / unit[:, None]
    turn = matrix(vectors.tolist())
    form = (turn.transpose() * matrix(rows) * turn).tolist()
    if (turn.det()) == 0 or turn.det().contains(0):
        return None
    negative = positive = 0
    for i, row in enumerate(form):
        radius = sum((abs(x) for j, x in enumerate(row) if j != i), ball(0))
        if row[i] > radius:
            positive += 1
        elif row[i] < -radius:
            negative += 1
        else:
            return None
    return negative, positive


def enclosed_multipliers(slopes: "list[list[Ball]]") -> "list[Ball] | None":
    """Enclose the solutions of ``sum lam_i g_i = dE``; None if the ``g_i`` may be dependent.

    ``slopes`` are the gradients ``g_i``, the energy's last.
    """
    count = len(slopes) - 1
    if not count:
        return []
    middle = np.array([[float(x.mid()) for x in row] for row in slopes[:-1]])
    if not np.isfinite(middle).all():
        return None
    try:
        left = matrix(np.linalg.pinv(middle.T).tolist())
        square = left * matrix(slopes[:-1]).transpose()
        return entries(square.solve(left * column(slopes[-1])))
    except (ZeroDivisionError, np.linalg.LinAlgError):
        return None


def outward(x: "Ball") -> tuple[float, float]:
    """Return doubles below and above a ball."""
    return _double(exact(x.lower()), -np.inf), _double(exact(x.upper()), np.inf)


def _double(value: object, towards: float) -> float:
    from fractions import Fraction

    assert isinstance(value, Fraction)
    near = value.numerator / value.denominator
    off = Fraction(near) > value if towards < 0 else Fraction(near) < value
    return float(np.nextafter(near, towards)) if off else near
