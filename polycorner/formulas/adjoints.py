"""Derivatives of programs in reverse: adjoints of every operation, accumulated once ([GW] ch. 3).

For an output ``f`` of the operations ``v_1, ..., v_N`` the adjoint of ``v`` is ``df/dv``, and

    df/dv = sum over operations w that read v of  df/dw * dw/dv,

taken from the last operation to the first, gives all partial derivatives at a small multiple of
the cost of ``f``, however many variables and operations there are.  The forward rule visits every
operation once per variable, and calls itself as deep as the formula is; it is cheaper for small
programs whose outputs share most of what they read, and kept for them.

Nodes on which no output depends to the first order (``stationary``) are constants to first
derivatives, whose own derivatives are complete: by the envelope theorem ([Danskin]) the gradient
of ``f(q) = F(q, t(q))``, where ``dF/dt = 0``, is ``dF/dq`` at ``t(q)``.

A branch (``select``) is not entered: its gradient is the gradient of the branch taken, since an
adjoint of zero times an infinite slope of the other branch would not be zero.
"""

import heapq
from collections.abc import Callable, Iterable
from dataclasses import replace

from polycorner.formulas.programs import Graph, Program

FEW = 12  # variables up to which derivatives are pushed forward
MANY = 2000  # operations up to which they are
DEEP = 100  # the same for operations that follow one another

# The nonzero partial derivatives of a node, by variable.
Row = dict[int, int]


def depth(graph: Graph, outputs: Iterable[int]) -> int:
    """Return the length of the longest chain of operations under the outputs."""
    lengths: list[int] = []
    for node in range(max(outputs, default=-1) + 1):
        lengths.append(1 + max((lengths[c] for c in graph.children(node)), default=0))
    return max((lengths[f] for f in outputs), default=0)


class Reverse:
    """Gradients of the nodes of one graph by accumulation of adjoints; ``held`` are constant."""

    def __init__(self, graph: Graph, held: Iterable[int] = ()) -> None:
        self.graph, self.held = graph, frozenset(held)
        self._fixed = sum(graph.supports[a] for a in self.held if graph.nodes[a][0] == "var")
        self._rows: dict[int, Row] = {}
        self._inside = 0  # how many branches the one that is being entered is inside of

    def row(self, node: int) -> Row:
        """Return the nonzero partial derivatives of a node by variable."""
        if node not in self._rows:
            if self._inside == DEEP:
                self._enter(node)
            self._inside += 1
            self._rows[node] = self._accumulate(node)
            self._inside -= 1
        return self._rows[node]

    def _enter(self, node: int) -> None:
        """Find the gradients of all branches below a node, from the innermost on."""
        for a in self.graph.needed([node]):
            for branch in self.graph.children(a)[1:] if self.graph.nodes[a][0] == "select" else ():
                if branch not in self._rows:
                    self._rows[branch] = self._accumulate(branch)

    def _accumulate(self, node: int) -> Row:
        """Visit the operations from the last to the first; arguments come before their readers."""
        g, found = self.graph, Row()
        adjoints, waiting = {node: g.const(1)}, [-node]
        while waiting:
            a = -heapq.heappop(waiting)
            w = adjoints.pop(a)
            if a in self.held:
                continue
            op, args = g.nodes[a]
            if op == "var":
                self._add(found, int(args[0]), w)
            elif op == "select":
                self._add_branches(found, a, w)
            else:
                for child, slope in g.partials(a):
                    if not g.supports[child] & ~self._fixed:
                        continue
                    if child not in adjoints:
                        heapq.heappush(waiting, -child)
                    self._add(adjoints, child, g.mul(w, slope))
        return {i: found[i] for i in sorted(found) if found[i] != g.const(0)}

    def _add(self, sums: Row, key: int, term: int) -> None:
        sums[key] = self.graph.add(sums[key], term) if key in sums else term

    def _add_branches(self, found: Row, a: int, w: int) -> None:
        g = self.graph
        condition, yes, no = g.children(a)
        left, right, zero = self.row(yes), self.row(no), g.const(0)
        for i in sorted({*left, *right}):
            slope = g.select(condition, left.get(i, zero), right.get(i, zero))
            self._add(found, i, g.mul(w, slope))


def derivatives(program: Program, order: int) -> tuple[Program, tuple[list[int], ...]]:
    """Return the nodes of the values, gradients and (symmetric) Hessians up to ``order``.

    Gradients are listed row by row ``(m, k)``, Hessians as ``(m, k, k)``.  They are nodes of the
    program that is returned, whose graph is a copy: operations depend on the given program alone,
    and gradients are the same for every order.
    """
    g, k = program.graph.copy(), program.variables
    small = k <= FEW and depth(g, program.outputs) <= DEEP and len(g.nodes) <= MANY
    rule = _pushed if small else _pulled
    levels: tuple[list[int], ...] = (list(program.outputs),)
    first = rule(g, k, program.stationary)
    rows = [first(f) for f in program.outputs] if order >= 1 else []
    if order >= 1:
        levels += ([found.get(i, g.const(0)) for found in rows for i in range(k)],)
    if order >= 2:
        second = rule(g, k, ())
        seconds = [{i: second(slope) for i, slope in found.items()} for found in rows]
        pairs = [(min(i, j), max(i, j)) for i in range(k) for j in range(k)]
        zero = g.const(0)
        levels += ([s.get(i, Row()).get(j, zero) for s in seconds for i, j in pairs],)
    return replace(program, graph=g), levels


def _pulled(graph: Graph, _: int, held: Iterable[int]) -> Callable[[int], Row]:
    return Reverse(graph, held).row


def _pushed(graph: Graph, variables: int, held: Iterable[int]) -> Callable[[int], Row]:
    graph.hold(held, variables)

    def row(node: int) -> Row:
        found = {i: graph.derivative(node, i) for i in range(variables)}
        return {i: slope for i, slope in found.items() if slope != graph.const(0)}

    return row
