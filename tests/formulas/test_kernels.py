"""Compiled kernels against long arithmetic: values, gradients, Hessians, batches."""

import mpmath
import numpy as np
import oracles
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import smooth_expressions, together

from polycorner.formulas.cache import sources_digest
from polycorner.formulas.linking import linked

pytestmark = pytest.mark.usefixtures("kernels_elsewhere")

x, y = sp.symbols("x y", real=True)
R = sp.Rational

SMOOTH = {
    "sin": sp.sin(x * y + 1),
    "cos": sp.cos(x - y**2),
    "sin and cos": sp.sin(x) * sp.cos(x) + y * sp.sin(x),
    "tan": sp.tan(x * y),
    "asin": sp.asin(x * y),
    "acos": sp.acos(x - y / 2),
    "atan": sp.atan(x / y),
    "atan2": sp.atan2(x - 1, y - R(1, 2)),
    "sinh": sp.sinh(x + y),
    "cosh": sp.cosh(x * y),
    "tanh": sp.tanh(x - 2 * y),
    "erf": sp.erf(x - y / 2),
    "exp": sp.exp(x * y),
    "exp of a negative": sp.exp(-x) * y,
    "power of e": sp.E ** (x + y**2),
    "log": sp.log(x + y),
    "sqrt": sp.sqrt(x + y**2),
    "fourth": (x - y) ** 4,
    "odd": (x * y - 2) ** 7,
    "reciprocal": 1 / (x + y),
    "quotient": (x**2 - y) / (x * y**3),
    "cube root": (x + y) ** R(1, 3),
    "minus two thirds": (x * y) ** R(-2, 3),
    "three halves": (x + y) ** R(3, 2),
    "minus five halves": (x + y) ** R(-5, 2),
    "float exponent": (x + y) ** sp.Float(2.3),
    "whole float exponent": x ** sp.Float(2.0) * y,
    "general power": (1 + x) ** y,
    "power of a number": 2 ** (x - y),
    "pi": sp.pi * x**2 + y / sp.pi,
    "constant": sp.Rational(22, 7) + 0 * x,
    "polynomial": 3 * x**2 * y - y**3 / 7 + x - 5,
    "distance": sp.sqrt((x - 2) ** 2 + (y + 1) ** 2) - 1,
}
BRANCHED = {
    "Abs": sp.Abs(sp.sin(x - y)) * x,
    "Min": sp.Min(x**2, y, x * y),
    "Max": sp.Max(sp.sin(x), sp.cos(y), R(1, 2)),
    "Piecewise": sp.Piecewise((x**2, x < R(1, 3)), (sp.exp(y), x <= R(2, 3)), (x * y, True)),
    "and": sp.Piecewise((x**3, sp.And(x > y, y >= R(1, 4))), (sp.log(x), True)),
    "or": sp.Piecewise((x * y**2, sp.Or(x > R(3, 4), y > R(3, 4))), (x / y, True)),
    "not": sp.Piecewise((sp.sin(y), sp.Not(sp.Or(x > y, y > R(1, 2)))), (sp.sqrt(x), True)),
    "nested": sp.Piecewise((sp.Min(x, y**2), x > y), (sp.Abs(x - y), True)),
}
ALL = SMOOTH | BRANCHED
POINTS = [(0.3, 0.7), (0.8, 0.45), (0.55, 0.62), (0.21, 0.13), (0.9, 0.85), (0.4, 0.2)]


@pytest.fixture(scope="module")
def every():
    return together(ALL, "x y")


def long(expressions):
    """Return the expressions as a function in long arithmetic, by SymPy's own translation."""
    written = sp.lambdify((x, y), list(expressions), "mpmath")
    return lambda q: written(*q)


@pytest.mark.parametrize("q", POINTS)
def test_kernels_agree_with_long_arithmetic(every, q):
    exact = oracles.differences(long(ALL.values()), q)
    oracles.agree(every.evaluate(np.array(q), 2), exact)


@pytest.mark.parametrize("q", POINTS[:3])
def test_kernels_agree_with_symbolic_derivatives(every, q):
    _, gradients, hessians = every.evaluate(np.array(q), 2)
    place = dict(zip((x, y), map(sp.Float, q), strict=True))
    for row, f in enumerate(SMOOTH.values()):
        gradient = [f.diff(u).evalf(25, subs=place) for u in (x, y)]
        hessian = [[f.diff(u, w).evalf(25, subs=place) for w in (x, y)] for u in (x, y)]
        np.testing.assert_allclose(
            gradients[row], np.array(gradient, float), rtol=1e-12, atol=1e-12
        )
        np.testing.assert_allclose(hessians[row], np.array(hessian, float), rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("q", POINTS)
@pytest.mark.parametrize("v", [(0.6, 0.8), (-0.8, 0.6), (1.0, 0.1)])
def test_taylor_errors_have_orders_two_and_three(every, q, v):
    steps = 0.02 * 2.0 ** -np.arange(7)
    orders = oracles.taylor_orders(lambda p: every.evaluate(p, 2), np.array(q), np.array(v), steps)
    for name, (first, second) in zip(ALL, orders, strict=True):
        assert first > 1.85, name
        assert second > 2.85, name


def test_the_orders_are_attained():
    """Orders of a function that has second and third derivatives are two and three, not more."""
    f = together({"f": sp.exp(x) * sp.sin(y)}, "x y")
    steps = 0.02 * 2.0 ** -np.arange(7)
    v = np.array([0.6, 0.8])
    ((first, second),) = oracles.taylor_orders(
        lambda p: f.evaluate(p, 2), np.array([0.3, 0.4]), v, steps
    )
    assert first == pytest.approx(2, abs=0.05)
    assert second == pytest.approx(3, abs=0.05)


@settings(max_examples=15)
@given(smooth_expressions((x, y)), st.tuples(st.floats(-2, 2), st.floats(-2, 2)))
def test_generated_expressions_agree_with_long_arithmetic(expression, q):
    compiled = together({"f": expression}, "x y").evaluate(np.array(q), 2)
    oracles.agree(compiled, oracles.differences(long([expression]), q), tolerance=1e-10)


@pytest.mark.parametrize("q", POINTS)
def test_hessians_are_symmetric_to_the_bit(every, q):
    hessians = every.evaluate(np.array(q), 2)[2]
    assert np.array_equal(hessians, hessians.transpose(0, 2, 1))


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 15, 16, 17, 23, 24, 25])
def test_a_batch_is_its_points_to_the_bit(every, order, count):
    q = np.random.default_rng(count).uniform(0.1, 0.9, (count, 2))
    batch = every.evaluate(q, order)
    for results, shape in zip(batch, ((), (2,), (2, 2)), strict=False):
        assert results.shape == (count, len(ALL), *shape)
    for i in range(count):
        for rows, alone in zip(batch, every.evaluate(q[i], order), strict=True):
            assert rows[i].tobytes() == alone.tobytes()


@pytest.mark.parametrize("order", [0, 1])
def test_lower_orders_are_parts_of_higher_ones(every, order):
    q = np.array(POINTS)
    full = every.evaluate(q, 2)
    for less, more in zip(every.evaluate(q, order), full, strict=False):
        np.testing.assert_allclose(less, more, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("outputs", [*range(1, 10), 15, 16, 17, 23])
def test_any_number_of_functions_is_stored_in_its_place(outputs):
    powers = together({f"f{i}": x * y**i + i for i in range(outputs)}, "x y")
    q = np.random.default_rng(outputs).uniform(0.5, 1.5, (19, 2))
    values, gradients = powers.evaluate(q, 1)
    a, b = q.T
    for i in range(outputs):
        np.testing.assert_allclose(values[:, i], a * b**i + i, rtol=1e-14)
        np.testing.assert_allclose(gradients[:, i, 0], b**i, rtol=1e-14)
        np.testing.assert_allclose(gradients[:, i, 1], i * a * b ** (i - 1.0), rtol=1e-14)


def test_a_transposed_batch_is_read_row_by_row(every):
    q = np.array(POINTS)
    columns = np.asfortranarray(q)
    assert np.array_equal(every.evaluate(columns, 0)[0], every.evaluate(q, 0)[0])


@pytest.mark.parametrize("quadrant", [(1, 1), (-1, 1), (-1, -1), (1, -1)])
def test_the_angle_of_a_vector_is_right_in_every_quadrant(quadrant):
    a, b = 0.3 * quadrant[0], 0.8 * quadrant[1]
    angle = together({"angle": sp.atan2(y, x)}, "x y")
    value, gradient, hessian = angle.evaluate(np.array([a, b]), 2)
    square = a * a + b * b
    assert value[0] == np.arctan2(b, a)
    np.testing.assert_allclose(gradient[0], [-b / square, a / square], rtol=1e-14)
    mixed = (b * b - a * a) / square**2
    expected = np.array([[2 * a * b / square**2, mixed], [mixed, -2 * a * b / square**2]])
    np.testing.assert_allclose(hessian[0], expected, rtol=1e-13)


@pytest.mark.parametrize("count", [1, 8])
def test_a_boundary_belongs_to_the_weak_inequality(count):
    """At ``x = y`` the relations ``<=`` and ``>=`` hold, ``<`` and ``>`` do not."""
    relations = {"<": x < y, "<=": x <= y, ">": x > y, ">=": x >= y}
    relations["not"] = sp.Not(sp.And(x <= y, x < 9), evaluate=False)
    cases = {name: sp.Piecewise((1, holds), (0, True)) for name, holds in relations.items()}
    found = together(cases, "x y").evaluate(np.full((count, 2), 0.5), 0)[0]
    assert found.tolist() == [[0.0, 1.0, 0.0, 1.0, 0.0]] * count


@pytest.mark.parametrize("value", [0.0, 0.25, 1e-9, -3.0, 1e100, 5e-324])
def test_parameters_come_in_late(value):
    k = sp.Symbol("k", real=True)
    late = together({"f": k * x + y, "g": sp.Min(k, x)}, "x y", {"k": value})
    f, g = late.evaluate(np.array([2.0, 0.5]), 0)[0]
    assert (f, g) == (value * 2.0 + 0.5, min(value, 2.0))


def test_exact_constants_are_rounded_once():
    exact = together({"tenth": R(1, 10), "pi": sp.pi, "e": sp.E}, "x")
    values = exact.evaluate(np.array([0.0]), 0)[0]
    with mpmath.workdps(40):
        assert values.tolist() == [0.1, float(mpmath.pi), float(mpmath.e)]


# -------------------------------------------------------------------------------------- compilation


def test_python_cannot_call_what_is_only_linked():
    twice = linked()(lambda x: 2 * x)
    with pytest.raises(SystemError):
        twice(5)


def test_the_digest_depends_on_names_and_bytes(tmp_path, monkeypatch):
    folder = tmp_path / "leaves"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "leaf.py").write_text("LEAF = 1")
    monkeypatch.syspath_prepend(str(tmp_path))
    digests = [sources_digest("leaves")]
    (folder / "leaf.py").write_text("LEAF = 2")
    digests.append(sources_digest("leaves"))
    (folder / "leaf.py").rename(folder / "twig.py")
    digests.append(sources_digest("leaves"))
    (folder / "other.py").touch()
    digests.append(sources_digest("leaves"))
    assert len(set(digests)) == 4
    assert sources_digest("leaves", without=("other.py",)) == digests[2]
    assert sources_digest("leaves", only=("__init__.py", "twig.py")) == digests[2]


def test_only_packages_have_a_digest():
    with pytest.raises(ValueError, match="package: expected the name of an importable package"):
        sources_digest("json.decoder")
