"""The compiled descent, as functions of arrays.

``python -m polycorner.minimisation.descent.intermediate`` writes its intermediate code;
``make intermediate`` does this after any stage was changed.
"""

import ctypes
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.shipped import Shipped
from polycorner.formulas.tables import Layout
from polycorner.minimisation.descent.records import DESCEND, ON_FACE, PROBLEM, RESTORE

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def _make() -> str:
    from polycorner.minimisation.descent.entry_points import made

    return made()


SHIPPED = Shipped(
    package="polycorner.minimisation.descent",
    file="descent.ll.xz",
    make=_make,
    names=("descend", "restore", "on_face"),
    arguments=2,
    results=2,
    number=ctypes.c_double,
    what="the search for minima",
    seconds=20,
    without=("intermediate.py",),
)


class Laid(NamedTuple):
    """A problem as compiled code finds it: see ``records.PROBLEM``."""

    table: bytes
    arrays: list[NDArray[Any]]
    rows: int

    @classmethod
    def of(cls, **values: Any) -> "Laid":
        """Lay out a problem of given entries."""
        values = {name: values[name] for name in PROBLEM.declared}
        return cls(*PROBLEM.table(values.values()), values["rows"])


def _call(number: int, problem: Laid, layout: Layout, *values: Any) -> list[float]:
    table, _arrays = layout.table(values)  # kept until the function returns
    return SHIPPED.functions[number](problem.table, table)


def descend(problem: Laid, use: Mask, u: Array, limit: int) -> tuple[int, int, Array, Array]:
    """Descend inside a piece; return status, iterations, point and multipliers."""
    v, multipliers = u.copy(), np.empty(problem.rows - 1)
    status, iterations = _call(0, problem, DESCEND, use, v, multipliers, limit)
    return int(status), int(iterations), v, multipliers


def restore(problem: Laid, use: Mask, u: Array) -> tuple[bool, Array]:
    """Project a point onto a piece; return success and the point."""
    v = u.copy()
    reached, _ = _call(1, problem, RESTORE, use, v)
    return bool(reached), v


def on_face(problem: Laid, on: Mask, u: Array) -> tuple[Array, float]:
    """Apply Newton's method on a face; return the point and the length of the last step."""
    v = u.copy()
    step, _ = _call(2, problem, ON_FACE, on, v)
    return v, step


if __name__ == "__main__":
    SHIPPED.write()
