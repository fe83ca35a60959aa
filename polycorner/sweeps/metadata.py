"""Metadata and checksums of a store: every file tells whether it is as it was written.

A chunk ends in its CRC-32C, written by zarr's codec.  The root ``zarr.json`` holds the SHA-256
digests of the metadata of all arrays, the numbers of their chunks where the study is finished,
and the digest of itself, computed with zeros in its own place.

Whoever forges a store can give it checksums that fit, and zarr follows whatever the metadata say:
so these may only be what the study and its results ask for.
"""

import json
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from polycorner import checks, forms
from polycorner.atomic import write_atomically
from polycorner.checks import refuse
from polycorner.container import one_sentence
from polycorner.sweeps.grid import Axis, Grid
from polycorner.sweeps.points import Column
from polycorner.sweeps.tables import TEXT, Variable, coordinates, variables

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
