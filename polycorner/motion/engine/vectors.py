"""Vectors of eight reals, for compiled code: one instruction where the processor has it.

They are read from and written to arrays at any place.  LLVM turns them into what the processor has,
of two, four or eight reals; products are not contracted with sums, and sums are taken in one fixed
order, so the results are the same on all of them.
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

WIDTH, ITEMSIZE = 8, 8  # reals in a vector, bytes of one
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
class Multiple(ConcreteTemplate):  # type: ignore[misc]
    """A number times a vector."""

    cases = (signature(VECTOR, types.float64, VECTOR),)


@lower_builtin(operator.add, VectorType, VectorType)
def add(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate the sum of two vectors."""
    return builder.fadd(*values)


@lower_builtin(operator.sub, VectorType, VectorType)
def subtract(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate the difference of two vectors."""
    return builder.fsub(*values)


@lower_builtin(operator.mul, types.Float, VectorType)
def multiply(_: Any, builder: Any, __: Any, values: Any) -> Any:
    """Generate a number times a vector."""
    number, vector = values
    return builder.fmul(_repeated(builder, number), vector)


@intrinsic
def zeros(_: Any) -> Any:
    """Return a vector of zeros."""
    return VECTOR(), lambda *_: ir.Constant(REALS, None)


@intrinsic
def load(_: Any, array: Any, at: Any) -> Any:
    """Return the eight numbers of an array that begin with number ``at``."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values)
        return builder.load(place, align=ITEMSIZE)

    return VECTOR(array, at), generate


@intrinsic
def store(_: Any, array: Any, at: Any, vector: Any) -> Any:
    """Write the eight numbers of an array that begin with number ``at``."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        place = _place(context, builder, kind.args[0], *values[:2])
        builder.store(values[2], place, align=ITEMSIZE)
        return context.get_dummy_value()

    return types.void(array, at, vector), generate


@intrinsic
def dot(_: Any, first: Any, second: Any) -> Any:
    """Return the scalar product of two vectors, summed by halves."""

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        total, length = builder.fmul(*values), WIDTH
        while length > 1:
            length //= 2
            nothing = ir.Constant(total.type, ir.Undefined)
            low, high = (
                builder.shuffle_vector(total, nothing, _numbers(range(start, start + length)))
                for start in (0, length)
            )
            total = builder.fadd(low, high)
        return builder.extract_element(total, ir.Constant(ir.IntType(32), 0))

    return types.float64(first, second), generate


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
