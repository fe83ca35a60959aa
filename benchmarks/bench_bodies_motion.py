"""Rigid dumbbells in space in motion: sixty in a turning drum beside MuJoCo, several on a floor.

In the drum, steps of a millisecond of four kinds of motion: *rows* side by side that the drum
carries, *falling* into it, in the *heap* they then are, and in a *bunch* on its bottom.  Every
round repeats the same steps from the same state, which each engine has reached by itself.  Overlaps
are those of the exact shapes at the ends of steps, also for MuJoCo's drum of boxes.  MuJoCo's cost
is also given for a drum of half as many boxes (faster, coarser), and for friction that is as soft
as MuJoCo's default (faster, bodies at rest creep).  The clock is that of the processor; each engine
has one thread.  ``--scenes`` and ``--rounds`` make shorter runs.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from bodies_in_drum import (
    BALL,
    DENSITY,
    DT,
    FRICTION,
    GRAVITY,
    TOLERANCE,
    Motion,
    PolycornerMotion,
    bunch_of,
    deepest_overlap,
    dumbbell,
    heap_of,
    rows_of,
)
from mujoco_bodies import MujocoMotion
from side_by_side import interleave, print_table, ratio, write

from polycorner import checks, simulate
from polycorner.bodies import Arrangement, HalfSpace
from polycorner.spaces.manifold import Array

OURS = "polycorner"
TOLERANCES = {OURS: TOLERANCE, f"{OURS}, tolerance 1e-4": 1e-4}
THEIRS: dict[str, dict[str, Any]] = {
    "MuJoCo": {},
    "MuJoCo, 360 boxes": {"segments": 360},
    "MuJoCo, impratio 1": {"impratio": 1.0},
}
ROUNDS = 5
COUNT = 60  # dumbbells in the drum
FLOOR_COUNTS = (1, 4, 12)
FLOOR_STEPS = 200


class Scene(NamedTuple):
    """Dumbbells in the drum, from ``start(count)``; the steps ``first`` to ``last`` are timed."""

    start: Callable[[int], Array]
    first: int
    last: int


SCENES = {
    "rows": Scene(rows_of, 0, 500),
    "falling": Scene(heap_of, 0, 100),
    "heap": Scene(heap_of, 100, 200),
    "bunch": Scene(bunch_of, 500, 700),
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=[*SCENES])
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args(arguments)
    rounds = checks.whole("--rounds", options.rounds, least=1)
    figures = {}
    for name in options.scenes:
        figures[name] = in_drum(SCENES[name], COUNT, rounds)
        columns = list(figures[name][OURS])
        rows = [[engine, *row.values()] for engine, row in figures[name].items()]
        print_table(f"{COUNT} dumbbells in a drum, {name}", ["", *columns], rows)
    floor = {str(count): on_floor(count, rounds) for count in FLOOR_COUNTS}
    rows = [(count, f"{value:.0f}") for count, value in floor.items()]
    print_table("Dumbbells on a floor, steps of 1 ms", ["dumbbells", "steps a second"], rows)
    write("bodies_motion", {"drum": figures, "floor, steps a second": floor})


def engines(placements: Array) -> dict[str, Motion]:
    """Return the motions by every engine, polycorner's default first."""
    motions: dict[str, Motion] = {
        name: PolycornerMotion(placements, tolerance) for name, tolerance in TOLERANCES.items()
    }
    if find_spec("mujoco") is None:
        print("MuJoCo is left out: it is not installed; `pip install '.[bench]'`.")
    else:
        motions |= {name: MujocoMotion(placements, **some) for name, some in THEIRS.items()}
    return motions


def in_drum(scene: Scene, count: int, rounds: int) -> dict[str, dict[str, Any]]:
    """Return speeds, overlaps and islands left unsolved of every engine, side by side."""
    figures, tasks = {}, {}
    steps = scene.last - scene.first
    for name, motion in engines(scene.start(count)).items():
        motion.advance(scene.first)
        figures[name] = watched(motion, steps)
        tasks[name] = repeated(motion, steps)
    times = interleave(tasks, rounds, time.process_time)
    for name, taken in times.items():
        speed = steps / statistics.median(taken)
        figures[name] = {
            "steps a second": round(speed),
            "times real time": round(speed * DT, 2),
            "time over ours": round(ratio(taken, times[OURS]), 2),
            **figures[name],
        }
    return figures


def watched(motion: Motion, steps: int) -> dict[str, Any]:
    """Return the deepest overlap in the next steps, and the islands left unsolved; then go back."""
    saved, before, deepest = motion.save(), motion.unsolved, 0.0
    for _ in range(steps):
        motion.advance(1)
        deepest = max(deepest, deepest_overlap(motion.placements()))
    missed = None if motion.unsolved is None else motion.unsolved - (before or 0)
    motion.load(saved)
    return {
        "deepest overlap, mm": float(f"{deepest:.2g}"),
        "islands unsolved": "–" if missed is None else missed,
    }


def repeated(motion: Motion, steps: int) -> Callable[[], object]:
    """Return the task that makes the same steps again at every call."""
    saved = motion.save()

    def task() -> None:
        motion.load(saved)
        motion.advance(steps)

    return task


def on_floor(count: int, rounds: int) -> float:
    """Return steps a second of dumbbells that fall on a floor side by side and roll."""
    floor = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}
    body = Arrangement({"D": dumbbell([0, 0, 1])}, floor, orientations="all")
    system = body.system(
        gravity=[0, 2000.0, -GRAVITY], density=DENSITY, friction=FRICTION, count=count
    )
    quarter = np.sqrt(0.5)
    starts = [[0.0, 1.2 * BALL * 2 * k, BALL + 0.5, quarter, 0, quarter, 0] for k in range(count)]
    state = system.state(np.array(starts) if count > 1 else starts[0])
    run = {"": lambda: simulate(system, state, FLOOR_STEPS * DT, DT)}
    return FLOOR_STEPS / statistics.median(interleave(run, rounds, time.process_time)[""])


if __name__ == "__main__":
    main()
