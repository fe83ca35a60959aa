"""Equations that depend on each other are a set like any other, for every method and verdict."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, Verdict, certify, minimise
from polycorner.formulas import Family

SPACE = Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
a, b, c, d = sp.symbols("a b c d")

NEAR = Family.of(
    {"near": (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2}, ["x", "y", "z"], ["a", "b", "c"]
)


def mixture(first, second):
    """Members of the ideal of two functions."""
    mixed = a * (1 + b * (x + z) ** 2) * first + (c + d * y) * second  # zero on no other set
    return Family.of({"mixed": mixed}, ["x", "y", "z"], ["a", "b", "c", "d"])


PLANE, SPHERE, TILT = x + y + z - 1, x**2 + y**2 + z**2 - 1, x - 2 * y
SETS = {
    "plane": mixture(PLANE, 0 * x),
    "line": mixture(PLANE, TILT),
    "sphere": mixture(SPHERE, 0 * x),
    "circle": mixture(SPHERE, TILT),
}


def nearest(kind, p):
    """Return the nearest point of a set, by linear algebra."""
    p = np.array(p, dtype=float)
    normals = np.array([[1, 1, 1], [1, -2, 0]][: 1 + (kind == "line")])
    if kind in {"plane", "line"}:
        return p - np.linalg.pinv(normals) @ (normals @ p - [1, 0][: len(normals)])
    if kind == "circle":
        n = np.array([1, -2, 0]) / np.sqrt(5)
        p = p - (n @ p) * n
    return p / np.linalg.norm(p)


signed = st.sampled_from([-3, -2, -1, 1, 2, 3])
rows = st.lists(st.tuples(signed, st.integers(0, 2), signed, st.just(0)), min_size=1, max_size=3)
centres = st.tuples(st.integers(1, 4), st.integers(-4, 4), st.integers(1, 4))


def dependent(kind, rows):
    return [
        SmoothFunction.member(SETS[kind], "mixed", SPACE, parameters=row, label=f"h{i}")
        for i, row in enumerate(rows)
    ]


@pytest.mark.parametrize("method", ["newton", "slsqp", "scp"])
@pytest.mark.parametrize("kind", SETS)
@settings(max_examples=6)
@given(data=st.data())
def test_the_nearest_point_of_a_set_with_dependent_equations(kind, method, data):
    chosen, p = data.draw(rows), data.draw(centres)
    # Members of an ideal define its set where their matrix has full rank: everywhere for these.
    regular = [(1, 0, 2, 0), (1, 0, -1, 0)]
    chosen = [*regular[: 1 + (kind in {"line", "circle"})], *chosen]
    E = SmoothFunction.member(NEAR, "near", SPACE, parameters=[float(v) for v in p])
    D = Polyhedron(SPACE, {"far": x + 50}, dependent(kind, chosen))
    found = minimise(D, E, nearest(kind, p) + np.array([0.2, -0.1, 0.1]), method=method)
    assert found.verdict is Verdict.STRICT_MINIMUM
    assert found.point == pytest.approx(nearest(kind, p), abs=1e-6)


@given(st.sampled_from(sorted(SETS)), centres, st.sampled_from([0.0, 50.0]))
def test_a_point_that_can_be_lowered_is_no_cusp(kind, p, wall):
    """Beside the nearest point the energy falls along the set, dependent equations or not."""
    rows = [(1, 0, 2, 0), (2, 0, 1, 0), (-1, 1, 3, 0)]
    E = SmoothFunction.member(NEAR, "near", SPACE, parameters=[float(v) for v in p])
    D = Polyhedron(SPACE, {"far": x + 10 + wall}, dependent(kind, rows))
    opposite = nearest(kind, [-v for v in p])
    turned = nearest(kind, nearest(kind, p) + np.array([0.3, 0.15, -0.5]))
    assert np.linalg.norm(turned - nearest(kind, p)) > 0.1
    assert certify(D, E, turned).verdict is Verdict.NOT_STATIONARY
    if kind in {"sphere", "circle"}:
        assert not certify(D, E, opposite).is_minimum


KISSING = {"parabola": y - x**2, "cubic": y - x**3, "quartic": y - x**4}


@pytest.mark.parametrize("kind", KISSING)
def test_curves_that_only_touch_leave_no_way_down(kind):
    plane = Manifold.euclidean("x y")
    D = Polyhedron(plane, {}, {"line": y, "curve": KISSING[kind]})
    assert certify(D, x, [0, 0]).verdict is Verdict.NO_MULTIPLIER
