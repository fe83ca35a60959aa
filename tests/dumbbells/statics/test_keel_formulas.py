"""Forces and torques on a tilted wall against the paper's formulas and against vectors in space."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells.statics.keel import (
    derivation,
    force_ratio,
    net_torque,
    rolling_cosine,
    s_curve,
)

PHI, ETA, THETA, ALPHA, RHO, MU = sympy.symbols("phi eta theta alpha rho mu", real=True)
azimuths = st.floats(-1.5, 1.5)
headings = st.floats(-math.pi, math.pi)
tilts = st.floats(-1.2, 1.2)


def same(first, second):
    """Equal at enough exact points of the region to be one analytic function."""
    points = [
        dict(zip((PHI, THETA, ALPHA, MU), point, strict=True))
        for point in [("0.3", "0.7", "0.1", "0.4"), ("1.1", "-0.4", "0.2", "0.9")]
    ]
    for point in points:
        numbers = {symbol: sympy.Rational(value) for symbol, value in point.items()}
        if abs((first - second).subs(numbers).evalf(40)) > sympy.Float("1e-35"):
            return False
    return True


def in_space(phi, theta, tilt):
    """Return the weight of a unit mass along ``u_r``, ``u_s`` and outwards, gravity being turned.

    At azimuth ``phi`` the wall's outward normal is ``(sin phi, 0, -cos phi)`` in the drum's frame.
    """
    gravity = np.array([0.0, -math.sin(tilt), -math.cos(tilt)])
    outward = np.array([math.sin(phi), 0.0, -math.cos(phi)])
    meridian = np.array([0.0, 1.0, 0.0])
    east = np.array([math.cos(phi), 0.0, math.sin(phi)])
    rolling = -math.cos(theta) * east + math.sin(theta) * meridian
    axis = math.sin(theta) * east + math.cos(theta) * meridian
    return gravity @ rolling, gravity @ axis, gravity @ outward


# ------------------------------------------------------------------------------- what is as printed


def test_the_force_along_the_wall_is_the_printed_gradient():
    east, north = derivation().tangent
    assert same(east, -sympy.cos(ALPHA) * sympy.sin(PHI))
    assert same(north, -sympy.sin(ALPHA))


def test_the_pressure_completes_the_unit_vector():
    d = derivation()
    east, north = d.tangent
    assert same(d.normal, sympy.cos(ALPHA) * sympy.cos(PHI))
    assert sympy.simplify(east**2 + north**2 + d.normal**2) == 1


def test_the_limit_is_as_printed():
    slope = sympy.tan(ALPHA) ** 2
    assert same(derivation().limit, sympy.asin(sympy.sqrt((MU**2 - slope) / (1 + MU**2))))


def test_lines_of_steepest_descent_are_as_printed():
    """The paper has ``d phi / d eta = sin(phi) / (R tan(alpha))`` along them."""
    east, north = derivation().tangent
    assert same(east / north, sympy.sin(PHI) / sympy.tan(ALPHA))
    assert same(derivation().curve, sympy.atan(east / north))


# --------------------------------------------------------------------------- what is not as printed


def test_the_printed_cosine_lacks_the_size_of_the_force():
    d = derivation()
    printed = sympy.cos(ALPHA) * sympy.sin(PHI) * sympy.cos(THETA)
    printed -= sympy.sin(ALPHA) * sympy.sin(THETA)
    size = sympy.sqrt(d.tangent[0] ** 2 + d.tangent[1] ** 2)
    assert same(d.cosine * size, printed)
    assert not same(d.cosine, printed)


@given(azimuths, headings, tilts)
def test_the_cosine_is_that_of_the_angle(phi, theta, tilt):
    along, across, _ = in_space(phi, theta, tilt)
    size = math.hypot(along, across)
    if size < 1e-6:
        return
    assert rolling_cosine(phi, theta, tilt) == pytest.approx(along / size, abs=1e-9)


def test_where_there_is_no_force_there_is_no_angle():
    assert rolling_cosine(0.0, 0.3, 0.0) == 0.0
    assert net_torque(0.0, 0.3, 0.0, 0.5) == pytest.approx(-math.sin(0.6) / 2)


# ------------------------------------------------------------------------------------------ numbers


@given(azimuths, headings, tilts)
def test_the_ratio_is_that_of_vectors_in_space(phi, theta, tilt):
    along, across, pressure = in_space(phi, theta, tilt)
    found = force_ratio(phi, theta, tilt)
    assert found == pytest.approx([along / pressure, across / pressure], rel=1e-9, abs=1e-12)


@given(azimuths, st.floats(0.01, 1.2))
def test_on_the_curve_nothing_rolls(phi, tilt):
    assert force_ratio(phi, s_curve(phi, tilt), tilt)[0] == pytest.approx(0, abs=1e-12)


def test_arrays_are_broadcast():
    phi, theta = np.linspace(-1, 1, 5)[:, None], np.linspace(-1, 1, 3)
    found = force_ratio(phi, theta, 0.1)
    assert found.shape == (5, 3, 2)
    assert found[4, 1].tolist() == force_ratio(1.0, 0.0, 0.1).tolist()
    assert net_torque(phi, theta, 0.1, 0.3).shape == (5, 3)


def balls_pushed(phi, theta, tilt, friction, kappa):
    """Return the torque from both balls' weight and friction, as vectors in space; length 1.

    A turn of the heading moves a ball along the wall, at the speed of its place in the chord.
    """
    half, rho = 0.5, 0.5 / kappa
    along, across, _ = in_space(phi, theta, tilt)
    size = math.hypot(along, across)
    gravity = np.array([0.0, -math.sin(tilt), -math.cos(tilt)]) / math.cos(tilt)
    torque, step = 0.0, 1e-6
    for e in (-1, 1):
        angle = phi + e * math.asin(half * math.sin(theta) / rho)

        def place(heading, e=e):
            azimuth = phi + e * math.asin(half * math.sin(heading) / rho)
            y = e * half * math.cos(heading)
            return np.array([rho * math.sin(azimuth), y, -rho * math.cos(azimuth)])

        moving = (place(theta + step) - place(theta - step)) / (2 * step)
        torque += gravity @ moving
        load = math.cos(angle)
        lever = -e * half  # u_r against the direction in which a turn moves the ball
        torque += -friction * load * (along / size) * lever
    return torque / (1 / (2 * rho))


@given(azimuths, headings, st.floats(0.02, 0.5), st.floats(0, 1), st.floats(0.01, 0.4))
def test_the_torque_is_that_of_both_balls(phi, theta, tilt, friction, kappa):
    found = net_torque(phi, theta, tilt, friction, kappa)
    expected = balls_pushed(phi, theta, tilt, friction, kappa)
    assert found == pytest.approx(expected, abs=1e-6 / kappa)


@given(azimuths, headings, tilts, st.floats(0, 1))
def test_the_torque_has_the_symmetries_of_the_drum(phi, theta, tilt, friction):
    """Turning round by half a turn changes nothing; the mirror image turns the other way."""
    found = net_torque(phi, theta, tilt, friction)
    half_turn, mirror = (
        net_torque(*at, tilt, friction) for at in ((phi, theta + math.pi), (-phi, -theta))
    )
    assert half_turn == pytest.approx(found, abs=1e-9)
    assert mirror == pytest.approx(-found, abs=1e-9)
    assert net_torque(phi, 0.0, tilt, friction) == 0


@given(azimuths, st.floats(1e-3, math.pi / 2 - 1e-3), st.floats(0, 1))
def test_in_a_horizontal_drum_headings_shrink(phi, theta, friction):
    """And ``|theta| = pi/2``, where nothing turns, is repulsive."""
    assert net_torque(phi, theta, 0.0, friction) < 0
    assert net_torque(phi, math.pi / 2, 0.0, friction) == pytest.approx(0, abs=1e-15)


@given(azimuths, st.floats(1e-3, math.pi / 2), st.floats(0.01, 1.0), st.floats(0, 1))
def test_headings_grow_only_beyond_the_curve(phi, theta, tilt, friction):
    """On the eastern side, where the dumbbell would roll down the axis instead of back."""
    if net_torque(phi, theta, tilt, friction) > 1e-15:
        assert phi > 0
        assert theta > s_curve(phi, tilt)


def test_headings_do_grow_beyond_it():
    phi, theta, tilt = 0.5, math.radians(89), math.radians(7)
    assert net_torque(phi, theta, tilt, 0.3) > 0 > net_torque(phi, theta, tilt, 0.0)
