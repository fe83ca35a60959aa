"""The installed studies against direct calls of what they are made of."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics import dyads
from polycorner.dumbbells.dynamics.bunch import follow_bunch
from polycorner.dumbbells.dynamics.dyads import follow_dyads, heading_at_shift
from polycorner.dumbbells.statics.minima import dyad_minima
from polycorner.dumbbells.studies import bunch, climbing, heading, turning
from polycorner.motion.noise import Noise
from polycorner.sweeps import sweep


@pytest.mark.parametrize("chirality", ["R", "L"])
def test_headings_are_those_of_the_dyads_minima(chirality):
    grid = {"length": ([12.0, 16.0], "mm"), "rod_radius": ([1.5, 2.95], "mm")}
    found = sweep(heading, grid, fixed={"chirality": chirality})
    for length in found["length"].values:
        for rod in found["rod_radius"].values:
            at = found.sel(length=length, rod_radius=rod)
            pair = DumbbellPair(float(length), 3.0, float(rod), 125.0)
            right = dyad_minima(pair)["RL".index(chirality)]
            assert at["heading"].item() == right.headings[0]
            assert at["minimum"].item() == right.certificate.is_minimum
            for name, value in right.multipliers.items():
                assert at[f"multiplier_{name}"].item() == value
            assert at["residual"].item() < 1e-12
    assert found["minimum"].values.tolist() == [[1, 0], [1, 0]]


@given(st.floats(12, 40), st.floats(0.1, 2.95))
def test_in_the_plane_the_heading_is_the_closed_form_and_minima_end_at_the_critical_rod(
    length, rod
):
    found = heading(length, rod, drum_radius=math.inf)
    assert found["heading"][0] == pytest.approx(found["plane_heading"][0], abs=1e-8)
    assert found["paper_heading"][0] == pytest.approx(math.degrees(math.atan(3 / length)))
    critical = 6 * math.sqrt(1 - (3 / length) ** 2) - 3  # where l s = 2 r^2, docs/heading.md
    if abs(rod - critical) > 1e-6:
        assert found["minimum"] == (rod < critical)


def test_pairs_that_cannot_be_are_rows_with_the_models_sentence():
    found = sweep(heading, {"length": [5.0, 8.0, 16.0], "rod_radius": [0.75, 4.0]})
    assert found["status"].values.tolist() == [[2, 2], [2, 2], [1, 2]]
    message = found["message"].values
    assert message[0, 0].startswith("ValueError: length: expected")
    assert message[2, 1].startswith("ValueError: rod_radius: expected")
    assert "expected a corner where A2B1 A2b aB1 touch; got none" in message[1, 0]


def test_climb_rates_are_slopes_of_the_paths_and_noise_is_the_points_own():
    grid = {"noise": [0.4, 0.6], "tilt": ([0.0, 7.0], "deg")}
    found = sweep(climbing, grid, rng=3, fixed={"duration": 4.0, "pairs": 2})
    assert (found["held"].values == 2).all()
    child = np.random.SeedSequence(3).spawn(4)[1]
    noise = Noise(chatter=0.4, seed=int(np.random.default_rng(child).integers(2**63)))
    starts = [("R", math.radians(angle)) for angle in (2.0, 14.0)]
    paths = follow_dyads(DumbbellDrum(tilt=math.radians(7)), starts, 4.0, noise=noise)
    late = paths.times >= 2.0
    slopes = (paths.eta[-1] - paths.eta[late][0]) / np.ptp(paths.times[late])
    at = found.sel(noise=0.4, tilt=7.0)
    assert at["climb_rate"].item() == pytest.approx(slopes.mean())
    assert abs(slopes).max() > 1e-3
    mean = np.degrees(paths.heading[late].mean())
    assert at["heading"].item() == pytest.approx(mean)
    assert at["law"].item() == pytest.approx(0.01 * 122 * math.tan(math.radians(mean)))
    assert len(set(found["heading"].values.ravel())) == 4


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"noise": -1.0}, "noise: expected"), ({"pairs": 0}, "pairs: expected")],
)
def test_climbing_names_what_is_wrong(wrong, words):
    given = {"noise": 0.1, "tilt": 7.0, "rng": np.random.default_rng(1)} | wrong
    with pytest.raises((TypeError, ValueError), match=words):
        climbing(**given)


def test_members_of_a_bunch_are_counted():
    fixed = {
        "count": 12,
        "duration": 0.2,
        "top": 60.0,
        "tilt": -20.0,
        "sliding": 0.15,
        "strength": 0.1,
    }
    found = sweep(bunch, {"start": [0, 3], "rubbing": [0.1, 0.3]}, fixed=fixed)
    drum = DumbbellDrum(
        count=12,
        floor=True,
        top=60.0,
        tilt=math.radians(-20.0),
        sliding=(0.15, 0.1),
        rubbing=(0.1, 0.1),
    )
    run = follow_bunch(drum, 0.2, start=3, noise=Noise(chatter=0.1, seed=3), dt=0.004)
    one = found.sel(start=3, rubbing=0.1)
    at = {name: values.item() for name, values in one.items() if values.ndim == 0}
    assert at["left"] == len(run.exits)
    assert 0 < at["left"] < 12
    assert at["left"] == at["left_right"] + at["left_left"] + at["left_single"]
    assert at["left_left"] == run.exit_counts()["left"]
    stayed = run.present[-1]
    assert at["in_right"] + at["in_left"] + at["both"] + at["single"] == stayed.sum()
    assert at["reach"] == run.q[-1, stayed, 1].mean()
    assert at["max_penetration"] == run.trajectory.max_penetration
    assert at["missed"] == run.trajectory.missed
    assert len(np.unique(found["reach"])) == 4
    count = int(at["left"])
    assert one["exit_time"].values[:count].tolist() == [time for time, _ in run.exits]
    assert np.isnan(one["exit_time"].values[count:]).all()
    hands = {"right": 1, "left": -1, "single": 0}
    assert one["exit_hand"].values[:count].tolist() == [hands[k] for k in run.exit_kinds]
    assert one["exit_alone"].values[:count].tolist() == [x.alone for x in run.leavings]
    late = [
        run.times.tolist().index(max(t for t in run.times if t <= 0.01 * k + 1e-12))
        for k in range(1, 21)
    ]
    assert one["present_at"].values.tolist() == [run.present[i].sum() for i in late]
    assert one["heap_at"].values.tolist() == [run.heap(i) for i in late]
    assert one["right_at"].values.tolist() == [run.census(i)["right"] for i in late]


def test_dynamic_coefficients_are_given_by_ratios():
    given = {"start": 0, "count": 12, "duration": 0.2, "tilt": -20.0, "sliding": 0.15}
    usual, other = bunch(**given), bunch(**given, sliding_ratio=0.95)
    assert usual["reach"] != other["reach"]
    kept = bunch(**given, sliding_ratio=2 / 3, rolling_ratio=0.6, rubbing_ratio=1.0)
    assert kept["reach"][0] == pytest.approx(usual["reach"][0], abs=1e-6)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"start": 1.5}, "start: expected"),
        ({"start": -1}, "start: expected"),
        ({"kind": "noise"}, "kind: expected"),
        ({"strength": -1.0}, "strength: expected"),
        ({"kicks": -1.0}, "kicks: expected"),
        ({"pairs": "RX"}, "pairs: expected"),
        ({"count": 0}, "count: expected"),
        ({"rubbing": -0.1}, "rubbing: expected"),
        ({"sliding_ratio": 1.5}, "sliding_ratio: expected"),
        ({"top": 0.0}, "top: expected"),
        ({"dt": 0.1}, "dt: expected"),
        ({"duration": math.nan}, "duration: expected"),
    ],
)
def test_bunches_name_what_is_wrong(wrong, words):
    with pytest.raises((TypeError, ValueError), match=words):
        bunch(**({"start": 1, "count": 3, "duration": 0.01} | wrong))


def test_pairs_start_one_above_the_other_and_kinds_of_noise_are_those_of_the_study_of_pairs():
    given = {"duration": 0.2, "top": 100.0, "dt": 0.002, "pairs": "RL"}
    found = bunch(1, kind="shaking along", strength=600.0, kicks=30.0, **given)
    assert found["in_right"] == found["in_left"] == 2
    assert found["highest"][0] == pytest.approx(67, abs=1.5)
    assert found["highest"][0] > bunch(1, **given)["reach"][0] > 40
    other = bunch(1, kind="kicks", strength=30.0, scale=0.003, **given)
    assert len({one["reach"][0] for one in (found, other, bunch(1, **given))}) == 3


# ------------------------------------------------------------------------------------------ turning


def results(heading, strength, **given):
    rng = np.random.default_rng(3)
    usual = {"duration": 6.0, "after": 2.0, "spin": 0.04, "dt": 1e-3}
    found = turning(heading, "kicks", strength, 0.003, rng=rng, **(usual | given))
    return {name: float(value) for name, (value, _) in found.items()}


def test_without_noise_pairs_turn_by_what_few_impacts_there_are():
    found = results(8.0, 0.0)
    for name in ("single", "weight"):
        assert found[name] == pytest.approx(0.0, abs=1e-6)
    assert 0 <= found["rate"] < 0.01
    assert 0 <= found["impacts"] < 0.01
    assert found["at"] == pytest.approx(8.0, abs=0.05)


def test_impacts_of_dumbbells_that_roll_turn_pairs_of_either_hand_away_from_zero():
    for hand in ("right", "left"):
        found = results(4.0, 40.0, hand=hand, part="rolling")
        assert found["single"] == pytest.approx(0.0, abs=1e-6)
        assert found["rate"] > 5 * found["rate_error"]
        assert 0.3 < found["impacts"] / found["rate"] < 1.2


def test_the_weights_part_follows_from_single_dumbbells():
    drum = DumbbellDrum()
    found = results(14.0, 50.0)
    least = heading_at_shift(drum, dyads.offsets(drum)[1])
    away = np.degrees(np.sin(2 * np.radians(found["at"] - least)) / 2)
    assert found["single"] < 0
    expected = found["single"] * dyads.return_ratio(drum) * away
    assert found["weight"] == pytest.approx(expected, rel=1e-12)
    assert found["pressing"] == dyads.pressing(drum, found["at"])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"hand": "both"}, "hand: expected 'right' or 'left'"),
        ({"part": "some"}, "part: expected"),
        ({"duration": 1.0}, "duration: expected"),
    ],
)
def test_what_is_wrong_is_named(wrong, words):
    with pytest.raises(ValueError, match=words):
        results(4.0, 30.0, **wrong)
