"""Symmetries of a pair: invariant contacts, and the group of relabellings."""

import itertools
import math
import pickle
from dataclasses import replace

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import pairs, placed_pairs, placements

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.symmetries import (
    drum_tangents,
    half_turn_in_place,
    plane_tangents,
    relabellings,
)

NAMES = oracles.CONTACTS
BALLS = ("A1", "A2", "B1", "B2")
ELEMENTS = relabellings()
elements = st.sampled_from(ELEMENTS)
PLANE = DumbbellPair(16, 3, 1.5)


def angle_apart(p, q):
    """Return how far two placements are apart, headings modulo a full turn."""
    apart = np.asarray(p) - np.asarray(q)
    apart[[2, 5]] = np.angle(np.exp(1j * apart[[2, 5]]))
    return abs(apart).max()


def moved_centres(pair, q):
    """Return the centres in the plane by name of ball, from the definition."""
    return dict(zip(BALLS, oracles.balls(pair, q)[:, :2], strict=True))


def turned(q, angle, right=0.0, up=0.0):
    """Return a pair in the plane moved as a whole; headings go from the y axis towards x."""
    rotation = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    moved = np.array(q, dtype=float)
    for k in (0, 3):
        moved[k : k + 2] = rotation @ moved[k : k + 2] + [right, up]
        moved[k + 2] += angle
    return moved


class TestRelabellings:
    def test_they_are_all_permutations_of_balls_that_keep_or_swap_the_dumbbells(self):
        """With the identity eight, each known by what it does to the four balls."""
        q = np.array([0.3, -1.1, 0.4, 5.0, 7.0, 2.1])
        before = moved_centres(PLANE, q)
        found = set()
        for g in ELEMENTS:
            after = moved_centres(PLANE, g.apply(q))
            image = tuple(
                next(b for b in BALLS if np.allclose(after[b], before[a], atol=1e-9)) for a in BALLS
            )
            found.add(image)
        expected = set()
        for image in itertools.permutations(BALLS):
            owners = [ball[0] for ball in image]
            if owners[0] == owners[1] and image != BALLS:
                expected.add(image)
        assert found == expected
        assert len(ELEMENTS) == 7

    @given(placed_pairs(), elements)
    def test_gaps_take_their_values_along(self, drawn, g):
        """The value of ``f`` at ``q`` is the value of ``names[f]`` at ``g(q)``."""
        pair, q = drawn
        before = dict(zip(NAMES, oracles.gaps(pair, q), strict=True))
        after = dict(zip(NAMES, oracles.gaps(pair, g.apply(q)), strict=True))
        computed = dict(zip(NAMES, pair.polyhedron.values(g.apply(q)), strict=True))
        for name in NAMES:
            assert after[g.names[name]] == pytest.approx(before[name], abs=1e-9)
            assert computed[g.names[name]] == pytest.approx(before[name], abs=4e-6 * pair.length)

    @pytest.mark.parametrize("g", ELEMENTS)
    def test_names_are_permuted_and_keep_their_kind(self, g):
        assert sorted(g.names) == sorted(g.names.values()) == sorted(NAMES)
        assert all(len(name) == len(image) for name, image in g.names.items())

    @given(placed_pairs(), elements, elements)
    def test_composing_two_gives_a_third_or_the_identity(self, drawn, g, h):
        _, q = drawn
        composed = {name: h.names[g.names[name]] for name in NAMES}
        if all(name == image for name, image in composed.items()):
            assert angle_apart(h.apply(g.apply(q)), q) < 1e-12 * (1 + abs(q).max())
            return
        (product,) = (k for k in ELEMENTS if k.names == composed)
        apart = angle_apart(h.apply(g.apply(q)), product.apply(q))
        assert apart < 1e-12 * (1 + abs(q).max())

    def test_they_form_the_symmetries_of_a_square(self):
        """Five elements of order two and two of order four, but the identity."""

        def order(g):
            names, power = dict(g.names), 1
            while any(a != b for a, b in names.items()):
                names, power = {a: g.names[b] for a, b in names.items()}, power + 1
            return power

        assert sorted(order(g) for g in ELEMENTS) == [2, 2, 2, 2, 2, 4, 4]


class TestTangents:
    """Along a motion of the pair as a whole nothing that matters changes."""

    STEP = 1e-5

    def slope(self, f, q, v):
        return (f(q + self.STEP * v) - f(q - self.STEP * v)) / (2 * self.STEP)

    @given(placed_pairs())
    def test_invariants_and_gaps_do_not_change_along_them(self, drawn):
        pair, q = drawn
        scales = pair.manifold.scale_array
        names = list(NAMES[:8])
        for v in pair.symmetry.tangents(q):
            unit = v / np.linalg.norm(v / scales)
            change = self.slope(pair.symmetry.invariants, q, unit)
            assert abs(change).max() < 1e-5 * (1 + abs(q).max() / pair.ball_radius)
            gaps = self.slope(lambda p: oracles.gaps(pair, p)[:8], q, unit)
            np.testing.assert_allclose(gaps, 0, atol=1e-4 * pair.length, err_msg=str(names))

    @given(placed_pairs())
    def test_they_are_as_many_as_the_symmetry_has_dimensions(self, drawn):
        pair, q = drawn
        tangents = pair.symmetry.tangents(q)
        assert tangents.shape == ((3, 6) if pair.is_plane else (2, 6))
        assert np.linalg.matrix_rank(tangents / pair.manifold.scale_array) == len(tangents)

    @pytest.mark.parametrize(("plane", "others"), [(True, 3), (False, 4)])
    @given(data=st.data())
    def test_invariants_change_in_every_other_direction(self, plane, others, data):
        """Together with the orbit they see all six directions."""
        pair, q = data.draw(placed_pairs(plane=plane))
        unit = np.eye(6) * pair.manifold.scale_array
        seen = np.array([self.slope(pair.symmetry.invariants, q, v) for v in unit])
        assert np.linalg.matrix_rank(seen, tol=1e-3) == others

    def test_functions_of_the_module_are_those_of_the_symmetry(self):
        q = np.array([0.3, -1.1, 0.4, 5.0, 7.0, 2.1])
        np.testing.assert_array_equal(PLANE.symmetry.tangents(q), plane_tangents(q))
        drum = DumbbellPair(16, 3, 1.5, 125)
        np.testing.assert_array_equal(drum.symmetry.tangents(q), drum_tangents(q))


class TestInvariants:
    @given(placed_pairs(plane=True), st.floats(-3, 3), st.floats(-20, 20), st.floats(-20, 20))
    def test_in_the_plane_they_do_not_change_under_any_motion(self, drawn, turn, right, up):
        pair, q = drawn
        after = pair.symmetry.invariants(turned(q, turn, right, up))
        size = 1e-12 * (40 + abs(q).max()) / pair.ball_radius
        np.testing.assert_allclose(after, pair.symmetry.invariants(q), atol=size)

    @given(placed_pairs(plane=False), st.floats(-7, 7), st.floats(-20, 20))
    def test_in_the_drum_they_do_not_change_when_the_pair_rolls_or_shifts(self, drawn, roll, up):
        pair, q = drawn
        moved = pair.manifold.wrap(q + np.array([roll, up, 0] * 2))
        size = 1e-11 * (40 + abs(q).max() + pair.drum_radius) / pair.ball_radius
        np.testing.assert_allclose(
            pair.symmetry.invariants(moved), pair.symmetry.invariants(q), atol=size
        )

    @given(placed_pairs(plane=True))
    def test_in_the_plane_they_tell_where_b_is_in_the_frame_of_a(self, drawn):
        """From the ball centres: A upright in the origin, lengths in ball radii."""
        pair, q = drawn
        centres = moved_centres(pair, q)
        along = (centres["A2"] - centres["A1"]) / pair.length
        across = np.array([along[1], -along[0]])
        apart = (centres["B1"] + centres["B2"] - centres["A1"] - centres["A2"]) / 2
        arm = (centres["B2"] - centres["B1"]) / 2
        expected = np.array([apart @ across, apart @ along, arm @ along, arm @ across])
        found = pair.symmetry.invariants(q) * pair.ball_radius
        np.testing.assert_allclose(found, expected, atol=1e-9 * (pair.length + abs(q).max()))
        np.testing.assert_array_equal(pair.relative(q), pair.symmetry.invariants(q))

    @given(placed_pairs(plane=False), st.floats(-7, 7), st.floats(-20, 20), st.integers(-2, 2))
    def test_relative_placements_in_the_drum_do_not_change_when_the_pair_rolls(
        self, drawn, roll, up, winding
    ):
        pair, q = drawn
        assume(abs(abs(math.remainder(q[3] - q[0], math.tau)) - math.pi) > 1e-6)
        moved = q + np.array([roll, up, 0, roll + winding * math.tau, up, 0])
        size = 1e-11 * (40 + abs(moved).max() + pair.drum_radius) / pair.ball_radius
        np.testing.assert_allclose(pair.relative(moved), pair.relative(q), atol=size)

    @given(st.data())
    def test_relative_placements_in_the_drum_are_those_of_the_developed_plane(self, data):
        pair = data.draw(pairs(plane=False))
        q = data.draw(placements(pair, reach=0.4))
        assume(abs(q[3] - q[0]) < math.pi)
        flat = DumbbellPair(pair.length, pair.ball_radius, pair.rod_radius)
        unrolled = q * np.array([pair.centre_radius, 1, 1] * 2)
        size = 1e-11 * (1 + abs(unrolled).max()) / pair.ball_radius
        np.testing.assert_allclose(pair.relative(q), flat.relative(unrolled), atol=size)

    @given(placed_pairs(), elements)
    def test_relative_placements_of_the_same_bodies_have_the_same_distance(self, drawn, g):
        pair, q = drawn
        apart = [np.hypot(*pair.relative(p)[:2]) for p in (q, g.apply(q))]
        assert apart[0] == pytest.approx(apart[1], abs=1e-9)

    @given(placed_pairs())
    def test_relative_does_not_change_its_argument(self, drawn):
        pair, q = drawn
        before = q.copy()
        pair.relative(q)
        np.testing.assert_array_equal(q, before)


class TestHalfTurnInPlace:
    @given(placed_pairs(plane=False))
    def test_it_turns_the_bodies_about_the_vertical_axis(self, drawn):
        pair, q = drawn
        before = oracles.balls(pair, q)
        after = oracles.balls(pair, half_turn_in_place().apply(q))
        size = 1e-9 * (1 + abs(before).max())
        np.testing.assert_allclose(after, before * np.array([-1, -1, 1]), atol=size)

    @given(placed_pairs(plane=False))
    def test_it_keeps_every_gap_and_undoes_itself(self, drawn):
        pair, q = drawn
        g = half_turn_in_place()
        assert not g.names
        np.testing.assert_allclose(
            oracles.gaps(pair, g.apply(q)), oracles.gaps(pair, q), atol=1e-8 * pair.length
        )
        assert angle_apart(g.apply(g.apply(q)), q) < 1e-12 * (1 + abs(q).max())

    def test_the_drum_has_it_and_the_plane_does_not_need_it(self):
        q = np.array([0.1, -1.1, 0.4, 0.15, 7.0, 2.1])
        (g,) = DumbbellPair(16, 3, 1.5, 125).symmetry.elements
        np.testing.assert_array_equal(g.apply(q), half_turn_in_place().apply(q))
        assert not PLANE.symmetry.elements


class TestPlacements:
    @given(pairs(least_drum=1.5), st.integers(0, 2**32 - 1), st.integers(0, 5))
    def test_they_lie_in_the_polyhedron(self, pair, seed, count):
        q = pair.placements(np.random.default_rng(seed), count)
        assert q.shape == (count, 6)
        assert all(oracles.gaps(pair, p).min() >= -1e-6 * pair.length for p in q)

    @given(pairs(least_drum=1.5), st.integers(0, 2**32 - 1), st.floats(-4, 4))
    def test_their_mean_heading_is_as_asked_modulo_a_half_turn(self, pair, seed, heading):
        for q in pair.placements(np.random.default_rng(seed), 4, heading=heading):
            assert math.sin((q[2] + q[5]) / 2 - heading) == pytest.approx(0, abs=1e-9)

    def test_they_follow_from_the_generator_alone(self):
        first, again, other = (PLANE.placements(np.random.default_rng(s), 5) for s in (7, 7, 8))
        np.testing.assert_array_equal(first, again)
        assert not np.array_equal(first, other)

    @pytest.mark.parametrize("pair", [PLANE, DumbbellPair(16, 3, 1.5, 125)])
    def test_they_are_near_enough_to_touch_and_all_around(self, pair):
        q = pair.placements(np.random.default_rng(0), 400)
        relative = np.array([pair.relative(p) for p in q]) * pair.ball_radius
        reach = (pair.length + 4 * pair.ball_radius) / 2
        assert abs(relative[:, :2]).max() <= math.sqrt(2) * reach + 1e-9
        turns = np.sort(np.arctan2(relative[:, 3], relative[:, 2]))
        assert np.diff(turns).max() < 0.2
        sides = np.sign(relative[:, :2])
        assert {tuple(side) for side in sides.tolist()} == {
            (s, t) for s in (1, -1) for t in (1, -1)
        }


class TestSection:
    @given(placed_pairs(plane=False), st.floats(-4, 4))
    def test_it_holds_where_the_mean_heading_is_as_asked(self, drawn, heading):
        pair, q = drawn
        section = pair.section(heading)
        turned_to = q.copy()
        turned_to[[2, 5]] += heading - (q[2] + q[5]) / 2
        for p in (turned_to, half_turn_in_place().apply(turned_to)):
            (value,) = section.equation_values(p)
            assert value == pytest.approx(0, abs=1e-12)
        (value,) = section.equation_values(q)
        assert value == pytest.approx(math.sin((q[2] + q[5]) / 2 - heading), abs=1e-12)

    @given(placed_pairs(plane=False))
    def test_it_does_not_notice_full_turns_of_one_dumbbell(self, drawn):
        """A full turn of one heading is half a turn of the mean: the equation changes its sign."""
        pair, q = drawn
        section = pair.section(0.3)
        full = q + np.array([0, 0, math.tau, 0, 0, 0])
        np.testing.assert_allclose(
            section.equation_values(full), -section.equation_values(q), atol=1e-12
        )

    def test_it_keeps_the_gaps_and_what_the_model_says(self):
        pair = DumbbellPair(16, 3, 1.5, 125)
        section = pair.section(0.3)
        q = pair.nested("R", heading=0.3)
        assert section.names == pair.polyhedron.names
        np.testing.assert_array_equal(section.values(q), pair.polyhedron.values(q))
        assert section.annotations == pair.polyhedron.annotations


@pytest.mark.parametrize("pair", [PLANE, DumbbellPair(16, 3, 1.5, 125)], ids=["plane", "drum"])
def test_symmetries_survive_pickling(pair):
    symmetry = replace(pair.symmetry, elements=(*pair.symmetry.elements, *ELEMENTS))
    other = pickle.loads(pickle.dumps(symmetry))
    q = np.array([0.1, 2.0, 0.3, -0.2, -3.0, 1.0])
    np.testing.assert_array_equal(other.tangents(q), symmetry.tangents(q))
    np.testing.assert_array_equal(other.invariants(q), symmetry.invariants(q))
    for g, h in zip(other.elements, symmetry.elements, strict=True):
        np.testing.assert_array_equal(g.apply(q), h.apply(q))
        assert g.names == h.names
