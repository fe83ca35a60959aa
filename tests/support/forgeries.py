"""Files that someone forged: entries replaced, dropped and shortened, with a digest that fits.

A :class:`Kept` thing is a file or folder of one kind with what reads it.  :func:`forged` changes a
copy; what reads it has to succeed, or to refuse it in one sentence that names the file.
"""

import contextlib
import io
import json
import random
import re
import shutil
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
import xarray as xr

from polycorner.container import FileKind
from polycorner.errors import PolycornerError

NUMBERS = [-1, 0, 1, 2, 7, -(2**63), 2**63, 10**12, 10**400, 0.5, -0.5, 1e12, 1e30, 1e300, -1e300]
NUMBERS += [float("nan"), float("inf"), 5e-324, 2**31, 10**9]
OTHERS = [None, True, "", "nan", "inf", "word", [], {}, [[]], [1, 2], {"a": 1}, "x" * 1000]
BYTES = 4  # places of a file that is damaged


@dataclass(frozen=True)
class Kept:
    """A file or folder, what forges a copy, and what reads it."""

    path: Path
    forge: Callable[[Path, random.Random], None]
    read: Callable[[Path], Any]


def forged(kept: Kept, folder: Path, seed: int) -> Path:
    """Return a forged copy."""
    rng, path = random.Random(seed), folder / kept.path.name
    (shutil.copytree if kept.path.is_dir() else shutil.copy)(kept.path, path)
    with warnings.catch_warnings(), contextlib.suppress(Exception):
        warnings.simplefilter("ignore")
        kept.forge(path, rng)  # what no library writes is no forgery
    return path


def outcome(kept: Kept, path: Path) -> str:
    """Read a file; return "read", "refused", or a foreign exception in words."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that overflow
            kept.read(path)
    except PolycornerError:
        return "refused"  # a simulation that goes on, but cannot be computed
    except (ValueError, TypeError) as error:
        told = str(error)
        if str(path) in told and "\n" not in told and len(told) < 1500:
            return "refused"
        return f"{type(error).__name__} without a name: {told[:300]}"
    except Exception as error:  # this is what is looked for
        return f"foreign: {error!r}"[:300]
    return "read"


def changed(entries: Any, rng: random.Random) -> Any:
    """Change one to three places of nested lists and mappings; return them."""
    for _ in range(rng.choice([1, 1, 2, 3])):
        place = _place(entries, rng)
        if place is None:
            break
        owner, key = place
        owner[key] = _other(owner, key, rng)
        if owner[key] is _DROPPED:
            del owner[key]
    return entries


_DROPPED = object()


def _place(entries: Any, rng: random.Random) -> tuple[Any, Any] | None:
    """Return a random place: each level of nesting is as likely to be left as to be entered."""
    owner, key, at = None, None, entries
    while isinstance(at, dict | list) and len(at) and (owner is None or rng.random() < 0.85):
        owner = at
        key = rng.choice(list(at)) if isinstance(at, dict) else rng.randrange(len(at))
        at = owner[key]
    return None if owner is None else (owner, key)


def _other(owner: Any, key: Any, rng: random.Random) -> Any:
    value = owner[key]
    if rng.random() < 0.1:
        return _DROPPED
    if isinstance(value, list) and rng.random() < 0.6:
        return rng.choice([value[:-1], value[1:], value * 2, value[::-1], [*value, value]])
    if isinstance(value, str) and rng.random() < 0.7:
        return rng.choice([value[:-1], value + value, "(" * 300, "9" * 5000, value[::-1]])
    if rng.random() < 0.75:
        return rng.choice(NUMBERS)
    return _deep(2000) if rng.random() < 0.1 else rng.choice(OTHERS)


def _deep(levels: int) -> Any:
    found: Any = []
    for _ in range(levels):
        found = [found]
    return found


def _dumped(entries: Any) -> str:
    try:
        return json.dumps(entries)
    except (ValueError, RecursionError):  # deeper, or larger, than Python writes
        return '{"a": ' + "[" * 5000 + "]" * 5000 + "}"


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Change some bytes, cut them out, or double them."""
    found = bytearray(content)
    for _ in range(rng.randrange(1, BYTES + 1)):
        at, size = rng.randrange(len(found) or 1), rng.choice([1, 1, 1, 8, 64])
        match rng.randrange(3):
            case 0:
                found[at : at + size] = rng.randbytes(min(size, len(found) - at))
            case 1 if len(found) > size:
                del found[at : at + size]
            case _:
                found[at:at] = found[at : at + size]
    return bytes(found)


def resealed(kind: FileKind, path: Path, content: bytes) -> None:
    """Write a content with a digest that fits."""
    kind.save(path, content)


def forge_bytes(kind: FileKind) -> Callable[[Path, random.Random], None]:
    """Return what damages the content of a file, with a digest that fits or without."""

    def forge(path: Path, rng: random.Random) -> None:
        if rng.random() < 0.2:
            path.write_bytes(damaged(path.read_bytes(), rng))
        else:
            resealed(kind, path, damaged(kind.load(path), rng))

    return forge


def forge_json(kind: FileKind) -> Callable[[Path, random.Random], None]:
    """Return what changes entries of JSON."""

    def forge(path: Path, rng: random.Random) -> None:
        if rng.random() < 0.1:
            return forge_bytes(kind)(path, rng)
        text = _dumped(changed(kind.load_json(path), rng))
        return resealed(kind, path, f"{text[:-1]},\n".encode())

    return forge


def forge_graph(kind: FileKind) -> Callable[[Path, random.Random], None]:
    """Return what changes numbers, words and tags of GraphML."""

    def forge(path: Path, rng: random.Random) -> None:
        if rng.random() < 0.2:
            return forge_bytes(kind)(path, rng)
        text = kind.load(path).decode()
        found = rng.choice(list(re.finditer(r'(?<=[>"])[^<>"\n]+(?=[<"])|<[^<>]*>', text)))
        new = str(rng.choice([_number(rng), found[0] * 2, "", "<a>" * 3000, "&x;", "[" * 3000]))
        text = text[: found.start()] + new + text[found.end() :]
        if rng.random() < 0.1:
            text = text.replace("<graphml", '<!DOCTYPE g [<!ENTITY x "y">]><graphml', 1)
        return resealed(kind, path, text.encode())

    return forge


def _number(rng: random.Random) -> str:
    number = rng.choice(NUMBERS)
    return "9" * 5000 if number == 10**400 else str(number)


def forged_array(array: Any, rng: random.Random) -> Any:
    """Return an array with another number, type or shape."""
    array = np.array(array)
    match rng.randrange(8):
        case 0:
            return array[..., :-1] if array.ndim and array.shape[-1] else array[None]
        case 1:
            return array[:-1] if array.ndim and len(array) else np.array([array])
        case 2:
            kinds = ("f8", "i8", "U4", "b1", "c16", "i1")
            with np.errstate(all="ignore"):
                return np.ones_like(array, dtype=rng.choice(kinds))
        case 3:
            return array.reshape(-1)[: rng.randrange(array.size + 1)]
    if array.size and array.dtype.kind in "fiub":
        found, number = array.copy(), rng.choice(NUMBERS)
        at = slice(None) if rng.random() < 0.2 else rng.randrange(array.size)
        if array.dtype.kind != "f":
            number = (
                int(max(-(2.0**63), min(2.0**62, np.nan_to_num(number))))
                if abs(number) < 1e308
                else -1
            )
        elif abs(number) > 1e300:
            number = np.inf
        with np.errstate(all="ignore"):
            found.reshape(-1)[at] = np.array(number).astype(array.dtype)
        return found
    return array


def _rows(kind: FileKind, path: Path) -> int:
    return len(kind.load_arrays(path)["left"])


def forge_arrays(kind: FileKind, *, shared: bool = True) -> Callable[[Path, random.Random], None]:
    """Return what changes an array in one of the archives of a folder.

    ``shared`` makes some forgeries agree: the last row that was recorded is that of the state.
    """

    def forge(folder: Path, rng: random.Random) -> None:
        path = rng.choice(sorted(folder.glob("*.npz")))
        if rng.random() < 0.15:
            return forge_bytes(kind)(path, rng)
        arrays = kind.load_arrays(path)
        for _ in range(rng.choice([1, 1, 2])):
            name = rng.choice(sorted(arrays))
            arrays[name] = forged_array(arrays[name], rng)
            if rng.random() < 0.05:
                del arrays[name]
        kind.save_arrays(path, arrays)
        if shared and path.stem == "state" and rng.random() < 0.7:
            kept = [file for file in sorted(folder.glob("chunk-*.npz")) if _rows(kind, file)]
            last, chunk = kept[-1], kind.load_arrays(kept[-1])
            for name in ("q", "v", "sums"):
                row = arrays.get(f"engine.{name}")
                if row is not None and row.shape == chunk[name].shape[1:]:
                    chunk[name][-1] = row
            kind.save_arrays(last, chunk)
        return None

    return forge


def forge_dataset(kind: FileKind) -> Callable[[Path, random.Random], None]:
    """Return what changes a variable or an attribute of a NetCDF file."""

    def forge(path: Path, rng: random.Random) -> None:
        content = kind.load(path)
        if rng.random() < 0.15:
            return forge_bytes(kind)(path, rng)
        with xr.open_dataset(io.BytesIO(content), engine="h5netcdf", decode_cf=False) as file:
            data = file.load()
        for variable in data.variables.values():
            variable.encoding.clear()
        for _ in range(rng.choice([1, 1, 2])):
            if rng.random() < 0.5:
                name = rng.choice(sorted(data.variables))
                array = forged_array(data[name].values, rng)
                if array.shape == data[name].shape and array.dtype.kind not in "cOb":
                    data[name] = (data[name].dims, array, data[name].attrs)
                elif rng.random() < 0.5:
                    data = data.drop_vars(name)
            else:
                name = rng.choice(sorted(data.attrs))
                other = rng.choice([*NUMBERS, "", "[" * 3000, "{}", "[1]", '{"x": -1}'])
                huge = isinstance(other, int) and abs(other) > 2**63 - 1
                data.attrs[name] = 1e300 if huge else other
        return resealed(kind, path, bytes(data.to_netcdf(engine="h5netcdf")))

    return forge


def forge_sweep(folder: Path, rng: random.Random) -> None:
    """Change the metadata or a chunk of a sweep's store, with all checksums."""
    root = folder / "zarr.json"
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    path = rng.choice([root, rng.choice(files)])
    content = path.read_bytes()
    if path.name != "zarr.json":
        body = damaged(content[:-4], rng)
        path.write_bytes(body + google_crc32c.value(body).to_bytes(4, "little"))
        return
    if path != root:
        path.write_text(_dumped(changed(json.loads(content), rng)))
    document = json.loads(root.read_bytes())
    attributes = document["attributes"]
    for name in ("study", "checksums", "columns", "versions"):
        attributes[name] = json.loads(attributes[name])
    if path == root:
        changed(rng.choice([document, attributes, attributes["study"]]), rng)
    checks = attributes.get("checksums")
    if path != root:
        checks["metadata"][path.parent.name] = sha256(path.read_bytes()).hexdigest()
    for name in ("study", "checksums", "columns", "versions"):
        if name in attributes and rng.random() < 0.95:
            attributes[name] = _dumped(attributes[name])
    if isinstance(document.get("attributes"), dict):
        document["attributes"]["sha256"] = "0" * 64
    text = _dumped(document)
    digest = sha256(text.encode()).hexdigest()
    root.write_text(text.replace("0" * 64, digest, 1))


def forge_list(path: Path, rng: random.Random) -> None:
    """Change the description or the subdivision in the archive of a list."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    if rng.random() < 0.15:
        path.write_bytes(damaged(path.read_bytes(), rng))
        return
    name = rng.choice(["problem.json", "problem.json", *parts])
    if name == "problem.json":
        parts[name] = _dumped(changed(json.loads(parts[name]), rng)).encode()
    else:
        parts[name] = damaged(parts[name], rng)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            if rng.random() < 0.97:
                archive.writestr(name, content)


def forge_search(folder: Path, rng: random.Random) -> None:
    """Change what a search for a list keeps, with all digests."""
    root = folder / "search.json"
    entries = json.loads(json.loads(root.read_bytes())["search"])
    name = rng.choice([None, *entries["files"]])
    if name is None:
        changed({key: entries[key] for key in entries if key not in ("library", "format")}, rng)
        kept = {
            key: entries[key] for key in ("tally", "regions", "loci", "missed", "failed", "files")
        }
        entries |= changed(kept, rng)
    else:
        with np.load(folder / name) as archive:
            arrays = {key: archive[key] for key in archive.files}
        key = rng.choice(sorted(arrays))
        arrays[key] = forged_array(arrays[key], rng)
        memory = io.BytesIO()
        np.savez(memory, **arrays)
        (folder / name).write_bytes(memory.getvalue())
        entries["files"][name] = sha256(memory.getvalue()).hexdigest()
    text = _dumped(entries)
    root.write_text(json.dumps({"sha256": sha256(text.encode()).hexdigest(), "search": text}))
