"""Immobility against searches for nearby points of the set."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from polycorner import Manifold, Polyhedron
from polycorner.bodies import Arrangement, HalfSpace, capsule, disc, polygon, sphere
from polycorner.minimisation import Mobility, immobility

SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
R = 0.2


def fingers(*places):
    return {f"F{k}": disc(R, at=place) for k, place in enumerate(places)}


def room(polyhedron, q, distance):
    """The largest least value of all functions at a distance from a point, by search."""
    scales = polyhedron.manifold.scale_array

    def value(way):
        return polyhedron.implicit(q + distance * scales * way / np.linalg.norm(way))

    ways = np.random.default_rng(0).standard_normal((2000, len(q)))
    ways = np.vstack([ways, np.eye(len(q)), -np.eye(len(q))])
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    values = polyhedron.implicit(q + distance * scales * ways)
    best = ways[np.argsort(values)[-3:]]
    options = {"xatol": 1e-9, "fatol": 1e-12, "maxiter": 800}
    return max(
        -minimize(lambda w: -value(w), w, method="Nelder-Mead", options=options).fun for w in best
    )


GRIPS = {
    "five fingers": (
        Arrangement(
            {"S": polygon(SQUARE)},
            fixed=fingers((-0.5, -1 - R), (0.5, -1 - R), (0, 1 + R), (-1 - R, 0.2), (1 + R, 0.2)),
        ),
        Mobility.FIRST_ORDER,
    ),
    "three fingers, meeting normals": (
        Arrangement(
            {"T": polygon([[2, 0], [-1, 3**0.5], [-1, -(3**0.5)]])},
            fixed=fingers(
                *(
                    (-(1 + R) * math.cos(a), (1 + R) * math.sin(a))
                    for a in (0, math.tau / 3, 2 * math.tau / 3)
                )
            ),
        ),
        Mobility.SECOND_ORDER,
    ),
    "four fingers, two lines": (
        Arrangement(
            {"S": polygon(SQUARE)},
            fixed=fingers((1 + R, 0.3), (-1 - R, 0.3), (-0.3, -1 - R), (-0.3, 1 + R)),
        ),
        Mobility.SECOND_ORDER,
    ),
    "four fingers, a pinwheel": (
        Arrangement(
            {"S": polygon(SQUARE)},
            fixed=fingers((1 + R, 0.3), (-1 - R, -0.3), (0.3, -1 - R), (-0.3, 1 + R)),
        ),
        Mobility.MOBILE,
    ),
    "a disc between three": (
        Arrangement(
            {"D": disc(1)},
            fixed=fingers(*((1 + R) * np.array([np.cos(a), np.sin(a)]) for a in (0, 2, 4))),
        ),
        Mobility.FIRST_ORDER,
    ),
    "a disc beside one": (
        Arrangement({"D": disc(1)}, fixed=fingers((1 + R, 0))),
        Mobility.MOBILE,
    ),
    "a rod on a floor": (
        Arrangement({"D": capsule([-1, 0], [1, 0], 0.2)}, {"floor": HalfSpace([0, 1], [0, -0.2])}),
        Mobility.MOBILE,
    ),
    "two fingers with flat sides": (
        Arrangement({"S": polygon(SQUARE)}, fixed=fingers((0, 1 + R), (0, -1 - R))),
        Mobility.MOBILE,  # it slides along: no function grows
    ),
}


@pytest.mark.parametrize("grip", GRIPS)
def test_grips(grip):
    a, expected = GRIPS[grip]
    q = a.point({name: [0, 0] for name in a.named})
    found = immobility(a.polyhedron, q)
    assert found.mobility is expected
    near = [room(a.polyhedron, q, d) for d in (0.1, 0.03)]
    if expected in {Mobility.FIRST_ORDER, Mobility.SECOND_ORDER}:
        assert max(near) < 0
    if expected is Mobility.MOBILE:
        assert min(near) > -1e-12
        assert found.motion is not None
    if expected is Mobility.SECOND_ORDER:
        gradients = dict(zip(a.polyhedron.names, a.polyhedron.gradients(q), strict=True))
        assert min(found.stress.values()) > -1e-9
        assert max(found.stress.values()) > 0.1
        balance = sum(w * gradients[name] for name, w in found.stress.items())
        np.testing.assert_allclose(balance, 0, atol=1e-9)


@settings(max_examples=max(5, settings.default.max_examples // 2))
@given(st.integers(0, 2**32 - 1), st.sampled_from([3, 4, 5]))
def test_random_fingers_around_random_polygons(seed, count):
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((8, 2))
    points = points[ConvexHull(points).vertices]
    points -= points.mean(axis=0)
    edges = np.roll(points, -1, axis=0) - points
    normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    chosen = rng.integers(len(points), size=count)
    at = rng.uniform(0.2, 0.8, count)
    places = points[chosen] + at[:, None] * edges[chosen] + 0.3 * normals[chosen]
    # Fingers may overlap each other: they are fixed.
    a = Arrangement(
        {"P": polygon(points)}, fixed={f"F{k}": disc(0.3, at=p) for k, p in enumerate(places)}
    )
    q = a.point({"P": [0, 0]})
    found = immobility(a.polyhedron, q)
    near = [room(a.polyhedron, q, d) for d in (1e-3, 1e-4, 1e-5, 1e-6)]
    if found.mobility in {Mobility.FIRST_ORDER, Mobility.SECOND_ORDER}:
        assert max(near[2:]) < 0
    elif found.mobility is Mobility.MOBILE:
        assert max(near) > 0


def test_a_wedge_between_two_grooves_is_held_by_unions():
    """A square on its corner between two grooves of sharp bars: edges on edges."""
    bar = polygon([[-1, 0], [1, 0], [1, -0.3], [-1, -0.3]])
    square = polygon([[0, -1], [1, 0], [0, 1], [-1, 0]])
    places = [
        bar.moved(0.5 * np.array([math.cos(a), math.sin(a)]) * 2**0.5, a + math.pi / 2)
        for a in (math.pi / 4 + k * math.pi / 2 for k in range(4))
    ]
    a = Arrangement({"S": square}, fixed={f"B{k}": place for k, place in enumerate(places)})
    q = a.point({"S": [0, 0]})
    assert a.polyhedron.is_union
    found = immobility(a.polyhedron, q)
    assert found.mobility is Mobility.FIRST_ORDER
    assert room(a.polyhedron, q, 0.05) < 0


def test_a_ball_in_a_corner_of_space_and_a_rolling_one():
    walls = {f"w{k}": HalfSpace(n, [0, 0, 0]) for k, n in enumerate(np.eye(3))}
    cap = {"cap": sphere(0.5, at=1 + 1.5 * np.ones(3) / 3**0.5)}
    a = Arrangement({"B": sphere(1.0)}, walls, fixed=cap)
    assert immobility(a.polyhedron, [1, 1, 1]).mobility is Mobility.FIRST_ORDER
    spins = Arrangement({"B": sphere(1.0)}, walls, fixed=cap, orientations="all")
    q = spins.point({"B": [1, 1, 1]})
    turning = immobility(spins.polyhedron, q)
    assert turning.mobility is Mobility.MOBILE
    np.testing.assert_allclose(turning.motion[:3], 0, atol=1e-9)


def test_jumps_of_curvature_decide_nothing():
    """A finger at the very corner of a rounded body: the second derivatives jump."""
    space = Manifold.euclidean("x y")
    x, y = space.symbols
    import sympy

    bent = sympy.Piecewise((y - x**2, x > 0), (y + x**2, True))
    with pytest.warns(match="jump"):
        d = Polyhedron(space, [bent, -y])
    assert immobility(d, [0, 0]).mobility is Mobility.UNDECIDED


def test_infinite_slopes_decide_nothing():
    import sympy

    space = Manifold.euclidean("x y")
    x, y = space.symbols
    d = Polyhedron(space, [sympy.sqrt(x), -x + y, -y])
    assert immobility(d, [0, 0]).mobility is Mobility.UNDECIDED


def test_a_point_outside_is_refused():
    space = Manifold.euclidean("x y")
    x, y = space.symbols
    with pytest.raises(ValueError, match="q: expected a point of the polyhedron"):
        immobility(Polyhedron(space, [x, y]), [-1, 0])
    with pytest.raises(TypeError, match="polyhedron"):
        immobility(x, [0, 0])
