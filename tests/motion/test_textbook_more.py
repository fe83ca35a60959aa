"""Textbook motions of many impacts against oracles of their own: a cradle and a billiard."""

import math

import numpy as np
import pytest

from polycorner.models import textbook as scenes
from polycorner.motion.events import EventKind
from polycorner.motion.simulation import simulate

RADIUS = 0.5  # of the disc on the table
AREA = 4 - math.pi * RADIUS**2
PERIMETER = 8 + 2 * math.pi * RADIUS


def passed_through(x, v, t):
    """Places and velocities of equal elastic balls of diameter 1, in a row.

    Two that meet exchange their velocities.  Less their diameters, they are points that pass
    through each other, told apart by their order alone.
    """
    number = np.arange(len(x))
    free = x - number + v * t
    order = np.argsort(free)
    return free[order] + number, v[order]


def cradle(x, v, t_end):
    row = scenes.newtons_cradle(len(x))
    path = simulate(row, row.state(x[:, None], v[:, None]), t_end, 1e-2)
    assert path.converged
    return path


@pytest.mark.parametrize("balls", [2, 3, 5, 8])
def test_as_many_balls_leave_a_cradle_as_come_in(balls):
    for coming in range(1, balls):
        x, v = np.arange(balls) * (1 + 1e-3), np.zeros(balls)
        x[:coming] -= 0.5
        v[:coming] = 1.0
        path = cradle(x, v, 1.0)
        places, speeds = passed_through(x, v, 1.0)
        assert speeds.tolist() == [0.0] * (balls - coming) + [1.0] * coming
        np.testing.assert_allclose(path.v[-1, :, 0], speeds, atol=1e-9)
        np.testing.assert_allclose(path.q[-1, :, 0], places, atol=1e-6)
        assert len(path.of_kind(EventKind.IMPACT)) == coming * (balls - coming)


@pytest.mark.parametrize("seed", range(6))
def test_elastic_balls_in_a_row_exchange_their_velocities(seed):
    random = np.random.default_rng(seed)
    balls = int(random.integers(2, 9))
    x = np.cumsum(1 + random.uniform(0.01, 1, balls))
    v = random.normal(size=balls)
    path = cradle(x, v, 3.0)
    places, speeds = passed_through(x, v, 3.0)
    np.testing.assert_allclose(path.v[-1, :, 0], speeds, atol=1e-9)
    np.testing.assert_allclose(path.q[-1, :, 0], places, atol=1e-6)
    np.testing.assert_allclose(path.v.sum(axis=1), v.sum(), atol=1e-12)
    np.testing.assert_allclose(path.kinetic, v @ v / 2, rtol=1e-12)


def next_impact(q, v):
    """When and where a point of unit speed meets the table next, and its velocity afterwards."""
    with np.errstate(divide="ignore"):
        walls = np.where(v == 0, np.inf, (np.sign(v) - q) / v)
    axis = int(np.argmin(walls))
    at, ahead = walls[axis], q @ v
    square = ahead**2 - (q @ q - RADIUS**2)
    if ahead < 0 and square > 0 and -ahead - math.sqrt(square) < at:
        at = -ahead - math.sqrt(square)
        place = q + at * v
        return at, place, v - 2 * (v @ place) * place / RADIUS**2
    turned = v.copy()
    turned[axis] *= -1
    return at, q + at * v, turned


def launched(t_end, dt, every):
    table = scenes.dispersing_billiard(RADIUS)
    state = table.state([0.7, 0.13], [math.cos(0.7), math.sin(0.7)])
    return state, simulate(table, state, t_end, dt, every=every)


def test_a_billiard_bounces_where_rays_meet_the_table():
    state, path = launched(6.0, 0.1, 1)
    impacts = path.of_kind(EventKind.IMPACT)
    q, v, t = state.q, state.v, 0.0
    for event in impacts:
        at, q, v = next_impact(q, v)
        t += at
        assert event.time == pytest.approx(t, abs=1e-6)
        assert (event.contact == "disc") == (abs(np.hypot(*q) - RADIUS) < 1e-9)
    assert len(impacts) > 4


def assert_mean(values, expected, batches=40, errors=4.5):
    """The mean is the expected one within some standard errors, from means of batches."""
    means = np.array([batch.mean() for batch in np.array_split(values, batches)])
    error = means.std(ddof=1) / math.sqrt(batches)
    assert abs(np.mean(values) - expected) < errors * error


@pytest.mark.parametrize("bounces", [2000, 100_000])
def test_a_billiard_keeps_its_energy_and_fills_its_table(bounces):
    free = math.pi * AREA / PERIMETER
    _, path = launched(1.2 * bounces * free, 0.1, 7)
    assert path.converged
    impacts = path.of_kind(EventKind.IMPACT)
    assert len(impacts) >= bounces
    np.testing.assert_allclose(path.kinetic, 0.5, rtol=1e-9)

    assert_mean(np.diff([event.time for event in impacts]), free)
    on_disc = np.array([event.contact == "disc" for event in impacts], dtype=float)
    assert_mean(on_disc, 2 * math.pi * RADIUS / PERIMETER)
    cosines = np.array([event.impulse / 2 for event in impacts])
    assert_mean(cosines, math.pi / 4)
    assert_mean(cosines**2, 2 / 3)
    x, y = path.q[:, 0].T
    for place, mean in ((x, 0), (y, 0), (x * y, 0)):
        assert_mean(place, mean)
    assert_mean(x**2 + y**2, (8 / 3 - math.pi * RADIUS**4 / 2) / AREA)
