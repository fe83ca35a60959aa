"""Forms of what files hold, and states of random generators, of which no number is trusted."""

import copy
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import forms

KINDS = sorted(forms.RANDOM)


def numbers(entry, place=()):
    """Yield where the whole numbers of a state are."""
    items = entry.items() if isinstance(entry, dict) else enumerate(entry)
    for key, value in items:
        if isinstance(value, dict | list):
            yield from numbers(value, (*place, key))
        elif not isinstance(value, str):
            yield (*place, key)


def state(kind, seed=7):
    rng = np.random.Generator(getattr(np.random, kind)(seed))
    rng.random(3)
    rng.integers(5, dtype=np.uint32)  # half of a word is kept for the next number
    return rng, json.loads(json.dumps(forms.generator_entry(rng)))


@pytest.mark.parametrize("kind", KINDS)
def test_a_generator_goes_on(kind):
    rng, entry = state(kind)
    again = forms.read_generator("random", entry)
    for draw in ("random", "standard_normal"):
        np.testing.assert_array_equal(getattr(again, draw)(999), getattr(rng, draw)(999))


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
def test_a_generator_with_one_impossible_number_is_refused(kind, data):
    entry = state(kind)[1]
    *path, last = data.draw(st.sampled_from(list(numbers(entry))))
    wrong = st.sampled_from([-1, 10**9 * 2**128, 1.5, None, True, "1", [1], 10**400])
    owner = entry = copy.deepcopy(entry)
    for key in path:
        owner = owner[key]
    owner[last] = data.draw(wrong)
    with pytest.raises((TypeError, ValueError), match=r"^random\."):
        forms.read_generator("random", entry)


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("MT19937", lambda s: s["state"].update(pos=625)),
        ("MT19937", lambda s: s["state"].update(pos=10**9)),
        ("MT19937", lambda s: s["state"]["key"].pop()),
        ("Philox", lambda s: s.update(buffer_pos=-1)),
        ("Philox", lambda s: s.update(buffer_pos=5)),
        ("Philox", lambda s: s["buffer"].append(1)),
        ("SFC64", lambda s: s.update(has_uint32=2)),
        ("PCG64", lambda s: s.update(bit_generator="Generator")),
        ("PCG64", lambda s: s.update(bit_generator="Philox")),
        ("PCG64", lambda s: s.pop("state")),
    ],
)
def test_positions_beyond_a_buffer_and_other_lengths_are_refused(kind, change):
    entry = state(kind)[1]
    change(entry)
    with pytest.raises((TypeError, ValueError), match=r"^random\."):
        forms.read_generator("random", entry)


def test_a_form_names_the_place():
    form = forms.entries({"edges": forms.many(forms.row(forms.position(3), forms.number()))})
    form("", {"edges": [[2, 0.5]], "more": None})
    for content, told in (
        (
            {"edges": [[2, 1.0], [3, 1.0]]},
            r"^edges\[1\]\[0\]: expected a whole number >= 0 and <= 2",
        ),
        ({"edges": [[2, "nan"]]}, r"^edges\[0\]\[1\]: expected a finite number"),
        ({"edges": [[2]]}, r"^edges\[0\]: expected a list of 2; got 1"),
        ({}, r"^edges: expected an entry"),
        ([], r"^content: expected a dict"),
    ):
        with pytest.raises((TypeError, ValueError), match=told):
            form("", content)


@pytest.mark.parametrize(
    "array",
    [np.zeros((2, 3)), np.zeros(2, int), np.array([1.0, np.nan]), np.array([1.0, 3.0]), ["a", "b"]],
)
def test_arrays_of_another_type_shape_or_range_are_refused(array):
    forms.array("a", np.array([0.5, 2.0]), "f", (2,), least=0, most=2)
    with pytest.raises(ValueError, match=r"^a: expected "):
        forms.array("a", array, "f", (2,), least=0, most=2)
