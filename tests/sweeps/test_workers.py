"""Workers and the scheduling of points: executors that are slow, broken, gone or killed."""

import sys
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest
import sweep_functions
import xarray as xr

from polycorner.sweeps import SweepError, execution, sweep
from polycorner.workers import AHEAD, Inline, Workers

GRID = {"a": ([0, 1, 2], "mm"), "b": [1, 2, 3, 4]}


def plain(found):
    """Return what does not depend on when and where it was computed."""
    return found.load().drop_vars("seconds").drop_attrs(deep=False)


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
    monkeypatch.setattr(execution, "BUDGET", 0.0)
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
    with pytest.raises(
        SweepError, match=r"workers that answer; got .*all died.*points are"
    ) as stopped:
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
    workers = Workers(executor, lambda: 2)
    workers.replace = lambda: renews
    monkeypatch.setattr(sys.modules[sweep.__module__], "workers_of", lambda _: workers)
    found = sweep(lambda a: {"x": a}, {"a": range(40)}, executor=executor)
    assert found["status"].values.tolist() == [1 + (k == 17) for k in range(40)]
    assert found["message"].values[17].startswith("WorkerDied: ")
    assert np.nansum(found["x"]) == sum(range(40)) - 17


def test_processes_that_die_are_replaced():
    found = sweep(sweep_functions.deadly, {"a": range(3), "b": range(4)}, executor=2)
    failed = np.argwhere(found["status"].values == 2).tolist()
    assert failed == [[1, 2]]
    assert found["message"].values[1, 2].startswith("WorkerDied: ")
    expected = np.add.outer(np.arange(3.0), np.arange(4))
    expected[1, 2] = np.nan
    np.testing.assert_array_equal(found["x"].values, expected)


def test_what_cannot_be_sent_is_said():
    lock = threading.Lock()
    with pytest.raises(
        TypeError, match=r"function: expected one that can be sent.*<lambda>.*pickle"
    ):
        sweep(lambda a: {"x": a + lock.locked()}, {"a": [1]}, executor=1)


class Picky(Inline):
    """An executor that says at once what it cannot send."""

    def submit(self, fn, /, *args):
        del fn, args
        msg = "cannot pickle 'socket' object"
        raise TypeError(msg)


def test_an_executor_may_say_so_when_it_is_given_the_call():
    with pytest.raises(TypeError, match=r"function: expected one that can be sent.*'socket'"):
        sweep(sweep_functions.mixed, GRID, executor=Picky())


class Searching(Inline):
    """A client that has lost its scheduler looks for it for a while and takes calls meanwhile."""

    status = "running"

    def get_executor(self, pure):
        assert not pure
        return self

    def nthreads(self):
        return {"one": 1}

    def submit(self, fn, /, *args, **kwargs):
        if self.status == "running":
            self.status = "connecting"
            return super().submit(fn, *args, **kwargs)
        return Future()  # which will never be done


def test_a_client_that_has_lost_its_scheduler_is_not_waited_for():
    client = Searching()
    with pytest.raises(SweepError, match="workers that answer; got a client that is connecting"):
        sweep(sweep_functions.mixed, {"a": range(50), "b": [1]}, executor=Dask(client))


class Dask:
    """What is asked of a client of Dask."""

    def __init__(self, executor):
        self.executor, self.get_executor = executor, executor.get_executor
        self.nthreads = executor.nthreads

    @property
    def status(self):
        return self.executor.status
