"""Compiled kernels: a straight-line program as machine code, cached on disk.

Machine code is made through llvmlite, the code generator that Numba uses, so it can be called by
address from Numba as well as from Python.  Batches run in explicit vectors of ``emit.LANES`` lanes.
"""

import ctypes
import logging
from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
from llvmlite import ir

from polycorner.formulas import adjoints, batches, emit, operations, programs, translate
from polycorner.formulas.batches import emit_lanes, emit_points
from polycorner.formulas.cache import read_code
from polycorner.formulas.machine_code import code_name, kept_code, machine_code
from polycorner.formulas.programs import Polynomial, Program
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

ROOMS = (operations, programs, translate, adjoints, emit, batches)
GENERATORS = (*(room.__name__ for room in ROOMS), __name__)
LOG = logging.getLogger("polycorner.compilation")
MANY = 64  # points from which on they are evaluated in lanes
# Numbers a point, above which code for lanes takes longer to compile than it will ever save: nine
# gaps of two rigid bodies in space with second derivatives take 20 s, and a microsecond less each.
MOST_IN_LANES = 1000


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
        program: Callable[[], Program | Polynomial],
        *,
        variables: int,
        parameters: int,
        outputs: int,
    ) -> None:
        self.key, self._program = key, program
        self.variables, self.parameters, self.outputs = variables, parameters, outputs
        self._compiled: dict[int, CompiledKernel] = {}
        self._compiling = Lock()

    @cached_property
    def program(self) -> Program | Polynomial:
        """What is compiled: a straight-line program, or a polynomial given by its coefficients."""
        return self._program()

    def compiled(self, order: int) -> "CompiledKernel":
        """Return the machine code for derivatives up to ``order`` (0, 1 or 2).

        It stays the same as long as the kernel lives, for its address is in tables.
        """
        if order not in self._compiled:
            with self._compiling:
                if order not in self._compiled:
                    self._compiled[order] = CompiledKernel(self, order)
        return self._compiled[order]

    def at(self, q: Array, parameters: int, order: int) -> tuple[Array, ...]:
        """Return values ``(m,)``, gradients ``(m, k)`` and Hessians ``(m, k, k)`` at one point.

        ``parameters`` is the address of the parameters (:func:`address`); nothing is checked.
        """
        return self.compiled(order).at(q, parameters)

    def over(self, q: Array, parameters: int, order: int, period: int = 1) -> tuple[Array, ...]:
        """Return values, gradients and Hessians at every row of ``q`` ``(N, k)``.

        ``parameters`` are those of the first ``period`` rows, one after the other; they repeat.
        """
        return self.compiled(order).over(q, parameters, period)


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
        self.kernel, self.order = kernel, order
        self._name = code_name("polycorner", (kernel.key, order), *GENERATORS)
        entries = ("point", "packed", "rows")
        self._engine, addresses, self.origin = self._code(emit_points, self._name, entries)
        self.point, packed, rows = addresses
        pointer = ctypes.c_void_p
        self._packed = ctypes.PYFUNCTYPE(None, pointer, pointer)(packed)
        self._rows = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 2, *[pointer] * 5)(rows)
        k, m = kernel.variables, kernel.outputs
        self._shapes = ((m,), (m, k), (m, k, k))[: order + 1]
        ends = np.cumsum([k, *(int(np.prod(shape)) for shape in self._shapes)]).tolist()
        self._k, self._size = k, ends[-1]
        self._views = [
            (slice(a, b), shape) for a, b, shape in zip(ends, ends[1:], self._shapes, strict=False)
        ]

    def _code(
        self, emitted: Callable[..., Any], name: str, entries: tuple[str, ...]
    ) -> tuple[Any, list[int], str]:
        """Return an engine with machine code, the addresses in it, and where it came from."""
        kernel, order = self.kernel, self.order

        def make() -> bytes:
            LOG.debug("compiling %d formulas with derivatives up to %d", kernel.outputs, order)
            module = ir.Module(name=name)
            emitted(module, kernel.program, order, name)
            return machine_code(str(module))

        return kept_code(name, [f"{name}_{entry}" for entry in entries], make)

    @cached_property
    def _lanes(self) -> Any:
        """The code for batches in lanes; None for polynomials, whose loops are as fast."""
        name = f"{self._name}_lanes"
        if self._size - self._k > MOST_IN_LANES:
            return None
        if read_code(name) is None and isinstance(self.kernel.program, Polynomial):
            return None
        engine, (batch,), _ = self._code(emit_lanes, name, ("batch",))
        call = ctypes.CFUNCTYPE(None, ctypes.c_int64, *[ctypes.c_void_p] * 5)(batch)
        return engine, call

    def at(self, q: Array, parameters: int) -> tuple[Array, ...]:
        """Evaluate at one point; see :meth:`Kernel.at`."""
        block = np.empty(self._size)
        block[: self._k] = q
        self._packed(address(block), parameters)
        return tuple([block[part].reshape(shape) for part, shape in self._views])

    def over(self, q: Array, parameters: int, period: int = 1) -> tuple[Array, ...]:
        """Evaluate at every row; see :meth:`Kernel.over`."""
        outputs = tuple([np.empty((len(q), *shape)) for shape in self._shapes])
        self.fill(np.ascontiguousarray(q), parameters, outputs, period)
        return outputs

    def fill(self, q: Array, parameters: int, outputs: tuple[Array, ...], period: int = 1) -> None:
        """Evaluate at every row of ``q``; all arrays C-contiguous, ``q`` of shape ``(N, k)``.

        Few points, and points with parameters of their own, are evaluated one by one: code for
        lanes is compiled when it is first worth it.  The results are the same to the last bit.
        """
        addresses = [*(address(output) if output.size else None for output in outputs), None, None]
        lanes = self._lanes if period == 1 and len(q) >= MANY else None
        if lanes is None:
            self._rows(len(q), period, q.ctypes.data, parameters, *addresses[:3])
        else:
            lanes[1](len(q), q.ctypes.data, parameters, *addresses[:3])


def address(array: Array) -> int:
    """Return the address of a writable, not empty array, faster than ``array.ctypes.data``."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
