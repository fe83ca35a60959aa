"""Ctrl-C as a request to stop: work in progress is finished and kept."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def first_interrupt(noted: Callable[[], object]) -> Iterator[None]:
    """Call ``noted`` at the first Ctrl-C; the second one has its usual effect.

    Outside the main thread, and where Ctrl-C has another handler, nothing is changed.
    """
    usual = signal.getsignal(signal.SIGINT)
    main = threading.current_thread() is threading.main_thread()
    if not main or usual is not signal.default_int_handler:
        yield
        return

    def first(_number: int, _frame: object) -> None:
        noted()
        signal.signal(signal.SIGINT, usual)

    signal.signal(signal.SIGINT, first)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
