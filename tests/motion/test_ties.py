"""Ties: joints, limits, springs and drives between bodies of a repeated system.

The oracles are closed forms, SciPy's integrator in coordinates without equations, or the same
joints as equations of one configuration.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from polycorner import Friction, Manifold, Polyhedron, System, velocities
from polycorner.files.trajectories import load_trajectory, save_trajectory
from polycorner.motion import (
    Assembly,
    Checkpoint,
    ContactFamily,
    EventKind,
    Interval,
    Solver,
    Tie,
    pair_coordinates,
    pair_velocities,
    simulate,
    time_symbol,
)

G = 9.81
LINE, PLANE, LINK = (Manifold.euclidean(names) for names in ("x", "x y", "x y a"))
EXACT = {"rtol": 1e-12, "atol": 1e-12, "method": "DOP853"}
TIGHT = Solver(tolerance=1e-12)
(X, Y, A), (VX, VY, VA) = LINK.symbols, velocities(LINK)
(X1, Y1, A1), (X2, Y2, A2) = pair_coordinates(LINK)
(U1, W1, O1), (U2, W2, O2) = pair_velocities(LINK)
ROD = (VX**2 + VY**2 + VA**2 / 12) / 2  # mass 1, length 1, along (sin a, -cos a)
FAR = {"far": Y + 900}


def end(x, y, a, which):
    """Return an end of a rod: the upper one for -1, the lower one for 1."""
    return x + which * sp.sin(a) / 2, y - which * sp.cos(a) / 2


def pinned(name, one, two):
    return {f"{name}x": two[0] - one[0], f"{name}y": two[1] - one[1]}


LOWER = {"x": end(X2, Y2, A2, -1)[0] - end(X1, Y1, A1, 1)[0]}
LOWER["y"] = end(X2, Y2, A2, -1)[1] - end(X1, Y1, A1, 1)[1]
UPPER = dict(zip("xy", end(X1, Y1, A1, -1), strict=True))


def rods(count, *, ties=(), walls=FAR, **more):
    """Return rods that hang from the origin, each from the end of the one before."""
    first = Tie(0, "hook", UPPER)
    pin = Tie((0, 1), "pin", LOWER)
    pins = [replace(pin, bodies=(i, i + 1)) for i in range(count - 1)]
    held = [first, *pins, *ties]
    return System(Polyhedron(LINK, walls), ROD, G * Y, count=count, ties=held, **more)


def hanging(angles):
    """Return the placements of rods that hang from each other at angles to the vertical."""
    ends = np.cumsum([[math.sin(a), -math.cos(a)] for a in angles], axis=0)
    middles = ends - 0.5 * np.array([[math.sin(a), -math.cos(a)] for a in angles])
    return np.column_stack([middles, angles])


def forces(path, instant=-1):
    return [(bodies, name, force) for bodies, name, force in path.touching[instant]]


def order(errors):
    return np.polyfit(-np.arange(len(errors)) * math.log(2), np.log(errors), 1)[0]


def double_pendulum(angles, times):
    """Return the angles of two hanging rods, by Lagrange's equations of the two angles."""
    a, b, u, w = sp.symbols("a b u w")
    m, one = sp.Rational(1, 12), (sp.sin(a) / 2, -sp.cos(a) / 2)
    two = (sp.sin(a) + sp.sin(b) / 2, -sp.cos(a) - sp.cos(b) / 2)
    speed = [sum(sp.diff(z, s) * r for s, r in ((a, u), (b, w))) for z in (*one, *two)]
    T = sum(s**2 for s in speed) / 2 + m * (u**2 + w**2) / 2
    V = G * (one[1] + two[1])
    mass = sp.hessian(T, (u, w))
    bend = [
        sp.diff(T - V, s) - sum(sp.diff(T, r, z) * y for z, y in ((a, u), (b, w)))
        for s, r in ((a, u), (b, w))
    ]
    known = sp.lambdify((a, b, u, w), [mass, sp.Matrix(bend)])

    def rate(_, y):
        M, F = known(*y)
        return [*y[2:], *np.linalg.solve(M, F).ravel()]

    return solve_ivp(rate, (0, times[-1]), [*angles, 0, 0], t_eval=times, **EXACT).y[:2].T


def test_double_pendulum_follows_lagrange_to_second_order():
    system, start, errors, drifts = rods(2), hanging([1.0, 0.4]), [], []
    for dt in (4e-3, 2e-3, 1e-3):
        path = simulate(system, system.state(start), 1.0, dt, every=round(0.1 / dt))
        exact = double_pendulum([1.0, 0.4], path.times)
        errors.append(abs(path.q[:, :, 2] - exact).max())
        drifts.append(np.ptp(path.kinetic + path.potential))
        assert path.converged
    assert 1.9 < order(errors) < 2.1
    assert 1.9 < order(drifts) < 2.1
    assert errors[-1] < 1e-4


def listed(count):
    """Return the same rods as one configuration with equations."""
    space = Manifold.euclidean(" ".join(f"x{i} y{i} a{i}" for i in range(count)))
    q = np.reshape(space.symbols, (count, 3))
    v = np.reshape(velocities(space), (count, 3))
    kinetic = sum(ROD.subs(zip((VX, VY, VA), row, strict=True)) for row in v)
    equations = dict(zip(("hx", "hy"), end(*q[0], -1), strict=True))
    for i in range(count - 1):
        equations |= pinned(f"p{i}", end(*q[i], 1), end(*q[i + 1], -1))
    walls = Polyhedron(space, {"far": q[0, 1] + 900}, equations=equations)
    return System(walls, kinetic, G * sum(q[:, 1]))


def test_tied_rods_move_as_one_configuration_does():
    start = hanging([0.9, -0.2, 1.4])
    tied, one = rods(3), listed(3)
    path = simulate(tied, tied.state(start), 1.0, 1e-3, solver=TIGHT)
    same = simulate(one, one.state(start.ravel()), 1.0, 1e-3, solver=TIGHT)
    assert abs(path.q.reshape(len(path), -1) - same.q[:, 0]).max() < 1e-9
    held = [force for _, _, force in forces(path)]
    assert np.allclose(held, [force for _, _, force in forces(same)], rtol=0, atol=1e-6)
    steps = tied.largest_step(tied.state(start))[0], one.largest_step(one.state(start.ravel()))[0]
    assert steps[0] == pytest.approx(steps[1], rel=1e-6)


@pytest.mark.parametrize("count", [20, 100])
def test_hanging_rods_carry_what_is_below(count):
    system = rods(count)
    path = simulate(system, system.state(hanging([0.0] * count)), 0.02, 1e-3, solver=TIGHT)
    # The force along the gradient: the hook pulls the first rod up, each pin the rod below it.
    carried = [force for _, name, force in forces(path) if name.endswith(".y")]
    assert np.allclose(carried, G * np.arange(count, 0, -1), rtol=1e-9)
    assert abs(path.q[-1] - path.q[0]).max() < 1e-9


def polygon(count, load, pull):
    """Return the placements of rods that hang between two hooks, at rest.

    The horizontal force is ``pull``; the moments of each rod about its middle balance.
    """
    up = load * (count / 2 - np.arange(count + 1))  # vertical force at each joint
    # tan of the angle to the horizontal is the mean of the vertical forces at both ends over pull
    slope = np.arctan2((up[:-1] + up[1:]) / 2, pull)
    return math.pi / 2 - slope[::-1] if load < 0 else math.pi / 2 - slope


def test_chain_between_hooks_hangs_as_its_polygon_of_forces():
    count, pull = 20, 60.0
    # Downwards first: the angle to the downward vertical is less than a right one there.
    angles = polygon(count, G, pull)
    start = hanging(angles)
    last = np.cumsum([[math.sin(a), -math.cos(a)] for a in angles], axis=0)[-1]
    hook = {"x": end(X1, Y1, A1, 1)[0] - last[0], "y": end(X1, Y1, A1, 1)[1] - last[1]}
    system = rods(count, ties=[Tie(count - 1, "far hook", hook)])
    path = simulate(system, system.state(start), 0.05, 1e-3, solver=TIGHT)
    assert abs(path.q[-1] - path.q[0]).max() < 1e-7
    across = [force for _, name, force in forces(path) if name.endswith(".x")]
    assert np.allclose(np.abs(across), pull, rtol=1e-6)


def test_four_bar_linkage_closes_and_keeps_its_energy():
    # A parallelogram of three rods on two hooks, one apart: all of its motions are known. The
    # cranks turn together and the coupler is carried without turning.
    hook = {"x": end(X1, Y1, A1, -1)[0] - 1, "y": end(X1, Y1, A1, -1)[1]}
    across = {
        "x": X2 - sp.sin(A2) / 2 - X1 - sp.sin(A1) / 2,
        "y": Y2 + sp.cos(A2) / 2 - Y1 + sp.cos(A1) / 2,
    }
    closing = {
        "x": X2 + sp.sin(A2) / 2 - X1 - sp.sin(A1) / 2,
        "y": Y2 - sp.cos(A2) / 2 - Y1 + sp.cos(A1) / 2,
    }
    ties = [
        Tie(0, "left", UPPER),
        Tie(2, "right", hook),
        Tie((0, 1), "crank", across),
        Tie((2, 1), "rocker", closing),
    ]
    system = System(Polyhedron(LINK, FAR), ROD, G * Y, count=3, ties=ties)
    a = 1.1
    tip = np.array([math.sin(a), -math.cos(a)])
    start = [[*tip / 2, a], [tip[0] + 0.5, tip[1], math.pi / 2], [tip[0] / 2 + 1, tip[1] / 2, a]]
    path = simulate(system, system.state(start), 1.0, 1e-3)

    # (2 / 3 + 1) a'' = -2 g sin a: two rods about their ends, and one at distance 1
    def rate(_, y):
        return [y[1], -2 * G * math.sin(y[0]) / (5 / 3)]

    exact = solve_ivp(rate, (0, 1), [a, 0], t_eval=path.times, **EXACT).y[0]
    assert abs(path.q[:, 0, 2] - exact).max() < 1e-4
    assert abs(path.q[:, 1, 2] - math.pi / 2).max() < 1e-7
    assert path.audit < 1e-4


def test_slider_crank_at_constant_speed_needs_the_torque_of_its_energy():
    # The crank of length 1 turns at constant speed, a rod of length 1 joins it to a slider on the
    # axis: (cos t, sin t), then (2 cos t, 0). The torque is dT/d(angle), without weight.
    speed, t = 2.0, time_symbol()
    turn = math.pi / 2  # of the angle a, from the downward vertical
    ties = [
        Tie(0, "hook", UPPER),
        Tie((0, 1), "pin", LOWER),
        Tie(1, "slider", {"axis": end(X1, Y1, A1, 1)[1]}),
        Tie(0, "motor", {"angle": A1 - turn - speed * t - 0.4}),
    ]
    system = System(Polyhedron(LINK, FAR), ROD, 0, count=2, ties=ties)

    def placed(angle):
        tip = np.array([math.cos(angle), math.sin(angle)])
        return [[*tip / 2, angle + turn], [1.5 * tip[0], 0.5 * tip[1], turn - angle]]

    def moving(angle):
        s, c = math.sin(angle), math.cos(angle)
        return np.array([[-s / 2, c / 2, 1], [-1.5 * s, c / 2, -1]])

    start = system.state(placed(0.4), speed * moving(0.4))
    path = simulate(system, start, 0.5, 5e-4, every=1)  # it is singular at a right angle
    angle = 0.4 + speed * path.times
    # T = speed^2 (sum of m |dr/d angle|^2 + I) / 2 as a function of the angle; torque = dT/d angle
    torque = speed**2 * 2 * np.sin(angle) * np.cos(angle)
    asked = np.array([next(f for _, n, f in some if n == "motor.angle") for some in path.touching])
    middle = 0.5 * (angle[1:] + angle[:-1])
    expected = speed**2 * 2 * np.sin(middle) * np.cos(middle)
    assert abs(asked[1:] - expected).max() < 1e-3 * abs(torque).max()
    exact = np.array([placed(x) for x in angle])
    assert abs(path.q - exact).max() < 1e-5
    kinetic = path.kinetic - path.kinetic[0]
    assert abs(path.work["drive"] - kinetic).max() < 1e-4 * np.ptp(kinetic)
    assert path.audit < 1e-4


def test_of_equations_that_follow_from_others_the_later_carry_no_force():
    # A third crank in the middle of the parallelogram: one of its equations is redundant.
    crank = {
        "x": X2 - sp.sin(A2) / 2 - X1 - sp.sin(A1) / 2,
        "y": Y2 + sp.cos(A2) / 2 - Y1 + sp.cos(A1) / 2,
    }
    ties = []
    for i, place in enumerate((0.0, 0.5, 1.0)):
        hook = {"x": end(X1, Y1, A1, -1)[0] - place, "y": end(X1, Y1, A1, -1)[1]}
        along = place - 0.5
        joint = {
            "x": crank["x"] + sp.sin(A2) * (along + 0.5),
            "y": crank["y"] - sp.cos(A2) * (along + 0.5),
        }
        ties += [Tie(i, f"hook {i}", hook), Tie((i, 3), f"pin {i}", joint)]
    system = System(Polyhedron(LINK, FAR), ROD, G * Y, count=4, ties=ties)
    a = 1.1
    tip = np.array([math.sin(a), -math.cos(a)])
    cranks = [[tip[0] / 2 + place, tip[1] / 2, a] for place in (0.0, 0.5, 1.0)]
    start = [*cranks, [tip[0] + 0.5, tip[1], math.pi / 2]]
    path = simulate(system, system.state(start), 0.5, 1e-3)

    def rate(_, y):  # (3 / 3 + 1) a'' = -(3 / 2 + 1) g sin a
        return [y[1], -2.5 * G * math.sin(y[0]) / 2]

    exact = solve_ivp(rate, (0, 0.5), [a, 0], t_eval=path.times, **EXACT).y[0]
    assert abs(path.q[:, 0, 2] - exact).max() < 1e-4
    assert path.converged
    assert [force == 0 for _, _, force in forces(path)].count(True) == 1


# ------------------------------------------------------------------------------- springs, dampers

(Z,), (VZ,) = LINE.symbols, velocities(LINE)
(Z1,), (Z2,) = pair_coordinates(LINE)
(S1,), (S2,) = pair_velocities(LINE)
STIFF = sp.Symbol("stiff", real=True)
WALLS = Polyhedron(LINE, {"far": Z + 900})


def springs(count, stiffness=1.0):
    """Return unit masses at 1, 2, ..., joined by springs to each other and to walls."""
    between = Tie((0, 1), "spring", potential=STIFF * (Z2 - Z1 - 1) ** 2 / 2)
    between = replace(between, parameters={"stiff": stiffness}, collide=True)
    ties = [replace(between, bodies=(i, i + 1)) for i in range(count - 1)]
    for i, place in ((0, 1), (count - 1, count)):
        wall = STIFF * (Z1 - place) ** 2 / 2
        ties.append(Tie(i, "wall", potential=wall, parameters={"stiff": stiffness}))
    return System(WALLS, VZ**2 / 2, count=count, ties=ties)


@pytest.mark.parametrize("mode", [1, 3, 5])
def test_chain_of_springs_swings_at_its_frequencies(mode):
    count, stiffness, dt = 5, 4.0, 1e-2
    system, i = springs(count, stiffness), np.arange(1, count + 1)
    shape = np.sin(mode * math.pi * i / (count + 1))
    omega = 2 * math.sqrt(stiffness) * math.sin(mode * math.pi / (2 * (count + 1)))
    # With the midpoints of steps at q + h v / 2 the scheme is leapfrog: sin(W h / 2) = w h / 2.
    found = 2 / dt * math.asin(omega * dt / 2)
    path = simulate(system, system.state((i + 0.1 * shape)[:, None]), 5.0, dt)
    expected = i + 0.1 * shape * np.cos(found * path.times)[:, None]
    assert abs(path.q[:, :, 0] - expected).max() < 1e-5
    share = (omega * dt / 2) ** 2  # of the energy, by which leapfrog lets it swing
    assert np.ptp(path.kinetic + path.potential) < 1.01 * share * path.kinetic.max()
    assert path.potential[0] == pytest.approx(0.5 * omega**2 * 0.01 * (shape**2).sum(), rel=1e-9)


@pytest.mark.parametrize("count", [4, 90])
def test_largest_step_is_that_of_the_stiffest_mode(count):
    system = springs(count, 100.0)
    place = np.arange(1.0, count + 1)[:, None]
    omega = 20 * math.sin(count * math.pi / (2 * (count + 1)))
    assert system.largest_step(system.state(place))[0] == pytest.approx(2 / omega, rel=0.01)
    with pytest.raises(ValueError, match="dt: expected at most"):
        simulate(system, system.state(place), 1.0, 0.2)


def test_damped_pair_loses_relative_velocity_and_no_momentum():
    damper = Tie((0, 1), "damper", forces={"x1": 3 * (S2 - S1), "x2": 3 * (S1 - S2)})
    system = System(WALLS, VZ**2 / 2, count=2, ties=[damper])
    path = simulate(system, system.state([[0], [5]], [[1], [0]]), 0.5, 1e-3)
    away = path.v[:, 0, 0] - path.v[:, 1, 0]
    assert np.allclose(away, np.exp(-6 * path.times), rtol=1e-5)
    assert np.ptp(path.v.sum(axis=(1, 2))) < 1e-14
    assert path.audit < 1e-9
    assert path.work["applied"][-1] == pytest.approx(path.kinetic[-1] - path.kinetic[0], rel=1e-9)


def test_force_of_time_between_bodies_does_work():
    t = time_symbol()
    motor = Tie((0, 1), "motor", forces={"x1": -sp.cos(t), "x2": sp.cos(t)})
    system = System(WALLS, VZ**2 / 2, count=2, ties=[motor])
    path = simulate(system, system.state([[0], [5]]), 1.0, 1e-3)
    assert np.allclose(path.v[:, 1, 0], np.sin(path.times), atol=1e-6)
    assert path.audit < 1e-9


# ------------------------------------------------------------------------------- limits, friction


def test_row_of_limits_is_a_cradle():
    count = 5
    touch = Tie((0, 1), "row", limits={"gap": Z2 - Z1 - 1}, restitution=1.0)
    ties = [replace(touch, bodies=(i, i + 1)) for i in range(count - 1)]
    system = System(WALLS, VZ**2 / 2, count=count, ties=ties)
    start = 1.01 * np.arange(count)[:, None] + [[-0.1], *[[0.0]] * (count - 1)]
    moving = [[1.0], *[[0.0]] * (count - 1)]
    path = simulate(system, system.state(start, moving), 0.4, 1e-3)
    assert np.allclose(path.v[-1, :, 0], [0, 0, 0, 0, 1], atol=1e-9)
    impacts = path.of_kind(EventKind.IMPACT)
    assert [(e.bodies, e.contact) for e in impacts] == [((i, i + 1), "row.gap") for i in range(4)]
    # They travel 0.11, and then 0.01 from one to the next.
    assert np.allclose([e.time for e in impacts], 0.11 + 0.01 * np.arange(4), atol=1e-9)
    one = ContactFamily({"gap": Z2 - Z1 - 1}, reach=1.0, restitution=1.0)
    same = System(WALLS, VZ**2 / 2, count=count, between=one)
    other = simulate(same, same.state(start, moving), 0.4, 1e-3, solver=path.solver)
    assert abs(path.q - other.q).max() < 1e-9


def test_stop_of_a_hinge_acts_as_a_wall_of_one_body():
    pivot = {"x": end(X, Y, A, -1)[0], "y": end(X, Y, A, -1)[1]}
    wall = Polyhedron(LINK, {"stop": A + 0.3, **FAR}, equations=pivot)
    one = System(wall, ROD, G * Y, restitution={"stop": 0.5})
    stop = Tie(0, "hinge", UPPER, limits={"stop": A1 + 0.3}, restitution=0.5)
    tied = System(Polyhedron(LINK, FAR), ROD, G * Y, ties=[stop])
    start = hanging([1.0])[0]
    path = simulate(tied, tied.state(start), 2.5, 1e-3)
    same = simulate(one, one.state(start), 2.5, 1e-3)
    assert abs(path.q - same.q).max() < 1e-7
    kinds = [(e.kind, e.contact.replace("hinge.", "")) for e in path.events]
    assert kinds == [(e.kind, e.contact) for e in same.events]
    assert len(path.of_kind(EventKind.IMPACT)) > 1
    assert path.dissipated["impact"][-1] == pytest.approx(same.dissipated["impact"][-1], rel=1e-6)


def test_friction_of_a_hinge_stops_it_and_holds():
    # tau = 0.1, I = 1 / 3 about the end: it stops after w I / tau, at half of that angle.
    brake = Friction("brake", [O1], Interval(0.1), load=1, kind="braking")
    hinge = Tie(0, "hinge", UPPER, friction=[brake])
    system = System(Polyhedron(LINK, FAR), ROD, 0, ties=[hinge])
    start = system.state(hanging([0.0])[0], [0.3, 0, 0.6])
    path = simulate(system, start, 3.0, 1e-3)
    assert path.q[-1, 0, 2] == pytest.approx(0.6 * (0.6 / 3 / 0.1) / 2, abs=1e-3)
    assert abs(path.v[-1]).max() < 1e-7
    assert path.dissipated["braking"][-1] == pytest.approx(0.36 / 6, rel=1e-4)


def test_friction_of_a_slider_is_loaded_by_its_rail():
    (_, y1), _ = pair_coordinates(PLANE)
    (u1, _), _ = pair_velocities(PLANE)
    (x, y), (vx, vy) = PLANE.symbols, velocities(PLANE)
    rub = Friction("rub", [u1], Interval(0.3), load="height", dynamic=Interval(0.2))
    rail = Tie(0, "rail", {"height": y1}, friction=[rub])
    system = System(Polyhedron(PLANE, {"far": x + 900}), (vx**2 + vy**2) / 2, G * y, ties=[rail])
    path = simulate(system, system.state([0, 0], [1, 0]), 1.0, 1e-3)
    assert path.q[-1, 0, 0] == pytest.approx(1 / (2 * 0.2 * G), rel=1e-3)
    assert forces(path) == [((0,), "rail.height", pytest.approx(G))]
    assert path.dissipated["sliding"][-1] == pytest.approx(0.5, rel=1e-9)


def ladder(mu, angle):
    """Return two rods that lean on each other, hinged at the top, on a floor with friction."""
    foot = [Y - sp.cos(A) / 2, VX + VA * sp.cos(A) / 2]  # of a rod from its upper end
    rub = Friction("rub", [foot[1]], Interval(mu), load="foot")
    top = {
        "x": end(X2, Y2, A2, -1)[0] - end(X1, Y1, A1, -1)[0],
        "y": end(X2, Y2, A2, -1)[1] - end(X1, Y1, A1, -1)[1],
    }
    ties = [Tie((0, 1), "top", top)]
    floor = Polyhedron(LINK, {"foot": foot[0]})
    system = System(floor, ROD, G * Y, friction=[rub], count=2, ties=ties)
    s, c = math.sin(angle) / 2, math.cos(angle) / 2
    return system, system.state([[s, c, angle], [-s, c, -angle]])


@pytest.mark.parametrize(("share", "stands"), [(1.02, True), (0.98, False)])
def test_ladder_stands_if_friction_exceeds_half_the_tangent(share, stands):
    angle = 0.5
    system, start = ladder(share * math.tan(angle) / 2, angle)
    path = simulate(system, start, 0.5, 1e-3)
    fallen = abs(path.q[-1] - path.q[0]).max()
    assert fallen < 1e-9 if stands else fallen > 0.01
    if stands:
        held = {(bodies, name): force for bodies, name, force in forces(path)}
        assert held[(0,), "foot"] == pytest.approx(G, rel=1e-6)
        assert abs(held[(0, 1), "top.x"]) == pytest.approx(G * math.tan(angle) / 2, rel=1e-6)
    else:
        assert path.audit < 1e-3


def test_equations_of_bodies_and_of_ties_hold_together():
    # Two beads on a parabola, joined by a rod of length 1.
    (x, y), (vx, vy) = PLANE.symbols, velocities(PLANE)
    (x1, y1), (x2, y2) = pair_coordinates(PLANE)
    rail = {"rail": y - x**2 / 2}
    rod = Tie((0, 1), "rod", {"length": ((x2 - x1) ** 2 + (y2 - y1) ** 2 - 1) / 2})
    floor = Polyhedron(PLANE, {"far": y + 900}, equations=rail)
    tied = System(floor, (vx**2 + vy**2) / 2, G * y, count=2, ties=[rod])
    space = Manifold.euclidean("x y z w idle")
    (a, b, c, d, _), speeds = space.symbols, velocities(space)
    equations = {"one": b - a**2 / 2, "two": d - c**2 / 2}
    equations["rod"] = ((c - a) ** 2 + (d - b) ** 2 - 1) / 2
    walls = Polyhedron(space, {"far": b + 900}, equations=equations)
    one = System(walls, sum(s**2 for s in speeds) / 2, G * (b + d))
    far = brentq(lambda s: (s - 0.3) ** 2 + (s**2 / 2 - 0.045) ** 2 - 1, 0.3, 2)
    start = np.array([[0.3, 0.045], [far, far**2 / 2]])
    path = simulate(tied, tied.state(start), 2.0, 1e-3, solver=TIGHT)
    same = simulate(one, one.state([*start.ravel(), 0]), 2.0, 1e-3, solver=TIGHT)
    assert abs(path.q.reshape(len(path), 4) - same.q[:, 0, :4]).max() < 1e-8


# ------------------------------------------------------------------------------ many, files, words


def discs(collide):
    """Return discs of radius 1 of which the first two are tied closer than they could touch."""
    (x, y), (vx, vy) = PLANE.symbols, velocities(PLANE)
    (x1, y1), (x2, y2) = pair_coordinates(PLANE)
    apart = sp.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2)
    near = Tie((0, 1), "rod", {"length": apart - 1}, collide=collide)
    between = ContactFamily({"discs": apart - 2}, reach=2.0, restitution=0.2)
    walls = Polyhedron(PLANE, {"floor": y - 1, "left": x + 3, "right": 3 - x})
    return System(
        walls, (vx**2 + vy**2) / 2, G * y, count=5, between=between, ties=[near], restitution=0.1
    )


PLACES = [[-0.5, 4], [0.5, 4], [-1.2, 1.2], [1.2, 1], [0.1, 7]]


def test_tied_bodies_do_not_touch_unless_asked():
    system = discs(collide=False)
    path = simulate(system, system.state(PLACES), 1.5, 1e-3)
    met = {bodies for some in path.touching for bodies, name, _ in some if name == "discs"}
    assert (0, 1) not in met
    assert met
    lengths = np.linalg.norm(path.q[:, 1] - path.q[:, 0], axis=1)
    assert abs(lengths - 1).max() < 1e-4
    with pytest.raises(ValueError, match="bodies 0 and 1 overlap"):
        discs(collide=True).state(PLACES)


def test_motion_does_not_depend_on_threads_or_interruptions(tmp_path):
    system = discs(collide=False)
    start = system.state(PLACES)
    whole = simulate(system, start, 0.4, 1e-3, every=100, solver=Solver(tolerance=1e-6))
    shared = simulate(system, start, 0.4, 1e-3, every=100, solver=Solver(tolerance=1e-6, threads=2))
    assert np.array_equal(whole.q, shared.q)
    assert whole.touching == shared.touching
    checkpoint = Checkpoint(tmp_path / "run", seconds=0)

    def stop(now, _end, _unit):
        if now > 0.15:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(
            system,
            start,
            0.4,
            1e-3,
            every=100,
            solver=Solver(tolerance=1e-6),
            checkpoint=checkpoint,
            progress=stop,
        )
    resumed = simulate(
        system, start, 0.4, 1e-3, every=100, solver=Solver(tolerance=1e-6), checkpoint=checkpoint
    )
    assert np.array_equal(whole.q, resumed.q)
    assert whole.touching == resumed.touching
    assert whole.events == resumed.events


def test_trajectories_are_read_back_for_the_same_ties_only(tmp_path):
    system = rods(2)
    path = simulate(system, system.state(hanging([0.4, 0.1])), 0.02, 1e-3)
    file = save_trajectory(path, tmp_path / "rods.nc")
    again = load_trajectory(file, system)
    assert np.array_equal(path.q, again.q)
    assert path.touching == again.touching
    other = replace(system, ties=[*system.ties[:-1], replace(system.ties[-1], name="axle")])
    with pytest.raises(ValueError, match="ties"):
        load_trajectory(file, other)


def test_ties_of_the_same_formulas_are_compiled_once():
    assert len(rods(30).bodies.ties.forms) == 2
    assert len(springs(30).bodies.ties.forms) == 3


def test_loops_of_joints_are_known():
    hook = {"x": end(X1, Y1, A1, 1)[0]}
    for more, closed in (([], False), ([Tie(3, "hook", hook)], True)):
        (found,) = rods(4, ties=more).bodies.ties.components
        assert (found.bodies, found.closed) == ((0, 1, 2, 3), closed)
    spring = Tie(3, "spring", potential=X1**2)
    assert not rods(4, ties=[spring]).bodies.ties.components[0].closed
    assert len(springs(3).bodies.ties.components) == 1


SWING = 0.3 + 0.2 * sp.sin(2 * time_symbol())


def assembled(system):
    """Return the same bodies as the only kind of an assembly."""
    alone = replace(system, count=1, ties=())
    return Assembly({"rod": alone}, {"rod": system.count}, ties=system.ties)


@pytest.mark.parametrize("form", [lambda system: system, assembled])
def test_tied_rods_that_follow_the_time_each_by_itself(form):
    """The torques are those of Lagrange's equations for the two angles."""
    now, t_end = time_symbol(), 1.0
    angles, rates = sp.symbols("p q", real=True), sp.symbols("u w", real=True)
    kinetic = potential = x = y = sp.S.Zero
    for p, u in zip(angles, rates, strict=True):
        middle = x + sp.sin(p) / 2, y - sp.cos(p) / 2
        moving = [
            sum(sp.diff(c, a) * w for a, w in zip(angles, rates, strict=True)) for c in middle
        ]
        kinetic += (sum(s**2 for s in moving) + u**2 / 12) / 2
        potential += G * middle[1]
        x, y = x + sp.sin(p), y - sp.cos(p)
    given = dict.fromkeys(angles, SWING) | dict.fromkeys(rates, sp.diff(SWING, now))
    torques = [
        float(
            (
                sp.diff(sp.diff(kinetic, u).subs(given), now)
                - sp.diff(kinetic - potential, p).subs(given)
            ).subs(now, t_end)
        )
        for p, u in zip(angles, rates, strict=True)
    ]
    energy = sp.lambdify(now, (kinetic + potential).subs(given))

    system = form(rods(2, rheonomic={"turn": A - SWING}))
    q, rate = hanging([0.3, 0.3]), 0.4
    way = 0.5 * rate * np.array([math.cos(0.3), math.sin(0.3)])
    v = np.column_stack([np.outer([1, 3], way), [rate, rate]])
    start = (q, v) if form is not assembled else ({"rod": q}, {"rod": v})
    path = simulate(system, system.state(*start), t_end, 1e-3, solver=TIGHT)
    turned = path.q.reshape(-1, 2, 3)[:, :, 2]
    followed = sp.lambdify(now, SWING)(path.times)
    np.testing.assert_allclose(turned, np.column_stack([followed] * 2), atol=1e-6)
    gained = energy(t_end) - energy(0.0)
    assert path.work["drive"][-1] == pytest.approx(gained, rel=1e-4)
    found = {bodies: force for bodies, name, force in path.touching[-1] if name == "turn"}
    # That of the last step is at its midpoint; the upper one bears what the lower one needs.
    assert [found[0,], found[1,]] == pytest.approx(torques, rel=5e-3)
    assert system.largest_step(path.last)[0] > 100  # nothing is left to swing
    assert path.effort.islands < 3 * path.effort.steps


MISTAKES = [
    (lambda: Tie((0, 0), "t"), "bodies: expected one body, or two different ones"),
    (lambda: Tie((0, 1, 2), "t"), "bodies: expected one body, or two different ones"),
    (lambda: Tie(0, "t", {"h": X1}, limits={"h": X1}), "limits: expected names other than"),
    (lambda: Tie(0, "t", limits={"f": X1}, restitution=2), "restitution: expected"),
    (lambda: Tie(0, "t", restitution={"f": 1}), "restitution: "),
    (
        lambda: Tie(0, "t", friction=[Friction("f", [O1], Interval(0.1), load="h")]),
        "load: expected one of the limits and equations",
    ),
    (lambda: rods(2, ties=[Tie((1, 2), "t", LOWER)]), "bodies: expected numbers of 2 bodies"),
    (lambda: rods(2, ties=[Tie(1, "t", LOWER)]), "equations: expected a formula in .*'t'"),
    (lambda: rods(2, ties=[Tie(1, "t", limits={"f": O1})]), "limits: expected a formula in"),
    (lambda: rods(2, ties=[Tie(1, "t", potential=time_symbol())]), "potential: expected a formula"),
    (lambda: rods(2, ties=[Tie(1, "t", forces={"x2": 1})]), "forces: "),
    (lambda: rods(2, exits={"x": 3.0}), "exits: expected none"),
    (
        lambda: rods(2, rheonomic={"h": A - time_symbol()}).state(hanging([0.1, 0.1])),
        "q: expected equation 'h' of body 0 to hold at the time 0; its value is 0.1",
    ),
    (
        lambda: rods(1, rheonomic={"h": A - time_symbol()}).state(hanging([0.0])),
        "v: expected velocities that follow equation 'h'",
    ),
    (lambda: rods(2).state([[1, 0, 0], [2, 0, 0]]), "q: expected equation 'hook.x' of body 0"),
    (
        lambda: rods(2).state(hanging([0.2, 0.1]), [[0, 0, 1], [0, 0, 1]]),
        "v: expected velocities at which equation 'hook.x' of body 0",
    ),
    (
        lambda: rods(1, ties=[Tie(0, "t", limits={"f": A1 - 1})]).state(hanging([0.0])),
        "q: expected limit 't.f' of body 0 not to be passed; its value is -1",
    ),
]


@pytest.mark.parametrize(("call", "words"), MISTAKES)
def test_mistakes_are_told(call, words):
    with pytest.raises((ValueError, TypeError), match=words):
        call()


def test_crowds_are_not_tied():
    system = discs(collide=False)
    with pytest.raises(NotImplementedError, match="crowd_sweeps=0 for bodies with ties"):
        simulate(system, system.state(PLACES), 0.1, 1e-3, solver=Solver(crowd_sweeps=20))
