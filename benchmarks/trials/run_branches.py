"""Equilibria over a parameter, in problems whose arcs and events are known by construction.

    python -m benchmarks.trials.run_branches [COUNT [FIRST]]

*complete*: the diagram is said to be closed, and its arcs and events are the known ones.  *open*:
it is not said to be closed, and nothing in it is wrong.  Anything else is *false*: an arc lost
although the diagram is closed, an arc or a decided event that there is not, another index.
"""

import argparse
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator

import numpy as np

from benchmarks.side_by_side import print_table, write
from benchmarks.trials import known_branches
from benchmarks.trials.known_branches import KnownArc, Posed
from benchmarks.trials.stages import Facts, staged
from polycorner.branches import Arc, Diagram, branches
from polycorner.minimisation.methods import stationary_on

SECONDS = 30.0
ALL = 2000  # 125 of each kind
SEED = 5
CLOSE = 1e-5  # of places and values of the parameter; square roots of rounding are below it
ENDS = {"END", "UNDECIDED", "FAR"}
COLUMNS = ("complete", "open", "refused", "false", "stopped", "crash")


def complaints(posed: Posed, found: Diagram) -> Iterator[str]:
    """Yield what is false in a diagram."""
    yield from _about_arcs(posed, found)
    yield from _about_events(posed, found)


def _about_arcs(posed: Posed, found: Diagram) -> Iterator[str]:
    matched: dict[int, list[int]] = {k: [] for k in range(len(posed.arcs))}
    for j, arc in enumerate(found.arcs):
        here = [k for k, known in enumerate(posed.arcs) if _on(posed, known, arc)]
        if len(here) != 1:
            yield f"arc {j} {arc.active} lies on {len(here)} known ones"
        for k in here:
            matched[k].append(j)
            known = posed.arcs[k]
            if arc.index != known.index:
                yield f"arc {j} has the index {known.index}, not {arc.index}"
            ends = [posed.unhide(q, t)[1] for q, t in _ends(arc)]
            if found.closed and abs(np.subtract(ends, [known.low, known.high])).max() > CLOSE:
                yield f"arc {j} is from {known.low} to {known.high}, not {ends}"
    for k, js in matched.items():
        if found.closed and len(js) != 1:
            yield f"arc {k} {sorted(posed.arcs[k].active)} was found {len(js)} times"


def _about_events(posed: Posed, found: Diagram) -> Iterator[str]:
    told = [e for e in found.events if e.kind.name not in ENDS]
    seen: Counter[int] = Counter()
    for e in told:
        place, at = posed.unhide(e.point, e.parameter)
        near = [
            i for i, known in enumerate(posed.events)
            if abs(known.at - at) < CLOSE
            and abs(place - posed.arcs[known.arcs[0]].place(known.at)).max() < 30 * CLOSE
        ]  # fmt: skip
        if len(near) != 1:
            yield f"{e.kind.name} at {at} is at {len(near)} known ones"
        for i in near:
            seen[i] += 1
            known = posed.events[i]
            if e.kind.name not in known.kinds:
                yield f"at {at} is {set(known.kinds)}, not {e.kind.name}"
            if found.closed and len(e.arcs) != len(known.arcs):
                yield f"{e.kind.name} at {at} has {len(known.arcs)} arcs, not {len(e.arcs)}"
    if found.closed and any(seen[i] != 1 for i in range(len(posed.events))):
        yield f"of {len(posed.events)} events {len(seen)} were found"


def _ends(arc: Arc) -> Iterator[tuple[np.ndarray, float]]:
    return zip(arc.points[[0, -1]], arc.parameters[[0, -1]].tolist(), strict=True)


def _on(posed: Posed, known: KnownArc, arc: Arc) -> bool:
    """Whether an arc lies on a known one."""
    if known.active != set(arc.active):
        return False
    for q, t in zip(arc.points, arc.parameters.tolist(), strict=True):
        place, at = posed.unhide(q, t)
        if not known.low - CLOSE <= at <= known.high + CLOSE:
            return False
        # Near a fold places move as the square root of the parameter.
        if abs(place - known.place(min(max(at, known.low), known.high))).max() > 30 * CLOSE:
            return False
    return True


def trial(posed: Posed) -> Iterator[Facts]:
    """Yield what is found and what is false in it."""
    started = time.process_time()
    try:
        at = stationary_on(posed.polyhedron, posed.energy, posed.start, [*posed.arcs[0].active])
        found = branches(at, "t", posed.interval)
    except ValueError as error:
        yield {"outcome": "refused", "said": str(error)}
        return
    wrong = list(complaints(posed, found))
    yield {
        "outcome": "false" if wrong else "complete" if found.closed else "open", "wrong": wrong,
        "arcs": len(posed.arcs), "events": len(posed.events),
        "notes": sorted({e.note for e in found.events if e.note}),
        "seconds": time.process_time() - started,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=ALL, help=f"problems ({ALL})")
    parser.add_argument("first", nargs="?", type=int, default=0, help="number of the first (0)")
    parser.add_argument("--seed", type=int, default=SEED)
    given = parser.parse_args()
    began = time.monotonic()
    warnings.simplefilter("ignore")
    totals: dict[str, Counter[str]] = {}
    results = []
    for number in range(given.first, given.first + given.count):
        posed = known_branches.problem(given.seed, number)
        facts = staged(trial, posed, seconds=SECONDS)
        outcome = facts.get("outcome", "crash" if "crash" in facts else "stopped")
        results.append({"number": number, "kind": posed.kind, **facts})
        totals.setdefault(posed.kind, Counter())[outcome] += 1
        if outcome not in {"complete", "open"} or facts["notes"]:
            shown = {k: v for k, v in facts.items() if k in {"wrong", "notes", "said", "traceback"}}
            print(number, posed.kind, outcome, shown, flush=True)
        sys.stdout.flush()
    rows = [[kind, *(total[c] for c in COLUMNS)] for kind, total in sorted(totals.items())]
    whole = sum(totals.values(), Counter())
    rows.append(["all", *(whole[c] for c in COLUMNS)])
    print_table(f"{given.count} problems with known arcs", ["", *COLUMNS], rows)
    arcs, events, seconds = (
        sum(r.get(k, 0) for r in results) for k in ("arcs", "events", "seconds")
    )
    print(f"{arcs} arcs, {events} events, {seconds:.0f} s of processor time")
    print(f"{time.monotonic() - began:.0f} s")
    if given.count == ALL:
        write("known_branches", {"counts": whole, "kinds": totals, "problems": results})


if __name__ == "__main__":
    main()
