"""The problems of Hock and Schittkowski from their standard starts, judged independently.

    python -m benchmarks.trials.run_hock_schittkowski [HS71 ...]

*best*: a certified minimum with the best known value.  *local*: a certified minimum that is higher,
and that the judge could not refute.  *declined*: any other verdict, or a sentence of refusal.
*wrong*: a certified minimum beside which the judge finds lower points, or outside the set, or an
INFEASIBLE although the violation decreases nearby.  The proofs are those of certified minima.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from time import perf_counter

import numpy as np

from benchmarks.side_by_side import print_table, write
from benchmarks.trials.hock_schittkowski import Problem, problems
from benchmarks.trials.judge import FEASIBLE, SAME, Judge
from benchmarks.trials.stages import Facts, staged
from polycorner import Certificate, minimise, prove
from polycorner.minimisation import Verdict

SECONDS = 120.0
CLASSES = ("best", "local", "declined", "wrong", "stopped", "crash")


def judge_of(problem: Problem) -> Judge:
    walls = []
    for x, (low, high) in zip(problem.symbols, problem.bounds, strict=True):
        walls += [] if low is None else [x - low]
        walls += [] if high is None else [high - x]
    return Judge(
        problem.symbols, problem.energy, [*problem.inequalities, *walls], problem.equations
    )


def trial(problem: Problem) -> Iterator[Facts]:
    """Yield what is found, how it is judged, what SLSQP finds, and whether it is proved."""
    start = perf_counter()
    try:
        found = minimise(problem.polyhedron, problem.energy, problem.start)
        verdict = found.verdict
    except ValueError as error:
        yield {"class": "declined", "verdict": "ValueError", "reason": str(error)}
        return
    yield {"seconds": round(perf_counter() - start, 3), "verdict": verdict.name}
    generator = np.random.default_rng(0)
    judge = judge_of(problem)
    value = judge.values(found.point)[0]
    yield {"energy": value, "point": found.point.tolist(), "iterations": found.iterations}
    yield judged(problem, judge, found, generator)
    if verdict.is_minimum:
        yield proof_of(found)
    yield rival(problem, judge)


def judged(
    problem: Problem, judge: Judge, found: Certificate, generator: np.random.Generator
) -> Facts:
    verdict, q = found.verdict, found.point
    if verdict is Verdict.INFEASIBLE:
        if judge.less_violated_nearby(q, generator):
            return {"class": "wrong", "reason": "called infeasible, but less violated nearby"}
        return {"class": "declined", "reason": verdict.value}
    if not verdict.is_minimum:
        return {"class": "declined", "reason": verdict.value}
    scale = 1 + float(np.abs(q).max())
    if judge.violation(q) > 1e3 * FEASIBLE * scale:
        return {"class": "wrong", "reason": f"outside the set by {judge.violation(q):.1e}"}
    for lower in judge.lower_points(q, generator):
        where = f"lower by {lower.gain:.1e} within {lower.radius:g}, at {lower.point}"
        return {"class": "wrong", "reason": where}
    value = judge.values(q)[0]
    if value <= problem.best + SAME * (1 + abs(problem.best)):
        return {"class": "best"}
    return {"class": "local", "reason": f"{value:.8g}; best known {problem.best:.8g}"}


def proof_of(found: Certificate) -> Facts:
    try:
        proof = prove(found)
    except ValueError as error:
        return {"proof": "refused", "unproved": {"prove": str(error)}}
    if proof.proved:
        return {"proof": "proved"}
    open_ones = {name: s for name, s in proof.conditions.items() if s != "proved"}
    status = "failed" if "failed" in open_ones.values() else "undecided"
    return {"proof": status, "unproved": {name: proof.reasons[name] for name in open_ones}}


def rival(problem: Problem, judge: Judge) -> Facts:
    """Return what SLSQP finds from the same start."""
    bounds = [(low, high) for low, high in problem.bounds]
    start = [
        float(np.clip(x, -np.inf if low is None else low, np.inf if high is None else high))
        for x, (low, high) in zip(problem.start, bounds, strict=True)
    ]
    end = judge.slsqp(np.array(start), bounds)
    return {"slsqp": judge.values(end)[0], "slsqp violation": judge.violation(end)}


def row(name: str, facts: Facts) -> list[object]:
    energy = facts.get("energy")
    return [
        name,
        facts.get("class", ""),
        facts.get("verdict", ""),
        "" if energy is None else f"{energy:.8g}",
        f"{facts['best known']:.8g}",
        "" if "slsqp" not in facts else f"{facts['slsqp']:.8g}",
        facts.get("proof", ""),
        facts.get("seconds", ""),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", nargs="*", help="problems, such as HS35; default all")
    names = parser.parse_args().name
    results: dict[str, Facts] = {}
    _warm()
    for problem in problems(*names):
        facts = staged(trial, problem, seconds=SECONDS)
        facts["best known"] = problem.best
        if "class" not in facts:
            facts["class"] = "crash" if "crash" in facts else "stopped"
        results[problem.name] = facts
        print(*row(problem.name, facts), facts.get("reason", facts.get("crash", "")), flush=True)
    columns = ["", "class", "verdict", "energy", "best known", "SLSQP", "proof", "s"]
    print_table("Hock-Schittkowski", columns, [row(name, facts) for name, facts in results.items()])
    counts = Counter(facts["class"] for facts in results.values())
    proofs = Counter(
        "FALSE" if facts["class"] == "wrong" and facts["proof"] == "proved" else facts["proof"]
        for facts in results.values()
        if "proof" in facts
    )
    print({name: counts[name] for name in CLASSES}, "proofs", dict(proofs))
    if not names:
        write("hock_schittkowski", {"counts": counts, "proofs": proofs, "problems": results})


def _warm() -> None:
    """Compile what every search needs before processes are forked."""
    problem = next(problems("HS35"))
    minimise(problem.polyhedron, problem.energy, problem.start).explain()


if __name__ == "__main__":
    main()
