"""Critical sizes: bisection, Newton's method and the closed form."""

import math
from dataclasses import replace
from functools import cache

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from polycorner import Verdict, minimise, stationary_on
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.critical import (
    branches,
    critical_corner,
    critical_length,
    critical_rod_radius,
    escape_barrier,
    mountain_pass,
    plane_critical_formula,
)

CORNER = ("A2B1", "A2b", "aB1")
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
PLANE = replace(PAIR, drum_radius=math.inf)
L, LETTER_R, T = sympy.symbols("l r t", positive=True)
lengths = st.floats(6.05, 60)
drums = st.sampled_from([9.0, 12.0, 30.0, 125.0, math.inf])
few = settings(max_examples=8)


@cache
def critical_in_the_plane(unknown):
    """The closed form as a function of l and r, or of r and t."""
    known = {"rod_radius": (L, LETTER_R), "length": (LETTER_R, T)}[unknown]
    return sympy.lambdify(known, plane_critical_formula(unknown))


def on_face(pair, chirality="R"):
    start = pair.nested(chirality, clearance=0.0)
    return stationary_on(pair.polyhedron, pair.energy, start, CORNER)


def bisected(pair):
    """The root of the multiplier in certificates, without derivatives by parameters."""

    def pressure(t):
        return on_face(replace(pair, rod_radius=t)).multipliers["A2b"]

    return brentq(pressure, 0.85 * pair.ball_radius, 0.9999 * pair.ball_radius, xtol=1e-13)


# -------------------------------------------------------------------- three ways to one number


@few
@given(lengths, drums)
def test_newtons_method_in_every_drum_gives_the_closed_form_of_the_plane(length, drum):
    pair = DumbbellPair(min(length, 2 * (drum - 3)), 3.0, 1.0, drum)
    found = critical_corner(pair)
    expected = critical_in_the_plane("rod_radius")(pair.length, 3.0)
    assert found.value == pytest.approx(expected, abs=1e-9)
    assert found.contacts == ("A2b", "aB1")
    assert found.minimum_below
    assert not found.minimum_above


@pytest.mark.parametrize("drum", [12.0, 125.0, math.inf])
@pytest.mark.parametrize("length", [12.0, 16.0])
def test_bisection_on_certified_multipliers_gives_it_too(length, drum):
    pair = DumbbellPair(length, 3.0, 1.0, drum)
    assert critical_rod_radius(pair) == pytest.approx(bisected(pair), abs=1e-9)


def test_closed_form_is_exact_in_the_models_own_formulas():
    """With r/l = 5/13 everything is rational: gaps close, and one contact balances the weight."""
    numbers = {LETTER_R: 5, L: 13}
    thickness = plane_critical_formula().subs(numbers)
    assert thickness == sympy.Rational(55, 13)
    pair = DumbbellPair(13, 5, float(thickness))
    half = sympy.Rational(6)  # l cos(theta) / 2
    angle = sympy.asin(sympy.Rational(5, 13))
    point = dict(
        zip(
            pair.manifold.symbols,
            (sympy.Rational(5, 2), -half, angle, sympy.Rational(-5, 2), half, angle),
            strict=True,
        )
    )
    sizes = dict(zip(sympy.symbols("l r t w", real=True), (13, 5, thickness, 0), strict=True))
    gap = dict(zip(pair.polyhedron.names, pair.polyhedron.functions, strict=True))
    for name in CORNER:
        assert sympy.simplify(gap[name].expression.subs(sizes).subs(point)) == 0
    for q in pair.manifold.symbols:
        pull = (pair.energy.expression - 5 * gap["A2B1"].expression).subs(sizes).diff(q)
        assert sympy.simplify(pull.subs(point)) == 0


@pytest.mark.parametrize("drum", [7, 20, 125])
def test_closed_form_holds_in_drums_to_forty_digits(drum):
    """The point where inner balls are side by side and outer ones lowest touches both rods."""
    with mpmath.workdps(50):
        r, length, rho = mpmath.mpf(3), mpmath.mpf(31) / 4, mpmath.mpf(drum - 3)
        side = mpmath.asin(r / rho) / 2
        angle = mpmath.asin(2 * rho / length * mpmath.sin(side))
        along = length * mpmath.cos(angle) / 2
        thickness = 2 * r * mpmath.sqrt(1 - (r / length) ** 2) - r
        point = (side, -along, angle, -side, along, angle)
        pair = DumbbellPair(float(length), 3, 1, drum)
        gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.functions, strict=True))
        names = sympy.symbols("l r t rho R w", real=True)
        sizes = (length, r, thickness, rho, mpmath.mpf(drum), mpmath.mpf(0))

        def precise(f):
            written = sympy.lambdify((*names, *pair.manifold.symbols), f.expression, "mpmath")
            return lambda *q: written(*sizes, *q)

        for name in CORNER:
            assert abs(precise(gaps[name])(*point)) < mpmath.mpf(10) ** -40
        slopes = []
        for f in (pair.energy, gaps["A2B1"]):
            g = precise(f)
            slopes.append(
                [mpmath.diff(g, point, tuple(row)) for row in np.eye(6, dtype=int).tolist()]
            )
        weight = slopes[0][0] / slopes[1][0]
        assert weight > 0
        for energy, touch in zip(*slopes, strict=True):
            assert abs(energy - weight * touch) < mpmath.mpf(10) ** -40


@given(st.floats(6.5, 60))
def test_length_and_thickness_are_inverse(length):
    thickness = critical_in_the_plane("rod_radius")(length, 3.0)
    assert critical_in_the_plane("length")(3.0, thickness) == pytest.approx(length, rel=1e-9)


@few
@given(st.floats(2.2, 2.97), drums)
def test_critical_length(thickness, drum):
    pair = DumbbellPair(6.0, 3.0, thickness, drum)
    expected = critical_in_the_plane("length")(3.0, thickness)
    if expected > 2 * (drum - 3):
        assert critical_length(pair) is None
    else:
        found = critical_corner(pair, "length")
        assert found.value == pytest.approx(expected, rel=1e-8)
        assert (found.minimum_below, found.minimum_above) == (False, True)


def test_what_does_not_matter():
    value = critical_rod_radius(PAIR)
    assert critical_rod_radius(replace(PAIR, rod_radius=2.95)) == pytest.approx(value, abs=1e-12)
    assert critical_rod_radius(replace(PAIR, rod_weight=1.3)) == pytest.approx(value, abs=1e-9)
    assert critical_corner(PAIR, chirality="L").value == pytest.approx(value, abs=1e-9)
    double = DumbbellPair(32, 6, 1, 250)
    assert critical_rod_radius(double) == pytest.approx(2 * value, abs=1e-9)


def test_thin_rods_have_no_critical_length_and_shortest_dumbbells_no_critical_rods():
    assert critical_length(PAIR) is None
    assert critical_length(replace(PAIR, rod_radius=2.9999)) is None  # beyond 100 r
    assert critical_rod_radius(replace(PAIR, length=6.0)) is None
    assert not any(
        on_face(replace(PAIR, length=6.0, rod_radius=t)).is_minimum
        for t in np.linspace(0.1, 2.99, 30)
    )


def test_at_the_critical_thickness_the_certificate_shows_the_way_down():
    found = critical_corner(PAIR)
    assert found.certificate.verdict is Verdict.SADDLE
    assert found.pair == replace(PAIR, rod_radius=found.value)
    assert found.certificate.residuals.worst < 1e-12


# ------------------------------------------------------------------- what becomes of the pair


@pytest.mark.parametrize("drum", [20.0, 125.0, math.inf])
@pytest.mark.parametrize("length", [8.0, 16.0, 30.0])
def test_the_pair_stays_on_one_side_and_falls_apart_on_the_other(length, drum):
    pair = DumbbellPair(length, 3.0, 1.0, drum)
    critical = critical_rod_radius(pair)
    for step, held in ((-1e-3, True), (1e-3, False)):
        thick = replace(pair, rod_radius=critical + step)
        corner = on_face(thick)
        assert corner.is_minimum == held
        rest = minimise(thick.polyhedron, thick.energy, corner.point)
        assert rest.is_minimum
        if held:
            assert rest.active == CORNER
        else:  # end to end on the lowest line, which is G; the balls may still touch, unpressed
            assert set(rest.active) <= {"A2B1"}
            np.testing.assert_allclose(rest.point[[0, 2, 3, 5]], 0, atol=1e-7)
            assert rest.point[4] - rest.point[1] > length + 6 - 1e-9


@pytest.mark.parametrize("step", [-0.05, 0.05])
@pytest.mark.parametrize("pair", [PAIR, PLANE])
def test_no_two_of_the_contacts_hold_the_pair_beside_the_critical_thickness(pair, step):
    """So nothing branches off that the pair could come to rest at: the end is a jump."""
    thick = replace(pair, rod_radius=critical_rod_radius(pair) + step)
    for left in CORNER:
        face = [name for name in CORNER if name != left]
        found = stationary_on(thick.polyhedron, thick.energy, on_face(thick).point, face)
        assert not found.is_minimum or set(found.active) != set(face)


@given(lengths, drums, st.sampled_from(["R", "L"]))
def test_the_pass(length, drum, chirality):
    pair = DumbbellPair(min(length, 2 * (drum - 3)), 3.0, 1.0, drum)
    top = mountain_pass(pair, chirality)
    assert top.verdict is Verdict.SADDLE
    assert top.active == ("A2B1",)
    assert top.multipliers["A2B1"] > 0
    assert int((top.curvatures < -1e-6).sum()) == 1
    a1, a2, b1, b2 = pair.ball_centres(top.point)
    np.testing.assert_allclose([a1[0], b2[0], a2[1] - b1[1]], 0, atol=1e-7)
    critical = critical_in_the_plane("rod_radius")(pair.length, 3.0)
    gaps = pair.polyhedron.values(top.point)[[pair.polyhedron.names.index(n) for n in CORNER[1:]]]
    np.testing.assert_allclose(gaps, critical - 1.0, atol=1e-9)


def test_energy_and_multiplier_of_the_pass_in_the_plane():
    top = mountain_pass(PLANE)
    assert top.energy == pytest.approx(9.0)  # r^2
    assert top.multipliers["A2B1"] == pytest.approx(3.0)
    assert math.sin(PLANE.heading(top.point)[0]) == pytest.approx(3 / 16)


@pytest.mark.parametrize("pair", [PAIR, PLANE])
def test_the_pass_leads_to_the_corner_and_away(pair):
    top = mountain_pass(pair)
    down = top.analysis.curvature.vectors[:, 0] * top.problem.scales
    ends = [
        minimise(pair.polyhedron, pair.energy, top.point + side * 0.02 * down) for side in (1, -1)
    ]
    assert {end.active for end in ends} == {CORNER, ()}
    assert all(end.is_minimum for end in ends)


def test_thicker_rods_do_not_fit_through_the_pass():
    assert mountain_pass(replace(PAIR, rod_radius=2.9)).verdict is Verdict.OUTSIDE
    assert escape_barrier(replace(PAIR, rod_radius=2.9)) is None


@given(st.floats(11, 40), st.floats(0.1, 0.8))
def test_barrier_in_the_plane(length, share):
    """The corner's energy is half the lesser eigenvalue of a quadratic form in the heading."""
    pair = DumbbellPair(length, 3.0, 3.0 * share)
    _, along, p = pair.plane_corner()
    form = np.array([[p**2, -along * p], [-along * p, along**2 + length**2]])
    rest = np.linalg.eigvalsh(form)[0] / 2
    assert escape_barrier(pair) == pytest.approx(9.0 - rest, rel=1e-9)


@pytest.mark.parametrize("pair", [PAIR, PLANE])
def test_barrier_vanishes_with_the_square_of_the_distance_to_the_critical_thickness(pair):
    critical = critical_rod_radius(pair)
    steps = np.array([0.02, 0.01, 0.005])
    barriers = [escape_barrier(replace(pair, rod_radius=critical - step)) for step in steps]
    assert 1.9 < np.polyfit(np.log(steps), np.log(barriers), 1)[0] < 2.1


def test_barrier_in_a_drum_is_that_of_the_plane_over_its_radius():
    radii = np.array([250.0, 500.0, 1000.0])
    drums = [replace(PAIR, drum_radius=radius) for radius in radii]
    away = [
        abs(drum.centre_radius * escape_barrier(drum) - escape_barrier(PLANE)) for drum in drums
    ]
    assert 1.9 < np.polyfit(np.log(1 / radii), np.log(away), 1)[0] < 2.1


def test_branches_meet_at_the_critical_thickness():
    critical = critical_rod_radius(PAIR)
    rods = [2.0, 2.5, critical - 1e-6, 2.95]
    corner, top = branches(PAIR, rods)
    assert corner.minimum.tolist() == [True, True, True, False]
    assert corner.equilibrium.tolist() == [True, True, True, False]
    assert top.equilibrium.tolist() == [True, True, True, False]
    assert not top.minimum.any()
    apart = np.abs(corner.headings - top.headings)
    assert apart[0] > 1
    assert apart[2] < 1e-4
    np.testing.assert_allclose(corner.gaps, 0, atol=1e-12)
    np.testing.assert_allclose(top.gaps, critical - np.array(rods), atol=1e-9)
    assert corner.energies[0] == pytest.approx(
        top.energies[0] - escape_barrier(replace(PAIR, rod_radius=2.0))
    )
