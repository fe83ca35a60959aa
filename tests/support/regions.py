"""A small region in the plane for tests that send regions to other processes."""

from pathlib import Path

from polycorner import Manifold, Polyhedron

FOLDER = Path(__file__).parent
PLANE = Manifold.euclidean("x y")


def bowl():
    """Return the region above a parabola and a line."""
    x, y = PLANE.symbols
    return Polyhedron(PLANE, {"bowl": y - x**2, "ramp": y - 1 + x})
