"""Spheres and rotations: exponentials against their definitions, matrices, products, refusals."""

import math
import pickle

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycorner import Manifold

SPHERE, ROTATION = Manifold.sphere("u"), Manifold.rotation("a")
POSE = Manifold.euclidean("x y z", scale=10.0, unit="mm") * ROTATION
MIXED = Manifold(("phi",), periods=(math.tau,)) * Manifold.sphere("p q r s") * ROTATION
SPACES = pytest.mark.parametrize("M", [SPHERE, ROTATION, POSE, MIXED, SPHERE * ROTATION**2])

seeds = st.integers(0, 2**32 - 1)


def points(M, seed, count=2):
    """Return random points, vectors and quaternions uniformly distributed."""
    drawn = np.random.default_rng(seed).standard_normal((count, M.size))
    return M.wrap(drawn)


def turned(a):
    """Return the rotation of a quaternion, by SciPy."""
    return Rotation.from_quat(a, scalar_first=True)


class TestCounts:
    def test_a_point_has_one_coordinate_more_than_dimensions_on_each_factor(self):
        assert (SPHERE.size, SPHERE.dimension) == (3, 2)
        assert (ROTATION.size, ROTATION.dimension) == (4, 3)
        assert (POSE.size, POSE.dimension) == (7, 6)
        assert (MIXED.size, MIXED.dimension) == (9, 7)

    def test_names_may_be_given_one_by_one(self):
        circle = Manifold.sphere("c s")
        assert (circle.names, circle.dimension) == (("c", "s"), 1)
        assert Manifold.rotation("q0 q1 q2 q3").rotations == (("q0", "q1", "q2", "q3"),)

    def test_copies_are_numbered(self):
        two = POSE**2
        assert two.rotations == (("aw1", "ax1", "ay1", "az1"), ("aw2", "ax2", "ay2", "az2"))
        assert two.matrix("a2").free_symbols == set(two.symbols[-4:])

    def test_units_and_scales_are_those_of_the_factors(self):
        assert POSE.units == ("mm",) * 3 + ("",) * 4
        assert POSE.scales == (10.0,) * 3 + (0.5,) * 4


class TestMaps:
    @SPACES
    @given(seeds)
    def test_the_exponential_of_the_logarithm_leads_back(self, M, seed):
        p, q = points(M, seed)
        assert M.distance(M.shift(q, M.difference(p, q)), p) == pytest.approx(0, abs=1e-7)

    @SPACES
    @given(seeds)
    def test_differences_are_tangent(self, M, seed):
        p, q = points(M, seed)
        v, F = M.difference(p, q), M.frame(q)
        assert np.linalg.matrix_rank(F) == M.dimension
        assert F @ np.linalg.lstsq(F, v, rcond=None)[0] == pytest.approx(v, abs=1e-12)

    @SPACES
    @given(seeds)
    def test_distance_is_a_metric(self, M, seed):
        p, q, r = points(M, seed, 3)
        assert M.distance(p, q) == pytest.approx(M.distance(q, p), abs=1e-12)
        assert M.distance(p, r) <= M.distance(p, q) + M.distance(q, r) + 1e-12

    @SPACES
    @given(seeds)
    def test_wrapping_is_idempotent_and_a_chord_leads_to_an_image(self, M, seed):
        p, q = points(M, seed)
        assert M.wrap(M.wrap(p)) == pytest.approx(M.wrap(p), abs=1e-15)
        assert M.distance(M.wrap(q + M.chord(p, q)), p) == pytest.approx(0, abs=1e-7)

    @given(seeds)
    def test_on_the_sphere_the_distance_is_the_angle(self, seed):
        p, q = points(SPHERE, seed)
        angle = math.atan2(np.linalg.norm(np.cross(p, q)), p @ q)
        assert SPHERE.distance(p, q) == pytest.approx(angle, abs=1e-14)

    @given(seeds)
    def test_between_rotations_it_is_the_angle_that_leads_from_one_to_the_other(self, seed):
        p, q = points(ROTATION, seed)
        angle = (turned(p) * turned(q).inv()).magnitude()
        assert ROTATION.distance(p, q) == pytest.approx(angle, abs=1e-7)

    @given(seeds)
    def test_frames_of_rotations_are_angular_velocities_in_the_body(self, seed):
        q, other = points(ROTATION, seed)
        omega = other[:3]
        reached = ROTATION.shift(q, ROTATION.frame(q) @ omega)
        wanted = turned(q) * Rotation.from_rotvec(omega)
        assert turned(reached).as_matrix() == pytest.approx(wanted.as_matrix(), abs=1e-12)

    @given(seeds)
    def test_frames_of_spheres_are_orthonormal_and_continuous_in_batches(self, seed):
        q = points(SPHERE, seed, 5)
        F = SPHERE.frame(q)
        assert np.einsum("kij,kil->kjl", F, F) == pytest.approx(
            np.tile(np.eye(2), (5, 1, 1)), abs=1e-14
        )
        assert np.einsum("kij,ki->kj", F, q) == pytest.approx(0, abs=1e-15)
        assert SPHERE.frame(q[0]) == pytest.approx(F[0], abs=0)

    def test_antipodes_are_half_a_turn_apart(self):
        q = np.array([0.0, 0.6, 0.8])
        assert SPHERE.distance(-q, q) == pytest.approx(math.pi)
        assert SPHERE.distance(SPHERE.shift(q, SPHERE.difference(-q, q)), -q) < 1e-7

    def test_opposite_quaternions_are_one_rotation(self):
        q = np.array([-0.5, 0.5, -0.5, 0.5])
        assert ROTATION.wrap(q).tolist() == [0.5, -0.5, 0.5, -0.5]
        assert ROTATION.wrap([0.0, -0.6, 0.8, 0.0]).tolist() == [0.0, 0.6, -0.8, 0.0]
        assert ROTATION.distance(q, -q) == 0

    def test_lines_and_circles_have_the_same_chords_and_differences(self):
        M = Manifold(("x", "phi"), periods=(math.inf, math.tau))
        p, q = np.array([3.0, 3.0]), np.array([-1.0, -3.0])
        assert M.chord(p, q).tolist() == M.difference(p, q).tolist()


class TestMatrices:
    def test_the_matrix_is_orthogonal_on_unit_quaternions(self):
        R = ROTATION.matrix()
        square = sum(s**2 for s in ROTATION.symbols)
        assert sp.expand(R.T * R - square**2 * sp.eye(3)) == sp.zeros(3)
        assert sp.expand(R.det() - square**3) == 0

    @given(seeds)
    def test_it_is_that_of_scipy(self, seed):
        (q,) = points(ROTATION, seed, 1)
        R = ROTATION.matrix().subs(dict(zip(ROTATION.symbols, q, strict=True)))
        assert np.array(R, dtype=float) == pytest.approx(turned(q).as_matrix(), abs=1e-14)

    def test_the_vector_of_a_sphere_is_a_column(self):
        assert list((SPHERE**2).vector("u2")) == list((SPHERE**2).symbols[3:])


class TestValues:
    @SPACES
    def test_they_are_equal_hashable_and_can_be_pickled(self, M):
        again = pickle.loads(pickle.dumps(M))
        assert again == M
        assert hash(again) == hash(M)
        if "coordinates:" not in repr(M):  # many are told in short
            assert eval(repr(M), {"Manifold": Manifold, "inf": math.inf}) == M

    def test_a_sphere_is_not_the_space_around_it(self):
        assert Manifold.sphere("u") != Manifold.euclidean("ux uy uz")
        assert Manifold.sphere("p q r s") != Manifold.rotation("p q r s", scale=2.0)


class TestRefusals:
    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: ROTATION.wrap([0, 0, 0, 0]), "q: expected a quaternion .* length > 0"),
            (lambda: SPHERE.difference([0, 0, 0], [1, 0, 0]), "p: expected a vector .* > 0"),
            (lambda: SPHERE.shift([0, 0, 0], [1, 0, 0]), "q: expected a vector .* > 0"),
            (lambda: SPHERE.frame([0, 0, 0]), "q: expected a vector .* > 0"),
            (lambda: SPHERE.point([1, 1, 0]), "q: expected a vector .* length 1 .* got .*1.41421"),
            (lambda: SPHERE.point([1, 0]), r"q: expected shape \(..., 3\)"),
            (lambda: POSE.point([0, 0, 0, 1]), r"q: expected shape \(..., 7\)"),
            (SPHERE.matrix, "name: expected a rotation among the factors"),
            (lambda: (ROTATION**2).matrix("a"), "name: expected the name of a rotation: 'a1' or"),
            (lambda: Manifold.rotation("a b c"), "rotations: expected 4 coordinates"),
            (lambda: Manifold("xyz", spheres=["xyz"]), "spheres: expected tuples of names"),
            (lambda: Manifold("x y z", spheres=[("x", "z")]), "spheres: expected two or more"),
            (
                lambda: Manifold("x y z", spheres=[("x", "y"), ("y", "z")]),
                "spheres: expected factors without common names",
            ),
            (lambda: Manifold("x y", (1, 1), spheres=[("x", "y")]), "periods: expected inf"),
            (
                lambda: Manifold("x y", scales=(1, 2), spheres=[("x", "y")]),
                "scales: expected one scale",
            ),
        ],
    )
    def test_one_sentence_names_what_is_wrong(self, call, words):
        with pytest.raises(ValueError, match=words) as error:
            call()
        assert "\n" not in str(error.value)

    def test_a_point_near_the_sphere_is_moved_onto_it(self):
        assert np.linalg.norm(SPHERE.point([0.577, 0.577, 0.577])) == pytest.approx(1, abs=1e-15)
