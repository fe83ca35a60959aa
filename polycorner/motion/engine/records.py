"""Records of the engine as compiled code reads them.

The first length of an array is not told: Numba adds it to indices below zero, of which there are
none; added as zero, it vanishes from the machine code.

The number of a body's coordinates may be known when code is compiled: then it is a constant, and so
are the lengths that follow from it, and loops over coordinates are unrolled.
"""

from typing import Any

from polycorner.formulas.records import RecordType, reader
from polycorner.motion.engine.arrays import Log, Model, State, Work, declarations
from polycorner.motion.engine.sizes import WIDTH

UNTOLD = 0  # said in place of the first length of an array


def readers(dimension: int) -> list[Any]:
    """Return the functions that make model, state, work and log of the addresses of their tables.

    ``dimension`` is the number of coordinates of a body, or 0 for any.
    """
    lanes = -(-dimension // WIDTH) * WIDTH
    lengths = {"k": dimension, "2*k": 2 * dimension, "K": lanes, "2*K": 2 * lanes}
    known = {**lengths, "dimension": dimension, "lanes": lanes} if dimension else {}
    return [
        reader(RecordType(f"{kind.__name__}, {dimension}", declarations(kind), known, UNTOLD))
        for kind in (Model, State, Work, Log)
    ]
