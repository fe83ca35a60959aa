"""
In which pocket a ball ends
===========================

A ball that sinks slowly over a pinball board, and the pockets in which it comes to rest.

On the tip of a roof, a concave corner of the polyhedron, the motion goes on to either side.
``simulate`` stops there, says which pieces lie beyond, and goes on in each on request: a tree,
whose leaves are pockets.  With a little noise each drop takes one of these ways, and hundreds of
them give the probabilities of the pockets with errors; more noise blurs them.

Run it to draw the ways: ``python examples/ex38_pinball_pockets.py [FOLDER]``.
"""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from polycorner import Drift, State, Trajectory, simulate
from polycorner.models import Pinball
from polycorner.motion import Noise

ROOFS = (
    ((3.0, 6.5), (2.2, 5.7), (3.8, 5.7)),
    ((2.2, 4.6), (1.3, 3.7), (3.1, 3.7)),
    ((3.8, 4.6), (2.9, 3.7), (4.7, 3.7)),
)
BOARD = Pinball(
    pins=((4.9, 2.0, 0.4),), wedges=ROOFS, cups=((1.3, 2.2, 0.5, 0.65),), tilt=math.pi / 2
)
POCKETS = {"cup": (1.3, 1.7), "valley": (3.0, 3.8), "floor": (math.nan, 0.0)}
DROP, DURATION, STEP = (3.0, 7.5), 12.0, 0.02
NOISES = 1e-3, 1e-1  # over the weight of the ball: a height


def ways(drift: Drift, state: State) -> Iterator[Trajectory]:
    """Yield the motions, one after each corner, through all continuations."""
    path = simulate(drift, state, DURATION, STEP)
    yield path
    for after in path.splits[0].states if path.splits else ():
        yield from ways(drift, after)


def pocket(x: float, y: float) -> str:
    """Return the pocket in which a ball is, the nearest one."""
    away = {
        name: math.hypot(0.0 if math.isnan(px) else x - px, y - py)
        for name, (px, py) in POCKETS.items()
    }
    return min(away, key=lambda name: away[name])


def probabilities(noise: float, count: int, seed: int) -> dict[str, tuple[float, float]]:
    """Return how often a ball ends in each pocket, with the standard error."""
    drift = Drift(BOARD.polyhedron, potential=BOARD.energy, noise=noise, count=count)
    start = drift.state(np.full((count, 2), DROP))
    ends = simulate(drift, start, DURATION, STEP, noise=Noise(seed=seed)).q[-1]
    found = [pocket(*end) for end in ends.tolist()]
    shares = {name: found.count(name) / count for name in POCKETS}
    return {name: (p, math.sqrt(p * (1 - p) / count)) for name, p in shares.items()}


def main(count: int = 400) -> tuple[list[Trajectory], dict[float, dict[str, tuple[float, float]]]]:
    """Return the motions through all corners, and the probabilities of the pockets by noise."""
    quiet = Drift(BOARD.polyhedron, potential=BOARD.energy)
    tree = list(ways(quiet, quiet.state(DROP)))
    return tree, {noise: probabilities(noise, count, seed=1) for noise in NOISES}


def draw(tree: list[Trajectory], path: Path) -> Path:
    from polycorner.pictures import draw_region, save

    figure = draw_region(BOARD.polyhedron, (-0.25, BOARD.width + 0.25, -0.25, BOARD.height + 0.25))
    axes = figure.axes[0]
    for motion in tree:
        axes.plot(*motion.q[:, 0].T, color="C1")
        for split in motion.splits:
            axes.plot(*split.q, "o", color="C3")
    return save(figure, path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    motions, shares = main()
    for motion in motions:
        if not motion.splits:
            print(f"without noise: {pocket(*motion.q[-1, 0].tolist())}")
    for noise, found in shares.items():
        told = ", ".join(f"{name} {p:.3f} +- {error:.3f}" for name, (p, error) in found.items())
        print(f"noise {noise:g}: {told}")
    print(f"wrote {draw(motions, folder / 'ex38_pinball_pockets.png')}")
