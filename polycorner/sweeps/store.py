"""Results of a study in a zarr store that can be killed at any moment and resumed.

::

    store/zarr.json    the study, its provenance, its columns, checksums
    store/<axis>/      values of a parameter
    store/<column>/    results, chunk by chunk; likewise message, seconds and status
    store.lock         held by the process that writes

Rows are written after every point, or as often as writing takes a twentieth of the time.  Each
file appears whole or not at all, and the status last: what has a status is there.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner import forms
from polycorner.atomic import is_part, is_store, lock_store
from polycorner.checks import missing_extra
from polycorner.kinds import checked
from polycorner.sweeps.metadata import (
    ROOT,
    check_store,
    checked_root,
    reading,
    stored_columns,
    stored_grid,
    write_root,
)
from polycorner.sweeps.study import Study, SweepError, difference, versions
from polycorner.sweeps.tables import (
    FAILED,
    PENDING,
    StudyTable,
    Variable,
    coordinate_arrays,
    coordinates,
    variables,
)

if TYPE_CHECKING:
    import xarray as xr

POINTS = 4096  # in a chunk, at most
BYTES = 4 << 20  # in a chunk, at most, unless one point has more


class Store(StudyTable):
    """Results on disk, in a folder that is created if it does not exist.

    Raises
    ------
    ImportError
        If zarr is missing.
    ValueError
        If the folder holds something else, another study or a damaged store, or is in use.
    SweepError
        If it cannot be written.
    """

    def __init__(self, path: Path, study: Study) -> None:
        need_zarr()
        super().__init__(study)
        self.path = path
        self.present: list[str] = []  # names of the arrays on disk
        check_study(path, study)
        with self._writing():
            path.mkdir(parents=True, exist_ok=True)
            self.lock = lock_store(path)
        try:
            with self._writing():
                self._open()
        except BaseException:
            self.lock.release()
            raise

    def _open(self) -> None:
        check_study(self.path, self.study)
        for part in filter(is_part, self.path.iterdir()):  # of a process that was killed
            part.unlink()
        if (self.path / ROOT).exists():
            self.about = check_store(self.path)
            self.present = list(checked_root(self.path)[1])
            self.columns = stored_columns(self.about)
        else:
            self.about = self.study.attributes()
            write_root(self.path, self.about, [])
        for new in coordinates(self.study.grid):
            if new.name not in self.present:
                self._create(new, new.shape)
                self.arrays[new.name][...] = new.fill
        self.create()
        with reading(self.path / "status"):
            status = np.asarray(self.arrays["status"][...]).reshape(-1)
            forms.array("status", status, "i", (-1,), least=PENDING, most=FAILED)
        self.set_status(status)

    def create(self) -> None:
        """Make the arrays that do not exist yet; they count once the root lists them."""
        with self._writing():
            self._create_missing()

    def _create_missing(self) -> None:
        import zarr

        for new in variables(self.study.grid, self.columns):
            if new.name not in self.present:
                self._create(new, _chunk_shape(self.study.grid.shape, new))
            elif new.name not in self.arrays:
                self.arrays[new.name] = zarr.open_array(self.path / new.name, mode="r+")
        made = [*self.present, *(name for name in self.arrays if name not in self.present)]
        if made != self.present:
            columns = json.dumps([asdict(column) for column in self.columns])
            self.about = self.about | {"columns": columns}
            write_root(self.path, self.about, made)
            self.present = made

    def _create(self, new: Variable, chunk: tuple[int, ...]) -> None:
        import zarr
        from zarr.codecs import Crc32cCodec, ZstdCodec

        array: Any = zarr.create_array(
            self.path / new.name,
            shape=new.shape,
            chunks=chunk,
            dtype="string" if new.dtype.kind == "T" else new.dtype,
            compressors=[ZstdCodec(), Crc32cCodec()],
            fill_value=None if isinstance(new.fill, np.ndarray) else new.fill,
            attributes=new.attributes,
            dimension_names=new.dimensions,
            overwrite=True,
        )
        self.arrays[new.name] = array

    def write(self, numbers: NDArray[np.int64], rows: Mapping[str, Any]) -> None:
        """Write rows into the chunks, the status last."""
        index = np.stack(np.unravel_index(numbers, self.study.grid.shape), axis=1)
        with self._writing():
            self._note_start()
            for name, values in rows.items():
                self._write_points(name, index, values)

    def _note_start(self) -> None:
        """Note, before rows are written, that the study is unfinished and which versions work."""
        known = json.loads(self.about["versions"])
        if versions() not in known:
            known.append(versions())
        about = self.about | {"complete": "unfinished", "versions": json.dumps(known)}
        if about != self.about:
            write_root(self.path, about, self.present)
            self.about = about

    def _write_points(self, name: str, index: Any, values: Any) -> None:
        """Write the values at some points, chunk by chunk, and wait for the disk."""
        array: Any = self.arrays[name]
        sizes = np.array(array.chunks[: index.shape[1]])
        chunk = index // sizes
        for place in np.unique(chunk, axis=0):
            here, corner = (chunk == place).all(axis=1), place * sizes
            region = tuple(slice(a, a + n) for a, n in zip(corner, sizes, strict=True))
            slab = np.array(array[region])
            slab[tuple((index[here] - corner).T)] = values[here]
            array[region] = slab
            rest = "0" * (values.ndim - 1)
            file = self.path.joinpath(name, "c", *map(str, place), *rest)
            if file.exists():  # zarr does not write chunks without a value
                with file.open("rb+") as opened:
                    os.fsync(opened.fileno())

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            why = error.strerror or error
            msg = f"store: expected a disk that can be written; {self.path}: {why}"
            raise SweepError(msg) from error

    def close(self, *, complete: str) -> None:
        """Write everything that waits and release the store."""
        try:
            with self._writing():
                self.flush()
                if self.about["complete"] != complete:
                    self.about = self.about | {"complete": complete}
                    write_root(self.path, self.about, self.present)
        finally:
            self.lock.release()

    def dataset(self) -> "xr.Dataset":
        """Return the results; values are read from the disk when they are asked for."""
        return open_results(self.path)


def need_zarr() -> None:
    """Raise ImportError with the command that installs zarr."""
    if find_spec("zarr") is None:
        package, extra = "zarr", "sweep"
        raise missing_extra(package, extra)


def check_study(path: Path, study: Study) -> None:
    """Refuse a folder with anything but this study, in a sentence that names the difference."""
    if not is_store(path, ROOT, "a store of a sweep"):
        return
    found = json.loads(checked_root(path)[0]["study"])
    differs = difference(json.loads(study.attributes()["study"]), found)
    if differs:
        msg = f"store: expected {differs}; {path} is of another study"
        raise ValueError(msg)


def stored_state(path: Path) -> str:
    """Return "unfinished", "interrupted" or "finished", or an empty text without a store."""
    return str(checked_root(path)[0]["complete"]) if (path / ROOT).exists() else ""


@checked
def open_results(path: str | Path) -> "xr.Dataset":
    """Return the results in a store, finished or not, after checking every file of it.

    While another process writes it these are the results that were there when it was opened, and
    values of later ones at points that are still pending by their status.

    Parameters
    ----------
    path : path
        What :func:`~polycorner.sweeps.sweep` was given as ``store``.

    Returns
    -------
    xarray.Dataset
        Its values are read when they are asked for.

    Raises
    ------
    ImportError
        If zarr is missing.
    ValueError
        If there is no such store, or a file of it was changed or damaged; it is named.
    """
    need_zarr()
    import xarray as xr

    folder = Path(path)
    about = check_store(folder)
    with reading(folder):  # every value once: what is asked for later can be read
        found: xr.Dataset = xr.open_zarr(folder, consolidated=True, chunks=None, decode_times=False)
        found["status"].load()  # first, as it is written last
        for array in found.variables.values():
            _ = [array[piece].values for piece in _pieces(array)]
    names = [column.name for column in stored_columns(about)]
    ordered: xr.Dataset = found[[*names, "message", "seconds", "status"]]
    ordered.attrs = {
        name: value
        for name, value in about.items()
        if name not in ("columns", "checksums", "sha256")
    }
    return ordered.assign_coords(coordinate_arrays(stored_grid(about)))


def _pieces(array: Any) -> Iterator[tuple[slice, ...]]:
    """Yield where the chunks of an array are."""
    sizes = array.encoding["chunks"]
    for place in np.ndindex(*(-(-n // size) for n, size in zip(array.shape, sizes, strict=True))):
        yield tuple(slice(k * size, (k + 1) * size) for k, size in zip(place, sizes, strict=True))


def _chunk_shape(grid: tuple[int, ...], new: Variable) -> tuple[int, ...]:
    """Return the shape of chunks: a rectangle of consecutive points, with all values of each.

    Of a grid of 5 x 4 x 10 points, a chunk of at most 100 has 2 x 4 x 10.
    """
    values = new.shape[len(grid) :]
    room = max(1, min(POINTS, BYTES // (8 * max(1, math.prod(values)))))
    sizes: list[int] = []
    for length in reversed(grid):
        sizes.append(min(length, max(1, room)))
        room = room // length if room >= length else 0
    return (*reversed(sizes), *(max(1, length) for length in values))
