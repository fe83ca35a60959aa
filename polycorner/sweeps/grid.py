"""Grids of parameters: the product of named axes, its points numbered row by row."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

Value: TypeAlias = bool | int | float | str
RESERVED = ("status", "message", "seconds", "journal", "rng")


@dataclass(frozen=True)
class Axis:
    """The values of one parameter.

    Parameters
    ----------
    values : (n,) numbers or texts
        All different, none of them nan; ``inf`` is a value.
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

    values: tuple[Value, ...]
    unit: str = ""

    def __init__(self, values: Iterable[Value] | ArrayLike, unit: str = "") -> None:
        object.__setattr__(self, "values", _listed(values))
        if not isinstance(unit, str):
            msg = f"unit: expected a text such as 'mm'; got {unit!r}"
            raise TypeError(msg)
        object.__setattr__(self, "unit", unit)


def _listed(values: Any) -> tuple[Value, ...]:
    listed = list(values) if isinstance(values, Iterable) and not isinstance(values, str) else None
    array = None if listed is None else np.array(listed)
    if array is None or array.ndim != 1 or array.dtype.kind not in "biufU" or not len(array):
        msg = f"values: expected a list of numbers or of texts; got {values!r}"
        raise TypeError(msg)
    if array.dtype.kind == "U" and not all(isinstance(value, str) for value in listed or ()):
        msg = f"values: expected numbers only, or texts only; got {values!r}"
        raise TypeError(msg)
    if array.dtype.kind == "f" and np.isnan(array).any():
        msg = f"values: expected numbers; got nan among {values!r}"
        raise ValueError(msg)
    if len(np.unique(array)) < len(array):
        twice = next(value for value in listed or () if (array == value).sum() > 1)
        msg = f"values: expected values that differ; got {twice!r} twice"
        raise ValueError(msg)
    return tuple(array.tolist())


@dataclass(frozen=True)
class Grid:
    """The full product of axes; point ``k`` is the ``k``-th with the last axis running fastest.

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
            msg = f"grid: expected a mapping from names to values; got {grid!r}"
            raise TypeError(msg)
        return Grid({_name(name): _axis(name, given) for name, given in grid.items()})

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters."""
        return tuple(self.axes)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """How many values each has."""
        return tuple(len(axis.values) for axis in self.axes.values())

    @cached_property
    def size(self) -> int:
        """How many points there are."""
        return math.prod(self.shape)

    def point(self, number: int) -> dict[str, Value]:
        """Return the parameters of a point."""
        places = np.unravel_index(number, self.shape)
        return {
            name: axis.values[int(place)]
            for (name, axis), place in zip(self.axes.items(), places, strict=True)
        }

    def description(self) -> list[dict[str, Any]]:
        """Return names, units and values, as JSON has them."""
        return [
            {"name": name, "unit": axis.unit, "values": list(axis.values)}
            for name, axis in self.axes.items()
        ]


def _name(name: Any) -> str:
    if not isinstance(name, str) or not name.isidentifier() or name in RESERVED:
        msg = f"grid: expected names of parameters, none of {', '.join(RESERVED)}; got {name!r}"
        raise ValueError(msg)
    return name


def _axis(name: str, given: Any) -> Axis:
    if isinstance(given, Axis):
        return given
    pair = isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str)
    try:
        return Axis(*given) if pair and not isinstance(given[0], str) else Axis(given)
    except (TypeError, ValueError) as error:
        msg = f"grid: {name}: {error}"
        raise type(error)(msg) from None


def written(value: Any, argument: str) -> str:
    """Return a value as JSON, the same for the same value."""
    try:
        return json.dumps(value, sort_keys=True, default=_plain)
    except (TypeError, ValueError):
        msg = f"{argument}: expected numbers, texts, lists and mappings of such; got {value!r}"
        raise TypeError(msg) from None


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError
