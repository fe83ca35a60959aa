"""Tables of results: a row for every point of a grid, kept in memory."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner.searches import Clock
from polycorner.sweeps.grid import Grid
from polycorner.sweeps.points import Column, Outcome
from polycorner.sweeps.study import Study

if TYPE_CHECKING:
    import xarray as xr

PENDING, DONE, FAILED = 0, 1, 2
TEXT = np.dtypes.StringDType()


@dataclass(frozen=True)
class Variable:
    """An array of a dataset: name, dimensions, shape, type, value of pending points, attributes."""

    name: str
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: Any
    fill: Any
    attributes: dict[str, Any]


def variables(grid: Grid, columns: Iterable[Column]) -> list[Variable]:
    """Return the arrays of a study in the order in which they are written; the status is last."""
    results = [
        Variable(
            column.name,
            (*grid.names, *(f"{column.name}_{k}" for k in range(len(column.shape)))),
            (*grid.shape, *column.shape),
            TEXT if column.text else np.dtype(float),
            "" if column.text else math.nan,
            units(column.unit),
        )
        for column in columns
    ]
    status = {
        "long_name": "state of the point",
        "flag_values": [PENDING, DONE, FAILED],
        "flag_meanings": "pending done failed",
    }
    return [
        *results,
        Variable("message", grid.names, grid.shape, TEXT, "", {"long_name": "reason of a failure"}),
        Variable(
            "seconds", grid.names, grid.shape, np.dtype(float), math.nan,
            {"long_name": "time that the point took", "units": "s"},
        ),
        Variable("status", grid.names, grid.shape, np.dtype(np.int8), PENDING, status),
    ]  # fmt: skip


def coordinates(grid: Grid) -> list[Variable]:
    """Return the arrays of the parameters; the values of an axis are its ``fill``."""
    found = []
    for name, axis in grid.axes.items():
        values = np.array(axis.values)
        dtype: Any = TEXT if values.dtype.kind == "U" else values.dtype
        found.append(Variable(name, (name,), values.shape, dtype, values, units(axis.unit)))
    return found


def units(unit: str) -> dict[str, Any]:
    """Return the attribute for a unit, if there is one."""
    return {"units": unit} if unit else {}


class StudyTable:
    """The results of a study in memory."""

    def __init__(self, study: Study) -> None:
        self.study, self.complete = study, "unfinished"
        self.columns: tuple[Column, ...] = ()
        self.arrays: dict[str, Any] = {}  # of NumPy or zarr
        self.waiting: list[Outcome] = []  # to be written
        self.clock = Clock(self.flush, every=0)
        self.set_status(np.zeros(study.grid.size, dtype=np.int8))

    def set_status(self, status: NDArray[np.int8]) -> None:
        """Take the states of all points, and count them."""
        self.status, self.counts = status, np.bincount(status, minlength=3)

    @property
    def done(self) -> int:
        """Number of points that are done."""
        return int(self.counts[DONE])

    @property
    def failed(self) -> int:
        """Number of points that failed."""
        return int(self.counts[FAILED])

    def missing(self, *, retry: bool) -> Iterator[int]:
        """Yield the points that are still to be computed; with ``retry`` the failed ones as well.

        The states are those at the first point.
        """
        wanted = (self.status == PENDING) | (retry & (self.status == FAILED))
        yield from map(int, np.flatnonzero(wanted))

    def add(self, outcomes: Sequence[Outcome]) -> None:
        """Take the outcomes of points, and write what waits when it is time."""
        self.waiting += [self.fitting(outcome) for outcome in outcomes]
        self.clock.tick()

    def flush(self) -> None:
        """Write all rows that wait."""
        if self.waiting:
            self.create()
            numbers, rows = self.rows(self.waiting)
            self.write(numbers, rows)
            self.status[numbers] = rows["status"]
            self.set_status(self.status)
            self.waiting.clear()

    def fitting(self, outcome: Outcome) -> Outcome:
        """Return an outcome with the columns of the study, or a failure that names both.

        The first point that succeeds settles the columns.
        """
        if outcome.columns and not self.columns:
            self.columns = outcome.columns
            self.create()
        if outcome.message or outcome.columns == self.columns:
            return outcome
        given = dict(zip(outcome.columns, outcome.values, strict=True))
        if set(given) == set(self.columns):
            values = tuple(given[column] for column in self.columns)
            return Outcome(outcome.number, outcome.seconds, self.columns, values)
        message = (
            f"ValueError: function: expected {_listing(self.columns)}, as at other points; "
            f"it returned {_listing(outcome.columns)}"
        )
        return Outcome(outcome.number, outcome.seconds, message=message)

    def create(self) -> None:
        """Make the arrays that do not exist yet."""
        for new in variables(self.study.grid, self.columns):
            if new.name not in self.arrays:
                self.arrays[new.name] = np.full(new.shape, new.fill, dtype=new.dtype)

    def write(self, numbers: NDArray[np.int64], rows: Mapping[str, Any]) -> None:
        """Write the values of every array at some points."""
        index = np.unravel_index(numbers, self.study.grid.shape)
        for name, values in rows.items():
            self.arrays[name][index] = values

    def rows(self, outcomes: Sequence[Outcome]) -> tuple[NDArray[np.int64], dict[str, Any]]:
        """Return the numbers of points and the values of every array there."""
        count = len(outcomes)
        found: dict[str, Any] = {}
        for new in variables(self.study.grid, self.columns):
            shape = (count, *new.shape[len(self.study.grid.shape) :])
            found[new.name] = np.full(shape, new.fill, dtype=new.dtype)
        for row, outcome in enumerate(outcomes):
            for column, value in zip(outcome.columns, outcome.values, strict=True):
                found[column.name][row] = value
            found["message"][row] = outcome.message
            found["seconds"][row] = outcome.seconds
            found["status"][row] = FAILED if outcome.message else DONE
        return np.array([outcome.number for outcome in outcomes]), found

    def close(self, *, complete: str) -> None:
        """Note how the study ended: "finished" or "interrupted"."""
        self.flush()
        self.complete = complete

    def dataset(self) -> "xr.Dataset":
        """Return the results."""
        import xarray as xr

        self.create()
        data = {
            new.name: (new.dimensions, self.arrays[new.name], new.attributes)
            for new in variables(self.study.grid, self.columns)
        }
        about = self.study.attributes() | {"complete": self.complete}
        return xr.Dataset(data, coordinate_arrays(self.study.grid), about)


def coordinate_arrays(grid: Grid) -> dict[str, Any]:
    """Return the parameters as xarray takes them."""
    return {new.name: (new.dimensions, new.fill, new.attributes) for new in coordinates(grid)}


def _listing(columns: Iterable[Column]) -> str:
    return ", ".join(
        f"{c.name}{list(c.shape) or ''}{f' in {c.unit}' if c.unit else ''}" for c in columns
    )
