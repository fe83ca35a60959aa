"""Options that commands share, their groups in help texts, and ``--config`` for all of them."""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import click
from click.core import ParameterSource

from polycorner.cli.output import Verbosity, fail, tell, versions
from polycorner.errors import nearest

Command = TypeVar("Command", bound=Callable[..., Any])
GENERAL = "General options"
OUTPUT = "Output"
# Options about one call rather than about the problem are no keys of a configuration file.
NOT_IN_FILES = frozenset(
    {"config", "help", "json", "list", "movie", "out", "quiet", "resume", "verbose"}
)


class Option(click.Option):
    """An option that is listed under the title of its group."""

    def __init__(self, *args: Any, group: str = "Options", **settings: Any) -> None:
        if isinstance(settings.get("type"), click.IntRange):
            settings.setdefault("metavar", "N")  # the range stands behind the help
        super().__init__(*args, **settings)
        self.group = group


class GroupedCommand(click.Command):
    """A command whose help lists options by group, the general ones last."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each group of options."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                groups.setdefault(getattr(parameter, "group", GENERAL), []).append(record)
        for title in sorted(groups, key=lambda title: (title == GENERAL, title == OUTPUT)):
            with formatter.section(title):
                formatter.write_dl(groups[title])


option = partial(click.option, cls=Option)
command = partial(click.command, cls=GroupedCommand)


def examples(*lines: str) -> str:
    """Return the end of a help text: calls of the command, without the program's name."""
    return "\b\nExamples:\n" + "\n".join(f"  polycorner {line}" for line in lines) + "\n"


def given(name: str) -> bool:
    """Return whether an option of the running command stands on the command line."""
    return _source(name) is ParameterSource.COMMANDLINE


def from_file(name: str) -> bool:
    """Return whether the value of an option of the running command is that of ``--config``."""
    return _source(name) is ParameterSource.DEFAULT_MAP


def _source(name: str) -> ParameterSource | None:
    return click.get_current_context().get_parameter_source(name)


def added(function: Command, *options: Callable[[Command], Command]) -> Command:
    """Return a command with options, in the order in which its help lists them."""
    for add in reversed(options):
        function = add(function)
    return function


def seed_option(of: str, group: str = "Search") -> Callable[[Command], Command]:
    """Return a decorator that adds ``--seed``."""
    return option(
        "--seed", type=click.IntRange(min=0), default=0, help=f"Seed of {of}.", group=group
    )


def digits_option(function: Command) -> Command:
    """Add ``--digits`` of a proof, as many as :func:`~polycorner.prove` takes."""
    return option(
        "--digits", type=click.IntRange(1, 10_000), default=30, group="Proof",
        help="Significant digits.",
    )(function)  # fmt: skip


def answer_options(function: Command) -> Command:
    """Add ``--json`` and ``--out``."""
    return added(
        function,
        option("--json", "as_json", is_flag=True, help="Print JSON, not tables.", group=OUTPUT),
        option(
            "--out",
            type=click.Path(file_okay=False, path_type=Path),
            metavar="DIR",
            help="Folder for the JSON file and the figures; made if it is missing.",
            group=OUTPUT,
        ),
    )


def output_options(function: Command) -> Command:
    """Add ``--json``, ``--out`` and ``--config``."""
    return answer_options(config_option(function))


def read_interval(flag: str, written: str, example: str) -> tuple[str, float, float]:
    """Return the name and the ends of ``NAME=LOW:HIGH``, or end the command."""
    name, _, sides = written.partition("=")
    try:
        low, high = map(float, sides.split(":"))
    except ValueError:
        fail(f"{flag}: expected two numbers, as in {example}; got {written!r}")
    return name.strip(), low, high


# ----------------------------------------------------------------------------- quiet and verbose


def verbosity_options(function: Command) -> Command:
    """Add ``--quiet`` and ``--verbose``, which are not passed to the command."""
    for name, words in (
        ("verbose", "Say on standard error what is done and how long it takes."),
        ("quiet", "Print the answer alone: no progress, remarks or names of files."),
    ):
        function = option(
            f"-{name[0]}",
            f"--{name}",
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=_noted,
            help=words,
            group=GENERAL,
        )(function)
    return function


def everywhere(found: click.Command) -> click.Command:
    """Return a command after adding ``--quiet`` and ``--verbose`` to it and to its subcommands."""
    if all(parameter.name != "quiet" for parameter in found.params):
        verbosity_options(found)
    for below in found.commands.values() if isinstance(found, click.Group) else ():
        everywhere(below)
    return found


def _noted(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    if not value or context.resilient_parsing:
        return
    chosen = context.ensure_object(Verbosity)
    first = not chosen.verbose
    setattr(chosen, str(parameter.name), True)
    if chosen.quiet and chosen.verbose:
        fail("--quiet: expected no --verbose beside it; got both")
    if chosen.verbose and first:
        tell(versions())


# ------------------------------------------------------------------------------------ --config


def config_option(function: Command) -> Command:
    """Add ``--config``, a TOML file whose keys are the options of the command.

    Its values take the place of the options' defaults; the command gets no argument for it.
    """
    return option(
        "--config",
        type=click.Path(path_type=Path),
        metavar="FILE",
        is_eager=True,
        expose_value=False,
        callback=_configured,
        help="TOML file with options as keys; the command line overrides it.",
        group=GENERAL,
    )(function)


def _configured(context: click.Context, parameter: click.Parameter, file: Path | None) -> None:
    del parameter
    if file is None or context.resilient_parsing:
        return
    options = {_key(o): o for o in context.command.params if isinstance(o, click.Option)}
    known = {key: found for key, found in options.items() if key not in NOT_IN_FILES}
    where = f"--config: {file}"
    context.default_map = {
        known[key].name: _setting(known[key], value, f"{where}: {key}", context)
        for key, value in _checked_keys(_table(file), known, where).items()
    }


def _key(found: click.Option) -> str:
    """Return the key of an option: its long name without leading dashes."""
    return max(found.opts, key=len).lstrip("-").replace("-", "_")


def _table(file: Path) -> dict[str, Any]:
    try:
        with file.open("rb") as stream:
            table = tomllib.load(stream)
    except OSError as error:
        fail(f"--config: {file} cannot be read ({error.strerror or error})")
    except (ValueError, RecursionError) as error:
        fail(f"--config: {file} is not a TOML file: {error}")
    tell(f"read {file}: {', '.join(table) or 'no keys'}")
    return table


def _checked_keys(table: Mapping[str, Any], known: Iterable[str], where: str) -> dict[str, Any]:
    """Return a table with ``-`` in its keys replaced by ``_``, all of them known."""
    words = list(known)
    renamed = {key.replace("-", "_"): value for key, value in table.items()}
    for key in renamed:
        if key not in words:
            fail(f"{where}: expected one of {', '.join(words)}; got {nearest(key, words)}")
    return renamed


def _setting(found: click.Option, value: Any, where: str, context: click.Context) -> Any:
    """Return the value of a key as the option takes it: repeated options are lists."""
    if not found.multiple:
        return _row(found, value, where, context)
    several = isinstance(value, list)
    if found.nargs > 1:
        several = several and all(isinstance(row, list) for row in value)
    return tuple(_row(found, row, where, context) for row in (value if several else [value]))


def _row(found: click.Option, value: Any, where: str, context: click.Context) -> Any:
    if found.nargs == 1:
        return _single(found, value, where, context)
    if not isinstance(value, list) or len(value) != found.nargs:
        fail(f"{where}: expected {found.nargs} numbers in brackets; got {value!r}")
    return tuple(_single(found, each, where, context) for each in value)


def _single(found: click.Option, value: Any, where: str, context: click.Context) -> Any:
    kinds: tuple[tuple[Any, Any, str], ...] = (
        (click.types.BoolParamType, bool, "true or false"),
        (click.types.IntParamType, int, "a whole number"),
        (click.types.FloatParamType, int | float, "a number"),
        (click.ParamType, str, "a text in quotes"),
    )
    _, kind, words = next(row for row in kinds if isinstance(found.type, row[0]))
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        fail(f"{where}: expected {words}; got {value!r}")
    try:
        return found.type.convert(value, found, context)
    except click.BadParameter as error:
        fail(f"{where}: {error.message}")
