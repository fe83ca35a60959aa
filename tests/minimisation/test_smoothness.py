"""Points where the optimality conditions do not apply: never a verdict, never a crash."""

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from sympy import Abs, Max, Min, Piecewise, Rational, acos, asin, log, sqrt

from polycorner import (
    Manifold,
    NonsmoothWarning,
    Polyhedron,
    Verdict,
    certify,
    minimise,
    prove,
    stratum_at,
)
from polycorner.polyhedra import LocalType

M = Manifold.euclidean("x y")
X, Y = M.symbols
R = sqrt(X**2 + Y**2)
KINKED = {
    "kink of the energy": ({"f": 1 - X}, Abs(X) + Y**2),
    "curvature that jumps": ({"f": 1 - X}, X * Abs(X) + Y**2),
    "third power": ({"f": 1 - X}, X**2 * Piecewise((1, X > 0), (3, True)) + Y**2),
    "largest of three": ({"f": 1 - X}, Max(X, -X, Y) + Y**2),
    "kink of a constraint": ({"f": Y + X * Max(X, Y)}, Y + X**2),
}
INFINITE = {
    "root": ({"f": sqrt(X), "g": Y}, X + Y),
    "root of the energy": ({"f": X, "g": Y}, sqrt(X) + Y),
    "root that falls": ({"f": X, "g": Y}, -sqrt(X) + Y),
    "power": ({"f": X, "g": Y}, X ** Rational(3, 2) + Y),
    "edge of a domain": ({"f": 1 - sqrt(X), "g": Y}, X + Y),
    "distance": ({"f": 1 - R}, R),
    "tip of a cone": ({"f": Y - R}, Y),
    "angle": ({"f": acos(1 - X), "g": Y}, X + Y),
    "angle of the energy": ({"f": X, "g": Y}, -asin(1 - X) + Y),
}


def examined(parts, energy):
    c = certify(Polyhedron(M, parts), energy, [0.0, 0.0])
    proof = prove(c)
    assert c.explain()
    assert str(c)
    assert str(proof)
    assert str(c.lemma)
    assert not proof.proved
    assert not c.holds()
    return c


@pytest.mark.filterwarnings("ignore::polycorner.NonsmoothWarning")
@pytest.mark.parametrize("case", KINKED)
def test_a_kink_is_neither_a_minimum_nor_refuted(case):
    c = examined(*KINKED[case])
    assert c.verdict is Verdict.NOT_SMOOTH
    assert "derivatives of" in c.explain()
    assert "jump" in c.explain()


@pytest.mark.parametrize("case", INFINITE)
def test_infinite_derivatives_are_neither(case):
    c = examined(*INFINITE[case])
    assert c.verdict is Verdict.NOT_SMOOTH
    assert "are not finite" in c.explain()


@pytest.mark.filterwarnings("ignore::polycorner.NonsmoothWarning")
@given(
    st.floats(-5, 5),
    st.floats(0.01, 100).map(lambda a: round(a, 4)),
    st.sampled_from([1, 2]),
    st.floats(0, 6.28),
)
def test_a_jump_is_found_wherever_it_is_and_however_it_is_turned(at, size, order, angle):
    """``u |u|^(k - 1)`` has a jump in its derivative of order ``k`` along the line ``u = 0``."""
    u = sympy.Float(np.cos(angle)) * (X - at) + sympy.Float(np.sin(angle)) * (Y - 1)
    energy = size * u ** (order - 1) * Abs(u) + X**2 + Y**2
    c = certify(Polyhedron(M, {"f": 100 - X}), energy, [at, 1.0])
    assert c.verdict is Verdict.NOT_SMOOTH


@pytest.mark.filterwarnings("ignore::polycorner.NonsmoothWarning")
@pytest.mark.parametrize("energy", [Abs(X) ** 3 + X**2 + Y**2, Max(0, X) ** 4 + Y**2 + X**2])
def test_formulas_with_branches_that_fit_together_are_judged(energy):
    """Twice continuously differentiable: the conditions of second order apply."""
    c = certify(Polyhedron(M, {"f": 1 - X}), energy, [0.0, 0.0])
    assert c.verdict is Verdict.STRICT_MINIMUM


@pytest.mark.filterwarnings("ignore::polycorner.NonsmoothWarning")
@pytest.mark.parametrize("away", [1e-3, 0.1, 10.0])
def test_beside_a_kink_the_conditions_apply(away):
    energy = Abs(X + away) + X**2 + X * (-1) + Y**2  # x**2 + y**2 + away for x > -away
    c = certify(Polyhedron(M, {"f": 100 - X}), energy, [0.0, 0.0])
    assert c.verdict is Verdict.STRICT_MINIMUM


def test_the_singularity_of_an_inactive_function_inside_its_domain_does_not_matter():
    c = certify(Polyhedron(M, {"disc": 1 - R}), X**2 + Y**2, [0.0, 0.0])
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert stratum_at(Polyhedron(M, {"disc": 1 - R}), [0.0, 0.0]).local_type is LocalType.INTERIOR


def test_the_tip_of_a_root_has_a_stratum():
    stratum = stratum_at(Polyhedron(M, {"root": sqrt(X), "floor": Y}), [0.0, 0.0])
    assert stratum.local_type is LocalType.NOT_SMOOTH
    assert stratum.active == ("root", "floor")
    assert stratum.rank == 1


def test_a_value_that_is_not_finite_is_outside():
    for f in (log(X), 1 / X, log(X) / X):
        d = Polyhedron(M, {"f": f, "floor": Y})
        assert stratum_at(d, [0.0, 0.0]).local_type is LocalType.OUTSIDE
        assert "f is not finite there" in certify(d, X, [0.0, 0.0]).explain()


def test_outermost_min_and_max_have_corners_instead_of_kinks():
    roof = Polyhedron(M, {"roof": Y - Abs(X)})
    c = minimise(roof, Y, [0.3, 2.0])
    assert (c.verdict, c.active) == (Verdict.STRICT_MINIMUM, ("roof1", "roof2"))
    assert prove(c).proved
    valley = Polyhedron(M, {"valley": Min(Y - X, 3 - Y) + 1})
    named = {f.name: f.expression for f in valley.functions}
    assert [named[name] for name in stratum_at(valley, [4.0, 4.0]).active] == [4 - Y]


def test_a_search_that_ends_at_a_kink_says_so():
    with pytest.warns(NonsmoothWarning):
        c = minimise(Polyhedron(M, {"f": 3 - X}), Abs(X) + Y**2, [1.0, 1.0])
    assert not c.is_minimum
    assert c.verdict in {Verdict.NOT_SMOOTH, Verdict.NOT_CONVERGED}
