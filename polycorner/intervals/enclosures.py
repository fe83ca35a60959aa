"""Formulas in ball arithmetic: enclosures of values and derivatives over whole boxes.

The evaluated graph is the one from which the kernels are compiled
(:mod:`~polycorner.formulas.programs`), with exact constants: fractions, pi and e are enclosed, and
a floating-point number given by the user stands for the dyadic fraction it represents.

Derivatives are taken only where a function is smooth on the whole box: every branch that matters
is decided there, and no root, quotient, logarithm, power or angle reaches the boundary of its
domain of analyticity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any

from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.programs import Graph, Program
from polycorner.formulas.translate import compile_expressions
from polycorner.intervals.balls import ANALYTIC, Ball, constant, operations
from polycorner.intervals.tapes import Box, Tape
from polycorner.spaces.manifold import Manifold

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True)
class Undecided:
    """A question that a box does not decide: its subject and the reason."""

    name: str
    reason: str

    def __str__(self) -> str:
        """Return subject and reason as one phrase."""
        return f"{self.name}: {self.reason}"


@lru_cache(maxsize=64)
def exact_program(family: Family) -> Program:
    """Return a family's program with every number exact, long floating-point ones included."""
    import sympy

    definitions, expressions = family.formulas()

    def fractions(e: "sympy.Expr") -> "sympy.Expr":
        found = e.atoms(sympy.Float)
        return e.xreplace({number: sympy.Rational(number) for number in found}) if found else e

    return compile_expressions(
        [fractions(expressions[name]) for name in family.names],
        family.variables,
        family.parameters,
        {name: fractions(e) for name, e in definitions.items()},
        family.names,
        family.stationary,
    )


def write(graph: Graph, f: SmoothFunction, free: "Mapping[str, int] | None" = None) -> int:
    """Write a function into a graph and return its node.

    Coordinates are the graph's first variables; ``free`` gives the positions of parameters that
    are variables, too.  All others are the exact numbers that the function is bound to.
    """
    program = exact_program(f.family)
    output = program.outputs[f.family.names.index(f.member_name)]
    return written(graph, f, program, [output], free)[output]


def written(
    graph: Graph,
    f: SmoothFunction,
    program: Program,
    outputs: Sequence[int],
    free: "Mapping[str, int] | None" = None,
) -> dict[int, int]:
    """Write nodes of the program of a function's family into a graph; return their places in it.

    See :func:`write`; the program is :func:`exact_program`, or that with derivatives.
    """
    places = free or {}
    inputs = {("var", i): graph.node("var", k) for i, k in enumerate(f.reads)}
    for j, (name, value) in enumerate(zip(f.family.parameters, f.parameters, strict=True)):
        if name in places:
            inputs["par", j] = graph.node("var", places[name])
        else:
            inputs["par", j] = graph.const(Fraction(value))
    placed: dict[int, int] = {}
    for a in program.graph.needed(outputs):
        op, args = program.graph.nodes[a]
        if op in {"var", "par"}:
            placed[a] = inputs[op, int(args[0])]
        elif op != "const" and op not in operations():
            msg = f"{f.name}: the operation {op} has no enclosure in ball arithmetic"
            raise ValueError(msg)
        else:
            placed[a] = graph.rebuilt(op, args, placed)
    return placed


class Formulas:
    """Functions on a manifold, written into one graph whose only inputs are a box's sides.

    Inputs are the manifold's coordinates, then the parameters with the names in ``free``.
    """

    def __init__(
        self, functions: Sequence[SmoothFunction], manifold: Manifold, free: Sequence[str] = ()
    ) -> None:
        self.names = tuple(f.name for f in functions)
        self.dimension, self.free = manifold.size, tuple(free)
        self.inputs = self.dimension + len(self.free)
        self.graph = Graph()
        places = {name: self.dimension + k for k, name in enumerate(self.free)}
        self.outputs = tuple([write(self.graph, f, places) for f in functions])
        self._tapes: dict[tuple[int, ...], Tape] = {}
        self._smooth: dict[Any, SmoothForms] = {}
        self._branches = Graph()  # of all smooth forms, so that none is differentiated twice

    def _tape(self, rows: tuple[int, ...]) -> Tape:
        if rows not in self._tapes:
            self._tapes[rows] = Tape(self.graph, [self.outputs[row] for row in rows])
        return self._tapes[rows]

    def values(self, box: Box, rows: Sequence[int]) -> "list[Ball]":
        """Return enclosures of some functions on a box; both branches where one is undecided."""
        tape = self._tape(tuple(rows))
        found = tape.run(box)
        return [found[slot] for slot in tape.outputs]

    def smooth(self, box: Box, rows: Sequence[int]) -> "SmoothForms | Undecided":
        """Return functions without branches that agree with the given ones on a box.

        The functions returned equal the given ones at every point of the box and are analytic in a
        neighbourhood of it; ``Undecided`` where the box does not determine the branches taken.
        """
        rows = tuple(rows)
        tape = self._tape(rows)
        found = tape.run(box)
        taken: dict[int, int] = {}
        for row in rows:
            reason = self._follow(self.outputs[row], tape, found, taken)
            if reason:
                return Undecided(self.names[row], reason)
        key = (rows, tuple(sorted(taken.items())))
        if key not in self._smooth:
            self._smooth[key] = self._pruned(rows, taken)
        return self._smooth[key]

    def undefined(self, parameters: "Sequence[Ball]") -> str:
        """Return the name of a function that is undefined for some parameters at every point.

        Only subexpressions of the parameters alone, outside branches, are examined; empty for none.
        """
        anywhere = [constant(Fraction(0))] * self.dimension
        for name, output in zip(self.names, self.outputs, strict=True):
            tape = Tape(self.graph, [output])
            found = tape.run(Box([*anywhere, *parameters]))
            waiting, fixed = [output], self._fixed(tape)
            while waiting:
                a = waiting.pop()
                op, children = self.graph.nodes[a][0], self.graph.children(a)
                if a in fixed and not found[tape.slots[a]].is_finite():
                    return name
                if op == "div" and children[1] in fixed and found[tape.slots[children[1]]] == 0:
                    return name
                if op != "select":
                    waiting += children
        return ""

    def _fixed(self, tape: Tape) -> set[int]:
        """Return the nodes of a tape that do not depend on the coordinates."""
        fixed: set[int] = set()
        for a in tape.nodes:
            op, args = self.graph.nodes[a]
            inputs = op == "var" and int(args[0]) < self.dimension
            if not inputs and all(child in fixed for child in self.graph.children(a)):
                fixed.add(a)
        return fixed

    def _follow(self, output: int, tape: Tape, found: list[Any], taken: dict[int, int]) -> str:
        """Follow the branches taken from an output; return the reason it may not be smooth."""
        waiting = [output]
        while waiting:
            a = waiting.pop()
            if a in taken:
                continue
            children = self.graph.children(a)
            given = [found[tape.slots[child]] for child in children]
            op = self.graph.nodes[a][0]
            if op == "select":
                if given[0] is None:
                    return "the box does not decide which branch is taken"
                taken[a] = children[1] if given[0] else children[2]
                waiting.append(taken[a])
                continue
            if op in ANALYTIC and not ANALYTIC[op][1](*given):
                return ANALYTIC[op][0]
            if not found[tape.slots[a]].is_finite():
                return "its values on the box are not bounded"
            taken[a] = a
            waiting += children
        return ""

    def _pruned(self, rows: tuple[int, ...], taken: dict[int, int]) -> "SmoothForms":
        graph, placed = self._branches, dict[int, int]()
        for a in sorted(taken):
            op, args = self.graph.nodes[a]
            direct = taken[a] == a
            placed[a] = graph.rebuilt(op, args, placed) if direct else placed[taken[a]]
        outputs = tuple([placed[self.outputs[row]] for row in rows])
        return SmoothForms(graph, outputs, self.dimension, self.inputs)


class SmoothForms:
    """Branch-free functions with their derivatives, ready for evaluation in balls."""

    def __init__(self, graph: Graph, outputs: tuple[int, ...], dimension: int, inputs: int) -> None:
        self.graph, self.outputs = graph, outputs
        self.dimension, self.inputs = dimension, inputs
        self._tapes: dict[int, Tape] = {}

    def _tape(self, order: int) -> Tape:
        if order not in self._tapes:
            d, n = self.graph.derivative, self.dimension
            wanted = list(self.outputs)
            if order >= 1:
                wanted += [d(f, i) for f in self.outputs for i in range(self.inputs)]
            if order >= 2:
                wanted += [
                    d(d(f, min(i, j)), max(i, j))
                    for f in self.outputs
                    for i in range(n)
                    for j in range(self.inputs)
                ]
            if order >= 3:
                sorts = [sorted(ijk) for ijk in product(range(n), repeat=3)]
                wanted += [d(d(d(f, i), j), k) for f in self.outputs for i, j, k in sorts]
            self._tapes[order] = Tape(self.graph, wanted)
        return self._tapes[order]

    def evaluate(self, box: Box, order: int) -> tuple[Any, ...]:
        """Return enclosures up to an order, for ``m`` functions of ``n`` coordinates.

        Values ``[m]``; gradients ``[m][inputs]``; second derivatives ``[m][n][inputs]``, the
        first by a coordinate, the second by any input; third ones by coordinates ``[m][n][n][n]``.
        """
        tape = self._tape(order)
        found = tape.run(box)
        return self._shaped([found[slot] for slot in tape.outputs], order)

    def slopes(self, box: Box, order: int = 2) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Return what :meth:`evaluate` does on a box with slopes, and derivatives along these.

        The second result has enclosures of the derivatives along each component of ``delta``, in
        the same shapes with ``[delta]`` added.
        """
        tape, nothing = self._tape(order), [constant(Fraction(0))] * len(box.reach)
        values, along = tape.moving(box)
        return (
            self._shaped([values[slot] for slot in tape.outputs], order),
            self._shaped([along[slot] or nothing for slot in tape.outputs], order),
        )

    def _shaped(self, flat: list[Any], order: int) -> tuple[Any, ...]:
        m, n, k = len(self.outputs), self.dimension, self.inputs
        result: list[Any] = [flat[:m]]
        if order >= 1:
            result.append(_cut(flat[m : m + m * k], k))
        if order >= 2:
            result.append(_cut(_cut(flat[m + m * k :][: m * n * k], k), n))
        if order >= 3:
            result.append(_cut(_cut(_cut(flat[m + m * k + m * n * k :], n), n), n))
        return tuple(result)


def _cut(flat: list[Any], size: int) -> list[Any]:
    return [flat[i : i + size] for i in range(0, len(flat), size)]
