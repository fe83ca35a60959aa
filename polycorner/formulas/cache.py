"""The one cache folder: machine code of formulas and algorithms, unfinished searches.

It is ``POLYCORNER_CACHE_DIR`` or the user's cache folder.  Where that cannot be written, or others
could write in it, a temporary folder that ends with the process takes its place, announced by one
warning.

Machine code that is loaded is executed.  Its files begin with a keyed digest of their names and
contents; the key is random, is kept beside them and can be read by the user alone.  So a file that
was damaged, exchanged or made by somebody else is compiled anew, also where a folder above is open
to others.  The names are digests of everything that the code depends on, versions included.
"""

import atexit
import hashlib
import hmac
import os
import secrets
import shutil
import stat
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from polycorner.atomic import PART, write_atomically
from polycorner.checks import refuse

VARIABLE = "POLYCORNER_CACHE_DIR"
KEY = "key"  # the file beside the machine code that holds the key of the digests
SIZE = 32  # bytes of the key, and of a digest
COMPILING = ("compilation.py", "intermediate.py", "linking.py", "records.py")  # what Numba is told


def cache_folder() -> Path:
    """Return the cache folder; it exists, and the user can write in it and nobody else.

    A relative one belongs to the working directory at the first call.
    """
    return _prepared(os.environ.get(VARIABLE, ""))


def cache_size() -> tuple[int, int]:
    """Return how many files there are in the cache folder, and their size in bytes."""
    sizes = [path.stat().st_size for path in _files(cache_folder())]
    return len(sizes), sum(sizes)


def clear_cache() -> tuple[int, int]:
    """Delete everything in the cache folder; return how many files that were, and their bytes."""
    counted = cache_size()
    for path in cache_folder().iterdir():
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    return counted


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_file() and path.name != KEY)


@cache
def _prepared(named: str) -> Path:
    folder = Path(named or "of the user")  # in words, if it is not known
    try:
        _make(folder := folder.absolute() if named else _users())
        for place in (folder, folder / "kernels"):
            if place.exists() and not _is_private(place.stat()):
                msg = f"others own {place} or may write in it"
                raise PermissionError(msg)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        substitute = Path(tempfile.mkdtemp(prefix="polycorner-"))
        atexit.register(shutil.rmtree, substitute, ignore_errors=True)
        warnings.warn(
            f"the cache folder {folder} cannot be used ({error.strerror or error}): compiled "
            f"code is kept in {substitute} until this process ends; set {VARIABLE} to a folder "
            "in which you can write and others cannot",
            RuntimeWarning,
            stacklevel=3,
        )
        return substitute
    return folder


def _users() -> Path:
    """Return the user's cache folder, or raise OSError."""
    import platformdirs

    with suppress(RuntimeError):  # platformdirs raises it, or leaves the ~
        folder = Path(platformdirs.user_cache_dir("polycorner"))
        if folder.is_absolute():
            return folder
    msg = "no home folder is known"
    raise FileNotFoundError(msg)


def _make(folder: Path) -> None:
    """Make a folder, and those above it that are missing, for the user alone."""
    if not folder.is_dir():
        _make(folder.parent)
        folder.mkdir(mode=stat.S_IRWXU, exist_ok=True)


def _is_private(found: os.stat_result, others: int = stat.S_IWGRP | stat.S_IWOTH) -> bool:
    """Whether the user owns a file or folder, and others do not have the named permissions.

    Windows has no such permissions; there, folders of a user are closed to others.
    """
    return os.name != "posix" or (found.st_uid == os.geteuid() and not found.st_mode & others)


@contextmanager
def one_at_a_time(name: str) -> Iterator[None]:
    """Let one process at a time do what ends in the cache, so that the others find it there.

    On file systems without locks all processes go ahead.
    """
    from filelock import FileLock

    with ExitStack() as held:
        with suppress(OSError, NotImplementedError):
            held.enter_context(FileLock(cache_folder() / f"{name}.lock"))
        yield


def source_key(*modules: str) -> str:
    """Return a hash of the source text of loaded modules: the key of what they define."""
    digest = hashlib.sha256()
    for name in modules:
        digest.update(Path(str(sys.modules[name].__file__)).read_bytes())
    return digest.hexdigest()


def sources_digest(
    package: str, *, only: tuple[str, ...] = (), without: tuple[str, ...] = ()
) -> str:
    """Return SHA-256 over names and text of a package's own Python files, and of the linker's.

    Subpackages are not included.  ``only`` names the files that are compiled, or ``without`` those
    that are not.  Ends of lines do not matter.
    """
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        refuse("package", "the name of an importable package", package)
    folders = map(Path, spec.submodule_search_locations)
    files = sorted(file for folder in folders for file in folder.glob("*.py"))
    chosen = [file for file in files if file.name in (only or {file.name} - {*without})]
    digest = hashlib.sha256()
    for file in (*map(Path(__file__).with_name, COMPILING), *chosen):
        content = file.read_bytes().replace(b"\r\n", b"\n")
        digest.update(f"{file.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def read_code(name: str) -> bytes | None:
    """Return the machine code kept under a name; None for none, or if it was not kept by us."""
    path = _code_file(name)
    try:
        key, content = _key(path.parent), path.read_bytes()
    except OSError:
        return None
    digest, code = content[:SIZE], content[SIZE:]
    return code if key and hmac.compare_digest(digest, _digest(key, name, code)) else None


def write_code(name: str, code: bytes) -> None:
    """Keep machine code under a name; other processes see all of it or nothing."""
    path = _code_file(name)
    try:
        _make(path.parent)
        write_atomically(path, _digest(_some_key(path.parent), name, code) + code)
    except OSError as error:
        warnings.warn(
            f"compiled kernels cannot be kept in {path.parent} ({error.strerror or error}); set "
            f"{VARIABLE} to a folder that can be written",
            RuntimeWarning,
            stacklevel=2,
        )


def _code_file(name: str) -> Path:
    return cache_folder() / "kernels" / f"{name}.o"


def _digest(key: bytes, name: str, code: bytes) -> bytes:
    digest = hashlib.blake2b(name.encode() + b"\0", key=key, digest_size=SIZE)
    digest.update(code)
    return digest.digest()


def _key(folder: Path) -> bytes:
    """Return the key of a folder, empty if there is none that only the user can know."""
    with suppress(FileNotFoundError), (folder / KEY).open("rb") as file:
        key = file.read(SIZE + 1)
        if len(key) == SIZE and _is_private(os.fstat(file.fileno()), stat.S_IRWXG | stat.S_IRWXO):
            return key
    return b""


def _some_key(folder: Path) -> bytes:
    """Return the key of a folder, made if it has none; of several processes one makes it.

    The key is read anew each time, for another process may have cleared the cache.
    """
    if key := _key(folder):
        return key
    path, part = folder / KEY, folder / f".{secrets.token_hex(4)}{PART}"
    try:
        part.touch(mode=stat.S_IRUSR | stat.S_IWUSR, exist_ok=False)
        part.write_bytes(secrets.token_bytes(SIZE))
        if not path.exists():
            os.link(part, path)
        elif not _key(folder):  # what is there is no key, or not a private one
            part.replace(path)
    except FileExistsError:
        pass  # another process was first
    except OSError:  # a file system without links
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    if not (key := _key(folder)):
        msg = f"others may read {path}"
        raise PermissionError(msg)
    return key
