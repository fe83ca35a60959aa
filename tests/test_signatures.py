"""What `help` shows of the everyday names: words, not what they stand for."""

import inspect
from typing import Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import polycorner
from polycorner import bodies
from polycorner.signatures import readable, written

EVERYDAY = {
    f"{room.__name__}.{name}": getattr(room, name)
    for room in (polycorner, bodies)
    for name in room.__all__
    if callable(getattr(room, name)) and name[:2] != "__"
}


@pytest.mark.parametrize("name", sorted(EVERYDAY))
def test_signatures_are_short(name):
    try:
        shown = str(inspect.signature(EVERYDAY[name]))
    except ValueError:
        pytest.skip("an exception or an enumeration has none")
    assert len(shown) <= 600
    assert "_array_like" not in shown
    assert " at 0x" not in shown
    assert len(str(inspect.signature(bodies.Arrangement.system))) < 600


@pytest.mark.parametrize(
    ("annotation", "text"),
    [
        (ArrayLike, "ArrayLike"),
        (ArrayLike | None, "ArrayLike | None"),
        (list[ArrayLike], "list[ArrayLike]"),
        (NDArray[np.float64], "Array"),
        (NDArray[np.bool_], "ndarray"),
        (Literal["a", 1], "Literal['a', 1]"),
        (tuple[int, ...], "tuple[int, ...]"),
        (None, "None"),
        ("sympy.Expr", "sympy.Expr"),
        (bodies.Body, "Body"),
    ],
)
def test_annotations_in_words(annotation, text):
    assert written(annotation) == text


def test_arguments_are_bound_as_before():
    def half(count: int, *, by: ArrayLike = 2) -> float:
        return count / by

    given = readable(inspect.signature(half)).bind(3, by=4)
    assert given.args == (3,)
    assert given.kwargs == {"by": 4}
    assert inspect.signature(polycorner.Manifold).bind(("x",)).args == (("x",),)
    manifold = polycorner.Manifold.euclidean("x")
    assert not hasattr(manifold, "__signature__")
    assert str(inspect.signature(manifold.distance)).startswith("(")
