"""Appendix A: expected verdicts, and its checks against numerical definitions."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from paper_checks import Verdict
from paper_checks.appendixA import coefficients, forces, rest, torque, turning
from polycorner.dumbbells.statics.keel import force_ratio, net_torque

azimuths = st.floats(-0.7, 0.7)
headings = st.floats(-1.5, 1.5)


@given(azimuths, st.floats(-1.2, 1.2), st.floats(-9, 9))
def test_the_frame_is_that_of_a_turned_cylinder(phi, alpha, eta):
    """A point is put on a level cylinder and turned about the x axis; slopes by differences."""
    turn = np.array(
        [
            [1, 0, 0],
            [0, math.cos(alpha), -math.sin(alpha)],
            [0, math.sin(alpha), math.cos(alpha)],
        ]
    )

    def height(azimuth, along, radius):
        level = [radius * math.sin(azimuth), along, -radius * math.cos(azimuth)]
        return (turn @ level)[2]

    symbols, down = forces.frame()
    at = {symbols["phi"]: phi, symbols["alpha"]: alpha}
    found = [float(part.subs(at)) for part in down]
    h, R = 1e-5, 2.0
    expected = [
        (height(phi - h, eta, R) - height(phi + h, eta, R)) / (2 * h * R),
        (height(phi, eta - h, R) - height(phi, eta + h, R)) / (2 * h),
        (height(phi, eta, R - h) - height(phi, eta, R + h)) / (2 * h),
    ]
    assert found == pytest.approx(expected, abs=1e-8)


@given(azimuths, headings)
def test_forces_are_those_of_the_library(phi, theta):
    ratio, size = rest.forces(np.array([phi]), np.array([theta]))
    assert ratio[0] == pytest.approx(force_ratio(phi, theta, forces.TILT), abs=1e-12)
    assert size[0] == pytest.approx(np.hypot(*ratio[0]) * math.cos(forces.TILT) * math.cos(phi))


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.booleans())
def test_what_is_held_is_so_by_the_two_cases_in_words(across, along, absolute):
    size = math.hypot(across, along)
    if size < 1e-3:
        return
    cosine = abs(across) / size if absolute else across / size
    angle, epsilon = math.acos(cosine), math.asin(0.1 / 0.3)
    if abs(angle - (math.pi / 2 - epsilon)) < 1e-6:
        return
    limit = 0.1 / math.cos(angle) if angle < math.pi / 2 - epsilon else 0.3
    if abs(size - limit) < 1e-9:
        return
    found = coefficients.held(
        np.array([[across, along]]), 0.1, 0.3, divided=True, absolute=absolute, force=None
    )
    assert bool(found[0]) == (size < limit)


@given(azimuths, headings, st.floats(0.01, 0.3))
def test_the_potential_gives_the_torque_of_the_library(phi, theta, k):
    """The library's unit is ``m g cos(alpha) l^2 / (2 rho)`` with the mass of one ball."""
    (p, _, t, a, kappa), height = torque.potential()
    slope = sympy.lambdify((p, t, a, kappa), -2 * height.diff(t))
    found = slope(phi, theta, forces.TILT, k) / (math.cos(forces.TILT) * 2 * k**2)
    assert found == pytest.approx(net_torque(phi, theta, forces.TILT, 0.0, k), abs=1e-9)


@given(st.floats(0.01, 0.26), st.floats(80.0, 89.99))
def test_in_the_sliver_the_torque_grows_and_outside_it_does_not(phi, degrees):
    theta = math.radians(degrees)
    found = torque.thin_sliver(np.array([phi, -phi, phi]), np.array([theta, -theta, -theta]))
    grows = bool(net_torque(phi, theta, forces.TILT, 0.3) > 0)
    assert found.tolist() == [grows, grows, False]


def test_printed_formulas_that_differ_are_not_taken_for_right():
    assert forces.pressure_is("cos(phi)").verdict is Verdict.REFUTED
    assert forces.limit_is("asin(mu)").verdict is Verdict.REFUTED
    assert forces.cosine_is("cos(alpha)*sin(phi)*cos(theta)").verdict is Verdict.REFUTED
    assert coefficients.quoted_angle_is(mu_s=0.7185, epsilon=8.0).verdict is Verdict.HOLDS


def test_neither_repair_of_the_cosine_is_enough_alone():
    for repair in ({"divided": True}, {"absolute": True}):
        assert rest.region_is(**repair).verdict is Verdict.CORRECTED


def test_the_region_of_the_stops_is_not_decided_by_how_many_there_are():
    found = turning.stops_are_in().numbers
    assert found["inside"] == found["stops"] > 20


def test_the_edge_of_the_inner_region_is_not_where_they_start():
    assert turning.carried_until("B").verdict is Verdict.REFUTED
