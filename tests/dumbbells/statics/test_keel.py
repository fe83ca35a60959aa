"""Regions of rest against the paper's two cases, a search for forces, and counted steps."""

import math
from itertools import product

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells.statics.keel import (
    Keel,
    RestRegion,
    exact_eastern_boundary,
    force_ratio,
    rest_margin,
    rests,
    s_curve,
)
from polycorner.formulas.kernels import address

TILT = math.radians(7)
KEEL = Keel(TILT, 0.1, 0.3, 0.05, 0.2)
PHI, THETA = np.meshgrid(np.linspace(-1.5, 1.5, 301), np.linspace(-math.pi, math.pi, 241))
azimuths = st.floats(-1.5, 1.5)
headings = st.floats(-math.pi, math.pi)


@st.composite
def regions(draw):
    """Return regions, most of which are not empty."""
    sliding = draw(st.floats(0.02, 1.5))
    tilt = math.atan(sliding * draw(st.floats(-1.1, 1.1)))
    return RestRegion(tilt, sliding * draw(st.floats(0.02, 1.0)), sliding)


# -------------------------------------------------------------------------------- the paper's cases


def two_cases(phi, theta, region, *, divided=True, absolute=True):
    """The two cases of the paper's definition, with or without what was left out in print."""
    ratio = force_ratio(phi, theta, region.tilt)
    size = np.hypot(ratio[..., 0], ratio[..., 1])
    force = size * math.cos(region.tilt) * np.cos(phi)
    cosine = ratio[..., 0] / size * (1 if divided else force)
    cosine = abs(cosine) if absolute else cosine
    beyond = np.arccos(np.clip(cosine, -1, 1)) > math.pi / 2 - math.asin(
        region.rolling / region.sliding
    )
    with np.errstate(divide="ignore"):
        return np.where(beyond, size < region.sliding, size < region.rolling / abs(cosine))


@pytest.mark.parametrize("region", [KEEL.onset, KEEL.arrest, RestRegion(0.4, 0.2, 1.1)])
def test_the_two_cases_are_the_sides_of_one_convex_set(region):
    clear = abs(region.margin(PHI, THETA)) > 1e-9
    found = region.contains(PHI, THETA)
    assert (found == two_cases(PHI, THETA, region))[clear].all()
    assert 0 < found.mean() < 1


def test_as_printed_no_dumbbell_would_roll_before_it_slides():
    """Without the divisor the first case never occurs, and the disc alone is left."""
    region = KEEL.onset
    printed = two_cases(PHI, THETA, region, divided=False, absolute=False)
    assert (printed == (abs(PHI) < region.limit)).all()
    assert printed.mean() > 2 * region.contains(PHI, THETA).mean()


def test_without_the_absolute_value_the_symmetry_is_lost():
    signed = two_cases(PHI, THETA, KEEL.onset, absolute=False)
    image = two_cases(-PHI, -THETA, KEEL.onset, absolute=False)
    assert (signed != image).any()
    assert not (KEEL.onset.contains(PHI, THETA) & ~signed).any()


def test_the_static_coefficient_of_the_text_and_of_the_figure_are_not_the_same():
    """``mu_r = 0.1`` with 20 degrees is ``mu_s = 0.3``; with the caption's 8 degrees it is 0.72."""
    text, caption = (0.1 / math.sin(math.radians(angle)) for angle in (20, 8))
    assert text == pytest.approx(0.3, abs=0.01)
    assert caption == pytest.approx(0.7185, abs=1e-4)
    limits = [math.degrees(RestRegion(TILT, 0.1, mu).limit) for mu in (text, caption)]
    assert limits == pytest.approx([14.8, 35.1], abs=0.05)


# ------------------------------------------------------------------------------------------ regions


@given(regions(), azimuths, headings)
def test_the_region_has_the_symmetries_of_the_drum(region, phi, theta):
    margin = region.margin(phi, theta)
    assert region.margin(-phi, -theta) == pytest.approx(margin, rel=1e-9, abs=1e-9)
    assert region.margin(phi, theta + math.pi) == pytest.approx(margin, rel=1e-9, abs=1e-9)


@given(regions(), azimuths, headings)
def test_azimuths_of_rest_are_an_interval(region, phi, theta):
    west, east = region.azimuths(theta)
    margin = region.margin(phi, theta)
    assume(abs(margin) > 1e-9)
    assert (margin > 0) == (west <= phi <= east)


@given(regions(), headings)
def test_at_both_ends_of_the_interval_the_force_is_on_the_boundary(region, theta):
    west, east = region.azimuths(theta)
    assume(math.isfinite(west))
    assert region.margin([west, east], theta) == pytest.approx([0, 0], abs=1e-7)
    assert region.azimuths(-theta) == pytest.approx((-east, -west), abs=1e-7)


def test_where_a_dumbbell_rolls_on_down_the_axis():
    """Nearly across, it is held at the eastern end against rolling east, not back."""
    region, theta = RestRegion(math.atan(0.35), 0.3, 1.0), math.radians(80.1)
    west, east = region.azimuths(theta)
    assert force_ratio([west, east], theta, region.tilt)[:, 0] == pytest.approx([-0.3, -0.3])
    assert 0 < west < east < region.limit
    assert not region.rolls_back(theta)
    assert region.contains((west + east) / 2, theta)


def test_nothing_rests_on_a_slope_that_is_too_steep():
    region = RestRegion(0.5, 0.1, 0.5)
    assert math.isnan(region.limit)
    assert not region.contains(PHI, THETA).any()
    assert np.isnan(region.azimuths([0.0, 1.0])).all()


def test_nothing_rests_on_the_upper_half_of_the_drum():
    assert KEEL.onset.contains(0.0, 0.0)
    assert not KEEL.onset.contains([math.pi, math.pi - 0.01, 1.6], 0.0).any()


def test_the_curve_runs_through_the_region_up_to_its_limit():
    region = KEEL.onset
    phi = np.linspace(-1, 1, 101) * region.limit * (1 - 1e-9)
    assert region.contains(phi, s_curve(phi, TILT)).all()
    assert not region.contains(1.0001 * region.limit, s_curve(region.limit, TILT))


def test_what_stops_also_stays():
    """``B`` lies in the interior of ``A``."""
    assert KEEL.is_ordered
    inner = KEEL.arrest.contains(PHI, THETA)
    assert inner.any()
    assert KEEL.onset.margin(PHI, THETA)[inner].min() > 0.04
    assert not Keel(math.radians(2), 0.1, 0.3, 0.05, 0.2).is_ordered


# ----------------------------------------------------------------------------------- turning points


def test_a_carried_dumbbell_leaves_at_the_upper_azimuth():
    """Counted in steps of the drum, from the middle of the interval."""
    step = 1e-5
    for degrees in (-30, -5, 0, 12, 35, 60):
        theta = math.radians(degrees)
        phi = float(np.mean(KEEL.onset.azimuths(theta)))
        while KEEL.onset.contains(phi, theta):
            phi += step
        assert KEEL.turning(theta).upper == pytest.approx(phi, abs=1.01 * step)


def test_turning_points_are_where_the_pull_is_the_resistance():
    theta = np.radians(np.arange(-40, 41, 5))
    turning = KEEL.turning(theta)
    assert turning.rolls.all()
    assert force_ratio(turning.upper, theta, TILT)[:, 0] == pytest.approx(0.1, abs=1e-12)
    assert force_ratio(turning.lower, theta, TILT)[:, 0] == pytest.approx(0.05, abs=1e-12)
    assert (turning.coasting < turning.lower).all()
    assert (turning.lower < turning.upper).all()
    assert turning.climb == pytest.approx(np.tan(theta) * (turning.upper - turning.lower))


@given(st.floats(-40, 40))
def test_coasting_uses_up_what_was_gained(degrees):
    """Work of force less resistance along the way, load times arc, by Gauss's rule."""
    theta = math.radians(degrees)
    turning = KEEL.turning(theta)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = (turning.upper - turning.coasting) / 2
    phi = turning.coasting + half * (1 + nodes)
    pull = (force_ratio(phi, theta, TILT)[:, 0] - KEEL.rolling_dynamic) * np.cos(phi)
    assert half * (weights @ pull) == pytest.approx(0, abs=1e-12)
    assert pull[0] < 0 < pull[-1]


def test_a_rolling_dumbbell_stops_where_it_enters_the_inner_region():
    """As long as that is bounded by rolling there; with larger headings it stops before."""
    theta = np.radians(np.arange(-40, 41, 1))
    turning, entered = KEEL.turning(theta), KEEL.arrest.eastern_boundary(theta)
    by_rolling = KEEL.arrest.rolls_back(theta)
    assert by_rolling[:70].all()
    assert not by_rolling[-1]
    assert (turning.lower == entered)[by_rolling].all()
    assert (turning.lower > entered)[~by_rolling].all()


def test_the_axis_turned_round_is_the_same_dumbbell():
    first, second = KEEL.turning(math.radians(15)), KEEL.turning(math.radians(195))
    for name in ("upper", "lower", "coasting", "climb"):
        assert getattr(first, name) == pytest.approx(getattr(second, name), abs=1e-12)


def test_beyond_some_heading_a_carried_dumbbell_no_longer_rolls_back():
    """It slides at the limit of the disc, or is at rest nowhere."""
    slides, nowhere = KEEL.turning(math.radians(60)), KEEL.turning(math.pi / 2)
    assert slides.upper == pytest.approx(KEEL.onset.limit)
    assert not slides.rolls
    assert math.isnan(slides.lower)
    assert math.isnan(nowhere.upper)


def test_without_tilt_all_headings_but_the_steepest_turn_alike():
    """``tan(phi) cos(theta) = mu_r`` gives back the angle of friction at heading zero."""
    keel = Keel(0.0, 0.1, 0.3, 0.05, 0.2)
    theta = np.radians([0.0, 20.0, 40.0])
    turning = keel.turning(theta)
    assert np.tan(turning.upper) == pytest.approx(0.1 / np.cos(theta))
    assert np.tan(turning.lower) == pytest.approx(0.05 / np.cos(theta))


# ---------------------------------------------------------------------------------- finite length


def held(phi, theta, region, kappa, r=0.3):
    """Return by how much forces can hold the dumbbell, over its weight: searched for, not solved.

    Forces of the four slips and of the spin balance the weight; they do so on a line, along which
    the worst excess over what friction allows is convex.
    """
    sizes = np.array([2 * kappa, 1.0, 1.0, math.tan(region.tilt)])
    slopes = drum_formulas.weight().kernel.at(np.array([phi, 0.0, theta]), address(sizes), 1)[1]
    numbers = np.array([2 * kappa, r, 1.0, 0.0, 1.0])
    q = np.array([phi, theta, 0.0, 0.0, 0.0, 0.0])
    values, gradients = drum_formulas.grip().kernel.at(q, address(numbers), 1)
    balance = gradients[:5, 2:].T
    particular = np.linalg.lstsq(balance, np.append(slopes[0], 0.0))[0]
    line = np.linalg.svd(balance)[2][-1]
    first, second, total = values[5:]

    def excess(t):
        force = particular + t * line
        return max(
            math.hypot(*force[0:2]) - region.sliding * first,
            math.hypot(*force[2:4]) - region.sliding * second,
            abs(force[4]) - region.rolling * total,
        )

    low, high = -20.0, 20.0
    for _ in range(150):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        low, high = (low, b) if excess(a) < excess(b) else (a, high)
    return -excess((low + high) / 2)


@given(regions(), st.floats(-1, 1), st.floats(-1.2, 1.2), headings, st.floats(0.01, 0.35))
def test_rest_is_what_a_search_for_forces_finds(region, share, wide, theta, kappa):
    west, east = region.azimuths(theta)
    phi = (west + east) / 2 + share * (east - west) if math.isfinite(west) else wide
    phi = float(np.clip(phi, -1.15, 1.15))
    slack = held(phi, theta, region, kappa)
    assume(abs(slack) > 1e-6)
    assert rests(phi, theta, region, kappa) == (slack > 0)


@pytest.mark.parametrize(
    "region", [KEEL.onset, RestRegion(0.0, 0.3, 0.3), RestRegion(0.1, 0.25, 0.3)]
)
@pytest.mark.parametrize("kappa", [0.1, 0.3])
def test_on_the_boundary_the_search_finds_forces_with_nothing_to_spare(region, kappa):
    theta = np.radians([-50, -20, 5, 20, 35, 55, 70])
    boundary = exact_eastern_boundary(theta, region, kappa)
    assert np.isfinite(boundary).sum() >= 6
    for phi, heading in zip(boundary, theta, strict=True):
        if math.isfinite(phi):
            assert held(phi, heading, region, kappa) == pytest.approx(0, abs=1e-9)
            assert held(phi + 1e-6, heading, region, kappa) < -1e-8


def test_the_search_finds_both_answers():
    found = [
        held(phi, theta, KEEL.onset, 0.2) > 0
        for phi, theta in product(np.linspace(-0.3, 0.3, 9), np.linspace(-1.2, 1.2, 9))
    ]
    assert 10 < sum(found) < 60


@given(regions(), azimuths, headings)
def test_a_dumbbell_without_length_is_the_papers(region, phi, theta):
    margin = region.margin(phi, theta)
    assume(abs(margin) > 1e-9)
    assert rests(phi, theta, region, 0.0) == (margin > 0)


@pytest.mark.parametrize("sliding", [0.3, 0.7185])
def test_the_boundary_moves_with_the_square_of_the_length(sliding):
    """On the strip's side (small headings) and on the disc's (large ones)."""
    region = RestRegion(TILT, 0.1, sliding)
    theta = np.radians([-40, -15, 10, 25, 40, 50, 60, 75, 80])
    short = region.eastern_boundary(theta)
    steps = 8 / 122 * 2.0 ** -np.arange(6)
    moved = [abs(exact_eastern_boundary(theta, region, kappa) - short) for kappa in steps]
    for errors in np.transpose(moved):
        assert errors[0] < math.radians(0.15)
        assert oracles.observed_order(errors, steps, 1e-13) == pytest.approx(2, abs=0.02)


def test_at_heading_zero_length_does_not_matter():
    for kappa in (0.01, 0.1, 0.5):
        east = exact_eastern_boundary(0.0, KEEL.onset, kappa)
        assert east == pytest.approx(math.atan(0.1), abs=1e-12)


def test_a_ball_that_would_leave_the_drum_does_not_rest():
    assert math.isnan(rest_margin(1.4, math.pi / 2, KEEL.onset, 0.5))
    assert not rests(1.4, math.pi / 2, KEEL.onset, 0.5)
