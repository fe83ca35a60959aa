"""Scheduling of points: small batches, few of them in flight, outcomes as they arrive."""

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from pickle import PicklingError
from typing import Any

from polycorner.sweeps.grid import Grid
from polycorner.sweeps.points import Job, Outcome, evaluate, one_line
from polycorner.sweeps.study import SweepError
from polycorner.workers import LARGEST, Shared, Workers, is_broken, killed_workers

TARGET = 0.1  # s that a batch should take
BUDGET = 1.0  # s after which a worker returns the rest of a batch
TICK = 0.5  # s between two looks whether to stop
PATIENCE = 10.0  # s for the other futures of a broken pool to end

Batch = list[int]


class Scheduler:
    """One pass over the points of a study.

    Parameters
    ----------
    workers : Workers
    job : Job
    grid : Grid
    todo : iterator of int
        The points to compute.
    record : callable
        Takes lists of outcomes; called at least every :data:`TICK` seconds while points are in
        flight elsewhere.
    stopped : callable
        Whether to submit nothing more.
    """

    def __init__(
        self, workers: Workers, job: Job, grid: Grid, todo: Iterator[int],
        record: Callable[[list[Outcome]], None], stopped: Callable[[], bool],
    ) -> None:  # fmt: skip
        self.workers, self.job, self.grid = workers, job, grid
        self._sent = Shared(job)
        self.todo, self.record, self.stopped = todo, record, stopped
        self.in_flight: dict[Future[Any], Batch] = {}
        self.returned: deque[int] = deque()  # by workers whose budget of time was spent
        self.suspects: deque[int] = deque()  # in flight when a worker died
        self.batch_size, self.mean = 1, math.nan  # points; s a point, smoothed

    def run(self) -> None:
        """Submit points until none is left or until stopped, and wait for those in flight."""
        while True:
            if self.workers.loss:  # a client that looks for its scheduler takes points all the same
                raise _gone(self.workers.loss)
            while not self.stopped() and self._submit():
                pass
            if self.stopped():
                self.cancel()
            if not self.in_flight:
                return
            finished, _ = wait(self.in_flight, timeout=TICK, return_when=FIRST_COMPLETED)
            for future in finished:
                if future in self.in_flight:  # not taken along with a broken pool
                    self._receive(future, self.in_flight.pop(future))
            if not finished:
                self.record([])

    def cancel(self) -> None:
        """Cancel batches that no worker has started."""
        for future in list(self.in_flight):
            if future.cancel():
                self.in_flight.pop(future, None)

    def _submit(self) -> bool:
        """Submit a batch if there is one and room for it; suspects one by one and alone."""
        try:
            room = 1 if self.suspects else self.workers.in_flight
        except OSError as error:
            raise _gone(error) from error
        if len(self.in_flight) >= room:
            return False
        batch = [self.suspects.popleft()] if self.suspects else self._batch()
        if not batch:
            return False
        points = [self.grid.point(number) for number in batch]
        try:
            future = self.workers.executor.submit(evaluate, self._sent, batch, points, BUDGET)
        except (TypeError, AttributeError, PicklingError) as error:
            raise self._not_sent(error) from error
        except Exception as error:
            raise _gone(error) from error
        self.in_flight[future] = batch
        return True

    def _batch(self) -> Batch:
        batch: Batch = []
        while len(batch) < min(self.batch_size, self.workers.largest):
            number = self.returned.popleft() if self.returned else next(self.todo, None)
            if number is None:
                break
            batch.append(number)
        return batch

    def _receive(self, future: "Future[Any]", batch: Batch) -> None:
        error = _error(future)
        if error is None:
            self._take(future.result(), batch)
        elif self.stopped():
            return  # the workers were interrupted as well; these points stay pending
        elif isinstance(error, KeyboardInterrupt):
            self.returned.extend(batch)
        elif killed_workers(error):
            self._suspect(batch, error)
        elif is_broken(error):
            self._replace(batch, error)
        else:
            raise self._not_sent(error) from error

    def _take(self, outcomes: list[Outcome], batch: Batch) -> None:
        found = {outcome.number for outcome in outcomes}
        self.returned.extend(number for number in batch if number not in found)
        mean = sum(outcome.seconds for outcome in outcomes) / len(outcomes)
        self.mean = mean if math.isnan(self.mean) else 0.8 * self.mean + 0.2 * mean
        size = LARGEST if self.mean * LARGEST < TARGET else max(1, int(TARGET / self.mean))
        self.batch_size = min(size, 2 * self.batch_size)
        self.record(outcomes)

    def _suspect(self, batch: Batch, error: BaseException) -> None:
        """Try the points of a batch that killed its worker one by one; a single one has failed."""
        if len(batch) > 1:
            self.suspects.extend(batch)
        else:
            message = f"WorkerDied: the worker died while it computed this point ({error})"
            self.record([Outcome(batch[0], math.nan, message=" ".join(message.split()))])

    def _replace(self, batch: Batch, error: BaseException) -> None:
        """Continue with a new executor; what was in flight is tried point by point."""
        alone = not self.in_flight
        wait(self.in_flight, timeout=PATIENCE)
        others, self.in_flight = self.in_flight, {}
        for future, points in others.items():
            if future.done() and _error(future) is None:
                self._take(future.result(), points)
            else:
                self.suspects.extend(points)
        if not self.workers.replace():
            raise _gone(error) from error
        if alone:
            self._suspect(batch, error)
        else:
            self.suspects.extend(batch)

    def _not_sent(self, error: BaseException) -> TypeError:
        name = getattr(self.job.function, "__qualname__", repr(self.job.function))
        return TypeError(
            "function: expected one that can be sent to workers, along with its arguments; "
            f"got {name} ({one_line(error)})"
        )


def _error(future: "Future[Any]") -> BaseException | None:
    try:
        return future.exception(timeout=0)
    except (CancelledError, TimeoutError) as error:
        return error


def _gone(why: BaseException | str) -> SweepError:
    got = why if isinstance(why, str) else one_line(why)
    return SweepError(f"executor: expected workers that answer; got {got}")
