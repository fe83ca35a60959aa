"""Results of a study in a zarr store that can be killed at any moment and gone on with.

::

    store/zarr.json             the study, its provenance, the columns
    store/<axis>/               values of a parameter
    store/<column>/             results, chunk by chunk; so are status, message and seconds
    store/journal/points.jsonl  what was finished since chunks were written last
    store/journal/lock          held by the process at work

A finished point goes into the journal first.  Now and then the journal's points are written into
the chunks, each of which appears whole or not at all, the status last; only then is the journal
emptied.  Killed in between, the same points are written once more.
"""

import json
import math
import time
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.sweeps.chunks import Chunks
from polycorner.sweeps.grid import written
from polycorner.sweeps.identity import (
    check_study,
    is_store,
    need_zarr,
    stored_columns,
    stored_study,
)
from polycorner.sweeps.journal import Journal, Lock
from polycorner.sweeps.points import Column, Outcome
from polycorner.sweeps.results import (
    MESSAGE,
    SECONDS,
    STATUS,
    Progress,
    Study,
    SweepError,
    blank,
    coordinate,
    dimensions,
    fitting,
    units,
    versions,
)

if TYPE_CHECKING:
    import xarray as xr

POINTS = 4096  # in a chunk, at most
BYTES = 4 << 20  # in a chunk, at most, as far as one point has less
FULL = 16 << 20  # bytes of the journal at which it is written into the chunks
OFTEN = 30.0  # s after which it is, unless that takes more than its share
SHARE = 0.02  # of the time, for writing chunks


class Store:
    """A table of results on disk.

    Parameters
    ----------
    path : Path
        The folder; it is made if need be.
    study : Study

    Raises
    ------
    ImportError
        If zarr is missing.
    ValueError
        If the folder holds something else, another study, or is in use.
    SweepError
        If it cannot be written.
    """

    def __init__(self, path: Path, study: Study) -> None:
        need_zarr()
        self.path, self.study = path, study
        check_study(path, study)
        with self._writing():
            self._take()

    def _take(self) -> None:
        """Open the store for this process alone."""
        folder = self.path / "journal"
        folder.mkdir(parents=True, exist_ok=True)
        try:
            self.lock = Lock(folder / "lock")
        except BlockingIOError as error:
            path = self.path
            msg = f"store: expected one that nothing else is writing; {path} is in use by {error}"
            raise ValueError(msg) from None
        try:
            check_study(self.path, self.study)
            self.journal = Journal(folder / "points.jsonl")
            self._open()
        except BaseException:
            self.abandon()
            raise

    def _open(self) -> None:
        import zarr

        if is_store(self.path):
            self.group: Any = zarr.open_group(self.path, mode="r+", zarr_format=3)
        else:
            about = self.study.attributes()
            self.group = zarr.create_group(self.path, zarr_format=3, attributes=about)
        self.group.require_group("journal")
        self._note_version()
        for name, axis in self.study.grid.axes.items():
            values = coordinate(axis)
            kind = "string" if values.dtype.kind == "U" else values.dtype
            array = self._array(name, values.shape, values.shape, kind, units(axis.unit), (name,))
            array[...] = values
        self.columns = stored_columns(self.group.attrs)
        grid, chunks = self.study.grid, Chunks(self.study.grid.shape, POINTS)
        for name, kind, about in (
            ("message", "string", MESSAGE),
            ("seconds", "float64", SECONDS),
            ("status", "int8", STATUS),
        ):
            self._array(name, grid.shape, chunks.sizes, kind, about, grid.names)
        self.progress = Progress(np.asarray(self.group["status"][...]).reshape(-1))
        self.waiting: dict[int, Outcome] = {}
        self.written, self.cost = time.monotonic(), 0.0
        for outcome in self.journal.read(self.columns):
            self.waiting[outcome.number] = outcome
            self.progress.mark(outcome)
        self._write()

    def _note_version(self) -> None:
        known = json.loads(str(self.group.attrs["versions"]))
        if versions() not in known:
            self.group.attrs["versions"] = written([*known, versions()], "versions")

    def _array(
        self, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], kind: Any,
        about: dict[str, Any], names: tuple[str, ...],
    ) -> Any:  # fmt: skip
        """Return an array of the group, made if it is not there."""
        if (self.path / name / "zarr.json").exists():
            return self.group[name]
        fill: Any = "" if kind == "string" else math.nan if kind == "float64" else 0
        return self.group.create_array(
            name, shape=shape, chunks=chunks, dtype=kind, fill_value=fill, attributes=about,
            dimension_names=names, overwrite=True,
        )  # fmt: skip

    def _chunks(self, column: Column) -> Chunks:
        size = 8 * max(1, math.prod(column.shape))
        return Chunks(self.study.grid.shape, max(1, min(POINTS, BYTES // size)))

    def _begin(self, columns: tuple[Column, ...]) -> None:
        """Make the arrays of the results; they count from when their names are in the group."""
        grid = self.study.grid
        for column in columns:
            self.group.create_array(
                column.name,
                shape=(*grid.shape, *column.shape),
                chunks=(*self._chunks(column).sizes, *column.shape),
                dtype="string" if column.text else "float64",
                fill_value="" if column.text else math.nan,
                attributes=units(column.unit),
                dimension_names=dimensions(grid, column),
                overwrite=True,
            )
        self.group.attrs["columns"] = json.dumps([asdict(column) for column in columns])
        self.columns = columns
        self._consolidate()

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Take the outcomes of points; they are in the journal when this returns."""
        fit = []
        for outcome in outcomes:
            if not self.columns and outcome.columns:
                with self._writing():
                    self._begin(outcome.columns)
            fit.append(fitting(outcome, self.columns))
        with self._writing():
            self.journal.add(fit)
            for outcome in fit:
                self.waiting[outcome.number] = outcome
                self.progress.mark(outcome)
            since = time.monotonic() - self.written
            if self.journal.size > FULL or since > max(OFTEN, self.cost / SHARE):
                self._write()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            why = error.strerror or error
            msg = f"store: expected a disk that can be written; {self.path}: {why}"
            raise SweepError(msg) from error

    def _write(self) -> None:
        """Write what waits into the chunks, and empty the journal."""
        if self.waiting:
            begun = time.monotonic()
            outcomes = [self.waiting[number] for number in sorted(self.waiting)]
            numbers = np.array([outcome.number for outcome in outcomes])
            for k, column in enumerate(self.columns):
                values = blank(column, (len(outcomes),))
                for row, outcome in enumerate(outcomes):
                    if outcome.values:
                        values[row] = outcome.values[k]
                self._chunks(column).write(
                    self.group[column.name], self.path / column.name, numbers, values
                )
            rows = {
                "message": np.array([o.message for o in outcomes], dtype=np.dtypes.StringDType()),
                "seconds": np.array([o.seconds for o in outcomes]),
                "status": self.progress.status[numbers],  # the last: it says that the others are in
            }
            for name, values in rows.items():
                chunks = Chunks(self.study.grid.shape, POINTS)
                chunks.write(self.group[name], self.path / name, numbers, values)
            self.waiting.clear()
            self.cost = time.monotonic() - begun
        self.journal.clear()
        self.written = time.monotonic()

    def _consolidate(self) -> None:
        import zarr

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # at the journal, and that zarr's format may grow
            zarr.consolidate_metadata(self.path)

    def close(self, *, complete: str) -> None:
        """Write everything into the chunks and let go of the store."""
        with self._writing():
            self._write()
            self.group.attrs["complete"] = complete
            self._consolidate()
        self.abandon()

    def abandon(self) -> None:
        """Let go of the store as it is; what is in the journal counts."""
        if hasattr(self, "journal"):
            self.journal.close()
        self.lock.release()

    def dataset(self) -> "xr.Dataset":
        """Return the results; values are read from the disk when they are asked for."""
        return open_results(self.path)


def open_results(path: str | Path) -> "xr.Dataset":
    """Return the results in a store, finished or not; values are read when they are asked for.

    Parameters
    ----------
    path : path
        What :func:`~polycorner.sweeps.execution.sweep` was given as ``store``.

    Raises
    ------
    ImportError
        If zarr is missing.
    ValueError
        If there is no such store.
    """
    need_zarr()
    import xarray as xr

    folder = Path(path)
    study = stored_study(folder)
    if study is None:
        msg = f"store: expected a store of a sweep; {folder} has none"
        raise ValueError(msg)
    found: xr.Dataset = xr.open_zarr(folder, consolidated=False, chunks=None, decode_times=False)
    names = [column.name for column in stored_columns(found.attrs)]
    coordinates = {
        axis["name"]: (axis["name"], np.array(axis["values"]), units(axis["unit"]))
        for axis in study["axes"]
    }
    about = {name: value for name, value in found.attrs.items() if name != "columns"}
    ordered = found[[*names, "status", "message", "seconds"]]
    ordered.attrs = about
    return ordered.assign_coords(coordinates)
