"""Elementary functions of intervals in lanes.

Sine and cosine are this library's own (:func:`polycorner.formulas.emit.sine_cosine`).  For
``|x| <= REDUCTION_LIMIT`` their error is below ``CIRCULAR = 2**-50 = 8 u``, ``u = 2**-53``:

- The reduced argument errs by at most ``u``: the number of quarter turns times the first part of
  pi/2 is exact, so is its difference from ``x`` (a multiple of ``2**-53`` below 1), the digits that
  the second part loses are carried over, and one rounding of a number below 0.79 remains.  The
  slopes of both functions are at most 1.
- The Taylor sums are truncated below ``5e-17 < u / 2`` and err by less than ``3 u``: their last
  addition rounds by at most ``u / 2``, and what is added to ``r`` or to ``1 - r**2 / 2`` is below
  0.1 with a relative error of at most ``10 u``; ``r**2 / 2`` itself errs by less than ``u / 2``.
- Subtracting or adding ``CIRCULAR`` rounds by at most ``u``.

Between the extrema both are monotone; an extremum counts as inside unless it surely is outside.

All others are those of the C library, at the ends of the intervals on which they are monotone.
*Trusted*: they err by fewer than ``LIBRARY - 1`` units in the last place.  The largest errors that
the library of GNU documents for these functions are 1 or 2 units; the tests compare the bounds
with Arb ([Johansson]).
"""

import math

from llvmlite import ir

from polycorner.formulas import emit
from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.ranges import PI
from polycorner.formulas.rounding import NAN, Stepped, greatest, least

CIRCULAR = 2.0**-50
LIBRARY = 8
QUARTERS = 2 / 3.141592653589793  # quarter turns a radian, to nearest

Sides = tuple[ir.Value, ir.Value]


def blend(b: ir.IRBuilder, mask: ir.Value, yes: Sides, no: Sides) -> Sides:
    """Return one of two intervals in every lane."""
    return b.select(mask, yes[0], no[0]), b.select(mask, yes[1], no[1])


def bounded(r: Stepped, ok: ir.Value, x: Sides) -> Sides:
    """Give up lanes: return NaN where a condition fails."""
    missing = r.splat(NAN)
    return blend(r.b, ok, x, (missing, missing))


def within(r: Stepped, x: Sides, low: float | None, high: float | None) -> Sides:
    """Intersect with bounds that the function has; NaN stays."""
    lower = x[0] if low is None else greatest(r.b, r.splat(low), x[0])
    upper = x[1] if high is None else least(r.b, r.splat(high), x[1])
    return lower, upper


def circular(r: Stepped, x: Sides) -> tuple[Sides, Sides]:
    """Return the ranges of sine and cosine."""
    b, routine = r.b, emit.sine_cosine(r.b.module, r.lanes)
    ends = [b.call(routine, [end]) for end in x]
    far = b.or_(
        *[b.fcmp_ordered(">", r.call("fabs", end), r.splat(emit.REDUCTION_LIMIT)) for end in x]
    )
    turns = _turns(r, x)
    sine, cosine = ([b.extract_value(end, k) for end in ends] for k in (0, 1))
    return _circular(r, sine, turns, far, 1), _circular(r, cosine, turns, far, 0)


def _turns(r: Stepped, x: Sides) -> list[ir.Value]:
    """Return bounds of an interval in quarter turns."""
    return [
        r.widen(r.b.fmul(end, r.splat(QUARTERS)), 8, up=up)
        for end, up in zip(x, (False, True), strict=True)
    ]


def _circular(
    r: Stepped, ends: list[ir.Value], turns: list[ir.Value], far: ir.Value, top: int
) -> Sides:
    """Return the range from the ends, and whether a maximum ``top + 4k`` or minimum is inside."""
    b, error = r.b, r.splat(CIRCULAR)
    low = b.fsub(r.fold(ends, up=False), error)
    high = b.fadd(r.fold(ends, up=True), error)
    low, high = within(r, (low, high), -1.0, 1.0)
    highest, lowest = (b.or_(far, _passes(r, turns, place)) for place in (top, top + 2))
    return (
        b.select(lowest, r.splat(-1.0), low),
        b.select(highest, r.splat(1.0), high),
    )


def _passes(r: Stepped, turns: list[ir.Value], place: int) -> ir.Value:
    """Whether a number ``place + 4k`` may be in an interval of quarter turns.

    For certain: an end ``t`` near such a number has ``|t| >= 1`` unless the number is zero, so the
    shift by ``place <= 3`` errs by at most ``2**-53 (|t| + 3) <= 2**-51 |t|``; with the errors of
    ``QUARTERS`` and of its product that is less than ``8 * 2**-52 |t|``, the widening of ends.
    """
    b = r.b
    first, last = (b.fmul(b.fsub(turn, r.splat(float(place))), r.splat(0.25)) for turn in turns)
    return b.fcmp_ordered(">=", r.call("floor", last), r.call("ceil", first))


def magnitude(r: Stepped, x: Sides) -> Sides:
    """Return the range of ``|x|``."""
    b = r.b
    below = greatest(b, x[0], b.fneg(x[1]))
    return greatest(b, r.splat(0.0), below), greatest(b, b.fneg(x[0]), x[1])


def unary(r: Stepped, op: str, x: Sides) -> Sides:
    """Return the range of an elementary function; NaN where it is not defined and bounded."""
    known, function = OPERATIONS[op], emit.library(r.b.module, op)
    x = inside(r, _between_poles(r, x) if known.turns else x, *known.limits)
    if known.shape == "even":
        x = magnitude(r, x)
    ends = x[::-1] if known.shape == "decreasing" else x
    low, high = (emit.by_lane(r.b, function, [end], r.lanes) for end in ends)
    sides = r.widen(low, LIBRARY, up=False), r.widen(high, LIBRARY, up=True)
    return within(r, sides, *known.values)


def _between_poles(r: Stepped, x: Sides) -> Sides:
    """Give up intervals that may contain a pole of a tangent, at odd quarter turns."""
    turns = _turns(r, x)
    pole = r.b.or_(_passes(r, turns, 1), _passes(r, turns, 3))
    limit = emit.REDUCTION_LIMIT
    return bounded(r, r.b.not_(pole), inside(r, x, -limit, limit))


def _corners(r: Stepped, name: str, x: Sides, y: Sides) -> Sides:
    """Return a function that is monotone in each argument, from its values at the corners."""
    function = emit.library(r.b.module, name)
    second = y if y[0] is not y[1] else y[:1]
    values = [emit.by_lane(r.b, function, [p, q], r.lanes) for p in x for q in second]
    low, high = (r.widen(r.fold(values, up=up), LIBRARY, up=up) for up in (False, True))
    return low, high


def cut_free(r: Stepped, y: Sides, x: Sides) -> ir.Value:
    """Whether ``atan2(y, x)`` is continuous: neither the origin nor its cut can be met."""
    b, zero = r.b, r.splat(0.0)
    beside = b.or_(b.fcmp_ordered(">", y[0], zero), b.fcmp_ordered("<", y[1], zero))
    return b.or_(beside, b.fcmp_ordered(">", x[0], zero))


def arctangent(r: Stepped, y: Sides, x: Sides) -> Sides:
    """Return the range of ``atan2(y, x)``; ``[-pi, pi]`` where its cut or the origin may be met."""
    low, high = _corners(r, "atan2", y, x)
    full = (r.splat(-PI[1]), r.splat(PI[1]))
    low, high = blend(r.b, cut_free(r, y, x), (low, high), full)
    # NaN must survive: the cut cannot be excluded for lanes that were given up.
    known = r.b.fcmp_ordered("ord", r.b.fadd(y[0], x[0]), r.splat(0.0))
    return bounded(r, known, (low, high))


def power(r: Stepped, x: Sides, y: Sides, *, positive: bool) -> Sides:
    """Return the range of ``x**y`` for ``x > 0``; also for ``x = 0`` if ``y`` is positive."""
    b, zero = r.b, r.splat(0.0)
    low, high = _corners(r, "pow", x, y)
    # The exponent is compared with itself: one raised to a missing number would be one.
    ok = b.and_(
        b.fcmp_ordered(">=" if positive else ">", x[0], zero), b.fcmp_ordered("ord", y[0], y[1])
    )
    return within(r, bounded(r, ok, (low, high)), 0.0, None)


def inside(r: Stepped, x: Sides, least_end: float, greatest_end: float) -> Sides:
    """Give up intervals that reach beyond limits, which may be infinite."""
    b = r.b
    if math.isfinite(greatest_end):
        x = bounded(r, b.fcmp_ordered("<=", x[1], r.splat(greatest_end)), x)
    if math.isfinite(least_end):
        x = bounded(r, b.fcmp_ordered(">=", x[0], r.splat(least_end)), x)
    return x
