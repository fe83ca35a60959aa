"""All rigid clusters of five, six and seven unit spheres, with proof.

A *cluster* is ``n`` points with all distances at least 1; pairs at distance 1 *touch*.  It is
*rigid* if it is isolated, modulo isometries, among all ``n`` points at distance 1 where its pairs
touch: a corner of the polyhedron of :class:`~polycorner.models.SphereCluster`.  It is regular if
the gradients of these distances have rank ``3 n - 6``, which takes as many touching pairs.

Theorem.  Up to isometries (mirror images included) and the order of the spheres, there are 1, 2
and 5 rigid clusters of ``n`` = 5, 6 and 7 spheres in which at least ``3 n - 6`` pairs touch.  They
are regular, so these are all regular corners.

Not covered are clusters isolated to higher order by fewer than ``3 n - 6`` pairs.

Proof.  (a) Three spheres are touched by two others at most, in places that are mirror images in the
plane of the three.  (They are not on a line, which meets a sphere twice at most.)

(b) Let a ring of ``m`` spheres, each touching the next, all touch two others.  It is on a circle,
and its steps around it have the same length and, as no two places coincide, the same sense.  So it
is a square for ``m = 4``, which with the two others is an octahedron, and a pentagon for ``m = 5``
(in a star neighbours on the circle would overlap).

(c) Each sphere touches three others.  Otherwise ``3 n - 8`` pairs or more would touch among the
other ``n - 1``: 7 of 6, all 10, or 13 of 15, which (d) excludes for five and for six spheres.  So
the pairs that touch are one of ``graphs_of(n)``.

(d) Four spheres that touch each other are a tetrahedron.  With diameter ``sqrt(2)`` it and the
octahedron have whole coordinates.  From one of them ``decided`` places spheres that touch three
known ones, by (a), in rational numbers, and compares all distances exactly.

(e) Two graphs of seven spheres are left.  That with a ring of five has one cluster, by (b).  In the
other three spheres that touch each other are on circles about edges of a tetrahedron, one angle
each.  ``corners`` shows that there is no isolated triple of angles at which all three pairs touch;
it leaves out angles at which one of them overlaps the tetrahedron.  In the same way it finds the
octahedron again: three spheres on circles about the sides of a triangle.
"""

import itertools
import math

import networkx as nx
import numpy as np
import pytest
import sympy
from networkx.algorithms.isomorphism import GraphMatcher

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.models import SphereCluster
from polycorner.proofs import corners

TOUCH = 2  # the square of the diameter
TETRAHEDRON = [sympy.Matrix(p) for p in ([0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1])]
OCTAHEDRON = [s * sympy.Matrix(p) for p in ([1, 0, 0], [0, 1, 0], [0, 0, 1]) for s in (1, -1)]
OPPOSITE = nx.Graph([(0, 1), (2, 3), (4, 5)])
BASES = ((nx.complete_graph(4), TETRAHEDRON), (nx.complement(OPPOSITE), OCTAHEDRON))
RING = nx.complement(nx.disjoint_union(nx.complement(nx.cycle_graph(5)), nx.path_graph(2)))


def graphs_of(count):
    """Return the graphs with ``3 n - 6`` edges or more, three at each vertex, up to isomorphism."""
    apart = [[nx.empty_graph(count)]]
    for _ in range(math.comb(count, 2) - (3 * count - 6)):
        apart.append([])
        for graph, pair in itertools.product(apart[-2], itertools.combinations(range(count), 2)):
            more = nx.Graph(graph)
            more.add_edge(*pair)
            new = more.size() > graph.size() and max(d for _, d in more.degree) <= count - 4
            if new and not any(nx.is_isomorphic(more, other) for other in apart[-1]):
                apart[-1].append(more)
    return [nx.complement(graph) for graphs in apart for graph in graphs]


def places(a, b, c):
    """Return the points, none, one or two, that touch three given ones, exactly."""
    u, v = b - a, c - a
    w = u.cross(v)
    if w.dot(w) == 0:
        return []
    foot = (u.dot(u) * v.cross(w) + v.dot(v) * w.cross(u)) / (2 * w.dot(w))
    rise = sympy.sqrt((TOUCH - foot.dot(foot)) / w.dot(w))
    if rise.is_imaginary:
        return []
    assert rise.is_rational
    return [a + foot + s * rise * w for s in ((1, -1) if rise else (1,))]


def gap(x, y):
    return (x - y).dot(x - y) - TOUCH


def fits(graph, known):
    """Whether pairs of known places touch where they should, and are farther apart elsewhere."""
    gaps = {pair: gap(*(known[v] for v in pair)) for pair in itertools.combinations(known, 2)}
    return all(g == 0 if graph.has_edge(*pair) else g > 0 for pair, g in gaps.items())


def decided(graph):
    """Return all clusters with exactly these contacts, up to isometry, or None if not decided."""
    triples = itertools.combinations(graph, 3)
    if any(len({*graph[i]} & {*graph[j]} & {*graph[k]}) > 2 for i, j, k in triples):
        return []
    for base, centres in BASES:
        maps = GraphMatcher(graph, base).subgraph_monomorphisms_iter()
        for image in {frozenset(each): each for each in maps}.values():
            partial, placed = [{v: centres[k] for v, k in image.items()}], [*image]
            while partial := [known for known in partial if fits(graph, known)]:
                new = [v for v in graph if v not in placed and len({*placed} & {*graph[v]}) > 2]
                if not new:
                    break
                three = [v for v in placed if v in graph[new[0]]][:3]
                placed.append(new[0])
                longer = [(known, places(*(known[v] for v in three))) for known in partial]
                partial = [{**known, new[0]: x} for known, both in longer for x in both]
            if not partial or len(placed) == len(graph):
                return [[known[v] for v in sorted(graph)] for known in partial]
    return None


def on_circles(graph):
    """Return three edges of a triangle or tetrahedron that three touching spheres touch."""
    for three in itertools.combinations(graph, 3):
        base = [v for v in graph if v not in three]
        edges = [[k for k, v in enumerate(base) if graph.has_edge(u, v)] for u in three]
        if graph.subgraph(three).size() == 3 and {*map(len, edges)} == {2}:
            assert graph.subgraph(base).size() == math.comb(len(base), 2)
            return len(base), edges
    raise AssertionError


def corners_on_circles(graph):
    """Return the list of corners of the gaps of the three spheres, in their angles."""
    size, edges = on_circles(graph)
    torus = Manifold(("alpha", "beta", "gamma"), (math.tau,) * 3)
    base, free = TETRAHEDRON[:size], 1.2 if size == 3 else 1.84
    spheres = []
    for (p, q), angle in zip(edges, torus.symbols, strict=True):
        middle = (base[p] + base[q]) / 2
        others = [base[k] for k in range(size) if k not in (p, q)]
        out = sum(others, sympy.zeros(3, 1)) / len(others) - middle
        across = out.cross(base[q] - base[p])
        turned = sympy.cos(angle) * out / out.norm() + sympy.sin(angle) * across / across.norm()
        x = middle + sympy.sqrt(TOUCH * sympy.Rational(3, 4)) * turned
        assert all(sympy.simplify(gap(x, base[k])) == 0 for k in (p, q))
        # Each other sphere is overlapped on one arc, which contains 0 and reaches beyond ``free``.
        gaps = [[float(gap(x, y).subs(angle, at)) for y in others] for at in (-free, 0, free)]
        assert max(min(gaps[0]), *gaps[1], min(gaps[2])) < -1e-3
        spheres.append(x)
    pairs = [sympy.expand(gap(x, y)) for x, y in itertools.combinations(spheres, 2)]
    return corners(Polyhedron(torus, pairs), box=[(free, math.tau - free)] * 3)


def ring_of_five():
    """Return a pentagon with sides that touch, and the two spheres that touch all of it."""
    radius = math.sqrt(TOUCH) / (2 * math.sin(math.pi / 5))
    ring = [radius * np.exp(2j * math.pi * k / 5) for k in range(5)]
    poles = [[0, 0, side * math.sqrt(TOUCH - radius**2)] for side in (1, -1)]
    return np.array([*([z.real, z.imag, 0] for z in ring), *poles])


@pytest.mark.parametrize("counts", [(4, 1, 1), (5, 2, 1), (6, 8, 2), (7, 64, 5)])
def test_rigid_clusters(counts):
    """Counts are those of [AMB]; shapes are those that the skeleton of the model reaches."""
    (count, graphs, clusters), found, left = counts, [], []
    for graph in graphs_of(count):
        known = decided(graph)
        found += [(graph, np.array(c, dtype=float).reshape(-1, 3)) for c in known or []]
        left += [graph] if known is None else []
    assert len(graphs_of(count)) == graphs
    assert len(left) == (2 if count == 7 else 0)
    for graph in left:
        if nx.is_isomorphic(graph, RING):
            found.append((RING, ring_of_five()))
        else:
            none = corners_on_circles(graph)
            assert (none.complete, len(none)) == (True, 0)

    assert len(found) == len({graph for graph, _ in found}) == clusters
    shapes = []
    for graph, centres in found:
        away = centres[:, None] - centres
        rows = np.zeros((graph.size(), count, 3))
        for row, (i, j) in zip(rows, graph.edges, strict=True):
            row[i], row[j] = away[i, j], away[j, i]
        gradients = rows.reshape(graph.size(), -1)
        assert graph.size() == np.linalg.matrix_rank(gradients, tol=1e-3) == 3 * count - 6
        distances = np.linalg.norm(away, axis=2) / math.sqrt(TOUCH)
        assert np.array_equal(abs(distances - 1) < 1e-12, nx.to_numpy_array(graph, range(count)))
        shapes.append(np.sort(distances[np.triu_indices(count, 1)]))
    model = SphereCluster(count)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    traced = [np.sort(model.distances(corner.point)) for corner in atlas.corners]
    assert len(traced) == clusters
    assert all(min(abs(x - y).max() for y in traced) < 1e-6 for x in shapes)


def test_the_octahedron_by_its_angles():
    """It and its mirror image are the only corners, as (b) says."""
    found = corners_on_circles(BASES[1][0])
    assert (found.complete, len(found)) == (True, 2)
    assert np.allclose(np.cos([p.point for p in found]), -1 / 3)
