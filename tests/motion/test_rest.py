"""What rests stays where it is: nothing creeps, nothing lifts off, redundant forces balance."""

import math

import numpy as np
import pytest
from step_inclusion import assemble

from polycorner import minimise
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.models import supports
from polycorner.models import textbook as scenes
from polycorner.motion.events import EventKind
from polycorner.motion.friction import Disc, Interval
from polycorner.motion.mechanics import State
from polycorner.motion.noise import Solver
from polycorner.motion.simulation import simulate, start

G = scenes.GRAVITY
LONG = 100_000  # steps
STEEP = 0.3  # friction 0.5 holds at this angle, tan(0.3) = 0.309


def floors(count):
    """Boxes of height 1 on top of each other."""
    return [c for i in range(count) for c in (0.0, 0.5 + i, 0.0)]


SCENES = {
    "block": (scenes.sliding_block(Disc(0.5), angle=STEEP), [0, 0]),
    "ball": (scenes.ball_on_plane(Disc(0.5), Disc(0.5), angle=STEEP), [0] * 4),
    "box": (scenes.box_on_plane(1.0, 0.5, Interval(0.5), angle=STEEP), [0, 0.5, 0]),
    "table": (supports.table(Disc(0.5), angle=STEEP), [0] * 6),
    "stack": (supports.stack(3, Interval(0.5), angle=0.2), floors(3)),
    "groove": (supports.groove(Interval(0.5)), [0, math.sqrt(2), 0]),
    "pile": (supports.pile_of_discs(), [1, 1, 3, 1, 2, 1 + math.sqrt(3)]),
}


def at_rest(name, steps, dt=1e-3):
    system, q = SCENES[name]
    engine = start(system, system.state(q), dt)
    engine.advance(steps)
    return system, np.array(q, dtype=float), engine


def imbalance(system, engine):
    """Sum of all forces on a system that rests, from the impulses of its last step."""
    motion, dt = engine.motion, engine.dt
    state = State(engine.time, motion.q[0], motion.v[0], motion.sticks.astype(bool))
    problem = assemble(system, state, dt)
    total = problem.mass @ (problem.v_free - problem.v) + problem.normals.T @ motion.normal
    for block, p in zip(problem.blocks, motion.friction, strict=True):
        total = total + block.matrix.T @ p[: len(block.matrix)]
    return total / dt


# ---------------------------------------------------------------------------------------- no creep


@pytest.mark.parametrize("name", SCENES)
def test_what_rests_has_not_moved_a_bit(name):
    _, q, engine = at_rest(name, LONG)
    assert (engine.motion.q[0] == q).all()
    assert not engine.motion.v.any()
    assert engine.motion.rests.all()
    assert engine.effort.unconverged == 0


@pytest.mark.parametrize("name", SCENES)
def test_forces_at_rest_balance(name):
    system, _, engine = at_rest(name, 10)
    np.testing.assert_allclose(imbalance(system, engine), 0, atol=1e-9)
    motion = engine.motion
    assert (motion.normal >= 0).all()
    for friction, p, owner, sources in zip(
        system.friction,
        motion.friction / engine.dt,
        system.owners,
        system.load_sources,
        strict=True,
    ):
        load = motion.normal[owner] / engine.dt if owner >= 0 else G * math.cos(STEEP)
        assert bool(sources) == (owner < 0)
        assert friction.static.contains(p[: len(friction.slip)] / load, tolerance=1e-8)


def test_redundant_contacts_share_the_weight():
    """More contacts than their gradients tell apart: what is determined is right."""
    force = {}
    for name in ("table", "stack", "pile"):
        system, _, engine = at_rest(name, 10)
        force[name] = dict(zip(system.contacts, engine.motion.normal / engine.dt, strict=True))
        normals = system.polyhedron.bundle.evaluate(engine.motion.q[0], 1)[1]
        assert np.linalg.matrix_rank(normals) <= len(system.contacts)
    table, stack, pile = force.values()
    assert sum(table.values()) == pytest.approx(G * math.cos(STEEP), rel=1e-9)
    legs = np.array(list(table.values())) @ [-1, 1, 1, -1]  # torque of a centre of mass at height 1
    assert legs == pytest.approx(G * math.sin(STEEP), rel=1e-9)
    for i in (1, 2, 3):
        above = (4 - i) * G * math.cos(0.2)
        assert stack[f"left{i}"] + stack[f"right{i}"] == pytest.approx(above, rel=1e-9)
    assert pile["13"] == pytest.approx(G / math.sqrt(3), rel=1e-9)
    assert pile["floor1"] == pytest.approx(1.5 * G, rel=1e-9)
    assert pile["left"] - pile["12"] == pytest.approx(G / (2 * math.sqrt(3)), rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.1])
def test_what_came_to_rest_has_no_velocity_at_all(angle):
    """With forces and without, from any motion; and it does not start again."""
    ball = scenes.ball_on_plane(Disc(0.5), Disc(0.3), angle=angle)
    block = scenes.sliding_block(Disc(0.3), angle=angle)
    rng = np.random.default_rng(1)
    for system in (ball, block):
        n = len(system.manifold.names)
        for _ in range(10):
            engine = start(system, system.state(np.zeros(n), rng.normal(size=n)), 3e-3)
            happened = engine.advance(2000)
            there = engine.motion.q.copy()
            happened += engine.advance(1000)
            assert [event.kind for event in happened] == [EventKind.REST]
            assert not engine.motion.v.any()
            assert (engine.motion.q == there).all()


def test_one_block_rests_while_another_slides_past_it():
    """Solved together, the one at rest still has the velocity zero, up to rounding."""
    free, dt = scenes.row_of_balls((1, 1), 0.0), 1e-3
    M, (v, w) = free.manifold, scenes.velocities(free.manifold)
    rough = [
        scenes.Friction(name, (speed,), Interval(0.3), (G,))
        for name, speed in zip(M.names, (v, w), strict=True)
    ]
    pulled = {"x1": G * 0.2}
    system = scenes.System(
        free.polyhedron, free.kinetic, free.potential, pulled, tuple(rough), restitution=0.0
    )
    engine = start(system, system.state([0, 10], [0, 3]), dt)
    engine.advance(500)
    assert abs(engine.motion.q[0, 0]) < 1e-15
    assert engine.motion.v[0, 1] > 1


def test_a_body_that_is_pushed_harder_than_friction_moves_at_once():
    block = scenes.sliding_block(Disc(0.3), angle=math.atan(0.31))
    engine = start(block, block.state([0, 0]), 1e-3)
    engine.advance(1)
    assert engine.motion.v[0, 0] > 0


# ------------------------------------------------------------------------------------- no lift-off


@pytest.mark.parametrize(("angle", "speed", "belt"), [(0.5, 0.0, 0.0), (0.0, 3.0, 0.0), (0, 0, 2)])
def test_a_sliding_box_stays_down_on_both_feet(angle, speed, belt):
    mu = 0.3
    box = scenes.box_on_plane(1.0, 0.5, Interval(mu), angle=angle, belt=belt)
    path = simulate(box, box.state([0, 0.5, 0], [speed, 0, 0]), 0.5, 1e-3, solver=Solver(1e-12))
    assert path.converged
    np.testing.assert_allclose(path.q[:, 0, 1], 0.5, atol=1e-13)
    np.testing.assert_allclose(path.q[:, 0, 2], 0, atol=1e-13)
    assert not path.of_kind(EventKind.LOST)
    assert path.max_penetration < 1e-13
    load = G * math.cos(angle)
    forward = mu * load if belt else -mu * load
    assert path.v[-1, 0, 0] == pytest.approx(speed + 0.5 * (G * math.sin(angle) + forward))
    back, front = (force for _, _, force in path.touching[-1])  # torque about the centre
    assert back == pytest.approx((load + forward * 0.5) / 2, rel=1e-8)
    assert front == pytest.approx((load - forward * 0.5) / 2, rel=1e-8)


def test_a_sliding_table_stays_down_on_all_legs():
    mu, angle = 0.3, 0.5
    table = supports.table(Disc(mu), angle=angle)
    path = simulate(table, table.state([0] * 6), 0.5, 1e-3)
    np.testing.assert_allclose(path.q[:, 0, 1:], 0, atol=1e-10)
    expected = 0.5 * G * (math.sin(angle) - mu * math.cos(angle))
    assert path.v[-1, 0, 0] == pytest.approx(expected, rel=1e-9)


# ------------------------------------------------------------------------------------ in the drum


def carried(drum, q, steps, dt=1e-3):
    """Displacements relative to the drum ``(10, count, 4)``, at ten instants."""
    engine = start(drum, drum.state(q), dt)
    begin, found = engine.motion.q.copy(), []
    for _ in range(10):
        engine.advance(steps // 10)
        assert (engine.motion.v == [drum.spin, 0, 0, 0]).all()
        assert engine.motion.rests.all()
        turned = drum.spin * engine.steps * dt
        found.append(engine.motion.q - begin - [turned, 0, 0, 0])
    return np.array(found)


def single(_):
    return [[0.0, 50.0, 0.2]]


def dyad(drum):
    """Two dumbbells nested at a minimum of their height in the level drum, away from its end."""
    certificate = minimise(drum.pair.polyhedron, drum.pair.energy, drum.pair.nested("R"))
    places = np.array(certificate.point).reshape(2, 3)
    places[:, 1] += 50.0
    return places


@pytest.mark.parametrize(("count", "placed"), [(1, single), (2, dyad)])
def test_what_rests_in_the_drum_goes_with_it(count, placed):
    """Along the drum and in heading nothing moves a bit; the azimuth is a sum that is rounded."""
    drum = DumbbellDrum(count=count, spin=1e-3)
    moved = carried(drum, placed(drum), LONG)
    assert not moved[:, :, 1:].any()
    assert abs(moved[:, :, 0]).max() < LONG * np.spacing(0.1)


@pytest.mark.parametrize(("count", "placed"), [(1, single), (2, dyad)])
def test_what_rests_in_a_drum_that_stands_does_not_move_a_bit(count, placed):
    drum = DumbbellDrum(count=count, spin=0.0)
    assert not carried(drum, placed(drum), LONG).any()


def test_friction_carries_a_dumbbell_as_far_as_it_can():
    """Then it rolls back: rest ends where the forces fit no more."""
    drum = DumbbellDrum(spin=0.02)
    path = simulate(drum, drum.state(single(None)), 10.0, 1e-3)
    (begin, *_) = path.of_kind(EventKind.MOTION)
    angle = 0.02 * begin.time
    assert path.rests[path.at(begin.time) - 1].all()
    assert math.atan(0.1) < angle < math.atan(0.3)  # rolling and sliding friction
