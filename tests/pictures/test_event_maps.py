"""Drawn maps of events: lines lie on the curves, regions bear the numbers of minima."""

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import branches, event_curves
from polycorner.pictures import draw_event_map

M = Manifold.euclidean("x")
(x,) = M.symbols
a, b = sympy.symbols("a b")


@pytest.fixture(scope="module")
def cusp():
    known = {"a": -1.0, "b": 0.1}
    energy = SmoothFunction("energy", x**4 / 4 + a * x**2 / 2 + b * x, M, parameters=known)
    start = minimise(Polyhedron(M, {"stop": 0.5 - x}), energy, [-1.0])
    return event_curves(branches(start, "b", (-2.0, 2.0)), "a", (-2.0, 1.0))


def test_a_drawn_cusp(cusp):
    axes = draw_event_map(cusp, labels=("force", "")).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("force", "a")
    lines = [line.get_xydata() for line in axes.lines if line.get_marker() == "None"]
    assert len(lines) == len(cusp.curves)
    off = [min(abs(4 * r**3 + 27 * s**2).max(), abs(s + r / 2 + 1 / 8).max()) for s, r in
           (line.T for line in lines)]  # fmt: skip
    assert max(off) < 0.02
    marks = {line.get_marker() for line in axes.lines} - {"None"}
    assert marks == {"^", "s"}
    for text in axes.texts:
        s, r = text.get_position()
        inside = 4 * r**3 + 27 * s**2 < 0 and s + r / 2 + 1 / 8 < 0
        assert text.get_text() == ("2" if inside else "1")
    assert {text.get_text() for text in axes.texts} == {"1", "2"}


def test_numbers_of_minima_can_be_left_out(cusp):
    axes = draw_event_map(cusp, minima=False, title="cusp").axes[0]
    assert not axes.texts
    assert axes.get_title() == "cusp"
    np.testing.assert_allclose([axes.get_xlim(), axes.get_ylim()], cusp.rectangle)
