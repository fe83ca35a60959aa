"""The reference step: by hand where that can be done, else against slow sweeps and definitions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, reject
from hypothesis import strategies as st
from reference_step import reference_step, solve_step
from step_inclusion import FrictionBlock, StepProblem, assemble
from step_residual import natural_residual
from strategies import reals, vectors

from polycorner import Manifold, Polyhedron
from polycorner.errors import SolverError
from polycorner.motion.contacts import Friction, velocities
from polycorner.motion.friction import ConvexPolygon, CutDisc, Disc, Ellipse, Interval
from polycorner.motion.system import System

G = 9.81

# ------------------------------------------------------------------------------------- problems


def step(mass, v_free, blocks=(), normals=(), bounds=()):
    """What a step asks, from its numbers."""
    v = np.array(v_free, dtype=float)
    bounds = np.array(bounds, dtype=float)
    normals = np.array(normals, dtype=float).reshape(len(bounds), len(v))
    mass = np.array(mass, dtype=float)
    return StepProblem(mass, v, v, 0 * v, 0 * bounds, normals, bounds, 0 * bounds, tuple(blocks))


def block(matrix, shape, load=0.0, drift=None, owner=-1):
    matrix = np.atleast_2d(np.array(matrix, dtype=float))
    drift = np.zeros(len(matrix)) if drift is None else np.array(drift, dtype=float)
    return FrictionBlock(matrix, drift, shape, float(load), owner)


def random_shape(rng, dimension, most=1.0):
    """A set of any kind, with coefficients from a twentieth of ``most`` to ``most``."""
    a, b = rng.uniform(most / 20, most, 2)
    if dimension == 1:
        return Interval(lower=-a, upper=b * rng.integers(2))
    angles = np.array([0.1, 2.2, 4.3, *rng.uniform(0, math.tau, 4)])
    corners = a * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    shapes = [Disc(a), Ellipse(a, b), CutDisc(a, a * b / most), ConvexPolygon(corners)]
    return shapes[rng.integers(4)]


def random_step(seed, *, owned=False, most=1.0, load=1.0, drifting=True):
    """A step of up to five coordinates, three contacts, four friction blocks."""
    rng = np.random.default_rng(seed)
    n, m, count = rng.integers(2, 6), rng.integers(1, 4), rng.integers(1, 5)
    root = rng.normal(size=(n, n))
    bounds = -rng.uniform(0, 1, m) * rng.integers(2, size=m)
    blocks = []
    for _ in range(count):
        d = rng.integers(1, 3)
        drift = rng.normal(size=d) * (drifting and rng.integers(2))
        owner = int(rng.integers(m)) if owned else -1
        shape = random_shape(rng, d, most)
        blocks.append(block(rng.normal(size=(d, n)), shape, load * rng.uniform(0, 2), drift, owner))
    normals = rng.normal(size=(m, n))
    return step(root @ root.T + np.eye(n), rng.normal(size=n), blocks, normals, bounds)


seeds = st.integers(0, 2**32 - 1)


def into(shape, load, p):
    return load * shape.project(p / load) if load > 1e-200 else np.zeros(len(p))


def swept(problem, sweeps=4000):
    """Velocity and impulses by Gauss-Seidel sweeps: each impulse in turn is set right."""
    inverse = np.linalg.inv(problem.mass)
    v, lam = problem.v_free.copy(), np.zeros(len(problem.bounds))
    friction = [np.zeros(len(b.matrix)) for b in problem.blocks]
    for _ in range(sweeps):
        before = np.concatenate([v, lam, *friction])
        for i, (row, bound) in enumerate(zip(problem.normals, problem.bounds, strict=True)):
            new = max(0.0, lam[i] - (row @ v - bound) / (row @ inverse @ row))
            v, lam[i] = v + inverse @ row * (new - lam[i]), new
        for k, b in enumerate(problem.blocks):
            load = b.load if b.owner < 0 else lam[b.owner]
            w = np.linalg.eigvalsh(b.matrix @ inverse @ b.matrix.T).max()
            new = into(b.shape, load, friction[k] - (b.matrix @ v + b.drift) / w)
            v, friction[k] = v + inverse @ b.matrix.T @ (new - friction[k]), new
        after = np.concatenate([v, lam, *friction])
        if abs(after - before).max() <= 1e-14 * (1 + abs(after).max()):
            return v, lam, friction
    return None


def settled(problem):
    """The step, unless friction on contacts leaves it without one, as far as sweeps can tell."""
    try:
        return solve_step(problem)
    except SolverError:
        assert any(b.owner >= 0 for b in problem.blocks)
        assert swept(problem) is None
        reject()


def cost(problem, v):
    """What the velocity minimises, from the definition."""
    away = v - problem.v_free
    dissipated = sum(b.load * b.shape.support(-(b.matrix @ v + b.drift)) for b in problem.blocks)
    return away @ problem.mass @ away / 2 + dissipated


# ------------------------------------------------------------------------------------- by hand


@given(vectors(2, 3.0), st.floats(0.1, 10), st.floats(0.01, 1), st.floats(0, 10))
def test_a_sliding_block_loses_speed_along_its_way(v, mass, mu, load):
    assume(np.linalg.norm(v) > 1e-3)
    found = solve_step(step(mass * np.eye(2), v, [block(np.eye(2), Disc(mu), load)]))
    left = max(0.0, np.linalg.norm(v) - mu * load / mass)
    np.testing.assert_allclose(found.velocity, left * v / np.linalg.norm(v), atol=1e-12)
    np.testing.assert_allclose(found.friction[0], mass * (found.velocity - v), atol=1e-11)


@given(st.floats(0, 1.5), st.floats(0, 2), st.floats(1e-4, 0.1))
def test_a_block_on_an_incline_moves_beyond_the_angle_of_friction(angle, mu, dt):
    down, load = dt * G * math.sin(angle), dt * G * math.cos(angle)
    found = solve_step(step([[1.0]], [down], [block([1.0], Interval(mu), load)]))
    assert found.velocity[0] == pytest.approx(max(0.0, down - mu * load), abs=1e-14)


@pytest.mark.parametrize("slope", [0.2, 0.5, 0.500001, 0.7, 1.5])
def test_a_box_on_an_incline_slides_beyond_the_angle_of_friction(slope):
    """Half as high as wide, on two feet: it slides before it tips, the lower foot loaded more."""
    a, b, mu, dt = 1.0, 0.5, 0.5, 0.01
    angle = math.atan(slope)
    found = solve_step(box(a, b, mu, dt, angle))
    down, load = dt * G * math.sin(angle), dt * G * math.cos(angle)
    assert found.velocity == pytest.approx([max(0.0, down - mu * load), 0, 0], abs=1e-12)
    held = min(down, mu * load)
    lower, upper = (load + held * b / a) / 2, (load - held * b / a) / 2
    assert found.normal == pytest.approx([lower, upper], abs=1e-12)
    assert sum(p[0] for p in found.friction) == pytest.approx(-held, abs=1e-12)


@pytest.mark.parametrize("slope", [0.3, 0.49, 0.51, 0.8])
def test_a_tall_box_tips_when_its_weight_passes_the_lower_foot(slope):
    """Twice as high as wide and rough: it turns about the lower foot, which stays."""
    a, b, mu, dt = 0.5, 1.0, 3.0, 0.01
    angle = math.atan(slope)
    found = solve_step(box(a, b, mu, dt, angle))
    torque = G * (b * math.sin(angle) - a * math.cos(angle))
    spin = max(0.0, dt * torque / (inertia(a, b) + a**2 + b**2))
    assert found.velocity == pytest.approx([b * spin, a * spin, -spin], abs=1e-12)


def inertia(a, b):
    return (a**2 + b**2) / 3


def box(a, b, mu, dt, angle):
    """A box of mass 1 at rest; ``x`` down the incline, ``y`` away from it, turned by the third."""
    pull = [dt * G * math.sin(angle), -dt * G * math.cos(angle), 0.0]
    feet = [(a, -b), (-a, -b)]
    normals = [(0, 1, x) for x, _ in feet]
    blocks = [block([1, 0, -y], Interval(mu), owner=i) for i, (_, y) in enumerate(feet)]
    return step(np.diag([1, 1, inertia(a, b)]), pull, blocks, normals, [0, 0])


@given(st.floats(0.1, 10), st.floats(0, 1), st.floats(0.1, 5))
def test_an_impact_reaches_its_bound_by_one_impulse(mass, restitution, speed):
    found = solve_step(step([[mass]], [-speed], normals=[[1]], bounds=[restitution * speed]))
    assert found.velocity[0] == pytest.approx(restitution * speed, rel=1e-13)
    assert found.normal[0] == pytest.approx(mass * speed * (1 + restitution), rel=1e-13)


def test_an_impact_stops_slip_as_far_as_its_impulse_goes():
    """A point falls at 1 and slides at 0.3 onto a rough floor: the impulse 1 holds up to ``mu``."""
    for mu, left in ((0.1, 0.2), (0.3, 0.0), (0.5, 0.0)):
        rough = block([1, 0], Interval(mu), owner=0)
        found = solve_step(step(np.eye(2), [0.3, -1], [rough], [[0, 1]], [0]))
        assert found.velocity == pytest.approx([left, 0], abs=1e-14)
        assert found.normal == pytest.approx([1], abs=1e-13)
        assert found.friction[0] == pytest.approx([left - 0.3], abs=1e-14)


def test_a_belt_carries_what_lies_on_it():
    for load, carried in ((0.5, 0.5), (1.0, 1.0), (4.0, 2.0)):
        belt = block([1.0], Interval(1.0), load, drift=[-2.0])
        assert solve_step(step([[1]], [0], [belt])).velocity[0] == pytest.approx(carried, abs=1e-13)


def test_what_may_roll_gives_way_along_the_strip():
    """A cut disc holds 0.5 along the second axis, but only 0.3 along the first."""
    rolls = block(np.eye(2), CutDisc(0.5, 0.3), 1.0)
    found = solve_step(step(np.eye(2), [0.7, 0.2], [rolls]))
    assert found.velocity == pytest.approx([0.4, 0], abs=1e-14)
    assert found.friction[0] == pytest.approx([-0.3, -0.2], abs=1e-14)
    corner = solve_step(step(np.eye(2), [0.7, 0.6], [rolls]))
    assert corner.velocity == pytest.approx([0.4, 0.2], abs=1e-14)


def test_a_ratchet_holds_one_way_only():
    ratchet = block([1.0], Interval(lower=0, upper=5), 1.0)
    assert solve_step(step([[1]], [2.0], [ratchet])).velocity == pytest.approx([2], abs=1e-14)
    assert solve_step(step([[1]], [-2.0], [ratchet])).velocity == pytest.approx([0], abs=1e-14)


def test_nothing_acts_on_a_free_body():
    found = solve_step(step(np.eye(2), [1, 2]))
    assert found.velocity.tolist() == [1, 2]
    assert found.residual == 0


def test_what_rests_without_forces_stays():
    found = solve_step(step(np.eye(2), [0, 0], [block(np.eye(2), Disc(0.3), 1.0)]))
    assert found.velocity.tolist() == [0, 0]
    assert found.residual == 0


def test_a_wedged_rod_is_stopped_by_friction_alone():
    """Painleve: while it slid no contact force could hold it up, so an impulse stops the slip.

    With compliance ``[[1, c], [c, 1]]`` and ``mu c > 1`` pressing pulls the sliding point down.
    """
    c, mu = 0.8, 2.0
    mass = np.linalg.inv([[1, c], [c, 1]])
    rod = step(mass, [1, -0.1], [block([1, 0], Interval(mu), owner=0)], [[0, 1]], [0])
    found = solve_step(rod)
    assert found.velocity == pytest.approx([0, 0], abs=1e-12)
    lam, p = np.linalg.solve([[1, c], [c, 1]], [0.1, -1])
    assert found.normal == pytest.approx([lam], abs=1e-12)
    assert found.friction[0] == pytest.approx([p], abs=1e-12)


# ------------------------------------------------------------------------------- all the others


@given(seeds, st.sampled_from([1e-3, 0.1, 1.0, 5.0]))
def test_under_known_loads_the_velocity_is_the_one_of_slow_sweeps(seed, load):
    problem = random_step(seed, load=load)
    slow = swept(problem)
    assume(slow is not None)
    found = solve_step(problem)
    np.testing.assert_allclose(found.velocity, slow[0], atol=1e-10)
    assert found.rounds == 1


@given(seeds)
def test_with_little_friction_on_contacts_the_velocity_is_the_one_of_slow_sweeps(seed):
    problem = random_step(seed, owned=True, most=0.1)
    slow = swept(problem)
    assume(slow is not None)
    np.testing.assert_allclose(solve_step(problem).velocity, slow[0], atol=1e-10)


@given(seeds, st.booleans(), st.sampled_from([1e-4, 1.0, 1e3]))
def test_steps_are_solved_to_rounding(seed, owned, load):
    problem = random_step(seed, owned=owned, most=0.5, load=load)
    found = settled(problem)
    assert found.residual <= 1e-12
    again = natural_residual(problem, found.velocity, found.normal, found.friction)
    assert found.residual == again


@given(seeds, vectors(5, 1.0), st.floats(1e-6, 1.0))
def test_no_other_velocity_within_the_bounds_costs_less(seed, away, distance):
    problem = random_step(seed)
    v = solve_step(problem).velocity
    other = v + distance * away[: len(v)]
    for _ in range(200):  # back into the bounds
        for row, bound in zip(problem.normals, problem.bounds, strict=True):
            other = other + row * max(0.0, bound - row @ other) / (row @ row)
    assume((problem.normals @ other >= problem.bounds).all())
    gap = other - v
    gained = cost(problem, other) - cost(problem, v)
    assert gained >= gap @ problem.mass @ gap / 2 - 1e-10  # strongly convex


@given(seeds)
def test_friction_answers_slip_with_the_greatest_dissipation(seed):
    problem = random_step(seed, owned=True, most=0.3)
    found = settled(problem)
    for b, p in zip(problem.blocks, found.friction, strict=True):
        load, slip = found.normal[b.owner], b.matrix @ found.velocity + b.drift
        assert load * b.shape.support(-slip) == pytest.approx(-p @ slip, abs=1e-10)
        away = p - into(b.shape, load, p)
        assert abs(away).max() <= 1e-11


@given(seeds, st.booleans())
def test_energy_falls_where_nothing_moves_the_ground(seed, owned):
    problem = random_step(seed, owned=owned, most=0.5, drifting=False)
    v, free = settled(problem).velocity, problem.v_free
    # The bounds are at most 0, so that rest is admissible too.
    assert v @ problem.mass @ v <= free @ problem.mass @ free + 1e-11


# ------------------------------------------------------------------------ redundancy, symmetry


@given(seeds, st.floats(0.1, 0.9))
def test_two_blocks_that_share_a_load_do_what_one_does(seed, share):
    problem = random_step(seed)
    first, *others = problem.blocks
    parts = [replace(first, load=part * first.load) for part in (share, 1 - share)]
    divided = replace(problem, blocks=(*parts, *others))
    one, two = solve_step(problem), solve_step(divided)
    np.testing.assert_allclose(two.velocity, one.velocity, atol=1e-10)
    both = (two.friction[0] + two.friction[1]) @ first.matrix
    rest = sum(p @ b.matrix for p, b in zip(two.friction[2:], others, strict=True))
    whole = sum(p @ b.matrix for p, b in zip(one.friction, problem.blocks, strict=True))
    normals = (two.normal - one.normal) @ problem.normals
    np.testing.assert_allclose(both + rest + normals, whole, atol=1e-9)


@given(seeds)
def test_a_contact_listed_twice_pushes_once(seed):
    problem = random_step(seed)
    normals = np.vstack([problem.normals, 3 * problem.normals[:1]])
    doubled = replace(
        problem,
        normals=normals,
        bounds=np.array([*problem.bounds, 3 * problem.bounds[0]]),
        gaps=np.zeros(len(normals)),
    )
    one, two = solve_step(problem), solve_step(doubled)
    np.testing.assert_allclose(two.velocity, one.velocity, atol=1e-10)
    pushes = two.normal @ normals + sum(
        p @ b.matrix for p, b in zip(two.friction, problem.blocks, strict=True)
    )
    momentum = problem.mass @ (one.velocity - problem.v_free)
    np.testing.assert_allclose(pushes, momentum, atol=1e-9)


@pytest.mark.parametrize("v", [(0.3, 0.4), (0.299, 0.4), (0.6, 0.8)])
def test_two_discs_hold_what_their_sum_holds(v):
    """At, below and beyond the threshold, which the two sets reach together."""
    blocks = [block(np.eye(2), Disc(0.2), 1.0), block(np.eye(2), Disc(0.1), 3.0)]
    found = solve_step(step(np.eye(2), v, blocks))
    size = math.hypot(*v)
    left = max(0.0, 1 - 0.5 / size)
    np.testing.assert_allclose(found.velocity, left * np.array(v), atol=1e-12)


@given(seeds, st.sampled_from([1e-6, 1e-3, 1e3, 1e6]), st.sampled_from([1e-6, 1e3]))
def test_units_do_not_matter(seed, faster, heavier):
    """Velocities ``faster`` times as large, masses ``heavier`` times: impulses by both."""
    problem = random_step(seed, owned=bool(seed % 2), most=0.1)
    blocks = [
        replace(b, load=b.load * faster * heavier, drift=b.drift * faster) for b in problem.blocks
    ]
    changed = step(
        heavier * problem.mass,
        faster * problem.v_free,
        blocks,
        problem.normals,
        faster * problem.bounds,
    )
    before, after = settled(problem), settled(changed)
    np.testing.assert_allclose(after.velocity, faster * before.velocity, atol=1e-10 * faster)
    args = (before.velocity * faster, before.normal * faster * heavier)
    friction = [p * faster * heavier for p in before.friction]
    assert natural_residual(changed, *args, friction) <= 1e-12


@given(seeds)
def test_coordinates_do_not_matter(seed):
    """With ``v = T u`` the step is the same motion, written in ``u``."""
    problem = random_step(seed)
    n = len(problem.v)
    T = np.eye(n) + np.triu(np.random.default_rng(seed).uniform(-1, 1, (n, n)), 1)
    changed = step(
        T.T @ problem.mass @ T,
        np.linalg.solve(T, problem.v_free),
        [replace(b, matrix=b.matrix @ T) for b in problem.blocks],
        problem.normals @ T,
        problem.bounds,
    )
    moved = T @ solve_step(changed).velocity
    np.testing.assert_allclose(moved, solve_step(problem).velocity, atol=1e-9)


# ------------------------------------------------------------------------------------- residual


@given(seeds, reals(1.0), st.floats(1e-6, 1e-2))
def test_the_residual_grows_with_the_error(seed, direction, distance):
    problem = random_step(seed)
    found = solve_step(problem)
    away = distance * math.copysign(1, direction)
    moved = found.velocity.copy()
    moved[0] += away
    assert natural_residual(problem, moved, found.normal, found.friction) >= 1e-3 * distance


def test_the_residual_sees_each_line_of_the_inclusion():
    rough = block([1, 0], Interval(0.5), owner=0)
    problem = step(np.eye(2), [2.0, -1.0], [rough], [[0, 1]], [0])
    v, lam, p = np.array([1.5, 0.0]), np.array([1.0]), [np.array([-0.5])]
    assert natural_residual(problem, v, lam, p) == pytest.approx(0, abs=1e-15)
    size = math.sqrt(5)  # of the free velocity, the largest speed
    for change, miss in (
        (([1.6, 0.0], lam, p), 0.1),  # momentum
        (([1.5, 0.1], lam + 0.1, p), 0.1),  # pushes at a distance
        (([1.5, -0.2], lam - 0.2, [[-0.5]]), 0.2),  # goes through
        (([1.4, 0.0], lam, [[-0.6]]), 0.1),  # too much friction
        (([1.7, 0.0], lam, [[-0.3]]), 0.2),  # too little
        (([2.5, 0.0], lam, [[0.5]]), 1.0),  # the wrong way
    ):
        friction = [np.asarray(f, dtype=float) for f in change[2]]
        found = natural_residual(problem, np.asarray(change[0]), change[1], friction)
        assert found * size == pytest.approx(miss, rel=0.12)


def test_the_residual_of_a_negative_impulse_is_its_size():
    problem = step(np.eye(1), [1.0], normals=[[1]], bounds=[0])
    assert natural_residual(problem, np.array([0.5]), np.array([-0.5]), []) == pytest.approx(0.5)


# --------------------------------------------------------------------------- steps of a system


def sliding_point(mu=0.4, static=None, restitution=0.0):
    """A point of mass 2 above a rough floor ``y >= 0``."""
    M = Manifold.euclidean("x y")
    (_, y), (vx, vy) = M.symbols, velocities(M)
    rough = Friction("rough", (vx,), Interval(static or mu), "floor", dynamic=Interval(mu))
    floor = Polyhedron(M, {"floor": y})
    return System(floor, vx**2 + vy**2, 2 * G * y, friction=(rough,), restitution=restitution)


def test_free_flight_is_exact():
    system, dt = sliding_point(), 0.01
    state = system.state([0.0, 5.0], [1.0, 2.0])
    for _ in range(20):
        state = reference_step(system, state, dt)
    t = 20 * dt
    assert state.time == pytest.approx(t)
    assert state.v == pytest.approx([1, 2 - G * t], rel=1e-12)
    assert state.q == pytest.approx([t, 5 + 2 * t - G * t**2 / 2], rel=1e-12)
    assert not state.sticking.any()


def test_a_point_slides_to_rest_and_stays():
    system, dt = sliding_point(), 0.01
    state = system.state([0.0, 0.0], [0.3, 0.0])
    speeds, sticking = [], []
    for _ in range(12):
        state = reference_step(system, state, dt)
        speeds.append(state.v[0])
        sticking.append(bool(state.sticking[0]))
    lost = np.maximum(0.0, 0.3 - 0.4 * G * dt * np.arange(1, 13))
    np.testing.assert_allclose(speeds, lost, atol=1e-12)
    assert sticking == [bool(left == 0) for left in lost]
    assert state.q[1] == pytest.approx(0, abs=1e-14)


def test_what_sticks_is_held_by_the_static_set():
    """A pull between dynamic and static friction moves what moved and holds what stuck."""
    dt = 0.01
    system = sliding_point(mu=0.2, static=0.6)
    pulled = replace(system, forces={"x": 2 * G * 0.4})
    resting = pulled.state([0.0, 0.0])
    assert reference_step(pulled, resting, dt).v == pytest.approx([0, 0], abs=1e-13)
    moving = pulled.state([0.0, 0.0], [0.1, 0.0])
    assert reference_step(pulled, moving, dt).v[0] == pytest.approx(0.1 + 0.2 * G * dt)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_falling_point_bounces_by_newtons_law(restitution):
    system, dt = sliding_point(restitution=restitution), 1e-3
    state = system.state([0.0, 0.0], [0.0, -2.0])
    after = reference_step(system, replace(state, q=np.array([0.0, 1e-3])), dt)
    # half of the step's fall comes before the bounce, half of it afterwards
    expected = restitution * 2.0 - (1 - restitution) * G * dt / 2
    assert after.v[1] == pytest.approx(expected, abs=1e-9 + (restitution == 0))
    assert assemble(system, state, dt).bounds[0] >= expected - 1e-12


def test_a_contact_may_just_be_reached():
    """Without restitution a point lands: at the next half step its gap is zero."""
    system, dt = sliding_point(), 0.01
    state = system.state([0.0, 0.03], [0.0, -2.0])
    after = reference_step(system, state, dt)
    assert after.q[1] + dt / 2 * after.v[1] == pytest.approx(0, abs=1e-14)


# ------------------------------------------------------------------------------------ wrong use


def test_bounds_that_no_velocity_meets_are_refused():
    jammed = step([[1]], [0], normals=[[1], [-1]], bounds=[1, 1])
    with pytest.raises(SolverError, match="a step's bounds are met by no velocity"):
        solve_step(jammed)


def test_a_mass_that_is_none_is_refused():
    with pytest.raises(SolverError, match="mass matrix of a step is not positive definite"):
        solve_step(step([[1, 1], [1, 1]], [0, 0]))


def test_rounds_must_be_positive():
    with pytest.raises(ValueError, match="rounds: expected at least one programme; got 0"):
        solve_step(step([[1]], [0]), rounds=0)


def test_impulses_that_do_not_settle_are_reported_with_their_residual():
    """Of many steps with much friction some need several programmes, and fail with one."""
    problems = [random_step(seed, owned=True, most=3.0) for seed in range(40)]
    hard = next(p for p in problems if solve_step(p).rounds > 1)
    with pytest.raises(SolverError, match="did not settle in 1 convex programmes"):
        solve_step(hard, rounds=1)
