"""A shaken stack, a jammed block and a bead on a turning hoop, against their definitions."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

from polycorner.models.textbook import (
    GRAVITY,
    bead_on_hoop,
    block_in_wedge,
    body_on_plane,
    shaken_stack,
)
from polycorner.motion.events import EventKind
from polycorner.motion.friction import Interval
from polycorner.motion.simulation import simulate

BLOCKS = 10
FREQUENCY = 2 * math.pi * 5


def stacked(amplitude, t_end, dt):
    system = shaken_stack(BLOCKS, amplitude, FREQUENCY)
    return simulate(system, system.state(np.arange(float(BLOCKS))), t_end, dt)


@pytest.mark.parametrize("share", [0.3, 0.9, 0.99])
def test_a_shaken_stack_stays_while_it_has_weight(share):
    dt = 1e-3
    path = stacked(share * GRAVITY / FREQUENCY**2, 0.4, dt)
    heights = path.q[:, 0]
    np.testing.assert_allclose(heights, np.arange(BLOCKS) * np.ones_like(heights), atol=1e-12)
    for time, touching in zip(path.times[1:], path.touching[1:], strict=True):
        weight = GRAVITY * (1 - share * math.sin(FREQUENCY * (time - dt / 2)))
        forces = [force for _, _, force in touching]
        carried = weight * np.arange(BLOCKS, 0, -1)
        np.testing.assert_allclose(forces, carried, atol=1e-6 * BLOCKS * GRAVITY)


@pytest.mark.parametrize("share", [1.2, 2.0])
def test_a_shaken_stack_leaves_the_floor_when_its_weight_vanishes(share):
    path = stacked(share * GRAVITY / FREQUENCY**2, 0.06, 1e-4)
    lost = [e.time for e in path.of_kind(EventKind.LOST) if e.contact == "floor"]
    assert lost[0] == pytest.approx(math.asin(1 / share) / FREQUENCY, abs=1e-5)
    inside = np.diff(path.q[:, 0])
    np.testing.assert_allclose(inside, 1, atol=1e-6)  # no block leaves another before the floor


def wedge_cones(half_angle, mu):
    """Edges of both friction cones, as columns: normals and tangents of the faces."""
    s, c = math.sin(half_angle), math.cos(half_angle)
    faces = [((-c, s), (s, c)), ((c, s), (-s, c))]
    return np.array([np.add(n, sign * mu * np.array(t)) for n, t in faces for sign in (1, -1)]).T


def can_leave(half_angle, mu, pull):
    """Whether the block may fly out, or slide up a face and leave the other."""
    s, c = math.sin(half_angle), math.cos(half_angle)
    into = np.array([[c, -s], [-c, -s]]) @ pull
    up = np.array([[s, c], [-s, c]]) @ pull
    return bool((into <= 0).all() or ((into > 0) & (up > mu * into)).any())


@pytest.mark.parametrize("half_angle", [0.15, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("mu", [0.2, 0.5])
def test_a_block_in_a_wedge_stays_where_the_cones_allow(half_angle, mu):
    """Under forces of any direction, unless at the very edge of the cones."""
    edges = wedge_cones(half_angle, mu)
    for direction in np.arange(12) * math.pi / 6 + 0.05:
        pull = 5 * np.array([math.cos(direction), math.sin(direction)])
        nudged = [nnls(edges, -pull + 0.02 * np.array(d))[1] < 1e-9 for d in ((1, 0), (-1, 0))]
        holds = nnls(edges, -pull)[1] < 1e-9
        leaves = can_leave(half_angle, mu, pull)
        assert holds or leaves
        if nudged != [holds, holds] or (holds and leaves):  # at the edge; two answers
            continue
        system = block_in_wedge(half_angle, Interval(mu), tuple(pull))
        path = simulate(system, system.state([0.0, 0.0]), 0.05, 1e-2)
        assert bool(abs(path.q[-1, 0]).max() < 1e-9) == holds
        if holds:
            forces = {name: force for _, name, force in path.touching[-1]}
            right, left = forces.get("right", 0.0), forces.get("left", 0.0)
            assert min(right, left) >= -1e-9
            s, c = math.sin(half_angle), math.cos(half_angle)
            normal = right * np.array([-c, s]) + left * np.array([c, s])
            friction = np.linalg.solve([[s, -s], [c, c]], -pull - normal)  # along both faces
            assert (abs(friction) <= mu * np.array([right, left]) + 1e-6).all()


@pytest.mark.parametrize("mu", [0.1, 0.4])
def test_a_block_slides_up_one_face_of_a_wedge(mu):
    half_angle = 0.6
    s, c = math.sin(half_angle), math.cos(half_angle)
    along, into = np.array([s, c]), np.array([c, -s])  # up the right face, and into it
    pull = 3 * along + 2 * into
    system = block_in_wedge(half_angle, Interval(mu), tuple(pull))
    path = simulate(system, system.state([0.0, 0.0]), 0.5, 1e-3)
    expected = (3 - 2 * mu) * 0.5**2 / 2 * along
    np.testing.assert_allclose(path.q[-1, 0], expected, atol=1e-3 * (3 - 2 * mu))


def hoop_forces(angle, spin):
    x, y = math.sin(angle), -math.cos(angle)
    force = np.array([spin**2 * x, -GRAVITY])
    return float(force @ [math.cos(angle), math.sin(angle)]), float(force @ [x, y])


def at_angle(angle):
    return [math.sin(angle), -math.cos(angle)]


@pytest.mark.parametrize("spin", [1.0, 3.0, 6.0])
@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_a_bead_sticks_to_a_turning_hoop_where_it_may(spin, mu):
    system = bead_on_hoop(spin, Interval(mu))
    for angle in np.linspace(0.1, 1.5, 12):
        along, across = hoop_forces(angle, spin)
        if abs(abs(along) - mu * abs(across)) < 0.05:
            continue
        path = simulate(system, system.state(at_angle(angle)), 0.1, 1e-2)
        moved = math.hypot(*(path.q[-1, 0] - path.q[0, 0]))
        assert (moved < 1e-9) == (abs(along) < mu * abs(across)), angle


@pytest.mark.parametrize(("spin", "angle", "speed"), [(2.0, 0.4, 3.0), (5.0, 0.3, 1.5)])
def test_a_bead_slides_on_a_turning_hoop(spin, angle, speed):
    """Until it stops, or for 0.4 s."""
    mu, t_end = 0.2, 0.4

    def rates(_, state):
        along, across = hoop_forces(state[0], spin)
        load = abs(across + state[1] ** 2)
        return [state[1], along - mu * load * math.copysign(1.0, state[1])]

    def stops(_, state):
        return state[1]

    stops.terminal = True
    solved = solve_ivp(rates, (0, t_end), [angle, speed], events=stops, rtol=1e-10, atol=1e-12)
    until = float(solved.t[-1])
    system = bead_on_hoop(spin, Interval(mu))
    velocity = [speed * math.cos(angle), speed * math.sin(angle)]
    errors = []
    for dt in (until / 50, until / 100):
        path = simulate(system, system.state(at_angle(angle), velocity), 0.9 * until, dt)
        expected = solve_ivp(rates, (0, 0.9 * until), [angle, speed], rtol=1e-10, atol=1e-12).y[
            0, -1
        ]
        errors.append(math.hypot(*(path.q[-1, 0] - at_angle(expected))))
    assert errors[0] < 1e-3
    assert errors[1] < 0.4 * errors[0]


def painleve(theta, mu, way):
    """Row of the gap and of the slip, and the gap's acceleration per force while it slides."""
    normal = np.array([0.0, 1.0, math.cos(theta)])
    tangent = np.array([1.0, 0.0, -math.sin(theta)])
    inverse = np.diag([1.0, 1.0, 3.0])  # of a rod of mass 1 and half-length 1
    return normal, tangent, float(normal @ inverse @ (normal - mu * way * tangent))


@pytest.mark.parametrize("mu", [1.2, 2.0, 3.0])
@pytest.mark.parametrize("theta", [-0.9, -math.atan(2), -1.3, math.atan(2)])
def test_a_rod_that_cannot_slide_on_is_stopped_by_an_impulse(mu, theta):
    """Painleve's paradox: no finite force keeps the sliding end of the rod on the floor.

    Where the acceleration per force is negative (for some angle beyond mu = 4/3), the end is
    stopped at once, without a collision and without a gain of energy; elsewhere forces are finite.
    """
    dt, way, slip = 1e-4, 1.0, 3.0
    rod = body_on_plane([(1.0, 0.0)], 1 / 3, Interval(mu))
    normal, tangent, per_force = painleve(theta, mu, way)
    place, start = np.array([0.0, -math.sin(theta), theta]), np.array([slip, 0.0, 0.0])
    path = simulate(rod, rod.state(place, start), 5 * dt, dt)
    assert path.converged
    change = path.v[1, 0] - start + [0.0, GRAVITY * dt, 0.0]
    change[2] /= 3.0  # the momentum that contacts gave
    rows = np.array([normal, tangent])
    impulse, missed, *_ = np.linalg.lstsq(rows.T, change, rcond=None)
    assert float(missed.sum()) < 1e-10
    assert impulse[0] >= 0
    assert abs(impulse[1]) <= mu * impulse[0] * (1 + 1e-6) + 1e-9
    energy = path.kinetic + path.potential
    assert float(energy.max()) <= float(energy[0]) * (1 + 1e-9) + 1e-6
    stopped = abs(path.v[1, 0] @ tangent) < 1e-3
    assert stopped == (per_force < 0)
    assert (impulse[0] > 0.1) == (per_force < 0)
