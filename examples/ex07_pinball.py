"""
A ball among pins and cups
==========================

A ball on a board with pins, wedges and cups: its minima, and the entrapment at each of them.

Balls are released all over the board; each descends to a certified minimum of its height.  The
kind of entrapment in each direction is computed: two half-V in a pocket, half-V and U in a cup,
half-V and half-U in a cup that a wall cuts in half at its lowest point, half-V and free on a
ledge.  Corners of wedges and rims of cups are locally concave: the region is a union there, and
the height decreases along each piece, so that no ball rests on them.

Run it to draw the figure: ``python examples/ex07_pinball.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner import Certificate, Entrapment, Skeleton, certify, minimise, skeleton
from polycorner.models import Pinball
from polycorner.polyhedra import LocalType

BOARD = Pinball()
BALLS = 250


@dataclass(frozen=True)
class Result:
    """The atlas, the balls at rest grouped by the walls that hold them, and corner certificates."""

    atlas: Skeleton
    rests: dict[str, list[Certificate]]
    corners: list[Certificate]

    @property
    def concave(self) -> list[Certificate]:
        """The corners at which the region is a union."""
        return [c for c in self.corners if c.stratum.local_type is LocalType.UNION]

    def entrapment(self, name: str) -> str:
        """Return the entrapment of the balls of a group, as in ``half-V + U``."""
        return held_as(self.rests[name][0])


def main() -> Result:
    # The circle of a free pin has no corner: a search is sure to find it only if it starts there.
    atlas = skeleton(BOARD.polyhedron, [(x, y + radius) for x, y, radius in BOARD.pins])
    rests: dict[str, list[Certificate]] = {}
    for start in BOARD.starts(np.random.default_rng(0), BALLS):
        rest = minimise(BOARD.polyhedron, BOARD.energy, start)
        rests.setdefault(held_by(rest), []).append(rest)
    corners = [certify(BOARD.polyhedron, BOARD.energy, c.point) for c in atlas.corners]
    from_the_top = dict(sorted(rests.items(), key=lambda item: -item[1][0].energy))
    return Result(atlas, from_the_top, corners)


def held_by(rest: Certificate) -> str:
    """Name the walls that hold the ball, except those that it merely touches."""
    touched = (Entrapment.HALF_V, Entrapment.HALF_U)
    return " ".join(name for name, kind in rest.entrapment.items() if kind in touched)


def held_as(rest: Certificate) -> str:
    counts = rest.entrapment_counts
    return " + ".join(f"{n} {kind}" if n > 1 else kind for kind, n in counts.items() if n)


def draw(result: Result, path: Path) -> Path:
    """Draw the board, its corners, and every ball at its minimum, coloured by entrapment."""
    from polycorner.pictures import draw_region, save

    balls = [(held_as(rest), rest.point) for group in result.rests.values() for rest in group]
    figure = draw_region(
        BOARD.polyhedron,
        (-0.25, BOARD.width + 0.25, -0.25, BOARD.height + 0.25),
        corners=[("", c.point) for c in result.corners],
        minima=balls,
    )
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(f"{result.atlas}, Euler characteristic {result.atlas.euler_characteristic}")
    for name, group in result.rests.items():
        first = group[0]
        print(f"{len(group):3} balls on {name:22} {held_as(first):17} {first.verdict.value}")
    verdicts = {c.verdict.value for c in result.concave}
    print(f"{len(result.concave)} concave corners: {', '.join(verdicts)}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex07_pinball.png')}")
