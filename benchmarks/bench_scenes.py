"""The same scenes of rigid bodies for polycorner, MuJoCo and Pymunk, side by side.

Boxes, discs, rods and balls fall into a tray and come to rest, and an arm of two links falls on a
floor: shapes, masses, coefficient of friction (0.3), starts and steps are the same, contacts are
plastic, and every engine has one thread and what its users get, but for MuJoCo's contacts, which
are as stiff as its step allows.  Rounds repeat the whole motion.

*Overlap* is the deepest one, over the size of the smallest body; *energy* the most that the total
grew by, which it never should, over what all bodies gain when they fall by the size of the largest;
*off* how far the centre of all masses strays from the engine's own at an eighth of the step, in
sizes of the largest body, and *from ours* from polycorner's at an eighth.  Both are about
convergence where a scene has one answer, as the arm has; in heaps that depend on the last bits they
are about the height of the heap.  A scene that an engine does not take is left out, and its words
are printed.  *First* is the time, in s of the processor and by the clock, from starting an
interpreter to the tenth step, with an empty cache (``--first``).
"""

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scene_engines import ENGINES, Engine, Moved
from scenes import DT, SCENES, Scene
from side_by_side import interleave, print_table, ratio, write

from polycorner import checks
from polycorner.spaces.manifold import Array

OURS, ROUNDS, RECORDS, FINER, TENTH = "polycorner", 3, 20, 8, 10
REFUSALS = (AttributeError, ImportError, OSError, RuntimeError, TypeError, ValueError)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=[*SCENES])
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=[*ENGINES])
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--dt", type=float, default=DT)
    parser.add_argument("--finer", action="store_true", help="compare with an eighth of the step")
    parser.add_argument("--first", action="store_true", help="time the first steps as well")
    parser.add_argument("--seconds", type=float, default=300.0, help="for a first motion")
    parser.add_argument("--tenth", nargs=2, metavar=("SCENE", "ENGINE"), help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.tenth:
        built = ENGINES[chosen.tenth[1]](SCENES[chosen.tenth[0]](), chosen.dt)
        built.move(TENTH, 1)
        return
    rounds = checks.whole("--rounds", chosen.rounds, least=1)
    dt = checks.real("--dt", chosen.dt, above=0, unit="s")
    found = {}
    for name in chosen.scenes:
        options = chosen.engines, rounds, chosen.seconds
        figures = measured(SCENES[name](), dt, *options, finer=chosen.finer)
        if chosen.first:
            figures = {e: row | first(name, e, chosen.seconds) for e, row in figures.items()}
        found[name] = figures
        columns = list(dict.fromkeys(key for row in figures.values() for key in row))
        rows = [[e, *(row.get(c, "") for c in columns)] for e, row in figures.items()]
        print_table(f"{name}, steps of {1e3 * dt:g} ms", ["", *columns], rows)
    write("scenes", {"step, s": dt, "scenes": found})


def measured(
    scene: Scene, dt: float, names: Sequence[str], rounds: int, seconds: float, *, finer: bool
) -> dict[str, dict[str, Any]]:
    """Return the figures of all engines that take the scene."""
    steps = round(scene.duration / dt)
    tried = {name: tried_with(name, scene, dt, seconds, finer=finer) for name in names}
    taken = {name: found for name, found in tried.items() if found is not None}
    tasks = {name: moving(engine, steps) for name, (engine, _, _) in taken.items()}
    times = interleave(tasks, rounds, time.process_time)
    figures: dict[str, dict[str, Any]] = {}
    for name, (engine, path, fine) in taken.items():
        speed = steps / median(times[name])
        row: dict[str, Any] = {"steps a second": round(speed), "of real time": rounded(speed * dt)}
        if OURS in taken:
            row["time over ours"] = rounded(ratio(times[name], times[OURS]))
        row["overlap"] = rounded(max(map(scene.overlap, path.q)))
        row["energy"] = rounded(growth(scene, path))
        if engine.unsolved is not None:
            row["unsolved"] = engine.unsolved
        if fine is not None:
            row["off"] = rounded(stray(scene, path, fine))
            ours = taken[OURS][2] if OURS in taken else None
            row |= {} if ours is None else {"from ours": rounded(stray(scene, path, ours))}
        figures[name] = row
    return figures


def tried_with(
    name: str, scene: Scene, dt: float, seconds: float, *, finer: bool
) -> tuple[Engine, Moved, Moved | None] | None:
    """Return an engine with its motion, and that at an eighth of the step; None if it refuses."""
    steps, fine = round(scene.duration / dt), None
    try:
        with at_most(seconds):
            engine = ENGINES[name](scene, dt)
            path = engine.move(steps, RECORDS)
        if finer:
            fine = ENGINES[name](scene, dt / FINER).move(FINER * steps, RECORDS)
    except REFUSALS as error:
        print(f"{name}: not taken: {type(error).__name__}: {str(error)[:200]}")
        return None
    return engine, path, fine


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError after so many seconds of the processor, where Python can."""

    def stop(*_: object) -> None:
        msg = f"still at it after {seconds:g} s of the processor"
        raise TimeoutError(msg)

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def moving(engine: Engine, steps: int) -> Callable[[], object]:
    """Return the task that moves a scene from its start."""
    return lambda: engine.move(steps, RECORDS)


def growth(scene: Scene, path: Moved) -> float:
    """Return the most that the energy grew by from an earlier instant, over the scene's scale."""
    energies = np.array([scene.energy(q, v) for q, v in zip(path.q, path.v, strict=True)])
    return float((energies - np.minimum.accumulate(energies)).max()) / scene.scale()


def stray(scene: Scene, path: Moved, other: Moved) -> float:
    """Return how far the centre of all masses of one motion gets from that of another one."""
    size = max(body.size for body in scene.bodies)
    apart = [centre(scene, a) - centre(scene, b) for a, b in zip(path.q, other.q, strict=True)]
    return float(np.linalg.norm(apart, axis=1).max()) / size


def centre(scene: Scene, q: Array) -> Array:
    """Return the centre of all masses."""
    masses = scene.masses[:, 0]
    return np.asarray(masses @ q[:, : scene.dimension] / masses.sum())


def first(scene: str, engine: str, seconds: float) -> dict[str, Any]:
    """Return the time to the tenth step of a fresh interpreter with an empty cache."""
    command = [sys.executable, __file__, "--tenth", scene, engine]
    with tempfile.TemporaryDirectory() as cache:
        environment = os.environ | {"POLYCORNER_CACHE_DIR": cache}
        before, clock = os.times(), time.perf_counter()
        with contextlib.suppress(subprocess.TimeoutExpired):
            subprocess.run(
                command,
                check=True,
                env=environment,
                capture_output=True,
                timeout=seconds,
                cwd=Path(__file__).parent,
            )
        wall, after = time.perf_counter() - clock, os.times()
    spent = after.children_user - before.children_user
    spent += after.children_system - before.children_system
    over = "over " if wall >= seconds else ""
    return {"first, processor": f"{spent:.1f}", "first, clock": f"{over}{wall:.1f}"}


def rounded(value: float) -> float:
    return float(f"{value:.2g}")


if __name__ == "__main__":
    main()
