"""Domains of a search: a side for each coordinate, an interval, a whole circle or one value."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.spaces.manifold import Array, Manifold, reals
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Domain(Value):
    """A box of configurations, closed.

    Attributes
    ----------
    manifold : Manifold
    lower, upper : (n,) arrays
        Its sides; equal for coordinates that are fixed.
    """

    manifold: Manifold
    lower: Array
    upper: Array

    @property
    def free(self) -> tuple[int, ...]:
        """Positions of the coordinates that are not fixed."""
        return tuple(np.flatnonzero(self.lower < self.upper).tolist())

    @property
    def fixed(self) -> tuple[int, ...]:
        """Positions of the coordinates that are fixed."""
        return tuple(np.flatnonzero(self.lower == self.upper).tolist())

    @property
    def units(self) -> Array:
        """The scales of the coordinates, 0 for those that are fixed, ``(n,)``."""
        return np.where(self.lower < self.upper, self.manifold.scale_array, 0.0)

    def sides(self) -> dict[str, tuple[float, float]]:
        """Return the sides by name."""
        pairs = zip(self.lower.tolist(), self.upper.tolist(), strict=True)
        return dict(zip(self.manifold.names, pairs, strict=True))


def domain(manifold: Manifold, within: Mapping[str, Any]) -> Domain:
    """Return the domain with given sides; whole circles where none is given.

    Raises
    ------
    TypeError, ValueError
        For names that are no coordinates, sides that are no increasing pairs of numbers, and lines
        without a side.
    """
    given = checks.mapping("within", within)
    checks.names("within", given, manifold.names)
    lower, upper = [], []
    for name, period in zip(manifold.names, manifold.periods, strict=True):
        if name in given:
            low, high = _side(name, given[name])
            if high - low > period:
                checks.refuse(f"within[{name!r}]", f"at most the period {period:g}", (low, high))
        elif math.isfinite(period):
            low, high = _circle(period)
        else:
            checks.refuse("within", f"an interval for {name}, which is a line", sorted(given))
        lower.append(low)
        upper.append(high)
    return Domain(manifold, np.array(lower), np.array(upper))


def _circle(period: float) -> tuple[float, float]:
    """Return the principal interval, rounded outwards: it covers the circle."""
    half = math.nextafter(period / 2, math.inf)
    return -half, half


def _side(name: str, side: Any) -> tuple[float, float]:
    argument = f"within[{name!r}]"
    values = reals(side, argument)
    if values.ndim == 0:
        values = np.array([values, values])
    if values.shape != (2,) or not np.isfinite(values).all():
        checks.refuse(argument, "a number, or two finite numbers", side)
    low, high = values.tolist()
    if low > high:
        checks.refuse(argument, "a lower and an upper end", side)
    return low, high
