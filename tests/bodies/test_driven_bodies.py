"""Motion of joined and driven bodies against closed forms and SciPy's integrator."""

import math

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

from polycorner import Friction, Manifold, Polyhedron, System, simulate
from polycorner.bodies import (
    Arrangement,
    Ball,
    Damper,
    Fixed,
    Gear,
    HalfSpace,
    Hinge,
    Mass,
    Motor,
    Prescribed,
    Rail,
    Slider,
    Spring,
    box,
    capsule,
    compound,
    disc,
    mass_of,
    sphere,
)
from polycorner.motion import EventKind, Interval, accelerations, time_symbol, velocities

G = 9.81
BAR, ROD = capsule([-1, 0], [1, 0], 0.1), capsule([-1, 0, 0], [1, 0, 0], 0.1)
DOWN, BELOW = [0, -G], [0, 0, -G]
NOW = time_symbol()


def nailed(d=2, **more):
    """A bar that hangs by one end; in space its hinge is about ``y``, so that it swings alike."""
    if d == 2:
        return Arrangement({"A": BAR}, joints={"nail": Hinge("world", "A", on=[-1, 0], **more)})
    hinge = Hinge("world", "A", on=[-1, 0, 0], axis=[0, -1, 0], **more)
    return Arrangement({"A": ROD}, joints={"nail": hinge})


def about_end(body=BAR):
    """Mass and moment of inertia about an end."""
    mass = mass_of(body)
    return mass.mass, mass.inertia + mass.mass


def run(a, system, joints=None, rates=None, t_end=1.0, dt=1e-3, placed=None, **more):
    q = a.point(placed or {}, joints=joints or {})
    state = system.state(q, a.velocity(q, {}, joints=rates or {}))
    path = simulate(system, state, t_end, dt, every=1, **more)
    assert path.converged
    return path


def coordinate(a, path, name):
    return np.unwrap(a.joint_values(path.q[:, 0])[name])


# --------------------------------------------------------------------------------------- joints


@pytest.mark.parametrize("d", [2, 3])
def test_a_physical_pendulum_has_its_period(d):
    """``4 sqrt(I / m g s) K(sin^2(a / 2))`` for the amplitude ``a``; the density does not count."""
    a, amplitude = nailed(d), 1.2
    mass, inertia = about_end()
    if d == 3:
        spatial = mass_of(ROD)
        mass, inertia = spatial.mass, spatial.inertia[1, 1] + spatial.mass
    period = 4 * math.sqrt(inertia / (mass * G)) * ellipk(math.sin(amplitude / 2) ** 2)
    system = a.system(gravity=DOWN if d == 2 else BELOW)
    path = run(a, system, {"nail": amplitude - math.pi / 2}, t_end=1.1 * period, dt=2e-3)
    swing = coordinate(a, path, "nail") + math.pi / 2
    back = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))[0]
    share = -swing[back] / (swing[back + 1] - swing[back])
    assert path.times[back] + share * path.dt == pytest.approx(0.75 * period, rel=1e-5)
    assert path.audit < 1e-4


@pytest.mark.parametrize("d", [2, 3])
def test_a_double_pendulum_in_angles_alone(d):
    """Two bars of length 2 with masses at their middles, in the angles from the vertical."""
    if d == 2:
        bodies = dict.fromkeys("AB", BAR)
        joints = {"n": Hinge("world", "A", on=[-1, 0])}
        joints["m"] = Hinge("A", "B", at=[1, 0], on=[-1, 0])
    else:
        bodies, axis = dict.fromkeys("AB", ROD), [0, -1, 0]
        joints = {"n": Hinge("world", "A", on=[-1, 0, 0], axis=axis)}
        joints["m"] = Hinge("A", "B", at=[1, 0, 0], on=[-1, 0, 0], axis=axis)
    a = Arrangement(bodies, joints=joints)
    mass = mass_of(bodies["A"])
    m, own = mass.mass, mass.inertia if d == 2 else mass.inertia[1, 1]

    def right(_, s):
        x, y, u, w = s
        c, sine = math.cos(x - y), math.sin(x - y)
        matrix = np.array([[own + 5 * m, 2 * m * c], [2 * m * c, own + m]])
        force = [-2 * m * w**2 * sine - 3 * m * G * math.sin(x)]
        force += [2 * m * u**2 * sine - m * G * math.sin(y)]
        return [u, w, *np.linalg.solve(matrix, force)]

    exact = solve_ivp(right, (0, 1.0), [1.2, 2.0, 0, 0], rtol=1e-11, atol=1e-11).y[:, -1]
    errors = []
    for dt in (2e-3, 1e-3):
        system = a.system(gravity=DOWN if d == 2 else BELOW)
        path = run(a, system, {"n": 1.2 - math.pi / 2, "m": 0.8}, dt=dt)
        first, second = (coordinate(a, path, n)[-1] for n in "nm")
        errors.append(
            np.hypot(first + math.pi / 2 - exact[0], first + second + math.pi / 2 - exact[1])
        )
        assert path.audit < 1e-4
    assert errors[1] < 2e-5
    assert 3 < errors[0] / errors[1] < 5


def test_a_rod_on_a_ball_joint_goes_round_a_cone():
    """``w^2 (I + m s^2) cos a = m g s``, without spin, in the coordinates of its axis."""
    a = Arrangement({"A": ROD}, joints={"p": Ball("world", "A", on=[-1, 0, 0])})
    mass, angle = mass_of(ROD), 0.7
    inertia = mass.inertia[1, 1] + mass.mass
    rate = math.sqrt(mass.mass * G / (inertia * math.cos(angle)))
    tilt = Rotation.from_euler("y", math.pi / 2 - angle)
    q = a.point({}, joints={"p": tilt})
    middle = np.array([math.sin(angle), 0, -math.cos(angle)])
    assert q[:3] == pytest.approx(middle)
    v = a.velocity(q, {"A": (rate * np.cross([0, 0, 1], middle), [0, 0, rate])})
    system = a.system(gravity=BELOW)
    path = simulate(system, system.state(q, v), 1.0, 1e-3, every=1)
    turned = Rotation.from_rotvec([0, 0, rate]).as_matrix() @ middle
    assert path.q[-1, 0, :3] == pytest.approx(turned, abs=1e-4)
    assert path.audit < 1e-5


@pytest.mark.parametrize("d", [2, 3])
def test_two_bodies_that_are_fixed_move_as_their_compound(d):
    """Thrown with a spin about a direction that is no axis of inertia."""
    rng = np.random.default_rng(5)
    bar = BAR if d == 2 else ROD
    turn = 1.1 if d == 2 else Rotation.from_rotvec([0.4, 1.0, -0.5])
    at, on = rng.normal(size=d), rng.normal(size=d)
    matrix = turn.as_matrix() if d == 3 else Rotation.from_rotvec([0, 0, turn]).as_matrix()[:2, :2]
    second = bar.moved(at - matrix @ on, turn)
    room = box([-99] * d, [99] * d)
    whole = Arrangement({"W": compound({"a": bar, "b": second})}, room, orientations="all")
    joints = {"weld": Fixed("A", "B", at=at, on=on, turn=turn)}
    two = Arrangement({"A": bar, "B": bar}, room, joints=joints)
    start = np.zeros(d)
    moving = (np.arange(1.0, d + 1), 2.0 if d == 2 else np.array([1.0, -2.0, 0.5]))
    ends = []
    for a, name in ((whole, "W"), (two, "A")):
        system = a.system(gravity=[*[0] * (d - 1), -G], masses=masses(whole, bar, second, name))
        q = a.point({name: start})
        v = a.velocity(q, {name: moving})
        if name == "A":
            v = a.velocity(q, carried_along(a, q, moving, d))
        path = simulate(system, system.state(q, v), 0.5, 5e-4)
        ends.append(a.placements[0].pose(path.q[-1, 0]))
        assert path.audit < 1e-5
    for one, other in zip(*ends, strict=True):
        assert one == pytest.approx(other, abs=1e-5)


def masses(whole, bar, second, name):
    """Both parts count fully, also where they overlap."""
    if name == "A":
        return {}
    d = bar.dimension
    parts = [mass_of(bar), mass_of(second)]
    total = sum(m.mass for m in parts)
    centre = sum(m.mass * m.centre for m in parts) / total
    inertia = 0.0
    for m in parts:
        x = m.centre - centre
        steiner = x @ x if d == 2 else x @ x * np.eye(3) - np.outer(x, x)
        inertia = inertia + m.inertia + m.mass * steiner
    assert whole.dimension == d
    return {"W": Mass(total, centre, inertia)}


def carried_along(a, q, moving, d):
    """Velocities of both bodies in the motion of the first as a rigid whole."""
    velocity, spin = moving
    away = a.placements[1].pose(q)[0] - a.placements[0].pose(q)[0]
    turned = np.cross(spin, away) if d == 3 else spin * np.array([-away[1], away[0]])
    return {"A": moving, "B": (velocity + turned, spin)}


def test_a_bead_on_a_wire_of_any_shape():
    """``y = x^2 / 2`` without friction, in ``x`` alone."""
    x, y = sympy.symbols("x y", real=True)
    wire = Rail("world", "A", at=[0, 1], curve=y - x**2 / 2)
    a = Arrangement({"A": disc(0.1)}, joints={"wire": wire})

    def right(_, s):
        return [s[1], -s[0] * (G + s[1] ** 2) / (1 + s[0] ** 2)]

    exact = solve_ivp(right, (0, 1.0), [1.2, 0], rtol=1e-11, atol=1e-11).y[0, -1]
    path = run(a, a.system(gravity=DOWN), placed={"A": [1.2, 1.72]})
    assert path.q[-1, 0] == pytest.approx([exact, 1 + exact**2 / 2], abs=1e-5)


def test_a_parallelogram_swings_as_one_pendulum():
    """A closed loop: two cranks and a coupler that does not turn."""
    crank, coupler = capsule([0, 0], [1, 0], 0.05), capsule([0, 0], [2, 0], 0.05)
    joints = {
        "O": Hinge("world", "A"),
        "P": Hinge("A", "B", at=[1, 0]),
        "Q": Hinge("B", "C", at=[2, 0], on=[1, 0]),
        "R": Hinge("world", "C", at=[2, 0]),
    }
    a = Arrangement({"A": crank, "B": coupler, "C": crank}, joints=joints)
    one, mid = mass_of(crank), mass_of(coupler).mass
    inertia = 2 * (one.inertia + one.mass / 4) + mid
    moment = 2 * one.mass / 2 + mid

    def right(_, s):
        return [s[1], -moment * G / inertia * math.cos(s[0])]

    exact = solve_ivp(right, (0, 1.0), [-0.8, 0], rtol=1e-11, atol=1e-11).y[0, -1]
    placed = {"A": ([0, 0], -0.8), "C": ([2, 0], -0.8)}
    path = run(a, a.system(gravity=DOWN), {"P": 0.8}, placed=placed)
    assert coordinate(a, path, "O")[-1] == pytest.approx(exact, abs=1e-5)
    assert path.audit < 1e-5


def test_the_force_of_a_nail_is_that_on_the_bar():
    """At rest the multiplier of ``nail.y`` carries the weight, upwards."""
    a = nailed()
    mass, _ = about_end()
    path = run(a, a.system(gravity=DOWN), {"nail": -math.pi / 2}, t_end=0.01)
    forces = {name: force for _, name, force in path.touching[-1]}
    assert forces["nail.y"] == pytest.approx(mass * G, rel=1e-6)


@pytest.mark.parametrize("bounce", [1.0, 0.6])
@pytest.mark.parametrize("by_joint", [True, False])
def test_a_limit_is_hit_and_left_with_its_restitution(bounce, by_joint):
    """A slider falls by 1 and rises by ``e^2``."""
    slide = Slider("world", "A", axis=[0, 1], limits=(0.0, 5.0))
    a = Arrangement({"A": disc(0.3)}, joints={"s": slide})
    given = {"s": bounce} if by_joint else {"s.min": bounce}
    path = run(a, a.system(gravity=DOWN, restitution=given), {"s": 1.0}, t_end=1.0)
    fall = math.sqrt(2 / G)
    hits = [e.time for e in path.of_kind(EventKind.IMPACT) if e.contact == "s.min"]
    assert hits[0] == pytest.approx(fall, abs=1e-3)
    height = coordinate(a, path, "s")
    assert height[path.times > fall + 0.01].max() == pytest.approx(bounce**2, abs=3e-3)
    assert path.audit < 1e-4


def test_a_hinge_rests_on_its_limit():
    a = nailed(limits=(-1.0, 0.5))
    mass, _ = about_end()
    path = run(a, a.system(gravity=DOWN), {"nail": 0.0}, t_end=2.0)
    assert coordinate(a, path, "nail")[-1] == pytest.approx(-1.0, abs=1e-5)
    forces = {name: force for _, name, force in path.touching[-1]}
    assert forces["nail.min"] == pytest.approx(mass * G * math.cos(1.0), rel=1e-3)


@pytest.mark.parametrize("ratio", [-2.0, 0.5])
def test_gears_share_a_torque_and_book_its_work(ratio):
    """``t = (I + r^2 J) w'``, and the wheels turn in the ratio."""
    wheels = {"A": disc(1.0), "B": disc(2.0)}
    joints = {"a": Hinge("world", "A"), "b": Hinge("world", "B", at=[3, 0])}
    arrangement = Arrangement(wheels, joints={**joints, "g": Gear("a", "b", ratio)})
    system = arrangement.system(drives={"m": Motor("a", 4.0)})
    path = run(arrangement, system, t_end=1.5)
    inertia = mass_of(wheels["A"]).inertia + ratio**2 * mass_of(wheels["B"]).inertia
    turned = 4.0 / inertia * 1.5**2 / 2
    assert coordinate(arrangement, path, "a")[-1] == pytest.approx(turned, rel=1e-5)
    assert coordinate(arrangement, path, "b")[-1] == pytest.approx(ratio * turned, rel=1e-5)
    assert path.work["applied"][-1] == pytest.approx(4.0 * turned, rel=1e-4)
    assert path.kinetic[-1] == pytest.approx(4.0 * turned, rel=1e-4)


def test_a_differential_shares_a_torque_among_three_shafts():
    """``w' = M^-1 (t - c p)`` with ``p = c M^-1 t / c M^-1 c``, as ``c w = 0``; no work is lost."""
    ratio, further = -20 / 60, 80 / 60
    wheels = {"A": disc(1.0), "B": disc(1.5), "C": disc(0.5)}
    joints = {n.lower(): Hinge("world", n, at=[3 * k, 0]) for k, n in enumerate(wheels)}
    joints["g"] = Gear("a", "b", ratio, 0.2, further={"c": further})
    a = Arrangement(wheels, joints=joints)
    system = a.system(drives={"m": Motor("a", 4.0), "n": Motor("c", -1.0)})
    path = run(a, system, t_end=1.5)
    torque, row = np.array([4.0, 0.0, -1.0]), np.array([-ratio, 1.0, -further])
    mobility = 1 / np.array([mass_of(wheel).inertia for wheel in wheels.values()])
    force = row @ (mobility * torque) / (row @ (mobility * row))
    turned = mobility * (torque - row * force) * 1.5**2 / 2
    start = a.joint_values(path.q[0, 0])
    found = [coordinate(a, path, n)[-1] - start[n] for n in "abc"]
    assert found == pytest.approx(turned, rel=1e-5)
    # As that of any equation, along its gradient.
    assert {n: f for _, n, f in path.touching[-1]}["g"] == pytest.approx(-force, rel=1e-5)
    assert path.kinetic[-1] == pytest.approx(torque @ turned, rel=1e-4)


def test_a_planet_rolls_on_its_sun_without_slipping():
    """The points of both where they mesh have one velocity; the planet hangs on the carrier."""
    sun, planet = 0.5, 0.25
    axis, arm = [0, 0, 1], [sun + planet, 0, 0]
    wheel = capsule([0, 0, -0.1], [0, 0, 0.1], 0.2)
    bodies = {"sun": wheel, "carrier": capsule([0, 0, 2], [*arm[:2], 2], 0.1), "planet": wheel}
    joints = {
        "s": Hinge("world", "sun", axis=axis),
        "c": Hinge("world", "carrier", axis=axis),
        "p": Hinge("carrier", "planet", at=arm, axis=axis),
        "teeth": Gear("s", "p", -sun / planet, further={"c": sun / planet}),
    }
    a = Arrangement(bodies, joints=joints)
    system = a.system(drives={"m": Motor("s", 3.0), "n": Motor("c", 1.0)})
    path = run(a, system, t_end=1.0)
    turned = {n: np.unwrap(coordinate(a, path, n)) for n in "scp"}
    rates = {n: np.gradient(x, path.times) for n, x in turned.items()}
    at_sun = sun * rates["s"]
    # The centre goes with the carrier, and the planet turns by what the carrier does, and p.
    at_planet = (sun + planet) * rates["c"] - planet * (rates["c"] + rates["p"])
    assert np.ptp(at_sun) > 0.1
    np.testing.assert_allclose(at_planet, at_sun, atol=1e-5)


@pytest.mark.parametrize("d", [2, 3])
def test_friction_in_a_hinge_stops_it_and_holds_it(d):
    """``I w' = -t``; and less than ``t`` does not move it."""
    a = nailed(d)
    inertia = about_end()[1] if d == 2 else mass_of(ROD).inertia[1, 1] + mass_of(ROD).mass
    system = a.system(friction={"nail": 0.5})
    stop = 2.0 * inertia / 0.5
    path = run(a, system, {"nail": 0.2}, {"nail": 2.0}, t_end=1.2 * stop, dt=2e-3)
    assert coordinate(a, path, "nail")[-1] == pytest.approx(0.2 + stop, rel=1e-4)
    assert path.dissipated["joints"][-1] == pytest.approx(inertia * 2, rel=1e-4)
    assert abs(path.v[-1]).max() < 1e-9
    for torque, moves in ((0.48, False), (0.52, True)):
        pushed = a.system(friction={"nail": 0.5}, drives={"m": Motor("nail", torque)})
        path = run(a, pushed, {"nail": 0.2}, t_end=0.2)
        assert (abs(path.v[-1]).max() > 0) == moves


# --------------------------------------------------------------------------------------- drives


def damped(t, inertia, stiffness, damping, start):
    """``I x'' + c x' + k x = 0`` from rest, underdamped."""
    decay, omega = damping / (2 * inertia), math.sqrt(stiffness / inertia)
    ringing = math.sqrt(omega**2 - decay**2)
    return (
        start * np.exp(-decay * t) * (np.cos(ringing * t) + decay / ringing * np.sin(ringing * t))
    )


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("separate", [False, True])
def test_a_torsion_spring_with_a_damper_rings_down(d, separate):
    a = nailed(d)
    inertia = about_end()[1] if d == 2 else mass_of(ROD).inertia[1, 1] + mass_of(ROD).mass
    both = {"s": Spring("nail", stiffness=40.0, length=0.3, damping=2.0)}
    apart = {"s": Spring("nail", stiffness=40.0, length=0.3), "d": Damper("nail", damping=2.0)}
    system = a.system(drives=apart if separate else both)
    path = run(a, system, {"nail": 0.9}, t_end=2.0, dt=2e-3)
    exact = 0.3 + damped(path.times, inertia, 40.0, 2.0, 0.6)
    assert coordinate(a, path, "nail") == pytest.approx(exact, abs=2e-4)
    assert path.audit < 1e-3


@pytest.mark.parametrize("length", [0.0, 1.5])
@pytest.mark.parametrize("d", [2, 3])
def test_a_spring_between_two_balls_changes_their_distance(length, d):
    """With the reduced mass ``m / 2``; their centre stays where it is."""
    ball = disc(0.2) if d == 2 else sphere(0.2)
    a = Arrangement({"A": ball, "B": ball}, box([-9] * d, [9] * d))
    spring = Spring("A", "B", stiffness=3.0, length=length, damping=0.1)
    system = a.system(drives={"s": spring})
    start = np.zeros(d)
    start[0] = 2.0
    path = run(a, system, placed={"A": np.zeros(d), "B": start}, t_end=0.1, dt=5e-4)
    reduced = mass_of(ball).mass / 2
    exact = length + damped(path.times, reduced, 3.0, 0.1, 2.0 - length)
    apart = path.q[:, 0, d] - path.q[:, 0, 0]
    assert apart == pytest.approx(exact, abs=2e-3)
    assert (path.q[:, 0, d] + path.q[:, 0, 0])[-1] == pytest.approx(2.0)


def test_a_spring_holds_a_bar_by_an_anchor_off_its_origin():
    """Between the world and an end of a bar on a nail: the potential is that of the geometry."""
    a = nailed()
    spring = Spring("world", "A", at=[2.0, 3.0], on=[1, 0], stiffness=5.0, length=0.5)
    system = a.system(drives={"s": spring})
    q = a.point({}, joints={"nail": 0.4})
    end = 2 * np.array([math.cos(0.4), math.sin(0.4)])
    stretched = np.linalg.norm(end - [2, 3]) - 0.5
    _, potential = system.energies(system.state(q))
    assert potential == pytest.approx(5 * stretched**2 / 2)


def test_a_motor_with_a_speed_pulls_with_its_limit_until_it_keeps_it():
    a = nailed()
    inertia = about_end()[1]
    system = a.system(drives={"m": Motor("nail", speed=3.0, limit=2.0)})
    path = run(a, system, t_end=3.0 * inertia / 2.0 + 1.0, dt=2e-3)
    begun = 3.0 * inertia / 2.0
    rate = path.v[:, 0, 2]
    early = path.times < begun - 0.01
    assert rate[early] == pytest.approx(2.0 / inertia * path.times[early], abs=1e-2)
    assert rate[path.times > begun + 0.01] == pytest.approx(3.0, abs=1e-6)
    gained = inertia * 9 / 2
    assert path.kinetic[-1] == pytest.approx(gained, rel=1e-4)
    given = path.work["substrate"][-1] - path.dissipated["drives"][-1]
    assert given == pytest.approx(gained, rel=1e-3)
    assert path.audit < 1e-5


def test_a_controller_is_a_torque_of_angle_and_rate():
    a = nailed()
    inertia = about_end()[1]
    angle, rate = a.joint_function("nail"), a.joint_rate("nail")
    system = a.system(drives={"m": Motor("nail", -40 * (angle - 0.3) - 2 * rate)})
    path = run(a, system, {"nail": 0.9}, t_end=1.0)
    exact = 0.3 + damped(path.times, inertia, 40.0, 2.0, 0.6)
    assert coordinate(a, path, "nail") == pytest.approx(exact, abs=2e-4)


@pytest.mark.parametrize("d", [2, 3])
def test_a_prescribed_motion_is_followed_to_second_order(d):
    a = nailed(d)
    system = a.system(
        gravity=DOWN if d == 2 else BELOW,
        drives={"p": Prescribed("nail", 0.5 * sympy.sin(3 * NOW), limit=1e4)},
    )
    errors = []
    for dt in (4e-3, 2e-3):
        path = run(a, system, rates={"nail": 1.5}, t_end=2.0, dt=dt)
        errors.append(abs(coordinate(a, path, "nail") - 0.5 * np.sin(3 * path.times)).max())
        assert path.audit < 1e-4
    assert 3.5 < errors[0] / errors[1] < 4.5
    assert errors[1] < 1e-5


def test_a_prescribed_motion_stops_at_what_its_drive_cannot_lift():
    mass, _ = about_end()
    for share, moves in ((0.9, False), (1.2, True)):
        lift = Prescribed("nail", 0.1 * NOW**2, limit=share * mass * G)
        rest = Slider("world", "A", axis=[0, 1])
        held = Arrangement(
            {"A": BAR}, {"floor": HalfSpace([0, 1], [0, -0.1])}, joints={"nail": rest}
        )
        path = run(held, held.system(gravity=DOWN, drives={"p": lift}), t_end=0.5)
        assert (path.q[-1, 0, 1] > 1e-6) == moves


def test_a_slider_crank_follows_its_crank():
    """``x = r cos a + sqrt(l^2 - r^2 sin^2 a)`` where the crank turns at a prescribed rate."""
    r, rod = 1.0, 2.5
    joints = {
        "O": Hinge("world", "crank"),
        "A": Hinge("crank", "rod", at=[r, 0]),
        "B": Hinge("rod", "piston", at=[rod, 0]),
        "C": Slider("world", "piston", axis=[1, 0]),
    }
    bodies = {"crank": capsule([0, 0], [r, 0], 0.1), "rod": capsule([0, 0], [rod, 0], 0.1)}
    a = Arrangement({**bodies, "piston": disc(0.4)}, joints=joints)
    start = 0.7
    slant = -math.asin(r * math.sin(start) / rod)
    system = a.system(drives={"p": Prescribed("O", 5 * NOW, limit=1e4)})
    path = run(a, system, {"O": start, "A": slant - start, "B": -slant}, {"O": 5.0}, t_end=1.5)
    angle = start + 5 * path.times
    exact = r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)
    assert a.joint_values(path.q[:, 0])["C"] == pytest.approx(exact, abs=1e-4)


def test_a_coordinate_of_a_body_is_prescribed():
    """A plate is shaken; a block on it with friction follows while ``mu g`` is enough."""
    block, plate = disc(0.2), capsule([-3, 0], [3, 0], 0.2)
    a = Arrangement(
        {"P": plate, "B": capsule([-0.3, 0], [0.3, 0], 0.2)},
        joints={"rail": Slider("world", "P", axis=[1, 0])},
    )
    assert block.dimension == 2
    shake = Prescribed("xP", 0.02 * (1 - sympy.cos(10 * NOW)), limit=1e4)  # at most 2 m/s^2
    for mu, follows in ((0.3, True), (0.1, False)):
        system = a.system(gravity=DOWN, friction=mu, drives={"s": shake})
        path = run(a, system, placed={"P": [0, 0], "B": ([0, 0.4], 0.0)}, t_end=0.6)
        slid = abs(path.q[:, 0, 3] - path.q[:, 0, 0]).max()
        assert (slid < 1e-3) == follows
        assert path.q[:, 0, 0] == pytest.approx(0.02 * (1 - np.cos(10 * path.times)), abs=1e-5)


@pytest.mark.parametrize("d", [2, 3])
def test_a_damper_that_a_step_does_not_resolve_is_refused(d):
    """``h c / I`` is at most 1.5; a motion that is damped so fast follows the implicit rule."""
    a = nailed(d)
    inertia = about_end()[1] if d == 2 else mass_of(ROD).inertia[1, 1] + mass_of(ROD).mass
    dt = 1e-3
    q = a.point({}, joints={"nail": 0.3})
    v = a.velocity(q, {}, joints={"nail": 1.0})
    for share, fits in ((1.4, True), (1.6, False)):
        system = a.system(drives={"d": Damper("nail", damping=share * inertia / dt)})
        state = system.state(q, v)
        longest, _ = system.largest_step(state)
        assert longest == pytest.approx(1.5 * dt / share, rel=1e-4)
        if not fits:
            with pytest.raises(ValueError, match=r"dt: .*damping is not resolved"):
                simulate(system, state, 0.1, dt)
            continue
        path = simulate(system, state, 2 * dt, dt, every=1)
        left = (1 - share / 2) / (1 + share / 2)
        assert np.linalg.norm(path.v[1]) / np.linalg.norm(v) == pytest.approx(left, abs=1e-3)


# --------------------------------------------------------------------------------------- forces


def test_a_torque_in_space_turns_a_free_body_about_its_direction():
    """Of a ball: ``w = t s / I``, by the rotation of the quaternion."""
    a = Arrangement({"A": sphere(1.0)}, box([-9] * 3, [9] * 3), orientations="all")
    torque = np.array([0.3, -0.2, 0.5])
    system = a.system(forces={"A": [0, 0, 0, *torque]})
    path = run(a, system, placed={"A": [0, 0, 0]}, t_end=2.0, dt=2e-3)
    inertia = mass_of(sphere(1.0)).inertia[0, 0]
    expected = Rotation.from_rotvec(torque / inertia * 2.0).as_matrix()
    assert a.placements[0].pose(path.q[-1, 0])[1] == pytest.approx(expected, abs=1e-4)


def test_a_torque_turns_the_axis_of_a_rod():
    rod = capsule([-1, 0, 0], [1, 0, 0], 0.1)
    a = Arrangement({"A": rod}, box([-9] * 3, [9] * 3))
    system = a.system(forces={"A": [0, 0, 0, 0, 0, 0.4]})
    path = run(a, system, placed={"A": [0, 0, 0]}, t_end=1.0)
    angle, start = 0.4 / mass_of(rod).inertia[1, 1] / 2, path.q[0, 0, 3:]
    expected = Rotation.from_rotvec([0, 0, angle]).as_matrix() @ start
    assert path.q[-1, 0, 3:] == pytest.approx(expected, abs=1e-3)


def test_a_force_may_follow_the_time_and_the_velocity():
    """``m v' = 2 t - c v``."""
    a = Arrangement({"A": disc(0.5)}, box([-99, -99], [99, 99]))
    v = velocities(a.manifold)[0]
    system = a.system(masses={"A": Mass(2.0, [0, 0], 0.1)}, forces={"A": [2 * NOW - 0.8 * v, 0]})
    path = run(a, system, placed={"A": [0, 0]}, t_end=2.0)
    exact = solve_ivp(lambda t, s: [(2 * t - 0.8 * s[0]) / 2], (0, 2), [0.0], rtol=1e-10).y[0, -1]
    assert path.v[-1, 0, 0] == pytest.approx(exact, abs=1e-5)


def test_an_arm_pushes_a_floor_with_its_torque():
    """At rest on the floor the force at the tip has the moment of motor and weight."""
    floor = {"floor": HalfSpace([0, 1], [0, -1.0])}
    joints = {"nail": Hinge("world", "A", on=[-1, 0])}
    a = Arrangement({"A": BAR}, floor, joints=joints)
    mass, _ = about_end()
    angle = brentq(lambda x: 2 * math.sin(x) - 0.1 + 1.0, -1.5, 0)
    path = run(
        a, a.system(gravity=DOWN, drives={"m": Motor("nail", -3.0)}), {"nail": angle}, t_end=0.2
    )
    force = next(f for _, name, f in path.touching[-1] if name == "A.v2-floor")
    arm = math.cos(angle)
    assert force == pytest.approx((3.0 + mass * G * arm) / (2 * arm), rel=1e-3)


def test_beads_on_a_rail_are_repeated_with_their_joint():
    """Three equal beads between two walls exchange their velocities when they meet."""
    rail = {"rail": Slider("world", "A", axis=[1, 0])}
    a = Arrangement({"A": disc(0.25)}, box([0, -9], [4, 9]), joints=rail)
    system = a.system(gravity=DOWN, count=3, restitution=1.0)
    qs = np.array([a.point({}, joints={"rail": x}) for x in (0.5, 1.5, 3.0)])
    rates = np.zeros((3, 3))
    rates[0, 0] = 1.0
    path = simulate(system, system.state(qs, rates), 2.5, 1e-3)
    assert path.q[-1] == pytest.approx(np.array([[1.0, 0, 0], [2.5, 0, 0], [3.5, 0, 0]]), abs=1e-6)
    assert path.v[-1, :, 0] == pytest.approx([0, 0, -1.0], abs=1e-6)  # 0.75 to the wall, and back


# --------------------------------------------------------------------------------------- errors

WRONG = [
    (lambda: Spring("A", "B", stiffness=-1), "stiffness: "),
    (lambda: Spring("A", "A", stiffness=1), "child: "),
    (lambda: Spring("nail", at=[0, 1], stiffness=1), "at: .*none where one joint is named"),
    (lambda: Spring("A", "B", stiffness=1, length=-1), "length: "),
    (lambda: Motor("nail"), "torque: .*either"),
    (lambda: Motor("nail", speed=1.0), "limit: "),
    (lambda: Motor("nail", 1.0, limit=3.0), "limit: "),
    (lambda: nailed().system(drives={"m": Motor("nagel", 1.0)}), r"drives\['m'\]: joint: .*nagel"),
    (lambda: nailed().system(drives={"m": 3}), r"drives\['m'\]: drive: expected a Spring"),
    (
        lambda: nailed().system(drives={"m": Motor("nail", sympy.Symbol("z"))}),
        r"drives\['m'\]: torque: .*formula",
    ),
    (
        lambda: nailed().system(drives={"s": Spring("floor", "A", stiffness=1)}),
        r"drives\['s'\]: parent: .*floor",
    ),
    (
        lambda: nailed().system(drives={"p": Prescribed("xB", NOW, limit=1.0)}),
        r"drives\['p'\]: of: .*xB",
    ),
    (lambda: nailed().system(forces={"A": [1.0]}), "forces: .*2 components"),
    (lambda: nailed().system(forces={"B": [1.0, 1.0]}), "forces: .*B"),
    (lambda: nailed().system(friction={"nail": -1.0}), "friction: "),
    (
        lambda: balls().system(drives={"s": Spring("A", "B", at=[0.1, 0], stiffness=1)}),
        r"drives\['s'\]: at: .*axis",
    ),
    (lambda: balls().system(forces={"A": [0, 0, 1.0]}), "forces: .*no torque"),
    (lambda: balls(Ball("A", "B", at=[1, 0])).system(friction={"J": 1.0}), "friction: .*one coord"),
]


def balls(joint=None):
    walls = box([-9, -9], [9, 9])
    joints = {} if joint is None else {"J": joint}
    return Arrangement({"A": disc(0.5), "B": disc(0.5)}, walls, joints=joints)


@pytest.mark.parametrize(("call", "sentence"), WRONG)
def test_what_does_not_fit_is_refused_in_a_sentence(call, sentence):
    with pytest.raises((ValueError, TypeError), match=sentence):
        call()


def test_a_ladder_slides_down_between_its_rails():
    """A rod of length 2 on a wall and a floor without friction, in its angle from the floor."""
    joints = {
        "wall": Rail("world", "L", on=[-1, 0], axis=[0, 1]),
        "floor": Rail("world", "L", on=[1, 0], axis=[1, 0]),
    }
    a = Arrangement({"L": BAR}, joints=joints)
    mass = mass_of(BAR)

    def right(_, s):
        return [s[1], -mass.mass * G * math.cos(s[0]) / (mass.inertia + mass.mass)]

    exact = solve_ivp(right, (0, 0.5), [1.2, 0], rtol=1e-11, atol=1e-11).y[0, -1]
    placed = {"L": ([math.cos(1.2), math.sin(1.2)], -1.2)}
    path = run(a, a.system(gravity=DOWN), placed=placed, t_end=0.5)
    assert -path.q[-1, 0, 2] == pytest.approx(exact, abs=1e-5)


def test_a_belt_of_changing_speed_carries_a_block_from_any_time():
    """A slip that depends on the time, also where a motion starts later."""
    M = Manifold.euclidean("x y")
    (_, y), (vx, vy) = M.symbols, velocities(M)
    rub = Friction("rub", [vx - sympy.sin(NOW)], Interval(0.5), load="floor")
    system = System(Polyhedron(M, {"floor": y}), (vx**2 + vy**2) / 2, G * y, friction=(rub,))
    begin = 0.4
    state = system.state([0, 0], [math.sin(begin), 0], begin)
    path = simulate(system, state, 3.0, 2e-3)
    assert path.q[-1, 0, 0] == pytest.approx(math.cos(begin) - math.cos(3.0), abs=1e-5)
    assert path.v[-1, 0, 0] == pytest.approx(math.sin(3.0), abs=1e-9)
    with pytest.raises(ValueError, match="system: expected slips that do not depend on the time"):
        accelerations(system, state)
