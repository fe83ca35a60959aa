"""
Disks on a torus
================

Disks on a torus: every radius at which their configuration space changes.

Two and three equal disks lie on the square and on the hexagonal torus.  Their largest common
radius is critical where the contacts carry a stress in equilibrium; the index is the dimension of
the space in which it can still grow to second order.  Radii are in units of the shortest lattice
vector.

On the hexagonal torus all critical configurations of three disks are isolated.  With their
labelled copies modulo translations, ``(-1)^index`` adds up to the Euler characteristic of the
space of three distinct points, which is 2.

Run it to draw a figure of four disks: ``python examples/ex06_disks.py [FOLDER]``.
"""

import sys
from pathlib import Path

import numpy as np

from polycorner.models import TorusDisks

# Number of labelled copies, modulo translations, of each configuration of three disks there.
COPIES = (2, 6, 6)


def main() -> dict[tuple[int, str], list[tuple[float, int]]]:
    """Return radius and index of every critical configuration, by number of disks and torus."""
    rng = np.random.default_rng(0)
    return {
        (count, lattice): [(c.radius, c.index) for c in TorusDisks(count, lattice).critical(rng)]
        for count in (2, 3)
        for lattice in ("square", "hexagonal")
    }


def draw(path: Path) -> Path:
    """Draw the critical configurations of four disks on the hexagonal torus."""
    from polycorner.pictures import draw_critical, save

    model = TorusDisks(4, "hexagonal")
    return save(draw_critical(model, model.critical(np.random.default_rng(0))), path)


if __name__ == "__main__":
    for (count, lattice), found in main().items():
        print(f"{count} disks, {lattice} torus")
        for radius, index in found:
            print(f"    r = {radius:.9f}, index {index}")
        if (count, lattice) == (3, "hexagonal"):
            total = sum((-1) ** k * copies for (_, k), copies in zip(found, COPIES, strict=True))
            print(f"    signed count of labelled copies: {total}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(folder / 'ex06_disks.png')}")
