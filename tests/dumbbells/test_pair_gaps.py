"""The nine gaps against minimisation, dense sampling, a collision library, and long arithmetic."""

import dataclasses
import math

import numpy as np
import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import pairs, placed_pairs

from polycorner.bodies import Arrangement, capsule, compound, sphere
from polycorner.dumbbells import DumbbellPair

DRUM = DumbbellPair(16, 3, 1.5, 125, rod_weight=0.5)
PLANE = DumbbellPair(16, 3, 1.5, rod_weight=0.5)
BOTH = pytest.mark.parametrize("pair", [DRUM, PLANE], ids=["drum", "plane"])

# Across, along (mm) and both headings of general placements, away from every change of branch.
GENERAL = {
    "nested": (5.1, 11.7, 0.31, 0.27),
    "crossing": (0.7, -1.1, 0.4, 1.9),
    "apart": (14.0, 9.0, -0.8, 2.2),
    "tee": (1.3, 13.2, 0.1, 1.6),
    "side by side": (6.3, 0.4, 0.02, -0.03),
    "the other way round": (5.0, 10.0, 0.2, 0.2 + math.pi - 0.04),
    "steep": (9.0, -7.0, 1.4, 1.7),
}
general = pytest.mark.parametrize("where", GENERAL)


def placed(pair, where):
    across, along, first, second = GENERAL[where]
    side = 1.0 if pair.is_plane else 1 / pair.centre_radius
    return np.array([0.3 * side, 2.5, first, side * (0.3 + across), 2.5 + along, second])


def worth(pair):
    """Return the accuracy of the rod-rod gap: rods within a millionth count as parallel."""
    return 2e-6 * pair.length


# The contacts of two compounds in space, in the order of those of the pair.
IN_SPACE = (
    *("A.1-B.1", "A.1-B.2", "A.2-B.1", "A.2-B.2"),
    *("A.1-B.rod", "A.2-B.rod", "B.1-A.rod", "B.2-A.rod", "A.rod-B.rod"),
)


def in_space(pair, q):
    """Return the middles of both dumbbells and their axes, which end at the first ball."""
    centres = pair.ball_centres(q).reshape(2, 2, 3)
    axes = (centres[:, 0] - centres[:, 1]) / pair.length
    return np.concatenate([centres.mean(axis=1), axes], axis=1).ravel()


@BOTH
@general
def test_gaps_are_those_of_two_rigid_bodies_where_the_drum_puts_them(pair, where):
    ends = [[0, 0, -pair.length / 2], [0, 0, pair.length / 2]]
    balls = {str(k): sphere(pair.ball_radius, at=end) for k, end in enumerate(ends, 1)}
    body = compound({**balls, "rod": capsule(*ends, pair.rod_radius)})
    bodies = Arrangement({"A": body, "B": body})
    q = placed(pair, where)
    values, gradients = bodies.polyhedron.evaluate(in_space(pair, q), 1)
    order = [bodies.polyhedron.names.index(name) for name in IN_SPACE]
    np.testing.assert_allclose(pair.polyhedron.values(q), values[order], rtol=0, atol=1e-12)
    steps = 1e-5 * np.eye(6)
    moving = [(in_space(pair, q + h) - in_space(pair, q - h)) / 2e-5 for h in steps]
    expected = gradients[order] @ np.transpose(moving)
    np.testing.assert_allclose(pair.polyhedron.gradients(q), expected, rtol=0, atol=1e-6)


class TestDefinition:
    def test_contacts_are_named_in_order(self):
        assert DRUM.polyhedron.names == oracles.CONTACTS == PLANE.polyhedron.names

    @given(placed_pairs())
    def test_ball_centres_are_where_the_definition_puts_them(self, drawn):
        pair, q = drawn
        np.testing.assert_allclose(
            pair.ball_centres(q), oracles.balls(pair, q), atol=1e-12 * (1 + abs(q).max())
        )

    @given(placed_pairs(plane=False))
    def test_ball_centres_lie_on_their_cylinder_a_rod_apart(self, drawn):
        pair, q = drawn
        centres = pair.ball_centres(q)
        distance = np.hypot(centres[:, 0], centres[:, 2])
        np.testing.assert_allclose(distance, pair.centre_radius, rtol=1e-12)
        for i in (0, 2):
            apart = np.linalg.norm(centres[i + 1] - centres[i])
            assert apart == pytest.approx(pair.length, rel=1e-10)

    @given(placed_pairs())
    def test_gaps_are_those_of_the_nearest_points(self, drawn):
        """Of balls and rods by projection, of two rods by minimisation."""
        pair, q = drawn
        found, exact = pair.polyhedron.values(q), oracles.gaps(pair, q)
        np.testing.assert_allclose(found[:8], exact[:8], atol=1e-9)
        assert found[8] == pytest.approx(exact[8], abs=worth(pair))

    @BOTH
    @general
    def test_rods_against_densely_sampled_points(self, pair, where):
        q = placed(pair, where)
        sampled, points = oracles.sampled_rod_distance(pair, q, 801), 801
        exact = pair.polyhedron.values(q)[8] + 2 * pair.rod_radius
        assert exact - 1e-9 <= sampled <= exact + pair.length / (points - 1)

    @pytest.mark.parametrize("tilt", [0.0, 1e-4, 1e-6, 1e-8, 1e-10, 1e-14])
    @given(pair=pairs(), heading=st.floats(-math.pi, math.pi), seed=st.integers(0, 2**32 - 1))
    def test_parallel_rods_many_times(self, pair, heading, seed, tilt):
        """Rounding decides whether parallel rods look parallel: ask for many placements at once."""
        rng = np.random.default_rng(seed)
        side = 1.0 if pair.is_plane else 1 / pair.centre_radius
        q = rng.uniform(-1.5, 1.5, (200, 6)) * pair.length * np.array([side, 1, 0] * 2)
        if not pair.is_plane:
            q[:, 3] = q[:, 0]  # chords of one generator's plane are parallel in space
        q[:, 2], q[:, 5] = heading, heading + tilt
        exact = oracles.gaps(pair, q)
        np.testing.assert_allclose(pair.polyhedron.values(q), exact, atol=worth(pair))


class TestCollisionLibrary:
    """Spheres and capsules of an independent library, where it is installed (extra ``test``)."""

    @given(placed_pairs())
    def test_gaps_are_distances_of_bodies_that_collide_where_they_are_negative(self, drawn):
        fcl = pytest.importorskip("fcl")
        pair, q = drawn
        for gap, (first, second) in zip(
            pair.polyhedron.values(q), bodies(fcl, pair, q), strict=True
        ):
            if gap > 1e-3:
                found = fcl.distance(first, second, fcl.DistanceRequest(), fcl.DistanceResult())
                assert found == pytest.approx(gap, abs=worth(pair))
            if abs(gap) > worth(pair):
                hit = fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult())
                assert bool(hit) == (gap < 0)


def bodies(fcl, pair, q):
    """Return the nine pairs of collision objects in the order of the contacts."""
    centres = oracles.balls(pair, q)

    def sphere(centre):
        return fcl.CollisionObject(fcl.Sphere(pair.ball_radius), fcl.Transform(np.eye(3), centre))

    def rod(start, end):
        axis = (end - start) / np.linalg.norm(end - start)
        side = np.cross(np.eye(3)[np.argmin(abs(axis))], axis)
        side /= np.linalg.norm(side)
        frame = np.column_stack([side, np.cross(axis, side), axis])
        shape = fcl.Capsule(pair.rod_radius, pair.length)
        return fcl.CollisionObject(shape, fcl.Transform(frame, (start + end) / 2))

    a1, a2, b1, b2 = (sphere(centre) for centre in centres)
    a, b = rod(*centres[:2]), rod(*centres[2:])
    return [
        *((p, s) for p in (a1, a2) for s in (b1, b2)),
        *((p, b) for p in (a1, a2)),
        *((a, s) for s in (b1, b2)),
        (a, b),
    ]


class TestDerivatives:
    @BOTH
    @general
    def test_gaps_agree_with_long_arithmetic(self, pair, where):
        q = placed(pair, where)
        exact = oracles.differences(lambda p: oracles.long_gaps(pair, p), q)
        oracles.agree(pair.polyhedron.evaluate(q, 2), exact)

    @BOTH
    @general
    def test_the_energy_agrees_with_long_arithmetic(self, pair, where):
        q = placed(pair, where)
        exact = oracles.differences(lambda p: oracles.long_energy(pair, p), q)
        E = pair.energy
        oracles.agree((np.array([E.value(q)]), E.gradient(q)[None], E.hessian(q)[None]), exact)

    @BOTH
    @general
    @pytest.mark.parametrize("seed", [0, 1])
    def test_taylor_errors_have_orders_two_and_three(self, pair, where, seed):
        v = np.random.default_rng(seed).normal(size=6) * pair.manifold.scale_array
        steps = 0.1 * 2.0 ** -np.arange(7)
        E = pair.energy

        def everything(q):
            gaps = pair.polyhedron.evaluate(q, 2)
            energy = (E.value(q), E.gradient(q), E.hessian(q))
            return [np.concatenate([g, np.array([e])]) for g, e in zip(gaps, energy, strict=True)]

        orders = oracles.taylor_orders(everything, placed(pair, where), v, steps)
        for name, (first, second) in zip((*oracles.CONTACTS, "energy"), orders, strict=True):
            assert first > 1.85, name
            assert second > 2.85, name

    @BOTH
    @pytest.mark.parametrize("order", [0, 1, 2])
    def test_hessians_are_symmetric_and_batches_are_their_points(self, pair, order):
        rng = np.random.default_rng(4)
        q = np.array([placed(pair, where) for where in GENERAL] * 4)[:25]
        q += 0.01 * rng.normal(size=q.shape) * pair.manifold.scale_array
        for count in (0, 1, 7, 8, 9, 16, 17, 24, 25):
            batch = pair.polyhedron.evaluate(q[:count], order)
            for i in range(count):
                for rows, alone in zip(batch, pair.polyhedron.evaluate(q[i], order), strict=True):
                    assert rows[i].tobytes() == alone.tobytes()
        if order == 2:
            assert np.array_equal(batch[2], batch[2].swapaxes(-1, -2))

    @BOTH
    def test_the_energy_of_a_batch_is_that_of_its_points(self, pair):
        q = np.array([placed(pair, where) for where in GENERAL] * 3)
        for method in (pair.energy.value, pair.energy.gradient, pair.energy.hessian):
            assert all(np.array_equal(a, method(p)) for a, p in zip(method(q), q, strict=True))


class TestCrossedRods:
    @BOTH
    @pytest.mark.parametrize("angle", [math.pi / 2, 1.2, -1.9])
    def test_crossed_rods_satisfy_all_inequalities_but_the_ninth(self, pair, angle):
        """Rods that cross like an X keep all balls apart: without ``ab`` the set would be wrong."""
        q = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.3 + angle])
        gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q), strict=True))
        assert gaps.pop("ab") < -2 * pair.rod_radius + 1
        assert min(gaps.values()) > 1
        assert not pair.polyhedron.contains(q)

    def test_in_the_plane_crossing_rods_are_at_distance_zero(self):
        q = [0.0, 0.0, 0.0, 1.0, 2.0, 1.5]
        assert PLANE.polyhedron.values(q)[8] == -2 * PLANE.rod_radius
        assert not PLANE.polyhedron.gradients(q)[8].any()


# ----------------------------------------------------------------------------------------- energies


@given(placed_pairs(plane=False))
def test_the_energy_is_the_sum_of_the_heights_of_the_balls(drawn):
    """A centre at azimuth ``a`` is ``R - rho cos a`` above the floor of the drum."""
    pair, q = drawn
    centres = oracles.balls(pair, q)
    azimuth = np.arctan2(centres[:, 0], -centres[:, 2])
    heights = pair.drum_radius - pair.centre_radius * np.cos(azimuth)
    assert pair.energy.value(q) == pytest.approx(heights.sum(), rel=1e-10)


@given(placed_pairs(plane=True))
def test_in_the_plane_it_is_half_the_sum_of_squared_distances_from_the_floor(drawn):
    pair, q = drawn
    lateral = oracles.balls(pair, q)[:, 0]
    assert pair.energy.value(q) == pytest.approx((lateral**2).sum() / 2, rel=1e-10, abs=1e-10)


@given(placed_pairs(), st.floats(0, 5))
def test_a_rod_of_weight_w_multiplies_the_energy_by_one_plus_half_w(drawn, w):
    pair, q = drawn
    weighted = dataclasses.replace(pair, rod_weight=w)
    assert weighted.energy.value(q) == pytest.approx((1 + w / 2) * pair.energy.value(q), rel=1e-12)
    sum_of_heights = weighted.energy.value(q) * weighted.ball_heights_per_energy
    assert sum_of_heights == pytest.approx(pair.energy.value(q), rel=1e-12)


@given(placed_pairs(weighted=True), st.floats(-100, 100), st.floats(-100, 100))
def test_the_energy_does_not_depend_on_the_axial_positions(drawn, first, second):
    pair, q = drawn
    moved = q + np.array([0, first, 0, 0, second, 0])
    assert pair.energy.value(moved) == pair.energy.value(q)
    assert not pair.energy.gradient(q)[[1, 4]].any()


@given(placed_pairs(weighted=True))
def test_lying_along_the_floor_is_lowest(drawn):
    pair, q = drawn
    least = 0.0 if pair.is_plane else (4 + 2 * pair.rod_weight) * pair.ball_radius
    lowest = pair.energy.value([0.0] * 6)
    assert lowest == pytest.approx(least, abs=1e-12 * (1 if pair.is_plane else pair.drum_radius))
    assert pair.energy.value(q) >= lowest - 1e-9 * (1 + lowest)


@given(placed_pairs(weighted=True))
def test_each_dumbbell_has_its_own_share(drawn):
    """``E(A, B) = E(A, A)/2 + E(B, B)/2``: there is no interaction but contact."""
    pair, q = drawn
    alone = [pair.energy.value(np.tile(q[k : k + 3], 2)) / 2 for k in (0, 3)]
    assert pair.energy.value(q) == pytest.approx(sum(alone), rel=1e-12, abs=1e-12)


@given(placed_pairs(plane=False))
def test_a_turn_of_the_drum_by_a_whole_turn_changes_nothing(drawn):
    pair, q = drawn
    turned = q + math.tau * np.array([1, 0, 0, -2, 0, 0])
    assert pair.energy.value(turned) == pytest.approx(pair.energy.value(q), rel=1e-12)
