"""Friction at rounded polygons and polyhedra: slips from the definition, sliding and rolling."""

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, disc, mass_of, polygon, polytope, sphere
from polycorner.bodies.pairs import distances
from polycorner.bodies.slips import SLIDING, slips_of
from polycorner.motion import Solver
from polycorner.motion.contacts import motions

TRIANGLE = [[0, 0], [2, 0], [1, 1.5]]
SIMPLEX = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0.3, 0, 1]]


def nearest(p, vertices):
    """The nearest point of a hull: a mean of vertices, of which those that count span a flat."""
    heavy = 1e4
    rows = np.vstack([vertices.T, heavy * np.ones(len(vertices))])
    weights, _ = nnls(rows, np.append(p, heavy), maxiter=1000)
    some = vertices[weights > 1e-9]
    along = (some[1:] - some[0]).T
    return some[0] + along @ np.linalg.lstsq(along, p - some[0], rcond=None)[0]


@pytest.mark.parametrize(
    ("point", "hull"),
    [
        (disc(0.2, at=[0.1, 0]), polygon(TRIANGLE, 0.1)),
        (disc(0.2), polygon(TRIANGLE)),
        (sphere(0.3, at=[0.1, 0, 0.2]), polytope(SIMPLEX, 0.1)),
    ],
)
def test_the_slip_is_that_of_material_points(point, hull):
    rng = np.random.default_rng(0)
    a = Arrangement({"A": point, "B": hull}, orientations="all")
    d = a.dimension
    (touch,) = distances(a.manifold, *a.pairs[0])
    rows = slips_of(motions(a.manifold), touch, SLIDING)
    cases = set()
    for _ in range(60):
        turns = (
            rng.uniform(-3, 3, 2) if d == 2 else [Rotation.random(random_state=rng) for _ in "AB"]
        )
        origins = rng.uniform(-2, 2, (2, d))
        q = a.point({name: tuple(place) for name, *place in zip("AB", origins, turns, strict=True)})
        spins, rates = rng.normal(size=(2, 3)), rng.normal(size=(2, d))
        moving = [
            (rate, spin[2] if d == 2 else spin) for rate, spin in zip(rates, spins, strict=True)
        ]
        v = a.velocity(q, dict(zip("AB", moving, strict=True)))
        placed = a.placed(q)
        p, vertices = placed["A"].parts[""].points[0], placed["B"].parts[""].points
        foot = nearest(p, vertices)
        if np.linalg.norm(p - foot) < 1e-3:
            continue
        normal = (p - foot) / np.linalg.norm(p - foot)
        place = p - point.parts[""].radius * normal
        omega = spins * [0, 0, 1] if d == 2 else spins
        first, second = (
            rate + np.cross(w, np.append(place - origin, np.zeros(3 - d)))[:d]
            for rate, w, origin in zip(rates, omega, origins, strict=True)
        )
        relative = first - second
        found = np.array([row.value([*q, *v]) for row in rows])
        by_velocity = [row.gradient([*q, *v])[len(q) :] for row in rows]
        np.testing.assert_allclose(by_velocity @ v, found, atol=1e-12)
        if d == 2:
            assert found[0] == pytest.approx(normal[0] * relative[1] - normal[1] * relative[0])
        along = relative - (relative @ normal) * normal
        assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(along), abs=1e-9)
        cases.add(int((np.linalg.norm(vertices - foot, axis=1) < 1e-9).any()))
    assert cases == {0, 1}  # at vertices and elsewhere


def rectangle(a, b, r):
    return polygon([[-a, -b], [a, -b], [a, b], [-a, b]], r)


@pytest.mark.parametrize(("mu", "share"), [(0.2, 1.0), (0.4, 0.0)])
def test_a_block_on_a_ramp_slides_if_the_slope_is_steep(mu, share):
    """``a = g (sin - mu cos)``; two corners of the block stand on one side of the ramp."""
    slope = 0.3
    ramp = rectangle(5, 1, 0.1).moved([0, 0], slope)
    a = Arrangement({"A": rectangle(0.4, 0.2, 0.1)}, fixed={"ramp": ramp}, orientations="all")
    system = a.system(gravity=[0, -10.0], friction=mu)
    up = np.array([-np.sin(slope), np.cos(slope)])
    path = simulate(system, system.state(a.point({"A": (1.4 * up, slope)})), 0.3, 1e-3)
    speed = share * 10 * (np.sin(slope) - mu * np.cos(slope)) * 0.3
    down = -speed * np.array([np.cos(slope), np.sin(slope)])
    np.testing.assert_allclose(path.v[-1, 0], [*down, 0], atol=1e-9)


def test_a_cart_carries_a_block_until_they_move_together():
    """Rough on each other, on a smooth floor: the momentum is shared."""
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    bodies = {"cart": rectangle(1.0, 0.3, 0.1), "block": rectangle(0.3, 0.2, 0.1)}
    a = Arrangement(bodies, floor, orientations="all")
    rough = [touch.gap.name for pair in a.pairs for touch in distances(a.manifold, *pair)]
    system = a.system(gravity=[0, -10.0], friction=dict.fromkeys(rough, 0.3))
    q = a.point({"cart": [0, 0.4], "block": [0, 1.1]})
    path = simulate(system, system.state(q, a.velocity(q, {"cart": [1.0, 0]})), 0.6, 2e-3)
    first, second = (mass_of(body).mass for body in bodies.values())
    common = first / (first + second)
    np.testing.assert_allclose(path.v[-1, 0], [common, 0, 0] * 2, atol=1e-9)


def test_a_ball_rolls_down_a_brick():
    """At 5/7 of the acceleration of one that slides."""
    slope = 0.3
    turn = Rotation.from_rotvec([0, slope, 0])
    corners = np.array(np.meshgrid([-5, 5], [-5, 5], [-1, 1])).reshape(3, -1).T
    ramp = polytope(corners, 0.1).moved([0, 0, 0], turn)
    a = Arrangement({"A": sphere(0.3)}, fixed={"ramp": ramp}, orientations="all")
    system = a.system(gravity=[0, 0, -10.0], friction=0.5)
    start = system.state(a.point({"A": turn.apply([0, 0, 1.4])}))
    path = simulate(system, start, 0.3, 2e-3)
    expected = turn.apply([10 * np.sin(slope) * 5 / 7 * 0.3, 0, 0])
    np.testing.assert_allclose(path.v[-1, 0, :3], expected, atol=1e-9)


def test_repeated_blocks_stand_on_each_other():
    """A tower of three on a slope stays or slides as one, with friction everywhere."""
    block = rectangle(0.4, 0.2, 0.1)
    up = np.array([-np.sin(0.2), np.cos(0.2)])
    a = Arrangement({"B": block}, {"slope": HalfSpace(up, [0, 0])}, orientations="all")
    starts = [[*(0.3 + 0.6 * k) * up, 0.2] for k in range(3)]
    for mu, share in ((0.25, 0.0), (0.15, 1.0)):
        gravity = [0, -10.0]
        system = a.system(
            gravity=gravity,
            friction={"between": 0.9} | dict.fromkeys([f"B.v{k}-slope" for k in range(1, 5)], mu),
            count=3,
        )
        exactly = Solver(tolerance=1e-9)
        path = simulate(system, system.state(starts), 0.1, 1e-3, solver=exactly)
        speed = share * 10 * (np.sin(0.2) - mu * np.cos(0.2)) * 0.1
        down = [-speed * np.cos(0.2), -speed * np.sin(0.2), 0]
        np.testing.assert_allclose(path.v[-1], [down] * 3, atol=1e-7)
