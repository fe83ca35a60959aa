"""What noise and imperfections of the drum cost: microseconds a step, by kind.

Two dumbbells and sixty, at rest on a slow drum and in motion on a fast one, in steps of 2 ms.
Motions differ from kind to kind, so that heaps in motion compare only roughly.
"""

import statistics
from time import perf_counter
from typing import Any

import numpy as np
from side_by_side import print_table, write

from polycorner.dumbbells import DumbbellDrum, OutOfRound, Shaking, UnevenFriction, Wobble
from polycorner.dumbbells.dynamics import starts
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import start

ROUNDS, DT = 5, 2e-3
MILD = {
    "shaking": Shaking((30.0, 30.0, 30.0), (2.0, 20.0)),
    "out_of_round": OutOfRound({2: 0.5, 3: 0.2}),
    "wobble": Wobble(0.01),
    "uneven_friction": UnevenFriction(0.2, 6.0),
}
KINDS: dict[str, tuple[dict[str, Any], Noise]] = {
    "none": ({}, Noise()),
    "chatter 0.3": ({}, Noise(chatter=0.3)),
    "white kicks": ({}, Noise(kicks={"phi": 300.0, "eta": 2.0})),
    "kicks held 10 ms": ({}, Noise(kicks={"phi": 300.0, "eta": 2.0}, kick_time=0.01)),
    **{name.replace("_", " "): ({name: kind}, Noise()) for name, kind in MILD.items()},
    "shaking, 300 mm/s^2": ({"shaking": Shaking((300.0,) * 3, (2.0, 20.0))}, Noise()),
    "all four": (MILD, Noise()),
}
# dumbbells, spin, steps before and during the timing
SCENES = {
    "dyad at rest": (2, 0.01, 1000, 5000),
    "dyad rolling": (2, 0.5, 1000, 5000),
    "sixty at rest": (60, 0.01, 500, 500),
    "sixty moving": (60, 0.2, 300, 200),
}


def cost(kind: str, scene: str) -> float:
    """Return microseconds a step."""
    imperfect, noise = KINDS[kind]
    count, spin, before, steps = SCENES[scene]
    drum = DumbbellDrum(count=count, spin=spin, floor=count > 2, **imperfect)
    if count == 2:
        q = starts.nested_pair(drum, "R", heading=0.17)
    else:
        q = starts.bunch(drum, np.random.default_rng(0))
    engine = start(drum, drum.state(q), DT, noise=noise)
    engine.advance(before)
    clock = perf_counter()
    engine.advance(steps)
    return (perf_counter() - clock) / steps * 1e6


def main() -> None:
    """Print the table and write the results."""
    figures: dict[str, dict[str, float]] = {kind: {} for kind in KINDS}
    for scene in SCENES:
        times: dict[str, list[float]] = {kind: [] for kind in KINDS}
        for _ in range(ROUNDS):
            for kind in KINDS:
                times[kind].append(cost(kind, scene))
        for kind, found in times.items():
            figures[kind][scene] = statistics.median(found)
    rows = [[kind, *(f"{x:.1f}" for x in row.values())] for kind, row in figures.items()]
    print_table("microseconds a step", ["", *SCENES], rows)
    write("imperfections", figures)


if __name__ == "__main__":
    main()
