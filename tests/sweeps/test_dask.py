"""A study on a scheduler and workers of Dask, each a process of its own on this machine."""

import logging
import os
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest
import sweep_functions

from polycorner.sweeps import SweepError, open_results, sweep

distributed = pytest.importorskip("distributed")
TESTS = Path(__file__).parents[1]
GRID = {"a": range(15), "b": range(12)}
FIXED = {"pause": 0.01}


@contextmanager
def running(*arguments):
    path = os.pathsep.join([str(TESTS / "support"), str(TESTS.parent)])
    quiet = subprocess.DEVNULL
    with subprocess.Popen(
        [sys.executable, "-m", *arguments],
        env=os.environ | {"PYTHONPATH": path},
        stdout=quiet,
        stderr=quiet,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def cluster(tmp_path, caplog):
    """A client, its scheduler and two workers."""
    caplog.set_level(logging.CRITICAL, logger="distributed")  # which tells of every loss
    address = str(tmp_path / "scheduler.json")
    common = ("--no-dashboard", "--scheduler-file", address)
    alone = ("--no-nanny", "--nthreads", "1", "--local-directory", str(tmp_path))
    with ExitStack() as stack:
        scheduler = stack.enter_context(
            running("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *common)
        )
        workers = [
            stack.enter_context(running("distributed.cli.dask_worker", *common, *alone))
            for _ in range(2)
        ]
        client = stack.enter_context(
            distributed.Client(scheduler_file=address, set_as_default=False, timeout=60)
        )
        client.wait_for_workers(2, timeout=60)
        yield client, scheduler, workers


def killing(process, after):
    """Return a progress that kills a process once so many points are done."""

    def progress(done, _total, _note):
        if done > after and process.poll() is None:
            process.kill()
            process.wait()

    return progress


def test_a_worker_killed_on_the_way_then_the_scheduler(cluster, tmp_path):
    """Points of the worker are computed by the other; without scheduler what is finished stays."""
    client, scheduler, (first, _) = cluster
    given = {"function": sweep_functions.drawn, "grid": GRID, "rng": 2, "fixed": FIXED}
    serial = sweep(**given | {"fixed": {"pause": 0.0}})
    found = sweep(**given, executor=client, progress=killing(first, 40))
    assert first.poll() is not None
    assert (found["status"].values == 1).all()
    for name in ("x", "y"):
        assert found[name].values.tobytes() == serial[name].values.tobytes()

    store = tmp_path / "s.zarr"
    with pytest.raises(SweepError, match=r"workers that answer.*kept in .*s\.zarr; the same"):
        sweep(**given, executor=client, store=store, progress=killing(scheduler, 40))
    kept = open_results(store)
    done = kept["status"].values == 1
    assert 40 < done.sum() < done.size
    np.testing.assert_array_equal(kept["x"].values[done], serial["x"].values[done])
    whole = sweep(**given, store=store)
    assert whole["y"].values.tobytes() == serial["y"].values.tobytes()
