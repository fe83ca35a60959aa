"""Immutable values: pickled by their content alone, with read-only arrays."""

import functools
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.kinds import check_fields
from polycorner.signatures import Shown

if TYPE_CHECKING:
    from functools import cached_property as cached_property  # noqa: PLC0414 - for all to import
else:

    class cached_property(functools.cached_property):  # noqa: N801 - as the one of Python
        """A property that is computed once, and keeps the first value that any thread computes.

        Addresses of what such a value owns are in tables of compiled code: it must not be
        replaced by that of a slower thread, as Python's own does from 3.12 on.  Before, that one
        holds a lock for all instances while it computes, so that threads may wait for each other.
        """

        def __get__(self, instance: Any, owner: Any = None) -> Any:
            """Return the value; later accesses find it among the attributes."""
            if instance is None:
                return self
            return vars(instance).setdefault(self.attrname, self.func(instance))


HOLDERS = (np.ndarray, tuple, dict)  # what arrays are looked for in
PLAIN = frozenset({int, float, bool, str, type(None)})  # tuples of these alone hold no arrays


class Value:
    """Base of immutable values.

    Cached properties are left out of pickles and copies and computed again when they are asked
    for, so a value may cache compiled code and still be sent to another process.  Arrays are
    read-only: those of a dataclass's fields once it is made, and all of them after unpickling.
    A subclass with a ``__post_init__`` of its own calls this one at its end.
    """

    __signature__ = Shown()

    def __post_init__(self) -> None:
        """Make the arrays among the attributes read-only."""
        own = vars(self)
        for name, value in own.items():
            if type(value) not in PLAIN and isinstance(value, HOLDERS):
                own[name] = read_only(value)

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes without what is computed on demand."""
        kind: Any = type(self)  # mypy does not know that classes are hashable
        computed = _computed(kind)
        return {name: value for name, value in vars(self).items() if name not in computed}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Restore the attributes; NumPy forgets in pickles that an array is read-only."""
        for name, value in state.items():
            object.__setattr__(self, name, read_only(value))


class Checked(Value):
    """Base of public dataclasses: their fields are what their annotations say, or they raise."""

    def __post_init__(self) -> None:
        """Raise TypeError for a field of the wrong kind; make the arrays read-only."""
        check_fields(self)
        super().__post_init__()


def read_only(value: Any) -> Any:
    """Return a read-only view of an array; the same for arrays in tuples and mappings.

    Everything else is returned as it is.  The array that is viewed stays writable through
    its other references, so a caller's own array is to be copied first.

    Examples
    --------
    >>> read_only(np.zeros(2)).flags.writeable
    False
    """
    if isinstance(value, np.ndarray):
        if not value.flags.writeable:
            return value
        view = value.view()
        view.flags.writeable = False
        return view
    if type(value) is tuple and not PLAIN.issuperset(map(type, value)):
        parts = tuple(map(read_only, value))
        return parts if any(a is not b for a, b in zip(parts, value, strict=True)) else value
    if type(value) is dict:
        for name, part in value.items():
            value[name] = read_only(part)
    return value


@cache
def _computed(kind: Any) -> frozenset[str]:
    """Return the names of a class's cached properties."""
    return frozenset(
        name
        for base in kind.__mro__
        for name, member in vars(base).items()
        if isinstance(member, cached_property)
    )
