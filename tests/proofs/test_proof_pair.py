"""Proofs of where two dumbbells rest: in the drum, and in the plane against its closed form."""

from fractions import Fraction

import mpmath
import pytest
import sympy as sp
from enclosing import contains
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, certify, minimise, stationary_on
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.formulas import plane_heading_formula
from polycorner.proofs import prove
from polycorner.proofs.hypotheses import CURVED

CORNER = ("A2B1", "A2b", "aB1")


def width(sides):
    return Fraction(sides[1]) - Fraction(sides[0])


@pytest.fixture(scope="module")
def drum():
    return DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)


@pytest.fixture(scope="module")
def corner(drum):
    return minimise(drum.polyhedron, drum.energy, drum.nested("R"))


def test_a_pair_in_the_drum_is_proved_modulo_its_shift(corner):
    p = prove(corner)
    assert p.proved, str(p)
    assert p.active == CORNER
    assert p.symmetry == ("d/deta1 + d/deta2",)
    names = corner.problem.polyhedron.manifold.names
    for name, value in zip(names, corner.point, strict=True):
        lower, upper = map(float, p.enclosures[name])
        assert lower - 1e-9 <= value <= upper + 1e-9


@pytest.mark.parametrize("chirality", ["R", "L"])
def test_in_the_plane_the_heading_is_the_closed_form(chirality):
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
    p = prove(minimise(pair.polyhedron, pair.energy, pair.nested(chirality)), digits=50)
    assert p.proved, str(p)
    formula = plane_heading_formula()
    sizes = {"l": 16, "r": 3, "t": sp.Rational(3, 2)}
    heading = sp.N(formula.subs({s: sizes[s.name] for s in formula.free_symbols}), 80)
    with mpmath.workdps(80):
        truth = mpmath.mpf(heading) * (1 if chirality == "R" else -1)
        assert contains(p.enclosures["theta1"], truth)
        assert contains(p.enclosures["theta2"], truth)
    first = next(s for s in pair.manifold.symbols if s.name == "theta1")
    with mpmath.workdps(80):
        assert contains(p.enclose(180 * first / sp.pi), truth * 180 / mpmath.pi)


@settings(max_examples=8)
@given(
    st.floats(13, 18), st.floats(1.0, 1.8), st.floats(80, 300), st.sampled_from([0.0, 1e-13, 1e-9])
)
def test_pairs_of_any_size_are_proved(length, rod, radius, away):
    pair = DumbbellPair(length, 3, rod, radius)
    c = minimise(pair.polyhedron, pair.energy, pair.nested("R"))
    p = prove(certify(pair.polyhedron, pair.energy, c.point + away))
    assert p.proved, str(p)
    assert p.active == CORNER


def test_a_symmetric_saddle_of_the_pair_is_refuted(drum):
    contacts = ["A1B1", "A2B2"]
    c = stationary_on(drum.polyhedron, drum.energy, drum.side_by_side(), contacts)
    p = prove(c)
    assert p.active == ("A1B1", "A2B2")
    assert p.conditions[CURVED] == "failed"


@pytest.mark.parametrize("digits", [1, 7, 30, 250])
def test_as_many_digits_come_as_were_asked_for(corner, digits):
    p = prove(corner, digits=digits)
    assert p.proved
    for lower, upper in p.enclosures.values():
        size = max(abs(Fraction(lower)), abs(Fraction(upper)))
        assert width((lower, upper)) <= 2 * size / Fraction(10) ** (digits - 1)


def test_more_digits_lie_inside_fewer(corner):
    few, many = prove(corner, digits=20), prove(corner, digits=1000)
    for name, (lower, upper) in many.enclosures.items():
        assert Fraction(few.enclosures[name][0]) <= Fraction(lower)
        assert Fraction(upper) <= Fraction(few.enclosures[name][1])
        assert Fraction(upper) - Fraction(lower) < Fraction(1, 10**990)


def test_a_proof_reads_as_a_table(corner):
    text = str(prove(corner, digits=12))
    assert text.startswith("Proof\nverdict")
    assert "theta1 (rad)" in text
    assert "strict local minimum, modulo d/deta1 + d/deta2: proved" in text
    assert "multiplier A2B1" in text
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    saddle = certify(Polyhedron(M, {"f": x}), x - y**2, [0, 0])
    assert "not proved" in str(prove(saddle))
