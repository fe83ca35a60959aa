"""Formulas as they are written: where they are not smooth, and whether they suit a circle."""

import math
import textwrap
import warnings
from collections.abc import Iterable, Mapping, Sequence
from numbers import Number
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import mapping, refuse
from polycorner.errors import NonsmoothWarning
from polycorner.formulas.operations import OPERATIONS
from polycorner.spaces.manifold import Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

KINKED = frozenset({"Abs", "Min", "Max", "Piecewise"})
SHOWN = 60  # characters of a formula in a warning
LONGEST = 2000  # symbols, numbers and operations of a formula that is written out
SAMPLES = 16  # points at which a period is tested
SPREAD = 2.0  # size, in scale units, of the region of the lines that is sampled


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
    if result is not None and result.has(sympy.nan, sympy.zoo, sympy.I):
        refuse(argument, "a formula of real values", result)
    if not isinstance(result, sympy.Expr):
        refuse(argument, "a SymPy expression", value, TypeError)
    return result


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


# ------------------------------------------------------------------------------------------ circles


def check_periodic(
    name: str,
    expression: "sympy.Expr",
    manifold: Manifold,
    reads: Mapping[str, int],
    parameters: Mapping[str, float],
) -> None:
    """Raise ValueError for an expression that changes when a circle is gone round once.

    It does not change where every occurrence of the circle's coordinate ``x`` of period ``T`` lies
    in a sine, cosine or tangent of ``a + k x`` with ``k T / 2 pi`` whole (``k T / pi`` for a
    tangent).  Other expressions are evaluated at points one period apart.

    Parameters
    ----------
    name : str
        Name of the function in the error.
    expression : sympy.Expr
        With definitions written out.
    manifold : Manifold
    reads : mapping from str to int
        The position of the coordinate behind every variable of the expression.
    parameters : mapping from str to float
        Values of the other symbols.
    """
    circles = {
        symbol: manifold.periods[reads[symbol.name]]
        for symbol in expression.free_symbols
        if symbol.name in reads and math.isfinite(manifold.periods[reads[symbol.name]])
    }
    doubtful = [x for x, period in circles.items() if not _is_periodic(expression, x, period)]
    if doubtful:
        _sample(name, expression, manifold, reads, parameters, doubtful)


def _is_periodic(expression: "sympy.Basic", x: "sympy.Symbol", period: float) -> bool:
    """Whether every occurrence of ``x`` lies in a circular function of the right period."""
    waiting = [expression]
    while waiting:
        part = waiting.pop()
        if x not in part.free_symbols:
            continue
        known = OPERATIONS.get(type(part).__name__)
        if known is not None and known.turns:
            slope = part.args[0].diff(x)
            turns = float(slope) * period / math.tau if slope.is_number else math.nan
            turns *= known.turns
            if abs(turns - np.round(turns)) <= DEFAULT.same / 10:
                continue
        if part == x:
            return False
        waiting += part.args
    return True


def _sample(
    name: str,
    expression: "sympy.Expr",
    manifold: Manifold,
    reads: Mapping[str, int],
    parameters: Mapping[str, float],
    doubtful: "Sequence[sympy.Symbol]",
) -> None:
    import sympy

    symbols = sorted((s for s in expression.free_symbols if s.name in reads), key=str)
    fixed = {s: parameters[s.name] for s in expression.free_symbols if s.name in parameters}
    function = sympy.lambdify(symbols, expression.xreplace(fixed), "numpy")
    sizes = [_size(manifold, reads[s.name]) for s in symbols]
    places = np.random.default_rng(0).uniform(-1, 1, (SAMPLES, len(symbols))) * sizes
    with np.errstate(all="ignore"):
        before = _values(function, places)
        for x in doubtful:
            period = manifold.periods[reads[x.name]]
            after = _values(function, places + period * np.array([s == x for s in symbols]))
            apart = abs(after - before) / (1 + abs(before) + abs(after))
            if (apart > DEFAULT.same / 10).any():
                k = int(np.nanargmax(apart))
                at = ", ".join(f"{s} = {v:.4g}" for s, v in zip(symbols, places[k], strict=True))
                msg = (
                    f"{name}: expected a function with the period {period:.6g} of the circle {x}; "
                    f"got {expression}, which changes from {before[k]:.4g} to {after[k]:.4g} "
                    f"over one period from {at} (use a line, of period inf, for a coordinate with "
                    "limits)"
                )
                raise ValueError(msg)


def _size(manifold: Manifold, position: int) -> float:
    period = manifold.periods[position]
    return period / 2 if math.isfinite(period) else SPREAD * manifold.scales[position]


def _values(function: Any, places: Any) -> Any:
    found = np.asarray(function(*places.T), dtype=complex)
    return np.where(found.imag == 0, found.real, np.nan) + np.zeros(len(places))
