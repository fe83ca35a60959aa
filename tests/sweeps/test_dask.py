"""A study on a scheduler and workers of Dask, each a process of its own on this machine."""

import logging
import os
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest
import regions
import sweep_functions

from polycorner import minimise
from polycorner.sweeps import SweepError, open_results, sweep

distributed = pytest.importorskip("distributed")
TESTS = Path(__file__).parents[1]
GRID = {"a": range(15), "b": range(12)}
FIXED = {"pause": 0.01}
PATIENCE = 800  # s, below the limit of a test: a busy machine starts processes slowly


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
            distributed.Client(scheduler_file=address, set_as_default=False, timeout=PATIENCE)
        )
        client.wait_for_workers(2, timeout=PATIENCE)
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


def test_a_region_of_ones_own_on_a_local_cluster(caplog):
    """Neither the region nor the function that refers to it is known to the workers."""
    caplog.set_level(logging.CRITICAL, logger="distributed")
    region, plane = regions.bowl(), regions.PLANE

    def lowest(slope, region):
        x, y = plane.symbols
        return {"point": minimise(region, y + slope * x, [0.2, 2.0]).point}

    def closed(slope):
        return lowest(slope, region)

    grid = {"slope": [0.5, 1.0, 2.0]}
    here = sweep(lowest, grid, fixed={"region": region})
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address=":0"
        ) as local,
        distributed.Client(local, set_as_default=False) as client,
    ):
        there = sweep(lowest, grid, fixed={"region": region}, executor=client)
        closed_over = sweep(closed, grid, executor=client)
    for found in (there, closed_over):
        np.testing.assert_array_equal(found["point"].values, here["point"].values)
