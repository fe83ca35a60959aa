"""Formulas as they are given: kinks, circles, groups that Min and Max stand for, and numbers."""

import math
import warnings

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from sympy import Abs, Max, Min, Piecewise, Rational, cos, exp, sin, sqrt, tan

from polycorner import AllOf, AnyOf, Manifold, NonsmoothWarning, Polyhedron, SmoothFunction
from polycorner.formulas.expressions import substitute
from polycorner.polyhedra.groups import outermost

M = Manifold.euclidean("x y")
X, Y = M.symbols
TORUS = Manifold(("p", "q"), periods=(math.tau, 3.0))
P, Q = TORUS.symbols
MIXED = Manifold(("p", "x"), periods=(math.tau, math.inf))


class TestKinks:
    @pytest.mark.parametrize(
        ("expression", "told"),
        [
            (X * Abs(Y), "Abs(y)"),
            (X + sin(Max(X, Y)), "Max(x, y)"),
            (1 / Min(X, 2), "Min(2, x)"),
            (Piecewise((X, Y > 0), (0, True)), "Piecewise((x, y > 0), (0, True))"),
        ],
    )
    def test_are_announced_when_a_function_is_made(self, expression, told):
        with pytest.warns(NonsmoothWarning, match="f: its derivatives may jump") as caught:
            f = SmoothFunction("f", expression, M)
        assert told in str(caught[0].message)
        assert f.kinks == (told,)

    def test_concern_the_function_that_has_them(self):
        with pytest.warns(NonsmoothWarning) as caught:
            d = Polyhedron(M, {"smooth": X, "bent": X * Abs(Y)})
        assert [str(w.message).split(":")[0] for w in caught] == ["bent"]
        assert [f.kinks for f in d.functions] == [(), ("Abs(y)",)]

    def test_of_a_definition_concern_every_function(self):
        t = sympy.Symbol("t", real=True)
        with pytest.warns(NonsmoothWarning):
            f = SmoothFunction("f", t + X, M, definitions={"t": Abs(X)})
        assert f.kinks == ("Abs(x)",)

    @pytest.mark.parametrize("expression", [sqrt(X**2 + Y**2), X ** Rational(3, 2), exp(-X) / Y])
    def test_smooth_branches_of_functions_are_not_announced(self, expression):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert SmoothFunction("f", expression, M).kinks == ()


numbers = st.integers(-3, 3).filter(bool)
linear = st.builds(lambda a, b, c: a * X + b * Y + c, numbers, numbers, numbers)
bent = st.one_of(
    st.builds(lambda f, g, c: c * Min(f, g), linear, linear, numbers),
    st.builds(lambda f, g, c: c * Max(f, g), linear, linear, numbers),
    st.builds(lambda f, c: c * Abs(f), linear, numbers),
)


class TestGroups:
    @given(st.lists(bent, min_size=1, max_size=3), linear, st.integers(0, 2**32 - 1))
    def test_have_the_sign_of_the_expression(self, terms, rest, seed):
        expression = rest + sum(terms)
        d = Polyhedron(M, [outermost(expression)])
        points = np.random.default_rng(seed).normal(0, 3, (40, 2))
        values = sympy.lambdify((X, Y), expression, "numpy")(*points.T)
        np.testing.assert_allclose(d.implicit(points), values, rtol=1e-12, atol=1e-12)

    def test_have_no_kink_where_the_other_terms_cancel(self):
        """In one of the branches of ``|x + 1|`` nothing but ``|x - 1|`` is left."""
        expression = Abs(X + 1) + Abs(X - 1) - X - 1
        d = Polyhedron(M, [outermost(expression)])
        assert not any(f.kinks for f in d.functions)
        assert d.implicit([3.0, 0.0]) == float(expression.subs(X, 3))

    def test_are_made_of_what_stands_outermost(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            d = Polyhedron(M, {"diamond": 1 - Abs(X) - Abs(Y), "outside": Max(X, Y) + 1})
        assert d.names == (*(f"diamond{k}" for k in (1, 2, 3, 4)), "outside1", "outside2")
        assert d.is_union
        assert [d.contains(q) for q in ([0.4, 0.5], [0.6, 0.5], [0, 0])] == [True, False, True]

    def test_inside_groups_and_lists(self):
        d = Polyhedron(M, [AnyOf(Min(X, Y), X - 5), Y + 7])
        assert d.names == ("f1", "f2", "f3", "f4")
        assert d.contains([6.0, -6.0])
        assert not d.contains([4.0, -6.0])

    @pytest.mark.parametrize("expression", [X * Max(X, Y), Abs(X), sin(Min(X, Y)), X + Y, 3])
    def test_other_expressions_stay(self, expression):
        assert outermost(expression) is expression

    def test_too_many_branches_stay_one_expression(self):
        many = sympy.symbols("a:12", real=True)
        expression = 1 - sum(map(Abs, many))
        assert outermost(expression) is expression

    def test_two_parts_of_one_name_are_refused(self):
        with pytest.raises(ValueError, match="distinct names; got a1 more than once"):
            Polyhedron(M, {"a1": X, "a": AllOf(X, Y)})


class TestCircles:
    @pytest.mark.parametrize(
        ("expression", "period"),
        [
            (P, "6.28319"),
            (sin(P / 2), "6.28319"),
            (cos(Q), "3"),
            (cos(P) * Q, "3"),
            (exp(sin(Q)), "3"),
        ],
    )
    def test_a_function_that_is_not_periodic_is_refused(self, expression, period):
        with pytest.raises(ValueError, match=f"wall: expected a function with the period {period}"):
            Polyhedron(TORUS, {"wall": expression})
        with pytest.raises(ValueError, match=r"f: expected a function with the period"):
            SmoothFunction("f", expression, TORUS)

    @given(st.integers(-3, 3), st.integers(-3, 3), st.floats(-2, 2))
    def test_one_that_is_periodic_is_taken(self, k, m, shift):
        turn = Q * 2 * sympy.pi / 3
        phase = k * P + m * turn + shift
        for f in (
            cos(phase) ** 2 / (2 + sin(phase)),
            sin(P / 2) ** 2 + tan(turn / 2) ** 2,
            (P - 2 * sympy.pi * sympy.Rational(k, 7)) * 0 + cos(P),
        ):
            assert SmoothFunction("f", f, TORUS).reads == (0, 1)

    def test_names_of_variables_and_parameters_are_followed(self):
        u, k = sympy.symbols("u k", real=True)
        f = SmoothFunction("f", sin(k * u), MIXED, variables=["u"], reads=["p"], parameters={k: 2})
        assert f.value([math.pi / 4, 0.0]) == pytest.approx(1)
        with pytest.raises(ValueError, match="the period 6"):
            SmoothFunction(
                "f", sin(k * u), MIXED, variables=["u"], reads=["p"], parameters={k: 2.5}
            )
        line = SmoothFunction(
            "f", sin(k * u), MIXED, variables=["u"], reads=["x"], parameters={k: 2.5}
        )
        assert line.reads == (1,)

    def test_definitions_are_written_out(self):
        t = sympy.Symbol("t", real=True)
        with pytest.raises(ValueError, match="the period 6"):
            SmoothFunction("f", 1 + t, TORUS, definitions={"t": P**2})


class TestNumbers:
    @pytest.mark.parametrize(
        "number", [10**400, -(10**309), Rational(1, 10**400), Rational(3, 7**400)]
    )
    @pytest.mark.parametrize(
        "form", [lambda c: Y - c * X, lambda c: X**2 + c, lambda c: sin(c + X)]
    )
    def test_beyond_the_processors_are_refused(self, number, form):
        with pytest.raises(ValueError, match="f1: expected numbers that double precision"):
            Polyhedron(M, [form(number)])

    def test_large_ones_within_the_range_are_taken(self):
        d = Polyhedron(M, [Y - 10**300 * X, X**65537 + 1, X ** (10**9) - Y])
        np.testing.assert_allclose(d.values([1.0, 2.0]), [-1e300, 2.0, -1.0])


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"name": 3}, "name: expected a str; got int"),
        ({"parameters": ["a"]}, "parameters: expected a mapping; got ['a']"),
        ({"definitions": ["a"]}, "definitions: expected a mapping; got ['a']"),
        ({"variables": 3}, "variables: expected a sequence of coordinate names; got 3"),
        ({"reads": "x"}, "reads: expected a sequence of coordinate names; got 'x'"),
        ({"manifold": "x y"}, "manifold: expected a Manifold; got str"),
    ],
)
def test_wrong_arguments_are_named(arguments, told):
    with pytest.raises(TypeError) as caught:
        SmoothFunction(**{"name": "f", "expression": X, "manifold": M} | arguments)
    assert str(caught.value) == told


def test_substitution_is_that_of_sympy_however_often_parts_are_repeated():
    x, y = X, Y
    e = Max(x, y * sin(x)) + Piecewise((x, y > 0), (Min(x, 2), True))
    places = {x: y + 1, y: x**2}
    assert substitute(e, places) == e.xreplace(places)
    assert substitute(e, {x: sympy.Integer(3), y: sympy.Integer(1)}) == e.subs({x: 3, y: 1})
    folded, expected = x, P
    for _ in range(8):
        folded = cos(folded) * Max(folded, y, evaluate=False)
        expected = cos(expected) * Max(expected, Q, evaluate=False)
    assert substitute(folded, {x: P, y: Q}) == expected
