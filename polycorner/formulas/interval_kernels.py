"""Compiled enclosures: a program in interval arithmetic as machine code, cached on disk."""

import ctypes
import hashlib
import logging
from collections.abc import Sequence
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
    interval_library,
    programs,
    ranges,
    rounding,
    translate,
)
from polycorner.formulas.batches import POINTER, VOID, at_offset, gather, loop, transpose
from polycorner.formulas.cache import read_code, source_key, write_code
from polycorner.formulas.interval_emit import IntervalEmitter
from polycorner.formulas.interval_library import Sides
from polycorner.formulas.machine_code import load_code, machine_code, machine_key
from polycorner.formulas.programs import Graph
from polycorner.formulas.rounding import ROUNDINGS
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
        kind: str = "",
    ) -> None:
        self.inputs, self.sizes, self.continuity = (
            inputs,
            [len(level) for level in levels],
            continuity,
        )
        self.kind = kind or best_rounding()
        used, kept = compact(graph, levels)
        name = _symbol((used.nodes, inputs, kept, continuity, self.kind))
        code = read_code(name)
        self.origin = "compiled" if code is None else "loaded"
        if code is None:
            LOG.debug("compiling enclosures of %d results", sum(self.sizes))
            code = machine_code(str(self._module(used, kept, name)))
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
        for level in levels:
            targets = [next(places) for _ in range(1 if self.continuity else 2)]
            for start, nodes in _windows(level):
                if self.continuity:
                    columns = [[_flag(emitter, node) for node in nodes]]
                else:
                    columns = [list(side) for side in zip(*(_bounds(emitter, a) for a in nodes))]
                for values, target in zip(columns, targets, strict=True):
                    _store(b, values, target, start, len(level))

    def fill(self, lo: Array, hi: Array, results: Sequence[Array]) -> None:
        """Evaluate on boxes ``(B, n)``; results are C-contiguous and zero where nothing is stored."""
        whole = len(lo) - len(lo) % LANES
        if whole:
            self._run(whole, lo, hi, results)
        if whole < len(lo):
            rest = len(lo) - whole
            last = [np.repeat(side[-1:], LANES, axis=0) for side in (lo, hi)]
            for side, given in zip(last, (lo, hi), strict=True):
                side[:rest] = given[whole:]
            spare = [np.zeros((LANES, *result.shape[1:])) for result in results]
            self._run(LANES, *last, spare)
            for result, part in zip(results, spare, strict=True):
                result[whole:] = part[:rest]

    def _run(self, count: int, lo: Array, hi: Array, results: Sequence[Array]) -> None:
        self._call(count, *(array.ctypes.data for array in (lo, hi, *results)))


def _bounds(emitter: IntervalEmitter, node: int | None) -> Sides:
    """Return the bounds of a node, infinite where it was given up."""
    r = emitter.r
    if node is None:
        return r.splat(0.0), r.splat(0.0)
    low, high = emitter.value(node)
    return (
        rounding.greatest(r.b, low, r.splat(-np.inf)),
        rounding.least(r.b, high, r.splat(np.inf)),
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


def _windows(level: Level) -> list[tuple[int, list[int | None]]]:
    """Cut results into runs of at most ``LANES``, of which the first one is not zero."""
    windows, start = [], 0
    while start < len(level):
        if level[start] is None:
            start += 1
            continue
        windows.append((start, list(level[start : start + LANES])))
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
    result, placed = Graph(), {}
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
    rooms = (programs, translate, adjoints, emit, batches)
    ours = (ranges, rounding, interval_library, interval_emit)
    return repr((source_key(*(m.__name__ for m in (*rooms, *ours)), __name__), machine_key()))


def _symbol(content: Any) -> str:
    digest = hashlib.sha256(repr((content, _generator_key())).encode()).hexdigest()
    return f"polycorner_boxes_{digest[:32]}"
