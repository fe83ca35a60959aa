"""
A heap in a turning drum
========================

Six hundred discs with friction fall to the bottom of a drum and are carried round.  They touch in
one island of thousands of contacts, over which a few sweeps go in each step: what that leaves open
is told, and two laws say whether it matters.

- Energy: what discs have gained is what the wall has worked, less what contacts have dissipated.
- Angular momentum about the axis: the wall's torque, by its work over its angular speed, is what
  the discs' angular momentum has gained, and what gravity took away, which places and velocities
  say alone.

Run it to draw the figure, and a film: ``python examples/ex28_heap_in_drum.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import Trajectory
from polycorner.bodies import Arrangement, Cylinder, disc
from polycorner.motion import Solver, simulate
from polycorner.toolkit import Array

COUNT, GRAVITY, FRICTION, SPIN = 600, 981.0, 0.5, 1.5  # of discs of radius 1 cm; rad/s
DRUM = math.sqrt(COUNT / 0.42)  # radius of the drum, in cm: it is half full
DT, DURATION, EVERY = 1e-3, 2.4, 20
SOLVER = Solver(tolerance=1e-4, crowd_sweeps=20, threads=2)
COLOURS = "#0072B2", "#E69F00", "#009E73", "#CC79A7"


@dataclass(frozen=True)
class Result:
    """The motion, and by how much two laws of it are missed.

    ``energy`` is relative to the energy that was moved, ``momentum`` to the largest impulse of the
    wall's torque; ``torque`` and ``expected`` are that impulse in time, from work and from places.
    """

    path: Trajectory
    energy: float
    momentum: float
    torque: Array
    expected: Array


def main(duration: float = DURATION) -> Result:
    wall = {"drum": Cylinder(DRUM, spin=SPIN)}
    discs = Arrangement({"disc": disc(1.0)}, wall, orientations="all").system(
        gravity=[0, -GRAVITY], friction=FRICTION, count=COUNT
    )
    path = simulate(discs, discs.state(loose_rows()), duration, DT, every=EVERY, solver=SOLVER)
    torque = path.work["substrate"] / SPIN
    expected = impulse_of_wall(path)
    missed = np.abs(torque - expected).max() / np.abs(expected).max()
    return Result(path, path.audit, float(missed), torque, expected)


def loose_rows() -> Array:
    """Return discs in rows near the bottom that do not touch, ``(COUNT, 3)``."""
    most = int(DRUM / 2) + 1
    grid = np.array([(i, j) for j in range(-most, most + 1) for i in range(-most, most + 1)])
    places = np.column_stack([2.05 * (grid[:, 0] + (grid[:, 1] % 2) / 2), 1.9 * grid[:, 1]])
    inside = places[np.hypot(*places.T) < DRUM - 1.05]
    lowest = inside[np.argsort(inside[:, 1], kind="stable")[:COUNT]]
    return np.column_stack([lowest, np.zeros(COUNT)])


def impulse_of_wall(path: Trajectory) -> Array:
    """Return the impulse of the wall's torque about the axis, from places and velocities."""
    mass, inertia = math.pi, math.pi / 2
    x, y = path.q[..., 0], path.q[..., 1]
    vx, vy, turning = np.moveaxis(path.v, -1, 0)
    momentum = (mass * (x * vy - y * vx) + inertia * turning).sum(axis=1)
    pull = -mass * GRAVITY * x.sum(axis=1)
    steps = np.diff(path.times) * (pull[1:] + pull[:-1]) / 2
    return momentum - momentum[0] - np.concatenate([[0.0], np.cumsum(steps)])


def layers(path: Trajectory) -> list[str]:
    """Return the colour of every disc: that of its layer at the start."""
    rank = np.argsort(np.argsort(path.q[0, :, 1], kind="stable"), kind="stable")
    return [COLOURS[4 * r // COUNT] for r in rank.tolist()]


def add_discs(axes: Any, path: Trajectory) -> Any:
    """Draw the drum and the discs, and return the collection of these."""
    from matplotlib.collections import EllipseCollection
    from matplotlib.patches import Circle

    axes.add_patch(Circle((0, 0), DRUM, fill=False, color="0.3"))
    size = np.full(COUNT, 2.0)
    discs = EllipseCollection(
        size, size, 0 * size, units="xy", facecolors=layers(path), transOffset=axes.transData
    )
    axes.add_collection(discs)
    edge = 1.01 * DRUM
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
    axes.set_axis_off()
    return discs


def draw(result: Result, target: Path) -> Path:
    """Draw four instants, and the impulse of the wall's torque."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    path = result.path
    figure = Figure(figsize=(9, 5.4), layout="constrained")
    panels = figure.subplot_mosaic(
        [["a", "b", "c", "d"], ["t", "t", "t", "t"]], height_ratios=[5, 4]
    )
    for name, index in zip(
        "abcd", np.linspace(0, len(path) - 1, 4).round().astype(int), strict=True
    ):
        add_discs(panels[name], path).set_offsets(path.q[index, :, :2])
        panels[name].set_title(f"{path.times[index]:.1f} s", fontsize=10)
    below = panels["t"]
    below.plot(path.times, result.torque / 1e7, color="#0072B2", label="from its work")
    below.plot(path.times, result.expected / 1e7, "--", color="#D55E00", label="from the discs")
    below.set(xlabel="time (s)", ylabel="impulse of the wall's torque\n(kg m² / s, per cm)")
    below.legend(frameon=False)
    return save(figure, target)


def film(path: Trajectory, target: Path) -> Path:
    """Write a film of the motion as a GIF, in a fifth of its speed."""
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4, 4))
    FigureCanvasAgg(figure)
    discs = add_discs(figure.add_axes((0, 0, 1, 1)), path)

    def show(index: int) -> tuple[Any]:
        discs.set_offsets(path.q[index, :, :2])
        return (discs,)

    moving = FuncAnimation(figure, show, frames=range(0, len(path), 2))
    target.parent.mkdir(parents=True, exist_ok=True)
    moving.save(target, PillowWriter(fps=5), dpi=80)
    return target


if __name__ == "__main__":
    result = main()
    print(
        f"islands left unsolved: {result.path.effort.unconverged} of {result.path.effort.islands}"
    )
    print(f"the energy misses {result.energy:.1e} of what was moved")
    print(f"angular momentum misses {result.momentum:.1e} of what the wall gave")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex28_heap_in_drum.png')}")
    print(f"wrote {film(result.path, folder / 'ex28_heap_in_drum.gif')}")
