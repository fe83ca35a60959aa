"""Compiled functions whose intermediate code the package contains.

Numba needs half a minute to infer types and to make LLVM's intermediate code of an algorithm.  This
code does not depend on the processor, so that the package contains it.  Where its sources were
changed since, or this version of LLVM does not understand it, it is made anew.  Machine code is
cached.
"""

import ctypes
import hashlib
import logging
import lzma
import pickle
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from polycorner.atomic import write_atomically
from polycorner.formulas.cache import one_at_a_time, read_code, sources_digest
from polycorner.formulas.machine_code import kept_code, machine_code, machine_key
from polycorner.values import cached_property

LOG = logging.getLogger("polycorner.compilation")
HEAD = "; made from "

Function = Callable[..., list[Any]]


@dataclass(frozen=True)
class Shipped:
    """Compiled functions, and the file that holds their intermediate code.

    Parameters
    ----------
    package : str
        Where the file is, and the sources.
    file : str
    make : callable
        Makes the intermediate code anew.
    names : tuple of str
        The functions.
    arguments, results : int
        How many whole numbers, or tables, they are given, and how many numbers they return.
    number : type, optional
        That of these: whole numbers.
    what, seconds : str, int
        What is compiled, and how long it takes to make it anew, in s of processor time.
    sources : tuple of str
        Python files from which the code is made; if empty, all but those of ``without``.
    """

    package: str
    file: str
    make: Callable[[], str]
    names: tuple[str, ...]
    arguments: int
    results: int
    what: str
    seconds: int
    sources: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    number: type[ctypes.c_int64] | type[ctypes.c_double] = ctypes.c_int64

    @property
    def path(self) -> Path:
        """The file."""
        return Path(str(files(self.package) / self.file))

    @property
    def head(self) -> str:
        """The first line of the file."""
        digest = sources_digest(self.package, only=self.sources, without=self.without)
        return f"{HEAD}{digest}\n"

    @property
    def text(self) -> str:
        """The intermediate code that the package contains; empty if it cannot be read."""
        try:
            return lzma.decompress(self.path.read_bytes()).decode()
        except (OSError, lzma.LZMAError):
            return ""

    def write(self) -> None:
        """Make the file anew."""
        write_atomically(self.path, lzma.compress((self.head + self.make()).encode(), preset=9))

    @cached_property
    def _code(self) -> tuple[Any, list[int]]:
        """What holds the machine code; of several processes one compiles it, and others wait."""
        head = self.head
        key = repr((head, self.file, machine_key()))
        name = f"{self.file.partition('.')[0]}_{hashlib.sha256(key.encode()).hexdigest()[:32]}"
        turn = one_at_a_time(name) if read_code(name) is None else nullcontext()
        with turn:
            holder, addresses, _ = kept_code(name, list(self.names), lambda: self._made(head))
        return holder, addresses

    @property
    def addresses(self) -> list[int]:
        """The addresses of the functions, for callers in machine code."""
        return self._code[1]

    @cached_property
    def functions(self) -> tuple[Function, ...]:
        """The functions."""
        holder, addresses = self._code
        return tuple(self._function(address, holder) for address in addresses)

    def _made(self, head: str) -> bytes:
        """Return machine code, from the intermediate code at hand if it is that of the sources."""
        text = self.text
        if text.startswith(head):
            try:
                return machine_code(text, optimise=False)
            except RuntimeError as error:
                LOG.info("intermediate code of %s is not understood: %s", self.what, error)
        LOG.warning("compiling %s, once on this machine: about %d s", self.what, self.seconds)
        return machine_code(self.make(), optimise=False)

    def _function(self, address: int, holder: Any) -> Function:
        """Return a function that calls compiled code without the interpreter's lock."""
        words = [ctypes.c_void_p] * (2 + self.arguments)  # a table is one, too
        compiled = ctypes.CFUNCTYPE(ctypes.c_int32, *words)(address)
        room = self.number * max(self.results, 1)
        count = self.results

        def call(*arguments: int | bytes, _: Any = holder) -> list[Any]:
            results, failure = room(), ctypes.c_void_p()
            if compiled(ctypes.byref(results), ctypes.byref(failure), *arguments):
                raise _exception(failure)
            return results[:count]

        return call


class _Description(ctypes.Structure):
    """What Numba says of an exception: its type, arguments and place, pickled."""

    _fields_ = (("pickled", ctypes.c_void_p), ("length", ctypes.c_int32))


def _exception(failure: ctypes.c_void_p) -> Exception:
    found = ctypes.cast(failure, ctypes.POINTER(_Description)).contents
    kind, arguments, _ = pickle.loads(ctypes.string_at(found.pickled, found.length))
    exception: Exception = kind(*(arguments or ()))
    return exception
