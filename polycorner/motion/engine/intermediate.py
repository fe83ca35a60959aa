"""Machine code of the engine, from the intermediate code that the package contains.

Numba needs half a minute to make intermediate code of the stages.  This does not depend on the
processor, so that the package contains it.  Where the stages were changed since, or this version of
LLVM does not understand it, it is made anew.  Machine code is cached.

There is code for bodies of any number of coordinates, and faster code for the commonest numbers, by
a sixth for dumbbells; results are the same, bit for bit.

``python -m polycorner.motion.engine.intermediate`` writes the package's files; ``make engine`` does
this after any stage was changed.
"""

import ctypes
import hashlib
import logging
import lzma
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.atomic import write_atomically
from polycorner.errors import SolverError
from polycorner.formulas.cache import one_at_a_time, read_code, sources_digest, write_code
from polycorner.formulas.machine_code import load_code, machine_code, machine_key

LOG = logging.getLogger("polycorner.compilation")
ENTRY, FILE, HEAD = "polycorner_advance", "engine_{}.ll.xz", "; made from "
PACKAGE = "polycorner.motion.engine"
NOT_COMPILED = ("allocation.py", "driver.py", "intermediate.py", "layout.py", "threads.py")
ANY, COMMON = 0, (3, 4, 7)  # coordinates: of bodies in the plane, dumbbells, bodies in space
SECONDS = 2  # of processor time, about, to make machine code

Advance = Callable[[NDArray[np.int64], int], list[int]]


@cache
def compiled_advance(dimension: int = ANY) -> Advance:
    """Return the function that advances by several steps bodies of so many coordinates.

    It takes the addresses of the tables of the records, and returns why it stopped, and how many
    steps and events there were.
    """
    if dimension not in COMMON and dimension != ANY:
        return compiled_advance(ANY)
    sources = engine_sources()
    key = repr((sources, dimension, machine_key()))
    name = f"engine_{hashlib.sha256(key.encode()).hexdigest()[:32]}"
    code = read_code(name)
    if code is None:
        with one_at_a_time(name):
            code = read_code(name)
            if code is None:
                code = _made(sources, dimension)
                write_code(name, code)
    return _loaded(code)


def engine_sources() -> str:
    """Return the digest of the stages."""
    return sources_digest(PACKAGE, without=NOT_COMPILED)


def shipped_code(dimension: int) -> str:
    """Return the intermediate code that the package contains; empty if it cannot be read."""
    try:
        return lzma.decompress(_file(dimension).read_bytes()).decode()
    except (OSError, lzma.LZMAError):
        return ""


def _file(dimension: int) -> Path:
    return Path(__file__).with_name(FILE.format(dimension or "any"))


def _made(sources: str, dimension: int) -> bytes:
    """Return machine code, from the intermediate code at hand if it is that of the sources."""
    text = shipped_code(dimension)
    if text.startswith(HEAD + sources + "\n"):
        LOG.warning("compiling the engine of motion, once on this machine: about %d s", SECONDS)
        try:
            return machine_code(text, optimise=False)
        except RuntimeError as error:
            LOG.info("the engine's intermediate code is not understood: %s", error)
    return machine_code(_anew(dimension), optimise=False)


def _anew(dimension: int) -> str:
    from polycorner.motion.engine.entry_point import intermediate_code

    return intermediate_code(ENTRY, dimension)


def _loaded(code: bytes) -> Advance:
    holder, (address,) = load_code(code, [ENTRY])
    pointer, whole = ctypes.c_void_p, ctypes.c_int64
    function = ctypes.CFUNCTYPE(ctypes.c_int32, pointer, pointer, *[whole] * 5)(address)
    failure = np.zeros(1, dtype=np.int64)

    def advance(tables: NDArray[np.int64], steps: int, _: Any = holder) -> list[int]:
        result = np.zeros(3, dtype=np.int64)
        status = function(result.ctypes.data, failure.ctypes.data, *tables.tolist(), steps)
        if status != 0:
            msg = f"the compiled engine failed with status {status}"
            raise SolverError(msg)
        return [int(number) for number in result]

    return advance


if __name__ == "__main__":
    for number in (ANY, *COMMON):
        whole = HEAD + engine_sources() + "\n" + _anew(number)
        write_atomically(_file(number), lzma.compress(whole.encode(), preset=9))
