"""Drawn diagrams: lines lie where equilibria are, marks where events are."""

import numpy as np
import pytest
import sympy
from diagrams import STOP, leaning_well

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise, prove
from polycorner.branches import branches, event_curves, hysteresis
from polycorner.pictures import draw_branches, draw_event_map, save
from polycorner.pictures.branches import draw_cells


@pytest.fixture(scope="module")
def diagram():
    return leaning_well()


def drawn(axes, style=None):
    lines = [line for line in axes.lines if line.get_marker() == "None"]
    return [line for line in lines if style in (None, line.get_linestyle())]


def test_lines_are_equilibria(diagram):
    axes = draw_branches(diagram, "x").axes[0]
    for line in drawn(axes):
        s, place = line.get_data()
        off = place**3 - place - s
        assert (np.minimum(abs(off), abs(place - STOP)) < 1e-3).all()
        stable = (3 * place**2 - 1 > -1e-3) | (abs(place - STOP) < 1e-6)
        assert stable.all() == (line.get_linestyle() == "-")
    assert len(drawn(axes)) == len(diagram.arcs)
    colours = {line.get_color() for line in drawn(axes)}
    assert len(colours) == len({arc.active for arc in diagram.arcs}) == 2


def test_marks_are_events(diagram):
    figure = draw_branches(diagram, "x", label="place", parameter="load")
    (axes,) = figure.axes
    marks = {line.get_data()[0][0] for line in axes.lines if line.get_marker() != "None"}
    fold = 2 / 3**1.5
    assert sorted(marks) == pytest.approx(sorted([-fold, STOP**3 - STOP, fold]))
    told = {text.get_text() for text in figure.legends[0].get_texts()}
    words = {"no contact", "stop", "minimum", "other equilibrium", "fold", "contact closes"}
    assert told == words
    assert [text.get_text() for text in axes.texts] == ["", "stop", ""]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("load", "place")


def test_energies_and_functions(diagram):
    by_default = draw_branches(diagram).axes[0]
    assert by_default.get_ylabel() == "energy"
    for line, arc in zip(drawn(by_default), diagram.arcs, strict=True):
        np.testing.assert_allclose(line.get_ydata()[[0, -1]], arc.energies[[0, -1]], atol=1e-9)
    squares = draw_branches(diagram, lambda q: q[0] ** 2).axes[0]
    for line, arc in zip(drawn(squares), diagram.arcs, strict=True):
        np.testing.assert_allclose(line.get_ydata()[[0, -1]], arc.points[[0, -1], 0] ** 2)


def test_a_loop_has_an_arrow_for_each_fall(diagram, tmp_path):
    loop = hysteresis(diagram)
    figure = draw_branches(diagram, "x", loop=loop)
    arrows = [text for text in figure.axes[0].texts if hasattr(text, "arrow_patch")]
    ends = [text.xy for text in arrows if text.arrow_patch is not None]
    expected = [(jump.parameter, jump.end[0]) for jump in loop.jumps]
    np.testing.assert_allclose(ends, expected)
    assert save(figure, tmp_path / "loop.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("of", "expected"),
    [("z", "of: expected 'energy', 'x' or 'y'"), (lambda q: q, "of: expected a finite number")],
)
def test_what_is_drawn_is_checked(diagram, of, expected):
    with pytest.raises((TypeError, ValueError), match=f"^{expected}"):
        draw_branches(diagram, of)


# ----------------------------------------------------------------------------------- maps of events

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


# ---------------------------------------------------------------------------------- cells of proofs

(X,) = M.symbols


def certificate():
    import sympy

    w = sympy.Symbol("w")
    wall = SmoothFunction("wall", X - w, M, parameters={"w": 1.0})
    return minimise(Polyhedron(M, [wall]), X, [2.0])


def test_every_cell_is_drawn(tmp_path):
    proof = prove(certificate(), parameters={"w": (0.5, 1.5)})
    figure = draw_cells(proof, {"w": "wall (mm)"})
    axes = figure.axes[0]
    assert sum(len(c.get_paths()) for c in axes.collections) == len(proof.cells) > 0
    assert axes.get_xlabel() == "wall (mm)"
    assert save(figure, tmp_path / "cells.png").read_bytes().startswith(b"\x89PNG")
