"""Who computes the points: this process, an executor, a pool of processes, a Dask cluster."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from typing import Any

from polycorner.sweeps.results import SweepError

AHEAD = 3  # batches in flight for each worker
LARGEST = 200  # points in a batch
WATCHED = 5.0  # s between two looks at how many workers a cluster has


class Inline(Executor):
    """An executor that computes at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Return a future that is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Crew:
    """An executor, how many work there, and what to do when one of them dies.

    Parameters
    ----------
    executor : Executor
    width : callable
        Returns how many points are computed at a time.
    """

    renews = False  # whether a broken executor is replaced
    largest = LARGEST  # points in a batch
    ahead = AHEAD  # batches in flight for each worker

    def __init__(self, executor: Executor, width: Callable[[], int]) -> None:
        self.executor = executor
        self._width, self._looked, self._workers = width, -WATCHED, 1

    @property
    def width(self) -> int:
        """How many points are computed at a time."""
        now = time.monotonic()
        if now - self._looked >= WATCHED:
            self._workers, self._looked = max(1, self._width()), now
        return self._workers

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Hand in a call."""
        return self.executor.submit(function, *arguments)

    def renew(self) -> None:
        """Replace a broken executor."""
        msg = "executor: expected one that can be replaced"
        raise SweepError(msg)

    def leave(self, *, at_once: bool) -> None:
        """End what this crew started itself."""


class Alone(Crew):
    """One worker, the process at work itself, which computes point by point."""

    largest = 1
    ahead = 1

    def __init__(self) -> None:
        super().__init__(Inline(), lambda: 1)


class Pool(Crew):
    """Processes of our own, started anew when one of them dies.

    Parameters
    ----------
    count : int
        How many.
    """

    renews = True

    def __init__(self, count: int) -> None:
        self.count = count
        super().__init__(self._start(), lambda: count)

    def _start(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")  # nothing is inherited but the code
        executor = ProcessPoolExecutor(self.count, mp_context=context, initializer=_serve)
        try:
            executor.submit(os.getpid).result()
        except BrokenExecutor as error:
            msg = (
                f"executor: expected {self.count} processes to start; got {error} (a script has to "
                'call sweep under `if __name__ == "__main__":`)'
            )
            raise SweepError(msg) from error
        return executor

    def renew(self) -> None:
        """Start the processes anew."""
        self.leave(at_once=True)
        self.executor = self._start()

    def leave(self, *, at_once: bool) -> None:
        """End the processes: those at work after what they do, or at once."""
        workers = dict(getattr(self.executor, "_processes", None) or {})
        self.executor.shutdown(wait=not at_once, cancel_futures=True)
        if at_once:
            for worker in workers.values():
                worker.kill()
                worker.join()


def _serve() -> None:
    """Leave Ctrl-C to the process that started this one, and end when that does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent,), daemon=True).start()


def _follow(parent: Any) -> None:
    parent.join()
    os._exit(1)


def hired(executor: Any) -> Crew:
    """Return who is meant by the argument ``executor`` of a sweep.

    Raises
    ------
    TypeError, ValueError
        If nobody is.
    """
    if executor is None:
        return Alone()
    if isinstance(executor, int) and not isinstance(executor, bool):
        if executor < 1:
            msg = f"executor: expected a positive number of processes; got {executor}"
            raise ValueError(msg)
        return Pool(executor)
    if isinstance(executor, Executor):
        count = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        return Crew(executor, lambda: int(count))
    if callable(getattr(executor, "get_executor", None)):
        return Crew(executor.get_executor(pure=False), lambda: sum(executor.nthreads().values()))
    msg = (
        "executor: expected an Executor of concurrent.futures, a Client of Dask, a number of "
        f"processes or None; got {executor!r}"
    )
    raise TypeError(msg)


def is_lost(error: BaseException) -> bool:
    """Whether an error of a future says that the executor itself is gone."""
    return isinstance(error, BrokenExecutor | CancelledError)


def is_killer(error: BaseException) -> bool:
    """Whether an error of a future says that computing it killed workers of a cluster."""
    return type(error).__name__ == "KilledWorker"  # of distributed, which is not imported here
