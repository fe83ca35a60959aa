"""Section 7, moving dyads: expected verdicts, and symmetries of the comparisons."""

import numpy as np
import pytest

from paper_checks import Verdict
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


def test_colours_that_neither_agree_nor_are_exchanged_are_refuted():
    assert dyads_moving.colours_agree(("red", "green")).verdict is Verdict.REFUTED
