"""Rigid dumbbells that lie in a bunch: carried by the drum, climbed on each other, in dyads."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellDrum, Shaking
from polycorner.dumbbells.drum import GRAVITY
from polycorner.dumbbells.dynamics.bunch import (
    BunchInSpaceRun,
    drum_for_bunch,
    follow_in_space,
    kicks_of_centres,
    scattered,
)
from polycorner.dumbbells.dynamics.starts import nested_pair

DRUM = drum_for_bunch(DumbbellDrum(), count=8, top=100.0)
SHAKING = Shaking((0.0, 600.0, 0.0), (5.0, 100.0))


@pytest.fixture(scope="module")
def run() -> BunchInSpaceRun:
    """Eight dumbbells that slide together on the bottom."""
    return follow_in_space(DRUM, 1.0, start=3, dt=1e-3, interval=0.02)


def test_a_bunch_at_rest_turns_with_the_drum(run):
    """In axes that turn with the drum nothing moves; seen from axes at rest, azimuths grow."""
    path = run.trajectory
    assert path.effort.unconverged == 0
    assert path.solver.tolerance == 1e-4
    at_rest = np.flatnonzero(path.rests[-1])
    assert len(at_rest) >= 4
    assert not path.v[-1, at_rest].any()
    places, turned = path.q[-1, at_rest], DRUM.spin * run.times[-1]
    carried = run.rigid.placements(places) + np.array([turned, 0.0, 0.0])
    assert run.q[-1, at_rest] == pytest.approx(carried, abs=1e-9)


def test_a_start_is_that_of_the_developed_drum(run):
    assert run.q[0] == pytest.approx(scattered(DRUM, np.random.default_rng(3)))
    assert run.climbed[0] == 0


def placed(run, q, lift=0.0):
    """A run in which dumbbells stay at ``phi, eta, theta``, the first one lifted off the drum."""
    places = run.rigid.state(q).q.copy()
    places[0, [0, 2]] *= 1 - lift / np.hypot(*places[0, [0, 2]])
    still = np.broadcast_to(places, run.trajectory.q.shape).copy()
    return BunchInSpaceRun(replace(run.trajectory, q=still), run.rigid)


def two_pairs():
    """A right- and a left-handed nested pair, and four dumbbells far from them."""
    pairs = [
        np.reshape(nested_pair(DRUM, h, heading=a), (2, 3)) for h, a in (("R", 0.1), ("L", -0.1))
    ]
    pairs = [np.add(pair, [0.0, eta, 0.0]) for pair, eta in zip(pairs, (30.0, 80.0), strict=True)]
    single = [[phi, 55.0, 0.0] for phi in (-1.2, -0.8, 0.8, 1.2)]
    return np.concatenate([*pairs, single])


def test_dyads_are_those_of_the_developed_drum_if_they_lie_on_it(run):
    q = two_pairs()
    assert placed(run, q).dyads(0) == [(0, 1, 1), (2, 3, -1)]
    assert placed(run, q, lift=2.0).dyads(0) == [(0, 1, 1), (2, 3, -1)]
    climbed = placed(run, q, lift=4.0)
    assert climbed.dyads(0) == [(2, 3, -1)]
    assert (climbed.climbed == 1).all()
    assert climbed.lifts[0, 0] == pytest.approx(4.0, abs=0.1)


def test_the_energy_of_the_weight_is_that_of_the_heights_of_balls(run):
    """As on the developed drum: ``-cos(tilt) cos(phi) rho + sin(tilt) eta`` of two balls each."""
    phi, eta, theta = np.moveaxis(run.q[..., :3], -1, 0)
    across = DRUM.length / 2 * np.sin(theta)
    deep = np.sqrt(DRUM.centre_radius**2 - across**2)  # of the middle, for dumbbells that lie
    height = math.sin(DRUM.tilt) * eta - math.cos(DRUM.tilt) * np.cos(phi) * deep
    expected = 2 * DRUM.ball_mass * GRAVITY * height.sum(axis=1)
    assert run.weight_energy == pytest.approx(expected, rel=1e-4)


def test_kicks_of_centres_are_those_of_a_mass():
    """An impulse ``sigma sqrt(t)`` gives the mass of a dumbbell a velocity ``strength sqrt(t)``."""
    mass = 2 * DRUM.ball_mass
    assert kicks_of_centres(DRUM, 30.0) == pytest.approx(
        dict.fromkeys(["xD", "yD", "zD"], 30.0 * mass)
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: follow_in_space(DumbbellDrum(count=8), 1.0), "drum: expected one with a bottom"),
        (lambda: follow_in_space(3, 1.0), "drum: expected a DumbbellDrum; got int"),
        (lambda: follow_in_space(DRUM, 1.0, dt=0.0), "dt: expected a number > 0; got 0"),
        (lambda: follow_in_space(DRUM, 1.0, interval=-1.0), "interval: expected a number > 0"),
        (
            lambda: follow_in_space(replace(DRUM, shaking=SHAKING), 1.0),
            "dt: expected a number <= 0.001 in s; got 0.002",
        ),
        (lambda: kicks_of_centres(DRUM, -1.0), "strength"),
    ],
)
def test_what_is_no_bunch_is_refused(call, message):
    with pytest.raises((TypeError, ValueError), match=message):
        call()
