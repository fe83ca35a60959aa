"""Proofs in ball arithmetic: time per proof, and a campaign that searches for a false one.

The pair of dumbbells is proved at growing precision and for a whole box of sizes at once.  How many
minima with multipliers of 1e-8 to 1e-30 and contacts at angles of 1e-2 to 1e-12 are proved is
counted.  Then the prover is given random problems with exactly known answers, many of them
borderline minima, and every theorem it states is checked in rational arithmetic.  ``python
benchmarks/bench_proof.py 500`` runs 500 problems of each kind instead of 100.
"""

import statistics
import sys
from collections import Counter
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from side_by_side import ROOT, print_table, seconds, write

from polycorner import Certificate, minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.proofs import Proof, prove

sys.path.append(str(Path(ROOT, "tests", "support")))
from exact_kinds import KINDS, departures, programme
from exact_oracle import holds
from faint_minima import regular

DIGITS = (30, 100, 1000, 4000)
ROUNDS = 5
BOX = {"t": (1.2, 1.8), "l": (14.0, 18.0)}
EACH = 100
FAINT = 171
WORDS = ("proved", "refuted", "undecided", "refused", "FALSE")


def corner() -> Certificate:
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
    return minimise(pair.polyhedron, pair.energy, pair.nested("R"))


def precisions(c: Certificate) -> dict[str, float]:
    """Return the median time of a proof at each precision, and of the first one."""
    figures = {
        "first proof, SymPy imported on the way, ms": round(1e3 * seconds(lambda: prove(c)), 1)
    }
    for digits in DIGITS:
        times = [seconds(lambda digits=digits: prove(c, digits=digits)) for _ in range(ROUNDS)]
        figures[f"{digits} digits, ms"] = round(1e3 * statistics.median(times), 1)
    return figures


def sizes(c: Certificate) -> dict[str, Any]:
    """Return the proof for a whole box of rod radii and lengths."""
    begun, worked = perf_counter(), process_time()
    p = prove(c, parameters=BOX)
    return {
        "box": ", ".join(f"{name} in {side}" for name, side in BOX.items()),
        "proved, %": round(100 * p.proved_fraction, 4),
        "cells": len(p.cells),
        "seconds": round(perf_counter() - begun, 1),
        "processor seconds": round(process_time() - worked, 1),
    }


def faint(count: int) -> dict[str, Any]:
    """Return how many regular minima are proved whose numbers floating point takes for zero."""
    rng = np.random.default_rng(1)
    proved = 0
    for k in range(count):
        weights = [10.0 ** -rng.uniform(8, 30) if k % 2 else 1.0, 1.0]
        rng.shuffle(weights)
        angle = 10.0 ** -rng.uniform(2, 12) if k % 3 else 0.75
        proved += prove(regular(angle, *weights, float(rng.integers(-2, 3)) / 4)).proved
    return {f"faint minima proved, of {count}": proved}


def outcome(proof: Proof, problem: Any, *, minimum: bool) -> str:
    """Return one of ``WORDS``; a problem is refused if its certificate does not claim a minimum."""
    if proof.proved:
        return "proved" if holds(problem, proof) else "FALSE"
    if "failed" in proof.conditions.values():
        return "refuted"
    return "undecided" if minimum else "refused"


def campaign(each: int) -> dict[str, Counter[str]]:
    """Return the outcomes of random problems, kind by kind."""
    totals = {}
    for number, kind in enumerate(KINDS):
        rng = np.random.default_rng([7, number])
        totals[kind] = Counter()
        for _ in range(each):
            problem = programme(kind, rng)
            start = problem.start() + departures(rng, problem.n)
            c = problem.certificate(start, search=bool(rng.integers(2)))
            proof = prove(c, digits=20, symmetry=problem.symmetry)
            totals[kind][outcome(proof, problem, minimum=c.is_minimum)] += 1
    return totals


def main() -> None:
    each = int(sys.argv[1]) if len(sys.argv) > 1 else EACH
    c = corner()
    figures: dict[str, Any] = {**precisions(c), **sizes(c), **faint(FAINT)}
    print_table("the corner of three contacts", ["", "figure"], list(map(list, figures.items())))
    totals = campaign(each)
    rows = [[kind, *(found[word] for word in WORDS)] for kind, found in totals.items()]
    whole = sum(totals.values(), Counter())
    shares = [f"{100 * whole[word] / whole.total():.1f} %" for word in WORDS]
    print_table(f"{whole.total()} problems", ["", *WORDS], [*rows, ["all", *shares]])
    write("proof", {**figures, "problems": whole.total(), "campaign": totals})


if __name__ == "__main__":
    main()
