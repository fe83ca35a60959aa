"""Random formulas: every function of the front door on each, judged independently.

    python -m benchmarks.trials.run_random_formulas [COUNT [FIRST]]

Each problem is built, minimised, certified at a simple point and where the search ended, printed,
explained and proved.  *right*: a certified minimum that the judge could not refute.  *declined*:
another verdict, or a refusal in words.  *wrong*: a claim that the judge refuted, of whatever kind.
*doubted*: "not a minimum" where the judge finds nothing lower nearby.  *crash*: an exception that
does not come from the package's own checks.
"""

import argparse
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import polycorner
from benchmarks.side_by_side import print_table, write
from benchmarks.trials import random_formulas
from benchmarks.trials.judge import FEASIBLE, RADII, TINY, Judge
from benchmarks.trials.random_formulas import Problem
from benchmarks.trials.stages import Facts, staged
from polycorner import (
    Certificate,
    Manifold,
    Polyhedron,
    certify,
    minimise,
    prove,
    stratum_at,
)
from polycorner.minimisation import Verdict

SECONDS = 30.0
SEED = 1
WORST = ("crash", "wrong", "stopped", "doubted", "right", "declined")
PACKAGE = str(Path(polycorner.__file__).parent)
NOT_MINIMA = (Verdict.NOT_STATIONARY, Verdict.SADDLE, Verdict.UNBOUNDED)


class RefusedError(Exception):
    """The package declined in words of its own."""


def asked(act: Callable[[], Any]) -> Any:
    """Return what ``act`` returns; a refusal raised by the package itself is a RefusedError."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return act()
        except (ValueError, TypeError, polycorner.PolycornerError) as error:
            raised_in = traceback.extract_tb(error.__traceback__)[-1].filename
            if raised_in.startswith(PACKAGE):
                raise RefusedError(str(error)) from error
            raise


def trial(problem: Problem) -> Iterator[Facts]:
    """Yield ``{claim: (class, reason)}`` for everything that is said about a problem."""
    judge = Judge(
        problem.symbols, problem.energy, problem.flat_inequalities, list(problem.equations)
    )
    try:
        D = asked(lambda: problem.polyhedron)
    except RefusedError as error:
        yield {"build": ("declined", str(error))}
        return
    for what, act in (
        ("minimise", partial(minimise, D, problem.energy, problem.start)),
        ("certify", partial(certify, D, problem.energy, problem.special)),
    ):
        try:
            certificate, verdict = asked(partial(_read, act))
        except RefusedError as error:
            yield {what: ("declined", str(error))}
            continue
        yield {f"{what} at": certificate.point.tolist()}
        yield {what: judged(judge, certificate, verdict)}
        yield from spoken(what, certificate)


def _read(act: Callable[[], Certificate]) -> tuple[Certificate, Verdict]:
    certificate = act()
    return certificate, certificate.verdict


def judged(judge: Judge, certificate: Certificate, verdict: Verdict) -> tuple[str, str]:
    generator = np.random.default_rng(0)
    q, name = certificate.point, verdict.name
    outside = judge.violation(q)
    if verdict.is_minimum:
        return _minimum(judge, certificate, verdict, generator)
    if verdict is Verdict.OUTSIDE and outside <= FEASIBLE:
        return "wrong", f"{name}: violation {outside:.1e} only"
    if verdict is Verdict.INFEASIBLE and judge.reachable(q, generator):
        return "wrong", f"{name}: feasible points exist, and the violation decreases"
    defined = np.isfinite(judge.values(q)[0])
    if (
        verdict in NOT_MINIMA
        and defined
        and not any(judge.lower_points(q, generator, (*TINY, *RADII)))
    ):
        return "doubted", f"{name}: nothing lower was found nearby"
    return "declined", name


def _minimum(
    judge: Judge, certificate: Certificate, verdict: Verdict, generator: np.random.Generator
) -> tuple[str, str]:
    q = certificate.point
    if not judge.violation(q) <= 1e3 * FEASIBLE * (1 + np.abs(q).max()):
        return "wrong", f"{verdict.name}: outside by {judge.violation(q):.1e}"
    for lower in judge.lower_points(q, generator):
        gain, radius = lower.gain, lower.radius
        return "wrong", f"{verdict.name}: lower by {gain:.1e} within {radius:g} at {lower.point}"
    if verdict is not Verdict.MINIMUM_ALONG_LOCUS and (same := judge.as_low(q)):
        return "wrong", f"{verdict.name}: not strict, as low at {same}"
    return "right", verdict.name


def spoken(what: str, certificate: Certificate) -> Iterator[Facts]:
    """Print, explain, classify and prove; yield the status of the proof."""
    for act in (
        certificate.explain,
        lambda: repr(certificate),
        lambda: str(certificate),
        lambda: certificate.lemma,
        lambda: str(stratum_at(certificate.problem.polyhedron, certificate.point)),
    ):
        try:
            asked(act)
        except RefusedError as error:
            yield {f"{what}, refusal": str(error)}
    try:
        proof = asked(lambda: prove(certificate))
        text = asked(lambda: str(proof))
    except RefusedError:
        yield {f"{what}, proof": "refused"}
        return
    del text
    statuses = set(map(str, proof.conditions.values()))
    status = "proved" if proof.proved else "failed" if "failed" in statuses else "undecided"
    yield {f"{what}, proof": status}


def summary(facts: Facts) -> str:
    """Return the worst class of all claims, that of the search before that of declining."""
    if "crash" in facts:
        return "crash"
    classes = {facts[w][0] for w in ("build", "minimise", "certify") if w in facts}
    for what in ("minimise", "certify"):
        if facts.get(f"{what}, proof") == "proved" and facts[what][0] == "wrong":
            facts["false proof"] = what
    if "stopped" in facts and "wrong" not in classes:
        return "stopped"
    return next((c for c in WORST if c in classes), "stopped")


def run(count: int, first: int) -> dict[str, Facts]:
    results = {}
    for number in range(first, first + count):
        problem = random_formulas.problem(SEED, number)
        facts = staged(trial, problem, seconds=SECONDS)
        facts["class"] = summary(facts)
        if facts["class"] not in {"right", "declined"}:
            facts["problem"] = repr(problem)
            print(facts["class"], problem)
            for what in ("crash", "traceback", "minimise at", "minimise", "certify", "stopped"):
                if what in facts:
                    print("   ", what, facts[what])
            sys.stdout.flush()
        results[problem.name] = facts
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=1000, help="problems (1000)")
    parser.add_argument("first", nargs="?", type=int, default=0, help="number of the first (0)")
    chosen = parser.parse_args()
    _warm()
    results = run(chosen.count, chosen.first)
    table = {}
    for what in ("minimise", "certify"):
        claims = Counter(facts[what][0] for facts in results.values() if what in facts)
        proofs = Counter(facts.get(f"{what}, proof", "") for facts in results.values())
        table[what] = {"claims": dict(claims), "proofs": {k: v for k, v in proofs.items() if k}}
    counts = Counter(facts["class"] for facts in results.values())
    false = [name for name, facts in results.items() if "false proof" in facts]
    rows = [[c, counts[c], *(table[w]["claims"].get(c, 0) for w in table)] for c in WORST]
    print_table("random formulas", ["", "problems", *table], rows)
    print({what: table[what]["proofs"] for what in table}, "false proofs", false)
    why = {what: declined(what, results) for what in table}
    for what, reasons in why.items():
        print(f"{what} declined: {dict(reasons)}")
    shown = {"counts": counts, "claims": table, "declined": why, "false proofs": false}
    write("random_formulas", {**shown, "problems": results})


def declined(what: str, results: dict[str, Facts]) -> Counter[str]:
    """Return how often each verdict was given instead of a minimum; a refusal is "in words"."""
    names = {verdict.name for verdict in Verdict}
    given = (facts[what] for facts in results.values() if what in facts)
    return Counter(
        reason if reason in names else "in words" for c, reason in given if c == "declined"
    )


def _warm() -> None:
    """Compile what every search needs before processes are forked."""
    M = Manifold.euclidean("x")
    certify(Polyhedron(M, [4 - M.symbols[0] ** 2]), M.symbols[0], [-2.0]).explain()
    minimise(Polyhedron(M, [4 - M.symbols[0] ** 2]), M.symbols[0], [0.0])


if __name__ == "__main__":
    main()
