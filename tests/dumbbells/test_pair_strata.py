"""The strata D6, D5, D4 and the two kinds of corners, Delta and E ([GMBN] sec. 5)."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import root

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
