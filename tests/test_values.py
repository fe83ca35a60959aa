"""Immutable values: content of their pickles, arrays that cannot be written, other processes."""

import copy
import functools
import pickle
import re
import threading
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import FrozenInstanceError, dataclass, fields, is_dataclass
from multiprocessing import get_context

import api_calls
import numpy as np
import pytest

from polycorner.values import Value, cached_property, read_only


@dataclass(frozen=True, eq=False)
class Sample(Value):
    """A value with arrays and something that cannot be pickled, made on demand."""

    rows: np.ndarray
    parts: tuple
    named: dict

    @cached_property
    def live(self):
        return threading.Lock()  # has no pickle


def sample():
    return Sample(np.arange(3.0), (np.zeros(2), "text"), {"a": np.ones(2)})


def arrays(value):
    return [value.rows, value.parts[0], value.named["a"]]


@pytest.mark.parametrize(
    "same", [lambda v: v, lambda v: pickle.loads(pickle.dumps(v)), copy.deepcopy, copy.copy]
)
def test_arrays_cannot_be_written(same):
    value = sample()
    assert value.live is value.live
    other = same(value)
    for array, original in zip(arrays(other), arrays(value), strict=True):
        np.testing.assert_array_equal(array, original)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 7.0
    assert other is value or other.live is not value.live


def test_what_is_computed_on_demand_stays_at_home():
    value = sample()
    assert value.live
    assert "live" not in vars(pickle.loads(pickle.dumps(value)))


def test_the_array_of_a_caller_stays_writable():
    own = np.zeros(2)
    seen = read_only(own)
    own[0] = 1.0
    assert seen[0] == 1.0
    assert read_only(seen) is seen


def test_a_cached_property_keeps_the_value_that_a_thread_finds_first():
    found = []

    class Slow:
        @cached_property
        def made(self):
            if threading.current_thread() is threading.main_thread():
                quick.start()
                quick.join(30)
            return object()

    slow = Slow()
    quick = threading.Thread(target=lambda: found.append(slow.made))
    assert [slow.made, slow.made] == found * 2


# ------------------------------------------------------------------------ those of the public names


def parts(value):
    """Return what a value is made of, by name, or None for a number, a word or a function."""
    if isinstance(value, Mapping):
        return {str(key): part for key, part in value.items()}
    if isinstance(value, tuple | list):
        return dict(enumerate(value))
    if isinstance(value, set | frozenset):
        return dict(enumerate(sorted(value, key=repr)))
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    return value.__getstate__() if isinstance(value, Value) else None


def plain(text):
    return re.sub(r" at 0x\w+", "", str(text))  # addresses differ between processes


def content(value, within=()):
    """Return a value as text, down to the last bits of its numbers."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tolist()}"
    inside = None if id(value) in within else parts(value)
    if inside is None:  # formulas of a closure are written out when they are sent
        return "a function" if callable(value) else plain(repr(value))
    within = (*within, id(value))
    named = (f"{name}: {content(part, within)}" for name, part in inside.items())
    return f"{type(value).__name__}({', '.join(named)})"


def everything(value):
    """Return the content of a value, of what it computes on demand, and what is printed of it."""
    yield plain(value)
    yield content(value)
    for kind in type(value).__mro__:
        for name, found in vars(kind).items():
            if isinstance(found, functools.cached_property) and not name.startswith("_"):
                try:
                    yield f"{name}: {content(getattr(value, name))}"
                except ValueError as error:  # what this value does not have
                    yield f"{name}: {error}"


def returned(value):
    return value, [*everything(value)]


def arrays_of(value, within=()):
    if isinstance(value, np.ndarray):
        yield value
    elif id(value) not in within:
        for name, part in (parts(value) or {}).items():
            if name != "state":  # of a search, for those that resume it
                yield from arrays_of(part, (*within, id(value)))


@pytest.fixture(scope="module")
def spawned():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        yield pool


# A view owns a figure.
@pytest.mark.parametrize("name", sorted(api_calls.VALUES.keys() - {"DrumView"}))
def test_a_value_is_the_same_as_its_copies_and_in_a_spawned_process(name, spawned):
    value = api_calls.VALUES[name]()
    expected = [*everything(value)]
    there, found = spawned.submit(returned, value).result()
    assert found == expected
    for other in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value)), there):
        assert type(other) is type(value)
        assert [*everything(other)] == expected
        for array in arrays_of(other):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
    if is_dataclass(value) and fields(value):
        with pytest.raises(FrozenInstanceError):
            setattr(value, fields(value)[0].name, None)
