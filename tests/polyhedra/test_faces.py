"""Ways onto faces: where they end, how, and that they are the shortest."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.quotients import Quotient

SPACE = Manifold(("x", "y", "z"), scales=(1.0, 2.0, 5.0))
X, Y, Z = SPACE.symbols
SPHERE = Polyhedron(SPACE, [1 - X**2 - (Y / 2) ** 2 - (Z / 5) ** 2, Z, X - Y / 2], [Y])
numbers = st.floats(-2, 2)


@given(st.tuples(numbers, numbers, numbers).filter(lambda u: 0.1 < math.hypot(*u)))
def test_the_nearest_point_of_a_sphere_is_on_the_ray(u):
    """In scaled coordinates the first function is that of the unit sphere."""
    q = np.array(u) * SPACE.scale_array
    found = project(Quotient(SPHERE), q, [0])
    assert found.settled
    assert np.allclose(found.point.q / SPACE.scale_array, np.array(u) / math.hypot(*u), atol=1e-9)
    assert abs(SPHERE.values(found.point.q)[0]) < 1e-13


def test_inequalities_and_equations_are_held_together():
    found = project(Quotient(SPHERE), np.array([0.7, 0.3, 0.2]), [0, 1, 3])
    assert found.settled
    assert np.allclose(found.point.q, [1, 0, 0], atol=1e-14)


def test_the_first_step_is_the_shortest_to_the_linearised_zeros():
    """By the normal equations, from the definition."""
    q = np.array([0.9, 0.4, 1.0])
    values, slopes = SPHERE.values(q), SPHERE.gradients(q) * SPACE.scale_array
    a, f = slopes[[0, 2]], values[[0, 2]]
    step = -a.T @ np.linalg.solve(a @ a.T, f)
    found = project(Quotient(SPHERE), q, [0, 2], steps=1)
    assert not found.settled
    assert np.allclose(found.point.q, q + step * SPACE.scale_array, atol=1e-14)


def test_steps_may_be_confined_to_some_directions():
    along = np.array([[0.0], [0.0], [1.0]])
    found = project(Quotient(SPHERE), np.array([0.6, 0.0, 3.0]), [0], along=along)
    assert found.settled
    assert np.allclose(found.point.q, [0.6, 0.0, 4.0], atol=1e-12)


def test_a_double_root_is_approached_though_slowly():
    """Convergence is linear, each step half of the one before."""
    line = Manifold.euclidean("t")
    (t,) = line.symbols
    found = project(Quotient(Polyhedron(line, [t**2])), np.array([1.0]), [0], steps=60)
    assert abs(found.point.q[0]) < 1e-8


@pytest.mark.parametrize(
    ("formula", "start", "limits", "settled"),
    [
        (X**2 + 1, [0.5, 0, 0], {}, False),
        (X - 100, [0, 0, 0], {"stride": 1.0, "steps": 10}, False),
        (X - 100, [0, 0, 0], {"stride": 1.0, "steps": 120}, True),
        (X**0.5 - 3, [-1.0, 0, 0], {}, False),  # not finite
    ],
)
def test_a_way_that_does_not_arrive_says_so(formula, start, limits, settled):
    found = project(Quotient(Polyhedron(SPACE, [formula])), np.array(start, float), [0], **limits)
    assert found.settled == settled
    assert np.isfinite(found.point.q).all()
    assert not settled or abs(found.point.q[0] - 100) < 1e-9
