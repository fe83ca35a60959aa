"""Degrees of formulas in some of their symbols, from the way that they are written."""

import math
from collections.abc import Callable, Collection, Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy


def degree(
    expression: "sympy.Basic", symbols: "Collection[sympy.Symbol]", *, least: bool = False
) -> float:
    """Return an upper bound of the degree of a formula as a polynomial in some symbols.

    It is zero only for a formula without them, and infinite where a function other than sums,
    products, whole powers and branches contains them.  Where it is finite, the degree of the
    ``least`` term, also asked for, is a lower bound of those of all terms.  Every subexpression is
    visited once, so that formulas which repeat subexpressions take no longer than they are large
    in memory.

    Examples
    --------
    >>> from sympy.abc import x, y
    >>> degree(x * y + y**2, [y]), degree(x * y + y**2, [x]), degree(1 / x, [x])
    (2, 1, inf)
    >>> degree(x * y + y**2, [x, y], least=True), degree(x + y**2, [x, y], least=True)
    (2, 1)
    """
    chosen = min if least else max
    known: dict[sympy.Basic, float] = dict.fromkeys(symbols, 1)
    waiting = [expression]
    while waiting:
        e = waiting[-1]
        unknown = [] if e in known else [part for part in e.args if part not in known]
        if unknown:
            waiting += unknown
            continue
        waiting.pop()
        if e not in known:
            known[e] = _joined(e, [known[part] for part in e.args], chosen)
    return known[expression]


def _joined(
    e: "sympy.Basic", degrees: list[float], chosen: Callable[[Iterable[float]], float]
) -> float:
    """Return the degree of an expression from those of its arguments."""
    if not any(degrees):
        return 0
    kind = type(e).__name__
    if kind == "Add":
        return chosen(degrees)
    if kind == "Mul":
        return sum(degrees)
    if kind == "Pow" and e.args[1].is_Integer and int(e.args[1]) > 0:
        return degrees[0] * int(e.args[1])
    if kind in {"Piecewise", "ExprCondPair"}:
        values = degrees if kind == "Piecewise" else degrees[:1]
        return math.inf if any(degrees[len(values) :]) else chosen(values)
    return math.inf
