"""Gaps of two rigid dumbbells in space beside plain C and FCL.

Each placement has nine gaps: four of balls, four of a ball and a rod, one of the rods.  The C is
``gaps_space.c``, written by hand for several pairs at once; it agrees before it is timed.  The
clock is that of the processor.
"""

import ctypes
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fcl
import numpy as np
from bench_kernels import AGREEMENT, BLOCK, compiled_c
from bodies_in_drum import BALL, LENGTH, ROD, dumbbell
from side_by_side import interleave, print_table, ratio, write

from polycorner.bodies import Arrangement
from polycorner.spaces.manifold import Array

ROUNDS = 5
PAIRS, PLACEMENTS, FEW = 1_000_000, 100_000, 1_000
DUMBBELL = dumbbell([0, 0, 1])


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
    found = {"a million pairs": million, "ns": nanoseconds, "fcl over polycorner": factor}
    write("bodies", found)


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


if __name__ == "__main__":
    main()
