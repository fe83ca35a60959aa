"""Straight-line programs: formulas as a graph of shared operations, and their derivatives.

Every subexpression is stored once (hash-consing), so a quantity used by nine gaps is computed
once; derivatives are taken on the same graph, here in forward mode, and zero derivatives never
become operations ([GW] ch. 3, 6).  Branches (``Piecewise``, ``Min``, ``Max``, ``Abs``) become
selections, whose derivative is the derivative of the branch taken.
"""

import hashlib
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from polycorner.formulas.operations import OPERATIONS

Payload = int | str | Fraction
Node = tuple[str, tuple[Payload, ...]]

LEAVES = frozenset({"const", "var", "par"})
POWERS_OF_TWO = frozenset(Fraction(2) ** k for k in range(-4, 5) if k)


class Graph:
    """A growing list of operations, each stored once; a node is named by its position.

    Leaves are ``const`` (a fraction, ``"pi"`` or ``"e"``), ``var`` and ``par`` (a position).
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.supports: list[int] = []  # the variables that a node depends on, one bit each
        self._index: dict[Node, int] = {}
        self._derivatives: dict[tuple[int, int], int] = {}
        self._zero = -1

    def copy(self) -> "Graph":
        """Return a graph with the same nodes, to which others can be added."""
        other = Graph()
        other.nodes, other.supports = self.nodes.copy(), self.supports.copy()
        other._index, other._zero = self._index.copy(), self._zero
        return other

    def node(self, op: str, *args: Payload) -> int:
        """Return the node ``op(args)``, adding it when it is new."""
        key = (op, args)
        if key not in self._index:
            self._index[key] = len(self.nodes)
            self.nodes.append(key)
            self.supports.append(self._support(op, args))
        return self._index[key]

    def _support(self, op: str, args: tuple[Payload, ...]) -> int:
        """Return the variables that an operation depends on, one bit each."""
        if op == "var":
            return 1 << int(args[0])
        support = 0
        for child in () if op in LEAVES else args:
            support |= self.supports[int(child)]
        return support

    def const(self, value: Fraction | int | str) -> int:
        """Return a constant node: an exact fraction, or ``"pi"`` or ``"e"``."""
        if value == 0:
            if self._zero < 0:
                self._zero = self.node("const", Fraction(0))
            return self._zero
        return self.node("const", value if isinstance(value, str) else Fraction(value))

    def children(self, a: int) -> tuple[int, ...]:
        """Return the nodes that an operation reads."""
        op, args = self.nodes[a]
        return () if op in LEAVES else tuple([int(child) for child in args])

    def needed(
        self,
        outputs: Iterable[int],
        reads: "Callable[[int], Iterable[int]] | None" = None,
        known: Container[int] = (),
    ) -> list[int]:
        """Return the nodes that some nodes depend on, arguments before what reads them.

        ``reads`` returns the nodes on which one depends directly, its :meth:`children` by default;
        ``known`` ones are left out, with what only they depend on.
        """
        reads = reads or self.children
        found: set[int] = set()
        waiting = list(outputs)
        while waiting:
            a = waiting.pop()
            if a not in found and a not in known:
                found.add(a)
                waiting += reads(a)
        return sorted(found)

    def rebuilt(self, op: str, args: Iterable[Payload], placed: Mapping[int, int]) -> int:
        """Write an operation of another graph, whose arguments have places in this one."""
        if op == "const":
            return self.const(*args)
        if op in LEAVES:
            return self.node(op, *args)
        children = [placed[int(arg)] for arg in args]
        if op in {"add", "sub", "neg", "mul", "div", "select"}:
            result: int = getattr(self, op)(*children)
            return result
        return self.unary(op, *children) if op in OPERATIONS else self.node(op, *children)

    def grafted(self, program: "Program", inputs: Mapping[tuple[str, int], int]) -> list[int]:
        """Write a program into the graph; return the places of its nodes there.

        ``inputs`` are the nodes in place of its variables ``("var", i)`` and parameters
        ``("par", i)``.  Operations on constants and on what the graph has already are simplified
        and shared.
        """
        placed: dict[int, int] = {}
        for a, (op, args) in enumerate(program.graph.nodes):
            leaf = op in {"var", "par"}
            placed[a] = inputs[op, int(args[0])] if leaf else self.rebuilt(op, args, placed)
        return [*placed.values()]

    def _value(self, a: int) -> Fraction | None:
        op, args = self.nodes[a]
        return args[0] if op == "const" and isinstance(args[0], Fraction) else None

    def add(self, a: int, b: int) -> int:
        """Return ``a + b``."""
        u, v = self._value(a), self._value(b)
        if u is not None and v is not None:
            return self.const(u + v)
        if u == 0:
            return b
        if v == 0:
            return a
        if self.nodes[b][0] == "neg":
            return self.sub(a, self._arg(b))
        if self.nodes[a][0] == "neg":
            return self.sub(b, self._arg(a))
        (f, x), (g, y) = self._scaled(a), self._scaled(b)
        if f == g != 1:
            return self.mul(self.const(f), self.add(x, y))
        return self.node("add", min(a, b), max(a, b))

    def _scaled(self, a: int) -> tuple[Fraction, int]:
        """Return a product as a power of two, whose place does not matter, and the rest."""
        op, args = self.nodes[a]
        f = self._value(int(args[0])) if op == "mul" else None
        return (f, int(args[1])) if f and f in POWERS_OF_TWO else (Fraction(1), a)

    def core(self, a: int) -> int:
        """Return a node without the sign and the power of two that products pass on."""
        op, args = self.nodes[a]
        return self._scaled(int(args[0]) if op == "neg" else a)[1]

    def sub(self, a: int, b: int) -> int:
        """Return ``a - b``."""
        u, v = self._value(a), self._value(b)
        if u is not None and v is not None:
            return self.const(u - v)
        if v == 0:
            return a
        if a == b:
            return self.const(0)
        if u == 0:
            return self.neg(b)
        if self.nodes[b][0] == "neg":
            return self.add(a, self._arg(b))
        if self.nodes[a][0] == "neg":
            return self.neg(self.add(self._arg(a), b))
        (f, x), (g, y) = self._scaled(a), self._scaled(b)
        if f == g != 1:
            return self.mul(self.const(f), self.sub(x, y))
        opposite = self._index.get(("sub", (b, a)))
        return self.node("sub", a, b) if opposite is None else self.node("neg", opposite)

    def neg(self, a: int) -> int:
        """Return ``-a``."""
        u = self._value(a)
        if u is not None:
            return self.const(-u)
        return self._arg(a) if self.nodes[a][0] == "neg" else self.node("neg", a)

    def mul(self, a: int, b: int) -> int:
        """Return ``a * b``."""
        u, v = self._value(a), self._value(b)
        if u is not None and v is not None:
            return self.const(u * v)
        if v is not None:
            a, b, u = b, a, v
        if u == 0:
            return a
        if u == 1:
            return b
        if u == -1:
            return self.neg(b)
        if self.nodes[a][0] == "neg":
            return self.neg(self.mul(self._arg(a), b))
        if self.nodes[b][0] == "neg":
            return self.neg(self.mul(a, self._arg(b)))
        (f, x), (g, y) = self._scaled(a), self._scaled(b)
        if u is not None:
            merged = g != 1 and u in POWERS_OF_TWO
            return self.mul(self.const(u * g), y) if merged else self.node("mul", a, b)
        if f != 1 or g != 1:
            return self.mul(self.const(f * g), self.mul(x, y))
        return self.node("mul", min(a, b), max(a, b))

    def div(self, a: int, b: int) -> int:
        """Return ``a / b``; a shared reciprocal is left to ``inv``."""
        u, v = self._value(a), self._value(b)
        if v is not None and v != 0:
            return self.mul(a, self.const(1 / v))
        if u == 0:
            return a
        return self.node("div", a, b)

    def inv(self, a: int) -> int:
        """Return ``1 / a``."""
        return self.div(self.const(1), a)

    def unary(self, op: str, a: int) -> int:
        """Return an elementary function of ``a``."""
        u = self._value(a)
        fixed = u is not None and OPERATIONS[op].known.get(u) == u
        return a if fixed else self.node(op, a)

    def power(self, a: int, exponent: Fraction) -> int:
        """Return ``a ** exponent`` by multiplications and square roots where that is possible."""
        if exponent == 0:
            return self.const(1)
        if exponent < 0:
            return self.inv(self.power(a, -exponent))
        if exponent.denominator == 2:
            return self.mul(self.power(a, Fraction(int(exponent))), self.unary("sqrt", a))
        if exponent.denominator == 1:
            half = self.power(a, Fraction(exponent.numerator // 2))
            square = self.mul(half, half)
            return self.mul(square, a) if exponent.numerator % 2 else square
        return self.node("pow", a, self.const(exponent))

    def select(self, condition: int, a: int, b: int) -> int:
        """Return ``a`` where the condition holds and ``b`` elsewhere."""
        return a if a == b else self.node("select", condition, a, b)

    def _arg(self, a: int, position: int = 0) -> int:
        child = self.nodes[a][1][position]
        assert isinstance(child, int)
        return child

    def hold(self, nodes: Iterable[int], variables: int) -> None:
        """Treat nodes as constants in the derivatives taken from now on, and no others."""
        self._derivatives = {(a, i): self.const(0) for a in nodes for i in range(variables)}

    def derivative(self, a: int, variable: int) -> int:
        """Return the partial derivative of node ``a`` by variable number ``variable``."""
        if not self.supports[a] >> variable & 1:
            return self.const(0)
        key = (a, variable)
        if key not in self._derivatives:
            self._derivatives[key] = self._differentiate(a, variable)
        return self._derivatives[key]

    def _differentiate(self, a: int, variable: int) -> int:
        op, args = self.nodes[a]
        if op == "var":
            return self.const(int(args[0] == variable))
        if op in {"const", "par"}:
            return self.const(0)
        if op == "select":
            condition, yes, no = (self._arg(a, k) for k in range(3))
            either = self.derivative(yes, variable), self.derivative(no, variable)
            return self.select(condition, *either)
        children = [self._arg(a, k) for k in range(len(args))]
        slopes = [self.derivative(child, variable) for child in children]
        if all(self._value(slope) == 0 for slope in slopes):
            return self.const(0)
        if len(children) == 1:
            return self._chain(op, a, children[0], slopes[0])
        return self._binary_rule(op, a, children, slopes)

    def partials(self, a: int) -> list[tuple[int, int]]:
        """Return the slope of an operation other than ``select`` by each argument that varies."""
        op, args = self.nodes[a]
        pair = [self._arg(a, k) for k in range(len(args))] if self.supports[a] else []
        one, zero = self.const(1), self.const(0)
        if len(pair) == 1:
            return [(pair[0], self._chain(op, a, pair[0], one))]
        units = ([one, zero], [zero, one])
        return [
            (child, self._binary_rule(op, a, pair, unit))
            for child, unit in zip(pair, units, strict=False)
            if self.supports[child]
        ]

    def _binary_rule(self, op: str, a: int, children: list[int], slopes: list[int]) -> int:
        u, v = children
        du, dv = slopes
        if op == "add":
            return self.add(du, dv)
        if op == "sub":
            return self.sub(du, dv)
        if op == "mul":
            one = self.mul(du, v)
            return self.mul(self.const(2), one) if u == v else self.add(one, self.mul(u, dv))
        if op == "div":
            return self.mul(self.sub(du, self.mul(a, dv)), self.inv(v))
        if op == "atan2":
            norm = self.add(self.mul(u, u), self.mul(v, v))
            return self.div(self.sub(self.mul(v, du), self.mul(u, dv)), norm)
        if op == "pow":
            slope = self.mul(v, self.node("pow", u, self.sub(v, self.const(1))))
            growth = self.mul(self.mul(a, self.unary("log", u)), dv) if self._value(dv) != 0 else dv
            return self.add(self.mul(slope, du), growth)
        msg = f"no derivative rule for {op}"
        raise AssertionError(msg)

    def _chain(self, op: str, a: int, u: int, du: int) -> int:
        return self.neg(du) if op == "neg" else int(OPERATIONS[op].slope(self, u, a, du))


@dataclass(frozen=True)
class Program:
    """The values of several expressions as one straight-line program.

    Attributes
    ----------
    graph : Graph
        The shared operations.
    outputs : tuple of int
        The node of each expression.
    variables, parameters : int
        How many of each the program reads.
    stationary : tuple of int
        Nodes on which no output depends to the first order, wherever it is evaluated.
    """

    graph: Graph
    outputs: tuple[int, ...]
    variables: int
    parameters: int
    stationary: tuple[int, ...] = ()

    def digest(self) -> str:
        """Return a hash of the operations: equal programs have equal digests."""
        parts = self.graph.nodes, self.outputs, self.variables, self.parameters, self.stationary
        return hashlib.sha256(repr(parts).encode()).hexdigest()


@dataclass(frozen=True)
class Polynomial:
    """A polynomial ``c + b.x + x.S x / 2`` of given dimension and degree, all coefficients data.

    Its parameters are ``c``, ``b (n,)`` and, for degree two, the symmetric ``S (n, n)``.

    Attributes
    ----------
    variables : int
        ``n``.
    degree : int
        1 or 2.
    """

    variables: int
    degree: int

    @property
    def parameters(self) -> int:
        """The number of coefficients."""
        n = self.variables
        return 1 + n + (n * n if self.degree == 2 else 0)
