"""Dips of a function along a step, against the cubic itself."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from polycorner.skeletons.sign_changes import dips

heights, slopes = st.floats(1e-3, 10), st.floats(0, 100)


@given(heights, heights, slopes, slopes, st.floats(1e-3, 1))
def test_a_dip_is_where_the_cubic_is_lowest(f0, f1, fall, rise, h):
    assume(fall > 1e-3)
    lowest = CubicHermiteSpline([0, h], [f0, f1], [-fall, rise])(np.linspace(0, h, 4001)).min()
    bound = 0.25 * min(f0, f1)
    assume(abs(lowest - bound) > 1e-4 * max(f0, f1, h * fall, h * rise))
    assert dips(f0, f1, -fall, rise, h) == (lowest < bound)
