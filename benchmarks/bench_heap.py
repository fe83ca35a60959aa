"""Thousands of discs in a turning drum: time of a step, overlaps, energy, by sweeps and threads.

A heap falls from loose rows and settles, with many sweeps; from there all variants go on.  Times
are those of the clock, which other load disturbs, and of processors, for which threads that wait
count as well.  Overlaps and the residual say how far steps are from solved.  A drum that turns by
0.1 rad/s carries the heap along until it slides; in one that turns by 1 rad/s it flows.
"""

import argparse
import os
import statistics
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from discs_in_drum import DT, RADIUS, Ours, Pymunk, have_pymunk, overlaps
from side_by_side import interleave, print_table, write

from polycorner.motion import Solver

SETTLING, SETTLED = 20, 1.0  # sweeps of a step, and seconds, until the heap has settled
WARM, ROUNDS, STEPS = 50, 5, 20  # steps before the times are taken; rounds, and steps of each
SWEEPS, ITERATIONS = (5, 10, 20, 40), (10, 40)
SPINS = {"at rest": 0.0, "turning": 0.1, "flowing": 1.0}  # rad/s


def solver(sweeps: int, threads: int) -> Solver:
    """Return the solver of a variant."""
    return Solver(tolerance=1e-4, crowd_sweeps=sweeps, threads=threads)


def settled(count: int, spin: float, threads: int, kept: Path | None = None) -> dict[str, Any]:
    """Return the state of a heap that has settled, as an engine saves it, and keep it in a file."""
    file = kept / f"heap_{count}_{spin}.npz" if kept else None
    if file and file.exists():
        return dict(np.load(file))
    heap = Ours(count, spin, solver(SETTLING, threads))
    heap.step(round(SETTLED / DT))
    state = {name: np.array(array) for name, array in heap.engine.save().items()}
    if file:
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **state)
    return state


def variants(
    begun: dict[str, Any],
    count: int,
    spin: float,
    sweeps: list[int],
    threads: list[int],
    iterations: list[int],
) -> dict[str, Any]:
    """Return all variants, each at its start: the settled heap."""
    found: dict[str, Any] = {}
    for few in sweeps:
        for number in threads:
            heap = Ours(count, spin, solver(few, number))
            heap.engine.load(begun)
            found[f"{few} sweeps, {number} threads"] = heap
    if iterations and have_pymunk():
        for few in iterations:
            for number in (1, 2):
                name = f"Pymunk, {few} iterations, {number} threads"
                found[name] = Pymunk(begun["q"], begun["v"], spin, few, number)
    return found


def measure(heaps: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the figures of all variants."""
    work: dict[str, list[float]] = {name: [] for name in heaps}

    def advance(name: str) -> None:
        begun = time.process_time()
        heaps[name].step(STEPS)
        work[name].append(time.process_time() - begun)

    for heap in heaps.values():
        heap.step(WARM)
    times = interleave({name: partial(advance, name) for name in heaps}, ROUNDS)
    figures = {}
    for name, heap in heaps.items():
        q, v = heap.state
        deep = overlaps(q) / RADIUS
        figures[name] = {
            "ms a step": round(1e3 * statistics.median(times[name]) / STEPS, 2),
            "of processors": round(1e3 * statistics.median(work[name]) / STEPS, 2),
            "of real time": round(DT * STEPS / statistics.median(times[name]), 3),
            "deepest overlap": float(f"{deep.max():.1e}"),
            "mean overlap": float(f"{deep.mean():.1e}"),
            "kinetic energy": float(
                f"{(v[:, :2] ** 2).sum() / 2 + RADIUS**2 * (v[:, 2] ** 2).sum() / 4:.3e}"
            ),
            "residual": float(f"{heap.engine.effort.residual:.0e}")
            if isinstance(heap, Ours)
            else None,
        }
    return figures


def exponents(results: dict[str, dict[str, dict[str, Any]]], counts: list[int]) -> dict[str, Any]:
    """Return slopes of the logarithm of the time of a step against that of the number of discs."""
    found: dict[str, Any] = {}
    for name in (key.partition(" ")[2] for key in results if key.startswith(f"{counts[0]} ")):
        rows = [results[f"{count} {name}"] for count in counts]
        found[name] = {
            variant: round(float(np.polyfit(np.log(counts), np.log(times), 1)[0]), 2)
            for variant in rows[0]
            if (times := [row[variant]["ms a step"] for row in rows])
        }
    return found


def main() -> None:
    """Measure, print and write all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--discs", type=int, nargs="+", default=[1000, 3000, 10000])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, os.cpu_count() or 1])
    parser.add_argument("--sweeps", type=int, nargs="+", default=list(SWEEPS))
    parser.add_argument(
        "--iterations", type=int, nargs="*", default=list(ITERATIONS), help="Pymunk's"
    )
    parser.add_argument("--drums", nargs="+", choices=SPINS, default=list(SPINS))
    parser.add_argument("--kept", type=Path, help="folder in which settled heaps are kept")
    chosen = parser.parse_args()
    results: dict[str, Any] = {}
    for count in chosen.discs:
        for name in chosen.drums:
            spin = SPINS[name]
            begun = settled(count, spin, max(chosen.threads), chosen.kept)
            options = chosen.sweeps, chosen.threads, chosen.iterations
            figures = measure(variants(begun, count, spin, *options))
            results[f"{count} {name}"] = figures
            columns = list(next(iter(figures.values())))
            rows = [[variant, *row.values()] for variant, row in figures.items()]
            print_table(f"{count} discs, {name}", ["", *columns], rows)
    if len(chosen.discs) > 1:
        results["exponents"] = exponents(results, chosen.discs)
        rows = [[v, *(results["exponents"][name][v] for name in chosen.drums)] for v in figures]
        print_table("Exponents of time", ["", *chosen.drums], rows)
    write("bench_heap", results)


if __name__ == "__main__":
    main()
