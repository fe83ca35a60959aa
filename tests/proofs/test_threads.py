"""Proofs in many threads: the same numbers as one after the other, and nothing left changed."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import sympy as sp
from flint import ctx

from polycorner import Manifold, Polyhedron, SmoothFunction, certify
from polycorner.intervals.balls import ball, precision
from polycorner.intervals.tapes import Tape
from polycorner.proofs import prove

M = Manifold.euclidean("x y")
x, y = M.symbols
b = sp.Symbol("b", real=True)
PROOFS, THREADS = 64, 8
WALL = SmoothFunction("wall", x - b**2, M, parameters={"b": 1.0})


def parabola(k):
    """Return a certificate on a parabola, with a slope and a number of digits of its own."""
    slope = sp.Rational(k + 1, 7)
    point = [-(k + 1) / 14, ((k + 1) / 14) ** 2]
    return certify(Polyhedron(M, {"bowl": y - x**2}), slope * x + y, point), 5 + 37 * k % 200


def walled():
    return certify(Polyhedron(M, [WALL]), x + y**2, [1, 0])


def told(proof):
    """Return everything that a proof says."""
    cells = [(c.parameters, c.status, c.reason, c.bounds) for c in proof.cells]
    said = (proof.enclosures, proof.box, proof.region, proof.conditions, proof.reasons, cells)
    return (*said, proof.enclose(sp.exp(x)))


def proved(k):
    if k % 8 == 7:
        return told(prove(walled(), parameters={"b": (0.5, 1.0 + k / 64)}))
    certificate, digits = parabola(k)
    return told(prove(certificate, digits=digits))


@pytest.fixture
def unusual():
    """A precision of the caller's own, which no proof may change."""
    before, ctx.prec = ctx.prec, 71
    yield 71
    assert ctx.prec == 71
    ctx.prec = before


def test_proofs_in_eight_threads_are_those_of_one_bit_for_bit(unusual):
    alone = [proved(k) for k in range(PROOFS)]
    assert ctx.prec == unusual
    with ThreadPoolExecutor(THREADS) as pool:
        together = list(pool.map(proved, range(PROOFS)))
    assert together == alone


def test_the_callers_precision_does_not_enter_a_proof(unusual):
    here = proved(3), proved(7)
    ctx.prec = 20
    there = proved(3), proved(7)
    ctx.prec = unusual
    assert here == there


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_the_precision_is_restored_after_an_exception(unusual, error):
    def stopped(*_):
        raise error

    with pytest.raises(error):
        prove(walled(), parameters={"b": (0.5, 1.5)}, progress=stopped)
    assert ctx.prec == unusual
    with pytest.raises(error), precision(300), precision(400):
        stopped()
    assert ctx.prec == unusual


def test_the_precision_is_restored_after_an_interrupt_at_any_evaluation(unusual, monkeypatch):
    certificate, digits = parabola(2)
    known = told(prove(certificate, digits=digits))
    evaluate, calls = Tape.run, []

    def interrupted(tape, box):
        calls.append(ctx.prec)
        if len(calls) == stop:
            raise KeyboardInterrupt
        return evaluate(tape, box)

    monkeypatch.setattr(Tape, "run", interrupted)
    stop = 0
    prove(certificate, digits=digits)
    assert len(set(calls)) > 2  # precisions in use, nested in one another
    for stop in range(1, len(calls) + 1):  # noqa: B007 - read by `interrupted`
        calls.clear()
        with pytest.raises(KeyboardInterrupt):
            prove(certificate, digits=digits)
        assert ctx.prec == unusual
    monkeypatch.undo()
    with ThreadPoolExecutor(1) as pool:  # the turn was given back, too
        assert pool.submit(lambda: told(prove(certificate, digits=digits))).result() == known


@pytest.mark.usefixtures("unusual")
def test_blocks_of_a_thread_may_be_nested():
    third = ball(1) / 3
    with precision(200):
        with precision(100):
            coarse = ball(1) / 3
        fine = ball(1) / 3
    assert fine.rad() < coarse.rad() < third.rad()
