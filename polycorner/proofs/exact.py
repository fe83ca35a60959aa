"""Zeros that no enclosure can show, by exact algebra.

A ball that contains 0 leaves a sign open at every precision where the number *is* zero.  Two
arguments show that it is:

- *At a recognised point.*  Lattice reduction proposes every unknown of an enclosed solution as a
  rational combination of 1 and the irrational constants of the formulas.  If these numbers lie in
  the box with exactly one solution and the KKT equations hold there identically, they are the
  solution, and functions may be evaluated at it.
- *On the face.*  A function that is a combination of the functions held, with polynomials as
  coefficients, vanishes wherever these do: division, and Buchberger's algorithm in small cases,
  decide membership of the ideal ([CLO] ch. 2).

Values are polynomials in *symbols*: coordinates left open, pi, e, and operations whose result is
not rational, equal operations on equal polynomials being one symbol.  Equal polynomials are
equal numbers; nothing is concluded from polynomials that differ.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import TYPE_CHECKING, Any

from polycorner.formulas.programs import Graph, Payload
from polycorner.formulas.ranges import arguments
from polycorner.intervals.balls import ball, constant, exact, integer_relation, operations
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import needed
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.krawczyk import Enclosure
from polycorner.proofs.polynomials import Polynomial, TooLargeError

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

MOST_CONSTANTS = 6  # irrational constants among which a number is sought
# Sizes up to which Buchberger's algorithm is tried: symbols, degree, and terms of a polynomial.
MOST_SYMBOLS, MOST_DEGREE, MOST_SUMMANDS = 6, 6, 40

ZERO = Fraction(0)
ONE = Fraction(1)
# Elementary functions at their rational arguments with rational values.
KNOWN: dict[str, tuple[Fraction, Fraction]] = {
    **dict.fromkeys(("sin", "tan", "asin", "atan", "sinh", "tanh", "erf"), (ZERO, ZERO)),
    **dict.fromkeys(("cos", "cosh", "exp"), (ZERO, ONE)),
    **dict.fromkeys(("log", "acos"), (ONE, ZERO)),
}
COMPARE: dict[str, Callable[[Fraction, Fraction], bool]] = {
    "lt": lambda x, y: x < y,
    "le": lambda x, y: x <= y,
}

Key = tuple[Any, ...]


class Symbols:
    """The symbols of polynomials: each is an open coordinate, a constant or an operation."""

    def __init__(self) -> None:
        self.keys: list[Key] = []
        self._index: dict[Key, int] = {}

    def of(self, op: str, *args: Any) -> Polynomial:
        """Return the symbol of an operation on polynomials, or of a leaf."""
        frozen = (tuple(sorted(a.items())) if isinstance(a, dict) else a for a in args)
        key = (op, *frozen)
        if key not in self._index:
            self._index[key] = len(self.keys)
            self.keys.append(key)
        return {(self._index[key],): ONE}

    def fixed(self, symbol: int) -> bool:
        """Whether a symbol stands for a number."""
        op, *args = self.keys[symbol]
        return op != "var" and all(
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
        if op == "const":
            return constant(args[0])
        found: Ball = operations()[op](*(self.ball(dict(arg)) for arg in args))
        return found

    def root(self, symbol: int) -> Fraction | None:
        """Return the number of which a symbol is the square root, if it is a rational one."""
        op, *args = self.keys[symbol]
        return algebra.constant(dict(args[0])) if op == "sqrt" else None

    def product(self, u: Polynomial, v: Polynomial) -> Polynomial:
        """Return the product, in which squares of square roots are numbers."""
        found: Polynomial = {}
        for monomial, weight in algebra.product(u, v).items():
            left, factor = list(monomial), weight
            for symbol in set(monomial):
                inner = self.root(symbol)
                while inner is not None and left.count(symbol) > 1:
                    left.remove(symbol)
                    left.remove(symbol)
                    factor *= inner
            found = algebra.total([found, {tuple(left): factor}])
        return found


def evaluate(
    graph: Graph, outputs: Sequence[int], inputs: Sequence[Polynomial], symbols: Symbols
) -> list[Any]:
    """Return exact values of nodes; None where a branch or a size is not decided."""
    values: dict[int, Any] = {}
    for a in needed(graph, outputs):
        op, args = graph.nodes[a]
        if op == "var":
            values[a] = inputs[int(args[0])]
        elif op == "const":
            values[a] = _leaf(args[0], symbols)
        else:
            values[a] = _applied(op, [values[child] for child in arguments(graph, a)], symbols)
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
        return None if first is None or last is None else COMPARE[op](first, last)
    if op == "div":
        if last is not None:
            return symbols.product(given[0], {(): 1 / last}) if last else None
        return symbols.product(given[0], symbols.of("div", algebra.number(1), given[1]))
    if op == "pow":
        return _power(given, last, symbols)
    if op == "sqrt" and first is not None:
        return _root(first, symbols)
    if op in KNOWN and first == KNOWN[op][0]:
        return algebra.number(KNOWN[op][1])
    if op == "atan2" and first == 0 and last is not None and last > 0:
        return {}
    return symbols.of(op, *given)


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


# ------------------------------------------------------------------------------ recognised points


@dataclass(frozen=True, eq=False)
class ExactPoint:
    """An enclosed solution whose unknowns are known exactly.

    Attributes
    ----------
    unknowns : tuple of Polynomial
        Coordinates and multipliers, in numbers and constants.
    symbols : Symbols
        The constants.
    """

    unknowns: tuple[Polynomial, ...]
    symbols: Symbols

    def vanishes(self, formulas: Formulas, row: int) -> bool:
        """Whether a function, which is known to be defined there, is shown to be zero."""
        inputs = self.unknowns[: formulas.dimension]
        return evaluate(formulas.graph, [formulas.outputs[row]], inputs, self.symbols) == [{}]


def recognised(enclosure: Enclosure) -> ExactPoint | None:
    """Return the solution in an enclosure exactly, if it is recognised and shown to be one."""
    system = enclosure.predictor.system
    formulas, symbols = system.formulas, Symbols()
    n = system.dimension
    if formulas.free:
        return None
    constants = _constants(formulas, symbols)
    if len(constants) > MOST_CONSTANTS:
        return None
    unknowns = [_combination(x, constants, symbols) for x in enclosure.solution]
    known = tuple([p for p in unknowns if p is not None])
    if len(known) < len(unknowns):
        return None
    inside = enclosure.predictor.unknowns(enclosure.candidate)
    if not all(w.contains(symbols.ball(p)) for w, p in zip(inside, known, strict=True)):
        return None
    found = ExactPoint(known, symbols)
    forms = enclosure.linear.forms
    k = len(system.held)
    d = forms.graph.derivative
    slopes = [d(f, i) for f in forms.outputs for i in range(n)]
    values = evaluate(forms.graph, [*forms.outputs[:k], *slopes], known[:n], symbols)
    if any(value is None for value in values) or any(values[:k]):
        return None
    rows = [values[k + n * r : k + n * (r + 1)] for r in range(k + 1)]
    return found if _stationary(system.gauges, system.anchor, rows, found, n) else None


def common_zero(
    formulas: Formulas, rows: Sequence[int], solution: "Sequence[Ball]"
) -> ExactPoint | None:
    """Return a point in a small enclosure at which functions are shown to vanish exactly.

    That the enclosure contains it is tested; if the functions have one common zero in a larger one
    this is it.
    """
    symbols = Symbols()
    constants = _constants(formulas, symbols)
    if len(constants) > MOST_CONSTANTS:
        return None
    unknowns = [_recognised(x, constants, symbols) for x in solution]
    known = tuple([p for p in unknowns if p is not None])
    if len(known) < len(unknowns):
        return None
    wide = [x + ball(0, 2.0**-50) for x in solution]
    if not all(w.contains(symbols.ball(p)) for w, p in zip(wide, known, strict=True)):
        return None
    values = evaluate(formulas.graph, [formulas.outputs[row] for row in rows], known, symbols)
    return None if any(value != {} for value in values) else ExactPoint(known, symbols)


def _recognised(x: "Ball", constants: Sequence[Polynomial], symbols: Symbols) -> Polynomial | None:
    return algebra.number(exact(x)) if x.is_exact() else _combination(x, constants, symbols)


def _stationary(
    gauges: Sequence[Sequence[float]],
    anchor: Sequence[float],
    rows: Sequence[Sequence[Polynomial]],
    point: ExactPoint,
    n: int,
) -> bool:
    """Whether the energy's gradient, the last row, is the combination of the others."""
    product, unknowns = point.symbols.product, point.unknowns
    normals = [[algebra.number(Fraction(x)) for x in gauge] for gauge in gauges]
    for i in range(n):
        rest = rows[-1][i]
        for weight, row in zip(unknowns[n:], [*rows[:-1], *normals], strict=True):
            rest = algebra.total([rest, product(weight, row[i])], "sub")
        if rest:
            return False
    for normal in normals:
        away: Polynomial = {}
        for p, x, part in zip(unknowns, anchor, normal, strict=False):
            offset = algebra.total([p, algebra.number(Fraction(x))], "sub")
            away = algebra.total([away, product(part, offset)])
        if away:
            return False
    return True


def _constants(formulas: Formulas, symbols: Symbols) -> list[Polynomial]:
    """Return the irrational constants that occur in formulas."""
    evaluate(formulas.graph, formulas.outputs, _open(formulas, symbols), symbols)
    found: list[Polynomial] = [{(k,): ONE} for k in range(len(symbols.keys)) if symbols.fixed(k)]
    return [p for p in found if symbols.ball(p).is_finite()]


def _open(formulas: Formulas, symbols: Symbols) -> list[Polynomial]:
    return [symbols.of("var", i) for i in range(formulas.inputs)]


def _combination(x: "Ball", constants: Sequence[Polynomial], symbols: Symbols) -> Polynomial | None:
    """Return a rational combination of 1 and constants that may be the number in a ball."""
    terms = [algebra.number(1), *constants]
    relation = integer_relation([x, *(symbols.ball(p) for p in terms)])
    if relation is None:
        return None
    result: Polynomial = {}
    for weight, p in zip(relation[1:], terms, strict=True):
        share = algebra.number(Fraction(-weight, relation[0]))
        result = algebra.total([result, algebra.product(share, p)])
    return result


# ------------------------------------------------------------------------------ ideals of a face


def implied(formulas: Formulas, held: Sequence[int], row: int) -> bool:
    """Whether a function is a combination of others and so vanishes wherever they all do.

    It does so where it is defined; that its operations are is for the caller to know.
    """
    symbols = Symbols()
    outputs = [formulas.outputs[i] for i in (row, *held)]
    found = evaluate(formulas.graph, outputs, _open(formulas, symbols), symbols)
    if any(p is None for p in found) or not held:
        return False
    return _in_ideal(found[0], found[1:])


def _in_ideal(p: Polynomial, generators: Sequence[Polynomial]) -> bool:
    from sympy import QQ
    from sympy.polys.groebnertools import groebner
    from sympy.polys.orderings import grevlex
    from sympy.polys.rings import PolyRing

    used = sorted({s for q in (p, *generators) for monomial in q for s in monomial})
    if not used:
        return not p
    ring = PolyRing([f"s{s}" for s in used], QQ, grevlex)

    def written(q: Polynomial) -> Any:
        terms = {
            tuple(m.count(s) for s in used): QQ(w.numerator, w.denominator) for m, w in q.items()
        }
        return ring.from_dict(terms)

    target, basis = written(p), [g for g in map(written, generators) if g]
    if not target or (basis and not target.rem(basis)):
        return True
    small = len(used) <= MOST_SYMBOLS and all(
        len(q) <= MOST_SUMMANDS and max((len(m) for m in q), default=0) <= MOST_DEGREE
        for q in (p, *generators)
    )
    return bool(small and basis) and not target.rem(groebner(basis, ring))
