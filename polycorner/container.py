"""The checksummed container of all kinds of files: kind, version and digest in the last line.

JSON, GraphML, NetCDF and NumPy archives end in a line that other readers of these formats take for
an entry or a comment, or ignore::

    "polycorner": "certificate 1 sha256 5f1d..."}
    <!-- polycorner graph 1 sha256 5f1d... -->
    polycorner trajectory 1 sha256 5f1d...

The digest is that of all bytes before it, kind and version included, and is checked before the
content is read.  It protects against damage, not against forgery: whoever changes a file can give
it a digest that fits.  So a reader checks every number, within
:meth:`FileKind.reading`.
"""

import hashlib
import io
import json
import math
import os
import platform
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import __version__
from polycorner.atomic import write_atomically
from polycorner.checks import LONGEST_REASON, shortened
from polycorner.errors import PolycornerError

JSON = (b' "polycorner": "', b'"}\n')
XML = (b"<!-- polycorner ", b" -->\n")
BINARY = (b"\npolycorner ", b"\n")
_SEAL = re.compile(rb"(?P<name>[a-z ]+) (?P<version>\d{1,9}) sha256 (?P<digest>[0-9a-f]{64})")
_WORDS = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


@contextmanager
def one_sentence(refusal: Callable[[str], Exception]) -> Iterator[None]:
    """Raise the refusal of a file, made of what is wrong, for whatever reading it raises.

    What is wrong may come to light anywhere in the libraries that are used, as an error of any
    class.
    """
    try:
        yield
    except FileError:
        raise
    except Exception as error:
        plain = isinstance(error, ValueError | TypeError) and str(error)
        raise refusal(_sentence(plain or repr(error))) from error


def _sentence(why: object) -> str:
    return shortened(" ".join(str(why).split()), LONGEST_REASON)  # libraries report lines


@dataclass(frozen=True)
class FileKind:
    """A kind of file.

    Attributes
    ----------
    name : str
        Its content, such as ``"certificate"``; lower-case letters and spaces.
    writer : str
        The function that writes it.
    around : tuple of (bytes, bytes)
        Beginning and end of the last line: ``JSON``, ``XML`` or ``BINARY``.
    version : int
        Version of the format; files of a newer one are refused.
    """

    name: str
    writer: str
    around: tuple[bytes, bytes]
    version: int = 1

    def refusal(self, path: str | os.PathLike[str], why: object) -> ValueError:
        """Return the error for a file that is not of this kind, or is damaged."""
        msg = f"path: expected a {self.name} that {self.writer} wrote; {path} {_sentence(why)}"
        return FileError(msg)

    def reading(self, path: str | os.PathLike[str]) -> AbstractContextManager[None]:
        """Turn whatever the content of a file makes a reader raise into one sentence naming it."""
        return one_sentence(lambda why: self.refusal(path, f"is damaged ({why})"))

    def save(self, path: str | os.PathLike[str], body: bytes) -> Path:
        """Write bytes with their last line, atomically.

        Raises
        ------
        OSError
            See :func:`~polycorner.atomic.atomic`.
        """
        before = body + self.around[0] + f"{self.name} {self.version} sha256 ".encode()
        digest = hashlib.sha256(before).hexdigest().encode()
        return write_atomically(path, before + digest + self.around[1])

    def load(self, path: str | os.PathLike[str]) -> bytes:
        """Return the bytes before the last line.

        Raises
        ------
        ValueError
            Naming the file, if it is of another kind, was changed, or has a newer version.
        OSError
            If it cannot be read.
        """
        content = Path(path).read_bytes()
        around = next((a for a in (JSON, XML, BINARY) if _last_line(content, a)), self.around)
        seal = _last_line(content, around)
        if seal is None:
            damaged = b"polycorner" in content
            raise self.refusal(path, "was changed or cut off" if damaged else "is something else")
        before = content[: -len(around[1]) - len(seal["digest"])]
        if hashlib.sha256(before).hexdigest().encode() != seal["digest"]:
            raise self.refusal(path, "was changed after it was written: its digest does not fit")
        if seal["name"] != self.name.encode() or around != self.around:
            raise self.refusal(path, f"is a {seal['name'].decode()}")
        if int(seal["version"]) > self.version:
            newer = f"has version {int(seal['version'])}"
            why = f"{newer}, and polycorner {__version__} reads up to version {self.version}"
            raise self.refusal(path, why)
        return content[: -len(around[0]) - len(seal.group()) - len(around[1])]

    def save_json(self, path: str | os.PathLike[str], entries: dict[str, Any]) -> Path:
        """Write entries as JSON, and which versions wrote them."""
        text = json.dumps(entries | {"written by": versions()}, indent=1, allow_nan=False)
        return self.save(path, f"{text[:-2]},\n".encode())

    def load_json(self, path: str | os.PathLike[str]) -> dict[str, Any]:
        """Return the entries that :meth:`save_json` wrote."""
        content = self.load(path).rstrip().removesuffix(b",") + b"}"
        with self.reading(path):
            entries: dict[str, Any] = json.loads(content, parse_constant=_no_number)
            return entries

    def save_arrays(self, path: str | os.PathLike[str], arrays: Mapping[str, Any]) -> Path:
        """Write arrays as a NumPy archive."""
        archive = io.BytesIO()
        np.savez(archive, **arrays)
        return self.save(path, archive.getvalue())

    def load_arrays(self, path: str | os.PathLike[str]) -> dict[str, Any]:
        """Return the arrays that :meth:`save_arrays` wrote."""
        content = self.load(path)
        with self.reading(path):
            return read_arrays(content)


class FileError(PolycornerError, ValueError):
    """A file that is refused, in a sentence that names it."""


def read_arrays(content: bytes) -> dict[str, Any]:
    """Return the arrays in a NumPy archive that is not compressed, hence no larger than its file.

    Raises
    ------
    Exception
        Of any class, if it is damaged.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = archive.infolist()
        stored = all(entry.compress_type == zipfile.ZIP_STORED for entry in entries)
        if not stored or sum(entry.file_size for entry in entries) > len(content):
            msg = "its entries are compressed, or overlap"
            raise ValueError(msg)
        return {e.filename.removesuffix(".npy"): _array(archive.read(e)) for e in entries}


def _array(content: bytes) -> Any:
    """Return the array in the format of NumPy, whose size has to be that of its content."""
    stream = io.BytesIO(content)
    header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }[np.lib.format.read_magic(stream)]
    shape, columns_first, kind = header(stream)
    if kind.hasobject:
        msg = "Object arrays cannot be loaded"
        raise ValueError(msg)
    values = np.frombuffer(stream.read(), dtype=kind)
    if values.size != math.prod(shape):
        msg = f"an array has {values.size} numbers, not the shape {shape}"
        raise ValueError(msg)
    return values.reshape(shape, order="F" if columns_first else "C").copy()


def _last_line(content: bytes, around: tuple[bytes, bytes]) -> "re.Match[bytes] | None":
    """Return kind, version and digest in the last line, if it is that of a format."""
    start, end = around
    _, found, line = content.rpartition(start)
    return _SEAL.fullmatch(line[: -len(end)]) if found and line.endswith(end) else None


def versions() -> dict[str, str]:
    """Return the versions that matter to the reader of a file."""
    return {
        "polycorner": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def number(x: float) -> float | str:
    """Return a number as strict JSON has it: infinities and NaN are words."""
    return float(x) if math.isfinite(x) else str(float(x))


def plain(value: Any) -> Any:
    """Return a value as strict JSON has it: dataclasses by field, enumerations by name."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, Enum):
        return value.name
    return number(value) if isinstance(value, float) else value


def _no_number(word: str) -> float:
    msg = f"{word} is no number of JSON"
    raise ValueError(msg)


def read_number(written: Any) -> float:
    """Return the number that :func:`number` wrote."""
    if isinstance(written, str):
        return _WORDS[written]
    if isinstance(written, bool) or not isinstance(written, int | float):
        msg = f"{written!r} is no number"
        raise TypeError(msg)
    return float(written)
