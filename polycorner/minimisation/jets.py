"""Straight-line programs evaluated in truncated power series ([GW] ch. 13)."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from polycorner.formulas.adjoints import derivatives
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.programs import Graph
from polycorner.minimisation.series import Ring, ring
from polycorner.spaces.manifold import Array

KINK = 1e-6  # relative difference of two compared numbers below which a branch point is near


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
    done: dict[tuple[int, tuple[int, ...], tuple[float, ...]], _Evaluation] = {}
    results = []
    for f in functions:
        graph, values, gradients = _nodes(f.family)
        key = id(f.family), f.reads, f.parameters
        if key not in done:
            done[key] = _Evaluation(graph, [q[i] for i in f.reads], f.parameters, domain)
        row, k = f.family.names.index(f.member_name), len(f.reads)
        series = [done[key].value(values[row])]
        if slopes:
            partial = dict(zip(f.reads, gradients[row * k : (row + 1) * k], strict=True))
            zero = domain.constant(0.0)
            series += [done[key].value(partial[i]) if i in partial else zero for i in range(len(q))]
        results.append(series)
    return results


@lru_cache(maxsize=256)
def _nodes(family: Family) -> tuple[Graph, list[int], list[int]]:
    """Return the operations of a family, and the nodes of its values and gradients."""
    program, (values, gradients) = derivatives(family.program(), 1)
    return program.graph, values, gradients


class _Evaluation:
    """The nodes of one graph evaluated in a ring, each at most once."""

    def __init__(
        self, graph: Graph, q: Sequence[Array], parameters: tuple[float, ...], domain: Ring
    ) -> None:
        self.graph, self.q, self.parameters, self.ring = graph, q, parameters, domain
        self._done: dict[int, Array] = {}

    def value(self, node: int) -> Array:
        """Return the series of a node."""
        needed, stack = set[int](), [node]
        while stack:
            top = stack.pop()
            if top not in needed and top not in self._done:
                needed.add(top)
                stack += self._children(top)
        found = []
        with np.errstate(all="ignore"):
            for k in sorted(needed):  # a node comes after its arguments
                self._done[k] = self._operate(k)
                found.append(self._done[k])
        if found and not np.isfinite(found).all():
            for k in needed:
                del self._done[k]
            msg = "an operation has no power series there"
            raise NotAnalyticError(msg)
        return self._done[node]

    def _children(self, node: int) -> list[int]:
        op, args = self.graph.nodes[node]
        leaf = op in {"const", "var", "par"}
        return [] if leaf else [a for a in args if isinstance(a, int)]

    def _operate(self, node: int) -> Array:
        op, args = self.graph.nodes[node]
        if op in {"var", "par"} and isinstance(args[0], int):
            return self.q[args[0]] if op == "var" else self._inexact(self.parameters[args[0]])
        if op == "const":
            named = {"pi": math.pi, "e": math.e}
            exact = args[0]
            return self._inexact(named[exact] if isinstance(exact, str) else float(exact))
        series = [self._done[k] for k in self._children(node)]
        try:
            return _RULES[op](self.ring, *series)
        except (KeyError, ZeroDivisionError, OverflowError, ValueError) as error:
            msg = f"{op} has no power series there"
            raise NotAnalyticError(msg) from error

    def _inexact(self, value: float) -> Array:
        series = self.ring.constant(value)
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
    return _exponential(domain, domain.mul(exponent, _logarithm(domain, a)))


def _exponential(domain: Ring, a: Array) -> Array:
    top = math.exp(a[0, 0])
    orders = range(domain.order + 2)
    return domain.compose(np.array([top / math.factorial(k) for k in orders]), a)


def _logarithm(domain: Ring, a: Array) -> Array:
    base = float(a[0, 0])
    rest = [-((-1 / base) ** k) / k for k in range(1, domain.order + 2)]
    return domain.compose(np.array([math.log(base), *rest]), a)


def _periodic(cycle: Callable[[float], tuple[float, ...]]) -> _Rule:
    """Return the rule of a function whose derivatives repeat."""

    def rule(domain: Ring, a: Array) -> Array:
        values = cycle(float(a[0, 0]))
        orders = range(domain.order + 2)
        taylor = [values[k % len(values)] / math.factorial(k) for k in orders]
        return domain.compose(np.array(taylor), a)

    return rule


_sine = _periodic(lambda t: (math.sin(t), math.cos(t), -math.sin(t), -math.cos(t)))
_cosine = _periodic(lambda t: (math.cos(t), -math.sin(t), -math.cos(t), math.sin(t)))
_sinh = _periodic(lambda t: (math.sinh(t), math.cosh(t)))
_cosh = _periodic(lambda t: (math.cosh(t), math.sinh(t)))


def _integral(value: Callable[[float], float], sign: float, power: float) -> _Rule:
    """Return the rule of the integral of ``(1 + sign t^2)^power``."""

    def rule(domain: Ring, a: Array) -> Array:
        line = ring(1, domain.order + 1)
        t = line.constant(a[0, 0]) + line.variable(0)
        slope = _power(line, line.constant(1.0) + sign * line.mul(t, t), power)[0]
        rest = slope[:-1] / np.arange(1, domain.order + 2)
        return domain.compose(np.array([value(a[0, 0]), *rest]), a)

    return rule


_arctangent = _integral(math.atan, 1.0, -1.0)
_arcsine = _integral(math.asin, -1.0, -0.5)


def _error_function(domain: Ring, a: Array) -> Array:
    line = ring(1, domain.order + 1)
    t = line.constant(a[0, 0]) + line.variable(0)
    slope = 2 / math.sqrt(math.pi) * _exponential(line, _negative(line, line.mul(t, t)))[0]
    rest = slope[:-1] / np.arange(1, domain.order + 2)
    return domain.compose(np.array([math.erf(a[0, 0]), *rest]), a)


def _arccosine(domain: Ring, a: Array) -> Array:
    result = _negative(domain, _arcsine(domain, a))
    result[0, 0] = math.acos(a[0, 0])
    return result


def _angle(domain: Ring, y: Array, x: Array) -> Array:
    """Return ``atan2(y, x)``, turned so that the quotient is zero at the point."""
    b, a = float(y[0, 0]), float(x[0, 0])
    if a == b == 0:
        raise ZeroDivisionError
    across, along = a * y - b * x, a * x + b * y
    across[1], along[1] = abs(a) * y[1] + abs(b) * x[1], abs(a) * x[1] + abs(b) * y[1]
    result = _arctangent(domain, _quotient(domain, across, along))
    result[0, 0] = math.atan2(b, a)
    return result


def _comparison(holds: Callable[[float, float], bool]) -> _Rule:
    def rule(domain: Ring, a: Array, b: Array) -> Array:
        u, v = float(a[0, 0]), float(b[0, 0])
        if abs(u - v) <= KINK * max(1.0, abs(u), abs(v)):
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
    "sqrt": lambda domain, a: _power(domain, a, 0.5),
    "exp": _exponential,
    "log": _logarithm,
    "sin": _sine,
    "cos": _cosine,
    "tan": lambda domain, a: _quotient(domain, _sine(domain, a), _cosine(domain, a)),
    "sinh": _sinh,
    "cosh": _cosh,
    "tanh": lambda domain, a: _quotient(domain, _sinh(domain, a), _cosh(domain, a)),
    "asin": _arcsine,
    "acos": _arccosine,
    "atan": _arctangent,
    "erf": _error_function,
    "atan2": _angle,
    "lt": _comparison(lambda u, v: u < v),
    "le": _comparison(lambda u, v: u <= v),
    "not": lambda domain, a: domain.constant(1.0 - a[0, 0]),
    "and": lambda domain, a, b: domain.constant(min(a[0, 0], b[0, 0])),
    "or": lambda domain, a, b: domain.constant(max(a[0, 0], b[0, 0])),
    "select": _choice,
}
