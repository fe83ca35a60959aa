"""Lists with a proof, of problems whose stationary points are known exactly.

    python -m benchmarks.trials.run_known_lists [COUNT [FIRST]]

*complete*, *open*, *refused* and *false* are those of ``known.py``.  Every ninth proof is saved and
verified by the checker, and copies that are falsified have to be refused (``falsified.py``).
"""

import argparse
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator

from benchmarks.side_by_side import print_table, write
from benchmarks.trials import falsified, known_lists
from benchmarks.trials.known import Posed, complaints
from benchmarks.trials.stages import Facts, staged
from polycorner.proofs import stationary_points

SECONDS = 60.0
ALL = 2340  # sixty of each kind
SEED = 3
MOST = 10_000
CHECKED = 9  # one in so many proofs is checked,
MOST_CHECKED = 2000  # if it has so few boxes
RESOLUTION = 1e-3
COLUMNS = ("complete", "open", "refused", "declined", "false", "stopped", "crash")


def trial(posed: Posed, checked: bool) -> Iterator[Facts]:
    """Yield what is found and what is false in it."""
    started = time.process_time()
    try:
        found = stationary_points(
            posed.polyhedron, posed.energy, box=posed.box, symmetry=posed.symmetry,
            max_boxes=MOST, resolution=RESOLUTION,
        )  # fmt: skip
    except ValueError as error:
        yield {"outcome": "refused" if posed.refused else "declined", "said": str(error)}
        return
    wrong = ["it was not refused"] if posed.refused else list(complaints(posed, found))
    outcome = "false" if wrong else "complete" if found.complete else "open"
    yield {
        "outcome": outcome, "wrong": wrong, "boxes": found.tally.boxes, "listed": len(found),
        "known": len(posed.points) + len(posed.loci), "undecided": len(found.undecided),
        "open points": len(found.open_points),
        "seconds": time.process_time() - started,
    }  # fmt: skip
    if checked and found.tally.boxes <= MOST_CHECKED:
        yield {"files": dict(falsified.tried(posed, found))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=ALL, help=f"problems ({ALL})")
    parser.add_argument("first", nargs="?", type=int, default=0, help="number of the first (0)")
    began = time.monotonic()
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    totals: dict[str, Counter[str]] = {}
    files: Counter[tuple[str, bool]] = Counter()
    results = []
    for number in range(given.first, given.first + given.count):
        posed = known_lists.problem(SEED, number)
        facts = staged(trial, posed, number % CHECKED == 0, seconds=SECONDS)
        outcome = facts.get("outcome", "crash" if "crash" in facts else "stopped")
        for name, said in facts.get("files", {}).items():
            files[name, said == "verified"] += 1
            if (name == "as saved") != (said == "verified"):
                print(number, posed.kind, name, said, flush=True)
        results.append({"number": number, "kind": posed.kind, **facts})
        totals.setdefault(posed.kind, Counter())[outcome] += 1
        if outcome in {"false", "crash", "stopped"}:
            print(number, posed.kind, facts, posed.box, flush=True)
            print([(f.name, f.expression) for f in posed.polyhedron.functions], posed.energy)
        sys.stdout.flush()
    rows = [[kind, *(total[c] for c in COLUMNS)] for kind, total in sorted(totals.items())]
    whole = sum(totals.values(), Counter())
    rows.append(["all", *(whole[c] for c in COLUMNS)])
    print_table(f"{given.count} problems with known lists", ["", *COLUMNS], rows)
    kinds = sorted({name for name, _ in files})
    rows = [[name, files[name, True], files[name, False]] for name in kinds]
    print_table("saved proofs, and falsified copies", ["", "verified", "refused"], rows)
    print(f"{time.monotonic() - began:.0f} s")
    if given.count == ALL:
        write("known_lists", {"counts": whole, "kinds": totals, "problems": results})


if __name__ == "__main__":
    main()
