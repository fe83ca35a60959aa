"""Building blocks shared by the folders of Numba code: calls by address, and no inlining."""

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def call_kernel(_: Any, address: Any, q: Any, p: Any, f: Any, J: Any, H: Any) -> Any:
    """Call ``void point(q, p, f, J, H)`` at an address, all arguments being addresses."""
    signature = types.void(*([types.int64] * 6))

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer = cgutils.voidptr_t
        kind = cgutils.ir.FunctionType(cgutils.ir.VoidType(), [pointer] * 5)
        function = builder.inttoptr(values[0], kind.as_pointer())
        builder.call(function, [builder.inttoptr(v, pointer) for v in values[1:]])
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def never_inline(_: Any) -> Any:
    """Mark the calling function as never inlined, which shortens compilation."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate
