"""Textbook motions against their closed forms, and the order in the step with which they are met.

Smooth motion is of second order.  An impact, a stop and the onset of slip lie somewhere within a
step: what depends on them is of first order.
"""

import math

import numpy as np
import pytest
from scipy.special import ellipkinc

from polycorner.models import textbook as scenes
from polycorner.motion.events import EventKind
from polycorner.motion.friction import Disc, Ellipse, Interval
from polycorner.motion.noise import Solver
from polycorner.motion.simulation import simulate, start, step

G = scenes.GRAVITY
FALL = math.sqrt(2 / G)  # from a height of 1
FIRST, SECOND = (0.7, 1.3), (1.7, 2.3)
LOCATED = 1e-8  # s and m, of impacts: about the gap at which bodies touch, in units of length


def between(value, limits):
    return limits[0] < value < limits[1]


def observed_order(error, largest, levels=4, phases=5):
    """The power of the step with which an error vanishes, at ``levels`` halvings of the step.

    An event meets the grid at any phase: of several steps about as long the worst counts.
    """
    steps = largest / 2.0 ** np.arange(levels)
    worst = [max(abs(error(dt * (1 + 0.37 * k / phases))) for k in range(phases)) for dt in steps]
    return np.polyfit(np.log(steps), np.log(worst), 1)[0]


def times(system, state, t_end, dt, kind=EventKind.IMPACT):
    path = simulate(system, state, t_end, dt, every=10**6)
    assert path.converged
    return [event.time for event in path.of_kind(kind)]


def end(system, state, t_end, dt):
    return simulate(system, state, t_end, dt, every=10**6)


# ---------------------------------------------------------------------------------- bouncing ball


def test_a_ball_lands_when_it_has_fallen():
    ball = scenes.bouncing_ball()
    state = ball.state([1.0])
    for dt in (0.1, 0.05, 4e-3, 1e-3):
        assert times(ball, state, 0.6, dt)[0] == pytest.approx(FALL, abs=LOCATED)


def test_an_elastic_ball_keeps_its_period():
    ball = scenes.bouncing_ball(1.0)
    state = ball.state([1.0])

    for dt in (0.3, 0.1, 4e-3, 1e-3):
        impacts = times(ball, state, 6.0, dt)
        expected = FALL * np.arange(1, 2 * len(impacts), 2)
        np.testing.assert_allclose(impacts, expected, atol=LOCATED * len(impacts))


def test_an_elastic_ball_keeps_its_energy():
    """Exactly: an impact takes place at one height, and free fall is free of error."""
    ball = scenes.bouncing_ball(1.0)
    path = simulate(ball, ball.state([1.0]), 10.0, 1.3e-3)
    np.testing.assert_allclose(path.kinetic + path.potential, G, rtol=1e-12)
    assert abs(path.dissipated["impact"]).max() <= 1e-12 * G
    assert path.audit < 1e-12
    assert path.max_penetration < LOCATED


def test_a_ball_ends_its_infinitely_many_bounces_in_zenos_time():
    """It rests once it would bounce off no faster than it is brought back within a step."""
    e = 0.5
    ball = scenes.bouncing_ball(e)
    state = ball.state([1.0])

    def error(dt):
        return times(ball, state, 1.5, dt, EventKind.REST)[0] - FALL * (1 + e) / (1 - e)

    assert all(abs(error(dt)) < 5 * dt for dt in (2e-2, 2e-3, 2e-4))
    path = end(ball, state, 1.5, 1e-3)
    assert path.rests[-1].all()
    assert path.v[-1, 0, 0] == 0
    assert path.dissipated["impact"][-1] == pytest.approx(G, rel=1e-9)


def test_an_impact_costs_one_minus_e_squared_of_the_energy():
    e, bounces = 0.5, 2
    ball = scenes.bouncing_ball(e)
    state = ball.state([1.0])
    apex = FALL + 2 * FALL * e + FALL * e**2  # highest place after the second bounce

    def error(dt):
        path = end(ball, state, apex, dt)
        assert len(path.of_kind(EventKind.IMPACT)) == bounces
        assert path.audit < 1e-12
        return path.dissipated["impact"][-1] - G * (1 - e ** (2 * bounces))

    assert all(abs(error(dt)) < 10 * G * LOCATED for dt in (0.05, 2e-3, 1e-3))


def test_a_plastic_ball_stays_where_it_lands():
    ball = scenes.bouncing_ball(0.0)
    path = end(ball, ball.state([1.0]), 1.0, 1.3e-3)
    (made,) = path.of_kind(EventKind.MADE)
    assert made.time == pytest.approx(FALL, abs=1e-5)
    assert not path.of_kind(EventKind.LOST)
    assert path.dissipated["impact"][-1] == pytest.approx(G, abs=G * LOCATED)
    assert path.q[-1, 0, 0] == pytest.approx(0, abs=LOCATED)


def test_a_plastic_ball_that_starts_on_the_floor_does_not_rebound():
    ball, speed, dt = scenes.bouncing_ball(0.0), 3.0, 1e-3
    path = simulate(ball, ball.state([0.0], [-speed]), 1.0, dt)
    assert path.v[1:].max() <= G * dt * (1 + 1e-9)
    assert path.q.max() < 1e-12
    assert path.max_penetration < LOCATED
    assert path.q[-1, 0, 0] == pytest.approx(0, abs=LOCATED)
    assert path.dissipated["impact"][-1] == pytest.approx(speed**2 / 2, rel=1e-9)


# ---------------------------------------------------------------------------------- sliding block


def test_a_sliding_block_stops():
    mu, v = 0.3, np.array([2.0, 1.0])
    block, speed = scenes.sliding_block(Disc(mu)), np.linalg.norm(v)
    state = block.state([0, 0], v)

    def late(dt):
        return times(block, state, 1.0, dt, EventKind.REST)[0] - speed / (mu * G)

    def far(dt):
        return np.linalg.norm(end(block, state, 1.0, dt).q[-1, 0]) - speed**2 / (2 * mu * G)

    assert between(observed_order(late, 8e-3), FIRST)
    assert between(observed_order(far, 8e-3), SECOND)
    path = end(block, state, 1.0, 1.3e-3)
    assert path.dissipated["sliding"][-1] == pytest.approx(speed**2 / 2, rel=1e-12)
    assert path.v[-1].tolist() == [[0, 0]]
    assert np.cross([*v, 0], [*path.q[-1, 0], 0])[2] == pytest.approx(0, abs=1e-12)


def test_across_its_easy_direction_a_block_is_stopped_by_an_ellipse_at_its_support():
    """Slip along an axis of the ellipse meets the friction of that axis."""
    block = scenes.sliding_block(Ellipse(0.3, 0.1))
    for v, mu in (([1.0, 0.0], 0.3), ([0.0, -1.0], 0.1)):
        path = end(block, block.state([0, 0], v), 2.0, 1e-4)
        assert np.linalg.norm(path.q[-1, 0]) == pytest.approx(1 / (2 * mu * G), abs=1e-7)


@pytest.mark.parametrize("margin", [2e-8, 1e-6, 1e-3])
def test_a_block_holds_exactly_up_to_the_angle_of_friction(margin):
    """The threshold is met within the relative tolerance ``1e-8`` of the solver."""
    angle, dt = 0.4, 1e-3
    holds = scenes.sliding_block(Disc(math.tan(angle) * (1 + 1e-12)), angle=angle)
    assert end(holds, holds.state([0, 0]), 0.1, dt).q[-1].tolist() == [[0, 0]]
    slides = scenes.sliding_block(Disc(math.tan(angle) * (1 - margin)), angle=angle)
    path = end(slides, slides.state([0, 0]), 0.1, dt)
    expected = 0.1 * G * math.sin(angle) * margin
    assert path.v[-1, 0, 0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("margin", [1e-7, 1e-3])
def test_a_box_on_its_feet_holds_up_to_the_same_angle(margin):
    """There friction is on contacts: what presses on each foot is found with it."""
    angle, dt = 0.4, 1e-3
    holds = scenes.box_on_plane(1.0, 0.5, Interval(math.tan(angle) * (1 + margin)), angle=angle)
    assert end(holds, holds.state([0, 0.5, 0]), 0.1, dt).q[-1].tolist() == [[0, 0.5, 0]]
    slides = scenes.box_on_plane(1.0, 0.5, Interval(math.tan(angle) * (1 - margin)), angle=angle)
    path = end(slides, slides.state([0, 0.5, 0]), 0.1, dt)
    expected = 0.1 * G * math.sin(angle) * margin
    assert path.v[-1, 0, 0] == pytest.approx(expected, rel=1e-3)


def test_a_block_slides_down_evenly_accelerated():
    angle, mu = 0.5, 0.3
    block = scenes.sliding_block(Disc(0.4), Disc(mu), angle=angle)
    path = simulate(block, block.state([0, 0], [1e-9, 0]), 2.0, 1e-2)
    a = G * (math.sin(angle) - mu * math.cos(angle))
    np.testing.assert_allclose(path.v[:, 0, 0], a * path.times + 1e-9, rtol=1e-11)
    np.testing.assert_allclose(path.q[:, 0, 0], a * path.times**2 / 2, atol=1e-8)
    lost = mu * G * math.cos(angle) * path.q[:, 0, 0]
    np.testing.assert_allclose(path.dissipated["sliding"], lost, atol=1e-12)


@pytest.mark.parametrize("phase", range(6))
def test_a_block_thrown_up_stays_if_static_friction_holds_it(phase):
    """Where it turns it is at rest for a moment, and the static set decides."""
    dt = 1e-3 * 1.0137**phase
    block = scenes.sliding_block(Disc(0.4), Disc(0.1), angle=math.atan(0.2))
    path = end(block, block.state([0, 0], [-1, 0]), 1.0, dt)
    assert path.v[-1].tolist() == [[0, 0]]
    braking = G * (0.2 + 0.1) * math.cos(math.atan(0.2))
    assert path.q[-1, 0, 0] == pytest.approx(-1 / (2 * braking), abs=dt**2 * braking)


def test_a_block_thrown_up_comes_back_slower_if_static_friction_is_too_weak():
    angle, mu = math.atan(0.5), 0.2
    block = scenes.sliding_block(Disc(0.4), Disc(mu), angle=angle)
    up, down = (G * (math.sin(angle) + s * mu * math.cos(angle)) for s in (1, -1))

    def error(dt):
        path = simulate(block, block.state([0, 0], [-1, 0]), 2.0, dt, every=1)
        back = int(np.argmax((path.q[:, 0, 0] > 0) & (path.times > 1e-2)))
        return path.v[back, 0, 0] - math.sqrt(down / up)

    assert between(observed_order(error, 8e-3), FIRST)


# ---------------------------------------------------------------------------------- rolling balls


def test_a_ball_rolls_down_with_five_sevenths():
    angle = 0.3
    ball = scenes.ball_on_plane(Disc(0.3), angle=angle)
    path = simulate(ball, ball.state([0] * 4), 2.0, 1e-2)
    a = 5 / 7 * G * math.sin(angle)
    np.testing.assert_allclose(path.v[:, 0, 0], a * path.times, atol=1e-12)
    np.testing.assert_allclose(path.v[:, 0, 2], a * path.times, atol=1e-12)
    np.testing.assert_allclose(path.q[:, 0, 0], a * path.times**2 / 2, atol=1e-12)
    assert abs(path.dissipated["sliding"]).max() < 1e-12


@pytest.mark.parametrize("excess", [1e-8, 1e-5, 0.5])
def test_a_ball_rolls_without_slip_up_to_seven_halves_mu(excess):
    angle = 0.3
    limit = 2 / 7 * math.tan(angle)
    rolls = scenes.ball_on_plane(Disc(limit * (1 + 1e-12)), angle=angle)
    v = end(rolls, rolls.state([0] * 4), 1.0, 1e-2).v[-1, 0]
    assert v[0] == pytest.approx(v[2], rel=1e-13)
    mu = limit * (1 - excess)
    slips = scenes.ball_on_plane(Disc(mu), angle=angle)
    v = end(slips, slips.state([0] * 4), 1.0, 1e-2).v[-1, 0]
    assert v[0] == pytest.approx(G * (math.sin(angle) - mu * math.cos(angle)), rel=1e-11)
    assert v[2] == pytest.approx(5 / 2 * mu * G * math.cos(angle), rel=1e-11)


@pytest.mark.parametrize("spin", [(0.0, 0.0), (-1.0, 0.5)])
def test_a_pushed_ball_ends_up_rolling(spin):
    """At ``(5 v + 2 r w) / 7``, after ``2 |s| / (7 mu g)``, with ``s^2 / 7`` of energy lost."""
    mu, v, w = 0.3, np.array([2.0, 1.0]), np.array(spin)
    ball, slip = scenes.ball_on_plane(Disc(mu)), v - w
    speed, rolling = np.linalg.norm(slip), (5 * v + 2 * w) / 7
    state, until = ball.state([0] * 4, [*v, *w]), 2 * speed / (7 * mu * G)

    def error(dt):
        path = end(ball, state, 1.0, dt)
        braked = v * until - mu * G * slip / speed * until**2 / 2
        return np.linalg.norm(path.q[-1, 0, :2] - braked - rolling * (path.times[-1] - until))

    assert between(observed_order(error, 8e-3), SECOND)
    path = end(ball, state, 1.0, 1.3e-3)
    np.testing.assert_allclose(path.v[-1, 0], [*rolling, *rolling], atol=1e-12)
    assert path.dissipated["sliding"][-1] == pytest.approx(speed**2 / 7, rel=1e-10)


def test_rolling_resistance_stops_a_ball():
    resistance, v = 0.02, np.array([0.4, 0.3])
    ball = scenes.ball_on_plane(Disc(0.3), Disc(resistance))
    braking, speed = 5 / 7 * resistance * G, 0.5
    state = ball.state([0] * 4, [*v, *v])

    def late(dt):
        return times(ball, state, 4.0, dt, EventKind.REST)[0] - speed / braking

    def far(dt):
        return np.linalg.norm(end(ball, state, 4.0, dt).q[-1, 0, :2]) - speed**2 / (2 * braking)

    assert between(observed_order(late, 3e-2, phases=15), FIRST)
    assert between(observed_order(far, 3e-2), SECOND)
    path = end(ball, state, 4.0, 1.3e-2)
    assert path.v[-1].tolist() == [[0, 0, 0, 0]]
    assert path.dissipated["rolling"][-1] == pytest.approx(0.7 * speed**2, rel=1e-9)
    assert path.dissipated["sliding"][-1] == pytest.approx(0, abs=1e-9)


def test_rolling_resistance_holds_a_ball_up_to_its_angle():
    angle = 0.1
    limit = math.tan(angle)
    for excess in (1e-7, 1e-4, 0.5):
        rolls = scenes.ball_on_plane(Disc(0.3), Disc(limit * (1 - excess)), angle=angle)
        v = end(rolls, rolls.state([0] * 4), 1.0, 1e-2).v[-1, 0, 0]
        assert v == pytest.approx(5 / 7 * G * math.sin(angle) * excess, rel=1e-6)
    holds = scenes.ball_on_plane(Disc(0.3), Disc(limit * (1 + 1e-12)), angle=angle)
    assert end(holds, holds.state([0] * 4), 1.0, 1e-2).q[-1].tolist() == [[0, 0, 0, 0]]


@pytest.mark.parametrize(("mu", "e", "spin"), [(0.5, 0.6, 0.0), (0.02, 0.6, 0.0), (0.5, 0.0, 8.0)])
def test_an_impact_turns_spin_into_motion(mu, e, spin):
    """Friction on the contact itself: the impulse that presses is the one of the impact."""
    ball, speed, dt = scenes.thrown_ball(Interval(mu), e), 3.0, 1e-7
    state = ball.state([0, 1 + speed * dt / 2, 0], [1.0, -speed, spin])
    slip = 1.0 - spin
    change = -math.copysign(min(2 / 7 * abs(slip), mu * (1 + e) * speed), slip)
    expected = [1 + change, e * speed, spin - 5 / 2 * change]
    assert step(ball, state, dt).v == pytest.approx(expected, abs=2 * G * dt)


# ---------------------------------------------------------------------------------------- belts


def test_a_belt_carries_a_block():
    """Half of the work of the belt is lost."""
    mu, belt = 0.3, 0.7
    block = scenes.sliding_block(Disc(mu), belt=belt)
    path = end(block, block.state([0, 0]), 1.0, 1.3e-3)
    (rest,) = path.of_kind(EventKind.REST)
    assert rest.time == pytest.approx(belt / (mu * G), abs=1.3e-3)
    assert path.v[-1].tolist() == [[belt, 0]]
    assert path.work["substrate"][-1] == pytest.approx(belt**2, rel=1e-12)
    assert path.dissipated["sliding"][-1] == pytest.approx(belt**2 / 2, rel=1e-12)
    assert path.audit < 1e-12


def test_a_block_on_a_spring_sticks_and_slips():
    """It sticks until the spring pulls ``mu_s g``, and slips until it moves with the belt again."""
    static, dynamic, belt, k = 0.4, 0.25, 0.1, 50.0
    block = scenes.sliding_block(Disc(static), Disc(dynamic), belt=belt, stiffness=k)
    state = block.state([0, 0], [belt, 0])
    w, d = math.sqrt(k), (static - dynamic) * G / k
    period = 2 * d / belt + 2 * (math.pi - math.atan(d * w / belt)) / w

    def slips(dt):
        return times(block, state, 3.3, dt, EventKind.MOTION)

    def error(dt):
        return np.diff(slips(dt)).mean() - period

    assert between(observed_order(lambda dt: slips(dt)[0] - static * G / k / belt, 8e-3), FIRST)
    assert between(observed_order(error, 8e-3), FIRST)
    assert between(observed_order(lambda dt: end(block, state, 3.3, dt).audit, 8e-3), SECOND)
    path = simulate(block, state, 3.3, 1e-3, every=1)
    assert path.q[:, 0, 0].max() == pytest.approx(swing_end(static, dynamic, belt, k), abs=1e-3)


def swing_end(static, dynamic, belt, k):
    """The farthest the block goes: from ``mu_s g / k`` with the speed of the belt."""
    centre = dynamic * G / k
    return centre + math.hypot(static * G / k - centre, belt / math.sqrt(k))


# ------------------------------------------------------------------------------- pendulum and dome


def swing(top, start_angle, end_angle):
    """Time in which a pendulum of the amplitude ``top`` goes from one angle to another."""
    k = math.sin(top / 2)

    def phase(angle):
        return ellipkinc(math.asin(np.clip(math.sin(angle / 2) / k, -1, 1)), k * k)

    return (phase(end_angle) - phase(start_angle)) / math.sqrt(G)


TOP, WALL = 1.2, -0.4


def test_a_pendulum_between_its_top_and_a_wall():
    pendulum = scenes.wall_pendulum(WALL, 1.0)
    state, half = pendulum.state([TOP]), swing(TOP, WALL, TOP)

    def period(dt):
        return np.diff(times(pendulum, state, 12 * half, dt)).mean() - 2 * half

    def first(dt):
        return times(pendulum, state, 2 * half, dt)[0] - half

    assert between(observed_order(first, 8e-3), SECOND)
    assert between(observed_order(period, 8e-3), SECOND)
    assert between(observed_order(lambda dt: end(pendulum, state, 2.0, dt).audit, 8e-3), SECOND)
    assert abs(period(5e-4)) < 2e-3


def test_a_pendulum_loses_height_at_a_wall():
    """Energy above that at the wall falls by ``e^2`` at each impact, and shortens the swings."""
    e, impacts = 0.7, 3
    pendulum = scenes.wall_pendulum(WALL, e)
    state = pendulum.state([TOP])
    energy = G * (math.cos(WALL) - math.cos(TOP))
    tops = [math.acos(math.cos(WALL) - energy * e ** (2 * n) / G) for n in range(impacts + 1)]
    last = sum(2 * swing(top, WALL, top) for top in tops[:-1]) - swing(TOP, WALL, TOP)
    rise = swing(tops[-1], WALL, tops[-1])

    def late(dt):
        return times(pendulum, state, last + rise, dt)[impacts - 1] - last

    def loss(dt):
        path = end(pendulum, state, last + rise, dt)
        return path.dissipated["impact"][-1] - energy * (1 - e ** (2 * impacts))

    assert between(observed_order(late, 8e-3), SECOND)
    assert between(observed_order(loss, 8e-3), SECOND)


def test_a_bead_goes_round_in_a_ring():
    """Only curvature presses it, and nothing pushes it back: what it strayed would add up."""
    ring = scenes.bead_in_ring()
    state = ring.state([0.0, -1.0], [1.0, 0.0])

    def lag(dt):
        x, y = end(ring, state, 1.5 * math.pi, dt).q[-1, 0]
        return math.remainder(math.atan2(x, -y) - 1.5 * math.pi, math.tau)

    def strayed(dt):
        return end(ring, state, 1.5 * math.pi, dt).max_penetration

    assert between(observed_order(lag, 1e-2), SECOND)
    assert observed_order(strayed, 1e-2) > 1.9
    for dt in (1e-2, 1e-3):
        path = simulate(ring, state, 20.0, dt)
        assert path.max_penetration < dt**2 / 2  # how far the tangent leads outside in one step
        assert path.kinetic[-1] == pytest.approx(0.5, abs=dt**2)


@pytest.mark.parametrize("across", [0.3, 0.6, 0.9])
def test_a_bead_that_hits_the_ring_goes_on_along_it(across):
    """The curvature met after an impact is not that before it."""
    ring = scenes.bead_in_ring()
    state = ring.state([across, 0.0], [0.0, 1.0])
    for dt in (5e-2, 1e-2):
        path = simulate(ring, state, 6.0, dt)
        assert path.max_penetration < 2e-4 + 2 * dt**3
        assert math.sqrt(2 * path.kinetic[-1]) == pytest.approx(across, abs=dt)


def test_a_point_leaves_a_smooth_dome_at_two_thirds_of_its_height():
    dome, angle = scenes.dome(), 0.3
    state = dome.state([math.sin(angle), math.cos(angle)])

    def error(dt):
        engine = start(dome, state, dt)
        engine.advance(2)
        while engine.touching() and engine.touching()[0][2] > 0:
            engine.advance(1)
        return engine.motion.q[0, 1] - 2 / 3 * math.cos(angle)

    assert between(observed_order(error, 8e-3), FIRST)
    path = end(dome, state, 0.4, 1e-3)
    assert not path.of_kind(EventKind.LOST)
    assert path.audit < 1e-12
    assert end(dome, state, 0.7, 1e-3).of_kind(EventKind.LOST)


# ------------------------------------------------------------------------------- several at once


@pytest.mark.parametrize("e", [1.0, 0.5, 0.0])
def test_a_ball_hits_two_that_touch(e):
    """Moreau's law: the first contact leaves at ``e``, the second stays closed."""
    row = scenes.row_of_balls((1, 1, 1), e)
    path = end(row, row.state([0, 1.5, 2.5], [1, 0, 0]), 1.0, 1e-3)
    expected = [(1 - 2 * e) / 3, (1 + e) / 3, (1 + e) / 3]
    solved = Solver().tolerance  # of speeds and energies that are about one
    np.testing.assert_allclose(path.v[-1, 0], expected, atol=solved)
    assert path.dissipated["impact"][-1] == pytest.approx((1 - e**2) / 3, abs=solved)


@pytest.mark.parametrize("e", [1.0, 0.8, 0.7])
def test_balls_that_are_apart_are_hit_one_after_the_other(e):
    masses = (1.0, 1.5, 2.0)
    row = scenes.row_of_balls(masses, e)
    path = end(row, row.state([0, 1.5, 2.6], [1, 0, 0]), 1.2, 1e-3)
    v = [1.0, 0.0, 0.0]
    for i in (0, 1):
        v[i], v[i + 1] = collision(masses[i], v[i], masses[i + 1], v[i + 1], e)
    assert v[0] < v[1] < v[2]  # no third impact
    np.testing.assert_allclose(path.v[-1, 0], v, atol=1e-9)


def collision(m, v, n, w, e):
    centre = (m * v + n * w) / (m + n)
    return centre - e * n / (m + n) * (v - w), centre + e * m / (m + n) * (v - w)


# ------------------------------------------------------------------------------- rocking, falling


def on_foot(corner, theta, spin):
    """Placement and velocity of a body that turns about a corner at the origin."""
    along, across = corner
    x = along * math.cos(theta) - across * math.sin(theta)
    y = along * math.sin(theta) + across * math.cos(theta)
    return [-x, -y, theta], [y * spin, -x * spin, spin]


def test_a_rocking_block_keeps_its_angular_momentum_about_the_new_foot():
    """Housner's ratio, and with it the energy lost."""
    a, b, tilt = 0.25, 1.0, 0.12
    box = scenes.box_on_plane(a, b, Interval(2.0))
    q, _ = on_foot((-a, -b), tilt, 0.0)
    state, c, size = box.state(q), math.atan(a / b), math.hypot(a, b)
    energy = G * size * (math.cos(c - tilt) - math.cos(c))
    left = (1 - 3 / 2 * math.sin(c) ** 2) ** 2

    def error(dt):
        path = end(box, state, 0.6, dt)
        assert [e.contact for e in path.of_kind(EventKind.MADE)] == ["foot1", "foot2"]
        assert path.q[-1, 0, 2] < 0
        return path.dissipated["impact"][-1] - energy * (1 - left)

    for dt in (4e-3, 1e-3, 2.5e-4):
        assert abs(error(dt)) < dt * energy
    path = end(box, state, 0.6, 1e-4)
    (lost,) = path.of_kind(EventKind.LOST)
    assert lost.contact == "foot1"
    assert path.audit < 1e-10


def test_a_rimless_wheel_rolls_at_a_steady_pace():
    """What it loses at each foot is what it falls from foot to foot."""
    spokes, slope, inertia = 8, 0.15, 0.1
    wheel = scenes.rimless_wheel(spokes, Interval(2.0), inertia=inertia, angle=slope)
    c = math.pi / spokes
    ratio = (inertia + math.cos(2 * c)) / (inertia + 1)
    gain = 4 * G * math.sin(c) * math.sin(slope) / (inertia + 1)
    fastest = math.sqrt(gain / (1 - ratio**2))
    state = wheel.state(*on_foot((math.sin(c), -math.cos(c)), -0.02, -1.5))

    def error(dt):
        path = simulate(wheel, state, 5.0, dt, every=1)
        turns = path.v[len(path) // 2 :, 0, 2]
        return -turns.min() - fastest

    for dt in (8e-3, 2e-3, 5e-4):  # instants recorded come up to a step before the impact
        assert abs(error(dt)) < 5 * dt
