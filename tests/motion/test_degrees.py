"""Degrees of formulas: at least those of the polynomials that they are."""

import math

import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner.motion.formulation import degree

X, Y, V, W = sympy.symbols("x y v w", real=True)
leaves = st.sampled_from([X, Y, V, W, sympy.Integer(2), sympy.sin(X)])
formulas = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] * p[1]),
        inner.map(lambda e: e**2),
    ),
    max_leaves=8,
)


@given(formulas)
def test_bounds_the_degree_of_polynomials(formula):
    found = degree(formula, [V, W])
    assert found >= sympy.Poly(formula, V, W).total_degree()
    assert (found == 0) == (not formula.free_symbols & {V, W})


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        (sympy.Integer(3), 0),
        (V / X + W * sympy.sqrt(Y), 1),
        (sympy.Piecewise((V, X > 0), (W * X, True)), 1),
        (sympy.Piecewise((V, V > 0), (W, True)), math.inf),
        (1 / V, math.inf),
        (sympy.sin(V), math.inf),
        (X**V, math.inf),
        ((V + X) ** 3, 3),
    ],
)
def test_other_formulas(formula, expected):
    assert degree(formula, [V, W]) == expected


def test_repeated_subexpressions_are_visited_once():
    formula = V
    for _ in range(200):  # a tree with 2^200 leaves
        formula = sympy.Add(
            sympy.Mul(2, formula, evaluate=False),
            sympy.Mul(X, formula, evaluate=False),
            evaluate=False,
        )
    assert degree(formula, [V]) == 1
