"""Values of minimisation and proofs travel between processes, and their arrays are read-only."""

import copy
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
import sympy

from polycorner import (
    Entrapment,
    Manifold,
    Polyhedron,
    SmoothFunction,
    Verdict,
    minima,
    minimise,
    prove,
    sensitivity,
)
from polycorner.minimisation import crossing

M = Manifold.euclidean("x y")
x, y = M.symbols
a = sympy.Symbol("a")
BOWL = SmoothFunction("bowl", y - a * x**2, M, parameters={"a": 1.0})
D = Polyhedron(M, [BOWL, SmoothFunction("lid", 2 - y, M)])
E = SmoothFunction("energy", x + y, M)


def certificate():
    return minimise(D, E, [1.0, 1.5])


def walled():
    wall = Polyhedron(M, [SmoothFunction("wall", x, M), SmoothFunction("floor", y, M)])
    pull = SmoothFunction("energy", x * (1 - a) + y, M, parameters={"a": 0.5})
    return minimise(wall, pull, [1.0, 1.0])


VALUES = {
    "problem": lambda: certificate().problem,
    "certificate": certificate,
    "analysis": lambda: certificate().analysis,
    "residuals": lambda: certificate().residuals,
    "lemma": lambda: certificate().lemma,
    "minima": lambda: minima(D, E, starts=5, box=[(-1, 1), (0, 2)]),
    "sensitivity": lambda: sensitivity(certificate(), ["a"]),
    "crossing": lambda: crossing(walled(), "wall", "a"),
    "proof": lambda: prove(certificate(), digits=8),
    "proof over a box": lambda: prove(certificate(), parameters={"a": (0.9, 1.1)}),
    "verdict": lambda: Verdict.SADDLE,
    "entrapment": lambda: Entrapment.HALF_U,
}


@pytest.fixture(scope="module")
def spawned():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        yield pool


def described(value):
    """Return a value as text, and the text after a computation that needs compiled code."""
    if hasattr(value, "problem"):
        return str(value), value.residuals.worst, value.explain()
    if hasattr(value, "certificate"):
        return str(value), value.certificate.residuals.worst
    if hasattr(value, "polyhedron"):
        return value.evaluate(np.array([0.5, 0.5]), 2)[0].tolist()
    return str(value)


def echoed(value):
    return value, described(value)


@pytest.mark.parametrize("kind", VALUES)
def test_a_value_survives_pickling_copying_and_a_spawned_process(kind, spawned):
    value = VALUES[kind]()
    for again in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value), copy.copy(value)):
        assert type(again) is type(value)
        assert described(again) == described(value)
    returned, there = spawned.submit(echoed, value).result()
    assert there == described(value)
    assert described(returned) == described(value)


def arrays_of(value):
    for part in vars(value).values():
        parts = (
            part.values() if isinstance(part, dict) else part if isinstance(part, tuple) else [part]
        )
        yield from (array for array in parts if isinstance(array, np.ndarray))


@pytest.mark.parametrize("kind", ["certificate", "analysis", "minima", "sensitivity", "crossing"])
def test_arrays_are_read_only_here_and_after_a_journey(kind, spawned):
    value = VALUES[kind]()
    for one in (
        value,
        pickle.loads(pickle.dumps(value)),
        spawned.submit(echoed, value).result()[0],
    ):
        found = list(arrays_of(one))
        assert found
        for array in found:
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0


def test_a_point_given_by_the_caller_stays_writable():
    start = np.array([1.0, 1.5])
    minimise(D, E, start)
    minima(D, E, starts=start[None])
    start[0] = 2.0
    assert certificate().point[0] == pytest.approx(-0.5)
