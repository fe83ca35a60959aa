"""Minima that doubles cannot tell from others, and contacts that a minimum does not need."""

from fractions import Fraction

import pytest
import sympy as sp
from faint_minima import regular
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import AnyOf, Manifold, Polyhedron, certify
from polycorner.proofs import prove
from polycorner.proofs.hypotheses import INACTIVE, POSITIVE

M2, M3 = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = M3.symbols
R = sp.Rational


def posed(manifold, parts, energy, q, equations=()):
    return certify(Polyhedron(manifold, parts, equations), energy, q)


def exact(proof):
    """Return bounds of the coordinates as fractions."""
    names = proof.certificate.problem.polyhedron.manifold.names
    return [tuple(map(Fraction, proof.enclosures[name])) for name in names]


def holds_point(proof, point):
    sides = exact(proof)
    return all(
        sp.Rational(lo) <= sp.N(v, 150) <= sp.Rational(up)
        for (lo, up), v in zip(sides, point, strict=True)
    )


# ----------------------------------------------------------------- small multipliers, small angles

small = st.tuples(st.integers(1, 9), st.integers(0, 30)).map(lambda t: t[0] * 10.0 ** -t[1])
angles = st.tuples(st.integers(1, 9), st.integers(2, 12)).map(lambda t: t[0] * 10.0 ** -t[1])


@settings(max_examples=12)
@given(angles, small, small, st.integers(-2, 2))
def test_regular_minima_are_proved_at_any_angle_and_with_any_multipliers(angle, first, second, b):
    p = prove(regular(angle, first, second, b / 4))
    assert p.proved, str(p)
    assert p.active == ("f", "g")
    assert holds_point(p, (0, 0, 0))
    for name, value in (("f", first), ("g", second)):
        lower, upper = map(Fraction, p.enclosures[f"multiplier {name}"])
        assert lower <= Fraction(value) <= upper


@settings(max_examples=12)
@given(angles, small, small, st.integers(-2, 2), st.sampled_from([(1, -1), (-1, 1), (-1, -1)]))
def test_none_of_them_is_proved_when_a_contact_pulls(angle, first, second, b, signs):
    p = prove(regular(angle, signs[0] * first, signs[1] * second, b / 4))
    if p.proved:  # somewhere beside, on fewer contacts
        assert len(p.active) < 2
        assert not holds_point(p, (0, 0, 0)) or first < 1e-25 or second < 1e-25
    assert p.proved or set(p.conditions.values()) != {"proved"}


# ------------------------------------------------------------------- weak, redundant and dependent

P, S = R(1, 3), sp.sqrt(2)
UNNEEDED = {
    "HS17": (
        M2,
        {"g": y**2 - x, "h": x**2 - y, "low": x + R(1, 2), "high": R(1, 2) - x, "top": 1 - y},
        100 * (y - x**2) ** 2 + (1 - x) ** 2,
        (0, 0),
        "g",
    ),
    "HS30": (M3, {"g": x**2 + y**2 - 1, "low": x - 1, "y": y + 10}, x**2 + y**2 + z**2, (1, 0, 0),
             "low"),
    "HS32": (M3, {"g": 6 * y + 4 * z - x**3 - 3, "x": x, "y": y, "z": z},
             (x + 3 * y + z) ** 2 + 4 * (x - y) ** 2, (0, 0, 1), "y"),
    "a weak contact": (M2, {"f": x}, x**2 + y**2, (0, 0), ""),
    "the same contact twice": (M2, {"f": x, "g": 2 * x}, x + y**2, (0, 0), "f"),
    "dependent gradients": (M2, {"f": x, "g": y, "h": x + y}, x + y, (0, 0), "fg"),
    "a function that is 0 at the point": (M2, {"f": x + y}, x**2 + y**2, (0, 0), ""),
    "at a third": (M2, {"f": x - P, "g": y - P}, (x - P) ** 2 + (y - P) ** 2, (P, P), ""),
    "at a root": (M2, {"f": x**2 - 2, "g": x**4 - 4}, x + y**2, (S, 0), "f"),
    "at a root in the numbers": (M2, {"f": x - S, "g": y - 1 + S}, x + (y - 1 + S) ** 2, (S, 1 - S),
                                 "f"),
    "at pi": (M2, {"f": x - sp.pi, "g": sp.sin(y)}, x + y**2, (sp.pi, 0), "f"),
    "on a transcendental curve": (M2, {"f": sp.exp(x) - 2, "g": (sp.exp(x) - 2) * (1 + y**2)},
                                  x + y**2, (sp.log(2), 0), "f"),
}  # fmt: skip


@pytest.mark.parametrize("case", UNNEEDED)
def test_contacts_that_a_minimum_does_not_need_are_exactly_zero(case):
    manifold, parts, energy, point, active = UNNEEDED[case]
    equations = {"sum": 1 - x - y - z} if case == "HS32" else {}
    p = prove(posed(manifold, parts, energy, [float(v) for v in point], equations))
    assert p.proved, str(p)
    assert holds_point(p, point)
    assert p.active == ((active,) if active in parts else tuple(active))
    assert "exactly 0 there" in p.reasons[INACTIVE]


EQUATIONS = {
    "twice": ([x, 2 * x], True),
    "a multiple": ([x + y * z, (x + y * z) * (1 + y**2)], True),
    "three in a plane": ([x + y, x - y, x], True),
    "nearly the same": ([x, x + R(1, 10**30) * y], True),
    "not the same": ([x, x + R(1, 10**30)], False),
}


@pytest.mark.parametrize("case", EQUATIONS)
def test_equations_that_depend_on_each_other_are_equations_like_any_other(case):
    equations, proved = EQUATIONS[case]
    named = {f"h{k}": e for k, e in enumerate(equations)}
    p = prove(posed(M3, {"far": z + 9}, x + y**2 + z**2, [0, 0, 0], named))
    assert p.proved == proved, str(p)


# Functions that vanish in doubles, and only there: nothing that needs them to be 0 is proved.
ALMOST = {
    "nearly redundant": (M2, {"f": x, "g": x - R(1, 10**40) + y**2}, x),
    "half a parabola": (M2, {"f": x, "g": x - y**2}, x - y**2),
    "a parabola, nearly": (M2, {"f": x, "g": x - y**2}, x - (1 + R(1, 10**40)) * y**2),
    "a union": (M2, AnyOf(x, x - y**2), x - y**2 / 2),
}


@pytest.mark.parametrize("case", ALMOST)
def test_what_is_not_exactly_zero_or_needed_is_not_left_out(case):
    manifold, parts, energy = ALMOST[case]
    p = prove(posed(manifold, parts, energy, [0, 0]))
    assert not p.proved, str(p)


def test_a_multiplier_that_is_exactly_zero_is_said_to_be():
    # The energy's second order needs the weak contact: dropping it leaves a saddle.
    p = prove(posed(M2, {"f": x, "g": y}, x + y**3, [0, 0]))
    assert not p.proved
    assert p.conditions[POSITIVE] in {"proved", "undecided"}
