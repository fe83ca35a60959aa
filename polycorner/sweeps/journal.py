"""A journal of finished points, and a lock that dies with its process.

A line for every point, appended when it is finished.  A process that is killed leaves whole lines
and at most a torn last one, which is not counted.
"""

import base64
import contextlib
import json
import os
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.sweeps.points import Column, Entry, Outcome

SYNCHRONISED = 1.0  # s between two times that the disk is waited for
HELD: set[Path] = set()  # locks of this process: the system's do not part its threads
GUARD = threading.Lock()


class Lock:
    """A file that one process at a time holds; the system frees it when the process ends.

    Parameters
    ----------
    path : Path
        The file; it is made if need be and stays.

    Raises
    ------
    BlockingIOError
        If another holds it, who being the message.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        with GUARD:
            if self.path in HELD:
                msg = "this process"
                raise BlockingIOError(msg)
            HELD.add(self.path)
        self.handle = -1
        try:
            self.handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            _hold(self.handle)
        except OSError as error:
            who = _holder(self.path)
            self.release()
            if isinstance(error, BlockingIOError | PermissionError):
                raise BlockingIOError(who) from None
            raise
        os.ftruncate(self.handle, 0)
        os.write(self.handle, f"process {os.getpid()}".encode())

    def release(self) -> None:
        """Let another have it."""
        with GUARD:
            HELD.discard(self.path)
        if self.handle >= 0:
            os.close(self.handle)
            self.handle = -1


def _hold(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _holder(path: Path) -> str:
    with contextlib.suppress(OSError):
        return path.read_text(encoding="utf-8") or "another process"
    return "another process"


class Journal:
    """Outcomes in a file, a line each.

    Parameters
    ----------
    path : Path
        The file; it is made if need be.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        self.synchronised = time.monotonic()

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return os.fstat(self.handle).st_size

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Append outcomes; they outlive this process from here on, the machine a second later."""
        text = "".join(f"{_line(outcome)}\n" for outcome in outcomes).encode()
        while text:
            text = text[os.write(self.handle, text) :]
        if time.monotonic() - self.synchronised > SYNCHRONISED:
            os.fsync(self.handle)
            self.synchronised = time.monotonic()

    def read(self, columns: Sequence[Column]) -> list[Outcome]:
        """Return the outcomes of all whole lines."""
        found = []
        for line in self.path.read_bytes().split(b"\n"):
            with contextlib.suppress(ValueError, KeyError, TypeError):
                found.append(_outcome(json.loads(line), columns))
        return found

    def clear(self) -> None:
        """Empty the file."""
        os.ftruncate(self.handle, 0)

    def close(self) -> None:
        """Let go of the file."""
        if self.handle >= 0:
            os.close(self.handle)
            self.handle = -1


def _line(outcome: Outcome) -> str:
    about: dict[str, Any] = {"point": outcome.number, "seconds": outcome.seconds}
    if outcome.message:
        about["message"] = outcome.message
    else:
        about["values"] = [_packed(value) for value in outcome.values]
    return json.dumps(about)


def _packed(value: Entry) -> Any:
    if isinstance(value, np.ndarray):
        return base64.b64encode(value.astype("<f8").tobytes()).decode()
    return value


def _outcome(about: dict[str, Any], columns: Sequence[Column]) -> Outcome:
    number, seconds = int(about["point"]), float(about["seconds"])
    if "message" in about:
        return Outcome(number, seconds, message=str(about["message"]))
    values = tuple(_read(c, v) for c, v in zip(columns, about["values"], strict=True))
    return Outcome(number, seconds, tuple(columns), values)


def _read(column: Column, value: Any) -> Entry:
    if column.text:
        return str(value)
    if column.shape:
        return np.frombuffer(base64.b64decode(value), dtype="<f8").reshape(column.shape)
    return float(value)
