"""Functions on circles and rotations: the same after one turn, and at opposite quaternions.

Where a formula does not show that, it is evaluated at random points.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.formulas.expressions import announce, substitute
from polycorner.formulas.operations import OPERATIONS
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

SAMPLES = 16  # points at which a period is tested
SPREAD = 2.0  # size, in scale units, of the region of the lines that is sampled


def check_function(function: Any, *, periodic: bool = True) -> None:
    """Warn of kinks; raise ValueError for a ``SmoothFunction`` that should be periodic and is not.

    A section, such as ``sin((a + b) / 2) = 0``, may change its sign, or fix an angle in one chart.
    """
    announce(function.name, function.kinks)
    if periodic and function.manifold.rotations:
        _check_even(function)
    circles = function.manifold.circles
    if periodic and circles and not circles.isdisjoint(function.reads):
        _check_periodic(function)


def _check_even(function: Any) -> None:
    """Raise ValueError for a function that differs between opposite quaternions."""
    expression, manifold = function.expression, function.manifold
    for factor in manifold.factors:
        quaternion = manifold.symbols[factor.at]
        if not factor.turns or expression.free_symbols.isdisjoint(quaternion):
            continue
        opposite = substitute(expression, {x: -x for x in quaternion})
        if opposite == expression:
            continue
        steps = np.random.default_rng(0).uniform(-SPREAD, SPREAD, (SAMPLES, manifold.size))
        places = np.array([manifold.onto(u * manifold.scale_array) for u in steps])
        before, after = (
            _evaluator(e, manifold.symbols, function.parameter_values)(places)
            for e in (expression, opposite)
        )
        if (_change(before, after) > DEFAULT.same / 10).any():
            msg = (
                f"{function.name}: expected a function of the rotation, the same at the "
                f"quaternions ({', '.join(factor.names)}) and -({', '.join(factor.names)}), such "
                f"as one of the entries of matrix({factor.name!r}); got {expression}"
            )
            raise ValueError(msg)


def _check_periodic(function: Any) -> None:
    """Raise ValueError for a function that changes when a circle is gone round once.

    It does not change where every occurrence of the circle's coordinate ``x`` of period ``T`` lies
    in a sine, cosine or tangent of ``a + k x`` with ``k T / 2 pi`` whole (``k T / pi`` for a
    tangent).  Others are evaluated at points one period apart.
    """
    manifold, family = function.manifold, function.family
    expression = family.expression(function.member_name)
    position = dict(zip(family.variables, function.reads, strict=True))
    symbols = sorted((s for s in expression.free_symbols if s.name in position), key=str)
    periods = {s: manifold.periods[position[s.name]] for s in symbols}
    doubtful = [
        x for x, T in periods.items() if math.isfinite(T) and not _is_periodic(expression, x, T)
    ]
    if not doubtful:
        return
    values = _evaluator(expression, symbols, function.parameter_values)
    sizes = [_size(manifold, position[s.name]) for s in symbols]
    places = np.random.default_rng(0).uniform(-1, 1, (SAMPLES, len(symbols))) * sizes
    before = values(places)
    for x in doubtful:
        after = values(places + periods[x] * np.array([s == x for s in symbols]))
        change = _change(before, after)
        if (change > DEFAULT.same / 10).any():
            k = int(np.nanargmax(change))
            at = ", ".join(f"{s} = {v:.4g}" for s, v in zip(symbols, places[k], strict=True))
            msg = (
                f"{function.name}: expected a function with the period {periods[x]:.6g} of the "
                f"circle {x}; got {expression}, which changes from {before[k]:.4g} to "
                f"{after[k]:.4g} over one period from {at} (use a line, of period inf, for a "
                "coordinate with limits)"
            )
            raise ValueError(msg)


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


def _size(manifold: Manifold, position: int) -> float:
    period = manifold.periods[position]
    return period / 2 if math.isfinite(period) else SPREAD * manifold.scales[position]


def _evaluator(
    expression: "sympy.Expr", symbols: "Sequence[sympy.Symbol]", parameters: Mapping[str, float]
) -> Callable[[Array], Array]:
    """Return what evaluates an expression at places ``(N, n)``; NaN where it is not real."""
    import sympy

    fixed = {s: parameters[s.name] for s in expression.free_symbols if s.name in parameters}
    function = sympy.lambdify(symbols, substitute(expression, fixed), "numpy")

    def values(places: Array) -> Array:
        with np.errstate(all="ignore"):
            found = np.asarray(function(*places.T), dtype=complex)
        return np.where(found.imag == 0, found.real, np.nan) + np.zeros(len(places))

    return values


def _change(before: Array, after: Array) -> Any:
    with np.errstate(all="ignore"):
        return abs(after - before) / (1 + abs(before) + abs(after))
