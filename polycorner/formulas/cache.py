"""The one cache folder: machine code of formulas and algorithms, unfinished searches.

It is ``POLYCORNER_CACHE_DIR`` or the user's cache folder; where neither can be written, a
temporary folder that ends with the process, announced by one warning.
"""

import atexit
import hashlib
import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from polycorner.atomic import write_atomically

VARIABLE = "POLYCORNER_CACHE_DIR"
COMPILING = ("compilation.py", "intermediate.py", "linking.py", "records.py")  # what Numba is told


def cache_folder() -> Path:
    """Return the cache folder; it exists and can be written."""
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
    return (path for path in folder.rglob("*") if path.is_file())


@lru_cache(maxsize=16)
def _prepared(named: str) -> Path:
    import platformdirs

    folder = Path(named) if named else Path(platformdirs.user_cache_dir("polycorner"))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        substitute = Path(tempfile.mkdtemp(prefix="polycorner-"))
        atexit.register(shutil.rmtree, substitute, ignore_errors=True)
        warnings.warn(
            f"the cache folder {folder} cannot be written ({error.strerror or error}): compiled "
            f"code is kept in {substitute} until this process ends; set {VARIABLE} to a folder "
            "that can be written",
            RuntimeWarning,
            stacklevel=3,
        )
        return substitute
    return folder


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
        msg = f"package: expected the name of an importable package; got {package!r}"
        raise ValueError(msg)
    folders = map(Path, spec.submodule_search_locations)
    files = sorted(file for folder in folders for file in folder.glob("*.py"))
    chosen = [file for file in files if file.name in (only or {file.name} - {*without})]
    digest = hashlib.sha256()
    for file in (*map(Path(__file__).with_name, COMPILING), *chosen):
        content = file.read_bytes().replace(b"\r\n", b"\n")
        digest.update(f"{file.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def read_code(name: str) -> bytes | None:
    """Return the machine code kept under a name; None if there is none or it was changed."""
    try:
        content = _code_file(name).read_bytes()
    except OSError:
        return None
    digest, code = content[:32], content[32:]
    return code if hashlib.sha256(code).digest() == digest else None


def write_code(name: str, code: bytes) -> None:
    """Keep machine code under a name; other processes see all of it or nothing."""
    path = _code_file(name)
    try:
        write_atomically(path, hashlib.sha256(code).digest() + code)
    except OSError as error:
        warnings.warn(
            f"compiled kernels cannot be kept in {path.parent} ({error.strerror or error}); set "
            f"{VARIABLE} to a folder that can be written",
            RuntimeWarning,
            stacklevel=2,
        )


def _code_file(name: str) -> Path:
    return cache_folder() / "kernels" / f"{name}.o"
