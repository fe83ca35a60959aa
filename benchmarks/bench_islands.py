"""Islands of touching dumbbells that are left unsolved: dyads and heaps of sixty, with every noise.

`--steps N` sets the number of steps of a dyad in each case, a hundredth of which a heap makes.
Heaps are solved to their default tolerance of 1e-4, and once more to 1e-8.
"""

import argparse
import time
from typing import Any

import numpy as np
from side_by_side import print_table, write

from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.simulation import start

DT, PLACE = 1e-3, (0.1, 150.0, 0.0)
SIZES = {"length": 16.0, "ball_radius": 3.0, "rod_radius": 1.5, "drum_radius": 125.0}
NOISES = {
    "none": Noise(),
    "kicks": Noise(kicks={"phi": 13000.0, "eta": 7.0}, seed=1),
    "chatter": Noise(chatter=0.3, seed=1),
    "both": Noise(chatter=0.1, kicks={"phi": 1300.0, "eta": 0.7}, seed=3),
}
EIGHT_DIGITS = Solver(tolerance=1e-8)


def run(engine: Any, steps: int) -> dict[str, Any]:
    """Advance, and return what it cost and what was left."""
    begun = time.perf_counter()
    for done in range(0, steps, 1000):
        engine.advance(min(1000, steps - done))
    spent, effort = time.perf_counter() - begun, engine.effort
    return {
        "steps": steps,
        "islands": effort.islands,
        "unsolved": effort.unconverged,
        "worst": float(f"{effort.residual:.2g}"),
        "parts": effort.parts,
        "steps/s": round(steps / spent),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1_250_000)
    steps = parser.parse_args().steps
    figures: dict[str, dict[str, Any]] = {}
    pair, dyad, heap = DumbbellPair(**SIZES), DumbbellDrum(**SIZES, count=2), DumbbellDrum(count=60)
    for name, noise in NOISES.items():
        for hand in "LR":
            nested = pair.nested(hand, clearance=0.02).reshape(2, 3) + np.array(PLACE)
            engine = start(dyad, dyad.state(nested), DT, noise=noise)
            figures[f"dyad {hand}, {name}"] = run(engine, steps)
    for name, noise in NOISES.items():
        state = heap.state(bunch(heap, np.random.default_rng(3)))
        figures[f"sixty, {name}"] = run(start(heap, state, DT, noise=noise), steps // 100)
        strict = start(heap, state, DT, noise=noise, solver=EIGHT_DIGITS)
        figures[f"sixty, {name}, 1e-8"] = run(strict, steps // 1000)
    columns = list(next(iter(figures.values())))
    rows = [(name, *row.values()) for name, row in figures.items()]
    print_table("Islands", ["", *columns], rows)
    write("islands", figures)


if __name__ == "__main__":
    main()
