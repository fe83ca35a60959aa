"""Impacts are where the bodies are: oracles are straight lines, circles and parabolas."""

import math
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch, scatter
from polycorner.motion import ContactFamily, EventKind, Noise, Solver, pair_coordinates, simulate

G = 9.81
PLANE, LINE = Manifold.euclidean("x y"), Manifold.euclidean("s")
X, Y = PLANE.symbols
VX, VY = velocities(PLANE)
(S,), (VS,) = LINE.symbols, velocities(LINE)
FREE = (VX**2 + VY**2) / 2
CLOSE = 1e-6  # lengths, in a world whose unit is 1


def flight(gap, start, velocity, duration, dt, restitution=0.0, **given):
    system = System(Polyhedron(PLANE, {"gap": gap}), FREE, restitution=restitution)
    return simulate(system, system.state(start, velocity), duration, dt, **given)


def chord(centre, radius, start, velocity):
    """When a straight flight meets a circle from outside, or None."""
    d, v = np.subtract(start, centre), np.array(velocity)
    a, b, c = v @ v, d @ v, d @ d - radius**2
    if b >= 0 or b * b <= a * c:
        return None
    return (-b - math.sqrt(b * b - a * c)) / a


@given(
    st.floats(0.02, 1.0),
    st.floats(-1.5, 1.5),
    st.floats(0.1, 50.0),
    st.floats(1e-3, 3.0),
    st.sampled_from([0.0, 0.4, 1.0]),
)
@example(1.0, 0.0, 1.0, 0.5, 0.0)  # touches in the middle of a step, and again a step later
@example(1.0, 0.0, 1.0, 0.5, 0.4)
@example(1.0, 0.0, 1.0, 0.5, 1.0)
def test_a_particle_meets_a_pin_or_flies_past(radius, height, speed, dt, e):
    """It is deflected if and only if it touches: where, when and into which direction."""
    start, velocity = np.array([-2.0, height]), np.array([speed, 0.0])
    duration = 4.0 / speed
    if abs(abs(height) - radius) < 1e-4:
        return
    path = flight(sp.sqrt(X**2 + Y**2) - radius, start, velocity, duration, dt * duration, e)
    met = chord((0, 0), radius, start, velocity)
    if met is None:
        assert not path.events
        np.testing.assert_array_equal(path.v[-1, 0], velocity)
        np.testing.assert_allclose(path.q[-1, 0], start + duration * velocity, rtol=1e-12)
        return
    place = start + met * velocity
    normal = place / radius
    after = velocity - (1 + e) * (velocity @ normal) * normal
    assert path.events[0].time == pytest.approx(met, abs=CLOSE * duration)
    sharp = CLOSE * (1 + 1 / math.sqrt(1 - (height / radius) ** 2)) / radius
    np.testing.assert_allclose(path.v[-1, 0], after, atol=10 * sharp * speed)
    np.testing.assert_allclose(
        path.q[-1, 0], place + (duration - met) * after, atol=10 * sharp * speed * duration
    )
    assert path.audit < 1e-10


@pytest.mark.parametrize("dt", [2.0, 0.3, 0.01])
@pytest.mark.parametrize("start", [(0.3, 0.1), (-0.7, 0.2)])
def test_a_particle_stays_in_a_ring_and_keeps_its_angular_momentum(start, dt):
    ring = 1 - sp.sqrt(X**2 + Y**2)
    path = flight(ring, start, (0.5, 7.0), 10.0, dt, 1.0)
    momentum = path.q[:, 0, 0] * path.v[:, 0, 1] - path.q[:, 0, 1] * path.v[:, 0, 0]
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-9)
    chord = 2 * math.sqrt(1 - (momentum[0] / math.hypot(0.5, 7)) ** 2)
    times = [event.time for event in path.of_kind(EventKind.IMPACT)]
    np.testing.assert_allclose(np.diff(times), chord / math.hypot(0.5, 7.0), atol=1e-6)
    assert path.max_penetration < CLOSE


@pytest.mark.parametrize("dt", [5.0, 0.1, 0.01])
def test_no_wall_is_thin_enough_to_pass_through(dt):
    path = flight(X**2 - 1e-4, (-1.0, 0.0), (300.0, 1.0), 1.0, dt, 0.5)
    assert path.v[-1, 0].tolist() == pytest.approx([-150.0, 1.0], rel=1e-6)


@pytest.mark.parametrize("dt", [0.05, 0.01, 1e-3])
def test_a_particle_between_two_walls_and_a_disc_keeps_its_energy(dt):
    """A dispersing billiard: all impacts are seen, whatever the step."""
    walls = {"left": X, "right": 1 - X, "bottom": Y, "top": 1 - Y}
    disc = sp.sqrt((X - sp.Rational(1, 2)) ** 2 + (Y - sp.Rational(1, 2)) ** 2) - 0.25
    table = System(Polyhedron(PLANE, {**walls, "disc": disc}), FREE, restitution=1.0)
    path = simulate(table, table.state([0.1, 0.17], [0.8, 0.6]), 500.0, dt)
    np.testing.assert_allclose(path.kinetic, 0.5, rtol=1e-11)
    # mean free path pi A / P of a plane billiard
    count = len(path.of_kind(EventKind.IMPACT))
    free = math.pi * (1 - math.pi / 16) / (4 + math.pi / 2)
    assert count == pytest.approx(500 / free, rel=0.1)


def test_bounces_under_a_force_that_is_not_constant_are_of_second_order():
    """An oscillator with drag over a floor, against an integration with events."""

    def hit(_, z):
        return z[0] + 0.3

    hit.terminal, hit.direction = True, -1
    t, z, expected = 0.0, [1.0, 0.0], []
    while t < 12:
        run = solve_ivp(
            lambda _, z: [z[1], -z[0] - z[1] / 5], (t, 12), z, events=hit, rtol=1e-11, atol=1e-12
        )
        t = run.t[-1]
        if run.status == 1:
            expected.append(t)
            z = [-0.3, -0.8 * run.y[1, -1]]
    floor = Polyhedron(LINE, {"floor": S + sp.Rational(3, 10)})
    system = System(floor, VS**2 / 2, S**2 / 2, {"s": -VS / 5}, restitution=0.8)
    errors = []
    for dt in (0.1, 0.05, 0.025, 0.0125):
        path = simulate(system, system.state([1.0]), 12.0, dt)
        times = [event.time for event in path.of_kind(EventKind.IMPACT)]
        errors.append([np.max(np.abs(np.subtract(times, expected)))])
    order = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((order > 1.7) & (order < 2.4)), errors


def test_a_bead_leaves_a_dome_when_the_force_vanishes():
    """At two thirds of its height; told to second order."""
    dome = System(Polyhedron(PLANE, {"dome": sp.sqrt(X**2 + Y**2) - 1}), FREE, G * Y)
    top = 0.1
    leave = math.acos(2 / 3 * math.cos(top))

    def rate(u):
        return 2 * u / math.sqrt(2 * G * (math.cos(top) - math.cos(top + u * u)))

    exact = quad(rate, 0, math.sqrt(leave - top))[0]
    late = []
    for dt in (2e-2, 1e-2, 5e-3, 2.5e-3):
        path = simulate(dome, dome.state([math.sin(top), math.cos(top)]), exact + 0.1, dt)
        (lost,) = path.of_kind(EventKind.LOST)
        late.append(abs(lost.time - exact))
    assert late[0] < 2e-3
    assert all(fine < coarse / 2.5 for coarse, fine in pairwise(late)), late


@pytest.mark.parametrize("gap", [1e-3, 0.1])
@pytest.mark.parametrize("dt", [1.0, 0.1, 0.01])
def test_the_last_ball_of_a_cradle_with_gaps_takes_all(gap, dt):
    (a,), (b,) = pair_coordinates(LINE)
    balls = ContactFamily({"gap": sp.sqrt((b - a) ** 2) - 1}, reach=1.0, restitution=1.0)
    row = System(Polyhedron(LINE, {"far": S + 100}), VS**2 / 2, count=5, between=balls)
    places = [[-1.5], *([i * (1 + gap)] for i in range(4))]
    path = simulate(row, row.state(places, [[1.0], [0.0], [0.0], [0.0], [0.0]]), 3.0, dt)
    assert path.v[-1].ravel().tolist() == pytest.approx([0, 0, 0, 0, 1], abs=1e-9)
    impacts = [(event.bodies, event.time) for event in path.of_kind(EventKind.IMPACT)]
    assert [bodies for bodies, _ in impacts] == [(0, 1), (1, 2), (2, 3), (3, 4)]
    assert [t for _, t in impacts] == pytest.approx([0.5 + i * gap for i in range(4)], abs=CLOSE)
    assert path.q[-1, 4, 0] == pytest.approx(3 * (1 + gap) + 3 - 0.5 - 3 * gap, abs=CLOSE)


def test_other_bodies_do_not_change_the_parts_of_a_step():
    (x1, y1), (x2, y2) = pair_coordinates(PLANE)
    apart = ContactFamily({"gap": sp.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2) - 1}, reach=1.0)
    floor = Polyhedron(PLANE, {"floor": Y})
    one = System(floor, FREE, G * Y, restitution=0.6)
    many = System(floor, FREE, G * Y, restitution=0.6, count=4, between=apart)
    places = np.array([[3.0 * i, 0.4 + 0.13 * i] for i in range(4)])
    alone = simulate(one, one.state(places[2]), 3.0, 0.02, every=1)
    together = simulate(many, many.state(places), 3.0, 0.02, every=1)
    np.testing.assert_array_equal(alone.q[:, 0], together.q[:, 2])


def test_a_run_that_does_not_refine_is_the_plain_method():
    """A pin is felt from half a step ahead, and a thin one is passed through."""
    pin = sp.sqrt(X**2 + Y**2) - sp.Rational(1, 20)
    plain = Solver(refine=False)
    near = flight(pin, (-0.59, 0.06), (1.0, 0.0), 1.0, 0.1, 1.0, solver=plain)
    assert near.v[-1, 0, 1] != 0
    through = flight(pin, (-1.0, 0.0), (10.0, 0.0), 1.0, 0.4, solver=plain)
    assert through.v[-1, 0].tolist() == [10.0, 0.0]
    with pytest.raises(TypeError, match="refine: expected a bool; got int"):
        Solver(refine=1)


def test_kicked_bodies_bounce_where_they_are():
    floor = System(Polyhedron(PLANE, {"floor": Y}), FREE, G * Y, restitution=0.5)
    noise = Noise(kicks={"x": 0.1, "y": 0.1}, seed=3)
    path = simulate(floor, floor.state([0.0, 1.0]), 5.0, 1e-2, noise=noise)
    assert path.max_penetration < 1e-3
    assert path.of_kind(EventKind.IMPACT)
    assert path.audit < 1e-10


def test_what_is_not_solved_is_an_event():
    """A tolerance below rounding cannot be met."""
    drum = DumbbellDrum(count=5, floor=True)
    state, strict = drum.state(bunch(drum, np.random.default_rng(3))), Solver(tolerance=1e-19)
    path = simulate(drum, state, 0.05, 1e-3, noise=Noise(chatter=0.3), solver=strict)
    failed = path.of_kind(EventKind.FAILED)
    assert len(failed) == path.effort.unconverged > 0
    assert not path.converged
    assert {event.contact for event in failed} <= {*drum.bodies.contact_names, ""}
    assert all(set(event.bodies) <= set(range(5)) and event.bodies for event in failed)


def test_a_step_of_more_events_than_there_is_room_for_is_taken_up_where_it_was_left():
    """Thousands of bounces within one step."""
    walls = {"left": S, "right": sp.Rational(1, 100) - S}
    box = System(Polyhedron(LINE, walls), VS**2 / 2, restitution=1.0)
    path = simulate(box, box.state([0.0025], [1.0]), 100.0, 100.0)
    times = [event.time for event in path.of_kind(EventKind.IMPACT)]
    expected = 0.0075 + 0.01 * np.arange(10_000)
    # an impact takes 1e-9 of the step
    np.testing.assert_allclose(times, expected, atol=1.1e-7 * len(times))
    assert path.effort.unconverged == 0


def test_bodies_in_parts_do_not_touch_those_that_are_not():
    """A heap slides: parts of a step book no work, and tell no events, of contacts of others."""
    drum = DumbbellDrum(
        length=16, ball_radius=3, rod_radius=1.5, drum_radius=125, count=60, floor=True
    )
    for seed in (1, 3):
        start = scatter(drum, np.random.default_rng(seed), width=0.35, height=240.0, tries=1000)
        path = simulate(drum, drum.state(start), 0.2, 1e-3)
        assert path.effort.parts > 0
        assert path.max_penetration < 1e-3
        assert path.audit < 1e-4
