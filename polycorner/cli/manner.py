"""How much a command tells besides its answer: ``--quiet``, ``--verbose`` and what follows."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from rich.console import Console

Command = TypeVar("Command", bound=Callable[..., Any])

HELP = {
    "quiet": "Print the answer alone: no progress, no names of files.",
    "verbose": "Tell on standard error what is done and how long it takes.",
}
# Whose versions are told: what the numbers depend on.
LIBRARIES = ("numpy", "scipy", "sympy", "numba", "click")
WIDTH = 120  # of tables that go into a file or a pipe


@dataclass
class Manner:
    """What was asked for, by any of the commands in a line."""

    quiet: bool = False
    verbose: bool = False


def manner() -> Manner:
    """Return what was asked for of the command that runs."""
    context = click.get_current_context(silent=True)
    return Manner() if context is None else context.ensure_object(Manner)


def manner_options(command: Command) -> Command:
    """Add ``--quiet`` and ``--verbose``; the command itself need not know of them."""
    for name in ("verbose", "quiet"):
        command = click.option(
            f"-{name[0]}",
            f"--{name}",
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=_noted,
            help=HELP[name],
        )(command)
    return command


def everywhere(command: click.Command) -> click.Command:
    """Return a command after adding these options to it, and to all below it, that lack them."""
    if all(parameter.name != "quiet" for parameter in command.params):
        manner_options(command)
    for below in command.commands.values() if isinstance(command, click.Group) else ():
        everywhere(below)
    return command


def _noted(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    if not value or context.resilient_parsing:
        return
    chosen = context.ensure_object(Manner)
    first = not chosen.verbose
    setattr(chosen, str(parameter.name), True)
    if chosen.quiet and chosen.verbose:
        msg = "--quiet: expected no --verbose beside it; got both"
        raise click.UsageError(msg)
    if chosen.verbose and first:
        tell(versions())


def versions() -> str:
    """Return the versions of the package, of Python and of what the numbers depend on."""
    import platform
    from importlib.metadata import version

    from polycorner import __version__

    every = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    return f"version {__version__}, Python {platform.python_version()}, {every}"


def tell(words: str) -> None:
    """Say something on standard error, with ``--verbose`` only."""
    if manner().verbose:
        click.echo(f"polycorner: {words}", err=True)


def remark(words: str) -> None:
    """Say something on standard error that is no mistake, unless ``--quiet``."""
    if not manner().quiet:
        click.echo(f"polycorner: {words}", err=True)


@contextmanager
def timed(words: str) -> Iterator[None]:
    """Tell what is begun, and how long it took."""
    start = perf_counter()
    tell(f"{words} ...")
    try:
        yield
    finally:
        tell(f"{words}: {perf_counter() - start:.2f} s")


def shows_progress() -> bool:
    """Whether somebody watches: standard error is a terminal, and no ``--quiet``."""
    return sys.stderr.isatty() and not manner().quiet


def console() -> "Console":
    """Return where tables are printed: as wide as the terminal, or as wide as reads well."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else WIDTH, highlight=False)
