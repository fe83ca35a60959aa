"""Tables by which compiled code finds numbers and arrays.

Compiled code reads them as :mod:`~polycorner.formulas.records`.
"""

from collections.abc import Iterable, Mapping
from ctypes import addressof, c_char
from struct import Struct
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from polycorner.checks import refuse

NOTHING = c_char * 0  # as long as any array is


class Declared(Protocol):
    """What is declared of a number or an array."""

    @property
    def kind(self) -> Any:
        """The type of the numbers: ``float64``, ``int64`` or ``bool``."""

    @property
    def shape(self) -> str:
        """The lengths of an array; empty for a number."""


class Entry(NamedTuple):
    """A number, or an array whose lengths are words, digits, or ``*`` for any."""

    kind: type[np.float64] | type[np.int64] | type[np.bool_]
    shape: str = ""


class Layout:
    """The layout of a table: for a number its value, for an array its address and its lengths.

    Parameters
    ----------
    declared : mapping
        Entries by name.
    """

    def __init__(self, declared: Mapping[str, Declared]) -> None:
        self.declared = declared
        shapes = [(entry.kind, len(entry.shape.split())) for entry in declared.values()]
        self._entries = [(np.dtype(kind), dimensions) for kind, dimensions in shapes]
        numbers = {np.float64: "d", np.int64: "q"}
        self._struct = Struct(
            "=" + "".join("q" * (1 + n) if n else numbers[kind] for kind, n in shapes)
        )

    @classmethod
    def of(cls, **stated: str) -> "Layout":
        """Return the layout of entries that are stated as type and lengths: ``real m n``."""
        kinds = {"real": np.float64, "whole": np.int64, "flag": np.bool_}
        split = {name: text.partition(" ") for name, text in stated.items()}
        return cls({name: Entry(kinds[kind], shape) for name, (kind, _, shape) in split.items()})

    def table(self, values: Iterable[Any]) -> tuple[bytes, list[NDArray[Any]]]:
        """Return a table, and the arrays in it, which have to be kept as long as it is used.

        Arrays of the declared types in C order are used as they are, others are copied.
        """
        words: list[Any] = []
        arrays: list[NDArray[Any]] = []
        for name, (kind, dimensions), value in zip(
            self.declared, self._entries, values, strict=True
        ):
            if not dimensions:
                words.append(value)
                continue
            array = np.ascontiguousarray(value, dtype=kind)
            if array.ndim != dimensions:
                refuse(name, f"an array of {dimensions} dimensions", array.ndim)
            arrays.append(array)
            words.append(_address(array))
            words += array.shape
        return self._struct.pack(*words), arrays


def _address(array: Any) -> int:
    if array.flags.writeable:  # four times faster than what works for all
        return addressof(NOTHING.from_buffer(array))
    return int(array.ctypes.data)
