"""Driven pairs: chirality against the model's, mirror images, strata, and the minimiser."""

import math
import statistics
from dataclasses import replace

import api_samples
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum
from polycorner.dumbbells.dynamics import dyads
from polycorner.dumbbells.dynamics.dyads import (
    correlation_time,
    follow_dyads,
    handedness,
    heading_at_shift,
    minimiser_heading,
    steady,
)
from polycorner.dumbbells.dynamics.pairs import is_dyad
from polycorner.dumbbells.dynamics.singles import Mean
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.statics.minima import dyad_minima
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate

DRUM = DumbbellDrum()
LEVEL = replace(DRUM, tilt=0.0)
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
CHATTER = Noise(chatter=0.4, seed=11)


@given(st.integers(0, 10**6))
def test_chirality_is_that_of_the_model(seed):
    pairs = PAIR.placements(np.random.default_rng(seed), 20)
    hands = handedness(DRUM, pairs.reshape(-1, 2, 3))
    assert [{1: "R", -1: "L", 0: None}[h] for h in hands] == [PAIR.chirality(q) for q in pairs]


@given(st.floats(-20, 20), st.sampled_from("RL"))
def test_nested_pairs_are_dyads_and_mirror_images_have_the_other_hand(degrees, hand):
    q = PAIR.nested(hand, heading=math.radians(degrees)).reshape(2, 3)
    assert is_dyad(DRUM, q)
    assert handedness(DRUM, q) == {"R": 1, "L": -1}[hand]
    assert handedness(DRUM, q * [-1, 1, -1]) == -handedness(DRUM, q)


def test_right_pairs_climb_and_left_pairs_descend_with_opposite_headings():
    angle = math.radians(12)
    paths = follow_dyads(DRUM, [("R", angle), ("L", -angle)], 25.0)
    assert np.isinf(paths.lifetimes).all()
    right, left = paths.climb_rates(after=5.0)
    law = DRUM.spin * DRUM.centre_radius * math.tan(angle)
    assert right == pytest.approx(law, rel=0.5)
    assert left == pytest.approx(-law, rel=0.5)
    assert (paths.hand == [1, -1]).all()
    assert sum(paths.strata().values()) == pytest.approx(1.0)


def test_in_a_level_drum_left_pairs_are_right_pairs_upside_down():
    """``eta -> -eta, theta -> pi - theta`` keeps the drum, its spin and the balls' numbers.

    With noise too, so that sorting by chirality does not need a tilt.  Solved to 1e-6 a step, the
    images part slowly; contacts make their order matter.
    """
    q = PAIR.nested("R", heading=0.2, clearance=0.05).reshape(2, 3)
    image = q * [1, -1, -1] + [0, 0, math.pi]
    assert handedness(DRUM, image) == -handedness(DRUM, q)
    two = replace(LEVEL, count=2)
    first, second = (
        simulate(two, two.state(place), 9.5, 1e-3, noise=CHATTER).q for place in (q, image)
    )
    moved = abs(first[-1, :, 1] - first[0, :, 1]).max()
    assert moved > 0.02
    back = second * [1, -1, -1, -1] + [0, 0, math.pi, 0]
    assert abs(back[-1, :, :3] - first[-1, :, :3]).max() < 0.01 * moved


def test_mirrored_pairs_in_a_drum_that_turns_the_other_way_are_mirrored():
    q = PAIR.nested("R", heading=0.2, clearance=0.05).reshape(2, 3)
    paths = []
    for sign in (1, -1):
        drum = replace(DRUM, count=2, spin=sign * DRUM.spin)
        paths.append(simulate(drum, drum.state(q * [sign, 1, sign]), 9.5, 1e-3, noise=CHATTER).q)
    moved = abs(paths[0][-1, :, 1] - paths[0][0, :, 1]).max()
    assert moved > 0.02
    back = paths[1] * [-1, 1, -1, -1]
    assert abs(back[-1, :, :3] - paths[0][-1, :, :3]).max() < 0.01 * moved


@pytest.mark.parametrize("degrees", [0.0, 3.0, 6.0])
def test_at_any_mean_azimuth_the_same_heading_is_of_least_energy(degrees):
    expected = dyad_minima(PAIR)[0].headings[0]
    found = minimiser_heading(DRUM, azimuth=math.radians(degrees))
    assert found == pytest.approx(expected, abs=1e-6)


def test_shaken_in_a_drum_that_stands_still_headings_go_to_that_of_least_energy():
    """From both sides, staying in the corner; a turning drum drives them elsewhere."""
    least = dyad_minima(PAIR)[0].headings[0]
    starts = [("R", math.radians(2)), ("R", math.radians(14))]
    quiet = replace(LEVEL, spin=0.0)
    paths = follow_dyads(quiet, starts, 10.0, noise=Noise(chatter=1.0, seed=4))
    away = abs(np.degrees(paths.heading[[0, -1]]) - least)
    assert (away[1] < away[0] - 0.5).all()
    assert paths.shift[-1] == pytest.approx(paths.shift[0], abs=0.3)


@given(st.floats(0.5, 15.0))
def test_the_heading_at_a_shift_has_the_lowest_balls(shift):
    """Squared lateral places of four balls, over all headings, by trying them."""
    theta = np.radians(np.linspace(-45, 45, 90_001))
    along, across = np.sin(theta), -np.cos(theta)
    lateral = [
        side * (shift * along + 4.5 * across) / 2 + end * 8 * along
        for side in (-1, 1)
        for end in (-1, 1)
    ]
    best = np.degrees(theta[np.argmin(np.square(lateral).sum(axis=0))])
    assert heading_at_shift(DRUM, shift) == pytest.approx(best, abs=0.002)


def test_the_heading_at_the_corner_is_that_of_the_plane():
    heading, along, _ = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5).plane_corner()
    assert heading_at_shift(DRUM, along) == pytest.approx(math.degrees(heading), abs=1e-12)


def test_means_are_over_pairs_that_held():
    starts = [("R", 0.1), ("R", 0.2), ("L", -0.2)]
    paths = follow_dyads(DRUM, starts, 2.0)
    found = steady(paths, after=1.0)
    assert (found.held, found.count) == (3, 3)
    assert found.heading.value == pytest.approx(np.degrees([0.1, 0.2, 0.2]).mean(), abs=1.0)
    assert found.minimiser == pytest.approx(dyad_minima(PAIR)[0].headings[0], abs=1e-6)
    with pytest.raises(ValueError, match="after: expected a time before the end"):
        steady(paths, after=3.0)


@pytest.mark.parametrize(("errors", "settled"), [(0.0, True), (1.9, True), (2.1, False)])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_heading_has_settled_that_drifts_by_at_most_two_standard_errors(errors, settled, sign):
    apart = [-1.0, 0.25, 0.75, 0.5, -0.5]  # of five pairs, with the mean zero
    error = statistics.stdev(apart) / math.sqrt(len(apart))
    drift = Mean.of(np.add(apart, sign * errors * error))
    assert replace(api_samples.steady(), drift=drift).settled == settled


def test_arguments_are_checked():
    with pytest.raises(ValueError, match="starts: expected at least one"):
        follow_dyads(DRUM, [], 1.0)
    with pytest.raises(ValueError, match="drum: expected one without bottom"):
        follow_dyads(replace(DRUM, floor=True), [("R", 0.1)], 1.0)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.95])
def test_the_correlation_time_of_a_first_order_process_is_the_closed_form(memory):
    rng, values = np.random.default_rng(5), np.zeros(200_000)
    noise = rng.normal(size=len(values))
    for k in range(1, len(values)):
        values[k] = memory * values[k - 1] + noise[k]
    expected = 0.5 * (1 + memory) / (1 - memory)
    assert correlation_time(values) == pytest.approx(expected, rel=0.1)


def test_a_trend_and_a_constant_are_one_sample():
    assert correlation_time(np.full(50, 3.0)) == 25.0
    assert correlation_time(np.arange(1000.0)) > 100.0


# ------------------------------------------------------------------------------------------ turning

WIDE = DumbbellDrum(drum_radius=12500.0)  # in which dumbbells are short


def places(drum, heading):
    return drum.pair.nested("R", heading=math.radians(heading), clearance=0.0).reshape(2, 3)


@pytest.mark.parametrize("length", [12.0, 16.0, 24.0])
def test_at_the_parting_heading_dumbbells_are_equally_high_and_press_no_more(length):
    drum = replace(WIDE, length=length)

    def apart(heading):
        return float(np.abs(np.diff(places(drum, heading)[:, 0]))[0])

    heading = dyads.parting_heading(drum)
    assert apart(heading) < 1e-3 * apart(0.0)
    assert dyads.pressing(drum, heading) == pytest.approx(0.0, abs=1e-12)
    assert dyads.pressing(drum, 5.0) == pytest.approx(apart(5.0), rel=1e-3)


def test_the_torque_of_the_weight_on_a_pair_is_the_ratio_times_that_on_a_dumbbell():
    drum, small = WIDE, math.radians(1.0)
    corner = math.radians(heading_at_shift(drum, dyads.offsets(drum)[1]))

    def energy(q):
        ends = drum.length / 2 / drum.centre_radius * np.sin(q[..., 2])
        return -np.cos(q[..., 0, None] + ends[..., None] * np.array([-1, 1])).sum()

    def rise(angle):
        pair = energy(places(drum, math.degrees(corner + angle)))
        return pair - energy(places(drum, math.degrees(corner)))

    single = energy(np.array([[0.0, 0.0, small]])) - energy(np.array([[0.0, 0.0, 0.0]]))
    pair = (rise(small) + rise(-small)) / 2
    assert pair / (2 * single) == pytest.approx(dyads.return_ratio(drum), rel=2e-3)


@pytest.mark.parametrize("length", [12.0, 16.0])
def test_an_impact_dissipates_the_energy_of_the_impact_mass(length):
    """Two bodies that approach with ``v`` push at half of ``s`` from centres of mass ``2 m``.

    Then ``1/M = 1/m + s^2 / (2 I)``, and a plastic impact dissipates ``M v^2 / 2``.
    """
    drum = DumbbellDrum(length)
    found = dyads.turn_by_impact(drum, 4.0)
    m, (_, along) = drum.ball_mass, dyads.offsets(drum)
    inertia = 2 * m * (length**2 / 4 + 0.4 * drum.ball_radius**2)
    expected = 0.5 * 4.0**2 / (1 / m + along**2 / (2 * inertia))
    assert found.dissipated == pytest.approx(expected, rel=0.02)


def test_the_turn_by_an_impact_grows_as_the_square_of_the_speed_over_the_friction():
    one, four = (dyads.turn_by_impact(DRUM, v).turn for v in (1.0, 4.0))
    assert one > 0
    assert four / one == pytest.approx(16.0, rel=0.05)
    smooth = replace(DRUM, sliding=(0.15, 0.1), rolling=(0.05, 0.03), rubbing=(0.15, 0.15))
    assert dyads.turn_by_impact(smooth, 1.0).turn == pytest.approx(2 * one, rel=0.05)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_after_a_head_on_impact_dumbbells_slide_as_far_as_friction_lets_them(speed):
    drum = replace(DRUM, count=2, tilt=0.0, spin=0.0)
    gap = 1e-4
    start = [[0, 50, 0], [0, 50 + drum.length + 2 * drum.ball_radius + gap, 0]]
    state = drum.state(start, [[0, speed, 0, 0], [0, 0, 0, 0]])
    from polycorner import simulate

    slowing = drum.sliding[1] * GRAVITY
    path = simulate(drum, state, 0.01, speed / slowing / 30)
    slid = path.q[-1, 1, 1] - path.q[0, 1, 1]
    after = math.sqrt(speed**2 - 2 * slowing * gap) / 2
    assert slid == pytest.approx(after**2 / (2 * slowing), rel=0.03)
