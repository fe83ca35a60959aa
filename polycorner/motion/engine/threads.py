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

from polycorner.motion.engine.arrays import Work
from polycorner.motion.engine.codes import STOP

ASSIST = -1  # in place of a number of steps


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
    work.shared.signals[STOP] = 0
    with ThreadPoolExecutor(len(addresses), "polycorner-motion") as pool:
        ended = [pool.submit(advance, tables, ASSIST) for tables in addresses]
        try:
            yield
        finally:
            work.shared.signals[STOP] = 1
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
