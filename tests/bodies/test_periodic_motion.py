"""Motion in periodic boxes: collisions one by one, momenta, and slips at images."""

import functools
from itertools import combinations, product

import numpy as np
import pytest
import sympy

from polycorner import simulate, velocities
from polycorner.bodies import (
    Arrangement,
    HalfSpace,
    capsule,
    compound,
    disc,
    mass_of,
    polygon,
    sphere,
)

SHIFTS = np.array([*product((-1, 0, 1), repeat=2)], dtype=float)


def next_collision(q, v, radius):
    """When equal discs on the unit torus collide next, which two, and the image of the second."""
    found = [(np.inf, 0, 0, SHIFTS[0])]
    for i, j in combinations(range(len(q)), 2):
        rate = v[j] - v[i]
        for shift in np.round(q[i] - q[j]) + SHIFTS:
            apart = q[j] + shift - q[i]
            a, b, c = rate @ rate, apart @ rate, apart @ apart - 4 * radius**2
            if b < 0 and b * b > a * c:
                found.append((c / (-b + np.sqrt(b * b - a * c)), i, j, shift))
    return min(found, key=lambda event: event[0])


def collided(q, v, radius, count):
    """Elastic discs in the middle between two collisions; and when that is.

    At a collision the velocities along the line of centres are exchanged.
    """
    q, v, t = q.copy(), v.copy(), 0.0
    for k in range(count + 1):
        after, i, j, shift = next_collision(q, v, radius)
        after = after / 2 if k == count else after
        q, t = q + after * v, t + after
        if k < count:
            normal = (q[j] + shift - q[i]) / (2 * radius)
            exchanged = normal * ((v[j] - v[i]) @ normal)
            v[i] += exchanged
            v[j] -= exchanged
    return q, v, t


@pytest.mark.parametrize("seed", range(3))
def test_a_gas_on_a_torus_collides_as_from_event_to_event(seed):
    rng = np.random.default_rng(seed)
    count, radius = 5, 0.08
    a = Arrangement([disc(radius)] * count, period=[1, 1])
    while True:
        q, v = rng.random((count, 2)), rng.normal(size=(count, 2))
        if a.polyhedron.contains(q.ravel()):
            break
    expected, speeds, t_end = collided(q, v, radius, 6)
    gas = a.system(restitution=1.0)
    path = simulate(gas, gas.state(q.ravel(), v.ravel()), t_end, t_end / 200)
    assert sum(bool(event.contact) for event in path.events) == 6
    found = path.v[-1].reshape(-1, 2)
    np.testing.assert_allclose(path.q[-1].reshape(-1, 2), expected, atol=1e-6)
    np.testing.assert_allclose(found, speeds, atol=1e-6)
    np.testing.assert_allclose(found.sum(axis=0), v.sum(axis=0), atol=1e-12)
    assert (found**2).sum() == pytest.approx((v**2).sum(), rel=1e-12)


ROD = capsule([-0.1, 0], [0.2, 0], 0.05)
TEE = compound([capsule([-0.1, 0], [0.2, 0], 0.05), disc(0.08, at=[0, 0.2])])
LONG = capsule([-0.5, 0], [0.5, 0], 0.06)


def touching(parts, others):
    """Yield gaps of ends of segments and segments, the place where they touch, and the normal.

    The place is on the part that has the end.
    """
    for (part, other), flip in product(product(parts, others), (False, True)):
        first, second = (other, part) if flip else (part, other)
        a, b = second.points[0], second.points[-1]
        along = b - a
        for p in first.points:
            at = np.clip((p - a) @ along / max(along @ along, 1e-300), 0, 1)
            foot = a + at * along
            near, far = (foot, p) if flip else (p, foot)
            away = np.linalg.norm(near - far)
            normal = (near - far) / away
            place = far + normal * other.radius if flip else near - normal * part.radius
            yield away - part.radius - other.radius, place, normal


BODIES = {"disc": [disc(0.1), ROD], "rods": [ROD, ROD], "itself": [LONG]}


@functools.cache
def rough(kind):
    """An arrangement, its gaps, and the slips there as functions of coordinates and velocities."""
    a = Arrangement(BODIES[kind], orientations="all", period=[0.95, 1.2])
    system = a.system(friction=0.3)
    symbols = [*a.manifold.symbols, *velocities(a.manifold)]
    slips = {f.load: sympy.lambdify(symbols, f.formulas[0]) for f in system.friction}
    return a, system.polyhedron, slips


def near_a_contact(a, gaps, rng):
    """Bodies in several boxes of which two nearly touch, and the gap there."""
    while True:
        q = np.concatenate([[*rng.uniform(-2, 2, 2), rng.uniform(-3, 3)] for _ in a.named])
        values = gaps.values(q)
        if abs(values.min()) < 0.03:
            return q, gaps.names[int(values.argmin())], float(values.min())


@pytest.mark.parametrize("kind", BODIES)
def test_slips_at_the_nearest_image_are_those_of_material_points(kind):
    rng = np.random.default_rng(0)
    a, gaps, slips = rough(kind)
    one, two = a.placements[0], a.placements[-1]
    shifts = [s for s in product(range(-6, 7), repeat=2) if one is not two or any(s)]
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    for _ in range(10):
        q, name, least = near_a_contact(a, gaps, rng)
        v = rng.normal(size=q.size)
        here, there = (a.placed(q)[p.name].parts.values() for p in (one, two))
        found = []
        for shift in shifts * a.lattice.lengths:
            moved = [part.moved(shift, np.eye(2)) for part in there]
            found += [(*some, shift) for some in touching(here, moved)]
        assert min(some[0] for some in found) == pytest.approx(least, abs=1e-9)
        expected = []
        for _, place, normal, shift in (some for some in found if some[0] < least + 1e-9):
            first, second = (
                v[p.at][:2] + v[p.at][2] * turn @ (place - by - q[p.at][:2])
                for p, by in ((one, np.zeros(2)), (two, shift))
            )
            expected.append(abs((turn @ normal) @ (first - second)))
        # Of two ends that touch, the gap may be that of either; a body has two equal images.
        assert len(expected) <= 2 + 2 * (one is two)
        slip = abs(slips[name](*q, *v))
        assert min(abs(slip - e) for e in expected) < 1e-7


def test_rough_bodies_through_a_side_move_as_those_that_do_not_cross_it():
    bodies, v = [ROD, TEE], [1.0, 0.2, 0.5, -0.6, 0, -1.0]
    rough = {"friction": 0.5, "restitution": 0.5, "rolling": 0.1}
    q = np.array([0.7, 0.5, 0.3, 1.2, 0.55, 0.0])
    plain, boxed = (Arrangement(bodies, orientations="all", period=p) for p in (None, [1.5, 1.5]))
    shift = np.array([0, 0, 0, -1.5, 1.5, 0])
    paths = []
    for a, start in ((plain, q), (boxed, q + shift)):
        system = a.system(**rough)
        paths.append(simulate(system, system.state(start, v), 0.6, 2e-3))
    assert any(event.contact for event in paths[0].events)
    np.testing.assert_allclose(paths[1].q[-1], paths[0].q[-1] + shift, atol=1e-9)
    np.testing.assert_allclose(paths[1].v[-1], paths[0].v[-1], atol=1e-9)


def test_a_channel_keeps_the_momentum_along_it():
    """Walls are smooth, bodies rough, and gravity acts across."""
    walls = {"floor": HalfSpace([0, 1], [0, 0]), "lid": HalfSpace([0, -1], [0, 1])}
    bodies = [disc(0.2), disc(0.15), capsule([-0.15, 0], [0.15, 0], 0.05)]
    a = Arrangement(bodies, walls, orientations="all", period=[1.3, None])
    system = a.system(gravity=[0, -2.0], friction={"1-2": 0.5, "2-3": 0.4}, restitution=0.5)
    q = a.point({"1": [0.1, 0.3], "2": [0.6, 0.4], "3": ([1.0, 0.6], 0.2)})
    v = np.array([1.0, 0, 2.0, -1.0, 0.5, 0, 0.3, 0, 1.0])
    path = simulate(system, system.state(q, v), 3.0, 5e-3)
    assert len({event.contact for event in path.events}) > 2
    masses = [mass_of(body).mass for body in bodies]
    before, after = (masses @ path.v[k, 0, ::3] for k in (0, -1))
    assert after == pytest.approx(before, abs=1e-12)


def test_gravity_along_a_periodic_direction():
    """Two balls fall around the box together."""
    a = Arrangement([sphere(0.1)] * 2, period=[1, 1, None])
    system = a.system(gravity=[1.0, 0, 0])
    start = system.state(a.point({"1": [0, 0, 0], "2": [0.5, 0.5, 0]}))
    path = simulate(system, start, 3.0, 1e-2)
    np.testing.assert_allclose(path.q[-1, 0], [4.5, 0, 0, 5.0, 0.5, 0], atol=1e-9)


def test_what_is_refused():
    narrow = r"period: expected lengths of at least 0.444444 for bodies that touch up to 0.2 apart"
    with pytest.raises(ValueError, match=narrow + ".*; got 0.4"):
        Arrangement([disc(0.1)], period=[1, 0.4]).system(count=2)
    with pytest.raises(ValueError, match=r"period: .* at least 1\.33333 "):
        Arrangement([disc(0.1)], fixed={"F": disc(0.5)}, period=[1, 1]).system(count=2)
    with pytest.raises(NotImplementedError, match="expected no images of sharp bodies"):
        Arrangement([polygon([[0, 0], [0.1, 0], [0, 0.1]])] * 2, period=[1, 1]).system()


def test_a_rod_turns_until_it_meets_its_own_image():
    """The force of its image is a torque: it bounces back and keeps its speed and momentum."""
    a = Arrangement([LONG], period=[0.95, 1.2])
    system = a.system(restitution=1.0)
    v = np.array([0.3, -0.2, 1.0])
    path = simulate(system, system.state([0.0, 0.0, np.pi / 4], v), 3.0, 1e-2)
    turns = path.v[:, 0, 2]
    np.testing.assert_allclose(abs(turns), 1.0, atol=1e-12)
    assert turns.min() < 0
    np.testing.assert_allclose(path.v[:, 0, :2], np.tile(v[:2], (len(turns), 1)), atol=1e-12)
    assert all(a.polyhedron.contains(q, tolerance=1e-9) for q in path.q[:, 0])
