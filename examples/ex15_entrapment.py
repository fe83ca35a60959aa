"""
Three kinds of wells
====================

Escape of a mass from U, half-U and half-V wells, and the wells that hold a dyad.

The paper orders them by strength.  Here masses are shaken by the same noise in wells of the same
rim and depth.  With little drag and absorbing walls, the order is the paper's: half-V holds longer
than half-U, and half-U longer than U.  With elastic walls half-U is the folded U, and escape from
half-V is the fastest; if drag outweighs inertia, it is so with any wall.

Without noise a half-V well brings the mass to its wall in finite time, even against friction, which
stops it beside the bottom of the other two.

The dyad's corner is held by half-V wells in the three directions that open a contact, and by U
wells in two.  Near the corner the former are the stronger ones; beyond about half a millimetre the
U wells have overtaken the contact between the balls.

Run it to draw the figure, which takes about a minute:
``python examples/ex15_entrapment.py [FOLDER]``.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.wells import Agitation, Hold, dyad_holds, hold_times
from polycorner.models.wells import (
    Escapes,
    Well,
    escapes,
    kick_of,
    ladder,
    mean_escape_time,
    overdamped_escape_time,
)

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
DEPTH, DRAG = 1.5, 0.8  # units of the temperature, of sqrt(m T) / a
SHAKING = Agitation(energy=1e-3, drag_rate=5.0)  # weight of a ball times mm, 1/s
NEAR = 0.2  # mm


@dataclass(frozen=True)
class Result:
    """Escape and capture, each for U, half-U and half-V; and the wells of a dyad.

    ``absorbing`` are simulations and ``expected`` what the backward equation gives for them;
    ``elastic`` are times from that equation behind elastic walls, ``overdamped`` those in the
    limit of large drag.  ``captures`` are times and final positions.  ``hold_times`` are in s, one
    for each of ``holds`` but the last, which is free.
    """

    absorbing: list[Escapes]
    expected: list[float]
    elastic: list[float]
    overdamped: list[float]
    captures: list[tuple[float, float]]
    holds: tuple[Hold, ...]
    hold_times: list[float]


def main() -> Result:
    wells = ladder(DEPTH, drag=DRAG)
    expected = times(wells)
    measured = zip(wells, expected, strict=True)
    lossy = ladder(1.0, friction=0.04, restitution=0.6)
    holds = dyad_holds(PAIR)
    return Result(
        absorbing=[escapes(w, kick_of(w, 1.0), count=200, duration=12 * t) for w, t in measured],
        expected=expected,
        elastic=times(ladder(DEPTH, drag=DRAG, restitution=1.0)),
        overdamped=[overdamped_escape_time(well, kick_of(well, 1.0)) for well in wells],
        captures=[well.capture(1.0) for well in lossy],
        holds=holds,
        hold_times=hold_times(holds[:-1], [NEAR], SHAKING)[:, 0].tolist(),
    )


def times(wells: Sequence[Well]) -> list[float]:
    return [mean_escape_time(well, kick_of(well, 1.0), cells=40) for well in wells]


def draw(path: Path, count: int = 40) -> Path:
    """Draw wells, paths, times to escape, capture, and the wells of the dyad."""
    from polycorner.dumbbells.pictures import draw_wells
    from polycorner.models.wells import compare
    from polycorner.pictures import save

    return save(draw_wells(compare(count=count), PAIR), path)


if __name__ == "__main__":
    result = main()
    print("          walls absorb: measured, expected   elastic   overdamped   rests when, where")
    for run, a, b, c, (when, where) in zip(
        result.absorbing,
        result.expected,
        result.elastic,
        result.overdamped,
        result.captures,
        strict=True,
    ):
        low, high = run.interval()
        print(
            f"{run.well.kind.value:<8}  {run.mean:8.1f} ({low:.1f} to {high:.1f}), {a:8.1f}"
            f"   {b:7.1f}   {c:10.3f}   {when:7.2f}, {where:.4f} a"
        )
    print(f"\ndyad, noise of {1e3 * SHAKING.energy:g} µm times the weight of a ball:")
    for hold, time in zip(result.holds, result.hold_times, strict=False):
        print(
            f"{hold.direction:<24} {hold.kind.value:<7} slope {hold.slope:.5f},"
            f" stiffness {hold.stiffness:.4f}/mm:  {NEAR} mm in {time:6.2f} s"
        )
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(folder / 'ex15_entrapment.png')}")
