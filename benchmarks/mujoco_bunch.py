"""The bunch of ``drum_in_space.py`` without noise, moved by MuJoCo: who leaves, with which hand.

Starts, drum, bottom and end are the same.  MuJoCo has one coefficient of friction where the drum
has a static and a dynamic one: the static ones by default, those of slip with ``--slipping``.  It
runs in one thread and cannot be resumed; an interrupt ends it with what was simulated so far.
"""

import argparse
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from drum_in_space import figures_of
from mjcf import DrumScene
from mujoco_drum import MujocoDrum
from numpy.typing import NDArray
from side_by_side import print_table, write

from polycorner import checks
from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import BunchRun, drum_for_bunch, scattered
from polycorner.spaces.manifold import Array

INTERVAL = 0.5  # s, between records
WATCHED = 0.01  # s, between looks at who has passed the end
AWAY = 1e5  # mm, where dumbbells that have left are put
REPORT = 30.0  # s of real time


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=60, help="dumbbells")
    parser.add_argument("--top", type=float, default=150.0, help="length of the drum, mm")
    parser.add_argument("--duration", type=float, default=1200.0, help="s")
    parser.add_argument("--dt", type=float, default=1e-3, help="s")
    parser.add_argument("--segments", type=int, default=720, help="boxes that make the drum")
    parser.add_argument("--impratio", type=float, default=100.0)
    parser.add_argument("--slipping", action="store_true", help="dynamic coefficients of friction")
    options = parser.parse_args(arguments)
    try:
        checks.whole("--starts", options.starts, least=1)
        checks.real("--dt", options.dt, above=0, most=WATCHED, unit="s")
        checks.real("--duration", options.duration, above=0, unit="s")
    except ValueError as error:
        parser.error(str(error))
    rows = []
    for start in range(options.first, options.first + options.starts):
        began = time.process_time()
        run = followed(options, start)
        spent = time.process_time() - began
        rows.append({"start": start, **figures_of(run), "processor, s": round(spent)})
    print_table(f"{options.count} dumbbells, MuJoCo", list(rows[0]), [[*r.values()] for r in rows])
    write("mujoco_bunch", {"settings": vars(options), "runs": rows})


@dataclass(frozen=True, eq=False)
class MujocoRun(BunchRun):
    """Records of placements ``(T, N, 4)``, of which dumbbells are present, and of exits."""

    recorded: Array
    here: NDArray[np.bool_]
    left: tuple[tuple[float, int], ...]
    of: DumbbellDrum

    @property
    def drum(self) -> DumbbellDrum:
        """The drum."""
        return self.of

    @property
    def times(self) -> Array:
        """Times of the records, ``(T,)``."""
        return INTERVAL * np.arange(len(self.recorded))

    @property
    def q(self) -> Array:
        """Placements."""
        return self.recorded

    @property
    def present(self) -> NDArray[np.bool_]:
        """Which dumbbells have not left."""
        return self.here

    @property
    def exits(self) -> tuple[tuple[float, int], ...]:  # type: ignore[override]  # is cached there
        """Time of leaving, and number."""
        return self.left


def followed(options: argparse.Namespace, start: int) -> MujocoRun:
    """Follow one start."""
    drum = drum_for_bunch(DumbbellDrum(), count=options.count, top=options.top)
    motion = MujocoDrum(scene(drum, options))
    motion.set_placements(scattered(drum, np.random.default_rng(start)))
    records, here = [motion.placements()], [np.ones(drum.count, dtype=bool)]
    left: list[tuple[float, int]] = []
    look, present, told = max(1, round(WATCHED / options.dt)), here[0].copy(), time.monotonic()
    with suppress(KeyboardInterrupt):
        while motion.data.time < options.duration - options.dt / 2:
            while motion.data.time < INTERVAL * len(records) - options.dt / 2:
                motion.step(look)
                for k in np.flatnonzero(present & (motion.placements()[:, 1] > drum.top)):
                    present[k] = False
                    left.append((float(motion.data.time), int(k)))
                take_out(motion, ~present)
            records.append(np.where(present[:, None], motion.placements(), records[-1]))
            here.append(present.copy())
            if time.monotonic() > told + REPORT:
                told = time.monotonic()
                print(f"start {start}: {motion.data.time:.0f} s, {len(left)} left", flush=True)
    return MujocoRun(None, np.array(records), np.array(here), tuple(left), drum)  # type: ignore[arg-type]  # no trajectory


def scene(drum: DumbbellDrum, options: argparse.Namespace) -> DrumScene:
    """Return the drum for MuJoCo, open at the top, beyond which it goes on."""
    which = 1 if options.slipping else 0
    return DrumScene(
        drum.length,
        drum.ball_radius,
        drum.rod_radius,
        drum.drum_radius,
        tilt=drum.tilt,
        spin=drum.spin,
        count=drum.count,
        ball_mass=drum.ball_mass,
        mu_slide=drum.sliding[which],
        mu_roll=drum.rolling[which],
        mu_contact=drum.rubbing[which],
        drum_length=2 * drum.top,
        dt=options.dt,
        segments=options.segments,
        impratio=options.impratio,
    )


def take_out(motion: MujocoDrum, gone: NDArray[np.bool_]) -> None:
    """Put dumbbells that have left away from the others, at rest."""
    model: Any = motion.model
    bodies = model.nbody - motion.scene.count + np.flatnonzero(gone)
    geoms = np.isin(model.geom_bodyid, bodies)
    model.geom_contype[geoms] = model.geom_conaffinity[geoms] = 0
    places, speeds = 7 * motion.scene.count, 6 * motion.scene.count
    away = np.array([0.0, AWAY, 0.0])
    motion.data.qpos[-places:].reshape(-1, 7)[gone, :3] = away
    motion.data.qvel[-speeds:].reshape(-1, 6)[gone] = 0.0


if __name__ == "__main__":
    main()
