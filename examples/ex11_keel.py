"""
The keel of a dumbbell
======================

The keel effect: a dumbbell climbs a tilted drum like a boat tacking against the wind.

A dumbbell rolls more easily than it slides.  Friction holds it while the force along the wall, over
the force onto the wall, lies in a disc that is cut by a strip.  The turning drum carries it east
until the force leaves that set; then it rolls back, perpendicular to its axis, and with a positive
heading gains height along the drum with each zigzag.

The formulas of a short dumbbell are compared with the exact condition of rest for one of finite
length, whose balls have different loads; the difference vanishes with the square of the length.

Run it to draw the figure: ``python examples/ex11_keel.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner.dumbbells import Keel
from polycorner.dumbbells.statics.keel import Turning, exact_eastern_boundary

# Static coefficients from the paper's text; it does not give the dynamic ones.
KEEL = Keel(math.radians(7), rolling=0.1, sliding=0.3, rolling_dynamic=0.05, sliding_dynamic=0.2)
LENGTH, CENTRE_RADIUS = 16.0, 122.0  # mm
TURNS = 0.01  # angular speed of the drum, radians per second
HEADINGS = (-20.0, -10.0, 0.0, 10.0, 20.0, 35.0, 60.0)  # degrees


@dataclass(frozen=True)
class Result:
    """Turning points of carried dumbbells and how much their length matters.

    ``turning`` is in radians, one entry for each of ``HEADINGS``; ``speeds`` are mean speeds of
    climbing in mm/s.  ``difference`` is the largest change of the azimuth at which they start to
    move, in degrees, that comes from the length; ``order`` the power of the length with which it
    vanishes.
    """

    limit: float
    turning: Turning
    speeds: list[float]
    difference: float
    order: float


def main() -> Result:
    theta = np.radians(HEADINGS)
    turning = KEEL.turning(theta)
    slenderness = LENGTH / (2 * CENTRE_RADIUS)
    moved = [
        exact_eastern_boundary(theta, KEEL.onset, slenderness / shorter) - turning.upper
        for shorter in (1, 2)
    ]
    first, second = (abs(change).max() for change in moved)
    cycle = (turning.upper - turning.coasting) / TURNS
    rise = CENTRE_RADIUS * np.tan(theta) * (turning.upper - turning.coasting)
    return Result(
        limit=KEEL.onset.limit,
        turning=turning,
        speeds=(rise / cycle).tolist(),
        difference=math.degrees(first),
        order=math.log2(first / second),
    )


def draw(path: Path) -> Path:
    """Draw regions of rest, turning points and torques."""
    from polycorner.dumbbells.pictures import draw_keel
    from polycorner.pictures import save

    return save(draw_keel(KEEL), path)


if __name__ == "__main__":
    result = main()
    turning = result.turning
    print("heading  carried to  back to (without inertia)  climbs")
    ends = np.degrees([turning.upper, turning.coasting, turning.lower]).T
    for heading, rolls, (upper, coasting, lower), speed in zip(
        HEADINGS, turning.rolls, ends, result.speeds, strict=True
    ):
        back = f"{coasting:5.2f}° ({lower:.2f}°)           {speed:6.3f} mm/s" if rolls else "slides"
        print(f"{heading:6.0f}°  {upper:9.2f}°  {back}")
    print(f"no dumbbell rests beyond {math.degrees(result.limit):.2f}°")
    print(f"the length changes this by {result.difference:.3f}° at most, order {result.order:.2f}")
    print(f"wrote {draw(Path(sys.argv[1] if len(sys.argv) > 1 else 'out') / 'ex11_keel.png')}")
