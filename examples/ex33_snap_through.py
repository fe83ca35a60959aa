"""
A truss that snaps through
==========================

A shallow truss of two bars is pressed down until it snaps through onto a stop, and pulled up again.

The apex stays on the axis of symmetry, where the load is greatest at ``1 + y^2 = L^(2/3)`` for bars
of the natural length ``L``: there is a fold, and the way up is another one than the way down.  The
area between the two, the work that pressing and pulling do in a cycle, is what the two falls
release.

Run it to draw the figures: ``python examples/ex33_snap_through.py [FOLDER]``.
"""

import sys
from pathlib import Path

import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import Hysteresis, branches, hysteresis

HEIGHT, STOP = sympy.Rational(2, 5), sympy.Rational(3, 10)  # half the span is one
LENGTH = sympy.sqrt(1 + HEIGHT**2)
STIFFNESS = 20
MOST = 0.6  # load


def main() -> Hysteresis:
    plane = Manifold.euclidean("x y")
    x, y = plane.symbols
    load = sympy.Symbol("load")
    bars = [sympy.sqrt((1 + side * x) ** 2 + y**2) - LENGTH for side in (1, -1)]
    formula = sum(STIFFNESS * bar**2 / 2 for bar in bars) + load * y
    energy = SmoothFunction("energy", formula, plane, parameters={"load": 0.0})
    space = Polyhedron(plane, {"stop": y + STOP})
    start = minimise(space, energy, [0.0, float(HEIGHT)])
    return hysteresis(branches(start, "load", (-MOST, MOST)))


def draw(loop: Hysteresis, folder: Path) -> list[Path]:
    """Draw the height of the apex and the energy over the load."""
    from polycorner.pictures import draw_branches, save

    title = "a shallow truss, pressed onto a stop and pulled off"
    heights = {"y": "height of the apex", "energy": "energy"}
    figures = {
        of: draw_branches(loop.diagrams[0], of, label=label, loop=loop, title=title)
        for of, label in heights.items()
    }
    return [save(figure, folder / f"ex33_{of}.png") for of, figure in figures.items()]


if __name__ == "__main__":
    loop = main()
    print(loop)
    for path in draw(loop, Path(sys.argv[1] if len(sys.argv) > 1 else "out")):
        print(f"wrote {path}")
