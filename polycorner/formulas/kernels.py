"""Compiled kernels: a straight-line program as machine code, cached on disk.

Machine code is made through llvmlite, the code generator that Numba uses, so it can be called by
address from Numba as well as from Python.  Batches run in explicit vectors of ``emit.LANES`` lanes.
"""

import ctypes
import ctypes.util
import hashlib
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import llvmlite
import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from polycorner.formulas import emit, programs, translate
from polycorner.formulas.programs import Program
from polycorner.spaces.manifold import Array

POINTER, VOID = ir.PointerType(emit.F64), ir.VoidType()
OPTIMISATION = 2


class Kernel:
    """Values, gradients and Hessians of ``m`` functions of ``k`` variables, as machine code.

    Parameters
    ----------
    key : str
        Identifies the program: equal keys must mean equal programs.
    program : callable
        Makes the program; called only when the machine code is not on disk yet.
    variables, parameters, outputs : int
        ``k``, the number of parameters, and ``m``.
    """

    def __init__(
        self,
        key: str,
        program: Callable[[], Program],
        *,
        variables: int,
        parameters: int,
        outputs: int,
    ) -> None:
        self.key, self._program = key, program
        self.variables, self.parameters, self.outputs = variables, parameters, outputs
        self._compiled: dict[int, CompiledKernel] = {}

    @cached_property
    def program(self) -> Program:
        """The straight-line program."""
        return self._program()

    def compiled(self, order: int) -> "CompiledKernel":
        """Return the machine code for derivatives up to ``order`` (0, 1 or 2)."""
        if order not in self._compiled:
            self._compiled[order] = CompiledKernel(self, order)
        return self._compiled[order]

    def at(self, q: Array, parameters: int, order: int) -> tuple[Array, ...]:
        """Return values ``(m,)``, gradients ``(m, k)`` and Hessians ``(m, k, k)`` at one point.

        ``parameters`` is the address of the parameters (:func:`address`); nothing is checked.
        """
        return self.compiled(order).at(q, parameters)

    def over(self, q: Array, parameters: int, order: int) -> tuple[Array, ...]:
        """Return values, gradients and Hessians at every row of ``q`` ``(N, k)``."""
        return self.compiled(order).over(q, parameters)


class CompiledKernel:
    """Machine code of one kernel up to one order of derivatives.

    Attributes
    ----------
    point : int
        Address of ``void point(q*, p*, f*, J*, H*)``, row-major, for callers in machine code.
    origin : str
        ``"compiled"`` or ``"loaded"`` from the disk cache.
    """

    def __init__(self, kernel: Kernel, order: int) -> None:
        name = _symbol(kernel.key, order)
        path = cache_directory() / f"{name}.o"
        code = _read(path)
        self.origin = "compiled" if code is None else "loaded"
        if code is None:
            code = _machine_code(kernel.program, order, name)
            _write(path, code)
        self._engine, addresses = _load(code, name)
        self.point, packed, batch = addresses
        pointer = ctypes.c_void_p
        self._packed = ctypes.PYFUNCTYPE(None, pointer, pointer)(packed)
        self._batch = ctypes.CFUNCTYPE(None, ctypes.c_int64, *[pointer] * 5)(batch)
        k, m = kernel.variables, kernel.outputs
        self._shapes = ((m,), (m, k), (m, k, k))[: order + 1]
        ends = np.cumsum([k, *(int(np.prod(shape)) for shape in self._shapes)]).tolist()
        self._k, self._size = k, ends[-1]
        self._views = [
            (slice(a, b), shape) for a, b, shape in zip(ends, ends[1:], self._shapes, strict=False)
        ]

    def at(self, q: Array, parameters: int) -> tuple[Array, ...]:
        """Evaluate at one point; see :meth:`Kernel.at`."""
        block = np.empty(self._size)
        block[: self._k] = q
        self._packed(address(block), parameters)
        return tuple([block[part].reshape(shape) for part, shape in self._views])

    def over(self, q: Array, parameters: int) -> tuple[Array, ...]:
        """Evaluate at every row; see :meth:`Kernel.over`."""
        outputs = tuple([np.empty((len(q), *shape)) for shape in self._shapes])
        self.fill(np.ascontiguousarray(q), parameters, outputs)
        return outputs

    def fill(self, q: Array, parameters: int, outputs: tuple[Array, ...]) -> None:
        """Evaluate at every row of ``q``; all arrays C-contiguous, ``q`` of shape ``(N, k)``."""
        addresses = [*(output.ctypes.data for output in outputs), None, None]
        self._batch(len(q), q.ctypes.data, parameters, *addresses[:3])


def address(array: Array) -> int:
    """Return the address of a writable, not empty array, faster than ``array.ctypes.data``."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))


def cache_directory() -> Path:
    """Return the folder of compiled kernels: ``POLYCORNER_CACHE_DIR`` or the user's cache."""
    override = os.environ.get("POLYCORNER_CACHE_DIR")
    if override:
        return Path(override)
    import platformdirs

    return Path(platformdirs.user_cache_dir("polycorner")) / "kernels"


@contextmanager
def one_at_a_time(name: str) -> Iterator[None]:
    """Let one process at a time do what ends in a cache, so that the others find it there.

    Where locks cannot be kept, all go ahead.
    """
    from filelock import FileLock

    path = cache_directory() / f"{name}.lock"
    with ExitStack() as held:
        with suppress(OSError, NotImplementedError):
            path.parent.mkdir(parents=True, exist_ok=True)
            held.enter_context(FileLock(path))
        yield


def source_key(*modules: str) -> str:
    """Return a hash of the source text of loaded modules: the key of what they define."""
    digest = hashlib.sha256()
    for name in modules:
        digest.update(Path(str(sys.modules[name].__file__)).read_bytes())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _prepare() -> None:
    """Set up code generation for this machine, and say where the C mathematics library is."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    library = ctypes.CDLL(ctypes.util.find_library("m") if os.name == "posix" else "msvcrt")
    for name in (*emit.LIBM_UNARY, *emit.LIBM_BINARY):
        function = ctypes.cast(getattr(library, name), ctypes.c_void_p)
        llvm.add_symbol(name, function.value)


def _target_machine() -> Any:
    """Return a new target machine; an execution engine takes over the one it is made with."""
    _prepare()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=OPTIMISATION,
        reloc="pic",
        codemodel="jitdefault",
        jit=True,
    )


@lru_cache(maxsize=1)
def _generator_key() -> str:
    machine = (llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    code = source_key(programs.__name__, translate.__name__, emit.__name__, __name__)
    return repr((code, llvmlite.__version__, machine))


def _symbol(key: str, order: int) -> str:
    digest = hashlib.sha256(repr((key, order, _generator_key())).encode()).hexdigest()
    return f"polycorner_{digest[:32]}_{order}"


def _read(path: Path) -> bytes | None:
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, code = content[:32], content[32:]
    return code if hashlib.sha256(code).digest() == digest else None


def _write(path: Path, code: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(hashlib.sha256(code).digest() + code)
        Path(file.name).replace(path)
    except OSError as error:
        warnings.warn(
            f"compiled kernels cannot be kept in {path.parent} ({error}); set POLYCORNER_CACHE_DIR "
            "to a folder that can be written",
            RuntimeWarning,
            stacklevel=2,
        )


def _load(code: bytes, name: str) -> tuple[Any, list[int]]:
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    entries = (f"{name}_point", f"{name}_packed", f"{name}_batch")
    return engine, [engine.get_function_address(entry) for entry in entries]


def _machine_code(program: Program, order: int, name: str) -> bytes:
    module = ir.Module(name=name)
    module.triple = llvm.get_default_triple()
    _emit_functions(module, program, order, name)
    parsed = llvm.parse_assembly(str(module))
    parsed.verify()
    target = _target_machine()
    options = llvm.create_pipeline_tuning_options(speed_level=OPTIMISATION)
    builder = llvm.create_pass_builder(target, options)
    builder.getModulePassManager().run(parsed, builder)
    code: bytes = target.emit_object(parsed)
    return code


def _emit_functions(module: ir.Module, program: Program, order: int, name: str) -> None:
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

    # All leaves first: nothing that is stored may seem to change what is still to be read.
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
