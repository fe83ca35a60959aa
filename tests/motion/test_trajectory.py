"""A trajectory as it is printed: when, how many, what happened, and where the energy went."""

import math

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron
from polycorner.motion.engine.driver import Effort
from polycorner.motion.events import Event, EventKind
from polycorner.motion.system import System
from polycorner.motion.trajectory import Trajectory

M = Manifold(("phi", "z"), periods=(math.tau, math.inf))
PHI, Z = M.symbols
PHI_DOT, Z_DOT = sp.symbols("phi_dot z_dot", real=True)


@pytest.fixture
def path():
    """Three instants, written down: nothing is simulated."""
    system = System(Polyhedron(M, {"floor": Z}), (PHI_DOT**2 + Z_DOT**2) / 2, 10 * Z)
    count = 3
    q = np.array([[[0.0, 1.0]], [[0.25, 0.5]], [[0.5, 0.0]]])
    return Trajectory(
        system=system,
        dt=0.01,
        times=np.array([0.0, 0.5, 1.5]),
        q=q,
        v=np.zeros_like(q),
        rests=np.array([[False], [False], [True]]),
        present=np.ones((count, 1), dtype=bool),
        touching=((), (), (((0,), "floor", 1.0),)),
        kinetic=np.array([0.0, 2.5, 0.0]),
        potential=np.array([10.0, 5.0, 0.0]),
        dissipated={"impact": np.array([0.0, 0.0, 7.25]), "sliding": np.array([0.0, 2.0, 2.75])},
        work={"applied": np.zeros(count)},
        events=(
            Event(1.0, EventKind.MADE, (0,), "floor", 3.0),
            Event(1.25, EventKind.REST, (0,), "", 0.0),
        ),
        max_penetration=1.5e-7,
        effort=Effort(150, 12, 0, 30, 0, 3e-13),
    )


def row(path, *beginning):
    """Return what follows the words with which one line of the table begins."""
    lines = [line.split() for line in str(path).splitlines()]
    words = [word for part in beginning for word in part.split()]
    (found,) = [line[len(words) :] for line in lines if line[: len(words)] == words]
    return found


def test_one_line(path):
    assert repr(path) == "Trajectory(1 body; 0 to 1.5 s in 3 instants; 2 events)"


def test_times_bear_their_unit(path):
    assert row(path, "time") == ["0", "s", "to", "1.5", "s,", "in", "3", "instants"]
    assert row(path, "step") == ["0.01", "s"]


def test_energies_at_both_ends_and_where_they_went(path):
    assert row(path, "potential") == ["10", "0"]
    assert row(path, "dissipated by impact") == ["0", "7.25"]
    assert row(path, "dissipated by sliding") == ["0", "2.75"]
    assert float(row(path, "energy audit")[0]) == pytest.approx(path.audit, abs=1e-3)


def test_events_are_counted_by_kind(path):
    assert row(path, EventKind.MADE.sentence) == ["1"]
    assert row(path, EventKind.REST.sentence) == ["1"]
    assert EventKind.EXIT.sentence not in str(path)


def test_placement_at_last_with_units(path):
    assert row(path, "body phi") == ["(rad)", "z"]
    assert row(path, "0 0.5") == ["0"]
    assert row(path, "at the end") == ["1", "present,", "1", "of", "them", "at", "rest"]


def test_the_same_in_a_notebook(path):
    html = path._repr_html_()
    for words in ("dissipated by sliding", "phi (rad)", "at the end"):
        assert words in html
