"""Derivatives in reverse: equal to those by dual numbers and by the forward rule, at any depth."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, SmoothFunction
from polycorner.formulas.adjoints import DEEP, Reverse, derivatives
from polycorner.formulas.translate import compile_expressions

x, y, z = sp.symbols("x y z", real=True)


FORMULAS = [
    sp.sin(x * y) / sp.cos(z - x),
    sp.atan2(x - 2 * y, 1 + z**2) ** 3,
    sp.sqrt(x**2 + y**2 + z) * sp.exp(-x * z),
    (1 + x + y) ** z * sp.log(x) + (x * y) ** sp.Rational(1, 3),
    sp.Piecewise((sp.sqrt(x), x > y), (z * sp.sin(y), True)) * sp.tan(x / 3),
    sp.asin(x / 9) + sp.acos(y / 9) + sp.atan(z) + sp.tanh(x * y) + sp.cosh(z) * sp.sinh(x),
    sp.Max(x * y, z) - sp.Abs(x - y) ** 3,
]


def values(graph, q):
    """Return the values of all nodes; arguments come before what reads them."""
    names = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
    names |= {"add": "add", "sub": "subtract", "mul": "multiply", "div": "divide"}
    names |= {"neg": "negative", "pow": "power", "lt": "less", "le": "less_equal"}
    found = []
    for op, args in graph.nodes:
        if op == "const":
            found.append({"pi": math.pi, "e": math.e}.get(args[0]) or float(args[0]))
        elif op == "var":
            found.append(q[args[0]])
        elif op == "select":
            found.append(found[args[1]] if found[args[0]] else found[args[2]])
        else:
            found.append(getattr(np, names.get(op, op))(*[found[a] for a in args]))
    return found


@given(st.sampled_from(FORMULAS), st.lists(st.floats(0.2, 2.0), min_size=3, max_size=3))
def test_reverse_is_forward_for_every_operation(formula, q):
    program = compile_expressions([formula], ("x", "y", "z"))
    graph, (node,) = program.graph, program.outputs
    reverse, zero = Reverse(graph), graph.const(0)
    pairs = []
    for i in range(3):
        slope = reverse.row(node).get(i, zero)
        pairs.append((slope, graph.derivative(node, i)))
        for j in range(3):
            forward = graph.derivative(graph.derivative(node, i), j)
            pairs.append((reverse.row(slope).get(j, zero), forward))
    at = values(graph, q)
    for one, other in pairs:
        assert at[one] == pytest.approx(at[other], rel=1e-9, abs=1e-9)


def test_a_branch_that_is_not_taken_leaves_no_trace():
    """Its slope is infinite where the other one ends."""
    program = compile_expressions([sp.Piecewise((sp.sqrt(x) * y, x > 0), (y, True))], ("x", "y"))
    graph, (node,) = program.graph, program.outputs
    row = Reverse(graph).row(node)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = values(graph, np.array([0.0, 3.0]))
    assert [at[row[i]] for i in range(2)] == [0.0, 1.0]


@pytest.mark.parametrize("terms", [DEEP // 2, 2000])
def test_a_long_sum_has_derivatives_at_any_depth(terms):
    variables = [f"q{i}" for i in range(4)]
    q = sp.symbols(variables, real=True)
    long = sp.Add(*[(q[k % 4] - k) ** 3 for k in range(terms)])
    program, (_, slopes, hessian) = derivatives(compile_expressions([long], variables), 2)
    point = [Fraction(1, 2), Fraction(3), Fraction(-1), Fraction(5, 4)]
    at = values(program.graph, [float(p) for p in point])
    for i, p in enumerate(point):
        expected = sum(3 * (p - k) ** 2 for k in range(terms) if k % 4 == i)
        assert at[slopes[i]] == pytest.approx(float(expected), rel=1e-12)
        curved = sum(6 * (p - k) for k in range(terms) if k % 4 == i)
        row = [float(curved) * (i == j) for j in range(4)]
        assert [at[a] for a in hessian[4 * i : 4 * i + 4]] == pytest.approx(row, rel=1e-12)


def test_operations_depend_on_the_program_alone():
    """Not on which derivatives were asked for before."""
    program = compile_expressions([sp.sin(x * y) * z, x / z], ("x", "y", "z"))
    first = derivatives(program, 1)
    twice = derivatives(program, 2)
    again = derivatives(program, 1)
    assert first[1] == again[1] == twice[1][:2]
    assert first[0].graph.nodes == again[0].graph.nodes
    assert twice[0].graph.nodes[: len(first[0].graph.nodes)] == first[0].graph.nodes


@pytest.mark.usefixtures("kernels_elsewhere")
def test_compiled_derivatives_of_many_variables():
    """Beyond the sizes of the forward rule, against SymPy."""
    space = Manifold.euclidean([f"u{i}" for i in range(14)])
    u = space.symbols
    formula = sp.Add(*[sp.sin(a * b) * u[0] for a, b in pairwise(u)])
    f, q = SmoothFunction("f", formula, space), np.linspace(0.1, 1.4, 14)
    at = dict(zip(u, map(sp.Float, q), strict=True))
    gradient = [float(formula.diff(s).subs(at)) for s in u]
    assert f.gradient(q) == pytest.approx(gradient, abs=1e-13)
    hessian = [[float(formula.diff(s, t).subs(at)) for s in u[:3]] for t in u]
    assert f.hessian(q)[:, :3] == pytest.approx(np.array(hessian), abs=1e-13)
