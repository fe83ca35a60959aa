"""
How deep pockets are
====================

Over which edges a ball rolls from one pocket of a pinball board into another, with proof.

The board leans to the left by a fiftieth, so that every place of rest is a point.  A pass is the
top of a free pin, or the tip of a wedge or the rim of a cup, where no ball rests on either side:
these are no places of rest of the board, but lowest points on two of its branches at once.  The
complete lists of both kinds bound what it takes to leave a pocket from below, and routes that are
verified in interval arithmetic bound it from above.  In the figure of the tree a pocket is left
where its line ends.

Run it to draw the board, the tree and a film of a way:
``python examples/ex31_landscape.py [FOLDER]``.
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from polycorner.landscapes import Landscape, landscape
from polycorner.models import Pinball

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from polycorner.spaces import Array

BOARD = Pinball()
LEAN = 50
SIDES = (-0.2, BOARD.width + 0.2, -0.2, BOARD.height + 0.2)


def main() -> Landscape:
    x, y = BOARD.manifold.symbols
    box = [(-0.1, BOARD.width + 0.1), (-0.1, BOARD.height + 0.1)]
    return landscape(BOARD.polyhedron, y + x / LEAN, box=box)


def draw_ball(axes: "Axes", point: "Array") -> None:
    """Draw the board with a ball."""
    from polycorner.pictures.regions import shade

    shade(axes, BOARD.polyhedron, SIDES, 120, outline=False)
    axes.plot(*point, "o", color="#D55E00", ms=5)
    axes.set(xlim=SIDES[:2], ylim=SIDES[2:], aspect="equal")


def draw(found: Landscape, folder: Path) -> list[Path]:
    """Draw the board with all passes and routes, and the tree."""
    from polycorner.pictures import draw_landscape, draw_landscape_map, save

    board = draw_landscape_map(found, SIDES)
    tree = draw_landscape(found, pictures=draw_ball, label="height")
    return [save(board, folder / "ex31_board.png"), save(tree, folder / "ex31_tree.png")]


def film(found: Landscape, path: Path, frames: int = 60) -> Path:
    """Write a film of the way from the highest pocket to the lowest."""
    from polycorner.pictures import film_route

    way = found.barrier(len(found.minima) - 1, 0).route
    assert way is not None
    return film_route(found, way, path, draw_ball, label="height", frames=frames)


if __name__ == "__main__":
    found = main()
    print(found)
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    for path in draw(found, folder):
        print(f"wrote {path}")
    print(f"wrote {film(found, folder / 'ex31_way.gif')}")
