"""What the metadata of a store may be: only what the study and its results ask for.

Whoever forges a store can give it checksums that fit; zarr follows whatever the metadata say.
"""

import json
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from polycorner import checks, forms
from polycorner.container import one_sentence
from polycorner.sweeps.grid import Axis, Grid
from polycorner.sweeps.points import Column
from polycorner.sweeps.tables import TEXT, Variable, coordinates, variables

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
    "shape": forms.many(forms.count),
}


def reading(path: str | os.PathLike[str]) -> AbstractContextManager[None]:
    """Turn whatever the content of a file makes a reader raise into one sentence naming it."""
    said = f"store: expected a store of a sweep; {path} is damaged"
    return one_sentence(lambda why: ValueError(f"{said} ({why})"))


def check_root(document: Any) -> None:
    """Check the attributes in the root of a store, and the metadata of its arrays.

    Raises
    ------
    TypeError, ValueError
        Naming the entry.
    """
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
    study = json.loads(about["study"])
    forms.entries(_STUDY)("study", study)
    return Grid({axis["name"]: Axis(axis["values"], axis["unit"]) for axis in study["axes"]})


def stored_columns(about: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns of the results from the attributes of a store."""
    entries = json.loads(about.get("columns", "[]"))
    forms.many(forms.entries(_COLUMN))("columns", entries)
    return tuple(Column(e["name"], e["unit"], e["text"], tuple(e["shape"])) for e in entries)


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
