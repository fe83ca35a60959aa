"""
The critical thickness of rods
==============================

The largest thickness of the rods of a dyad, and the error bar of its heading.

A nested pair has a minimum in the corner of three contacts only if its rods are thin enough.  The
critical thickness is found in three ways: by Newton's method on the equations of the corner with
one multiplier set to zero, by bisection on the multiplier of certified corners, and by the closed
form derived for the plane, ``t = 2 r sqrt(1 - r^2/l^2) - r``, which holds in every drum.  A pair
with thicker rods slides apart until it lies end to end.

The heading of the experiment's pair comes with the error bar that tolerances of its sizes give it.

Run it to draw the figures: ``python examples/ex10_critical_rod.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import sympy

from polycorner import Certificate, minimise, stationary_on
from polycorner.dumbbells import (
    DumbbellPair,
    ErrorBar,
    critical_length,
    critical_rod_radius,
    heading_error_bar,
    pair_sensitivity,
    plane_critical_formula,
)
from polycorner.dumbbells.statics.critical import escape_barrier
from polycorner.dumbbells.statics.minima import CORNER

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
TOLERANCES = {"length": 0.1, "ball_radius": 0.05, "rod_radius": 0.05, "drum_radius": 1.0}


@dataclass(frozen=True)
class Result:
    """Critical rod radius in three ways, in mm, and related quantities.

    ``apart`` is how far along the drum, in mm, the centres of a slightly too thick pair end up;
    ``length`` the critical length for rods of 2.9 mm; ``barrier`` the energy barrier to falling
    apart, as a height in mm of one ball's weight; ``heading`` in degrees.
    """

    newton: float | None
    bisection: float
    closed_form: float
    apart: float
    length: float | None
    barrier: float | None
    heading: ErrorBar


def main() -> Result:
    bisection = bisected()
    return Result(
        newton=critical_rod_radius(PAIR),
        bisection=bisection,
        closed_form=closed_form(),
        apart=apart(bisection + 0.01),
        length=critical_length(replace(PAIR, rod_radius=2.9)),
        barrier=escape_barrier(PAIR),
        heading=heading_error_bar(PAIR, TOLERANCES),
    )


def closed_form() -> float:
    """Return the derived expression's value for the pair."""
    sizes = dict(zip(sympy.symbols("l r", positive=True), (16, 3), strict=True))
    return float(plane_critical_formula().subs(sizes))


def corner(rod: float) -> Certificate:
    """Return the stationary point on the face of the three contacts."""
    pair = replace(PAIR, rod_radius=rod)
    start = pair.nested("R", clearance=0.0)
    return stationary_on(pair.polyhedron, pair.energy, start, CORNER)


def bisected(low: float = 2.5, high: float = 2.99) -> float:
    """Return the rod radius at which the multiplier of a ball-rod contact changes sign."""
    while high - low > 1e-12:
        middle = (low + high) / 2
        low, high = (middle, high) if corner(middle).multipliers["A2b"] > 0 else (low, middle)
    return low


def apart(rod: float) -> float:
    """Return the distance of the centres along the drum at the end of the descent."""
    thick = corner(rod)
    rest = minimise(thick.problem.polyhedron, thick.problem.energy, thick.point)
    return float(rest.point[4] - rest.point[1])


def draw(folder: Path) -> list[Path]:
    """Draw the branches that meet, and the critical thickness over the length."""
    from polycorner.dumbbells.pictures import draw_bifurcation, draw_critical
    from polycorner.pictures import save

    radius = PAIR.ball_radius
    drums = [math.inf, PAIR.drum_radius, 10 * radius, 4 * radius]
    return [
        save(draw_bifurcation(PAIR), folder / "ex10_bifurcation.png"),
        save(draw_critical(radius, drums, pairs=[PAIR]), folder / "ex10_critical.png"),
    ]


if __name__ == "__main__":
    result = main()
    print(f"critical rod radius  {result.newton} mm (Newton), {result.bisection} mm (bisection)")
    print(f"t = {plane_critical_formula()}  =  {result.closed_form} mm")
    print(f"a pair with rods 0.01 mm thicker ends {result.apart:.2f} mm apart along the drum")
    print(f"critical length for rods of 2.9 mm  {result.length} mm")
    print(f"barrier {result.barrier} mm;  heading {result.heading} degrees, of which")
    for name, share in result.heading.shares.items():
        print(f"  {share:+.4f} from {name} +- {TOLERANCES[name]} mm")
    print(pair_sensitivity(PAIR))
    for path in draw(Path(sys.argv[1] if len(sys.argv) > 1 else "out")):
        print(f"wrote {path}")
