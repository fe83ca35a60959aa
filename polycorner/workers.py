"""Workers: this process, an executor, processes that are started here, a Dask cluster.

The argument ``executor`` of parameter studies and of searches stands for one of them.
"""

import ctypes
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import lru_cache
from typing import Any

from polycorner.checks import refuse, whole
from polycorner.errors import WorkersError
from polycorner.values import cached_property

AHEAD = 3  # batches, or calls, in flight for each worker
RUNNING = "running"  # as Dask says it
LARGEST = 200  # points in a batch
DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of Linux
REFRESH = 5.0  # s between two looks at the number of workers of a cluster


class Shared:
    """A value that travels to workers with many calls and is unpickled there once, not every time.

    Functions are pickled by cloudpickle, so lambdas, closures and functions of a notebook can be
    sent.
    """

    def __init__(self, value: Any) -> None:
        self.value = value

    @cached_property
    def _content(self) -> bytes:
        import cloudpickle

        content: bytes = cloudpickle.dumps(self.value)
        return content

    def __reduce__(self) -> "tuple[Callable[[bytes], Shared], tuple[bytes]]":
        return _unpickled, (self._content,)


@lru_cache(maxsize=4)
def _unpickled(content: bytes) -> Shared:
    return Shared(pickle.loads(content))


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


class Workers:
    """An executor, and how much it is given at a time.

    ``count`` returns the number of workers, ``state`` "running", or in another word why nothing
    that is submitted is computed.  At most ``largest`` points are in a batch, and ``ahead`` batches
    in flight for each worker.
    """

    def __init__(
        self,
        executor: Executor,
        count: Callable[[], int],
        *,
        largest: int = LARGEST,
        ahead: int = AHEAD,
        state: Callable[[], str] = lambda: RUNNING,
    ) -> None:
        self.executor, self.largest, self.ahead = executor, largest, ahead
        self._state = state
        self._count, self._looked, self._workers = count, -REFRESH, 1

    @property
    def loss(self) -> str:
        """Why nothing that is submitted is computed any more, or an empty text."""
        state = self._state()
        return "" if state == RUNNING else f"a client that is {state}"

    @property
    def in_flight(self) -> int:
        """Number of batches that may be in flight."""
        now = time.monotonic()
        if now - self._looked >= REFRESH:
            self._workers, self._looked = max(1, self._count()), now
        return self.ahead * self._workers

    def replace(self) -> bool:
        """Replace a broken executor; return whether there is a new one."""
        return False

    def close(self, *, at_once: bool) -> None:
        """Stop what was started here."""


class Processes(Workers):
    """Processes that are started here, and replaced when one of them dies."""

    def __init__(self, count: int) -> None:
        super().__init__(self._started(count), lambda: count)

    @staticmethod
    def _started(count: int) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")  # nothing is inherited but the code
        executor = ProcessPoolExecutor(count, mp_context=context, initializer=serve)
        try:
            executor.submit(os.getpid).result()
        except BrokenExecutor as error:
            msg = (
                f"executor: expected {count} processes to start; got {error} (a script has to "
                'start them under `if __name__ == "__main__":`)'
            )
            raise WorkersError(msg) from error
        return executor

    def replace(self) -> bool:
        """Start the processes anew."""
        self.close(at_once=True)
        self.executor = self._started(self._count())
        return True

    def close(self, *, at_once: bool) -> None:
        """Stop the processes after what they are computing, or at once."""
        workers = dict(getattr(self.executor, "_processes", None) or {})
        self.executor.shutdown(wait=not at_once, cancel_futures=True)
        if at_once:
            for worker in workers.values():
                worker.kill()
                worker.join()


def serve() -> None:
    """Ignore Ctrl-C, which the parent process handles, and end when the parent ends.

    However that ends: a process that is killed has no time to stop those that it started.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent,), daemon=True).start()
    if sys.platform == "linux":  # compiled code may keep the thread from running for long
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(DEATH_SIGNAL, signal.SIGKILL)


def _follow(parent: Any) -> None:
    parent.join()
    os._exit(1)


@contextmanager
def opened(executor: Any) -> Iterator[Workers]:
    """Yield the workers that an argument ``executor`` stands for; stop those started here."""
    if isinstance(executor, Workers):
        yield executor
        return
    workers, at_once = workers_of(executor), True
    try:
        yield workers
        at_once = False
    finally:
        workers.close(at_once=at_once)


def opened_if_any(executor: Any) -> AbstractContextManager[Workers | None]:
    """Yield the workers of :func:`opened`, or None where there is no executor."""
    return nullcontext() if executor is None else opened(executor)


def workers_of(executor: Any) -> Workers:
    """Return the workers that an argument ``executor`` stands for."""
    if executor is None:
        return Workers(Inline(), lambda: 1, largest=1, ahead=1)
    if isinstance(executor, int):
        # The stubs lack it.
        from multiprocessing.synchronize import SEM_VALUE_MAX  # type: ignore[attr-defined]

        return Processes(whole("executor", executor, least=1, most=SEM_VALUE_MAX - 1))
    if isinstance(executor, Executor):
        count = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        return Workers(executor, lambda: int(count))
    if not callable(getattr(executor, "get_executor", None)):
        kinds = "an Executor of concurrent.futures, a Client of Dask, a number of processes or None"
        refuse("executor", kinds, executor, TypeError)
    threads: Any = executor.nthreads
    return Workers(
        executor.get_executor(pure=False),
        lambda: sum(threads().values()),
        state=lambda: str(getattr(executor, "status", RUNNING)),
    )


def is_broken(error: BaseException) -> bool:
    """Whether the error of a future means that the executor itself is gone."""
    return isinstance(error, BrokenExecutor | CancelledError)


def killed_workers(error: BaseException) -> bool:
    """Whether the error of a future means that computing it killed workers of a cluster."""
    return type(error).__name__ == "KilledWorker"  # of distributed, which is not imported here


# ---------------------------------------------------------------------- results ahead of their need

# The caller takes results in an order of its own, which does not depend on the workers: whatever it
# does with them is the same for any number of workers.

ATTEMPTS = 3  # how often workers may die while they compute the call whose result is needed


class Lookahead:
    """Calls of functions, a few in flight for each worker."""

    def __init__(self, workers: Workers) -> None:
        self.workers = workers
        self._calls: dict[Hashable, tuple[Future[Any], tuple[Any, ...]]] = {}

    @property
    def has_room(self) -> bool:
        """Whether another call may be started."""
        return len(self._calls) < self.workers.in_flight

    def __contains__(self, key: Hashable) -> bool:
        """Whether a call was started whose result was not taken."""
        return key in self._calls

    def start(self, key: Hashable, function: Callable[..., Any], *arguments: Any) -> None:
        """Start a call of a module-level function in a worker."""
        call = (function, *arguments)
        self._calls[key] = (self._submitted(call), call)

    def result(self, key: Hashable) -> Any:
        """Wait for a result and take it; calls that dying workers left are started anew.

        Raises
        ------
        WorkersError
            If the workers do not answer, or died :data:`ATTEMPTS` times during this call.
        """
        for _ in range(ATTEMPTS):
            future, _ = self._calls[key]
            try:
                found = future.result()
            except Exception as error:
                if not (is_broken(error) or killed_workers(error)):
                    raise
                last = error
                self._renew(error)
            else:
                del self._calls[key]
                return found
        msg = f"executor: expected workers that live; they died {ATTEMPTS} times ({last})"
        raise WorkersError(msg) from last

    def drop(self, key: Hashable) -> None:
        """Forget a call whose result is not needed."""
        future, _ = self._calls.pop(key)
        future.cancel()

    def close(self) -> None:
        """Cancel the calls that no worker has begun."""
        for key in list(self._calls):
            self.drop(key)

    def _submitted(self, call: tuple[Any, ...]) -> "Future[Any]":
        try:
            return self.workers.executor.submit(*call)
        except Exception as error:
            if not is_broken(error) or not self.workers.replace():
                msg = f"executor: expected workers that answer; got {error!r}"
                raise WorkersError(msg) from error
        return self.workers.executor.submit(*call)

    def _renew(self, error: BaseException) -> None:
        """Replace a broken executor, and start again what it did not finish."""
        if is_broken(error) and not self.workers.replace():
            msg = f"executor: expected workers that answer; got {error!r}"
            raise WorkersError(msg) from error
        for key, (future, call) in self._calls.items():
            if not _is_finished(future) and (is_broken(error) or future.done()):
                self._calls[key] = (self._submitted(call), call)


def in_order(
    workers: Workers | None, function: Callable[..., Any], common: Any, items: Sequence[Any]
) -> Iterator[Any]:
    """Yield ``function(common, item)`` for every item, in their order, or without workers here."""
    if workers is None:
        yield from (function(common, item) for item in items)
        return
    ahead, started = Lookahead(workers), 0
    try:
        for k in range(len(items)):
            while started < len(items) and (started <= k or ahead.has_room):
                ahead.start(started, function, common, items[started])
                started += 1
            yield ahead.result(k)
    finally:
        ahead.close()


def _is_finished(future: "Future[Any]") -> bool:
    """Whether a call is finished, without an error."""
    try:
        return future.done() and future.exception() is None
    except CancelledError:
        return False
