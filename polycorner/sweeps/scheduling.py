"""Handing out points in small batches, few at a time, and taking in what becomes of them."""

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future, wait
from pickle import PicklingError
from queue import SimpleQueue
from typing import Any

from polycorner.sweeps.grid import Grid
from polycorner.sweeps.points import Job, Outcome, evaluate, sentence
from polycorner.sweeps.results import SweepError
from polycorner.sweeps.workers import LARGEST, Crew, is_killer, is_lost

TARGET = 0.1  # s that a batch should take
BUDGET = 1.0  # s after which a worker hands in what it has of a batch
PATIENCE = 10.0  # s for the rest of a broken pool to be told

Batch = list[int]


class Pace:
    """How many points make a batch, from how long they took so far."""

    def __init__(self) -> None:
        self.size, self.mean = 1, math.nan

    def take(self, outcomes: list[Outcome]) -> None:
        """Learn from outcomes; batches grow twofold at most."""
        if not outcomes:
            return
        mean = sum(outcome.seconds for outcome in outcomes) / len(outcomes)
        self.mean = mean if math.isnan(self.mean) else 0.8 * self.mean + 0.2 * mean
        fitting = LARGEST if self.mean * LARGEST < TARGET else max(1, int(TARGET / self.mean))
        self.size = min(fitting, 2 * self.size, LARGEST)


class Dispatch:
    """One pass over the points of a study.

    Parameters
    ----------
    crew : Crew
    job : Job
    grid : Grid
    todo : iterator of int
        The points to compute.
    record : callable
        Takes the outcomes of points.
    stopped : callable
        Whether to hand out nothing more.
    """

    def __init__(
        self, crew: Crew, job: Job, grid: Grid, todo: Iterator[int],
        record: Callable[[list[Outcome]], None], stopped: Callable[[], bool],
    ) -> None:  # fmt: skip
        self.crew, self.job, self.grid = crew, job, grid
        self.todo, self.record, self.stopped = todo, record, stopped
        self.landed: SimpleQueue[Future[Any] | None] = SimpleQueue()
        self.flying: dict[Future[Any], Batch] = {}
        self.again: deque[int] = deque()  # handed back by workers that had no time
        self.suspects: deque[int] = deque()  # in flight when a worker died
        self.pace = Pace()

    def wake(self) -> None:
        """Make :meth:`run` look whether it is to stop; also from a signal's handler."""
        self.landed.put(None)

    def run(self) -> None:
        """Hand out points until none is left or until stopped, and wait for those in flight."""
        while True:
            while not self.stopped() and self._launch():
                pass
            if not self.flying:
                return
            future = self.landed.get()
            if future is None:
                self.cancel()
            elif future in self.flying:
                self._land(future, self.flying.pop(future))

    def cancel(self) -> None:
        """Take back what no worker has begun."""
        for future in list(self.flying):
            if future.cancel():
                self.flying.pop(future, None)

    def _launch(self) -> bool:
        """Hand out a batch, if there is one and room for it; suspects one by one and alone."""
        room = self.crew.ahead * self.crew.width if not self.suspects else 1
        if len(self.flying) >= room:
            return False
        batch = [self.suspects.popleft()] if self.suspects else self._batch()
        if not batch:
            return False
        points = [self.grid.point(number) for number in batch]
        try:
            future = self.crew.submit(evaluate, self.job, batch, points, BUDGET)
        except (TypeError, AttributeError, PicklingError) as error:
            raise self._unloadable(error) from error
        except Exception as error:
            raise _gone(error) from error
        self.flying[future] = batch
        future.add_done_callback(self.landed.put)
        return True

    def _batch(self) -> Batch:
        batch: Batch = []
        while len(batch) < min(self.pace.size, self.crew.largest):
            number = self.again.popleft() if self.again else next(self.todo, None)
            if number is None:
                break
            batch.append(number)
        return batch

    def _land(self, future: "Future[Any]", batch: Batch) -> None:
        error = _error(future)
        if error is None:
            self._take(future.result(), batch)
        elif self.stopped():
            return  # workers were interrupted too; their points stay pending
        elif isinstance(error, KeyboardInterrupt):
            self.again.extend(batch)
        elif is_killer(error):
            self._accuse(batch, error)
        elif is_lost(error):
            self._replace(batch, error)
        else:
            raise self._unloadable(error) from error

    def _unloadable(self, error: BaseException) -> TypeError:
        name = getattr(self.job.function, "__qualname__", repr(self.job.function))
        return TypeError(
            "function: expected one that workers can load and whose arguments can be sent, "
            f"defined in a module; got {name} ({sentence(error)})"
        )

    def _take(self, outcomes: list[Outcome], batch: Batch) -> None:
        self.pace.take(outcomes)
        found = {outcome.number for outcome in outcomes}
        self.again.extend(number for number in batch if number not in found)
        self.record(outcomes)

    def _accuse(self, batch: Batch, error: BaseException) -> None:
        """Try the points of a batch that killed its worker alone; alone, the point has failed."""
        if len(batch) > 1:
            self.suspects.extend(batch)
        else:
            message = f"WorkerDied: the worker died while it computed this point ({error})"
            self.record([Outcome(batch[0], math.nan, message=" ".join(message.split()))])

    def _replace(self, batch: Batch, error: BaseException) -> None:
        """Go on with a new executor; what was in flight is tried one by one."""
        if not self.crew.renews:
            raise _gone(error) from error
        alone = not self.flying and len(batch) == 1
        wait(self.flying, timeout=PATIENCE)
        others, self.flying = self.flying, {}
        for future, points in others.items():
            if future.done() and _error(future) is None:
                self._take(future.result(), points)
            else:
                self.suspects.extend(points)
        self.crew.renew()
        if alone:
            self._accuse(batch, error)
        else:
            self.suspects.extend(batch)


def _error(future: "Future[Any]") -> BaseException | None:
    try:
        return future.exception(timeout=0)
    except (CancelledError, TimeoutError) as error:
        return error


def _gone(error: BaseException) -> SweepError:
    return SweepError(f"executor: expected workers that answer; they are gone ({sentence(error)})")
