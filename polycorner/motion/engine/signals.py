"""Atomic numbers, by which threads of the engine agree on who does what."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

ORDERING, ITEMSIZE = "seq_cst", 8


@intrinsic
def read(_: Any, array: Any, at: Any) -> Any:
    """Return number ``at`` of an array of whole numbers as it is for all threads."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values)
        return builder.load_atomic(place, ORDERING, ITEMSIZE)

    return types.int64(array, at), generate


@intrinsic
def write(_: Any, array: Any, at: Any, number: Any) -> Any:
    """Write number ``at`` of an array of whole numbers, for all threads."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values[:2])
        builder.store_atomic(values[2], place, ORDERING, ITEMSIZE)
        return context.get_dummy_value()

    return types.void(array, at, types.int64), generate


@intrinsic
def increase(_: Any, array: Any, at: Any, more: Any) -> Any:
    """Add to number ``at`` of an array of whole numbers; return what it was before."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values[:2])
        return builder.atomic_rmw("add", place, values[2], ORDERING)

    return types.int64(array, at, types.int64), generate


@intrinsic
def call_nothing(_: Any, address: Any) -> Any:
    """Call a function of no arguments at an address."""

    def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
        function = ir.FunctionType(ir.VoidType(), []).as_pointer()
        builder.call(builder.inttoptr(values[0], function), [])
        return context.get_dummy_value()

    return types.void(types.int64), generate


def _place(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.gep(data, [at])
