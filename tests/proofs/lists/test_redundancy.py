"""Stationary points where more functions vanish than are needed to hold them."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from proof_files import changed, verdict

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import corners, stationary_points

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SPACE = Manifold.euclidean("u v w")
U, V, W = SPACE.symbols
SIDES = [(-3.0, 3.0), (-3.1, 3.2)]
CUBE = [(-2.0, 2.0), (-2.0, 2.1), (-2.0, 2.2)]
R = sympy.Rational
PYRAMID = [1 - W - U, 1 - W + U, 1 - W - V, 1 - W + V, W]


@pytest.mark.parametrize(
    ("manifold", "parts", "equations", "energy", "at"),
    [
        (PLANE, [Y, Y - X, Y + X], (), Y + X / 3, [0, 0]),
        (PLANE, [Y, Y - X, Y + X, Y - 2 * X], (), Y + X / 3, [0, 0]),
        (PLANE, [Y - R(1, 3), Y - X, Y + X - R(2, 3)], (), Y + X / 3, [1 / 3, 1 / 3]),
        # lines that meet where a coordinate is a root
        (
            PLANE,
            [Y - sympy.sqrt(2), Y - X * sympy.sqrt(2), Y + X - sympy.sqrt(2) - 1],
            (),
            Y + X / 3,
            [1, np.sqrt(2)],
        ),
        # two circles and a line through the origin
        (
            PLANE,
            [1 - (X - 1) ** 2 - Y**2, 1 - X**2 - (Y - 1) ** 2, X + Y],
            (),
            X + R(5, 4) * Y,
            [0, 0],
        ),
        (SPACE, PYRAMID, (), U / 3 + V / 5 - W, [0, 0, 1]),
        (SPACE, [U, U - V, U + V], [W - U**2], U + W + V / 3, [0, 0, 0]),
    ],
)
def test_a_point_with_redundant_functions_is_listed_once(
    manifold, parts, equations, energy, at, tmp_path
):
    d = Polyhedron(manifold, parts, equations)
    found = stationary_points(d, energy, box=CUBE if manifold is SPACE else SIDES)
    assert found.complete
    (point,) = found
    assert np.allclose(point.point, at)
    assert point.index == 0
    held = set(point.active) | set(point.redundant)
    assert len(point.active) + len(equations) == manifold.size < len(held) + len(equations)
    assert np.allclose(d.values(point.point)[[d.names.index(f) for f in held]], 0)
    fine, line = verdict(found.save(tmp_path / "list.zip"))
    assert fine, line
    assert line.startswith("verified: 1 stationary points")


lines = st.tuples(st.integers(-2, 2), st.integers(-2, 2)).filter(lambda n: n != (0, 0))
bundles = st.tuples(
    st.tuples(st.integers(-1, 1), st.integers(-1, 1)), st.lists(lines, min_size=2, max_size=4)
)


@settings(max_examples=15)
@given(st.lists(bundles, min_size=1, max_size=2), lines, st.booleans())
def test_lists_are_those_of_rational_arithmetic(bundle, way, union):
    """Lines through one or two points; by Farkas' lemma vertices are at rest if ``dE`` is in cones.

    The energy is linear and constant along no line.
    """
    walls = [(a, b, a * p + b * q) for (p, q), normals in bundle for a, b in normals]
    slope = (way[0] + Fraction(1, 101), way[1] + Fraction(1, 103))
    energy = sum(R(s.numerator, s.denominator) * q for s, q in zip(slope, (X, Y), strict=True))
    half = len(walls) // 2
    pieces = [walls[:half], walls[half:]] if union else [walls]
    d = Polyhedron(PLANE, [AnyOf(*(AllOf(*(c - a * X - b * Y for a, b, c in p)) for p in pieces))])
    found = stationary_points(d, energy, box=[(-4.03, 5.01), (-4.07, 4.9)], max_boxes=1000)
    expected = at_rest(pieces, slope)
    shown = {tuple(Fraction(x).limit_denominator(100) for x in p.point.tolist()) for p in found}
    assert len(shown) == len(found)
    assert shown <= expected
    if found.complete:
        assert shown == expected


def at_rest(pieces, slope):
    """Return the vertices of a union of polygons that are stationary, in rational numbers."""
    found = set()
    for (a, b, c), (d, e, f) in itertools.combinations([wall for p in pieces for wall in p], 2):
        area = a * e - b * d
        q = area and (Fraction(c * e - b * f, area), Fraction(a * f - c * d, area))
        if q and -4.03 <= q[0] <= 5.01 and -4.07 <= q[1] <= 4.9:
            gaps = [[w - u * q[0] - v * q[1] for u, v, w in piece] for piece in pieces]
            here = [
                [(-u, -v) for (u, v, _), gap in zip(piece, some, strict=True) if gap == 0]
                for piece, some in zip(pieces, gaps, strict=True)
                if min(some) >= 0
            ]
            if here and all(in_cone(normals, slope) for normals in here):
                found.add(q)
    return found


def in_cone(normals, slope):
    """Whether a vector is a combination of two of some vectors without negative weights."""
    for (a, b), (c, d) in itertools.combinations(normals, 2):
        area = a * d - b * c
        if area:
            weights = (slope[0] * d - slope[1] * c) / area, (a * slope[1] - b * slope[0]) / area
            if min(weights) >= 0:
                return True
    return False


@pytest.mark.parametrize(
    ("parts", "energy"),
    [
        ([Y - X**2, -Y - X**2], X),  # one point: every energy is at rest there
        ([Y, -Y, X], X),  # an equation in disguise
    ],
)
def test_degenerate_contacts_stay_undecided(parts, energy):
    d = Polyhedron(PLANE, parts)
    found = stationary_points(d, energy, box=SIDES, resolution=1e-3, max_boxes=5000)
    assert not found.complete
    rest = found.undecided
    assert ((rest[:, 0] <= 0) & (rest[:, 1] >= 0)).all(axis=1).any()


def mirror(q):
    return q * [-1, 1, 1]


def test_a_symmetry_that_keeps_the_point_and_changes_the_functions():
    symmetry = Symmetry(elements=[Element(mirror, {})])
    d = Polyhedron(SPACE, [1 - W - U, 1 - W + U, 1 - W - V, 1 - W - 2 * V])
    for more in ({}, {"symmetry": symmetry}):
        found = stationary_points(d, -W - V / 3, box=[(-2, 2), (-2, 2.1), (-2, 2.2)], **more)
        assert found.complete
        assert [p.point.tolist() for p in found] == [[0, 0, 1]]


def test_multiples_of_a_function_are_one_function():
    circle = 1 - X**2 - Y**2
    parts = [circle, 3 * circle, R(1, 2) - X**2 / 2 - Y**2 / 2, X + 2 * Y, 4 * Y + 2 * X]
    found = stationary_points(Polyhedron(PLANE, parts), Y, box=SIDES)
    assert found.complete
    alone = stationary_points(Polyhedron(PLANE, [circle, X + 2 * Y]), Y, box=SIDES)
    assert [p.point.tolist() for p in found] == [p.point.tolist() for p in alone]
    assert {name for p in found for name in p.active} <= {"f1", "f4"}
    vertices = corners(Polyhedron(PLANE, parts), box=SIDES)
    assert vertices.complete
    assert [set(p.active) for p in vertices] == [{"f1", "f4"}] * 2


def test_a_union_of_branches_that_share_functions():
    """Both branches hold the point with the same two lines, one with a third as well."""
    branches = AnyOf(AllOf(Y, Y - X, Y + X), AllOf(2 * (Y - X), Y + X, Y + 1))
    found = stationary_points(Polyhedron(PLANE, [branches, 1 - Y]), Y + X / 3, box=SIDES)
    assert found.complete
    assert [p.point.tolist() for p in found] == [[0, 0]]


def drop_region(data):
    data["regions"] = []
    data["points"] = []


def call_it_nothing(data):
    data["points"] = []


def drop_functions(data):
    data["branches"] = [[0], [1, 2]]


@pytest.mark.parametrize("change", [drop_region, call_it_nothing, drop_functions])
def test_corrupted_files_are_refused(change, tmp_path):
    d = Polyhedron(PLANE, [Y, Y - X, Y + X])
    path = stationary_points(d, Y + X / 3, box=SIDES).save(tmp_path / "list.zip")
    assert verdict(path)[0]
    assert not verdict(changed(path, change))[0]


def line(name, expression, **values):
    """Return an inequality with parameters."""
    return SmoothFunction(name, expression, PLANE, parameters=values)


def test_functions_that_agree_at_one_value_of_a_parameter_only():
    """Two walls coincide, or three lines meet, for the values bound and for no others."""
    a, b = sympy.symbols("a b")
    walls = [line("first", a - X, a=1.0), line("second", b - X, b=1.0)]
    frame = [2 - Y, 2 + Y]
    found = stationary_points(
        Polyhedron(PLANE, [*walls, *frame]), Y**2 - X, box=SIDES, parameters={"b": (0.5, 0.6)}
    )
    assert found.complete
    (point,) = found
    assert point.active == ("second",)
    assert point.lower[0] <= 0.5
    assert point.upper[0] >= 0.6
    fan = [line("third", Y + X - a, a=0.0), Y, Y - X]
    sides = {"a": (-0.1, 0.1)}
    found = stationary_points(
        Polyhedron(PLANE, fan), Y + X / 3, box=SIDES, parameters=sides, resolution=0.02
    )
    assert not found.complete


def test_a_redundant_contact_can_make_a_minimum_of_a_saddle():
    """On the line alone the energy falls to both sides; a second one through the point holds it."""
    d = Polyhedron(PLANE, [Y, Y - X, Y + X])
    for energy, count in ((Y + X / 3 - X**2, 1), (Y + X / 3 + X**2, 1)):
        for minima_only in (False, True):
            found = stationary_points(
                d, energy, box=[(-0.6, 0.7), (-0.6, 0.7)], minima_only=minima_only
            )
            assert found.complete
            assert [p.point.tolist() for p in found.minima][:1] == [[0, 0]]
            assert len(found.minima) == count
    saddle = Y - X**2
    fan = Polyhedron(PLANE, [Y, Y - X, Y + X])
    found = stationary_points(
        fan, saddle, box=[(-0.4, 0.5), (-0.4, 0.5)], minima_only=True, resolution=1e-3
    )
    rest = [*found.undecided, *([p.lower, p.upper] for p in (*found.open_points, *found))]
    assert any(((lower <= 0) & (upper >= 0)).all() for lower, upper in rest)
