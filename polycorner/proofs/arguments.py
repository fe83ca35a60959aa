"""Checks of the arguments of a proof."""

from collections.abc import Mapping
from itertools import product
from math import isfinite
from numbers import Real
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Certificate, Problem
from polycorner.proofs.parameter_boxes import Interval
from polycorner.tolerances import DEFAULT

CHECK_BITS = 128


def check_unchanged(certificate: Certificate, formulas: Formulas) -> None:
    """Raise ValueError for a certificate whose functions have changed since it was made.

    A certificate computes with kernels bound once, a proof with the formulas as they are now.
    """
    problem = certificate.problem
    point = certificate.point
    seen, gradients = problem.evaluate(point, 1)
    rows = range(problem.rows)
    with precision(CHECK_BITS):
        now = formulas.values(Box([ball(x) for x in point.tolist()]), rows)
    sizes = 1 + abs(seen) + np.nan_to_num(abs(gradients).max(axis=1), nan=np.inf, posinf=np.inf)
    for name, before, value, size in zip(formulas.names, seen, now, sizes, strict=True):
        if not (isfinite(before) and value.is_finite() and isfinite(size)):
            continue
        if abs(float(value.mid()) - before) > 1e4 * DEFAULT.alike * size + float(value.rad()):
            msg = (
                f"certificate: expected the problem it was made for; {name} was {before:g} at its "
                f"point and is {float(value.mid()):g} now"
            )
            raise ValueError(msg)


def check_parameters(problem: Problem, parameters: Any) -> tuple[dict[str, Interval], list[float]]:
    """Return the box of parameters, and their values in the problem."""
    if parameters is None:
        return {}, []
    if not isinstance(parameters, Mapping) or not parameters:
        checks.refuse("parameters", "a mapping from names to (lower, upper)", parameters, TypeError)
    problem.check_parameters(parameters)
    sides = {name: _side(name, side) for name, side in parameters.items()}
    return sides, [min(problem.parameter_values[name]) for name in sides]


def _side(name: str, side: Any) -> Interval:
    pair = isinstance(side, tuple | list | np.ndarray) and len(side) == 2
    if not pair or not all(isinstance(x, Real) and not isinstance(x, bool) for x in side):
        msg = f"parameters: expected {name} as a pair of numbers (lower, upper); got {side!r}"
        raise TypeError(msg)
    lower, upper = float(side[0]), float(side[1])
    if not (isfinite(lower) and isfinite(upper) and lower < upper):
        msg = f"parameters: expected finite lower < upper for {name}; got ({lower:g}, {upper:g})"
        raise ValueError(msg)
    return lower, upper


def check_domain(formulas: Formulas, sides: Mapping[str, Interval]) -> None:
    """Raise ValueError for a box of parameters with a corner at which a function is undefined."""
    with precision(CHECK_BITS):
        for corner in product(*sides.values()):
            name = formulas.undefined([ball(x) for x in corner])
            if name:
                place = ", ".join(f"{p} = {x:g}" for p, x in zip(sides, corner, strict=True))
                msg = f"parameters: expected values for which {name} is defined; got {place}"
                raise ValueError(msg)
