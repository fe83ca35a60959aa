"""Grip, weight, inertia, floor and rubbing against rigid bodies in space, by vector products."""

import math

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import placements, reals, vectors

from polycorner.dumbbells import DumbbellPair, drum_formulas
from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.formulas.kernels import address

L, R_BALL, T, RHO = 16.0, 3.0, 1.5, 122.0
PAIR = DumbbellPair(L, R_BALL, T, RHO + R_BALL)
UP = np.array([0.0, 0.0, 1.0])
KINDS = ("ball_ball", "ball_rod", "rod_rod")
ENDS = [(a, b) for a in (-1, 1) for b in (-1, 1)]
angles = st.floats(-math.pi, math.pi)
azimuths = st.floats(-1.5, 1.5)


def derivatives(family, q, numbers, order):
    parameters = np.array(numbers, dtype=float)
    return family.kernel.at(np.array(q, dtype=float), address(parameters), order)


def values(family, q, numbers):
    """Return the functions of a family at one point, by name."""
    return dict(zip(family.names, derivatives(family, q, numbers, 0)[0].tolist(), strict=True))


def gradients(family, q, numbers):
    return derivatives(family, q, numbers, 1)[1]


# ---------------------------------------------------------------------- rigid bodies in flat space


def axis(theta):
    return np.array([math.sin(theta), math.cos(theta), 0.0])


def rolling(theta):
    """Perpendicular to the axis and to the vertical, at ``+pi/2`` from the axis."""
    return np.cross(UP, axis(theta))


def turning(theta, theta_dot, psi_dot):
    """A growing heading turns clockwise seen from above; the spin rolls the body along ``u_r``."""
    return -theta_dot * UP - psi_dot * axis(theta)


def material(place, q, v, rho=RHO):
    """Velocity of the point of a body that is at ``place`` (developed, seen in space)."""
    (phi, eta, theta), (phi_dot, eta_dot, theta_dot, psi_dot) = q, v
    centre = np.array([rho * phi, eta, 0.0])
    w = np.array([rho * phi_dot, eta_dot, 0.0])
    return w + np.cross(turning(theta, theta_dot, psi_dot), place - centre)


def ball(q, e):
    return np.array([RHO * q[0], q[1], 0.0]) + e * L / 2 * axis(q[2])


# -------------------------------------------------------------------------------------------- grip


def gripped(q, v, surface=0.0, weight=1.0, rho=RHO, length=L):
    numbers = (length, R_BALL, rho, surface, weight)
    return values(drum_formulas.grip(), [q[0], q[2], *v], numbers)


@given(st.tuples(azimuths, reals(50.0), angles), vectors(4), reals())
def test_slip_is_the_velocity_of_the_lowest_points_over_the_wall(q, v, surface):
    found = gripped(q, v, surface)
    for k, e in ((1, -1), (2, 1)):
        slip = material(ball(q, e) - R_BALL * UP, q, v) - np.array([surface, 0.0, 0.0])
        assert found[f"slip{k}_r"] == pytest.approx(slip @ rolling(q[2]), abs=1e-9)
        assert found[f"slip{k}_s"] == pytest.approx(slip @ axis(q[2]), abs=1e-9)
    assert found["spin"] == R_BALL * v[3]


@given(azimuths, angles, reals(100.0), reals())
def test_nothing_slips_where_it_rolls_or_is_carried_along(phi, theta, speed, omega):
    """Rolling along ``u_r`` at ``r psi'`` over a wall that carries it at ``omega rho``."""
    w = speed * rolling(theta)
    v = (omega + w[0] / RHO, w[1], 0.0, speed / R_BALL)
    found = gripped((phi, 0.0, theta), v, omega * RHO)
    scale = 1 + abs(speed) + abs(omega) * RHO
    assert max(abs(found[name]) for name in drum_formulas.GRIPS[:4]) <= 1e-13 * scale
    assert found["spin"] == pytest.approx(speed, abs=1e-12)


@given(st.tuples(azimuths, reals(50.0), angles), st.floats(0.01, 10.0))
def test_a_load_is_the_weight_along_the_radius_through_the_ball(q, weight):
    found = gripped(q, np.zeros(4), weight=weight)
    centres = oracles.balls(PAIR, [*q, *q])[:2]
    outwards = centres * [1, 0, 1] / np.linalg.norm(centres * [1, 0, 1], axis=1)[:, None]
    pressed = outwards @ (-weight * UP)
    assert [found["load1"], found["load2"]] == pytest.approx(pressed.tolist(), abs=1e-12 * weight)
    assert found["load"] == pytest.approx(pressed.sum(), abs=1e-12 * weight)


def exact_slip(q, v, omega, e, length, rho):
    """Slip of a ball in the curved drum, along azimuth and meridian, with the spin about the axis.

    The body turns about the axis of the drum as it moves in azimuth, on top of heading and spin.
    """
    _, eta, theta = q
    phi_dot, eta_dot, theta_dot, psi_dot = v
    half = length / 2 * math.sin(theta)
    drop = -math.sqrt(rho**2 - half**2)
    drop_dot = -half * length / 2 * math.cos(theta) * theta_dot / drop
    middle = np.array([0.0, eta, drop])
    about = np.array([0.0, -phi_dot, 0.0])
    spin = turning(theta, theta_dot, psi_dot) + about
    centre = middle + e * length / 2 * axis(theta)
    velocity = np.array([0.0, eta_dot, drop_dot]) + np.cross(about, middle)
    out = centre * [1, 0, 1] / rho
    lowest = centre + R_BALL * out
    moving = velocity + np.cross(spin, lowest - middle)
    wall = np.cross([0.0, -omega, 0.0], lowest)
    east = np.array([-out[2], 0.0, out[0]])
    return np.array([(moving - wall) @ east, moving[1] - wall[1]])


def test_slip_in_the_curved_drum_differs_by_a_share_r_over_rho():
    """Speeds are fixed while the drum grows; the lowest points are ``r`` further out."""
    rhos = 122.0 * 2.0 ** np.arange(8)
    q, errors = (0.3, 5.0, 0.4), []
    for rho in rhos:
        v = np.array([2.0 / rho, 1.5, 0.2, 0.7])
        found = gripped(q, v, 0.8, rho=rho)
        flat = found["slip2_r"] * rolling(q[2]) + found["slip2_s"] * axis(q[2])
        errors.append(np.linalg.norm(flat[:2] - exact_slip(q, v, 0.8 / rho, 1, L, rho)))
    assert oracles.observed_order(errors, 1 / rhos, 1e-12) == pytest.approx(1, abs=0.05)
    assert errors[0] < 2 * R_BALL / RHO * 2.0


# -------------------------------------------------------------------------------- weight, inertia


def potential(q, weight, pull):
    return values(drum_formulas.weight(), q, (L, RHO, weight, pull))["potential"]


@given(st.tuples(azimuths, reals(50.0), angles), st.floats(0.01, 10.0), st.floats(-0.3, 0.3))
def test_the_potential_is_what_both_balls_weigh(q, m, alpha):
    """The drum is turned by ``alpha`` instead of gravity."""
    centres = oracles.balls(PAIR, [*q, *q])[:2]
    heights = centres[:, 1] * math.sin(alpha) + centres[:, 2] * math.cos(alpha)
    g = 9810.0
    found = potential(q, m * g * math.cos(alpha), m * g * math.sin(alpha))
    assert found == pytest.approx(m * g * heights.sum(), abs=1e-11 * m * g * RHO)


@given(st.tuples(azimuths, reals(50.0), angles), reals(), reals())
def test_forces_are_differences_of_the_potential(q, weight, pull):
    numbers = (L, RHO, weight, pull)
    slope = gradients(drum_formulas.weight(), q, numbers)[0]
    step = 1e-6
    for i in range(3):
        ahead, behind = (np.array(q) + s * step * np.eye(3)[i] for s in (1, -1))
        difference = (potential(ahead, weight, pull) - potential(behind, weight, pull)) / (2 * step)
        assert slope[i] == pytest.approx(difference, abs=1e-6 * RHO)


@given(st.tuples(azimuths, reals(50.0), angles))
def test_the_loads_fall_off_as_the_potential_rises(q):
    """Both come from the same heights: ``load = -potential / rho`` where nothing pulls along."""
    found = gripped(q, np.zeros(4), weight=2.0)
    assert found["load"] == pytest.approx(-potential(q, 2.0, 0.0) / RHO, abs=1e-12)


@given(angles, vectors(4), st.floats(0.01, 10.0))
def test_kinetic_energy_is_that_of_two_solid_balls(theta, v, m):
    """The tensor of inertia about the centre, by the theorem of parallel axes."""
    numbers = (L, R_BALL, RHO, m)
    tensor = np.zeros((3, 3))
    for e in (-1, 1):
        d = e * L / 2 * axis(theta)
        tensor += m * (2 / 5 * R_BALL**2 * np.eye(3) + (d @ d) * np.eye(3) - np.outer(d, d))
    spin = turning(theta, v[2], v[3])
    expected = m * ((RHO * v[0]) ** 2 + v[1] ** 2) + spin @ tensor @ spin / 2
    found = values(drum_formulas.kinetic(), v, numbers)["kinetic"]
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-300)
    mass = drum_formulas.inertia(*numbers)
    assert found == pytest.approx(mass @ v**2 / 2, rel=1e-12, abs=1e-300)


@given(st.tuples(azimuths, reals(50.0), angles))
def test_floors_are_the_distances_of_the_balls_from_the_bottom(q):
    along = oracles.balls(PAIR, [*q, *q])[:2, 1]
    found = values(drum_formulas.floors(), q[1:], (L, R_BALL))
    assert list(found.values()) == pytest.approx((along - R_BALL).tolist(), abs=1e-12)


# ----------------------------------------------------------------------------------------- rubbing


def rubbing(kind, q, v, e1=1, e2=1):
    numbers = (L, R_BALL, T, RHO, e1, e2)
    found = values(drum_formulas.rubs(kind), [*q, *v], numbers)
    return np.array([found["tangential"], found["vertical"]])


@st.composite
def touching(draw, kind):
    """Return two placements that touch, ``e1 e2``, the point between them and the normal."""
    first = np.array([draw(azimuths), draw(reals(50.0)), draw(angles)])
    theta2, (e1, e2) = draw(angles), draw(st.sampled_from(ENDS))
    start = ball(first, e1)
    if kind == "ball_ball":
        normal = axis(draw(angles))
        place, end = start + R_BALL * normal, start + 2 * R_BALL * normal
        centre = end - e2 * L / 2 * axis(theta2)
    else:
        normal = draw(st.sampled_from([-1, 1])) * rolling(theta2)
        place, foot = start + R_BALL * normal, start + (R_BALL + T) * normal
        centre = foot + draw(st.floats(-0.5, 0.5)) * L * axis(theta2)
    second = np.array([centre[0] / RHO, centre[1], theta2])
    return np.concatenate([first, second]), (e1, e2), place, normal


def pulled_apart(q, v, place):
    """Velocity of the surface of body 1 relative to body 2."""
    return material(place, q[:3], v[:4]) - material(place, q[3:], v[4:])


@pytest.mark.parametrize("kind", KINDS[:2])
@given(st.data(), vectors(8))
def test_rubbing_is_the_relative_velocity_of_the_surfaces(kind, data, v):
    q, (e1, e2), place, normal = data.draw(touching(kind))
    relative = pulled_apart(q, v, place)
    expected = [relative @ np.cross(UP, normal), relative @ UP]
    assert rubbing(kind, q, v, e1, e2) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("kind", KINDS[:2])
@given(st.data(), vectors(8))
def test_what_does_not_rub_opens_the_gap(kind, data, v):
    """Relative velocity in the plane, squared: rubbing and the rate of the gap of the pair."""
    q, (e1, e2), place, _ = data.draw(touching(kind))
    name = f"A{(e1 + 3) // 2}" + (f"B{(e2 + 3) // 2}" if kind == "ball_ball" else "b")
    flat = np.array([RHO, 1.0, 1.0] * 2)
    slopes = gradients(dumbbell_formulas.plane_gaps(), flat * q, (L, R_BALL, T))
    gap = slopes[dumbbell_formulas.CONTACTS.index(name)] @ (flat * v[[0, 1, 2, 4, 5, 6]])
    relative = pulled_apart(q, v, place)
    rubbed = rubbing(kind, q, v, e1, e2)[0]
    assert rubbed**2 + gap**2 == pytest.approx(relative[:2] @ relative[:2], rel=1e-6, abs=1e-6)


def same_place(q, e1, e2):
    """Two balls at one place have no normal; they never get there."""
    return np.linalg.norm(ball(q[:3], e1) - ball(q[3:], e2)) < 1e-3


@pytest.mark.parametrize("kind", KINDS)
@given(st.data(), reals(), reals(), reals())
def test_a_motion_of_both_as_one_rubs_nowhere(kind, data, east, north, theta_dot):
    """A translation, and a turn of the whole plane about any point, without spin."""
    q = data.draw(placements(PAIR))
    e1, e2 = data.draw(st.sampled_from(ENDS))
    assume(kind != "ball_ball" or not same_place(q, e1, e2))
    v = []
    for phi, eta, _ in q.reshape(2, 3):
        moving = np.array([east, north, 0.0])
        moving += np.cross(-theta_dot * UP, [RHO * (phi - q[0]), eta - q[1], 0.0])
        v += [moving[0] / RHO, moving[1], theta_dot, 0.0]
    assert rubbing(kind, q, v, e1, e2) == pytest.approx([0, 0], abs=1e-9)


def beside(gap):
    """Parallel on two meridians, ``gap`` mm between the axes."""
    return np.array([0.0, 0.0, 0.0, gap / RHO, 0.0, 0.0])


def spinning(first, second):
    return np.array([0, 0, 0, first, 0, 0, 0, second], dtype=float)


@pytest.mark.parametrize(
    ("kind", "gap", "arms"),
    [("ball_ball", 2 * R_BALL, (R_BALL, R_BALL)), ("rod_rod", 2 * T, (T, T))],
)
def test_the_same_spin_rubs_and_opposite_spins_mesh(kind, gap, arms):
    """Between two bodies that roll the same way the surfaces move opposite ways, up and down."""
    assert rubbing(kind, beside(gap), spinning(1, -1)) == pytest.approx([0, 0], abs=1e-13)
    same = rubbing(kind, beside(gap), spinning(1, 1))
    assert same == pytest.approx([0, sum(arms)], abs=1e-13)
    # rolling west, the eastern flank of a body goes up
    assert rubbing(kind, beside(gap), spinning(1, 0))[1] == pytest.approx(arms[0])


def test_a_ball_spinning_at_a_rod_rubs_by_its_own_radius():
    q = np.array([0.0, 0.0, 0.0, (R_BALL + T) / RHO, 2.0, 0.0])
    assert rubbing("ball_rod", q, spinning(1, 0)) == pytest.approx([0, R_BALL])
    assert rubbing("ball_rod", q, spinning(0, 1)) == pytest.approx([0, T])


@pytest.mark.parametrize("kind", KINDS)
@given(st.data(), vectors(8), vectors(8), reals(3.0))
def test_rubbing_is_linear_in_the_velocities_and_always_finite(kind, data, u, v, a):
    q = data.draw(placements(PAIR))
    e1, e2 = data.draw(st.sampled_from(ENDS))
    assume(kind != "ball_ball" or not same_place(q, e1, e2))
    both = rubbing(kind, q, u + a * v, e1, e2)
    parts = rubbing(kind, q, u, e1, e2) + a * rubbing(kind, q, v, e1, e2)
    slopes = gradients(drum_formulas.rubs(kind), [*q, *v], (L, R_BALL, T, RHO, e1, e2))
    assert np.isfinite(slopes).all()
    assert both == pytest.approx(parts, abs=1e-9 * RHO)


@pytest.mark.parametrize("kind", KINDS[:2])
@given(st.data(), vectors(8))
def test_a_mirror_image_rubs_the_other_way_and_rises_as_before(kind, data, v):
    """Reflection in the lowest meridian keeps the meridian's direction and turns the spin."""
    q, ends, _, _ = data.draw(touching(kind))
    image = np.array([-1, 1, -1] * 2) * q
    moving = np.array([-1, 1, -1, -1] * 2) * v
    expected = np.array([-1, 1]) * rubbing(kind, q, v, *ends)
    assert rubbing(kind, image, moving, *ends) == pytest.approx(expected, abs=1e-9)
    before, after = gripped(q, v[:4], 5.0), gripped(image, moving[:4], -5.0)
    for name in ("slip1_r", "slip2_r", "spin"):
        assert after[name] == pytest.approx(-before[name], abs=1e-12)
    for name in ("slip1_s", "slip2_s", "load1", "load2"):
        assert after[name] == pytest.approx(before[name], abs=1e-12)


@given(st.data(), vectors(8))
def test_seen_from_the_other_ball_only_the_vertical_turns_round(data, v):
    q, (e1, e2), _, _ = data.draw(touching("ball_ball"))
    swapped = rubbing("ball_ball", np.roll(q, 3), np.roll(v, 4), e2, e1)
    expected = np.array([1, -1]) * rubbing("ball_ball", q, v, e1, e2)
    assert swapped == pytest.approx(expected, abs=1e-9)


@given(azimuths, angles, st.floats(0.05, 1.5), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
def test_crossing_rods_rub_where_they_cross(phi, theta, angle, first, second):
    """On both axes: no spin is felt there, and turning about the crossing does not rub."""
    cross = np.array([RHO * phi, 7.0, 0.0])
    q, v = [], []
    for heading, share, rate in ((theta, first, 1.3), (theta + angle, second, -0.4)):
        centre = cross + share * L * axis(heading)
        moving = np.cross(-rate * UP, centre - cross)
        q += [centre[0] / RHO, centre[1], heading]
        v += [moving[0] / RHO, moving[1], rate, 1.0 - rate]
    assert rubbing("rod_rod", q, v) == pytest.approx([0, 0], abs=1e-9)


@pytest.mark.parametrize("turned", [0.0, math.pi, -math.pi])
@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-8, 1e-4])
def test_nearly_parallel_rods_rub_in_the_middle(angle, turned):
    q = beside(2 * T) + np.array([0, 0, 0, 0, 3.0, angle + turned])
    v = np.array([0, 1.0, 0.5, 0.2, 0, -1.0, 0.1, 0.7])
    place = (ball(q[:3], 0) + ball(q[3:], 0)) / 2
    relative = pulled_apart(q, v, place)
    expected = [relative[1], relative[2]]
    assert rubbing("rod_rod", q, v) == pytest.approx(expected, abs=10 * angle + 1e-12)


def test_an_unknown_kind_of_contact_is_refused():
    with pytest.raises(ValueError, match=r"^kind: expected "):
        drum_formulas.rubs("x")
