"""The heading of the dyad: two ways to every number, and the order in which they agree."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import sympy
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from polycorner import minimise
from polycorner.dumbbells import (
    DumbbellPair,
    dyad_minima,
    heading_curve,
    paper_heading,
    plane_heading_formula,
)

derived_formula = cache(plane_heading_formula)
FORMULA_SYMBOLS = sympy.symbols("l r t", positive=True)
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
lengths, shares = st.floats(12, 30), st.floats(0.1, 0.8)


def trough(theta, length, along, across):
    """Half the sum of squared lateral positions, from the four ball centres."""
    axis = np.array([math.sin(theta), math.cos(theta)])
    normal = np.array([-math.cos(theta), math.sin(theta)])
    offset = along * axis + across * normal
    centres = [s * offset / 2 + e * length / 2 * axis for s in (-1, 1) for e in (-1, 1)]
    return sum(c[0] ** 2 for c in centres) / 2


@given(lengths, shares)
def test_closed_form_minimises_the_trough_energy_of_the_rigid_corner(length, share):
    pair = DumbbellPair(length, 3.0, 3.0 * share)
    theta, along, across = pair.plane_corner()
    found = minimize_scalar(
        trough, bounds=(-0.7, 0.7), args=(length, along, across), options={"xatol": 1e-12}
    )
    assert abs(found.x - theta) < 1e-7


def test_closed_form_is_the_root_of_the_symbolic_derivative():
    theta, along, across, length = sympy.symbols("theta D p l", positive=True)
    dx = along * sympy.sin(theta) - across * sympy.cos(theta)
    energy = (dx**2 + length**2 * sympy.sin(theta) ** 2) / 2
    tangent = 2 * along * across / (along**2 + length**2 - across**2)
    slope = sympy.diff(energy, theta).rewrite(sympy.tan)
    at_root = slope.subs(theta, sympy.atan(tangent) / 2)
    for values in ((12, sympy.Rational(9, 2), 16), (9, sympy.Rational(37, 10), 14), (20, 5, 25)):
        number = at_root.subs(dict(zip((along, across, length), values, strict=True)))
        assert abs(complex(number.evalf(30))) < 1e-25


@given(lengths, shares)
def test_plane_optimum_is_the_closed_form(length, share):
    pair = DumbbellPair(length, 3.0, 3.0 * share)
    corner = minimise(pair.polyhedron, pair.energy, pair.nested("R"))
    assert corner.is_minimum
    assert abs(corner.point[2] - pair.plane_corner()[0]) < 1e-10


@given(lengths, shares)
def test_drum_approaches_the_plane_with_the_square_of_its_curvature(length, share):
    plane = DumbbellPair(length, 3.0, 3.0 * share)
    radii = np.array([400.0, 800.0, 1600.0])
    headings = [
        dyad_minima(replace(plane, drum_radius=float(radius)))[0].headings[0] for radius in radii
    ]
    gaps = np.abs(np.array(headings) - math.degrees(plane.plane_corner()[0]))
    order = np.polyfit(np.log(1 / radii), np.log(gaps), 1)[0]
    assert 1.9 < order < 2.1


@given(lengths, shares)
def test_multipliers_of_the_drum_approach_those_of_the_plane(length, share):
    plane = DumbbellPair(length, 3.0, 3.0 * share)
    flat = dyad_minima(plane)[0].multipliers
    drum = replace(plane, drum_radius=1e4)
    curved = dyad_minima(drum)[0].multipliers
    for contact, value in flat.items():
        assert abs(drum.centre_radius * curved[contact] - value) < 1e-4 * max(1.0, abs(value))


def test_mirror_image():
    pair = replace(PAIR, drum_radius=125.0)
    right, left, _ = dyad_minima(pair)
    image = pair.mirror(right.point)
    np.testing.assert_allclose(
        pair.manifold.difference(image, left.point)[[0, 2, 3, 5]], 0, atol=1e-12
    )


def test_the_papers_heading_is_exact_when_only_outer_balls_weigh_and_rods_are_thick():
    r, length = sympy.symbols("r l", positive=True)
    across, along = 2 * r, length  # t = r
    outer = sympy.atan(across / (along + length))
    assert sympy.simplify(outer - sympy.atan(r / length)) == 0


@given(lengths, shares)
def test_derived_formula_is_the_number_the_model_uses(length, share):
    pair = DumbbellPair(length, 3.0, 3.0 * share)
    sizes = (length, pair.ball_radius, pair.rod_radius)
    number = derived_formula().subs(dict(zip(FORMULA_SYMBOLS, sizes, strict=True))).evalf()
    assert math.isclose(float(number), pair.plane_corner()[0], rel_tol=1e-12)


def test_curve_keeps_what_is_no_minimum_apart():
    headings, rests = heading_curve(replace(PAIR, rod_radius=2.95), [16.0, 20.0])
    assert not rests.any()
    assert np.isfinite(headings).all()


def test_paper_heading_is_the_arctangent():
    assert math.isclose(math.tan(math.radians(paper_heading(PAIR))), 3 / 16)
