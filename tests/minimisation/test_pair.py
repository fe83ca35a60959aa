"""Minima of the pair of dumbbells in the drum, and the evidence for them."""

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles_minima import feasible_around

from polycorner import Entrapment, Verdict, certify, minimise, stationary_on
from polycorner.dumbbells import DumbbellPair

METHODS = ("newton", "slsqp", "scp")
CORNER = ("A2B1", "A2b", "aB1")
ALONG = np.array([0.0, 1.0, 0.0, 0.0, 1.0, 0.0])  # both dumbbells carried along the drum
every_method = pytest.mark.parametrize("method", METHODS)
chiralities = st.sampled_from("RL")


@st.composite
def pairs(draw):
    """Pairs of the experiments' proportions: 3 mm balls, rods of 30 to 70 % of their radius."""
    return DumbbellPair(
        length=draw(st.floats(12, 20)),
        ball_radius=3,
        rod_radius=3 * draw(st.floats(0.3, 0.7)),
        drum_radius=draw(st.floats(60, 300)),
    )


def standard(**changes):
    sizes = {"length": 16, "ball_radius": 3, "rod_radius": 1.5, "drum_radius": 125}
    return DumbbellPair(**(sizes | changes))


def rest(pair, start, **options):
    return minimise(pair.polyhedron, pair.energy, start, **options)


def judge(pair, point):
    return certify(pair.polyhedron, pair.energy, point)


def apart(pair, p, q):
    """Largest difference of two configurations, of which one may be carried along the drum."""
    v = pair.manifold.difference(p, q)
    return float(abs(v - ALONG * (v @ ALONG) / 2).max())


def free_directions(c):
    return [direction for direction, kind in c.entrapment.items() if kind is Entrapment.FREE]


def is_corner(c):
    return c.verdict is Verdict.MINIMUM_ALONG_LOCUS and c.active == CORNER


# ------------------------------------------------------------------------------- what is found


@given(pairs(), chiralities)
def test_three_methods_agree_on_the_corner(pair, chirality):
    found = [rest(pair, pair.nested(chirality), method=method) for method in METHODS]
    for c in found:
        assert is_corner(c)
        assert c.signature == (3, 2, 1)
        assert c.entrapment_counts == {"half-V": 3, "half-U": 0, "U": 2, "free": 1}
        assert [set(re.findall(r"\w+", d)) for d in free_directions(c)] == [{"eta1", "eta2"}]
        assert all(c.multipliers[name] > 0 for name in CORNER)
        assert pair.chirality(c.point) == chirality
        assert c.residuals.worst < 1e-12
        assert c.holds(1e-12)
        assert apart(pair, c.point, found[0].point) < 1e-9
        assert c.energy == pytest.approx(found[0].energy, rel=1e-13)


@given(pairs(), chiralities)
def test_the_corner_is_symmetric(pair, chirality):
    c = rest(pair, pair.nested(chirality))
    other = rest(pair, pair.nested("L" if chirality == "R" else "R"))
    assert apart(pair, pair.mirror(c.point), other.point) < 1e-9
    assert c.energy == pytest.approx(other.energy, rel=1e-13)
    phi1, _, theta1, phi2, _, theta2 = c.point
    assert phi1 == pytest.approx(-phi2, abs=1e-12)
    assert theta1 == pytest.approx(theta2, abs=1e-12)
    assert c.multipliers["A2b"] == pytest.approx(c.multipliers["aB1"], rel=1e-10)
    assert judge(pair, pair.mirror(c.point)).multipliers == pytest.approx(c.multipliers, rel=1e-9)
    swapped = judge(pair, pair.swap(c.point))
    assert swapped.verdict is c.verdict
    assert set(swapped.active) == {"A1B2", "A1b", "aB2"}
    turned = judge(pair, pair.half_turn(c.point, "A"))
    assert set(turned.active) == {"A1B1", "A1b", "aB1"}
    assert turned.signature == c.signature


@given(pairs(), st.floats(0, 10), st.floats(-100, 100))
def test_end_to_end_is_the_global_minimum(pair, gap, shift):
    q = pair.end_to_end(gap=gap) + shift * ALONG
    c = judge(pair, q)
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert c.energy == pytest.approx(4 * pair.ball_radius, rel=1e-13)  # four balls on the floor
    if gap > 1e-3:
        assert c.active == ()
        assert c.signature == (0, 4, 2)
        assert sorted(free_directions(c)) == ["eta1", "eta2"]
    for method in METHODS:
        tilted = q + np.array([0.02, 0, 0.01, -0.01, 0.5, 0.03])
        found = rest(pair, tilted, method=method)
        assert found.verdict is Verdict.MINIMUM_ALONG_LOCUS
        assert found.energy == pytest.approx(4 * pair.ball_radius, rel=1e-12)
    assert rest(pair, pair.nested("R")).energy > c.energy


@given(pairs(), st.floats(0.01, 5))
def test_the_weight_of_the_rods_does_not_move_the_corner(pair, weight):
    heavy = DumbbellPair(
        pair.length, pair.ball_radius, pair.rod_radius, pair.drum_radius, rod_weight=weight
    )
    light, loaded = (rest(p, p.nested("R")) for p in (pair, heavy))
    assert is_corner(loaded)
    assert apart(pair, light.point, loaded.point) < 1e-9
    for name in CORNER:
        expected = light.multipliers[name] * (1 + weight / 2)
        assert loaded.multipliers[name] == pytest.approx(expected, rel=1e-9)


@given(st.floats(12, 20), st.floats(0.3, 0.7), chiralities)
def test_multipliers_are_the_energys_sensitivities(length, ratio, chirality):
    """A thicker rod closes the ball-rod gaps; a larger ball closes all, the ball-ball gap twice.

    In the plane the energy does not know the radii, so ``dE/dt`` and ``dE/dr`` at the corner are
    the multipliers' sums (the envelope theorem).
    """

    def corner(r, t):
        pair = DumbbellPair(length=length, ball_radius=r, rod_radius=t)
        return rest(pair, pair.nested(chirality))

    r, t, h = 3.0, 3 * ratio, 1e-3
    lam = corner(r, t).multipliers
    by_rod = (corner(r, t + h).energy - corner(r, t - h).energy) / (2 * h)
    by_ball = (corner(r + h, t).energy - corner(r - h, t).energy) / (2 * h)
    assert by_rod == pytest.approx(lam["A2b"] + lam["aB1"], rel=1e-5)
    assert by_ball == pytest.approx(2 * lam["A2B1"] + lam["A2b"] + lam["aB1"], rel=1e-5)


# ------------------------------------------------------------------------- what is refused


@given(pairs(), chiralities, st.integers(0, 2**32 - 1))
def test_a_point_beside_the_corner_is_refused_and_along_it_accepted(pair, chirality, seed):
    c = rest(pair, pair.nested(chirality))
    rng = np.random.default_rng(seed)
    scales = np.array(pair.manifold.scales)
    for _ in range(10):
        v = rng.normal(size=6)
        v -= ALONG * (v @ ALONG) / 2
        v *= 1e-6 / np.linalg.norm(v)
        assert not judge(pair, c.point + v * scales).is_minimum
    for along in (1e-6, -1e-6, 1.0, -40.0):
        moved = judge(pair, c.point + along * ALONG)
        assert is_corner(moved)
        assert moved.energy == pytest.approx(c.energy, rel=1e-14)


@given(pairs(), chiralities, st.integers(0, 2**32 - 1))
def test_no_feasible_point_near_the_corner_is_lower(pair, chirality, seed):
    c = rest(pair, pair.nested(chirality))
    rng = np.random.default_rng(seed)
    around = feasible_around(pair.polyhedron, c.point, (1e-5, 1e-3, 0.03, 0.2), rng, 2000)
    assert len(around) > 1500
    assert pair.energy.value(around).min() >= c.energy * (1 - 1e-14)


# ------------------------------------------------------------------------- where one may start


def test_two_hundred_dyads_reach_their_corner():
    pair, rng = standard(), np.random.default_rng(200)
    expected = {chirality: rest(pair, pair.nested(chirality)) for chirality in "RL"}
    for k in range(200):
        chirality = "RL"[k % 2]
        c = rest(pair, _dyad(pair, chirality, rng))
        assert is_corner(c)
        assert c.residuals.worst < 1e-12
        assert apart(pair, c.point, expected[chirality].point) < 1e-9


@pytest.mark.parametrize("method", ["slsqp", "scp"])
def test_dyads_reach_their_corner_by_the_other_methods(method):
    pair, rng = standard(), np.random.default_rng(20)
    for k in range(20):
        chirality = "RL"[k % 2]
        c = rest(pair, _dyad(pair, chirality, rng), method=method)
        assert is_corner(c)
        assert c.residuals.worst < 1e-12
        assert pair.chirality(c.point) == chirality


def _dyad(pair, chirality, rng):
    """A nested pair as one would lay it down by hand: loosely, turned, and on the slope."""
    q = pair.nested(chirality, clearance=rng.uniform(0, 1.5))
    turn, slope = np.deg2rad([rng.uniform(-20, 20), rng.uniform(-8, 8)])
    return q + np.array([slope, 0, turn, slope, 0, turn])


@every_method
@settings(max_examples=15)
@given(pair=pairs(), chirality=chiralities, seed=st.integers(0, 2**32 - 1))
def test_an_overlapping_start_is_restored_or_refused(method, pair, chirality, seed):
    rng = np.random.default_rng(seed)
    corner = rest(pair, pair.nested(chirality)).point
    v = rng.normal(size=6) * np.array(pair.manifold.scales)
    # Move until the bodies overlap by up to a millimetre.
    reach = next(
        (s for s in np.linspace(0.02, 0.6, 59) if pair.polyhedron.implicit(corner + s * v) < -0.02),
        None,
    )
    assume(reach is not None)
    start = corner + reach * v
    assume(pair.polyhedron.implicit(start) > -1)
    check_outcome(pair, rest(pair, start, method=method))


@every_method
@settings(max_examples=15)
@given(
    pair=pairs(),
    turns=st.tuples(st.floats(-math.pi, math.pi), st.floats(0.3, math.pi - 0.3)),
    seed=st.integers(0, 2**32 - 1),
)
def test_crossed_rods_never_end_silently_wrong(method, pair, turns, seed):
    rng = np.random.default_rng(seed)
    first, between = turns
    start = np.array([0, 0, first, 0, 0, first + between])
    start += 0.2 * rng.normal(size=6) * np.array(pair.manifold.scales)
    assert not pair.polyhedron.contains(start)
    check_outcome(pair, rest(pair, start, method=method))


def check_outcome(pair, c):
    """A minimum is certified, inside, and no point around it is lower; anything else says so."""
    if not c.is_minimum:
        assert c.verdict in {Verdict.INFEASIBLE, Verdict.NOT_CONVERGED}
        assert not c.holds(1)
        return
    assert pair.polyhedron.contains(c.point, tolerance=1e-9)
    assert c.residuals.worst < 1e-9
    around = feasible_around(pair.polyhedron, c.point, (1e-4, 1e-2), np.random.default_rng(5), 1000)
    assert pair.energy.value(around).min() >= c.energy * (1 - 1e-12)


@given(pairs(), st.tuples(*[st.integers(-3, 3)] * 4), st.sampled_from(METHODS))
def test_whole_turns_of_the_start_do_not_matter(pair, turns, method):
    start = pair.nested("R")
    turned = start.copy()
    turned[[0, 2, 3, 5]] += np.array(turns) * math.tau
    c, other = rest(pair, start, method=method), rest(pair, turned, method=method)
    assert is_corner(other)
    assert abs(other.point[[0, 2, 3, 5]]).max() < math.pi
    assert apart(pair, c.point, other.point) < 1e-9
    assert abs((c.point - other.point)[[0, 2, 3, 5]]).max() < 1e-9


# ------------------------------------------------------------------ where the corner gives way


def on_corner(pair, ratio):
    """Return the entry of the corner for a rod of ``ratio`` times the ball's radius."""
    thick = DumbbellPair(pair.length, pair.ball_radius, ratio * pair.ball_radius, pair.drum_radius)
    return thick, stationary_on(thick.polyhedron, thick.energy, thick.nested("R"), active=CORNER)


@settings(max_examples=10)
@given(pairs())
def test_a_thick_rod_pushes_its_balls_away(pair):
    """One bisection finds where the ball-rod multipliers change sign; the verdict changes there."""
    low, high = 0.7, 0.995
    while high - low > 1e-6:
        middle = (low + high) / 2
        _, c = on_corner(pair, middle)
        low, high = (middle, high) if c.multipliers["A2b"] > 0 else (low, middle)
    assert 0.85 < low < 0.995
    before = [on_corner(pair, ratio) for ratio in (*np.linspace(0.1, low, 12), low)]
    after = [on_corner(pair, ratio) for ratio in np.linspace(high, 0.995, 8)]
    for _, c in before + after:
        assert c.active == CORNER
        assert c.residuals.worst < 1e-12
        assert c.multipliers["A2B1"] > 0
        assert c.multipliers["A2b"] == pytest.approx(c.multipliers["aB1"], abs=1e-12)
    for _, c in before[:-2]:
        assert c.multipliers["A2b"] > 0
        assert is_corner(c)
    for _, c in after[1:]:
        assert c.multipliers["A2b"] < 0
        assert c.verdict is Verdict.NOT_STATIONARY
        assert not c.holds(1)
    # Beyond the bracket the pair leaves the corner, to lower ground.
    thick, entry = after[-1]
    found = rest(thick, entry.point)
    assert found.is_minimum
    assert found.energy < entry.energy - 1e-6
