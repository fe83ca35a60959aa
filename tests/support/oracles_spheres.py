"""Clusters of unit spheres from the definition: slow, independent truths.

Graphs are realised from random starts; congruences are found by trying every isomorphism.
"""

import itertools

import networkx as nx
import numpy as np
from networkx.algorithms.isomorphism import GraphMatcher


def pair_distances(centres):
    """Return the matrix of distances of points ``(n, 3)``."""
    return np.linalg.norm(centres[:, None] - centres[None], axis=-1)


def rigidity_matrix(centres, contacts):
    """Return the rows ``(x_i - x_j, x_j - x_i)``, one for each contact."""
    rows = np.zeros((len(contacts), len(centres), 3))
    for row, (i, j) in zip(rows, contacts, strict=True):
        row[i], row[j] = centres[i] - centres[j], centres[j] - centres[i]
    return rows.reshape(len(contacts), -1)


def singular_values_above(matrix, tolerance=1e-7):
    """Return how many singular values exceed a number."""
    return int((np.linalg.svd(matrix, compute_uv=False) > tolerance).sum())


def stress_and_flex(centres, contacts):
    """Return the self-stress and the flex of a cluster that has one of each, and their product.

    With stresses ``w``, flex ``d``: ``sum w_ij |d_i - d_j|^2``, made positive by the sign of ``w``.
    Then the cluster is prestress stable, and along the flex the distance of a contact that is
    released grows to second order where its stress is positive and shrinks where it is negative.
    """
    matrix = rigidity_matrix(centres, contacts)
    left, singular, right = np.linalg.svd(matrix)
    full = int((singular > 1e-7).sum())
    (stress,) = left.T[full:]
    motions = [np.tile(axis, len(centres)) for axis in np.eye(3)]
    motions += [np.cross(axis, centres).ravel() for axis in np.eye(3)]
    span = np.linalg.qr(np.array(motions).T)[0]
    flexes = right[full:] - (right[full:] @ span) @ span.T
    _, sizes, directions = np.linalg.svd(flexes)
    assert (sizes > 1e-6).sum() == 1
    flex = directions[0].reshape(-1, 3)
    bend = sum(
        w * ((flex[i] - flex[j]) ** 2).sum() for w, (i, j) in zip(stress, contacts, strict=True)
    )
    return np.sign(bend) * stress, flex, abs(bend)


def contact_graph(centres, tolerance=1e-7):
    """Return which of the unit spheres touch."""
    near = np.argwhere(abs(pair_distances(centres) - 1) < tolerance)
    graph = nx.empty_graph(len(centres))
    graph.add_edges_from((int(i), int(j)) for i, j in near if i < j)
    return graph


def realisations(graph, rng, *, starts=24, steps=150):
    """Return clusters of unit spheres with exactly these contacts, one of each congruence class.

    Newton's method with a vanishing regularisation from random starts, on the squared distances
    of contacts and of pairs that overlap.
    """
    n = graph.number_of_nodes()
    pairs = list(itertools.combinations(range(n), 2))
    first, second = (np.array(side) for side in zip(*pairs, strict=True))
    touching = np.array([graph.has_edge(*pair) for pair in pairs])
    X = rng.standard_normal((starts, n, 3))
    slots = np.arange(len(pairs))
    for _ in range(steps):
        away = X[:, first] - X[:, second]
        gap = (away**2).sum(axis=2) - 1
        active = touching | (gap < 0)
        r = np.where(active, gap, 0.0)
        J = np.zeros((starts, len(pairs), n, 3))
        J[:, slots, first], J[:, slots, second] = 2 * away, -2 * away
        J = np.where(active[..., None, None], J, 0.0).reshape(starts, len(pairs), 3 * n)
        damping = 1e-12 + 0.1 * (r**2).sum(axis=1)
        normal = np.swapaxes(J, 1, 2) @ J + damping[:, None, None] * np.eye(3 * n)
        step = np.linalg.solve(normal, np.swapaxes(J, 1, 2) @ r[..., None])
        X = X - step.reshape(starts, n, 3)
    found = {}
    for centres in X:
        distances = pair_distances(centres)[first, second]
        exact = abs(distances[touching] - 1).max() < 1e-9
        if exact and distances[~touching].min(initial=2.0) > 1 + 1e-6:
            found.setdefault(tuple(np.sort(distances).round(6)), centres)
    return list(found.values())


def rigid_clusters(n, contacts, rng):
    """Return all clusters of ``n <= 7`` unit spheres with a given number of contacts.

    Graphs with a sphere that touches fewer than three others are left out: it could move.
    """
    graphs = [
        graph
        for graph in nx.graph_atlas_g()
        if graph.number_of_nodes() == n
        and graph.number_of_edges() == contacts
        and min(dict(graph.degree).values()) >= 3
    ]
    return [centres for graph in graphs for centres in realisations(graph, rng)]


def contact_orbits(centres):
    """Return how many kinds of contacts a cluster has under its own congruences."""
    graph = contact_graph(centres)
    alike = nx.Graph()
    alike.add_nodes_from(frozenset(pair) for pair in graph.edges)
    for image in congruences(graph, graph, pair_distances(centres), pair_distances(centres)):
        for i, j in graph.edges:
            alike.add_edge(frozenset((i, j)), frozenset((image[i], image[j])))
    return nx.number_connected_components(alike)


def congruences(one, other, apart, away, **match):
    """Yield relabellings between graphs of points that keep all distances, mirrored or not."""
    for image in GraphMatcher(one, other, **match).isomorphisms_iter():
        order = [image[i] for i in range(len(apart))]
        if abs(away[np.ix_(order, order)] - apart).max() < 1e-6:
            yield image


def broken_contact(centres, held):
    """Return the contact graph at the end of an edge; ``held`` says which contacts it keeps."""
    graph = contact_graph(centres, 1e-6)
    for i, j in graph.edges:
        graph.edges[i, j]["held"] = (i, j) in held or (j, i) in held
    return graph


def same_ends(one, other):
    """Whether a congruence carries one end of an edge to another one, as ``(centres, held)``."""
    graphs = [broken_contact(*end) for end in (one, other)]
    apart, away = (pair_distances(centres) for centres, _ in (one, other))
    if abs(np.sort(apart.ravel()) - np.sort(away.ravel())).max() > 1e-5:
        return False
    return any(
        True
        for _ in congruences(*graphs, apart, away, edge_match=lambda a, b: a["held"] == b["held"])
    )


def isomorphism_classes(graphs):
    """Return positions of graphs, put together where they are isomorphic."""
    found = {}
    for k, graph in enumerate(graphs):
        key = tuple(sorted(dict(graph.degree).values())), sum(nx.triangles(graph).values())
        known = found.setdefault(key, [])
        for group in known:
            if nx.is_isomorphic(graph, graphs[group[0]]):
                group.append(k)
                break
        else:
            known.append([k])
    return [group for known in found.values() for group in known]


def without_one_contact(graphs):
    """Return the graphs with one contact less, one of each isomorphism class.

    Where a graph says which of its contacts are ``breakable``, only those.
    """
    smaller = []
    for graph in graphs:
        for pair in graph.graph.get("breakable", graph.edges):
            less = nx.Graph(graph.edges)
            less.remove_edge(*pair)
            smaller.append(less)
    return [smaller[group[0]] for group in isomorphism_classes(smaller)]
