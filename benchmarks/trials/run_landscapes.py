"""Landscapes with a proof, of problems whose trees are known.

    python -m benchmarks.trials.run_landscapes [COUNT [FIRST]]

*complete*: said to be complete, and nothing in it is false; *open*: not said to be complete, and
nothing that is said is false; *false*: anything else; *refused*: a sentence says why not.
"""

import argparse
import time
import warnings
from collections import Counter
from collections.abc import Iterator

import numpy as np

from benchmarks.side_by_side import print_table, write
from benchmarks.trials.generated_landscapes import DRAWS, Posed, problem
from benchmarks.trials.stages import Facts, staged
from benchmarks.trials.tree_judge import complaints, tightness
from polycorner.landscapes import landscape

SECONDS = 30.0
ALL = 70 * len(DRAWS)
SEED = 11
MOST = 100_000
CAPPED = 7  # one in so many is asked up to an energy only,
BETWEEN = 0.01  # which is not that of a minimum or a pass
COLUMNS = ("complete", "open", "refused", "false", "stopped", "crash")


def cap(posed: Posed) -> float:
    """Return an energy between those of minima and passes."""
    heights = np.array([h for some in posed.truth.heights.values() for h in some])
    return float(np.median([*heights[np.isfinite(heights)], *posed.truth.energies])) + BETWEEN


def trial(posed: Posed, capped: bool = False) -> Iterator[Facts]:
    """Yield what is found and what is false in it."""
    started = time.process_time()
    try:
        found = landscape(
            posed.polyhedron, posed.energy, box=posed.box, region=posed.region,
            symmetry=posed.symmetry, cap=cap(posed) if capped else np.inf, max_boxes=MOST,
        )  # fmt: skip
    except ValueError as error:
        yield {"outcome": "refused", "said": str(error)}
        return
    yield {"seconds": time.process_time() - started}
    wrong = list(complaints(posed, found))
    outcome = "false" if wrong else "complete" if found.complete else "open"
    close, pairs = tightness(found)
    yield {
        "outcome": outcome, "wrong": wrong, "minima": len(found.minima),
        "passes": len(found.passes), "known": len(posed.truth.energies), "close": close,
        "pairs": pairs, "loops": len(found.loops), "notes": found.notes,
        "euler": found.euler is not None and posed.truth.euler(found.cap) is not None,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=ALL, help=f"problems ({ALL})")
    parser.add_argument("first", nargs="?", type=int, default=0, help="number of the first (0)")
    given = parser.parse_args()
    began = time.monotonic()
    warnings.simplefilter("ignore")
    totals: dict[str, Counter[str]] = {}
    sums: Counter[str] = Counter()
    results = []
    for number in range(given.first, given.first + given.count):
        posed = problem(SEED, number)
        facts = staged(trial, posed, number % CAPPED == 0, seconds=SECONDS)
        outcome = facts.get("outcome", "crash" if "crash" in facts else "stopped")
        results.append({"number": number, "kind": posed.kind, **facts})
        totals.setdefault(posed.kind, Counter())[outcome] += 1
        for name in ("seconds", "minima", "passes", "pairs", "close", "loops"):
            sums[name] += facts.get(name, 0)
        if outcome in {"false", "crash", "stopped"}:
            print(number, posed.kind, outcome, facts, flush=True)
    rows = [[kind, *(total[c] for c in COLUMNS)] for kind, total in sorted(totals.items())]
    whole = sum(totals.values(), Counter())
    rows.append(["all", *(whole[c] for c in COLUMNS)])
    print_table(f"{given.count} landscapes with known trees", ["", *COLUMNS], rows)
    print({name: round(total, 1) for name, total in sums.items()})
    print(f"{time.monotonic() - began:.0f} s")
    if given.count == ALL:
        write("landscapes", {"counts": whole, "kinds": totals, "problems": results})


if __name__ == "__main__":
    main()
