"""A bunch at the bottom: starts, dyads and exits against counts by hand."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from drum_motions import recorded

from polycorner.dumbbells import Shaking
from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import (
    BunchInSpaceRun,
    BunchRun,
    drum_for_bunch,
    exit_statistics,
    follow_bunch,
    follow_in_space,
    kicks_of_centres,
    scattered,
)
from polycorner.dumbbells.dynamics.dyads import handedness
from polycorner.dumbbells.dynamics.pairs import is_dyad
from polycorner.dumbbells.dynamics.starts import nested_pair
from polycorner.motion.events import Event, EventKind

SMALL = drum_for_bunch(DumbbellDrum(length=8, ball_radius=2, rod_radius=0.5), count=8)


NOBODY = {"right": 0, "left": 0, "both": 0, "single": 0, "present": 0}


def still(drum, q, times, present=None, exits=()):
    """A run in which nothing moves."""
    places = np.concatenate([q, np.zeros((len(q), 1))], axis=1)
    shape = (len(times), len(q))
    here = np.ones(shape, dtype=bool) if present is None else present
    many = np.broadcast_to(places, (*shape, 4)).copy()
    events = tuple(Event(t, EventKind.EXIT, (body,), "", 0.0) for t, body in exits)
    return BunchRun(recorded(drum, np.array(times), many, present=here, events=events))


@pytest.mark.parametrize("count", [8, 60])
@pytest.mark.parametrize("sizes", [(16, 3, 1.5), (8, 2, 0.5)])
def test_starts_lie_on_the_bottom_without_overlap(sizes, count):
    drum = drum_for_bunch(DumbbellDrum(*sizes), count=count)
    q = scattered(drum, np.random.default_rng(4))
    assert drum.placed(q).shape == (count, 4)
    assert abs(q[:, 0]).max() <= 0.35
    assert q[:, 1].max() < drum.top


def test_dyads_are_those_of_all_pairs():
    q = scattered(replace(SMALL, count=30), np.random.default_rng(0), width=0.15)
    run = still(replace(SMALL, count=30), q, [0.0, 1.0])
    by_hand = [
        (i, j, int(handedness(SMALL, q[[i, j]])))
        for i, j in combinations(range(30), 2)
        if is_dyad(SMALL, q[[i, j]])
    ]
    assert run.dyads(1) == [dyad for dyad in by_hand if dyad[2]]
    assert by_hand


def exits_of(hand):
    pair = SMALL.pair.nested(hand).reshape(2, 3)
    pair[:, 1] += 298
    alone = np.array([[0.0, 298.0, 0.1], [1.0, 30.0, 0.0]])
    drum = replace(SMALL, count=4)
    times = np.arange(5.0)
    present = np.ones((5, 4), dtype=bool)
    present[2:, 0] = present[3:, 1:3] = False
    alone[0, 0] = -0.8
    q = np.concatenate([pair, alone])
    return still(drum, q, times, present, [(1.5, 0), (2.5, 1), (2.7, 2)])


def test_what_is_known_of_those_that_leave_is_read_off_the_records():
    """Against a slow reading of all records of a run that is tilted the other way."""
    drum = replace(SMALL, count=16, top=40.0, tilt=math.radians(-20.0), sliding=(0.15, 0.1))
    run = follow_bunch(drum, 1.0, start=1, dt=2e-3, interval=0.02)
    assert len(run.leavings) > 3
    for one in run.leavings:
        before = [i for i, t in enumerate(run.times) if t < one.time]
        partners = {
            body for i in before for *two, _ in run.dyads(i) if one.body in two for body in two
        }
        touched = [
            i
            for i in before
            for bodies, *_ in run.trajectory.touching[i]
            if one.body in bodies and set(bodies) - partners - {one.body}
        ]
        last = touched[-1] if touched else 0
        assert one.alone == one.time - run.times[last]
        there = [run.q[last, k, 1] for k in range(16) if run.present[last, k]]
        assert one.above == pytest.approx(run.q[last, one.body, 1] - np.mean(there))
        assert math.tan(one.heading) == pytest.approx(math.tan(run.q[before[-1], one.body, 2]))
    assert {one.alone == one.time for one in run.leavings} == {True, False}


def test_a_heap_is_the_largest_group_that_touches():
    run = follow_bunch(replace(SMALL, count=16), 1.0, start=1, dt=2e-3, interval=0.1)
    groups = [{k} for k in range(16)]
    for bodies, *_ in run.trajectory.touching[-1]:
        if len(bodies) == 2:
            met = [group for group in groups if group & set(bodies)]
            groups = [group for group in groups if group not in met] + [set().union(*met)]
    assert run.heap(len(run.times) - 1) == max(map(len, groups)) > 1
    assert run.heap(0) >= 1


@pytest.mark.parametrize(("hand", "kind"), [("R", "right"), ("L", "left")])
def test_both_members_of_a_dyad_leave_as_such(hand, kind):
    """The second one is alone in the last record, but was not a moment ago."""
    run = exits_of(hand)
    assert run.exit_kinds == (kind, kind, "single")
    assert run.exit_counts() == {"right": 0, "left": 0, "single": 1} | {kind: 2}
    assert run.census(0) == NOBODY | {"single": 2, "present": 4, kind: 2}
    assert run.census(4) == NOBODY | {"single": 1, "present": 1}


def test_who_is_between_a_right_and_a_left_dyad_is_of_both_hands():
    """Three side by side, the middle one shifted up against both."""
    p, up = 2.6, 5.0
    places = np.array([[-p, 50.0, 0.0], [0.0, 50.0 + up, 0.0], [p, 50.0, 0.0]])
    run = still(replace(SMALL, count=3), places / [SMALL.centre_radius, 1.0, 1.0], [0.0])
    assert {(i, j) for i, j, _ in run.dyads(0)} == {(0, 1), (1, 2)}
    assert sum(hand for *_, hand in run.dyads(0)) == 0
    assert run.census(0) == {"right": 1, "left": 1, "both": 1, "single": 0, "present": 3}


def test_statistics_over_runs():
    found = exit_statistics([exits_of("R"), exits_of("L")])
    assert found.total.value == 3.0
    assert found.by_kind["right"].value == 1.0
    assert found.by_kind["right"].error == pytest.approx(1.0)
    with pytest.raises(ValueError, match="runs: expected at least one"):
        exit_statistics([])


def test_what_spins_rolls_and_what_does_not_slides():
    q = np.array([[0.02, 40.0, 0.1], [0.2, 80.0, 0.1]])
    still_path = still(replace(SMALL, count=2), q, np.arange(0, 21.0)).trajectory
    moved = still_path.q.copy()
    moved[:, 0, 3] = np.where(np.arange(21) % 2, 0.0, 0.2)
    run = BunchRun(replace(still_path, q=moved))
    assert run.rollers(20).tolist() == [True, False]
    assert run.azimuths(20) == pytest.approx((0.02, 0.2))
    assert math.isnan(run.azimuths(0)[0])


def test_a_bunch_stays_in_the_drum_and_sorts_itself():
    run = follow_bunch(SMALL, 1.0, start=2, dt=2e-3)
    assert run.present.all()
    assert run.exits == ()
    assert run.trajectory.max_penetration < 0.01
    low = run.q[-1, :, 1] - SMALL.length / 2 * abs(np.cos(run.q[-1, :, 2])) - SMALL.ball_radius
    assert low.min() > -0.01
    assert sum(run.census(-1)[k] for k in ("right", "left", "both", "single")) == 8


def test_dumbbells_leave_at_the_top():
    drum = replace(SMALL, top=40.0, tilt=math.radians(-40))  # steep: all slide out
    run = follow_bunch(drum, 0.5, start=2, interval=0.01)
    assert len(run.exits) == 8
    assert run.exits[0][0] > 0.02
    assert not run.present[-1].any()


def test_a_bunch_that_begins_above_the_top_is_refused():
    with pytest.raises(ValueError, match=r"top: .* got 10 mm, and number \d is at 17\.2"):
        follow_bunch(replace(SMALL, top=10.0), 1.0, start=2)


def test_a_drum_without_a_bottom_is_refused():
    with pytest.raises(ValueError, match="drum: expected one with a bottom"):
        follow_bunch(DumbbellDrum(), 1.0)


def test_dyads_climb_free_or_touched_by_a_third():
    """A right-handed pair rises by 1 mm in 10 s; in the second interval a third one touches it."""
    pair = SMALL.pair.nested("R").reshape(2, 3)
    drum = replace(SMALL, count=3)
    q = np.concatenate([pair + np.array([0, 50, 0]), [[1.0, 30.0, 0.0]]])
    path = still(drum, q, np.arange(0, 21.0)).trajectory
    rising = path.q.copy()
    rising[:, :2, 1] += 0.1 * path.times[:, None]
    touching = tuple((((1, 2), "A2B1", 0.0),) if time > 10 else () for time in path.times)
    run = BunchRun(replace(path, q=rising, touching=touching))
    found = run.dyad_rates()
    assert found["right free"] == pytest.approx([0.1])
    assert found["right touched"] == pytest.approx([0.1])
    assert len(found["left free"]) == len(found["left touched"]) == 0


# ----------------------------------------------------------------------------------------- in space

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
