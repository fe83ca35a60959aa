"""A polyhedron of one's own: a bead in a curved wedge under gravity, and why it rests there.

The region is where ``y >= x^2`` (a bowl) and ``y >= 1 - x`` (a ramp).  The bead's height ``y`` is
least where the two meet on the right of the bowl: a corner with two positive multipliers, which
holds the bead to first order in both directions.
"""

import numpy as np

from polycorner import Certificate, Manifold, Polyhedron, minimise


def main() -> Certificate:
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    wedge = Polyhedron(M, {"bowl": y - x**2, "ramp": y - 1 + x})
    return minimise(wedge, y, [0.2, 2.0])


GOLDEN = (np.sqrt(5) - 1) / 2  # x^2 = 1 - x

if __name__ == "__main__":
    print(main())
