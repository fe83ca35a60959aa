"""Dumbbells that attract each other, or that the wall attracts: when they begin to roll."""

import math

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellDrum, OutOfRound, RigidDumbbells
from polycorner.dumbbells.drum import GRAVITY
from polycorner.motion import EventKind, Noise, Solver, simulate

ROLLING, RUBBING = 0.1, 0.3
LEVEL = {"tilt": 0.0, "rolling": (ROLLING, 0.06), "rubbing": (RUBBING, RUBBING)}
SOLVER = Solver(tolerance=1e-7, sweeps=500)


def onset(drum, places, end, every=10):
    """The run, and the first instant at which a dumbbell leaves the motion of the drum."""
    path = simulate(drum, drum.state(places), end, 1e-3, every=every, solver=SOLVER)
    started = [e.time for e in path.of_kind(EventKind.MOTION) if e.time > 0.1]
    return path, started[0]


@pytest.mark.parametrize("adhesion", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("wall", [None, OutOfRound({2: 1e-9})])
def test_a_dumbbell_that_the_wall_attracts_is_carried_higher(adhesion, wall):
    """``sin(phi) = mu_r (cos(phi) + adhesion)``."""
    drum = DumbbellDrum(adhesion=adhesion, out_of_round=wall, **LEVEL)
    _, time = onset(drum, [[0.0, 0.0, 0.0]], 18.0)
    turned = math.atan(ROLLING)
    expected = turned + math.asin(ROLLING * adhesion * math.cos(turned))
    assert drum.spin * time == pytest.approx(expected, abs=2 * drum.spin * 1e-3)


@pytest.mark.parametrize("cohesion", [0.05, 0.1])
def test_a_pair_rolls_when_weight_overcomes_rolling_and_rubbing(cohesion):
    """The virtual power of rolling together vanishes, with the forces of the simulation.

    Surfaces that touch slip by ``1 + t/r`` times the way of the centres, at the rods and, as
    ``(r + t)/r`` is the same, between the balls; almost all that presses is the attraction.
    """
    drum = DumbbellDrum(count=2, spin=0.04, cohesion=cohesion, attraction_range=0.5, **LEVEL)
    places = drum.pair.nested("R", heading=0.0, clearance=3e-4).reshape(2, 3)
    places[:, 0] += 0.08
    path, time = onset(drum, places, 2.8, every=1)
    at = path.at(time)
    pressing = sum(force for _, _, force in path.touching[at])
    weight = 2 * drum.ball_mass * GRAVITY
    assert pressing == pytest.approx(3 * cohesion * weight, rel=0.2)
    rubs = (1 + drum.rod_radius / drum.ball_radius) * RUBBING * pressing / weight
    left = np.sin(path.q[at, :, 0]).sum() - ROLLING * np.cos(path.q[at, :, 0]).sum()
    assert left == pytest.approx(rubs, rel=1e-3)
    assert path.audit < 1e-4


def test_pairs_in_reach_of_each_other_are_pulled_with_the_stated_force():
    """Of parallel dumbbells without friction, at the gap ``g`` between ball and ball."""
    drum = DumbbellDrum(
        count=2, cohesion=0.2, attraction_range=0.5, spin=0.0, tilt=0.0,
        sliding=(0, 0), rolling=(0, 0), rubbing=(0, 0),
    )  # fmt: skip
    gap = 0.3
    apart = (2 * drum.ball_radius + gap + drum.length) / 2
    state = drum.state([[0.0, -apart, 0.0], [0.0, apart, 0.0]])
    path = simulate(drum, state, 1e-3, 1e-3)
    force = 0.2 * 2 * drum.ball_mass * GRAVITY * (1 - gap / 0.5)
    speed = force / (2 * drum.ball_mass) * 1e-3
    assert path.v[-1, :, 1] == pytest.approx([speed, -speed], rel=1e-9)
    assert path.work["attraction"][-1] == pytest.approx(path.kinetic[-1], rel=1e-9)


def test_thresholds_of_rolling_scatter_from_dumbbell_to_dumbbell():
    """On the way up from the lowest line ``tan(phi)`` is the threshold that was drawn."""
    count = 40
    drum = DumbbellDrum(count=count, **LEVEL | {"rolling": (ROLLING, 0.0)})
    places = np.zeros((count, 3))
    places[:, 1] = 1e3 * np.arange(count)
    noise = Noise(scatter={"rolling": 0.3}, seed=2)
    path = simulate(drum, drum.state(places), 22.0, 2e-3, every=5, noise=noise)
    first = {}
    for event in path.of_kind(EventKind.MOTION):
        first.setdefault(event.bodies[0], math.tan(drum.spin * event.time) / ROLLING)
    logs = np.log([*first.values()])
    width = math.sqrt(math.log(1 + 0.3**2))
    assert len(logs) == count
    assert logs.mean() == pytest.approx(-(width**2) / 2, abs=4 * width / math.sqrt(count))
    assert logs.std() == pytest.approx(width, rel=4 / math.sqrt(2 * count))


def test_in_space_a_dumbbell_rolls_where_it_does_on_the_developed_drum():
    """But that the weight acts at the centres and friction at the wall: by ``r/R`` of it."""
    drum = DumbbellDrum(adhesion=0.5, spin=0.05, **LEVEL)
    rigid = RigidDumbbells(drum)
    path = simulate(rigid.system, rigid.state([0.1, 0.0, 0.0]), 3.0, 1e-3, every=10)
    started = next(e.time for e in path.of_kind(EventKind.MOTION) if e.time > 0.1)
    turned = math.atan(ROLLING)
    expected = turned + math.asin(ROLLING * drum.adhesion * math.cos(turned))
    assert 0.1 + drum.spin * started == pytest.approx(expected, rel=2 * 3.0 / 125.0)


def test_in_space_pairs_are_pulled_with_the_same_force():
    drum = DumbbellDrum(
        count=2, cohesion=0.2, attraction_range=0.5, spin=0.0, tilt=0.0,
        sliding=(0, 0), rolling=(0, 0), rubbing=(0, 0),
    )  # fmt: skip
    apart = (2 * drum.ball_radius + 0.3 + drum.length) / 2
    rigid = RigidDumbbells(drum)
    path = simulate(rigid.system, rigid.state([[0, -apart, 0], [0, apart, 0]]), 1e-3, 1e-3)
    force = 0.2 * 2 * drum.ball_mass * GRAVITY * (1 - 0.3 / 0.5)
    speed = force / (2 * drum.ball_mass) * 1e-3
    assert path.v[-1, :, 1] == pytest.approx([speed, -speed], rel=1e-6)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"cohesion": -0.1}, "cohesion: expected"),
        ({"adhesion": math.nan}, "adhesion: expected"),
        ({"attraction_range": 0.0}, "attraction_range: expected"),
        ({"attraction_range": 2.0}, "attraction_range: expected"),
    ],
)
def test_forces_that_do_not_attract_are_refused(given, told):
    with pytest.raises(ValueError, match=told):
        DumbbellDrum(**given)
