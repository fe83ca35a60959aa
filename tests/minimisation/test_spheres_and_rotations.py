"""Minima on spheres and rotations: eigenvectors, polygons, packings, Wahba's problem, poses."""

import math
from itertools import combinations, product

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from polycorner import (
    Manifold,
    Polyhedron,
    SmoothFunction,
    Verdict,
    certify,
    minima,
    minimise,
    sensitivity,
    stratum_at,
)
from polycorner.polyhedra import LocalType

SPHERE, ROTATION = Manifold.sphere("u"), Manifold.rotation("a")
u = SPHERE.symbols
R = ROTATION.matrix()
WHOLE, TURNS = Polyhedron(SPHERE, {}), Polyhedron(ROTATION, {})
OCTANT = Polyhedron(SPHERE, dict(zip("xyz", u, strict=True)))

seeds = st.integers(0, 2**32 - 1)
METHODS = pytest.mark.parametrize("method", ["newton", "slsqp", "scp"])


def on_sphere(rng):
    return SPHERE.wrap(rng.standard_normal(3))


class TestStrata:
    def test_dimension_and_rank_are_those_on_the_sphere(self):
        corner, edge, face = ([0, 0, 1], [0, 0.6, 0.8], [0.48, 0.64, 0.6])
        for q, dimension in ((corner, 0), (edge, 1), (face, 2)):
            found = stratum_at(OCTANT, q)
            assert (found.dimension, found.rank) == (dimension, 2 - dimension)
        assert stratum_at(OCTANT, face).local_type is LocalType.INTERIOR

    def test_membership_does_not_count_rounding_of_the_length(self):
        assert OCTANT.contains([0.577, 0.577, 0.577])
        assert not OCTANT.contains([0.6, -0.8, 0.0])
        with pytest.raises(ValueError, match=r"expected a vector .* length 1"):
            OCTANT.contains([1.0, 1.0, 1.0])

    def test_the_length_is_no_equation_of_the_user(self):
        assert OCTANT.stated == ()
        assert "|u|" not in str(OCTANT)
        assert "equation" not in repr(OCTANT)
        assert "the unit vector (ux, uy, uz)" in str(OCTANT)


class TestEigenvectors:
    """The stationary points of ``x.A.x`` on the sphere are eigenvectors."""

    @given(seeds)
    @settings(max_examples=20)
    def test_the_minimum_is_the_least_eigenvalue(self, seed):
        rng = np.random.default_rng(seed)
        A = rng.standard_normal((3, 3))
        A = A + A.T
        energy = SmoothFunction(
            "form",
            sum(sp.Symbol(f"A{i}{j}") * u[i] * u[j] for i in range(3) for j in range(3)),
            SPHERE,
            parameters={f"A{i}{j}": A[i, j] for i in range(3) for j in range(3)},
        )
        found = minimise(WHOLE, energy, on_sphere(rng))
        values, vectors = np.linalg.eigh(A)
        assert found.energy == pytest.approx(values[0], abs=1e-9)
        assert SPHERE.distance(found.point, vectors[:, 0]) % math.pi == pytest.approx(
            0, abs=1e-6
        ) or SPHERE.distance(found.point, -vectors[:, 0]) == pytest.approx(0, abs=1e-6)

    @pytest.mark.parametrize(
        ("k", "wells", "verdict"), [(0, 2, "STRICT_MINIMUM"), (1, 1, "SADDLE"), (2, 0, "SADDLE")]
    )
    def test_wells_and_saddles_are_counted_in_two_dimensions(self, k, wells, verdict):
        """Along an eigenvector ``e_j`` the curvature is ``2 (A_j - A_k)``."""
        values = np.array([1.0, 2.0, 5.0])
        c = certify(WHOLE, sum(a * x**2 for a, x in zip(values, u, strict=True)), np.eye(3)[k])
        assert c.verdict.name == verdict
        assert sorted(c.curvatures) == pytest.approx(sorted(2 * (np.delete(values, k) - values[k])))
        assert c.signature == (0, 2, 0)
        assert c.entrapment_counts["U"] == wells
        assert c.multipliers == {}
        assert "|u|" not in str(c) + c.explain()

    def test_all_minima_are_found_once(self):
        found = minima(WHOLE, u[0] ** 2 + 2 * u[1] ** 2 + 3 * u[2] ** 2, starts=40)
        assert len(found) == 2
        assert sorted(c.point[0] for c in found) == pytest.approx([-1, 1])

    def test_a_degenerate_eigenvalue_gives_one_circle_of_minima(self):
        found = minima(WHOLE, u[2] ** 2, starts=40)
        assert len(found) == 1
        assert (found[0].verdict, found[0].signature) == (Verdict.MINIMUM_ALONG_LOCUS, (0, 1, 1))


class TestPolygons:
    """Linear energies on spherical polygons rest in corners, on edges or inside."""

    @METHODS
    def test_a_corner_of_the_octant(self, method):
        c = minimise(OCTANT, u[0] + 2 * u[1] + 3 * u[2], [0.6, 0.6, math.sqrt(0.28)], method=method)
        assert c.point == pytest.approx([1, 0, 0], abs=1e-9)
        assert c.multipliers == pytest.approx({"y": 2, "z": 3}, abs=1e-9)
        assert c.signature == (2, 0, 0)
        assert c.residuals.worst < 1e-12

    @METHODS
    def test_on_an_edge_the_curvature_is_that_of_the_great_circle(self, method):
        """On ``z = 0`` the energy is ``-cos t`` along the circle: half-V across, U along."""
        energy = -(3 * u[0] + 4 * u[1]) / 5 + u[2]
        c = minimise(OCTANT, energy, [0.48, 0.6, 0.64], method=method)
        assert c.point == pytest.approx([0.6, 0.8, 0], abs=1e-9)
        assert c.multipliers == pytest.approx({"z": 1})
        assert c.curvatures == pytest.approx([1.0])
        assert list(c.entrapment_counts.values())[:3] == [1, 0, 1]

    def test_a_small_circle_adds_its_geodesic_curvature(self):
        """On the cap ``u_z <= cos b`` the energy ``-a.u`` has the curvature of its circle."""
        b, tilt = 0.7, 0.3
        cap = Polyhedron(SPHERE, {"cap": sp.Float(math.cos(b)) - u[2]})
        energy = -(math.sin(tilt) * u[0] + math.cos(tilt) * u[2])
        c = minimise(cap, energy, [math.sin(1.0), 0, math.cos(1.0)])
        assert c.point == pytest.approx([math.sin(b), 0, math.cos(b)], abs=1e-9)
        # Around the circle E = -sin(tilt) sin(b) cos(s / sin(b)) + const.
        assert c.curvatures == pytest.approx([math.sin(tilt) / math.sin(b)])
        assert c.multipliers["cap"] == pytest.approx(math.sin(b - tilt) / math.sin(b))


def packing(n):
    """Return points on a sphere that keep ``u_i . u_j <= 1 - t``, and the energy ``-t``."""
    M = SPHERE**n * Manifold.euclidean("t")
    vectors = [sp.Matrix(M.symbols[3 * i : 3 * i + 3]) for i in range(n)]
    gaps = {
        f"{i}{j}": 1 - M.symbols[-1] - vectors[i].dot(vectors[j])
        for i, j in combinations(range(n), 2)
    }
    return Polyhedron(M, gaps), -M.symbols[-1]


def spread(n, rng):
    q = (SPHERE**n).wrap(rng.standard_normal(3 * n)).reshape(n, 3)
    return np.append(q, 1 - (q @ q.T)[np.triu_indices(n, 1)].max())


class TestPackings:
    """Tammes' problem: the largest least distance of ``n`` points ([SvdW])."""

    @pytest.mark.parametrize(("n", "cosine", "free"), [(3, -1 / 2, 3), (4, -1 / 3, 3), (6, 0.0, 3)])
    def test_triangle_tetrahedron_and_octahedron(self, n, cosine, free):
        D, energy = packing(n)
        rng = np.random.default_rng(3)
        found = [minimise(D, energy, spread(n, rng)) for _ in range(3)]
        best = min(found, key=lambda c: c.energy)
        assert 1 + best.energy == pytest.approx(cosine, abs=1e-9)
        assert best.verdict is Verdict.MINIMUM_ALONG_LOCUS  # all rotations of it
        p, q, r = best.signature
        assert (p + q + r, r) == (D.dimension, free)

    def test_the_octahedron_has_twelve_contacts_of_rank_ten(self):
        D, energy = packing(6)
        vertices = np.vstack([np.eye(3), -np.eye(3)]).ravel()
        c = certify(D, energy, np.append(vertices, 1.0))
        assert (len(c.active), c.stratum.rank, c.stratum.dimension) == (12, 10, 3)
        assert c.is_minimum
        assert not c.multipliers_unique


class TestRotations:
    @given(seeds)
    @settings(max_examples=15)
    def test_wahbas_problem_is_solved_by_the_singular_value_decomposition(self, seed):
        """``|A R - B|^2`` is least at ``R = V diag(1, 1, det) U'`` with ``B' A = U S V'``."""
        rng = np.random.default_rng(seed)
        A, B = rng.standard_normal((2, 3, 5))
        moment = A @ B.T
        energy = SmoothFunction(
            "misfit",
            -sum(sp.Symbol(f"m{i}{j}") * R[j, i] for i in range(3) for j in range(3)),
            ROTATION,
            parameters={f"m{i}{j}": moment[i, j] for i in range(3) for j in range(3)},
        )
        c = minimise(TURNS, energy, ROTATION.wrap(rng.standard_normal(4)))
        U, sizes, V = np.linalg.svd(moment.T)
        sign = np.array([1, 1, np.linalg.det(U @ V)])
        assert c.energy == pytest.approx(-sizes @ sign, abs=1e-9)
        found = Rotation.from_quat(c.point, scalar_first=True).as_matrix()
        if sizes[1] + sign[2] * sizes[2] > 0.05:  # else nearly a circle of minima
            assert found == pytest.approx(U * sign @ V, abs=1e-5)

    def test_curvatures_are_by_the_angle_of_the_rotation(self):
        """Of ``-tr(S R)`` at ``R = 1``: about axis ``i`` the sum of the other entries of ``S``."""
        c = certify(TURNS, -(3 * R[0, 0] + 2 * R[1, 1] + R[2, 2]), [1, 0, 0, 0])
        assert sorted(c.curvatures) == pytest.approx([3, 4, 5])
        assert c.signature == (0, 3, 0)

    def test_a_hanging_body_may_turn_about_the_vertical(self):
        """Of a centre of mass ``d`` below the pivot: two wells of curvature ``d``, one free."""
        c = minimise(TURNS, 2 * R[2, 2], ROTATION.wrap([0.2, 1.0, 0.3, 0.1]))
        assert c.energy == pytest.approx(-2)
        assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
        assert c.signature == (0, 2, 1)
        assert sorted(c.curvatures) == pytest.approx([0, 2, 2], abs=1e-9)
        assert len(minima(TURNS, 2 * R[2, 2], starts=20)) == 1

    def test_opposite_quaternions_are_one_minimum(self):
        found = minima(TURNS, -(3 * R[0, 0] + 2 * R[1, 1] + R[2, 2]), starts=20)
        assert found.counts == (20,)
        assert found[0].point == pytest.approx([1, 0, 0, 0], abs=1e-9)

    def test_functions_must_not_tell_opposite_quaternions_apart(self):
        w, x, *_ = ROTATION.symbols
        for wrong in (w, w * x + x, sp.acos(w)):
            with pytest.raises(ValueError, match="the same at the quaternions"):
                Polyhedron(ROTATION, {"f": wrong})
        Polyhedron(ROTATION, {"f": sp.acos(2 * w**2 - 1)})
        Polyhedron(ROTATION, {}, equations={"section": w})  # changes its sign only


def cube(half=1):
    """Return a cube above a floor and beside two walls, and its pose."""
    M = Manifold.euclidean("x y z") * ROTATION
    centre, turn = sp.Matrix(M.symbols[:3]), M.matrix()
    gaps = {}
    for signs in product((-1, 1), repeat=3):
        vertex = centre + turn * sp.Matrix(signs) * half
        label = "".join("-+"[s > 0] for s in signs)
        gaps |= {f"{wall}{label}": vertex[i] for i, wall in enumerate(("west", "south", "floor"))}
    return Polyhedron(M, gaps), centre


class TestPoses:
    """A cube of edge 2 with the six dimensions of position and attitude."""

    REST = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)

    def test_in_a_corner_of_the_room_the_first_order_holds_it(self):
        D, (x, y, z) = cube()
        c = certify(D, x + y + 3 * z, self.REST)
        assert (c.verdict, c.signature) == (Verdict.STRICT_MINIMUM, (6, 0, 0))
        assert (len(c.active), c.stratum.rank, c.stratum.dimension) == (12, 6, 0)

    def test_on_the_floor_it_may_slide_and_turn(self):
        D, (_, _, z) = cube()
        c = certify(D, z, (5.0, 5.0, 1.0, 1.0, 0.0, 0.0, 0.0))
        assert (c.verdict, c.signature) == (Verdict.MINIMUM_ALONG_LOCUS, (3, 0, 3))

    def test_on_an_edge_it_falls(self):
        """The centre at the height ``sqrt 2 cos t`` above two vertices: a saddle of curvature."""
        D, (_, _, z) = cube()
        half = math.pi / 8
        tilted = (5.0, 5.0, math.sqrt(2), math.cos(half), math.sin(half), 0.0, 0.0)
        c = certify(D, z, tilted)
        assert c.verdict is Verdict.SADDLE
        assert min(c.curvatures) == pytest.approx(-math.sqrt(2))

    @METHODS
    def test_descent_leads_into_the_corner(self, method):
        D, (x, y, z) = cube()
        start = ROTATION.shift([1, 0, 0, 0], [0, 0.05, 0.03, -0.04])
        c = minimise(D, x + y + 3 * z, (2.0, 2.2, 2.1, *start), method=method)
        assert c.energy == pytest.approx(5.0, abs=1e-8)
        assert c.verdict is Verdict.STRICT_MINIMUM

    def test_a_tumbler_stands_up_and_rolls_freely(self):
        """A ball with its centre of mass ``d`` off the middle: height half-V, two wells, r = 3."""
        M = Manifold.euclidean("x y z") * ROTATION
        z = M.symbols[2]
        c = minimise(
            Polyhedron(M, {"floor": z - 1}),
            z + M.matrix()[2, 2] / 4,
            M.wrap([0.0, 0.0, 2.0, 0.5, 1.0, 0.2, 0.1]),
        )
        assert c.energy == pytest.approx(0.75)
        assert (c.verdict, c.signature) == (Verdict.MINIMUM_ALONG_LOCUS, (1, 2, 3))
        assert sorted(c.curvatures)[-2:] == pytest.approx([0.25, 0.25])


class TestSensitivity:
    @given(st.floats(-0.3, 0.3))
    @settings(max_examples=15)
    def test_a_moved_wall_moves_the_minimum_as_differences_say(self, height):
        def solved(h):
            wall = SmoothFunction("wall", u[2] - sp.Symbol("h"), SPHERE, parameters={"h": h})
            return minimise(Polyhedron(SPHERE, wall), u[2] + u[0] / 3 + u[1] ** 2, [-0.6, 0.0, 0.8])

        s = sensitivity(solved(height), ["h"])
        step = 1e-5
        above, below = solved(height + step), solved(height - step)
        slope = (above.point - below.point) / (2 * step)
        assert s.point[:, 0] == pytest.approx(slope, abs=1e-6)
        assert s.energy[0] == pytest.approx((above.energy - below.energy) / (2 * step), abs=1e-6)
        change = (above.multipliers["wall"] - below.multipliers["wall"]) / (2 * step)
        assert s.multipliers["wall"][0] == pytest.approx(change, abs=1e-5)
        assert list(s.multipliers) == ["wall"]
        assert s.predict({"h": 1e-3}) == pytest.approx(solved(height + 1e-3).point, abs=1e-5)

    def test_a_rotation_follows_its_load(self):
        """A tilted spring: ``-cos t`` against ``b t`` about one axis, ``sin t = b``."""
        a = ROTATION.symbols
        angle = 2 * sp.atan2(2 * a[0] * a[1], a[0] ** 2 - a[1] ** 2) / 2
        load = sp.Symbol("b")
        energy = SmoothFunction(
            "energy", -R[1, 1] - R[0, 0] - load * R[2, 1], ROTATION, parameters={"b": 0.5}
        )
        c = minimise(TURNS, energy, [1, 0, 0, 0])
        s = sensitivity(c, ["b"])
        # -cos t - b sin t is least at tan t = b.
        turn = float(angle.subs(dict(zip(a, c.point, strict=True))))
        assert turn == pytest.approx(math.atan(0.5))
        assert s.of(angle)[0] == pytest.approx(1 / (1 + 0.25))


class TestArguments:
    def test_a_start_off_the_sphere_is_refused(self):
        for call in (
            lambda q: minimise(OCTANT, u[0], q),
            lambda q: certify(OCTANT, u[0], q),
            lambda q: stratum_at(OCTANT, q),
            lambda q: minima(OCTANT, u[0], starts=[q]),
        ):
            with pytest.raises(ValueError, match=r"expected a vector .* got length 1.4"):
                call([1.0, 1.0, 0.0])

    def test_a_sphere_is_sampled_as_a_whole(self):
        with pytest.raises(ValueError, match="expected None for ux"):
            minima(OCTANT, u[0], starts=10, box=[(0, 1), None, None])


def test_the_largest_cap_that_holds_three_points_is_found_by_bisection_as_well():
    """The least cap around three directions: its centre minimises the largest angle."""
    directions = [SPHERE.wrap(d) for d in ([1, 0.2, 0.5], [0.1, 1, 0.4], [0.3, 0.2, 1])]
    M = SPHERE * Manifold.euclidean("t")
    v, t = sp.Matrix(M.symbols[:3]), M.symbols[-1]
    gaps = {f"d{k}": v.dot(sp.Matrix(d)) - t for k, d in enumerate(directions)}
    c = minimise(Polyhedron(M, gaps), -t, [*SPHERE.wrap([1, 1, 1]), 0.1])
    middle = np.linalg.solve(np.array(directions), np.ones(3))
    assert c.energy == pytest.approx(-1 / np.linalg.norm(middle))
    root = brentq(lambda s: np.linalg.norm(s * middle) - 1, 0.1, 1)
    assert -c.energy == pytest.approx(root)
