"""
All rigid clusters, with a proof
================================

The rigid clusters of five spheres that stick, of six and of seven: one, two and five.

A *cluster* is ``n`` points with all distances at least 1; pairs at distance 1 *touch*.  It is
*rigid* if it is isolated, modulo isometries, among all ``n`` points at distance 1 where its pairs
touch: a corner of the polyhedron of ``SphereCluster(n)``.  A box of all ``3 n - 6`` coordinates is
too large for ``corners``; the proof goes through the graphs of pairs that touch, exact algebra
decides all but two of these, and ``corners`` searches the angles of one.

**Theorem.**  Up to isometries, mirror images included, and the order of the spheres, there is one
rigid cluster of five spheres, and there are two of six: the octahedron, and three tetrahedra in a
row.  Of seven spheres there are five in which at least 15 pairs touch.  In all of them the
gradients of the distances of touching pairs have rank ``3 n - 6``.

Not covered are clusters of seven with fewer contacts, rigid to higher order only.

**Proof.**  (a) Three spheres are touched by two others at most, in places that are mirror images in
the plane of the three.  (They are not on a line, which meets a sphere twice at most.)

(b) Let a ring of ``m`` spheres, each touching the next, all touch two others.  It is on a circle,
and its steps around it have the same length and, as no two places coincide, the same sense.  So it
is a square for ``m = 4``, which with the two others is an octahedron, and a pentagon for ``m = 5``
(in a star neighbours on the circle would overlap).

(c) Let at least ``3 n - 6`` pairs touch.  Then each sphere touches three others.  Otherwise
``3 n - 8`` pairs or more would touch among the other ``n - 1``: 7 of 6, all 10, or 13 of 15, which
(d) excludes for five and for six spheres.

(d) Four spheres that touch each other are a tetrahedron.  With diameter ``sqrt(2)`` it and the
octahedron have whole coordinates.  From one of them ``decided`` places spheres that touch three
known ones, by (a), in rational numbers, and compares all distances exactly.

(e) Two graphs of seven spheres are left.  That with a ring of five has one cluster, by (b).  In the
other three spheres that touch each other are on circles about edges of a tetrahedron, one angle
each.  ``corners`` shows that there is no isolated triple of angles at which all three pairs touch;
it leaves out angles at which one of them overlaps the tetrahedron.

(f) Now let fewer than ``3 n - 6`` pairs touch in a rigid cluster, with ``n > 2`` least.  A sphere
that touches one other at most could move on its own.  One that touches two is midway between them.
Otherwise it could move on a circle, unless all others were on the axis of the circle, where an end
of their row touches one sphere at most.  One that touches three is in their plane: otherwise it
would follow all motions of the others, and these were a rigid cluster of ``n - 1`` with fewer than
``3 (n - 1) - 6`` contacts.

(g) Let one be midway.  Take a longest straight row of three or more in which each touches the next
and inner ones touch nothing else.  Either end touches two more; none of these touches both ends,
which are 2 apart or farther.  So ``n`` is 7 at least.

(h) Let none be midway.  Then each sphere touches three at least.  If only three, it is in their
plane, so that nothing else touches these, by (a), and they do not all touch each other.  That
leaves no graph for ``n < 6`` and three for ``n = 6``.  In two of them, a ring of five about a
sphere and two triangles joined by three pairs, all centres are in one plane, since planes of
neighbours share a triangle.  A corner of their convex hull has an angle of 120 degrees at least, as
it touches three.  So the hull has six corners and all angles are 120 degrees: each corner touches
those next to it and a sphere at the centre of a regular hexagon, where none is.  In the third graph
two spheres touch the other four, which touch in pairs.  Each of the four is in the plane of the two
and its mate, so it is opposite to its mate on a circle of diameter 1, which is too small for four.

Run it to draw the clusters: ``python examples/ex20_rigid_clusters.py [FOLDER]``.
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path

import networkx as nx
import numpy as np
import sympy
from networkx.algorithms.isomorphism import GraphMatcher

from polycorner import Manifold, Polyhedron
from polycorner.models import SphereCluster
from polycorner.proofs import CornerList, corners
from polycorner.toolkit import Array

TOUCH = 2  # the square of the diameter
TETRAHEDRON = [sympy.Matrix(p) for p in ([0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1])]
OCTAHEDRON = [s * sympy.Matrix(p) for p in ([1, 0, 0], [0, 1, 0], [0, 0, 1]) for s in (1, -1)]
OPPOSITE = nx.Graph([(0, 1), (2, 3), (4, 5)])
BASES = ((nx.complete_graph(4), TETRAHEDRON), (nx.complement(OPPOSITE), OCTAHEDRON))
RING = nx.complement(nx.disjoint_union(nx.complement(nx.cycle_graph(5)), nx.path_graph(2)))


@dataclass(frozen=True)
class Result:
    """Clusters with at least ``3 n - 6`` contacts, searches for (e), and graphs that (h) leaves."""

    clusters: list[tuple[nx.Graph, Array]]
    searches: list[CornerList]
    fewer: list[nx.Graph]


def main(count: int = 6) -> Result:
    """Return the rigid clusters of 5, 6 or 7 spheres, with diameter 1."""
    clusters, searches, fewer = [], [], []
    for graph in contact_graphs(count):
        if graph.size() < 3 * count - 6:
            fewer += [graph] if may_be_flat(graph) else []
        elif (found := decided(graph)) is not None:
            clusters += [(graph, np.array(c, dtype=float).reshape(-1, 3)) for c in found]
        elif nx.is_isomorphic(graph, RING):
            clusters.append((RING, ring_of_five()))
        else:
            searches.append(corners_on_circles(graph))
    return Result([(g, c / math.sqrt(TOUCH)) for g, c in clusters], searches, fewer)


def contact_graphs(count: int) -> list[nx.Graph]:
    """Return the graphs in which each vertex has three edges at least, up to isomorphism."""
    apart, last = [], [nx.empty_graph(count)]
    while last:
        apart += last
        longer: list[nx.Graph] = []
        for graph, pair in product(last, combinations(range(count), 2)):
            more = nx.Graph(graph)
            more.add_edge(*pair)
            new = more.size() > graph.size() and max(d for _, d in more.degree) <= count - 4
            if new and not any(nx.is_isomorphic(more, other) for other in longer):
                longer.append(more)
        last = longer
    return [nx.complement(graph) for graph in apart]


def touching_all(graph: nx.Graph, spheres: Sequence[int]) -> set[int]:
    return set.intersection(*({*graph[v]} for v in spheres))


def overfull(graph: nx.Graph) -> bool:
    """Whether three spheres are touched by three others, which (a) excludes."""
    return any(len(touching_all(graph, three)) > 2 for three in combinations(graph, 3))


def may_be_flat(graph: nx.Graph) -> bool:
    """Whether spheres that touch three alone may all be in the plane of these, by (a) and (h)."""
    threes = [tuple(graph[v]) for v in graph if graph.degree(v) == 3]
    free = all(len(touching_all(graph, t)) == 1 and graph.subgraph(t).size() < 3 for t in threes)
    return free and not overfull(graph)


def places(a: sympy.Matrix, b: sympy.Matrix, c: sympy.Matrix) -> list[sympy.Matrix]:
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


def gap(x: sympy.Matrix, y: sympy.Matrix) -> sympy.Expr:
    return (x - y).dot(x - y) - TOUCH


def fits(graph: nx.Graph, known: dict[int, sympy.Matrix]) -> bool:
    """Whether pairs of known places touch where they should, and are farther apart elsewhere."""
    gaps = {pair: gap(*(known[v] for v in pair)) for pair in combinations(known, 2)}
    return all(g == 0 if graph.has_edge(*pair) else g > 0 for pair, g in gaps.items())


def decided(graph: nx.Graph) -> list[list[sympy.Matrix]] | None:
    """Return all clusters with exactly these contacts, up to isometry, or None if not decided."""
    if overfull(graph):
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


def on_circles(graph: nx.Graph) -> tuple[int, list[list[int]]]:
    """Return three edges of a triangle or tetrahedron that three touching spheres touch."""
    for three in combinations(graph, 3):
        base = [v for v in graph if v not in three]
        edges = [[k for k, v in enumerate(base) if graph.has_edge(u, v)] for u in three]
        if graph.subgraph(three).size() == 3 and {*map(len, edges)} == {2}:
            assert graph.subgraph(base).size() == math.comb(len(base), 2)
            return len(base), edges
    raise AssertionError


def corners_on_circles(graph: nx.Graph) -> CornerList:
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
        # Each other sphere is overlapped on one arc; it contains 0, not pi, and, for one of them,
        # ``free``, for one ``-free``.
        at = [[float(gap(x, y).subs(angle, t)) for y in others] for t in (0, math.pi, free, -free)]
        assert max(*at[0], min(at[2]), min(at[3])) < -1e-3 < 1e-3 < min(at[1])
        spheres.append(x)
    pairs = [sympy.expand(gap(x, y)) for x, y in combinations(spheres, 2)]
    return corners(Polyhedron(torus, pairs), box=[(free, math.tau - free)] * 3)


def ring_of_five() -> Array:
    """Return a pentagon with sides that touch, and the two spheres that touch all of it."""
    radius = math.sqrt(TOUCH) / (2 * math.sin(math.pi / 5))
    ring = [radius * np.exp(2j * math.pi * k / 5) for k in range(5)]
    poles = [[0, 0, side * math.sqrt(TOUCH - radius**2)] for side in (1, -1)]
    return np.array([*([z.real, z.imag, 0] for z in ring), *poles])


def draw(result: Result, path: Path) -> Path:
    from polycorner.pictures import draw_clusters, save

    centres = np.array([centres for _, centres in result.clusters])
    model = SphereCluster(centres.shape[1])
    return save(draw_clusters(model, centres.reshape(len(centres), -1)), path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    for count in (5, 6, 7):
        result = main(count)
        print(f"rigid clusters of {count} spheres: {len(result.clusters)}")
        print(f"wrote {draw(result, folder / f'ex20_{count}.png')}")
