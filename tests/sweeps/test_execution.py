"""Studies against the loop they stand for; random streams, failures, workers, wrong use."""

import itertools
import json
import sys
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest
import sweep_functions
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from polycorner.sweeps import scheduling as sweep_dispatch
from polycorner.sweeps.execution import Axis, SweepError, sweep
from polycorner.sweeps.workers import AHEAD, Crew, Inline

GRID = {"a": ([0, 1, 2], "mm"), "b": [1, 2, 3, 4]}


def plain(found):
    """Return what does not depend on when and where it was computed."""
    return found.load().drop_vars("seconds").drop_attrs(deep=False)


axes = st.lists(st.integers(-50, 50), min_size=1, max_size=5, unique=True)


@given(axes, axes, axes)
def test_a_study_is_the_loop_over_all_combinations(a, b, c):
    def function(a, b, c):
        return {"value": a + 1000 * b - 7 * c}

    found = sweep(function, {"a": a, "b": b, "c": c})
    expected = [function(*point)["value"] for point in itertools.product(a, b, c)]
    assert found["value"].values.ravel().tolist() == expected
    assert found["value"].dims == ("a", "b", "c")
    assert [found[name].values.tolist() for name in "abc"] == [a, b, c]


def test_numbers_arrays_texts_and_units():
    found = sweep(sweep_functions.mixed, GRID)
    at = found.sel(a=2, b=3)
    assert (at["total"], at["odd"], at["name"].item()) == (32, 0, "2/3")
    assert at["row"].values.tolist() == [0, 1 / 3, 2 / 3]
    assert at["row"].dims == ("row_0",)
    assert (found["total"].attrs, found["a"].attrs) == ({"units": "mm"}, {"units": "mm"})


def test_a_point_that_fails_is_a_row_with_its_sentence():
    found = sweep(sweep_functions.mixed, GRID)
    failed = found["status"] == 2
    assert int(failed.sum()) == 1
    at = found.sel(a=1, b=2)
    assert at["message"].item() == "ValueError: b: expected anything but 2; got 2"
    assert np.isnan(at["total"])
    assert np.isnan(at["row"]).all()
    assert at["name"].item() == ""
    assert (found["message"].values == "").sum() == failed.size - 1
    assert (found["seconds"] >= 0).all()


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        ([1.0], "expected a mapping"),
        ({}, "expected a mapping"),
        ({"x": object()}, "x: expected a number, an array of numbers or a text"),
        ({"x": 1j}, "x: expected a number"),
        ({"x": 2**60}, "x: expected whole numbers up to 2^53"),
        ({"status": 1.0}, "expected names of results"),
        ({"a": 1.0}, "expected names of results"),
        ({"no/name": 1.0}, "expected names of results"),
    ],
)
def test_results_that_cannot_be_kept_are_failures_that_say_so(returned, words):
    found = sweep(lambda a: returned if a else {}, {"a": [1]})
    assert found["status"].values.tolist() == [2]
    assert words in found["message"].values[0]
    assert set(found.data_vars) == {"status", "message", "seconds"}


def test_results_that_change_their_kind_fail_where_they_do():
    def function(a):
        return {0: {"x": 1.0, "y": 2.0}, 1: {"y": 2.0, "x": 1.0}, 2: {"x": 1.0}}.get(
            a, {"x": [1.0, 2.0], "y": 2.0}
        )

    found = sweep(function, {"a": range(4)})
    assert found["status"].values.tolist() == [1, 1, 2, 2]
    assert found["y"].values[:2].tolist() == [2.0, 2.0]
    assert "expected x, y, as at other points; it returned x[2], y" in found["message"].values[3]


def test_leaving_python_is_a_failure_too():
    def function(a):
        raise SystemExit(a)

    assert sweep(function, {"a": [3]})["message"].values[0] == "SystemExit: 3"


# ------------------------------------------------------------------------------- random streams


@given(st.integers(0, 2**63 - 1))
def test_every_point_has_the_stream_its_number_spawns(seed):
    found = sweep(sweep_functions.drawn, {"a": range(2), "b": range(3)}, rng=seed)
    children = np.random.SeedSequence(seed).spawn(6)
    expected = [np.random.default_rng(child).normal() for child in children]
    assert found["x"].values.ravel().tolist() == expected
    assert found.attrs["seed"] == seed


def test_a_seed_that_was_not_given_is_told_and_gives_the_same_again():
    first = sweep(sweep_functions.drawn, {"a": [1], "b": [2, 3]})
    assert "rng" not in first.attrs["fixed"]
    again = sweep(sweep_functions.drawn, {"a": [1], "b": [2, 3]}, rng=first.attrs["seed"])
    xr.testing.assert_identical(plain(first), plain(again))
    assert sweep(sweep_functions.drawn, {"a": [1], "b": [2]}).attrs["seed"] != first.attrs["seed"]


@pytest.mark.parametrize("workers", [1, 3, 40])
def test_results_do_not_depend_on_the_number_of_workers(workers):
    grid = {"a": range(8), "b": range(9)}
    with ThreadPoolExecutor(workers) as pool:
        found = sweep(sweep_functions.drawn, grid, executor=pool, rng=3)
    xr.testing.assert_identical(plain(found), plain(sweep(sweep_functions.drawn, grid, rng=3)))


# ---------------------------------------------------------------------------------- provenance


def test_the_dataset_tells_where_it_is_from(tmp_path):
    found = sweep(sweep_functions.drawn, {"a": ([1.5], "mm"), "b": [2]}, rng=1, fixed={"pause": 0})
    assert found.attrs["function"] == "sweep_functions:drawn"
    assert json.loads(found.attrs["fixed"]) == {"pause": 0}
    assert json.loads(found.attrs["versions"])[0]["numpy"] == np.__version__
    assert json.loads(found.attrs["study"])["axes"][0] == {
        "name": "a", "unit": "mm", "values": [1.5]
    }  # fmt: skip
    assert found.attrs["complete"] == "finished"
    assert found.attrs["polycorner_sweep"] == 1
    assert found.attrs["command"]
    found.to_netcdf(tmp_path / "found.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "found.nc", engine="h5netcdf") as back:
        assert back["x"].values.tolist() == found["x"].values.tolist()
        assert back.attrs["seed"] == 1


def test_progress_counts_up_to_all_points():
    counts = []
    sweep(sweep_functions.mixed, GRID, progress=lambda *now: counts.append(now))
    assert counts[0] == (0, 0, 12)
    assert counts[-1] == (11, 1, 12)
    finished = [done + failed for done, failed, _ in counts]
    assert finished == sorted(finished)


# ------------------------------------------------------------------------------------- workers


class Watched(Executor):
    """An executor that computes in threads and notes how many calls were open at a time."""

    _max_workers = 2

    def __init__(self):
        self.pool, self.open, self.most, self.guard = ThreadPoolExecutor(2), 0, 0, threading.Lock()

    def submit(self, fn, /, *args):
        with self.guard:
            self.open += 1
            self.most = max(self.most, self.open)
        future = self.pool.submit(fn, *args)
        future.add_done_callback(self._landed)
        return future

    def _landed(self, _future):
        with self.guard:
            self.open -= 1


def test_few_batches_are_in_flight_however_large_the_grid():
    executor = Watched()
    found = sweep(lambda a, b: {"x": a * b}, {"a": range(100), "b": range(200)}, executor=executor)
    executor.pool.shutdown()
    assert executor.most <= AHEAD * 2 + 1
    assert (found["x"].values == np.outer(range(100), range(200))).all()


def test_points_a_worker_has_no_time_for_are_handed_out_again(monkeypatch):
    monkeypatch.setattr(sweep_dispatch, "BUDGET", 0.0)
    grid = {"a": range(20), "b": range(30)}
    with ThreadPoolExecutor(2) as pool:
        found = sweep(sweep_functions.drawn, grid, executor=pool, rng=5)
    xr.testing.assert_identical(plain(found), plain(sweep(sweep_functions.drawn, grid, rng=5)))


class Faulty(Inline):
    """An executor whose batches with a certain point, or from a certain call on, break."""

    def __init__(self, error, *, point=None, after=10**9):
        self.error, self.point, self.after, self.calls = error, point, after, 0

    def submit(self, fn, /, job, numbers, *args):
        self.calls += 1
        if self.point in numbers or self.calls > self.after:
            future = Future()
            future.set_exception(self.error)
            return future
        return super().submit(fn, job, numbers, *args)


def test_workers_that_are_gone_leave_what_was_finished():
    executor = Faulty(BrokenExecutor("all died"), after=3)
    with pytest.raises(SweepError, match=r"they are gone.*all died.*points are") as stopped:
        sweep(sweep_functions.mixed, GRID, executor=executor)
    found = stopped.value.results
    done = found["status"].values.ravel() > 0
    assert 0 < done.sum() < done.size
    assert found.attrs["complete"] == "interrupted"
    whole = sweep(sweep_functions.mixed, GRID)["total"].values.ravel()
    np.testing.assert_array_equal(found["total"].values.ravel()[done], whole[done])


def test_an_executor_that_is_shut_down_is_said_to_be():
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(SweepError, match="cannot schedule new futures after shutdown"):
        sweep(sweep_functions.mixed, GRID, executor=pool)


KilledWorker = type("KilledWorker", (Exception,), {})  # what a cluster raises


@pytest.mark.parametrize("renews", [False, True])
def test_a_point_that_kills_its_workers_is_a_row_and_the_others_are_there(monkeypatch, renews):
    error = BrokenExecutor("died") if renews else KilledWorker("several died")
    executor = Faulty(error, point=17)
    crew = Crew(executor, lambda: 2)
    crew.renews, crew.renew = renews, lambda: None
    monkeypatch.setattr(sys.modules[sweep.__module__], "hired", lambda _: crew)
    found = sweep(lambda a: {"x": a}, {"a": range(40)}, executor=executor)
    assert found["status"].values.tolist() == [1 + (k == 17) for k in range(40)]
    assert found["message"].values[17].startswith("WorkerDied: ")
    assert np.nansum(found["x"]) == sum(range(40)) - 17


@pytest.mark.slow
def test_processes_that_die_are_replaced():
    found = sweep(sweep_functions.deadly, {"a": range(3), "b": range(4)}, executor=2)
    failed = np.argwhere(found["status"].values == 2).tolist()
    assert failed == [[1, 2]]
    assert found["message"].values[1, 2].startswith("WorkerDied: ")
    expected = np.add.outer(np.arange(3.0), np.arange(4))
    expected[1, 2] = np.nan
    np.testing.assert_array_equal(found["x"].values, expected)


def test_a_function_that_workers_cannot_load_is_named():
    with pytest.raises(TypeError, match=r"function: expected one that workers can load.*<lambda>"):
        sweep(lambda a: {"x": a}, {"a": [1]}, executor=1)


class Picky(Inline):
    """An executor that says at once what it cannot send."""

    def submit(self, fn, /, *args):
        del fn, args
        msg = "cannot pickle 'socket' object"
        raise TypeError(msg)


def test_an_executor_may_say_so_when_it_is_given_the_call():
    with pytest.raises(TypeError, match=r"function: expected one that workers.*'socket'"):
        sweep(sweep_functions.mixed, GRID, executor=Picky())


# ----------------------------------------------------------------------------------- wrong use

WRONG = {
    "grid: expected a mapping": {"grid": [1, 2]},
    "grid: a: values: expected a list": {"grid": {"a": 3, "b": [1]}},
    "grid: a: values: expected values that differ; got 2 twice": {"grid": {"a": [1, 2, 2]}},
    "grid: a: values: expected numbers; got nan": {"grid": {"a": [1.0, float("nan")], "b": [1]}},
    "grid: a: values: expected numbers only": {"grid": {"a": [1, "x"], "b": [1]}},
    "grid: expected names of parameters": {"grid": {"status": [1]}},
    r"got paus \(did you mean pause\?\)": {"fixed": {"paus": 1}},
    "grid: expected all that the function needs; b is missing": {"grid": {"a": [1]}},
    "fixed: expected parameters that are no axis; got b": {"fixed": {"b": 1}},
    "fixed: expected numbers, texts": {"fixed": {"log": object()}},
    "rng: expected a seed": {"rng": -1},
    "executor: expected a positive number": {"executor": 0},
    "executor: expected an Executor": {"executor": "here"},
    "store: expected a folder": {"store": __file__},
}


@pytest.mark.parametrize(("words", "wrong"), WRONG.items())
def test_wrong_arguments_are_named(words, wrong):
    given = {"grid": {"a": [1], "b": [2]}} | wrong
    with pytest.raises((TypeError, ValueError), match=words):
        sweep(sweep_functions.drawn, **given)


def test_a_unit_is_a_text():
    with pytest.raises(TypeError, match="unit: expected a text"):
        Axis([1], 3)


def test_a_seed_for_a_function_without_chance_is_refused():
    with pytest.raises(ValueError, match="rng: expected none"):
        sweep(sweep_functions.mixed, GRID, rng=1)
