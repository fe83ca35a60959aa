"""Allocation of the records of the engine, with arrays that begin with a cache line."""

from collections.abc import Mapping
from functools import lru_cache
from math import prod
from typing import Any, TypeVar, get_type_hints

import numpy as np

from polycorner.motion.engine.arrays import (
    OWN,
    Declaration,
    EngineState,
    Log,
    Model,
    Work,
    declarations,
)
from polycorner.motion.engine.sizes import Sizes

LINE = 8  # numbers in a cache line, into which whole vectors fit

Record = TypeVar("Record", Model, EngineState, Log)


@lru_cache(maxsize=64)  # of two runs: reading the shapes takes as long as a hundred steps
def extents_of(record: type[Any], sizes: Sizes) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the arrays of a record."""
    return {name: declared.extents(sizes) for name, declared in declarations(record).items()}


def size_of(sizes: Sizes) -> float:
    """Return how many bytes state, workspace and log take, but for the matrix of an island.

    Of that memory is used as islands grow.
    """
    records = [EngineState, Log, *get_type_hints(Work).values()]
    arrays = [extents for record in records for extents in extents_of(record, sizes).values()]
    whole = sum(float(prod(extents)) for extents in arrays)
    return 8.0 * (whole - sizes.M)


def workspace(sizes: Sizes) -> Work:
    """Return a new workspace."""
    return Work(**{name: allocate(part, sizes) for name, part in get_type_hints(Work).items()})


def own_workspace(work: Work, sizes: Sizes) -> Work:
    """Return the workspace of a further thread, which shares all but what is in the making."""
    parts = get_type_hints(Work)
    return work._replace(**{name: allocate(parts[name], sizes) for name in OWN})


def allocate(record: type[Record], sizes: Sizes) -> Record:
    """Return new arrays with their initial values."""
    named: Any = record  # to mypy classes of named tuples cannot be hashed
    extents = extents_of(named, sizes)
    return record(
        **{
            name: initial_array(declared, extents[name])
            for name, declared in declarations(record).items()
        }
    )


def initial_array(declared: Declaration, extents: tuple[int, ...]) -> Any:
    """Return a new array with its initial values; of zeros, memory is used as it is written."""
    count = prod(extents)
    room = np.zeros(count + LINE, dtype=declared.kind)
    first = -room.ctypes.data // room.itemsize % LINE
    array = room[first : first + count].reshape(extents)
    if declared.initial != 0:
        array.fill(declared.initial)
    return array


def filled(record: type[Record], sizes: Sizes, values: Mapping[str, Any]) -> Record:
    """Return a record of given values, brought to their declared types and shapes."""
    arrays: dict[str, Any] = {}
    for name, declared in declarations(record).items():
        array = np.array(values[name], dtype=declared.kind).reshape(declared.extents(sizes))
        arrays[name] = array if declared.shape else array.item()
    return record(**arrays)


def restored(record: type[Record], sizes: Sizes, saved: Mapping[str, Any]) -> Record:
    """Return new arrays with saved ones at their beginning: there may be more room than before."""
    arrays = allocate(record, sizes)
    for name, array in arrays._asdict().items():
        array[: len(saved[name])] = saved[name]
    return arrays
