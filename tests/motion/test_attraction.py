"""Attraction at contacts: what holds, what slides and what parts, by closed forms; its energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.files import load_trajectory, save_trajectory
from polycorner.motion import (
    Attraction,
    ContactFamily,
    Drift,
    EventKind,
    Friction,
    Interval,
    pair_coordinates,
    simulate,
)

LINE, PLANE = Manifold.euclidean("x"), Manifold.euclidean("x y")
(S,), (VS,) = LINE.symbols, velocities(LINE)
(X, Y), (VX, VY) = PLANE.symbols, velocities(PLANE)
ONE, TWO = (bodies[0] for bodies in pair_coordinates(LINE))
LINE_SEGMENT = Polyhedron(LINE, {"left": 1e3 + S, "right": 1e3 - S})
FAR, MASS, G, SIZE = 1e3, 2.0, 9.81, 1.0
GLUE = Attraction(force=3.0, range=0.02)


def hung(attraction):
    """A ball below a ceiling, at the depth ``S``."""
    energy = attraction.energy(S)
    return System(Polyhedron(LINE, {"ceiling": S}), MASS * VS**2 / 2, energy - MASS * G * S)


def balls(attraction=GLUE, pull=0.0, **more):
    """Two balls of the diameter 1 on a line, each drawn away from the origin by a force."""
    apart = ContactFamily({"balls": sympy.Abs(TWO - ONE) - SIZE}, SIZE, attraction=attraction)
    outward = sympy.Piecewise((-pull, S < 0), (pull, True))
    box = Polyhedron(LINE, {"left": FAR + S, "right": FAR - S})
    forces = {"x": outward} if pull else {}
    return System(box, MASS * VS**2 / 2, 0, forces, between=apart, count=2, **more)


def placed(system, gap, speed=0.0):
    half = (SIZE + gap) / 2
    return system.state([[-half], [half]], [[-speed], [speed]])


def test_a_ball_hangs_from_a_ceiling_that_attracts_it_by_more_than_its_weight():
    ball = hung(Attraction(1.5 * MASS * G, 0.01))
    path = simulate(ball, ball.state([0.0]), 1.0, 1e-3)
    assert abs(path.q).max() < 1e-9
    assert path.touching[-1][0][2] == pytest.approx(0.5 * MASS * G)


def test_a_ball_falls_from_a_ceiling_that_attracts_it_by_less():
    """``s'' = g - a/m + a s/(m d)`` up to the range, and free fall with that energy beyond."""
    force, reach, dt = 0.8 * MASS * G, 0.05, 1e-4
    ball = hung(Attraction(force, reach))
    path = simulate(ball, ball.state([0.0]), 0.3, dt, every=10)
    rate = math.sqrt(force / (MASS * reach))
    left = (G - force / MASS) / rate**2
    within = path.q[:, 0, 0] < reach
    expected = left * (np.cosh(rate * path.times) - 1)
    assert within.sum() > 50
    assert path.q[within, 0, 0] == pytest.approx(expected[within], abs=1e-5)
    fallen = path.q[-1, 0, 0]
    assert path.v[-1, 0, 0] ** 2 == pytest.approx(2 * G * fallen - force * reach / MASS, rel=1e-4)
    assert path.audit < 1e-5


@pytest.mark.parametrize("more", [0.99, 1.01])
def test_a_block_on_a_slope_that_attracts_it_slides_where_its_friction_is_used_up(more):
    """``tan(alpha) = mu (m g cos + a) / (m g cos)``, and ``g sin - mu (g cos + a/m)`` beyond."""
    mu, pull = 0.3, 4.0
    glue = Attraction(pull, 0.01)

    def left(angle):
        return G * math.sin(angle) - mu * (G * math.cos(angle) + pull / MASS)

    limit = math.asin(mu * pull / (MASS * G * math.hypot(1, mu))) + math.atan(mu)
    assert left(limit) == pytest.approx(0, abs=1e-12)
    angle = more * limit
    weight = MASS * G * (Y * math.cos(angle) - X * math.sin(angle))
    rubs = Friction("rubs", [VX], Interval(mu), "slope")
    slope = Polyhedron(PLANE, {"slope": Y})
    energy = MASS * (VX**2 + VY**2) / 2
    block = System(slope, energy, weight + glue.energy(Y), friction=[rubs])
    path = simulate(block, block.state([0.0, 0.0]), 1.0, 1e-3)
    assert path.v[-1, 0, 0] == pytest.approx(max(0.0, left(angle)), rel=2e-3, abs=1e-9)
    assert path.touching[-1][0][2] == pytest.approx(MASS * G * math.cos(angle) + pull)


def test_two_balls_are_held_together_against_less_than_their_attraction():
    system = balls(pull=0.9 * GLUE.force)
    path = simulate(system, placed(system, 0.0), 1.0, 1e-3)
    assert np.ptp(path.q[:, 1, 0]) < 1e-9
    assert path.touching[-1] == (((0, 1), "balls", pytest.approx(0.1 * GLUE.force)),)


def test_two_balls_are_parted_by_more():
    """Half the gap has ``m s'' = F - a + 2 a s / d``; steps are of second order."""
    pull, end = 1.2 * GLUE.force, 0.12
    system, rate = balls(pull=pull), math.sqrt(2 * GLUE.force / (MASS * GLUE.range))
    found = []
    for dt in (2e-3, 1e-3):
        path = simulate(system, placed(system, 0.0), end, dt)
        exact = (pull - GLUE.force) / (MASS * rate**2) * (math.cosh(rate * end) - 1)
        assert 0.001 < exact < GLUE.range / 2
        found.append(path.q[-1, 1, 0] - SIZE / 2 - exact)
        assert path.q[-1, 0, 0] == pytest.approx(-path.q[-1, 1, 0], abs=1e-14)
        assert path.audit < 1e-12
    assert found[0] / found[1] == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize("gap", [0.0, 0.008])
def test_balls_that_part_leave_the_energy_of_adhesion(gap):
    """``a d (1 - g/d)^2 / 2``, which is the work of the attraction; its error is of order two."""
    bound, system = GLUE.force * GLUE.range / 2 * (1 - gap / GLUE.range) ** 2, balls()
    speed = math.sqrt(1.5 * bound / MASS)
    path = simulate(system, placed(system, gap, speed), 0.5, 1e-4)
    assert path.kinetic[-1] == pytest.approx(0.5 * bound, rel=1e-3)
    assert path.work["attraction"][-1] == pytest.approx(-bound, rel=1e-3)
    assert path.audit < 1e-12
    slower = simulate(system, placed(system, gap, 0.8 * speed), 0.5, 1e-4)
    assert slower.q[-1, 1, 0] - slower.q[-1, 0, 0] == pytest.approx(SIZE, abs=1e-6)


def test_a_ball_that_rebounds_too_slowly_stays():
    """It comes with ``u`` from outside the range and needs ``(e^2 - 1) a d/2 + e^2 m u^2/4``."""
    bounce, bound = 0.5, GLUE.force * GLUE.range / 2
    for more, stays in ((0.9, True), (1.1, False)):
        speed = more * math.sqrt((1 - bounce**2) * bound / (MASS * bounce**2))
        system = balls()
        system = replace(system, between=replace(system.between, restitution=bounce))
        path = simulate(system, placed(system, 0.05, -speed), 1.0, 1e-4)
        gap = path.q[-1, 1, 0] - path.q[-1, 0, 0] - SIZE
        assert (gap < 1e-6) == stays
        assert path.audit < 1e-12
        assert len(path.of_kind(EventKind.IMPACT)) >= 1


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_blocks_that_rest_are_drawn_together_where_friction_cannot_hold_them(share):
    """Both lie on a table; asleep they are held against an attraction that has no contact."""
    gap = 0.005
    hold = GLUE.force * (1 - gap / GLUE.range)
    table = Friction("table", [VS], Interval(1.0), load=[hold / share], dynamic=Interval(0.5))
    system = balls(friction=[table])
    path = simulate(system, placed(system, gap), 0.5, 1e-3)
    met = path.q[-1, 1, 0] - path.q[-1, 0, 0] - SIZE
    assert met == pytest.approx(0.0 if share > 1 else gap, abs=1e-7)
    assert path.rests[-1].all()
    assert path.audit < 1e-12


def test_blocks_at_rest_are_carried_along_by_what_they_lie_on():
    """What does work on one of them is taken from the other; the substrate does none."""
    belt = Friction("belt", [VS - 0.3], Interval(1.0), load=[2 * GLUE.force])
    system = balls(friction=[belt], substrate={"x": 0.3})
    start = system.state([[-0.5 - 0.004], [0.5]])
    path = simulate(system, start, 1.0, 1e-3)
    assert path.q[-1] - path.q[0] == pytest.approx(0.3, abs=1e-12)
    assert path.rests[-1].all()
    assert path.audit < 1e-9


def test_a_run_goes_on_bit_for_bit():
    system = balls(pull=0.5)
    start = placed(system, 0.03, -0.05)
    whole = simulate(system, start, 0.6, 1e-3, every=100)
    half = simulate(system, start, 0.3, 1e-3, every=100)
    rest = simulate(half.system, half.last, 0.6, 1e-3, every=100)
    assert (rest.q[-1] == whole.q[-1]).all()
    assert (rest.v[-1] == whole.v[-1]).all()


def test_without_attraction_nothing_is_booked():
    system = balls(attraction=None)
    path = simulate(system, placed(system, 0.01, 0.1), 0.1, 1e-3)
    assert "attraction" not in path.work


def test_energy_is_minus_the_integral_of_the_force():
    (g,) = LINE.symbols
    energy = sympy.lambdify(g, GLUE.energy(g))
    force = sympy.lambdify(g, -sympy.diff(GLUE.energy(g), g))
    for gap, expected in ((-0.01, 3.0), (0.0, 3.0), (0.005, 2.25), (0.02, 0.0), (1.0, 0.0)):
        assert -force(gap) == pytest.approx(expected)
        step = 1e-7
        slope = (energy(gap + step) - energy(gap - step)) / (2 * step)
        assert slope == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("force", "reach", "named"),
    [(-1.0, 1.0, "force"), (1.0, 0.0, "range"), (math.nan, 1.0, "force"), (1.0, math.inf, "range")],
)
def test_an_attraction_that_is_none_is_refused(force, reach, named):
    with pytest.raises(ValueError, match=f"{named}: expected"):
        Attraction(force, reach)


def test_first_order_motion_has_no_attraction_between_bodies():
    with pytest.raises(ValueError, match="between: expected contacts without attraction"):
        Drift(LINE_SEGMENT, {}, count=2, between=balls().between)


def test_a_file_tells_of_attraction(tmp_path):
    system = balls()
    path = simulate(system, placed(system, 0.01), 0.01, 1e-3)
    save_trajectory(path, tmp_path / "run")
    assert (load_trajectory(tmp_path / "run", system).work["attraction"] > 0)[1:].all()
    with pytest.raises(ValueError, match="attraction"):
        load_trajectory(tmp_path / "run", balls(replace(GLUE, force=2.0)))


def test_what_is_no_attraction_is_refused():
    with pytest.raises(TypeError, match="attraction: expected"):
        balls(attraction=0.3)
