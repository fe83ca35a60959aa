"""Sharp boxes in motion: steps a second, the first steps from an empty cache, and dice.

Boxes fall into a tray in loose order, tumble and come to rest: ten in the plane, ten and a hundred
in space, with friction.  Steps of a millisecond in the plane and of two in space are counted while
they fall and tumble (*moving*) and afterwards (*at rest*), by the clock of the processor.  *First*
is a new process from its start to the tenth step, with an empty cache of compiled formulas.

Dice, six at a time, are thrown in any orientation into a tray, where they hit each other; all six
faces have to come up as often.  ``--dice 0`` leaves them out.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chisquare

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, polygon, polytope
from polycorner.spaces.manifold import Array

GRAVITY = 10.0
SCENES = {"ten in the plane": (2, 10), "ten in space": (3, 10), "a hundred in space": (3, 100)}
STEPS = {2: 1e-3, 3: 2e-3}
FACES = 6


def tray(dimension: int, half: float, **options: Any) -> tuple[Arrangement, Any]:
    """Return unit boxes in a tray so many units wide to either side, and their system."""
    eye = np.eye(dimension)
    corners = np.array(list(product([-0.5, 0.5], repeat=dimension)))
    body = polygon(corners[[0, 2, 3, 1]]) if dimension == 2 else polytope(corners)
    walls = {
        f"side{c}{sign:+d}": HalfSpace(sign * eye[c], -sign * half * eye[c])
        for c, sign in product(range(dimension - 1), (1, -1))
    }
    walls["floor"] = HalfSpace(eye[-1], 0 * eye[-1])
    a = Arrangement({"A": body}, walls, orientations="all")
    return a, a.system(gravity=-GRAVITY * eye[-1], **options)


def loosely(a: Arrangement, count: int, half: float, rng: np.random.Generator) -> Array:
    """Return placements above the floor, apart from each other, turned at random."""
    d, apart = a.dimension, 1.05 * np.sqrt(a.dimension)
    side = int((2 * half - 2 * a.named["A"].size) // apart) + 1
    places = []
    for k in range(count):
        cell = np.array(np.unravel_index(k, (count, *[side] * (d - 1)))[::-1])
        place = (cell - np.append(np.full(d - 1, (side - 1) / 2), -0.6)) * apart
        turn = rng.uniform(0, 6) if d == 2 else Rotation.random(random_state=rng)
        places.append(a.point({"A": (place, turn)}))
    return np.array(places)


def pace(dimension: int, count: int) -> None:
    """Print how many steps a second are done while boxes move, and when they lie."""
    half, dt = (3.0 if count <= 10 else 4.0), STEPS[dimension]
    a, system = tray(dimension, half, friction=0.4, count=count)
    state = system.state(loosely(a, count, half, np.random.default_rng(0)))
    simulate(system, state, 10 * dt, dt)
    spent = [0.0]
    durations = (1.5, 4.0, 4.5) if count <= 10 else (1.5, 3.0)
    for duration in durations:
        began = time.process_time()
        path = simulate(system, state, duration, dt)
        spent.append(time.process_time() - began)
    rates = [durations[0] / dt / spent[1]]
    if count <= 10:
        rates.append((durations[2] - durations[1]) / dt / max(spent[3] - spent[2], 1e-3))
    told = ", ".join(
        f"{what} {r:.0f}" for what, r in zip(("moving", "at rest"), rates, strict=False)
    )
    print(
        f"{count} boxes, {dimension} dimensions, steps a second: {told}; {path.effort}", flush=True
    )


def first(dimension: int, count: int) -> None:
    """Do ten steps, in a process of its own."""
    half, dt = (3.0 if count <= 10 else 4.0), STEPS[dimension]
    a, system = tray(dimension, half, friction=0.4, count=count)
    start = system.state(loosely(a, count, half, np.random.default_rng(0)))
    simulate(system, start, 10 * dt, dt)


def throw(throws: int, first: int = 0, at_once: int = 6) -> tuple[list[int], int]:
    """Return how often each face came up, and how many dice did not lie flat."""
    a, system = tray(3, 3.5, friction=0.3, restitution=0.3, count=at_once)
    counts, cocked = [0] * FACES, 0
    for seed in range(first, first + throws):
        rng = np.random.default_rng(seed)
        q = loosely(a, at_once, 3.5, rng)
        speeds = [a.velocity(x, {"A": (rng.normal(size=3), 4 * rng.normal(size=3))}) for x in q]
        path = simulate(system, system.state(q, np.array(speeds)), 4.0, 2e-3)
        turns = Rotation.from_quat(path.q[-1][:, [4, 5, 6, 3]]).as_matrix()
        for up in turns[:, 2, :]:
            axis = int(np.argmax(abs(up)))
            if abs(up[axis]) < 1 - 1e-6:
                cocked += 1
            else:
                counts[2 * axis + int(up[axis] > 0)] += 1
    return counts, cocked


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dice", type=int, default=100, help="throws of six dice")
    parser.add_argument("--seed", type=int, default=0, help="of the first throw")
    parser.add_argument("--paces", type=int, default=len(SCENES), help="how many scenes are timed")
    parser.add_argument("--first", nargs=2, type=int, help="dimension and count: ten steps only")
    given = parser.parse_args()
    if given.first:
        first(*given.first)
        return
    for name, (dimension, count) in list(SCENES.items())[: given.paces]:
        pace(dimension, count)
        with tempfile.TemporaryDirectory() as folder:
            cache = os.environ | {"POLYCORNER_CACHE_DIR": folder}
            began = time.perf_counter()
            command = [sys.executable, __file__, "--first", str(dimension), str(count)]
            subprocess.run(command, env=cache, check=True)
            print(f"{name}: first ten steps after {time.perf_counter() - began:.1f} s", flush=True)
    if given.dice:
        counts, cocked = throw(given.dice, given.seed)
        p = chisquare(counts).pvalue
        print(f"faces {counts}, not flat {cocked}: chance of more difference {p:.2f}")


if __name__ == "__main__":
    main()
