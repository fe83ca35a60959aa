"""Descents go on from flat inflections and saddles of higher order, and stay at minima."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, certify, minimise

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
BOX = Polyhedron(PLANE, {"left": x + 10, "right": 10 - x, "low": y + 10, "high": 10 - y})
TURNS = {"straight": (1, 0), "turned": (sp.Rational(3, 5), sp.Rational(4, 5)), "across": (0, 1)}

NO_MINIMA = {
    "inflection": lambda u, v: u**3 + v**2,
    "inflection of order five": lambda u, v: u**5 + v**2,
    "maximum of order four": lambda u, v: -(u**4) + v**2,
    "maximum of order six": lambda u, v: -(u**6) + v**2,
    "monkey saddle": lambda u, v: u**3 - 3 * u * v**2,
    "quartic saddle": lambda u, v: u**4 - 6 * u**2 * v**2 + v**4,
    "between two parabolas": lambda u, v: (v - u**2) * (v - 3 * u**2),
    "between two cubics": lambda u, v: (v - u**3) * (v - 2 * u**3),
}
MINIMA = {
    "order four": lambda u, v: u**4 + v**2,
    "order six": lambda u, v: u**6 + v**4,
    "outside two parabolas": lambda u, v: (v - u**2) * (v - 3 * u**2) + 2 * u**4,
    "locus": lambda u, v: (v - u**2) ** 2,
}


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", NO_MINIMA)
def test_a_descent_goes_on_where_something_lower_is_near(kind, turn):
    found = minimise(BOX, _turned(NO_MINIMA[kind], turn), [0.0, 0.0])
    assert found.energy < -1


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", MINIMA)
def test_a_descent_stays_at_a_flat_minimum(kind, turn):
    found = minimise(BOX, _turned(MINIMA[kind], turn), [0.0, 0.0])
    assert found.point == pytest.approx([0, 0], abs=1e-9)


def _turned(energy, turn):
    c, s = TURNS[turn]
    return energy(c * x + s * y, c * y - s * x)


def test_a_descent_goes_on_along_a_curved_face():
    """On the parabola the energy is x**3; its first and second order vanish at the vertex."""
    D = Polyhedron(PLANE, {"floor": y - x**2, "left": x + 2, "right": 2 - x})
    found = minimise(D, 2 * y - 2 * x**2 + x**3, [0.0, 0.0])
    assert found.active == ("floor", "left")


FALLING = {
    "cubic": x**3 + y,
    "cubic under a bent floor": x**3 + x**2 * y + y,
    "cubic with a minimum": x**4 + x**3 + y,
    "order five": x**5 + y,
}


@pytest.mark.parametrize("start", [(0.3, 0.2), (0.5, 0.0), (1e-3, 1e-3), (1.0, 1.0)], ids=str)
@pytest.mark.parametrize("kind", FALLING)
def test_a_descent_goes_on_along_a_floor_that_holds_it(kind, start):
    """What holds the point on the floor does not hold it along the floor."""
    D = Polyhedron(PLANE, {"floor": y, "left": x + 2})
    found = minimise(D, FALLING[kind], start)
    assert found.verdict.name == "STRICT_MINIMUM"
    assert found.point[0] < -0.7


def test_a_barrier_is_not_crossed():
    """A flat minimum stays the end of its basin, although a lower one lies close."""
    found = minimise(BOX, x**4 * (x - sp.Rational(1, 20)) * (x - sp.Rational(1, 10)) + y**2, [0, 0])
    assert found.point == pytest.approx([0, 0], abs=1e-9)


@given(
    st.sampled_from([3, 5, 7]),
    st.floats(0, math.tau),
    st.floats(0.3, 3),
    st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    st.sampled_from([-1.0, 1.0]),
)
def test_beside_an_odd_inflection_with_a_free_direction_no_minimum_is_seen(
    order, angle, size, start, sign
):
    """``(a q)^k`` with odd ``k`` is monotone: whatever point a search ends at, it is no minimum."""
    u = (math.cos(angle) * x + math.sin(angle) * y) / size
    D = Polyhedron(PLANE, {"room": 1000 - x**2 - y**2})
    found = minimise(D, sign * u**order, start)
    if not found.active:
        assert not found.is_minimum
    beside = np.array([math.cos(angle), math.sin(angle)]) * size * 3e-9
    assert not certify(D, sign * u**order, beside).is_minimum
