"""Immutable values: content of their pickles, and arrays that cannot be written."""

import copy
import pickle
import threading
from dataclasses import dataclass

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
