"""Thousands of discs in a turning drum: time of a step, overlaps, energy, by sweeps and threads.

A heap falls from loose rows and settles, with many sweeps; from there all variants go on.  Times
are those of the clock, for one thread and for more; other load disturbs them.  Overlaps and the
residual say how far steps are from solved.
"""

import argparse
import os
import statistics
from functools import partial
from typing import Any

import numpy as np
from discs_in_drum import DT, RADIUS, Ours, Pymunk, have_pymunk, overlaps
from side_by_side import interleave, print_table, write

from polycorner.motion import Solver

SETTLING, SETTLED = 60, 1.0  # sweeps of a step, and seconds, until the heap has settled
WARM, ROUNDS, STEPS = 50, 5, 20  # steps before the times are taken; rounds, and steps of each
SWEEPS, ITERATIONS = (5, 10, 20, 40), (10, 40)
SPINS = {"at rest": 0.0, "turning": 0.1}  # rad/s


def solver(sweeps: int, threads: int) -> Solver:
    """Return the solver of a variant."""
    return Solver(tolerance=1e-4, crowd_sweeps=sweeps, threads=threads)


def settled(count: int, spin: float, threads: int) -> dict[str, Any]:
    """Return the state of a heap that has settled, as an engine saves it."""
    heap = Ours(count, spin, solver(SETTLING, threads))
    heap.step(round(SETTLED / DT))
    return {name: np.array(array) for name, array in heap.engine.save().items()}


def variants(count: int, spin: float, threads: list[int]) -> dict[str, Any]:
    """Return all variants, each at its start: the settled heap."""
    begun, found = settled(count, spin, max(threads)), {}
    for sweeps in SWEEPS:
        for number in threads:
            heap = Ours(count, spin, solver(sweeps, number))
            heap.engine.load(begun)
            found[f"{sweeps} sweeps, {number} threads"] = heap
    if have_pymunk():
        for iterations in ITERATIONS:
            for number in (1, 2):
                name = f"Pymunk, {iterations} iterations, {number} threads"
                found[name] = Pymunk(begun["q"], begun["v"], spin, iterations, number)
    return found


def measure(count: int, spin: float, threads: list[int]) -> dict[str, dict[str, Any]]:
    """Return the figures of all variants."""
    heaps = variants(count, spin, threads)
    for heap in heaps.values():
        heap.step(WARM)
    times = interleave({name: partial(h.step, STEPS) for name, h in heaps.items()}, ROUNDS)
    figures = {}
    for name, heap in heaps.items():
        q, v = heap.state
        deep = overlaps(q) / RADIUS
        figures[name] = {
            "ms a step": round(1e3 * statistics.median(times[name]) / STEPS, 2),
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
    for name in SPINS:
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
    chosen = parser.parse_args()
    results: dict[str, Any] = {}
    for count in chosen.discs:
        for name, spin in SPINS.items():
            figures = measure(count, spin, chosen.threads)
            results[f"{count} {name}"] = figures
            columns = list(next(iter(figures.values())))
            rows = [[variant, *row.values()] for variant, row in figures.items()]
            print_table(f"{count} discs, {name}", ["", *columns], rows)
    if len(chosen.discs) > 1:
        results["exponents"] = exponents(results, chosen.discs)
        rows = [[v, *(results["exponents"][name][v] for name in SPINS)] for v in figures]
        print_table("Exponents of time", ["", *SPINS], rows)
    write("bench_heap", results)


if __name__ == "__main__":
    main()
