"""Skeletons of polytopes against exhaustion in the fractions; what every skeleton keeps to."""

import itertools
import math
from collections import Counter

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_skeletons import exact_polytope
from scipy.spatial import HalfspaceIntersection
from skeleton_shapes import (
    ball,
    check_incidence,
    counts,
    half_spaces,
    identical,
    isomorphic,
    polytope,
    space,
)

from polycorner import AllOf, Manifold, Polyhedron, skeleton
from polycorner.polyhedra import LocalType
from polycorner.skeletons import Completeness, End

few = settings(max_examples=settings.default.max_examples // 4)
fewest = settings(max_examples=settings.default.max_examples // 8)

SHAPES = ["square", "cube", "4-cube", "triangle", "tetrahedron", "4-simplex", "5-simplex"]
SHAPES += ["octahedron", "4-cross", "pyramid"]
AXES = {n: np.eye(n, dtype=int) for n in range(1, 6)}


def cube(n):
    return np.vstack([AXES[n], -AXES[n]]), np.ones(2 * n, dtype=int)


def simplex(n):
    return np.vstack([-AXES[n], np.ones((1, n), dtype=int)]), np.array([0] * n + [1])


def cross(n):
    rows = np.array(list(itertools.product((1, -1), repeat=n)))
    return rows, np.ones(len(rows), dtype=int)


def pyramid():
    """Return a pyramid over a square; a fifth row touches it along an edge to the apex."""
    rows = [[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1], [1, 1, 2], [0, 0, -1]]
    return np.array(rows), np.array([1, 1, 1, 1, 2, 0])


@st.composite
def integer_polytopes(draw, n, rows):
    """Return bounded polytopes around the origin with small whole numbers: often not simple."""
    entries = st.lists(st.integers(-2, 2), min_size=n, max_size=n).filter(any)
    extra = draw(st.lists(entries, min_size=1, max_size=rows))
    limits = draw(st.lists(st.integers(1, 3), min_size=len(extra), max_size=len(extra)))
    box, sides = cube(n)
    return np.vstack([box, extra]), np.concatenate([2 * sides, limits])


def agrees(atlas, rows, limits):
    """Assert that a skeleton is that of ``{q : rows q <= limits}``, from the exact one."""
    exact = exact_polytope(rows, limits)
    n = len(rows[0])
    D = atlas.polyhedron
    named = {
        tuple(map(float, q)): {D.names[i] for i in tight} for q, tight in exact.vertices.items()
    }
    assert len(atlas.corners) == len(named)
    position = []
    for corner in atlas.corners:
        q = min(named, key=lambda p, q=corner.point: math.dist(p, q))
        assert math.dist(q, corner.point) < 1e-9
        assert set(corner.active) == named[q]
        assert (corner.rank, corner.stratum.dimension, corner.singular) == (n, 0, False)
        expected = LocalType.QUADRANT if len(corner.active) == n else LocalType.CONE
        assert corner.local_type is expected
        position.append(q)
    assert len(set(position)) == len(position)

    straight = {
        frozenset(tuple(map(float, q)) for q in pair): {D.names[i] for i in tight}
        for pair, tight in exact.edges.items()
    }
    found = {frozenset(position[e] for e in edge.ends): edge for edge in atlas.edges}
    assert len(found) == len(atlas.edges)
    assert set(found) == set(straight)
    for pair, edge in found.items():
        assert set(edge.active) == straight[pair]
        assert edge.length == pytest.approx(math.dist(*pair), abs=1e-9)
        assert edge.kinds == (End.CORNER, End.CORNER)
        assert not edge.is_loop

    assert Counter(frozenset(f.active) for f in atlas.faces) == Counter(
        frozenset(D.names[i] for i in tight) for tight in exact.faces
    )
    assert all(face.closed and len(face.boundary) == 1 for face in atlas.faces)
    assert atlas.complete is Completeness.EXHAUSTED
    assert atlas.notes == ()
    return exact


class TestPolytopes:
    @pytest.mark.parametrize(
        ("shape", "expected"),
        [
            (cube(2), (4, 4, 1)),
            (cube(3), (8, 12, 6)),
            (cube(4), (16, 32, 24)),
            (simplex(2), (3, 3, 1)),
            (simplex(3), (4, 6, 4)),
            (simplex(4), (5, 10, 10)),
            (simplex(5), (6, 15, 20)),
            (cross(3), (6, 12, 8)),
            (cross(4), (8, 24, 32)),
            (pyramid(), (5, 8, 5)),
        ],
        ids=SHAPES,
    )
    def test_the_f_vector_is_the_known_one(self, shape, expected):
        rows, limits = shape
        n = len(rows[0])
        atlas = skeleton(polytope(rows, limits), [np.arange(1, n + 1) / 20])
        assert counts(atlas) == expected
        agrees(atlas, rows, limits)
        check_incidence(atlas)

    @given(integer_polytopes(2, 5))
    @few
    def test_polygons_agree_with_exhaustion(self, shape):
        rows, limits = shape
        atlas = skeleton(polytope(rows, limits), [[0.01, 0.02]])
        exact = agrees(atlas, rows, limits)
        assert len(exact.vertices) == len(exact.edges)
        assert atlas.euler_characteristic == 1
        assert atlas.components == {0: len(exact.vertices), 1: len(exact.edges), 2: 1}

    @given(integer_polytopes(3, 5))
    @few
    def test_polytopes_in_space_agree_with_exhaustion(self, shape):
        rows, limits = shape
        atlas = skeleton(polytope(rows, limits), [[0.01, 0.02, -0.015]])
        exact = agrees(atlas, rows, limits)
        corners, edges, faces = counts(atlas)
        assert corners - edges + faces == 2
        assert atlas.euler_characteristic == 2
        assert exact.facets == faces
        assert atlas.components == {0: corners, 1: edges, 2: faces, 3: 1}

    @given(integer_polytopes(4, 3))
    @fewest
    def test_polytopes_in_four_dimensions_agree_with_exhaustion(self, shape):
        rows, limits = shape
        atlas = skeleton(polytope(rows, limits), [[0.01, 0.02, -0.015, 0.005]])
        exact = agrees(atlas, rows, limits)
        corners, edges, faces = counts(atlas)
        assert corners - edges + faces - exact.facets == 0

    @given(st.integers(2, 4), st.integers(0, 10**6))
    @few
    def test_random_simple_polytopes_have_the_vertices_of_qhull(self, n, seed):
        rng = np.random.default_rng(seed)
        normals = rng.standard_normal((n + 2, n))
        rows = np.vstack([normals / np.linalg.norm(normals, axis=1)[:, None], *cube(n)[:1]])
        limits = np.concatenate([np.ones(n + 2), np.full(2 * n, 1.7)])
        hull = HalfspaceIntersection(np.hstack([rows, -limits[:, None]]), np.zeros(n))
        vertices = np.unique(hull.intersections.round(9), axis=0)
        atlas = skeleton(polytope(rows, limits), [np.full(n, 0.01)], rng=seed)
        found = np.array([c.point for c in atlas.corners])
        assert len(found) == len(vertices)
        apart = np.linalg.norm(found[:, None] - vertices[None], axis=2)
        assert apart.min(axis=1).max() < 1e-8
        assert len(atlas.edges) == n * len(vertices) / 2
        met = sum(len(curve) for face in atlas.faces for curve in face.boundary)
        assert met == math.comb(n, 2) * len(vertices)

    def test_a_row_that_only_touches_counts_as_active_and_makes_no_edge(self):
        """A plane through an edge of the cube and one through a corner."""
        rows = np.vstack([cube(3)[0], [[1, 1, 0], [-1, -1, -1]]])
        limits = np.array([1] * 6 + [2, 3])
        atlas = skeleton(polytope(rows, limits), [[0.1, 0.2, 0.3]])
        assert counts(atlas) == (8, 12, 6)
        agrees(atlas, rows, limits)

    def test_a_function_written_twice_changes_nothing_but_names(self):
        once = skeleton(polytope(*cube(3)), [[0.1, 0.2, 0.3]])
        rows, limits = (np.concatenate([part, part]) for part in cube(3))
        twice = skeleton(polytope(rows, 1.0 * limits), [[0.1, 0.2, 0.3]])
        assert counts(twice) == counts(once)
        assert nx.is_isomorphic(twice.graph, once.graph)
        assert twice.euler_characteristic == 2
        agrees(twice, rows, limits)

    @given(scale=st.floats(0.01, 100), shift=st.floats(-5, 5))
    @fewest
    def test_scales_are_a_change_of_units(self, scale, shift):
        """The cube in other units and elsewhere: the same atlas, lengths in scale units."""
        M = Manifold(space(3).names, scales=(scale, 1.0, 1 / scale))
        sizes = np.array(M.scales)
        rows, limits = cube(3)
        planes = half_spaces(rows / sizes, limits + shift * rows.sum(axis=1), M)
        D = Polyhedron(M, AllOf(*planes))
        atlas = skeleton(D, [shift * sizes + 0.1 * sizes])
        assert counts(atlas) == (8, 12, 6)
        assert [e.length for e in atlas.edges] == pytest.approx([2.0] * 12, abs=1e-8)


class TestLowDimension:
    def test_a_segment_has_two_corners_and_an_edge(self):
        atlas = skeleton(polytope([[1], [-1]], [3, 2]), [[0.5]])
        assert counts(atlas) == (2, 1, 0)
        assert sorted(c.point[0] for c in atlas.corners) == pytest.approx([-2, 3])
        assert atlas.edges[0].length == pytest.approx(5)
        assert atlas.edges[0].active == ()
        assert atlas.components == {0: 2, 1: 1}

    def test_a_segment_in_the_plane_is_an_edge_without_a_face(self):
        rows, limits = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]), [0, 0, 1, 1]
        atlas = skeleton(polytope(rows, limits), [[0, 0.3]])
        assert counts(atlas) == (2, 1, 0)
        assert atlas.edges[0].active == ("f1", "f2")
        assert all(c.local_type is LocalType.DEGENERATE for c in atlas.corners)

    def test_a_point_is_a_corner_alone(self):
        atlas = skeleton(polytope(cube(2)[0], [0, 0, 0, 0]), [[0, 0]])
        assert counts(atlas) == (1, 0, 0)
        assert atlas.corners[0].active == ("f1", "f2", "f3", "f4")

    def test_separate_pieces_need_a_start_each(self):
        rows = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        hole = [ball((0, 0), 1.0, "hole", inside=False)]
        D = Polyhedron(space(2), AllOf(*half_spaces(rows, [3, 3, 0.5, 0.5]), *hole))
        left, both = skeleton(D, [[-2, 0]]), skeleton(D, [[-2, 0], [2, 0.1]])
        assert (counts(left), left.components) == ((4, 4, 1), {0: 4, 1: 4, 2: 1})
        assert (counts(both), both.components) == ((8, 8, 2), {0: 8, 1: 8, 2: 2})
        assert both.euler_characteristic == 2
        assert nx.number_connected_components(both.graph) == 2


@pytest.fixture(scope="module")
def atlas():
    return skeleton(polytope(*cube(3)), [[0.1, 0.2, 0.3]])


class TestAnswer:
    def test_the_graph_is_that_of_corners_and_edges(self, atlas):
        graph = atlas.graph
        assert nx.is_isomorphic(nx.Graph(graph), nx.hypercube_graph(3))
        for one, other, data in graph.edges(data=True):
            edge = atlas.edges[data["position"]]
            assert {one, other} == set(edge.ends)
            assert (data["active"], data["length"]) == (edge.active, edge.length)
        assert all(graph.nodes[k]["active"] == c.active for k, c in enumerate(atlas.corners))

    def test_a_corner_tells_what_its_stratum_does(self, atlas):
        for corner in atlas.corners:
            stratum = corner.stratum
            assert (corner.active, corner.rank) == (stratum.active, stratum.rank)
            assert corner.local_type is stratum.local_type
            assert corner.chirality is None

    def test_the_representation_counts_and_says_how_complete_it_is(self, atlas):
        assert repr(atlas) == (
            f"Skeleton(8 corners, 12 edges, 6 faces; {Completeness.EXHAUSTED.value})"
        )

    def test_every_boundary_curve_is_a_circuit_of_its_edges(self, atlas):
        for face in atlas.faces:
            (curve,) = face.boundary
            met = Counter(end for k in curve for end in atlas.edges[k].ends)
            assert set(met.values()) == {2}

    def test_progress_is_told_after_every_step(self):
        told = []
        skeleton(polytope(*cube(3)), [[0.1, 0.2, 0.3]], progress=lambda *now: told.append(now))
        edges, total, notes = zip(*told, strict=True)
        assert (edges[-1], total[-1], notes[-1]) == (12, 12, "8 corners")
        assert all(a <= b <= a + 1 for a, b in itertools.pairwise(edges))
        assert all(done <= expected for done, expected, _ in told)


class TestDeterminism:
    @given(integer_polytopes(3, 4), st.integers(0, 10**6))
    @fewest
    def test_the_same_seed_gives_the_same_skeleton_to_the_last_bit(self, shape, seed):
        D, starts = polytope(*shape), [[0.01, 0.02, 0.0]]
        one, other = (skeleton(D, starts, rng=seed) for _ in range(2))
        assert identical(one, other)
        assert identical(skeleton(D, starts, rng=np.random.default_rng(seed)), one)

    def test_the_default_seed_is_zero(self):
        D = polytope(*cube(3))
        assert identical(skeleton(D, [[0.1, 0, 0]]), skeleton(D, [[0.1, 0, 0]], rng=0))

    @given(integer_polytopes(3, 4), st.lists(st.integers(0, 10**6), min_size=2, max_size=2))
    @fewest
    def test_different_seeds_and_starts_give_isomorphic_skeletons(self, shape, seeds):
        D = polytope(*shape)
        one = skeleton(D, [[0.01, 0.02, 0.0]], rng=seeds[0])
        other = skeleton(D, [[-0.1, 0.02, 0.1], [0.2, 0.1, 0.0]], rng=seeds[1])
        assert isomorphic(one, other)

    @given(st.permutations(range(9)), st.integers(0, 10**6))
    @fewest
    def test_the_order_of_the_functions_does_not_matter(self, order, seed):
        rows = np.vstack([cube(3)[0], [[1, 1, 1], [1, -1, 0], [0, 1, 1]]])
        limits = np.array([2] * 6 + [3, 2, 2])
        planes = half_spaces(rows, limits)
        shuffled = Polyhedron(space(3), AllOf(*(planes[k] for k in order)))
        agrees(skeleton(shuffled, [[0.0, 0.1, 0.2]], rng=seed), rows[order], limits[order])
