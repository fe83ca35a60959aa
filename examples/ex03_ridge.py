"""
A ridge splits descents
=======================

A union of two half-planes: its corner is locally concave and separates descents.

Outside the quadrant ``x < 0, y < 0`` the energy ``(x + 1)^2 + (y + 2)^2`` has two minima, one on
each side of the corner.  At the corner itself the energy decreases along each side, so it is no
minimum, and a descent ends on the side that is downhill from its start.

Run it to draw the figure: ``python examples/ex03_ridge.py [FOLDER]``.
"""

import sys
from pathlib import Path

import numpy as np

from polycorner import AnyOf, Certificate, Manifold, Polyhedron, certify, minimise

M = Manifold.euclidean("x y")
X, Y = M.symbols
OUTSIDE = Polyhedron(M, AnyOf(X, Y))
ENERGY = (X + 1) ** 2 + (Y + 2) ** 2
STARTS = [[2.0, 0.5], [-3.0, 2.0], [1.0, -2.5], [0.5, 2.5]]


def main() -> tuple[Certificate, Certificate]:
    return minimise(OUTSIDE, ENERGY, STARTS[0]), certify(OUTSIDE, ENERGY, [0.0, 0.0])


def draw(path: Path) -> Path:
    """Draw the energy's level lines, the starts of descents, and the minima where they end."""
    from polycorner.pictures import draw_region, save

    rests = [minimise(OUTSIDE, ENERGY, start) for start in STARTS]
    named = [(f"rest on {rest.active[0]}, E = {rest.energy:g}", rest.point) for rest in rests]
    figure = draw_region(OUTSIDE, (-4, 3, -4, 3), corners=[("", [0.0, 0.0])], minima=named)
    (axes,) = figure.axes
    x, y = np.meshgrid(np.linspace(-4, 3, 141), np.linspace(-4, 3, 141))
    axes.contour(x, y, (x + 1) ** 2 + (y + 2) ** 2, range(1, 26, 3), colors="0.6", linewidths=0.6)
    for start, rest in zip(STARTS, rests, strict=True):
        axes.annotate("", rest.point, start, arrowprops={"arrowstyle": "->", "color": "0.4"})
    return save(figure, path)


if __name__ == "__main__":
    for certificate in main():
        print(certificate, end="\n\n")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(folder / 'ex03_ridge.png')}")
