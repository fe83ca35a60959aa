"""Corners with too many contacts: which are shown to be minima, and whether any is that is none.

    python -m benchmarks.trials.run_corners [COUNT]

*proved*: a theorem about the known minimum, with its energy between the bounds and its point in the
enclosure.  *false*: a theorem about anything else.  *refuted*: a hypothesis is said to be violated
at a minimum.  *open*: undecided.
"""

import argparse
import time
from collections import Counter
from fractions import Fraction

import numpy as np
import sympy

from benchmarks.side_by_side import print_table, write
from benchmarks.trials.rational_corners import MINIMA, OTHERS, Corner, corners
from polycorner import certify, prove
from polycorner.proofs import Status

ALL = 2000
SEED = 5
COLUMNS = ("proved", "open", "refuted", "false")


def judged(posed: Corner) -> str:
    """Prove the point of a corner and compare with what is known of it."""
    proof = prove(certify(posed.polyhedron, posed.energy, posed.start))
    if not proof.proved:
        failed = Status.FAILED in proof.conditions.values()
        return "refuted" if failed and posed.is_minimum else "open"
    if not posed.is_minimum:
        return "false"
    if posed.kind == "open":  # the minimum is beside the point
        return "proved"
    at = dict(zip(posed.polyhedron.manifold.symbols, posed.point, strict=True))
    energy = sympy.Rational(posed.energy.subs(at))
    low, high = (Fraction(x) for x in proof.enclosures["energy"])
    loose = {len(posed.point) - 1} if posed.kind == "rattle" else set()
    inside = all(
        side[0] <= Fraction(int(x.p), int(x.q)) <= side[1]
        for j, (x, side) in enumerate(zip(posed.point, proof.region, strict=True))
        if j not in loose
    )
    true = inside and low <= Fraction(int(energy.p), int(energy.q)) <= high
    return "proved" if true else "false"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=ALL, help=f"corners ({ALL})")
    count = parser.parse_args().count
    totals = {kind: Counter[str]() for kind in (*MINIMA, *OTHERS)}
    begun = time.process_time()
    for number, posed in enumerate(corners(np.random.default_rng(SEED), count)):
        word = judged(posed)
        totals[posed.kind][word] += 1
        if word in {"false", "refuted"}:
            print(number, word, posed, flush=True)
    seconds = time.process_time() - begun
    rows = [[kind, *(str(total[word]) for word in COLUMNS)] for kind, total in totals.items()]
    print_table("Corners with too many contacts", ["kind", *COLUMNS], rows)
    print(f"{count} corners, {seconds / count:.3f} s of processor time each, formulas included")
    write("corners", {"count": count, "seconds": seconds, "kinds": totals})


if __name__ == "__main__":
    main()
