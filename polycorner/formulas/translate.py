"""SymPy expressions as straight-line programs."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial, reduce
from typing import TYPE_CHECKING

from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import Graph, Program
from polycorner.values import cached_property

if TYPE_CHECKING:
    import sympy

LARGEST_POWER = 2**16  # up to which a power is a chain of multiplications


def compile_expressions(
    expressions: Sequence["sympy.Expr"],
    variables: Sequence[str],
    parameters: Sequence[str] = (),
    definitions: "Mapping[str, sympy.Expr] | None" = None,
    names: Sequence[str] = (),
    stationary: Iterable[str] = (),
) -> Program:
    """Translate SymPy expressions into one program.

    Parameters
    ----------
    expressions : sequence of sympy.Expr
        The outputs of the program.
    variables, parameters : sequence of str
        Names of the symbols it reads, in order.
    definitions : mapping from str to sympy.Expr, optional
        Intermediate quantities by name, in an order in which each uses only earlier ones.
    names : sequence of str, optional
        Names of the expressions in error messages.
    stationary : iterable of str, optional
        Definitions on which no expression depends to the first order, and variables by which
        derivatives are not asked for.

    Raises
    ------
    ValueError
        Naming a symbol that is neither variable, parameter nor definition, or a function that
        has no translation.
    """
    translator = Translator(variables, parameters)
    for name, expression in (definitions or {}).items():
        translator.subject = name
        translator.names[name] = translator.translate(expression)
    outputs = []
    for position, expression in enumerate(expressions):
        translator.subject = names[position] if names else f"expression {position + 1}"
        outputs.append(translator.translate(expression))
    held = tuple([translator.graph.core(translator.names[name]) for name in stationary])
    return Program(translator.graph, tuple(outputs), len(variables), len(parameters), held)


class Translator:
    """Translator of SymPy trees that visits each shared subexpression once."""

    def __init__(self, variables: Sequence[str], parameters: Sequence[str]) -> None:
        self.graph = Graph()
        self.names = {name: self.graph.node("var", i) for i, name in enumerate(variables)}
        self.names |= {name: self.graph.node("par", i) for i, name in enumerate(parameters)}
        self.subject = ""
        self._seen: dict[sympy.Basic, int] = {}

    def translate(self, expression: "sympy.Basic") -> int:
        """Return the node of an expression."""
        if expression not in self._seen:
            self._seen[expression] = self._translate(expression)
        return self._seen[expression]

    def _translate(self, e: "sympy.Basic") -> int:
        kind = type(e).__name__
        if kind in {"Symbol", "Dummy"}:
            return self.symbol(str(e))
        if getattr(e, "is_Rational", False) or getattr(e, "is_Float", False):
            return self._number(e)
        rule = self._rules.get(kind)
        if rule is None:
            msg = f"{self.subject}: the function {kind} has no compiled form; got {e}"
            raise ValueError(msg)
        return rule(e)

    def _number(self, e: "sympy.Basic") -> int:
        # Floats are rounded as doubles are: one that is too small is zero.
        fits = math.isfinite(float(e)) if e.is_Float else representable((int(e.p), int(e.q)))
        if not fits:
            msg = (
                f"{self.subject}: expected numbers that double precision can hold, between "
                f"4.9e-324 and 1.8e308 in size; got {e.evalf(6)!s}"
            )
            raise ValueError(msg)
        return self.number(_exact(e))

    @property
    def known(self) -> Iterable[str]:
        """The names of all symbols."""
        return self.names

    def number(self, value: Fraction) -> int:
        """Return the node of a number."""
        return self.graph.const(value)

    def symbol(self, name: str) -> int:
        """Return the node of a symbol."""
        if name not in self.names:
            msg = (
                f"{self.subject}: the symbol {name} is none of the variables and no parameter; "
                f"known are {', '.join(self.known)}"
            )
            raise ValueError(msg)
        return self.names[name]

    @cached_property
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
        return rules | {op: partial(self._unary, op) for op in OPERATIONS}

    def _unary(self, op: str, e: "sympy.Basic") -> int:
        return self.graph.unary(op, self.translate(e.args[0]))

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
        if exponent.is_Rational and abs(exponent) <= LARGEST_POWER:
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
        if type(otherwise).__name__ != "BooleanTrue":
            msg = (
                f"{self.subject}: expected the last case of a Piecewise to be True; got {otherwise}"
            )
            raise ValueError(msg)
        result = self.translate(last)
        for value, condition in reversed(cases):
            result = self.graph.select(self.translate(condition), self.translate(value), result)
        return result


def representable(number: tuple[int, int] | float) -> bool:
    """Whether a number, given as numerator and denominator or as a double, fits in a double."""
    if not isinstance(number, tuple):
        return math.isfinite(number)
    try:
        return number[0] == 0 or number[0] / number[1] != 0
    except OverflowError:
        return False


def _exact(number: "sympy.Basic") -> Fraction:
    if getattr(number, "is_Float", False):
        return Fraction(float(number))
    return Fraction(int(number.p), int(number.q))
