"""Exact algebra: nodes of a program as polynomials with rational coefficients in symbols.

A symbol is an open coordinate, a constant, or an operation on polynomials; the same operation on
equal polynomials is one symbol.  Equal polynomials are equal wherever the program is defined;
nothing is concluded from polynomials that differ.  None stands for what is not decided, or would
take too much work.
"""

import operator
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat

from .problem import StoredProgram
from .rationals import ratio

MOST_WORK = 10**9  # bits of coefficients that are multiplied
MOST_FACTORS = 64  # of a monomial
Polynomial = dict[tuple[int, ...], fmpq]  # a monomial repeats its symbols
ONE: Polynomial = {(): fmpq(1)}
ARITHMETIC = ("add", "sub", "neg", "mul", "square", "div")
COMPARED = {"lt": operator.lt, "le": operator.le}
AT_ZERO = dict.fromkeys(("sin", "tan", "asin", "atan", "sinh", "tanh", "erf"), 0)
AT_ZERO |= dict.fromkeys(("cos", "cosh", "exp"), 1)


class TooMuchError(Exception):
    """The algebra would take too much work."""


def total(u: Polynomial, v: Polynomial, factor: int | fmpq = 1) -> Polynomial:
    """Return ``u + factor v``."""
    found = dict(u)
    for monomial, x in v.items():
        found[monomial] = found.get(monomial, 0) + factor * x
    return {monomial: x for monomial, x in found.items() if x != 0}


def number(x: fmpq) -> Polynomial:
    return {(): x} if x != 0 else {}


def root(x: fmpq) -> Polynomial | None:
    if x < 0:
        return None
    found = fmpq(x.p.isqrt(), x.q.isqrt())
    return number(found) if found * found == x else None


def constant(u: Any) -> fmpq | None:
    """Return the number that a polynomial is, or None."""
    return u.get((), fmpq(0)) if isinstance(u, dict) and set(u) <= {()} else None


class Algebra:
    """Nodes of a program as polynomials, at a rational point or with open coordinates."""

    def __init__(self, p: StoredProgram, point: Sequence[fmpq] | None = None) -> None:
        self.p, self.point, self.work = p, point, 0
        self.keys: list[tuple[Any, ...]] = []
        self.places: dict[tuple[Any, ...], int] = {}
        self.known: dict[int, Any] = {}

    # ---------------------------------------------------------------------------- symbols, products

    def symbol(self, op: str, *given: Any) -> Polynomial:
        frozen = (tuple(sorted(x.items())) if isinstance(x, dict) else x for x in given)
        key = (op, *frozen)
        if key not in self.places:
            self.places[key] = len(self.keys)
            self.keys.append(key)
        return {(self.places[key],): fmpq(1)}

    def product(self, u: Polynomial, v: Polynomial) -> Polynomial:
        sizes = (max((int(x.height_bits()) for x in w.values()), default=0) for w in (u, v))
        self.work += len(u) * len(v) * (100 + sum(sizes))
        if self.work > MOST_WORK:
            raise TooMuchError
        found: Polynomial = {}
        for first, a in u.items():
            for second, b in v.items():
                if len(first) + len(second) > MOST_FACTORS:
                    raise TooMuchError
                for monomial, x in self.reduced(tuple(sorted((*first, *second)))).items():
                    found[monomial] = found.get(monomial, 0) + a * b * x
        return {monomial: x for monomial, x in found.items() if x != 0}

    def reduced(self, monomial: tuple[int, ...]) -> Polynomial:
        """Apply ``sqrt(x)^2 = x``, ``sin^2 = 1 - cos^2`` and ``y / y = 1``."""
        for s in set(monomial):
            op, *args = self.keys[s]
            rest = list(monomial)
            rest.remove(s)
            if op in {"sqrt", "sin"} and s in rest:
                rest.remove(s)
                instead = dict(args[0])
                if op == "sin":
                    cos = self.symbol("cos", instead)
                    instead = total(ONE, self.product(cos, cos), -1)
                return self.product({tuple(rest): fmpq(1)}, instead)
            if op == "inverse" and len(args[0]) == 1:
                ((inner, x),) = args[0]
                if len(inner) == 1 and inner[0] in rest:
                    rest.remove(inner[0])
                    return self.product({tuple(rest): 1 / x}, ONE)
        return {monomial: fmpq(1)}

    def inverse(self, u: Polynomial) -> Polynomial | None:
        x = constant(u)
        if x is None:
            return self.symbol("inverse", u)
        return {(): 1 / x} if x != 0 else None

    def power(self, u: Polynomial, exponent: int) -> Polynomial | None:
        base = u if exponent >= 0 else self.inverse(u)
        if base is None or abs(exponent) > MOST_FACTORS:
            return None
        found = ONE
        for _ in range(abs(exponent)):
            found = self.product(found, base)
        return found

    # -------------------------------------------------------------------------------------- values

    def value(self, node: int) -> Any:
        """Return a node as a polynomial, or its truth, or None."""
        for a in self.p.inputs(node):
            if a not in self.known:
                op, args = self.p.nodes[a]
                given = args if op in {"const", "var"} else [self.known[b] for b in args]
                try:
                    self.known[a] = None if None in given else self.applied(op, given)
                except TooMuchError:
                    self.known[a] = None
        return self.known[node]

    def applied(self, op: str, given: list[Any]) -> Any:
        if op in {"var", "const"}:
            return self.leaf(op, given[0])
        if op in ARITHMETIC:
            return self.arithmetic(op, given)
        found = self.decided(op, given, [constant(x) for x in given])
        return self.symbol(op, *given) if found is None else found

    def leaf(self, op: str, given: Any) -> Polynomial:
        if op == "var":
            return self.symbol(op, given) if self.point is None else number(self.point[given])
        *factors, last = given.split()
        if last not in {"pi", "e"}:
            return number(ratio(last))
        return self.product(number(ratio(*factors) if factors else fmpq(1)), self.symbol(last))

    def arithmetic(self, op: str, given: list[Any]) -> Polynomial | None:
        if op in {"add", "sub"}:
            return total(given[0], given[1], 1 if op == "add" else -1)
        if op == "neg":
            return total({}, given[0], -1)
        last = self.inverse(given[-1]) if op == "div" else given[-1]
        return None if last is None else self.product(given[0], last)

    def decided(self, op: str, given: list[Any], numbers: list[fmpq | None]) -> Any:
        """Return the result of an operation that is known where some arguments are numbers."""
        first, last = numbers[0], numbers[-1]
        if op == "select":
            return given[2 - given[0]] if isinstance(given[0], bool) else None
        if all(isinstance(x, bool) for x in given):
            return {"not": not given[0], "and": all(given), "or": any(given)}[op]
        if op == "pow" and last is not None and last.q == 1:
            return self.power(given[0], int(last.p))
        if first is None or last is None:
            return None
        if op in COMPARED:
            return COMPARED[op](first, last)
        if op == "abs":
            return number(abs(first))
        if op in {"min", "max"}:
            return number(min(first, last) if op == "min" else max(first, last))
        if op == "sqrt":
            return root(first)
        return number(fmpq(AT_ZERO[op])) if op in AT_ZERO and first == 0 else None

    def combines(self, node: int, others: Sequence[int]) -> bool:
        """Whether a node is a sum of multiples of others, and so vanishes wherever these do."""
        columns = [self.value(a) for a in (*others, node)]
        if not all(isinstance(u, dict) for u in columns):
            return False
        monomials = sorted(frozenset().union(*columns))
        rows = [[u.get(monomial, fmpq(0)) for u in columns] for monomial in monomials]
        if not others or not rows:
            return not rows
        before, whole = ([row[:count] for row in rows] for count in (len(others), len(columns)))
        return fmpq_mat(before).rank() == fmpq_mat(whole).rank()

    # -------------------------------------------------------------------------------------- slopes

    def slopes(self, along: Sequence[Polynomial], nodes: Sequence[int]) -> list[Any]:
        """Return derivatives of nodes along a vector field, one component for a coordinate."""
        found: dict[int, Any] = {}
        for node in nodes:
            for a in self.p.inputs(node):
                if a not in found:
                    op, args = self.p.nodes[a]
                    leaf = op in {"const", "var"}
                    parts = [] if leaf else [found[b] for b in args]
                    try:
                        found[a] = along[args[0]] if op == "var" else self.slope(a, op, parts)
                    except TooMuchError:
                        found[a] = None
        return [found[node] for node in nodes]

    def slope(self, a: int, op: str, parts: list[Any]) -> Any:
        if all(part == {} for part in parts):
            return {}  # whatever it is, it is a function of what does not change
        here, *given = [self.value(b) for b in (a, *self.p.nodes[a][1])]
        if None in parts or here is None or None in given:
            return None
        x, dx = given[0], parts[0]
        if op in {"add", "sub"}:
            return total(parts[0], parts[1], 1 if op == "add" else -1)
        if op == "neg":
            return total({}, dx, -1)
        if op in {"mul", "square"}:
            return total(self.product(dx, given[-1]), self.product(x, parts[-1]))
        if op == "div":
            return self.product(
                total(dx, self.product(here, parts[1]), -1), self.inverse(given[1]) or {}
            )
        factor = self.factor(op, x, here, constant(given[-1]))
        return None if factor is None else self.product(factor, dx)

    def factor(
        self, op: str, x: Polynomial, here: Polynomial, exponent: fmpq | None
    ) -> Polynomial | None:
        """Return the derivative of an operation, where it is a polynomial in symbols."""
        twins = {"pow": (exponent, "pow"), "sin": (1, "cos"), "cos": (-1, "sin")}
        share, twin = twins.get(op, (None, ""))
        if share is not None:
            given = [x] if twin != "pow" else [x, number((exponent or 0) - fmpq(1))]
            found = self.applied(twin, given)
            return None if found is None else total({}, found, share)
        if op == "sqrt" and (below := self.inverse(here)) is not None:
            return self.product({(): fmpq(1, 2)}, below)
        return here if op == "exp" else self.inverse(x) if op == "log" else None

    # --------------------------------------------------------------------------------------- words

    def words(self, u: Polynomial) -> str:
        """Return a polynomial as a formula."""
        terms = []
        for monomial, x in sorted(u.items()):
            factors = [self.named(s) for s in monomial]
            if x != 1 or not factors:
                factors.insert(0, str(x))
            terms.append("*".join(factors))
        return " + ".join(terms) or "0"

    def named(self, s: int) -> str:
        op, *args = self.keys[s]
        if op == "var":
            return str(self.p.names[args[0]])
        inner = ", ".join(self.words(dict(x)) if isinstance(x, tuple) else str(x) for x in args)
        return f"{op}({inner})" if args else op
