"""A straight-line program in interval arithmetic, as LLVM instructions for several boxes at once.

A number is a lower and an upper bound in every lane.  Both are finite, or both are NaN: then the
interval is *given up*, since the number may be undefined or unbounded.  Operations carry NaN on
by themselves, selections and extremes are written so that they do; results replace it by infinite
bounds.  Infinities do not occur (:mod:`polycorner.formulas.ranges`).

A condition is a pair of masks: it holds on the whole box, it fails on the whole box.
"""

from functools import partial
from typing import Any

from llvmlite import ir

from polycorner.formulas import interval_library as functions
from polycorner.formulas.interval_library import Sides, blend, bounded
from polycorner.formulas.programs import Graph
from polycorner.formulas.ranges import (
    GUARD,
    INPUT,
    LOGIC,
    SMALLEST_DIVISOR,
    Fact,
    outward,
    pattern,
    reads,
    static,
)
from polycorner.formulas.rounding import Stepped, greatest, least


class IntervalEmitter:
    """Translates the nodes of one graph, each at most once, into a block of instructions."""

    def __init__(self, rounding: Stepped, graph: Graph, boxes: dict[int, Sides]) -> None:
        self.r, self.b, self.graph, self.boxes = rounding, rounding.b, graph, boxes
        self.facts: dict[int, Fact] = {}
        self._done: dict[int, Sides] = {}
        self._circular: dict[int, tuple[Sides, Sides]] = {}
        self._continuous: dict[int, ir.Value | None] = {}

    def value(self, node: int) -> Sides:
        """Return the bounds of a node, emitting what it needs."""
        for a in self.graph.needed([node], partial(reads, self.graph), self._done):
            self._done[a] = self._emit(a)
        return self._done[node]

    def _emit(self, node: int) -> Sides:
        op, args = self.graph.nodes[node]
        if op in LOGIC:
            return self._logic(op, args)
        known = self.facts[node] = static(self.graph, node, self.facts)
        result = self._leaf(op, args) if op in {"const", "var"} else self._operate(op, node)
        if known.guarded:
            result = functions.inside(self.r, result, -(2.0**GUARD), 2.0**GUARD)
        self.facts[node] = known.kept
        return result

    def _leaf(self, op: str, args: tuple[Any, ...]) -> Sides:
        if op == "const":
            ends = outward(args[0])
            low, high = (self.r.splat(end) for end in ends)
            return (low, low) if ends[0] == ends[1] else (low, high)
        box = functions.inside(self.r, self.boxes[int(args[0])], -(2.0**INPUT), 2.0**INPUT)
        return bounded(self.r, self.b.fcmp_ordered("<=", *box), box)

    def _operate(self, op: str, node: int) -> Sides:
        if op == "select":
            return self._select(node)
        children = self.graph.children(node)
        if op in {"sin", "cos"}:
            return self._sine(children[0])[op == "cos"]
        values = [self._done[a] for a in children]
        x, y = values[0], values[-1]
        rules = {"mul": self._mul, "div": self._div, "pow": self._pow}
        if op in rules:
            return rules[op](children, x, y)
        if op == "add":
            return self.r.sides("add", (x[0], y[0]), (x[1], y[1]))
        if op == "sub":
            return self.r.sides("sub", (x[0], y[1]), (x[1], y[0]))
        if op == "neg":
            return self._neg(x)
        if op == "sqrt":
            return self._sqrt(self.facts[children[0]], x)
        if op == "atan2":
            return functions.arctangent(self.r, x, y)
        known = self.facts[node]
        signs = 0.0 if known.nonnegative else None, 0.0 if known.nonpositive else None
        return functions.within(self.r, functions.unary(self.r, op, x), *signs)

    def _neg(self, x: Sides) -> Sides:
        return self.b.fneg(x[1]), self.b.fneg(x[0])

    def _sine(self, argument: int) -> tuple[Sides, Sides]:
        if argument not in self._circular:
            self._circular[argument] = functions.circular(self.r, self._done[argument])
        return self._circular[argument]

    def _sqrt(self, known: Fact, x: Sides) -> Sides:
        """Square roots of intervals that reach below zero are given up, as in ball arithmetic."""
        if not known.nonnegative:
            x = bounded(self.r, self.b.fcmp_ordered(">=", x[0], self.r.splat(0.0)), x)
        return self.r.sides("sqrt", x[:1], x[1:])

    def _mul(self, children: tuple[int, ...], x: Sides, y: Sides) -> Sides:
        first, second = (self.facts[a] for a in children)
        if children[0] == children[1]:
            return self._square(first, x)
        if first.nonpositive:
            return self._neg(self.product(first.negated(), self._neg(x), second, y))
        if second.nonpositive:
            return self._neg(self.product(first, x, second.negated(), self._neg(y)))
        return self.product(first, x, second, y)

    def _square(self, known: Fact, x: Sides) -> Sides:
        if known.nonpositive:
            x = self._neg(x)
        elif not known.nonnegative:
            x = functions.magnitude(self.r, x)
        low, high = (
            self.r.mul([(end, end)], up=up) for end, up in zip(x, (False, True), strict=True)
        )
        return greatest(self.b, self.r.splat(0.0), low), high

    def product(self, first: Fact, x: Sides, second: Fact, y: Sides) -> Sides:
        """Return the range of a product: the least and the greatest of products of ends."""
        if second.nonnegative and not first.nonnegative:
            first, x, second, y = second, y, first, x
        if first.nonnegative and second.nonnegative:
            low = self.r.mul([(x[0], y[0])], up=False)
            high = self.r.mul([(x[1], y[1])], up=True)
            return greatest(self.b, self.r.splat(0.0), low), high
        ends = x if x[0] is not x[1] else x[:1]
        if first.nonnegative:
            low = self.r.mul([(end, y[0]) for end in ends], up=False)
            return low, self.r.mul([(end, y[1]) for end in ends], up=True)
        pairs = [(p, q) for p in x for q in y]
        return self.r.mul(pairs, up=False), self.r.mul(pairs, up=True)

    def _div(self, children: tuple[int, ...], x: Sides, y: Sides) -> Sides:
        above, below = (self.facts[a] for a in children)
        b, r = self.b, self.r
        if below.nonpositive:
            return self._neg(self._quotient(above, x, self._apart(self._neg(y))))
        if below.nonnegative:
            return self._quotient(above, x, self._apart(y))
        negative = b.fcmp_ordered("<", y[1], r.splat(0.0))
        x, y = (blend(b, negative, self._neg(z), z) for z in (x, y))
        return self._quotient(Fact(False, False, above.size), x, self._apart(y))

    def _apart(self, y: Sides) -> Sides:
        """Give up divisors that may be zero, or so small that a quotient could overflow."""
        smallest = self.r.splat(2.0**-SMALLEST_DIVISOR)
        return bounded(self.r, self.b.fcmp_ordered(">=", y[0], smallest), y)

    def _quotient(self, above: Fact, x: Sides, y: Sides) -> Sides:
        """Return the range of ``x / y`` for positive ``y``."""
        b, r, zero = self.b, self.r, self.r.splat(0.0)
        if above.nonnegative:
            low, high = r.sides("div", (x[0], y[1]), (x[1], y[0]))
            return greatest(b, zero, low), high
        if above.nonpositive:
            low, high = r.sides("div", (x[0], y[0]), (x[1], y[1]))
            return low, least(b, zero, high)
        smaller = b.select(b.fcmp_ordered(">=", x[0], zero), y[1], y[0])
        larger = b.select(b.fcmp_ordered(">=", x[1], zero), y[0], y[1])
        return r.sides("div", (x[0], smaller), (x[1], larger))

    def _pow(self, children: tuple[int, ...], x: Sides, y: Sides) -> Sides:
        exponent = self.facts[children[1]]
        constant = self.graph.nodes[children[1]][0] == "const"
        return functions.power(self.r, x, y, positive=constant and exponent.nonnegative)

    # -------------------------------------------------------------------------------- branches

    def _logic(self, op: str, args: tuple[Any, ...]) -> Sides:
        b, values = self.b, [self._done[int(a)] for a in args]
        x, y = values[0], values[-1]
        if op in {"lt", "le"}:  # strictly: what is decided is decided around the closed box, too
            return b.fcmp_ordered("<", x[1], y[0]), b.fcmp_ordered(">", x[0], y[1])
        if op == "not":
            return x[1], x[0]
        if op == "and":
            return b.and_(x[0], y[0]), b.or_(x[1], y[1])
        return b.or_(x[0], y[0]), b.and_(x[1], y[1])

    def _select(self, node: int) -> Sides:
        found = pattern(self.graph, node)
        if found is None:
            condition, yes, no = (self._done[a] for a in self.graph.children(node))
            hull = self._both(self._extremes(yes, no, "hull"), yes, no)
            result = blend(self.b, condition[0], yes, hull)
            return blend(self.b, condition[1], no, result)
        x, y = (self._done[a] for a in (found.nodes[0], found.nodes[-1]))
        if found.kind in {"abs", "-abs"}:
            size = functions.magnitude(self.r, x)
            return size if found.kind == "abs" else self._neg(size)
        return self._both(self._extremes(x, y, found.kind), x, y)

    def _extremes(self, x: Sides, y: Sides, kind: str) -> Sides:
        low, high = greatest if kind == "max" else least, least if kind == "min" else greatest
        return low(self.b, x[0], y[0]), high(self.b, x[1], y[1])

    def _both(self, result: Sides, x: Sides, y: Sides) -> Sides:
        """Give up a result of two intervals, one of which is given up."""
        return bounded(self.r, self.b.fcmp_ordered("ord", x[0], y[0]), result)

    # ------------------------------------------------------------------------------ continuity

    def continuous(self, node: int) -> ir.Value | None:
        """Return where a node is continuous on the box; None if it always is where defined.

        It is where every selection it depends on is decided, or one of the patterns of
        :func:`~polycorner.formulas.ranges.pattern`, and every ``atan2`` keeps off its cut.
        """
        for a in self.graph.needed([node], self._parts, self._continuous):
            self._continuous[a] = self._continuity(a)
        return self._continuous[node]

    def _parts(self, node: int) -> tuple[int, ...]:
        """Return the nodes whose continuity matters, all but a condition."""
        is_branch = self.graph.nodes[node][0] == "select" and not pattern(self.graph, node)
        return self.graph.children(node)[1:] if is_branch else reads(self.graph, node)

    def _continuity(self, node: int) -> ir.Value | None:
        b, op = self.b, self.graph.nodes[node][0]
        parts = [self._continuous[a] for a in self._parts(node)]
        if op == "select" and not pattern(self.graph, node):
            condition = self.value(self.graph.children(node)[0])
            taken = [
                side if part is None else b.and_(side, part)
                for side, part in zip(condition, parts, strict=True)
            ]
            return b.or_(*taken)
        if op == "atan2":
            y, x = (self.value(a) for a in self.graph.children(node))
            parts.append(functions.cut_free(self.r, y, x))
        result: ir.Value | None = None
        for part in parts:
            if part is not None:
                result = part if result is None else b.and_(result, part)
        return result
