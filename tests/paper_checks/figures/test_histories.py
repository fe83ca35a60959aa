"""The simulated histories in the paper's figures: zigzags, and headings lost and gained."""

import math

import numpy as np
import pytest
from drawn_curves import lines

from paper_checks.figures import FIGURES
from paper_checks.figures import style as look


def test_the_single_dumbbell_zigzags_and_loses_its_heading(drawn):
    a, b, c, d, e = drawn("single_history").axes
    calm = [lines(axes, look.RIGHT[1])[0] for axes in (a, b, c)]
    noisy = [lines(axes, look.RIGHT[0])[0] for axes in (a, b, c, d, e)]
    assert np.ptp(calm[2][:, 1]) < 1e-6
    # carried with the drum, 0.01 rad/s, until 0.1 of the load pulls across the axis
    carried = calm[0][calm[0][:, 0] < 8]
    rate = np.diff(carried[:, 1]) / np.diff(carried[:, 0])
    assert np.radians(rate) == pytest.approx(0.01, rel=1e-6)
    tilt, theta, phi = math.radians(7), math.radians(15), np.radians(calm[0][:, 1].max())
    pull = math.sin(phi) * math.cos(theta) - math.tan(tilt) * math.sin(theta)
    assert pull == pytest.approx(0.1 * math.cos(phi), rel=5e-3)
    for early, late in ((noisy[1], noisy[3]), (noisy[2], noisy[4])):
        assert late[: len(early), 1] == pytest.approx(early[:, 1])
    heading, rise = noisy[4][:, 1], noisy[3][:, 1]
    assert heading[0] == pytest.approx(15)
    assert abs(heading[-1]) < 7
    assert rise.max() > 4
    assert np.argmax(rise) < len(rise) - 1
    assert f"{heading[-1]:+.1f}°".replace("-", "−") in FIGURES["single_history"].caption


def test_dyads_turn_to_the_side_of_their_hand(drawn):
    panels = drawn("dyad_history").axes
    b, c, d, e, f = panels[3:]
    for axes in (b, c, d):
        first, second = (lines(axes, colour)[0][:, 1] for colour in look.RIGHT)
        assert lines(axes, "black")[0][:, 1] == pytest.approx((first + second) / 2, abs=1e-9)
    starts = [("R", 10), ("R", -8), ("L", 8), ("L", -10)]
    curves = [line.get_ydata() for line in f.lines if len(line.get_ydata()) > 2]
    assert len(curves) == 4
    for curve, (_, heading) in zip(curves, starts, strict=True):
        assert curve[0] == pytest.approx(heading, abs=1e-6)
    right, left = (curves[k][-1] - curves[k][0] for k in (1, 2))
    assert right > 4
    assert left < -4
    assert np.mean([curves[k][-1] for k in (0, 1)]) > np.mean([curves[k][-1] for k in (2, 3)]) + 4
    rises = [line.get_ydata()[-1] for line in e.lines if len(line.get_ydata()) > 2]
    assert rises[0] > rises[1] > rises[3]
    assert f"R from +10°: {curves[0][-1]:+.1f}°" in FIGURES["dyad_history"].caption
