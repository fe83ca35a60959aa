"""
Sizes at which the space of hard squares changes
================================================

Two, three and four squares slide in a square box, and shrink from the size at which they fill it.

The size is one more coordinate, in which all gaps are linear, so that the placements are a union of
flat pieces, and the nerve of these pieces has the homology of the placements above every size.  It
changes where ``k`` squares in a row reach from wall to wall, at sizes ``1/k``, where forces balance
along the row ([BBK]).  Four squares that fill the box are 24 separate points; three follow each
other around it, in one of two cyclic orders ([ABKMS]).  Squares smaller than ``1/n`` are as free as
``n`` points in the plane, with the Betti numbers of ``(1 + t) (1 + 2 t) ... (1 + (n - 1) t)``
([Arnold]).

Run it to draw births and deaths of homology classes, and squares at critical sizes:
``python examples/ex27_hard_squares.py [FOLDER]``.
"""

import sys
from pathlib import Path

from polycorner.bodies import Arrangement, box, polygon, scaled
from polycorner.polyhedra import Nerve, nerve


def squares(count: int, size: float = 1.0) -> Arrangement:
    """Return squares that slide in the unit square."""
    h = size / 2
    square = polygon([[-h, -h], [h, -h], [h, h], [-h, h]])
    return Arrangement([square] * count, box([0, 0], [1, 1]), orientations="none")


def main(count: int = 3) -> Nerve:
    """Return the homology of the placements above every size."""
    whole = squares(count)
    placements = scaled(whole)
    return nerve(placements, placements.manifold.symbols[-1], symmetry=whole.full_symmetry)


def balanced(count: int, row: int) -> tuple[Arrangement, list[float]]:
    """Return squares of which as many as a row takes fill it, the others above them."""
    size = 1 / row
    whole = squares(count, size)
    rows, columns = zip(*(divmod(k, row) for k in range(count)), strict=True)
    places = {
        name: [(column + 0.5) * size, (above + 0.5) * size]
        for name, column, above in zip(whole.named, columns, rows, strict=True)
    }
    return whole, whole.point(places).tolist()


def draw(count: int, found: Nerve, folder: Path) -> list[Path]:
    from polycorner.pictures import draw_arrangement, draw_barcode, save

    written = [save(draw_barcode(found, "size"), folder / f"ex27_{count}_squares.png")]
    for size in found.critical:
        row = round(1 / size)
        figure = draw_arrangement(*balanced(count, row))
        written.append(save(figure, folder / f"ex27_{count}_squares_row_of_{row}.png"))
    return written


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    for count in (2, 3):
        found = main(count)
        for size in found.critical:
            print(f"{count} squares up to size {size:.6f}: Betti numbers {found.betti(size)}")
        for path in draw(count, found, folder):
            print(f"wrote {path}")
