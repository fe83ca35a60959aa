"""The engine: room for contacts, and the key under which its code is cached."""

import os
import subprocess
import sys

import numpy as np
import pytest

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.engine import driver
from polycorner.motion.engine.intermediate import ANY, SHIPPED, compiled_advance
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import start


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


@pytest.mark.slow
@pytest.mark.parametrize("shipped", ["", SHIPPED[ANY].head + "words of another version"])
def test_without_it_numba_makes_the_same_engine(tmp_path, shipped):
    """The file may be missing, and another version of LLVM may not understand it."""
    results = []
    for number, arguments in enumerate(([], [shipped])):
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
