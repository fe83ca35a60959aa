"""Entry points of a kernel as LLVM functions: one point, rows of points, a batch in lanes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from llvmlite import ir

from polycorner.formulas import emit
from polycorner.formulas.adjoints import derivatives
from polycorner.formulas.programs import Polynomial, Program

LONG = 5000  # operations after which a function of machine code ends
SPARSE = 64  # results from which on structural zeros are cleared together
POINTER, VOID = ir.PointerType(emit.F64), ir.VoidType()


def emit_points(
    module: ir.Module, program: Program | Polynomial, order: int, name: str
) -> ir.Function:
    """Add ``name_point``, ``name_packed`` and ``name_rows`` to a module."""
    point = _emit_point(module, program, order, f"{name}_point")
    k, sizes = program.variables, _sizes(program, order)
    packed = ir.Function(module, ir.FunctionType(VOID, [POINTER] * 2), f"{name}_packed")
    builder = ir.IRBuilder(packed.append_basic_block())
    block, parameters = packed.args
    starts = [at_offset(builder, block, n) for n in np.cumsum([k, *sizes]).tolist()[:-1]]
    missing = [ir.Constant(POINTER, None)] * (3 - len(starts))
    builder.call(point, [block, parameters, *starts, *missing])
    builder.ret_void()
    _emit_rows(module, program, sizes, point, f"{name}_rows")
    return point


def emit_lanes(module: ir.Module, program: Program, order: int, name: str) -> None:
    """Add ``name_batch`` to a module: many points in lanes, with the same parameters."""
    point = _emit_point(module, program, order, f"{name}_single")
    point.linkage = "internal"
    _emit_batch(module, *derivatives(program, order), point, f"{name}_batch")


def _sizes(program: Program | Polynomial, order: int) -> list[int]:
    if isinstance(program, Polynomial):
        return [program.variables**level for level in range(order + 1)]
    return [len(program.outputs) * program.variables**level for level in range(order + 1)]


def _emit_point(
    module: ir.Module, program: Program | Polynomial, order: int, name: str
) -> ir.Function:
    point = ir.Function(module, ir.FunctionType(VOID, [POINTER] * 5), name)
    builder = ir.IRBuilder(point.append_basic_block())
    if isinstance(program, Polynomial):
        builder = _emit_polynomial(builder, program, order, point.args)
    else:
        _emit_whole(builder, point, *derivatives(program, order))
    builder.ret_void()
    return point


def _emit_whole(
    b: ir.IRBuilder, point: ir.Function, program: Program, levels: tuple[list[int], ...]
) -> None:
    """Emit a program for one point: at once, or in functions of a few results each if it is long.

    LLVM takes more than proportionally longer for longer functions.  What results of several share
    is computed in each.
    """
    parts = list(_parts(program, levels))
    if len(parts) == 1:
        _emit_body(b, program, levels, point.args, lanes=1)
        return
    results = point.args[2:]
    for nodes, pointer in zip(levels, results, strict=False):
        if _is_sparse(program, nodes):
            _clear(b, pointer, len(nodes))
    for k, entries in enumerate(parts):
        part = ir.Function(point.module, point.function_type, f"{point.name}_{k}")
        part.linkage = "internal"
        part.attributes.add("noinline")
        inside = ir.IRBuilder(part.append_basic_block())
        emitter = emit.Emitter(inside, program.graph, _leaves(inside, program, part.args, 1), 1)
        for level, position, node in entries:
            inside.store(emitter.value(node), at_offset(inside, part.args[2 + level], position))
        inside.ret_void()
        b.call(part, point.args)


def _parts(program: Program, levels: tuple[list[int], ...]) -> Iterator[list[tuple[int, int, int]]]:
    """Yield results in groups, as level, position and node: whole functions, until it is long."""
    zero, count = program.graph.const(0), len(program.outputs)
    sparse = [_is_sparse(program, nodes) for nodes in levels]
    group: list[tuple[int, int, int]] = []
    reached: set[int] = set()
    for f in range(count):
        if len(reached) > LONG:
            yield group
            group, reached = [], set()
        for level, nodes in enumerate(levels):
            width = len(nodes) // count
            for position in range(f * width, (f + 1) * width):
                node = nodes[position]
                if not (sparse[level] and node == zero):
                    reached.update(program.graph.needed([node], known=reached))
                    group.append((level, position, node))
    yield group


def _emit_polynomial(
    b: ir.IRBuilder, program: Polynomial, order: int, pointers: Any
) -> ir.IRBuilder:
    """Evaluate ``c + x.(b + S x / 2)`` and its derivatives ``b + S x`` and ``S`` by loops.

    ``S x`` is summed column by column, so that the inner loop runs over independent sums.
    """
    q, p, *results = pointers
    n, zero = program.variables, ir.Constant(emit.F64, 0.0)
    count = ir.Constant(emit.I64, n)
    slopes = at_offset(b, p, 1)
    curvature = at_offset(b, p, 1 + n)
    bent = b.alloca(emit.F64, count)
    total = b.alloca(emit.F64)
    b.store(b.load(p), total)
    first = ir.Constant(emit.I64, 0)

    def at(b: ir.IRBuilder, pointer: ir.Value, i: ir.Value) -> ir.Value:
        return b.gep(pointer, [i])

    def clear(b: ir.IRBuilder, i: ir.Value) -> None:
        b.store(zero, at(b, bent, i))

    def column(b: ir.IRBuilder, j: ir.Value) -> ir.IRBuilder:
        x, start = b.load(at(b, q, j)), b.mul(j, count)

        def row(b: ir.IRBuilder, i: ir.Value) -> None:
            entry = b.load(at(b, curvature, b.add(start, i)))
            b.store(b.fadd(b.load(at(b, bent, i)), b.fmul(entry, x)), at(b, bent, i))

        return loop(b, first, count, 1, row)

    def term(b: ir.IRBuilder, i: ir.Value) -> None:
        slope, change, x = (b.load(at(b, pointer, i)) for pointer in (slopes, bent, q))
        inner = b.fadd(slope, b.fmul(ir.Constant(emit.F64, 0.5), change))
        b.store(b.fadd(b.load(total), b.fmul(x, inner)), total)
        if order >= 1:
            b.store(b.fadd(slope, change), at(b, results[1], i))

    def second(b: ir.IRBuilder, i: ir.Value) -> None:
        entry = b.load(at(b, curvature, i)) if program.degree == 2 else zero
        b.store(entry, at(b, results[2], i))

    b = loop(b, first, count, 1, clear)
    if program.degree == 2:
        b = loop(b, first, count, 1, column)
    b = loop(b, first, count, 1, term)
    b.store(b.load(total), results[0])
    if order >= 2:
        b = loop(b, first, ir.Constant(emit.I64, n * n), 1, second)
    return b


def _emit_rows(
    module: ir.Module,
    program: Program | Polynomial,
    sizes: list[int],
    point: ir.Function,
    name: str,
) -> None:
    """Loop over points one by one; parameters repeat after ``period`` rows of them."""
    rows = ir.Function(module, ir.FunctionType(VOID, [emit.I64, emit.I64] + [POINTER] * 5), name)
    count, period, q, p, *results = rows.args
    strides = [*sizes, 0, 0][:3]

    def one(b: ir.IRBuilder, i: ir.Value) -> None:
        numbers = row(b, p, b.urem(i, period), program.parameters)
        places = [row(b, r, i, stride) for r, stride in zip(results, strides, strict=True)]
        b.call(point, [row(b, q, i, program.variables), numbers, *places])

    builder = ir.IRBuilder(rows.append_basic_block())
    builder = loop(builder, ir.Constant(emit.I64, 0), count, 1, one)
    builder.ret_void()


def _emit_batch(
    module: ir.Module, program: Program, levels: tuple[list[int], ...], point: Any, name: str
) -> None:
    """Loop over whole blocks of lanes, then over the points that are left."""
    strides = [program.variables, 0, *(len(level) for level in levels)]
    strides += [0] * (5 - len(strides))
    batch = ir.Function(module, ir.FunctionType(VOID, [emit.I64] + [POINTER] * 5), name)
    count, *pointers = batch.args

    def moved(b: ir.IRBuilder, i: ir.Value) -> list[ir.Value]:
        return [row(b, p, i, stride) for p, stride in zip(pointers, strides, strict=True)]

    builder = ir.IRBuilder(batch.append_basic_block("entry"))
    lanes = ir.Constant(emit.I64, emit.LANES)
    whole = builder.sub(count, builder.urem(count, lanes))

    def blocks(b: ir.IRBuilder, i: ir.Value) -> None:
        _emit_body(b, program, levels, moved(b, i), lanes=emit.LANES)

    def rest(b: ir.IRBuilder, i: ir.Value) -> None:
        b.call(point, moved(b, i))

    builder = loop(builder, ir.Constant(emit.I64, 0), whole, emit.LANES, blocks)
    builder = loop(builder, whole, count, 1, rest)
    builder.ret_void()


def loop(
    b: ir.IRBuilder,
    start: ir.Value,
    stop: ir.Value,
    step: int,
    body: Callable[[ir.IRBuilder, ir.Value], ir.IRBuilder | None],
) -> ir.IRBuilder:
    """Emit a loop; a body with loops of its own returns the builder at its end."""
    before = b.block
    head, inside, after = (b.append_basic_block(label) for label in ("head", "inside", "after"))
    b.branch(head)
    b.position_at_end(head)
    i = b.phi(emit.I64)
    i.add_incoming(start, before)
    b.cbranch(b.icmp_signed("<", i, stop), inside, after)
    end = ir.IRBuilder(inside)
    end = body(end, i) or end
    i.add_incoming(end.add(i, ir.Constant(emit.I64, step)), end.block)
    end.branch(head)
    return ir.IRBuilder(after)


def _emit_body(
    b: ir.IRBuilder,
    program: Program,
    levels: tuple[list[int], ...],
    pointers: Any,
    *,
    lanes: int,
) -> None:
    results = pointers[2:]
    emitter = emit.Emitter(b, program.graph, _leaves(b, program, pointers, lanes), lanes)
    for nodes, pointer in zip(levels, results, strict=False):
        if lanes == 1 and _is_sparse(program, nodes):
            _store_sparse(b, emitter, pointer, nodes)
            continue
        for start in range(0, len(nodes), emit.LANES):
            values = [emitter.value(node) for node in nodes[start : start + emit.LANES]]
            store(b, values, pointer, start, len(nodes), lanes)


def _leaves(
    b: ir.IRBuilder, program: Program, pointers: Any, lanes: int
) -> Callable[[str, int], ir.Value]:
    """Load variables and parameters; LLVM must assume that stores may alias later loads."""
    q, p, *_ = pointers
    variables = [gather(b, q, i, program.variables, lanes) for i in range(program.variables)]
    parameters = [gather(b, p, i, 0, lanes) for i in range(program.parameters)]
    return lambda op, position: (variables if op == "var" else parameters)[position]


def _is_sparse(program: Program, nodes: list[int]) -> bool:
    """Whether most of many results are structurally zero."""
    zero = program.graph.const(0)
    return len(nodes) >= SPARSE and 2 * sum(node != zero for node in nodes) <= len(nodes)


def _store_sparse(
    b: ir.IRBuilder, emitter: emit.Emitter, pointer: ir.Value, nodes: list[int]
) -> None:
    """Clear all results and store those that are not structurally zero."""
    zero = emitter.graph.const(0)
    _clear(b, pointer, len(nodes))
    for position, node in enumerate(nodes):
        if node != zero:
            b.store(emitter.value(node), at_offset(b, pointer, position))


def _clear(b: ir.IRBuilder, pointer: ir.Value, count: int) -> None:
    byte, flag = ir.IntType(8), ir.IntType(1)
    clear = b.module.declare_intrinsic("llvm.memset", [ir.PointerType(byte), emit.I64])
    block, size = b.bitcast(pointer, ir.PointerType(byte)), ir.Constant(emit.I64, 8 * count)
    b.call(clear, [block, ir.Constant(byte, 0), size, ir.Constant(flag, 0)])


def at_offset(b: ir.IRBuilder, pointer: ir.Value, position: int) -> ir.Value:
    """Return the address of a number after the one at an address."""
    return b.gep(pointer, [ir.Constant(emit.I64, position)])


def row(b: ir.IRBuilder, pointer: ir.Value, i: ir.Value, stride: int) -> ir.Value:
    """Return the address of row ``i`` of ``stride`` numbers each; all share it for none."""
    return b.gep(pointer, [b.mul(i, ir.Constant(emit.I64, stride))]) if stride else pointer


def gather(b: ir.IRBuilder, pointer: ir.Value, position: int, stride: int, lanes: int) -> ir.Value:
    """Load a number at ``position`` for every lane; they lie ``stride`` numbers apart."""
    if lanes == 1:
        return b.load(at_offset(b, pointer, position))
    result = ir.Constant(emit.lane_type(lanes), ir.Undefined)
    shared = None if stride else b.load(at_offset(b, pointer, position))
    for lane in range(lanes):
        value = shared or b.load(at_offset(b, pointer, position + lane * stride))
        result = b.insert_element(result, value, ir.Constant(emit.I64, lane))
    return result


def store(
    b: ir.IRBuilder, values: list[ir.Value], pointer: ir.Value, start: int, stride: int, lanes: int
) -> None:
    """Store consecutive results: lane ``l`` of value ``j`` goes to ``start + j + l * stride``."""
    if lanes > 1 and len(values) == lanes:
        for lane, row in enumerate(transpose(b, values)):
            target = at_offset(b, pointer, start + lane * stride)
            vector = b.bitcast(target, ir.PointerType(emit.lane_type(lanes)))
            b.store(row, vector, align=8)
        return
    for j, value in enumerate(values):
        for lane in range(lanes):
            number = value if lanes == 1 else b.extract_element(value, ir.Constant(emit.I64, lane))
            b.store(number, at_offset(b, pointer, start + j + lane * stride))


def transpose(b: ir.IRBuilder, rows: list[ir.Value]) -> list[ir.Value]:
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
