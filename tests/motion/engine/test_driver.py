"""The engine: room for contacts, and the key under which its code is cached."""

import os
import subprocess
import sys

import numpy as np
import pytest

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.engine import driver
from polycorner.motion.engine.intermediate import ENTRY, HEAD, engine_sources, shipped_code
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


def test_the_package_contains_the_engine_as_it_is():
    """After a change of a stage, `make engine` makes it anew."""
    assert shipped_code().startswith(HEAD + engine_sources() + "\n")


def test_what_the_package_contains_names_no_file():
    code = shipped_code()
    assert "/" not in code
    assert f"@{ENTRY}(" in code


RUN = """
import sys
from polycorner.models.textbook import bouncing_ball
from polycorner.motion import simulate
from polycorner.motion.engine import intermediate
if len(sys.argv) > 1:
    intermediate.shipped_code = lambda: sys.argv[1]
ball = bouncing_ball(0.7)
print(simulate(ball, ball.state([1.0]), 2.0, 1e-2).q.tobytes().hex())
"""


@pytest.mark.slow
@pytest.mark.parametrize("shipped", ["", HEAD + engine_sources() + "\nwords of another version"])
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
