"""
How high a part must rise to leave its cage
===========================================

Parts that gravity holds: on two spikes, in a corner, in a cup.  What is the least energy with which
they get out?

A part is in an *energy-bounded cage* if every way out leads over some height ([MPMSG]).  A descent
finds ways out, and so heights that suffice; that lower ones do not is proved here by boxes that
cover the placements, with :func:`~polycorner.landscapes.paved_barrier`.  Three heights are known by
hand:

- A square with sides 2 stands on a corner between two spikes, which are 2d apart and touch the
  sides next to it.  By Thales the corner stays on the circle around the middle of the spikes when
  the square tilts, so that its centre is at the height ``R cos t - d cos 2t`` with ``R = sqrt(2)``.
  It is least at ``t = 0`` if ``4d > R``, and the square tips over at ``cos t = R / 4d``, from the
  height ``d + R^2 / 8d``.
- A ball gets out of a notched bowl over the lower wall: its centre rises to the height of the wall
  and the radius.
- A rod that leans on a step gets out when its middle is above the edge.

The cup has an opening that is narrower than the square in it: the height is infinite, a cage.

Run it to draw the parts where they rest: ``python examples/ex29_cages.py [FOLDER]``.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import minimise
from polycorner.bodies import Arrangement, Body, HalfSpace, disc, polygon
from polycorner.landscapes import Paving, paved_barrier
from polycorner.minimisation import Problem

D = 0.45  # half the distance of the spikes
R = math.sqrt(2)
FLOOR, LEFT = HalfSpace((0, 1), (0, 0)), HalfSpace((1, 0), (0, 0))
NEAR = 1e-6  # up to which a height is asked for


def rectangle(left: float, low: float, right: float, high: float) -> Body:
    """Return a rectangle between its sides."""
    return polygon([[left, low], [right, low], [right, high], [left, high]])


@dataclass
class Cage:
    """A part in a cage, the height at which it gets out by hand, and from below by boxes."""

    arrangement: Arrangement
    rest: np.ndarray
    height: float
    paving: Paving


def analysed(
    arrangement: Arrangement,
    start: list[float],
    box: list,
    region: Callable[[Any, Any], list],
    height: float,
) -> Cage:
    """Return where a part rests, and a bound of the height at which it leaves a region."""
    polyhedron = arrangement.polyhedron
    x, y = polyhedron.manifold.symbols[:2]
    rest = minimise(polyhedron, y, start)
    problem = Problem(polyhedron, rest.problem.energy)
    paving = paved_barrier(problem, box, rest.point, region=region(x, y), until=height - NEAR)
    return Cage(arrangement, rest.point, height, paving)


def spikes() -> Cage:
    """Return a square on a corner between two spikes."""
    square = polygon([[0, -R], [R, 0], [0, R], [-R, 0]])
    left = polygon([[-D, 0], [-D - 1, -2], [-D, -2]])
    right = polygon([[D, 0], [D, -2], [D + 1, -2]])
    both = Arrangement({"square": square}, fixed={"left": left, "right": right})
    height = D + R**2 / (8 * D)
    box = [(-2, 2), (-1, 3), None]
    return analysed(both, [0, R - D + 0.01, 0], box, lambda x, _: [1 - x**2], height)


def tipping(count: int = 1001) -> np.ndarray:
    """Return placements of the square as it tips over and slides off, ``(k, 3)``."""
    t = np.linspace(0, math.pi / 4, count)
    tilted = np.stack([R * np.sin(t) - D * np.sin(2 * t), R * np.cos(t) - D * np.cos(2 * t), -t])
    slid = tilted[:, -1] + np.linspace(0, 1, count)[:, None] * [1 - tilted[0, -1], 0, 0]
    return np.vstack([tilted.T, slid])


def bowl() -> Cage:
    """Return a ball in a bowl with a notch: its right wall is lower."""
    walls = {"left": rectangle(-2, -1, -1, 2), "right": rectangle(1, -1, 2, 0.75)}
    ball = Arrangement({"ball": disc(0.5)}, {"floor": FLOOR}, fixed=walls, orientations="none")
    return analysed(ball, [0.2, 0.7], [(-3, 3), (0, 4)], lambda x, _: [1.75 - x], 0.75 + 0.5)


def corner() -> Cage:
    """Return a rod between a wall and a step, on whose edge it leans."""
    thin, step = 0.02, 0.5
    rod = rectangle(-0.75, -thin, 0.75, thin)
    walls = {"floor": FLOOR, "wall": LEFT}
    leaning = Arrangement({"rod": rod}, walls, fixed={"step": rectangle(1, -1, 4, step)})
    box = [(-0.5, 2.5), (-0.5, 3), None]
    return analysed(leaning, [0.7, 0.4, 0.46], box, lambda x, _: [2 - x], step + thin)


def cup() -> Cage:
    """Return a square in a cup whose opening is narrower than the square."""
    walls = {
        "floor": FLOOR,
        "left": HalfSpace((1, 0), (-1.6, 0)),
        "right": HalfSpace((-1, 0), (1.6, 0)),
    }
    lids = {"one": rectangle(-2.1, 3, -0.7, 3.5), "other": rectangle(0.7, 3, 2.1, 3.5)}
    square = Arrangement({"square": rectangle(-1, -1, 1, 1)}, walls, fixed=lids)
    box = [(-3, 3), (0, 4), None]
    return analysed(square, [0, 1.1, 0], box, lambda _, y: [3.5 - y], math.inf)


def main() -> dict[str, Cage]:
    """Return the cages by name."""
    return {"spikes": spikes(), "bowl": bowl(), "corner": corner(), "cup": cup()}


def draw(cages: dict[str, Cage], folder: Path) -> list[Path]:
    from polycorner.pictures import draw_arrangement, save

    return [
        save(
            draw_arrangement(cage.arrangement, cage.rest, titles=[f"{name}: {cage.height:.6g}"]),
            folder / f"ex29_{name}.png",
        )
        for name, cage in cages.items()
    ]


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    cages = main()
    for name, cage in cages.items():
        print(f"{name}: at rest at {cage.rest[1]:.6f}, out at {cage.height:.6f}, {cage.paving}")
    for path in draw(cages, folder):
        print(f"wrote {path}")
