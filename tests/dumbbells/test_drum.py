"""A dumbbell in the turning drum, against rest regions, rolling laws and its mirror images."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import minimise
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.statics.keel import Keel, exact_eastern_boundary
from polycorner.motion.events import EventKind
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate

DRUM = DumbbellDrum()
KEEL = Keel(DRUM.tilt, DRUM.rolling[0], DRUM.sliding[0], DRUM.rolling[1], DRUM.sliding[1])
SLENDERNESS = DRUM.length / (2 * DRUM.centre_radius)
STEP = DRUM.spin * 1e-3


def first_slip(drum, azimuth, heading, duration):
    path = simulate(drum, drum.state([[azimuth, 0.0, heading]]), duration, 1e-3, every=10)
    began = path.of_kind(EventKind.MOTION)
    assert began
    return path, began[0].time


def assert_motion_begins_on_the_boundary(theta):
    boundary = float(exact_eastern_boundary(theta, KEEL.onset, SLENDERNESS))
    start = boundary - math.radians(0.1)
    _, time = first_slip(DRUM, start, theta, 0.4)
    assert start + DRUM.spin * time == pytest.approx(boundary, abs=STEP)


@given(st.floats(-30, 30))
@settings(max_examples=6)
def test_motion_begins_on_the_eastern_boundary_of_the_region_of_rest(degrees):
    """The drum carries it there from a tenth of a degree before; the boundary is that of keel.py.

    Steps begin half-way between those at which forces are evaluated, hence within one step.
    """
    assert_motion_begins_on_the_boundary(math.radians(degrees))


@pytest.mark.parametrize("degrees", [50, 60, 70])
def test_motion_begins_on_the_boundary_where_it_slides_first(degrees):
    """At these headings the disc bounds the region, not the strip; length matters most there."""
    assert not KEEL.onset.rolls_back(math.radians(degrees))
    assert_motion_begins_on_the_boundary(math.radians(degrees))


@pytest.mark.parametrize("degrees", [-25, 10])
def test_while_carried_nothing_else_moves(degrees):
    path, time = first_slip(DRUM, 0.0, math.radians(degrees), 13.0)
    before = path.times <= time
    assert before.sum() > 100
    phi, eta, theta, psi = path.q[before, 0].T
    assert phi == pytest.approx(DRUM.spin * path.times[before], abs=1e-12)
    for still in (eta, theta, psi):
        assert (still == still[0]).all()
    lost = sum(values[before][-1] for values in path.dissipated.values())
    assert abs(lost) < 1e-9 * abs(path.potential).max()


@pytest.mark.parametrize("degrees", [-15, 5, 20])
def test_rolling_keeps_the_heading_and_goes_along_a_helix_of_the_drum(degrees):
    """Without axial slip ``eta' = -tan(theta) rho (phi' - omega)``, at rest and in rolling."""
    theta = math.radians(degrees)
    path = simulate(DRUM, DRUM.state([[0.0, 0.0, theta]]), 25.0, 1e-3)
    assert len(path.of_kind(EventKind.MOTION)) >= 2
    phi, eta, heading, _ = path.q[:, 0].T
    law = math.tan(theta) * DRUM.centre_radius * (DRUM.spin * path.times - phi)
    assert heading == pytest.approx(theta, abs=1e-8)
    assert eta == pytest.approx(law, abs=1e-5)
    assert abs(eta[-1]) > 1.0
    assert path.dissipated["sliding"][-1] < 1e-4 * path.dissipated["rolling"][-1]


@pytest.mark.parametrize("degrees", [-15, 0, 12])
def test_it_stops_where_its_energy_is_used_up(degrees):
    """The gain above the dynamic resistance is spent at the coasting azimuth of keel.py.

    That is of a short dumbbell; length changes it by a share of order ``SLENDERNESS^2``.
    """
    theta = math.radians(degrees)
    turning = KEEL.turning(theta)
    path = simulate(DRUM, DRUM.state([[turning.upper - 0.002, 0.0, theta]]), 1.5, 1e-3, every=1)
    moved = path.of_kind(EventKind.MOTION)[0].time
    stop = next(e.time for e in path.of_kind(EventKind.REST) if e.time > moved)
    lower = path.q[path.at(stop + 1e-9), 0, 0]
    width = turning.upper - turning.coasting
    assert lower == pytest.approx(turning.coasting, abs=SLENDERNESS**2 * width)
    assert stop - moved < 1.0


def test_a_raft_has_no_keel():
    """Where sliding is as easy as rolling it slides down, and neither rolls nor climbs."""
    boat = replace(DRUM, tilt=0.0)
    raft = replace(boat, sliding=(0.1, 0.1))
    climbs, spins = [], []
    for drum in (boat, raft):
        path = simulate(drum, drum.state([[0.08, 0.0, 0.2]]), 20.0, 1e-3)
        assert path.of_kind(EventKind.MOTION)
        phi, eta, _, psi = path.q[-1, 0]
        carried = drum.centre_radius * (drum.spin * 20.0 - (phi - 0.08))
        climbs.append(eta / (carried * math.tan(0.2)))
        spins.append(psi)
    assert climbs[0] == pytest.approx(1.0, abs=1e-6)
    assert spins[0] > 1.0
    assert abs(climbs[1]) < 0.05
    assert abs(spins[1]) < 1e-6


@pytest.mark.parametrize("noise", [Noise(), Noise(chatter=0.4, seed=3)])
def test_the_mirror_image_in_a_drum_that_turns_the_other_way(noise):
    """``phi, theta, psi, omega`` change sign: reflection in the vertical plane of the axis."""
    q = np.array([[0.05, 1.0, 0.2]])
    image = replace(DRUM, spin=-DRUM.spin)
    first = simulate(DRUM, DRUM.state(q), 12.0, 1e-3, noise=noise).q
    second = simulate(image, image.state(q * [-1, 1, -1]), 12.0, 1e-3, noise=noise).q
    assert first[-1, 0, 1] != first[0, 0, 1]
    assert second * [-1, 1, -1, -1] == pytest.approx(first, abs=1e-5)


@pytest.mark.parametrize("noise", [Noise(), Noise(chatter=0.4, seed=3)])
def test_in_a_level_drum_the_opposite_heading_climbs_as_far_down(noise):
    """``eta -> -eta``, ``theta -> pi - theta`` keeps the drum, its spin, and the ball's numbers."""
    level = replace(DRUM, tilt=0.0)
    first = simulate(level, level.state([[0.05, 0.0, 0.2]]), 12.0, 1e-3, noise=noise).q[:, 0]
    turned = level.state([[0.05, 0.0, math.pi - 0.2]])
    second = simulate(level, turned, 12.0, 1e-3, noise=noise).q[:, 0]
    assert abs(first[-1, 1]) > 0.1
    assert second[:, :2] == pytest.approx(first[:, :2] * [1, -1], abs=1e-5)
    assert math.pi - second[:, 2] == pytest.approx(first[:, 2], abs=1e-6)


def test_energy_is_accounted_for_better_with_shorter_steps():
    """What is left is the scheme's own error: at least of first order in the step."""
    errors = []
    for dt in (1e-3, 2.5e-4):
        path = simulate(DRUM, DRUM.state([[0.1, 0.0, 0.2]]), 12.0, dt)
        assert path.converged
        assert path.work["substrate"][-1] > 0
        errors.append(path.audit)
    assert 0 < errors[1] < errors[0] / 4 < 1e-3


def test_a_nested_pair_touches_at_the_first_instant():
    drum = DumbbellDrum(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125, count=2)
    pair = drum.pair
    nested = minimise(pair.polyhedron, pair.energy, pair.nested("R", clearance=0.1))
    path = simulate(drum, drum.state(nested.point.reshape(2, 3)), 0.01, 1e-3)
    assert {name for _, name, _ in path.touching[0]} == {*nested.active}
    assert all(force > 0 for _, _, force in path.touching[0])
