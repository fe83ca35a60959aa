"""
The heading of a dyad
=====================

The heading of a dyad: the paper's curve and the computed ones compared.

The paper gives ``theta_s = +-arctan(r/l)`` for the heading of a nested pair of dumbbells in
equilibrium.  Here the minimiser is computed for several rod radii and both chiralities, in the
drum and in the plane it develops into, and compared with the closed form of the plane,
``tan 2 theta_s = 2 D p / (D^2 + l^2 - p^2)``, ``p = r + t``, ``D = l - sqrt(4 r^2 - p^2)``.

Run it to draw the figure: ``python examples/ex01_heading.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from polycorner.dumbbells import DumbbellPair, dyad_minima, heading_curve, paper_heading

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
RODS = (0.5, 1.0, 1.5, 2.0, 2.5)
LENGTHS = np.linspace(10, 30, 41)


@dataclass(frozen=True)
class Result:
    """Headings in degrees: of the pair, of the closed form, of the paper; and the order in 1/R."""

    right: float
    left: float
    plane: float
    paper: float
    order: float


def main() -> Result:
    right, left, _ = dyad_minima(PAIR)
    return Result(
        right=right.headings[0],
        left=left.headings[0],
        plane=math.degrees(PAIR.plane_corner()[0]),
        paper=paper_heading(PAIR),
        order=order_in_curvature(),
    )


def order_in_curvature() -> float:
    """Return the slope of log(heading in the drum - heading in the plane) against log(1/R)."""
    radii = np.array([125.0, 250.0, 500.0, 1000.0])
    plane = math.degrees(PAIR.plane_corner()[0])
    drums = [dyad_minima(replace(PAIR, drum_radius=float(radius)))[0] for radius in radii]
    differences = [abs(drum.headings[0] - plane) for drum in drums]
    return float(np.polyfit(np.log(1 / radii), np.log(differences), 1)[0])


def draw(path: Path) -> Path:
    """Draw both curves of the paper and the computed ones for several rod radii."""
    from polycorner.dumbbells.pictures import draw_heading
    from polycorner.pictures import save

    return save(draw_heading(PAIR, LENGTHS.tolist(), RODS), path)


if __name__ == "__main__":
    result = main()
    print(f"computed  {result.right:+.6f} and {result.left:+.6f} degrees (right, left)")
    print(f"plane     {result.plane:+.6f}; the drum differs by the order {result.order:.3f} in 1/R")
    print(f"paper     {result.paper:+.6f}, arctan(r/l)")
    for rod in RODS:
        headings, rests = heading_curve(replace(PAIR, rod_radius=rod), [PAIR.length])
        print(f"t = {rod:3} mm  {headings[0]:.6f} degrees, minimum: {bool(rests[0])}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(folder / 'ex01_heading.png')}")
