"""
Impacts, and piles at rest
==========================

Several contacts at once: balls in a row, a block that rocks, a stack and a table that rest.

- Three equal balls: if the last two touch, Newton's law in Moreau's form sends ``(1, 0, 0)`` to
  ``(-1, 2, 2) / 3``; if they are apart, however little, to ``(0, 0, 1)``.  Both conserve momentum
  and energy: the model of rigid bodies does not determine the outcome.
- A block that rocks changes feet: it rotates on with ``1 - 3/2 sin(c)^2`` of its angular speed.
- A table on four legs and a stack of boxes have more contact forces than equilibrium determines.
  Balancing forces are found, and no coordinate changes by a single bit.

Run it to draw the figure: ``python examples/ex14_impact_and_stack.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner import System, Trajectory, simulate
from polycorner.models.supports import stack, table
from polycorner.models.textbook import GRAVITY, box_on_plane, row_of_balls
from polycorner.motion import Disc, Interval
from polycorner.toolkit import Array

HALF_WIDTH, HALF_HEIGHT, TILT = 0.35, 1.0, 0.25
SLENDER = math.atan(HALF_WIDTH / HALF_HEIGHT)
BOXES, SLOPE = 5, 0.1
STEP = 2e-4


@dataclass(frozen=True)
class Result:
    """Velocities of balls, a rocking block, and bodies at rest.

    ``touching`` and ``apart`` are velocities after the impacts; ``kept`` the share of the angular
    speed after the first change of feet and ``housner`` that of the formula; ``moved`` the largest
    displacement of stack and table, ``carried`` the sums of their contact forces over their weight.
    """

    touching: Array
    apart: Array
    rocking: Trajectory
    kept: float
    housner: float
    moved: tuple[float, float]
    carried: tuple[Array, float]


def main() -> Result:
    rocking = rocked()
    boxes = stack(BOXES, Interval(0.5), angle=SLOPE)
    levels = [c for i in range(BOXES) for c in (0.0, 0.5 + i, 0.0)]
    standing, legs = rested(boxes, levels), rested(table(Disc(0.5), angle=SLOPE), [0.0] * 6)
    return Result(
        touching=struck(0.0),
        apart=struck(0.1),
        rocking=rocking,
        kept=kept(rocking),
        housner=1 - 3 / 2 * math.sin(SLENDER) ** 2,
        moved=(moved(standing), moved(legs)),
        carried=(forces(standing).reshape(BOXES, 2).sum(axis=1), float(forces(legs).sum())),
    )


def struck(gap: float) -> Array:
    """Return the velocities after the first of three balls has hit the second."""
    balls = row_of_balls((1.0, 1.0, 1.0), 1.0)
    path = simulate(balls, balls.state([0.0, 1.5, 2.5 + gap], [1.0, 0.0, 0.0]), 1.0, 1e-3)
    return path.v[-1, 0]


def rocked() -> Trajectory:
    """Tilt the block about its left foot and release it."""
    block = box_on_plane(HALF_WIDTH, HALF_HEIGHT, Interval(2.0))
    cos, sin = math.cos(TILT), math.sin(TILT)
    place = [HALF_WIDTH * cos - HALF_HEIGHT * sin, HALF_WIDTH * sin + HALF_HEIGHT * cos, TILT]
    return simulate(block, block.state(place), 6.0, STEP, every=5)


def kept(path: Trajectory) -> float:
    """Return the remaining share of the angular speed, from the energy before and after."""
    lost = path.dissipated["impact"]
    first = int(np.argmax(path.q[:, 0, 2] < -0.01))  # well after the first change of feet
    size = math.hypot(HALF_WIDTH, HALF_HEIGHT)
    swing = GRAVITY * size * (math.cos(SLENDER - TILT) - math.cos(SLENDER))
    return math.sqrt(1 - float(lost[first]) / swing)


def rested(system: System, place: list[float]) -> Trajectory:
    """Simulate a system at rest for ten seconds."""
    return simulate(system, system.state(place), 10.0, 1e-3)


def moved(path: Trajectory) -> float:
    """Return the largest displacement."""
    return float(np.abs(path.q - path.q[0]).max())


def forces(path: Trajectory) -> Array:
    """Return the forces of all contacts at the end, over the weight of one body on the slope."""
    return np.array([force for _, _, force in path.touching[-1]]) / (GRAVITY * math.cos(SLOPE))


def draw(result: Result, path: Path) -> Path:
    """Draw the tilt of the block and its energy against time."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    motion = result.rocking
    figure = Figure(figsize=(8, 5.2), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(motion.times, np.degrees(motion.q[:, 0, 2]), color="#0072B2")
    above.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    rest = motion.potential.min()
    below.plot(motion.times, motion.kinetic + motion.potential - rest, color="#D55E00")
    above.set(ylabel="tilt (degrees)", title="a block rocks to rest")
    below.set(ylabel="energy (J)", xlabel="time (s)", ylim=(0, None))
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(f"three balls that touch: {np.round(result.touching, 4)}, apart: {result.apart}")
    print(f"a change of feet keeps {result.kept:.4f} of the spin, formula {result.housner:.4f}")
    print(f"stack and table have moved by {result.moved[0]:g} and {result.moved[1]:g}")
    print(f"the boxes carry {np.round(result.carried[0], 9)} of a box's weight across the slope")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex14_impact_and_stack.png')}")
