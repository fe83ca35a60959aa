"""The compiled engine.

There is code for bodies of any number of coordinates, and of several kinds, and faster code for the
commonest numbers and one kind, by a sixth for dumbbells; results are the same, bit for bit.

``python -m polycorner.motion.engine.intermediate`` writes the package's files; ``make
intermediate`` does this after any stage was changed.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.shipped import Shipped

ANY, COMMON = 0, (3, 4, 7)  # coordinates: of bodies in the plane, dumbbells, bodies in space
NOT_COMPILED = ("allocation.py", "driver.py", "intermediate.py", "layout.py", "threads.py")

Advance = Callable[[NDArray[np.int64], int], list[int]]


def _shipped(dimension: int) -> Shipped:
    def make() -> str:
        from polycorner.motion.engine.entry_point import made

        return made(dimension)

    return Shipped(
        package="polycorner.motion.engine",
        file=f"engine_{dimension or 'any'}.ll.xz",
        make=make,
        names=("advance",),
        arguments=5,
        results=3,
        what="the engine of motion",
        seconds=30,
        without=NOT_COMPILED,
    )


SHIPPED = {dimension: _shipped(dimension) for dimension in (ANY, *COMMON)}


@cache
def compiled_advance(dimension: int = ANY) -> Advance:
    """Return the function that advances by several steps bodies of so many coordinates.

    It takes the addresses of the tables of the records, and returns why it stopped, and how many
    steps and events there were.
    """
    (function,) = SHIPPED.get(dimension, SHIPPED[ANY]).functions

    def advance(tables: NDArray[np.int64], steps: int) -> list[int]:
        return function(*tables.tolist(), steps)

    return advance


if __name__ == "__main__":
    for shipped in SHIPPED.values():
        shipped.write()
