"""Dumbbells as rigid bodies in the drum, beside the model of the developed drum."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from examples import ex26_drum_in_space as example
from polycorner import simulate
from polycorner.dumbbells import (
    DumbbellDrum,
    OutOfRound,
    RigidDumbbells,
    Shaking,
    UnevenFriction,
    Wobble,
)
from polycorner.dumbbells.drum import GRAVITY
from polycorner.dumbbells.dynamics.singles import follow, zigzags

SMOOTH = {"sliding": (0.0, 0.0), "rolling": (0.0, 0.0)}


def moving(rigid, q, v=(0.0, 0.0, 0.0)):
    """The state of a dumbbell of the velocity ``v`` in axes at rest, in which it does not turn."""
    place = np.ravel(q)
    relative = v - np.cross(rigid.spin, place[:3]), -rigid.spin
    return rigid.system.state(place, rigid.arrangement.velocity(place, {"D": relative}))


def test_placements_are_those_of_the_state():
    rigid = RigidDumbbells(DumbbellDrum(count=2))
    places = np.array([[0.1, 5.0, 0.2], [-0.3, 60.0, -1.2]])
    state = rigid.state(places)
    assert rigid.placements(state.q) == pytest.approx(places, abs=1e-12)
    assert rigid.lifts(state.q) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_state_moves_with_the_drum():
    """Seen from axes at rest it turns about the axis of the drum; nothing slips or rolls."""
    drum = DumbbellDrum(spin=0.3)
    rigid = RigidDumbbells(drum)
    state = rigid.state([0.2, 0.0, 0.4])
    assert not state.v.any()
    assert state.sticking.all()
    later = rigid.placements(state.q, 2.0)
    assert later == pytest.approx([0.2 + 2.0 * drum.spin, 0.0, 0.4], abs=1e-12)


def test_the_drum_carries_a_dumbbell_without_creep():
    rigid = RigidDumbbells(replace(example.DRUM, spin=1.0))
    path = simulate(rigid.system, rigid.state([0.0, 0.0, 0.3]), 0.08, 1e-3, every=20)
    assert rigid.placements(path.q[:, 0], path.times) == pytest.approx(
        np.stack([path.times, 0 * path.times, 0.3 + 0 * path.times], axis=-1), abs=1e-12
    )


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
    phi, eta, _ = rigid.placements(path.q[:, 0], path.times).T
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
        changes.append(np.sort(rigid.placements(path.q[-1], path.times[-1]) - start, axis=0))
    right, left = changes
    assert (np.abs(right).max(axis=0) > [0.1, 1e-3, 1e-3]).all()
    assert np.sort(right * [1, -1, -1], axis=0) == pytest.approx(left, abs=1e-6)


def test_shaking_and_wobble_move_a_smooth_dumbbell_as_on_the_developed_drum():
    """It slides as a point that two sets of formulas, written apart, push in the same way."""
    shaking, wobble = Shaking((400.0, 300.0, 500.0), (1.0, 8.0), seed=4), Wobble(0.05, 0.3)
    drum = DumbbellDrum(shaking=shaking, wobble=wobble, spin=2.0, tilt=0.1, **SMOOTH)
    rigid, q = RigidDumbbells(drum), np.array([0.2, 0.0, 0.0])
    planar = simulate(drum, drum.state([q], np.zeros((1, 4))), 1.0, 5e-4, every=20)
    start = moving(rigid, rigid.state(q).q)
    path = simulate(rigid.system, start, 1.0, 5e-4, every=20)
    assert np.ptp(planar.q[:, 0, 0]) > 0.5
    seen = rigid.placements(path.q, path.times[:, None])
    assert seen == pytest.approx(planar.q[..., :3], abs=5e-6)


def test_a_smooth_dumbbell_slides_in_an_oval_drum():
    """Against ``L = (r'^2 + (r phi')^2) / 2 + g r cos(phi)`` of its centre, ``r`` that of the wall.

    Along the axis of the drum it is a point that follows the curve which turns.
    """
    waves = {2: (1.0, 0.7), 3: (0.5, 0.0)}
    wall = OutOfRound({k: a for k, (a, _) in waves.items()}, {k: p for k, (_, p) in waves.items()})
    drum = DumbbellDrum(out_of_round=wall, spin=1.0, tilt=0.1, **SMOOTH)
    rigid, pull = RigidDumbbells(drum), GRAVITY * math.cos(drum.tilt)

    def radius(azimuth, order=0):
        turn = order * math.pi / 2
        outward = (a * k**order * math.cos(k * azimuth + p + turn) for k, (a, p) in waves.items())
        return (drum.centre_radius if order == 0 else 0.0) + sum(outward)

    def slide(t, y):
        phi, rate = y
        r, r1, r2 = (radius(phi - drum.spin * t, k) for k in range(3))
        across = rate - drum.spin  # relative to the wall
        forces = pull * (r1 * math.cos(phi) - r * math.sin(phi)) + r * r1 * rate**2
        return rate, (forces - r1 * r2 * across**2 - 2 * r * r1 * across * rate) / (r**2 + r1**2)

    begin = np.array([0.3, 0.2])
    r, out = radius(begin[0]), radius(begin[0], 1) * (begin[1] - drum.spin)
    outward, around = np.array([[math.sin(0.3), -math.cos(0.3)], [math.cos(0.3), math.sin(0.3)]])
    q = rigid.state([begin[0], 0.0, 0.0]).q.ravel().copy()
    q[[0, 2]] = r * outward
    v = np.zeros(3)
    v[[0, 2]] = out * outward + r * begin[1] * around
    path = simulate(rigid.system, moving(rigid, q, v), 1.0, 5e-4, every=20)
    exact = solve_ivp(slide, (0, 1), begin, t_eval=path.times, rtol=1e-10, atol=1e-12).y[0]
    phi, _, theta = rigid.placements(path.q[:, 0], path.times).T
    assert np.ptp(exact) > 0.5
    assert phi == pytest.approx(exact, abs=5e-6)
    assert theta == pytest.approx(0.0, abs=1e-9)


def test_friction_that_is_uneven_slows_a_dumbbell_place_by_place():
    """It slides down along the axis of a drum at rest; its pitch fixes the load on each ball."""
    uneven, mu = UnevenFriction(0.5, 20.0, seed=3), 0.3
    drum = DumbbellDrum(
        uneven_friction=uneven, spin=0.0, tilt=0.5, sliding=(mu, mu), rolling=(0.0, 0.0)
    )
    rigid, half = RigidDumbbells(drum), drum.length / 2
    amplitude, *modes = uneven.numbers(math.tau * drum.centre_radius)
    _, along, phase = np.reshape(modes, (-1, 3)).T

    def slide(_, y):
        eta, rate = y
        field = np.cos(np.outer([eta - half, eta + half], along) + phase).sum(axis=1)
        factors = np.maximum(0.0, 1 + amplitude * field)
        grip = mu * factors  # upwards, over the loads
        pitch = np.array([-half, half]) + drum.ball_radius * grip
        loads = np.linalg.solve([[1, 1], pitch], [2 * GRAVITY * math.cos(drum.tilt), 0.0])
        return rate, grip @ loads / 2 - GRAVITY * math.sin(drum.tilt)

    q = rigid.state([0.0, 0.0, 0.0]).q.ravel()
    path = simulate(rigid.system, moving(rigid, q, [0.0, -10.0, 0.0]), 0.2, 5e-4, every=20)
    exact = solve_ivp(slide, (0, 0.2), [0.0, -10.0], t_eval=path.times, rtol=1e-10, atol=1e-10).y[0]
    even = -10 * path.times + (mu * math.cos(0.5) - math.sin(0.5)) * GRAVITY * path.times**2 / 2
    assert abs(exact - even).max() > 1.0
    assert rigid.placements(path.q)[:, 0, 1] == pytest.approx(exact, abs=1e-4)


def test_a_dumbbell_leaves_at_the_top():
    rigid = RigidDumbbells(
        DumbbellDrum(sliding=(0.0, 0.0), rolling=(0.0, 0.0), top=40.0, tilt=-0.5)
    )
    path = simulate(rigid.system, rigid.state([0.0, 39.0, 0.0]), 0.1, 1e-3)
    assert [event.kind.name for event in path.events if event.kind.name == "EXIT"] == ["EXIT"]


def test_bad_input():
    with pytest.raises(TypeError, match="drum: expected"):
        RigidDumbbells("drum")
    corrugated = DumbbellDrum(out_of_round=OutOfRound({30: 0.2}))
    with pytest.raises(ValueError, match="drum: expected a convex wall"):
        RigidDumbbells(corrugated)
    with pytest.raises(ValueError, match="q: expected shape"):
        RigidDumbbells(DumbbellDrum()).state([[0.0, 0.0]])
    with pytest.raises(ValueError, match=r"q: expected shape \(2, 3\)"):
        RigidDumbbells(DumbbellDrum(count=2)).state([0.0, 0.0, 0.0])
