"""
A bead in a wedge
=================

A user-defined polyhedron: a bead in a curved wedge under gravity, and the forces that hold it.

The region is given by ``y >= x^2`` (a bowl) and ``y >= 1 - x`` (a ramp).  The bead's height ``y``
has its minimum where the two meet on the right of the bowl: a corner with two positive
multipliers, which holds the bead to first order in both directions.

Run it to draw the figure: ``python examples/ex02_own_polyhedron.py [FOLDER]``.
"""

import sys
from pathlib import Path

import numpy as np

from polycorner import Certificate, Manifold, Polyhedron, minimise

M = Manifold.euclidean("x y")
X, Y = M.symbols
WEDGE = Polyhedron(M, {"bowl": Y - X**2, "ramp": Y - 1 + X})
GOLDEN = (np.sqrt(5) - 1) / 2  # x^2 = 1 - x


def main() -> Certificate:
    return minimise(WEDGE, Y, [0.2, 2.0])


def draw(rest: Certificate, path: Path) -> Path:
    """Draw the wedge and the bead in its corner."""
    from polycorner.pictures import draw_region, save

    bowl = np.linspace(GOLDEN, 1.5, 61)
    sides = [
        ("ramp", np.array([[-1.5, 2.5], [GOLDEN, GOLDEN**2]])),
        ("bowl", np.stack([bowl, bowl**2], axis=1)),
    ]
    held = ", ".join(f"{name}: {kind.value}" for name, kind in rest.entrapment.items())
    bounds = (-1.6, 1.6, 0.0, 2.6)
    return save(draw_region(WEDGE, bounds, edges=sides, minima=[(held, rest.point)]), path)


if __name__ == "__main__":
    result = main()
    print(result)
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex02_own_polyhedron.png')}")
