"""All rigid clusters of five and of six unit spheres, with proof.

A *cluster* is ``n`` points with all distances at least 1; pairs at distance 1 *touch*.  It is
*rigid* if it is isolated, modulo isometries, among all ``n`` points at distance 1 where its pairs
touch: a corner of the polyhedron of :class:`~polycorner.models.SphereCluster`.  It is regular if
the gradients of these distances have rank ``3 n - 6``, which takes as many touching pairs.

Theorem.  Up to isometries (mirror images included) and the order of the spheres, the rigid clusters
in which at least ``3 n - 6`` pairs touch are: for ``n = 5`` the bipyramid; for ``n = 6`` the
octahedron, and three tetrahedra in a row.  They are regular, so these are all regular corners.

Proof.  Each sphere touches three others: of the pairs that touch, at least ``3 n - 8`` would not be
of a sphere that touches two at most.  Of four others there are only 6 pairs, not 7; five would all
have to touch each other, and the complete graph of five is among those that have no realisation
here.  So the pairs that touch are one of ``graphs_of(n)``.

1. Four spheres that touch each other are a tetrahedron, unique up to isometry.  A further one that
   touches three known ones is in one of two places, mirror images in the plane of the three.
   With diameter ``sqrt(2)`` the tetrahedron has whole coordinates, and all places that occur are
   rational; ``realisations`` compares all distances exactly.  All of ``graphs_of(5)`` and all but
   one of ``graphs_of(6)`` can be built like this.
2. The last graph is that of the octahedron: a triangle ``a b c``, and spheres ``a'``, ``b'``,
   ``c'`` that touch each other and, of the triangle, all but the one of the same letter.  They are
   on circles about the sides of the triangle, at angles of which 0 is the place of ``a``, ``b``
   or ``c``.  Where the angle is less than 1.2 either way, ``a`` and ``a'`` overlap; ``corners``
   lists with proof where all pairs of ``a' b' c'`` touch in the box that remains.  (By hand:
   ``b c b' c'`` are on the circle of points that touch ``a`` and ``a'``, and a rhombus with its
   vertices on a circle is a square.)

Not covered are clusters isolated to higher order by fewer than ``3 n - 6`` pairs.
"""

import itertools
import math

import networkx as nx
import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.models import SphereCluster
from polycorner.proofs import corners

TOUCH = 2  # the square of the diameter
TETRAHEDRON = [sympy.Matrix(p) for p in ([0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1])]
OCTAHEDRON = [s * sympy.Matrix(p) for p in ([1, 0, 0], [0, 1, 0], [0, 0, 1]) for s in (1, -1)]
K222 = nx.complement(nx.Graph([(0, 1), (2, 3), (4, 5)]))  # as OCTAHEDRON is numbered


def graphs_of(count):
    """Return the graphs with ``3 n - 6`` edges or more, three at each vertex, up to isomorphism."""
    pairs = list(itertools.combinations(range(count), 2))
    found = []
    for size in range(len(pairs) - (3 * count - 6) + 1):
        for apart in itertools.combinations(pairs, size):
            graph = nx.complete_graph(count)
            graph.remove_edges_from(apart)
            if min(d for _, d in graph.degree) >= 3:
                found += [graph] * (not any(nx.is_isomorphic(graph, other) for other in found))
    return found


def places(a, b, c):
    """Return the points, none, one or two, that touch three given ones, exactly."""
    u, v = b - a, c - a
    w = u.cross(v)
    if w.dot(w) == 0:
        return []  # a sphere about the point meets their line twice at most
    foot = (u.dot(u) * v.cross(w) + v.dot(v) * w.cross(u)) / (2 * w.dot(w))
    rise = sympy.sqrt((TOUCH - foot.dot(foot)) / w.dot(w))
    if rise.is_imaginary:
        return []
    assert rise.is_rational
    return [a + foot + s * rise * w for s in ((1, -1) if rise else (1,))]


def order_of_building(graph):
    """Return four vertices that touch each other and then such that touch three before, or None."""
    for four in itertools.combinations(graph, 4):
        order = list(four) if graph.subgraph(four).size() == 6 else []
        while new := [v for v in graph if v not in order and len({*order} & {*graph[v]}) >= 3]:
            order.append(new[0])
        if len(order) == len(graph):
            return order
    return None


def realisations(graph, order):
    """Return all clusters with exactly these contacts, up to isometry, as places of vertices."""
    partial = [dict(zip(order[:4], TETRAHEDRON, strict=True))]
    for v in order[4:]:
        longer = []
        for known in partial:
            for x in places(*[known[u] for u in graph[v] if u in known][:3]):
                gaps = {u: (x - y).dot(x - y) - TOUCH for u, y in known.items()}
                if all(gap == 0 if graph.has_edge(u, v) else gap > 0 for u, gap in gaps.items()):
                    longer.append({**known, v: x})
        partial = longer
    return [[known[v] for v in sorted(graph)] for known in partial]


def rank(graph, centres):
    """Return the rank of the gradients of the distances of touching pairs, exactly."""
    rows = sympy.zeros(graph.size(), 3 * len(centres))
    for k, (i, j) in enumerate(graph.edges):
        away = (centres[i] - centres[j]).T
        rows[k, 3 * i : 3 * i + 3], rows[k, 3 * j : 3 * j + 3] = away, -away
    return rows.rank()


def built(count):
    """Return clusters that are built exactly, and the graphs that are left."""
    orders = [(graph, order_of_building(graph)) for graph in graphs_of(count)]
    found = [
        (graph, centres)
        for graph, order in orders
        if order is not None
        for centres in realisations(graph, order)
    ]
    return found, [graph for graph, order in orders if order is None]


def angles():
    """Return the torus of three angles and the centres of ``a``, ``b``, ``c`` and of the others."""
    torus = Manifold(("alpha", "beta", "gamma"), (math.tau,) * 3)

    def centre(k, angle):
        turn, root = 2 * sympy.pi * k / 3, sympy.sqrt(3)
        out = (3 * sympy.cos(angle) - 1) / (2 * root)
        height = root / 2 * sympy.sin(angle)
        return sympy.Matrix([out * sympy.cos(turn), out * sympy.sin(turn), height])

    triangle = [centre(k, 0) for k in range(3)]
    return torus, triangle, [centre(k, angle) for k, angle in enumerate(torus.symbols)]


def gap(x, y):
    return sympy.expand((x - y).dot(x - y)) - 1


def test_the_octahedron_is_all_there_is_of_its_graph():
    torus, triangle, others = angles()
    for i, j in itertools.permutations(range(3), 2):
        assert sympy.simplify(gap(triangle[i], triangle[j])) == 0
        assert sympy.simplify(gap(triangle[i], others[j])) == 0  # on the circle, at all angles
    for k, angle in enumerate(torus.symbols):  # |a - a'| grows up to pi; at 1.2 they overlap
        assert sympy.simplify(gap(triangle[k], others[k]) + 1 - 3 * sympy.sin(angle / 2) ** 2) == 0
    side = (1.2, 5.1)
    assert all(3 * math.sin(angle / 2) ** 2 < 1 - 1e-3 for angle in side)
    pairs = {
        f"{names[0]}'{names[1]}'": gap(others[i], others[j])
        for names, (i, j) in zip(
            ("ab", "ac", "bc"), itertools.combinations(range(3), 2), strict=True
        )
    }
    found = corners(Polyhedron(torus, pairs), box=[side] * 3)
    assert found.complete
    assert len(found) == 2

    # Both mirror images of the octahedron are zeros of these functions: they are the two.
    for point, sign in zip(sorted(p.point[0] for p in found), (1, -1), strict=True):
        angle = sign * sympy.acos(sympy.Rational(-1, 3))
        exact = [x.subs(dict.fromkeys(torus.symbols, angle)) for x in others]
        assert all(sympy.simplify(gap(x, y)) == 0 for x, y in itertools.combinations(exact, 2))
        assert all(sympy.simplify(gap(x, y)) == 1 for x, y in zip(exact, triangle, strict=True))
        assert math.isclose(point, float(angle) % math.tau)


@pytest.mark.parametrize(("count", "graphs", "clusters"), [(4, 1, 1), (5, 2, 1), (6, 8, 2)])
def test_rigid_clusters_are_those_of_the_literature(count, graphs, clusters):
    """One of four spheres, one of five, two of six ([AMB]), as in the skeleton of the model."""
    found, left = built(count)
    assert len(graphs_of(count)) == graphs
    if count == 6:
        (octahedron,) = left
        assert nx.is_isomorphic(octahedron, K222)
        found.append((K222, OCTAHEDRON))
    else:
        assert not left
    assert len(found) == clusters
    assert all(rank(*cluster) == 3 * count - 6 for cluster in found)
    assert all(graph.size() == 3 * count - 6 for graph, _ in found)

    model = SphereCluster(count)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    shapes = [
        sorted(math.sqrt((x - y).dot(x - y) / TOUCH) for x, y in itertools.combinations(centres, 2))
        for _, centres in found
    ]
    traced = [sorted(model.distances(corner.point).tolist()) for corner in atlas.corners]
    assert np.allclose(sorted(shapes), sorted(traced), atol=1e-6)
