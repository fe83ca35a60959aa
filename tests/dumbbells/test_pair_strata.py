"""The strata D6, D5, D4 and the two kinds of corners, Delta and E ([GMBN] sec. 5)."""

import itertools
import math

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import root
from strategies import pairs, placed_pairs

from polycorner import stratum_at
from polycorner.dumbbells import DumbbellPair
from polycorner.polyhedra import LocalType

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
BOTH = pytest.mark.parametrize("pair", [DRUM, PLANE], ids=["drum", "plane"])
DELTA, EPSILON = ("A2B1", "A2b", "aB1"), ("A1B1", "A2B2", "A2b", "aB1")
ACROSS = PLANE.rod_radius + PLANE.ball_radius
ALONG = math.sqrt(4 * PLANE.ball_radius**2 - ACROSS**2)


def beside(along, across, turn=0.0, heading=0.0):
    """Return A at the origin of the plane and B moved along and across A's axis, then turned."""
    axis = np.array([math.sin(heading), math.cos(heading)])
    normal = np.array([-math.cos(heading), math.sin(heading)])
    return np.array([0.0, 0.0, heading, *(along * axis + across * normal), heading + turn])


# Placements in the plane by contacts: along, across, turn.
PLANE_STRATA = {
    (): [(16, 9, 0.3), (30, 0, 0.0), (0, 6.5, 0.0)],
    ("A2B1",): [(16 + 6, 0, 0.0)],
    ("A2b",): [(8 + ACROSS, 0, math.pi / 2)],
    ("aB1",): [(0, -8 - ACROSS, math.pi / 2)],
    ("A1B1", "A2B2"): [(0, 6, 0.0), (0, -6, 0.0)],
    ("A2b", "aB1"): [(8, ACROSS, 0.0), (9, -ACROSS, 0.0)],
    DELTA: [(16 - ALONG, ACROSS, 0.0), (16 - ALONG, -ACROSS, 0.0)],
    EPSILON: [(ALONG, ACROSS, 0.0), (ALONG, -ACROSS, 0.0)],
}
CASES = [(contacts, place) for contacts, places in PLANE_STRATA.items() for place in places]


def corner(pair, contacts, heading, hand="R"):
    """Solve for a corner symmetric under a half turn about the middle: two unknowns, two gaps.

    The half turn takes A to B and exchanges the balls' numbers, so both gaps of a pair of
    contacts such as ``A2b``, ``aB1`` vanish together.
    """
    side = 1.0 if pair.is_plane else 1 / pair.centre_radius
    start = beside(ALONG if contacts == EPSILON else 16 - ALONG, ACROSS, heading=heading)[3:5] / 2
    rows = [pair.polyhedron.names.index(name) for name in (contacts[0], "A2b")]

    def placement(offset):
        across, along = offset[0] * side, offset[1]
        return np.array([-across, -along, heading, across, along, heading])

    solved = root(lambda z: pair.polyhedron.values(placement(z))[rows], start, tol=1e-14)
    q = placement(solved.x)
    return q if hand == "R" else pair.mirror(q)


class TestPlane:
    @given(
        st.sampled_from(CASES),
        st.floats(-math.pi, math.pi),
        st.floats(-20, 20),
        st.floats(-20, 20),
    )
    def test_strata_by_their_contacts_wherever_they_lie(self, case, heading, right, up):
        contacts, (along, across, turn) = case
        q = beside(along, across, turn, heading) + np.array([right, up, 0.0] * 2)
        stratum = stratum_at(PLANE.polyhedron, q)
        rank = min(len(contacts), 3)
        assert stratum.active == tuple(name for name in PLANE.polyhedron.names if name in contacts)
        assert (stratum.rank, stratum.dimension) == (rank, 6 - rank)
        kind = LocalType.QUADRANT if contacts else LocalType.INTERIOR
        assert stratum.local_type is (LocalType.CONE if contacts == EPSILON else kind)

    @pytest.mark.parametrize("contacts", [DELTA, EPSILON])
    def test_both_corners_come_in_two_hands(self, contacts):
        first, second = (
            stratum_at(PLANE.polyhedron, beside(along, across)).chirality
            for along, across, _ in PLANE_STRATA[contacts]
        )
        assert {first, second} == {"L", "R"}

    @pytest.mark.parametrize("contacts", [(), ("A2B1",), ("A1B1", "A2B2")])
    def test_without_enough_contacts_there_may_be_no_hand(self, contacts):
        q = beside(*PLANE_STRATA[contacts][-1])
        assert stratum_at(PLANE.polyhedron, q).chirality is None

    def test_motions_of_the_plane_span_the_corner(self):
        """The three-dimensional corner consists of the placements of one rigid pair."""
        for contacts in (DELTA, EPSILON):
            q = beside(*PLANE_STRATA[contacts][0])
            rows = [PLANE.polyhedron.names.index(name) for name in contacts]
            gradients = PLANE.polyhedron.gradients(q)[rows]
            turn = np.array([q[1], -q[0], 1, q[4], -q[3], 1])
            motions = np.array([[1, 0, 0, 1, 0, 0], [0, 1, 0, 0, 1, 0], turn])
            np.testing.assert_allclose(gradients @ motions.T, 0, atol=1e-12)

    def test_overlapping_bodies_are_outside(self):
        for place in ((0, 5.9, 0.0), (16 - ALONG + 0.01, ACROSS, 0.0), (0, 0, math.pi / 2)):
            stratum = stratum_at(PLANE.polyhedron, beside(*place))
            assert stratum.local_type is LocalType.OUTSIDE


class TestDrum:
    @BOTH
    @pytest.mark.parametrize("contacts", [DELTA, EPSILON])
    @pytest.mark.parametrize("heading", [0.0, 0.2, -0.5, 1.0])
    @pytest.mark.parametrize("hand", ["R", "L"])
    def test_corners_have_rank_and_dimension_three(self, pair, contacts, heading, hand):
        stratum = stratum_at(pair.polyhedron, corner(pair, contacts, heading, hand))
        assert set(stratum.active) == set(contacts)
        assert (stratum.rank, stratum.dimension) == (3, 3)
        quadrant = contacts == DELTA
        assert stratum.local_type is (LocalType.QUADRANT if quadrant else LocalType.CONE)

    @BOTH
    @pytest.mark.parametrize("heading", [0.0, 0.2, -0.5])
    @pytest.mark.parametrize("hand", ["R", "L"])
    def test_the_three_contact_corner_has_the_hand_of_the_nested_pair(self, pair, heading, hand):
        q = corner(pair, DELTA, heading, hand)
        assert stratum_at(pair.polyhedron, q).chirality == hand
        assert pair.chirality(pair.nested(hand)) == hand

    @pytest.mark.parametrize("contacts", [DELTA, EPSILON])
    @given(turn=st.floats(-math.pi, math.pi), lift=st.floats(-50, 50))
    def test_a_corner_stays_a_corner_when_the_drum_turns(self, contacts, turn, lift):
        q = corner(DRUM, contacts, 0.2)
        there = stratum_at(DRUM.polyhedron, q + np.array([turn, lift, 0.0] * 2))
        assert there == stratum_at(DRUM.polyhedron, q)

    @pytest.mark.parametrize("contacts", [DELTA, EPSILON])
    @given(which=st.sampled_from(["swap", "A", "B"]))
    def test_relabelled_corners_have_relabelled_contacts(self, contacts, which):
        q = corner(DRUM, contacts, 0.2)
        other = DRUM.swap(q) if which == "swap" else DRUM.half_turn(q, which)
        here, there = (stratum_at(DRUM.polyhedron, p) for p in (q, other))
        assert len(there.active) == len(here.active)
        assert there.active != here.active
        assert (there.dimension, there.local_type) == (here.dimension, here.local_type)
        assert there.chirality == here.chirality

    @BOTH
    def test_one_contact_and_two(self, pair):
        one = stratum_at(pair.polyhedron, pair.end_to_end(gap=0.0))
        two = stratum_at(pair.polyhedron, pair.side_by_side(clearance=0.0))
        none = stratum_at(pair.polyhedron, pair.nested("R"))
        assert (one.active, one.dimension) == (("A2B1",), 5)
        assert (two.active, two.dimension) == (("A1B1", "A2B2"), 4)
        assert (none.active, none.dimension) == ((), 6)
        kinds = [stratum.local_type for stratum in (none, one, two)]
        assert kinds == [LocalType.INTERIOR, LocalType.QUADRANT, LocalType.QUADRANT]


# ------------------------------------------------------------------------------------------- starts

HANDS = pytest.mark.parametrize("hand", ["R", "L"])
hands = st.sampled_from(["R", "L"])
# Long enough that a ball touches one ball of the other dumbbell only.
long_pairs = pairs(least_length=4.5, least_drum=2.0)


def gaps(pair, q):
    return dict(zip(pair.polyhedron.names, pair.polyhedron.values(q), strict=True))


def orientation(pair, q):
    """Return the sign of the turn from the farthest centres' vector to the other two's."""
    a1, a2, b1, b2 = pair.developed(q)
    _, outer, inner = max(
        (
            (float(np.linalg.norm(far - near)), far - near, rest - other)
            for (near, other), (far, rest) in itertools.product(
                [(a1, a2), (a2, a1)], [(b1, b2), (b2, b1)]
            )
        ),
        key=lambda found: found[0],
    )
    return float(np.sign(outer[0] * inner[1] - outer[1] * inner[0]))


class TestNested:
    @given(long_pairs, hands)
    def test_it_lies_inside_with_a_clearance_and_the_hand_asked_for(self, pair, hand):
        q = pair.nested(hand)
        assert pair.polyhedron.contains(q)
        assert pair.chirality(q) == hand

    @given(
        pairs(plane=True, least_length=4.5), hands, st.floats(0, 0.2), st.floats(-math.pi, math.pi)
    )
    def test_in_the_plane_three_contacts_have_exactly_the_clearance(
        self, pair, hand, share, heading
    ):
        clearance = share * pair.ball_radius
        q = pair.nested(hand, clearance=clearance, heading=heading)
        found = gaps(pair, q)
        for contact in ("A2b", "aB1", "A2B1"):
            assert found.pop(contact) == pytest.approx(clearance, abs=1e-9)
        assert min(found.values()) > clearance
        np.testing.assert_allclose(q[[2, 5]], heading)

    @pytest.mark.parametrize("contact", ["A2b", "aB1", "A2B1"])
    @HANDS
    def test_in_the_drum_the_clearance_is_right_to_second_order_in_the_curvature(
        self, hand, contact
    ):
        radii = 50.0 * 2.0 ** np.arange(6)
        errors = []
        for rho in radii:
            pair = DumbbellPair(16, 3, 1.5, rho + 3)
            errors.append(abs(gaps(pair, pair.nested(hand, clearance=0.5))[contact] - 0.5))
        assert oracles.observed_order(errors, 1 / radii, 1e-10) == pytest.approx(2, abs=0.1)

    @given(long_pairs)
    def test_the_mirror_turns_one_hand_into_the_other(self, pair):
        mirrored = pair.mirror(pair.nested("R"))
        np.testing.assert_allclose(pair.ball_centres(mirrored), pair.ball_centres(pair.nested("L")))

    @BOTH
    @pytest.mark.parametrize("hand", ["", "r", "right", None, 1, True])
    def test_hands_are_left_and_right(self, pair, hand):
        with pytest.raises((TypeError, ValueError), match=r"^chirality: expected 'R' or 'L'"):
            pair.nested(hand)

    @pytest.mark.parametrize("name", ["heading", "clearance"])
    @pytest.mark.parametrize("value", [math.nan, math.inf, "1", True, [1.0]])
    def test_bad_numbers_are_refused_by_name(self, name, value):
        with pytest.raises((ValueError, TypeError), match=f"^{name}: "):
            PLANE.nested("R", **{name: value})


class TestOtherStarts:
    @given(pairs(), st.floats(0, 1))
    def test_side_by_side_leaves_the_clearance_between_two_pairs_of_balls(self, pair, share):
        assume(pair.is_plane or pair.centre_radius > 4 * pair.ball_radius)
        clearance = share * pair.ball_radius
        q = pair.side_by_side(clearance=clearance)
        found = gaps(pair, q)
        assert found.pop("A1B1") == pytest.approx(clearance, abs=1e-9)
        assert found.pop("A2B2") == pytest.approx(clearance, abs=1e-9)
        assert min(found.values()) > clearance

    @given(pairs(), st.floats(0, 3))
    def test_end_to_end_leaves_the_gap_between_two_balls(self, pair, share):
        gap = share * pair.ball_radius
        found = gaps(pair, pair.end_to_end(gap=gap))
        assert found.pop("A2B1") == pytest.approx(gap, abs=1e-9)
        assert min(found.values()) > gap

    @given(pairs())
    def test_they_are_placements_of_the_set(self, pair):
        assume(pair.is_plane or pair.centre_radius > 4 * pair.ball_radius)
        for q in (pair.end_to_end(), pair.side_by_side(clearance=0.1)):
            assert pair.polyhedron.contains(q)

    @BOTH
    def test_neither_has_a_hand(self, pair):
        assert pair.chirality(pair.side_by_side()) is None
        assert pair.chirality(pair.end_to_end()) is None

    @pytest.mark.parametrize("value", [math.nan, math.inf, "1", True])
    def test_bad_numbers_are_refused_by_name(self, value):
        with pytest.raises((ValueError, TypeError), match=r"^clearance: "):
            DRUM.side_by_side(clearance=value)
        with pytest.raises((ValueError, TypeError), match=r"^gap: "):
            DRUM.end_to_end(gap=value)


class TestPlaneCorner:
    @given(pairs(plane=True, least_length=4.5), hands, st.floats(-math.pi, math.pi))
    def test_the_rigid_corner_rests_at_its_heading(self, pair, hand, turn):
        """Turned either way by the same angle the energy is the same, and not less."""
        theta, _, _ = pair.plane_corner()
        theta = {"R": theta, "L": -theta}[hand]
        least, plus, minus = (
            pair.energy.value(pair.nested(hand, clearance=0.0, heading=theta + angle))
            for angle in (0.0, turn, -turn)
        )
        assert plus == pytest.approx(minus, rel=1e-9)
        assert plus >= least * (1 - 1e-12)
        assert least == pytest.approx(pair.energy.value(pair.nested(hand, clearance=0.0)))

    @given(pairs(plane=True, least_length=4.5))
    def test_it_is_the_distance_of_the_centres_of_the_nested_pair(self, pair):
        _, along, across = pair.plane_corner()
        q = pair.nested("R", clearance=0.0)
        assert np.hypot(q[3] - q[0], q[4] - q[1]) == pytest.approx(np.hypot(along, across))


class TestChirality:
    @given(placed_pairs())
    def test_it_is_the_orientation_of_the_farthest_and_the_other_centres(self, drawn):
        pair, q = drawn
        hand = pair.chirality(q)
        if hand is not None:
            assert orientation(pair, q) == {"R": 1.0, "L": -1.0}[hand]

    @given(placed_pairs(), st.sampled_from(["A", "B"]))
    def test_relabelling_keeps_it_and_the_mirror_flips_it(self, drawn, which):
        pair, q = drawn
        hand = pair.chirality(q)
        assume(hand is not None)
        assert pair.chirality(pair.swap(q)) in (hand, None)
        assert pair.chirality(pair.half_turn(q, which)) in (hand, None)
        assert pair.chirality(pair.mirror(q)) in ({"R": "L", "L": "R"}[hand], None)

    @BOTH
    @HANDS
    def test_a_nested_pair_keeps_its_hand_exactly(self, pair, hand):
        q = pair.nested(hand)
        assert pair.chirality(pair.swap(q)) == hand
        assert pair.chirality(pair.half_turn(q, "A")) == hand
        assert pair.chirality(pair.mirror(q)) == {"R": "L", "L": "R"}[hand]
        assert stratum_at(pair.polyhedron, q).chirality == hand

    @HANDS
    @pytest.mark.parametrize("turn", [0.0, 1.0, math.pi, -3.1, 100.0])
    def test_it_does_not_depend_on_where_in_the_drum(self, hand, turn):
        q = DRUM.nested(hand) + np.array([turn, 5.0, 0.0] * 2)
        assert DRUM.chirality(q) == hand
        assert DRUM.chirality(DRUM.manifold.wrap(q)) == hand

    def test_it_belongs_to_one_placement(self):
        with pytest.raises(ValueError, match=r"^q: expected one point"):
            DRUM.chirality([DRUM.nested("R")])


class TestHeading:
    @given(placed_pairs(), st.integers(-3, 3), st.integers(-3, 3))
    def test_a_heading_is_the_angle_modulo_half_a_turn(self, drawn, first, second):
        pair, q = drawn
        turned = q + math.pi * np.array([0, 0, first, 0, 0, second])
        heading = pair.heading(turned)
        assert (np.abs(heading) <= math.pi / 2 + 1e-12).all()
        np.testing.assert_allclose(np.sin(heading - q[[2, 5]]), 0, atol=1e-12)

    @given(placed_pairs())
    def test_the_canonical_placement_is_of_the_same_bodies(self, drawn):
        pair, q = drawn
        before, after = pair.ball_centres(q), pair.ball_centres(pair.canonical(q))
        for k in (0, 2):
            same, other = after[k : k + 2], after[[k + 1, k]]
            error = min(np.abs(before[k : k + 2] - s).max() for s in (same, other))
            assert error <= 1e-11 * (1 + np.abs(before).max())

    def test_a_dumbbell_across_the_drum_has_a_positive_heading(self):
        q = [0.0, 0.0, -math.pi / 2, 0.0, 20.0, math.pi / 2]
        np.testing.assert_allclose(PLANE.heading(q), math.pi / 2)

    @pytest.mark.parametrize("which", ["", "a", "C", None, 1])
    def test_one_turns_a_or_b(self, which):
        with pytest.raises((TypeError, ValueError), match=r"^which: expected 'A' or 'B'"):
            DRUM.half_turn(DRUM.nested("R"), which)


@pytest.mark.parametrize("size", [1.0, 1e150, 1e300])
def test_nested_pairs_scale_with_their_size(size):
    unit = DumbbellPair(16.0, 3.0, 1.5).nested("R", clearance=0.25)
    q = DumbbellPair(16 * size, 3 * size, 1.5 * size).nested("R", clearance=0.25 * size)
    lengths = np.array([size, size, 1.0] * 2)
    np.testing.assert_allclose(q / lengths, unit, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("clearance", [-6.1, 1e308])
def test_balls_farther_apart_than_the_drum_is_wide_are_refused(clearance):
    with pytest.raises(ValueError, match=r"^clearance: expected a number >= -6 and <= 238 in mm"):
        DumbbellPair(16.0, 3.0, 1.5, 125.0).side_by_side(clearance=clearance)
