"""Results of a study in a zarr store that can be killed at any moment and resumed.

::

    store/zarr.json    the study, its provenance, its columns, checksums
    store/<axis>/      values of a parameter
    store/<column>/    results, chunk by chunk; likewise message, seconds and status
    store.lock         held by the process that writes

Rows are written after every point, or as often as writing takes a twentieth of the time.  Each
file appears whole or not at all, and the status last: what has a status is there.

A chunk ends in its CRC-32C, written by zarr's codec.  The root ``zarr.json`` holds the SHA-256
digests of the metadata of all arrays, the numbers of their chunks where the study is finished, and
its own, computed with zeros in its place.  Whoever forges a store can give it checksums that fit,
and zarr follows the metadata: so these may only be what the study and its results ask for.
"""

import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict
from functools import partial
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner import checks, forms
from polycorner.atomic import is_part, is_store, lock_store, write_atomically
from polycorner.checks import missing_extra, refuse
from polycorner.container import one_sentence
from polycorner.kinds import checked
from polycorner.sweeps.grid import Axis, Grid
from polycorner.sweeps.points import Column
from polycorner.sweeps.study import Study, SweepError, difference, versions
from polycorner.sweeps.tables import (
    FAILED,
    PENDING,
    TEXT,
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
ROOT = "zarr.json"
ZEROS = "0" * 64
DIGEST = re.compile(rb'"sha256": "([0-9a-f]{64})"')
CONSOLIDATED = {"kind": "inline", "must_understand": False}
_AXIS = {"name": forms.text, "unit": forms.text, "values": forms.many(forms.anything)}
_STUDY = {
    "axes": forms.many(forms.entries(_AXIS)),
    "function": forms.text,
    "fixed": forms.mapped(forms.text, forms.anything),
    "seed": forms.anything,
}
_ZARR = partial(checks.whole, least=3, most=3)
_COLUMN = {
    "name": forms.text,
    "unit": forms.text,
    "text": forms.flag,
    "shape": forms.made(forms.many(forms.count), tuple),
}


def reading(path: str | os.PathLike[str]) -> AbstractContextManager[None]:
    """Turn whatever the content of a file makes a reader raise into one sentence naming it."""
    said = f"store: expected a store of a sweep; {path} is damaged"
    return one_sentence(lambda why: ValueError(f"{said} ({why})"))


def check_root(document: Any) -> None:
    """Check the attributes in the root of a store, and the metadata of its arrays."""
    told = forms.entries({"study": forms.text, "versions": forms.text, "checksums": forms.text})
    states = forms.word("unfinished", "interrupted", "finished")
    rest = forms.entries({"complete": states}, {"columns": forms.text})
    arrays = {"metadata": forms.mapped(forms.text, forms.anything), "kind": forms.word("inline")}
    root: dict[str, forms.Form] = {
        "zarr_format": _ZARR,
        "node_type": forms.word("group"),
        "attributes": told,
        "consolidated_metadata": forms.entries(arrays),
    }
    forms.entries(root)("", document)
    about, metadata = document["attributes"], document["consolidated_metadata"]["metadata"]
    rest("attributes", about)
    checksums = json.loads(about["checksums"])
    counts = {"chunks": forms.mapped(forms.text, forms.count)}
    forms.entries({"metadata": forms.mapped(forms.text, forms.text)}, counts)(
        "checksums", checksums
    )
    forms.many(forms.anything)("versions", json.loads(about["versions"]))
    grid, columns = stored_grid(about), stored_columns(about)
    known = {new.name: new for new in (*coordinates(grid), *variables(grid, columns))}
    checks.names("arrays", metadata, known)
    checks.names("checksums", metadata, checksums["metadata"])
    for name, entry in metadata.items():
        _array(known[name])(name, entry)


def stored_grid(about: Mapping[str, Any]) -> Grid:
    """Return the grid of the study in a store."""
    study = forms.entries(_STUDY)("study", json.loads(about["study"]))
    return Grid({axis["name"]: Axis(axis["values"], axis["unit"]) for axis in study["axes"]})


def stored_columns(about: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns of the results from the attributes of a store."""
    column = forms.made(forms.entries(_COLUMN), lambda entry: Column(**entry))
    return tuple(forms.many(column)("columns", json.loads(about.get("columns", "[]"))))


def _array(new: Variable) -> forms.Form:
    """Return the form of the metadata of an array."""
    kind = "string" if new.dtype is TEXT else str(new.dtype)
    shape = forms.row(*(partial(checks.whole, least=n, most=n) for n in new.shape))
    chunks = forms.row(*(partial(checks.whole, least=1, most=max(1, n)) for n in new.shape))
    regular = {"configuration": forms.entries({"chunk_shape": chunks})}
    codec = forms.entries({"name": forms.word("bytes", "vlen-utf8", "zstd", "crc32c")})
    required: dict[str, forms.Form] = {
        "zarr_format": _ZARR,
        "node_type": forms.word("array"),
        "shape": shape,
        "data_type": forms.word(kind),
        "chunk_grid": forms.entries({"name": forms.word("regular"), **regular}),
        "chunk_key_encoding": forms.entries({"name": forms.word("default")}),
        "codecs": forms.many(codec),
        "dimension_names": forms.row(*map(forms.word, new.dimensions)),
    }
    return forms.entries(required, {"storage_transformers": forms.row()})


# --------------------------------------------------------------------------------------- checksums


def write_root(path: Path, attributes: dict[str, Any], arrays: Iterable[str]) -> None:
    """Write the metadata of a store: its attributes, and what its arrays are.

    Chunks are counted if the attribute ``complete`` is "finished".
    """
    contents = {name: (path / name / ROOT).read_bytes() for name in arrays}
    checks: dict[str, Any] = {
        "metadata": {name: sha256(content).hexdigest() for name, content in contents.items()}
    }
    if attributes["complete"] == "finished":
        checks["chunks"] = {name: len(chunks(path / name)) for name in contents}
    metadata = {name: json.loads(content) for name, content in contents.items()}
    document = {
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes | {"checksums": json.dumps(checks), "sha256": ZEROS},
        "consolidated_metadata": CONSOLIDATED | {"metadata": metadata},
    }
    content = json.dumps(document, indent=2, allow_nan=False).encode()
    write_atomically(
        path / ROOT, content.replace(ZEROS.encode(), sha256(content).hexdigest().encode(), 1)
    )


def checked_root(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the attributes of a store and the metadata of its arrays by name.

    Raises
    ------
    ValueError
        If there is no store of a sweep, or its metadata was changed.
    """
    file = path / ROOT
    try:
        content = file.read_bytes()
    except OSError as error:
        msg = f"store: expected a store of a sweep; {file} cannot be read ({error.strerror})"
        raise ValueError(msg) from error
    if b'"polycorner_sweep": 1,' in content:
        msg = f"store: expected one of format 2; {path} has format 1, of polycorner 0.1"
        raise ValueError(msg)
    found = DIGEST.search(content)
    if found is None and b"polycorner" not in content:
        msg = f"store: expected a store of a sweep; {file} is damaged or of something else"
        raise ValueError(msg)
    blank = b"" if found is None else content.replace(found[1], ZEROS.encode(), 1)
    if found is None or sha256(blank).hexdigest().encode() != found[1]:
        raise _changed(file)
    with reading(file):
        document = json.loads(content)
        check_root(document)
    return document["attributes"], document["consolidated_metadata"]["metadata"]


def check_store(path: Path) -> dict[str, Any]:
    """Read every file of a store, which may be written meanwhile, and return its attributes.

    Raises
    ------
    ValueError
        Naming a file that was changed, or an array that lacks chunks.
    """
    while True:
        attributes, metadata = checked_root(path)
        try:
            _check_files(path, attributes, metadata)
        except ValueError:
            if checked_root(path)[0] != attributes:
                continue  # another process has written; what it wrote is checked instead
            raise
        return attributes


def _check_files(path: Path, attributes: dict[str, Any], metadata: dict[str, Any]) -> None:
    import google_crc32c

    checks = json.loads(attributes["checksums"])
    for name, about in metadata.items():
        file = path / name / ROOT
        content = _read(file)
        if sha256(content).hexdigest() != checks["metadata"][name]:
            raise _changed(file)
        with reading(file):
            if json.loads(content) != about:
                refuse(name, "the metadata in the root", "others")
        files = chunks(path / name)
        for file in files:
            content = _read(file)
            if not content and not file.exists():
                continue  # a retry has removed the messages of failures meanwhile
            if google_crc32c.value(content[:-4]).to_bytes(4, "little") != content[-4:]:
                raise _changed(file)
        expected = checks.get("chunks", {}).get(name, len(files))
        if len(files) != expected:
            msg = f"store: expected {expected} chunks in {path / name}; found {len(files)}"
            raise ValueError(msg)


def chunks(array: Path) -> list[Path]:
    """Return the files of the chunks of an array."""
    return sorted(file for file in (array / "c").rglob("*") if file.is_file() and not file.suffix)


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError:
        return b""


def _changed(file: Path) -> ValueError:
    return ValueError(
        f"store: expected a file as it was written; {file} was changed or damaged (checksum): "
        "restore it, or delete the store and compute the study anew"
    )


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
