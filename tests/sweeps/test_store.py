"""Stores: the same results, kept through kills, torn lines, full disks and two at once."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import sweep_functions
import xarray as xr
import zarr
from hypothesis import given
from hypothesis import strategies as st

from polycorner.sweeps import store as sweep_store
from polycorner.sweeps.chunks import Chunks
from polycorner.sweeps.execution import SweepError, open_results, sweep
from polycorner.sweeps.journal import Journal, Lock

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


def test_the_seed_that_was_drawn_is_gone_on_with(tmp_path):
    first = sweep(sweep_functions.drawn, {"a": [1], "b": [2]}, store=tmp_path / "s").load()
    again = sweep(sweep_functions.drawn, {"a": [1], "b": [2]}, store=tmp_path / "s").load()
    assert first.attrs["seed"] == again.attrs["seed"]


@given(st.lists(st.integers(1, 7), min_size=1, max_size=4), st.integers(1, 60))
def test_chunks_are_runs_of_consecutive_points_that_share_none(shape, most):
    chunks = Chunks(tuple(shape), most)
    numbers = np.arange(np.prod(shape))
    whole = numbers.reshape(shape)
    seen = []
    for place, which in chunks.holding(numbers):
        inside = whole[chunks.region(place)].ravel()
        assert inside.tolist() == list(range(inside[0], inside[0] + inside.size))
        assert (chunks.first(place), chunks.count(place)) == (inside[0], inside.size)
        assert which.tolist() == inside.tolist()
        assert inside.size <= most
        seen += inside.tolist()
    assert sorted(seen) == numbers.tolist()


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


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize(
    ("owner", "name", "at"),
    [
        (Journal, "add", 4),
        (Chunks, "write", 1),
        (Chunks, "write", 2),
        (Chunks, "write", 5),
        (Journal, "clear", 2),
        (sweep_store.Store, "_begin", 1),
        (sweep_store.Store, "_consolidate", 1),
        (sweep_store.Store, "_consolidate", 2),
    ],
)
def test_stopped_anywhere_the_same_call_comes_to_the_same(
    tmp_path, monkeypatch, owner, name, at, after
):
    """Nothing is put in order after the stop, as if the process were gone."""
    log, whole = tmp_path / "log", drawn(None, tmp_path / "other")
    with monkeypatch.context() as patch:
        stopping(at, patch, owner, name, after=after)
        patch.setattr(SWEEP, "_settle", sweep_store.Store.abandon)
        with pytest.raises(Stop):
            drawn(tmp_path / "s", log)
    computed = len(lines(log))
    found = drawn(tmp_path / "s", log)
    xr.testing.assert_identical(plain(found), plain(whole))
    assert len(lines(log)) <= 42 + 1
    assert computed <= 42


def test_a_torn_last_line_is_computed_again_and_nothing_else(tmp_path, monkeypatch):
    log = tmp_path / "log"
    with monkeypatch.context() as patch:
        stopping(20, patch, Journal, "add", after=True)
        patch.setattr(SWEEP, "_settle", sweep_store.Store.abandon)
        with pytest.raises(Stop):
            drawn(tmp_path / "s", log)
    journal = tmp_path / "s" / "journal" / "points.jsonl"
    before = len(lines(log))
    journal.write_bytes(journal.read_bytes()[:-30])
    found = drawn(tmp_path / "s", log)
    xr.testing.assert_identical(plain(found), plain(drawn(None, tmp_path / "other")))
    assert len(lines(log)) == 42 + 1
    assert before < 42


@pytest.mark.parametrize("owner", [Journal, Chunks])
def test_a_full_disk_is_said_and_room_lets_the_study_go_on(tmp_path, monkeypatch, owner):
    name = "add" if owner is Journal else "write"

    def full(*_arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    log, real, calls = tmp_path / "log", getattr(owner, name), []

    def method(*arguments):
        calls.append(1)
        return real(*arguments) if len(calls) < 4 else full()

    with monkeypatch.context() as patch:
        patch.setattr(owner, name, method)
        with pytest.raises(SweepError, match=r"No space left on device; .* points are"):
            drawn(tmp_path / "s", log)
    found = drawn(tmp_path / "s", log)
    xr.testing.assert_identical(plain(found), plain(drawn(None, tmp_path / "other")))
    assert len(lines(log)) <= 42 + 1


def test_a_folder_that_cannot_be_made_is_said(tmp_path, monkeypatch):
    def full(*_arguments, **_options):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", full)
    with pytest.raises(SweepError, match="Read-only file system"):
        drawn(tmp_path / "s")


def test_half_a_line_written_to_a_full_disk_is_no_harm(tmp_path, monkeypatch):
    real, calls = os.write, []

    def write(handle, text):
        if not text.startswith(b'{"point"') and not calls:
            return real(handle, text)
        calls.append(1)
        if len(calls) == 10:
            return real(handle, text[: len(text) // 2])
        if len(calls) > 10:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(handle, text)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", write)
        with pytest.raises(SweepError, match="No space left"):
            drawn(tmp_path / "s")
    xr.testing.assert_identical(plain(drawn(tmp_path / "s")), plain(drawn(None)))


# ----------------------------------------------------------------------------- whole processes

SCRIPT = """
import sys
from polycorner.sweeps.execution import sweep
import sweep_functions
grid = {"a": range(20), "b": (range(15), "mm")}
executor = int(sys.argv[3]) or None
found = sweep(
    sweep_functions.drawn, grid, rng=4, store=sys.argv[1], executor=executor,
    fixed={"log": sys.argv[2], "pause": 0.002},
)
print(found.attrs["complete"])
"""
WHOLE = {"a": range(20), "b": (range(15), "mm")}


def process(store, log, workers=0):
    path = os.pathsep.join([str(TESTS), str(TESTS.parent)])
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(store), str(log), str(workers)],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(log, count, running, limit=60.0):
    until = time.monotonic() + limit
    while len(lines(log)) < count and running.poll() is None and time.monotonic() < until:
        time.sleep(0.01)


def same_bits(found, other):
    for name in ("x", "y", "status"):
        assert found[name].values.tobytes() == other[name].values.tobytes()


def test_killed_twice_the_study_is_that_of_one_never_stopped(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    for count in (60, 150):
        with process(store, log) as running:
            wait_for(log, count, running)
            running.kill()
    assert 0 < int((open_results(store)["status"].values > 0).sum()) <= len(lines(log)) < 300
    found = sweep(
        sweep_functions.drawn, WHOLE, rng=4, store=store, fixed={"log": str(log), "pause": 0.002}
    )
    same_bits(found, sweep(sweep_functions.drawn, WHOLE, rng=4))
    assert len(lines(log)) <= 300 + 2  # of each process killed, the point in flight


def test_ctrl_c_keeps_what_is_finished_and_says_that_more_is_pending(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    with process(store, log) as running:
        wait_for(log, 40, running)
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=60)
    assert (out, err, running.returncode) == ("interrupted\n", "", 0)
    status = open_results(store)["status"].values
    assert int((status == 1).sum()) == len(lines(log)) < 300
    with ThreadPoolExecutor(2) as pool:
        fixed = {"log": str(log), "pause": 0.002}
        found = sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, executor=pool, fixed=fixed)
    same_bits(found, sweep(sweep_functions.drawn, WHOLE, rng=4))
    assert len(lines(log)) == 300


@pytest.mark.slow
def test_killed_with_a_pool_no_worker_is_left_and_few_points_are_lost(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    with process(store, log, workers=2) as running:
        wait_for(log, 100, running)
        children = Path(f"/proc/{running.pid}/task/{running.pid}/children")
        workers = children.read_text().split() if children.exists() else []
        running.kill()
    until = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(Path(f"/proc/{pid}").exists() for pid in workers)
    fixed = {"log": str(log), "pause": 0.002}
    found = sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, fixed=fixed)
    same_bits(found, sweep(sweep_functions.drawn, WHOLE, rng=4))
    assert len(lines(log)) <= 300 + 2 * 3 * 200


# --------------------------------------------------------------------------------- other stores

OTHER = {
    r"values of a \[0, 1, 3\], not \[0, 1, 2\]": {"grid": {"a": ([0, 1, 3], "mm"), "b": [1]}},
    'unit of a "cm", not "mm"': {"grid": {"a": ([0, 1, 2], "cm"), "b": [1]}},
    "axes b, a, not a, b": {"grid": {"b": [1], "a": ([0, 1, 2], "mm")}},
    "seed 2, not 1": {"rng": 2},
    'fixed {"pause": 0}, not {}': {"fixed": {"pause": 0}},
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
    group = zarr.open_group(tmp_path / "s", mode="r+")
    group.attrs["polycorner_sweep"] = 99
    with pytest.raises(ValueError, match=r"store: expected format 1; .* has format 99"):
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
    with pytest.raises(ValueError, match="is damaged or something else"):
        drawn(tmp_path / "zarr")
    with pytest.raises(ValueError, match=r"expected a store of a sweep; .* has none"):
        open_results(tmp_path / "nothing")


def test_another_version_goes_on_and_is_noted(tmp_path):
    drawn(tmp_path / "s")
    group = zarr.open_group(tmp_path / "s", mode="r+")
    group.attrs["versions"] = json.dumps([{"polycorner": "0.0.1"}])
    found = json.loads(drawn(tmp_path / "s").attrs["versions"])
    assert found[0] == {"polycorner": "0.0.1"}
    assert len(found) == 2


# ------------------------------------------------------------------------------------ two at once


def test_a_store_in_use_is_refused(tmp_path):
    store = tmp_path / "s"
    drawn(store)
    lock = Lock(store / "journal" / "lock")
    with pytest.raises(ValueError, match="in use by this process"):
        drawn(store)
    lock.release()
    drawn(store)


def test_a_store_in_use_by_another_process_is_refused_until_that_is_killed(tmp_path):
    store, log = tmp_path / "s", tmp_path / "log"
    fixed = {"log": str(log), "pause": 0.002}
    with process(store, log) as running:
        wait_for(log, 10, running)
        with pytest.raises(ValueError, match=f"in use by process {running.pid}"):
            sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, fixed=fixed)
        assert running.poll() is None
        running.kill()
    assert (store / "journal" / "lock").read_text() == f"process {running.pid}"
    found = sweep(sweep_functions.drawn, WHOLE, rng=4, store=store, fixed=fixed)
    assert (found["status"].values == 1).all()


def test_without_zarr_a_store_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("polycorner.sweeps.identity.find_spec", lambda _: None)
    with pytest.raises(ImportError, match=r"pip install 'polycorner\[sweep\]'"):
        drawn(tmp_path / "s")
    assert not list(tmp_path.iterdir())
