"""Distances of points and segments in space against minimisation."""

import numpy as np
import oracles
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import directions, vectors

from polycorner import Manifold, SmoothFunction
from polycorner.spaces import distances as bodies

# Values and gradients are compared with definitions, also near the kinks that are announced.
pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")

NAMES = [f"{corner}{axis}" for corner in ("a", "b", "c", "d") for axis in "xyz"]
SPACE = Manifold.euclidean(NAMES)
A, B, C, D = (SPACE.symbols[3 * i : 3 * i + 3] for i in range(4))
LONGEST = 10.0


def point_segment(p, start, end):
    along = bodies.minus(end, start)
    at = bodies.clamped(bodies.foot(p, start, end, 1 / bodies.dot(along, along)))
    return bodies.distance_from(p, start, end, at)


@pytest.fixture(scope="module")
def from_segment():
    return SmoothFunction("distance", point_segment(A, C, D), SPACE)


@pytest.fixture(scope="module")
def between_segments():
    ends = [point_segment(A, C, D), point_segment(B, C, D)]
    ends += [point_segment(C, A, B), point_segment(D, A, B)]
    definitions, distance = bodies.segment_segment_distance((A, B), (C, D), ends)
    return SmoothFunction("distance", distance, SPACE, definitions=definitions)


@st.composite
def segments(draw):
    """Two segments: general, parallel, nearly parallel, crossing, or touching ends."""
    a, u, v = draw(vectors(3)), draw(directions(3)), draw(directions(3))
    length, width = draw(st.floats(0.1, LONGEST)), draw(st.floats(0.1, LONGEST))
    shift = draw(vectors(3, 3.0))
    kind = draw(st.sampled_from(["general", "parallel", "nearly", "crossing", "ends"]))
    if kind == "parallel":
        v = u * draw(st.sampled_from([-1.0, 1.0]))
    elif kind == "nearly":
        v = u + draw(st.sampled_from([1e-2, 1e-4, 1e-6, 1e-8, 1e-10])) * v
    b = a + length * u
    c = a + shift
    if kind == "crossing":
        c = a + draw(st.floats(0, 1)) * (b - a) - draw(st.floats(0, 1)) * width * v
    elif kind == "ends":
        c = b + draw(st.floats(0, 2)) * v
    return np.concatenate([a, b, c, c + width * v])


def parts(q):
    return q.reshape(*q.shape[:-1], 4, 3).swapaxes(-2, 0) if q.ndim > 1 else q.reshape(4, 3)


@given(segments())
def test_distance_of_a_point_from_a_segment(from_segment, q):
    a, _, c, d = parts(q)
    exact = oracles.from_segment(a, c, d)
    assert from_segment.value(q) == pytest.approx(exact, abs=1e-10)


@given(segments())
def test_distance_of_two_segments(between_segments, q):
    exact = oracles.between_segments(*parts(q))
    assert between_segments.value(q) == pytest.approx(exact, abs=LONGEST * 2e-6)


@given(vectors(3), vectors(3, 3.0), directions(3), st.floats(-1, 1), st.integers(0, 2**32 - 1))
def test_parallel_segments_are_as_far_apart_as_their_ends(
    between_segments, a, shift, u, stretch, seed
):
    """Rounding decides whether parallel rods look parallel: ask many times."""
    moved = np.random.default_rng(seed).uniform(-5, 5, (200, 3))
    q = np.stack([a, a + 8 * u, a + shift, a + shift + (8 + stretch) * u])
    batch = (q + moved[:, None, :]).reshape(-1, 12)
    exact = oracles.between_segments(*q)
    np.testing.assert_allclose(between_segments.value(batch), exact, atol=1e-6)


@pytest.mark.parametrize("angle", [1e-2, 5e-4, 1e-4, 2e-6, 1e-7, 1e-8, 1e-9, 1e-11])
@pytest.mark.parametrize("apart", [0.5, 3.0])
def test_slightly_crossed_segments_are_as_far_apart_as_at_their_crossing(
    between_segments, angle, apart
):
    """At a crossing angle the lines are exactly ``apart``, ends a little more."""
    rng = np.random.default_rng(5)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    u, v, w = turn[0], np.cos(angle) * turn[0] + np.sin(angle) * turn[1], apart * turn[2]
    middle = rng.uniform(-100, 100, (100, 1, 3))
    q = middle + np.stack([-2 * u, 14 * u, w - 9 * v, w + 7 * v])
    np.testing.assert_allclose(between_segments.value(q.reshape(-1, 12)), apart, atol=1e-7)


@given(segments())
def test_distance_does_not_depend_on_the_order_of_anything(between_segments, q):
    a, b, c, d = parts(q)
    value = between_segments.value(q)
    for other in ((b, a, c, d), (a, b, d, c), (c, d, a, b)):
        assert between_segments.value(np.concatenate(other)) == pytest.approx(
            value, abs=LONGEST * 2e-6
        )


@given(segments())
def test_the_gradient_pushes_apart_as_fast_as_the_bodies_move(between_segments, q):
    """Moving all four corners alike changes nothing, moving one segment changes the distance."""
    assume(oracles.between_segments(*parts(q)) > 1e-3)
    gradient = between_segments.gradient(q).reshape(4, 3)
    np.testing.assert_allclose(gradient.sum(axis=0), 0, atol=1e-6)
    assert np.linalg.norm(gradient[:2].sum(axis=0)) == pytest.approx(1, abs=1e-6)


def test_vector_algebra():
    u, v = A, B
    assert sp.expand(bodies.dot(bodies.cross(u, v), u)) == 0
    assert sp.expand(bodies.dot(bodies.cross(u, v), v)) == 0
    lagrange = bodies.dot(u, u) * bodies.dot(v, v) - bodies.dot(u, v) ** 2
    assert sp.expand(bodies.dot(bodies.cross(u, v), bodies.cross(u, v)) - lagrange) == 0
    assert bodies.norm((sp.Integer(2), sp.Integer(3), sp.Integer(6))) == 7
