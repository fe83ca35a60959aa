"""Forms of what files hold: what each number may be, checked before it is used.

A form is a function of a place and of what stands there, like the guards of
:mod:`polycorner.checks`: it returns what was read, or raises an error that names the place.

Whoever forges a file can give it a digest that fits; numbers that become an index, a size or a
state are not taken on trust.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.container import read_number

Form = Callable[[str, Any], Any]


def anything(_place: str, value: Any) -> Any:
    """Check nothing: what stands there is checked elsewhere."""
    return value


def made(form: Form, convert: Callable[[Any], Any]) -> Form:
    """Return the form of something of which a value is made."""
    return lambda place, value: convert(form(place, value))


def count(place: str, value: Any) -> int:
    """Check a whole number from 0."""
    return checks.whole(place, value, least=0)


def position(size: int, *, least: int = 0) -> Form:
    """Return the form of a position among so many."""
    return partial(checks.whole, least=least, most=size - 1)


def flag(place: str, value: Any) -> bool:
    """Check a truth value."""
    return checks.instance(place, value, bool)


def text(place: str, value: Any) -> str:
    """Check a text."""
    return checks.instance(place, value, str)


def word(*known: str) -> Form:
    """Return the form of one of some words."""
    return partial(checks.choice, known=known)


def number(**limits: Any) -> Form:
    """Return the form of a number in a range, as :func:`polycorner.container.number` writes it."""

    def check(place: str, value: Any) -> float:
        written = isinstance(value, str | int | float) and not isinstance(value, bool)
        return checks.real(place, read_number(value) if written else value, **limits)

    return check


def optional(form: Form) -> Form:
    """Return the form of something that may be missing."""
    return lambda place, value: None if value is None else form(place, value)


def many(form: Form, *, exactly: int | None = None) -> Form:
    """Return the form of a list."""

    def check(place: str, value: Any) -> list[Any]:
        checks.instance(place, value, list)
        if exactly is not None and len(value) != exactly:
            checks.refuse(place, f"a list of {exactly}", len(value))
        return [form(f"{place}[{k}]", item) for k, item in enumerate(value)]

    return check


def row(*forms: Form) -> Form:
    """Return the form of a list with an entry of each form."""

    def check(place: str, value: Any) -> tuple[Any, ...]:
        parts = zip(forms, many(anything, exactly=len(forms))(place, value), strict=True)
        return tuple(form(f"{place}[{k}]", item) for k, (form, item) in enumerate(parts))

    return check


def entries(required: Mapping[str, Form], maybe: Mapping[str, Form] | None = None) -> Form:
    """Return the form of entries by name; others may be there and do not count."""

    def check(place: str, value: Any) -> dict[str, Any]:
        checks.instance(place or "content", value, dict)
        within, read = f"{place}." if place else "", {}
        for name, form in (*required.items(), *(maybe or {}).items()):
            if name in value:
                read[name] = form(f"{within}{name}", value[name])
            elif name in required:
                checks.refuse(f"{within}{name}", "an entry", None)
        return read

    return check


def mapped(names: Form, form: Form) -> Form:
    """Return the form of a mapping from names."""

    def check(place: str, value: Any) -> dict[Any, Any]:
        return {
            names(f"a name in {place}", name): form(f"{place}.{name}", item)
            for name, item in checks.instance(place, value, dict).items()
        }

    return check


def array(
    place: str,
    value: Any,
    kinds: str,
    shape: tuple[int, ...],
    *,
    least: Any = -np.inf,
    most: Any = np.inf,
) -> Any:
    """Return an array after a check of its type, its shape and the range of its numbers.

    The kinds are letters of NumPy's: ``f`` for real numbers, which have to be finite, ``iu`` for
    whole ones, ``b`` for truth values.  In the shape -1 stands for any length.
    """
    found = np.asarray(value)
    fits = found.ndim == len(shape) and all(
        n in (-1, m) for n, m in zip(shape, found.shape, strict=True)
    )
    if found.dtype.kind not in kinds or not fits:
        expected = f"numbers of kind {kinds} and shape {shape}"
        checks.refuse(place, expected, f"{found.dtype} {found.shape}")
    if found.dtype.kind == "f" and not np.isfinite(found).all():
        checks.refuse(place, "finite numbers", found[~np.isfinite(found)].flat[0].item())
    outside = (found < least) | (found > most)
    if outside.any():
        checks.refuse(place, f"numbers from {least} to {most}", found[outside].flat[0].item())
    return found


# -------------------------------------------------------------------------------- random generators

# What the whole numbers of each bit generator may be at most, by name; lists are arrays of them.
_WORD, _LONG, _WIDE = 2**32 - 1, 2**64 - 1, 2**128 - 1
_HALF = {"has_uint32": 1, "uinteger": _WORD}
_PERMUTED = {"state": {"state": _WIDE, "inc": _WIDE}, **_HALF}
RANDOM: Mapping[str, Mapping[str, Any]] = {
    "MT19937": {"state": {"key": [_WORD] * 624, "pos": 624}},
    "PCG64": _PERMUTED,
    "PCG64DXSM": _PERMUTED,
    "Philox": {
        "state": {"counter": [_LONG] * 4, "key": [_LONG] * 2},
        "buffer": [_LONG] * 4,
        "buffer_pos": 4,
        **_HALF,
    },
    "SFC64": {"state": {"state": [_LONG] * 4}, **_HALF},
}


def generator_entry(rng: np.random.Generator) -> dict[str, Any]:
    """Return the state of a generator as plain values."""
    entry: dict[str, Any] = _listed(rng.bit_generator.state)
    return entry


def read_generator(place: str, state: Any) -> np.random.Generator:
    """Return the generator of :func:`generator_entry`, after a check of all its numbers.

    NumPy takes any: with others it reads and writes beyond its arrays.
    """
    entries({"bit_generator": word(*RANDOM)})(place, state)
    name = state["bit_generator"]
    _stated(RANDOM[name])(place, state)
    bits = getattr(np.random, name)()
    bits.state = _unlisted(state)
    return np.random.Generator(bits)


def _stated(most: Any) -> Form:
    """Return the form of a state whose whole numbers have given bounds."""
    if isinstance(most, Mapping):
        return entries({name: _stated(bound) for name, bound in most.items()})
    if isinstance(most, list):
        return row(*map(_stated, most))
    return partial(checks.whole, least=0, most=most)


def _listed(state: Any) -> Any:
    if isinstance(state, Mapping):
        return {name: _listed(value) for name, value in state.items()}
    return state.tolist() if isinstance(state, np.ndarray | np.generic) else state


def _unlisted(state: Any) -> Any:
    if isinstance(state, dict):
        return {name: _unlisted(value) for name, value in state.items()}
    return np.array(state, dtype=np.uint64) if isinstance(state, list) else state
