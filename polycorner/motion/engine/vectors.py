"""Vectors of four reals, for compiled code: one instruction where the processor has it.

They are read from and written to arrays at any place.  LLVM turns them into what the processor has;
products are not contracted with sums, and sums are taken in one fixed order, so the results are the
same on all processors.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import lower_builtin
from numba.core.typing import signature
from numba.core.typing.templates import ConcreteTemplate, infer_global
from numba.extending import intrinsic, register_model

from polycorner.motion.engine.sizes import WIDTH

ITEMSIZE = 8  # bytes of a real
REALS = ir.VectorType(ir.DoubleType(), WIDTH)


# Numba has no types, so its classes are Any to mypy.
class VectorType(types.Type):  # type: ignore[misc]
    """The type of a vector to compiled code."""

    def __init__(self) -> None:
        super().__init__(name="Vector")


VECTOR = VectorType()


@register_model(VectorType)
class VectorModel(PrimitiveModel):  # type: ignore[misc]
    """A vector of LLVM's."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, REALS)


@infer_global(operator.add)
@infer_global(operator.sub)
class Sum(ConcreteTemplate):  # type: ignore[misc]
    """Vectors are added and subtracted entry by entry."""

    cases = (signature(VECTOR, VECTOR, VECTOR),)


@infer_global(operator.mul)
class Product(ConcreteTemplate):  # type: ignore[misc]
    """Vectors are multiplied entry by entry, or by a number."""

    cases = (signature(VECTOR, VECTOR, VECTOR), signature(VECTOR, types.float64, VECTOR))


@lower_builtin(operator.add, VectorType, VectorType)
def add(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate the sum of two vectors."""
    return builder.fadd(*values)


@lower_builtin(operator.sub, VectorType, VectorType)
def subtract(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate the difference of two vectors."""
    return builder.fsub(*values)


@lower_builtin(operator.mul, VectorType, VectorType)
def multiply(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate the product of two vectors."""
    return builder.fmul(*values)


@lower_builtin(operator.mul, types.Float, VectorType)
def scale(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate a number times a vector."""
    number, vector = values
    return builder.fmul(_repeated(builder, number), vector)


@intrinsic
def zeros(_: Any) -> Any:
    """Return a vector of zeros."""
    return VECTOR(), lambda *_: ir.Constant(REALS, None)


@intrinsic
def load(_: Any, array: Any, at: Any) -> Any:
    """Return the numbers of an array, of any shape, that begin with number ``at``."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values)
        return builder.load(place, align=ITEMSIZE)

    return VECTOR(array, at), generate


@intrinsic
def store(_: Any, array: Any, at: Any, vector: Any) -> Any:
    """Write the numbers of an array, of any shape, that begin with number ``at``."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values[:2])
        builder.store(values[2], place, align=ITEMSIZE)
        return context.get_dummy_value()

    return types.void(array, at, vector), generate


@intrinsic
def entry(_: Any, array: Any, at: Any) -> Any:
    """Return number ``at`` of an array of any shape."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        array, at = values
        data = context.make_array(kind.args[0])(context, builder, array).data
        return builder.load(builder.gep(data, [at]))

    return types.float64(array, at), generate


@intrinsic
def total(_: Any, vector: Any) -> Any:
    """Return the sum of the entries of a vector, by halves."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        left, length = values[0], WIDTH
        while length > 1:
            length //= 2
            nothing = ir.Constant(left.type, ir.Undefined)
            low, high = (
                builder.shuffle_vector(left, nothing, _numbers(range(start, start + length)))
                for start in (0, length)
            )
            left = builder.fadd(low, high)
        return builder.extract_element(left, ir.Constant(ir.IntType(32), 0))

    return types.float64(vector), generate


def _place(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), REALS.as_pointer())


def _repeated(builder: Any, number: Any) -> Any:
    nothing = ir.Constant(REALS, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, _numbers([0] * WIDTH))


def _numbers(values: Any) -> Any:
    numbers = list(values)
    return ir.Constant(ir.VectorType(ir.IntType(32), len(numbers)), numbers)
