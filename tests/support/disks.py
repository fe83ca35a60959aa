"""Disks that fail, and processes that end, at a chosen one of the operations on files."""

import errno
import os
from contextlib import contextmanager
from pathlib import Path

import pytest

OPERATIONS = ("write_bytes", "replace", "unlink", "mkdir")  # of a path


class Killed(BaseException):
    """Ends the work of a process wherever it is."""


class Disk:
    """Operations on files, of which one fails.

    Parameters
    ----------
    fails_at : int
        The number of the operation that fails, from 1.
    full : bool
        Whether there is no room from then on.  Else the process has ended: nothing has any effect.
    """

    def __init__(self, fails_at, *, full):
        self.fails_at, self.full, self.done = fails_at, full, 0

    @property
    def failed(self):
        return self.done >= self.fails_at

    def begin(self, name):
        """Count an operation; raise if it is the one that fails, or comes after it."""
        self.done += 1
        if self.failed and self.full and name not in {"unlink", "fsync"}:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if self.failed and not self.full:
            raise Killed

    @contextmanager
    def used(self):
        """Let all operations on files be those of this disk."""
        with pytest.MonkeyPatch.context() as patch:
            for name in OPERATIONS:
                patch.setattr(Path, name, self._failing(name, getattr(Path, name)))
            patch.setattr(os, "fsync", self._failing("fsync", os.fsync))
            yield

    def _failing(self, name, usual):
        def operation(*arguments, **options):
            before = self.failed
            try:
                self.begin(name)
            except BaseException:
                if name == "write_bytes" and not before:  # the failure comes halfway
                    usual(arguments[0], arguments[1][: len(arguments[1]) // 2])
                raise
            return usual(*arguments, **options)

        return operation
