"""Signs and sizes of the operations of a graph, known before anything is evaluated.

Interval arithmetic needs no care for infinities if nothing overflows.  Inputs are bounded by
``2**INPUT``; every operation then has a bound ``2**size``, and where that could leave the range of
double precision (``size > LARGEST``) the number is *guarded*: intervals beyond ``2**GUARD`` are
given up at evaluation, so that what follows is bounded again.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import Graph

INPUT, GUARD, LARGEST = 40.0, 480.0, 1000.0
BOUNDLESS = 2000.0  # the size of what has no bound of its own
SMALLEST_DIVISOR = 200.0  # denominators that may be smaller than 2**-200 are given up
SMALLEST = -1000.0  # no smaller size is claimed, since bounds are moved by subnormal numbers

PI, E = (3.141592653589793, 3.1415926535897936), (2.718281828459045, 2.7182818284590455)
LOGIC = {"lt", "le", "and", "or", "not"}


@dataclass(frozen=True)
class Fact:
    """What holds for the bounds of a number wherever it is bounded at all.

    Attributes
    ----------
    nonnegative, nonpositive : bool
        The sign, if it is known.
    size : float
        Both bounds are at most ``2**size`` in absolute value.
    """

    nonnegative: bool
    nonpositive: bool
    size: float

    def negated(self) -> "Fact":
        """Return what holds for the negative."""
        return Fact(self.nonpositive, self.nonnegative, self.size)

    @property
    def guarded(self) -> bool:
        """Whether the number must be checked at evaluation."""
        return self.size > LARGEST

    @property
    def kept(self) -> "Fact":
        """What holds after the check."""
        return Fact(self.nonnegative, self.nonpositive, GUARD) if self.guarded else self


def outward(value: object) -> tuple[float, float]:
    """Return the tightest doubles about a constant: a fraction, ``"pi"`` or ``"e"``.

    Both are infinite for a fraction beyond the range of doubles.
    """
    if value == "pi":
        return PI
    if value == "e":
        return E
    assert isinstance(value, Fraction)
    try:
        near = value.numerator / value.denominator
    except OverflowError:
        return -math.inf, math.inf
    if Fraction(near) == value:
        return near, near
    if Fraction(near) < value:
        return near, math.nextafter(near, math.inf)
    return math.nextafter(near, -math.inf), near


def constant_fact(value: object) -> Fact:
    """Return sign and size of a constant; one that no double bounds is guarded."""
    low, high = outward(value)
    largest = max(abs(low), abs(high))
    size = float(math.frexp(largest)[1]) if math.isfinite(largest) else BOUNDLESS
    return Fact(low >= 0, high <= 0, max(size, SMALLEST))


def fact(op: str, given: list[Fact], *, same: bool) -> Fact:
    """Return sign and size of an operation from those of its arguments.

    ``same`` says that both arguments of a binary operation are one node.
    """
    x = given[0]
    y = given[-1]
    sizes = max(x.size, y.size)
    if op == "neg":
        return x.negated()
    if op in {"add", "sub"}:
        other = y if op == "add" else y.negated()
        below, above = x.nonnegative and other.nonnegative, x.nonpositive and other.nonpositive
        return Fact(below, above, sizes + 1)
    if op in {"mul", "div"}:
        size = max(x.size + (y.size if op == "mul" else SMALLEST_DIVISOR) + 1, SMALLEST)
        like = (x.nonnegative and y.nonnegative) or (x.nonpositive and y.nonpositive)
        unlike = (x.nonnegative and y.nonpositive) or (x.nonpositive and y.nonnegative)
        return Fact(like or (same and op == "mul"), unlike, size)
    return _elementary(op, x)


def _elementary(op: str, x: Fact) -> Fact:
    if op == "atan2":
        return Fact(False, False, 2.0)
    if op == "pow":
        return Fact(True, False, BOUNDLESS)
    known = OPERATIONS[op]
    size = max(x.size, 0.0) / 2 + 1 if op == "sqrt" else known.size
    least, odd = known.values[0], known.keeps_signs
    positive = least is not None and least >= 0
    return Fact(positive or (odd and x.nonnegative), odd and x.nonpositive, size)


@dataclass(frozen=True)
class Selection:
    """A selection that is continuous: ``min``, ``max``, ``abs`` or ``clamp`` of nodes."""

    kind: str
    nodes: tuple[int, ...]


def pattern(graph: Graph, node: int) -> Selection | None:
    """Return what a selection amounts to, or None if it is not known to be continuous.

    ``a if a <= b else b`` is the smaller of both, ``-u if u < 0 else u`` is ``|u|``, and so on.  A
    clamp names a constant first, so that its outer selection compares with that constant.
    """
    op, args = graph.nodes[node]
    if op != "select":
        return None
    condition, yes, no = (int(a) for a in args)
    op, compared = graph.nodes[condition]
    if op == "not":
        op, compared = graph.nodes[int(compared[0])]
        yes, no = no, yes
    if op not in {"lt", "le"}:
        return None
    a, b = (int(c) for c in compared)
    if {yes, no} == {a, b}:
        return Selection("min" if yes == a else "max", (a, b))
    if _opposite(graph, yes, no):
        return _absolute(graph, a, b, yes, no)
    return _clamp(graph, a, b, yes, no)


def _opposite(graph: Graph, x: int, y: int) -> bool:
    return graph.nodes[x] == ("neg", (y,)) or graph.nodes[y] == ("neg", (x,))


def _absolute(graph: Graph, a: int, b: int, yes: int, no: int) -> Selection | None:
    """Recognise ``|u|`` and ``-|u|``: selections between ``u`` and ``-u`` by the sign of ``u``."""
    if is_zero(graph, b) and a in (yes, no):
        return Selection("abs" if no == a else "-abs", (a,))
    if is_zero(graph, a) and b in (yes, no):
        return Selection("abs" if yes == b else "-abs", (b,))
    return None


def _clamp(graph: Graph, a: int, b: int, yes: int, no: int) -> Selection | None:
    """Recognise ``max(c, y)`` and ``min(c, y)`` where ``y`` is an extreme of the number compared.

    ``c if t <= c else min(d, t)`` is ``max(c, min(d, t))`` for constants ``c <= d``.
    """
    for bound, t, lower in ((b, a, True), (a, b, False)):
        if yes != bound or graph.nodes[bound][0] != "const":
            continue
        inner = pattern(graph, no)
        if inner is None or inner.kind != ("min" if lower else "max") or t not in inner.nodes:
            continue
        other = inner.nodes[1 - inner.nodes.index(t)]
        if graph.nodes[other][0] == "const" and _ordered(graph, bound, other, lower=lower):
            return Selection("max" if lower else "min", (bound, no))
    return None


def _ordered(graph: Graph, c: int, d: int, *, lower: bool) -> bool:
    (_, c_high), (d_low, _) = (outward(graph.nodes[n][1][0]) for n in ((c, d) if lower else (d, c)))
    return c_high <= d_low or c == d


def is_zero(graph: Graph, node: int) -> bool:
    """Whether a node is the constant zero."""
    return graph.nodes[node] == ("const", (Fraction(0),))


def reads(graph: Graph, node: int) -> tuple[int, ...]:
    """Return the nodes on which the bounds of a node depend directly."""
    found = pattern(graph, node)
    return found.nodes if found else graph.children(node)


def static(graph: Graph, node: int, known: dict[int, Fact]) -> Fact:
    """Return what is known of a node whose arguments are known."""
    op, args = graph.nodes[node]
    if op == "const":
        return constant_fact(args[0])
    if op == "var":
        return Fact(False, False, INPUT)
    if op == "select":
        return _selected(graph, node, known)
    given: list[Any] = [known[int(a)] for a in args]
    return fact(op, given, same=len(args) == 2 and args[0] == args[1])


def _selected(graph: Graph, node: int, known: dict[int, Fact]) -> Fact:
    found = pattern(graph, node)
    if found and found.kind in {"abs", "-abs"}:
        size = known[found.nodes[0]].size
        return Fact(found.kind == "abs", found.kind == "-abs", size)
    if found:
        x, y = (known[a] for a in found.nodes)
        join, meet = (any, all) if found.kind == "max" else (all, any)
        signs = join((x.nonnegative, y.nonnegative)), meet((x.nonpositive, y.nonpositive))
        return Fact(*signs, max(x.size, y.size))
    x, y = (known[int(a)] for a in graph.nodes[node][1][1:])
    below, above = x.nonnegative and y.nonnegative, x.nonpositive and y.nonpositive
    return Fact(below, above, max(x.size, y.size))
