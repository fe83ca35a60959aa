"""Never a false theorem: problems on the edge of being minima, whose strict minima are known."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import settings

from benchmarks.trials.adversarial import CASES, problems, trial
from polycorner import certify
from polycorner.proofs import prove

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")

DIGITS = 60  # more than the forty of the numbers that decide
MANY = max(2, settings().max_examples // 100)  # of each kind


def at(proof, point):
    """Whether an exact point lies in the enclosure."""
    names = proof.certificate.problem.polyhedron.manifold.names
    return all(
        sp.Rational(low) <= sp.N(value, 200, maxn=2000) <= sp.Rational(up)
        for (low, up), value in zip((proof.enclosures[n] for n in names), point, strict=True)
    )


def attempted(posed):
    """Return the proof, and complain if it is false."""
    proof = prove(certify(posed.polyhedron, posed.energy, posed.point), digits=DIGITS)
    if proof.proved:
        known = [at(proof, point) for point in posed.truth]
        assert any(known), f"false theorem: {posed}\n{proof}"
    return proof


def test_no_false_theorem_in_a_few_adversarial_problems():
    rng = np.random.default_rng(11)
    for k in rng.choice(len(CASES), 8, replace=False):
        attempted(trial(CASES[k], rng))


def test_no_false_theorem_in_adversarial_problems_of_every_kind():
    for posed in problems(np.random.default_rng(12), MANY * len(CASES)):
        attempted(posed)
