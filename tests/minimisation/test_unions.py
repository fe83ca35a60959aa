"""Unions of pieces: corners that are not convex, and descents from piece to piece."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import feasible_around
from polynomials import quadratic

from polycorner import (
    AllOf,
    AnyOf,
    Manifold,
    Polyhedron,
    Verdict,
    certify,
    minimise,
)

METHODS = ("newton", "slsqp", "scp")
every_method = pytest.mark.parametrize("method", METHODS)
M2, M3 = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = M3.symbols


def corner_union():
    """The plane without its open third quadrant."""
    return Polyhedron(M2, AnyOf(x, y))


@given(
    arrays(float, 2, elements=st.sampled_from([-1.0, 0.0, 1.0])),
    arrays(float, (2, 2), elements=st.floats(-2, 2)),
)
def test_a_concave_corner_is_a_minimum_when_each_piece_is(slope, matrix):
    form = matrix + matrix.T
    c = certify(corner_union(), quadratic(M2, form, slope), [0, 0])
    angles = np.linspace(-np.pi / 2, np.pi, 30_001)
    d = np.column_stack([np.cos(angles), np.sin(angles)])
    if slope.any():
        assert c.verdict is Verdict.NOT_STATIONARY
        assert (d @ slope).min() < 0
        return
    least = np.einsum("ki,ij,kj->k", d, form, d).min()
    assume(abs(least) > 0.01)
    assert c.is_minimum == (least > 0)
    assert c.verdict in ({Verdict.WEAK_MINIMUM} if least > 0 else {Verdict.SADDLE})


@pytest.mark.parametrize("other", [x**2, -(x**2), x**3, x**4, x], ids=str)
def test_the_piece_that_refutes_to_first_order_decides(other):
    # Whatever the energy does on y >= 0, on x >= 0 it simply falls with y.
    c = certify(corner_union(), y + other, [0, 0])
    assert c.verdict is Verdict.NOT_STATIONARY


def test_pieces_that_do_not_reach_the_point_do_not_matter():
    D = Polyhedron(M2, AnyOf(AllOf(y, 5 - y), AllOf(x - 3, 9 - x)))
    c = certify(D, x**2 + y, [0, 0])
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.signature == (1, 1, 0)
    assert len(c.active) == 1


@every_method
def test_descent_switches_from_one_disk_to_the_next(method):
    """Disks in a row overlap; the energy leads through all of them to the far end."""
    centres = (0, 2, 4)
    radius = sp.Rational(5, 4)
    D = Polyhedron(M2, AnyOf(*[radius**2 - (x - c) ** 2 - y**2 for c in centres]))
    c = minimise(D, x + y / 10, [4.5, 0.3], method=method)
    downhill = np.array([1, 0.1]) / np.hypot(1, 0.1)
    assert c.point == pytest.approx(-1.25 * downhill, abs=1e-9)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.signature == (1, 1, 0)


@every_method
@pytest.mark.parametrize(
    ("start", "goal", "expected"),
    [
        # From the foot into the arm, where the goal is; and back to the wall nearest to it.
        ((2.5, 0.5), (0.5, 2.5), (0.5, 2.5)),
        ((0.5, 2.5), (2.5, 0.5), (2.5, 0.5)),
        ((2.5, 0.5), (-1.0, 2.0), (0.0, 2.0)),
    ],
)
def test_descent_turns_the_corner_of_an_l(method, start, goal, expected):
    foot = AllOf(x, 3 - x, y, 1 - y)
    arm = AllOf(x, 1 - x, y, 3 - y)
    c = minimise(
        Polyhedron(M2, AnyOf(foot, arm)),
        (x - goal[0]) ** 2 + (y - goal[1]) ** 2,
        start,
        method=method,
    )
    # Going straight, the descent may get stuck on the arm's wall or the foot's: never silently.
    assert c.is_minimum
    if c.point == pytest.approx(expected, abs=1e-9):
        return
    around = feasible_around(
        c.problem.polyhedron, c.point, (1e-3, 1e-1), np.random.default_rng(0), 4000
    )
    assert c.problem.energy.value(around).min() >= c.energy - 1e-14


@every_method
def test_a_start_outside_a_union_reaches_one_of_its_parts(method):
    D = Polyhedron(M2, AnyOf(1 - (x - 5) ** 2 - y**2, 1 - (x + 5) ** 2 - y**2))
    c = minimise(D, y, [2.0, 0.0], method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert abs(c.point[0]) == pytest.approx(5, abs=1e-9)
    assert c.point[1] == pytest.approx(-1, abs=1e-9)
