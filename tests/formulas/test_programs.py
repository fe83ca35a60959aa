"""Straight-line programs: exact identities on the graph, translation, and refusals."""

from fractions import Fraction

import oracles
import pytest
import sympy as sp
from hypothesis import assume, given
from strategies import rational_terms

from polycorner.formulas.adjoints import Reverse, derivatives
from polycorner.formulas.programs import Graph
from polycorner.formulas.translate import compile_expressions

x, y, k = sp.symbols("x y k", real=True)
POINT = (Fraction(2, 3), Fraction(-5, 7), Fraction(11, 13))


def build(graph, term):
    """Enter a nested term into a graph."""
    op, *args = term
    if op == "var":
        return graph.node("var", args[0])
    if op == "const":
        return graph.const(args[0])
    return getattr(graph, op)(*(build(graph, arg) for arg in args))


def direct(term, values, constant):
    """Evaluate a nested term as it is written."""
    op, *args = term
    if op == "var":
        return values[args[0]]
    if op == "const":
        return constant(args[0])
    a, *b = (direct(arg, values, constant) for arg in args)
    return {
        "add": lambda: a + b[0],
        "sub": lambda: a - b[0],
        "mul": lambda: a * b[0],
        "div": lambda: a / b[0],
        "neg": lambda: -a,
    }[op]()


def run(graph, node, values):
    """Evaluate a node of a rational graph in fractions."""
    op, args = graph.nodes[node]
    if op == "var":
        return values[args[0]]
    if op == "const":
        return args[0]
    a, *b = (run(graph, arg, values) for arg in args)
    return {
        "add": lambda: a + b[0],
        "sub": lambda: a - b[0],
        "mul": lambda: a * b[0],
        "div": lambda: a / b[0],
        "neg": lambda: -a,
    }[op]()


def evaluated(term, values, constant):
    try:
        return direct(term, values, constant)
    except ZeroDivisionError:
        assume(False)


class TestGraph:
    @given(rational_terms())
    def test_simplification_does_not_change_a_value(self, term):
        exact = evaluated(term, POINT, Fraction)
        graph = Graph()
        assert run(graph, build(graph, term), POINT) == exact

    @given(rational_terms())
    def test_first_derivatives_are_exact(self, term):
        graph = Graph()
        node = build(graph, term)
        for i in range(3):
            seeded = [oracles.Dual(v, Fraction(i == j)) for j, v in enumerate(POINT)]
            exact = evaluated(term, seeded, oracles.Dual).b
            assert run(graph, graph.derivative(node, i), POINT) == exact
            assert run(graph, Reverse(graph).row(node).get(i, graph.const(0)), POINT) == exact

    @given(rational_terms(depth=3, variables=2))
    def test_second_derivatives_are_exact_and_commute(self, term):
        graph, dual = Graph(), oracles.Dual
        node, rows = build(graph, term), Reverse(graph)

        def constant(value):
            return dual(dual(Fraction(value)), dual(Fraction(0)))

        for i in range(2):
            for j in range(2):
                seeded = [
                    dual(dual(v, Fraction(j == p)), dual(Fraction(i == p), Fraction(0)))
                    for p, v in enumerate(POINT[:2])
                ]
                exact = evaluated(term, seeded, constant).b
                exact = exact.b if isinstance(exact, dual) else exact
                mixed = graph.derivative(graph.derivative(node, i), j)
                assert run(graph, mixed, POINT) == exact
                adjoint = rows.row(rows.row(node).get(i, graph.const(0))).get(j, graph.const(0))
                assert run(graph, adjoint, POINT) == exact

    def test_an_operation_is_stored_once(self):
        graph = Graph()
        a, b = graph.node("var", 0), graph.node("var", 1)
        assert graph.add(a, b) == graph.add(b, a)
        assert graph.mul(a, b) == graph.mul(b, a)
        assert len(graph.nodes) == len(set(graph.nodes)) == 4

    def test_zero_derivatives_never_become_operations(self):
        graph = Graph()
        a = graph.node("var", 0)
        node = graph.unary("sin", graph.mul(a, graph.unary("exp", a)))
        before = len(graph.nodes)
        derivative = graph.derivative(node, 1)
        assert graph.nodes[derivative] == ("const", (Fraction(0),))
        assert len(graph.nodes) == before + 1

    @pytest.mark.parametrize("n", range(-6, 7))
    @pytest.mark.parametrize("halves", [0, 1])
    def test_powers_are_products_and_square_roots(self, n, halves):
        graph = Graph()
        node = graph.power(graph.node("var", 0), Fraction(2 * n + halves, 2))
        assert not any(op == "pow" for op, _ in graph.nodes)
        if not halves:
            assert run(graph, node, POINT) == POINT[0] ** n


class TestTranslation:
    def test_a_subexpression_used_twice_is_computed_once(self):
        shared = sp.sin(x * y)
        once = compile_expressions([shared], ("x", "y"))
        both = compile_expressions([shared, shared**2 + 1], ("x", "y"))
        assert sum(op == "sin" for op, _ in both.graph.nodes) == 1
        assert len(both.graph.nodes) == len(once.graph.nodes) + 2, "a square and a sum are added"

    def test_equal_programs_have_equal_digests(self):
        first = compile_expressions([x * y + 1], ("x", "y"))
        again = compile_expressions([1 + y * x], ("x", "y"))
        assert first.digest() == again.digest()

    @pytest.mark.parametrize(
        ("expressions", "variables", "parameters"),
        [
            ([x * y + 2], ("x", "y"), ()),
            ([x * y + 1], ("y", "x", "k"), ()),
            ([x * y + 1], ("x",), ("y",)),
            ([x * y + 1, x], ("x", "y"), ()),
        ],
    )
    def test_other_programs_have_other_digests(self, expressions, variables, parameters):
        first = compile_expressions([x * y + 1], ("x", "y"))
        other = compile_expressions(expressions, variables, parameters)
        assert first.digest() != other.digest()

    def test_derivatives_are_listed_row_by_row(self):
        program = compile_expressions([x**2 * y, 3 * y], ("x", "y"))
        program, (values, gradients, hessians) = derivatives(program, 2)
        point = POINT[:2]
        a, b = point
        assert [run(program.graph, node, point) for node in values] == [a * a * b, 3 * b]
        assert [run(program.graph, node, point) for node in gradients] == [2 * a * b, a * a, 0, 3]
        expected = [2 * b, 2 * a, 2 * a, 0, 0, 0, 0, 0]
        assert [run(program.graph, node, point) for node in hessians] == expected

    def test_a_definition_may_use_earlier_ones(self):
        u, v = sp.symbols("u v", real=True)
        program = compile_expressions([v + u], ("x", "y"), (), {"u": x + y, "v": u * x})
        a, b = POINT[:2]
        assert run(program.graph, program.outputs[0], POINT) == (a + b) * a + a + b

    @pytest.mark.parametrize("name", ["z", "X", "x1"])
    def test_an_unknown_symbol_is_named(self, name):
        with pytest.raises(ValueError, match=f"the symbol {name} .*known are x, y, k"):
            compile_expressions([x + sp.Symbol(name)], ("x", "y"), ("k",))

    def test_a_definition_cannot_use_a_later_one(self):
        u, v = sp.symbols("u v")
        with pytest.raises(ValueError, match="symbol v"):
            compile_expressions([u], ("x",), (), {"u": v, "v": x})

    @pytest.mark.parametrize(
        ("expression", "name"),
        [
            (sp.gamma(x), "gamma"),
            (sp.asinh(x), "asinh"),
            (sp.floor(x), "floor"),
            (sp.sign(x), "sign"),
            (sp.Heaviside(x), "Heaviside"),
            (sp.I * x, "ImaginaryUnit"),
            (sp.Function("spline")(x), "spline"),
            (sp.Derivative(sp.Function("spline")(x), x), "Derivative"),
            (sp.Integral(sp.sin(x**2), (x, 0, 1)), "Integral"),
            (sp.Piecewise((x, sp.Eq(x, y)), (y, True)), "Equality"),
            (x + sp.nan, "NaN"),
            (sp.oo, "Infinity"),
            (-sp.oo, "NegativeInfinity"),
            (sp.zoo, "ComplexInfinity"),
        ],
    )
    def test_an_unsupported_function_is_named(self, expression, name):
        with pytest.raises(ValueError, match=f"the function {name} "):
            compile_expressions([expression], ("x", "y"))

    def test_a_piecewise_must_cover_everything(self):
        with pytest.raises(ValueError, match="Piecewise to be True"):
            compile_expressions([sp.Piecewise((x, x > 0), (y, y > 0))], ("x", "y"))
