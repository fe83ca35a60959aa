"""Arithmetic on lanes that is rounded downwards or upwards, whatever the rounding mode.

Every result is one of two bounds of an exact result ``x``: ``up=False`` gives a number at most
``x``, ``up=True`` one at least ``x``.  Nothing may overflow (:mod:`polycorner.formulas.ranges`);
NaN comes out where NaN goes in.  The rounding mode stays to nearest.

:class:`Embedded` uses instructions of AVX-512 that carry their own direction of rounding.
:class:`Stepped` uses ordinary ones.  Let ``u = 2**-53``, ``eta = 2**-1074``, ``r = fl(x)`` the
rounded result, ``pred(r)`` the number before it and ``ulp(r) = r - pred(r)`` or, for negative
``r``, what is subtracted to reach it.  As ``r`` is nearest to ``x``, ``pred(r) <= x``; claimed is

    fl(r - fl(2u |r|)) <= pred(r)    if r is normal,
    fl(fl(r - fl(2u |r|)) - eta) <= pred(r)    for every finite r.

For normal ``r`` with ``2**E <= |r| < 2**(E+1)``, ``ulp(r) <= 2**(E-52) <= 2u |r|``.  The number
``ulp(r)`` is a floating-point number, so ``fl(2u |r|) >= ulp(r)`` since rounding is monotone; then
``r - fl(2u |r|) <= pred(r)``, and again by monotonicity the rounded difference is at most
``pred(r)``.  Subtracting ``eta`` only lowers it.  If ``r`` is zero or subnormal, the first
difference is at most ``r``, and ``fl(r - eta) = pred(r)`` exactly.  Sums, differences and square
roots that are not normal are exact, so the first form is enough for them; products and quotients
need the second.  Upwards is the mirror image.  (Cf. [Rump] sec. 3, whose bounds are tighter.)
A least product is ``fl``-monotone as well: rounding the least of rounded products bounds the least.
"""

from collections.abc import Sequence
from functools import reduce
from typing import Any

from llvmlite import ir

from polycorner.formulas import emit

ULP, ETA = 2.0**-52, 2.0**-1074
NAN = float("nan")
DOWNWARDS, UPWARDS = 9, 10  # rounding operands of AVX-512, exceptions suppressed

Pairs = Sequence[tuple[ir.Value, ir.Value]]


def least(b: ir.IRBuilder, x: ir.Value, y: ir.Value) -> ir.Value:
    """Return the smaller number; ``y`` where one is NaN, as the instruction of x86 does."""
    return b.select(b.fcmp_ordered("<", x, y), x, y)


def greatest(b: ir.IRBuilder, x: ir.Value, y: ir.Value) -> ir.Value:
    """Return the larger number; ``y`` where one is NaN."""
    return b.select(b.fcmp_ordered(">", x, y), x, y)


class Stepped:
    """Directed rounding by a step of one unit in the last place, or two."""

    name = "stepped"

    def __init__(self, b: ir.IRBuilder, lanes: int) -> None:
        self.b, self.lanes = b, lanes

    def splat(self, value: float) -> ir.Constant:
        """Return one constant in every lane."""
        return emit.splat(value, self.lanes)

    def rounded(self, op: str, *values: ir.Value, up: bool) -> ir.Value:
        """Return a bound of a result of ``add``, ``sub``, ``div`` or ``sqrt``."""
        if op == "sqrt":
            return self.step(self.call(op, *values), up=up)
        r = self.step(getattr(self.b, f"f{op}")(*values), up=up)
        return self._beyond(r, up=up) if op == "div" else r

    def sides(
        self, op: str, lower: Sequence[ir.Value], upper: Sequence[ir.Value]
    ) -> tuple[ir.Value, ir.Value]:
        """Return a lower bound of one result and an upper bound of another."""
        return self.rounded(op, *lower, up=False), self.rounded(op, *upper, up=True)

    def mul(self, pairs: Pairs, *, up: bool) -> ir.Value:
        """Return a lower bound of the least of some products, or an upper one of the greatest."""
        products = [self.b.fmul(x, y) for x, y in pairs]
        return self._beyond(self.step(self.fold(products, up=up), up=up), up=up)

    def fold(self, values: Sequence[ir.Value], *, up: bool) -> ir.Value:
        """Return the least or the greatest of some numbers."""
        pick = greatest if up else least
        return reduce(lambda x, y: pick(self.b, x, y), values)

    def step(self, r: ir.Value, *, up: bool, ulps: int = 1) -> ir.Value:
        """Return a number that is lower (higher) by at least ``ulps`` units in the last place."""
        move = self.b.fadd if up else self.b.fsub
        return move(r, self.b.fmul(self.call("fabs", r), self.splat(ulps * ULP)))

    def widen(self, r: ir.Value, ulps: int, *, up: bool) -> ir.Value:
        """Return a bound of a number that is known within ``ulps - 1`` units in the last place."""
        return self._beyond(self.step(r, up=up, ulps=ulps), up=up, steps=ulps)

    def call(self, name: str, x: ir.Value) -> ir.Value:
        """Call one of LLVM's own functions of one number."""
        return self.b.call(emit.intrinsic(self.b.module, name, self.lanes), [x])

    def _beyond(self, r: ir.Value, *, up: bool, steps: int = 1) -> ir.Value:
        move = self.b.fadd if up else self.b.fsub
        return move(r, self.splat(steps * ETA))


class Embedded(Stepped):
    """Directed rounding by the instructions of AVX-512, the tightest that there is."""

    name = "embedded"

    def rounded(self, op: str, *values: ir.Value, up: bool) -> ir.Value:
        """Return a bound of the result of an operation."""
        name, kind, mode = f"llvm.x86.avx512.{op}.pd.512", emit.lane_type(8), ir.IntType(32)
        known: dict[str, Any] = self.b.module.globals
        if name not in known:
            ir.Function(self.b.module, ir.FunctionType(kind, [kind] * len(values) + [mode]), name)
        direction = ir.Constant(mode, UPWARDS if up else DOWNWARDS)
        return self.b.call(known[name], [*values, direction])

    def mul(self, pairs: Pairs, *, up: bool) -> ir.Value:
        """Return a lower bound of the least of some products, or an upper one of the greatest."""
        return self.fold([self.rounded("mul", *pair, up=up) for pair in pairs], up=up)


ROUNDINGS: dict[str, type[Stepped]] = {kind.name: kind for kind in (Stepped, Embedded)}
