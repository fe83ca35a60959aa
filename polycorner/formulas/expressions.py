"""Formulas as they are written, and where they are not smooth."""

import textwrap
import warnings
from collections.abc import Iterable, Mapping, Sequence
from numbers import Number
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import mapping, refuse
from polycorner.errors import NonsmoothWarning

if TYPE_CHECKING:
    import sympy

KINKED = frozenset({"Abs", "Min", "Max", "Piecewise"})
SHOWN = 60  # characters of a formula in a warning
LONGEST = 2000  # symbols, numbers and operations of a formula that is written out


def as_expression(argument: str, value: object) -> "sympy.Expr":
    """Return a formula or a number as a SymPy expression, or raise TypeError.

    SymPy's own conversion would execute text as code of Python, also in lists and mappings.

    Examples
    --------
    >>> as_expression("kinetic", "x**2")
    Traceback (most recent call last):
    TypeError: kinetic: expected a SymPy expression; got 'x**2'
    """
    import sympy

    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    known = isinstance(value, sympy.Basic | Number) or hasattr(value, "_sympy_")
    result = sympy.sympify(value, strict=True) if known else None
    if isinstance(result, sympy.core.relational.Relational):
        refuse(argument, "f, meaning f >= 0, instead of an inequality", result, TypeError)
    if result is not None and not _parts(result).isdisjoint({sympy.nan, sympy.zoo, sympy.I}):
        refuse(argument, "a formula of real values", result)
    if not isinstance(result, sympy.Expr):
        refuse(argument, "a SymPy expression", value, TypeError)
    return result


def _parts(expression: "sympy.Basic") -> "set[sympy.Basic]":
    """Return all subexpressions; each is visited once, however often it is repeated."""
    seen, waiting = {expression}, [expression]
    while waiting:
        fresh = set(waiting.pop().args) - seen
        seen |= fresh
        waiting += fresh
    return seen


def substitute(expression: "sympy.Expr", places: "Mapping[Any, Any]") -> "sympy.Expr":
    """Return a formula with others in place of symbols, as ``xreplace`` does.

    A subexpression that is repeated is written once, so that this takes as long as the formula is
    large in memory, and no maximum is compared with its parts, which takes longer than all else.
    """
    import sympy

    known: dict[Any, Any] = dict(places)

    def write(part: Any) -> Any:
        if part not in known:
            parts = [write(one) for one in part.args]
            if all(new is old for new, old in zip(parts, part.args, strict=True)):
                known[part] = part
            elif isinstance(part, sympy.Max | sympy.Min) and not all(x.is_number for x in parts):
                known[part] = part.func(*parts, evaluate=False)
            else:
                known[part] = part.func(*parts)
        return known[part]

    found: sympy.Expr = write(expression)
    return found


def as_expressions(argument: str, given: "Mapping[str, Any]") -> "dict[str, sympy.Expr]":
    """Return formulas by name, or raise TypeError with the argument and the name."""
    found = mapping(argument, given).items()
    return {name: as_expression(f"{argument}[{name!r}]", e) for name, e in found}


def kinks(expressions: "Iterable[sympy.Expr]") -> tuple[str, ...]:
    """Return the subexpressions across which derivatives of the expressions may jump, as text."""
    found: list[sympy.Basic] = []
    waiting: list[sympy.Basic] = list(expressions)
    seen: set[sympy.Basic] = set()
    while waiting:
        part = waiting.pop()
        if part.args and part not in seen:
            seen.add(part)
            waiting += part.args
            if type(part).__name__ in KINKED:
                found.append(part)
    return tuple(dict.fromkeys(map(str, found)))


def written(expression: "sympy.Expr") -> str:
    """Return a formula as text; of a long one, which takes long to write, its length."""
    sizes: dict[sympy.Basic, int] = {}

    def size(part: "sympy.Basic") -> int:
        if part not in sizes:
            sizes[part] = 1 + sum(map(size, part.args))
        return sizes[part]

    length = size(expression)
    return str(expression) if length <= LONGEST else f"a formula of length {length}"


def announce(name: str, found: Sequence[str]) -> None:
    """Warn that a function is not smooth everywhere, if so."""
    if not found:
        return
    shown = textwrap.shorten(min(found, key=len), SHOWN, placeholder=" ...")
    if len(found) > 1:
        shown += f" and {len(found) - 1} more"
    msg = (
        f"{name}: its derivatives may jump, because of {shown}; where they do, a point is neither "
        "certified as a minimum nor refuted"
    )
    warnings.warn(msg, NonsmoothWarning, stacklevel=4)
