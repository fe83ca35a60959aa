"""Grids of parameters: products of named axes, their points numbered in row-major order."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import about, instance, refuse, whole
from polycorner.values import Checked, cached_property

Scalar: TypeAlias = bool | int | float | str
RESERVED = ("status", "message", "seconds", "rng")
MOST_POINTS = 10**8  # whose results, of a few columns, fill a disk and not quite a memory


@dataclass(frozen=True)
class Axis:
    """The values of one parameter.

    Parameters
    ----------
    values : (n,) numbers or texts
        All different, none of them nan; ``inf`` is allowed.
    unit : str, optional
        Their unit; empty if they have none.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Examples
    --------
    >>> Axis([8, 16, 24], "mm")
    Axis(values=(8, 16, 24), unit='mm')
    """

    values: tuple[Scalar, ...]
    unit: str = ""

    def __init__(self, values: Iterable[Scalar] | ArrayLike, unit: str = "") -> None:
        object.__setattr__(self, "values", _scalars(values))
        object.__setattr__(self, "unit", instance("unit", unit, str))


def _scalars(values: Any) -> tuple[Scalar, ...]:
    if not isinstance(values, Iterable) or isinstance(values, str):
        refuse("values", "a list of numbers or of texts", values, TypeError)
    scalars = list(values)
    if not all(isinstance(value, str | Real | np.bool_) for value in scalars):
        refuse("values", "a list of numbers or of texts", values, TypeError)
    array = np.array(scalars)
    if array.ndim != 1 or array.dtype.kind not in "biufU" or not len(array):
        refuse("values", "a list of numbers or of texts", values, TypeError)
    if array.dtype.kind == "U" and not all(isinstance(value, str) for value in scalars):
        refuse("values", "numbers only, or texts only", values, TypeError)
    if array.dtype.kind == "f" and np.isnan(array).any():
        refuse("values", "numbers without nan", values)
    if len(np.unique(array)) < len(array):
        refuse("values", "values that differ from one another", values)
    return tuple(array.tolist())


@dataclass(frozen=True)
class Grid(Checked):
    """The full product of axes; the last axis varies fastest in the numbering of the points.

    Parameters
    ----------
    axes : mapping from str to Axis
    """

    axes: Mapping[str, Axis]

    @staticmethod
    def of(grid: "Mapping[str, Any] | Grid") -> "Grid":
        """Return a grid of axes given as :class:`Axis`, as values, or as ``(values, unit)``."""
        if isinstance(grid, Grid):
            return grid
        if not isinstance(grid, Mapping) or not grid:
            refuse("grid", "a mapping from names to values", grid, TypeError)
        found = Grid({_name(name): _axis(name, given) for name, given in grid.items()})
        if found.size > MOST_POINTS:
            refuse("grid", f"at most {MOST_POINTS:,} points", f"{found.size:,}")
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.axes)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each parameter."""
        return tuple(len(axis.values) for axis in self.axes.values())

    @cached_property
    def size(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    def point(self, number: int) -> dict[str, Scalar]:
        """Return the parameters of a point."""
        index = np.unravel_index(whole("number", number, least=0, most=self.size - 1), self.shape)
        return {
            name: axis.values[int(k)]
            for (name, axis), k in zip(self.axes.items(), index, strict=True)
        }

    def description(self) -> list[dict[str, Any]]:
        """Return names, units and values in the types of JSON."""
        return [
            {"name": name, "unit": axis.unit, "values": list(axis.values)}
            for name, axis in self.axes.items()
        ]


def _name(name: Any) -> str:
    if not isinstance(name, str) or not name.isidentifier() or name in RESERVED:
        refuse("grid", f"names of parameters other than {', '.join(RESERVED)}", name)
    return name


def _axis(name: str, given: Any) -> Axis:
    if isinstance(given, Axis):
        return given
    pair = isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str)
    with about(f"grid: {name}"):
        return Axis(*given) if pair and not isinstance(given[0], str) else Axis(given)
