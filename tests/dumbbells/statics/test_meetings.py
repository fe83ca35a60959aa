"""Collisions of two dumbbells: where they touch first, and in what they end."""

import math
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from polycorner import minimise
from polycorner.dumbbells import DumbbellPair, meeting_basins, meetings, placement_basins
from polycorner.dumbbells.statics.minima import kind_of

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
REACH = 16 + 2 * 3


def drawn(seed, count):
    rng = np.random.default_rng(seed)
    return rng.uniform(-25, 25, count), rng.uniform(-math.pi / 2, math.pi / 2, count)


# -------------------------------------------------------------------------- the first contact


@pytest.mark.parametrize("pair", [DRUM, PLANE])
def test_dumbbells_touch_first_where_they_meet(pair):
    offsets, headings = drawn(0, 60)
    found = meetings(pair, offsets, headings, first=0.2)
    unit = 1.0 if pair.is_plane else pair.centre_radius
    on_the_way = np.linspace(-REACH - 6, REACH + 6, 2000) / unit
    for q, offset, heading in zip(found, offsets, headings, strict=True):
        track = np.tile([0, 0, 0.2, 0, offset, heading], (len(on_the_way), 1))
        track[:, 3] = on_the_way
        gaps = pair.polyhedron.values(track).min(axis=1)
        if np.isnan(q).any():
            assert gaps.min() > 0
            continue
        assert q[[0, 1, 2, 4, 5]].tolist() == [0, 0, 0.2, offset, heading]
        assert abs(pair.polyhedron.values(q).min()) < 1e-9
        assert (gaps[on_the_way > q[3]] > 0).all()
        assert gaps[on_the_way < q[3]].min() < 0.05
    assert 0 < np.isnan(found[:, 0]).sum() < 30


def test_parallel_dumbbells_meet_ball_on_ball():
    rho = DRUM.centre_radius
    side, nested = meetings(DRUM, [0.0, 13.0], [0.0, 0.0])
    assert math.isclose(side[3], 2 * math.asin(3 / rho))
    # The inner balls, 3 mm along the axis apart, touch before a ball reaches a rod.
    assert math.isclose(nested[3], 2 * math.asin(math.sqrt(36 - 9) / 2 / rho))


def test_a_dumbbell_passes_one_that_it_cannot_reach():
    assert np.isnan(meetings(DRUM, [22.1, -22.1], [0.0, 0.0])).all()
    assert not np.isnan(meetings(DRUM, [21.9, -21.9], [0.0, 0.0])).any()


# ----------------------------------------------------------------------------------- their ends


def test_the_half_turn_of_a_mirror_image_exchanges_hands():
    """It maps the offset ``s`` and the heading ``b`` to ``-s`` and ``-b``."""
    offsets, headings = drawn(1, 40)
    one = meeting_basins(DRUM, np.stack([offsets, headings], axis=1))
    other = meeting_basins(DRUM, -np.stack([offsets, headings], axis=1))
    swapped = {"delta_R": "delta_L", "delta_L": "delta_R", "G": "G"}
    assert set(one.names) == set(swapped)
    ends = [swapped[one.names[k]] for k in one.ends]
    assert ends == [other.names[k] for k in other.ends]


def test_collisions_end_as_the_flow_against_soft_walls_does():
    """Overlap costs energy, and the flow of the gradient is integrated by a stiff solver."""
    offsets, headings = drawn(2, 12)
    found = meeting_basins(DRUM, np.stack([offsets, headings], axis=1))
    scales, stiff = DRUM.manifold.scale_array, 3.0

    def flow(_, u):
        q = u * scales
        values, gradients = DRUM.polyhedron.bundle.evaluate(q, 1)[:2]
        overlap = np.minimum(values, 0)
        slope = DRUM.energy.gradient(q) + stiff * overlap @ gradients
        return -slope * scales

    for q, k in zip(found.points, found.ends, strict=True):
        path = solve_ivp(flow, (0, 3000), q / scales, method="BDF", rtol=1e-4, atol=1e-6)
        end = minimise(DRUM.polyhedron, DRUM.energy, path.y[:, -1] * scales)
        hand = DRUM.chirality(end.point)
        assert found.names[k] == (f"{kind_of(end)}_{hand}" if hand else kind_of(end))


def test_drawn_collisions_are_within_reach():
    found = meeting_basins(DRUM, 20, widest=0.3, first=-0.1, rng=3)
    assert found.descents == 20
    assert abs(found.points[:, 4]).max() < REACH
    assert abs(found.points[:, 5]).max() < 0.3
    assert (found.points[:, 2] == -0.1).all()
    again = meeting_basins(DRUM, 20, widest=0.3, first=-0.1, rng=3)
    assert np.array_equal(found.ends, again.ends)


def test_placements_are_within_reach_and_do_not_overlap():
    found = placement_basins(PLANE, 30, rng=1)
    assert sum(found.counts) == found.descents == 30
    apart = found.points[:, 3:5] - found.points[:, :2]
    assert (np.linalg.norm(apart, axis=1) < REACH).all()
    assert np.allclose(found.points[:, :2], -found.points[:, 3:5])
    assert PLANE.polyhedron.values(found.points).min() >= 0
    assert set(found.names) <= {"G", "delta_R", "delta_L"}


def test_arguments_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match="headings: expected as many as offsets, 2; got 1"):
        meetings(DRUM, [0.0, 1.0], [0.0])
    with pytest.raises(ValueError, match=re.escape("starts: expected an array (k, 2)")):
        meeting_basins(DRUM, [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="pair: expected a drum wider than 28 mm"):
        meetings(DumbbellPair(16, 3, 1.5, 20), [0.0], [0.0])
