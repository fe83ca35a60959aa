"""Straight-line programs: a SymPy expression as a graph of shared operations, and its derivatives.

Every subexpression is stored once (hash-consing), so a quantity used by nine gaps is computed
once; derivatives are taken in forward mode on the same graph, and zero derivatives never become
operations ([GW] ch. 3, 6).  Branches (``Piecewise``, ``Min``, ``Max``, ``Abs``) become selections,
whose derivative is the derivative of the branch taken.
"""

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy

Payload = int | str | Fraction
Node = tuple[str, tuple[Payload, ...]]

ZERO, ONE = Fraction(0), Fraction(1)
UNARY = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt")
BOOLEAN = ("lt", "le", "and", "or", "not")


class Graph:
    """A growing list of operations, each stored once; a node is named by its position.

    Leaves are ``const`` (a fraction, ``"pi"`` or ``"e"``), ``var`` and ``par`` (a position).
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._index: dict[Node, int] = {}
        self._derivatives: dict[tuple[int, int], int] = {}

    def node(self, op: str, *args: Payload) -> int:
        """Return the node ``op(args)``, adding it when it is new."""
        key = (op, args)
        if key not in self._index:
            self._index[key] = len(self.nodes)
            self.nodes.append(key)
        return self._index[key]

    def const(self, value: Fraction | int | str) -> int:
        """Return a constant node: an exact fraction, or ``"pi"`` or ``"e"``."""
        return self.node("const", value if isinstance(value, str) else Fraction(value))

    def _value(self, a: int) -> Fraction | None:
        op, args = self.nodes[a]
        return args[0] if op == "const" and isinstance(args[0], Fraction) else None

    def add(self, a: int, b: int) -> int:
        """Return ``a + b``."""
        u, v = self._value(a), self._value(b)
        if u is not None and v is not None:
            return self.const(u + v)
        if u == 0:
            return b
        if v == 0:
            return a
        if self.nodes[b][0] == "neg":
            return self.sub(a, self._arg(b))
        if self.nodes[a][0] == "neg":
            return self.sub(b, self._arg(a))
        return self.node("add", min(a, b), max(a, b))

    def sub(self, a: int, b: int) -> int:
        """Return ``a - b``."""
        u, v = self._value(a), self._value(b)
        if u is not None and v is not None:
            return self.const(u - v)
        if v == 0:
            return a
        if a == b:
            return self.const(0)
        if u == 0:
            return self.neg(b)
        if self.nodes[b][0] == "neg":
            return self.add(a, self._arg(b))
        return self.node("sub", a, b)

    def neg(self, a: int) -> int:
        """Return ``-a``."""
        u = self._value(a)
        if u is not None:
            return self.const(-u)
        op, args = self.nodes[a]
        if op == "neg":
            return self._arg(a)
        if op == "sub":
            return self.node("sub", args[1], args[0])
        return self.node("neg", a)

    def mul(self, a: int, b: int) -> int:
        """Return ``a * b``."""
        u, v = self._value(a), self._value(b)
        if u is not None and v is not None:
            return self.const(u * v)
        if v is not None:
            a, b, u = b, a, v
        if u == 0:
            return a
        if u == 1:
            return b
        if u == -1:
            return self.neg(b)
        if self.nodes[a][0] == "neg":
            return self.neg(self.mul(self._arg(a), b))
        if self.nodes[b][0] == "neg":
            return self.neg(self.mul(a, self._arg(b)))
        return self.node("mul", min(a, b), max(a, b))

    def div(self, a: int, b: int) -> int:
        """Return ``a / b``; a shared reciprocal is left to ``inv``."""
        u, v = self._value(a), self._value(b)
        if v is not None and v != 0:
            return self.mul(a, self.const(1 / v))
        if u == 0:
            return a
        return self.node("div", a, b)

    def inv(self, a: int) -> int:
        """Return ``1 / a``."""
        return self.div(self.const(1), a)

    def unary(self, op: str, a: int) -> int:
        """Return an elementary function of ``a``."""
        u = self._value(a)
        if u == 0 and op in {"sin", "tan", "asin", "atan", "sinh", "tanh", "sqrt"}:
            return a
        if op == "sqrt" and u == 1:
            return a
        return self.node(op, a)

    def power(self, a: int, exponent: Fraction) -> int:
        """Return ``a ** exponent`` by multiplications and square roots where that is possible."""
        if exponent == 0:
            return self.const(1)
        if exponent < 0:
            return self.inv(self.power(a, -exponent))
        if exponent.denominator == 2:
            root = self.unary("sqrt", a)
            return self.mul(self.power(a, Fraction(int(exponent))), root)
        if exponent.denominator == 1:
            half = self.power(a, Fraction(exponent.numerator // 2))
            square = self.mul(half, half)
            return self.mul(square, a) if exponent.numerator % 2 else square
        return self.node("pow", a, self.const(exponent))

    def select(self, condition: int, a: int, b: int) -> int:
        """Return ``a`` where the condition holds and ``b`` elsewhere."""
        return a if a == b else self.node("select", condition, a, b)

    def _arg(self, a: int, position: int = 0) -> int:
        child = self.nodes[a][1][position]
        assert isinstance(child, int)
        return child

    def derivative(self, a: int, variable: int) -> int:
        """Return the partial derivative of node ``a`` by variable number ``variable``."""
        key = (a, variable)
        if key not in self._derivatives:
            self._derivatives[key] = self._differentiate(a, variable)
        return self._derivatives[key]

    def _differentiate(self, a: int, variable: int) -> int:
        op, args = self.nodes[a]
        if op == "var":
            return self.const(int(args[0] == variable))
        if op in {"const", "par"}:
            return self.const(0)
        if op == "select":
            condition, yes, no = (self._arg(a, k) for k in range(3))
            return self.select(
                condition, self.derivative(yes, variable), self.derivative(no, variable)
            )
        children = [self._arg(a, k) for k in range(len(args))]
        slopes = [self.derivative(child, variable) for child in children]
        if all(self._value(slope) == 0 for slope in slopes):
            return self.const(0)
        if len(children) == 1:
            return self._chain(op, a, children[0], slopes[0])
        return self._binary_rule(op, a, children, slopes)

    def _binary_rule(self, op: str, a: int, children: list[int], slopes: list[int]) -> int:
        u, v = children
        du, dv = slopes
        if op == "add":
            return self.add(du, dv)
        if op == "sub":
            return self.sub(du, dv)
        if op == "mul":
            return self.add(self.mul(du, v), self.mul(u, dv))
        if op == "div":
            return self.mul(self.sub(du, self.mul(a, dv)), self.inv(v))
        if op == "atan2":
            norm = self.add(self.mul(u, u), self.mul(v, v))
            return self.div(self.sub(self.mul(v, du), self.mul(u, dv)), norm)
        if op == "pow":
            slope = self.mul(v, self.node("pow", u, self.sub(v, self.const(1))))
            power_part = self.mul(slope, du)
            if self._value(dv) == 0:
                return power_part
            return self.add(power_part, self.mul(self.mul(a, self.unary("log", u)), dv))
        msg = f"no derivative rule for {op}"
        raise AssertionError(msg)

    def _chain(self, op: str, a: int, u: int, du: int) -> int:
        if op == "sqrt":
            return self.mul(self.mul(self.const(Fraction(1, 2)), self.inv(a)), du)
        if op in {"tan", "atan", "tanh", "log", "asin", "acos"}:
            return self._chain_reciprocal(op, a, u, du)
        slope = {
            "neg": lambda: self.const(-1),
            "sin": lambda: self.unary("cos", u),
            "cos": lambda: self.neg(self.unary("sin", u)),
            "sinh": lambda: self.unary("cosh", u),
            "cosh": lambda: self.unary("sinh", u),
            "exp": lambda: a,
        }[op]()
        return self.mul(slope, du)

    def _chain_reciprocal(self, op: str, a: int, u: int, du: int) -> int:
        one, square = self.const(1), self.mul(u, u)
        if op == "tan":
            return self.mul(self.add(one, self.mul(a, a)), du)
        if op == "tanh":
            return self.mul(self.sub(one, self.mul(a, a)), du)
        if op == "atan":
            return self.div(du, self.add(one, square))
        if op == "log":
            return self.div(du, u)
        quotient = self.div(du, self.unary("sqrt", self.sub(one, square)))
        return quotient if op == "asin" else self.neg(quotient)


@dataclass(frozen=True)
class Program:
    """The values of several expressions as one straight-line program.

    Attributes
    ----------
    graph : Graph
        The shared operations.
    outputs : tuple of int
        The node of each expression.
    variables, parameters : int
        How many of each the program reads.
    """

    graph: Graph
    outputs: tuple[int, ...]
    variables: int
    parameters: int

    def digest(self) -> str:
        """Return a hash of the operations: equal programs have equal digests."""
        text = repr((self.graph.nodes, self.outputs, self.variables, self.parameters))
        return hashlib.sha256(text.encode()).hexdigest()

    def derivatives(self, order: int) -> tuple[list[int], ...]:
        """Return the nodes of the values, gradients and (upper) Hessians up to ``order``.

        Gradients are listed row by row ``(m, k)``, Hessians as ``(m, k, k)``.
        """
        d, k = self.graph.derivative, range(self.variables)
        levels: tuple[list[int], ...] = (list(self.outputs),)
        if order >= 1:
            levels += ([d(f, i) for f in self.outputs for i in k],)
        if order >= 2:
            hessian = [d(d(f, min(i, j)), max(i, j)) for f in self.outputs for i in k for j in k]
            levels += (hessian,)
        return levels


def compile_expressions(
    expressions: Sequence["sympy.Expr"],
    variables: Sequence[str],
    parameters: Sequence[str] = (),
    definitions: "Mapping[str, sympy.Expr] | None" = None,
    names: Sequence[str] = (),
) -> Program:
    """Translate SymPy expressions into one program.

    Parameters
    ----------
    expressions : sequence of sympy.Expr
        What the program computes.
    variables, parameters : sequence of str
        Names of the symbols it reads, in order.
    definitions : mapping from str to sympy.Expr, optional
        Intermediate quantities by name, in an order in which each uses only earlier ones.
    names : sequence of str, optional
        What the expressions are called in error messages.

    Raises
    ------
    ValueError
        Naming a symbol that is neither variable, parameter nor definition, or a function that
        has no translation.
    """
    translator = _Translator(variables, parameters)
    for name, expression in (definitions or {}).items():
        translator.subject = name
        translator.names[name] = translator.translate(expression)
    outputs = []
    for position, expression in enumerate(expressions):
        translator.subject = names[position] if names else f"expression {position + 1}"
        outputs.append(translator.translate(expression))
    return Program(translator.graph, tuple(outputs), len(variables), len(parameters))


class _Translator:
    """Walks SymPy trees once, sharing whatever it has seen."""

    def __init__(self, variables: Sequence[str], parameters: Sequence[str]) -> None:
        self.graph = Graph()
        self.names = {name: self.graph.node("var", i) for i, name in enumerate(variables)}
        self.names |= {name: self.graph.node("par", i) for i, name in enumerate(parameters)}
        self.subject = ""
        self._seen: dict[sympy.Basic, int] = {}

    def translate(self, expression: "sympy.Basic") -> int:
        if expression not in self._seen:
            self._seen[expression] = self._translate(expression)
        return self._seen[expression]

    def _translate(self, e: "sympy.Basic") -> int:
        kind = type(e).__name__
        if kind in {"Symbol", "Dummy"}:
            return self._symbol(str(e))
        if getattr(e, "is_Rational", False) or getattr(e, "is_Float", False):
            return self.graph.const(_exact(e))
        rule = self._rules().get(kind)
        if rule is None:
            msg = f"{self.subject}: the function {kind} has no compiled form; got {e}"
            raise ValueError(msg)
        return rule(e)

    def _symbol(self, name: str) -> int:
        if name not in self.names:
            msg = (
                f"{self.subject}: the symbol {name} is no coordinate and no parameter; "
                f"known are {', '.join(self.names)}"
            )
            raise ValueError(msg)
        return self.names[name]

    def _rules(self) -> "dict[str, Callable[[sympy.Basic], int]]":
        g, t = self.graph, self.translate
        rules: dict[str, Callable[[sympy.Basic], int]] = {
            "Add": self._add,
            "Mul": self._mul,
            "Pow": self._pow,
            "Pi": lambda _: g.const("pi"),
            "Exp1": lambda _: g.const("e"),
            "atan2": lambda e: g.node("atan2", t(e.args[0]), t(e.args[1])),
            "Abs": self._abs,
            "Min": lambda e: self._extreme(e, smallest=True),
            "Max": lambda e: self._extreme(e, smallest=False),
            "Piecewise": self._piecewise,
            "StrictLessThan": lambda e: g.node("lt", t(e.args[0]), t(e.args[1])),
            "LessThan": lambda e: g.node("le", t(e.args[0]), t(e.args[1])),
            "StrictGreaterThan": lambda e: g.node("lt", t(e.args[1]), t(e.args[0])),
            "GreaterThan": lambda e: g.node("le", t(e.args[1]), t(e.args[0])),
            "Not": lambda e: g.node("not", t(e.args[0])),
            "And": lambda e: self._fold("and", e.args),
            "Or": lambda e: self._fold("or", e.args),
        }
        for op in UNARY:
            rules[op] = lambda e, op=op: g.unary(op, t(e.args[0]))  # type: ignore[misc]  # the default binds op
        return rules

    def _fold(self, op: str, args: "Iterable[sympy.Basic]") -> int:
        return reduce(lambda a, b: self.graph.node(op, a, b), map(self.translate, args))

    def _add(self, e: "sympy.Basic") -> int:
        return reduce(self.graph.add, map(self.translate, e.args))

    def _mul(self, e: "sympy.Basic") -> int:
        g = self.graph
        above: list[sympy.Basic] = []
        below: list[sympy.Basic] = []
        for factor in e.args:
            negative = type(factor).__name__ == "Pow" and factor.args[1].is_negative
            (below if negative else above).append(1 / factor if negative else factor)
        numerator = reduce(g.mul, map(self.translate, above), g.const(1))
        if not below:
            return numerator
        return g.div(numerator, reduce(g.mul, map(self.translate, below)))

    def _pow(self, e: "sympy.Basic") -> int:
        base, exponent = e.args
        if type(base).__name__ == "Exp1":
            return self.graph.unary("exp", self.translate(exponent))
        if exponent.is_Rational:
            return self.graph.power(self.translate(base), _exact(exponent))
        return self.graph.node("pow", self.translate(base), self.translate(exponent))

    def _abs(self, e: "sympy.Basic") -> int:
        u = self.translate(e.args[0])
        g = self.graph
        return g.select(g.node("lt", u, g.const(0)), g.neg(u), u)

    def _extreme(self, e: "sympy.Basic", *, smallest: bool) -> int:
        g = self.graph

        def pick(a: int, b: int) -> int:
            first = g.node("le", a, b) if smallest else g.node("le", b, a)
            return g.select(first, a, b)

        return reduce(pick, map(self.translate, e.args))

    def _piecewise(self, e: "sympy.Basic") -> int:
        *cases, (last, otherwise) = e.args
        if otherwise != True:  # noqa: E712  SymPy's own truth value, not Python's
            msg = (
                f"{self.subject}: expected the last case of a Piecewise to be True; got {otherwise}"
            )
            raise ValueError(msg)
        result = self.translate(last)
        for value, condition in reversed(cases):
            result = self.graph.select(self.translate(condition), self.translate(value), result)
        return result


def _exact(number: "sympy.Basic") -> Fraction:
    if getattr(number, "is_Float", False):
        return Fraction(float(number))
    return Fraction(int(number.p), int(number.q))
