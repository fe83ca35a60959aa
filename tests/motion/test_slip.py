"""Slip whose direction turns, and sticking where slip turns with the place, are of second order.

What sticks does no work.  The oracles are closed forms, or much shorter steps.
"""

import math
from functools import cache

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipj

from polycorner import Manifold, Polyhedron
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.motion import angular_velocity, rotational_energy
from polycorner.motion.assembly import Assembly
from polycorner.motion.contacts import (
    ContactFamily,
    Friction,
    PairFriction,
    pair_coordinates,
    pair_velocities,
    velocities,
)
from polycorner.motion.friction import Disc, Ellipse, Interval
from polycorner.motion.mechanics import State
from polycorner.motion.simulation import simulate, step
from polycorner.motion.system import System

G, HALVINGS = 9.81, 4
NO_WORK = 1e-12  # of an energy of about 1: rounding


def errors(error, steps, t_end):
    """Return errors with so many steps, and with twice as many, four halvings on."""
    return [error(t_end / (steps * 2**n)) for n in range(HALVINGS + 1)]


def orders(found):
    return np.diff(-np.log2(found))


def end(system, state, t_end, dt):
    path = simulate(system, state, t_end, dt, every=10**6)
    assert path.converged
    return path


def last(path):
    return np.concatenate([path.q[-1].ravel(), path.v[-1].ravel()])


def booked(path):
    return sum(float(work[-1]) for work in path.dissipated.values())


def against_shorter(system, state, t_end, steps, rows=slice(None)):
    """Return errors, measured from steps an eighth as long as the shortest."""
    fine = last(end(system, state, t_end, t_end / (steps * 2 ** (HALVINGS + 3))))
    return errors(
        lambda dt: abs(last(end(system, state, t_end, dt)) - fine)[rows].max(), steps, t_end
    )


# ------------------------------------------------------------------------------ a puck on a slope


def puck(shape):
    """Return a puck of mass 1 on a slope that falls along x."""
    M = Manifold.euclidean("x y")
    (x, _), v = M.symbols, velocities(M)
    rub = Friction("rub", v, shape, load=sp.Float(G * math.cos(SLOPE)))
    kinetic = (v[0] ** 2 + v[1] ** 2) / 2
    return System(Polyhedron(M), kinetic, -G * math.sin(SLOPE) * x, friction=(rub,))


SLOPE = 0.5


def speed_of_puck(v, t):
    """Speed and direction at the angle of friction, of a puck thrown across with the speed ``v``.

    ``dv/dt = a (cos p - 1)`` and ``v dp/dt = -a sin p`` with ``a = g sin(slope)`` leave
    ``v (1 + cos p)`` as it is; with ``u = tan(p / 2)`` the time is
    ``v / (2 a) (log(1 / u) + (1 - u^2) / 2)``.
    """
    a = G * math.sin(SLOPE)
    u = brentq(lambda u: v / (2 * a) * (-math.log(u) + (1 - u * u) / 2) - t, 1e-9, 1.0, xtol=1e-15)
    direction = 2 * math.atan(u)
    size = v / (1 + math.cos(direction))
    return size * np.array([math.cos(direction), math.sin(direction)])


def test_a_puck_thrown_across_a_slope_turns_with_second_order():
    system, t_end = puck(Disc(math.tan(SLOPE))), 1.0
    exact = speed_of_puck(2.0, t_end)
    state = system.state([0, 0], [0, 2.0])

    def error(dt):
        return np.linalg.norm(end(system, state, t_end, dt).v[-1, 0] - exact)

    found = errors(error, 50, t_end)
    assert orders(found) == pytest.approx(2, abs=0.1)
    assert found[0] < 1e-3


def test_so_it_is_with_friction_that_depends_on_the_direction():
    system = puck(Ellipse(0.5, 0.3))
    found = against_shorter(system, system.state([0, 0], [-1.0, 2.0]), 0.5, 25)
    assert orders(found) == pytest.approx(2, abs=0.2)


def test_a_puck_that_stops_stays():
    """Where its slip vanishes it is stopped, not sent back."""
    system = puck(Disc(2 * math.tan(SLOPE)))
    path = simulate(system, system.state([0, 0], [0.3, 0.2]), 0.5, 1e-3)
    assert not path.v[-1].any()


# --------------------------------------------------------------------------- a ball on a wall

SPACE = Manifold.euclidean("x y z") * Manifold.rotation("a")
INERTIA, RADIUS, RATE = 0.4, 0.5, 6.0  # of the ball, over m r^2; m; rad/s about the axis


@cache
def ball_in(opening, mu):
    """Return a ball whose centre stays at ``1 + z tan(opening)`` from a vertical axis."""
    x, y, z = SPACE.symbols[:3]
    v, w = sp.Matrix(velocities(SPACE)[:3]), angular_velocity(SPACE, frame="space")
    rho = sp.sqrt(x**2 + y**2)
    out = sp.Matrix([x / rho, y / rho, 0]) * math.cos(opening)
    out -= sp.Matrix([0, 0, math.sin(opening)])
    across = sp.Matrix([-y / rho, x / rho, 0])
    slip = v + w.cross(RADIUS * out)
    wall = (1 - rho) * math.cos(opening) + z * math.sin(opening)
    rub = Friction("rub", (slip.dot(across), slip.dot(across.cross(out))), Disc(mu), load="wall")
    kinetic = v.dot(v) / 2 + rotational_energy(SPACE, [INERTIA * RADIUS**2] * 3)
    on_wall = Polyhedron(SPACE, {}, equations={"wall": wall})
    return System(on_wall, kinetic, G * z, friction=(rub,))


def thrown_ball(system, rise=0.5, slip=0.0, opening=0.0):
    """Return a ball that rolls around the axis, and up, but for some slip around it."""
    along = np.array([math.sin(opening), 0.0, math.cos(opening)])
    spin = (np.array([0.0, rise, 0.0]) + (slip - RATE) * along) / RADIUS
    return system.state([1, 0, 0, 1, 0, 0, 0], [0, RATE, rise, 0, *spin / 2])


def test_a_ball_rolls_up_and_down_in_a_cylinder():
    """``(1 + k) z'' = -k W^2 (z - z_c)`` with ``k W^2 z_c = -g``: in a frequency of its own."""
    system, t_end = ball_in(0.0, 5.0), 2 * math.tau / RATE
    state, rate = thrown_ball(system), RATE * math.sqrt(INERTIA / (1 + INERTIA))
    centre = -G / (INERTIA * RATE**2)
    z = centre * (1 - math.cos(rate * t_end)) + 0.5 / rate * math.sin(rate * t_end)

    def error(dt):
        path = end(system, state, t_end, dt)
        assert abs(booked(path)) < NO_WORK
        return abs(path.q[-1, 0, 2] - z)

    found = errors(error, 100, t_end)
    assert orders(found) == pytest.approx(2, abs=0.2)
    assert found[-1] < 1e-4


def test_a_ball_that_slips_in_a_cylinder_loses_what_it_should():
    system = ball_in(0.0, 0.3)
    found = against_shorter(system, thrown_ball(system, slip=3.0), 2.0, 200)
    assert orders(found) == pytest.approx(2, abs=0.3)


def test_a_ball_that_slips_and_then_rolls_is_of_second_order_too():
    """It begins to roll somewhere in a step, whose error is of second order."""
    system, t_end, steps = ball_in(0.0, 0.6), 1.0, 100
    state = thrown_ball(system, slip=3.0)
    found = against_shorter(system, state, t_end, steps, slice(3))
    assert np.polyfit(np.arange(HALVINGS + 1), -np.log2(found), 1)[0] == pytest.approx(2, abs=0.3)
    early, late = (booked(end(system, state, t, 2e-3)) for t in (0.8, 1.0))
    assert late == pytest.approx(early, abs=NO_WORK)


def test_a_ball_rolls_in_a_cone():
    system = ball_in(0.4, 5.0)
    state = thrown_ball(system, rise=0.0, opening=0.4)
    assert abs(booked(end(system, state, 1.0, 1e-3))) < NO_WORK
    assert orders(against_shorter(system, state, 1.0, 200, slice(3))) == pytest.approx(2, abs=0.3)


# ------------------------------------------------------------------------------------- wheels

PLANE = Manifold.euclidean("x y turn")
WHEEL = 0.5  # moment of inertia over m r^2


def wheel_in_valley(mu, damping=0.0):
    """Return a wheel of radius 0.25 in a round valley, whose centre is on the unit circle."""
    (x, y, _), (vx, vy, w), r = PLANE.symbols, velocities(PLANE), 0.25
    rho = sp.sqrt(x**2 + y**2)
    slip = (x * vy - y * vx) / rho + r * w
    rub = Friction("rub", (slip,), Interval(mu), load="valley")
    kinetic = (vx**2 + vy**2) / 2 + WHEEL * r**2 * w**2 / 2
    forces = {"turn": -damping * w} if damping else {}
    return System(Polyhedron(PLANE, {"valley": 1 - rho}), kinetic, G * y, forces, friction=(rub,))


def test_a_wheel_swings_in_a_valley_like_a_longer_pendulum():
    """``(1 + k) a'' = -g sin a``, from the bottom with ``a' = 2 s sqrt(g / (1 + k))``."""
    system, t_end, rate, share = wheel_in_valley(5.0), 2.0, math.sqrt(G / (1 + WHEEL)), 0.3
    start = 2 * share * rate
    state = system.state([0, -1, 0], [start, 0, -start / 0.25])
    sine = share * ellipj(rate * t_end, share**2)[0]

    def error(dt):
        path = end(system, state, t_end, dt)
        assert abs(path.dissipated["sliding"][-1]) < 1e-9
        x, y = path.q[-1, 0, :2]
        return abs(math.atan2(x, -y) - 2 * math.asin(sine))

    assert orders(errors(error, 400, t_end)) == pytest.approx(2, abs=0.3)


def test_a_wheel_comes_to_rest_at_the_bottom():
    """What little slip is left of its motion does not go on for ever."""
    system = wheel_in_valley(5.0, damping=0.5)
    path = simulate(system, system.state([0, -1, 0], [1.0, 0, -4.0]), 20.0, 5e-3)
    assert abs(path.v[-1]).max() < 1e-9
    assert path.last.sticking.all()


def test_a_capsule_rocks_on_a_round_wall():
    """Its side, ``b`` from its axis, rolls on a circle of radius ``R``: so far as it is turned.

    The centre is at ``(R + b) n + R a t``, and ``a`` obeys
    ``(k + b^2 + R^2 a^2) a'' = -R^2 a a'^2 - g (R a cos a - b sin a)``, a swing of one angle.
    """
    (x, y, a), (vx, vy, w), R, b, k = PLANE.symbols, velocities(PLANE), 1.0, 0.1, 0.1
    gap = y * sp.cos(a) - x * sp.sin(a) - (R + b)
    rub = Friction("rub", (vx * sp.cos(a) + vy * sp.sin(a) + b * w,), Interval(5.0), load="wall")
    kinetic = (vx**2 + vy**2 + k * w**2) / 2
    system = System(Polyhedron(PLANE, {"wall": gap}), kinetic, G * y, friction=(rub,))
    t_end, tilt = 1.5, 0.3

    def swing(_, state):
        turn, rate = state
        pull = R**2 * turn * rate**2 + G * (R * turn * math.cos(turn) - b * math.sin(turn))
        return rate, -pull / (k + b**2 + R**2 * turn**2)

    exact = solve_ivp(swing, (0, t_end), (tilt, 0.0), rtol=1e-12, atol=1e-12).y[0, -1]
    sine, cosine = math.sin(tilt), math.cos(tilt)
    start = [R * tilt * cosine - (R + b) * sine, (R + b) * cosine + R * tilt * sine, tilt]
    state = system.state(start)

    def error(dt):
        path = end(system, state, t_end, dt)
        assert abs(path.dissipated["sliding"][-1]) < 1e-8
        return abs(path.q[-1, 0, 2] - exact)

    assert orders(errors(error, 800, t_end)) == pytest.approx(2, abs=0.3)


def pair_of_wheels(kinds):
    """Return two wheels pressed against each other by springs to the origin, of one kind or two."""
    (x, y, _), (vx, vy, w) = PLANE.symbols, velocities(PLANE)
    (x1, y1, _), (x2, y2, _) = pair_coordinates(PLANE, PLANE)
    (a1, b1, w1), (a2, b2, w2) = pair_velocities(PLANE, PLANE)
    far, radius = sp.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2), 0.5
    slip = ((b1 - b2) * (x2 - x1) - (a1 - a2) * (y2 - y1)) / far + radius * (w1 + w2)
    between = ContactFamily(
        {"touch": far - 2 * radius},
        2 * radius,
        friction=(PairFriction({"touch": (slip,)}, Interval(9.0)),),
    )
    kinetic = (vx**2 + vy**2) / 2 + WHEEL * radius**2 * w**2 / 2
    potential = (30 * x**2 + 25 * y**2) / 2
    if not kinds:
        return System(Polyhedron(PLANE), kinetic, potential, count=2, between=between)
    one = System(Polyhedron(PLANE), kinetic, potential)
    other = System(Polyhedron(PLANE), 2 * kinetic, potential)
    return Assembly(
        {"one": one, "other": other}, {"one": 1, "other": 1}, {("one", "other"): between}
    )


@pytest.mark.parametrize("kinds", [False, True])
def test_wheels_roll_on_each_other(kinds):
    system = pair_of_wheels(kinds)
    q, v = [[-0.5, 0, 0], [0.5, 0, 0]], [[0.1, -1.0, 4.3], [0.1, 1.0, -0.3]]
    if kinds:
        q, v = ({"one": [rows[0]], "other": [rows[1]]} for rows in (q, v))
    state = system.state(q, v)
    found = against_shorter(system, state, 2.0, 1000)
    assert np.polyfit(np.arange(HALVINGS + 1), -np.log2(found), 1)[0] == pytest.approx(2, abs=0.3)
    path = end(system, state, 2.0, 2.5e-4)
    assert abs(path.dissipated["rubbing"][-1]) < 1e-9


# ----------------------------------------------------------------------- how sticking begins


def test_slip_where_a_contact_sticks_at_the_start_is_stopped_at_once():
    """It would go on with alternating sign: the mean of two steps sticks, and neither does."""
    system = ball_in(0.0, 5.0)
    rolls = thrown_ball(system)
    v = rolls.v.copy()
    v[2] += 0.1
    state = State(0.0, rolls.q, v, np.array([True]))
    for _ in range(3):
        state = step(system, state, 1e-3)
        law = system.formulation
        slips, _ = law.slip_velocities(system.parameters, np.concatenate([state.q, state.v])[None])
        assert abs(slips).max() < 1e-3 * 0.1


def test_a_dumbbell_slides_around_a_drum_with_second_order():
    drum = DumbbellDrum(count=1)
    state = drum.state([[0.3, 50.0, 0.4]], [[5.0, 100.0, 20.0, 100.0]])
    assert orders(against_shorter(drum, state, 0.05, 50)) == pytest.approx(2, abs=0.1)
