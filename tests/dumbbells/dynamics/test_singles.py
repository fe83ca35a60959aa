"""Zigzags of single dumbbells against rest regions, an exact law of climbing, and hand counts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.singles import (
    Mean,
    follow,
    keel_of,
    keel_ratio,
    onset_azimuths,
    zigzags,
)
from polycorner.motion.events import EventKind
from polycorner.motion.noise import Noise

DRUM = DumbbellDrum()
HEADINGS = np.radians([-20, -5, 0, 10, 20])


@pytest.fixture(scope="module")
def path():
    return follow(DRUM, HEADINGS, 30.0, azimuth=0.02)


def test_every_zigzag_turns_where_the_region_of_rest_ends(path):
    """To within what the drum turns in a step, at each of several onsets."""
    found = zigzags(path, DRUM.spin)
    for zigzag, boundary in zip(found, onset_azimuths(DRUM, HEADINGS), strict=True):
        assert len(zigzag) >= 2
        assert zigzag.upper == pytest.approx(np.full(len(zigzag), boundary), abs=1e-3 * DRUM.spin)


def test_widths_are_those_of_coasting(path):
    """The formula is that of a short dumbbell."""
    turning = keel_of(DRUM).turning(HEADINGS)
    widths = [zigzag.width.mean() for zigzag in zigzags(path, DRUM.spin)]
    assert widths == pytest.approx(turning.upper - turning.coasting, rel=0.005)
    assert 4.5 < np.degrees(widths).min() < np.degrees(widths).max() < 5.0


def test_over_whole_zigzags_it_climbs_at_omega_rho_tan_theta(path):
    """``rho = R - r`` is the radius on which centres move; with ``R`` it would be 2.5 % more."""
    rates = [zigzag.climb_rate for zigzag in zigzags(path, DRUM.spin)]
    law = DRUM.spin * DRUM.centre_radius * np.tan(HEADINGS)
    assert rates == pytest.approx(law, rel=1e-4, abs=1e-8)


def test_slips_are_what_the_record_shows(path):
    """A slip is what lies between two rests, read off the record by hand."""
    zigzag = zigzags(path, DRUM.spin)[3]
    moving = ~path.rests[1:, 3]
    times = path.times[1:]
    begins = times[1:][moving[1:] & ~moving[:-1]]
    assert zigzag.starts == pytest.approx(begins[: len(zigzag)], abs=0.011)
    assert zigzag.turn == pytest.approx(np.zeros(len(zigzag)), abs=1e-8)
    total = path.q[-1, 3, 1] - path.q[0, 3, 1]
    if path.rests[-1, 3]:
        assert zigzag.rise.sum() == pytest.approx(total, abs=1e-6)


def test_backwards_the_region_is_mirrored():
    back = replace(DRUM, spin=-DRUM.spin)
    assert onset_azimuths(back, -HEADINGS) == pytest.approx(-onset_azimuths(DRUM, HEADINGS))
    began = follow(back, -HEADINGS, 16.0, azimuth=-0.04).of_kind(EventKind.MOTION)
    first = {e.bodies[0]: e.time for e in reversed(began)}
    reached = [-0.04 + back.spin * first[k] for k in range(len(HEADINGS))]
    assert reached == pytest.approx(onset_azimuths(back, -HEADINGS), abs=1e-3 * DRUM.spin)


def test_a_keel_is_lost_when_sliding_is_as_easy_as_rolling():
    level = replace(DRUM, tilt=0.0)
    assert keel_ratio(level, 0.2, duration=20.0) == pytest.approx(1.0, abs=1e-6)
    raft = replace(level, sliding=(0.1, 0.1))
    assert abs(keel_ratio(raft, 0.2, duration=20.0)) < 0.1


def test_runs_do_not_depend_on_who_else_is_in_them():
    noise = Noise(chatter=0.3, seed=5)
    alone = follow(DRUM, [0.2], 9.0, noise=noise, azimuth=0.05)
    among = follow(DRUM, [0.2, -0.1], 9.0, noise=noise, azimuth=0.05)
    assert among.q[:, 0] == pytest.approx(alone.q[:, 0], abs=1e-9)
    assert len(zigzags(alone, DRUM.spin)[0]) >= 1


def test_means_and_standard_errors():
    mean = Mean.of([1.0, 2.0, 3.0, math.nan])
    assert (mean.value, mean.count) == (2.0, 3)
    assert mean.error == pytest.approx(1 / math.sqrt(3))
    assert math.isnan(Mean.of([1.0]).error)
    assert math.isnan(Mean.of([]).value)


def test_a_drum_with_a_bottom_is_refused():
    with pytest.raises(ValueError, match="drum: expected one without bottom"):
        follow(replace(DRUM, floor=True), [0.1], 1.0)
