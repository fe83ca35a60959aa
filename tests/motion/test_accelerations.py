"""Accelerations that contacts allow, against closed forms and enumeration from the definition."""

import itertools
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Friction, Manifold, Polyhedron, System, simulate, velocities
from polycorner.models.textbook import GRAVITY, body_on_plane, box_on_plane
from polycorner.motion import Consistency, Disc, Interval, accelerations


def rod_state(mu, angle, slip, turning):
    """A rod of mass 1 and half-length 1 on its end, which slips and does not leave the floor."""
    rod = body_on_plane([(1.0, 0.0)], 1 / 3, Interval(mu))
    lift = -math.cos(angle) * turning
    sideways = slip + math.sin(angle) * turning
    return rod, rod.state([0.0, -math.sin(angle), angle], [sideways, lift, turning])


@given(st.floats(0, 4), st.floats(-1.5, -0.1), st.sampled_from([-2.0, 3.0]), st.floats(-6, 6))
def test_a_sliding_rod_has_the_accelerations_of_the_closed_form(mu, angle, slip, turning):
    """The gap ``y + sin(theta)``: its acceleration is ``b + A N`` with the normal force ``N``."""
    way = math.copysign(1.0, slip)
    A = 1 + 3 * math.cos(angle) * (math.cos(angle) + mu * way * math.sin(angle))
    b = -GRAVITY - math.sin(angle) * turning**2
    if abs(A) < 1e-3 or abs(b) < 1e-3:
        return
    forces = [0.0] if b > 0 else []
    if b / A < 0:
        forces.append(-b / A)
    found = accelerations(*rod_state(mu, angle, slip, turning))
    names = {0: "INCONSISTENT", 1: "CONSISTENT", 2: "INDETERMINATE"}
    assert found.consistency.name == names[len(forces)]
    np.testing.assert_allclose(sorted(found.forces[:, 0]), sorted(forces), rtol=1e-6, atol=1e-6)
    for value, (force,) in zip(found.values, found.forces, strict=True):
        spin = 3 * force * (math.cos(angle) + mu * way * math.sin(angle))
        expected = [-mu * way * force, force - GRAVITY, spin]
        np.testing.assert_allclose(value, expected, rtol=1e-6, atol=1e-6 * (1 + force))


def solutions_by_enumeration(mass, rows, drags, force, bends):
    """Every solution of ``0 <= lam, rows a + bends >= 0``, complementary, by Cramer's rule."""
    inverse, found = np.linalg.inv(mass), []
    W = rows @ inverse @ (rows + drags).T
    w = rows @ inverse @ force + bends
    for size in range(len(rows) + 1):
        for pressed in map(list, itertools.combinations(range(len(rows)), size)):
            lam = np.zeros(len(rows))
            if pressed:
                lam[pressed] = np.linalg.solve(W[np.ix_(pressed, pressed)], -w[pressed])
            left = W @ lam + w
            left[pressed] = 0.0
            if (lam >= 0).all() and (left >= 0).all():
                found.append(inverse @ (force + (rows + drags).T @ lam))
    return found


@given(st.integers(0, 10_000))
def test_random_bodies_on_several_feet_have_the_solutions_of_enumeration(seed):
    """Feet of random formulas: rows, curvatures, slips and sets of either side."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4))
    M = Manifold.euclidean("x y z")
    q, v = sympy.Matrix(M.symbols), sympy.Matrix(velocities(M))
    rows, slips = rng.normal(size=(2, count, 3))
    curves = rng.normal(size=(count, 3, 3))
    curves = curves + curves.transpose(0, 2, 1)
    speed = np.linalg.svd(np.vstack([rows, np.zeros((3, 3))]))[2][-1] if count < 3 else np.zeros(3)
    ends = rng.uniform(0, 3, size=(count, 2))
    drift = rng.normal(size=count)  # the ground moves
    half = rng.normal(size=(3, 3))
    mass, force = half @ half.T + 0.1 * np.eye(3), rng.normal(size=3)
    gaps = {
        f"foot{i}": (sympy.Matrix([rows[i]]) * q + q.T * sympy.Matrix(curves[i] / 2) * q)[0]
        for i in range(count)
    }
    friction = [
        Friction(
            f"rubs{i}",
            (sympy.Matrix([slips[i]]) * v)[0] + drift[i],
            Interval(lower=-ends[i, 0], upper=ends[i, 1]),
            f"foot{i}",
        )
        for i in range(count)
    ]
    body = System(
        Polyhedron(M, gaps),
        (v.T * sympy.Matrix(mass) * v)[0] / 2,
        -(sympy.Matrix([force]) * q)[0],
        friction=tuple(friction),
    )
    state = body.state(np.zeros(3), speed)
    ways = slips @ speed + drift
    per_force = np.where(ways > 0, -ends[:, 0], ends[:, 1])
    bends = np.einsum("i,gij,j->g", speed, curves, speed)
    expected = solutions_by_enumeration(mass, rows, per_force[:, None] * slips, force, bends)
    found = accelerations(body, state)
    assert len(found.values) == len(expected)
    for value in expected:
        assert min(np.abs(found.values - value).max(axis=1)) <= 1e-5 * (1 + np.abs(value).max())


@pytest.mark.parametrize("mu", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("speed", [0.0, 1.0, -1.0])
def test_a_box_on_a_slope_sticks_or_slips(mu, speed):
    slope = 0.45
    box = box_on_plane(2.0, 1.0, Interval(mu), angle=slope)
    found = accelerations(box, box.state([0.0, 1.0, 0.0], [speed, 0.0, 0.0]))
    pull, press = GRAVITY * math.sin(slope), GRAVITY * math.cos(slope)
    drag = -math.copysign(mu * press, speed) if speed else -min(pull, mu * press)
    assert found.consistency is Consistency.CONSISTENT
    np.testing.assert_allclose(found.values, [[pull + drag, 0, 0]], atol=1e-6)
    assert found.forces.sum() == pytest.approx(press)


def test_redundant_feet_leave_the_forces_open_but_not_the_acceleration():
    table = body_on_plane([(x, -1.0) for x in (-2.0, -0.5, 1.0, 2.0)], 1.0, Interval(0.3))
    found = accelerations(table, table.state([0.0, 1.0, 0.0], [0.0, 0.0, 0.0]))
    assert found.consistency is Consistency.CONSISTENT
    np.testing.assert_allclose(found.values, np.zeros((1, 3)), atol=1e-6)
    assert found.forces.sum() == pytest.approx(GRAVITY)


@pytest.mark.parametrize("speed", [-2.0, 3.0])
def test_a_bead_on_a_rough_wire_is_slowed_by_the_magnitude_of_its_force(speed):
    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    wire = Polyhedron(M, {}, equations={"wire": y + x**2})  # a crest: the force has either sign
    grip = Friction("grip", vx, Interval(0.3), "wire")
    bead = System(wire, (vx**2 + vy**2) / 2, GRAVITY * y, friction=(grip,))
    found = accelerations(bead, bead.state([0.0, 0.0], [speed, 0.0]))
    force = GRAVITY - 2 * speed**2
    assert found.consistency is Consistency.CONSISTENT
    drag = -math.copysign(0.3 * abs(force), speed)
    np.testing.assert_allclose(found.values, [[drag, -2 * speed**2]], rtol=1e-6)
    np.testing.assert_allclose(found.forces, [[force]], rtol=1e-6)


def test_a_step_has_the_acceleration_that_is_consistent():
    """The mean acceleration of a short time is that in the middle, or the mean of the ends."""
    dt, time = 1e-5, 1e-3
    for mu, angle, slip in ((0.3, -0.8, 2.0), (0.9, -1.2, -1.0), (0.5, -0.4, 3.0)):
        rod, state = rod_state(mu, angle, slip, 0.5)
        path = simulate(rod, state, time, dt)
        q, v = path.q[-1, 0], path.v[-1, 0]
        ends = [accelerations(rod, at).values for at in (state, rod.state(q, v))]
        change = (v - path.v[0, 0]) / time
        np.testing.assert_allclose(change, np.mean(ends, axis=0)[0], rtol=1e-3, atol=1e-3)


def test_known_loads_and_free_motion():
    M = Manifold.euclidean("x y")
    (x, _), (vx, vy) = M.symbols, velocities(M)
    brake = Friction("brake", (vx, vy), Disc(0.5), sympy.Integer(4))
    sled = System(Polyhedron(M, {"wall": 5 - x}), (vx**2 + vy**2) / 2, friction=(brake,))
    found = accelerations(sled, sled.state([0.0, 0.0], [3.0, 4.0]))
    np.testing.assert_allclose(found.values, [[-1.2, -1.6]])
    assert found.forces.tolist() == [[0.0]]
    assert found.names == ("wall",)
    assert pickle.loads(pickle.dumps(found)).consistency is found.consistency


def test_what_cannot_be_answered_is_refused():
    rod, _ = rod_state(0.5, -0.8, 1.0, 0.0)
    falling = rod.state([0.0, math.sin(0.8), -0.8], [1.0, -1.0, 0.0])
    with pytest.raises(ValueError, match=r"state: expected .*contact 'foot1' does not close"):
        accelerations(rod, falling)
    M = Manifold.euclidean("x y")
    (x, _), (vx, vy) = M.symbols, velocities(M)
    room = Polyhedron(M, {"wall": 5 - x})
    pad = Friction("pad", (vx, vy), Disc(0.5), sympy.Integer(4))
    sled = System(room, (vx**2 + vy**2) / 2, friction=(pad,))
    with pytest.raises(ValueError, match="friction 'pad' in two directions to slip"):
        accelerations(sled, sled.state([0.0, 0.0], [0.0, 0.0]))
    two = System(room, (vx**2 + vy**2) / 2, count=2)
    with pytest.raises(ValueError, match="system: expected one body, its count being 1; got 2"):
        accelerations(two, two.state(np.zeros((2, 2))))
    feet = body_on_plane([(x, -1.0) for x in np.linspace(-1, 1, 13)], 1.0, Interval(0.3))
    with pytest.raises(ValueError, match="at most 4096 cases"):
        accelerations(feet, feet.state([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]))
    with pytest.raises(TypeError, match="system"):
        accelerations("rod", falling)
    with pytest.raises(TypeError, match="state"):
        accelerations(rod, [0.0, 0.0, 0.0])


@given(st.floats(-3, 3), st.floats(-2, 2), st.floats(-2, 2))
def test_a_skate_turns_its_velocity(heading, along, turning):
    """It does not slip sideways: the acceleration is ``u omega`` across, as the blade turns."""
    M = Manifold(("x", "y", "theta"), (math.inf, math.inf, math.tau), (1.0, 1.0, 1.0))
    (x, _, theta), (vx, vy, omega) = M.symbols, velocities(M)
    sideways = sympy.cos(theta) * vy - sympy.sin(theta) * vx
    blade = Friction("blade", [sideways], Interval(10.0), sympy.Float(10.0))
    skate = System(Polyhedron(M, [x + 100]), (vx**2 + vy**2 + omega**2) / 2, friction=[blade])
    way = np.array([math.cos(heading), math.sin(heading), 0.0])
    state = skate.state([0, 0, heading], along * way + [0, 0, turning])
    found = accelerations(skate, replace(state, sticking=np.ones_like(state.sticking)))
    expected = along * turning * np.array([-way[1], way[0], 0.0])
    np.testing.assert_allclose(found.values, [expected], rtol=0, atol=1e-9)
