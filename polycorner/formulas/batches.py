"""Entry points of a kernel as LLVM functions: one point, one packed block, a batch in lanes."""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir

from polycorner.formulas import emit
from polycorner.formulas.programs import Program

POINTER, VOID = ir.PointerType(emit.F64), ir.VoidType()


def emit_functions(module: ir.Module, program: Program, order: int, name: str) -> None:
    """Add ``name_point``, ``name_packed`` and ``name_batch`` to a module."""
    k, levels = program.variables, program.derivatives(order)
    sizes = [len(level) for level in levels]
    point = ir.Function(module, ir.FunctionType(VOID, [POINTER] * 5), f"{name}_point")
    builder = ir.IRBuilder(point.append_basic_block())
    _emit_body(builder, program, levels, point.args, lanes=1)
    builder.ret_void()

    packed = ir.Function(module, ir.FunctionType(VOID, [POINTER] * 2), f"{name}_packed")
    builder = ir.IRBuilder(packed.append_basic_block())
    block, parameters = packed.args
    starts = [_offset(builder, block, n) for n in np.cumsum([k, *sizes]).tolist()[:-1]]
    missing = [ir.Constant(POINTER, None)] * (3 - len(starts))
    builder.call(point, [block, parameters, *starts, *missing])
    builder.ret_void()

    _emit_batch(module, program, levels, point, f"{name}_batch")


def _emit_batch(
    module: ir.Module, program: Program, levels: tuple[list[int], ...], point: Any, name: str
) -> None:
    """Loop over whole blocks of lanes, then over the points that are left."""
    strides = [program.variables, 0, *(len(level) for level in levels)]
    strides += [0] * (5 - len(strides))
    batch = ir.Function(module, ir.FunctionType(VOID, [emit.I64] + [POINTER] * 5), name)
    count, *pointers = batch.args

    def moved(b: ir.IRBuilder, i: ir.Value) -> list[ir.Value]:
        return [
            b.gep(p, [b.mul(i, ir.Constant(emit.I64, s))]) if s else p
            for p, s in zip(pointers, strides, strict=True)
        ]

    builder = ir.IRBuilder(batch.append_basic_block("entry"))
    lanes = ir.Constant(emit.I64, emit.LANES)
    whole = builder.sub(count, builder.urem(count, lanes))

    def blocks(b: ir.IRBuilder, i: ir.Value) -> None:
        _emit_body(b, program, levels, moved(b, i), lanes=emit.LANES)

    def rest(b: ir.IRBuilder, i: ir.Value) -> None:
        b.call(point, moved(b, i))

    builder = _loop(builder, ir.Constant(emit.I64, 0), whole, emit.LANES, blocks)
    builder = _loop(builder, whole, count, 1, rest)
    builder.ret_void()


def _loop(
    b: ir.IRBuilder,
    start: ir.Value,
    stop: ir.Value,
    step: int,
    body: Callable[[ir.IRBuilder, ir.Value], None],
) -> ir.IRBuilder:
    before = b.block
    head, inside, after = (b.append_basic_block(label) for label in ("head", "inside", "after"))
    b.branch(head)
    b.position_at_end(head)
    i = b.phi(emit.I64)
    i.add_incoming(start, before)
    b.cbranch(b.icmp_signed("<", i, stop), inside, after)
    b.position_at_end(inside)
    body(b, i)
    i.add_incoming(b.add(i, ir.Constant(emit.I64, step)), b.block)
    b.branch(head)
    b.position_at_end(after)
    return b


def _emit_body(
    b: ir.IRBuilder,
    program: Program,
    levels: tuple[list[int], ...],
    pointers: Any,
    *,
    lanes: int,
) -> None:
    q, p, *results = pointers
    leaves: dict[tuple[str, int], ir.Value] = {}

    def leaf(op: str, position: int) -> ir.Value:
        if (op, position) not in leaves:
            stride = program.variables if op == "var" else 0
            leaves[op, position] = _gather(b, q if op == "var" else p, position, stride, lanes)
        return leaves[op, position]

    # All leaves are loaded first, since LLVM must assume that stores may alias later loads.
    for i in range(program.variables):
        leaf("var", i)
    for i in range(program.parameters):
        leaf("par", i)
    emitter = emit.Emitter(b, program.graph, leaf, lanes)
    for nodes, pointer in zip(levels, results, strict=False):
        for start in range(0, len(nodes), emit.LANES):
            values = [emitter.value(node) for node in nodes[start : start + emit.LANES]]
            _store(b, values, pointer, start, len(nodes), lanes)


def _offset(b: ir.IRBuilder, pointer: ir.Value, position: int) -> ir.Value:
    return b.gep(pointer, [ir.Constant(emit.I64, position)])


def _gather(b: ir.IRBuilder, pointer: ir.Value, position: int, stride: int, lanes: int) -> ir.Value:
    if lanes == 1:
        return b.load(_offset(b, pointer, position))
    result = ir.Constant(emit.lane_type(lanes), ir.Undefined)
    shared = None if stride else b.load(_offset(b, pointer, position))
    for lane in range(lanes):
        value = shared or b.load(_offset(b, pointer, position + lane * stride))
        result = b.insert_element(result, value, ir.Constant(emit.I64, lane))
    return result


def _store(
    b: ir.IRBuilder, values: list[ir.Value], pointer: ir.Value, start: int, stride: int, lanes: int
) -> None:
    """Store consecutive results: lane ``l`` of value ``j`` goes to ``start + j + l * stride``."""
    if lanes > 1 and len(values) == lanes:
        for lane, row in enumerate(_transpose(b, values)):
            target = _offset(b, pointer, start + lane * stride)
            vector = b.bitcast(target, ir.PointerType(emit.lane_type(lanes)))
            b.store(row, vector, align=8)
        return
    for j, value in enumerate(values):
        for lane in range(lanes):
            number = value if lanes == 1 else b.extract_element(value, ir.Constant(emit.I64, lane))
            b.store(number, _offset(b, pointer, start + j + lane * stride))


def _transpose(b: ir.IRBuilder, rows: list[ir.Value]) -> list[ir.Value]:
    """Transpose a square of lanes by exchanging blocks of half the size, then halving again."""
    lanes = len(rows)
    half = lanes // 2
    while half:
        keep = [i if not i & half else i - half + lanes for i in range(lanes)]
        other = [i + half if not i & half else i + lanes for i in range(lanes)]
        masks = [ir.Constant(ir.VectorType(ir.IntType(32), lanes), m) for m in (keep, other)]
        rows = [
            b.shuffle_vector(rows[i & ~half], rows[i | half], masks[bool(i & half)])
            for i in range(lanes)
        ]
        half //= 2
    return rows
