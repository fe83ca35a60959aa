"""The energy: heights of the balls, weighted rods, and the trough in the plane."""

import dataclasses
import math

import numpy as np
import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import placed_pairs


@given(placed_pairs(plane=False))
def test_the_energy_is_the_sum_of_the_heights_of_the_balls(drawn):
    """A centre at azimuth ``a`` is ``R - rho cos a`` above the floor of the drum."""
    pair, q = drawn
    centres = oracles.balls(pair, q)
    azimuth = np.arctan2(centres[:, 0], -centres[:, 2])
    heights = pair.drum_radius - pair.centre_radius * np.cos(azimuth)
    assert pair.energy.value(q) == pytest.approx(heights.sum(), rel=1e-10)


@given(placed_pairs(plane=True))
def test_in_the_plane_it_is_half_the_sum_of_squared_distances_from_the_floor(drawn):
    pair, q = drawn
    lateral = oracles.balls(pair, q)[:, 0]
    assert pair.energy.value(q) == pytest.approx((lateral**2).sum() / 2, rel=1e-10, abs=1e-10)


@given(placed_pairs(), st.floats(0, 5))
def test_a_rod_of_weight_w_multiplies_the_energy_by_one_plus_half_w(drawn, w):
    pair, q = drawn
    weighted = dataclasses.replace(pair, rod_weight=w)
    assert weighted.energy.value(q) == pytest.approx((1 + w / 2) * pair.energy.value(q), rel=1e-12)
    sum_of_heights = weighted.energy.value(q) * weighted.ball_heights_per_energy
    assert sum_of_heights == pytest.approx(pair.energy.value(q), rel=1e-12)


@given(placed_pairs(weighted=True), st.floats(-100, 100), st.floats(-100, 100))
def test_the_energy_does_not_depend_on_the_axial_positions(drawn, first, second):
    pair, q = drawn
    moved = q + np.array([0, first, 0, 0, second, 0])
    assert pair.energy.value(moved) == pair.energy.value(q)
    assert not pair.energy.gradient(q)[[1, 4]].any()


@given(placed_pairs(weighted=True))
def test_lying_along_the_floor_is_lowest(drawn):
    pair, q = drawn
    least = 0.0 if pair.is_plane else (4 + 2 * pair.rod_weight) * pair.ball_radius
    lowest = pair.energy.value([0.0] * 6)
    assert lowest == pytest.approx(least, abs=1e-12 * (1 if pair.is_plane else pair.drum_radius))
    assert pair.energy.value(q) >= lowest - 1e-9 * (1 + lowest)


@given(placed_pairs(weighted=True))
def test_each_dumbbell_has_its_own_share(drawn):
    """``E(A, B) = E(A, A)/2 + E(B, B)/2``: there is no interaction but contact."""
    pair, q = drawn
    alone = [pair.energy.value(np.tile(q[k : k + 3], 2)) / 2 for k in (0, 3)]
    assert pair.energy.value(q) == pytest.approx(sum(alone), rel=1e-12, abs=1e-12)


@given(placed_pairs(plane=False))
def test_a_turn_of_the_drum_by_a_whole_turn_changes_nothing(drawn):
    pair, q = drawn
    turned = q + math.tau * np.array([1, 0, 0, -2, 0, 0])
    assert pair.energy.value(turned) == pytest.approx(pair.energy.value(q), rel=1e-12)
