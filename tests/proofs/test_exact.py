"""Exact zeros: ideals, recognised points and forms on cones, against rational oracles."""

import warnings
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
import sympy as sp
from exact_algebra import solved
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, certify
from polycorner.intervals.balls import ball, integer_relation, precision
from polycorner.intervals.enclosures import Formulas
from polycorner.proofs import prove
from polycorner.proofs.definite import positive_on_cone
from polycorner.proofs.exact import implied
from polycorner.proofs.hypotheses import CURVED
from polycorner.proofs.polynomials import number, total
from polycorner.proofs.symbols import Symbols, evaluate

M = Manifold.euclidean("x y z")
x, y, z = M.symbols
whole = st.integers(-3, 3)
fractions = st.builds(Fraction, st.integers(-40, 40), st.integers(1, 40))


def formulas(*expressions):
    return Formulas([SmoothFunction(f"f{k}", e, M) for k, e in enumerate(expressions)], M)


# ------------------------------------------------------------------------------------- exact values

leaves = st.sampled_from([x, y, z, sp.Rational(1, 3), sp.Integer(2), sp.sqrt(2), sp.pi])
expressions = st.recursive(
    leaves,
    lambda e: st.one_of(
        st.builds(lambda u, v: u + v, e, e),
        st.builds(lambda u, v: u * v, e, e),
        st.builds(lambda u, v: u - v, e, e),
        st.builds(lambda u: u**2, e),
        st.builds(sp.sin, e),
        st.builds(lambda u: 1 / (1 + u**2), e),
        st.builds(lambda u: sp.sqrt(1 + u**2), e),
    ),
    max_leaves=6,
)


@pytest.mark.parametrize("twelfths", range(-13, 14))
def test_sines_and_cosines_of_twelfths_of_a_turn_that_are_rational(twelfths):
    angle = twelfths * sp.pi / 6
    f, symbols = formulas(sp.sin(x), sp.cos(x)), Symbols()
    ((pi, _),) = symbols.of("const", "pi").items()
    at = [{pi: Fraction(twelfths, 6)} if twelfths else {}, {}, {}]
    for found, truth in zip(
        evaluate(f.graph, f.outputs, at, symbols), (sp.sin(angle), sp.cos(angle)), strict=True
    ):
        if truth.is_rational:
            assert found == number(Fraction(int(2 * truth), 2))
        else:
            assert sp.Abs(sp.Float(symbols.ball(found).str(15, radius=False)) - truth) < 1e-12


@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
def test_comparisons_are_decided_where_enclosures_decide_them():
    f, symbols = formulas(sp.Abs(x - sp.pi) + sp.Abs(y - x)), Symbols()
    at = [number(3), symbols.of("var", 1), {}]
    assert evaluate(f.graph, f.outputs, at, symbols)[0] != {}
    symbols.places[1] = ball(4)
    (found,) = evaluate(f.graph, f.outputs, at, symbols)
    ((pi, _),) = symbols.of("const", "pi").items()
    ((moved, _),) = symbols.of("var", 1).items()
    assert found == {pi: 1, moved: 1, (): -6}


@given(expressions, st.tuples(fractions, fractions, fractions))
def test_exact_values_are_sympys(expression, point):
    f, symbols = formulas(expression), Symbols()
    (found,) = evaluate(f.graph, f.outputs, [number(v) for v in point], symbols)
    numbers = dict(zip((x, y, z), map(sp.Rational, point), strict=True))
    truth = sp.N(expression.subs(numbers), 60)
    with precision(250):
        assert abs(sp.Float(symbols.ball(found).str(50, radius=False), 50) - truth) < sp.Float(
            1e-40
        ) * (1 + abs(truth))


@given(expressions, st.tuples(fractions, fractions, fractions))
def test_what_cancels_is_seen_to_be_zero(expression, point):
    """``(e - v) (1 + x^2)`` vanishes where ``e`` has the value ``v``."""
    numbers = dict(zip((x, y, z), map(sp.Rational, point), strict=True))
    value = expression.subs(numbers)
    f, symbols = formulas((expression - value) * (1 + x**2)), Symbols()
    (found,) = evaluate(f.graph, f.outputs, [number(v) for v in point], symbols)
    assert not found or value.is_irrational is not False


@given(st.lists(st.tuples(whole, whole, whole), min_size=1, max_size=3))
def test_relations_between_constants_are_found(rows):
    with precision(200):
        constants = [ball(1), ball(2).sqrt(), ball(3).sqrt()]
        for row in rows:
            value = sum((c * k for c, k in zip(constants, row, strict=True)), ball(0)) / 7
            found = integer_relation([value, *constants])
            assert found is not None
            assert [Fraction(-k, found[0]) for k in found[1:]] == [Fraction(k, 7) for k in row]
        assert integer_relation([ball(2).exp(), *constants]) is None


# -------------------------------------------------------------------------------------- ideals


def polynomial(weights, at):
    """Return a polynomial that vanishes at a point."""
    away = [s - sp.Rational(v) for s, v in zip((x, y, z), at, strict=True)]
    terms = [*away, away[0] ** 2, away[0] * away[1], away[2] ** 2]
    return sum(w * t for w, t in zip(weights, terms, strict=True))


weights = st.lists(whole, min_size=6, max_size=6)
points = st.tuples(whole, whole, whole)


@settings(max_examples=25)
@given(weights, weights, weights, weights, points)
def test_combinations_are_implied(first, second, u, v, at):
    g, h = polynomial(first, at), polynomial(second, at)
    f = sp.expand(g * (1 + polynomial(u, (0, 0, 0))) + h * polynomial(v, (1, 0, 0)))
    held = formulas(f, g, h)
    assert f == 0 or implied(held, (1, 2), 0)


@settings(max_examples=25)
@given(weights, weights, weights, points)
def test_what_does_not_vanish_at_a_common_zero_is_not_implied(first, second, third, at):
    g, h = polynomial(first, at), polynomial(second, at)
    f = polynomial(third, at) + sp.Rational(1, 10**30)
    assert not implied(formulas(f, g, h), (1, 2), 0)


# ------------------------------------------------------------------------------------- cones


def least_on_simplex(form):
    """Return the least value of a form on the simplex of weights that sum to 1, exactly."""
    values = []
    for size in range(1, len(form) + 1):
        for chosen in combinations(range(len(form)), size):
            rows = [[*(form[i][j] for j in chosen), Fraction(-1)] for i in chosen]
            rows.append([*[Fraction(1)] * size, Fraction(0)])
            answer = solved(rows, [*[Fraction(0)] * size, Fraction(1)])
            if answer and answer[1] and min(answer[0][:size]) > 0:
                values.append(answer[0][size])  # the value at a stationary point inside a face
    return min(values)


@settings(max_examples=60)
@given(st.integers(2, 4), st.integers(0, 2**32))
def test_forms_on_a_cone_are_positive_where_the_exact_minimum_says_so(n, seed):
    rng = np.random.default_rng(seed)
    drawn = rng.integers(-2, 6, (n, n))
    form = [[Fraction(int(drawn[i, j] + drawn[j, i])) for j in range(n)] for i in range(n)]
    for i in range(n):
        form[i][i] = Fraction(int(rng.integers(0, 6)))
    turn = np.tril(rng.integers(-1, 2, (n, n)), -1) + np.eye(n, dtype=int)
    bent = turn.T @ np.array(form, dtype=object) @ turn
    with precision(150):
        found = positive_on_cone(
            [[ball(v) for v in row] for row in bent.tolist()],
            [],
            [[ball(int(v)) for v in row] for row in turn],
            [1.0] * n,
        )
    least = least_on_simplex(form)
    if found:
        assert least > 0
    if least >= Fraction(1, 4):
        assert found


@pytest.mark.parametrize(
    ("energy", "proved"),
    [
        (x**2 + 4 * x * y + y**2 + z**2, True),
        (x**2 - sp.Rational(21, 10) * x * y + y**2 + z**2, False),
        (x**2 + y**2 + 3 * x * y + z**2 + 3 * y * z - x * z, True),
        ((x + y) ** 2 + z**2, True),
        (x * y + z**2, False),
        (y**2 - x**2 + z**2, False),
    ],
)
def test_weak_contacts_may_make_a_minimum_of_a_saddle(energy, proved):
    D = Polyhedron(M, {"a": x, "b": y, "c": z})
    p = prove(certify(D, energy, [0, 0, 0]))
    assert p.proved == proved, str(p)
    assert p.conditions[CURVED] == ("proved" if proved else "undecided")


def test_a_symmetry_that_a_weak_contact_breaks_does_not_count():
    # Along (1, 1, 0) the energy is constant, but the contact is not.
    D = Polyhedron(M, {"a": x + y, "b": z})
    p = prove(certify(D, -((x - y) ** 2) + z**2, [0, 0, 0]))
    assert not p.proved


# -------------------------------------------------------------------- infinite derivatives

EDGES = {
    "a root in a contact": ({"f": sp.sqrt(x) + y}, x + y + z**2),
    "a root in the energy": ({"f": x, "g": y}, sp.sqrt(x) + y + z**2),
    "two roots": ({"f": sp.sqrt(x) - sp.sqrt(y), "g": y}, x + z**2),
    "a distance": ({"f": sp.sqrt(x**2 + y**2) - z}, x**2 + y**2 - z),
    "a cube root": ({"f": sp.cbrt(x) + y, "g": y}, x + y + z**2),
    "a power": ({"f": x}, x ** sp.Rational(3, 2) + y**2 + z**2),
    "a logarithm at its edge": ({"f": x * sp.log(x), "g": y}, y + x**2 + z**2),
    "an arcsine": ({"f": sp.asin(1 - x), "g": x}, x + y**2 + z**2),
}


@pytest.mark.parametrize("case", EDGES)
def test_infinite_derivatives_leave_a_proof_undecided_with_a_reason(case):
    parts, energy = EDGES[case]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            certificate = certify(Polyhedron(M, parts), energy, [0, 0, 0])
        except ValueError:
            return  # the energy is not finite there
        p = prove(certificate)
    assert not p.proved, str(p)
    assert all(p.reasons[name] for name, status in p.conditions.items() if status != "proved")
    assert "undecided" in str(p)


def test_powers_of_a_root_are_reduced_by_its_equation():
    symbols, one = Symbols(), number(1)
    with precision(200):
        root = symbols.algebraic((-2, 0, 0, 1), ball(2).root(3))
        square = symbols.product(root, root)
        # (1 + a + a^2) (a - 1) = a^3 - 1 = 1 for the cube root a of 2
        sum_ = total([total([one, root]), square])
        assert symbols.product(sum_, total([root, one], "sub")) == one
        assert symbols.ball(square).overlaps(ball(4).root(3))
        assert symbols.ball(square).rad() < 1e-50


def test_a_root_is_one_number():
    symbols = Symbols()
    with precision(100):
        both = ball(0, 2)  # the square roots of 2, and neither of those of -2
        assert symbols.algebraic((-2, 0, 1), both) is None
        assert symbols.algebraic((2, 0, 1), both) is None
        assert symbols.algebraic((-2, 0, 1), ball(1.5)) is None
