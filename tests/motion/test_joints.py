"""Equations as constraints: joints and rails, with contacts and friction.

The oracles are closed forms, or SciPy's integrator in coordinates without equations.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_step import solve_step
from scipy.integrate import solve_ivp
from scipy.linalg import null_space
from scipy.optimize import linprog
from step_inclusion import assemble, slips_at_end, stopped

from polycorner import AnyOf, Friction, Manifold, Polyhedron, System, velocities
from polycorner.files.trajectories import load_trajectory, save_trajectory
from polycorner.motion import (
    Checkpoint,
    Disc,
    EventKind,
    Interval,
    Noise,
    Solver,
    simulate,
    time_symbol,
)
from polycorner.motion.engine.driver import Engine
from polycorner.motion.mechanics import State
from polycorner.motion.placements import onto_equations

G = 9.81
PLANE, LINK = Manifold.euclidean("x y"), Manifold.euclidean("x y a")
(X, Y), (VX, VY) = PLANE.symbols, velocities(PLANE)
FREE = (VX**2 + VY**2) / 2
EXACT = {"rtol": 1e-12, "atol": 1e-12, "method": "DOP853"}


def order(error, dt, levels=4):
    steps = dt / 2.0 ** np.arange(levels)
    return np.polyfit(np.log(steps), np.log([error(h) for h in steps]), 1)[0]


def is_second(measured):
    return 1.85 < measured < 2.15


def forces(path, instant=-1):
    return {name: force for _, name, force in path.touching[instant]}


def holds_at_midpoints(path):
    """Whether equations hold in the middle of each step as well as velocities are solved for."""
    middles = path.q[1:-1] + path.dt / 2 * path.v[1:-1]
    fastest = abs(path.v).sum(axis=-1).max()
    off = abs(path.system.polyhedron.equation_values(middles)).max()
    return off < 4 * path.solver.tolerance * fastest * path.dt + 3e-10


# ------------------------------------------------------------------------------------- pendulums


def pendulum(length, equations=None):
    rod = {"rod": X**2 + Y**2 - length**2}
    return System(Polyhedron(PLANE, {}, equations=equations or rod), FREE, G * Y)


def on_circle(length, angle, rate):
    s, c = math.sin(angle), math.cos(angle)
    return length * np.array([s, -c]), length * rate * np.array([c, s])


def swing(length, angle, rate, t_end):
    """The pendulum in its angle."""
    right = lambda _, s: [s[1], -G / length * math.sin(s[0])]  # noqa: E731
    return solve_ivp(right, (0, t_end), [angle, rate], **EXACT).y[:, -1]


@pytest.mark.parametrize(("length", "angle", "rate"), [(1.3, 1.0, 2.0), (0.5, 0, 9.5), (2, 3, 0)])
def test_a_point_on_a_circle_is_a_pendulum(length, angle, rate):
    """Of second order; the equation holds in the middle of steps, and else up to the sagitta."""
    system = pendulum(length)
    q, v = on_circle(length, *swing(length, angle, rate, 2.0))

    def error(dt):
        path = simulate(system, system.state(*on_circle(length, angle, rate)), 2.0, dt, every=1)
        assert path.converged
        assert not path.events
        fastest = np.linalg.norm(path.v, axis=-1).max()
        assert holds_at_midpoints(path)
        far = abs(np.linalg.norm(path.q, axis=-1) - length)
        assert far.max() < 1.01 * (dt * fastest) ** 2 / (8 * length) + 1e-9
        energy = path.kinetic + path.potential
        assert abs(energy - energy[0]).max() < (dt * fastest / length) ** 2 * fastest**2
        return np.linalg.norm([*(path.q[-1, 0] - q), *(path.v[-1, 0] - v)])

    assert is_second(order(error, 0.01))


def test_energy_does_not_drift():
    system = pendulum(1.0)
    path = simulate(system, system.state(*on_circle(1.0, 2.0, 0.0)), 300.0, 0.01, every=10)
    energy = path.kinetic + path.potential
    first, last = energy[:1000].mean(), energy[-1000:].mean()
    assert abs(last - first) < 1e-5
    assert holds_at_midpoints(path)


def test_the_force_of_an_equation_is_the_tension():
    """``m (l w^2 + g cos a) = 2 l lambda`` for ``x^2 + y^2 = l^2``, negative: the rod pulls."""
    length, end = 1.3, 1.5
    angle, rate = swing(length, 1.0, 2.0, end)
    tension = length * rate**2 + G * math.cos(angle)
    system = pendulum(length)
    path = simulate(system, system.state(*on_circle(length, 1.0, 2.0)), end, 1e-4)
    assert -2 * length * forces(path)["rod"] == pytest.approx(tension, rel=1e-3)


RODS = [
    {"one": X**2 + Y**2 - 1, "two": X**2 + Y**2 - 1},
    {"rod": sp.sqrt(X**2 + Y**2) - 1},
    {"square": 7 * (X**2 + Y**2 - 1), "root": 0.1 - sp.sqrt(X**2 + Y**2) / 10},
    {"cubic": (X**2 + Y**2) ** 2 * 3 - 3},
]


@pytest.mark.parametrize("equations", RODS, ids=["twice", "root", "both", "fourth power"])
def test_motion_depends_on_the_set_and_not_on_its_equations(equations):
    start = on_circle(1.0, 1.0, 2.0)
    paths = [
        simulate(system, system.state(*start), 2.0, 1e-3, solver=Solver(1e-10))
        for system in (pendulum(1.0), pendulum(1.0, equations))
    ]
    assert all(path.converged for path in paths)
    assert abs(paths[0].q - paths[1].q).max() < 1e-7
    pulls = []
    for path in paths:
        gradients = path.system.polyhedron.bundle.evaluate(path.q[-1, 0], 1)[1]
        pulls.append(np.array(list(forces(path).values())) @ gradients)
    assert pulls[0] == pytest.approx(pulls[1], abs=1e-2)


@pytest.mark.parametrize("start", [[1.2, -0.5, 0, 0.4], [2.5, 1.0, 1.0, -1.0]])
def test_a_double_pendulum_in_cartesian_coordinates(start):
    """Two unit masses on rods of unit length, gravity one."""
    M = Manifold.euclidean("x1 y1 x2 y2")
    (x1, y1, x2, y2), speeds = M.symbols, velocities(M)
    rods = {"first": x1**2 + y1**2 - 1, "second": (x2 - x1) ** 2 + (y2 - y1) ** 2 - 1}
    system = System(Polyhedron(M, {}, equations=rods), sum(v**2 for v in speeds) / 2, y1 + y2)

    def equations(_, state):
        a, b, u, w = state
        c, s = math.cos(a - b), math.sin(a - b)
        right = [-(w**2) * s - 2 * math.sin(a), u**2 * s - math.sin(b)]
        return [u, w, *np.linalg.solve([[2, c], [c, 1]], right)]

    def cartesian(state):
        a, b, u, w = state
        (q1, v1), (q2, v2) = on_circle(1, a, u), on_circle(1, b, w)
        return np.array([*q1, *(q1 + q2)]), np.array([*v1, *(v1 + v2)])

    q, v = cartesian(solve_ivp(equations, (0, 2), start, **EXACT).y[:, -1])

    def error(dt):
        path = simulate(system, system.state(*cartesian(start)), 2.0, dt, every=1)
        assert path.converged
        assert holds_at_midpoints(path)
        return np.linalg.norm([*(path.q[-1, 0] - q), *(path.v[-1, 0] - v)])

    assert is_second(order(error, 0.005))


# ----------------------------------------------------------------------------- rails with a stop


@pytest.mark.parametrize("bounce", [1.0, 0.6])
@pytest.mark.parametrize("shape", [X**2, sp.sin(3 * X) / 2, -X / 2])
def test_a_bead_on_a_rail_bounces_off_a_wall(shape, bounce):
    """In ``x`` alone ``(1 + f'^2) x'' = -f' (g + f'' x'^2)``, and ``x'`` is reversed at 1."""
    slope, bend = (sp.lambdify(X, sp.diff(shape, X, n)) for n in (1, 2))
    height = sp.lambdify(X, shape)

    def right(_, s):
        d = slope(s[0])
        return [s[1], -d * (G + bend(s[0]) * s[1] ** 2) / (1 + d * d)]

    def wall(_, s):
        return s[0] - 1

    wall.terminal, wall.direction = True, 1
    end, now, state, hits = 1.1, 0.0, [-0.3, 5.0], []
    while True:
        part = solve_ivp(right, (now, end), state, events=wall, **EXACT)
        state = part.y[:, -1]
        if part.status == 0:
            break
        now, state = part.t[-1], [1.0, -bounce * state[1]]
        hits.append(now)
    rail = Polyhedron(PLANE, {"wall": 1 - X}, equations={"rail": Y - shape})
    system = System(rail, FREE, G * Y, restitution=bounce)
    start = system.state([-0.3, height(-0.3)], [5.0, 5.0 * slope(-0.3)])

    def error(dt):
        path = simulate(system, start, end, dt, every=1)
        assert path.converged
        found = [event.time for event in path.of_kind(EventKind.IMPACT)]
        assert len(found) == len(hits)
        assert {event.contact for event in path.events} <= {"wall"}
        far = path.q[-1, 0] - [state[0], height(state[0])]
        return np.linalg.norm([*far, *(np.array(found) - hits)])

    steps = 0.004 / 2.0 ** np.arange(3)
    errors = [error(h) for h in steps]
    # Impacts fall anywhere in a step, so that single ratios vary: a bound by C h^2.
    assert np.max(np.array(errors) / steps**2) < 60


@pytest.mark.parametrize("bounce", [1.0, 0.5])
def test_a_slider_crank_with_a_stop(bounce):
    """Unit masses at the crank's pin and at the slider; the stop reverses the crank's rate."""
    M = Manifold.euclidean("x y s")
    (x, y, s), speeds = M.symbols, velocities(M)
    r, rod, stop = 1.0, 2.0, 2.6
    joints = {"crank": x**2 + y**2 - r**2, "rod": (s - x) ** 2 + y**2 - rod**2}
    linkage = Polyhedron(M, {"stop": stop - s}, equations=joints)
    system = System(linkage, sum(v**2 for v in speeds) / 2, restitution=bounce)
    angle = sp.Symbol("a")
    slider = r * sp.cos(angle) + sp.sqrt(rod**2 - (r * sp.sin(angle)) ** 2)
    d = sp.diff(slider, angle)
    mass = sp.lambdify(angle, r**2 + d**2)  # without other forces mass(a) w^2 is constant
    change, place = sp.lambdify(angle, sp.diff(d, angle) * d), sp.lambdify(angle, slider)
    speed = sp.lambdify(angle, d)

    def stopped(_, state):
        return place(state[0]) - stop

    stopped.terminal, stopped.direction = True, 1

    def right(_, state):
        return [state[1], -change(state[0]) * state[1] ** 2 / mass(state[0])]

    end, now, state, hits = 2.5, 0.0, [2.0, -3.0], 0
    while True:
        part = solve_ivp(right, (now, end), state, events=stopped, **EXACT)
        state = part.y[:, -1]
        if part.status == 0:
            break
        now, hits = part.t[-1], hits + 1
        state = [state[0], -bounce * state[1]]
    start = system.state(
        [r * math.cos(2), r * math.sin(2), place(2.0)],
        [3 * r * math.sin(2), -3 * r * math.cos(2), -3 * speed(2.0)],
    )

    def error(dt):
        path = simulate(system, start, end, dt, every=1)
        assert path.converged
        assert len(path.of_kind(EventKind.IMPACT)) == hits > 0
        assert path.audit < 30 * dt**2
        found = path.q[-1, 0]
        return np.linalg.norm(found - [math.cos(state[0]), math.sin(state[0]), place(state[0])])

    steps = 0.004 / 2.0 ** np.arange(3)
    assert np.max(np.array([error(h) for h in steps]) / steps**2) < 60


@pytest.mark.parametrize("cranks", [2, 3, 5])
def test_a_parallelogram_with_any_number_of_cranks_is_a_pendulum(cranks):
    """All but two of its equations follow from the others."""
    (x, y, a), (vx, vy, va) = LINK.symbols, velocities(LINK)
    pins = np.linspace(-1, 1, cranks)
    legs = {
        f"leg{i}": (x + p * sp.cos(a) - p) ** 2 + (y + p * sp.sin(a)) ** 2 - 1
        for i, p in enumerate(pins)
    }
    bar = System(Polyhedron(LINK, {}, equations=legs), (vx**2 + vy**2 + va**2 / 3) / 2, G * y)
    q, v = on_circle(1.0, 1.0, 0.5)
    exact, _ = on_circle(1.0, *swing(1.0, 1.0, 0.5, 1.5))

    def error(dt):
        path = simulate(bar, bar.state([*q, 0], [*v, 0]), 1.5, dt, every=1)
        assert path.converged
        assert abs(path.q[:, 0, 2]).max() < 1e-8
        return np.linalg.norm(path.q[-1, 0, :2] - exact)

    assert is_second(order(error, 0.01))


# ----------------------------------------------------------------------------------------- rest

SPACE = Manifold.euclidean("ax ay az bx by bz")


@pytest.mark.parametrize("rigid", [False, True])
@given(tilt=st.floats(-1.4, 1.4), mass=st.floats(0.1, 20))
@settings(max_examples=10, deadline=None)
def test_a_rod_between_two_ball_joints_has_its_reactions(rigid, tilt, mass):
    """Each joint carries half of the weight; what a length in excess adds cancels in each node."""
    a, b = SPACE.symbols[:3], SPACE.symbols[3:]
    u, w = velocities(SPACE)[:3], velocities(SPACE)[3:]
    end = [0.0, math.cos(tilt), math.sin(tilt)]
    joints = {f"A{i}": a[i] for i in range(3)} | {f"B{i}": b[i] - end[i] for i in range(3)}
    if rigid:
        joints["length"] = sum((p - q) ** 2 for p, q in zip(a, b, strict=True)) - 1
    kinetic = sum(p**2 + p * q + q**2 for p, q in zip(u, w, strict=True)) * mass / 6
    rod = System(Polyhedron(SPACE, {}, equations=joints), kinetic, mass * G * (a[2] + b[2]) / 2)
    path = simulate(rod, rod.state([0, 0, 0, *end]), 0.05, 1e-3)
    found = forces(path)
    along = 2 * found.get("length", 0.0) * np.array(end)
    half = [0, 0, mass * G / 2]
    first, second = ([found[f"{node}{i}"] for i in range(3)] for node in "AB")
    assert first - along == pytest.approx(half, abs=1e-6 * mass * G)
    assert second + along == pytest.approx(half, abs=1e-6 * mass * G)
    assert path.rests[-1, 0]
    assert path.converged
    assert not path.v.any()
    assert abs(path.q - path.q[0]).max() == 0


def incline(angle, mu, pull=0.0):
    """A bead on a straight rail with friction that the rail's force presses."""
    s, c = math.sin(angle), math.cos(angle)
    rail = Polyhedron(PLANE, {}, equations={"rail": c * Y - s * X})
    rub = Friction("rub", [c * VX + s * VY], Interval(mu), load="rail")
    return System(rail, FREE, (G - pull) * Y, friction=(rub,))


@given(angle=st.floats(-1.2, 1.2), share=st.floats(0.3, 0.97), pull=st.sampled_from([0.0, 2 * G]))
@settings(max_examples=15, deadline=None)
def test_a_rough_rail_holds_within_the_cone(angle, share, pull):
    """Whether the rail pushes or pulls: friction is pressed by the magnitude of its force."""
    system = incline(angle, abs(math.tan(angle)) / share, pull)
    path = simulate(system, system.state([0, 0]), 0.1, 1e-3)
    assert path.converged
    assert path.rests[-1, 0]
    assert not path.q.any()
    assert not path.v.any()
    weight = math.cos(angle) * (G - pull)
    assert forces(path)["rail"] == pytest.approx(weight, rel=1e-6)


@given(angle=st.floats(0.2, 1.2), share=st.floats(0.1, 0.9), pull=st.sampled_from([0.0, 2 * G]))
@settings(max_examples=15, deadline=None)
def test_a_rough_rail_lets_slide_beyond_the_cone(angle, share, pull):
    mu, end = share * math.tan(angle), 0.3
    system = incline(angle, mu, pull)
    path = simulate(system, system.state([0, 0]), end, 1e-3)
    sense = 1 if pull else -1
    pace = sense * G * (math.sin(angle) - mu * math.cos(angle))
    along = np.array([math.cos(angle), math.sin(angle)])
    assert path.v[-1, 0] == pytest.approx(pace * end * along, abs=1e-8)
    slid = abs(pace) * end**2 / 2
    lost = mu * G * math.cos(angle) * slid
    assert path.dissipated["sliding"][-1] == pytest.approx(lost, rel=1e-2)
    assert path.audit < 1e-9


@pytest.mark.parametrize("rate", [7.8, 8.2])
def test_a_rough_hoop_presses_from_both_sides(rate):
    """``a'' = -g sin a - mu sign(a') |a'^2 + g cos a|``: the rod pulls, then pushes."""
    mu, end = 0.1, 1.0

    def right(_, s):
        rub = mu * np.sign(s[1]) * abs(s[1] ** 2 + G * math.cos(s[0]))
        return [s[1], -G * math.sin(s[0]) - rub]

    angles = solve_ivp(right, (0, end), [0, rate], max_step=1e-3, **EXACT)
    pressed = angles.y[1] ** 2 + G * np.cos(angles.y[0])
    assert pressed[0] > 0 > pressed.min()
    rub = Friction("rub", [X * VY - Y * VX], Interval(mu), load="rod")
    rod = {"rod": sp.sqrt(X**2 + Y**2) - 1}
    system = System(Polyhedron(PLANE, {}, equations=rod), FREE, G * Y, friction=(rub,))
    q, _ = on_circle(1.0, *angles.y[:, -1])

    def error(dt):
        path = simulate(system, system.state(*on_circle(1.0, 0.0, rate)), end, dt, every=1)
        assert path.converged
        balance = path.kinetic + path.potential + path.dissipated["sliding"]
        assert abs(balance - balance[0]).max() < (dt * rate**2) ** 2 / 4
        return np.linalg.norm(path.q[-1, 0] - q)

    assert is_second(order(error, 0.004))


@given(
    slope=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    speed=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    mu=st.floats(0.05, 0.6),
)
@settings(max_examples=10, deadline=None)
def test_an_equation_is_a_contact_that_remains_closed(slope, speed, mu):
    """A point in a rough bowl in space moves alike, to second order."""
    M = Manifold.euclidean("x y z")
    (x, y, z), (u, v, w) = M.symbols, velocities(M)
    bowl = z - slope[0] * x - slope[1] * y - (x**2 + 2 * y**2) / 4
    rise = [slope[0] + x / 2, slope[1] + y]
    slip = [u + rise[0] * w, v + rise[1] * w]
    rub = Friction("rub", slip, Disc(mu), load="bowl")
    kinetic = (u**2 + v**2 + w**2) / 2
    start = [0, 0, 0], [*speed, slope[0] * speed[0] + slope[1] * speed[1]]
    ends = []
    for polyhedron in (Polyhedron(M, {"bowl": bowl}), Polyhedron(M, {}, equations={"bowl": bowl})):
        system = System(polyhedron, kinetic, G * z, friction=(rub,))
        path = simulate(system, system.state(*start), 0.5, 1e-3)
        assert path.converged
        ends.append((path.q[-1, 0], forces(path)["bowl"], path.dissipated["sliding"][-1]))
    (one, force, lost), (other, pull, rubbed) = ends
    assert one == pytest.approx(other, abs=2e-5)
    assert force == pytest.approx(pull, rel=1e-2)
    assert lost == pytest.approx(rubbed, abs=1e-4)


def test_a_bead_comes_to_rest_on_a_rough_sine():
    """Where it stops friction holds it, and it sleeps there."""
    rail = Polyhedron(PLANE, {}, equations={"rail": Y + sp.cos(X)})
    along = VX + sp.sin(X) * VY
    rub = Friction("rub", [along], Interval(0.4), load="rail")
    system = System(rail, FREE, G * Y, friction=(rub,))
    path = simulate(system, system.state([0.0, -1.0], [4.0, 0.0]), 8.0, 1e-3)
    assert path.rests[-1, 0]
    assert path.converged
    assert not path.v[-1].any()
    assert abs(math.sin(path.q[-1, 0, 0])) < 0.4
    assert path.audit < 1e-5
    lost = path.kinetic[0] + path.potential[0] - path.potential[-1]
    assert path.dissipated["sliding"][-1] == pytest.approx(lost, rel=1e-5)


def test_a_block_that_is_tied_rubs_on_a_moving_belt():
    """The rope holds it against sliding friction; it may not start with the belt."""
    rub = Friction("rub", [VX - 2.0], Interval(0.5), load="floor")
    tied = Polyhedron(PLANE, {"floor": Y}, equations={"rope": X})
    system = System(tied, FREE, G * Y, friction=(rub,), substrate={"x": 2.0})
    with pytest.raises(ValueError, match=r"v: .*'rope'.* at the rate 2"):
        system.state([0, 0])
    path = simulate(system, system.state([0, 0], [0, 0]), 1.0, 1e-3)
    assert not path.q.any()
    assert path.converged
    assert forces(path) == pytest.approx({"floor": G, "rope": -0.5 * G})
    assert path.work["substrate"][-1] == pytest.approx(0.5 * G * 2.0, rel=1e-9)
    assert path.audit < 1e-9


# ------------------------------------------------------------------------- joints and friction


@pytest.mark.parametrize("pull", [12.0, 25.0])
def test_a_towed_sled_on_a_floor(pull):
    """Two masses with a rod between them; friction of the floor on both; energies are booked."""
    M = Manifold.euclidean("x1 y1 x2 y2")
    (x1, y1, x2, y2), (v1, w1, v2, w2) = M.symbols, velocities(M)
    floor = Polyhedron(
        M, {"left": y1, "right": y2}, equations={"rod": (x2 - x1) ** 2 + (y2 - y1) ** 2 - 4}
    )
    rubs = tuple(
        Friction(f"rub {side}", [v], Interval(mu), load=side)
        for side, v, mu in (("left", v1, 0.5), ("right", v2, 0.3))
    )
    kinetic = (v1**2 + w1**2 + 2 * (v2**2 + w2**2)) / 2
    sled = System(floor, kinetic, G * (y1 + 2 * y2), {"x2": pull}, friction=rubs)
    path = simulate(sled, sled.state([0, 0, 2, 0]), 1.0, 1e-3)
    drag = 0.5 * G + 0.3 * 2 * G
    pace = (pull - drag) / 3
    assert path.converged
    assert path.q[-1, 0] == pytest.approx([pace / 2, 0, 2 + pace / 2, 0], rel=1e-2, abs=1e-9)
    assert path.v[-1, 0] == pytest.approx([pace, 0, pace, 0], abs=1e-7)
    assert 4 * forces(path)["rod"] == pytest.approx(-(pace + 0.5 * G), rel=1e-6)
    assert forces(path)["right"] == pytest.approx(2 * G, rel=1e-6)
    assert path.dissipated["sliding"][-1] == pytest.approx(drag * path.q[-1, 0, 0], rel=1e-3)
    assert path.work["applied"][-1] == pytest.approx(pull * path.q[-1, 0, 0], rel=1e-9)
    assert path.audit < 1e-9


def test_several_bodies_each_have_their_rail():
    """Bodies on the same circle pass through each other, and move as each alone."""
    system = pendulum(1.0)
    several = replace(system, count=3)
    starts = [on_circle(1.0, angle, 1.0) for angle in (0.0, 1.0, 2.5)]
    together = simulate(several, several.state(*map(list, zip(*starts, strict=True))), 1.0, 1e-3)
    for i, start in enumerate(starts):
        alone = simulate(system, system.state(*start), 1.0, 1e-3)
        assert np.array_equal(alone.q[:, 0], together.q[:, i])


# -------------------------------------------------------------------- one step, noise and sleep


def constrained(seed):
    """A random system with curved equations, contacts and friction, and the same without the first.

    Mass matrices depend on the place, forces on the velocity.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 6))
    M = Manifold.euclidean(" ".join(f"q{i}" for i in range(n)))
    q, v = sp.Matrix(M.symbols), sp.Matrix(velocities(M))

    def linear(of):
        return (sp.Matrix(rng.normal(size=n).round(3)).T * of)[0]

    root = sp.Matrix(rng.normal(size=(n, n)).round(2))
    kinetic = (v.T * (root * root.T + sp.eye(n)) * v)[0] / 2 + v[0] ** 2 * sp.cos(q[1]) / 3
    equations = {f"h{j}": linear(q) + linear(q) ** 2 / 3 for j in range(rng.integers(1, n - 1))}
    gaps = {f"g{i}": linear(q) for i in range(2)}
    friction = (
        Friction("pressed", [linear(v)], Interval(0.3), load="g0"),
        Friction("known", [linear(v), linear(v) - 0.1], Disc(0.4), load=3 + sp.sin(q[0])),
    )
    rest = (kinetic, 3 * linear(q), {"q1": -v[1] / 5}, friction, 0.5)
    law = "newton unlimited"  # which the programme states
    joined = System(Polyhedron(M, gaps, equations=equations), *rest, impact=law)
    return joined, System(Polyhedron(M, gaps), *rest, impact=law), rng


def restricted(problem, base, tangent):
    """The step in velocities ``base + tangent y``."""
    mass = tangent.T @ problem.mass @ tangent
    blocks = tuple(
        replace(b, matrix=b.matrix @ tangent, drift=b.drift + b.matrix @ base)
        for b in problem.blocks
    )
    return replace(
        problem,
        mass=mass,
        v_free=np.linalg.solve(mass, tangent.T @ problem.mass @ (problem.v_free - base)),
        normals=problem.normals @ tangent,
        bounds=problem.bounds - problem.normals @ base,
        blocks=blocks,
    )


@pytest.mark.parametrize("seed", range(12))
def test_a_step_solves_the_inclusion_in_the_tangent_space(seed):
    """The convex programme, in velocities ``v0 + N y`` that keep the equations."""
    system, loose, rng = constrained(seed)
    dt, n, m = 1e-3, system.manifold.dimension, len(system.contacts)
    places = (onto_equations(system.polyhedron, dt * rng.normal(size=n)) for _ in range(100))
    middle = next(place for place in places if system.polyhedron.values(place).min() >= 0)
    rows = system.polyhedron.bundle.evaluate(middle, 1)[1][m:]
    v = null_space(rows) @ rng.normal(size=n - len(rows))
    state = State(0.0, middle - dt / 2 * v, v, np.zeros(2, dtype=bool))
    engine = Engine(
        system.bodies,
        state.q[None],
        v[None],
        state.sticking[None],
        dt,
        noise=Noise(),
        solver=Solver(1e-11, refine=False),
    )
    engine.advance(1)
    after, normal = engine.motion.v[0], engine.motion.normal
    assert abs(system.polyhedron.equation_values(middle + dt * after)).max() < 1e-11
    base, tangent = np.linalg.pinv(rows) @ rows @ after, null_space(rows)

    def along_equations(problem):
        found = solve_step(restricted(problem, base, tangent))
        return base + tangent @ found.velocity, found.normal

    problem = assemble(loose, state, dt, after)
    expected, pressed = along_equations(problem)
    at_end = slips_at_end(loose, problem, after, dt)
    anew = stopped(problem, expected, pressed, at_end, after=after, same=1e-8)
    if anew is not None:
        expected, _ = along_equations(anew)
    assert after == pytest.approx(expected, abs=1e-8)
    impulse = np.vstack([problem.normals, rows]).T @ normal
    for block, p in zip(problem.blocks, engine.motion.friction, strict=True):
        impulse += block.matrix.T @ p[: len(block.matrix)]
    assert problem.mass @ (after - problem.v_free) == pytest.approx(impulse, abs=1e-8)


def test_random_kicks_remain_on_the_equations():
    system = pendulum(1.0)
    kicks = Noise(kicks={"x": 0.5, "y": 0.3}, seed=3)
    begin = system.state(*on_circle(1.0, 1.0, 2.0))
    path = simulate(system, begin, 3.0, 1e-3, noise=kicks, every=1)
    assert path.converged
    assert holds_at_midpoints(path)
    assert path.work["noise"][-1] != 0
    assert path.audit < 1e-5


@pytest.mark.parametrize("rate", [1.0, -3.0])
def test_a_growing_force_starts_a_bead_that_sleeps_on_a_rail(rate):
    """At ``|rate| t = mu m g``."""
    rub = Friction("rub", [VX], Interval(0.2), load="rail")
    rail = Polyhedron(PLANE, {}, equations={"rail": Y})
    system = System(rail, FREE, G * Y, {"x": rate * time_symbol()}, friction=(rub,))
    path = simulate(system, system.state([0, 0]), 2.5, 1e-3)
    (begun,) = path.of_kind(EventKind.MOTION)
    assert begun.time == pytest.approx(0.2 * G / abs(rate), abs=2e-3)
    late = 2.5 - 0.2 * G / abs(rate)
    assert path.v[-1, 0] == pytest.approx([rate * late**2 / 2, 0], abs=5e-3)


@pytest.mark.parametrize("seed", range(8))
def test_rest_lasts_as_long_as_forces_can_be_balanced(seed):
    """The last time is that of a linear programme in the time and all impulses."""
    rng = np.random.default_rng(seed)
    M = Manifold.euclidean("q0 q1 q2")
    q, v = sp.Matrix(M.symbols), sp.Matrix(velocities(M))
    joints, normal, slips = (rng.normal(size=(count, 3)) for count in (rng.integers(1, 3), 1, 2))
    inner = (rng.normal(size=len(joints)), rng.uniform(1, 2, 1), 0.2 * rng.uniform(-1, 1, 2))
    constant = -sum(rows.T @ p for rows, p in zip((joints, normal, slips), inner, strict=True))
    growing = rng.normal(size=3)
    unknown = np.column_stack([growing, joints.T, normal.T, slips.T])  # time, impulses
    free, load = (None, None), len(joints) + 1
    cone = np.zeros((2, unknown.shape[1]))
    cone[:, load], cone[:, load + 2] = -0.4, (1, -1)
    found = linprog(
        -np.eye(unknown.shape[1])[0],
        A_ub=cone,
        b_ub=np.zeros(2),
        A_eq=unknown,
        b_eq=-constant,
        bounds=[(0, 5), *[free] * len(joints), (0, None), (-1, 1), free],
    )
    lasts = found.x[0]
    system = System(
        Polyhedron(
            M,
            {"floor": (sp.Matrix(normal) * q)[0]},
            equations={f"h{j}": (sp.Matrix(row).T * q)[0] for j, row in enumerate(joints)},
        ),
        (v.T * v)[0] / 2,
        forces={f"q{i}": constant[i] + growing[i] * time_symbol() for i in range(3)},
        friction=(
            Friction("known", [(sp.Matrix(slips[0]).T * v)[0]], Interval(0.5), load=2.0),
            Friction("pressed", [(sp.Matrix(slips[1]).T * v)[0]], Interval(0.4), load="floor"),
        ),
    )
    dt = lasts / 500
    path = simulate(system, system.state([0, 0, 0]), min(1.2 * lasts, 5.0), dt)
    begun = [event.time for event in path.of_kind(EventKind.MOTION)][:1]
    assert begun == ([pytest.approx(lasts, abs=2 * dt)] if lasts < 4.99 else [])
    assert not path.q[: path.at(lasts - 3 * dt) + 1].any()
    # Once it moves, there may be no solution: friction may jam ([AB]).
    assert all(e.time >= lasts - dt for e in path.of_kind(EventKind.FAILED))


def test_a_guided_block_sleeps_on_its_belt():
    """An equation along the belt: it is carried, at rest; one across it lets it slide."""
    M = Manifold.euclidean("x y z")
    (x, y, z), (u, v, w) = M.symbols, velocities(M)
    rub = Friction("rub", [u - 2, v], Disc(0.5), load="floor")
    kinetic = (u**2 + v**2 + w**2) / 2
    for slope in (0.0, 0.2):
        guide = Polyhedron(M, {"floor": z}, equations={"guide": y - slope * x})
        system = System(guide, kinetic, G * z, friction=(rub,), substrate={"x": 2.0})
        path = simulate(system, system.state([0, 0, 0], [0, 0, 0] if slope else None), 3.0, 1e-3)
        pace = 2 / (1 + slope**2)  # at which the slip is across the guide
        assert path.v[-1, 0] == pytest.approx([pace, slope * pace, 0], abs=1e-9)
        assert path.rests[-1, 0] == (slope == 0)
        assert path.audit < 1e-9
        assert forces(path)["floor"] == pytest.approx(G)
        across = 0.5 * G / math.sqrt(1 + slope**2) if slope else 0.0
        assert forces(path)["guide"] == pytest.approx(across, abs=1e-4)
        if slope == 0:
            assert path.effort.islands < 5


def test_the_stratum_of_an_instant_is_on_the_equations():
    system = System(
        Polyhedron(PLANE, {"wall": X + 2}, equations={"rod": X**2 + Y**2 - 1}), FREE, G * Y
    )
    path = simulate(system, system.state(*on_circle(1.0, 1.0, 2.0)), 0.5, 0.01)
    found = path.stratum(-1)
    assert (found.dimension, found.active) == (1, ())
    assert "OUTSIDE" not in str(found)


# -------------------------------------------------------------------------- input, files, resume


@given(length=st.floats(1e-3, 10), angle=st.floats(-0.3, 0.3))
@settings(max_examples=10, deadline=None)
def test_the_largest_step_is_that_of_motions_along_the_equations(length, angle):
    """``2 / omega`` with ``omega^2 = g cos a / l``; a stiffness across them is none."""
    system = pendulum(length)
    largest, _ = system.largest_step(system.state(on_circle(length, angle, 0)[0]))
    assert largest == pytest.approx(2 / math.sqrt(G * math.cos(angle) / length), rel=1e-4)
    stiff = System(Polyhedron(PLANE, {}, equations={"rail": Y}), FREE, 1e9 * Y**2 + 2 * X**2)
    assert stiff.largest_step(stiff.state([0, 0]))[0] == pytest.approx(1.0, rel=1e-4)


CIRCLE = {"rod": X**2 + Y**2 - 1}
WRONG = [
    (lambda: pendulum(1.0).state([1.1, 0]), "q: expected equation 'rod' to hold; .* 0.21"),
    (lambda: pendulum(1.0).state([1.0, 0], [0.5, 1]), "v: .*'rod'; .* rate 1"),
    (lambda: pendulum(1.0, {"p": X**2}).state([0.0, 0]), "q: .*gradient of equation 'p'"),
    (lambda: replace(pendulum(1.0), count=2).state([[1, 0], [2, 0]]), "'rod' of body 1"),
    (lambda: System(Polyhedron(PLANE, AnyOf(X, Y), equations=CIRCLE), FREE), "polyhedron: "),
    (
        lambda: replace(pendulum(1.0), friction=(Friction("f", [VX], Interval(1), load="road"),)),
        "load: expected one of the contacts rod or",
    ),
    (lambda: replace(pendulum(1.0), restitution={"rod": 1.0}), "restitution"),
]


@pytest.mark.parametrize(("call", "sentence"), WRONG)
def test_what_is_wrong_is_refused_in_a_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()


def test_a_start_within_the_tolerance_is_moved_onto_its_equations():
    system = pendulum(1.0)
    path = simulate(system, system.state([0.0, -1.00005]), 0.1, 1e-3, every=1)
    assert holds_at_midpoints(path)
    assert path.converged


def test_runs_resume_bit_for_bit(tmp_path):
    system = pendulum(1.0)
    start = system.state(*on_circle(1.0, 1.0, 2.0))
    whole = simulate(system, start, 1.0, 1e-3, every=100)

    def stop(time, _, __):
        if time > 0.45:
            raise RuntimeError

    saved = Checkpoint(tmp_path / "run", seconds=0)
    with pytest.raises(RuntimeError):
        simulate(system, start, 1.0, 1e-3, every=100, checkpoint=saved, progress=stop)
    again = simulate(system, start, 1.0, 1e-3, every=100, checkpoint=saved)
    assert np.array_equal(whole.q, again.q)
    assert whole.touching == again.touching
    other = pendulum(1.0, {"rod": 2 * (X**2 + Y**2 - 1)})
    with pytest.raises(ValueError, match="checkpoint"):
        simulate(other, start, 1.0, 1e-3, every=100, checkpoint=saved)


def test_trajectories_are_kept_in_files(tmp_path):
    system = pendulum(1.0)
    path = simulate(system, system.state(*on_circle(1.0, 1.0, 2.0)), 0.1, 1e-3)
    file = save_trajectory(path, tmp_path / "path.nc")
    assert load_trajectory(file, system).touching == path.touching
    other = pendulum(1.0, {"rod": 2 * (X**2 + Y**2 - 1)})
    with pytest.raises(ValueError, match="equations"):
        load_trajectory(file, other)
