"""Machine code for this processor, from LLVM's intermediate code."""

import ctypes
import ctypes.util
import hashlib
import os
import platform
from collections.abc import Callable
from functools import lru_cache
from importlib.metadata import version
from typing import Any

import llvmlite
from llvmlite import binding as llvm
from llvmlite.binding.ffi import ObjectRef

from polycorner import __version__
from polycorner.formulas import emit
from polycorner.formulas.cache import read_code, source_key, write_code
from polycorner.formulas.operations import OPERATIONS

OPTIMISATION = 2
# A pass that takes a sixth of the time that code of algorithms takes, or more, and makes it no
# faster as far as can be measured: their loops go over many arrays, bounded by what is in memory.
LEFT_OUT = "disable-lsr"


def machine_key() -> str:
    """Return what machine code depends on, beside the code that it is made from."""
    machine = (llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    versions = (__version__, platform.python_version(), version("numba"), llvmlite.__version__)
    return repr((source_key(__name__), versions, machine))


def machine_code(text: str) -> bytes:
    """Return the machine code of intermediate code, optimised, as an object file.

    Raises
    ------
    RuntimeError
        If this version of LLVM does not understand the text.
    """
    target = _target_machine()
    parsed = _parsed(text, target)
    options = llvm.create_pipeline_tuning_options(speed_level=OPTIMISATION)
    options.loop_vectorization = True
    _run_passes(parsed, target, options)
    code: bytes = target.emit_object(parsed)
    return code


def emitted_code(text: str, *, quick: bool = False) -> bytes:
    """Return the machine code of intermediate code that is optimised already, as an object file.

    It is that of :func:`portable_code`, or of formulas that were simplified before, and long.
    ``quick`` code is made in a seventh of the time, takes about twice as long to run, and does the
    same, to the last bit: nothing but registers and the order of instructions is chosen worse.

    Raises
    ------
    RuntimeError
        If this version of LLVM does not understand the text.
    """
    target = _target_machine(0 if quick else OPTIMISATION)
    parsed = _parsed(text, target)
    # Options of LLVM are those of the process: other code is made with all passes.
    llvm.set_option("polycorner", f"-{LEFT_OUT}=true")
    try:
        code: bytes = target.emit_object(parsed)
    finally:
        llvm.set_option("polycorner", f"-{LEFT_OUT}=false")
    return code


def portable_code(text: str) -> str:
    """Return intermediate code, optimised as far as that does not depend on the processor."""
    _prepare()
    target = llvm.Target.from_default_triple().create_target_machine()
    parsed = llvm.parse_assembly(text)
    options = llvm.create_pipeline_tuning_options(speed_level=OPTIMISATION)
    options.loop_vectorization = options.slp_vectorization = False
    _run_passes(parsed, target, options)
    return str(parsed)


def load_code(code: bytes, entries: list[str]) -> tuple[Any, list[int]]:
    """Return an engine that holds an object file, and the addresses of functions in it."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine, [engine.get_function_address(entry) for entry in entries]


def kept_code(
    name: str, entries: list[str], make: Callable[[], bytes]
) -> tuple[Any, list[int], str]:
    """Return what :func:`load_code` does of the code kept under a name, made where there is none.

    Then ``"loaded"`` or ``"compiled"``.
    """
    code, origin = read_code(name), "loaded"
    if code is None:
        code, origin = make(), "compiled"
        write_code(name, code)
    return *load_code(code, entries), origin


def code_name(prefix: str, content: Any, *generators: str) -> str:
    """Return the name of code: a digest of its content, and of the modules that make it."""
    digest = hashlib.sha256(repr((content, _generator_key(generators))).encode()).hexdigest()
    return f"{prefix}_{digest[:32]}"


@lru_cache(maxsize=8)
def _generator_key(generators: tuple[str, ...]) -> str:
    return repr((source_key(*generators), machine_key()))


def _parsed(text: str, target: Any) -> Any:
    parsed = llvm.parse_assembly(text)
    parsed.triple, parsed.data_layout = llvm.get_default_triple(), str(target.target_data)
    parsed.verify()
    return parsed


def _run_passes(parsed: Any, target: Any, options: Any) -> None:
    builder = llvm.create_pass_builder(target, options)
    passes = builder.getModulePassManager()
    passes.run(parsed, builder)
    # In some versions of llvmlite passes inherit what frees nothing before what frees them, and
    # every kernel that is compiled would leave 0.1 MB.
    kinds: tuple[Any, ...] = type(passes).__mro__
    for kind in kinds:
        if "_dispose" in vars(kind) and kind is not ObjectRef:
            kind._dispose(passes)  # noqa: SLF001 - nothing public frees them
            passes.detach()
            break


@lru_cache(maxsize=1)
def _prepare() -> None:
    """Set up code generation for this machine, and say where functions of the C library are."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    library = ctypes.CDLL(ctypes.util.find_library("m") if os.name == "posix" else "ucrtbase")
    for name in (*OPERATIONS, *emit.LIBM_BINARY, "floor", "ceil", "malloc", "free"):
        function = ctypes.cast(getattr(library, name), ctypes.c_void_p)
        llvm.add_symbol(name, function.value)


def _target_machine(optimisation: int = OPTIMISATION) -> Any:
    """Return a new target machine; an execution engine takes over the one it is made with."""
    _prepare()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=optimisation,
        reloc="pic",
        codemodel="jitdefault",
        jit=True,
    )
