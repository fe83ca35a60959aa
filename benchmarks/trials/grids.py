"""Sums of functions of one coordinate each, on products of unions of intervals.

A point is stationary if it is along each axis: where the derivative vanishes, or at an end of an
interval from which the energy grows.  Its index is the number of axes along which it is a maximum.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

import flint
import numpy as np
import sympy as sp

from benchmarks.trials.exact import (
    BITS,
    Vector,
    added,
    derivative,
    fraction,
    integral,
    real_roots,
    sign,
    value,
)
from benchmarks.trials.known import Known

Interval = tuple[Fraction, Fraction]


class Rest(NamedTuple):
    """A point where a function of one coordinate is stationary, and how."""

    at: Fraction
    active: frozenset[int]
    index: int | None


@dataclass(frozen=True)
class Axis:
    """A function of a coordinate on a union of intervals, or on finitely many numbers.

    Attributes
    ----------
    energy : sympy.Expr
        In the symbol ``S``.
    functions : tuple of sympy.Expr
    branches : tuple of tuple of int
        The set as a union of intersections.
    equation : sympy.Expr or None
    rests : tuple of Rest
    circle : bool
    """

    energy: Any
    functions: tuple[Any, ...]
    branches: tuple[tuple[int, ...], ...]
    rests: tuple[Rest, ...]
    equation: Any = None
    circle: bool = False


S = sp.Symbol("s", real=True)


def number(x: Fraction) -> Any:
    return sp.Rational(x.numerator, x.denominator)


def polynomial(p: Sequence[Fraction]) -> Any:
    return sum(number(c) * S**k for k, c in enumerate(p))


def line(
    slope: Sequence[Fraction], roots: Sequence[Fraction], intervals: Sequence[Interval] = ()
) -> Axis:
    """Return an axis with the derivative ``slope``, on closed intervals that do not overlap.

    Without intervals it is the whole line.  Those that share an end have a kink in common, which is
    no end of the set.
    """
    bent = derivative(slope)
    functions, branches = list[Any](), list[tuple[int, ...]]()
    ends: dict[Fraction, list[tuple[int, int]]] = {}
    for a, b in intervals:
        ends.setdefault(a, []).append((len(functions), 1))
        ends.setdefault(b, []).append((len(functions) + 1, -1))
        branches.append((len(functions), len(functions) + 1))
        functions += [S - number(a), number(b) - S]
    rests = []
    for x in sorted({*roots, *ends}):
        curved = sign(value(bent, x))
        if intervals and not any(a <= x <= b for a, b in intervals):
            continue
        if x not in ends:
            rests.append(Rest(x, frozenset(), {1: 0, -1: 1, 0: None}[curved]))
            continue
        active = frozenset(i for i, _ in ends[x])
        pull = sign(value(slope, x))
        if not pull:
            rests.append(Rest(x, active, None))
        elif len(ends[x]) == 1 and pull == ends[x][0][1]:
            rests.append(Rest(x, active, 0))
    return Axis(
        polynomial(integral(slope)), tuple(functions), tuple(branches or [()]), tuple(rests)
    )


def kinked(
    slope: Sequence[Fraction], at: Fraction, pull: Fraction, intervals: Sequence[Interval]
) -> Axis:
    """Return an axis with the derivative ``slope + pull sign(s - at)``, on one interval or all."""
    found = []
    for side in (-1, 1):
        steep = added(slope, [side * pull])
        smooth = line(steep, [x for x, _ in real_roots(steep)], intervals)
        found += [r for r in smooth.rests if side * sign(r.at - at) > 0]
    low, high = intervals[0] if intervals else (at - 1, at + 1)
    left = sign(value(slope, at) - pull) <= 0 or at == low
    right = sign(value(slope, at) + pull) >= 0 or at == high
    if low <= at <= high and left and right:
        found.append(Rest(at, frozenset(), None))
    whole = line(slope, [], intervals)
    energy = whole.energy + number(pull) * sp.Abs(S - number(at))
    return Axis(energy, whole.functions, whole.branches, tuple(found))


def sheets(slope: Sequence[Fraction], places: Sequence[Fraction]) -> Axis:
    """Return an axis on which an equation leaves some numbers."""
    rests = tuple(Rest(x, frozenset(), 0) for x in sorted(set(places)))
    equation = sp.expand(sp.prod([S - number(x) for x in places]))
    if len(set(places)) < len(places):
        rests = tuple(Rest(x, frozenset(), None if places.count(x) > 1 else 0) for x, _, _ in rests)
    return Axis(polynomial(integral(slope)), (), ((),), rests, equation)


def circle(
    size: Fraction, turns: int, phase: Fraction, arc: tuple[Fraction, Fraction] | None = None
) -> Axis:
    """Return ``size cos(turns (s - phase))`` on a circle, or where ``cos(s - middle) >= level``.

    ``arc`` is the middle and the level, between -1 and 1.
    """
    before, flint.ctx.prec = flint.ctx.prec, BITS
    try:
        return _circle(size, turns, phase, arc)
    finally:
        flint.ctx.prec = before


def _circle(size: Fraction, turns: int, phase: Fraction, arc: Any) -> Axis:
    pi = flint.arb.pi()
    energy = number(size) * sp.cos(turns * (S - number(phase)))
    rests = []
    for j in range(2 * turns):
        at = _ball(phase) + pi * j / turns
        if arc is None or (at - _ball(arc[0])).cos() > _ball(arc[1]):
            rests.append(Rest(fraction(at), frozenset(), int((size > 0) == (j % 2 == 0))))
    functions: tuple[Any, ...] = ()
    if arc is not None:
        functions = (sp.cos(S - number(arc[0])) - number(arc[1]),)
        for side in (1, -1):
            at = _ball(arc[0]) + side * _ball(arc[1]).acos()
            pull = -_ball(size) * turns * (turns * (at - _ball(phase))).sin()
            if side * pull < 0:
                rests.append(Rest(fraction(at), frozenset({0}), 0))
            elif not side * pull > 0:
                msg = "an arc that ends at a stationary point"
                raise ValueError(msg)
    branches = ((0,),) if functions else ((),)
    return Axis(energy, functions, branches, tuple(rests), circle=True)


def _ball(x: Fraction) -> Any:
    return flint.arb(flint.fmpq(x.numerator, x.denominator))


def turn() -> Fraction:
    """Return a whole turn."""
    before, flint.ctx.prec = flint.ctx.prec, BITS
    try:
        return fraction(2 * flint.arb.pi())
    finally:
        flint.ctx.prec = before


TURN = turn()


@dataclass(frozen=True)
class Grid:
    """A product of axes in coordinates ``q`` with ``u = B (q - shift)``, ``B`` unimodular."""

    axes: tuple[Axis, ...]
    turn: tuple[tuple[int, ...], ...]
    shift: Vector

    def placed(self, symbols: Sequence[Any]) -> list[Any]:
        """Return ``u`` in terms of ``q``."""
        apart = [s - number(c) for s, c in zip(symbols, self.shift, strict=True)]
        return [sum(m * a for m, a in zip(row, apart, strict=True)) for row in self.turn]

    def energy(self, symbols: Sequence[Any]) -> Any:
        """Return the sum of the functions of all axes."""
        pairs = zip(self.axes, self.placed(symbols), strict=True)
        return sum(axis.energy.subs(S, u) for axis, u in pairs)

    def functions(self, symbols: Sequence[Any]) -> list[list[Any]]:
        """Return the functions of each axis."""
        pairs = zip(self.axes, self.placed(symbols), strict=True)
        return [[sp.expand(f.subs(S, u)) for f in axis.functions] for axis, u in pairs]

    def equations(self, symbols: Sequence[Any]) -> list[Any]:
        """Return the equations of the axes that have one."""
        pairs = zip(self.axes, self.placed(symbols), strict=True)
        return [sp.expand(a.equation.subs(S, u)) for a, u in pairs if a.equation is not None]

    def points(self) -> Iterator[Known]:
        """Yield all stationary points; function ``j`` of axis ``i`` is named ``f<i><j>``."""
        inverse = np.round(np.linalg.inv(np.array(self.turn, dtype=float))).astype(int).tolist()
        for rests in product(*(axis.rests for axis in self.axes)):
            u = [r.at for r in rests]
            moved = (
                sum((m * x for m, x in zip(row, u, strict=True)), Fraction(0)) for row in inverse
            )
            point = tuple(x + c for x, c in zip(moved, self.shift, strict=True))
            active = frozenset(f"f{i}{j}" for i, r in enumerate(rests) for j in r.active)
            indices = [r.index for r in rests]
            index = None if None in indices else sum(k for k in indices if k is not None)
            yield Known(point, active if index is not None else None, index)
