"""Compiled enclosures: a program in interval arithmetic as machine code, cached on disk."""

import ctypes
import logging
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from polycorner.formulas import (
    adjoints,
    batches,
    emit,
    interval_emit,
    interval_library,
    operations,
    programs,
    ranges,
    rounding,
    translate,
)
from polycorner.formulas.batches import POINTER, VOID, gather, loop, row, store
from polycorner.formulas.interval_emit import IntervalEmitter
from polycorner.formulas.interval_library import Sides
from polycorner.formulas.machine_code import code_name, emitted_code, kept_code
from polycorner.formulas.programs import LEAVES, Graph
from polycorner.formulas.ranges import Fact
from polycorner.formulas.rounding import ROUNDINGS, Stepped, greatest, least
from polycorner.spaces.manifold import Array

LOG = logging.getLogger("polycorner.compilation")
LANES = emit.LANES
ROOMS = (operations, programs, translate, adjoints, emit, batches)
OURS = (ranges, rounding, interval_library, interval_emit)
GENERATORS = (*(room.__name__ for room in (*ROOMS, *OURS)), __name__)

FORMS = ("natural", "mean value", "monotone")
NOTHING = Fact(nonnegative=False, nonpositive=False, size=0.0)

# Nodes of results, entry by entry; None for a structural zero.
Level = Sequence[int | None]


class IntervalKernel:
    """Enclosures of nodes of a graph on boxes, as machine code.

    Parameters
    ----------
    graph : Graph
        Its leaves are constants and ``inputs`` variables.
    inputs : int
        ``n``.
    levels : sequence of sequence of node or None
        The results, array by array; None where a result is zero.
    form : str, optional
        One of ``FORMS``: how values, the first array, are enclosed; others than the natural one
        need their first derivatives, the second array.
    continuity : bool, optional
        Whether the results are not bounds but flags: is each node continuous on the box?
    kind : str, optional
        How bounds are rounded, a key of ``ROUNDINGS``; default the best for this processor.
    """

    def __init__(
        self,
        graph: Graph,
        inputs: int,
        levels: Sequence[Level],
        *,
        continuity: bool = False,
        form: str = "natural",
        kind: str = "",
    ) -> None:
        self.inputs, self.sizes = inputs, [len(level) for level in levels]
        self.continuity, self.form, self.kind = continuity, form, kind or best_rounding()
        used, kept = compact(graph, levels)
        content = (used.nodes, inputs, kept, continuity, form, self.kind)
        name = code_name("polycorner_boxes", content, *GENERATORS)

        def make() -> bytes:
            LOG.debug("compiling enclosures of %d results", sum(self.sizes))
            # Each node is emitted once and simplified before, so that LLVM's passes find nothing.
            return emitted_code(str(self._module(used, kept, name)))

        self._engine, (address,), self.origin = kept_code(name, [name], make)
        pointers = [ctypes.c_void_p] * (2 + len(self._widths()))
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_int64, *pointers)(address)

    def _widths(self) -> list[int]:
        """Return the numbers that each array of results has for a box."""
        return [size for size in self.sizes for _ in range(1 if self.continuity else 2)]

    def _module(self, graph: Graph, levels: Sequence[Level], name: str) -> ir.Module:
        module, widths = ir.Module(name=name), self._widths()
        kind = ir.FunctionType(VOID, [emit.I64] + [POINTER] * (2 + len(widths)))
        function = ir.Function(module, kind, name)
        for argument in function.args[1:]:
            argument.add_attribute("noalias")
        count, *pointers = function.args
        strides = [self.inputs, self.inputs, *widths]

        def block(b: ir.IRBuilder, i: ir.Value) -> None:
            places = [row(b, p, i, stride) for p, stride in zip(pointers, strides, strict=True)]
            self._body(b, graph, levels, places)

        start = ir.IRBuilder(function.append_basic_block("entry"))
        loop(start, ir.Constant(emit.I64, 0), count, LANES, block).ret_void()
        return module

    def _body(
        self, b: ir.IRBuilder, graph: Graph, levels: Sequence[Level], pointers: list[ir.Value]
    ) -> None:
        r = ROUNDINGS[self.kind](b, LANES)
        n = self.inputs
        read = {int(args[0]) for op, args in graph.nodes if op == "var"}
        boxes: dict[int, Sides] = {
            i: (gather(b, pointers[0], i, n, LANES), gather(b, pointers[1], i, n, LANES))
            for i in sorted(read)
        }
        emitter = IntervalEmitter(r, graph, boxes)
        places = iter(pointers[2:])
        for depth, level in enumerate(levels):
            targets = [next(places) for _ in range(1 if self.continuity else 2)]
            result = self._results(emitter, levels, depth)
            for start, size in _windows(level):
                found = [result(j) for j in range(start, start + size)]
                for column, target in zip(zip(*found, strict=True), targets, strict=True):
                    store(b, list(column), target, start, len(level), LANES)

    def _results(
        self, emitter: IntervalEmitter, levels: Sequence[Level], depth: int
    ) -> Callable[[int], tuple[ir.Value, ...]]:
        """Return what emits result number ``j`` of an array: a flag, or both bounds."""
        level = levels[depth]
        if self.continuity:
            return lambda j: (_flag(emitter, level[j]),)
        if depth or self.form == "natural":
            return lambda j: _bounds(emitter, level[j])
        sharper = Sharper(emitter, [a for a in level if a is not None], levels[1])
        sharpened = sharper.mean_value if self.form == "mean value" else sharper.monotone
        return lambda j: _infinite(emitter.r, sharpened(j))

    def fill(self, lo: Array, hi: Array, results: Sequence[Array]) -> None:
        """Evaluate on boxes ``(B, n)``; results are C-contiguous, and zero before."""
        whole = len(lo) - len(lo) % LANES
        if whole:
            self._run(whole, lo, hi, results)
        if whole < len(lo):
            rest = len(lo) - whole
            last = [np.repeat(side[-1:], LANES, axis=0) for side in (lo, hi)]
            for side, given in zip(last, (lo, hi), strict=True):
                side[:rest] = given[whole:]
            spare = [np.zeros((LANES, *result.shape[1:])) for result in results]
            self._run(LANES, last[0], last[1], spare)
            for result, part in zip(results, spare, strict=True):
                result[whole:] = part[:rest]

    def _run(self, count: int, lo: Array, hi: Array, results: Sequence[Array]) -> None:
        self._call(count, *(array.ctypes.data for array in (lo, hi, *results)))


def _bounds(emitter: IntervalEmitter, node: int | None) -> Sides:
    """Return the bounds of a node; zero for none."""
    zero = emitter.r.splat(0.0)
    return (zero, zero) if node is None else _infinite(emitter.r, emitter.value(node))


def _infinite(r: Stepped, x: Sides) -> Sides:
    """Replace the bounds of intervals that were given up by infinities."""
    return (
        greatest(r.b, x[0], r.splat(-np.inf)),
        least(r.b, x[1], r.splat(np.inf)),
    )


def _flag(emitter: IntervalEmitter, node: int | None) -> ir.Value:
    """Return one where a node is bounded and continuous, zero elsewhere."""
    r = emitter.r
    if node is None:
        return r.splat(1.0)
    low, high = emitter.value(node)
    fine = r.b.fcmp_ordered("ord", low, high)
    part = emitter.continuous(node)
    fine = fine if part is None else r.b.and_(fine, part)
    return r.b.select(fine, r.splat(1.0), r.splat(0.0))


def _windows(level: Level) -> list[tuple[int, int]]:
    """Cut results into runs of at most ``LANES``, whose first ones are not zero: start and size."""
    windows, start = [], 0
    while start < len(level):
        if level[start] is None:
            start += 1
            continue
        windows.append((start, min(LANES, len(level) - start)))
        start += LANES
    return windows


def compact(graph: Graph, levels: Sequence[Level]) -> tuple[Graph, list[list[int | None]]]:
    """Return a graph of what the results need, in order, and the results in it."""
    result = Graph()
    placed: dict[int, int] = {}
    for a in graph.needed(a for level in levels for a in level if a is not None):
        op, args = graph.nodes[a]
        placed[a] = result.node(op, *(args if op in LEAVES else [placed[int(c)] for c in args]))
    return result, [[None if a is None else placed[a] for a in level] for level in levels]


class Sharper:
    """Bounds of values in one of ``FORMS``, by an emitter that has the natural ones.

    Both other forms need ``f`` to be continuous on the box and the enclosure ``[g]`` to contain its
    generalised gradient there; elsewhere the bounds stay as they are.

    *Mean value form*: ``f(q)`` lies in ``f(c) + [g].([q] - c)`` for every ``c`` in the box
    ([Neumaier] sec. 2.3); its excess width falls with the square of the width of the box.

    *Monotone form*: where ``[g_i]`` has one sign, the least value is taken at one end of side ``i``
    and the greatest at the other, so that both are enclosed on faces of the box.

    ``values`` are the nodes of the functions, ``slopes`` those of their partial derivatives row by
    row, None where one is zero.
    """

    def __init__(
        self, emitter: IntervalEmitter, values: Sequence[int], slopes: Sequence[int | None]
    ) -> None:
        self.emitter, self.r, self.b = emitter, emitter.r, emitter.b
        self.values, count = values, len(slopes) // max(len(values), 1)
        self.rows = [slopes[j * count : (j + 1) * count] for j in range(len(values))]
        self._offsets: dict[int, Sides] = {}
        self._middle: IntervalEmitter | None = None

    def mean_value(self, j: int) -> Sides:
        """Return bounds of function ``j``, in the mean value form where that is better."""
        if self._middle is None:
            points = {i: (c, c) for i, c in self._centre().items()}
            self._middle = IntervalEmitter(self.r, self.emitter.graph, points)
        low, high = self._middle.value(self.values[j])
        for i, slope in self._row(j).items():
            part = self.emitter.product(NOTHING, slope, NOTHING, self._offsets[i])
            low, high = self.r.sides("add", (low, part[0]), (high, part[1]))
        return self._intersected(j, (low, high))

    def monotone(self, j: int) -> Sides:
        """Return bounds of function ``j`` on the faces where it is least and greatest."""
        zero = self.r.splat(0.0)
        lowest, highest = dict(self.emitter.boxes), dict(self.emitter.boxes)
        for i, slope in self._row(j).items():
            low, high = self.emitter.boxes[i]
            rising = self.b.fcmp_ordered(">=", slope[0], zero)
            constant_or_falling = self.b.fcmp_ordered("<=", slope[1], zero)
            falling = self.b.and_(constant_or_falling, self.b.not_(rising))
            lowest[i] = self.b.select(falling, high, low), self.b.select(rising, low, high)
            highest[i] = self.b.select(rising, high, low), self.b.select(falling, low, high)
        low, _ = IntervalEmitter(self.r, self.emitter.graph, lowest).value(self.values[j])
        _, high = IntervalEmitter(self.r, self.emitter.graph, highest).value(self.values[j])
        return self._intersected(j, (low, high))

    def _row(self, j: int) -> dict[int, Sides]:
        """Return the enclosures of the partial derivatives that are not zero."""
        return {i: self.emitter.value(a) for i, a in enumerate(self.rows[j]) if a is not None}

    def _centre(self) -> dict[int, ir.Value]:
        """Return a point of the box; record the box as seen from it."""
        centre = {}
        for i, (low, high) in self.emitter.boxes.items():
            half = self.r.splat(0.5)
            near = self.b.fadd(self.b.fmul(half, low), self.b.fmul(half, high))
            c = centre[i] = greatest(self.b, least(self.b, near, high), low)
            self._offsets[i] = self.r.sides("sub", (low, c), (high, c))
        return centre

    def _intersected(self, j: int, form: Sides) -> Sides:
        """Keep what is better of natural bounds and others, where those are valid."""
        node, b = self.values[j], self.b
        low, high = self.emitter.value(node)
        better = greatest(b, form[0], low), least(b, form[1], high)
        fine = self.emitter.continuous(node)
        if fine is None:
            return better
        return b.select(fine, better[0], low), b.select(fine, better[1], high)


@lru_cache(maxsize=1)
def best_rounding() -> str:
    """Return the rounding for this processor: ``"embedded"`` where it has AVX-512."""
    return "embedded" if llvm.get_host_cpu_features().get("avx512f") else "stepped"
