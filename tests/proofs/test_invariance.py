"""Symmetries shown by exact algebra: what is invariant is seen, what is not is never claimed."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st

from polycorner import Manifold, SmoothFunction
from polycorner.dumbbells import DumbbellPair
from polycorner.intervals.balls import ball
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import Box
from polycorner.proofs.invariance import (
    annihilated,
    generators,
    slope_bounds,
    translations,
)

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
M = Manifold.euclidean("x y z")
x, y, z = M.symbols
AT = (0.75, 0.5, -0.375)
whole = st.integers(-3, 3)


def forms_of(*expressions, at=AT, manifold=M):
    functions = [SmoothFunction(f"f{k}", e, manifold) for k, e in enumerate(expressions)]
    return Formulas(functions, manifold).smooth(Box([ball(v) for v in at]), range(len(functions)))


def generator(manifold, components):
    (field,) = generators(manifold, [components])
    return field


def rank(vectors):
    return np.linalg.matrix_rank(np.array(vectors, dtype=float)) if vectors else 0


# ------------------------------------------------------------------------------------ translations


@pytest.mark.parametrize(
    ("expressions", "dimension"),
    [
        ([sp.sin(x - y)], 2),
        ([sp.sin(x - y), sp.exp(y - z)], 1),
        ([sp.sin(x - y) + x], 1),
        ([(x - y) ** 2 / (1 + (2 * x - 2 * y) ** 2)], 2),
        ([x * y], 1),
        ([x * y, z], 0),
        ([sp.sqrt(1 + (x - 3 * z) ** 2), x - 3 * z], 2),
        ([sp.S(5)], 3),
    ],
)
def test_translations_are_found_and_hold(expressions, dimension):
    found = translations(forms_of(*expressions))
    assert len(found) == rank(found) == dimension
    for vector in found:
        for e in expressions:
            slope = sum(sp.Rational(c.numerator, c.denominator) * e.diff(s)
                        for c, s in zip(vector, (x, y, z), strict=True))  # fmt: skip
            assert sp.simplify(slope) == 0


def test_a_term_that_moves_by_a_constant_is_no_symmetry():
    (vector,) = translations(forms_of(x - y, sp.cos(z)))
    assert vector == [1, 1, 0]
    assert translations(forms_of(x + sp.cos(y), sp.cos(z))) == []


@given(st.lists(st.lists(whole, min_size=3, max_size=3), min_size=1, max_size=2))
def test_translations_are_all_that_linear_forms_allow(rows):
    assume(all(any(row) for row in rows))
    symbols = (x, y, z)
    forms = forms_of(*[sp.atan(sum(c * s for c, s in zip(r, symbols, strict=True))) for r in rows])
    found = translations(forms)
    assert len(found) == 3 - rank(rows)
    for vector in found:
        assert all(sum(c * v for c, v in zip(row, vector, strict=True)) == 0 for row in rows)


@pytest.mark.parametrize("radius", [125.0, np.inf])
def test_a_pair_may_be_carried_along_the_drum(radius):
    pair = DumbbellPair(16, 3, 1.5, radius)
    functions = [*pair.polyhedron.functions, pair.energy]
    q = pair.nested("R") + 1e-3 * np.arange(6) ** 2  # headings that differ decide every branch
    forms = Formulas(functions, pair.manifold).smooth(Box([ball(v) for v in q.tolist()]), range(10))
    assert translations(forms) == [[0, 1, 0, 0, 1, 0]]


# ------------------------------------------------------------------------------------ vector fields


@pytest.mark.parametrize(
    ("expression", "components"),
    [
        (sp.sqrt(x**2 + y**2), [-y, x, 0]),
        (x**2 + 2 * x * y + y**2, [1, -1, 0]),
        (sp.atan2(y, x) - z, [-y, x, 1]),
        (x * y, [x, -y, 0]),
        (x / y, [x, y, 0]),
        (sp.exp(x) / sp.exp(y) + sp.sin(x - y), [1, 1, 0]),
        ((x * sp.cos(z) + y * sp.sin(z)) ** 2 + (y * sp.cos(z) - x * sp.sin(z)) ** 2, [-y, x, 1]),
        (x * sp.cos(z) + y * sp.sin(z), [-y, x, 1]),
        (x * sp.cosh(z) - y * sp.sinh(z), [y, x, 1]),
        (sp.log(x**2 + y**2) - 2 * z, [x, y, 1]),
    ],
)
def test_invariants_of_a_field_are_recognised(expression, components):
    field = generator(M, components)
    truth = sum(c * expression.diff(s) for c, s in zip(components, (x, y, z), strict=True))
    assert sp.simplify(truth) == 0
    assert annihilated(forms_of(expression), field) == [True]


@given(st.lists(whole, min_size=9, max_size=9), st.lists(whole, min_size=3, max_size=3))
def test_what_is_claimed_to_be_invariant_is(weights, direction):
    terms = [x**2, x * y, y**2, sp.sin(x - y), z * x, z, x, y, x**2 * y]
    expression = sum(w * t for w, t in zip(weights, terms, strict=True)) + sp.S(1)
    (constant,) = annihilated(forms_of(expression), generator(M, direction))
    slope = sum(c * expression.diff(s) for c, s in zip(direction, (x, y, z), strict=True))
    assert constant == (sp.expand(slope) == 0)


def test_a_slope_that_vanishes_only_to_rounding_is_no_symmetry():
    tiny = sp.Rational(1, 2**80)
    field = generator(M, [1, 1, 0])
    assert annihilated(forms_of(sp.cos(x - y)), field) == [True]
    assert annihilated(forms_of(sp.cos(x - (1 + tiny) * y)), field) == [False]
    assert annihilated(forms_of(sp.Float(0.1) * x - sp.Rational(1, 10) * y), field) == [False]


def test_identities_beyond_the_algebra_are_not_claimed():
    identity = sp.tan(x) * sp.cos(x) - sp.sin(x) + sp.cos(y)
    assert annihilated(forms_of(identity), generator(M, [1, 0, 0])) == [False]


def test_a_polynomial_that_grows_too_large_is_given_up():
    huge = sp.prod([1 + x * sp.Rational(k, 7) + y**2 * k + z for k in range(1, 14)])
    assert annihilated(forms_of(huge), generator(M, [y, x, z])) == [False]


def test_a_parameter_that_is_free_does_not_move():
    a = sp.Symbol("a", real=True)
    f = SmoothFunction("f", a * sp.cos(x - y) + a, M, parameters={"a": 2.0})
    forms = Formulas([f], M, ["a"]).smooth(Box([ball(v) for v in (*AT, 2.0)]), [0])
    assert annihilated(forms, generator(M, [1, 1, 0])) == [True]
    assert translations(forms) == [[1, 1, 0], [0, 0, 1]]


def test_slopes_along_a_field_are_enclosed():
    forms = forms_of(x**2 + y, at=(2.0, 1.0, 0.0))
    box = Box([ball(2), ball(1), ball(0)])
    (slope,) = slope_bounds(forms, generator(M, [y, x, 0]), box)
    assert float(slope) == 6
    assert (
        slope_bounds(forms, generator(M, [sp.Abs(z), 0, 0]), Box([ball(2), ball(1), ball(0, 1)]))
        == []
    )


# ---------------------------------------------------------------------------------------- declaring


def test_fields_are_given_as_mappings_or_sequences_of_anything_with_a_value():
    speed = SmoothFunction("speed", x**2, M)
    fields = generators(
        M, [{"x": 1}, [0, y, sp.Rational(1, 2)], {"z": speed}, [Fraction(1, 3), 0, 0.5]]
    )
    assert [str(field) for field in fields] == [
        "d/dx",
        "(y) d/dy + 1/2 d/dz",
        "(x**2) d/dz",
        "1/3 d/dx + 1/2 d/dz",
    ]
    values = fields[3].at([ball(v) for v in AT])
    assert [float(v) for v in values] == [1 / 3, 0, 0.5]
    assert str(generators(M, [[-1, 1, 0]])[0]) == "-d/dx + d/dy"
