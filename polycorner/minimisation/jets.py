"""Straight-line programs evaluated in truncated power series ([GW] ch. 13)."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from polycorner.formulas.adjoints import derivatives
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import LEAVES, Graph
from polycorner.minimisation.series import Ring, ring
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT


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
