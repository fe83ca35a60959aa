"""Records of arrays as one pointer, for compiled code.

To compiled code a record is the address of a table (:func:`~polycorner.formulas.tables.table`): for
every number its value, for every array its address and its lengths.  Reading ``record.name`` loads
what it needs from there; the loads are marked invariant, since tables do not change while compiled
code runs.  To call a function so costs one argument for each record, not one for each length of all
arrays.

Numbers and lengths may be known when code is compiled: then they are constants, and loops over them
are unrolled.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, register_model

from polycorner.formulas.tables import Declared


# Numba has no types, so its classes are Any to mypy.
class RecordType(types.Type):  # type: ignore[misc]
    """The type of a record to compiled code.

    Parameters
    ----------
    name : str
        Another one for each type.
    declared : mapping
        Its entries, in the order of the table.
    known : mapping, optional
        Numbers and lengths that are known, by name.
    first : int, optional
        Said in place of the first length of every array.
    """

    def __init__(
        self,
        name: str,
        declared: Mapping[str, Declared],
        known: Mapping[str, int] | None = None,
        first: int | None = None,
    ) -> None:
        self.known, self.first = dict(known or {}), first
        self.fields: dict[str, tuple[int, Any]] = {}
        self.shapes = {entry: declared[entry].shape.split() for entry in declared}
        self.sizes = {entry: np.dtype(declared[entry].kind).itemsize for entry in declared}
        slot = 0
        for entry, shape in self.shapes.items():
            kind = from_dtype(np.dtype(declared[entry].kind))
            held = types.Array(kind, len(shape), "C") if shape else kind
            self.fields[entry] = (slot, held)
            slot += 1 + len(shape)
        super().__init__(name=f"Record({name})")


@register_model(RecordType)
class RecordModel(PrimitiveModel):  # type: ignore[misc]
    """A pointer to the table."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.IntType(64).as_pointer())


@infer_getattr
class RecordAttributes(AttributeTemplate):  # type: ignore[misc]
    """The entries of a record are its attributes."""

    key = RecordType

    def generic_resolve(self, record: RecordType, name: str) -> Any:
        """Return the type of an entry."""
        return record.fields[name][1] if name in record.fields else None


@lower_getattr_generic(RecordType)
def read_entry(context: Any, builder: Any, record: RecordType, table: Any, name: str) -> Any:
    """Load an entry."""
    slot, held = record.fields[name]
    word = ir.IntType(64)
    if name in record.known:
        return ir.Constant(word, record.known[name])
    invariant = builder.module.add_metadata([])

    def load(at: int, kind: Any = None) -> Any:
        place = builder.gep(table, [ir.Constant(ir.IntType(32), at)])
        if kind is not None:
            place = builder.bitcast(place, kind.as_pointer())
        value = builder.load(place)
        value.set_metadata("invariant.load", invariant)
        return value

    if not isinstance(held, types.Array):
        return load(slot, context.get_value_type(held))
    lengths = [record.known.get(length, length) for length in record.shapes[name]]
    shape = [
        ir.Constant(word, int(length)) if str(length).isdigit() else load(slot + 1 + axis)
        for axis, length in enumerate(lengths)
    ]
    strides, stride = [ir.Constant(word, record.sizes[name])], shape[-1]
    for length in reversed(shape[:-1]):
        strides.insert(0, builder.mul(ir.Constant(word, record.sizes[name]), stride))
        stride = builder.mul(stride, length)
    if record.first is not None:
        shape[0] = ir.Constant(word, record.first)
    members = {
        "nitems": stride,
        "itemsize": strides[-1],
        "data": load(slot, context.get_data_type(held.dtype).as_pointer()),
        "shape": cgutils.pack_array(builder, shape, word),
        "strides": cgutils.pack_array(builder, strides, word),
    }
    model = context.data_model_manager[held]
    array = ir.Constant(model.get_value_type(), None)
    for member, value in members.items():
        array = model.set(builder, array, value, member)
    return array


def reader(kind: RecordType) -> Any:
    """Return the compiled function that makes a record of the address of its table."""

    @intrinsic
    def record_at(_: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return builder.inttoptr(values[0], ir.IntType(64).as_pointer())

        return kind(types.int64), generate

    return record_at
