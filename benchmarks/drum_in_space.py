"""Sixty rigid dumbbells in the drum for twenty minutes: who leaves, and with which hand.

Starts are followed side by side, one on each worker.  Each saves its state every 30 s in a folder
of its own, so that the same command goes on with what was stopped; with ``--seconds`` the program
stops by itself.  Figures are those of what was simulated so far.
"""

import argparse
import os
import re
import signal
import threading
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from side_by_side import print_table, write

from polycorner import checks
from polycorner.dumbbells import DumbbellDrum, OutOfRound, RigidDumbbells, Shaking, UnevenFriction
from polycorner.dumbbells.dynamics.bunch import (
    BunchInSpaceRun,
    BunchRun,
    drum_for_bunch,
    follow_in_space,
    kicks_of_centres,
)
from polycorner.dumbbells.pictures.film_in_space import film_in_space
from polycorner.dumbbells.viewer.page import film_page, write_page
from polycorner.motion import Checkpoint, Noise

SAVE = 30.0  # s
KICK_TIME = 0.003  # s, for which a kick is held
AXES = ("ACROSS", "ALONG", "UP")  # directions of shaking
FRICTION = ("sliding", "rolling", "rubbing")
STATES = ("STATIC", "DYNAMIC")
IN = {"right": "in right", "left": "in left"}  # dyads
SHARES = 10  # instants at which dumbbells off the drum are counted


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=2, help="how many, from --first on")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kicks", type=float, nargs="+", default=[0.0], help="mm/s per sqrt(s)")
    parser.add_argument("--shake", type=float, nargs=3, metavar=AXES, help="rms in mm/s^2")
    parser.add_argument("--band", type=float, nargs=2, default=[5.0, 50.0], help="Hz")
    parser.add_argument("--oval", type=float, metavar="MM", help="amplitude of an oval wall")
    parser.add_argument("--uneven", type=float, nargs=2, metavar=("RMS", "MM"), help="friction")
    for name in FRICTION:
        told = f"coefficients of {name}; default: the drum's"
        parser.add_argument(f"--{name}", type=float, nargs=2, metavar=STATES, help=told)
    parser.add_argument("--count", type=int, default=60, help="dumbbells")
    parser.add_argument("--top", type=float, default=150.0, help="length of the drum, mm")
    parser.add_argument("--duration", type=float, default=1200.0, help="s")
    parser.add_argument("--dt", type=float, default=2e-3, help="s")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--seconds", type=float, default=0.0, help="of real time; 0: to the end")
    parser.add_argument("--films", action="store_true", help="write a page for each start, too")
    parser.add_argument("--out", type=Path, default=Path("out/drum_in_space"))
    options = parser.parse_args(arguments)
    try:
        checks.whole("--starts", options.starts, least=1)
        checks.real("--seconds", options.seconds, least=0)
        RigidDumbbells(DumbbellDrum(**imperfections(options, 0)))
    except ValueError as error:
        parser.error(str(error))
    starts = range(options.first, options.first + options.starts)
    points = [(start, kicks) for kicks, start in product(options.kicks, starts)]
    work = partial(followed, options)
    with ProcessPoolExecutor(options.workers) as pool:
        rows = list(pool.map(work, points))
    print_table(f"{options.count} dumbbells in space", list(rows[0]), [[*r.values()] for r in rows])
    write("drum_in_space", {"settings": vars(options) | {"out": None}, "runs": rows})


def imperfections(options: argparse.Namespace, start: int) -> dict[str, Any]:
    """Return the imperfections of the drum of a start, by name."""
    found: dict[str, Any] = {}
    if options.shake:
        found["shaking"] = Shaking(options.shake, options.band, seed=start)
    if options.oval:
        found["out_of_round"] = OutOfRound({2: options.oval})
    if options.uneven:
        found["uneven_friction"] = UnevenFriction(*options.uneven, seed=start)
    return found | {k: tuple(getattr(options, k)) for k in FRICTION if getattr(options, k)}


def followed(options: argparse.Namespace, point: tuple[int, float]) -> dict[str, Any]:
    """Follow one start, or go on with it; return its figures."""
    start, kicks = point
    told = {"shaken": options.shake, "oval": options.oval, "uneven": options.uneven}
    told |= {name: getattr(options, name) for name in FRICTION}
    told = {"kicks": kicks} | {name: value for name, value in told.items() if value}
    words = [f"{name} {value}" for name, value in told.items()]
    folder = options.out / re.sub(r"[^\w.]+", "-", " ".join([*words, f"start {start}"]))
    timer = threading.Timer(options.seconds, signal.raise_signal, [signal.SIGINT])
    if options.seconds:
        timer.daemon = True
        timer.start()
    drum = drum_for_bunch(
        DumbbellDrum(**imperfections(options, start)), count=options.count, top=options.top
    )
    run = follow_in_space(
        drum,
        options.duration,
        start=start,
        noise=Noise(kicks=kicks_of_centres(drum, kicks), kick_time=KICK_TIME, seed=start),
        dt=options.dt,
        checkpoint=Checkpoint(folder, seconds=SAVE),
    )
    timer.cancel()
    if options.films:
        write_page(film_page(film_in_space(run)), folder.parent / f"{folder.name}.html")
    return {"start": start, **told, **figures(run)}


def figures(run: BunchInSpaceRun) -> dict[str, Any]:
    """Return who left and who is where, and how well the motion was solved."""
    path = run.trajectory
    climbed = run.climbed[:: max(1, len(run.times) // SHARES)]
    return {
        **figures_of(run),
        "off the drum, mean": round(float(climbed.mean()), 1),
        "overlap, mm": float(f"{path.max_penetration:.2g}"),
        "unsolved": path.effort.unconverged,
        "islands": path.effort.islands,
    }


def figures_of(run: BunchRun) -> dict[str, Any]:
    """Return who left, when and with which heading, and who is where at the end."""
    records = [int(np.searchsorted(run.times, time)) - 1 for time, _ in run.exits]
    headings = [run.q[k, body, 2] for k, (_, body) in zip(records, run.exits, strict=True)]
    return {
        "s": round(float(run.times[-1]), 1),
        "left": len(run.exits),
        "at, s": [round(time) for time, _ in run.exits],
        "headings, deg": np.degrees(headings).round().astype(int).tolist(),
        **{f"left {kind}": number for kind, number in run.exit_counts().items()},
        **{IN.get(kind, kind): number for kind, number in run.census(-1).items()},
        "highest, mm": round(float(run.q[..., 1].max()), 1),
    }


if __name__ == "__main__":
    main()
