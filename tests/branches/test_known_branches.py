"""Problems whose arcs and events are known by construction; the trials have thousands of them."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from benchmarks.trials.known_branches import FORMS, problem
from benchmarks.trials.run_branches import complaints
from polycorner import Manifold, Polyhedron, SmoothFunction, stationary_on
from polycorner.branches import branches, prove_branches
from polycorner.minimisation.problem import Problem

SEED = 7
SIMPLE = ["regular", "opens", "corner_limit", "fold", "loop", "steep"]


def start(posed):
    return stationary_on(posed.polyhedron, posed.energy, posed.start, list(posed.arcs[0].active))


@pytest.mark.parametrize("kind", range(len(FORMS)), ids=[f.__name__ for f in FORMS])
def test_arcs_and_events_are_the_known_ones(kind):
    posed = problem(SEED, kind)
    found = branches(start(posed), "t", posed.interval)
    assert list(complaints(posed, found)) == []
    assert found.closed


def test_the_judge_notices_what_is_lost_and_what_is_false():
    posed = problem(SEED, [f.__name__ for f in FORMS].index("corner_limit"))
    found = branches(start(posed), "t", posed.interval)
    lost = replace(found, arcs=found.arcs[1:])
    turned = replace(found, arcs=(replace(found.arcs[0], index=7), *found.arcs[1:]))
    moved = replace(found.events[0], kind=type(found.events[0].kind).FOLD)
    for copy in (lost, turned, replace(found, events=(moved, *found.events[1:]))):
        assert list(complaints(posed, copy)) != []


@pytest.mark.parametrize("number", [7, 18])
def test_pitchforks_are_complete(number):
    """The mirror is found; nothing else is in a box around the arcs."""
    posed = problem(11, number, mirror=True)
    found = branches(start(posed), "t", posed.interval)
    assert list(complaints(posed, found)) == []
    assert "BRANCH" in {e.kind.name for e in found.events}
    every = np.vstack([arc.points for arc in found.arcs])
    room = 0.02 * np.array(posed.polyhedron.manifold.scales)
    box = np.array([every.min(axis=0) - room, every.max(axis=0) + room]).T
    assert prove_branches(found, box=box.tolist()).complete


def plain(number):
    """Return a problem that sparse matrices decide, or None."""
    posed = problem(SEED, number)
    kinds = {e for k in posed.events for e in k.kinds}
    easy = kinds <= {"OPENS", "CLOSES", "CORNER_LIMIT", "FOLD", "EXCHANGE"}
    return posed if easy and not posed.polyhedron.is_union else None


@pytest.mark.parametrize("form", SIMPLE)
def test_sparse_matrices_give_the_same(form, monkeypatch):
    first = [f.__name__ for f in FORMS].index(form)
    posed = next(filter(None, map(plain, range(first, 50 * len(FORMS), len(FORMS)))))
    at = start(posed)
    assert at.found is not None  # which full matrices give
    monkeypatch.setattr(Problem, "is_sparse", property(lambda _: True))
    found = branches(at, "t", posed.interval)
    assert list(complaints(posed, found)) == []
    assert found.closed


def test_what_touches_is_not_decided():
    """The curves of ``x^3/3 - t^4 x`` touch: nothing is said of what leaves."""
    M = Manifold.euclidean("x")
    (x,) = M.symbols
    t = sympy.Symbol("t")
    energy = SmoothFunction("energy", x**3 / 3 - t**4 * x, M, parameters={"t": 0.5})
    D = Polyhedron(M, {"far": x + 10})
    d = branches(stationary_on(D, energy, [0.25], []), "t", (-1.0, 1.0))
    assert not d.closed
    undecided = [e.parameter for e in d.events if e.kind.name in {"UNDECIDED", "BRANCH"}]
    np.testing.assert_allclose(undecided, 0, atol=0.05)
