"""Wrong use: every call is refused with the type of exception and the argument in this table."""

import numpy as np
import pytest
import sweep_functions

from polycorner.sweeps import Axis, sweep

GIVEN = {"function": sweep_functions.drawn, "grid": {"a": [1], "b": [2]}}
WRONG = [
    ({"function": 3}, TypeError, "function: expected"),
    ({"grid": [1, 2]}, TypeError, "grid: expected"),
    ({"grid": {}}, TypeError, "grid: expected"),
    ({"grid": {"a": 3, "b": [1]}}, TypeError, "grid: a: values: expected"),
    ({"grid": {"a": "text", "b": [1]}}, TypeError, "grid: a: values: expected"),
    ({"grid": {"a": [], "b": [1]}}, TypeError, "grid: a: values: expected"),
    ({"grid": {"a": [1, 2, 2], "b": [1]}}, ValueError, "grid: a: values: expected"),
    ({"grid": {"a": [1.0, np.nan], "b": [1]}}, ValueError, "grid: a: values: expected"),
    ({"grid": {"a": [1, "x"], "b": [1]}}, TypeError, "grid: a: values: expected"),
    ({"grid": {"status": [1]}}, ValueError, "grid: expected"),
    ({"grid": {"a": [1]}}, ValueError, "grid: expected .*b is missing"),
    ({"grid": {"a": [1], "c": [1]}}, ValueError, "grid: expected .*got c"),
    ({"fixed": {"paus": 1}}, ValueError, r"fixed: expected .*\(did you mean pause\?\)"),
    ({"fixed": {"b": 1}}, ValueError, "fixed: expected .*got b"),
    ({"fixed": {"log": (k for k in "ab")}}, TypeError, "fixed: expected"),
    ({"rng": -1}, ValueError, "rng: expected"),
    ({"rng": 1.5}, TypeError, "rng: expected"),
    ({"function": sweep_functions.mixed, "rng": 1}, ValueError, "rng: expected"),
    ({"executor": 0}, ValueError, "executor: expected"),
    ({"executor": True}, TypeError, "executor: expected"),
    ({"executor": "here"}, TypeError, "executor: expected"),
    ({"store": __file__}, ValueError, "store: expected"),
]


@pytest.mark.parametrize(("wrong", "kind", "words"), WRONG)
def test_wrong_arguments_are_named(wrong, kind, words):
    with pytest.raises(kind, match=words):
        sweep(**GIVEN | wrong)


def test_the_unit_of_an_axis_is_a_text():
    with pytest.raises(TypeError, match="unit: expected"):
        Axis([1], 3)
