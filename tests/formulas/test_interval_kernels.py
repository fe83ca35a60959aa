"""Single operations in lanes: bounds against Arb at two hundred bits, domains, rounding, sizes."""

import math
from fractions import Fraction

import numpy as np
import pytest
from enclosing import inside, misses
from hypothesis import given
from hypothesis import strategies as st

from polycorner.formulas.interval_kernels import LANES, IntervalKernel, best_rounding
from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import Graph
from polycorner.formulas.ranges import outward, pattern
from polycorner.intervals.balls import ball, bounds, constant, operations, precision

KINDS = ["stepped"] if best_rounding() == "stepped" else ["stepped", "embedded"]
LOGIC = {"lt", "le", "not", "and", "or", "select"}
BINARY = {"add", "sub", "mul", "div", "pow", "atan2"}
ALL = sorted(set(operations()) - LOGIC)
# Absolute errors of sine and cosine are bounded, relative ones of everything else.
EACH = [(op, kind) for op in ALL for kind in KINDS]
ABSOLUTE, RELATIVE = 2.0**-48, 2.0**-46


def operation(op, kind):
    """Return a kernel of one operation of variables."""
    graph = Graph()
    x = graph.node("var", 0)
    y = graph.node("var", 1)
    arguments = {"square": ("mul", x, x)}.get(op, (op, x, y) if op in BINARY else (op, x))
    return IntervalKernel(graph, 2, [[graph.node(*arguments)]], kind=kind)


def bounded(kernel, lo, hi):
    low, high = np.zeros((len(lo), 1)), np.zeros((len(lo), 1))
    kernel.fill(np.ascontiguousarray(lo), np.ascontiguousarray(hi), [low, high])
    return low[:, 0], high[:, 0]


def exactly(op, q):
    """Return an operation at a point given in full, as a ball."""
    values = [ball(Fraction(float(x))) for x in q]
    return operations()[op](*(values if op in BINARY else values[:1]))


def boxes(rng, count):
    """Return boxes of all widths, of no width and of one unit in the last place among them."""
    size = 10.0 ** rng.choice([-300, -20, -5, -1, 0, 0, 0.5, 1, 2, 5], size=(count, 1))
    middle = size * rng.uniform(-1, 1, (count, 2)) * rng.choice([1, 1, 0], size=(count, 2))
    reach = np.abs(size) * 10.0 ** rng.uniform(-18, 0.5, (count, 2))
    lo, hi = middle - reach, middle + reach
    hi[::5] = lo[::5]
    hi[1::5] = np.nextafter(lo[1::5], np.inf)
    return lo, hi


@pytest.mark.parametrize(("op", "kind"), EACH)
def test_true_values_lie_between_the_bounds(op, kind):
    rng = np.random.default_rng(ALL.index(op))
    lo, hi = boxes(rng, 1200)
    low, high = bounded(operation(op, kind), lo, hi)
    assert not np.isnan(low).any()
    assert not np.isnan(high).any()
    assert (low <= high).all()
    assert np.isfinite(low).mean() > 0.2
    with precision(200):
        for q, below, above in zip(inside(rng, lo, hi), low, high, strict=True):
            true = exactly(op, q)
            assert not misses(true, below, above), (q.tolist(), below, above)
            assert true.is_finite() or (below, above) == (-np.inf, np.inf)


@pytest.mark.parametrize("op", OPERATIONS)
@pytest.mark.parametrize("side", [1, -1])
def test_the_sign_of_an_argument_that_is_known_leaves_products_of_values_right(op, side):
    """``y f(x^2)`` and ``y f(-x^2)``: products depend on the signs of their factors."""
    graph, rng = Graph(), np.random.default_rng(11)
    x, y = graph.node("var", 0), graph.node("var", 1)
    u = graph.node("mul", x, x) if side > 0 else graph.node("neg", graph.node("mul", x, x))
    product = graph.node("mul", graph.node(op, u), y)
    kernel = IntervalKernel(graph, 2, [[product]])
    lo = rng.uniform(-3, 3, (150, 2)) * rng.choice([0.3, 1], (150, 1))
    hi = lo + rng.choice([0.0, 0.1, 2.0], (150, 2))
    low, high = bounded(kernel, lo, hi)
    # What is undefined for all arguments of one sign has no bounds.
    assert np.isfinite(low).any() or op in {"sqrt", "log"}
    with precision(200):
        for q, below, above in zip(inside(rng, lo, hi), low, high, strict=True):
            one, two = (ball(Fraction(float(t))) for t in q)
            assert not misses(operations()[op](side * one * one) * two, below, above)


@pytest.mark.parametrize(("op", "kind"), EACH)
def test_bounds_of_a_point_are_tight(op, kind):
    rng = np.random.default_rng(7)
    q = rng.uniform(0.1, 0.9, (400, 2)) * rng.choice([1, 3], (400, 1))
    low, high = bounded(operation(op, kind), q, q)
    fine = np.isfinite(low)
    assert fine.mean() >= (0.4 if op in {"asin", "acos"} else 1)
    width = ABSOLUTE if op in {"sin", "cos"} else RELATIVE * np.maximum(np.abs(low), 2.0**-40)
    assert np.all((high - low)[fine] <= np.broadcast_to(width, low.shape)[fine])


@pytest.mark.parametrize("op", ["sin", "cos"])
def test_extrema_inside_a_box_are_met_and_others_are_not(op):
    middles = np.arange(-400, 400) * math.pi / 4
    lo, hi = middles - 0.3, middles + 0.3
    low, high = bounded(operation(op, KINDS[-1]), np.stack([lo, lo], 1), np.stack([hi, hi], 1))
    fine = np.linspace(-0.3, 0.3, 601) + middles[:, None]
    values = getattr(np, op)(fine)
    assert np.all(low <= values.min(1))
    assert np.all(values.max(1) <= high)
    assert np.allclose(low, values.min(1), atol=1e-5)
    assert np.allclose(high, values.max(1), atol=1e-5)


@pytest.mark.parametrize(
    ("op", "sides"),
    [
        ("div", [(1, 2), (-1, 1)]),
        ("div", [(1, 2), (0, 1)]),
        ("div", [(0, 0), (0, 0)]),
        ("sqrt", [(-1, 1)]),
        ("sqrt", [(-2, -1)]),
        ("log", [(0, 1)]),
        ("log", [(-2, -1)]),
        ("asin", [(0.5, 1.5)]),
        ("acos", [(-1.5, 0)]),
        ("tan", [(1.5, 1.6)]),
        ("tan", [(0, 4)]),
        ("exp", [(0, 800)]),
        ("exp", [(-900, 800)]),
        ("cosh", [(-800, 0)]),
        ("pow", [(-1, 1), (0.5, 0.5)]),
        ("pow", [(0, 1), (-1, 1)]),
        ("add", [(-math.inf, 1), (0, 1)]),
        ("mul", [(0, math.inf), (0, 0)]),
        ("sin", [(math.nan, 1)]),
        ("neg", [(2, 1)]),
    ],
)
def test_what_is_undefined_somewhere_has_no_bounds(op, sides):
    lo, hi = np.array([*sides, (0, 0)][:2], dtype=float).T
    for kind in KINDS:
        found = bounded(operation(op, kind), np.tile(lo, (3, 1)), np.tile(hi, (3, 1)))
        assert [bound.tolist() for bound in found] == [[-np.inf] * 3, [np.inf] * 3]


def test_lanes_do_not_disturb_each_other():
    lo = np.linspace(-2, 2, 2 * LANES + 3)[:, None] * [1, 1]
    hi = lo + 0.1
    for op in ALL:
        kernel = operation(op, KINDS[-1])
        together = np.array(bounded(kernel, lo, hi))
        alone = [np.ravel(bounded(kernel, lo[i : i + 1], hi[i : i + 1])) for i in range(len(lo))]
        assert np.array_equal(together, np.array(alone).T)


tiny = st.integers(-(2**60), 2**60).map(lambda k: math.ldexp(float(k), -1074))
wide = st.floats(-(2.0**40), 2.0**40)


@given(st.sampled_from(["add", "sub", "mul", "div"]), *[st.one_of(tiny, wide)] * 2)
def test_four_operations_round_outwards_also_where_numbers_are_subnormal(op, a, b):
    q = np.array([[a, b]])
    for kind in KINDS:
        (low,), (high,) = bounded(operation(op, kind), q, q)
        if op == "div" and abs(b) < 2.0**-200:
            assert (low, high) == (-np.inf, np.inf)
            continue
        x, y = Fraction(a), Fraction(b)
        true = {"add": x + y, "sub": x - y, "mul": x * y, "div": y and x / (y or 1)}[op]
        assert Fraction(low) <= true <= Fraction(high)
        slack = 2.0**-50 * abs(float(true)) + 2.0**-1070
        assert high - low <= slack


def test_what_could_overflow_is_guarded():
    graph = Graph()
    x = graph.node("var", 0)
    high = graph.power(x, Fraction(64))
    kernel = IntervalKernel(graph, 1, [[high, graph.mul(high, high), graph.inv(high)]])
    bound = [np.zeros((3, 3)), np.zeros((3, 3))]
    q = np.array([[1.0], [2.0**7], [2.0**39]])
    kernel.fill(q, q, bound)
    assert np.allclose(bound[0][:2, 0], [1, 2.0**448])
    assert np.isfinite(bound[0][0]).all()
    assert np.isinf(bound[0][2]).all()
    assert np.isinf(bound[1][2]).all()


@pytest.mark.parametrize("op", ["atan", "asin", "sinh", "tanh", "erf", "exp", "cosh", "acos"])
def test_signs_that_are_known_are_kept(op):
    graph = Graph()
    x = graph.node("var", 0)
    square = graph.mul(x, x)
    values = [graph.node(op, square), graph.node(op, graph.neg(square))]
    kernel = IntervalKernel(graph, 1, [[graph.node("sqrt", values[0]), *values]])
    low, high = np.zeros((2, 3)), np.zeros((2, 3))
    kernel.fill(np.array([[0.0], [-0.5]]), np.array([[0.0], [0.5]]), [low, high])
    assert np.all(low[:, 0] >= 0)
    assert np.all(low[:, 1] >= 0)
    assert np.all(high[:, 2] <= 0) or op in {"exp", "cosh", "acos"}
    assert np.all(np.isfinite(low) & np.isfinite(high))


def test_sizes_below_the_smallest_number_are_not_claimed():
    """``(2**-990 x)**4`` underflows to a subnormal bound, which four factors ``2**990`` enlarge."""
    graph = Graph()
    x, small, large = graph.node("var", 0), *(graph.const(Fraction(2) ** k) for k in (-990, 990))
    value = graph.power(graph.mul(x, small), Fraction(4))
    for _ in range(4):
        value = graph.mul(large, value)
    kernel = IntervalKernel(graph, 1, [[value]])
    low, high = np.zeros((1, 1)), np.zeros((1, 1))
    kernel.fill(np.ones((1, 1)), np.ones((1, 1)), [low, high])
    assert low.item() <= 1 <= high.item()


def test_constants_beyond_doubles_have_no_bounds():
    graph = Graph()
    huge = graph.const(Fraction(10) ** 400)
    kernel = IntervalKernel(graph, 1, [[huge, graph.inv(huge)]])
    low, high = np.zeros((1, 2)), np.zeros((1, 2))
    kernel.fill(np.ones((1, 1)), np.ones((1, 1)), [low, high])
    assert (low[0, 0], high[0, 0]) == (-np.inf, np.inf)
    assert (low[0, 1], high[0, 1]) == (0, 2.0**-1074)


def test_structural_zeros_and_constants_are_results():
    graph = Graph()
    third = graph.const(Fraction(1, 3))
    kernel = IntervalKernel(graph, 1, [[None, third, None, None]])
    low, high = np.zeros((5, 4)), np.zeros((5, 4))
    kernel.fill(np.zeros((5, 1)), np.zeros((5, 1)), [low, high])
    assert not low[:, [0, 2, 3]].any()
    assert not high[:, [0, 2, 3]].any()
    assert np.all((low[:, 1] < 1 / 3 + 1e-15) & (low[:, 1] < high[:, 1]))
    assert Fraction(low[0, 1]) < Fraction(1, 3) < Fraction(high[0, 1])


@given(st.fractions())
def test_constants_are_enclosed_by_neighbours(value):
    low, high = outward(value)
    assert Fraction(low) <= value <= Fraction(high)
    assert high in {low, math.nextafter(low, np.inf)}
    assert (low == high) == (Fraction(float(value)) == value)


@pytest.mark.parametrize("name", ["pi", "e"])
def test_pi_and_e_are_enclosed_by_neighbours(name):
    low, high = outward(name)
    with precision(200):
        lower, upper = bounds(constant(name))
    assert Fraction(low) < lower <= upper < Fraction(high)
    assert high == math.nextafter(low, np.inf)


def test_selections_are_recognised():
    g = Graph()
    x, y, zero, one = g.node("var", 0), g.node("var", 1), g.const(0), g.const(1)
    smaller = g.select(g.node("le", x, y), x, y)
    assert pattern(g, smaller).kind == "min"
    assert pattern(g, g.select(g.node("lt", x, y), y, x)).kind == "max"
    assert pattern(g, g.select(g.node("lt", x, zero), g.neg(x), x)).kind == "abs"
    assert pattern(g, g.select(g.node("lt", zero, x), g.neg(x), x)).kind == "-abs"
    inner = g.select(g.node("le", one, x), one, x)
    assert pattern(g, g.select(g.node("le", x, zero), zero, inner)).kind == "max"
    assert pattern(g, g.select(g.node("le", x, zero), one, inner)) is None
    assert pattern(g, g.select(g.node("le", x, one), one, inner)).kind == "max"
    assert pattern(g, g.select(g.node("le", x, y), x, one)) is None
    assert pattern(g, x) is None
