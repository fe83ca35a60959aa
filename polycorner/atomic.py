"""Atomic writing: a file is replaced as a whole or left untouched."""

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from polycorner.checks import refuse

if TYPE_CHECKING:
    from filelock import FileLock

PART = ".part"  # in the name of a file that is still being written


def is_part(path: Path) -> bool:
    """Whether a file is one that was not written to its end, which nothing reads."""
    return path.name.startswith(".") and PART in path.name


@contextmanager
def replace_atomically(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary name in the same folder, and move it to ``path`` if all goes well.

    The folder is created if it does not exist.  The temporary name has the suffix of ``path``, by
    which many libraries choose a format.  Content and name are synchronised to the disk, so that
    the file survives a crash of the machine; after an exception the temporary file is removed.

    Parameters
    ----------
    path : path
        A symbolic link keeps pointing to its file, which is replaced.

    Raises
    ------
    OSError
        Of the kind that the system reported, such as a full disk or a read-only folder, in a
        sentence that names ``path``.

    Examples
    --------
    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "answer.txt"
    >>> with replace_atomically(target) as temporary:
    ...     _ = temporary.write_text("42")
    >>> target.read_text()
    '42'
    """
    target = Path(os.path.realpath(path))
    part = target.with_name(f".{target.stem}-{secrets.token_hex(4)}{PART}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield part
        _synchronise(part)
        part.replace(target)
        if os.name == "posix":  # elsewhere folders cannot be synchronised
            _synchronise(target.parent)
    except BaseException as error:
        if target.parent.is_dir():
            part.unlink(missing_ok=True)
        if isinstance(error, OSError):
            msg = f"{error.strerror or error}: nothing was written to {path}"
            raise (OSError(msg) if error.errno is None else OSError(error.errno, msg)) from error
        raise


def write_atomically(
    path: str | os.PathLike[str], content: bytes | str, *, suffix: str = ""
) -> Path:
    """Write bytes, or text in UTF-8, with :func:`replace_atomically`, and return the path.

    Raises
    ------
    ValueError
        If a suffix is required and the name has another one.
    OSError
        See :func:`replace_atomically`.
    """
    target = Path(path)
    if suffix and target.suffix.lower() != suffix:
        refuse("path", f"a name ending in {suffix}", target.name)
    with replace_atomically(target) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)
    return target


def is_store(path: Path, root: str, what: str, is_own: Callable[[Path], bool] = is_part) -> bool:
    """Return whether a folder has the root of a store; refuse a file, and a folder of others."""
    if path.exists() and not path.is_dir():
        msg = f"store: expected a folder; {path} is a file"
        raise ValueError(msg)
    found = (path / root).exists()
    if not found and path.is_dir() and not all(map(is_own, path.iterdir())):
        msg = f"store: expected a new or empty folder, or {what}; {path} is neither"
        raise ValueError(msg)
    return found


def lock_store(path: Path) -> "FileLock":
    """Return the lock of a store, which this process alone writes until it is released."""
    from filelock import FileLock, Timeout

    lock = FileLock(f"{path}.lock", thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        msg = f"store: expected one that nothing else is writing; {path} is in use"
        raise ValueError(msg) from None
    return lock


def _synchronise(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
