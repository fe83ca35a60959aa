"""Compiled enclosures: a program in interval arithmetic as machine code, cached on disk."""

import ctypes
import hashlib
import logging
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from polycorner.formulas import (
    adjoints,
    batches,
    emit,
    interval_emit,
    interval_forms,
    interval_library,
    operations,
    programs,
    ranges,
    rounding,
    translate,
)
from polycorner.formulas.batches import POINTER, VOID, at_offset, gather, loop, transpose
from polycorner.formulas.cache import read_code, source_key, write_code
from polycorner.formulas.interval_emit import IntervalEmitter
from polycorner.formulas.interval_forms import Sharper
from polycorner.formulas.interval_library import Sides
from polycorner.formulas.machine_code import load_code, machine_code, machine_key
from polycorner.formulas.programs import Graph
from polycorner.formulas.rounding import ROUNDINGS, Stepped
from polycorner.spaces.manifold import Array

LOG = logging.getLogger("polycorner.compilation")
LANES = emit.LANES

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
        self.inputs, self.sizes, self.continuity = (
            inputs,
            [len(level) for level in levels],
            continuity,
        )
        self.kind = kind or best_rounding()
        self.form = form
        used, kept = compact(graph, levels)
        name = _symbol((used.nodes, inputs, kept, continuity, form, self.kind))
        code = read_code(name)
        self.origin = "compiled" if code is None else "loaded"
        if code is None:
            LOG.debug("compiling enclosures of %d results", sum(self.sizes))
            # Each node is emitted once and simplified before, so that LLVM's passes find nothing.
            code = machine_code(str(self._module(used, kept, name)), optimise=False)
            write_code(name, code)
        self._engine, (address,) = load_code(code, [name])
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
            places = [
                b.gep(pointer, [b.mul(i, ir.Constant(emit.I64, stride))])
                for pointer, stride in zip(pointers, strides, strict=True)
            ]
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
                    _store(b, list(column), target, start, len(level))

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
        rounding.greatest(r.b, x[0], r.splat(-np.inf)),
        rounding.least(r.b, x[1], r.splat(np.inf)),
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


def _store(
    b: ir.IRBuilder, values: list[ir.Value], pointer: ir.Value, start: int, stride: int
) -> None:
    """Store consecutive results: lane ``l`` of value ``j`` goes to ``start + j + l * stride``."""
    if len(values) == LANES:
        vector = ir.PointerType(emit.lane_type(LANES))
        for lane, row in enumerate(transpose(b, values)):
            target = at_offset(b, pointer, start + lane * stride)
            b.store(row, b.bitcast(target, vector), align=8)
        return
    for j, value in enumerate(values):
        for lane in range(LANES):
            part = b.extract_element(value, ir.Constant(emit.I64, lane))
            b.store(part, at_offset(b, pointer, start + j + lane * stride))


def compact(graph: Graph, levels: Sequence[Level]) -> tuple[Graph, list[list[int | None]]]:
    """Return a graph of what the results need, in order, and the results in it."""
    needed: set[int] = set()
    waiting = [a for level in levels for a in level if a is not None]
    while waiting:
        a = waiting.pop()
        if a not in needed:
            needed.add(a)
            waiting += ranges.arguments(graph, a)
    result = Graph()
    placed: dict[int, int] = {}
    for a in sorted(needed):
        op, args = graph.nodes[a]
        leaf = op in {"const", "var", "par"}
        placed[a] = result.node(op, *(args if leaf else [placed[int(c)] for c in args]))
    return result, [[None if a is None else placed[a] for a in level] for level in levels]


@lru_cache(maxsize=1)
def best_rounding() -> str:
    """Return the rounding for this processor: ``"embedded"`` where it has AVX-512."""
    return "embedded" if llvm.get_host_cpu_features().get("avx512f") else "stepped"


@lru_cache(maxsize=1)
def _generator_key() -> str:
    rooms = (operations, programs, translate, adjoints, emit, batches)
    ours = (ranges, rounding, interval_library, interval_emit, interval_forms)
    return repr((source_key(*(m.__name__ for m in (*rooms, *ours)), __name__), machine_key()))


def _symbol(content: Any) -> str:
    digest = hashlib.sha256(repr((content, _generator_key())).encode()).hexdigest()
    return f"polycorner_boxes_{digest[:32]}"
