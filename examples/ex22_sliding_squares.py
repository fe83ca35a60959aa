"""
Squares that slide in a box
===========================

Two and three unit squares in a square box between 2 and 3 wide, as in the fifteen puzzle.

The squares slide without turning, so that two of them are apart if one of four edges separates
them: a union, and the polyhedron is made of flat pieces that meet at concave corners.  Three
squares leave one place free.  They follow each other around the box, in one of two cyclic orders
that no motion exchanges: the placements have two components, each homotopy equivalent to a circle,
as the cubical complex of Alpert, Bauer, Kahle, MacPherson and Spendlove ([ABKMS]) shows.

Run it to draw corners: ``python examples/ex22_sliding_squares.py [FOLDER]``.
"""

import sys
from pathlib import Path

from polycorner import Skeleton, skeleton
from polycorner.bodies import Arrangement, box, polygon

PLACES = ((0.6, 0.6), (1.7, 0.6), (1.7, 1.7))


def main(count: int = 3, side: float = 2.3) -> tuple[Arrangement, Skeleton]:
    """Return the squares, and the skeleton of the placements that one placement leads to."""
    square = polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    squares = Arrangement([square] * count, box([0, 0], [side, side]), orientations="none")
    start = squares.point({name: PLACES[k] for k, name in enumerate(squares.named)})
    return squares, skeleton(squares.polyhedron, [start])


def draw(squares: Arrangement, found: Skeleton, path: Path) -> Path:
    from polycorner.pictures import draw_arrangement, save

    return save(draw_arrangement(squares, [c.point for c in found.corners[:8]]), path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    squares, found = main(2)
    print(f"two squares: {len(found.corners)} corners, {len(found.edges)} edges")
    print(f"wrote {draw(squares, found, folder / 'ex22_sliding_squares.png')}")
