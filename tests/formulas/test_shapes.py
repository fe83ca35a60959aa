"""Formulas of one shape share a kernel, whatever their names and numbers; nothing else changes."""

import math
import pickle

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction
from polycorner.formulas.bundles import Bundle, resolve
from polycorner.formulas.families import Family
from polycorner.formulas.kernels import MANY

NAMES = [f"x{i}" for i in range(12)]
M = Manifold.euclidean(NAMES)
X = M.symbols


def kernels(polyhedron):
    return {id(resolve(f)[0].kernel) for f in polyhedron.functions}


def exact(expression, q):
    """Return value, gradient and Hessian at a point with thirty digits, as floats."""
    place = {s: i for i, s in enumerate(X)}
    point = {
        s: sp.Rational(*float(q[place[s]]).as_integer_ratio()) for s in expression.free_symbols
    }
    gradient, hessian = np.zeros(len(X)), np.zeros((len(X), len(X)))
    for s in point:
        slope = expression.diff(s)
        gradient[place[s]] = slope.evalf(30, subs=point)
        for t in point:
            hessian[place[s], place[t]] = slope.diff(t).evalf(30, subs=point)
    return float(expression.evalf(30, subs=point)), gradient, hessian


class TestSharing:
    @pytest.mark.parametrize("n", [4, 30, 80])
    def test_all_bounds_are_one_kernel(self, n):
        space = Manifold.euclidean([f"y{i}" for i in range(n)])
        parts = {f"low{i}": y + sp.Rational(i, 7) for i, y in enumerate(space.symbols)}
        parts |= {f"high{i}": 2 * i - 3 * y for i, y in enumerate(space.symbols)}
        assert len(kernels(Polyhedron(space, parts))) == 1

    def test_bounds_written_one_by_one_are_one_kernel(self):
        functions = [SmoothFunction(f"f{i}", x - i - 0.5, M) for i, x in enumerate(X)]
        assert len({id(resolve(f)[0].kernel) for f in functions}) == 1
        assert len(kernels(Polyhedron(M, functions))) == 1

    def test_distances_of_discs_are_one_kernel(self):
        gaps = {
            f"gap{i}{j}": sp.sqrt((X[i] - X[j]) ** 2 + (X[i + 1] - X[j + 1]) ** 2) - (i + j)
            for i in range(0, 12, 2)
            for j in range(0, i, 2)
        }
        assert len(kernels(Polyhedron(M, gaps))) == 1

    def test_dense_quadratics_are_data(self):
        rng = np.random.default_rng(0)
        parts = {}
        for k in range(5):
            a = rng.normal(size=(12, 12))
            terms = [a[i, j] * X[i] * X[j] for i in range(12) for j in range(i + 1)]
            parts[f"q{k}"] = sp.Add(*terms, *(rng.normal() * x for x in X), rng.normal())
        assert len(kernels(Polyhedron(M, parts))) == 1

    def test_a_function_reads_what_occurs_in_it(self):
        for f, reads in ((X[3] - 1, (3,)), (sp.sin(X[7] * X[2]), {2, 7}), (X[0] * X[5], (0, 5))):
            assert set(resolve(SmoothFunction("f", f, M))[1]) == set(reads)


numbers = st.one_of(st.integers(-9, 9), st.fractions(-3, 3, max_denominator=9))
coefficients = numbers.map(lambda c: sp.Rational(*c.as_integer_ratio())).filter(bool)
places = st.integers(0, len(X) - 1)
seeds = st.integers(0, 2**32 - 1)
points = st.lists(st.floats(-2, 2).map(lambda v: round(v, 6)), min_size=12, max_size=12)


@st.composite
def quadratics(draw):
    terms = [draw(coefficients)]
    for _ in range(draw(st.integers(1, 8))):
        i, j = draw(places), draw(places)
        terms.append(draw(coefficients) * X[i] * draw(st.sampled_from([1, X[j]])))
    return sp.Add(*terms)


@st.composite
def formulas(draw):
    i, j, k = (X[draw(places)] for _ in range(3))
    a, b, c = (draw(coefficients) for _ in range(3))
    return draw(
        st.sampled_from(
            [
                a * sp.sin(b * i + c) + j * k,
                (i - a) ** 2 + (j - b) ** 2 - c**2,
                sp.exp(-(i**2)) * (a * j + b) / (2 + c**2 + k**2),
                sp.sqrt(1 + a**2 * i**2 + b**2 * j**2) - c,
                (a * i + b * j + c) ** 3 - i * j * k,
                sp.atan(a * i * j) - sp.cos(b * k) * c,
            ]
        )
    )


@given(st.one_of(quadratics(), formulas()), points)
def test_values_and_derivatives_are_those_of_the_formula(expression, q):
    if not expression.free_symbols:
        return
    f = SmoothFunction("f", expression, M)
    size = 1 + sum(abs(float(c)) for c in expression.atoms(sp.Number)) ** 3
    found = f.value(q), f.gradient(q), f.hessian(q)
    for ours, theirs in zip(found, exact(expression, q), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-13 * size)


@given(
    st.lists(st.one_of(quadratics(), formulas()), min_size=1, max_size=6), st.integers(0, 2**32 - 1)
)
def test_one_point_many_points_and_one_function_alone_agree_to_the_last_bit(expressions, seed):
    d = Polyhedron(M, expressions)
    rng = np.random.default_rng(seed)
    for count in (3, MANY + 5):
        q = rng.normal(size=(count, 12))
        together = d.bundle.evaluate(q, 2)
        for part, whole in zip(d.bundle.evaluate(q[-1], 2), together, strict=True):
            np.testing.assert_array_equal(part, whole[-1])
        for i, f in enumerate(d.functions):
            np.testing.assert_array_equal(f.value(q), together[0][:, i])
            np.testing.assert_array_equal(f.hessian(q), together[2][:, i])


@given(quadratics(), quadratics(), points)
def test_shared_kernels_of_different_numbers_are_one_call(f, g, q):
    """Formulas of one shape and different numbers are evaluated by one call, each with its own."""
    both = Polyhedron(M, [f, g, f + 1])
    for i, expression in enumerate((f, g, f + 1)):
        alone = SmoothFunction("alone", expression, M)
        assert both.values(q)[i] == alone.value(q)


def test_named_parameters_come_before_numbers():
    a, b = sp.symbols("a b", real=True)
    f = SmoothFunction("f", a * sp.sin(3 * X[1]) + b / 7, M, parameters={a: 2.0, b: 14.0})
    q = np.full(12, 0.3)
    assert f.value(q) == pytest.approx(2 * math.sin(0.9) + 2)
    assert f.parameters == (2.0, 14.0)


def test_keys_tell_numbers_apart_to_the_last_digit():
    third = sp.Rational(1, 3)
    near = sp.Rational(*(1 / 3).as_integer_ratio())
    keys = {Family.of({"f": X[0] + c}, NAMES).key for c in (third, near, 1)}
    assert len(keys) == 3
    keys = {Family.of({"f": sp.sin(X[0]) + c}, NAMES).key for c in (third, near, 1)}
    assert len(keys) == 3


def test_functions_come_back_from_a_pickle_with_the_kernel_in_use():
    f = SmoothFunction("f", sp.cos(5 * X[3]) - 2, M)
    assert f.value(np.ones(12)) == math.cos(5.0) - 2
    again = pickle.loads(pickle.dumps(f))
    assert resolve(again)[0].kernel is resolve(f)[0].kernel
    assert again.value(np.ones(12)) == f.value(np.ones(12))


def test_code_for_lanes_is_made_when_it_is_worth_it():
    f = SmoothFunction("f", sp.sinh(X[0]) * 2.5 + 0.125, M)
    kernel = resolve(f)[0].kernel.compiled(0)
    f.value(np.zeros((MANY - 1, 12)))
    assert "_lanes" not in vars(kernel)
    f.value(np.zeros((MANY, 12)))
    assert "_lanes" in vars(kernel)


def test_a_bundle_of_many_kinds_keeps_its_rows():
    expressions = [X[0], X[1] ** 2, sp.sin(X[2]), X[3] - 1, sp.sin(X[4]), X[5] * X[6], X[7] ** 3]
    functions = [SmoothFunction(f"f{i}", e, M) for i, e in enumerate(expressions)]
    q = np.linspace(-1, 1, 12)
    values = Bundle(M, functions).evaluate(q, 0)[0]
    written = [float(e.subs(dict(zip(X, q, strict=True)))) for e in expressions]
    np.testing.assert_allclose(values, written, rtol=1e-14)
