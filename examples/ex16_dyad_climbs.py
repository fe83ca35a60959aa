"""
A dyad climbs
=============

Nested pairs of dumbbells in a tilted drum: right-handed ones climb, left-handed ones descend.

A single dumbbell begins to roll at the boundary of the region of rest, derived on paper, and climbs
at ``omega rho tan(theta)``.  A nested pair does the same, and does not lose its heading as easily:
a right-handed one, whose heading is positive, climbs, and its mirror image descends.  The model
contains nothing but friction on rigid axles.

Run it to draw the figure: ``python examples/ex16_dyad_climbs.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.dyads import DyadPaths, follow_dyads
from polycorner.dumbbells.dynamics.singles import Zigzag, follow, onset_azimuths, zigzags
from polycorner.toolkit import Array

DRUM = DumbbellDrum(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
HEADING = math.radians(8)  # near the minimum of the energy of the pair, 7.94 degrees
DURATION = 30.0  # s


@dataclass(frozen=True)
class Result:
    """Motion of single dumbbells and pairs with headings of 8 and -8 degrees, without noise.

    ``zigzags`` of the single ones, ``onsets`` of the formula in rad, ``law`` the speed of a perfect
    keel in mm/s.
    """

    zigzags: tuple[Zigzag, ...]
    onsets: Array
    law: float
    pairs: DyadPaths


def main() -> Result:
    headings = [HEADING, -HEADING]
    singles = follow(DRUM, headings, DURATION)
    return Result(
        zigzags=zigzags(singles, DRUM.spin),
        onsets=onset_azimuths(DRUM, headings),
        law=DRUM.spin * DRUM.centre_radius * math.tan(HEADING),
        pairs=follow_dyads(DRUM, [("R", HEADING), ("L", -HEADING)], DURATION),
    )


def draw(result: Result, path: Path) -> Path:
    """Draw axial positions and azimuths against time."""
    import numpy as np
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(8.5, 6.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    for k, (hand, colour) in enumerate((("right", "#0072B2"), ("left", "#009E73"))):
        times = result.pairs.times
        above.plot(times, result.pairs.eta[:, k], color=colour, label=f"{hand}-handed pair")
        for body in range(2):
            phi = np.degrees(result.pairs.q[:, k, body, 0])
            below.plot(times, phi, color=colour, linewidth=1.0, alpha=1.0 if body else 0.5)
    for sign in (1, -1):
        name = "perfect keel, ±ωρ tan θ" if sign > 0 else None
        above.plot(times, sign * result.law * times, ":", color="0.5", zorder=0.5, label=name)
    above.set(ylabel="axial position η (mm)")
    below.set(ylabel="azimuth φ (degrees)", xlabel="time (s)")
    above.legend()
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    for one, onset in zip(result.zigzags, result.onsets, strict=True):
        print(
            f"single, heading {math.degrees(one.heading[0]):5.1f}°: begins at "
            f"{math.degrees(one.upper[0]):.4f}° (formula {math.degrees(onset):.4f}°), climbs "
            f"{one.climb_rate:+.4f} mm/s (law {math.copysign(result.law, one.heading[0]):+.4f})"
        )
    rates = result.pairs.climb_rates(after=10.0)
    for sign, rate in zip(result.pairs.signs, rates, strict=True):
        print(f"{'right' if sign > 0 else 'left'}-handed pair: climbs {rate:+.4f} mm/s")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex16_dyad_climbs.png')}")
