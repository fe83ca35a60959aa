"""Repeated bodies in periodic boxes: neighbours, contacts and momenta through the sides."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import Manifold, Polyhedron, simulate, velocities
from polycorner.bodies import Arrangement, HalfSpace, capsule, disc, mass_of, sphere
from polycorner.motion import ContactFamily, Solver, System, pair_coordinates
from polycorner.motion.simulation import start

RADIUS, BOX = 0.08, np.array([1.0, 1.3])
ROD = capsule([-0.1, 0], [0.2, 0], 0.05)


def images(away, box):
    """Return displacements to the nearest images."""
    return away - box * np.round(away / box)


def apart(q, box):
    """Return the distances of all pairs to the nearest images."""
    one, two = np.triu_indices(len(q), 1)
    return np.linalg.norm(images(q[one] - q[two], box), axis=-1)


def scattered(rng, count, box, distance):
    """Return places in several boxes, farther apart than a distance."""
    places = np.empty((0, len(box)))
    while len(places) < count:
        tried = np.vstack([places, rng.random(len(box)) * box])
        if len(tried) == 1 or apart(tried, box).min() > distance:
            places = tried
    return places + box * rng.integers(-2, 3, places.shape)


@cache
def gas(count):
    """Return the system of elastic discs in a box."""
    return Arrangement({"D": disc(RADIUS)}, period=BOX.tolist()).system(restitution=1, count=count)


@pytest.mark.parametrize(("body", "count"), [(ROD, 2), (disc(0.1), 4)])
def test_repeated_bodies_move_as_listed_ones(body, count):
    """Rough rods that are not placed by their middles, and discs; they collide two by two."""
    rng, box = np.random.default_rng(0), np.array([0.9, 1.0])
    rough = {"friction": 0.4, "rolling": 0.1, "restitution": 0.9}
    q = np.column_stack([scattered(rng, count, box, 0.4), rng.uniform(-3, 3, count)])
    v = 2 * rng.normal(size=q.shape)
    one, many = (
        Arrangement(bodies, orientations="all", period=box.tolist())
        for bodies in ([body], [body] * count)
    )
    ways = []
    for system, shape in (
        (one.system(count=count, **rough), (count, 3)),
        (many.system(**rough), -1),
    ):
        begun = system.state(q.reshape(shape), v.reshape(shape))
        ways.append(simulate(system, begun, 1.0, 1e-3, every=50))
    repeated, listed = ways
    assert sum(bool(event.contact) for event in repeated.events) > 2
    assert (np.abs(repeated.q[-1] - q)[:, :2] > box).any()
    np.testing.assert_allclose(repeated.q.reshape(len(listed.q), -1), listed.q[:, 0], atol=1e-6)


@pytest.mark.parametrize("shift", [[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])
def test_motion_is_the_same_when_all_bodies_are_shifted(shift):
    rng, count = np.random.default_rng(1), 8
    q, v = scattered(rng, count, BOX, 2.2 * RADIUS), rng.normal(size=(count, 2))
    system, by = gas(count), np.array(shift) * BOX
    paths = [simulate(system, system.state(x, v), 0.4, 2e-3) for x in (q, q + by)]
    assert sum(bool(event.contact) for event in paths[0].events) > 2
    np.testing.assert_allclose(paths[1].q[-1], paths[0].q[-1] + by, atol=1e-9)


def test_a_gas_keeps_momentum_and_energy_as_it_goes_round_the_box():
    rng, count = np.random.default_rng(2), 20
    q, v = scattered(rng, count, BOX, 2.1 * RADIUS), rng.normal(size=(count, 2))
    system = gas(count)
    path = simulate(system, system.state(q, v), 5.0, 2e-3, every=10)
    turns = np.round((path.q[-1] - q) / BOX)
    assert (np.abs(turns).max(axis=0) >= 1).all()
    assert sum(bool(event.contact) for event in path.events) > 200
    assert path.effort.unconverged == 0
    np.testing.assert_allclose(
        path.v.sum(axis=1), np.tile(v.sum(axis=0), (len(path.v), 1)), atol=1e-9
    )
    np.testing.assert_allclose(path.kinetic, path.kinetic[0], rtol=1e-9)
    assert min(apart(x, BOX).min() for x in path.q) > 2 * RADIUS - 1e-4


@pytest.mark.parametrize("axis", range(3))
def test_two_spheres_meet_through_any_side(axis):
    """One flies away from the other and meets its image; the rough central hit exchanges speeds."""
    box, along = [1.0, 1.2, 1.4], np.eye(3)[axis]
    a = Arrangement({"D": sphere(0.1)}, orientations="all", period=box)
    system = a.system(restitution=1.0, friction=0.3, rolling=0.1, count=2)
    places = [0.3 * np.ones(3), 0.3 * np.ones(3) + 0.3 * along]
    q = [a.point({"D": (p, Rotation.identity())}) for p in places]
    v = [a.velocity(x, {"D": (w * along, [0, 0, 0])}) for x, w in zip(q, (-1.0, 0.0), strict=True)]
    t = box[axis] - 0.3 - 0.2
    path = simulate(system, system.state(q, v), t + 0.25, 1e-2)
    (event,) = [event for event in path.events if event.contact]
    assert event.time == pytest.approx(t, abs=1e-9)
    np.testing.assert_allclose(path.v[-1, :, :3], [0 * along, -along], atol=1e-9)
    np.testing.assert_allclose(path.q[-1, 1, :3], places[1] - 0.25 * along, atol=1e-9)


def test_rough_bodies_in_a_channel_keep_the_momentum_along_it():
    walls = {"floor": HalfSpace([0, 1], [0, 0]), "lid": HalfSpace([0, -1], [0, 1])}
    rod = capsule([-0.15, 0], [0.15, 0], 0.05)
    a = Arrangement({"D": rod}, walls, orientations="all", period=[1.3, None])
    laws = {"friction": {"between": 0.5}, "rolling": {"between": 0.1}}
    system = a.system(gravity=[0, -2.0], restitution=0.5, count=5, **laws)
    rng, x = np.random.default_rng(3), 0.26 * np.arange(5) - 2.6
    q = np.column_stack([x, np.tile([0.3, 0.7], 3)[:5], np.full(5, 1.4)])
    v = rng.normal(size=q.shape)
    path = simulate(system, system.state(q, v), 2.0, 5e-3, every=20)
    assert path.dissipated["rolling"][-1] > 0
    momenta = mass_of(rod).mass * path.v[:, :, 0].sum(axis=1)
    np.testing.assert_allclose(momenta, momenta[0], atol=1e-12)


@pytest.mark.parametrize("box", [[3.0, 40.0], [40.0, 3.0], [5.0, 7.0]])
def test_neighbours_are_all_pairs_of_near_images(box):
    """Also in a box hardly wider than bodies reach, where a list must not name a pair twice."""
    rng, box = np.random.default_rng(4), np.array(box)
    system = Arrangement({"D": disc(0.5)}, period=box.tolist()).system(count=12)
    q = scattered(rng, 12, box, 1.0)
    engine = start(system, system.state(q), 1e-3)
    engine.advance(1)
    count = int(engine.work.neighbours.status[0])
    listed = [tuple(pair) for pair in engine.work.neighbours.pairs[:count].tolist()]
    one, two = np.triu_indices(12, 1)
    near = apart(q, box) < 1.0 * (1 + 0.3)
    assert len(set(listed)) == len(listed)
    assert set(zip(one[near].tolist(), two[near].tolist(), strict=True)) <= set(listed)


def test_beads_on_a_ring_meet_around_it():
    """A system of one circle, with a gap of its own."""
    import sympy

    M = Manifold(("a",), periods=(5.0,))
    ((one,), (two,)), (v,) = pair_coordinates(M), velocities(M)
    turn = 2 * sympy.pi * (two - one) / 5
    away = 5 / (2 * sympy.pi) * sympy.Abs(sympy.atan2(sympy.sin(turn), sympy.cos(turn)))
    beads = System(
        Polyhedron(M, {"free": sympy.Integer(1)}),
        v**2 / 2,
        count=2,
        between=ContactFamily({"beads": away - 1}, reach=1.0, restitution=1.0),
    )
    path = simulate(beads, beads.state([[0.5], [2.0]], [[-1.0], [0.0]]), 3.0, 1e-2)
    np.testing.assert_allclose(path.q[-1], [[-2.0], [1.5]], atol=1e-9)
    with pytest.raises(ValueError, match="q: expected a placement without overlap"):
        beads.state([[0.2], [4.9]])


def test_threads_and_strips_go_around_the_box():
    """A dense layer that falls together along a channel, in cyclic strips of a crowd."""
    side, width = 24, 2.1 * 24
    walls = {"floor": HalfSpace([0, 1], [0, 0])}
    a = Arrangement({"D": disc(1.0)}, walls, orientations="all", period=[width, None])
    system = a.system(gravity=[0, -10.0], friction=0.3, rolling=0.05, count=side**2)
    rows, columns = np.divmod(np.arange(side**2), side)
    places = np.stack([2.1 * columns + 1.05 * (rows % 2) - 10, 1.01 + 1.71 * rows], axis=-1)
    state = system.state(np.column_stack([places, 0 * rows]))
    engines = [
        start(system, state, 5e-3, solver=Solver(tolerance=1e-4, crowd_sweeps=6, threads=n))
        for n in (1, 3)
    ]
    for engine in engines:
        engine.advance(60)
    single, several = engines
    strips, around = single.work.crowd.strips[:2].tolist()
    assert around
    assert strips > 4
    assert strips % 2 == 0
    for name, array in single.save().items():
        np.testing.assert_array_equal(several.save()[name], array, err_msg=name)
    deepest = 2.0 - apart(single.motion.q[:, :2], np.array([width, 1e9])).min()
    assert deepest < 0.05
