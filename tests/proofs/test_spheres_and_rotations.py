"""Proofs on spheres and rotations: enclosures of points, energies and multipliers, refusals."""

import math
from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry, certify, minimise, prove
from polycorner.proofs import stationary_points

SPHERE, ROTATION = Manifold.sphere("u"), Manifold.rotation("a")
u = SPHERE.symbols
R = ROTATION.matrix()


def contains(enclosure, value):
    lower, upper = map(Fraction, enclosure)
    return lower <= Fraction(value) <= upper


def about(axis, vector):
    return sp.Matrix(axis).cross(sp.Matrix(vector))


class TestSphere:
    def test_an_eigenvector_is_enclosed(self):
        D = Polyhedron(SPHERE, {})
        p = prove(minimise(D, 2 * u[0] ** 2 + 3 * u[1] ** 2 + u[2] ** 2, [0.6, 0, 0.8]), digits=20)
        assert p.proved
        assert contains(p.enclosures["energy"], 1)
        assert contains(p.enclosures["uz"], 1)
        assert set(p.enclosures) == {"ux", "uy", "uz", "energy"}
        assert "|u|" not in str(p)

    def test_the_length_is_exactly_one(self):
        D = Polyhedron(SPHERE, {"wall": u[2] - sp.Rational(1, 3)})
        p = prove(minimise(D, u[2] + u[0] / 3, [-0.6, 0, 0.8]), digits=30)
        assert p.proved
        assert contains(p.enclosures["uz"], Fraction(1, 3))
        lower, upper = map(Fraction, p.enclosures["ux"])
        assert lower**2 >= Fraction(8, 9) >= upper**2
        assert upper < 0
        # On the circle of radius r the multiplier is 1 - cot(latitude) / 3.
        height = sp.Rational(1, 3)
        slope = 1 + height / sp.sqrt(1 - height**2) / 3
        assert contains(p.enclosures["multiplier wall"], Fraction(str(sp.N(slope, 60))))

    def test_a_corner_of_three_walls_is_refuted_for_a_wrong_sign(self):
        octant = Polyhedron(SPHERE, dict(zip("xyz", u, strict=True)))
        assert prove(certify(octant, u[0] + 2 * u[1] + 3 * u[2], [1, 0, 0])).proved
        assert not prove(certify(octant, u[0] - 2 * u[1] + 3 * u[2], [1, 0, 0])).proved

    def test_a_saddle_is_not_proved(self):
        c = certify(Polyhedron(SPHERE, {}), u[0] ** 2 + 2 * u[1] ** 2 + 3 * u[2] ** 2, [0, 1, 0])
        assert not prove(c).proved

    def test_parameters_may_vary_over_an_interval(self):
        wall = SmoothFunction("wall", u[2] - sp.Symbol("h"), SPHERE, parameters={"h": 0.25})
        c = minimise(Polyhedron(SPHERE, wall), u[2] + u[0] / 3, [-0.6, 0, 0.8])
        p = prove(c, parameters={"h": (0.2, 0.3)})
        assert p.proved
        lower, upper = map(float, p.enclosures["ux"])
        assert lower <= -math.sqrt(1 - 0.2**2)
        assert upper >= -math.sqrt(1 - 0.3**2)


class TestPackings:
    @pytest.mark.parametrize(("n", "energy"), [(3, Fraction(-3, 2)), (4, Fraction(-4, 3))])
    def test_triangle_and_tetrahedron_are_optimal_nearby_modulo_rotations(self, n, energy):
        M = SPHERE**n * Manifold.euclidean("t")
        vectors = [sp.Matrix(M.symbols[3 * i : 3 * i + 3]) for i in range(n)]
        gaps = {
            f"{i}{j}": 1 - M.symbols[-1] - vectors[i].dot(vectors[j])
            for i, j in combinations(range(n), 2)
        }
        start = M.onto(np.append(np.random.default_rng(3).standard_normal(3 * n), -1.0))
        c = minimise(Polyhedron(M, gaps), -M.symbols[-1], start)
        axes = np.eye(3, dtype=int).tolist()
        fields = tuple((*(x for v in vectors for x in about(axis, v)), 0) for axis in axes)
        p = prove(c, digits=12, symmetry=Symmetry(fields=fields))
        assert p.proved
        assert contains(p.enclosures["energy"], energy)


class TestRotations:
    def test_the_best_rotation_is_enclosed(self):
        """Of ``-tr(S R)`` with ``S`` a turn about ``z`` with ``tan t = 3/4``, scaled."""
        energy = -(4 * (R[0, 0] + R[1, 1]) + 3 * (R[1, 0] - R[0, 1]) + R[2, 2])
        c = minimise(Polyhedron(ROTATION, {}), energy, [1, 0, 0, 0])
        p = prove(c, digits=25)
        assert p.proved
        assert contains(p.enclosures["energy"], -11)
        half = Fraction(1, 10)  # cos t = 4/5: sin(t/2)^2 = 1/10
        lower, upper = map(Fraction, p.enclosures["az"])
        assert lower**2 <= half <= upper**2
        assert contains(p.enclose(R[0, 0]), Fraction(4, 5))

    def test_a_limit_of_the_tilt_is_a_proved_contact(self):
        D = Polyhedron(ROTATION, {"tilt": R[2, 2] - sp.Rational(3, 5)})
        c = minimise(D, R[2, 0] + R[2, 2] / 10 - R[1, 1], [1, 0, 0, 0])
        p = prove(c, digits=15)
        assert c.active == ("tilt",)
        assert p.proved
        assert float(p.enclosures["multiplier tilt"][0]) > 0

    def test_a_free_turn_needs_its_symmetry(self):
        a = ROTATION.symbols
        c = minimise(Polyhedron(ROTATION, {}), -R[2, 2], ROTATION.wrap([1, 0.1, 0.2, 0.3]))
        assert not prove(c).proved
        turn = (-a[3], -a[2], a[1], a[0])  # (0, e_z) a, a turn about the vertical of space
        p = prove(c, symmetry=Symmetry(fields=(turn,)))
        assert p.proved


class TestBodies:
    def test_a_cube_in_a_corner_of_twelve_contacts_is_proved(self):
        M = Manifold.euclidean("x y z") * ROTATION
        centre, turn = sp.Matrix(M.symbols[:3]), M.matrix()
        vertices = [centre + turn * sp.Matrix(s) for s in product((-1, 1), repeat=3)]
        gaps = {f"{'wsf'[i]}{k}": v[i] for k, v in enumerate(vertices) for i in range(3)}
        energy = centre.dot(sp.Matrix([1, 1, 3]))
        p = prove(certify(Polyhedron(M, gaps), energy, [1, 1, 1, 1, 0, 0, 0]), digits=12)
        assert p.proved
        assert len(p.active) == 6
        assert contains(p.enclosures["energy"], 5)

    def test_a_rod_along_an_edge_of_the_room_is_proved(self):
        """A rod of half-length 1 by its direction: five contacts in the five dimensions."""
        M = Manifold.euclidean("x y z") * SPHERE
        centre, way = sp.Matrix(M.symbols[:3]), M.vector()
        gaps = {
            f"{wall}{end:+d}": (centre + end * way)[i]
            for end in (1, -1)
            for i, wall in enumerate(("west", "south", "floor"))
        }
        energy = centre[0] / 2 + centre[1] / 3 + centre[2]
        c = minimise(Polyhedron(M, gaps), energy, M.wrap([2, 2, 2, 0.5, 0.3, 0.7]))
        assert (c.stratum.dimension, c.signature) == (0, (5, 0, 0))
        p = prove(c, digits=10)
        assert p.proved
        assert contains(p.enclosures["energy"], Fraction(1, 2))
        assert contains(p.enclosures["multiplier south+1"], Fraction(1, 6))


def test_lists_of_stationary_points_are_of_lines_and_circles():
    D = Polyhedron(SPHERE, {"x": u[0]})
    with pytest.raises(ValueError, match="polyhedron: expected one on lines and circles"):
        stationary_points(D, u[2], box=[(-1, 1)] * 3)
