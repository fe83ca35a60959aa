"""Starts outside: feasible points are found where they exist, and emptiness has its evidence."""

import pytest
import sympy as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, Verdict, minimise
from polycorner.formulas import Family

LINE, PLANE, SPACE = (Manifold.euclidean(names) for names in ("x", "x y", "x y z"))
x, y, z = SPACE.symbols

a, b, c, d, e, f = sp.symbols("a b c d e f")
whole = st.integers(-9, 9)
WALL = Family.of({"wall": f * (a * x - b)}, ["x"], ["a", "b", "f"])
WELL = Family.of({"well": (x - 2 * a * b) ** 2 / b**2}, ["x"], ["a", "b"])
BOWL = Family.of(
    {"bowl": f - (a * x + b * y) ** 2 - (c * y) ** 2 - d * x - e * y}, ["x", "y"], list("abcdef")
)
DISC = Family.of({"disc": a**2 - (x - b) ** 2 - y**2}, ["x", "y"], ["a", "b"])


@given(st.sampled_from([1, 51, 1000, 10**7]), st.sampled_from([-1, 1]), st.integers(-3, 3))
def test_a_wall_at_any_distance_is_reached(distance, side, order):
    wall = SmoothFunction.member(WALL, "wall", LINE, parameters=[side, distance, 10.0**order])
    well = SmoothFunction.member(WELL, "well", LINE, parameters=[side, distance])
    found = minimise(Polyhedron(LINE, [wall]), well, [0.0])
    assert found.is_minimum
    assert found.point == pytest.approx([2 * side * distance], rel=1e-6)


@given(whole, whole, whole, whole, st.lists(st.tuples(*[whole] * 5), min_size=1, max_size=4))
@example(0, -5, 0, 0, [(1, 1, 0, 0, -1)])  # a long narrow valley of the violation
def test_a_convex_set_with_interior_points_is_reached_from_everywhere(p, q, i, j, rows):
    """The squared violation of concave functions is convex: it has no other stationary points."""

    def level(row):
        p, q, r, s, t = row
        return 1.0 + (p * i + q * j) ** 2 + (r * j) ** 2 + s * i + t * j

    parts = [
        SmoothFunction.member(BOWL, "bowl", PLANE, parameters=[*row, level(row)], label=f"f{k}")
        for k, row in enumerate(rows)
    ]
    D = Polyhedron(PLANE, parts)
    found = minimise(D, (x - 3) ** 2 + (y + 2) ** 2, [100.0 * p, 100.0 * q])
    assert D.contains(found.point, tolerance=1e-6)
    assert found.verdict not in {Verdict.INFEASIBLE, Verdict.OUTSIDE, Verdict.NOT_CONVERGED}


@settings(max_examples=12)
@given(st.integers(1, 50), st.integers(1, 50), st.integers(3, 40), whole)
def test_two_separate_discs_have_no_common_point(r, s, gap, at):
    discs = ("one", r, 0), ("two", s, r + s + gap)
    parts = [
        SmoothFunction.member(DISC, "disc", PLANE, parameters=rest, label=name)
        for name, *rest in discs
    ]
    found = minimise(Polyhedron(PLANE, parts), x + y, [float(at), 2.0])
    assert found.verdict is Verdict.INFEASIBLE
    # On the line of the centres, between the discs, both are violated.
    assert found.point[1] == pytest.approx(0, abs=1e-4)
    assert r < found.point[0] < r + gap
    text = found.explain()
    assert "one" in text
    assert "two" in text


CURVED = {
    "hyperbola": (LINE, {"f": 1 - 2 / x}, {}, x**2, [0.5]),
    "hump": (LINE, {"f": x**2 - 1}, {}, x**2, [0.0]),
    "hidden beyond a dip": (LINE, {"f": 2 * x + 2.5, "g": x**2 - x - 1.75}, {}, x**2, [-0.75]),
    "paraboloid": (SPACE, {}, {"h": x + z**2 + 1}, (x - 1) ** 2 / 100 + (y - x**2) ** 2, [2, 2, 2]),
    "two equations": (
        SPACE,
        {},
        {"g": 3 * x - 2 * y**2 - 7, "h": 4 * x - z**2 - 11},
        4 * x**2 + 2 * y**2 + 2 * z**2 - 33 * x + 16 * y - 24 * z,
        [0, 0, 0],
    ),
    "reciprocals": (
        SPACE,
        {"f": 1 - 4 / x - 32 / y - 120 / z, "a": x, "b": y, "c": z},
        {},
        5 * x + 50000 / x + 20 * y + 72000 / y + 10 * z + 144000 / z,
        [1, 1, 1],
    ),
    "corner beyond a hyperbola": (
        PLANE,
        {"f": x * y - 1, "g": x + y**2, "h": 0.5 - x},
        {},
        100 * (y - x**2) ** 2 + (1 - x) ** 2,
        [-2, 1],
    ),
}


@pytest.mark.parametrize("method", ["newton", "slsqp", "scp"])
@pytest.mark.parametrize("kind", CURVED)
def test_curved_sets_are_reached(kind, method):
    manifold, parts, equations, energy, start = CURVED[kind]
    D = Polyhedron(manifold, parts, equations)
    found = minimise(D, energy, start, method=method)
    assert D.contains(found.point, tolerance=1e-6)
    assert found.verdict is not Verdict.INFEASIBLE


def test_the_other_branch_of_a_union_is_reached():
    D = Polyhedron(PLANE, AnyOf(-1 - x**2 - y**2, y - 51))
    found = minimise(D, x**2 + y, [0.0, 0.0])
    assert found.is_minimum
    assert found.point == pytest.approx([0, 51], abs=1e-9)


@given(st.integers(-9, 9), st.integers(-9, 9), st.integers(-3, 3))
def test_an_empty_disc_is_explained_without_a_distance(p, q, order):
    """Where a gradient vanishes, a distance to first order would say nothing."""
    empty = SmoothFunction.member(
        BOWL, "bowl", PLANE, parameters=[1.0, 0.0, 1.0, 0.0, 0.0, -(10.0**order)]
    )
    found = minimise(Polyhedron(PLANE, [empty]), x + y, [float(p), float(q) + 0.5])
    assert found.verdict is Verdict.INFEASIBLE
    assert found.point == pytest.approx([0, 0], abs=1e-3)
    text = found.explain()
    assert "its gradient vanishes there" in text
    assert "scale units" not in text


def test_a_stationary_violation_beside_a_set_is_not_emptiness():
    """At (1.5, 1.5) no step lowers the violation of both, which are satisfied at (-1, -5)."""
    D = Polyhedron(PLANE, {"hyperbola": x * y - x - y, "line": 3 - x - y})
    assert minimise(D, x**2 + y**2, [0.1, 9.9]).is_minimum


def test_parts_that_hold_may_exclude_each_other():
    """Where ``x >= 1`` holds, no part of the second union does; ``x <= -1`` has points of both."""
    D = Polyhedron(PLANE, [AnyOf(x - 1, -1 - x), AnyOf(-2 - x, -5 - x)])
    found = minimise(D, x**2 + y**2, [2.0, 0.0])
    assert found.point == pytest.approx([-2, 0], abs=1e-9)


INSIDE = [3 * x - y - 3, -x + y / 2 + 4, -x - y + 7]
BARD = Manifold.euclidean("x y k l m")
FORCES = BARD.symbols[2:]


@pytest.mark.parametrize("kind", ["products", "branches"])
@pytest.mark.parametrize("method", ["newton", "slsqp"])
def test_a_follower_that_minimises_is_a_system_of_complementarities(kind, method):
    """Bard's convex two-level problem has the minimum 17 at (1, 0), reached from the origin."""
    pairs = list(zip(INSIDE, FORCES, strict=True))
    balance = {"balance": 2 * (y - 1) - 1.5 * x + FORCES[0] - FORCES[1] / 2 + FORCES[2]}
    parts = [x, y, *INSIDE, *FORCES]
    if kind == "products":
        balance |= {f"c{i}": gap * force for i, (gap, force) in enumerate(pairs)}
    else:
        parts += [AnyOf(AllOf(gap, -gap), AllOf(force, -force)) for gap, force in pairs]
    found = minimise(
        Polyhedron(BARD, parts, balance), (x - 5) ** 2 + (2 * y + 1) ** 2, [0] * 5, method=method
    )
    assert found.energy == pytest.approx(17, abs=1e-6)
    assert found.is_minimum
