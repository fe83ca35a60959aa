"""Real numbers at addresses, for compiled code that is called as the kernels of formulas are."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from polycorner.formulas.linking import linked

# Without reference counts: nothing is allocated.
compiled = linked(error_model="numpy", _nrt=False)


def _place(builder: Any, address: Any, at: Any) -> Any:
    start = builder.inttoptr(address, ir.DoubleType().as_pointer())
    return builder.gep(start, [at])


@intrinsic
def get(_: Any, address: Any, at: Any) -> Any:
    """Return number ``at`` from an address on."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        return builder.load(_place(builder, *values))

    return types.float64(types.int64, types.int64), generate


@intrinsic
def put(_: Any, address: Any, at: Any, number: Any) -> Any:
    """Write number ``at`` from an address on."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        builder.store(values[2], _place(builder, *values[:2]))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64), generate
