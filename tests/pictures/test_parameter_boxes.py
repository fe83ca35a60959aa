"""Cells of a proof as a picture."""

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise, prove
from polycorner.pictures.branches import draw_cells
from polycorner.pictures.style import save

M = Manifold.euclidean("x")
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
