"""A skeleton whose edges are walked on a cluster of two workers, of which one stops and dies."""

import logging
import os
import signal
import threading

import pytest
from skeleton_shapes import identical

from polycorner import skeleton
from polycorner.models.spheres import SphereCluster

distributed = pytest.importorskip("distributed")
SIX = SphereCluster(6)
HANGING = 0.3  # s for which walks are given to the worker that stopped


def clusters(**options):
    return skeleton(SIX.polyhedron, SIX.starts(), symmetry=SIX.symmetry, **options)


@pytest.fixture
def cluster(caplog):
    caplog.set_level(logging.CRITICAL, logger="distributed")  # which tells of every loss
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0"
        ) as local,
        distributed.Client(local, set_as_default=False) as client,
    ):
        yield client


def test_the_walks_of_a_worker_that_dies_are_walked_again(cluster):
    """The worker has stopped when it is killed, so that nothing it was given is finished."""
    first, _ = cluster.run(os.getpid).values()
    killed = threading.Event()

    def kill():
        killed.set()
        os.kill(first, signal.SIGKILL)

    later = threading.Timer(HANGING, kill)

    def stop(*_):
        if later.ident is None:
            os.kill(first, signal.SIGSTOP)
            later.start()

    found = clusters(executor=cluster, progress=stop)
    assert killed.is_set()  # the search had to wait for walks that the worker had been given
    assert identical(found, clusters())
