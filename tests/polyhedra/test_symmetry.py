"""Quotients: skeletons modulo motions and relabellings against skeletons of the whole."""

import itertools
import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_skeletons import orbit_counts
from skeleton_shapes import counts, half_spaces, isomorphic, polytope, space

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry, skeleton
from polycorner.polyhedra import Element
from polycorner.polyhedra.symmetry import renamed

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
few = settings(max_examples=settings.default.max_examples // 4)

# ----------------------------------------------------------------------------- signed permutations


def signed_permutations(n):
    """Return the matrices of the symmetries of the cube."""
    for order in itertools.permutations(range(n)):
        for signs in itertools.product((1, -1), repeat=n):
            matrix = np.zeros((n, n), dtype=int)
            matrix[range(n), order] = signs
            yield matrix


def generated(matrices):
    """Return the group that some matrices generate, the identity left out."""
    n = len(matrices[0])
    group = {tuple(np.eye(n, dtype=int).ravel())}
    new = list(group)
    while new:
        products = {
            tuple((np.reshape(g, (n, n)) @ m).ravel().tolist()) for g in new for m in matrices
        }
        new = list(products - group)
        group |= products
    identity = tuple(np.eye(n, dtype=int).ravel().tolist())
    return [np.reshape(g, (n, n)) for g in sorted(group) if tuple(g) != identity]


def elements(group, rows):
    """Return the elements ``q -> g q`` of a group that permutes ``{q : rows q <= limits}``.

    ``rows_k . q`` takes at ``q`` the value that ``(rows_k g^-1) . q`` takes at ``g q``.
    """
    where = {tuple(row): f"f{k + 1}" for k, row in enumerate(np.asarray(rows).tolist())}
    return tuple(
        Element(
            lambda q, g=g: g @ q,
            {name: where[tuple((np.array(row) @ g.T).tolist())] for row, name in where.items()},
        )
        for g in group
    )


SIDES = np.vstack([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
DIAGONALS = np.array(list(itertools.product((1, -1), repeat=3)))
TRUNCATED = np.vstack([SIDES, DIAGONALS])
LIMITS = np.array([5] * 6 + [11] * 8) / 5
OCTAHEDRAL = list(signed_permutations(3))
SQUARE = np.vstack([np.eye(2, dtype=int), -np.eye(2, dtype=int)])
QUARTER = np.array([[0, -1], [1, 0]])
MIRROR = np.array([[-1, 0], [0, 1]])


@cache
def truncated_cube():
    return skeleton(polytope(TRUNCATED, LIMITS), [[0.1, 0.2, 0.3]])


class TestFiniteGroups:
    def test_the_square_modulo_its_own_group_is_one_corner_one_edge_one_face(self):
        group = elements(generated([QUARTER, MIRROR]), SQUARE)
        assert len(group) == 7
        atlas = skeleton(polytope(SQUARE, [1] * 4), [[0.1, 0.2]], symmetry=Symmetry(elements=group))
        assert counts(atlas) == (1, 1, 1)
        assert atlas.edges[0].length == pytest.approx(2)
        assert atlas.edges[0].is_loop

    @pytest.mark.parametrize(
        ("generators", "expected"),
        [
            ([QUARTER], (1, 1, 1)),
            ([QUARTER @ QUARTER], (2, 2, 1)),
            ([MIRROR], (2, 3, 1)),
            ([MIRROR @ QUARTER], (3, 2, 1)),
            ([MIRROR, -MIRROR], (1, 2, 1)),
        ],
        ids=["quarter turns", "half turn", "mirror", "diagonal mirror", "two mirrors"],
    )
    def test_orbits_on_the_square(self, generators, expected):
        """Counted by hand: four corners and four sides under subgroups of the dihedral group."""
        group = elements(generated(generators), SQUARE)
        D = polytope(SQUARE, [1] * 4)
        atlas = skeleton(D, [[0.1, 0.2]], symmetry=Symmetry(elements=group))
        assert counts(atlas) == expected == orbit_counts(skeleton(D, [[0.1, 0.2]]), group)

    @pytest.mark.parametrize(
        ("rows", "limit"),
        [(SIDES, 1), (DIAGONALS, 1)],
        ids=["cube", "octahedron"],
    )
    def test_regular_polyhedra_modulo_their_group(self, rows, limit):
        group = elements(generated(OCTAHEDRAL), rows)
        assert len(group) == 47
        D = polytope(rows, [limit] * len(rows))
        symmetry = Symmetry(elements=group)
        assert counts(skeleton(D, [[0.1, 0.2, 0.3]], symmetry=symmetry)) == (1, 1, 1)

    @given(st.lists(st.sampled_from(OCTAHEDRAL), min_size=1, max_size=2), st.integers(0, 10**6))
    @few
    def test_orbits_on_the_truncated_cube_are_those_of_the_listed_group(self, generators, seed):
        """24 corners, 36 edges, 14 faces, modulo any subgroup of the cube's group."""
        whole = truncated_cube()
        assert counts(whole) == (24, 36, 14)
        group = elements(generated(generators), TRUNCATED)
        D = whole.polyhedron
        atlas = skeleton(D, [[0.1, 0.2, 0.3]], symmetry=Symmetry(elements=group), rng=seed)
        assert counts(atlas) == orbit_counts(whole, group)
        assert sorted({round(e.length, 9) for e in atlas.edges}) == sorted(
            {round(e.length, 9) for e in whole.edges}
        )

    def test_a_mirror_gives_no_wrong_euler_number(self):
        """The square modulo a mirror is a rectangle: a disc."""
        group = elements(generated([MIRROR]), SQUARE)
        symmetry = Symmetry(elements=group)
        atlas = skeleton(polytope(SQUARE, [1] * 4), [[0.1, 0.2]], symmetry=symmetry)
        assert atlas.euler_characteristic in (None, 1)

    def test_closed_edges_that_a_mirror_exchanges_are_one(self):
        """The caps of a cylinder, modulo the mirror between them."""
        M = Manifold.euclidean("x y z")
        x, y, z = M.symbols
        D = Polyhedron(M, {"wall": 1 - x**2 - y**2, "floor": 1 + z, "lid": 1 - z})
        flip = Element(lambda q: q * [1, 1, -1], {"floor": "lid", "lid": "floor"})
        atlas = skeleton(D, [[0.1, 0.2, 0.3]], symmetry=Symmetry(elements=(flip,)))
        assert len(atlas.edges) == 1
        assert atlas.edges[0].is_closed


# -------------------------------------------------------------------------------- discs in a square

DISTANCE = 0.7


def discs_in_a_square():
    """Return the centres of two discs in the unit square, at least 0.7 apart."""
    M = space(4)
    a, b, c, d = M.symbols
    walls = half_spaces(np.vstack([np.eye(4), -np.eye(4)]), [1] * 4 + [0] * 4)
    apart = SmoothFunction("contact", (a - c) ** 2 + (b - d) ** 2 - DISTANCE**2, M)
    return Polyhedron(M, [*walls, apart])


def square_and_swap():
    """Return the sixteen symmetries of two discs in a square, the identity left out."""
    found = []
    walls = {(axis, high): 1 + axis + 4 * (not high) for axis in range(4) for high in (0, 1)}
    for order in itertools.permutations(range(2)):
        for flips in itertools.product((0, 1), repeat=2):
            for swap in (0, 1):
                where = [2 * (k ^ swap) + order[i] for k in range(2) for i in range(2)]
                flipped = [flips[order[i]] for _ in range(2) for i in range(2)]
                names = {}
                for (axis, high), number in walls.items():
                    image = walls[where[axis], high ^ flipped[axis]]
                    names[f"f{number}"] = f"f{image}"

                def apply(q, where=tuple(where), flipped=tuple(flipped)):
                    image = np.empty(4)
                    for axis in range(4):
                        image[where[axis]] = 1 - q[axis] if flipped[axis] else q[axis]
                    return image

                found.append(Element(apply, names))
    return tuple(g for g in found if any(name != image for name, image in g.names.items()))


class TestDiscsInASquare:
    """Two discs in a box: 12 corners with both in corners, 16 with one against the other."""

    D = discs_in_a_square()
    START = ((0.2, 0.3, 0.8, 0.7),)

    def test_corners_and_edges_counted_by_hand(self):
        """All corners are simple: each has four edges and six faces."""
        atlas = skeleton(self.D, self.START)
        contact = self.D.names[-1]
        touching = [c for c in atlas.corners if contact in c.active]
        assert (len(atlas.corners), len(touching)) == (28, 16)
        assert all(len(c.active) == c.rank == 4 for c in atlas.corners)
        assert len(atlas.edges) == 4 * 28 / 2
        for corner in touching:
            p, q = corner.point[:2], corner.point[2:]
            assert math.dist(p, q) == pytest.approx(DISTANCE)
            assert sorted(sum(abs(w - 0.5) == 0.5 for w in r.round(9)) for r in (p, q)) == [1, 2]
        met = sum(len(curve) for face in atlas.faces for curve in face.boundary)
        assert met == 6 * 28

    def test_the_square_s_symmetries_and_the_exchange_leave_three_corners(self):
        group = square_and_swap()
        assert len(group) == 15
        whole = skeleton(self.D, self.START)
        atlas = skeleton(self.D, self.START, symmetry=Symmetry(elements=group))
        assert counts(atlas) == orbit_counts(whole, group)
        assert len(atlas.corners) == 3


class TestPieces:
    @given(st.integers(0, 10**6))
    @few
    def test_invariance_of_the_functions_is_what_the_elements_say(self, seed):
        """The oracle's own groups: ``names[f]`` takes at the image what ``f`` takes."""
        rng = np.random.default_rng(seed)
        for D, group in (
            (truncated_cube().polyhedron, elements(generated(OCTAHEDRAL), TRUNCATED)),
            (TestDiscsInASquare.D, square_and_swap()),
        ):
            q = rng.standard_normal(D.dimension)
            here = dict(zip(D.names, D.values(q), strict=True))
            for g in group:
                there = dict(zip(D.names, D.values(g.apply(q)), strict=True))
                for name, value in here.items():
                    assert there[g.names.get(name, name)] == pytest.approx(value)

    def test_without_invariants_separation_is_that_of_the_manifold(self):
        M = Manifold(("a", "b"), (math.tau, math.inf), (0.5, 2.0))
        assert Symmetry().separation(M, [3, 1], [-3, 1]) == pytest.approx((math.tau - 6) / 0.5)
        assert Symmetry().separation(M, [3, 4], [-3, 1]) == pytest.approx(1.5)

    def test_directions_are_tangents_in_scale_units(self):
        M = Manifold(("a", "b"), scales=(0.5, 2.0))
        symmetry = Symmetry(tangents=lambda _: np.array([[1.0, 1.0]]))
        np.testing.assert_allclose(symmetry.directions(M, np.zeros(2)), [[2.0, 0.5]])
        assert Symmetry().directions(M, np.zeros(2)).shape == (0, 2)

    def test_relabellings_carry_a_point_to_another(self):
        group = elements(generated([QUARTER, MIRROR]), SQUARE)
        symmetry = Symmetry(elements=group)
        p, q = np.array([0.3, 0.7]), np.array([-0.7, 0.3])
        (names,) = symmetry.relabellings(PLANE, p, q, 1e-9)
        assert names == {"f1": "f2", "f2": "f3", "f3": "f4", "f4": "f1"}
        assert symmetry.relabellings(PLANE, p, np.array([0.3, 0.6]), 1e-9) == []
        assert len(symmetry.relabellings(PLANE, np.zeros(2), np.zeros(2), 1e-9)) == 8

    def test_a_key_that_differs_rules_relabellings_out(self):
        group = elements(generated([MIRROR]), SQUARE)
        symmetry = Symmetry(elements=group, key=lambda q: np.array([abs(q[0]), q[1]]))
        p = np.array([0.3, 0.7])
        assert len(symmetry.relabellings(PLANE, p, p * [-1, 1], 1e-9)) == 1
        assert symmetry.relabellings(PLANE, p, p * [-1, -1], 1e-9) == []

    def test_names_that_are_not_listed_stay(self):
        assert renamed(frozenset("abc"), {"a": "b", "b": "a"}) == frozenset("abc")
        assert renamed(frozenset("ac"), {"a": "b", "b": "a"}) == frozenset("bc")

    def test_no_symmetry_is_the_default(self):
        D = polytope(SQUARE, [1] * 4)
        one, other = skeleton(D, [[0.1, 0.2]]), skeleton(D, [[0.1, 0.2]], symmetry=Symmetry())
        assert isomorphic(one, other)


@given(
    st.lists(st.sampled_from([0.0, 0.25, 0.5, 1.0, 3.0, 3.5 - math.tau]), min_size=12, max_size=12)
)
def test_points_that_are_excluded_at_once_are_carried_nowhere(numbers):
    """Also across the ends of a circle, and exactly where no function of the user's decides."""
    ring = Manifold(("r", "a"), periods=(math.inf, math.tau), scales=(1.0, 0.5))
    turned = Element(lambda q: np.array([q[0], q[1] + 0.5]), {"f": "g", "g": "f"})
    points = np.reshape(numbers, (6, 2))
    plain = Symmetry(elements=[turned])
    by_invariant = Symmetry(elements=[turned], invariants=lambda q: q[:1])
    for symmetry in (plain, by_invariant):
        found = symmetry.possible(ring, points[0], points, 1e-6)
        carried = [k for k in range(6) if symmetry.relabellings(ring, points[0], points[k], 1e-6)]
        assert set(carried) <= set(found)
        assert symmetry is by_invariant or carried == found
