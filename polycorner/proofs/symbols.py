"""Exact values: polynomials with rational coefficients in symbols that stand for numbers.

Symbols are coordinates left open, pi, e, roots of polynomials, and operations whose result is not
rational; equal operations on equal polynomials are one symbol.  Equal polynomials are equal
numbers; nothing is concluded from polynomials that differ, but that one is less than another where
enclosures show it.
"""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import isqrt
from typing import Any

from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import Graph, Payload
from polycorner.intervals.balls import (
    Ball,
    ball,
    constant,
    current_precision,
    exact,
    operations,
    roots,
)
from polycorner.intervals.enclosures import Formulas
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.polynomials import Polynomial, TooLargeError

ZERO = Fraction(0)
ONE = Fraction(1)
# Twice the sine where it is rational, by twelfths of a turn.
TWICE_SINES = {0: 0, 1: 1, 3: 2, 5: 1, 6: 0, 7: -1, 9: -2, 11: -1}
COMPARE = ("lt", "le")

Key = tuple[Any, ...]


class Symbols:
    """The symbols of polynomials: each is an open coordinate, a constant or an operation.

    ``places`` are enclosures of open coordinates that stand for one number each.
    """

    def __init__(self) -> None:
        self.keys: list[Key] = []
        self.places: dict[int, Ball] = {}
        self._index: dict[Key, int] = {}

    def of(self, op: str, *args: Any) -> Polynomial:
        """Return the symbol of an operation on polynomials, or of a leaf."""
        frozen = (tuple(sorted(a.items())) if isinstance(a, dict) else a for a in args)
        key = (op, *frozen)
        if key not in self._index:
            self._index[key] = len(self.keys)
            self.keys.append(key)
        return {(self._index[key],): ONE}

    def algebraic(self, coefficients: Sequence[int], near: "Ball") -> Polynomial | None:
        """Return the symbol of the real root in a ball, if there is one and no other root is near.

        The constant coefficient comes first; the last is not 0.
        """
        every = roots(tuple(coefficients), current_precision())
        alike = [x for x in every if x.real.overlaps(near)]
        if len(alike) != 1 or alike[0].imag != 0 or not near.contains(alike[0].real):
            return None
        return self.of("root", tuple(coefficients), exact(near.mid()))

    def fixed(self, symbol: int) -> bool:
        """Whether a symbol stands for a number."""
        op, *args = self.keys[symbol]
        if op == "var":
            return args[0] in self.places
        if op == "root":
            return True
        return all(
            self.fixed(inner) for arg in args if op != "const" for m, _ in arg for inner in m
        )

    def ball(self, p: "Mapping[tuple[int, ...], Fraction]") -> "Ball":
        """Return an enclosure of a polynomial in symbols that stand for numbers."""
        total = ball(0)
        for monomial, weight in p.items():
            term = ball(weight)
            for symbol in monomial:
                term = term * self._number(symbol)
            total = total + term
        return total

    def _number(self, symbol: int) -> "Ball":
        op, *args = self.keys[symbol]
        if op == "root":
            coefficients, near = args
            real: list[Ball] = [x.real for x in roots(coefficients, current_precision())]
            return min(real, key=lambda x: abs(x - ball(near)).upper())
        if op in {"const", "var"}:
            return constant(args[0]) if op == "const" else self.places[args[0]]
        found: Ball = operations()[op](*(self.ball(dict(arg)) for arg in args))
        return found

    def negative(self, p: Polynomial, or_zero: bool = False) -> bool | None:
        """Whether a polynomial is negative, or at most zero; None where that is not decided."""
        value = algebra.constant(p)
        if value is not None:
            return value < 0 or (or_zero and value == 0)
        if not all(self.fixed(symbol) for monomial in p for symbol in monomial):
            return None
        shown = self.ball(p)
        if shown < 0 or (or_zero and shown <= 0):
            return True
        return False if shown > 0 or (not or_zero and shown >= 0) else None

    def _square(self, symbol: int) -> tuple[int, Polynomial] | None:
        """Return a power of a symbol that is a polynomial of a lower degree, and this polynomial.

        A square root's square is what is under it; a root's highest power is given by its equation.
        """
        op, *args = self.keys[symbol]
        if op == "sqrt" and (inner := algebra.constant(dict(args[0]))) is not None:
            return 2, algebra.number(inner)
        if op == "root":
            *low, top = args[0]
            powers = {(symbol,) * k: Fraction(-c, top) for k, c in enumerate(low) if c}
            return len(low), powers
        return None

    def product(self, u: Polynomial, v: Polynomial) -> Polynomial:
        """Return the product, in which powers of roots are of the least degree."""
        waiting, found = [algebra.product(u, v)], Polynomial()
        while waiting:
            for monomial, weight in waiting.pop().items():
                for symbol in set(monomial):
                    known = self._square(symbol)
                    if known and monomial.count(symbol) >= known[0]:
                        left = list(monomial)
                        for _ in range(known[0]):
                            left.remove(symbol)
                        waiting.append(algebra.product({tuple(left): weight}, known[1]))
                        break
                else:
                    found = algebra.total([found, {monomial: weight}])
        return found


def evaluate(
    graph: Graph, outputs: Sequence[int], inputs: Sequence[Polynomial], symbols: Symbols
) -> list[Any]:
    """Return exact values of nodes; None where a branch or a size is not decided."""
    values: dict[int, Any] = {}
    for a in graph.needed(outputs):
        op, args = graph.nodes[a]
        if op == "var":
            values[a] = inputs[int(args[0])]
        elif op == "const":
            values[a] = _leaf(args[0], symbols)
        else:
            values[a] = _applied(op, [values[child] for child in graph.children(a)], symbols)
    return [values[a] for a in outputs]


def _leaf(value: Payload, symbols: Symbols) -> Polynomial:
    if isinstance(value, str):
        return symbols.of("const", value)
    return algebra.number(Fraction(value))


def _applied(op: str, given: list[Any], symbols: Symbols) -> Any:
    if op == "select":
        return None if given[0] is None else given[1] if given[0] else given[2]
    if any(x is None for x in given):
        return None
    if op in {"not", "and", "or"}:
        return not given[0] if op == "not" else all(given) if op == "and" else any(given)
    try:
        return _number_of(op, given, symbols)
    except TooLargeError:
        return None


def _number_of(op: str, given: list[Polynomial], symbols: Symbols) -> Any:
    numbers = [algebra.constant(p) for p in given]
    first, last = numbers[0], numbers[-1]
    if op in {"add", "sub", "neg"}:
        return algebra.total(given, op)
    if op == "mul":
        return symbols.product(*given)
    if op in COMPARE:
        return symbols.negative(algebra.total(given, "sub"), or_zero=op == "le")
    if op == "abs" and (sign := symbols.negative(given[0])) is not None:
        return algebra.total(given, "neg") if sign else given[0]
    if op == "div":
        if last is not None:
            return symbols.product(given[0], {(): 1 / last}) if last else None
        return symbols.product(given[0], symbols.of("div", algebra.number(1), given[1]))
    if op == "pow":
        return _power(given, last, symbols)
    if op == "sqrt" and first is not None:
        return _root(first, symbols)
    if op in OPERATIONS and (value := OPERATIONS[op].known.get(first)) is not None:
        return algebra.number(value)
    if op in {"sin", "cos"} and (turn := _twelfths(given[0], symbols)) is not None:
        twice = TWICE_SINES.get((turn + 3 * (op == "cos")) % 12)
        if twice is not None:
            return algebra.number(Fraction(twice, 2))
    if op == "atan2" and first == 0 and last is not None and last > 0:
        return {}
    return symbols.of(op, *given)


def _twelfths(p: Polynomial, symbols: Symbols) -> int | None:
    """Return an angle in twelfths of a turn, if it is a whole number of them."""
    ((pi, _),) = symbols.of("const", "pi").items()
    sixths = 6 * p[pi] if set(p) == {pi} else None
    return int(sixths) if sixths is not None and sixths.denominator == 1 else None


def _power(given: list[Polynomial], exponent: Fraction | None, symbols: Symbols) -> Any:
    base = given[0]
    if exponent is not None and exponent >= 0 and exponent.denominator == 1:
        result = algebra.number(1)
        for _ in range(int(exponent)):
            result = symbols.product(result, base)
        return result
    if not base:
        return {} if exponent is not None and exponent > 0 else None
    if algebra.constant(base) == 1:
        return base
    return symbols.of("pow", *given)


def _root(value: Fraction, symbols: Symbols) -> Polynomial | None:
    if value < 0:
        return None
    root = Fraction(isqrt(value.numerator), isqrt(value.denominator))
    if root * root == value:
        return algebra.number(root)
    return symbols.of("sqrt", algebra.number(value))


def constants(formulas: Formulas, symbols: Symbols) -> list[Polynomial]:
    """Return the irrational constants that occur in formulas."""
    evaluate(formulas.graph, formulas.outputs, opened(formulas, symbols), symbols)
    found: list[Polynomial] = [{(k,): ONE} for k in range(len(symbols.keys)) if symbols.fixed(k)]
    return [p for p in found if symbols.ball(p).is_finite()]


def opened(formulas: Formulas, symbols: Symbols) -> list[Polynomial]:
    """Return all coordinates as symbols."""
    return [symbols.of("var", i) for i in range(formulas.inputs)]
