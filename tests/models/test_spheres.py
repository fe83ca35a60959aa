"""Sticky spheres: published counts, every cluster re-checked, and an independent enumeration."""

import itertools
import math
from collections import Counter
from functools import lru_cache

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_spheres import (
    contact_graph,
    contact_orbits,
    isomorphism_classes,
    pair_distances,
    rigid_clusters,
    rigidity_matrix,
    same_ends,
    singular_values_above,
    stress_and_flex,
    without_one_contact,
)
from scipy.linalg import null_space
from skeleton_shapes import counts

from polycorner import Symmetry, minimise, skeleton
from polycorner.models import LennardJones
from polycorner.models.spheres import SphereCluster
from polycorner.skeletons import Completeness, End

few = settings(max_examples=settings.default.max_examples // 4)

# Rigid clusters [HC] table I; one- and two-dimensional modes [HGB] table I.
PUBLISHED = {5: (1, 2, 4), 6: (2, 5, 13), 7: (5, 16, 51), 8: (13, 75, 281)}
NINE, TEN = 52, 263
FIVE = SphereCluster(5)


@lru_cache
def atlas_of(count):
    cluster = SphereCluster(count)
    return skeleton(cluster.polyhedron, cluster.starts(), symmetry=cluster.symmetry)


def centres_of(corner):
    return corner.point.reshape(-1, 3)


def contacts_of(active):
    """Return pairs counted from 0 from names such as ``1-2``."""
    return [tuple(int(k) - 1 for k in name.split("-")) for name in active]


def moved(centres, rng, *, mirrored=False):
    """Return the points after a random motion, mirrored or not."""
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn)) * (-1 if mirrored else 1)
    return centres @ turn.T + rng.standard_normal(3)


every_count = pytest.mark.parametrize(
    "count",
    [4, 5, 6, 7, pytest.param(8, marks=pytest.mark.slow), pytest.param(9, marks=pytest.mark.slow)],
)


class TestPublishedCounts:
    @pytest.mark.parametrize("count", [5, 6, 7, pytest.param(8, marks=pytest.mark.slow)])
    def test_corners_edges_and_faces(self, count):
        atlas = atlas_of(count)
        assert counts(atlas) == PUBLISHED[count]
        assert atlas.complete is Completeness.EXHAUSTED
        assert atlas.notes == ()
        corners, edges, faces = PUBLISHED[count]
        assert atlas.components == {6: corners, 7: edges, 8: faces}

    def test_four_spheres_by_hand(self):
        """A tetrahedron; a hinge; a square of contacts, or a triangle with a sphere on a leash."""
        assert counts(atlas_of(4)) == (1, 1, 2)

    @pytest.mark.slow
    def test_nine_spheres_with_the_singular_cluster(self):
        atlas = atlas_of(9)
        assert len(atlas.corners) == NINE
        assert Counter(len(c.active) for c in atlas.corners) == {21: NINE}
        (singular,) = [c for c in atlas.corners if c.singular]
        centres = centres_of(singular)
        matrix = rigidity_matrix(centres, contacts_of(singular.active))
        assert singular_values_above(matrix) == singular.rank == 20
        assert len(singular.active) == 21
        assert not any("second order" in note for note in atlas.notes)
        assert stress_and_flex(centres, contacts_of(singular.active))[2] > 1e-3

    @pytest.mark.slow
    def test_ten_spheres_with_the_cluster_of_fewer_contacts(self):
        """A stress without a sign change on both flexes holds it ([CW] sec. 3)."""
        atlas = atlas_of(10)
        assert atlas.complete is Completeness.EXHAUSTED
        assert len(atlas.corners) == TEN
        assert Counter(len(c.active) for c in atlas.corners) == {23: 1, 24: 259, 25: 3}
        (few,) = [c for c in atlas.corners if len(c.active) == 23]
        centres, contacts = centres_of(few), contacts_of(few.active)
        matrix = rigidity_matrix(centres, contacts)
        assert singular_values_above(matrix) == few.rank == 22
        (stress,) = null_space(matrix.T, rcond=1e-7).T
        motions = np.array([np.kron(np.ones(10), axis) for axis in np.eye(3)])
        turns = np.array([np.cross(axis, centres).ravel() for axis in np.eye(3)])
        flexes = null_space(np.vstack([matrix, motions, turns]), rcond=1e-7).T.reshape(-1, 10, 3)
        form = sum(
            w * np.einsum("aik,bik->ab", *[flexes[:, [i]] - flexes[:, [j]]] * 2)
            for w, (i, j) in zip(stress, contacts, strict=True)
        )
        values = np.linalg.eigvalsh(form)
        assert len(values) == 2
        assert values[0] * values[1] > 0
        assert min(abs(values)) > 1e-2

    @pytest.mark.parametrize(("count", "gap"), [(6, 0.4142), (7, 0.05146)])
    def test_the_smallest_gap_to_a_non_contact(self, count, gap):
        """[HC]: 0.4142 for six spheres (the diagonal of a square), 0.05146 for seven."""
        gaps = []
        for corner in atlas_of(count).corners:
            distances = pair_distances(centres_of(corner))[np.triu_indices(count, 1)]
            gaps.append(min(d - 1 for d in distances if d > 1 + 1e-9))
        assert min(gaps) == pytest.approx(gap, abs=5e-5)


class TestFromTheDefinition:
    @every_count
    def test_every_corner_is_a_rigid_cluster(self, count):
        for corner in atlas_of(count).corners:
            centres, contacts = centres_of(corner), contacts_of(corner.active)
            distances = pair_distances(centres)
            assert all(abs(distances[i, j] - 1) < 1e-9 for i, j in contacts)
            others = set(itertools.combinations(range(count), 2)) - set(contacts)
            assert all(distances[i, j] > 1 + 1e-3 for i, j in others)
            assert len(contacts) == 3 * count - 6
            rank = singular_values_above(rigidity_matrix(centres, contacts))
            assert rank == corner.rank == 3 * count - 6 - corner.singular

    @every_count
    def test_no_two_corners_are_congruent(self, count):
        spectra = [
            np.sort(pair_distances(centres_of(c))[np.triu_indices(count, 1)])
            for c in atlas_of(count).corners
        ]
        for one, other in itertools.combinations(range(len(spectra)), 2):
            if abs(spectra[one] - spectra[other]).max() < 1e-6:
                graphs = [
                    contact_graph(centres_of(atlas_of(count).corners[k])) for k in (one, other)
                ]
                assert not nx.is_isomorphic(*graphs)

    @every_count
    def test_every_edge_is_a_motion_with_one_degree_of_freedom(self, count):
        atlas = atlas_of(count)
        for edge in atlas.edges:
            contacts = contacts_of(edge.active)
            assert len(contacts) == 3 * count - 7
            middle = edge.polyline[len(edge.polyline) // 2].reshape(-1, 3)
            assert singular_values_above(rigidity_matrix(middle, contacts)) == 3 * count - 7
            for q in edge.polyline:
                distances = pair_distances(q.reshape(-1, 3))
                assert all(abs(distances[i, j] - 1) < 1e-9 for i, j in contacts)
                assert distances[np.triu_indices(count, 1)].min() > 1 - 1e-8
            assert edge.kinds == (End.CORNER, End.CORNER)
            for end, q in zip(edge.ends, (edge.polyline[0], edge.polyline[-1]), strict=True):
                here = np.sort(pair_distances(q.reshape(-1, 3)).ravel())
                there = np.sort(pair_distances(centres_of(atlas.corners[end])).ravel())
                np.testing.assert_allclose(here, there, atol=1e-6)

    @every_count
    def test_every_kind_of_contact_that_breaks_begins_one_edge(self, count):
        """Ends of edges, up to congruence, are the orbits of contacts of the clusters."""
        atlas = atlas_of(count)
        kinds = {k: [] for k, c in enumerate(atlas.corners) if not c.singular}
        for position, edge in enumerate(atlas.edges):
            held = contacts_of(edge.active)
            for corner, q in zip(edge.ends, (edge.polyline[0], edge.polyline[-1]), strict=True):
                end = (q.reshape(-1, 3), held)
                if corner not in kinds:
                    continue
                for known, owner in kinds[corner]:
                    if same_ends(end, known):
                        assert owner == position
                        break
                else:
                    kinds[corner].append((end, position))
        for corner, ends in kinds.items():
            assert len(ends) == contact_orbits(centres_of(atlas.corners[corner]))
            assert len(atlas.corners[corner].edges) == 3 * count - 6
            assert set(atlas.corners[corner].edges) == {position for _, position in ends}

    @every_count
    def test_modes_are_the_graphs_with_one_and_with_two_contacts_less(self, count):
        """[HGB]: a mode is a set of contacts up to relabelling, here found without geometry.

        At a singular cluster a contact opens only where its stress has the sign of stability,
        then along the flex both ways: two motions may have one set of contacts.
        """
        atlas = atlas_of(count)
        clusters, at_singular = [], set()
        for corner in atlas.corners:
            graph, contacts = contact_graph(centres_of(corner)), contacts_of(corner.active)
            if corner.singular:
                stress, _, _ = stress_and_flex(centres_of(corner), contacts)
                opens = [pair for pair, w in zip(contacts, stress, strict=True) if w > 1e-9]
                graph.graph["breakable"] = opens
                at_singular.update(corner.edges)
            clusters.append(graph)
        hinges = without_one_contact(clusters)
        modes = isomorphism_classes([nx.Graph(contacts_of(e.active)) for e in atlas.edges])
        assert len(hinges) == len(modes)
        assert all(len(mode) == 1 or at_singular.issuperset(mode) for mode in modes)
        if count < 9:
            assert len(without_one_contact(hinges)) == len(atlas.faces)
        for face in atlas.faces:
            assert len(face.active) == 3 * count - 8

    @pytest.mark.parametrize("count", [5, 6, 7])
    def test_corners_are_the_realisable_graphs(self, count):
        """Every graph with 3n - 6 contacts, realised from random starts; and none has more."""
        rng = np.random.default_rng(0)
        found = rigid_clusters(count, 3 * count - 6, rng)
        assert len(found) == PUBLISHED[count][0]
        atlas = atlas_of(count)
        matched = set()
        for centres in found:
            distances = np.sort(pair_distances(centres).ravel())
            for k, corner in enumerate(atlas.corners):
                other = np.sort(pair_distances(centres_of(corner)).ravel())
                if abs(distances - other).max() < 1e-6 and nx.is_isomorphic(
                    contact_graph(centres), contact_graph(centres_of(corner))
                ):
                    matched.add(k)
        assert matched == set(range(len(atlas.corners)))
        if count < 7:
            assert rigid_clusters(count, 3 * count - 5, rng) == []


class TestInvariance:
    @given(st.integers(5, 6), st.integers(0, 10**6), st.booleans())
    @few
    def test_labels_and_place_of_the_start_do_not_matter(self, count, seed, mirrored):
        rng = np.random.default_rng(seed)
        cluster = SphereCluster(count)
        centres = cluster.stacked().reshape(-1, 3)[rng.permutation(count)]
        start = moved(centres, rng, mirrored=mirrored).ravel()
        atlas = skeleton(cluster.polyhedron, [start], symmetry=cluster.symmetry, rng=seed)
        assert counts(atlas) == PUBLISHED[count]
        shapes, expected = (
            sorted(
                np.sort(pair_distances(centres_of(c)).ravel()).round(6).tolist() for c in a.corners
            )
            for a in (atlas, atlas_of(count))
        )
        np.testing.assert_allclose(shapes, expected, atol=2e-6)
        assert nx.is_isomorphic(atlas.graph, atlas_of(count).graph)

    @pytest.mark.parametrize("count", [5, 6])
    def test_any_corner_or_a_loose_heap_will_do_as_a_start(self, count):
        cluster = SphereCluster(count)
        for corner in atlas_of(count).corners:
            atlas = skeleton(cluster.polyhedron, [corner.point], symmetry=cluster.symmetry)
            assert counts(atlas) == PUBLISHED[count]
        heap = 1.3 * cluster.stacked()
        atlas = skeleton(cluster.polyhedron, [heap], symmetry=cluster.symmetry, extent=50)
        assert counts(atlas) == PUBLISHED[count]

    @pytest.mark.parametrize(
        ("count", "clusters"), [(4, 1), pytest.param(5, 10, marks=pytest.mark.slow)]
    )
    def test_without_relabellings_there_are_all_labelled_clusters(self, count, clusters):
        """Of five spheres one pair of ten does not touch; mirror images are one."""
        cluster = SphereCluster(count)
        labelled = Symmetry(cluster.symmetry.tangents, cluster.symmetry.invariants)
        atlas = skeleton(cluster.polyhedron, cluster.starts(), symmetry=labelled)
        apart = {frozenset(cluster.polyhedron.names) - set(c.active) for c in atlas.corners}
        assert len(apart) == len(atlas.corners) == clusters
        assert all(len(names) == math.comb(count, 2) - 3 * count + 6 for names in apart)
        graph = nx.MultiGraph(atlas.graph)
        assert nx.is_connected(graph)


class TestModel:
    @given(st.integers(2, 7), st.integers(0, 10**6))
    def test_functions_are_squared_distances_minus_one(self, count, seed):
        cluster = SphereCluster(count)
        q = np.random.default_rng(seed).standard_normal(3 * count)
        values = dict(zip(cluster.polyhedron.names, cluster.polyhedron.values(q), strict=True))
        centres = q.reshape(-1, 3)
        for i, j in itertools.combinations(range(count), 2):
            gap = ((centres[i] - centres[j]) ** 2).sum() - 1
            assert values[f"{i + 1}-{j + 1}"] == pytest.approx(gap)
        assert len(values) == math.comb(count, 2)

    @given(st.integers(2, 8), st.integers(0, 10**6), st.booleans())
    def test_distances_are_those_of_the_centres_and_do_not_see_motions(self, count, seed, mirrored):
        rng = np.random.default_rng(seed)
        cluster, centres = SphereCluster(count), rng.standard_normal((count, 3))
        found = cluster.distances(centres.ravel())
        assert found.tolist() == pytest.approx(
            [math.dist(centres[i], centres[j]) for i, j in cluster.pairs]
        )
        away = moved(centres, rng, mirrored=mirrored).ravel()
        np.testing.assert_allclose(cluster.distances(away), found, atol=1e-12)
        batch = cluster.distances(np.stack([centres.ravel(), away]))
        assert batch.shape == (2, math.comb(count, 2))

    @pytest.mark.parametrize("count", range(2, 13))
    def test_the_stacked_cluster_is_rigid_and_does_not_overlap(self, count):
        cluster = SphereCluster(count)
        centres = cluster.stacked().reshape(-1, 3)
        contacts = np.argwhere(np.triu(cluster.contacts(centres.ravel())))
        distances = pair_distances(centres)[np.triu_indices(count, 1)]
        assert distances.min() > 1 - 1e-9
        rank = singular_values_above(rigidity_matrix(centres, contacts.tolist()))
        assert rank == {2: 1, 3: 3}.get(count, 3 * count - 6)
        assert cluster.polyhedron.contains(centres.ravel(), tolerance=1e-9)
        assert cluster.starts().shape == (1, 3 * count)

    @given(st.integers(0, 10**6))
    def test_contacts_are_symmetric_and_within_the_tolerance(self, seed):
        rng = np.random.default_rng(seed)
        cluster = SphereCluster(6)
        q = cluster.stacked() + 1e-8 * rng.standard_normal(18)
        touching = cluster.contacts(q)
        assert touching.dtype == bool
        assert (touching == touching.T).all()
        assert not touching.diagonal().any()
        assert touching.sum() == 2 * 12
        np.testing.assert_array_equal(touching, abs(pair_distances(q.reshape(-1, 3)) - 1) <= 1e-6)
        assert cluster.contacts(1.1 * q).sum() == 0

    @given(st.integers(3, 7), st.integers(0, 10**6))
    def test_motions_keep_every_distance_to_first_order(self, count, seed):
        cluster = SphereCluster(count)
        q = np.random.default_rng(seed).standard_normal(3 * count)
        motions = cluster.symmetry.tangents(q)
        assert np.linalg.matrix_rank(motions) == 6
        np.testing.assert_allclose(cluster.polyhedron.gradients(q) @ motions.T, 0, atol=1e-12)

    @given(st.integers(4, 7), st.integers(0, 10**6), st.booleans())
    def test_a_relabelled_cluster_is_recognised(self, count, seed, mirrored):
        """The relabelling found carries every distance to one of the same length."""
        rng = np.random.default_rng(seed)
        cluster, centres = SphereCluster(count), rng.standard_normal((count, 3))
        order = rng.permutation(count)
        p, q = centres.ravel(), moved(centres[order], rng, mirrored=mirrored).ravel()
        (names,) = cluster.symmetry.relabellings(cluster.manifold, p, q, 1e-9)
        there = dict(zip(cluster.polyhedron.names, cluster.distances(q), strict=True))
        here = dict(zip(cluster.polyhedron.names, cluster.distances(p), strict=True))
        assert sorted(names.values()) == sorted(there)
        for name, distance in here.items():
            assert there[names[name]] == pytest.approx(distance)
        stretched = q * 1.01
        assert cluster.symmetry.relabellings(cluster.manifold, p, stretched, 1e-6) == []

    def test_the_octahedron_has_its_48_relabellings(self):
        cluster = SphereCluster(6)
        q = (np.vstack([np.eye(3), -np.eye(3)]) / math.sqrt(2)).ravel()
        found = cluster.symmetry.relabellings(cluster.manifold, q, q, 1e-9)
        assert len(found) == 48
        assert len({tuple(sorted(names.items())) for names in found}) == 48

    @pytest.mark.parametrize("count", [1, 0, -2, 2.0, True, "4", None])
    def test_the_count_is_a_whole_number_of_spheres(self, count):
        with pytest.raises(
            (TypeError, ValueError), match=r"^count: expected a whole number >= 2; "
        ):
            SphereCluster(count)


@given(st.sets(st.sampled_from(sorted(FIVE.polyhedron.names))), st.permutations(range(1, 6)))
def test_one_set_of_contacts_stands_for_all_numberings(contacts, image):
    """Of 34 graphs of five vertices each has one; it is one of its numberings."""
    turned = {"-".join(map(str, sorted(image[int(k) - 1] for k in c.split("-")))) for c in contacts}
    stands = FIVE.symmetry.representative(contacts)
    assert stands == FIVE.symmetry.representative(turned)
    images = (
        {frozenset(p[int(k) - 1] for k in c.split("-")) for c in contacts}
        for p in itertools.permutations(range(1, 6))
    )
    assert {frozenset(map(int, c.split("-"))) for c in stands} in images


def test_there_are_34_sets_of_contacts_of_five_spheres():
    """[OEIS A000088]: graphs of five unlabelled vertices."""
    names = FIVE.polyhedron.names
    sets = (
        itertools.compress(names, bits) for bits in itertools.product((0, 1), repeat=len(names))
    )
    assert len({FIVE.symmetry.representative(some) for some in sets}) == 34


# -------------------------------------------------------------------------------------------- atoms


def definition(q):
    atoms = q.reshape(-1, 3)
    pairs = itertools.combinations(atoms, 2)
    return sum(4 * (r**-12 - r**-6) for r in (np.linalg.norm(a - b) for a, b in pairs))


def test_energy_and_extent_are_those_of_the_definition():
    model, rng = LennardJones(4, 1.5), np.random.default_rng(0)
    for q in model.starts(rng, 8):
        assert model.energy.value(q) == pytest.approx(definition(q))
        atoms = q.reshape(-1, 3)
        square = ((atoms - atoms.mean(axis=0)) ** 2).sum() / 4
        assert model.polyhedron.values(q) == pytest.approx([1.5**2 - square])


def test_turns_and_exchanges_are_symmetries():
    model, rng = LennardJones(4), np.random.default_rng(1)
    p = model.starts(rng, 2)[1]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    q = (p.reshape(-1, 3) @ turn)[rng.permutation(4)].ravel() + 0.3
    assert model.symmetry.relabellings(model.manifold, p, q, 1e-9)
    assert not model.symmetry.relabellings(model.manifold, p, 1.01 * q, 1e-9)
    assert model.energy.value(p) == pytest.approx(model.energy.value(q))


def test_every_fourth_start_is_plane():
    heights = LennardJones(5).starts(np.random.default_rng(0), 9).reshape(9, 5, 3)[:, :, 2]
    assert (~heights.any(axis=1)).nonzero()[0].tolist() == [0, 4, 8]


def test_a_pair_rests_at_the_depth_of_its_well():
    model = LennardJones(2)
    found = minimise(model.polyhedron, model.energy, [0, 0, 0, 1, 0.2, 0.1])
    assert found.energy == pytest.approx(-1)
    assert np.linalg.norm(found.point[3:] - found.point[:3]) == pytest.approx(2 ** (1 / 6))


def test_wrong_parameters_are_refused_by_name():
    for name, wrong in (("count", 1), ("count", 2.5), ("extent", 0.0)):
        with pytest.raises((TypeError, ValueError), match=name):
            LennardJones(**{"count": 3, name: wrong})
