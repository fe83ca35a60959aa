"""Searches: how they end, and when they are saved."""

import math

import pytest

from polycorner.models import SphereCluster
from polycorner.searches import Clock, Ending, work_through
from polycorner.skeletons import resume, skeleton


def countdown(left, allowed=math.inf, at=None):
    """Return the tasks of a search, and the numbers that they find."""
    found = []

    def find():
        if len(found) == at:
            raise KeyboardInterrupt
        found.append(len(found))

    def tasks():
        while len(found) < left:
            yield len(found) < allowed, find

    return tasks(), found


@pytest.mark.parametrize(
    ("options", "seconds", "count", "ending"),
    [
        ({}, math.inf, 5, Ending.FINISHED),
        ({"allowed": 3}, math.inf, 3, Ending.BUDGET),
        ({"allowed": 0}, math.inf, 0, Ending.BUDGET),
        ({}, 0.0, 1, Ending.BUDGET),
        ({"at": 2}, math.inf, 2, Ending.INTERRUPTED),
    ],
)
def test_a_search_ends(options, seconds, count, ending):
    (tasks, found), told, saved = countdown(5, **options), [], []
    clock = Clock(lambda: saved.append(len(found)), every=0)
    clock.share = math.inf
    ended = work_through(
        tasks, lambda: (len(found), 5, ""), lambda *all_: told.append(all_), seconds=seconds,
        clock=clock,
    )  # fmt: skip
    assert (ended, len(found)) == (ending, count)
    assert told == [(k, 5, "") for k in range(1, count + 1)]
    assert saved == list(range(1, min(count, 4) + 1))


def test_saving_takes_a_share_of_the_time(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("polycorner.searches.monotonic", lambda: now[0])
    saved = []

    def save():
        saved.append(now[0])
        now[0] += 1

    clock = Clock(save)
    for _ in range(100):
        clock.tick()
        now[0] += 1
    assert saved == [5.0, 26.0, 47.0, 68.0, 89.0]


def test_a_skeleton_goes_on_from_each_state_that_is_kept(monkeypatch):
    model, kept = SphereCluster(6), []
    monkeypatch.setattr(Clock, "every", 0.0)
    monkeypatch.setattr(Clock, "share", math.inf)
    found = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry, keep=kept.append)
    assert len(kept) > 3
    for part in kept[::2]:
        whole = resume(part)
        assert whole.complete is found.complete
        assert len(whole.edges) == len(found.edges)
        for one, other in zip(whole.corners, found.corners, strict=True):
            assert (one.point == other.point).all()
