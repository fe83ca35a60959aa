"""Stores: the same results as in memory, after kills, full disks, and with two writers at once."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import sweep_functions
import xarray as xr
import zarr
from disks import Disk, Killed
from filelock import FileLock
from hypothesis import given
from hypothesis import strategies as st

from polycorner.sweeps import SweepError, open_results, sweep
from polycorner.sweeps import store as stores
from polycorner.sweeps.store import Store, _chunk_shape, write_root
from polycorner.sweeps.tables import Variable

GRID = {"a": ([0, 1, 2], "mm"), "b": [1, 2, 3, 4]}
TESTS = Path(__file__).parents[1]
SWEEP = sys.modules[sweep.__module__]


def plain(found):
    """Return what does not depend on when and where it was computed."""
    return found.load().drop_vars("seconds").drop_attrs(deep=False)


def drawn(store, log=None, *, size=(6, 7), **options):
    grid = {"a": range(size[0]), "b": (range(size[1]), "mm")}
    fixed = {} if log is None else {"log": str(log)}
    return sweep(sweep_functions.drawn, grid, rng=4, fixed=fixed, store=store, **options)


def lines(log):
    return log.read_text().splitlines() if log.exists() else []


# ----------------------------------------------------------------------------------- the same


@pytest.mark.parametrize("function", [sweep_functions.mixed, sweep_functions.drawn])
def test_a_store_has_what_memory_has(tmp_path, function):
    rng = None if function is sweep_functions.mixed else 1
    kept = sweep(function, GRID, rng=rng, store=tmp_path / "s.zarr")
    xr.testing.assert_identical(plain(kept), plain(sweep(function, GRID, rng=rng)))
    xr.testing.assert_identical(plain(open_results(tmp_path / "s.zarr")), plain(kept))
    assert kept["a"].attrs == {"units": "mm"}


def test_a_store_is_zarr_that_xarray_reads_by_itself(tmp_path):
    found = sweep(sweep_functions.mixed, GRID, store=tmp_path / "s.zarr")
    assert zarr.open_group(tmp_path / "s.zarr", mode="r").metadata.zarr_format == 3
    by_itself = xr.open_zarr(tmp_path / "s.zarr", chunks=None)
    np.testing.assert_array_equal(by_itself["total"].values, found["total"].values)
    assert by_itself["b"].values.tolist() == GRID["b"]
    assert by_itself.attrs["function"] == "sweep_functions:mixed"


def test_axes_of_texts_are_kept(tmp_path):
    grid = {"hand": ["R", "L"], "far": [1.0, float("inf")]}
    found = sweep(lambda hand, far: {"x": hand + str(far)}, grid, store=tmp_path / "s")
    assert found.sel(hand="L", far=np.inf)["x"].item() == "Linf"


def test_a_finished_study_is_not_computed_again(tmp_path):
    log = tmp_path / "log"
    first = drawn(tmp_path / "s", log).load()
    xr.testing.assert_identical(drawn(tmp_path / "s", log).load(), first)
    assert len(lines(log)) == 42


@given(st.lists(st.integers(1, 7), min_size=1, max_size=4), st.integers(0, 3))
def test_chunks_are_runs_of_consecutive_points(shape, order):
    values = (10**order,) if order else ()
    one = Variable("x", (), (*shape, *values), None, None, {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("polycorner.sweeps.store.POINTS", 30)
        patch.setattr("polycorner.sweeps.store.BYTES", 8 * 100)
        sizes = _chunk_shape(tuple(shape), one)
    assert sizes[len(shape) :] == values
    points = sizes[: len(shape)]
    assert np.prod(points) <= min(30, max(1, 100 // np.prod(values, dtype=int)))
    numbers = np.arange(np.prod(shape)).reshape(shape)
    inside = numbers[tuple(slice(size) for size in points)].ravel()
    assert inside.tolist() == list(range(inside.size))


@pytest.mark.parametrize("columns", [(), (3,), (2, 600_000)])
def test_grids_of_several_chunks_are_kept(tmp_path, monkeypatch, columns):
    monkeypatch.setattr("polycorner.sweeps.store.POINTS", 4)

    def function(a, b, c):
        return {"x": np.full(columns, a + 10.0 * b + 100 * c)}

    grid = {"a": range(2), "b": range(3), "c": range(3)}
    kept = sweep(function, grid, store=tmp_path / "s")
    xr.testing.assert_identical(plain(kept), plain(sweep(function, grid)))


# ------------------------------------------------------------------------------------- faults


def test_failed_points_stay_until_they_are_asked_for_once_more(tmp_path):
    healthy, calls = [], []

    def function(a):
        calls.append(a)
        if a % 3 == 0 and not healthy:
            msg = "no licence"
            raise RuntimeError(msg)
        return {"x": 2.0 * a}

    grid = {"a": range(9)}
    assert sweep(function, grid, store=tmp_path / "s")["status"].values.tolist() == [2, 1, 1] * 3
    assert sweep(function, grid, store=tmp_path / "s")["status"].values.tolist() == [2, 1, 1] * 3
    assert len(calls) == 9
    healthy.append(True)
    found = sweep(function, grid, store=tmp_path / "s", retry=True)
    assert calls[9:] == [0, 3, 6]
    assert found["x"].values.tolist() == [2.0 * a for a in range(9)]
    assert set(found["message"].values.tolist()) == {""}


class Stop(BaseException):
    """Ends a process's work wherever it is."""


def stopping(at, monkeypatch, owner, name, *, after):
    """Make a method stop everything once it was called often enough, before or after its work."""
    real, calls = getattr(owner, name), []

    def method(*arguments, **options):
        calls.append(1)
        if len(calls) == at and not after:
            raise Stop
        result = real(*arguments, **options)
        if len(calls) == at and after:
            raise Stop
        return result

    monkeypatch.setattr(owner, name, method)


def unsettled(patch):
    """Put nothing in order after a stop, as if the process were gone; locks die with processes."""
    patch.setattr(SWEEP, "_close", lambda table: table.lock.release())


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize(
    ("name", "at"),
    [
        ("flush", 4),
        ("_write_points", 1),
        ("_write_points", 3),
        ("_write_points", 5),
        ("_write_points", 12),
        ("_create", 1),
        ("_create", 4),
        ("_create", 6),
        ("create", 1),
        ("create", 2),
        ("_note_start", 1),
        ("close", 1),
    ],
)
def test_stopped_anywhere_the_same_call_comes_to_the_same(tmp_path, monkeypatch, name, at, after):
    """Whatever was reported as finished is not computed again."""
    log, whole, reported = tmp_path / "log", drawn(None, tmp_path / "other"), [0]
    with monkeypatch.context() as patch:
        patch.setattr("polycorner.searches.Clock.share", 1e9)  # rows are written after every point
        stopping(at, patch, Store, name, after=after)
        unsettled(patch)
        with pytest.raises(Stop):
            drawn(tmp_path / "s", log, progress=lambda done, *_: reported.append(done))
    computed = len(lines(log))
    found = drawn(tmp_path / "s", log)
    xr.testing.assert_identical(plain(found), plain(whole))
    assert len(lines(log)) <= computed + 42 - reported[-1]
    assert found.attrs["complete"] == "finished"


@pytest.mark.parametrize("full", [False, True], ids=["killed", "full"])
def test_stopped_at_any_operation_the_same_call_comes_to_the_same(tmp_path, monkeypatch, full):
    """At each of the first operations on files, before the root is there too, and some later."""
    whole = drawn(None, size=(1, 2))
    for at in (*range(1, 8), 12, 25, 50):
        store, disk = tmp_path / str(at), Disk(at, full=full)
        with monkeypatch.context() as patch, disk.used():
            if not full:
                unsettled(patch)
            with suppress(Killed, SweepError):
                drawn(store, size=(1, 2))
        found = drawn(store, size=(1, 2))
        xr.testing.assert_identical(plain(found), plain(whole))
        assert found.attrs["complete"] == "finished"
        assert not list(store.glob(".*"))


def test_what_is_read_while_more_is_written_is_what_was_there(tmp_path):
    opened = []

    def look(done, *_):
        if (tmp_path / "s").exists():
            opened.append((done, open_results(tmp_path / "s")))

    drawn(tmp_path / "s", progress=look)
    assert len(opened) > 2
    for done, found in opened:
        there = found["status"].values == 1
        assert there.sum() == done
        assert not done or np.isfinite(found["x"].values[there]).all()


def test_a_store_that_changes_as_it_is_checked_is_checked_anew(tmp_path, monkeypatch):
    """The root says how many chunks a finished study has; a retry writes others."""
    drawn(tmp_path / "s")
    real, calls = stores.chunks, []

    def changing(array):
        if not calls:
            about, names = stores.checked_root(tmp_path / "s")
            about = {k: v for k, v in about.items() if k not in ("checksums", "sha256")}
            write_root(tmp_path / "s", about | {"complete": "unfinished"}, names)
        calls.append(array)
        return [] if len(calls) == 1 else real(array)

    monkeypatch.setattr(stores, "chunks", changing)
    assert open_results(tmp_path / "s").attrs["complete"] == "unfinished"


@pytest.mark.parametrize("at", [1, 2, 3, 7, 20])
def test_a_full_disk_is_said_and_room_lets_the_study_go_on(tmp_path, monkeypatch, at):
    def full(*_arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    log, real, calls = tmp_path / "log", Store._write_points, []

    def method(*arguments):
        calls.append(1)
        return real(*arguments) if len(calls) < at else full()

    with monkeypatch.context() as patch:
        patch.setattr("polycorner.searches.Clock.share", 1e9)  # rows are written after every point
        patch.setattr(Store, "_write_points", method)
        with pytest.raises(
            SweepError, match=r"No space left on device; \d+ of 42 points are"
        ) as stop:
            drawn(tmp_path / "s", log)
    found = drawn(tmp_path / "s", log)
    done = stop.value.results["status"].values == 1
    assert found["x"].values[done].tolist() == stop.value.results["x"].values[done].tolist()
    xr.testing.assert_identical(plain(found), plain(drawn(None, tmp_path / "other")))


def test_a_folder_that_cannot_be_made_is_said(tmp_path, monkeypatch):
    def full(*_arguments, **_options):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", full)
    with pytest.raises(SweepError, match="Read-only file system"):
        drawn(tmp_path / "s")


# ----------------------------------------------------------------------------- whole processes

SCRIPT = """
import sys
from polycorner.sweeps import sweep
import sweep_functions
grid = {"a": range(20), "b": (range(15), "mm")}
executor = int(sys.argv[3]) or None
def report(done, total, note):
    with open(sys.argv[2] + ".reported", "a") as file:
        file.write(f"{done}\\n")
found = sweep(
    sweep_functions.drawn, grid, rng=4, store=sys.argv[1], executor=executor,
    fixed={"log": sys.argv[2], "pause": 0.002}, progress=report,
)
print(found.attrs["complete"])
"""
WHOLE = {"a": range(20), "b": (range(15), "mm")}


def process(store, log, workers=0):
    path = os.pathsep.join([str(TESTS / "support"), str(TESTS.parent)])
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(store), str(log), str(workers)],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(log, count, running):
    while len(lines(log)) < count and running.poll() is None:
        time.sleep(0.01)


def same_bits(found, other):
    for name in ("x", "y", "status"):
        assert found[name].values.tobytes() == other[name].values.tobytes()


def test_killed_twice_the_study_is_that_of_one_never_stopped(tmp_path):
    """Every point that was reported as finished is in the store."""
    store, log = tmp_path / "s", tmp_path / "log"
    for count in (60, 150):
        with process(store, log) as running:
            wait_for(log, count, running)
            running.kill()
        kept = int((open_results(store)["status"].values > 0).sum())
        assert int(lines(tmp_path / "log.reported")[-1]) <= kept <= len(lines(log)) < 300
    before = len(lines(log))
    found = sweep(
        sweep_functions.drawn, WHOLE, rng=4, store=store, fixed={"log": str(log), "pause": 0.002}
    )
    same_bits(found, sweep(sweep_functions.drawn, WHOLE, rng=4))
    assert len(lines(log)) == before + 300 - kept


def test_ctrl_c_keeps_what_is_finished_and_says_that_more_is_pending(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    with process(store, log) as running:
        wait_for(log, 40, running)
        running.send_signal(signal.SIGINT)
        out, err = running.communicate()
    assert (out, err, running.returncode) == ("interrupted\n", "", 0)
    status = open_results(store)["status"].values
    assert int((status == 1).sum()) == len(lines(log)) < 300
    with ThreadPoolExecutor(2) as pool:
        fixed = {"log": str(log), "pause": 0.002}
        found = sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, executor=pool, fixed=fixed)
    same_bits(found, sweep(sweep_functions.drawn, WHOLE, rng=4))
    assert len(lines(log)) == 300


def test_killed_with_a_pool_no_worker_is_left_and_few_points_are_lost(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    with process(store, log, workers=2) as running:
        wait_for(log, 100, running)
        children = Path(f"/proc/{running.pid}/task/{running.pid}/children")
        workers = children.read_text().split() if children.exists() else []
        running.kill()
    while any(Path(f"/proc/{pid}").exists() for pid in workers):  # up to the limit of a test
        time.sleep(0.05)
    fixed = {"log": str(log), "pause": 0.002}
    found = sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, fixed=fixed)
    same_bits(found, sweep(sweep_functions.drawn, WHOLE, rng=4))
    assert (found["status"].values == 1).all()


# --------------------------------------------------------------------------------- other stores

OTHER = {
    r"values of a \[0, 1, 3\], not \[0, 1, 2\]": {"grid": {"a": ([0, 1, 3], "mm"), "b": [1]}},
    'unit of a "cm", not "mm"': {"grid": {"a": ([0, 1, 2], "cm"), "b": [1]}},
    "axes b, a, not a, b": {"grid": {"b": [1], "a": ([0, 1, 2], "mm")}},
    "seed 2, not 1": {"rng": 2},
    "fixed pause 0, not its default": {"fixed": {"pause": 0}},
    'function "sweep_functions:mixed", not "sweep_functions:drawn"': {
        "function": sweep_functions.mixed, "rng": None
    },
}  # fmt: skip


@pytest.mark.parametrize(("words", "changed"), OTHER.items())
def test_a_store_of_another_study_is_refused_and_stays(tmp_path, words, changed):
    given = {
        "function": sweep_functions.drawn,
        "grid": {"a": ([0, 1, 2], "mm"), "b": [1]},
        "rng": 1,
    }
    first = sweep(**given, store=tmp_path / "s").load()
    with pytest.raises(ValueError, match=f"store: expected {words}; .* is of another study"):
        sweep(**given | changed, store=tmp_path / "s")
    xr.testing.assert_identical(open_results(tmp_path / "s").load(), first)


def test_a_store_of_another_format_is_refused(tmp_path):
    drawn(tmp_path / "s")
    root = tmp_path / "s" / "zarr.json"
    root.write_text(root.read_text().replace('"polycorner_sweep": 2', '"polycorner_sweep": 1'))
    with pytest.raises(ValueError, match=r"store: expected one of format 2; .* has format 1"):
        drawn(tmp_path / "s")


def test_a_folder_with_something_else_is_refused_and_stays(tmp_path):
    (tmp_path / "letter.txt").write_text("dear reader")
    with pytest.raises(ValueError, match="store: expected a new or empty folder"):
        drawn(tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["letter.txt"]
    zarr.create_group(tmp_path / "zarr", zarr_format=3)
    with pytest.raises(ValueError, match="store: expected a store of a sweep"):
        drawn(tmp_path / "zarr")
    (tmp_path / "zarr" / "zarr.json").write_text("{")
    with pytest.raises(ValueError, match=r"zarr\.json is damaged or of something else"):
        drawn(tmp_path / "zarr")
    with pytest.raises(ValueError, match=r"expected a store of a sweep; .* cannot be read"):
        open_results(tmp_path / "nothing")


def test_another_version_resumes_and_is_noted(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("polycorner.sweeps.study.versions", lambda: {"polycorner": "0.0.1"})
        patch.setattr("polycorner.sweeps.store.versions", lambda: {"polycorner": "0.0.1"})
        stopping(3, patch, Store, "add", after=True)
        with pytest.raises(Stop):
            drawn(tmp_path / "s")
    found = json.loads(drawn(tmp_path / "s").attrs["versions"])
    assert found[0] == {"polycorner": "0.0.1"}
    assert len(found) == 2


# ------------------------------------------------------------------------------------ two at once


def test_a_store_in_use_is_refused(tmp_path):
    store = tmp_path / "s"
    drawn(store)
    with FileLock(f"{store}.lock"), pytest.raises(ValueError, match=r"store: .*s is in use"):
        drawn(store)
    drawn(store)


def test_a_store_in_use_by_another_process_is_refused_until_that_is_killed(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    fixed = {"log": str(log), "pause": 0.002}
    with process(store, log) as running:
        wait_for(log, 10, running)
        with pytest.raises(ValueError, match=r"store: .*s is in use"):
            sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, fixed=fixed)
        assert running.poll() is None
        running.kill()
    found = sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, fixed=fixed)
    assert (found["status"].values == 1).all()


def test_without_zarr_a_store_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("polycorner.sweeps.store.find_spec", lambda _: None)
    with pytest.raises(ImportError, match=r"pip install 'polycorner\[sweep\]'"):
        drawn(tmp_path / "s")
    assert not list(tmp_path.iterdir())
