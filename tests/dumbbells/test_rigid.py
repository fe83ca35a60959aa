"""Dumbbells as rigid bodies in the drum, beside the model of the developed drum."""

import math
from dataclasses import replace

import numpy as np
import pytest

from examples import ex26_drum_in_space as example
from polycorner import simulate
from polycorner.dumbbells import (
    DumbbellDrum,
    OutOfRound,
    RigidDumbbells,
    Shaking,
    Wobble,
)
from polycorner.dumbbells.dynamics.singles import follow, zigzags


def test_placements_are_those_of_the_state():
    rigid = RigidDumbbells(DumbbellDrum(count=2))
    places = np.array([[0.1, 5.0, 0.2], [-0.3, 60.0, -1.2]])
    state = rigid.state(places)
    assert rigid.placements(state.q) == pytest.approx(places, abs=1e-12)
    assert rigid.lifts(state.q) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_state_moves_with_the_drum():
    """Positions a moment later are turned about the axis; nothing slips or rolls."""
    drum = DumbbellDrum(spin=0.3)
    rigid = RigidDumbbells(drum)
    state = rigid.state([0.2, 0.0, 0.4])
    dt = 1e-6
    later = rigid.state([0.2 + drum.spin * dt, 0.0, 0.4])
    assert state.v == pytest.approx((later.q - state.q) / dt, abs=1e-4)
    assert state.sticking.all()


def test_the_limit_of_rest_is_that_of_the_developed_drum_up_to_the_order_of_its_curvature():
    """Deviations fall with the radius of the drum; the limit is computed by convex programmes."""
    wide = replace(example.DRUM, drum_radius=500.0)
    narrow, wide = RigidDumbbells(example.DRUM), RigidDumbbells(wide)
    for theta in np.radians([-25.0, 20.0]):
        near, far = (
            example.rest_limit(rigid, theta) - example.onset_azimuths(rigid.drum, [theta])[0]
            for rigid in (narrow, wide)
        )
        assert abs(near) < 3 / 122 * math.radians(6)
        assert abs(far) < 0.35 * abs(near)


def test_a_wide_drum_carries_a_dumbbell_as_the_developed_one_does():
    """Onset, stop and rise of the first slip, in a drum of four times the radius."""
    drum = replace(example.DRUM, drum_radius=500.0)
    rigid, theta = RigidDumbbells(drum), math.radians(20)
    path = simulate(rigid.system, rigid.state([0.0, 0.0, theta]), 17.0, 1e-3, every=10)
    phi, eta, _ = rigid.placements(path.q[:, 0]).T
    (planar,) = zigzags(follow(drum, [theta], 17.0), drum.spin)
    begin = int(np.argmax(np.diff(phi) < 0))
    end = begin + int(np.argmax(np.diff(phi[begin:]) > 0))
    assert phi[[begin, end]] == pytest.approx([planar.upper[0], planar.lower[0]], abs=3e-3)
    assert eta[end] - eta[begin] == pytest.approx(planar.rise[0], rel=0.05)


def test_a_level_drum_mirrors_pairs():
    """Reflection of the axis reverses climb and heading of the pair of the other hand.

    Without friction, where a step has one solution; the pair slides down from 11 degrees and parts.
    """
    smooth = {"sliding": (0.0, 0.0), "rolling": (0.0, 0.0), "rubbing": (0.0, 0.0)}
    rigid = RigidDumbbells(replace(example.DRUM, count=2, tilt=0.0, **smooth))
    changes = []
    for hand, sign in (("R", 1), ("L", -1)):
        start = example.nested_pair(rigid.drum, hand, heading=sign * math.radians(8))
        start[:, 0] += 0.2
        path = simulate(rigid.system, rigid.state(start), 0.2, 1e-3)
        changes.append(np.sort(rigid.placements(path.q[-1]) - start, axis=0))
    right, left = changes
    assert (np.abs(right).max(axis=0) > [0.1, 1e-3, 1e-3]).all()
    assert np.sort(right * [1, -1, -1], axis=0) == pytest.approx(left, abs=1e-6)


def test_shaking_and_wobble_move_a_smooth_dumbbell_as_on_the_developed_drum():
    """It slides as a point that two sets of formulas, written apart, push in the same way."""
    smooth = {"sliding": (0.0, 0.0), "rolling": (0.0, 0.0)}
    shaking, wobble = Shaking((400.0, 300.0, 500.0), (1.0, 8.0), seed=4), Wobble(0.05, 0.3)
    drum = DumbbellDrum(shaking=shaking, wobble=wobble, spin=2.0, tilt=0.1, **smooth)
    rigid, q = RigidDumbbells(drum), np.array([0.2, 0.0, 0.0])
    planar = simulate(drum, drum.state([q], np.zeros((1, 4))), 1.0, 5e-4, every=20)
    start = rigid.system.state(rigid.state(q).q, np.zeros(7))
    path = simulate(rigid.system, start, 1.0, 5e-4, every=20)
    assert np.ptp(planar.q[:, 0, 0]) > 0.5
    assert rigid.placements(path.q) == pytest.approx(planar.q[..., :3], abs=5e-6)


def test_a_dumbbell_leaves_at_the_top():
    rigid = RigidDumbbells(
        DumbbellDrum(sliding=(0.0, 0.0), rolling=(0.0, 0.0), top=40.0, tilt=-0.5)
    )
    path = simulate(rigid.system, rigid.state([0.0, 39.0, 0.0]), 0.1, 1e-3)
    assert [event.kind.name for event in path.events if event.kind.name == "EXIT"] == ["EXIT"]


def test_bad_input():
    with pytest.raises(TypeError, match="drum: expected"):
        RigidDumbbells("drum")
    oval = DumbbellDrum(out_of_round=OutOfRound({2: 0.1}))
    with pytest.raises(ValueError, match="drum: expected no out_of_round"):
        RigidDumbbells(oval)
    with pytest.raises(ValueError, match="q: expected shape"):
        RigidDumbbells(DumbbellDrum()).state([[0.0, 0.0]])
    with pytest.raises(ValueError, match=r"q: expected shape \(2, 3\)"):
        RigidDumbbells(DumbbellDrum(count=2)).state([0.0, 0.0, 0.0])
