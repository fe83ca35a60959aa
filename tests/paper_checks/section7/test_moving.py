"""Section 7, moving dyads: expected verdicts, and symmetries of the comparisons."""

import math

import numpy as np
import pytest

from paper_checks import Verdict
from paper_checks.framework.disturbances import Disturbance
from paper_checks.section7 import driven
from paper_checks.section7 import moving as dyads_moving


def test_rates_are_rises_over_times():
    paths = driven.dyads((("R", 8.0),), 20.0, tilt=0.0)
    first = int(np.searchsorted(paths.times, 5.0))
    rise = paths.q[-1, 0, :, 1].mean() - paths.q[first, 0, :, 1].mean()
    assert dyads_moving.rates(paths) == pytest.approx(rise / (paths.times[-1] - paths.times[first]))


def test_other_images_of_a_pair_do_not_show_that_the_drum_is_achiral():
    for image in ((-1, 1, -1), (-1, -1, 1)):
        found = dyads_moving.sorting_needs_no_chirality(image, turned=False)
        assert found.verdict is Verdict.REFUTED


def test_headings_that_noise_has_not_turned_say_nothing():
    quiet = ((Disturbance("chatter", 0.0, 0.01), 20.0),)
    wide = {"kinds": quiet, "width": (0.0, 6.0)}
    found = dyads_moving.stays_at_its_heading(**wide)
    assert found.verdict is Verdict.REFUTED
    assert found.numbers["heading_0"] < 0.1
    assert 4 < found.numbers["width_0"] < 6
    assert dyads_moving.stays_at_its_heading(**wide, turned=0.0).verdict is Verdict.HOLDS_UNDER


def test_the_distance_from_the_locus_is_that_of_both_dumbbells():
    paths = driven.dyads((("R", 8.0),), 60.0)
    late = paths.q[paths.times > 15.0, 0]
    from_it = [
        (122 * one[:, 0].mean()) ** 2 * 2 + (8 * (one[:, 2].mean() - math.radians(7.943))) ** 2 * 2
        for one in late
    ]
    found = dyads_moving.stays_close_to_the_corner()
    assert found.verdict is Verdict.CORRECTED
    assert found.numbers["least"] == pytest.approx(math.sqrt(min(from_it)), rel=1e-3)
    assert found.numbers["largest"] == pytest.approx(math.sqrt(max(from_it)), rel=1e-3)
