"""Arguments of manifolds: numbers, names, units and groups of coordinates."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from polycorner.checks import reals, refuse
from polycorner.spaces.embedding import Array

FEW = 24
_IDENTIFIER = re.compile(r"[^\W\d]\w*")


def scalar(values: Any) -> Any:
    """Return a plain Python number for an array of no dimension, any other array as it is."""
    return values.item() if values.ndim == 0 else values


def finite(array: Array, argument: str) -> Array:
    """Return ``array`` unchanged, refusing NaN and infinities."""
    # For a single point a Python loop is faster than two passes of NumPy.
    few = array.size <= FEW
    if not (all(map(math.isfinite, array.ravel().tolist())) if few else np.isfinite(array).all()):
        msg = f"{argument}: expected finite numbers; got {_first_bad(array)}"
        raise ValueError(msg)
    return array


def _first_bad(array: Array) -> str:
    position = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
    return f"{array[position]} at index {position[0] if len(position) == 1 else position}"


def names_of(names: str | Sequence[str]) -> tuple[str, ...]:
    """Return distinct identifiers, given in one string or a sequence."""
    if not isinstance(names, Iterable):
        refuse("names", "a string or a sequence of strings", names, TypeError)
    parsed = tuple(names.replace(",", " ").split()) if isinstance(names, str) else tuple(names)
    if not parsed:
        msg = "names: expected at least one coordinate name; got none"
        raise ValueError(msg)
    for name in parsed:
        if not isinstance(name, str) or not _IDENTIFIER.fullmatch(name):
            refuse("names", "identifiers", name)
    repeated = [name for name, count in Counter(parsed).items() if count > 1]
    if repeated:
        msg = f"names: expected distinct names; got {', '.join(repeated)} more than once"
        raise ValueError(msg)
    return parsed


def groups_of(argument: str, given: Any) -> tuple[tuple[str, ...], ...]:
    """Return groups of names of coordinates as tuples."""
    kinds = (list, tuple)
    fits = isinstance(given, kinds) and all(isinstance(some, kinds) for some in given)
    groups: tuple[tuple[Any, ...], ...] = tuple(map(tuple, given)) if fits else ()
    if not fits or not all(isinstance(name, str) for some in groups for name in some):
        refuse(argument, "tuples of names of coordinates", given)
    return groups


def units_of(units: Any, periods: Sequence[float]) -> tuple[str, ...]:
    """Return one unit for each coordinate; by default that of the angles of circles."""
    given = tuple("rad" if period == math.tau else "" for period in periods)
    if isinstance(units, tuple) and not units:
        return given
    words = tuple(units) if isinstance(units, Sequence) and not isinstance(units, str) else ()
    if len(words) != len(given) or not all(isinstance(unit, str) for unit in words):
        refuse("units", f"{len(given)} strings, one for each coordinate", units)
    return words


def given(values: Any, default: float, n: int) -> Any:
    """Return what was given, or the default for each of ``n`` coordinates."""
    return (default,) * n if isinstance(values, tuple) and not values else values


def positive(argument: str, values: Any, n: int, *, finite: bool) -> tuple[float, ...]:
    """Return ``n`` positive numbers; infinities may be among them unless ``finite``."""
    array = reals(argument, values)
    if array.shape != (n,):
        refuse(argument, f"{n} numbers, one for each coordinate", values)
    numbers = tuple(array.tolist())
    if not all(v > 0 and (v < math.inf or not finite) for v in numbers):
        kind = "positive finite numbers" if finite else "positive numbers or inf"
        msg = f"{argument}: expected {kind}; got {numbers}"
        raise ValueError(msg)
    return numbers
