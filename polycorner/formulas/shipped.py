"""Compiled functions whose intermediate code the package contains.

Numba needs half a minute to infer types and to make LLVM's intermediate code of an algorithm.  This
code does not depend on the processor, so that the package contains it.  Where its sources were
changed since, or this version of LLVM does not understand it, it is made anew.

LLVM needs seconds for good machine code of it, more than many a program has to do.  So quick code
is made first, and better code once the quick one has run for long enough; results are the same to
the last bit.  Both are cached.
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
from math import inf
from pathlib import Path
from threading import Lock
from time import perf_counter
from typing import Any, NamedTuple

from polycorner.atomic import write_atomically
from polycorner.formulas.cache import one_at_a_time, read_code, sources_digest
from polycorner.formulas.machine_code import emitted_code, kept_code, machine_key
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
    patience : float, optional
        How long quick code runs in a process before better code is made, in s: about as long as
        making it takes, so that no program takes twice the time that it might have taken.
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
    patience: float = 2.0
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

    @property
    def addresses(self) -> list[int]:
        """The addresses of the functions, for callers in machine code."""
        return self._optimised.addresses

    @cached_property
    def functions(self) -> tuple[Function, ...]:
        """The functions, which are called without the interpreter's lock."""
        code = _InUse(self)
        return tuple(self._function(code, number) for number in range(len(self.names)))

    def _function(self, code: "_InUse", number: int) -> Function:
        room = self.number * max(self.results, 1)
        count = self.results

        def call(*arguments: int | bytes) -> list[Any]:
            results = room()
            code.run(number, ctypes.byref(results), arguments)
            return results[:count]

        return call

    @cached_property
    def _name(self) -> str:
        """The name of the machine code in the cache."""
        key = repr((self.head, self.file, machine_key()))
        return f"{self.file.partition('.')[0]}_{hashlib.sha256(key.encode()).hexdigest()[:32]}"

    @cached_property
    def _optimised(self) -> "_Code":
        return self._kept(self._name, self._made)

    def _first(self) -> tuple["_Code", bool]:
        """Return the code to begin with, and whether there is better code."""
        if read_code(self._name) is None:
            try:
                return self._kept(f"{self._name}_quick", self._quickly_made), True
            except RuntimeError as error:
                LOG.info("intermediate code of %s cannot be used: %s", self.what, error)
        return self._optimised, False

    def _kept(self, name: str, make: Callable[[], bytes]) -> "_Code":
        """Return code from the cache; of several processes one makes it, and others wait."""
        turn = one_at_a_time(name) if read_code(name) is None else nullcontext()
        with turn:
            holder, addresses, _ = kept_code(name, list(self.names), make)
        words = [ctypes.c_void_p] * (2 + self.arguments)  # a table is one, too
        function = ctypes.CFUNCTYPE(ctypes.c_int32, *words)
        return _Code(holder, addresses, [function(address) for address in addresses])

    def _fresh_text(self) -> str:
        """Return the intermediate code at hand, or raise RuntimeError if sources were changed."""
        text = self.text
        if not text.startswith(self.head):
            msg = "it is not that of the sources"
            raise RuntimeError(msg)
        return text

    def _quickly_made(self) -> bytes:
        return emitted_code(self._fresh_text(), quick=True)

    def _made(self) -> bytes:
        """Return machine code, from the intermediate code at hand if it can be used."""
        try:
            return emitted_code(self._fresh_text())
        except RuntimeError as error:
            LOG.info("intermediate code of %s cannot be used: %s", self.what, error)
        LOG.warning("compiling %s, once on this machine: about %d s", self.what, self.seconds)
        return emitted_code(self.make())


class _Code(NamedTuple):
    """Machine code: what holds it, where its functions are, and these as Python calls them."""

    holder: Any
    addresses: list[int]
    functions: list[Callable[..., int]]


class _InUse:
    """The machine code that is used, quick or optimised."""

    def __init__(self, shipped: Shipped) -> None:
        self._shipped = shipped
        self._code, quick = shipped._first()  # noqa: SLF001 - its other half
        self._left = shipped.patience if quick else inf  # s until better code is worth making
        self._improving = Lock()

    def run(self, number: int, results: Any, arguments: tuple[Any, ...]) -> None:
        """Call a function, or raise what it raises; better code takes over between two calls."""
        if self._left <= 0:
            self._improve()
        failure, begun = ctypes.c_void_p(), perf_counter()
        failed = self._code.functions[number](results, ctypes.byref(failure), *arguments)
        self._left -= perf_counter() - begun
        if failed:
            raise _exception(failure)

    def _improve(self) -> None:
        with self._improving:
            if self._left <= 0:
                # Other threads may still run the quick code: Shipped's functions keep it.
                self._quick, self._code = self._code, self._shipped._optimised  # noqa: SLF001
                self._left = inf


class _Description(ctypes.Structure):
    """What Numba says of an exception: its type, arguments and place, pickled."""

    _fields_ = (("pickled", ctypes.c_void_p), ("length", ctypes.c_int32))


def _exception(failure: ctypes.c_void_p) -> Exception:
    found = ctypes.cast(failure, ctypes.POINTER(_Description)).contents
    kind, arguments, _ = pickle.loads(ctypes.string_at(found.pickled, found.length))
    exception: Exception = kind(*(arguments or ()))
    return exception
