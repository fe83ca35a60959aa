"""Section 6: expected verdicts, and its checks against independent computations."""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from paper_checks import Verdict
from paper_checks.section6 import corner, ends, energetics, experiment, grip
from paper_checks.section6.experiment import EXPERIMENT, PLANE


@pytest.mark.parametrize("pair", [EXPERIMENT, PLANE], ids=["drum", "plane"])
def test_the_definitions_are_those_of_the_library(pair):
    places = pair.placements(np.random.default_rng(3), 40)
    variables = [pair.manifold.symbols]
    gaps = dict(
        zip(pair.polyhedron.names, pair.polyhedron.bundle.evaluate(places, 0)[0].T, strict=True)
    )
    for a, b in itertools.product(("A1", "A2"), ("B1", "B2")):
        own = sympy.lambdify(variables, experiment.between(pair, a, b))
        apart = np.array([float(own(q)) for q in places])
        np.testing.assert_allclose(apart - 2 * pair.ball_radius, gaps[a + b], atol=1e-12)
    reach = pair.ball_radius + pair.rod_radius
    for ball, contact in (("A1", "A1b"), ("A2", "A2b"), ("B1", "aB1"), ("B2", "aB2")):
        own = sympy.lambdify(variables, experiment.to_axis(pair, ball))
        line = np.array([float(own(q)) for q in places]) - reach
        assert (line <= gaps[contact] + 1e-12).all()  # a segment is part of its line
        assert (abs(line - gaps[contact]) < 1e-12).any()


def test_the_energy_is_that_of_the_library():
    energy = sympy.lambdify([EXPERIMENT.manifold.symbols], experiment.height(EXPERIMENT))
    places = EXPERIMENT.placements(np.random.default_rng(5), 40)
    own = np.array([float(energy(q)) for q in places])
    np.testing.assert_allclose(own, EXPERIMENT.energy.value(places), rtol=1e-14)


@given(st.lists(st.fractions(-5, 5), min_size=9, max_size=9), st.fractions(0, 1))
def test_the_determinant_of_intervals_contains_that_of_what_is_in_them(entries, width):
    exact = sympy.Matrix(3, 3, [sympy.Rational(x) for x in entries]).det()
    rows = [[(x, x) for x in entries[k : k + 3]] for k in (0, 3, 6)]
    assert experiment.determinant(rows) == (Fraction(str(exact)), Fraction(str(exact)))
    wide = [[(x - width, x + width) for x in entries[k : k + 3]] for k in (0, 3, 6)]
    assert experiment.has(experiment.determinant(wide), exact)


def test_an_unbalanced_point_is_not_called_balanced(monkeypatch):
    found = experiment.proof(EXPERIMENT, "delta_R")
    low, high = (sympy.Rational(x) + sympy.Rational(1, 10**3) for x in found.enclosures["phi2"])
    moved = replace(found, enclosures={**found.enclosures, "phi2": (str(low), str(high))})
    assert corner.half_turn_fixes_the_corner()
    monkeypatch.setattr(corner, "proof", lambda *_: moved)
    assert not corner.half_turn_fixes_the_corner()


def test_only_outer_balls_with_weight_and_thick_rods_give_the_printed_heading():
    length, r = 16.0, 3.0
    angles = np.linspace(0, 0.5, 200_001)
    along = np.array([length, -length])  # the touching balls are beside each other for t = r
    outer = (along[0] + length) * np.sin(angles) - 2 * r * np.cos(angles)
    assert math.isclose(angles[abs(outer).argmin()], math.atan(r / length), abs_tol=1e-5)


@pytest.mark.parametrize("formula", [corner.BALL / corner.LENGTH, 2 * corner.PRINTED_HEADING])
def test_another_wrong_heading_is_corrected(formula):
    assert corner.heading_is(formula).verdict is Verdict.CORRECTED


def test_a_heading_that_is_right_in_the_drum_only_nearly_is_not_called_exact():
    shifted = corner.plane_formula() + sympy.Rational(1, 10**25)
    assert corner.heading_is(shifted).verdict is Verdict.CORRECTED


def test_each_way_of_missing_a_rest_locus_is_noticed():
    for named in (frozenset({"G"}), energetics.NAMED | {"crossed"}):
        assert energetics.only_loci(named, energetics.OTHERS[:1]).verdict is Verdict.REFUTED


def test_the_components_of_delta_are_its_images_under_relabelling():
    q = experiment.rests(EXPERIMENT)["delta_R"].point
    turned = [EXPERIMENT.half_turn(p, k) for p in (q, EXPERIMENT.swap(q)) for k in "AB"]
    places = set()
    for p in (q, EXPERIMENT.swap(q), *turned):
        p1, e1, t1, p2, e2, t2 = EXPERIMENT.canonical(p)
        places.add(tuple(np.round([p1, t1, p2, t2, e2 - e1], 6) + 0.0))
    assert places == energetics.resting_places()["delta_R"]


def test_without_names_there_is_one_component_each():
    assert energetics.half_lines(components=1, ordered=False).verdict is Verdict.HOLDS


def test_a_limit_below_the_critical_one_holds_and_one_above_does_not():
    critical = energetics.critical_formula()
    assert energetics.minimum_below(critical * 0.99).verdict is Verdict.HOLDS
    assert energetics.minimum_below(critical * 1.01).verdict is Verdict.HOLDS_UNDER


def test_friction_weaker_than_the_pull_would_leave_the_force_to_hold():
    assert grip.force_holds_the_pair(rolling=0.01).verdict is Verdict.HOLDS
    assert grip.force_holds_the_pair(rolling=0.012).verdict is Verdict.HOLDS_UNDER


def test_other_dumbbells_have_their_own_gap():
    assert ends.gap_of_ends(pair=energetics.BUNCH).verdict is Verdict.HOLDS
    assert ends.gap_of_ends(components=1).verdict is Verdict.CORRECTED
