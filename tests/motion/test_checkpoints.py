"""Runs that are saved: interrupted or killed they continue bit for bit, others are refused."""

import errno
import itertools
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from discs import DISCS, START
from hypothesis import given
from hypothesis import strategies as st
from kept_files import same_motion as same

from polycorner import atomic as writing
from polycorner.models.textbook import bouncing_ball
from polycorner.motion import Checkpoint, Event, EventKind, Noise, Solver, simulate
from polycorner.motion.checkpoints import KIND, STATE, SavedRun
from polycorner.motion.scenes import FrictionTable
from polycorner.motion.tables import event_table, read_events

NOISE = Noise(kicks={"x": 0.3}, seed=5)
LASTING = 1.5


def followed(folder=None, *, system=DISCS, state=None, t_end=LASTING, dt=1e-3, **options):
    """Discs that fall, collide, settle and leave, saved at every record."""
    saving = {name: options.pop(name) for name in ("resume", "seconds") if name in options}
    if folder is not None:
        options["checkpoint"] = Checkpoint(folder, **({"seconds": 0.0} | saving))
    state = system.state(START) if state is None else state
    return simulate(system, state, t_end, dt, **({"every": 20, "noise": NOISE} | options))


@pytest.fixture(scope="module")
def whole():
    """Return the run that was never stopped."""
    path = followed()
    assert len(path.events) > 10
    assert any(len(touches) > 1 for touches in path.touching)
    assert path.finished
    return path


def test_saving_changes_nothing(whole, tmp_path):
    same(followed(tmp_path / "deep" / "state"), whole)


class Killed(BaseException):
    """A process that is killed handles nothing."""


@pytest.mark.parametrize("moment", range(1, 30, 3))
def test_a_run_killed_while_a_file_is_written_continues(whole, tmp_path, monkeypatch, moment):
    """Every save synchronises two files and their folder twice; the run dies at one of these."""
    usual, seen = writing._synchronise, itertools.count(1)

    def dying(path):
        if next(seen) == moment:
            raise Killed
        usual(path)

    with monkeypatch.context() as patch:
        patch.setattr(writing, "_synchronise", dying)
        patch.setattr("pathlib.Path.unlink", lambda *_, **__: None)  # nor does it tidy up
        with pytest.raises(Killed):
            followed(tmp_path / "state")
    assert (tmp_path / "state" / STATE).exists() == (moment > 3)
    same(followed(tmp_path / "state"), whole)


SCRIPT = """
import sys
sys.path[:0] = {path!r}
from test_checkpoints import followed
followed({folder!r})
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system has no SIGKILL")
def test_a_killed_process_loses_nothing(whole, tmp_path):
    """Kill it again and again at random moments; it saves almost all the time."""
    rng = np.random.default_rng()
    here = Path(__file__).parent
    path = [str(here), str(here.parent / "support"), str(here.parents[1])]
    state, kills = tmp_path / STATE, 0
    for _ in range(4):
        before = state.stat().st_mtime_ns if state.exists() else 0
        code = SCRIPT.format(path=path, folder=str(tmp_path))
        process = subprocess.Popen([sys.executable, "-c", code])
        while process.poll() is None and (not state.exists() or state.stat().st_mtime_ns == before):
            time.sleep(0.001)
        time.sleep(rng.uniform(0, 0.05))
        process.kill()
        kills += process.wait() == -signal.SIGKILL
    assert kills >= 1
    same(followed(tmp_path), whole)


def interrupting(*times):
    """Return a progress that presses Ctrl-C at these times."""
    left = list(times)

    def progress(done, total, note):
        assert total == pytest.approx(LASTING)
        assert note
        if left and done > left[0]:
            left.pop(0)
            signal.raise_signal(signal.SIGINT)

    return progress


def test_an_interrupted_run_keeps_what_is_done(whole, tmp_path):
    part = followed(tmp_path, seconds=1e6, progress=interrupting(0.5))
    assert not part.finished
    assert "unfinished" in str(part)
    assert 0.5 < part.times[-1] < 0.6
    np.testing.assert_array_equal(part.q, whole.q[: len(part)])
    same(followed(tmp_path), whole)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_interruption_ends_at_once_and_so_does_one_without_a_checkpoint(tmp_path):
    def impatient(*_):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        followed(tmp_path, progress=impatient)
    with pytest.raises(KeyboardInterrupt):
        followed(progress=interrupting(0.5))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_clock_decides_when_a_run_is_saved(tmp_path):
    saves = []

    def counting(*_):
        saves.append(len(list(tmp_path.glob("chunk-*"))))

    followed(tmp_path, seconds=1e6, progress=counting)
    assert max(saves) == 0
    assert len(list(tmp_path.glob("chunk-*"))) == 1
    followed(tmp_path, resume=False, seconds=0.0, progress=counting)
    assert max(saves) == len(saves) // 2


def test_progress_is_reported_at_every_record():
    told = []
    followed(progress=lambda done, _total, _note: told.append(done))
    np.testing.assert_allclose(told, np.arange(1, 76) * 0.02, atol=1e-12)


# ------------------------------------------------------------------------------ runs at one time


def test_one_run_at_a_time_uses_a_folder(whole, tmp_path):
    told = []

    def meanwhile(*_):
        for use in (partial(followed, tmp_path), Checkpoint(tmp_path).clear):
            with pytest.raises(ValueError, match=r"^checkpoint: .*no other run.* is in use") as why:
                use()
            told.append(str(why.value))

    same(followed(tmp_path, progress=meanwhile), whole)
    assert all(str(tmp_path) in sentence for sentence in told)
    assert told
    same(followed(tmp_path), whole)


def test_a_folder_without_locks_is_used_all_the_same(whole, tmp_path, monkeypatch):
    def missing(*_, **__):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("filelock.FileLock.acquire", missing)
    same(followed(tmp_path), whole)


HOLDING = """
import sys, time
sys.path[:0] = {path!r}
from test_checkpoints import followed
followed({folder!r}, progress=lambda *_: (print("running", flush=True), time.sleep(60)))
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system has no SIGKILL")
def test_a_process_that_is_killed_leaves_its_folder_free(whole, tmp_path):
    here = Path(__file__).parent
    path = [str(here), str(here.parent / "support"), str(here.parents[1])]
    code = HOLDING.format(path=path, folder=str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        with pytest.raises(ValueError, match=r"^checkpoint: .* is in use"):
            followed(tmp_path)
        process.kill()
    same(followed(tmp_path), whole)


# -------------------------------------------------------------------------------------- forgeries

MOVED = 1e-3


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """Return the folder of a run that was interrupted."""
    folder = tmp_path_factory.mktemp("stopped")
    assert not followed(folder, seconds=1e6, progress=interrupting(1.0)).finished
    return folder


@pytest.mark.parametrize(
    ("name", "number"),
    [
        *[("engine.body_of_rank", k) for k in (-1, 4, 10**12)],
        *[("engine.rank", k) for k in (-1, 4, 10**12)],
        *[("engine.keys", k) for k in (-1, 10**12)],
        *[("engine.cluster", k) for k in (0, 10**12)],
        *[("engine.counts", k) for k in (-1, 10**12)],
        *[("engine.check_due", k) for k in (-1,)],
        *[("engine.elapsed", x) for x in (-1e12, 1.0)],
        *[("engine.q", x) for x in (MOVED, np.nan, 1e300)],
        *[("engine.touches", k) for k in (2, -1)],
        *[("frames", k) for k in (-1, 10**12)],
        *[("chunks", k) for k in (-1, 0, 10**12)],
        ("finished", True),
    ],
)
def test_a_state_with_a_forged_number_is_refused(stopped, tmp_path, name, number):
    folder = Path(shutil.copytree(stopped, tmp_path / "run"))
    arrays = KIND.load_arrays(folder / STATE)
    array = arrays[name].reshape(-1)
    array[0] = array[0] + number if number == MOVED else number
    arrays[name] = array.reshape(arrays[name].shape)
    KIND.save_arrays(folder / STATE, arrays)
    with pytest.raises(ValueError, match=r"^checkpoint: expected a saved run; .* is damaged"):
        followed(folder)


@pytest.mark.parametrize("name", ["q", "v", "t", "left", "touch", "event", "event_numbers"])
@pytest.mark.parametrize("number", [-1, 10**12])
def test_a_record_with_a_forged_number_is_refused(stopped, tmp_path, name, number):
    """Of coordinates and velocities the first row is the start, the last one the state."""
    folder = Path(shutil.copytree(stopped, tmp_path / "run"))
    path = folder / "chunk-000000.npz"
    arrays = KIND.load_arrays(path)
    arrays[name].reshape(-1)[0] = number if name not in ("left", "event_numbers") else np.nan
    KIND.save_arrays(path, arrays)
    with pytest.raises(ValueError, match=r"^checkpoint: expected a saved run; .* is damaged"):
        followed(folder)


# ----------------------------------------------------------------------------------- other runs

CHANGES = {
    "noise.seed": {"noise": replace(NOISE, seed=6)},
    "noise.kicks": {"noise": Noise(kicks={"x": 0.2}, seed=5)},
    "dt": {"dt": 5e-4},
    "every": {"every": 10},
    "t_end": {"t_end": 2.0},
    "solver.tolerance": {"solver": Solver(tolerance=1e-6)},
    "state.q": {"state": DISCS.state(START + np.array([1e-9, 0.0]))},
    "restitution": {"system": replace(DISCS, restitution=0.1)},
    "exits": {"system": replace(DISCS, exits={"x": 9.0})},
}


@pytest.mark.parametrize("resume", [True, False])
@pytest.mark.parametrize("name", CHANGES)
def test_an_unfinished_run_of_other_parameters_is_refused_and_kept(tmp_path, name, resume):
    followed(tmp_path, progress=interrupting(0.1))
    before = {entry: entry.read_bytes() for entry in tmp_path.iterdir()}
    with pytest.raises(ValueError, match=rf"^checkpoint: expected {name} = .* unfinished run in"):
        followed(tmp_path, resume=resume, **CHANGES[name])
    assert {entry: entry.read_bytes() for entry in tmp_path.iterdir()} == before


def test_a_finished_run_is_returned_or_gives_way_to_a_new_one(whole, tmp_path):
    followed(tmp_path)
    told = []
    same(followed(tmp_path, progress=lambda *_: told.append(1)), whole)
    assert not told
    with pytest.raises(ValueError, match=r"^checkpoint: expected dt = 0\.001 .* finished run in"):
        followed(tmp_path, dt=5e-4)
    assert followed(tmp_path, dt=5e-4, resume=False).dt == 5e-4


def test_a_new_run_removes_nothing_but_the_old_one(whole, tmp_path):
    followed(tmp_path, progress=interrupting(1.0))
    (tmp_path / "mine.txt").write_text("kept")
    same(followed(tmp_path, resume=False, seconds=1e6), whole)
    assert len(list(tmp_path.glob("chunk-*"))) == 1
    Checkpoint(tmp_path).clear()
    assert [entry.name for entry in tmp_path.iterdir()] == ["mine.txt"]


def test_damaged_files_are_refused(tmp_path):
    followed(tmp_path, progress=interrupting(0.5))
    chunks = sorted(tmp_path.glob("chunk-*"))
    content = chunks[1].read_bytes()
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 1
    for damaged in (content[: len(content) // 2], b"", bytes(flipped)):
        chunks[1].write_bytes(damaged)
        with pytest.raises(ValueError, match=r"^checkpoint: .* is damaged"):
            followed(tmp_path)
    chunks[1].unlink()
    with pytest.raises(ValueError, match=r"^checkpoint: .* is damaged"):
        followed(tmp_path)
    (tmp_path / STATE).write_text("something else")
    with pytest.raises(ValueError, match=r"^checkpoint: .* is damaged"):
        followed(tmp_path)


def test_a_newer_checkpoint_is_refused_naming_both_versions(tmp_path):
    replace(KIND, version=2).save_arrays(tmp_path / STATE, {"finished": np.array(False)})
    with pytest.raises(ValueError, match=r"^checkpoint: .* has version 2, .* up to version 1"):
        followed(tmp_path)


class Engine:
    """The part of an engine that checkpoints use."""

    def __init__(self):
        self.q = np.array([1.0, 2.0])
        self.bodies = SimpleNamespace(contact_names=("left", "right"))

    def save(self):
        return {"q": self.q}

    def load(self, arrays):
        self.q = arrays["q"]


def recorder(rows):
    happened = [Event(0.05, EventKind.IMPACT, (0,), "right", 2.0)] * bool(rows)
    names = ("left", "right")
    return SimpleNamespace(
        engine=Engine(),
        columns={"times": [0.1 * k for k in range(rows)]},
        left=[0.0] * rows,
        touching=[(((0,), "left", 1.5),)] * rows,
        friction=[FrictionTable()] * rows,
        events=[read_events(event_table(happened, names), names, 1)],
        gone=0.25,
    )


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Return the files of a run that was saved once."""
    folder = tmp_path_factory.mktemp("saved")
    SavedRun(Checkpoint(folder), {"count": 1}, 2, 1).save(recorder(3), finished=False)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@given(data=st.data())
def test_a_single_flipped_bit_is_noticed(saved, tmp_path_factory, data):
    name = data.draw(st.sampled_from(sorted(saved)))
    changed = bytearray(saved[name])
    position = data.draw(st.integers(0, 8 * len(changed) - 1))
    changed[position // 8] ^= 1 << position % 8
    folder = tmp_path_factory.mktemp("flipped")
    for other, content in (saved | {name: bytes(changed)}).items():
        (folder / other).write_bytes(content)
    with pytest.raises(ValueError, match=rf"^checkpoint: .* is damaged .*{name}"):
        SavedRun(Checkpoint(folder), {"count": 1}, 2, 1).begin(recorder(0))


@pytest.mark.parametrize("kind", ["one body", "dumbbells"])
def test_any_system_continues(kind, tmp_path):
    if kind == "one body":
        system = bouncing_ball(0.5)
        state = system.state([1.0])
    else:
        from polycorner.dumbbells import DumbbellDrum

        system = DumbbellDrum(count=2)
        state = system.state(system.pair.nested("R", clearance=0.05).reshape(2, 3))
    options = {"system": system, "state": state, "noise": None, "every": 10}
    part = followed(tmp_path, **options, progress=interrupting(0.7))
    assert not part.finished
    same(followed(tmp_path, **options), followed(**options))


@pytest.mark.parametrize("seconds", [-1.0, math.nan, "often"])
def test_seconds_are_checked(seconds):
    with pytest.raises((TypeError, ValueError), match=r"^seconds: expected a number"):
        Checkpoint("state", seconds)
