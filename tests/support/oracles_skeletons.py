"""Corners, edges and faces by exhaustion: slow, independent truths.

Polytopes in the fractions, unions of boxes by counting cells, curves by quadrature, and orbits
of a listed group by applying it.
"""

import itertools
import math
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction

import networkx as nx
import numpy as np
import sympy as sp
from exact_algebra import solved
from oracles import exact_rank
from scipy.integrate import quad

# ---------------------------------------------------------------------------------- exact polytopes


@dataclass(frozen=True)
class ExactPolytope:
    """Vertices and edges with the rows that are tight on them, 2-faces by theirs, facets."""

    vertices: dict
    edges: dict
    faces: set
    facets: int


def exact_polytope(rows, limits):
    """Return the faces of ``{q : rows q <= limits}``, integers in, by trying every n rows."""
    rows = [[int(x) for x in row] for row in rows]
    limits = [int(b) for b in limits]
    n = len(rows[0])
    vertices = {}
    for chosen in itertools.combinations(range(len(rows)), n):
        found = solved([[*map(Fraction, rows[i])] for i in chosen], [limits[i] for i in chosen])
        if found is None or not found[1] or tuple(found[0]) in vertices:
            continue
        q = tuple(found[0])
        room = [
            b - sum(a * x for a, x in zip(row, q, strict=True))
            for row, b in zip(rows, limits, strict=True)
        ]
        if min(room) >= 0:
            vertices[q] = frozenset(i for i, r in enumerate(room) if r == 0)

    def rank_of(tight):
        return exact_rank([rows[i] for i in sorted(tight)])

    edges = {}
    for p, q in itertools.combinations(vertices, 2):
        tight = vertices[p] & vertices[q]
        if len(tight) >= n - 1 and rank_of(tight) == n - 1:
            edges[frozenset((p, q))] = tight
    neighbours = {p: [e for e in edges if p in e] for p in vertices}
    faces = set()
    for p in vertices:
        for one, other in itertools.combinations(neighbours[p], 2):
            tight = edges[one] & edges[other]
            if rank_of(tight) == n - 2:
                faces.add(tight)
    facets = {
        tuple(q for q in vertices if i in vertices[q])
        for i in range(len(rows))
        if _flat_dimension([q for q in vertices if i in vertices[q]]) == n - 1
    }
    return ExactPolytope(vertices, edges, faces, len(facets))


def _flat_dimension(points):
    if not points:
        return -1
    shared = math.lcm(*(x.denominator for p in points for x in p))
    away = [[(x - o) * shared for x, o in zip(p, points[0], strict=True)] for p in points[1:]]
    return exact_rank(away) if away else 0


# ---------------------------------------------------------------------------------- unions of boxes


class Cells:
    """The union of boxes with whole-numbered sides, as cells of the grid of whole numbers.

    ``inside[i, j, ...]`` is the cell with the upper corner ``(i, j, ...)``.
    """

    def __init__(self, boxes):
        self.n = len(boxes[0])
        size = 2 + max(high for box in boxes for _, high in box)
        self.inside = np.zeros((size,) * self.n, dtype=bool)
        for box in boxes:
            self.inside[tuple(slice(low + 1, high + 1) for low, high in box)] = True

    def around(self, point, axes):
        """Return the cells around a point that differ along given axes."""
        where = [slice(x, x + 2) if k in axes else x + 1 for k, x in enumerate(point)]
        return self.inside[tuple(where)]

    @staticmethod
    def bends(pattern):
        """Whether a pattern of cells changes along each of its axes."""
        return all((pattern != np.flip(pattern, axis)).any() for axis in range(pattern.ndim))

    def points(self):
        """Yield the points of the grid."""
        return itertools.product(*(range(k - 1) for k in self.inside.shape))

    def corners(self):
        """Return the corners: where the pattern around a point changes along every axis."""
        everything = range(self.n)
        return {p for p in self.points() if self.bends(self.around(p, everything))}

    def segments(self):
        """Return unit segments of edges ``(point, axis)``, the point being the lower end."""
        found = set()
        for point in self.points():
            for axis in range(self.n):
                if self.bends(self.around(point, set(range(self.n)) - {axis})):
                    found.add((point, axis))
        return found

    def edge_count(self):
        """Return how many edges there are, each with a corner at both ends."""
        segments = self.segments()
        ends = 0
        for p in self.corners():
            for axis in range(self.n):
                below = tuple(x - (k == axis) for k, x in enumerate(p))
                ends += ((p, axis) in segments) + ((below, axis) in segments)
        return ends // 2

    def euler_characteristic(self):
        """Return that of the closed set in the plane, of its boundary in space."""
        if self.n == 2:
            kept = {self._doubled(c) for c in zip(*np.nonzero(self.inside), strict=True)}
        else:
            kept = set()
            for axis in range(self.n):
                change = np.diff(self.inside, axis=axis)
                for cell in zip(*np.nonzero(change), strict=True):
                    odd = [2 * int(x) - 1 for x in cell]
                    odd[axis] += 1
                    kept.add(tuple(odd))
        closed = set()
        for cell in kept:
            spans = [(x - 1, x, x + 1) if x % 2 else (x,) for x in cell]
            closed.update(itertools.product(*spans))
        return sum((-1) ** sum(x % 2 for x in cell) for cell in closed)

    @staticmethod
    def _doubled(cell):
        return tuple(2 * int(x) - 1 for x in cell)

    def face_count(self):
        """Return how many two-dimensional faces there are: squares joined where none bends."""
        segments = self.segments()
        graph = nx.Graph()
        if self.n == 2:
            graph.add_nodes_from(
                tuple(int(x) for x in c) for c in zip(*np.nonzero(self.inside), strict=True)
            )
            for cell in list(graph):
                for axis in range(2):
                    after = tuple(x + (k == axis) for k, x in enumerate(cell))
                    if after in graph:
                        graph.add_edge(cell, after)
            return nx.number_connected_components(graph)
        for axis in range(3):
            for cell in zip(*np.nonzero(np.diff(self.inside, axis=axis)), strict=True):
                square = tuple(int(x) for x in cell)
                graph.add_node((square, axis))
        for square, axis in list(graph):
            for other in range(3):
                if other == axis:
                    continue
                after = (tuple(x + (k == other) for k, x in enumerate(square)), axis)
                third = 3 - axis - other
                low = tuple(x - (k == third) for k, x in enumerate(square))
                if after in graph and (low, third) not in segments:
                    graph.add_edge((square, axis), after)
        return nx.number_connected_components(graph)


# -------------------------------------------------------------------------------------- curves


def arc_length(curve, start, stop):
    """Return the length of ``curve(t)``, written in SymPy, by quadrature."""
    t = sp.Symbol("t", real=True)
    speed = sp.lambdify(t, sp.sqrt(sum(sp.diff(c, t) ** 2 for c in curve(t))), "math")
    return quad(speed, start, stop, epsabs=1e-12, epsrel=1e-12)[0]


def turned(polyline, centre):
    """Return the angle that a polyline in the plane turns about a point."""
    away = np.asarray(polyline) - centre
    angles = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    assert (np.sign(np.diff(angles)) == np.sign(angles[-1] - angles[0])).all()
    return float(abs(angles[-1] - angles[0]))


def circle_meetings(c1, r1, c2, r2):
    """Return the two points that two circles share, from the triangle of the centres."""
    c1, c2 = np.asarray(c1, dtype=float), np.asarray(c2, dtype=float)
    d = np.linalg.norm(c2 - c1)
    along = (c2 - c1) / d
    a = (d**2 + r1**2 - r2**2) / (2 * d)
    h = math.sqrt(r1**2 - a**2)
    across = np.array([-along[1], along[0]])
    return np.array([c1 + a * along + h * across, c1 + a * along - h * across])


# -------------------------------------------------------------------------------------- orbits


def orbit_counts(atlas, elements):
    """Return how many orbits of corners, edges and faces a listed group has on a whole atlas.

    Every element maps every corner, the middle of every edge, and the boundary of every face.
    """
    manifold = atlas.polyhedron.manifold
    points = np.array([c.point for c in atlas.corners])
    corners, edges, faces = nx.Graph(), nx.Graph(), nx.Graph()
    corners.add_nodes_from(range(len(atlas.corners)))
    edges.add_nodes_from(range(len(atlas.edges)))
    faces.add_nodes_from(range(len(atlas.faces)))
    for element in elements:

        def renamed(names, table=element.names):
            return frozenset(table.get(name, name) for name in names)

        def corner_image(k, element=element):
            image = element.apply(atlas.corners[k].point)
            away = [abs(manifold.difference(image, p)).max() for p in points]
            assert min(away) < 1e-6
            return int(np.argmin(away))

        on_corners = [corner_image(k) for k in range(len(points))]
        corners.add_edges_from(enumerate(on_corners))
        on_edges = []
        for edge in atlas.edges:
            active = renamed(edge.active)
            ends = Counter(on_corners[e] for e in edge.ends)
            candidates = [
                k
                for k, other in enumerate(atlas.edges)
                if frozenset(other.active) == active and Counter(other.ends) == ends
            ]
            assert len(candidates) == 1
            on_edges.append(candidates[0])
        edges.add_edges_from(enumerate(on_edges))
        for k, face in enumerate(atlas.faces):
            boundary = {frozenset(on_edges[e] for e in curve) for curve in face.boundary}
            candidates = [
                j
                for j, other in enumerate(atlas.faces)
                if {frozenset(curve) for curve in other.boundary} == boundary
                and frozenset(other.active) == renamed(face.active)
            ]
            assert len(candidates) == 1
            faces.add_edge(k, candidates[0])
    return tuple(nx.number_connected_components(g) for g in (corners, edges, faces))
