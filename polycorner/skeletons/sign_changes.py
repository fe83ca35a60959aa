"""Sign changes and dips of a function along a step."""

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from polycorner.spaces.manifold import Array

Point = TypeVar("Point")


def may_vanish(
    values: tuple[Array, Array], slopes: tuple[Array, Array], reach: Array, h: float
) -> list[int]:
    """Return which functions, with values and slopes at both ends of a step, may vanish in it.

    Those that end negative; and one that falls first and rises then, if the cubic through values
    and slopes comes near zero, or if slopes kept up over the step (``reach``) would let it.
    """
    (f0, f1), (slope0, slope1) = values, slopes
    turns = (slope0 < 0) & (slope1 >= 0)
    near = f0 + f1 < reach
    return [
        int(k)
        for k in np.flatnonzero((f1 < 0) | turns)
        if f1[k] < 0 or near[k] or dips(f0[k], f1[k], slope0[k], slope1[k], h)
    ]


def dips(f0: float, f1: float, slope0: float, slope1: float, h: float) -> bool:
    """Whether the cubic through values and slopes at both ends comes near zero in between.

    It falls first and rises at the end, so that it has one minimum there: where its slope, ``c +
    b t + a t^2`` with ``c < 0 <= a + b + c``, grows through zero.  The root is computed without
    cancellation: for ``b < 0``, where ``a >= -b - c > 0``, by a formula of its own.
    """
    f0, f1, c, last = float(f0), float(f1), float(h * slope0), float(h * slope1)
    if not c < 0:  # it was so small that it vanishes
        return False
    a, b = 3 * (2 * (f0 - f1) + c + last), 6 * (f1 - f0) - 4 * c - 2 * last
    root = math.hypot(b, 2 * math.sqrt(-a * c)) if a >= 0 else math.sqrt(max(b * b - 4 * a * c, 0))
    if b + root == 0:  # slopes so small that their product vanishes: it is constant
        return bool(f0 < 0.25 * min(f0, f1) + 1e-9)
    t = (root - b) / (2 * a) if b < 0 else -2 * c / (b + root)
    lowest = f0 + t * (c + t * (b / 2 + t * a / 3))
    return bool(lowest < 0.25 * min(f0, f1) + 1e-9)


def sign_change(
    value: Callable[[float], tuple[float, Point]],
    far: float = 1.0,
    enough: Callable[[Point, float, float], bool] | None = None,
) -> tuple[float, Point]:
    """Return where a function changes sign on ``[0, far]``, by the Illinois method.

    Where both ends have one sign, as by rounding, it is the end with the smaller value.

    ``enough``, of a point, the value there and the length of the interval that is left, may end
    the search before.
    """
    a, b = 0.0, far
    (fa, start), (fb, at) = value(a), value(b)
    small = 1e-15 * max(abs(fa), abs(fb))
    if abs(fb) <= small:
        return b, at
    # Rounding alone changes the sign of what is constant: nothing is looked for outside.
    if fa != 0 and (fa > 0) == (fb > 0):
        return (a, start) if abs(fa) < abs(fb) else (b, at)
    s, side = far, 0
    for _ in range(80):
        if b - a < 1e-15 or fb == fa:
            break
        s = (a * fb - b * fa) / (fb - fa)
        f, at = value(s)
        if abs(f) <= small:
            break
        if (f > 0) == (fb > 0):
            b, fb = s, f
            fa, side = (fa / 2 if side == 1 else fa), 1
        else:
            a, fa = s, f
            fb, side = (fb / 2 if side == -1 else fb), -1
        if b - a < 1e-14 or (enough is not None and enough(at, f, b - a)):
            break
    return s, at
