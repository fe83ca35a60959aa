"""Results of a study as one dataset: units, provenance, and what became of every point."""

import platform
import shlex
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner import __version__
from polycorner.errors import PolycornerError
from polycorner.sweeps.grid import Axis, Grid, written
from polycorner.sweeps.points import Column, Outcome

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 1
PENDING, DONE, FAILED = 0, 1, 2
STATUS: dict[str, Any] = {
    "long_name": "what became of the point",
    "flag_values": [PENDING, DONE, FAILED],
    "flag_meanings": "pending done failed",
}
MESSAGE: dict[str, Any] = {"long_name": "why the point failed"}
SECONDS: dict[str, Any] = {"long_name": "time the point took", "units": "s"}
BLOCK = 4096  # points whose state is looked up at a time


class SweepError(PolycornerError):
    """A study that had to stop: its workers are gone, or its store cannot be written.

    Attributes
    ----------
    results : xarray.Dataset or None
        What was finished.
    """

    def __init__(self, message: str, results: "xr.Dataset | None" = None) -> None:
        super().__init__(message)
        self.results = results


@dataclass(frozen=True)
class Study:
    """What is computed, where and from which seed: all that a result depends on.

    Attributes
    ----------
    grid : Grid
    function : str
        ``module:name`` of the function.
    fixed : mapping from str
        Arguments that are the same everywhere.
    seed : int or None
    """

    grid: Grid
    function: str
    fixed: dict[str, Any]
    seed: int | None

    def identity(self) -> dict[str, Any]:
        """Return what two studies share that are the same."""
        return {
            "format": FORMAT,
            "function": self.function,
            "axes": self.grid.description(),
            "fixed": self.fixed,
            "seed": self.seed,
        }

    def attributes(self) -> dict[str, Any]:
        """Return the provenance, as attributes of a dataset."""
        return {
            "polycorner_sweep": FORMAT,
            "function": self.function,
            "seed": "none" if self.seed is None else self.seed,
            "fixed": written(self.fixed, "fixed"),
            "study": written(self.identity(), "fixed"),
            "versions": written([versions()], "versions"),
            "command": shlex.join(sys.argv),
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "complete": "unfinished",
        }


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    return {
        "polycorner": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }


@dataclass
class Progress:
    """What became of each point, and how many are done and failed."""

    status: NDArray[np.int8]
    done: int = field(init=False)
    failed: int = field(init=False)

    def __post_init__(self) -> None:
        self.done, self.failed = (int((self.status == flag).sum()) for flag in (DONE, FAILED))

    @property
    def total(self) -> int:
        """How many points there are."""
        return len(self.status)

    def pending(self, *, retry: bool) -> Iterator[int]:
        """Yield the points that are still to be computed; failed ones too if asked."""
        for start in range(0, self.total, BLOCK):
            block = self.status[start : start + BLOCK]
            todo = (block == PENDING) | (retry & (block == FAILED))
            yield from (start + np.flatnonzero(todo)).tolist()

    def mark(self, outcome: Outcome) -> None:
        """Note what became of a point."""
        was, now = self.status[outcome.number], FAILED if outcome.message else DONE
        self.done += int(now == DONE) - int(was == DONE)
        self.failed += int(now == FAILED) - int(was == FAILED)
        self.status[outcome.number] = now


def fitting(outcome: Outcome, columns: Sequence[Column]) -> Outcome:
    """Return an outcome whose columns are those of the study, or a failed one that says not."""
    if outcome.message or outcome.columns == tuple(columns):
        return outcome
    order = {column.name: k for k, column in enumerate(outcome.columns)}
    if sorted(order) == sorted(column.name for column in columns):
        places = [order[column.name] for column in columns]
        if [outcome.columns[k] for k in places] == list(columns):
            values = tuple(outcome.values[k] for k in places)
            return Outcome(outcome.number, outcome.seconds, tuple(columns), values)
    message = (
        f"ValueError: function: expected {_listing(columns)}, as at other points; "
        f"it returned {_listing(outcome.columns)}"
    )
    return Outcome(outcome.number, outcome.seconds, message=message)


def _listing(columns: Iterable[Column]) -> str:
    return ", ".join(
        f"{c.name}{list(c.shape) or ''}{f' in {c.unit}' if c.unit else ''}" for c in columns
    )


def blank(column: Column, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return an array for a column where nothing is known: nan, or empty texts."""
    if column.text:
        return np.full(shape, "", dtype=np.dtypes.StringDType())
    return np.full((*shape, *column.shape), np.nan)


def dimensions(grid: Grid, column: Column) -> tuple[str, ...]:
    """Return the names of a column's dimensions: those of the grid, then ``name_0, name_1...``."""
    return (*grid.names, *(f"{column.name}_{k}" for k in range(len(column.shape))))


def units(unit: str) -> dict[str, Any]:
    """Return the attribute that says a unit, if there is one."""
    return {"units": unit} if unit else {}


def coordinate(axis: Axis) -> NDArray[Any]:
    """Return the values of an axis as an array."""
    return np.array(axis.values)


class MemoryTable:
    """Results kept in memory."""

    def __init__(self, study: Study) -> None:
        self.study, self.complete = study, "unfinished"
        self.columns: tuple[Column, ...] = ()
        size = study.grid.size
        self.progress = Progress(np.zeros(size, dtype=np.int8))
        self.arrays: list[NDArray[Any]] = []
        self.message = np.full(size, "", dtype=np.dtypes.StringDType())
        self.seconds = np.full(size, np.nan)

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Take the outcomes of points."""
        for given in outcomes:
            if not self.columns and given.columns:
                self.columns = given.columns
                self.arrays = [blank(c, (self.study.grid.size,)) for c in self.columns]
            outcome = fitting(given, self.columns)
            for array, value in zip(self.arrays, outcome.values, strict=bool(outcome.values)):
                array[outcome.number] = value
            self.message[outcome.number] = outcome.message
            self.seconds[outcome.number] = outcome.seconds
            self.progress.mark(outcome)

    def close(self, *, complete: str) -> None:
        """Note how the study ended."""
        self.complete = complete

    def abandon(self) -> None:
        """Let go of what there is."""

    def dataset(self) -> "xr.Dataset":
        """Return the results."""
        import xarray as xr

        grid = self.study.grid
        data: dict[str, Any] = {
            column.name: (
                dimensions(grid, column),
                array.reshape(*grid.shape, *column.shape),
                units(column.unit),
            )
            for column, array in zip(self.columns, self.arrays, strict=True)
        }
        rows: tuple[NDArray[Any], ...] = (self.progress.status, self.message, self.seconds)
        for name, array, about in zip(
            ("status", "message", "seconds"), rows, (STATUS, MESSAGE, SECONDS), strict=True
        ):
            data[name] = (grid.names, array.reshape(grid.shape), dict(about))
        coordinates = {
            name: (name, coordinate(axis), units(axis.unit)) for name, axis in grid.axes.items()
        }
        return xr.Dataset(data, coordinates, self.study.attributes() | {"complete": self.complete})
