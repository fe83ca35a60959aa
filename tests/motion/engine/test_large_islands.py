"""What holds for islands of any size: impacts gain no energy, and nothing passes through.

Oracles are sums over bodies, straight flights in samples, and distances from their definition.
"""

from functools import cache

import numpy as np
import pytest

from polycorner import velocities
from polycorner.bodies import Arrangement, HalfSpace, Mass, capsule, disc
from polycorner.motion import EventKind, Solver
from polycorner.motion.engine.crowds import CROWD
from polycorner.motion.engine.partition import LARGE
from polycorner.motion.simulation import start
from tests.support.rods import distance

MASS, INERTIA = 2.0, 0.3
HALF, RADIUS, THIN = 0.5, 0.1, 0.02


def box(width, height):
    walls = {"floor": ([0, 1], [0, 0]), "left": ([1, 0], [0, 0])}
    walls |= {"right": ([-1, 0], [width, 0]), "top": ([0, -1], [0, height])}
    return {name: HalfSpace(*wall) for name, wall in walls.items()}


@cache
def gas(law, columns, rows, restitution, friction):
    """Rods in a box without gravity, nearly touching, that are thrown."""
    rod, size = capsule([-HALF, 0], [HALF, 0], RADIUS), (1.3 * columns, 0.3 * rows)
    arrangement = Arrangement({"A": rod}, box(*np.add(size, 1.0)), orientations="all")
    given = {"friction": friction, "restitution": restitution, "count": columns * rows}
    return arrangement.system(masses={"A": Mass(MASS, [0, 0], INERTIA)}, impact=law, **given)


def thrown(law, columns, rows, restitution, friction, seed, solver):
    """Return kinetic energies after each step, from the definition, and the largest islands."""
    system, rng = gas(law, columns, rows, restitution, friction), np.random.default_rng(seed)
    x, y = np.meshgrid(0.7 + 1.25 * np.arange(columns), 0.3 + 0.3 * np.arange(rows))
    q = np.column_stack([x.ravel(), y.ravel(), rng.uniform(-0.07, 0.07, x.size)])
    engine = start(system, system.state(q, rng.normal(size=q.shape)), 0.01, solver=solver)
    energies, islands = [], []
    for _ in range(60):
        v = engine.motion.v
        energies.append((MASS * v[:, :2] ** 2).sum() / 2 + (INERTIA * v[:, 2] ** 2).sum() / 2)
        engine.advance(1)
        islands.append(np.diff(engine.work.island.start).max())
    return np.array(energies), np.array(islands), engine


@pytest.mark.parametrize("law", ["poisson", "newton", "stronge"])
@pytest.mark.parametrize(("restitution", "friction"), [(1.0, 1.0), (0.6, 0.4)])
def test_a_gas_of_rods_that_is_solved_gains_no_energy(law, restitution, friction):
    energies, islands, engine = thrown(law, 6, 12, restitution, friction, 3, None)
    assert (islands > LARGE).sum() > 10
    assert engine.effort.unconverged == 0
    assert np.diff(energies).max() <= engine.model.tolerance * energies[0]


@pytest.mark.parametrize("law", ["poisson", "newton", "stronge"])
@pytest.mark.parametrize("sweeps", [3, 10])
def test_a_gas_of_rods_that_is_swept_gains_no_energy(law, sweeps):
    """However little of a step a few sweeps solve."""
    for friction in (0.3, 1.0):
        solver = Solver.crowd(sweeps)
        energies, islands, _ = thrown(law, 10, 15, 1.0, friction, 3, solver)
        assert (islands > CROWD).sum() > 10
        assert np.diff(energies).max() <= 1e-12 * energies[0]


def test_newtons_law_as_published_gains_energy_where_it_is_swept():
    energies, _, _ = thrown("newton unlimited", 10, 15, 1.0, 0.3, 3, Solver.crowd(3))
    assert np.diff(energies).max() > 1e-2 * energies[0]


def test_what_is_taken_back_leaves_impulses_in_their_cones_and_velocities_that_follow_from_them():
    """Impulses push, friction is within its cone, and momentum is that of the impulses."""
    friction, taken = 0.3, 0
    system, rng = gas("poisson", 10, 15, 1.0, friction), np.random.default_rng(3)
    x, y = np.meshgrid(0.7 + 1.25 * np.arange(10), 0.3 + 0.3 * np.arange(15))
    q = np.column_stack([x.ravel(), y.ravel(), rng.uniform(-0.07, 0.07, x.size)])
    state = system.state(q, rng.normal(size=q.shape))
    engine = start(system, state, 0.01, solver=Solver.crowd(3))
    for _ in range(30):
        before, sweeps = engine.motion.v.copy(), engine.effort.sweeps
        engine.advance(1)
        block, v = engine.work.block, before.copy()
        starts = engine.work.island.start
        for i in np.flatnonzero(np.diff(starts) > CROWD):
            taken += engine.effort.sweeps > sweeps + 3
            blocks = block.order[starts[i] : starts[i + 1]]
            K, p = engine.work.velocity.new.shape[1], block.impulse
            for b in blocks:
                if block.rows[b]:
                    assert abs(p[b, 0]) <= friction * p[block.pressing[b], 0] * (1 + 1e-9)
                else:
                    assert p[b, 0] >= 0
                for side, body in enumerate(block.bodies[b]):
                    if body >= 0:
                        row = block.jacobian[b, 0, side * K : side * K + 3]
                        v[body] += p[b, 0] * row / [MASS, MASS, INERTIA]
            moved = np.unique(block.bodies[blocks])
            moved = moved[moved >= 0]
            found = engine.motion.v[moved]
            np.testing.assert_allclose(found, v[moved], atol=1e-11 * abs(before).max())
    assert taken


@cache
def thin_rods(side):
    rod = Arrangement({"A": capsule([-HALF, 0], [HALF, 0], THIN)}, orientations="all")
    return rod.system(friction=0.3, restitution=0.5, count=side**2 + 1)


def spins(seed, number, side):
    """A crowd of rods at rest, one in a hole that spins and flies, and when it meets one first."""
    rng, at = np.random.default_rng(seed), np.arange(side) - side // 2
    x, y = np.meshgrid(1.1 * at, 0.15 * at)
    others = np.column_stack([x.ravel(), y.ravel(), rng.uniform(-0.1, 0.1, side**2)])
    hole = (others[:, 0] == 0) & (abs(others[:, 1]) < 0.32)
    others[hole, 1] += 0.15 * side  # on top of their column
    near = others[np.linalg.norm(others[:, :2], axis=1) < 2.5]
    while number:
        spun = np.array([0.0, 0.0, rng.uniform(-0.1, 0.1)])
        turn = rng.choice([-1, 1]) * rng.uniform(100, 200)
        v = np.array([rng.uniform(-3, 3), rng.uniform(-3, 3), turn])
        t = np.linspace(0, 0.04, 4001)
        # All others are at rest, so that up to then it flies straight on.
        gap = distance((spun + t[:, None] * v)[:, None], near, HALF).min(axis=1) - 2 * THIN
        met = np.flatnonzero(gap < 0)
        if gap[0] < 0.01 or not len(met):
            continue
        number -= 1
        yield np.vstack([others, spun]), np.vstack([0 * others, v]), t[met[0]]


def flown(system, q, v, dt, steps, **given):
    """Return the states after each step, the events, and the largest island of all steps."""
    engine = start(system, system.state(q, v), dt, solver=Solver(tolerance=1e-4, **given))
    states, events, largest = [q], [], 0
    for _ in range(steps):
        events += list(engine.advance(1))
        states.append(engine.motion.q.copy())
        largest = max(largest, np.diff(engine.work.island.start).max())
    return np.array(states), events, largest


def crossings(states):
    """Return how many recorded states there are with rods that cross each other."""
    one, two = np.triu_indices(states.shape[1], 1)
    near = np.linalg.norm(states[:, one, :2] - states[:, two, :2], axis=2).min(axis=0) < 1.1
    one, two = one[near], two[near]
    return int((distance(states[:, one], states[:, two], HALF) == 0).any(axis=1).sum())


@pytest.mark.parametrize("dt", [0.03, 0.02])
def test_a_rod_that_spins_in_a_crowd_meets_what_it_would_sweep_through(dt):
    """When its straight flight does, and no two rods cross each other at any instant."""
    side, steps, passed = 13, 3, 0
    system = thin_rods(side)
    for q, v, met in spins(1, 2, side):
        states, events, largest = flown(system, q, v, dt, steps, crowd_sweeps=10)
        assert largest > CROWD
        assert not [event for event in events if event.kind is EventKind.FAILED]
        first = min(event.time for event in events if side**2 in event.bodies)
        assert first == pytest.approx(met, abs=dt / 8)
        assert not crossings(states)
        plain, _, _ = flown(system, q, v, dt, steps, crowd_sweeps=10, refine=False)
        passed += crossings(plain) > 0
    assert passed


@pytest.mark.parametrize("dt", [0.03, 0.02])
def test_a_rod_of_a_large_island_that_spins_does_not_pass_through_a_fixed_one(dt):
    """It meets a thin bar where its straight flight does; others lie below, in the same island."""
    bar, side, steps, passed = np.zeros(3), 7, 3, 0
    rod, fixed = (capsule([-HALF, 0], [HALF, 0], THIN) for _ in range(2))
    arrangement = Arrangement({"A": rod}, fixed={"bar": fixed}, orientations="all")
    system, rng = arrangement.system(restitution=0.5, count=side**2 + 1), np.random.default_rng(4)
    x, y = np.meshgrid(1.1 * (np.arange(side) - 3), -2.0 - 0.1 * np.arange(side))
    pile = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    for _ in range(3):
        spun = np.array([rng.uniform(-0.2, 0.2), rng.uniform(-0.4, -0.2), rng.uniform(-0.1, 0.1)])
        v = np.vstack([0 * pile, [*rng.uniform(-2, 2, 2), rng.uniform(100, 200)]])
        t = np.linspace(0, 0.04, 4001)[:, None]
        met = np.flatnonzero(distance(spun + t * v[-1], bar, HALF) < 2 * THIN)
        if not met.size or not met[0]:
            continue
        q = np.vstack([pile, spun])
        states, events, _ = flown(system, q, v, dt, steps)
        struck = [e.time for e in events if e.bodies == (side**2,) and "bar" in e.contact]
        assert struck[0] == pytest.approx(float(t[met[0], 0]), abs=dt / 8)
        assert (distance(states[:, -1], bar, HALF) > 0).all()
        plain, _, largest = flown(system, q, v, dt, steps, refine=False)
        assert largest > LARGE
        passed += (distance(plain[:, -1], bar, HALF) == 0).any()
    assert passed


def test_bodies_of_a_crowd_that_are_sunk_into_each_other_are_told():
    """Discs of a lattice, of which two are pushed together to a third of their distance."""
    arrangement = Arrangement({"D": disc(1.0)}, box(100.0, 900.0), orientations="all")
    system = arrangement.system(count=800)
    rows, columns = np.divmod(np.arange(800), 4)
    q = np.column_stack([10 + 2.0 * columns, 10 + 2.0 * rows, 0 * rows])
    engine = start(system, system.state(q), 5e-3, solver=Solver(tolerance=1e-4, crowd_sweeps=3))
    engine.motion.v[:, 0] = -0.2 * (columns - 1.5)
    engine.advance(1)
    assert (np.diff(engine.work.island.start) > CROWD).any()
    engine.motion.q[401, 0] = engine.motion.q[400, 0] + 0.7
    events = list(engine.advance(1))
    failed = [event for event in events if event.kind is EventKind.FAILED]
    assert {400, 401} in [set(event.bodies) for event in failed]


def test_limits_on_velocities_act_in_a_large_island():
    """Discs that a slope accelerates, in rows upon each other, stay below a speed."""
    arrangement = Arrangement(
        {"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all"
    )
    along, most = velocities(arrangement.manifold)[0], 0.5
    system = arrangement.system(
        gravity=[3, -10], friction=0.2, count=60, limits={"speed": most - along}
    )
    rows, columns = np.divmod(np.arange(60), 10)
    q = np.column_stack([2.01 * columns + rows % 2, 1.0 + 1.75 * rows, 0 * rows])
    engine, largest, fastest = start(system, system.state(q), 5e-3), 0, []
    for _ in range(60):
        engine.advance(1)
        largest = max(largest, np.diff(engine.work.island.start).max())
        fastest.append(engine.motion.v[:, 0].max())
    assert largest > LARGE
    assert engine.effort.unconverged == 0
    assert max(fastest) <= most + engine.model.tolerance * abs(engine.motion.v).max()
    assert max(fastest) > 0.99 * most
    assert engine.motion.limit_acts.any()
