"""One point after another, wherever the worker is: values, or the sentence that says why not."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from polycorner.spaces.manifold import Array
from polycorner.sweeps.grid import RESERVED

EXACT = 2**53  # up to which every whole number is a float
LONGEST = 1000  # characters of a message

Entry: TypeAlias = float | str | Array


@dataclass(frozen=True)
class Column:
    """What one result looks like: its name, its unit, whether it is a text, and its shape."""

    name: str
    unit: str = ""
    text: bool = False
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a point.

    Attributes
    ----------
    number : int
        Of the point.
    seconds : float
        How long it took.
    columns : tuple of Column
        What was returned; empty if the point failed.
    values : tuple
        The values of the columns.
    message : str
        Type and sentence of the exception; empty if there was none.
    """

    number: int
    seconds: float
    columns: tuple[Column, ...] = ()
    values: tuple[Entry, ...] = ()
    message: str = ""


@dataclass(frozen=True)
class Job:
    """What is computed at every point.

    Attributes
    ----------
    function : callable
    fixed : mapping from str
        Arguments that are the same everywhere.
    seed : int or None
        Of the random streams; None if the function takes none.
    """

    function: Callable[..., Mapping[str, Any]]
    fixed: Mapping[str, Any]
    seed: int | None


def stream(seed: int, number: int) -> np.random.Generator:
    """Return the random generator of a point, independent of all others of the seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))


def evaluate(
    job: Job, numbers: Sequence[int], points: Sequence[Mapping[str, Any]], budget: float
) -> list[Outcome]:
    """Return the outcomes of the first points, as many as can be begun in ``budget`` seconds.

    One at least; of several, those that are finished when Ctrl-C reaches the worker.
    """
    found: list[Outcome] = []
    begun = time.perf_counter()
    try:
        for number, point in zip(numbers, points, strict=True):
            if found and time.perf_counter() - begun > budget:
                break
            found.append(_outcome(job, number, point))
    except KeyboardInterrupt:
        if not found:
            raise
    return found


def _outcome(job: Job, number: int, point: Mapping[str, Any]) -> Outcome:
    begun = time.perf_counter()
    random = {} if job.seed is None else {"rng": stream(job.seed, number)}
    try:
        returned = job.function(**point, **job.fixed, **random)
        columns, values = _columns(returned, (*point, *RESERVED))
    except (Exception, SystemExit) as error:
        return Outcome(number, time.perf_counter() - begun, message=sentence(error))
    return Outcome(number, time.perf_counter() - begun, columns, values)


def sentence(error: BaseException) -> str:
    """Return type and message of an exception in one line."""
    words = " ".join(str(error).split())
    return f"{type(error).__name__}: {words}"[:LONGEST] if words else type(error).__name__


def _columns(returned: Any, taken: Sequence[str]) -> tuple[tuple[Column, ...], tuple[Entry, ...]]:
    if not isinstance(returned, Mapping) or not returned:
        msg = f"function: expected a mapping from names to values; it returned {returned!r}"
        raise TypeError(msg)
    columns, values = [], []
    for name, given in returned.items():
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            msg = f"function: expected names of results, none of {', '.join(taken)}; got {name!r}"
            raise ValueError(msg)
        unit, value = _entry(name, given)
        text = isinstance(value, str)
        columns.append(Column(name, unit, text, () if text else np.shape(value)))
        values.append(value)
    return tuple(columns), tuple(values)


def _entry(name: str, given: Any) -> tuple[str, Entry]:
    """Return unit and value of a result: a number, numbers, a text, or one of them and its unit."""
    unit, value = "", given
    if isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str):
        value, unit = given
    if isinstance(value, str):
        return unit, str(value)
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        msg = f"{name}: expected a number, an array of numbers or a text; got {value!r}"
        raise TypeError(msg)
    if array.dtype.kind in "iu" and array.size and max(abs(int(x)) for x in _ends(array)) > EXACT:
        msg = f"{name}: expected whole numbers up to 2^53; got {value!r}"
        raise ValueError(msg)
    numbers = array.astype(np.float64)
    return unit, numbers if numbers.ndim else float(numbers)


def _ends(array: Any) -> tuple[Any, Any]:
    return array.min(), array.max()
