"""What turns a dyad: closed forms against the energy, the certificate and the engine."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.drum import GRAVITY
from polycorner.dumbbells.dynamics import dyads
from polycorner.dumbbells.dynamics.dyads import heading_at_shift

DRUM = DumbbellDrum()
WIDE = DumbbellDrum(drum_radius=12500.0)  # in which dumbbells are short


def places(drum, heading):
    return drum.pair.nested("R", heading=math.radians(heading), clearance=0.0).reshape(2, 3)


@pytest.mark.parametrize("length", [12.0, 16.0, 24.0])
def test_at_the_parting_heading_dumbbells_are_equally_high_and_press_no_more(length):
    drum = replace(WIDE, length=length)

    def apart(heading):
        return float(np.abs(np.diff(places(drum, heading)[:, 0]))[0])

    heading = dyads.parting_heading(drum)
    assert apart(heading) < 1e-3 * apart(0.0)
    assert dyads.pressing(drum, heading) == pytest.approx(0.0, abs=1e-12)
    assert dyads.pressing(drum, 5.0) == pytest.approx(apart(5.0), rel=1e-3)


def test_the_torque_of_the_weight_on_a_pair_is_the_ratio_times_that_on_a_dumbbell():
    drum, small = WIDE, math.radians(1.0)
    corner = math.radians(heading_at_shift(drum, dyads.offsets(drum)[1]))

    def energy(q):
        ends = drum.length / 2 / drum.centre_radius * np.sin(q[..., 2])
        return -np.cos(q[..., 0, None] + ends[..., None] * np.array([-1, 1])).sum()

    def rise(angle):
        pair = energy(places(drum, math.degrees(corner + angle)))
        return pair - energy(places(drum, math.degrees(corner)))

    single = energy(np.array([[0.0, 0.0, small]])) - energy(np.array([[0.0, 0.0, 0.0]]))
    pair = (rise(small) + rise(-small)) / 2
    assert pair / (2 * single) == pytest.approx(dyads.return_ratio(drum), rel=2e-3)


@pytest.mark.parametrize("length", [12.0, 16.0])
def test_an_impact_dissipates_the_energy_of_the_impact_mass(length):
    """Two bodies that approach with ``v`` push at half of ``s`` from centres of mass ``2 m``.

    Then ``1/M = 1/m + s^2 / (2 I)``, and a plastic impact dissipates ``M v^2 / 2``.
    """
    drum = DumbbellDrum(length)
    found = dyads.turn_by_impact(drum, 4.0)
    m, (_, along) = drum.ball_mass, dyads.offsets(drum)
    inertia = 2 * m * (length**2 / 4 + 0.4 * drum.ball_radius**2)
    expected = 0.5 * 4.0**2 / (1 / m + along**2 / (2 * inertia))
    assert found.dissipated == pytest.approx(expected, rel=0.02)


def test_the_turn_by_an_impact_grows_as_the_square_of_the_speed_over_the_friction():
    one, four = (dyads.turn_by_impact(DRUM, v).turn for v in (1.0, 4.0))
    assert one > 0
    assert four / one == pytest.approx(16.0, rel=0.05)
    smooth = replace(DRUM, sliding=(0.15, 0.1), rolling=(0.05, 0.03), rubbing=(0.15, 0.15))
    assert dyads.turn_by_impact(smooth, 1.0).turn == pytest.approx(2 * one, rel=0.05)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_after_a_head_on_impact_dumbbells_slide_as_far_as_friction_lets_them(speed):
    drum = replace(DRUM, count=2, tilt=0.0, spin=0.0)
    gap = 1e-4
    start = [[0, 50, 0], [0, 50 + drum.length + 2 * drum.ball_radius + gap, 0]]
    state = drum.state(start, [[0, speed, 0, 0], [0, 0, 0, 0]])
    from polycorner import simulate

    slowing = drum.sliding[1] * GRAVITY
    path = simulate(drum, state, 0.01, speed / slowing / 30)
    slid = path.q[-1, 1, 1] - path.q[0, 1, 1]
    after = math.sqrt(speed**2 - 2 * slowing * gap) / 2
    assert slid == pytest.approx(after**2 / (2 * slowing), rel=0.03)
