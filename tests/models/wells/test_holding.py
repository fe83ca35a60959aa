"""Ensembles in U, half-U and half-V wells: laws of equilibrium, escape and capture.

Statistical bounds are four standard errors, with fixed seeds.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import ks_2samp, kstest

from polycorner import Entrapment
from polycorner.models.wells.escape import mean_escape_time
from polycorner.models.wells.holding import (
    Escapes,
    compare,
    escapes,
    kick_of,
    ladder,
    rests,
    stays,
)
from polycorner.models.wells.wells import KINDS, Well
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate, start

U, HALF_U, HALF_V = KINDS
HALF = (HALF_U, HALF_V)


def copies(well, places, *, dt, noise=None):
    """An engine of independent copies of a mass."""
    many = replace(well.system, count=len(places))
    return start(many, many.state(places), dt, noise=noise)


# ------------------------------------------------------------------------------------------- copies


def test_the_first_of_many_moves_as_if_alone():
    well = Well.of_depth(HALF_V, 3.0, drag=1.0, friction=0.1, restitution=0.4)
    noise = Noise(kicks={"x": 1.0}, seed=7)
    engine = copies(well, np.full((5, 1), 0.2), dt=0.01, noise=noise)
    path = simulate(well.system, well.system.state([0.2]), 3.0, 0.01, every=1, noise=noise)
    for step in range(1, 301):
        engine.advance(1)
        assert engine.motion.q[0, 0] == path.q[step, 0, 0]
        assert engine.motion.v[0, 0] == path.v[step, 0, 0]


def test_copies_are_shaken_independently():
    """Free flights before drag matters: speeds are normal with ``<v^2> = (kick/m)^2 t``."""
    well = Well.of_depth(U, 1.0, 1e6, mass=2.0)
    kick = Noise(kicks={"x": 3.0}, seed=1)
    engine = copies(well, np.zeros((1000, 1)), dt=0.01, noise=kick)
    engine.advance(100)
    speeds = engine.motion.v[:, 0] / 1.5
    assert kstest(speeds, "norm").pvalue > 1e-3
    assert np.corrcoef(speeds[:-1], speeds[1:])[0, 1] == pytest.approx(0, abs=4 / math.sqrt(1000))


def test_copies_are_checked():
    well = Well.of_depth(HALF_V, 3.0)
    with pytest.raises(ValueError, match="contact 'wall' of body 1 overlaps by"):
        copies(well, [[0.1], [-0.1]], dt=0.01)
    with pytest.raises(ValueError, match="kicks: expected names among x; got"):
        copies(well, [[0.1]], dt=0.01, noise=Noise(kicks={"y": 1.0}))
    with pytest.raises(ValueError, match=r"dt: expected a number >= .* in s; got 0\.0"):
        copies(well, [[0.1]], dt=0.0)


# -------------------------------------------------------------------------------------- equilibrium


@pytest.fixture(scope="module")
def warm():
    """Return places of 500 copies of each kind at temperature 1 with elastic walls."""
    found = {}
    for kind in KINDS:
        well = Well.of_depth(kind, 20.0, 4.0, drag=2.0, restitution=1.0)
        noise = Noise(kicks={"x": kick_of(well, 1.0)}, seed=5)
        engine = copies(well, np.full((500, 1), 0.1), dt=0.01, noise=noise)
        engine.advance(800)
        found[kind] = well, engine.motion.q[:, 0].copy(), engine.motion.v[:, 0].copy()
    return found


@pytest.mark.slow
def test_equilibrium_is_exponential_half_gaussian_and_gaussian(warm):
    for kind, law in ((U, "norm"), (HALF_U, "halfnorm"), (HALF_V, "expon")):
        well, places, speeds = warm[kind]
        scale = 1 / well.slope if kind is HALF_V else 1 / math.sqrt(well.stiffness)
        assert kstest(places / scale, law).pvalue > 1e-3
        assert kstest(speeds, "norm").pvalue > 1e-3
        square = 2 * scale**2 if kind is HALF_V else scale**2
        error = np.std(places**2) / math.sqrt(len(places))
        assert np.mean(places**2) == pytest.approx(square, abs=4 * error)


@pytest.mark.slow
@pytest.mark.parametrize("kind", HALF)
def test_absorbing_walls_cool(kind):
    """Nearer to the wall, and slower, than the temperature of noise and drag says."""
    well = Well.of_depth(kind, 20.0, 4.0, drag=0.5)
    noise = Noise(kicks={"x": kick_of(well, 1.0)}, seed=5)
    engine = copies(well, np.full((400, 1), 0.1), dt=0.01, noise=noise)
    engine.advance(1200)
    warm = 2 / well.slope**2 if kind is HALF_V else 1 / well.stiffness
    for values, expected in ((engine.motion.q, warm), (engine.motion.v, 1.0)):
        squares = values[:, 0] ** 2
        assert expected - squares.mean() > 4 * squares.std() / math.sqrt(400)


# ------------------------------------------------------------------------------------------- escape


def agrees(run, exact, slack):
    """Whether a measured mean is within four standard errors, and what the methods neglect."""
    return abs(run.mean - exact) <= 4 * run.error + slack * exact


@pytest.mark.parametrize("kind", KINDS)
def test_measured_times_are_those_of_the_backward_equation(kind):
    """With strong noise, which takes few steps."""
    well = Well.of_depth(kind, 1.0, drag=1.0, restitution=0.5 if kind is HALF_U else 0.0)
    kick = kick_of(well, 1.0)
    exact = mean_escape_time(well, kick, cells=40)
    run = escapes(well, kick, count=300, duration=15 * exact, seed=3)
    assert run.escaped.all()
    assert agrees(run, exact, 0.03)
    assert run.error < 0.08 * exact


@pytest.mark.slow
@pytest.mark.parametrize("drag", [0.8, 3.0])
@pytest.mark.parametrize("kind", KINDS)
def test_measured_times_in_deeper_wells(kind, drag):
    well = Well.of_depth(kind, 2.0, drag=drag)
    kick = kick_of(well, 1.0)
    exact = mean_escape_time(well, kick)
    assert agrees(escapes(well, kick, count=300, duration=12 * exact, seed=11), exact, 0.03)


@pytest.mark.slow
def test_friction_is_in_the_backward_equation_too():
    well = Well.of_depth(HALF_U, 1.0, drag=0.5, friction=0.3)
    exact = mean_escape_time(well, 1.0)
    assert agrees(escapes(well, 1.0, count=300, duration=12 * exact, seed=2), exact, 0.03)


def test_an_elastic_half_u_well_lets_go_like_the_folded_u_well():
    """The whole distribution, from different seeds."""
    runs = []
    for seed, kind in enumerate((U, HALF_U)):
        well = Well.of_depth(kind, 1.0, drag=0.5, restitution=1.0)
        runs.append(escapes(well, 1.0, count=300, duration=200.0, seed=seed).times)
    assert ks_2samp(*runs).pvalue > 1e-3


@pytest.mark.slow
def test_with_little_drag_and_absorbing_walls_each_is_stronger_than_its_predecessor():
    runs = [
        escapes(well, kick_of(well, 1.0), count=300, duration=400.0, seed=1)
        for well in ladder(2.0, drag=0.8)
    ]
    for weaker, stronger in pairwise(runs):
        error = math.hypot(weaker.error, stronger.error)
        assert stronger.mean - weaker.mean > 3 * error
    assert runs[2].mean / runs[0].mean > 3


@pytest.mark.slow
def test_with_elastic_walls_half_v_is_the_weakest():
    first, second, third = (
        escapes(well, kick_of(well, 1.0), count=400, duration=400.0, seed=1)
        for well in ladder(2.0, drag=0.8, restitution=1.0)
    )
    assert abs(first.mean - second.mean) < 4 * math.hypot(first.error, second.error)
    assert second.mean - third.mean > 2 * math.hypot(third.error, second.error)
    assert third.mean < first.mean


def test_runs_are_reproducible_and_end_at_the_rim():
    well = Well.of_depth(HALF_V, 1.0, drag=1.0)
    runs = [escapes(well, 1.4, count=40, duration=6.0, seed=seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0].times, runs[1].times)
    assert not np.array_equal(runs[0].times, runs[2].times)
    assert 0 < runs[0].escaped.sum() < 40
    assert np.nanmax(runs[0].times) <= 6.0


# --------------------------------------------------------------------------------------- statistics


@pytest.mark.parametrize("watched", [0.5, 50.0])
def test_intervals_hold_the_mean_as_often_as_they_say(watched):
    """Exponential times, seen to the end or for half a mean."""
    rng, well, hits = np.random.default_rng(0), Well(1.0, 0.0), 0
    for _ in range(1000):
        times = rng.exponential(1.0, 200)
        run = Escapes(well, 1.0, np.where(times < watched, times, math.nan), watched)
        low, high = run.interval()
        hits += low < 1.0 < high
    assert hits / 1000 == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 1000))


def test_where_nothing_escapes_there_is_a_lower_limit():
    run = Escapes(Well(1.0, 0.0), 1.0, np.full(30, math.nan), 10.0)
    assert math.isinf(run.mean)
    assert run.interval() == (100.0, math.inf)
    assert math.exp(-30 * 10.0 / 100.0) == pytest.approx(0.05, abs=1e-3)


# ------------------------------------------------------------------------------------------ capture


@pytest.mark.parametrize("kind", KINDS)
def test_what_comes_in_slower_than_the_capture_speed_stays(kind):
    well = Well.of_depth(kind, 1.0, friction=0.1, restitution=0.6)
    limit = well.capture_speed()
    speeds = limit * np.array([0.5, 0.95, 0.99, 1.01, 1.05, 1.5])
    kept = stays(well, speeds.tolist(), duration=20.0, dt=0.002)
    assert kept.tolist() == [True] * 3 + [False] * 3


@pytest.mark.parametrize("kind", KINDS)
def test_masses_come_to_rest_where_and_when_the_closed_form_says(kind):
    well = Well.of_depth(kind, 1.0, friction=0.15, restitution=0.5)
    speed = math.sqrt(2 * 0.8 * (well.depth - well.friction))
    time, place = well.capture(speed)
    for share, moving in ((0.97, True), (1.02, False)):
        ends, left = rests(well, [0.0], [speed], duration=share * time, dt=0.001)
        assert (left[0] != 0) == moving
    assert abs(ends[0]) == pytest.approx(place, abs=2e-3)


def test_friction_leaves_u_and_half_u_beside_the_bottom_but_not_half_v():
    for well in ladder(1.0, friction=0.1, restitution=0.5):
        starts = well.starts(np.random.default_rng(2), 60)[:, 0]
        places, left = rests(well, starts, np.zeros(60), duration=60.0, dt=0.01)
        assert not left.any()
        if well.kind is HALF_V:
            assert abs(places).max() < 1e-9
        else:
            reach = well.friction / well.stiffness
            assert abs(places).max() <= reach + 1e-3
            assert (abs(places) > 0.1 * reach).mean() > 0.6


# --------------------------------------------------------------------------------------- comparison


@pytest.mark.slow
def test_a_comparison_says_where_the_paper_is_right():
    found = compare(1.5, drags=(1.0,), restitutions=(1.0,), count=60, cells=20)
    least, most = found.over_drag[:, 0], found.over_drag[:, -1]
    assert least[0] < least[1] < least[2]
    assert most[2] < most[1]
    absorbing, elastic = found.over_restitution[:, 0], found.over_restitution[:, -1]
    assert absorbing[0] < absorbing[1] < absorbing[2]
    assert elastic[2] < elastic[1] == pytest.approx(elastic[0], rel=0.03)
    assert [run.well.kind for run in found.runs] == [*KINDS, *HALF]
    for run in found.runs:
        exact = mean_escape_time(run.well, run.kick, cells=40)
        assert agrees(run, exact, 0.05)


def test_a_ladder_shares_everything_but_its_kind():
    wells = ladder(2.0, 3.0, mass=0.5, drag=0.1, friction=0.2, restitution=0.3)
    assert [well.kind for well in wells] == [U, HALF_U, HALF_V]
    assert {(w.depth, w.rim, w.mass, w.drag, w.friction, w.restitution) for w in wells} == {
        (2.0, 3.0, 0.5, 0.1, 0.2, 0.3)
    }
    assert all(isinstance(well.kind, Entrapment) for well in wells)
