"""Skeletons whose edges are walked by others: the same in content and order."""

import os
import signal
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from functools import lru_cache

import numpy as np
import pytest
from skeleton_shapes import identical, polytope

from polycorner import skeleton
from polycorner.errors import WorkersError
from polycorner.models.spheres import SphereCluster
from polycorner.skeletons import Completeness, resume
from polycorner.workers import AHEAD, Inline, Workers, opened

TRIANGLE = polytope(np.array([[-1, 0], [0, -1], [1, 1]]), np.array([0, 0, 1]))
START = ((0.1, 0.2),)
SIX = SphereCluster(6)


def clusters(**options):
    return skeleton(SIX.polyhedron, SIX.starts(), symmetry=SIX.symmetry, **options)


@lru_cache
def whole():
    return clusters()


class Faulty(Inline):
    """An executor whose calls with certain numbers break it."""

    def __init__(self, *broken):
        self.calls, self.broken = 0, broken

    def submit(self, fn, /, *arguments):
        self.calls += 1
        if self.calls in self.broken:
            future = Future()
            future.set_exception(BrokenExecutor("died"))
            return future
        return super().submit(fn, *arguments)


def renewing(executor):
    workers = Workers(executor, lambda: 2)
    workers.replace = lambda: True
    return workers


@pytest.mark.parametrize("threads", [1, 5])
def test_threads_find_the_same(threads):
    with ThreadPoolExecutor(threads) as pool:
        assert identical(clusters(executor=pool), whole())


def test_a_search_without_relabellings_finds_the_same():
    with ThreadPoolExecutor(2) as pool:
        assert identical(skeleton(TRIANGLE, START, executor=pool), skeleton(TRIANGLE, START))


def test_processes_find_the_same_also_when_one_is_killed():
    killed = []
    with opened(2) as workers:

        def kill(done, *_):
            if done == 2 and not killed:
                killed.append(next(iter(workers.executor._processes)))
                os.kill(killed[0], signal.SIGKILL)

        assert identical(clusters(executor=workers, progress=kill), whole())
    assert killed


@pytest.mark.parametrize("broken", [(1,), (2, 3), (4, 9)])
def test_what_broken_workers_left_is_walked_again(broken):
    assert identical(clusters(executor=renewing(Faulty(*broken))), whole())


def test_workers_that_die_again_and_again_are_an_error():
    with pytest.raises(WorkersError, match=r"executor: expected workers that live; they died 3"):
        clusters(executor=renewing(Faulty(*range(1, 100))))


def test_workers_that_are_gone_are_an_error():
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(
        WorkersError, match=r"executor: expected workers that answer; got .*shutdown"
    ):
        clusters(executor=pool)


def test_a_search_in_pieces_ends_as_the_whole():
    with ThreadPoolExecutor(2) as pool:
        part = clusters(executor=pool, budget=1)
        for count in range(2, len(whole().edges) + 1):
            assert part.complete is Completeness.BUDGET
            part = resume(part, executor=pool, budget=1)
            assert len(part.edges) == count
        assert identical(resume(part, executor=pool), whole())


def test_few_walks_are_under_way():
    class Counting(ThreadPoolExecutor):
        def __init__(self):
            super().__init__(2)
            self.open, self.most = set(), 0

        def submit(self, fn, /, *arguments):
            future = super().submit(fn, *arguments)
            self.open = {f for f in self.open if not f.done()} | {future}
            self.most = max(self.most, len(self.open))
            return future

    with Counting() as pool:
        clusters(executor=pool)
    assert 1 < pool.most <= 2 * AHEAD


def test_others_than_executors_are_refused():
    with pytest.raises(TypeError, match="executor: expected an Executor"):
        clusters(executor="many")
