"""Gaps of two dumbbells in space beside plain C and FCL; motion of several, in a tray and a drum.

Each placement has nine gaps: four of balls, four of a ball and a rod, one of the rods.  The C is
``gaps_space.c``, written by hand for several pairs at once; it agrees before it is timed.  For gaps
the clock is that of the processor.
"""

import ctypes
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import fcl
import numpy as np
from bench_kernels import AGREEMENT, BLOCK, compiled_c
from scipy.spatial.transform import Rotation
from side_by_side import interleave, print_table, ratio, write

from polycorner import simulate
from polycorner.bodies import Arrangement, Cylinder, HalfSpace, capsule, compound, sphere
from polycorner.spaces.manifold import Array

ROUNDS = 5
PAIRS, PLACEMENTS, FEW = 1_000_000, 100_000, 1_000
LENGTH, BALL, ROD = 16.0, 3.0, 1.5
DUMBBELL = compound(
    {
        "1": sphere(BALL, at=[0, 0, -LENGTH / 2]),
        "2": sphere(BALL, at=[0, 0, LENGTH / 2]),
        "rod": capsule([0, 0, -LENGTH / 2], [0, 0, LENGTH / 2], ROD),
    }
)
RADIUS = 125.0
COUNTS = (1, 4, 12)
STEPS = 200


def main() -> None:
    million = beside_c()
    pair = Arrangement({"A": DUMBBELL, "B": DUMBBELL})
    places = anywhere(pair, PLACEMENTS)
    some = places[:FEW]
    objects, found = [in_fcl(pair, q) for q in some], []
    tasks = {
        "polycorner": lambda: pair.polyhedron.values(places),
        "with gradients": lambda: pair.polyhedron.evaluate(places, 1),
        "fcl": lambda: found.append([distances(*both) for both in objects]),
    }
    times = interleave(tasks, ROUNDS, time.process_time)
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
    (rows,), (falling, heap) = in_drum(rows_of(60), 500), in_drum(heap_of(60), 100, 200)
    drums = {"rows": rows, "falling": falling, "heap": heap}
    rows = [(name, f"{value:.0f}") for name, value in drums.items()]
    print_table("Sixty dumbbells in a drum, steps of 1 ms", ["start", "steps a second"], rows)
    found = {
        "a million pairs": million,
        "ns": nanoseconds,
        "fcl over polycorner": factor,
        "steps a second": speeds,
    }
    write("bodies", {**found, "steps a second in the drum": drums})


def anywhere(pair: Arrangement, count: int) -> Array:
    """Return random placements of two dumbbells near each other, ``(count, n)``."""
    places = np.random.default_rng(0).standard_normal((count, pair.manifold.size))
    half = pair.manifold.size // 2
    places[:, [0, 1, 2, half, half + 1, half + 2]] *= LENGTH
    return pair.manifold.wrap(places)


def beside_c() -> dict[str, Any]:
    """Time the gaps of a million pairs, poses with quaternions, beside the same in C."""
    pair = Arrangement({"A": DUMBBELL, "B": DUMBBELL}, orientations="all")
    q, sizes = anywhere(pair, PAIRS), np.array([LENGTH, BALL, ROD])
    values, slopes = pair.polyhedron.evaluate(q, 1)
    first = pair.polyhedron.functions[0]
    kernels, numbers = first.family.kernel, np.array(first.parameters)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        library = compiled_c("gaps_space.c", Path(folder))
        if library is None:
            return {}
        figures: dict[str, Any] = {}
        for order, (kind, name) in enumerate({"gaps": "values", "with gradients": "gaps"}.items()):
            theirs = in_c(library, name, sizes, order)
            kernel = kernels.compiled(order)

            def ours(q: Array, *results: Array, kernel: Any = kernel) -> None:
                kernel.fill(q, numbers.ctypes.data, results)

            results = [np.zeros_like(values), np.zeros_like(slopes)][: order + 1]
            theirs(q, *results)
            for result, known in zip(results, (values, slopes), strict=False):
                assert np.abs(result - known).max() <= AGREEMENT
            figures[kind] = compared(q, results, ours, theirs)
    rows = [(f"{kind}, {how}", *some) for kind, f in figures.items() for how, some in f.items()]
    print_table(f"{PAIRS} pairs in space", ["", "ns a pair", "C", "time over C's"], rows)
    return figures


def in_c(library: ctypes.CDLL, name: str, sizes: Array, order: int) -> Callable[..., None]:
    """Return a routine of the C file that fills arrays."""
    function = getattr(library, name)
    function.argtypes = [ctypes.c_int64, *[ctypes.c_void_p] * (3 + order)]
    function.restype = None

    def routine(q: Array, *results: Array) -> None:
        function(len(q), q.ctypes.data, sizes.ctypes.data, *(r.ctypes.data for r in results))

    return routine


def compared(
    q: Array, results: list[Array], ours: Callable[..., object], theirs: Callable[..., object]
) -> dict[str, list[float]]:
    """Return the times of both a pair, and their ratio: existing arrays, in cache, new arrays."""

    def cached(routine: Callable[..., object]) -> None:
        for start in range(0, len(q), BLOCK):
            routine(q[start : start + BLOCK], *(r[:BLOCK] for r in results))

    ways: dict[str, Callable[[Callable[..., object]], object]] = {
        "existing arrays": lambda routine: routine(q, *results),
        "in cache": cached,
        "new arrays": lambda routine: routine(q, *map(np.empty_like, results)),
    }
    figures = {}
    for name, way in ways.items():
        tasks = {"ours": lambda way=way: way(ours), "theirs": lambda way=way: way(theirs)}
        times = interleave(tasks, ROUNDS, time.process_time)
        each = [round(1e9 * statistics.median(t) / len(q), 1) for t in times.values()]
        figures[name] = [*each, round(ratio(times["ours"], times["theirs"]), 2)]
    return figures


def rows_of(count: int) -> Array:
    """Return dumbbells along the axis of the drum, side by side in rows of six."""
    row, column = np.divmod(np.arange(count), 6)
    phi = (column - 2.5) * 0.09
    away = RADIUS - BALL
    places = np.stack([away * np.sin(phi), 30.0 * row, -away * np.cos(phi)], axis=-1)
    turns = Rotation.from_rotvec(np.stack([0 * phi, -phi, 0 * phi], axis=-1))
    return np.array([drum().point({"D": at}) for at in zip(places, turns, strict=True)])


def heap_of(count: int) -> Array:
    """Return dumbbells that turn in all directions, in layers above the drum; they fall."""
    rng = np.random.default_rng(0)
    layer, rest = np.divmod(np.arange(count), 15)
    x, y = np.divmod(rest, 3)
    places = np.stack([23.0 * (x - 2), 23.0 * (y - 1), 23.0 * layer - 100], axis=-1)
    turns = Rotation.random(count, random_state=rng)
    return np.array([drum().point({"D": at}) for at in zip(places, turns, strict=True)])


@cache
def drum() -> Arrangement:
    """Return a dumbbell in the turning drum, its rod along ``y``."""
    ends = np.array([[0, -LENGTH / 2, 0], [0, LENGTH / 2, 0]])
    rod = capsule(*ends, ROD)
    body = compound({"1": sphere(BALL, at=ends[0]), "2": sphere(BALL, at=ends[1]), "rod": rod})
    wall = Cylinder(RADIUS, axis=[0, 1, 0], spin=0.1)
    return Arrangement({"D": body}, {"drum": wall}, orientations="all")


def in_drum(start: Array, *until: int) -> list[float]:
    """Return the steps a second of dumbbells that rub in the drum, up to each of these steps."""
    down = [0, 0, -9810.0]
    system = drum().system(gravity=down, density=1e-3, friction=0.3, count=len(start))
    state = system.state(start)
    simulate(system, state, 0.005, 1e-3)  # compiles
    spent = [0.0]
    for steps in until:
        begin = time.perf_counter()
        simulate(system, state, 1e-3 * steps, 1e-3)
        spent.append(time.perf_counter() - begin)
    return (np.diff([0, *until]) / np.diff(spent)).tolist()


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
