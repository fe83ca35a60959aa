"""Files that others wrote: of bounded size, and within a folder."""

import os
from pathlib import Path

from polycorner.checks import refuse

MIB = 2**20


def content(argument: str, path: str | os.PathLike[str], megabytes: float) -> bytes:
    """Return the bytes of a file, which ``argument`` names.

    Raises
    ------
    ValueError
        For one that is larger than ``megabytes``, in MiB, or is no ordinary file.
    OSError
        If it cannot be read.
    """
    with Path(path).open("rb") as file:
        if not Path(path).is_file():
            refuse(argument, "an ordinary file", os.fspath(path))
        size = os.fstat(file.fileno()).st_size
        if size > MIB * megabytes:
            refuse(argument, f"at most {megabytes:g} MiB", "more")
        return file.read(size)


def name_of(path: str | os.PathLike[str]) -> str:
    """Return the last part of a path, for messages."""
    return Path(path).name


def within(argument: str, folder: Path, reference: str, start: Path | None = None) -> Path:
    """Return the file that another file refers to, by a path in a folder, links followed.

    Parameters
    ----------
    argument : str
    folder : Path
        Beyond which nothing is read.
    reference : str
    start : Path, optional
        The folder that a path is relative to; default ``folder``.

    Raises
    ------
    ValueError
        For an absolute path, a URI, and what leads out of the folder.
    """
    expected = f"the path of a file in the folder {folder}"
    place = Path(reference)
    strange = "\0" in reference or "\\" in reference or ":" in reference
    if not reference or strange or place.is_absolute():
        refuse(argument, expected, reference)
    found = ((folder if start is None else start).resolve() / place).resolve()
    if not found.is_relative_to(folder.resolve()):
        refuse(argument, f"{expected}, without a way out of it", reference)
    return found
