"""Records of arrays as one pointer, for compiled code.

To compiled code a record (:class:`~polycorner.motion.engine.arrays.Model` and the others) is the
address of a table: for every number its value, for every array its address and its lengths.
Reading ``record.name`` loads what it needs from there; the loads are marked invariant, since tables
do not change while compiled code runs.  To call a function so costs one argument for each record,
not one for each length of some 140 arrays.

The first length of an array is not told: Numba adds it to indices below zero, of which there are
none; added as zero, it vanishes from the machine code.

The number of a body's coordinates may be known when code is compiled: then it is a constant, and so
are the lengths that follow from it, and loops over coordinates are unrolled.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, register_model

from polycorner.motion.engine.arrays import Log, Model, State, Work, declarations
from polycorner.motion.engine.sizes import WIDTH

ITEMSIZE = 8  # bytes of every number
UNTOLD = 0  # said in place of the first length of an array
LETTERS = {"dimension": "k", "lanes": "K"}  # numbers of the model that may be known


# Numba has no types, so its classes are Any to mypy.
class RecordType(types.Type):  # type: ignore[misc]
    """The type of a record to compiled code, for bodies of so many coordinates."""

    def __init__(self, record: Any, dimension: int) -> None:
        lanes = -(-dimension // WIDTH) * WIDTH
        known = {"k": dimension, "2*k": 2 * dimension, "K": lanes, "2*K": 2 * lanes}
        self.known = known if dimension else {}
        self.fields: dict[str, tuple[int, Any]] = {}
        self.shapes: dict[str, list[str]] = {}
        slot = 0
        for name, declared in declarations(record).items():
            kind = types.float64 if declared.kind is np.float64 else types.int64
            dimensions = len(declared.shape.split())
            held = types.Array(kind, dimensions, "C") if dimensions else kind
            self.fields[name] = (slot, held)
            self.shapes[name] = declared.shape.split()
            slot += 1 + dimensions
        super().__init__(name=f"Record({record.__name__}, {dimension})")


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
    if name in LETTERS and record.known:
        return ir.Constant(ir.IntType(64), record.known[LETTERS[name]])
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
    word, untold = ir.IntType(64), ir.Constant(ir.IntType(64), UNTOLD)
    known = [record.known.get(length, length) for length in record.shapes[name]]
    shape = [
        ir.Constant(word, int(length)) if str(length).isdigit() else load(slot + 1 + axis)
        for axis, length in enumerate(known)
    ]
    strides, stride = [ir.Constant(word, ITEMSIZE)], shape[-1]
    for length in reversed(shape[:-1]):
        strides.insert(0, builder.mul(stride, strides[-1]))
        stride = builder.mul(stride, length)
    members = {
        "nitems": stride,
        "itemsize": strides[-1],
        "data": load(slot, context.get_data_type(held.dtype).as_pointer()),
        "shape": cgutils.pack_array(builder, [untold, *shape[1:]], word),
        "strides": cgutils.pack_array(builder, strides, word),
    }
    model = context.data_model_manager[held]
    array = ir.Constant(model.get_value_type(), None)
    for member, value in members.items():
        array = model.set(builder, array, value, member)
    return array


def _reader(kind: RecordType) -> Any:
    """Return the compiled function that makes a record of the address of its table."""

    @intrinsic
    def record_at(_: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return builder.inttoptr(values[0], ir.IntType(64).as_pointer())

        return kind(types.int64), generate

    return record_at


def readers(dimension: int) -> list[Any]:
    """Return the functions that make model, state, work and log of the addresses of their tables.

    ``dimension`` is the number of coordinates of a body, or 0 for any.
    """
    return [_reader(RecordType(record, dimension)) for record in (Model, State, Work, Log)]
