"""Parameter studies: a function at every point of a grid, on any number of workers, for days."""

import inspect
import json
import os
import threading
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from polycorner.errors import nearest
from polycorner.interrupts import first_interrupt
from polycorner.sweeps.grid import Axis, Grid, written
from polycorner.sweeps.identity import stored_study
from polycorner.sweeps.points import Job, Outcome
from polycorner.sweeps.results import MemoryTable, Study, SweepError
from polycorner.sweeps.scheduling import Dispatch
from polycorner.sweeps.store import Store, open_results
from polycorner.sweeps.workers import hired

if TYPE_CHECKING:
    import xarray as xr

Report: TypeAlias = Callable[[int, int, int], object]

__all__ = ["Axis", "Grid", "SweepError", "open_results", "sweep"]


def sweep(
    function: Callable[..., Mapping[str, Any]],
    grid: "Mapping[str, Any] | Grid",
    *,
    executor: Any = None,
    rng: int | None = None,
    fixed: Mapping[str, Any] | None = None,
    store: "str | os.PathLike[str] | None" = None,
    retry: bool = False,
    progress: Report | None = None,
) -> "xr.Dataset":
    """Return ``function`` at every point of a grid as one dataset.

    A point where the function raises is a row like any other: its status is 2 (failed), its
    message the type and the sentence of the exception, its results are nan.  Nothing depends on
    how many workers there are, on the order they finish in, or on how often a study was stopped.

    Parameters
    ----------
    function : callable
        ``function(**point, **fixed)`` returns a mapping from names to numbers, arrays of numbers
        or texts, each of them alone or as ``(value, unit)``; the same names and shapes everywhere.
        If it has a parameter ``rng`` it gets a generator of its own at each point, spawned from the
        seed by the point's number.  Workers elsewhere have to be able to load it.
    grid : mapping from str to Axis
        The values of each parameter: an :class:`Axis`, values alone, or ``(values, unit)``.  All
        combinations are computed, the last axis running fastest.
    executor : optional
        None (default) computes here; a number starts so many processes, replaced when they die;
        otherwise any ``concurrent.futures.Executor`` or a ``distributed.Client``, which stay open.
    rng : int, optional
        Seed of the random streams; by default that of the store, or a new one, which the result
        tells.
    fixed : mapping, optional
        Further arguments, the same at every point: numbers, texts, lists and mappings of such.
    store : path, optional
        A folder to keep the results in, as zarr arrays.  Killed at any moment, the same call goes
        on with what is missing.
    retry : bool, optional
        Compute points that failed once more.
    progress : callable, optional
        Called with the numbers of points done, failed, and in all.

    Returns
    -------
    xarray.Dataset
        Results, ``status`` (0 pending, 1 done, 2 failed), ``message`` and ``seconds`` over the
        axes; as attributes the provenance, and ``complete``: "finished" or "interrupted".

    Raises
    ------
    TypeError, ValueError
        Naming the argument; also if the store is of another study or in use.
    ImportError
        If a store is asked for and zarr is missing.
    SweepError
        If the workers are gone or the store cannot be written; what was finished is kept.

    Notes
    -----
    The first Ctrl-C waits for the points under way (a cluster's are let go) and returns what there
    is, the rest being pending; a second one ends the study at once, and what is in the store stays.

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
    path = None if store is None else Path(store)
    seed = _seed(rng, path, wanted=random)
    study = Study(axes, _name(function), json.loads(written(constants, "fixed")), seed)
    table = MemoryTable(study) if path is None else Store(path, study)
    try:
        finished = _compute(table, Job(function, constants, seed), executor, retry, progress)
        table.close(complete="finished" if finished else "interrupted")
    except SweepError as error:
        _settle(table)
        msg = f"{error}; {_kept(table)}"
        raise SweepError(msg, results=table.dataset()) from error
    except BaseException:
        _settle(table)
        raise
    return table.dataset()


def _compute(
    table: "MemoryTable | Store", job: Job, executor: Any, retry: bool, progress: Report | None
) -> bool:
    """Compute what is missing, or a part of it until Ctrl-C; return whether it is all there."""
    now, stop = table.progress, threading.Event()

    def record(outcomes: list[Outcome]) -> None:
        table.add(outcomes)
        if progress is not None:
            progress(now.done, now.failed, now.total)

    record([])
    if now.done + (0 if retry else now.failed) == now.total:
        return True
    crew, at_once = hired(executor), True
    todo = now.pending(retry=retry)
    dispatch = Dispatch(crew, job, table.study.grid, todo, record, stop.is_set)

    def stopped() -> None:
        stop.set()
        dispatch.wake()

    try:
        with first_interrupt(stopped):
            dispatch.run()
        at_once = False
    finally:
        dispatch.cancel()
        crew.leave(at_once=at_once)
    return now.done + now.failed == now.total and not (retry and stop.is_set())


def _settle(table: "MemoryTable | Store") -> None:
    """Bring what is finished into order, as far as that goes."""
    try:
        table.close(complete="interrupted")
    except SweepError:
        table.abandon()


def _kept(table: "MemoryTable | Store") -> str:
    now = table.progress
    finished = f"{now.done + now.failed} of {now.total} points are finished"
    if isinstance(table, Store):
        return f"{finished} and kept in {table.path}; the same call goes on with the others"
    return f"{finished}, the `results` of this exception; a store would let the study go on"


# ------------------------------------------------------------------------------------ what is asked


def check_arguments(
    function: Any,
    grid: Grid,
    fixed: Mapping[str, Any],
    *,
    names: tuple[str, str] = ("grid", "fixed"),
) -> bool:
    """Refuse arguments that the function does not take; return whether it takes a generator.

    ``names`` is what ``grid`` and ``fixed`` are called in the sentence of the error.
    """
    if not callable(function):
        msg = f"function: expected something to call; got {function!r}"
        raise TypeError(msg)
    both = sorted(set(grid.names) & set(fixed))
    if both:
        msg = f"{names[1]}: expected parameters that are no axis; got {', '.join(both)}"
        raise ValueError(msg)
    try:
        parameters = inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False  # some compiled functions do not tell
    if not any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        _check_names(names[0], grid.names, parameters)
        _check_names(names[1], tuple(fixed), parameters)
    given = {*grid.names, *fixed, "rng"}
    missing = [name for name, p in parameters.items() if _is_needed(p) and name not in given]
    if missing:
        msg = f"{names[0]}: expected all that the function needs; {', '.join(missing)} is missing"
        raise ValueError(msg)
    return "rng" in parameters


def _is_needed(parameter: inspect.Parameter) -> bool:
    optional = (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL)
    return parameter.default is parameter.empty and parameter.kind not in optional


def _check_names(argument: str, names: tuple[str, ...], parameters: Mapping[str, Any]) -> None:
    known = [name for name in parameters if name != "rng"]
    for name in names:
        if name not in known:
            msg = f"{argument}: expected names among {', '.join(known)}; got {nearest(name, known)}"
            raise ValueError(msg)


def _seed(rng: Any, path: Path | None, *, wanted: bool) -> int | None:
    if not wanted and rng is not None:
        msg = f"rng: expected none for a function without a parameter rng; got {rng!r}"
        raise ValueError(msg)
    if not wanted:
        return None
    if rng is None:
        stored = None if path is None else stored_study(path)
        if stored is not None and stored["seed"] is not None:
            return int(stored["seed"])
        return int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer) or not 0 <= rng < 2**63:
        msg = f"rng: expected a seed, a whole number from 0 to 2^63 - 1; got {rng!r}"
        raise ValueError(msg)
    return int(rng)


def _name(function: Any) -> str:
    inner = function
    while isinstance(inner, partial):
        inner = inner.func
    if not hasattr(inner, "__qualname__"):
        inner = type(inner)
    return f"{inner.__module__}:{inner.__qualname__}"
