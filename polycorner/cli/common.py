"""What subcommands share: options, files of settings, one line for a mistake, JSON, files."""

import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import click

from polycorner.atomic import write_atomically
from polycorner.cli.manner import (
    Command,
    manner,
    remark,
    shows_progress,
    tell,
    timed,
)
from polycorner.errors import nearest

# What is about one call, not about what is computed, has no place in a file.
NO_SETTINGS = frozenset({"config", "help", "json", "out", "quiet", "resume", "verbose"})


def config_option(command: Command) -> Command:
    """Add ``--config``, a file that the command reads itself."""
    return click.option(
        "--config",
        type=click.Path(path_type=Path),
        help="TOML file with these names as keys; options override it.",
    )(command)


def settings_option(command: Command) -> Command:
    """Add ``--config``, a file whose keys are the command's options, taken where none is given.

    The command itself gets no argument for it.
    """
    return click.option(
        "--config",
        type=click.Path(path_type=Path),
        is_eager=True,
        expose_value=False,
        callback=_settle,
        help="TOML file with these names as keys; options override it.",
    )(command)


def seed_option(of: str) -> Callable[[Command], Command]:
    """Return what adds ``--seed``, a whole number not below 0."""
    return click.option("--seed", type=int, default=0, callback=_seed, help=f"Seed of {of}. [0]")


def _seed(context: click.Context, parameter: click.Parameter, value: int) -> int:
    del context, parameter
    if value < 0:
        fail(f"--seed: expected a whole number not below 0; got {value}")
    return value


def output_options(command: Command) -> Command:
    """Add ``--json`` and ``--out``."""
    command = click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        help="Folder for the figures and the JSON file.",
    )(command)
    return click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")(
        command
    )


def given(name: str) -> bool:
    """Whether an option of the command that runs stands on the command line itself."""
    source = click.get_current_context().get_parameter_source(name)
    return source is click.core.ParameterSource.COMMANDLINE


@contextmanager
def patience(words: str) -> Iterator[None]:
    """Show on a terminal that something is going on; with ``--verbose`` also how long it took."""
    with timed(words):
        if manner().verbose or not shows_progress():
            yield
            return
        from rich.console import Console

        with Console(stderr=True).status(words):
            yield


@contextmanager
def progress_bar(
    words: str, *, total: float | None = None, count: str = "", left: bool = False
) -> "Iterator[Callable[..., None] | None]":
    """Show a bar on a terminal; yield what changes it, or None where nobody watches.

    What is yielded takes ``completed``, ``total``, ``description`` (first these words) and
    ``note``, which is shown last.

    Parameters
    ----------
    words : str
        What is done, before the bar.
    total : float, optional
        The end, if it is known already.
    count : str, optional
        How progress is written behind the bar, in the markup of rich; default both numbers.
    left : bool, optional
        Whether to estimate the time left.
    """
    if not shows_progress():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn(count) if count else MofNCompleteColumn(),
        *([TimeRemainingColumn()] if left else []),
        TextColumn("{task.fields[note]}"),
    ]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield partial(bar.update, bar.add_task(words, total=total, note=""))


def fail(message: str) -> NoReturn:
    """End the command with one line and exit code 2."""
    raise click.UsageError(message)


def toml_table(config: Path) -> dict[str, Any]:
    """Return what is in the file of ``--config``."""
    try:
        with config.open("rb") as file:
            table = tomllib.load(file)
    except OSError as error:
        fail(f"--config: {config} cannot be read ({error.strerror or error})")
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        fail(f"--config: {config} is no TOML file: {error}")
    tell(f"read {config}: {', '.join(table) or 'nothing in it'}")
    return table


def checked_keys(table: Mapping[str, Any], expected: Iterable[str], where: str) -> dict[str, Any]:
    """Return a table with its keys as they are expected, ``-`` and ``_`` being the same.

    Parameters
    ----------
    table : mapping from str
        What was read.
    expected : iterable of str
        The keys there may be, with underscores.
    where : str
        What an error begins with, such as ``"--config: run.toml"``.

    Raises
    ------
    click.UsageError
        Naming the first key that is none of these, and the one that may be meant.
    """
    known = list(expected)
    renamed = {key.replace("-", "_"): value for key, value in table.items()}
    for key in renamed:
        if key not in known:
            fail(f"{where}: expected one of {', '.join(known)}; got {nearest(key, known)}")
    return renamed


def _settle(context: click.Context, parameter: click.Parameter, config: Path | None) -> None:
    """Take what a file says for what the command line does not."""
    del parameter
    if config is None or context.resilient_parsing:
        return
    options = {_key(o): o for o in context.command.params if isinstance(o, click.Option)}
    known = {key: option for key, option in options.items() if key not in NO_SETTINGS}
    where = f"--config: {config}"
    read = checked_keys(toml_table(config), known, where)
    context.default_map = {
        known[key].name: _setting(known[key], value, f"{where}: {key}", context)
        for key, value in read.items()
    }


def _key(option: click.Option) -> str:
    """Return an option as a key: its long name without dashes at its beginning."""
    return max(option.opts, key=len).lstrip("-").replace("-", "_")


def _setting(option: click.Option, value: Any, where: str, context: click.Context) -> Any:
    if option.multiple:
        every = value if isinstance(value, list) else [value]
        return tuple(_single(option, each, where, context) for each in every)
    return _single(option, value, where, context)


def _single(option: click.Option, value: Any, where: str, context: click.Context) -> Any:
    kinds: tuple[tuple[Any, Any, str], ...] = (
        (click.types.BoolParamType, bool, "true or false"),
        (click.types.IntParamType, int, "a whole number"),
        (click.types.FloatParamType, int | float, "a number"),
        (click.ParamType, str, "a text in quotes"),
    )
    _, kind, words = next(row for row in kinds if isinstance(option.type, row[0]))
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        fail(f"{where}: expected {words}; got {value!r}")
    try:
        return option.type.convert(value, option, context)
    except click.BadParameter as error:
        fail(f"{where}: {error.message}")


def json_text(answer: dict[str, Any] | list[Any]) -> str:
    """Return JSON with ``null`` in place of numbers it does not have."""
    import json

    return json.dumps(_finite(answer), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    """Return the same value with ``null`` in place of numbers JSON does not have."""
    import math

    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def prepare(out: Path | None) -> None:
    """Make the folder of ``--out`` before the work, so that nothing is computed in vain."""
    if out is not None:
        with writing(out):
            out.mkdir(parents=True, exist_ok=True)


@contextmanager
def writing(path: Path, option: str = "--out") -> Iterator[None]:
    """End the command with one line where a file, or a folder, cannot be written."""
    try:
        yield
    except OSError as error:
        fail(f"{option}: {path} cannot be written ({error.strerror or error})")


def write_answer(answer: dict[str, Any], out: Path, name: str) -> Path:
    """Write an answer as JSON into the folder of ``--out`` and return the file."""
    with writing(out):
        return write_atomically(out / name, json_text(answer) + "\n")


def deliver(
    answer: dict[str, Any] | list[Any],
    show: Callable[[], object],
    write: Callable[[], Iterable[Path]] = tuple,
    *,
    as_json: bool,
) -> None:
    """Print an answer, as JSON or as ``show`` does, then write its files and name them.

    The answer is printed first, so that a full disk does not swallow it; and the files are written
    also where nobody reads the answer, as in a broken pipe.
    """
    try:
        if as_json:
            click.echo(json_text(answer))
        else:
            show()
        sys.stdout.flush()
    finally:
        written = list(write())
    for path in written:
        if as_json:
            tell(f"wrote {path}")
        elif not manner().quiet:
            click.echo(f"wrote {path}")


def unfinished(kept: Path) -> None:
    """Say where unfinished work is kept."""
    sys.stdout.flush()
    remark(f"unfinished, kept in {kept}; --resume goes on")
