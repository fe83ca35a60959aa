"""Straight-line programs evaluated in truncated power series ([GW] ch. 13), and these."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.adjoints import derivatives
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import LEAVES, Graph
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import cached_property

# A series is an array ``(2, K)``: its coefficients, by increasing degree, and bounds of their
# rounding errors in units of the machine's precision, propagated to first order: for a product
# ``|a| e_b + e_a |b| + |a| |b|``, for a function ``|f'(a)| e_a + |f(a)|`` ([GW] ch. 13 for the
# arithmetic, [Higham] sec. 3.3 for running error bounds).

EPSILON = float(np.finfo(np.float64).eps)


class Ring:
    """Power series in ``variables`` variables, truncated beyond total degree ``order``.

    Attributes
    ----------
    exponents : (K, variables) array of int
        Exponents of the monomials, by increasing degree; ``degrees`` are their sums.
    """

    def __init__(self, variables: int, order: int) -> None:
        self.variables, self.order = variables, order
        rows = [
            [chosen.count(i) for i in range(variables)]
            for degree in range(order + 1)
            for chosen in combinations_with_replacement(range(variables), degree)
        ]
        self.exponents = np.array(rows, dtype=np.int64).reshape(len(rows), variables)
        self.degrees: NDArray[np.int64] = self.exponents.sum(axis=1)
        self.index = {tuple(row): k for k, row in enumerate(rows)}
        ends = np.searchsorted(self.degrees, np.arange(order + 2)).tolist()
        triples = sorted(
            (self.index[tuple(self.exponents[i] + self.exponents[j])], i, j)
            for i, degree in enumerate(self.degrees.tolist())
            for j in range(ends[order - degree + 1])
        )
        to, self._left, self._right = (np.array(column) for column in zip(*triples, strict=True))
        self._starts = np.flatnonzero(np.diff(to, prepend=-1))

    @property
    def size(self) -> int:
        """The number of coefficients."""
        return len(self.degrees)

    def constant(self, value: float) -> Array:
        """Return a constant series, exact."""
        series = np.zeros((2, self.size))
        series[0, 0] = value
        return series

    def variable(self, i: int) -> Array:
        """Return the series of variable number ``i``."""
        series = np.zeros((2, self.size))
        if self.order:
            series[0, 1 + i] = 1.0
        return series

    def mul(self, a: Array, b: Array) -> Array:
        """Return the product."""
        u, v = abs(a[0]), abs(b[0])
        parts = self._products(np.array([a[0], u, a[1]]), np.array([b[0], b[1] + v, v]))
        parts[1] += parts[2]
        return parts[:2]

    def _products(self, a: Array, b: Array) -> Array:
        """Return the products of coefficients ``(k, K)``, row by row."""
        parts = a.take(self._left, axis=1)
        parts *= b.take(self._right, axis=1)
        return np.asarray(np.add.reduceat(parts, self._starts, axis=1))

    def compose(self, taylor: Array, a: Array) -> Array:
        """Return ``f(a)`` for Taylor coefficients ``(order + 2,)`` of ``f`` at ``a``'s constant.

        Horner's scheme gives the value, its bound ``sum |c_k| |a|^k`` and ``sum k |c_k| |a|^k-1``.
        """
        powers = np.array([a[0], abs(a[0]), abs(a[0])])
        powers[:, 0] = 0.0
        sizes = abs(taylor)
        factors = np.array([taylor[:-1], sizes[:-1], sizes[1:] * np.arange(1, len(taylor))])
        result = np.zeros_like(powers)
        result[:, 0] = factors[:, -1]
        for c in factors[:, -2::-1].T:
            result = self._products(result, powers)
            result[:, 0] += c
        result[1] += self._products(result[2:], a[1:])[0]
        return result[:2]

    @cached_property
    def shifts(self) -> list[tuple[int, int, int, float]]:
        """Entries ``(to, from, variable, factor)`` of the partial derivatives."""
        return [
            (self.index[tuple(e - np.eye(self.variables, dtype=np.int64)[i])], k, i, float(e[i]))
            for k, e in enumerate(self.exponents)
            for i in range(self.variables)
            if e[i]
        ]

    def derivative(self, coefficients: Array, i: int) -> Array:
        """Return the coefficients of the partial derivative by variable ``i``."""
        result = np.zeros_like(coefficients)
        for to, source, variable, factor in self.shifts:
            if variable == i:
                result[to] += factor * coefficients[source]
        return result

    def shifted(self, coefficients: Array, move: Array) -> Array:
        """Return the coefficients of ``p(w + move)``, by Taylor's formula."""
        total, term = coefficients.copy(), coefficients
        for k in range(1, self.order + 1):
            term = sum(
                (step / k * self.derivative(term, i) for i, step in enumerate(move) if step),
                np.zeros_like(term),
            )
            total += term
        return total


@lru_cache(maxsize=64)
def ring(variables: int, order: int) -> Ring:
    """Return the ring of truncated series, from a cache."""
    return Ring(variables, order)


class NotAnalyticError(ArithmeticError):
    """A formula has no power series at the point: a kink, a branch point, or no value."""


def function_series(
    functions: Sequence[SmoothFunction], q: Sequence[Array], domain: Ring, *, slopes: bool
) -> list[list[Array]]:
    """Return ``[value, df/dq_1, ..., df/dq_n]`` of every function along the series ``q``.

    Without ``slopes`` only the values.

    Raises
    ------
    NotAnalyticError
        Where a formula has no power series.
    """
    grouped: dict[tuple[int, tuple[int, ...], tuple[float, ...]], list[int]] = {}
    for position, f in enumerate(functions):
        grouped.setdefault((id(f.family), f.reads, f.parameters), []).append(position)
    results: list[list[Array]] = [[] for _ in functions]
    for (_, reads, parameters), positions in grouped.items():
        family = functions[positions[0]].family
        plan = _plan(family, tuple([functions[i].member_name for i in positions]), slopes)
        series = _evaluated(plan.steps, [q[i] for i in reads], parameters, domain)
        for position, targets in zip(positions, plan.targets, strict=True):
            found = results[position]
            found.append(series[targets[0]])
            if slopes:
                partial = dict(zip(reads, targets[1:], strict=True))
                zero = domain.constant(0.0)
                found += [series[partial[i]] if i in partial else zero for i in range(len(q))]
    return results


class _Plan(NamedTuple):
    """Operations in order, and for each function the nodes of its value and its derivatives."""

    steps: list[tuple[int, str, tuple[Any, ...]]]
    targets: list[list[int]]


@lru_cache(maxsize=256)
def _plan(family: Family, members: tuple[str, ...], slopes: bool) -> _Plan:
    """Return what some functions of a family need, each node once, after its arguments."""
    graph, values, gradients = _nodes(family)
    rows, k = [family.names.index(name) for name in members], len(family.variables)
    targets = [
        [values[row], *(gradients[row * k : (row + 1) * k] if slopes else ())] for row in rows
    ]
    needed = graph.needed(node for some in targets for node in some)
    return _Plan([(node, *graph.nodes[node]) for node in needed], targets)


@lru_cache(maxsize=256)
def _nodes(family: Family) -> tuple[Graph, list[int], list[int]]:
    """Return the operations of a family, and the nodes of its values and gradients."""
    program, (values, gradients) = derivatives(family.program(), 1)
    return program.graph, values, gradients


def _evaluated(
    steps: Sequence[tuple[int, str, tuple[Any, ...]]],
    q: Sequence[Array],
    parameters: Sequence[float],
    domain: Ring,
) -> dict[int, Array]:
    """Return the series of every node of a plan."""
    series: dict[int, Array] = {}
    with np.errstate(all="ignore"):
        for node, op, args in steps:
            if op == "var":
                series[node] = q[args[0]]
            elif op in LEAVES:
                series[node] = _number(parameters[args[0]] if op == "par" else args[0], domain)
            else:
                try:
                    series[node] = _RULES[op](domain, *[series[a] for a in args])
                except (KeyError, ZeroDivisionError, OverflowError, ValueError) as error:
                    msg = f"{op} has no power series there"
                    raise NotAnalyticError(msg) from error
    if not np.isfinite([*series.values()]).all():
        msg = "an operation has no power series there"
        raise NotAnalyticError(msg)
    return series


def _number(exact: Any, domain: Ring) -> Array:
    """Return a constant with a bound of its rounding error."""
    value = {"pi": math.pi, "e": math.e}[exact] if isinstance(exact, str) else float(exact)
    series = domain.constant(value)
    series[1, 0] = 0.0 if value.is_integer() else abs(value)
    return series


# --------------------------------------------------------------- rules

_Rule = Callable[..., Array]


def _sum(_: Ring, a: Array, b: Array) -> Array:
    result = a + b
    result[1] += abs(result[0])
    return result


def _difference(domain: Ring, a: Array, b: Array) -> Array:
    return _sum(domain, a, _negative(domain, b))


def _negative(_: Ring, a: Array) -> Array:
    return np.asarray(a * np.array([[-1.0], [1.0]]))


def _power(domain: Ring, a: Array, exponent: float) -> Array:
    base = float(a[0, 0])
    if base == 0 or (base < 0 and not exponent.is_integer()):
        raise ZeroDivisionError
    taylor, factor = [], 1.0
    for k in range(domain.order + 2):
        taylor.append(factor * base ** (exponent - k))
        factor *= (exponent - k) / (k + 1)
    return domain.compose(np.array(taylor), a)


def _quotient(domain: Ring, a: Array, b: Array) -> Array:
    return domain.mul(a, _power(domain, b, -1.0))


def _general_power(domain: Ring, a: Array, exponent: Array) -> Array:
    if not exponent[0, 1:].any():
        return _power(domain, a, float(exponent[0, 0]))
    return _RULES["exp"](domain, domain.mul(exponent, _RULES["log"](domain, a)))


class _Series:
    """Power series as an algebra, for the rules of elementary functions."""

    def __init__(self, domain: Ring) -> None:
        self.const: Callable[[Any], Array] = lambda exact: _number(exact, domain)
        self.add, self.sub, self.mul, self.div, self.neg = (
            partial(_RULES[op], domain) for op in ("add", "sub", "mul", "div", "neg")
        )
        self.unary: Callable[[str, Array], Array] = lambda op, a: _RULES[op](domain, a)


def _elementary(op: str) -> _Rule:
    """Return the rule of an elementary function."""
    known, value = OPERATIONS[op], getattr(math, op)

    def rule(domain: Ring, a: Array) -> Array:
        orders = range(domain.order + 2)
        if known.cycle:
            values = [derivative(a[0, 0]) for derivative in known.cycle]
            taylor = [values[k % len(values)] / math.factorial(k) for k in orders]
            return domain.compose(np.array(taylor), a)
        line = ring(1, domain.order + 1)
        t, y = line.constant(a[0, 0]) + line.variable(0), line.constant(value(a[0, 0]))
        y[0, 1:] = np.nan  # not known yet: a slope that reads y gives one coefficient after another
        for _ in orders[1:]:
            slope = known.slope(_Series(line), t, y, line.constant(1.0))
            y[:, 1:] = slope[:, :-1] / orders[1:]
            if np.isfinite(y[0]).all():
                break
        found = domain.compose(y[0], a)
        found[1] += domain.compose(y[1], abs(a))[0]  # what is rounded in the coefficients
        return found

    return rule


def _angle(domain: Ring, y: Array, x: Array) -> Array:
    """Return ``atan2(y, x)``, turned so that the quotient is zero at the point."""
    b, a = float(y[0, 0]), float(x[0, 0])
    if a == b == 0:
        raise ZeroDivisionError
    across, along = a * y - b * x, a * x + b * y
    across[1], along[1] = abs(a) * y[1] + abs(b) * x[1], abs(a) * x[1] + abs(b) * y[1]
    result = _RULES["atan"](domain, _quotient(domain, across, along))
    result[0, 0] = math.atan2(b, a)
    return result


def _comparison(holds: Callable[[float, float], bool]) -> _Rule:
    def rule(domain: Ring, a: Array, b: Array) -> Array:
        u, v = float(a[0, 0]), float(b[0, 0])
        # A branch point is near: a series on one side of it says nothing about the other.
        if abs(u - v) <= DEFAULT.same * max(1.0, abs(u), abs(v)):
            raise ZeroDivisionError
        return domain.constant(float(holds(u, v)))

    return rule


def _choice(_: Ring, condition: Array, a: Array, b: Array) -> Array:
    return a if condition[0, 0] else b


_RULES: dict[str, _Rule] = {
    "add": _sum,
    "sub": _difference,
    "neg": _negative,
    "mul": Ring.mul,
    "div": _quotient,
    "pow": _general_power,
    **{op: _elementary(op) for op in OPERATIONS},
    "sqrt": lambda domain, a: _power(domain, a, 0.5),
    "atan2": _angle,
    "lt": _comparison(lambda u, v: u < v),
    "le": _comparison(lambda u, v: u <= v),
    "not": lambda domain, a: domain.constant(1.0 - a[0, 0]),
    "and": lambda domain, a, b: domain.constant(min(a[0, 0], b[0, 0])),
    "or": lambda domain, a, b: domain.constant(max(a[0, 0], b[0, 0])),
    "select": _choice,
}
