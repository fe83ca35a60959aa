"""Files that appear whole or not at all, and that tell whether they were changed since.

A sealed file holds the SHA-256 digest of all else that is in it: in JSON the entry ``sha256``,
over the entries in canonical form, so that the file may be laid out anew; elsewhere a last line,
over every byte before it.  What does not fit its digest is refused before anything is read from
it.
"""

import hashlib
import json
import math
import os
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import __version__
from polycorner.atomic import write_atomically

DIGEST = "sha256"
SEAL = b"\npolycorner sha256 "
SEALED = "polycorner_sealed"  # an attribute of sealed NetCDF files
CHANGED = "was changed after it was written (digest)"
WORDS = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes
    ----------
    words : str
        What is in it, with an article: ``"an atlas"``.
    writer : str
        The function that writes it.
    key : str
        The entry that says so, with the version as its value.
    schema : int
        Version of the newest files of this kind.
    unsealed : int
        Newest version without a digest; default 0, none.
    """

    words: str
    writer: str
    key: str
    schema: int
    unsealed: int = 0

    def refusal(self, path: str | os.PathLike[str], why: str) -> ValueError:
        """Return the error of a file that is not of this kind, or no more."""
        sentence = " ".join(why.split())  # what libraries report may have lines
        return ValueError(
            f"path: expected {self.words} that {self.writer} wrote; {path} {sentence}"
        )

    def check_schema(self, path: str | os.PathLike[str], schema: object, writer: str = "") -> int:
        """Return the version of a file, refusing those that are newer than this package."""
        if isinstance(schema, bool) or not isinstance(schema, int) or schema < 1:
            raise self.refusal(path, "is something else")
        if schema > self.schema:
            by = f" of polycorner {writer}" if writer else ""
            why = f"has version {schema}{by}, and polycorner {__version__} reads up to version"
            raise self.refusal(path, f"{why} {self.schema}")
        return schema


def versions() -> dict[str, str]:
    """Return what wrote a file."""
    return {
        "polycorner": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def number(x: float) -> float | str:
    """Return a number as strict JSON has it: infinities and nan are words."""
    return float(x) if math.isfinite(x) else str(float(x))


def read_number(written: Any) -> float:
    """Return the number that :func:`number` wrote."""
    if isinstance(written, str):
        return WORDS[written]
    if isinstance(written, bool) or not isinstance(written, int | float):
        msg = f"{written!r} is no number"
        raise TypeError(msg)
    return float(written)


# --------------------------------------------------------------------------------------------- JSON


def _digest(content: dict[str, Any]) -> str:
    rest = {name: value for name, value in content.items() if name != DIGEST}
    canonical = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def save_json(
    kind: Kind, path: str | os.PathLike[str], content: dict[str, Any], *, indent: int | None = None
) -> Path:
    """Write entries as sealed JSON, with the kind, its version, and what wrote it."""
    whole = {kind.key: kind.schema, "written by": versions(), **content}
    whole[DIGEST] = _digest(whole)
    text = json.dumps(whole, indent=indent, allow_nan=False)
    return write_atomically(path, f"{text}\n")


def load_json(kind: Kind, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the entries of a file of a kind, refusing what was changed or is newer."""
    try:
        content = json.loads(Path(path).read_bytes().decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise kind.refusal(path, f"is no JSON ({error})") from error
    if not isinstance(content, dict) or kind.key not in content:
        raise kind.refusal(path, "is something else")
    by = content.get("written by")
    writer = by.get("polycorner") if isinstance(by, dict) else None
    schema = kind.check_schema(path, content[kind.key], writer if isinstance(writer, str) else "")
    if (schema > kind.unsealed or DIGEST in content) and not _fits(content):
        raise kind.refusal(path, CHANGED)
    return content


def _fits(content: dict[str, Any]) -> bool:
    try:
        return bool(content.get(DIGEST) == _digest(content))
    except (ValueError, RecursionError):  # nan and infinities, which are written as words
        return False


# -------------------------------------------------------------------------------------------- bytes


def sealed(content: bytes) -> bytes:
    """Return bytes with their digest in a last line; HDF5 does not mind what comes after it."""
    return content + _seal(content)


def _seal(content: bytes) -> bytes:
    return SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"


def unsealed(kind: Kind, path: str | os.PathLike[str]) -> tuple[bytes, bool]:
    """Return the bytes of a file without the seal, and whether there was one.

    Bytes that do not fit their seal, or that once had one, are refused.
    """
    content = Path(path).read_bytes()
    size = len(_seal(b""))
    body, seal = content[:-size], content[-size:]
    if seal.startswith(SEAL):
        if seal != _seal(body):
            raise kind.refusal(path, CHANGED)
        return body, True
    if SEAL in content or SEALED.encode() in content:
        raise kind.refusal(path, CHANGED)
    return content, False
