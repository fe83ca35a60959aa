"""Skeletons on spheres and rotations: polygons, caps, solid tori, cells, opposite quaternions."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.skeletons import End

SPHERE, ROTATION = Manifold.sphere("u"), Manifold.rotation("a")
u = SPHERE.symbols
R = ROTATION.matrix()
w, x, y, z = ROTATION.symbols


def counts(found):
    return len(found.corners), len(found.edges), len(found.faces)


def triangle(normals):
    return Polyhedron(
        SPHERE,
        {f"n{k}": sum(a * b for a, b in zip(n, u, strict=True)) for k, n in enumerate(normals)},
    )


class TestSphericalPolygons:
    def test_the_octant_has_three_right_angles(self):
        found = skeleton(triangle(np.eye(3)), [SPHERE.wrap([1, 2, 3])])
        assert counts(found) == (3, 3, 1)
        assert [e.length for e in found.edges] == pytest.approx([math.pi / 2] * 3, abs=1e-11)
        assert sorted(tuple(np.abs(c.point).round(12)) for c in found.corners) == [
            (0, 0, 1), (0, 1, 0), (1, 0, 0),
        ]  # fmt: skip
        assert found.euler_characteristic == 1
        assert found.components == {0: 3, 1: 3, 2: 1}

    @given(st.integers(0, 2**32 - 1))
    @settings(max_examples=10)
    def test_the_edges_of_a_triangle_are_arcs_between_its_corners(self, seed):
        rng = np.random.default_rng(seed)
        corners = SPHERE.wrap(np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3)))
        normals = np.linalg.inv(corners).T  # n_i . c_j is zero unless i = j
        found = skeleton(triangle(normals), [SPHERE.wrap(corners.sum(axis=0))])
        assert counts(found) == (3, 3, 1)
        for edge in found.edges:
            one, other = (found.corners[k].point for k in edge.ends)
            assert edge.length == pytest.approx(SPHERE.distance(one, other), abs=1e-10)
        for corner in corners:
            assert min(SPHERE.distance(corner, c.point) for c in found.corners) < 1e-9

    def test_a_lune_has_two_corners_and_edges_of_half_a_turn(self):
        found = skeleton(triangle([[1, 0, 0], [0.6, 0.8, 0]]), [SPHERE.wrap([1, 0.1, 0.2])])
        assert counts(found) == (2, 2, 1)
        assert [e.length for e in found.edges] == pytest.approx([math.pi] * 2, abs=1e-10)

    def test_a_belt_is_bounded_by_two_closed_circles(self):
        belt = Polyhedron(SPHERE, {"north": sp.Rational(3, 5) - u[2], "south": u[2] + 0})
        found = skeleton(belt, [[1.0, 0, 0]])
        assert counts(found) == (0, 2, 1)
        assert all(e.kinds[0] is End.CLOSED for e in found.edges)
        lengths = sorted(e.length for e in found.edges)
        assert lengths == pytest.approx([2 * math.pi * 0.8, 2 * math.pi], abs=1e-9)
        assert found.euler_characteristic == 0

    @pytest.mark.parametrize("axis", range(3))
    def test_a_cap_is_a_disc_and_the_rest_of_the_sphere_as_well(self, axis):
        """Also where a height happens to have its extremum at the first point of the edge."""
        for height in (0.9, *np.linspace(-0.97, 0.97, 13).tolist()):
            cap = Polyhedron(SPHERE, {"cap": u[axis] - height})
            found = skeleton(cap, [np.eye(3)[axis]])
            assert counts(found) == (0, 1, 1)
            assert found.euler_characteristic == 1


class TestRotations:
    def test_rotations_near_one_by_three_axes_form_a_cube(self):
        """Rotations with ``|x|, |y|, |z| <= w tan(pi/8)``: a cube in Rodrigues' vector."""
        side = sp.tan(sp.pi / 8)
        faces = {
            f"{name}{sign:+d}": side * w**2 - sign * v * w
            for name, v in zip("xyz", (x, y, z), strict=True)
            for sign in (1, -1)
        }
        found = skeleton(Polyhedron(ROTATION, faces), [[1, 0, 0, 0]])
        assert counts(found) == (8, 12, 6)
        assert found.euler_characteristic == 2
        t = math.tan(math.pi / 8)
        first, second = (np.array([1, t, t, s * t]) for s in (1, -1))
        cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
        assert [e.length for e in found.edges] == pytest.approx([2 * math.acos(cosine)] * 12)

    def test_a_curve_closes_at_the_opposite_quaternion(self):
        """Where ``R_33 = R_31 = 0`` the body turns about one axis: two circles of one turn."""
        found = skeleton(Polyhedron(ROTATION, {"a": R[2, 2], "b": R[2, 0]}), [[1, 0, 0, 0]])
        assert counts(found) == (0, 2, 2)
        assert [e.length for e in found.edges] == pytest.approx([2 * math.pi] * 2, abs=1e-9)
        for edge in found.edges:
            first, last = edge.polyline[[0, -1]]
            assert ROTATION.distance(first, last) < 1e-6

    def test_edges_that_arrive_at_the_opposite_quaternion_end_at_the_same_corner(self):
        parts = {"a": R[2, 2], "b": R[2, 0], "c": R[0, 0] + sp.Rational(9, 10)}
        found = skeleton(Polyhedron(ROTATION, parts), [[1, 0, 0, 0], [0.5, 0.5, 0.5, 0.5]])
        assert counts(found) == (4, 6, 3)
        assert found.complete.name == "EXHAUSTED"
        turned = 2 * math.acos(-0.9)
        about = sorted(e.length for e in found.edges if set(e.active) == {"a", "b"})
        assert about == pytest.approx([turned] * 2, abs=1e-9)

    @pytest.mark.parametrize("start", [[1, 0, 0, 0], [-1, 0, 0, 0]])
    def test_a_ball_of_rotations_has_a_sphere_as_boundary(self, start):
        ball = Polyhedron(ROTATION, {"angle": w**2 - sp.Rational(3, 4)})
        found = skeleton(ball, [start])
        assert counts(found) == (0, 0, 1)
        assert found.euler_characteristic == 2

    def test_tilts_up_to_an_angle_are_a_solid_torus(self):
        found = skeleton(
            Polyhedron(ROTATION, {"tilt": R[2, 2] - sp.Rational(1, 2)}), [[1, 0, 0, 0]]
        )
        assert counts(found) == (0, 0, 1)
        assert found.euler_characteristic == 0


def test_starts_must_lie_on_the_sphere():
    with pytest.raises(ValueError, match=r"starts: expected a vector .* got length 2"):
        skeleton(triangle(np.eye(3)), [[0, 0, 2]])
