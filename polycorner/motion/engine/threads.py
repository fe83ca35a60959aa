"""Threads that do the steps of the engine together."""

import ctypes
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.motion.engine.allocation import initial_array
from polycorner.motion.engine.arrays import Work, declarations
from polycorner.motion.engine.codes import STOP
from polycorner.motion.engine.sizes import Sizes

# What is in the making: every thread has arrays of its own.
OWN = (
    "scratch",
    "pair_gap_next",
    "way_gap",
    "way_rate",
    "own_block",
    "equation_rows",
    "body_matrix",
    "body_vector",
    "rest_velocity",
    "slip",
    "image",
    "members",
    "number",
    "listed",
    "degree",
    "first_of_degree",
    "queue",
    "first_neighbour",
    "link",
    "link_status",
    "mark",
    "place",
    "row_start",
    "columns",
    "island_vector",
    "matrix",
)
ASSIST = -1  # in place of a number of steps


def copies(work: Work, sizes: Sizes, threads: int) -> list[Work]:
    """Return the workspaces of further threads."""
    declared = declarations(Work)
    return [
        work._replace(**{name: initial_array(declared[name], sizes) for name in OWN})
        for _ in range(threads - 1)
    ]


@contextmanager
def assisted(
    advance: Callable[[NDArray[np.int64], int], Any],
    work: Work,
    addresses: list[NDArray[np.int64]],
) -> Iterator[None]:
    """Let further threads assist, with tables at these addresses, until steps are done.

    Compiled code tells them to stop when it returns.
    """
    if not addresses:
        yield
        return
    work.signals[STOP] = 0
    with ThreadPoolExecutor(len(addresses), "polycorner-motion") as pool:
        ended = [pool.submit(advance, tables, ASSIST) for tables in addresses]
        try:
            yield
        finally:
            work.signals[STOP] = 1
    for thread in ended:
        thread.result()


@cache
def address_of_yield() -> int:
    """Return the address of the function by which a thread lets others run; 0 if there is none."""
    library: Any
    if sys.platform == "win32":
        library, name = ctypes.WinDLL("kernel32"), "SwitchToThread"
    else:
        library, name = ctypes.CDLL(None), "sched_yield"
    function = getattr(library, name, None)
    return 0 if function is None else ctypes.cast(function, ctypes.c_void_p).value or 0
