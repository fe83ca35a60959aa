"""Parameter studies: a function at every point of a grid, on any number of workers."""

import inspect
import math
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from functools import partial
from pathlib import Path
from pickle import PicklingError
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import MOST, names, refuse, whole
from polycorner.errors import WorkersError
from polycorner.interrupts import first_interrupt
from polycorner.kinds import checked
from polycorner.progress import Progress, silent
from polycorner.sweeps.grid import Grid
from polycorner.sweeps.points import Job, Outcome, evaluate, one_line
from polycorner.sweeps.store import Store
from polycorner.sweeps.study import Study, SweepError, canonical
from polycorner.sweeps.tables import StudyTable
from polycorner.workers import LARGEST, Shared, Workers, is_broken, killed_workers, workers_of

if TYPE_CHECKING:
    import xarray as xr


TARGET = 0.1  # s that a batch should take
BUDGET = 1.0  # s after which a worker returns the rest of a batch
TICK = 0.5  # s between two looks whether to stop
PATIENCE = 10.0  # s for the other futures of a broken pool to end

Batch = list[int]


class Scheduler:
    """One pass over the points of a study, of which ``todo`` are to be computed.

    ``record`` takes outcomes, at least every :data:`TICK` seconds while points are in flight
    elsewhere; once ``stopped`` nothing more is submitted.
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


@checked
def sweep(
    function: Callable[..., Mapping[str, Any]],
    grid: "Mapping[str, Any] | Grid",
    *,
    executor: Any = None,
    rng: int | np.random.Generator | None = None,
    fixed: Mapping[str, Any] | None = None,
    store: "str | os.PathLike[str] | None" = None,
    retry: bool = False,
    progress: Progress = silent,
) -> "xr.Dataset":
    """Return the values of ``function`` at every point of a grid as one dataset.

    A point where the function raises is a row like any other: its status is 2 (failed), its
    message is the type and message of the exception, its results are nan.  The results do not
    depend on the number of workers, on the order in which points finish, or on how often the study
    was interrupted and resumed.

    Parameters
    ----------
    function : callable
        ``function(**point, **fixed)`` returns a mapping from names to numbers, arrays of numbers
        or texts, each alone or as ``(value, unit)``; the same names and shapes everywhere.  If it
        has a parameter ``rng``, it gets a generator of its own at each point.
    grid : mapping from str to Axis
        The values of each parameter: an :class:`Axis`, values alone, or ``(values, unit)``.  All
        combinations are computed; the last axis varies fastest.
    executor : optional
        None (default) computes in this process; a number starts that many processes, which are
        replaced when they die; otherwise a ``concurrent.futures.Executor`` or a
        ``distributed.Client``, which stays open.  Functions and arguments are sent by cloudpickle.
    rng : int or Generator, optional
        Seed of the random streams (default 0), or a generator that one is drawn from.  The point
        with number k gets the k-th child of the seed (:class:`numpy.random.SeedSequence`).
    fixed : mapping, optional
        Further arguments, the same at every point: anything that can be pickled.
    store : path, optional
        A folder for the results, as zarr arrays.  After any interruption, the same call computes
        the missing points.
    retry : bool, optional
        Compute failed points again.
    progress : callable, optional
        Called with the number of finished points (with a store: of those written), the number of
        all points, and a note on failures; see :class:`~polycorner.progress.Progress`.

    Returns
    -------
    xarray.Dataset
        Results, ``message``, ``seconds`` and ``status`` (0 pending, 1 done, 2 failed) over the
        axes; as attributes the provenance, and ``complete``: "finished" or "interrupted".

    Raises
    ------
    TypeError, ValueError
        Naming the argument; also if the store is of another study, damaged or in use.
    ImportError
        If a store is asked for and zarr is missing.
    SweepError
        If the workers do not answer or the store cannot be written; finished points are kept.

    Notes
    -----
    The first Ctrl-C waits for the points that are being computed (those on a cluster are cancelled)
    and returns the results so far, with the other points pending.  The second one raises
    KeyboardInterrupt at once; what is in the store stays.

    Examples
    --------
    >>> def area(width, height):
    ...     return {"area": (width * height, "mm^2")}
    >>> found = sweep(area, {"width": ([1, 2], "mm"), "height": ([3, 4, 5], "mm")})
    >>> found["area"].values.tolist(), found["area"].attrs["units"]
    ([[3.0, 4.0, 5.0], [6.0, 8.0, 10.0]], 'mm^2')
    """
    axes, constants = Grid.of(grid), dict(fixed or {})
    random = check_arguments(function, axes, constants)
    study = Study(axes, _name(function), canonical(constants), _seed(rng, wanted=random))
    table = StudyTable(study) if store is None else Store(Path(store), study)
    try:
        finished = _compute(table, Job(function, constants, study.seed), executor, retry, progress)
        table.close(complete="finished" if finished else "interrupted")
    except (SweepError, WorkersError) as error:
        _close(table)
        msg = f"{error}; {_kept(table)}"
        raise SweepError(msg, results=table.dataset()) from error
    except BaseException:
        _close(table)
        raise
    return table.dataset()


def _compute(table: StudyTable, job: Job, executor: Any, retry: bool, progress: Progress) -> bool:
    """Compute the missing points, until Ctrl-C; return whether all are finished."""
    grid, stop = table.study.grid, threading.Event()
    reported = (-1, -1)

    def record(outcomes: list[Outcome]) -> None:
        nonlocal reported
        table.add(outcomes)
        done, failed = table.done, table.failed
        if (done, failed) != reported:
            reported = (done, failed)
            progress(done + failed, grid.size, f"{failed} failed" if failed else "")

    record([])
    if table.done + (0 if retry else table.failed) == grid.size:
        return True
    workers, at_once = workers_of(executor), True
    scheduler = Scheduler(workers, job, grid, table.missing(retry=retry), record, stop.is_set)
    try:
        with first_interrupt(stop.set):
            scheduler.run()
        at_once = False
    finally:
        scheduler.cancel()
        workers.close(at_once=at_once)
    table.flush()
    record([])
    return table.done + table.failed == grid.size and not (retry and stop.is_set())


def _close(table: StudyTable) -> None:
    """Keep what is finished as far as that is possible."""
    try:
        table.close(complete="interrupted")
    except SweepError:
        return  # a full disk has been reported already


def _kept(table: StudyTable) -> str:
    finished = f"{table.done + table.failed} of {table.study.grid.size} points are finished"
    if isinstance(table, Store):
        return f"{finished} and kept in {table.path}; the same call computes the others"
    return f"{finished}, the `results` of this exception; with a store the study could be resumed"


# -------------------------------------------------------------------------------------- arguments


def check_arguments(
    function: Any,
    grid: Grid,
    fixed: Mapping[str, Any],
    *,
    called: tuple[str, str] = ("grid", "fixed"),
) -> bool:
    """Refuse arguments that the function does not take; return whether it takes a generator.

    ``called`` are the names of ``grid`` and ``fixed`` in the errors.
    """
    if not callable(function):
        refuse("function", "something to call", function, TypeError)
    both = sorted(set(grid.names) & set(fixed))
    if both:
        msg = f"{called[1]}: expected parameters that are no axis; got {', '.join(both)}"
        raise ValueError(msg)
    try:
        parameters = inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False  # some compiled functions have no signature
    if not any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        known = [name for name in parameters if name != "rng"]
        names(called[0], grid.names, known)
        names(called[1], fixed, known)
    given = {*grid.names, *fixed, "rng"}
    missing = [name for name, p in parameters.items() if _is_needed(p) and name not in given]
    if missing:
        msg = f"{called[0]}: expected all that the function needs; {', '.join(missing)} is missing"
        raise ValueError(msg)
    return "rng" in parameters


def _is_needed(parameter: inspect.Parameter) -> bool:
    optional = (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL)
    return parameter.default is parameter.empty and parameter.kind not in optional


def _seed(rng: Any, *, wanted: bool) -> int | None:
    if not wanted:
        if rng is not None:
            refuse("rng", "none for a function without a parameter rng", rng)
        return None
    if rng is None or isinstance(rng, np.random.Generator):
        return 0 if rng is None else int(rng.integers(2**63))
    return whole("rng", rng, least=0, most=MOST)


def _name(function: Any) -> str:
    inner = function
    while isinstance(inner, partial):
        inner = inner.func
    if not hasattr(inner, "__qualname__"):
        inner = type(inner)
    return f"{inner.__module__}:{inner.__qualname__}"
