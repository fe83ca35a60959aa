"""
What the floor of a silo bears
==============================

Rods and discs of two sizes are poured into a silo: three kinds of bodies, each with its own
coordinates, mass and contacts, in one system.  When they are at rest

- walls without friction bear no weight, and the floor bears all of it;
- walls with friction bear a part ([Janssen]); which, depends on how the grains came to lie.

Forces of the floor are those of the contacts in the trajectory, by kind; the weight is that of the
areas.

Run it to draw the figure: ``python examples/ex32_silo.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import Trajectory, simulate
from polycorner.bodies import Arrangement, HalfSpace, capsule, disc
from polycorner.toolkit import Array

HALF, THIN, LARGE, SMALL = 1.0, 0.3, 0.75, 0.45  # of the rods; radii of the discs, in cm
COUNT = {"rod": 15, "large": 20, "small": 35}
COLOURS = {"rod": "#D55E00", "large": "#0072B2", "small": "#56B4E9"}
AREAS = {
    "rod": 4 * HALF * THIN + math.pi * THIN**2,
    "large": math.pi * LARGE**2,
    "small": math.pi * SMALL**2,
}
WIDTH, GRAVITY, GRAINS, WALLS = 7.0, 981.0, 0.3, 0.6  # coefficients of friction
DT, DURATION, EVERY, SEED = 1e-3, 1.2, 10, 0


@dataclass(frozen=True)
class Result:
    """The motion with and without friction of the walls, and what the floor bears in each.

    ``floor`` is the force on the floor over the weight at each instant, ``(T,)``.
    """

    rough: Trajectory
    smooth: Trajectory
    floor: dict[str, Array]


def main(duration: float = DURATION) -> Result:
    rough, smooth = poured(WALLS, duration), poured(0.0, duration)
    return Result(rough, smooth, {"rough": borne(rough), "smooth": borne(smooth)})


def poured(walls: float, duration: float) -> Trajectory:
    """Return the motion of the mixture, with this friction at the walls."""
    silo = {
        "floor": HalfSpace([0, 1], [0, 0]),
        "left": HalfSpace([1, 0], [0, 0]),
        "right": HalfSpace([-1, 0], [WIDTH, 0]),
    }
    kinds = {
        "rod": capsule([-HALF, 0], [HALF, 0], THIN),
        "large": disc(LARGE),
        "small": disc(SMALL),
    }
    contacts = [f"rod.v{end}" for end in (1, 2)] + ["large", "small"]
    friction = dict.fromkeys(kinds, GRAINS)
    friction |= {f"{name}-{side}": walls for name in contacts for side in ("left", "right")}
    system = Arrangement(kinds, silo, orientations="all").system(
        gravity=[0, -GRAVITY], friction=friction, count=COUNT
    )
    return simulate(system, system.state(in_rows()), duration, DT, every=EVERY)


def in_rows() -> dict[str, Array]:
    """Return all bodies in loose rows, in an order that is drawn."""
    rng, names = (
        np.random.default_rng(SEED),
        [n for n, count in COUNT.items() for _ in range(count)],
    )
    widths = {"rod": 2 * (HALF + THIN), "large": 2 * LARGE, "small": 2 * SMALL}
    found: dict[str, list[list[float]]] = {name: [] for name in COUNT}
    x, y, step = 0.0, LARGE, 2.05 * LARGE
    for name in rng.permutation(names).tolist():
        if x + widths[name] > 0.98 * WIDTH:
            x, y = 0.0, y + step
        found[name].append([x + 0.02 + widths[name] / 2, y, 0.0])
        x += widths[name] + 0.02
    return {name: np.array(places) for name, places in found.items()}


def borne(path: Trajectory) -> Array:
    """Return the force on the floor at each instant, over the weight of all bodies."""
    weight = GRAVITY * sum(AREAS[name] * count for name, count in COUNT.items())
    forces = [
        sum(force for _, contact, force in touches if contact.endswith("floor"))
        for touches in path.touching
    ]
    return np.array(forces) / weight


def add_bodies(axes: Any, path: Trajectory) -> None:
    """Draw all bodies where they are at last."""
    from matplotlib.collections import EllipseCollection

    axes.plot([0, 0, WIDTH, WIDTH], [18, 0, 0, 18], color="0.3")
    for x, y, angle in path["rod"].q[-1].tolist():
        dx, dy = HALF * math.cos(angle), HALF * math.sin(angle)
        axes.fill(
            *outline(x, y, dx, dy), facecolor=COLOURS["rod"], edgecolor="white", linewidth=0.5
        )
    for name, radius in (("large", LARGE), ("small", SMALL)):
        places = path[name].q[-1, :, :2]
        size = np.full(len(places), 2 * radius)
        discs = EllipseCollection(
            size, size, 0 * size, units="xy", offsets=places, transOffset=axes.transData
        )
        discs.set(facecolor=COLOURS[name], edgecolor="white", linewidth=0.5)
        axes.add_collection(discs)
    axes.set(xlim=(-0.3, WIDTH + 0.3), ylim=(-0.3, 18), aspect="equal")
    axes.set_axis_off()


def outline(x: float, y: float, dx: float, dy: float) -> tuple[Array, Array]:
    """Return the outline of a rod with ends ``(x, y) +- (dx, dy)``."""
    turn = math.atan2(dy, dx) + np.linspace(-math.pi / 2, math.pi / 2, 24)
    one = np.array([x + dx + THIN * np.cos(turn), y + dy + THIN * np.sin(turn)])
    other = np.array([x - dx - THIN * np.cos(turn), y - dy - THIN * np.sin(turn)])
    xs, ys = np.concatenate([one, other], axis=1)
    return xs, ys


def draw(result: Result, target: Path) -> Path:
    """Draw both silos at last, and what their floors bear."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(9, 5), layout="constrained")
    panels = figure.subplot_mosaic([["smooth", "rough", "t"]], width_ratios=[3, 3, 6])
    for name, path in (("smooth", result.smooth), ("rough", result.rough)):
        add_bodies(panels[name], path)
        panels[name].set_title(f"{name} walls", fontsize=10)
        panels["t"].plot(path.times, result.floor[name], label=f"{name} walls")
    panels["t"].axhline(1.0, color="0.7", linewidth=0.8)
    panels["t"].set(xlabel="time (s)", ylabel="force on the floor over the weight", ylim=(0, 2))
    panels["t"].legend(frameon=False)
    return save(figure, target)


if __name__ == "__main__":
    result = main()
    for name, share in result.floor.items():
        print(f"{name} walls: the floor bears {share[-20:].mean():.3f} of the weight")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex32_silo.png')}")
