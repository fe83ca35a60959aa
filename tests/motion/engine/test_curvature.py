"""Bounds that follow the curvature of gaps: whatever the order of an island's blocks."""

from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest

from polycorner.motion.engine import curvature
from polycorner.motion.engine.arrays import OWN_GAP, PAIR_GAP

# Of blocks: what it is of, its bodies, the gap now, and where the bodies will be.
BLOCKS = [
    (OWN_GAP, (0, -1), 0.1, -0.5),
    (OWN_GAP, (1, -1), 0.2, 0.3),
    (PAIR_GAP, (0, 1), 0.1, -0.25),
    (PAIR_GAP, (1, 2), 0.1, 0.4),
]


def island(order):
    """Return model constants and arrays of an island whose gaps curve."""
    kinds, bodies, gaps, following = zip(*BLOCKS, strict=True)
    n = len(BLOCKS)
    block = SimpleNamespace(
        order=np.array(order),
        rows=np.zeros(n, dtype=int),
        bound=np.zeros(n, dtype=int),
        bilateral=np.zeros(n, dtype=int),
        bodies=np.array(bodies),
        origin=np.column_stack([kinds, [0, 0, 0, 1], [0, 1, 0, 0]]),
        offset=np.full((n, 2), 2.0),
        load=np.zeros(n),
        after=np.full((n, 2), 2.0),
    )
    ahead = SimpleNamespace(q=np.zeros((3, 1)), gap=np.full(2, np.nan), gradient=None)
    pair = SimpleNamespace(gap=np.array(gaps[2:]))
    work = SimpleNamespace(
        body=SimpleNamespace(speed=np.ones(3)),
        ahead=ahead,
        island=SimpleNamespace(start=np.array([0, n])),
        block=block,
        pair=pair,
        mid=SimpleNamespace(gap=np.array(gaps[:2])),
        scratch=SimpleNamespace(values=np.full(1, np.nan)),
    )
    model = SimpleNamespace(bending=1e-3, gap_unit=1.0, follows_velocity=0)
    return model, work, dict(zip(bodies, following, strict=True))


@pytest.fixture
def corrected(monkeypatch):
    """Return the bounds of the blocks after the correction, for an order of them."""

    def correct(order):
        model, work, following = island(order)

        def evaluate_own(_model, _scratch, i, _q, _later, gap, _gradient):
            gap[i] = following[i, -1]

        def evaluate_pair(_model, scratch, i, j, _q):
            scratch.values[0] = following[i, j]

        monkeypatch.setattr(curvature, "evaluate_gaps", evaluate_own)
        monkeypatch.setattr(curvature, "evaluate_pair_gaps", evaluate_pair)
        for name in ("family_of", "pair_inputs"):
            monkeypatch.setattr(curvature, name, lambda *_: 0)
        curvature.correct_island.py_func(model, work, 0, 0.05)
        return work.block.offset[:, 0]

    return correct


def test_the_order_of_blocks_does_not_matter(corrected):
    expected = corrected(range(len(BLOCKS)))
    assert (expected != 2.0).tolist() == [True, False, True, False]
    for order in permutations(range(len(BLOCKS))):
        np.testing.assert_array_equal(corrected(order), expected)
