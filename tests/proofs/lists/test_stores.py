"""Stores of searches: an interrupted search finds what one that was never interrupted finds."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import sympy
from disks import Disk, Killed
from proof_files import parts_of

from polycorner import Manifold, Polyhedron, Symmetry
from polycorner.polyhedra.symmetry import Element
from polycorner.proofs import stationary_points
from polycorner.proofs.lists import stores

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
BOX = [(-3, 3), (-3, 3)]
# The same problem in another process, which saves after every round and notes how far it is.
RUN = """
import sys, time
from polycorner.searches import Clock
from test_stores import problem, stationary_points
Clock.every, Clock.share = 0.0, float("inf")
def note(done, total, words):
    with open(sys.argv[2], "a") as log:
        log.write(f"{done:.0f}\\n")
    time.sleep(0.05)
print(stationary_points(**problem(), store=sys.argv[1], progress=note).complete)
"""


def problem():
    waves = sympy.cos(7 * X + Y) * sympy.cos(6 * Y) + sympy.sin(3 * X * Y)
    walls = [3 - X, 3 + X, 3 - Y, 3 + Y, X**2 + (Y - 1) ** 2 - 1]
    return {"polyhedron": Polyhedron(PLANE, walls), "energy": waves, "box": BOX, "max_boxes": 60000}


@pytest.fixture(scope="module")
def whole():
    return stationary_points(**problem())


def small(store, **change):
    disc = Polyhedron(PLANE, {"disc": 4 - X**2 - Y**2})
    given = {"polyhedron": disc, "energy": X**4 + Y**2 - X**2, "box": BOX, **change}
    return stationary_points(**given, store=store)


def same(found, other, folder):
    assert found.tally == other.tally
    assert np.array_equal(found.undecided, other.undecided)
    assert parts_of(found.save(folder / "a.zip")) == parts_of(other.save(folder / "b.zip"))


def started(store, log):
    here = Path(__file__).parent
    folders = here, here.parents[1] / "support", Path.cwd(), os.environ.get("PYTHONPATH", "")
    path = os.pathsep.join(map(str, folders))
    return subprocess.Popen(
        [sys.executable, "-c", RUN, str(store), str(log)],
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        text=True,
    )


def wait_for(log, count, running):
    while running.poll() is None:
        if log.exists() and len(log.read_text().splitlines()) >= count:
            return
        time.sleep(0.01)


def saved(store):
    return json.loads(json.loads((store / stores.ROOT).read_text())["search"])


def boxes(store):
    return sum(saved(store)["tally"].values())


def test_killed_twice_the_search_is_that_of_one_never_stopped(whole, tmp_path):
    store, log = tmp_path / "store", tmp_path / "log"
    for rounds in (3, 6):
        with started(store, log) as running:
            wait_for(log, rounds, running)
            running.kill()
        assert running.returncode == -signal.SIGKILL
        assert int(log.read_text().split()[-1]) <= boxes(store) < whole.tally.boxes
    same(stationary_points(**problem(), store=store, workers=2), whole, tmp_path)


@pytest.mark.parametrize("full", [False, True], ids=["killed", "full"])
def test_stopped_at_any_operation_the_same_call_finds_the_same(full, tmp_path):
    """Also at those of the first save, when nothing is there to go on with; and of the last."""
    simple = {"energy": X**2 + Y**2}
    whole = small(None, **simple)
    for at in itertools.count(1):
        store, disk = tmp_path / str(at) / "store", Disk(at, full=full)
        with disk.used(), suppress(Killed, OSError):
            small(store, **simple)
        if not disk.failed:
            break
        same(small(store, **simple), whole, tmp_path)
        assert {file.name for file in store.iterdir()} == {stores.ROOT, *saved(store)["files"]}
    assert at > 20


def test_ctrl_c_returns_what_was_found_and_the_search_goes_on(whole, tmp_path):
    store, log = tmp_path / "store", tmp_path / "log"
    with started(store, log) as running:
        wait_for(log, 3, running)
        running.send_signal(signal.SIGINT)
        out, _ = running.communicate()
    assert (out, running.returncode) == ("False\n", 0)
    same(stationary_points(**problem(), store=store), whole, tmp_path)


def test_loci_symmetries_and_attempts_in_vain_are_kept(tmp_path):
    """A valley, a search of one half, and degenerate points of rest that stay undecided."""
    half = Symmetry(elements=[Element(lambda q: q * np.array([-1.0, 1.0]), {})])
    strip = Polyhedron(PLANE, {"left": 2 - X, "right": 2 + X, "low": 2 - Y, "high": Y + 2})
    flat = X**4 + Y**2
    for posed in ({"polyhedron": strip, "energy": Y**2, "symmetry": half}, {"energy": flat}):
        given = {**posed, "resolution": 1e-3}
        whole = small(tmp_path / f"whole{len(given)}", **given)
        for most in range(20, 10_000, 60):
            part = small(tmp_path / f"parts{len(given)}", **given, max_boxes=most)
            if part.tally.boxes < most:
                break
        same(part, whole, tmp_path)
        assert part.loci or len(part.undecided)


def test_a_finished_search_is_not_done_again(tmp_path):
    found, done = small(tmp_path / "store"), []
    again = small(tmp_path / "store", progress=lambda *report: done.append(report))
    same(again, found, tmp_path)
    assert not done


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"energy": X**2 + Y**2}, "for this problem"),
        ({"box": [(-3, 3), (-3, 4)]}, "in this box"),
        ({"resolution": 1e-3}, "of this resolution"),
        ({"symmetry": Symmetry(elements=[Element(np.negative, {})])}, "with these symmetries"),
    ],
)
def test_the_store_of_another_search_is_refused_in_a_sentence(change, words, tmp_path):
    small(tmp_path / "store", max_boxes=10)
    with pytest.raises(ValueError, match=f"^store: expected a search {words}; .* holds another"):
        small(tmp_path / "store", **change)
    assert small(tmp_path / "store").complete


def test_folders_with_something_else_are_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="store: expected a new or empty folder"):
        small(tmp_path)
    with pytest.raises(ValueError, match=r"store: expected a folder; .* is a file"):
        small(tmp_path / "notes.txt")
    with pytest.raises(TypeError, match="store: expected text or a path"):
        small(3)


@pytest.mark.parametrize("name", ["tree-0.npz", "boxes-*.npz", "search.json"])
def test_files_that_were_changed_are_named(name, tmp_path):
    small(tmp_path, max_boxes=10)
    (file,) = tmp_path.glob(name)
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    with pytest.raises(ValueError, match=f"store: .*{file.name} was changed"):
        small(tmp_path)


def test_a_store_that_cannot_be_written_is_said_at_the_start(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(stores, "write_atomically", full)
    done = []
    with pytest.raises(OSError, match=r"store: expected a folder that can be written; .*No space"):
        small(tmp_path / "store", progress=lambda *report: done.append(report))
    assert not done


def test_two_searches_do_not_write_one_store(tmp_path):
    def inner(*_):
        with pytest.raises(ValueError, match="is in use"):
            small(tmp_path / "store")

    assert small(tmp_path / "store", progress=inner).complete
