"""Results of calls that workers compute ahead of when they are needed.

The caller takes results in an order of its own, which does not depend on the workers: whatever it
does with them is the same for any number of workers.
"""

from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from typing import Any

from polycorner.errors import WorkersError
from polycorner.workers import Workers, is_broken, killed_workers

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
