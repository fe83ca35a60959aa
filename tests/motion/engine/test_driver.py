"""The engine: room for contacts, and the key under which its code is cached."""

import ctypes
import os
import subprocess
import sys

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.bodies import Arrangement, HalfSpace, Hinge, Motor, capsule, polygon
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.errors import SolverError
from polycorner.formulas import shipped
from polycorner.motion.engine import driver, layout, sizes
from polycorner.motion.engine.arrays import CONTACTS_FULL, DONE, EVENTS_FULL
from polycorner.motion.engine.intermediate import ANY, SHIPPED, compiled_advance
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate, start


def test_room_for_contacts_grows(monkeypatch):
    """Contacts of sleepers are kept while others meet: both need room."""
    drum = DumbbellDrum(count=12, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    ample = start(drum, drum.state(starts), 1e-3)
    monkeypatch.setattr(driver, "CONTACTS_PER_BODY", 0)
    narrow = start(drum, drum.state(starts), 1e-3)
    assert narrow.capacity < ample.capacity
    for _ in range(300):  # a repeated step starts from other impulses
        ample.advance(1)
        narrow.advance(1)
        np.testing.assert_allclose(narrow.motion.q, ample.motion.q, atol=1e-4)
    assert narrow.capacity > 16


def points_in_a_pail(count, walls=24):
    """Points that fall onto the walls of a polygon, and touch nothing else."""
    plane = Manifold.euclidean("x y")
    (x, y), (u, v) = plane.symbols, velocities(plane)
    turns = np.linspace(0, 2 * np.pi, walls, endpoint=False)
    sides = {f"w{k}": 1 - np.cos(a) * x - np.sin(a) * y for k, a in enumerate(turns)}
    return System(Polyhedron(plane, sides), (u**2 + v**2) / 2, 10 * y, count=count, restitution=0.5)


def test_the_log_has_room_for_all_events_of_a_step():
    """Hundreds of bodies with dozens of gaps each have the events that each has alone."""
    starts = np.random.default_rng(0).uniform(-0.6, 0.6, (400, 2))
    many, one = points_in_a_pail(400), points_in_a_pail(1)
    together = simulate(many, many.state(starts), 0.5, 1e-2).events
    alone = simulate(one, one.state(starts[7]), 0.5, 1e-2).events
    told = [(e.time, e.kind, e.contact) for e in together if e.bodies == (7,)]
    assert told == [(e.time, e.kind, e.contact) for e in alone]
    assert len(together) > len(starts) / 2


@pytest.mark.parametrize("events", [0, 1, 30])
def test_a_small_log_changes_nothing(monkeypatch, events):
    drum = DumbbellDrum(count=9, floor=True)
    state = drum.state(bunch(drum, np.random.default_rng(3)))
    ample = simulate(drum, state, 0.3, 1e-3)
    for module in (layout, sizes):
        monkeypatch.setattr(module, "EVENTS", events)
    narrow = simulate(drum, state, 0.3, 1e-3)
    assert narrow.events == ample.events
    np.testing.assert_array_equal(narrow.q, ample.q)


@pytest.mark.parametrize("why", [DONE, CONTACTS_FULL, EVENTS_FULL])
def test_the_driver_says_so_when_nothing_goes_on(monkeypatch, why):
    drum = DumbbellDrum(count=3, floor=True)
    engine = start(drum, drum.state(bunch(drum, np.random.default_rng(3))), 1e-3)
    monkeypatch.setattr(driver, "compiled_advance", lambda _: lambda *_: [why, 0, 0])
    with pytest.raises(SolverError, match="the step after t = 0 "):
        engine.advance(1)


def advanced(system, state, noise, seconds):
    """Return the state after a time, bit for bit."""
    engine = start(system, state, 1e-3, noise=noise)
    engine.advance(round(seconds / 1e-3))
    return engine.save()


@pytest.mark.parametrize("count", [1, 2, 9])
def test_a_known_number_of_coordinates_changes_nothing(monkeypatch, count):
    """Code for dumbbells and code for bodies of any number of coordinates give the same bits."""
    drum = DumbbellDrum(count=count, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    noise = Noise(chatter=0.2, kicks={"eta": 1.0, "theta": 0.1}, seed=2)
    known = advanced(drum, drum.state(starts), noise, 0.5)
    monkeypatch.setattr(driver, "compiled_advance", lambda _: compiled_advance(ANY))
    unknown = advanced(drum, drum.state(starts), noise, 0.5)
    assert known["counts"][1] == 500
    for name, array in known.items():
        np.testing.assert_array_equal(array, unknown[name], err_msg=name)


def boxes_on_a_slope(count=3):
    box = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    a = Arrangement({"A": box}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all")
    system = a.system(gravity=[3, -10], friction=0.3, restitution=0.4, count=count)
    return system, system.state(np.array([[0.3 * k, 1.2 + 2.4 * k, 0.1 * k] for k in range(count)]))


def a_driven_link():
    joints = {"hinge": Hinge("world", "A", at=[0, 1.5], limits=(-3, 3))}
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    a = Arrangement({"A": capsule([0, 0], [1.45, 0], 0.1)}, floor, joints=joints)
    given = {"drives": {"push": Motor("hinge", -3.0)}, "rates": {"hinge": 4.0}}
    system = a.system(gravity=[0, -10], friction={"floor": 0.4, "hinge": 0.1}, **given)
    return system, system.state(a.point(joints={"hinge": 0.2}))


def dumbbells_that_are_kicked():
    drum = DumbbellDrum(count=9, floor=True)
    return drum, drum.state(bunch(drum, np.random.default_rng(3)))


SCENES = (boxes_on_a_slope, a_driven_link, dumbbells_that_are_kicked)


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_quick_code_gives_the_same_bits(monkeypatch, scene):
    """Made with no optimisation at all, as where nothing is cached yet."""
    system, state = scene()
    kicked = scene is dumbbells_that_are_kicked
    noise = Noise(chatter=0.2, kicks={"eta": 1.0, "theta": 0.1}, seed=2) if kicked else None
    known = advanced(system, state, noise, 0.5)
    monkeypatch.setattr(shipped, "read_code", lambda _: None)
    quick, inferior = SHIPPED[4 if kicked else 3]._first()
    assert inferior

    def advance(tables, steps):
        results, failure = (ctypes.c_int64 * 3)(), ctypes.c_void_p()
        assert not quick.functions[0](results, ctypes.byref(failure), *tables.tolist(), steps)
        return results[:]

    monkeypatch.setattr(driver, "compiled_advance", lambda _: advance)
    found = advanced(system, state, noise, 0.5)
    for name, array in known.items():
        np.testing.assert_array_equal(array, found[name], err_msg=name)


RUN = """
import sys
from polycorner.models.textbook import bouncing_ball
from polycorner.motion import simulate
from polycorner.formulas.shipped import Shipped
if len(sys.argv) > 1:
    Shipped.text = sys.argv[1]
ball = bouncing_ball(0.7)
print(simulate(ball, ball.state([1.0]), 2.0, 1e-2).q.tobytes().hex())
"""


@pytest.mark.parametrize("text", ["", SHIPPED[ANY].head + "words of another version"])
def test_without_it_numba_makes_the_same_engine(tmp_path, text):
    """The file may be missing, and another version of LLVM may not understand it."""
    results = []
    for number, arguments in enumerate(([], [text])):
        run = subprocess.run(
            [sys.executable, "-c", RUN, *arguments],
            env={**os.environ, "POLYCORNER_CACHE_DIR": str(tmp_path / str(number))},
            capture_output=True,
            check=True,
            text=True,
        )
        results.append(run.stdout)
        assert ("about 30 s" in run.stderr) == bool(number)
    assert results[0] == results[1]
