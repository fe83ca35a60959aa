"""Domains of a search: a side for each coordinate, an interval, a whole circle or one value."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.checks import reals
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Value, cached_property

ROUNDING = 10 * DEFAULT.rounding  # of boxes that are carried around circles, in scale units


@dataclass(frozen=True, eq=False)
class Domain(Value):
    """A box of configurations, closed.

    Sides are equal for coordinates that are fixed.  What is shown is shown for each value of the
    parameters, which are given by their positions.
    """

    manifold: Manifold
    lower: Array
    upper: Array
    parameters: tuple[int, ...] = ()

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Positions of the coordinates that are neither fixed nor parameters."""
        places = np.flatnonzero(self.lower < self.upper).tolist()
        return tuple(i for i in places if i not in self.parameters)

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """Positions of the coordinates that are fixed."""
        return tuple(np.flatnonzero(self.lower == self.upper).tolist())

    @cached_property
    def units(self) -> Array:
        """The scales of the free coordinates, 0 for the others, ``(n,)``."""
        units = np.zeros(len(self.lower))
        units[list(self.free)] = self.manifold.scale_array[list(self.free)]
        return units

    @property
    def held(self) -> dict[int, tuple[float, float]]:
        """The sides of the parameters, by position."""
        return {i: (float(self.lower[i]), float(self.upper[i])) for i in self.parameters}

    def misses(self, lower: Array, upper: Array, places: Sequence[int]) -> bool:
        """Whether a box in some coordinates lies outside, circles that are whole apart."""
        at = list(places)
        # A whole circle has no sides, although the box of its coordinates has.
        whole = (self.upper - self.lower >= self.manifold.periods)[at]
        away = (upper < self.lower[at]) | (lower > self.upper[at])
        return bool((away & ~whole).any())

    def is_beyond(self, lower: Array, upper: Array) -> bool:
        """Whether a box lies outside where it is, not carried around circles."""
        return bool(((upper < self.lower) | (lower > self.upper)).any())

    def holds(self, lower: Array, upper: Array, room: float = 0.0) -> bool:
        """Whether a box in all coordinates lies inside, circles that are whole apart.

        Or at most ``room`` beyond a side, in scale units.
        """
        whole, more = self.upper - self.lower >= self.manifold.periods, room * self.units
        return bool(((lower >= self.lower - more) & (upper <= self.upper + more) | whole).all())

    def within(
        self, lower: Array, upper: Array, left: Array, right: Array, places: Sequence[int]
    ) -> NDArray[np.bool_]:
        """Whether a box lies in boxes ``left``, ``right`` ``(..., k)`` in some coordinates.

        It is carried around circles to where it is nearest to them, and widened by what that
        rounds.
        """
        at = list(places)
        periods = np.array(self.manifold.periods)[at]
        circles = np.where(np.isfinite(periods), periods, 1.0)
        apart = 0.5 * (left + right) - 0.5 * (lower + upper)
        # Of the images of a box around a circle only the nearest can lie inside.
        turn = np.where(np.isfinite(periods), np.round(apart / circles) * circles, 0.0)
        slack = ROUNDING * self.manifold.scale_array[at]
        inside = (lower + turn - slack >= left) & (upper + turn + slack <= right)
        return np.asarray(inside.all(axis=-1))

    def apart(self, low: Array, high: Array, left: Array, right: Array) -> bool:
        """Whether two boxes in all coordinates are disjoint, on circles as well."""
        middle = 0.5 * (left + right) - 0.5 * (low + high)
        turn = middle - self.manifold.wrap(middle)
        slack = ROUNDING * self.manifold.scale_array
        return bool(((low + turn > right + slack) | (high + turn < left - slack)).any())

    def sides(self) -> dict[str, tuple[float, float]]:
        """Return the sides by name."""
        pairs = zip(self.lower.tolist(), self.upper.tolist(), strict=True)
        return dict(zip(self.manifold.names, pairs, strict=True))


def domain(manifold: Manifold, box: Any) -> Domain:
    """Return the domain with given sides; whole circles where none is given.

    Parameters
    ----------
    manifold : Manifold
    box : sequence or mapping
        A side for each coordinate, in their order or by name: two numbers, one number for a
        coordinate that is fixed, or None (or no entry) for a whole circle.

    Raises
    ------
    TypeError, ValueError
        For names that are no coordinates, sides that are no increasing pairs of numbers, and lines
        without a side.
    """
    if manifold.factors:
        curved = ", ".join(name for f in manifold.factors for name in f.names)
        checks.refuse("polyhedron", "one on lines and circles", f"unit vectors ({curved})")
    lower, upper = [], []
    sides = _sides(manifold, box)
    for name, period in zip(manifold.names, manifold.periods, strict=True):
        side = sides.get(name)
        if side is not None:
            low, high = _side(name, side)
            if high - low > period:
                checks.refuse(f"box[{name!r}]", f"at most the period {period:g}", (low, high))
        elif math.isfinite(period):
            low, high = _circle(period)
        else:
            checks.refuse("box", f"two finite numbers for {name}, which is a line", side)
        lower.append(low)
        upper.append(high)
    return Domain(manifold, np.array(lower), np.array(upper))


def _sides(manifold: Manifold, box: Any) -> dict[str, Any]:
    if isinstance(box, Mapping):
        checks.names("box", box, manifold.names)
        return dict(box)
    if isinstance(box, str) or not isinstance(box, Sequence | np.ndarray):
        checks.refuse("box", "sides in the order of the coordinates, or by name", box, TypeError)
    if len(box) != manifold.size:
        checks.refuse(
            "box", f"{manifold.size} sides, one for each coordinate of the polyhedron", len(box)
        )
    return dict(zip(manifold.names, box, strict=True))


def _circle(period: float) -> tuple[float, float]:
    """Return the principal interval, rounded outwards: it covers the circle."""
    half = math.nextafter(period / 2, math.inf)
    return -half, half


def _side(name: str, side: Any) -> tuple[float, float]:
    argument = f"box[{name!r}]"
    values = reals(argument, side)
    if values.ndim == 0:
        # A number alone fixes a coordinate: both of its sides.
        values = np.array([values, values])
    if values.shape != (2,) or not np.isfinite(values).all():
        checks.refuse(argument, "a number, or two finite numbers", side)
    low, high = values.tolist()
    if low > high:
        checks.refuse(argument, "a lower and an upper end", side)
    return low, high
