"""Dips of a function along a step, against the cubic itself."""

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from polycorner.skeletons.walks import dips, sign_change

heights, slopes = st.floats(1e-3, 10), st.floats(0, 100)


@given(heights, heights, slopes, slopes, st.floats(1e-3, 1))
def test_a_dip_is_where_the_cubic_is_lowest(f0, f1, fall, rise, h):
    assume(fall > 1e-3)
    lowest = CubicHermiteSpline([0, h], [f0, f1], [-fall, rise])(np.linspace(0, h, 4001)).min()
    bound = 0.25 * min(f0, f1)
    assume(abs(lowest - bound) > 1e-4 * max(f0, f1, h * fall, h * rise))
    assert dips(f0, f1, -fall, rise, h) == (lowest < bound)


@given(
    st.floats(-1e3, 1e3),
    st.floats(1e-3, 1e3),
    st.floats(1e-3, 1 - 1e-3),
    st.floats(0, 1e3),
    st.sampled_from([0.0, 1e-320, 1e-200, 1e-17, 1.0, 1e150]),
)
@example(1.0, 1e-3, 1e-3, 1e3, 1e-200)  # the product of the slopes vanishes
def test_every_cubic_has_an_answer_without_a_warning(f0, fall, turn, bend, size):
    """The slope is ``(t - turn) (bend t + fall / turn)``; sizes from 0 to overflow follow."""
    p, q, r = bend, fall / turn - bend * turn, -fall
    f1 = f0 + r + q / 2 + p / 3
    lowest = f0 + turn * (r + turn * (q / 2 + turn * p / 3))
    assume(abs(lowest - 0.25 * min(f0, f1)) > 1e-6 * max(abs(f0), fall, bend, 1.0))
    exact = np.array([f0, f1, -fall, p + q + r])
    scaled = np.array([size * value for value in exact.tolist()])
    with np.errstate(all="raise"):
        assert dips(*exact, 1.0) == (lowest < 0.25 * min(f0, f1))
        assert dips(*scaled, 1.0) in {True, False}


@pytest.mark.parametrize(
    ("ends", "least"), [((-3e-16, -2e-16), 1.0), ((2e-16, 3e-16), 0.0), ((-1e-16, -1e-16), 1.0)]
)
def test_where_no_sign_changes_nothing_is_looked_for_outside(ends, least):
    tried = []

    def noise(s):
        tried.append(s)
        return ends[0] + s * (ends[1] - ends[0]), s

    assert sign_change(noise) == (least, least)
    assert all(0 <= s <= 1 for s in tried)
