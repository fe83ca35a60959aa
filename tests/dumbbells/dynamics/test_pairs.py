"""Dyads in the drum, and what is computed from trajectories: headings, climbing, exits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from drum_motions import recorded
from hypothesis import given
from hypothesis import strategies as st
from oracles import gaps

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics import pairs as drum_pairs
from polycorner.dumbbells.dynamics import starts as drum_starts
from polycorner.dumbbells.dynamics.pairs import DumbbellLengths
from polycorner.dumbbells.formulas import CONTACTS
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.models.textbook import bouncing_ball
from polycorner.motion.events import Event, EventKind
from polycorner.motion.simulation import simulate

PAIR = DumbbellPair(16, 3, 1.5, 125)
SIZES = DumbbellLengths(16.0, 3.0, 122.0, 1.5)

# -------------------------------------------------------------------------------------------- dyads

PLACES = st.tuples(
    *[st.floats(-0.15, 0.15), st.floats(-20, 20), st.floats(-4, 4)] * 2,
).map(np.array)


def centres(q):
    return np.concatenate([SIZES.balls(q[:3]), SIZES.balls(q[3:])], axis=-2)


def line_distance(p, a, b):
    u = (b - a) / math.dist(a, b)
    return abs(u[0] * (p - a)[1] - u[1] * (p - a)[0])


@given(PLACES)
def test_balls_lie_where_the_pair_has_them(q):
    developed = PAIR.developed(q)
    middle = SIZES.centre_radius * (q[0] + q[3]) / 2
    np.testing.assert_allclose(centres(q) - [middle, 0.0], developed, atol=1e-9)


@given(PLACES)
def test_chirality_is_the_pairs(q):
    expected = {"R": 1, "L": -1, None: 0}[PAIR.chirality(q)]
    assert drum_pairs.chirality(centres(q)) == expected


@given(PLACES)
def test_the_neighbourhood_is_the_three_inequalities(q):
    a1, a2, b1, b2 = centres(q)
    largest = max(
        max(line_distance(p, b1, b2) for p in (a1, a2)) / 6,
        max(line_distance(p, a1, a2) for p in (b1, b2)) / 6,
        max(math.dist(a, b) for a in (a1, a2) for b in (b1, b2)) / (2 * math.hypot(16, 3)),
    )
    assert drum_pairs.in_neighbourhood(centres(q), 3.0) == (largest < 1)


@given(st.lists(PLACES, min_size=2, max_size=5))
def test_many_pairs_are_judged_as_each_alone(places):
    balls, pairs = np.stack([centres(q) for q in places]), np.stack(places).reshape(-1, 2, 3)
    for judge, stacked in (
        (drum_pairs.chirality, balls),
        (lambda balls: drum_pairs.in_neighbourhood(balls, 3.0), balls),
        (lambda pairs: drum_pairs.is_dyad(SIZES, pairs), pairs),
    ):
        np.testing.assert_array_equal(judge(stacked), [judge(one) for one in stacked])


@pytest.mark.parametrize("chirality", ["R", "L"])
@pytest.mark.parametrize("heading", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize("gap", [0.0, 0.5])
def test_nested_pairs_are_dyads_however_they_are_named(chirality, heading, gap):
    q = PAIR.nested(chirality, heading=heading, clearance=gap)
    for named in (q, PAIR.swap(q), PAIR.half_turn(q, "A"), PAIR.half_turn(q, "B")):
        assert drum_pairs.is_dyad(SIZES, named.reshape(2, 3))
        assert drum_pairs.chirality(centres(named)) == {"R": 1, "L": -1}[chirality]


def slid(pair, by):
    """Return a pair ``(..., 2, k)`` with B moved along its axis, towards A if A is below."""
    moved = np.array(pair)
    heading = moved[..., 1, 2]
    moved[..., 1, 0] -= by * np.sin(heading) / SIZES.centre_radius
    moved[..., 1, 1] -= by * np.cos(heading)
    return moved


SHIFT = 16 - math.sqrt(6**2 - 4.5**2)  # mm along their axis, of two in the corner


@given(
    st.sampled_from("RL"),
    st.floats(-0.3, 0.3),
    st.floats(0.02, 0.6),
    st.floats(0, 2 * SHIFT - 16),
)
def test_pairs_that_have_slid_along_each_other_are_dyads(chirality, heading, gap, by):
    """Parallel, a ball of each beside the other's rod: ``T`` asks for no more."""
    corner = PAIR.nested(chirality, heading=heading, clearance=gap).reshape(2, 3)
    pair = slid(corner, by)
    assert min(gaps_of(pair).values()) > 0
    assert drum_pairs.is_dyad(SIZES, pair)
    assert drum_pairs.is_dyad(DumbbellDrum(), pair)
    assert drum_pairs.chirality(centres(pair.ravel())) == {"R": 1, "L": -1}[chirality]


def gaps_of(pair):
    return dict(zip(CONTACTS, gaps(PAIR, pair.ravel()), strict=True))


@given(PLACES)
def test_dyads_are_parallel_and_hold_each_others_rods(q):
    found = gaps_of(q)
    rods = [min(found[name] for name in names) for names in (("A1b", "A2b"), ("aB1", "aB2"))]
    turned = math.degrees(abs(math.remainder(q[5] - q[2], math.pi)))
    assert drum_pairs.is_dyad(SIZES, q.reshape(2, 3)) == (max(rods) < 0.75 and turned < 20)


@pytest.mark.parametrize("rod_radius", [0.5, 1.5, 2.0, 2.8])
@pytest.mark.parametrize("gap", [0.1, 0.0, -1e-3])
def test_dumbbells_that_touch_side_by_side_or_end_to_end_are_no_dyads(rod_radius, gap):
    """Also when the rods are so thick that the balls are not far from them."""
    pair, sizes = replace(PAIR, rod_radius=rod_radius), replace(SIZES, rod_radius=rod_radius)
    for q in (pair.side_by_side(clearance=gap), pair.end_to_end(gap=gap)):
        assert not drum_pairs.is_dyad(sizes, q.reshape(2, 3))
    nest = pair.nested("R", clearance=0.05).reshape(2, 3)
    assert drum_pairs.is_dyad(sizes, nest)


def test_pairs_that_are_apart_or_crossed_are_no_dyads():
    apart = PAIR.nested("R", clearance=0.9)  # more than half of r - t
    crossed = PAIR.nested("R", clearance=0.5)
    crossed[5] += math.radians(21)
    for q in (apart, crossed):
        assert not drum_pairs.is_dyad(SIZES, q.reshape(2, 3))


# ------------------------------------------------------------------------------------ trajectories


def motion(q, drum, events=(), present=None):
    """Return a trajectory with given coordinates ``(T, N, 4)``, one instant per second."""
    q = np.array(q, dtype=float)
    T, N = q.shape[:2]
    here = np.ones((T, N), dtype=bool) if present is None else np.array(present)
    return recorded(drum, np.arange(float(T)), q, present=here, events=tuple(events))


def test_turns_of_a_zigzag():
    phi = np.radians([0.0, 3, 6, 9, 4, 5, 6, 7, 2, 2.5, 2.1, 3, 4])
    q = np.zeros((len(phi), 1, 4))
    q[:, 0, 0] = phi
    top, bottom = drum_pairs.turning_azimuths(motion(q, DumbbellDrum()))
    assert math.degrees(top) == pytest.approx((9 + 7) / 2)
    assert math.degrees(bottom) == pytest.approx((4 + 2) / 2)  # 2.5 to 2.1 is no turn
    still = drum_pairs.turning_azimuths(motion(q[:4], DumbbellDrum()))
    assert all(math.isnan(x) for x in still)


def test_the_mean_heading_is_that_of_directions():
    q = np.zeros((4, 2, 4))
    q[:, :, 2] = np.radians([[80, 84], [88, 90], [-86, 91], [-80, -84]])  # through 90 degrees
    heading = np.degrees(drum_pairs.mean_heading(motion(q, DumbbellDrum(count=2))))
    np.testing.assert_allclose(heading, [82, 89, 92.5, 98], atol=1e-9)


def test_the_climb_of_who_left_ends_there():
    q = np.zeros((5, 2, 4))
    q[:, 0, 1] = [0, 1, 2, 3, 4]
    q[:, 1, 1] = [0, 3, 6, 6, 6]
    present = np.array([[1, 1], [1, 1], [1, 1], [1, 0], [1, 0]], dtype=bool)
    rate = drum_pairs.climb_rate(motion(q, DumbbellDrum(count=2), present=present))
    assert rate == pytest.approx((1 + 3) / 2)


def nested_in_time(chirality, eta):
    """Return coordinates ``(T, 2, 4)`` of a nested pair whose mean is at ``eta``."""
    q = drum_starts.nested_pair(DumbbellDrum(count=2), chirality)
    placed = np.zeros((len(eta), 2, 4))
    placed[:, :, :3] = q
    placed[:, :, 1] += np.array(eta)[:, None]
    return placed


@pytest.mark.parametrize("by", [0.0, 4.0])
def test_exits_are_counted_by_kind(by):
    """A right dyad, a left one and a single leave; the second of the dyad some time later.

    In the corner, and after the two have slid along each other.
    """
    T = 20
    right, left = (
        slid(nested_in_time(hand, [eta] * T), by) for hand, eta in (("R", 50.0), ("L", 150.0))
    )
    single = np.zeros((T, 1, 4))
    single[:, 0, 1] = 250
    q = np.concatenate([right, left, single], axis=1)
    times = {1: 4.5, 0: 8.5, 2: 5.5, 4: 6.5}  # body 3 stays
    present = np.array([[t < times.get(body, math.inf) for body in range(5)] for t in range(T)])
    events = [
        Event(t, EventKind.EXIT, (body,), "", 0.0)
        for body, t in sorted(times.items(), key=lambda item: item[1])
    ]
    path = motion(
        q, DumbbellDrum(count=5), [*events, Event(9.0, EventKind.REST, (3,), "", 0.0)], present
    )
    assert drum_pairs.exits(path) == {"right": 2, "left": 1, "single": 1}
    assert drum_pairs.exits(path, memory=2.0) == {"right": 1, "left": 1, "single": 2}
    assert drum_pairs.dyads(path, 0) == [(0, 1, "R"), (2, 3, "L")]
    assert drum_pairs.dyads(path, 5) == [(2, 3, "L")]


def test_the_second_of_a_dyad_that_climbs_out_leaves_as_one_too():
    """It follows the first by its shift along the drum, as long as the climb takes for that."""
    drum = DumbbellDrum(count=2, top=50.0)
    start = drum_starts.nested_pair(drum, "R", heading=math.radians(12), eta=49.6 - SHIFT / 2)
    path = simulate(drum, drum.state(start), 80.0, 2e-3)
    first, second = (event.time for event in path.of_kind(EventKind.EXIT))
    assert second - first > 20
    assert drum_pairs.exits(path) == {"right": 2, "left": 0, "single": 0}
    assert drum_pairs.exits(path, memory=20.0) == {"right": 1, "left": 0, "single": 1}


def test_the_commoner_hand_counts_and_where_they_balance_the_record_before():
    records = [[(0, 1, -1)], [(0, 1, 1)], [(0, 1, 1), (0, 2, -1)], [(1, 3, 1)]]
    times = np.arange(4.0)
    assert drum_pairs.left_as(times, [(3.5, 0)], records.__getitem__) == ["right"]
    assert drum_pairs.left_as(times, [(3.5, 0)], records.__getitem__, memory=2.0) == ["single"]
    assert drum_pairs.left_as(times, [(1.0, 0), (3.5, 4)], records.__getitem__) == [
        "left",
        "single",
    ]
    three = [[(0, 1, 1), (0, 2, -1), (3, 0, -1)]]
    assert drum_pairs.left_as(times[:1], [(0.5, 0)], three.__getitem__) == ["left"]


def test_a_pair_is_held_while_it_is_near_and_handed():
    drum = DumbbellDrum(count=2)
    q = nested_in_time("R", [50.0] * 4)
    assert drum_pairs.held(motion(q, drum))
    assert drum_pairs.handedness(motion(q, drum)) == "R"
    apart = q.copy()
    apart[2, 1, 1] += 16 + 6
    assert not drum_pairs.held(motion(apart, drum))
    turned = q.copy()
    turned[3] = nested_in_time("L", [50.0])[0]
    assert not drum_pairs.held(motion(turned, drum))
    gone = np.array([[1, 1], [1, 1], [1, 1], [1, 0]], dtype=bool)
    assert not drum_pairs.held(motion(q, drum, present=gone))
    with pytest.raises(ValueError, match=r"^trajectory: expected one of two dumbbells"):
        drum_pairs.held(motion(np.zeros((2, 1, 4)), DumbbellDrum()))


def test_other_trajectories_are_refused():
    path = motion(np.zeros((2, 1, 4)), DumbbellDrum())
    with pytest.raises(TypeError, match=r"^trajectory: expected one of dumbbells in a drum"):
        drum_pairs.dyads(replace(path, system=bouncing_ball()), 0)
