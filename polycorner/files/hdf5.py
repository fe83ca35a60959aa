"""The structure of HDF5 files, checked before anything in them is read.

HDF5 can store a dataset in other files of the machine, link to these, and declare shapes for which
nothing is stored.  What is written here needs none of that: arrays in the root, at most deflated.
"""

import math
from collections.abc import Iterator
from typing import Any

# What a byte can become by deflating at most (https://zlib.net/zlib_tech.html), and shuffling.
INFLATED = 1032
DEFLATE, SHUFFLE = 1, 2  # filters, as HDF5 counts them
# References to the scales of dimensions, which NetCDF keeps in these attributes.
SCALES = ("DIMENSION_LIST", "REFERENCE_LIST")
LENGTH = b"This is a netCDF dimension but not a netCDF variable"  # has no numbers, and is not read


def check_structure(content: bytes, stream: Any) -> None:
    """Raise ValueError if an HDF5 file has more than arrays of numbers and texts in its root.

    Parameters
    ----------
    content : bytes
    stream : file
        Of the content.
    """
    import h5py

    with h5py.File(stream, "r") as file:
        stored = 0
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                _refuse(name, "is a link to something else")
            if file.get(name, getclass=True) is not h5py.Dataset:
                _refuse(name, "is no array")
            dataset = file[name].id
            _check_attributes(name, dataset, len(content))
            is_read = not bytes(file[name].attrs.get("NAME", b"")).startswith(LENGTH)
            for why in _faults(dataset, is_read=is_read):
                _refuse(name, why)
            stored += dataset.get_storage_size()
        if stored > len(content):
            _refuse("content", f"is of {stored} bytes, more than the file")
        _check_attributes("/", file.id, len(content))


def _faults(dataset: Any, *, is_read: bool) -> Iterator[str]:
    import h5py

    how, kind, shape = dataset.get_create_plist(), dataset.dtype, dataset.shape
    if how.get_external_count():
        yield "is stored in other files"
    if how.get_layout() not in (h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED):
        yield "is put together from other arrays"
    if not _is_plain(kind):
        yield f"has the type {kind}"
    if shape is None:
        yield "has no shape"
        return
    chunks = how.get_chunk() if how.get_layout() == h5py.h5d.CHUNKED else ()
    sizes = zip(chunks, shape, strict=bool(chunks))
    if math.prod(shape) and any(size > extent for size, extent in sizes):
        yield "has pieces larger than itself"
    filters = [how.get_filter(k)[0] for k in range(how.get_nfilters())]
    if not set(filters) <= {DEFLATE, SHUFFLE} or len(set(filters)) < len(filters):
        yield "is packed in another way"
    most = dataset.get_storage_size() * (INFLATED if filters else 1)
    if is_read and math.prod(shape) * kind.itemsize > most:
        yield f"has the shape {shape}, for which nothing is stored"


def _is_plain(kind: Any) -> bool:
    import h5py

    return kind.kind in "iufSU" or h5py.check_string_dtype(kind) is not None


def _check_attributes(name: str, owner: Any, size: int) -> None:
    import h5py

    for k in range(h5py.h5a.get_num_attrs(owner)):
        attribute = h5py.h5a.open(owner, index=k)
        label = attribute.name.decode()
        if not _is_plain(attribute.dtype) and label not in SCALES:
            _refuse(f"{name}: {label}", f"has the type {attribute.dtype}")
        if attribute.get_storage_size() > size:
            _refuse(f"{name}: {label}", "is larger than the file")


def _refuse(place: str, why: str) -> None:
    msg = f"{place} {why}"
    raise ValueError(msg)
