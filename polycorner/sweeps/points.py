"""Evaluation of single points in a worker: the values, or the reason for a failure."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from polycorner.checks import refuse
from polycorner.spaces.manifold import Array
from polycorner.sweeps.grid import RESERVED
from polycorner.workers import Shared

EXACT = 2**53  # whole numbers up to here are exact as floats
LONGEST = 1000  # characters of a message

Entry: TypeAlias = float | str | Array


@dataclass(frozen=True)
class Column:
    """The description of one result: name, unit, whether it is a text, and its shape."""

    name: str
    unit: str = ""
    text: bool = False
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Outcome:
    """The outcome of one point: its number, the time it took, what the function returned or raised.

    A point that failed has no columns, and as message type and message of the exception.
    """

    number: int
    seconds: float
    columns: tuple[Column, ...] = ()
    values: tuple[Entry, ...] = ()
    message: str = ""


@dataclass(frozen=True)
class Job:
    """The computation at every point; without a seed the function takes no generator."""

    function: Callable[..., Mapping[str, Any]]
    fixed: Mapping[str, Any]
    seed: int | None


def stream(seed: int, number: int) -> np.random.Generator:
    """Return the random generator of a point, independent of all others of the seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))


def evaluate(
    job: Shared, numbers: Sequence[int], points: Sequence[Mapping[str, Any]], budget: float
) -> list[Outcome]:
    """Return the outcomes of the first points, as many as can be started within ``budget`` seconds.

    ``job`` is a :class:`Job`.  At least one point is evaluated.  After Ctrl-C in the worker the
    finished ones are returned.
    """
    found: list[Outcome] = []
    start = time.perf_counter()
    try:
        for number, point in zip(numbers, points, strict=True):
            if found and time.perf_counter() - start > budget:
                break
            found.append(_outcome(job.value, number, point))
    except KeyboardInterrupt:
        if not found:
            raise
    return found


def _outcome(job: Job, number: int, point: Mapping[str, Any]) -> Outcome:
    start = time.perf_counter()
    random = {} if job.seed is None else {"rng": stream(job.seed, number)}
    try:
        returned = job.function(**point, **job.fixed, **random)
        columns, values = _columns(returned, (*point, *RESERVED))
    except (Exception, SystemExit) as error:
        return Outcome(number, time.perf_counter() - start, message=one_line(error))
    return Outcome(number, time.perf_counter() - start, columns, values)


def one_line(error: BaseException) -> str:
    """Return type and message of an exception in one line."""
    words = " ".join(str(error).split())
    return f"{type(error).__name__}: {words}"[:LONGEST] if words else type(error).__name__


def _columns(returned: Any, taken: Sequence[str]) -> tuple[tuple[Column, ...], tuple[Entry, ...]]:
    if not isinstance(returned, Mapping) or not returned:
        refuse("function", "a mapping from names to values as its result", returned, TypeError)
    columns, values = [], []
    for name, given in returned.items():
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            refuse("function", f"names of results other than {', '.join(taken)}", name)
        unit, value = _entry(name, given)
        text = isinstance(value, str)
        columns.append(Column(name, unit, text, () if text else np.shape(value)))
        values.append(value)
    return tuple(columns), tuple(values)


def _entry(name: str, given: Any) -> tuple[str, Entry]:
    """Return unit and value of a result: a number, numbers or a text, alone or with a unit."""
    unit, value = "", given
    if isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str):
        value, unit = given
    if isinstance(value, str):
        return unit, str(value)
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        refuse(name, "a number, an array of numbers or a text", value, TypeError)
    whole = array.dtype.kind in "iu" and array.size
    if whole and max(abs(int(array.min())), abs(int(array.max()))) > EXACT:
        refuse(name, "whole numbers up to 2^53", value)
    numbers = array.astype(np.float64)
    return unit, numbers if numbers.ndim else float(numbers)
