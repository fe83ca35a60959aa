"""Sections 3 and 4: expected verdicts, and counts made by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from paper_checks import Verdict
from paper_checks.section3 import bunch, steep
from paper_checks.section3 import zigzag as dyad_zigzag
from paper_checks.section7 import driven
from polycorner.dumbbells.dynamics.dyads import handedness
from polycorner.dumbbells.dynamics.pairs import is_dyad
from polycorner.motion.events import Event, EventKind


def events(*entries):
    return [
        Event(time, EventKind.MOTION if moves else EventKind.REST, (body,), "", 0.0)
        for time, body, moves in entries
    ]


def test_who_moves_first_is_counted_from_rest_of_both():
    """Twice the upper one alone, once both; what starts while the other moves does not count."""
    path = SimpleNamespace(
        events=events(
            (1.0, 0, True),
            (1.2, 1, True),
            (1.5, 0, False),
            (1.6, 0, True),
            (2.0, 0, False),
            (2.0, 1, False),
            (3.0, 0, True),
            (3.0, 1, True),
            (4.0, 0, False),
            (4.0, 1, False),
            (5.0, 0, True),
        ),
        q=np.array([[[0.2, 0, 0, 0], [0.1, 0, 0, 0]]]),
        at=lambda _: 0,
    )
    assert dyad_zigzag.first_to_move(path) == {"lower": 0, "upper": 2, "both": 1}


def test_pairs_start_where_they_are_said_to():
    sides = driven.pairs("side_by_side", 2, 0.02)
    across = driven.TWO.centre_radius * np.abs(np.diff(sides.q[0, :, :, 0], axis=-1))
    assert across == pytest.approx(6.05, abs=0.01)
    assert sides.q[0, :, :, 1:3] == pytest.approx(0.0)
    ends = driven.pairs("end_to_end", 1, 0.02)
    assert np.abs(np.diff(ends.q[0, 0, :, 1])) == pytest.approx(16 + 6 + 0.05)
    for paths in (sides, ends):
        assert not is_dyad(driven.TWO, paths.q[0]).any()
        assert (handedness(driven.TWO, paths.q[0]) == 0).all()


def test_encounters_start_apart_and_a_climbing_one_below():
    drum, q = bunch.encounters(5, 0.02, 0.0)
    assert q.shape[1:] == (5, 2, 4)
    assert (q[0, :, 1, 1] - q[0, :, 0, 1] > 22).all()
    assert (q[0, :, 0, 2] > q[0, :, 1, 2]).all()
    for pair in q[0]:
        drum.placed(pair)  # refuses what overlaps


def test_bunches_are_judged_by_how_many_have_left(monkeypatch):
    monkeypatch.setattr(bunch, "OBSERVED_TIME", 0.02)
    found = {leaving: bunch.of_sixty_leave(leaving) for leaving in (0, 40)}
    assert {leaving: one.verdict for leaving, one in found.items()} == {
        0: Verdict.HOLDS_UNDER,
        40: Verdict.REFUTED,
    }
    assert [found[40].numbers[f"left_{k}"] for k in range(3)] == [0, 0, 0]
    told = found[40].evidence
    assert "sliding 0.3, rolling 0.1, rubbing 0.3, no noise, 2 start(s): 0, 0 left" in told
    assert "shaking along the axis with 600 mm/s² at 5 to 50 Hz, 1 start(s): 0 left" in told
    assert "sliding 0.72, rolling 0.1, rubbing 0.1, no noise, 4 start(s): 0, 0, 0, 0 left" in told
    assert "0.02 s" in found[40].evidence


def test_the_reach_of_a_dyad_is_speed_times_time():
    found = bunch.can_leave_in_time().numbers
    assert found["reach"] == pytest.approx(0.01 * 122 * math.tan(math.radians(15)) * 1200)
    assert found["least_reach"] == pytest.approx(
        0.01 * 122 * math.tan(math.radians(7.943)) * 1200, rel=1e-4
    )
    assert 0.01 * 122 * math.tan(math.radians(found["needed"])) * 1200 == pytest.approx(300)
    assert bunch.can_leave_in_time(found["least_reach"]).verdict is Verdict.HOLDS_UNDER
    assert bunch.can_leave_in_time(found["reach"] + 1).verdict is Verdict.REFUTED


def test_more_sliding_friction_lets_steeper_dumbbells_climb():
    """Against the region of rest: the last heading at which the drum makes a dumbbell roll."""
    from polycorner.dumbbells.statics.keel import RestRegion

    theta = np.radians(np.arange(-60.0, 90.0, 0.05))
    for sliding in (0.15, 0.2, 0.3, 0.45):
        region = RestRegion(steep.DRUM.tilt, 0.1, sliding)
        last = np.degrees(theta[np.asarray(region.rolls_back(theta))].max())
        assert steep.largest_climbing(sliding) == pytest.approx(last, abs=0.06)
