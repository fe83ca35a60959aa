"""Shapes with many skeletons, compiled once per kind, and invariants that compare skeletons."""

import itertools
from collections import Counter

import networkx as nx
import numpy as np
import sympy as sp
from networkx.algorithms.isomorphism import categorical_multiedge_match

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction
from polycorner.formulas.families import Family
from polycorner.skeletons import End

# ------------------------------------------------------------------------------------------ shapes


def space(n):
    """Return ``R^n`` with the coordinates ``q1 ... qn``."""
    return Manifold.euclidean([f"q{i + 1}" for i in range(n)])


_FAMILIES = {}


def _family(kind, n, write):
    """Return functions of one kind on ``R^n``, compiled once, their numbers bound late."""
    if (kind, n) not in _FAMILIES:
        numbers = [f"c{i}" for i in range(n + 1)]
        variables = space(n).names
        symbols = [sp.Symbol(name, real=True) for name in (*variables, *numbers)]
        expression = write(symbols[:n], symbols[n:])
        _FAMILIES[kind, n] = Family.of({kind: expression}, variables, numbers)
    return _FAMILIES[kind, n]


def half_space(normal, limit, name, manifold=None):
    """Return ``limit - normal . q``."""
    n = len(normal)
    family = _family("half", n, lambda q, c: c[n] - sum(c[i] * q[i] for i in range(n)))
    numbers = (*map(float, normal), float(limit))
    return SmoothFunction.member(
        family, "half", manifold or space(n), parameters=numbers, label=name
    )


def ball(centre, radius, name, *, inside=True):
    """Return ``radius^2 - |q - centre|^2``, positive inside, or its negative."""
    n = len(centre)
    kind = "inside" if inside else "outside"
    sign = 1 if inside else -1
    family = _family(
        kind, n, lambda q, c: sign * (c[n] ** 2 - sum((q[i] - c[i]) ** 2 for i in range(n)))
    )
    numbers = (*map(float, centre), float(radius))
    return SmoothFunction.member(family, kind, space(n), parameters=numbers, label=name)


def half_spaces(rows, limits, manifold=None):
    """Return ``limits - rows q`` as the functions ``f1, f2, ...``."""
    pairs = enumerate(zip(rows, limits, strict=True), 1)
    return [half_space(row, limit, f"f{k}", manifold) for k, (row, limit) in pairs]


def polytope(rows, limits):
    """Return ``{q : rows q <= limits}``."""
    return Polyhedron(space(len(rows[0])), AllOf(*half_spaces(rows, limits)))


def boxes_union(boxes):
    """Return the union of boxes ``[[(low, high) for each axis] for each box]``."""
    n = len(boxes[0])
    axes = np.eye(n)
    parts = []
    for k, box in enumerate(boxes):
        sides = []
        for axis, (low, high) in enumerate(box):
            sides.append(half_space(-axes[axis], -low, f"{k}low{axis}"))
            sides.append(half_space(axes[axis], high, f"{k}high{axis}"))
        parts.append(AllOf(*sides))
    return Polyhedron(space(n), AnyOf(*parts))


# --------------------------------------------------------------------------------- skeletons


def isomorphic(one, other):
    """Whether two skeletons agree up to the order of what is in them."""
    same = (
        [len(one.corners), len(one.edges), len(one.faces)],
        Counter((e.active, frozenset(e.kinds)) for e in one.edges),
        Counter((f.active, f.closed, _sizes(f)) for f in one.faces),
        dict(one.components),
    ) == (
        [len(other.corners), len(other.edges), len(other.faces)],
        Counter((e.active, frozenset(e.kinds)) for e in other.edges),
        Counter((f.active, f.closed, _sizes(f)) for f in other.faces),
        dict(other.components),
    )
    return same and nx.is_isomorphic(
        one.graph,
        other.graph,
        node_match=lambda a, b: a["active"] == b["active"] and a["singular"] == b["singular"],
        edge_match=categorical_multiedge_match("active", None),
    )


def _sizes(face):
    return tuple(sorted(map(len, face.boundary)))


def identical(one, other):
    """Whether two skeletons agree in everything, polylines to the last bit."""
    return (
        [(c.point.tobytes(), c.active, c.singular, c.edges) for c in one.corners]
        == [(c.point.tobytes(), c.active, c.singular, c.edges) for c in other.corners]
        and [(e.polyline.tobytes(), e.active, e.ends, e.kinds, e.length) for e in one.edges]
        == [(e.polyline.tobytes(), e.active, e.ends, e.kinds, e.length) for e in other.edges]
        and one.faces == other.faces
        and (one.complete, one.notes, dict(one.components))
        == (other.complete, other.notes, dict(other.components))
    )


def whole(atlas):
    """Return the numbers of corners, edges and faces, and the Euler characteristic."""
    return counts(atlas), atlas.euler_characteristic


def counts(atlas):
    """Return how many corners, edges and faces there are."""
    return len(atlas.corners), len(atlas.edges), len(atlas.faces)


def closed(atlas):
    """Return which edges close upon themselves."""
    return [edge.is_closed and edge.kinds == (End.CLOSED, End.CLOSED) for edge in atlas.edges]


def check_incidence(atlas):
    """Assert what holds in every skeleton, whatever the polyhedron is."""
    D, M = atlas.polyhedron, atlas.polyhedron.manifold
    ends = Counter()
    for k, edge in enumerate(atlas.edges):
        assert D.contains(edge.polyline, tolerance=1e-7).all()
        held = [D.names.index(name) for name in edge.active]
        assert abs(D.values(edge.polyline)[:, held]).max(initial=0.0) < 1e-9
        for end, point in zip(edge.ends, (edge.polyline[0], edge.polyline[-1]), strict=True):
            if end is not None:
                ends[end, k] += 1
                corner = atlas.corners[end]
                assert abs(M.difference(point, corner.point)).max() < 1e-6
                assert set(edge.active) <= set(corner.active)
                assert corner.singular or edge.active != corner.active
    for k, corner in enumerate(atlas.corners):
        assert Counter(corner.edges) == Counter({e: n for (c, e), n in ends.items() if c == k})
    for face in atlas.faces:
        for edge in itertools.chain(*face.boundary):
            assert set(face.active) < set(atlas.edges[edge].active)
