"""Invariance under motions of the bodies, and the plane as the limit of the drum."""

import math

import numpy as np
import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import pairs, placed_pairs, placements

from polycorner.dumbbells import DumbbellPair

NAMES = oracles.CONTACTS


def exchange(letters):
    """Return where each contact comes from when labels are exchanged, such as A1 with A2."""
    return [NAMES.index(oracles.renamed(name, letters)) for name in NAMES]


SWAPPED = exchange({"A1": "B1", "A2": "B2", "B1": "A1", "B2": "A2", "a": "b", "b": "a"})
TURNED = {"A": exchange({"A1": "A2", "A2": "A1"}), "B": exchange({"B1": "B2", "B2": "B1"})}


def tolerance(pair):
    return 4e-6 * pair.length


def gaps(pair, q):
    return pair.polyhedron.values(q)


class TestInvariance:
    @given(placed_pairs(), st.floats(-100, 100))
    def test_gaps_do_not_change_along_the_drum(self, drawn, lift):
        pair, q = drawn
        moved = q + lift * np.array([0, 1, 0] * 2)
        np.testing.assert_allclose(gaps(pair, moved), gaps(pair, q), atol=tolerance(pair))

    @given(placed_pairs(plane=False), st.floats(-10, 10), st.integers(-2, 2))
    def test_gaps_do_not_change_when_the_drum_turns(self, drawn, turn, winding):
        pair, q = drawn
        moved = (
            q + turn * np.array([1, 0, 0] * 2) + winding * math.tau * np.array([0, 0, 0, 1, 0, 0])
        )
        np.testing.assert_allclose(gaps(pair, moved), gaps(pair, q), atol=tolerance(pair))
        wrapped = pair.manifold.wrap(moved)
        np.testing.assert_allclose(gaps(pair, wrapped), gaps(pair, q), atol=tolerance(pair))

    @given(placed_pairs(plane=True), st.floats(-20, 20), st.floats(-20, 20), st.floats(-4, 4))
    def test_in_the_plane_gaps_do_not_change_under_any_motion(self, drawn, right, up, turn):
        """Headings are measured from the y axis towards x: a turn by ``turn`` adds it to them."""
        pair, q = drawn
        rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        moved = q.copy()
        for k in (0, 3):
            moved[k : k + 2] = rotation @ q[k : k + 2] + [right, up]
            moved[k + 2] += turn
        np.testing.assert_allclose(gaps(pair, moved), gaps(pair, q), atol=tolerance(pair))

    @given(placed_pairs())
    def test_a_mirror_keeps_every_gap(self, drawn):
        pair, q = drawn
        np.testing.assert_allclose(gaps(pair, pair.mirror(q)), gaps(pair, q), atol=tolerance(pair))
        reflected = pair.ball_centres(q) * np.array([-1, 1, 1])
        size = np.abs(reflected).max()
        np.testing.assert_allclose(pair.ball_centres(pair.mirror(q)), reflected, atol=1e-12 * size)

    @given(placed_pairs())
    def test_swapping_the_dumbbells_swaps_the_labels(self, drawn):
        pair, q = drawn
        swapped = gaps(pair, pair.swap(q))
        np.testing.assert_allclose(swapped, gaps(pair, q)[SWAPPED], atol=tolerance(pair))
        assert np.array_equal(pair.ball_centres(pair.swap(q)), pair.ball_centres(q)[[2, 3, 0, 1]])

    @given(placed_pairs(), st.sampled_from(["A", "B"]))
    def test_a_half_turn_swaps_the_balls_of_one_dumbbell(self, drawn, which):
        pair, q = drawn
        turned = pair.half_turn(q, which)
        np.testing.assert_allclose(
            gaps(pair, turned), gaps(pair, q)[TURNED[which]], atol=tolerance(pair)
        )
        order = [1, 0, 2, 3] if which == "A" else [0, 1, 3, 2]
        before = pair.ball_centres(q)
        np.testing.assert_allclose(
            pair.ball_centres(turned), before[order], atol=1e-12 * abs(before).max()
        )

    @given(placed_pairs(weighted=True), st.sampled_from(["A", "B"]))
    def test_the_energy_does_not_know_the_labels(self, drawn, which):
        pair, q = drawn
        for other in (pair.mirror(q), pair.swap(q), pair.half_turn(q, which), pair.canonical(q)):
            assert pair.energy.value(other) == pytest.approx(pair.energy.value(q), rel=1e-9)

    @given(placed_pairs())
    def test_involutions_undo_themselves(self, drawn):
        pair, q = drawn
        for move in (pair.mirror, pair.swap, lambda p: pair.half_turn(p, "A")):
            assert np.abs(pair.manifold.difference(move(move(q)), q)).max() <= 1e-12 * (
                1 + abs(q).max()
            )

    @given(pairs(), st.integers(0, 5), st.data())
    def test_moves_of_a_batch_are_moves_of_its_points(self, pair, count, data):
        q = np.array([data.draw(placements(pair)) for _ in range(count)]).reshape(-1, 6)
        moves = (pair.mirror, pair.swap, pair.canonical, lambda p: pair.half_turn(p, "B"))
        for move in (*moves, pair.heading, pair.ball_centres, pair.developed):
            whole = move(q)
            assert all(np.array_equal(row, move(p)) for row, p in zip(whole, q, strict=True))


class TestPlaneLimit:
    """Between a placement in the drum and the same one in the plane, as the drum grows."""

    RADII = 200.0 * 2.0 ** np.arange(6)
    PLANE = DumbbellPair(16, 3, 1.5, rod_weight=1.5)

    def drums(self):
        return [DumbbellPair(16, 3, 1.5, rho + 3, rod_weight=1.5) for rho in self.RADII]

    def developed(self, q, pair):
        return np.asarray(q) * np.array([1 / pair.centre_radius, 1, 1] * 2)

    def order(self, errors):
        return oracles.observed_order(errors, 1 / self.RADII, 1e-11)

    @pytest.mark.parametrize(
        "q", [[0.4, 0, 0.3, 5.6, 11, 0.4], [2, 0, -0.5, 14, 3, 1.2], [0, 1, 1.4, 3, -14, 0.1]]
    )
    def test_separate_bodies_approach_with_order_two(self, q):
        """A chord falls short of its arc by the square of the curvature."""
        flat = gaps(self.PLANE, q)
        curved = np.array([gaps(drum, self.developed(q, drum)) for drum in self.drums()])
        for i, name in enumerate(NAMES):
            assert self.order(abs(curved[:, i] - flat[i])) == pytest.approx(2, abs=0.1), name

    def test_crossed_rods_approach_with_order_one(self):
        """Where rods cross, their chords are apart by the difference of two sagittas."""
        q = [0.0, 0.0, 0.2, 1.0, 2.0, 1.5]
        flat = gaps(self.PLANE, q)
        curved = np.array([gaps(drum, self.developed(q, drum)) for drum in self.drums()])
        assert self.order(abs(curved[:, 8] - flat[8])) == pytest.approx(1, abs=0.1)
        for i in range(8):
            assert self.order(abs(curved[:, i] - flat[i])) == pytest.approx(2, abs=0.1)

    def test_the_energy_above_its_lowest_times_the_radius_approaches_the_trough(self):
        q = [3.0, 0.0, 0.5, -7.0, 11.0, -0.2]
        errors = []
        for drum in self.drums():
            lowest = drum.energy.value([0.0] * 6)
            above = drum.energy.value(self.developed(q, drum)) - lowest
            errors.append(abs(drum.centre_radius * above - self.PLANE.energy.value(q)))
        assert oracles.observed_order(errors, 1 / self.RADII, 1e-8) == pytest.approx(2, abs=0.1)

    @given(st.data())
    def test_developing_the_drum_keeps_arcs(self, data):
        """Developed centres are azimuths times the radius, less that of the middle of the pair."""
        pair = data.draw(pairs(plane=False))
        q = data.draw(placements(pair, reach=0.5))
        centres = oracles.balls(pair, q)
        azimuth = np.arctan2(centres[:, 0], -centres[:, 2])
        expected = np.angle(np.exp(1j * (azimuth - (q[0] + q[3]) / 2)))
        developed = pair.developed(q)
        cut = math.pi - np.abs(expected).max() < 1e-6 or math.pi - abs(q[0] - q[3]) < 1e-3
        if not cut:
            np.testing.assert_allclose(developed[:, 0] / pair.centre_radius, expected, atol=1e-9)
        np.testing.assert_allclose(developed[:, 1], centres[:, 1], atol=1e-12)
