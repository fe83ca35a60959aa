"""Gaps of two dumbbells in space, timed beside FCL, and motion of several in a tray.

Each placement has nine gaps: four of balls, four of a ball and a rod, one of the rods.
"""

import statistics
import time

import fcl
import numpy as np
from side_by_side import interleave, print_table, write

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, capsule, compound, sphere
from polycorner.spaces.manifold import Array

ROUNDS = 5
PLACEMENTS, FEW = 100_000, 1_000
LENGTH, BALL, ROD = 16.0, 3.0, 1.5
DUMBBELL = compound(
    {
        "1": sphere(BALL, at=[0, 0, -LENGTH / 2]),
        "2": sphere(BALL, at=[0, 0, LENGTH / 2]),
        "rod": capsule([0, 0, -LENGTH / 2], [0, 0, LENGTH / 2], ROD),
    }
)
COUNTS = (1, 4, 12)
STEPS = 200


def main() -> None:
    pair = Arrangement({"A": DUMBBELL, "B": DUMBBELL})
    rng = np.random.default_rng(0)
    places = rng.standard_normal((PLACEMENTS, pair.manifold.size))
    places[:, [0, 1, 2, 6, 7, 8]] *= LENGTH
    places = pair.manifold.wrap(places)
    some = places[:FEW]
    objects, found = [in_fcl(pair, q) for q in some], []
    tasks = {
        "polycorner": lambda: pair.polyhedron.values(places),
        "with gradients": lambda: pair.polyhedron.evaluate(places, 1),
        "fcl": lambda: found.append([distances(*both) for both in objects]),
    }
    times = interleave(tasks, ROUNDS)
    ours, ahead, other = (statistics.median(times[name]) for name in tasks)
    nanoseconds = {
        "polycorner": 1e9 * ours / PLACEMENTS,
        "with gradients": 1e9 * ahead / PLACEMENTS,
        "fcl": 1e9 * other / FEW,
    }
    check(pair.polyhedron.values(some), np.array(found[0]))
    factor = nanoseconds["fcl"] / nanoseconds["polycorner"]
    rows = [(name, f"{value:.0f}") for name, value in nanoseconds.items()]
    print_table("Nine gaps of two dumbbells in space", ["", "ns a placement"], rows)
    print(f"fcl over polycorner: {factor:.0f}")

    speeds = {str(count): speed(count) for count in COUNTS}
    rows = [(count, f"{value:.0f}") for count, value in speeds.items()]
    print_table("Dumbbells on a floor, steps of 1 ms", ["dumbbells", "steps a second"], rows)
    write("bodies", {"ns": nanoseconds, "fcl over polycorner": factor, "steps a second": speeds})


def in_fcl(pair: Arrangement, q: Array) -> list[list[fcl.CollisionObject]]:
    """Return the parts of both dumbbells in their places as FCL's objects."""
    parts = []
    for body in pair.placed(q).values():
        start, end = body.parts["rod"].points
        third = (end - start) / LENGTH
        first = np.cross(third, np.eye(3)[np.argmin(abs(third))])
        first /= np.linalg.norm(first)
        frame = np.column_stack([first, np.cross(third, first), third])
        balls = [fcl.Transform(np.eye(3), point) for point in (start, end)]
        rod = fcl.Transform(frame, (start + end) / 2)
        parts.append(
            [
                *(fcl.CollisionObject(fcl.Sphere(BALL), place) for place in balls),
                fcl.CollisionObject(fcl.Capsule(ROD, LENGTH), rod),
            ]
        )
    return parts


def distances(first: list[fcl.CollisionObject], second: list[fcl.CollisionObject]) -> list[float]:
    """Return the nine distances by FCL."""
    request = fcl.DistanceRequest()
    return [fcl.distance(a, b, request, fcl.DistanceResult()) for a in first for b in second]


def check(ours: Array, theirs: Array) -> None:
    """Raise where bodies are apart and distances differ by more than FCL's own tolerance."""
    apart = (ours > 0) & (theirs > 0)
    assert apart.any()
    assert np.abs(ours - theirs)[apart].max() < 1e-2


def speed(count: int) -> float:
    """Return steps a second of dumbbells that fall on a floor side by side and roll."""
    floor = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}
    body = Arrangement({"D": DUMBBELL}, floor, orientations="all")
    system = body.system(gravity=[0, 2000.0, -9810.0], density=1e-3, friction=0.3, count=count)
    quarter = np.sqrt(0.5)
    starts = [[0.0, 1.2 * BALL * 2 * k, BALL + 0.5, quarter, 0, quarter, 0] for k in range(count)]
    state = system.state(np.array(starts) if count > 1 else starts[0])
    simulate(system, state, 0.01, 1e-3)
    begun = time.perf_counter()
    simulate(system, state, STEPS * 1e-3, 1e-3)
    return STEPS / (time.perf_counter() - begun)


if __name__ == "__main__":
    main()
