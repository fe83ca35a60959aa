"""Branches of a tree in boxes: the least sets of functions that have to hold."""

import numpy as np

from polycorner.proofs.lists import branches


def test_few_and_many_branches_are_reduced_alike():
    rng = np.random.default_rng(0)
    for _ in range(50):
        boxes, count, m = rng.integers(1, 30, 3)
        open_ = rng.random((boxes, count, m)) < rng.random()
        alive = rng.random((boxes, count)) < 0.7
        kept = branches._least_of_many(alive, open_)
        assert (kept == branches._least(alive, open_)).all()
        for box in range(boxes):
            sets = [frozenset(np.flatnonzero(open_[box, c])) for c in np.flatnonzero(alive[box])]
            left = [frozenset(np.flatnonzero(open_[box, c])) for c in np.flatnonzero(kept[box])]
            assert set(left) == {s for s in sets if not any(t < s for t in sets)}
            assert len(left) == len(set(left))
