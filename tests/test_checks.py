"""Guards: every refusal names the argument, and nothing in range is refused."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import checks, kinds

REFUSED = {
    "whole-float": (checks.whole, (2.0,), {}, TypeError),
    "whole-bool": (checks.whole, (True,), {}, TypeError),
    "whole-low": (checks.whole, (0,), {"least": 1}, ValueError),
    "whole-high": (checks.whole, (9,), {"most": 8}, ValueError),
    "real-text": (checks.real, ("1",), {}, TypeError),
    "real-bool": (checks.real, (False,), {}, TypeError),
    "real-complex": (checks.real, (1j,), {}, TypeError),
    "real-nan": (checks.real, (math.nan,), {"infinite": True}, ValueError),
    "real-inf": (checks.real, (math.inf,), {}, ValueError),
    "real-inf-range": (checks.real, (math.inf,), {"above": 0.0}, ValueError),
    "real-huge": (checks.real, (16**5000,), {}, ValueError),
    "real-open": (checks.real, (0.0,), {"above": 0.0}, ValueError),
    "real-closed": (checks.real, (1.1,), {"most": 1.0}, ValueError),
    "choice": (checks.choice, ("slsq", ["slsqp", "scp"]), {}, ValueError),
    "choice-kind": (checks.choice, (3, ["slsqp", "scp"]), {}, TypeError),
    "names": (checks.names, (["z"], ["x", "y"]), {}, ValueError),
    "mapping": (checks.mapping, ([],), {}, TypeError),
    "instance": (checks.instance, ("x", np.ndarray), {}, TypeError),
    "generator-text": (checks.generator, ("x",), {}, TypeError),
    "generator-negative": (checks.generator, (-1,), {}, ValueError),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_refusal_is_one_sentence_that_names_the_argument(case):
    guard, values, options, kind = REFUSED[case]
    with pytest.raises(kind, match=r"^thing: expected .*; got ") as refused:
        guard("thing", *values, **options)
    assert "\n" not in str(refused.value)


@given(st.integers(), st.floats(allow_nan=False))
def test_what_is_in_range_passes_unchanged(number, value):
    assert checks.whole("n", np.int64(0) + 3) == 3
    assert checks.whole("n", number, least=number, most=number) == number
    assert checks.real("x", value, least=value, most=value, infinite=True) == value


def test_a_seed_and_nothing_make_reproducible_generators():
    own = np.random.default_rng(5)
    assert checks.generator("rng", own) is own
    assert checks.generator("rng", 5).random() == np.random.default_rng(5).random()
    assert checks.generator("rng", None).random() == checks.generator("rng", None).random()


def test_the_sentence_for_a_missing_extra_fits_a_package_and_a_checkout():
    words = str(checks.missing_extra("tornado", "view"))
    assert "polycorner[view]" in words
    assert "'.[view]'" in words


def test_an_infinity_in_range_is_said_to_be_none():
    with pytest.raises(ValueError, match=r"^thing: expected a finite number > 0 in mm; got inf$"):
        checks.real("thing", math.inf, above=0, unit="mm")


class _Shape(Protocol):
    points: Any

    @property
    def faces(self) -> Any: ...


class _Cube:
    def __init__(self):
        self.points = ()

    @property
    def faces(self):
        raise AssertionError  # whatever it costs, it is not computed


@kinds.checked
def _given(
    expression: "sympy.Expr" = 0,
    shapes: Sequence[_Cube] = (),
    counts: Sequence[int] = (),
    pairs: Sequence[tuple[float, float]] = (),
    shape: _Shape | None = None,
) -> None:
    """Take what is of the kinds that the annotations name."""


@pytest.mark.parametrize(
    "named",
    [
        {"expression": 1},
        {"expression": sympy.Symbol("x")},
        {"shapes": [_Cube()]},
        {"counts": np.arange(3)},
        {"counts": np.empty(0, dtype=int)},
        {"pairs": np.ones((3, 2))},
        {"shape": _Cube()},
    ],
)
def test_what_an_annotation_means_is_taken(named):
    _given(**named)


@pytest.mark.parametrize(
    "named",
    [
        {"expression": "x"},
        {"shapes": np.ones(3)},
        {"shapes": np.empty(0)},
        {"counts": np.ones(3)},
        {"counts": np.ma.array([1, 2], mask=[True, False])},
        {"pairs": np.ones((3, 3))},
        {"pairs": np.float64(1.0)},
        {"shape": 1.0},
        {"shape": _Cube},
    ],
)
def test_what_it_does_not_mean_is_refused(named):
    (name,) = named
    with pytest.raises(TypeError, match=rf"^{name}: expected "):
        _given(**named)


def test_masks_in_lists_are_not_lost():
    with pytest.raises(TypeError, match=r"^q: expected real numbers; got a masked array"):
        checks.reals("q", [np.ma.array([0.0, 1.0], mask=[True, False])])
