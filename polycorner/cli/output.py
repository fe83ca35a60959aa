"""Output of commands: answers on standard output, remarks and progress on standard error."""

import logging
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NoReturn

import click

if TYPE_CHECKING:
    from polycorner.printing import Sheet

WIDTH = 120  # columns of what goes into a file or a pipe
# A callable with the signature of :class:`polycorner.progress.Progress`.
Report = Callable[[float, float | None, str], None]
# The libraries that the numbers depend on, whose versions --verbose shows.
LIBRARIES = ("numpy", "scipy", "sympy", "numba", "click")


@dataclass
class Verbosity:
    """The options ``--quiet`` and ``--verbose`` of the command line, wherever they stand in it."""

    quiet: bool = False
    verbose: bool = False


def verbosity() -> Verbosity:
    """Return the verbosity of the running command."""
    context = click.get_current_context(silent=True)
    return Verbosity() if context is None else context.ensure_object(Verbosity)


def versions() -> str:
    """Return the versions of the package, of Python and of the libraries that matter."""
    import platform
    from importlib.metadata import version

    from polycorner import __version__

    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    return f"version {__version__}, Python {platform.python_version()}, {libraries}"


# ------------------------------------------------------------------------------------------ remarks


def fail(message: str) -> NoReturn:
    """End the command with one line on standard error and exit code 2."""
    raise click.UsageError(message)


def tell(words: str) -> None:
    """Write a line to standard error, with ``--verbose`` only."""
    if verbosity().verbose:
        click.echo(f"polycorner: {words}", err=True)


def remark(words: str) -> None:
    """Write a line to standard error that reports no error, unless ``--quiet``."""
    if not verbosity().quiet:
        click.echo(f"polycorner: {words}", err=True)


def unfinished(kept: Path) -> None:
    """Say where unfinished work is kept."""
    sys.stdout.flush()
    remark(f"unfinished, kept in {kept}; --resume continues it")


@contextmanager
def naming(flags: Mapping[str, str]) -> Iterator[None]:
    """End the command where the library refuses an argument, named by the option that gives it."""
    try:
        yield
    except (ValueError, TypeError) as error:
        argument, colon, rest = str(error).partition(":")
        if isinstance(error, TypeError) and argument not in flags:
            raise
        fail(f"{flags.get(argument, argument)}{colon}{rest}")


def save_proof(proof: Any, archive: Path, row: dict[str, Any], **options: Any) -> list[Path]:
    """Save a proof for the checker, or note in the answer why there is no file of it."""
    with writing(archive):
        try:
            return [Path(proof.save(archive, **options))]
        except ValueError as error:
            row["not_saved"] = str(error)
            remark(f"{archive.name} is not written: {error}")
            return []


@contextmanager
def timed(words: str) -> Iterator[None]:
    """With ``--verbose`` say that some work begins, and how long it took."""
    start = perf_counter()
    tell(f"{words} ...")
    try:
        yield
    finally:
        tell(f"{words}: {perf_counter() - start:.2f} s")


@contextmanager
def notices(chosen: Verbosity) -> Iterator[None]:
    """Show warnings and the library's log as remarks: one line each, none with ``--quiet``.

    What the library logs is shown on a terminal (that it compiles, say), details of it with
    ``--verbose`` only.
    """
    handler = _Remarks(chosen)
    log = logging.getLogger("polycorner")
    level, show = log.level, warnings.showwarning
    log.addHandler(handler)
    log.setLevel(logging.DEBUG)
    warnings.showwarning = handler.warn
    try:
        yield
    finally:
        warnings.showwarning = show
        log.setLevel(level)
        log.removeHandler(handler)


class _Remarks(logging.Handler):
    """A log handler that writes lines to standard error."""

    def __init__(self, chosen: Verbosity) -> None:
        super().__init__()
        self.chosen = chosen

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record where it is wanted."""
        least = logging.INFO if sys.stderr.isatty() else logging.WARNING
        if self.chosen.verbose or (record.levelno >= least and not self.chosen.quiet):
            self.write(record.getMessage())

    def warn(self, message: Warning | str, *_: object, **__: object) -> None:
        """Write a warning."""
        if not self.chosen.quiet:
            self.write(f"warning: {message}")

    def write(self, words: str) -> None:
        """Write a line."""
        click.echo(f"polycorner: {' '.join(words.split())}", err=True)


# ----------------------------------------------------------------------------------------- progress


def shows_progress() -> bool:
    """Whether progress is shown: standard error is a terminal, and no ``--quiet`` is given."""
    return sys.stderr.isatty() and not verbosity().quiet


@contextmanager
def working(words: str, unit: str = "") -> Iterator[Report]:
    """Show a bar on a terminal while some work is done; yield the callable that moves it.

    The unit is that of ``done`` and ``total``, such as ``"edges"``; ``--verbose`` times the work.
    """
    with timed(words):
        if not shows_progress():
            yield _ignored
            return
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = [
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TimeElapsedColumn(),
            TextColumn("{task.fields[note]}"),
        ]
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            change = partial(bar.update, bar.add_task(words, total=None, note=""))
            yield partial(_moved, change, unit, perf_counter())


def _ignored(done: float, total: float | None, note: str, /) -> None:
    """Take a report of progress that nobody sees."""


def _moved(
    change: Callable[..., None], unit: str, begun: float, done: float, total: float | None,
    note: str, /,
) -> None:  # fmt: skip
    """Show a report of progress, with the time left where the total is known."""
    parts = [f"{round(done, 1):g}{'' if total is None else f' of {total:g}'} {unit}".rstrip()]
    if total and done > 0:
        parts.append(f"{(total - done) * (perf_counter() - begun) / done:.0f} s left")
    change(completed=done, total=total, note=", ".join([*parts, note] if note else parts))


# ------------------------------------------------------------------------------------------ answers


def columns() -> int:
    """Return the width of the terminal; a fixed one where the answer goes elsewhere."""
    from shutil import get_terminal_size

    return get_terminal_size((WIDTH, 24)).columns


def shown(sheet: "Sheet") -> str:
    """Return tables and sentences as text that fits the terminal."""
    return sheet.text(columns())


def json_text(answer: dict[str, Any] | list[Any]) -> str:
    """Return JSON with ``null`` in place of numbers it does not have."""
    import json

    return json.dumps(_finite(answer), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    import math

    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def prepare(out: Path | None) -> None:
    """Make the folder of ``--out`` before the work, so that nothing is computed in vain."""
    if out is not None:
        with writing(out):
            out.mkdir(parents=True, exist_ok=True)


@contextmanager
def writing(path: Path, option: str = "--out") -> Iterator[None]:
    """End the command with one line where a file or a folder cannot be written."""
    try:
        yield
    except OSError as error:
        fail(f"{option}: {path} cannot be written ({error.strerror or error})")


def write_answer(answer: dict[str, Any], out: Path, name: str) -> Path:
    """Write an answer as JSON into the folder of ``--out`` and return the file."""
    from polycorner.atomic import write_atomically

    with writing(out):
        return write_atomically(out / name, json_text(answer) + "\n")


def deliver(
    answer: dict[str, Any] | list[Any],
    text: Callable[[], str],
    write: Callable[[Path], Iterable[Path]] = lambda _: (),
    *,
    as_json: bool,
    out: Path | None = None,
) -> None:
    """Print an answer as JSON or as text, then write its files to ``--out`` and name them.

    The answer is printed first, so that a full disk does not swallow it; the files are written
    also where nobody reads the answer, as in a broken pipe.
    """
    try:
        words = json_text(answer) if as_json else text()
        if words:
            click.echo(words)
        sys.stdout.flush()
    finally:
        written = [] if out is None else list(write(out))
    for path in written:
        if as_json:
            tell(f"wrote {path}")
        elif not verbosity().quiet:
            click.echo(f"wrote {path}")
