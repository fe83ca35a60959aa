"""Starts in the drum: single dumbbells, nested pairs, bunches."""

import itertools
import math

import numpy as np
import pytest
from oracles import gaps

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics import starts as drum_starts
from polycorner.dumbbells.pair import DumbbellPair

PAIR = DumbbellPair(16, 3, 1.5, 125)


@pytest.mark.parametrize("chirality", ["R", "L"])
@pytest.mark.parametrize("heading", [None, -12.0, -3.0, 0.0, 7.0, 20.0])
def test_a_nested_pair_touches_at_three_contacts(chirality, heading):
    angle = None if heading is None else math.radians(heading)
    drum = DumbbellDrum(count=2)
    q = drum_starts.nested_pair(drum, chirality, heading=angle, eta=70.0)
    found = gaps(PAIR, q.reshape(6))
    assert np.sum(np.abs(found) < 1e-9) == 3
    assert found.min() > -1e-9
    assert drum.pair.chirality(q.reshape(6)) == chirality
    np.testing.assert_allclose(q[:, :2].mean(axis=0), [0.0, 70.0], atol=1e-12)
    if heading is not None:
        assert math.degrees(q[:, 2].mean()) == pytest.approx(heading, abs=1e-9)


def test_the_default_heading_is_that_of_least_energy():
    drum = DumbbellDrum(count=2)
    at_rest = drum_starts.nested_pair(drum, "R")

    def height(q):
        return PAIR.ball_centres(q.reshape(6))[:, 2].sum()

    heading = at_rest[:, 2].mean()
    for change in (-0.05, -0.01, 0.01, 0.05):
        turned = drum_starts.nested_pair(drum, "R", heading=heading + change)
        assert height(turned) > height(at_rest)


def test_the_two_hands_are_mirror_images():
    drum = DumbbellDrum(count=2)
    right = drum_starts.nested_pair(drum, "R", heading=0.1)
    left = drum_starts.nested_pair(drum, "L", heading=-0.1)
    np.testing.assert_allclose(left, right * [-1, 1, -1], atol=1e-9)


@pytest.mark.parametrize(("count", "seed"), [(1, 0), (5, 1), (40, 2)])
def test_a_bunch_lies_apart_above_the_bottom(count, seed):
    drum = DumbbellDrum(count=count, floor=True)
    q = drum_starts.bunch(drum, np.random.default_rng(seed))
    assert q.shape == (count, 3)
    pairs = np.array([[*one, *other] for one, other in itertools.combinations(q, 2)])
    assert gaps(PAIR, pairs.reshape(-1, 6)).min(initial=1.0) > 0
    assert (q[:, 1] - 8 * np.abs(np.cos(q[:, 2])) - 3).min() > 0
    np.testing.assert_array_equal(q, drum_starts.bunch(drum, np.random.default_rng(seed)))


def test_isolated_dumbbells_cannot_touch_and_the_steepest_is_highest():
    headings = [0.1, -0.2, 0.3]
    q = drum_starts.isolated(DumbbellDrum(count=3), headings, azimuth=0.05, eta=10.0)
    np.testing.assert_array_equal(q[:, 2], headings)
    assert np.argsort(q[:, 1]).tolist() == [1, 0, 2]
    assert np.diff(np.sort(q[:, 1])).min() > 16 + 2 * 3
    assert q[:, 1].min() == 10.0
    with pytest.raises(ValueError, match=r"^headings: expected 3 angles"):
        drum_starts.isolated(DumbbellDrum(count=3), [0.1])
