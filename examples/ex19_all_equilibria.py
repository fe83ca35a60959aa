"""
All equilibria, with a proof
============================

Every place of rest of a ball on a pinball table, and of a ladder in a corner.

``stationary_points`` bisects a box until each part is shown to contain no place of rest, or lies
around one that is known: the lists are complete.  On the table, which leans to the left by a
little, a ball rests in pockets between walls, and could be balanced on every pin that is free on
top; on corners of wedges and rims of cups it cannot.  A ladder slides without friction on a floor
and a wall, on ground that slopes to the wall: it lies, stands, or could be balanced, leaning or on
its end in the corner.  Either end may be the upper one.

Run it to draw the figures: ``python examples/ex19_all_equilibria.py [FOLDER]``.
"""

import math
import sys
from pathlib import Path

import sympy

from polycorner import Manifold, Polyhedron
from polycorner.models import Pinball
from polycorner.proofs import StationaryList, StationaryPoint, stationary_points

BOARD = Pinball()
SLOPE = sympy.Rational(1, 2)  # of the ground of the ladder; that of the table is 1/50
PLANE = Manifold(("x", "y", "angle"), (math.inf, math.inf, math.tau))


def main() -> tuple[StationaryList, StationaryList]:
    """Return the places of rest on the table and those of the ladder."""
    return table(), ladder()


def table() -> StationaryList:
    x, y = BOARD.manifold.symbols
    box = [(-0.1, BOARD.width + 0.1), (-0.1, BOARD.height + 0.1)]
    return stationary_points(BOARD.polyhedron, y + x / 50, box=box)


def ladder() -> StationaryList:
    """Return the equilibria of a ladder of length 2 with its middle at ``(x, y)``."""
    x, y, angle = PLANE.symbols
    across, up = sympy.cos(angle), sympy.sin(angle)
    ends = {"a wall": x + across, "b wall": x - across, "a floor": y + up, "b floor": y - up}
    return stationary_points(
        Polyhedron(PLANE, ends), y + SLOPE * x, box={"x": (-0.5, 3), "y": (-0.5, 3)}
    )


def balance(p: StationaryPoint) -> str:
    return "stable" if p.is_minimum else "unstable"


def draw_table(found: StationaryList, path: Path) -> Path:
    """Draw the table and its places of rest."""
    from polycorner.pictures import draw_region, save

    sides = (-0.25, BOARD.width + 0.25, -0.25, BOARD.height + 0.25)
    places = sorted((balance(p), tuple(p.point)) for p in found)
    return save(draw_region(BOARD.polyhedron, sides, minima=places), path)


def draw_ladder(found: StationaryList, path: Path) -> Path:
    """Draw the ladder in its positions, one for either way round."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save
    from polycorner.pictures.regions import MINIMA

    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.add_subplot(aspect="equal", xticks=[], yticks=[], frame_on=False)
    axes.plot([0, 0, 2.4], [2.4, 0, 0], color="0.4", lw=2)
    slope = float(SLOPE)
    axes.annotate(
        "gravity",
        (2.0, 1.5),
        (2.0 + 0.5 * slope, 2.0),
        ha="center",
        arrowprops={"arrowstyle": "->"},
    )
    for p in found:
        (x, y, angle), stable = p.point, p.is_minimum
        along = math.cos(angle), math.sin(angle)
        axes.plot(
            [x - along[0], x + along[0]], [y - along[1], y + along[1]],
            color=MINIMA[not stable], lw=4, solid_capstyle="round",
        )  # fmt: skip
    for colour, label in zip(MINIMA, ("stable", "unstable"), strict=False):
        axes.plot([], [], color=colour, lw=4, label=label)
    axes.legend(loc="upper right", frameon=False)
    return save(figure, path)


if __name__ == "__main__":
    on_table, of_ladder = main()
    for found in (on_table, of_ladder):
        print(f"{found.statement} {len(found.minima)} are stable.")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw_table(on_table, folder / 'ex19_table.png')}")
    print(f"wrote {draw_ladder(of_ladder, folder / 'ex19_ladder.png')}")
