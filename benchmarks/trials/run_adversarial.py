"""Adversarial proofs: problems on the edge of being minima, whose strict minima are known exactly.

    python -m benchmarks.trials.run_adversarial [COUNT]

*proved true*: a theorem whose enclosure contains a strict minimum.  *proved false*: a theorem about
anything else.  *failed, none*: a hypothesis is violated, and there is no minimum; *failed, one*:
there is one all the same, beside the enclosed point or of a kind that the theorem does not cover.
*open*: undecided.  A verdict is *false* if it says that a minimum is strict where none is.
"""

import argparse
import warnings
from collections import Counter
from collections.abc import Iterator

import numpy as np
import sympy

from benchmarks.side_by_side import print_table, write
from benchmarks.trials import adversarial
from benchmarks.trials.adversarial import Trial
from benchmarks.trials.stages import Facts, staged
from polycorner import certify, minimise, prove
from polycorner.minimisation import Verdict
from polycorner.proofs import Proof

SECONDS = 30.0
ALL = 500
SEED = 2
STRICT = (Verdict.STRICT_MINIMUM, Verdict.WEAK_MINIMUM)
COLUMNS = (
    "proved true", "proved false", "failed, none", "failed, one", "open, none", "open, one",
    "stopped", "crash",
)  # fmt: skip


def contains(proof: Proof, point: tuple[sympy.Expr, ...]) -> bool:
    """Whether an exact point lies in the enclosure of the coordinates."""
    names = proof.certificate.problem.polyhedron.manifold.names
    return all(
        sympy.Rational(low) <= sympy.N(x, 200, maxn=2000) <= sympy.Rational(high)
        for (low, high), x in zip((proof.enclosures[n] for n in names), point, strict=True)
    )


def trial(posed: Trial) -> Iterator[Facts]:
    """Yield the verdict at the point and what becomes of its proof."""
    found = certify(posed.polyhedron, posed.energy, posed.point)
    claimed = found.verdict in STRICT
    yield {"verdict": found.verdict.name, "false verdict": claimed and not posed.truth}
    proof = prove(found)
    if proof.proved:
        true = any(contains(proof, point) for point in posed.truth)
        yield {"outcome": "proved true" if true else "proved false"}
        return
    open_ones = {name: str(s) for name, s in proof.conditions.items() if s != "proved"}
    word = "failed" if "failed" in open_ones.values() else "open"
    yield {"outcome": f"{word}, {'one' if posed.truth else 'none'}"}
    yield {"reasons": {name: f"{s}: {proof.reasons[name]}" for name, s in open_ones.items()}}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=ALL, help=f"problems ({ALL})")
    count = parser.parse_args().count
    warnings.simplefilter("ignore")  # formulas with kinks are meant
    _warm()
    totals: dict[str, Counter[str]] = {}
    results = []
    for number, posed in enumerate(adversarial.problems(np.random.default_rng(SEED), count)):
        facts = staged(trial, posed, seconds=SECONDS)
        broken = "crash" if "crash" in facts else "stopped"
        facts["outcome"] = facts.get("outcome", broken)
        results.append({"name": posed.name, **facts})
        total = totals.setdefault(posed.name, Counter())
        total[facts["outcome"]] += 1
        total["false verdict"] += bool(facts.get("false verdict"))
        if facts["outcome"] in {"proved false", "crash", "stopped"} or facts.get("false verdict"):
            described = f"{posed.polyhedron.functions}, {posed.polyhedron.equations}"
            print(number, facts, posed, described, flush=True)
    columns = [*COLUMNS, "false verdict"]
    rows = [[name, *(total[c] for c in columns)] for name, total in totals.items()]
    whole = sum(totals.values(), Counter())
    rows.append(["all", *(whole[c] for c in columns)])
    print_table(f"{count} adversarial problems", ["", *columns], rows)
    if count == ALL:
        write("adversarial", {"counts": whole, "kinds": totals, "problems": results})


def _warm() -> None:
    """Compile what every search needs before processes are forked."""
    posed = next(adversarial.problems(np.random.default_rng(0), 1))
    minimise(posed.polyhedron, posed.energy, posed.point)


if __name__ == "__main__":
    main()
