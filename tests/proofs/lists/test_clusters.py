"""The proof of all rigid clusters of five, six and seven spheres, against other ways to them."""

import networkx as nx
import numpy as np
import pytest
from networkx.generators.atlas import graph_atlas_g

from examples import ex20_rigid_clusters as proof
from polycorner import skeleton
from polycorner.models import SphereCluster

WHEEL = nx.wheel_graph(6)
PRISM = nx.circular_ladder_graph(3)
PAIRS = nx.complement(nx.disjoint_union(nx.cycle_graph(4), nx.path_graph(2)))


@pytest.mark.parametrize(("count", "clusters"), [(4, 1), (5, 1), (6, 2), (7, 5)])
def test_rigid_clusters(count, clusters):
    """Counts are those of [AMB]; shapes are those that the skeleton of the model reaches."""
    found = proof.main(count)
    assert len(found.clusters) == len({graph for graph, _ in found.clusters}) == clusters
    assert [(s.complete, len(s)) for s in found.searches] == [(True, 0)] * (count == 7)
    shapes = []
    for graph, centres in found.clusters:
        away = centres[:, None] - centres
        rows = np.zeros((graph.size(), count, 3))
        for row, (i, j) in zip(rows, graph.edges, strict=True):
            row[i], row[j] = away[i, j], away[j, i]
        gradients = rows.reshape(graph.size(), -1)
        assert graph.size() == np.linalg.matrix_rank(gradients, tol=1e-3) == 3 * count - 6
        distances = np.linalg.norm(away, axis=2)
        assert np.array_equal(abs(distances - 1) < 1e-12, nx.to_numpy_array(graph, range(count)))
        shapes.append(np.sort(distances[np.triu_indices(count, 1)]))
    model = SphereCluster(count)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    traced = [np.sort(model.distances(corner.point)) for corner in atlas.corners]
    assert len(traced) == clusters
    assert all(min(abs(x - y).max() for y in traced) < 1e-6 for x in shapes)


def test_graphs_that_are_excluded_by_hand():
    """Below six spheres there are none; of seven the theorem does not speak."""
    assert not any(proof.main(count).fewer for count in (4, 5))
    left = proof.main(6).fewer
    assert len(left) == 3
    assert all(any(nx.is_isomorphic(g, h) for g in left) for h in (WHEEL, PRISM, PAIRS))


@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_graphs_are_those_of_the_atlas_of_graphs(count):
    graphs = proof.contact_graphs(count)
    listed = [g for g in graph_atlas_g() if len(g) == count and min(dict(g.degree).values()) >= 3]
    assert len(graphs) == len(listed)
    assert all(any(nx.is_isomorphic(g, h) for h in graphs) for g in listed)


def test_the_octahedron_by_its_angles():
    """It and its mirror image are the only corners, as (b) says."""
    found = proof.corners_on_circles(proof.BASES[1][0])
    assert (found.complete, len(found)) == (True, 2)
    assert np.allclose(np.cos([p.point for p in found]), -1 / 3)


def test_places_that_touch_three():
    a, b, c, d = proof.TETRAHEDRON
    both = proof.places(a, b, c)
    assert len(both) == 2
    assert d in both
    assert all(proof.gap(x, y) == 0 for x in both for y in (a, b, c))
    assert not proof.places(a, b, 2 * b)  # on a line
    assert not proof.places(a, 2 * b, 2 * c)  # too far apart
