"""Speed of the engine of motion beside that of another checkout, alternating, and its growth.

`bench_engine.py FOLDER` times both; without a folder this one alone.  Every case is a process of
its own, in which the package of its folder is imported; processor time, one thread.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

from side_by_side import print_table, write

HERE, ROUNDS = Path(__file__).resolve().parent.parent, 3
KICK = 25.0  # white kicks, in mm/s per sqrt(s) for masses of 1 g
# name: dumbbells (2: a dyad that rolls), chatter, kicks, steps of a millisecond, starts
CASES: dict[str, tuple[int, float, float, int, int]] = {
    "dyad": (2, 0.0, 0.0, 40_000, 1),
    "sixty": (60, 0.0, 0.0, 8_000, 8),
    "sixty, chatter 0.3": (60, 0.3, 0.0, 1_000, 4),
    "sixty, kicks": (60, 0.0, KICK, 1_000, 4),
    "240": (240, 0.0, 0.0, 8_000, 3),
    "960": (960, 0.0, 0.0, 4_000, 1),
    "60, all move": (60, 0.0, KICK, 300, 4),
    "240, all move": (240, 0.0, KICK, 300, 1),
    "960, all move": (960, 0.0, KICK, 300, 1),
}

# What a process does: it imports bench_motion, and the package, of its own folder.
CHILD = """
import json, sys, time
root, count, chatter, kick, steps, starts = json.loads(sys.argv[1])
sys.path[:0] = [root, root + "/benchmarks"]
import numpy as np
import bench_motion
import polycorner
assert polycorner.__file__.startswith(root + "/")
from polycorner.dumbbells.dynamics.starts import scatter
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import start
spent, islands, missed = 0.0, 0, 0
for seed in range(starts):
    if count == 2:
        engine = bench_motion.ours(2, 1.0).func.__self__
        engine.advance(2_000)
    else:
        drum = bench_motion.DumbbellDrum(
            **bench_motion.SIZES, drum_radius=125.0, count=count, floor=True
        )
        rng = np.random.default_rng(seed)
        placed = scatter(drum, rng, width=0.35, height=4.0 * count, tries=1000)
        kicks = {"phi": 122.0 * kick, "eta": kick, "theta": kick} if kick else {}
        noise = Noise(chatter=chatter, kicks=kicks, seed=3)
        engine = start(drum, drum.state(placed), 1e-3, noise=noise)
        engine.advance(10)
    begun = time.process_time()
    engine.advance(steps)
    spent += time.process_time() - begun
    islands += engine.effort.islands
    missed += engine.effort.unconverged
print(json.dumps([1e6 * spent / (steps * starts), islands, missed]))
"""


def measured(root: Path, case: str) -> tuple[float, int, int]:
    """Return µs a step, islands, and how many of them were missed."""
    arguments = json.dumps([str(root), *CASES[case]])
    run = subprocess.run(
        [sys.executable, "-c", CHILD, arguments],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    spent, islands, missed = json.loads(run.stdout)
    return spent, islands, missed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="another checkout")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    given = parser.parse_args()
    roots = {"this": HERE} | ({"other": given.folder.resolve()} if given.folder else {})
    figures: dict[str, dict[str, Any]] = {}
    for case in given.cases:
        times: dict[str, list[float]] = {name: [] for name in roots}
        found: dict[str, Any] = {}
        for _ in range(ROUNDS):
            for name, root in roots.items():
                spent, islands, missed = measured(root, case)
                times[name].append(spent)
                found[f"{name}: missed"] = f"{missed} of {islands}"
        for name, taken in times.items():
            found[f"{name}: us a step"] = round(statistics.median(taken), 2)
        if "other" in roots:
            ratios = [b / a for a, b in zip(times["this"], times["other"], strict=True)]
            found["other over this"] = round(statistics.median(ratios), 2)
        figures[case] = found
        print(case, found, flush=True)
    keys = list(next(iter(figures.values())))
    print_table("The engine", ["", *keys], [[c, *f.values()] for c, f in figures.items()])
    write("engine", figures)


if __name__ == "__main__":
    main()
