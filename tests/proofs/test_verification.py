"""Proofs of single points: what is proved, what is refuted, what stays undecided, and why."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp
from enclosing import contains, precise
from problems import REGULAR, hs13, hs26

from polycorner import (
    AllOf,
    AnyOf,
    Manifold,
    Polyhedron,
    SmoothFunction,
    certify,
    minima,
    minimise,
)
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.proofs import Proof, prove
from polycorner.proofs.hypotheses import CURVED, INACTIVE, INDEPENDENT, POSITIVE, SYMMETRIC, UNIQUE

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")

M = Manifold.euclidean("x y")
x, y = M.symbols


def proof_at(parts, energy, q, **options):
    return prove(certify(Polyhedron(M, parts), energy, q), **options)


# ------------------------------------------------------------------------------------- what is said


def test_the_bowl_is_proved_with_its_exact_numbers():
    D = Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y})
    p = prove(minimise(D, x + y, [1.0, 1.5]))
    assert p.proved
    assert p.active == ("bowl",)
    assert p.symmetry == ()
    assert set(p.conditions.values()) == {"proved"}
    assert set(p.conditions) == set(p.reasons) == {UNIQUE, INDEPENDENT, POSITIVE, INACTIVE, CURVED}
    truths = {"x": -0.5, "y": 0.25, "energy": -0.25, "multiplier bowl": 1.0}
    assert set(p.enclosures) == set(truths)
    for name, truth in truths.items():
        assert contains(p.enclosures[name], truth)
        lower, upper = map(Fraction, p.enclosures[name])
        assert upper - lower <= Fraction(2, 10**30)
    assert p.proved_fraction == 1.0
    assert p.undecided == ()


@pytest.mark.parametrize("posed", REGULAR, ids=lambda posed: posed.name)
def test_regular_optima_are_proved_about_their_forty_digits(posed):
    p = prove(certify(posed.polyhedron, posed.energy, [float(v) for v in posed.solution[0]]))
    assert p.proved, str(p)
    assert p.active == posed.active
    point, multipliers = posed.solution
    with mpmath.workdps(60):
        for symbol, truth in zip(posed.coordinates, point, strict=True):
            assert contains(p.enclosures[symbol.name], truth) or near(p, symbol.name, truth)
        for name, truth in multipliers.items():
            assert near(p, f"multiplier {name}", truth)


def near(p, name, truth):
    """Whether a number known to some 35 digits agrees with an enclosure of 30."""
    lower, upper = (precise(side) for side in p.enclosures[name])
    small = mpmath.mpf(10) ** -28 * (1 + abs(truth))
    return lower - small <= truth <= upper + small


@pytest.mark.parametrize("posed", [hs13(), hs26()], ids=lambda posed: posed.name)
def test_a_cusp_and_a_degenerate_valley_are_not_proved(posed):
    p = prove(certify(posed.polyhedron, posed.energy, [float(v) for v in posed.optimum]))
    assert not p.proved
    assert p.conditions[UNIQUE] == "undecided"
    assert p.proved_fraction == 0.0
    assert "no enclosure" in p.reasons[CURVED]


CASES = {
    "a saddle": ({"f": x}, x - y**2, CURVED, "failed"),
    "a pulling contact": ({"f": x}, y**2 - x, POSITIVE, "failed"),
    "outside": ({"f": y - 1}, x**2 + y**2, INACTIVE, "failed"),
    "a flat direction": ({"f": x}, x + y**4, UNIQUE, "undecided"),
    "a cusp": ({"f": y - x**2, "g": -y - x**2}, y + x, UNIQUE, "undecided"),
    "a slope": ({"f": x + 1}, x + y, UNIQUE, "undecided"),
    "a kink": ({"f": y}, y + sp.Abs(x), UNIQUE, "undecided"),
    "beside the cut of an angle": (
        {"f": x + 1}, x**2 + y**2 + sp.atan2(y, x - 1) ** 2, UNIQUE, "undecided"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_no_provable_minimum_is_said_to_be_none(case):
    parts, energy, condition, status = CASES[case]
    p = proof_at(parts, energy, [0, 0])
    assert not p.proved
    assert p.conditions[condition] == status
    assert p.reasons[condition]


@pytest.mark.parametrize("power", [30, 60, 90])
@pytest.mark.parametrize("sign", [1, -1])
def test_what_rounding_cannot_tell_from_zero_is_decided(power, sign):
    tiny = sign * sp.Rational(1, 2**power)
    p = proof_at({"f": x}, tiny * x + x**2 + y**2, [0, 0], digits=40)
    assert p.proved
    assert p.active == (("f",) if sign > 0 else ())
    if sign < 0:
        with mpmath.workdps(60):
            assert contains(p.enclosures["x"], mpmath.mpf(2) ** (-power - 1))
    q = proof_at({"f": y}, y + tiny * x**2, [0, 0], digits=40)
    assert q.proved == (sign > 0)
    assert q.conditions[CURVED] == ("proved" if sign > 0 else "failed")
    r = proof_at({"f": x, "g": y + tiny}, x + x**2 + y**2, [0, 0], digits=40)
    assert r.proved
    assert r.active == (("f",) if sign > 0 else ("f", "g"))


def test_of_dependent_gradients_those_that_hold_are_chosen():
    tiny = sp.Rational(1, 10**12)
    p = proof_at({"f": x, "g": y, "h": x + y + tiny}, x + y, [0, 0])
    assert p.proved
    assert p.active == ("f", "g")


def test_exact_irrational_numbers_are_enclosed_not_rounded():
    p = proof_at({"f": y - sp.Rational(1, 3)}, x**2 + sp.pi * y, [0, 1 / 3], digits=60)
    with mpmath.workdps(80):
        assert contains(p.enclosures["multiplier f"], +mpmath.pi)
        assert contains(p.enclosures["energy"], mpmath.pi / 3)
        assert contains(p.enclosures["y"], mpmath.mpf(1) / 3)
    rounded = proof_at({"f": y - 0.1}, x**2 + y, [0, 0.1], digits=30)
    lower, upper = (Fraction(side) for side in rounded.enclosures["y"])
    assert lower <= Fraction(0.1) <= upper
    assert not lower <= Fraction(1, 10) <= upper


def test_equations_hold_with_multipliers_of_either_sign():
    D = Polyhedron(M, {"far": x + 9}, {"line": x + y - 2})
    p = prove(certify(D, x**2 + y**2 - 6 * y, [-0.5, 2.5]))
    assert p.proved
    assert contains(p.enclosures["multiplier line"], -1)
    assert p.active == ()


def test_branches_are_taken_only_where_they_are_decided():
    energy = y + sp.Abs(x - 1) + x**2
    assert proof_at({"f": y}, energy, [0.5, 0]).proved
    step = sp.Piecewise((1, x <= 0), (-1, True))
    beside = proof_at({"f": step}, x**2 + y**2, [0, 0])
    assert beside.conditions[INACTIVE] == "undecided"  # positive there, but not nearby
    assert proof_at({"f": sp.Piecewise((1, x < 1), (-1, True))}, x**2 + y**2, [0, 0]).proved


# ------------------------------------------------------------------------------------------- unions


@pytest.mark.parametrize(
    ("tree", "q", "proved"),
    [
        (AnyOf(x, y - 3), [0, 0], True),
        (AnyOf(x, y + 3), [0, 0], False),
        (AllOf(AnyOf(x, y - 1), x + y**2 + 1), [0, 0], True),
        (AnyOf(x, x + y**2 - 1), [0, 0], True),
        (AnyOf(x, 2 * x), [0, 0], False),
        (AllOf(x, AnyOf(y + 1, y - 1)), [0, 0], True),
        (AllOf(x, AnyOf(y + 1, y)), [0, 0], True),
        (AnyOf(x, x + sp.Rational(1, 2**70)), [0, 0], False),
        (AnyOf(x, x - sp.Rational(1, 2**70)), [0, 0], True),
    ],
)
def test_a_union_is_proved_where_every_branch_asks_for_the_same(tree, q, proved):
    p = prove(certify(Polyhedron(M, tree), x + y**2, q))
    assert p.proved == proved, str(p)


def test_an_open_branch_refutes_a_minimum_that_rounding_suggests():
    c = certify(Polyhedron(M, AnyOf(x, x + sp.Rational(1, 2**70))), x + y**2, [0, 0])
    assert c.is_minimum
    p = prove(c)
    assert p.conditions[INACTIVE] == "failed"
    assert "more, or less, than f1 alone there: f2 lies in" in p.reasons[INACTIVE]


# ------------------------------------------------------------------------------------- symmetries


def test_translations_are_found_without_being_declared():
    p = proof_at({"f": x - y}, (x - y) ** 2 + x - y, [0, 0])
    assert p.proved
    assert p.symmetry == ("d/dx + d/dy",)
    assert p.conditions[SYMMETRIC] == "proved"


def test_a_rotation_is_checked_when_it_is_declared():
    ring, energy = {"f": x**2 + y**2 - 1}, x**2 + y**2
    assert not proof_at(ring, energy, [1, 0]).proved
    p = proof_at(ring, energy, [1, 0], symmetry=Symmetry(fields=[{"x": -y, "y": x}]))
    assert p.proved
    assert p.symmetry == ("(-y) d/dx + (x) d/dy",)
    wrong = proof_at(ring, energy, [1, 0], symmetry=Symmetry(fields=[{"x": 1}]))
    assert wrong.conditions[SYMMETRIC] == "failed"
    assert not wrong.proved


def test_one_symmetry_serves_the_search_and_the_proof():
    turn = Symmetry(
        fields=[{"x": -y, "y": x}], invariants=lambda q: np.array([np.hypot(q[0], q[1])])
    )
    ring = Polyhedron(M, {"f": x**2 + y**2 - 1})
    starts = [[1.5, 0.2], [-0.3, 1.4], [-2, 1]]
    (found,) = minima(ring, x**2 + y**2, starts=starts, symmetry=turn)
    assert found.energy == pytest.approx(1)
    assert not prove(found).proved
    assert prove(found, symmetry=turn).proved


def test_fields_that_enclose_a_small_angle_are_one_within_the_rank_tolerance():
    """Of an angle of 1e-4; the other direction is then that of a translation that was found."""
    m = Manifold.euclidean("x y z")
    x = m.symbols[0]
    fields = Symmetry(fields=[(0, 1, 0), (0, 1, sp.Rational(1, 10_000))])
    told = [
        prove(certify(Polyhedron(m, [1 - x]), x**2, np.zeros(3), rank_tolerance=r), symmetry=fields)
        for r in (1e-5, 1e-3)
    ]
    assert all(p.proved for p in told)
    assert told[0].symmetry == ("d/dy", "d/dy + 1/10000 d/dz")
    assert told[1].symmetry == ("d/dy", "d/dz")


def test_the_minimum_may_be_farther_from_a_point_of_a_larger_tolerance():
    """It is 2e-3 away; the limit is 1e-3, or 1e-3 (1e-6 / 1e-8)^(3/8) = 5.6e-3."""
    m = Manifold.euclidean("x")
    (x,) = m.symbols
    D, energy = Polyhedron(m, [1 - x]), (x - sp.Rational(2, 1000)) ** 2
    told = [prove(certify(D, energy, [0.0], tolerance=t)) for t in (1e-8, 1e-6)]
    assert [p.proved for p in told] == [False, True]


def test_a_flat_direction_that_is_no_symmetry_is_named():
    p = proof_at({"f": x**2 + y**2 - 1}, x**2 + y**2, [1, 0])
    assert p.conditions[UNIQUE] == "undecided"
    assert "flat along y" in p.reasons[UNIQUE]


def test_an_energy_that_bends_only_to_fourth_order_is_no_symmetry():
    p = proof_at({"f": x}, x + y**4, [0, 0], symmetry=Symmetry(fields=[{"y": 1}]))
    assert not p.proved
    assert p.conditions[SYMMETRIC] in {"failed", "undecided"}


# --------------------------------------------------------------------------------------- enclosures


def test_the_box_of_uniqueness_holds_the_enclosure_and_no_other_minimum():
    p = proof_at({"far": x + 100}, (x**2 - 1) ** 2 + y**2, [1, 0])
    assert p.proved
    for name in ("x", "y"):
        lower, upper = (Fraction(side) for side in p.box[name])
        assert lower <= Fraction(p.enclosures[name][0])
        assert Fraction(p.enclosures[name][1]) <= upper
    lower, upper = (Fraction(side) for side in p.box["x"])
    assert 0 < lower < 1 < upper  # neither the saddle at 0 nor the minimum at -1
    assert upper - lower > Fraction(1, 1000)


def test_derived_quantities_are_enclosed():
    p = proof_at({"f": x**2 - 2}, x + y**2, [math.sqrt(2), 0], digits=40)
    with mpmath.workdps(60):
        assert contains(p.enclose(sp.exp(x)), mpmath.exp(mpmath.sqrt(2)))
        assert contains(p.enclose(SmoothFunction("twice", 2 * x, M)), 2 * mpmath.sqrt(2))


def test_a_point_that_is_far_from_any_solution_is_undecided():
    p = proof_at({"f": x + 1}, sp.cosh(x) + y**2, [0.05, 0])
    assert p.conditions[UNIQUE] == "undecided"
    assert "scale units from the point" in p.reasons[UNIQUE]
    assert isinstance(p, Proof)


def test_a_starting_point_violates_no_branch_that_is_not_its_own():
    """0.3 as a double is below 3/10, in the one branch; the other is far from holding there."""
    d = Polyhedron(M, [AnyOf(x - sp.Rational(3, 10), y - 5), y + 1])
    found = prove(minimise(d, x**2 + y**2, [1.0, 0.2]))
    assert found.proved
    assert found.outside.keys() == {"f1"}
    assert float(found.outside["f1"]) == pytest.approx(float(Fraction(0.3) - Fraction(3, 10)))
