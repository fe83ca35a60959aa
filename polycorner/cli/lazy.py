"""Groups of commands whose members are imported when they are needed, those of applications too.

An application registers its commands as entry points of the group ``polycorner.commands``:
``drum`` is a command, ``atlas.dyad`` one of the group ``atlas``.  Tables of studies, which stand
beside their files, are entry points of ``polycorner.studies`` (:mod:`polycorner.cli.sweep`).
"""

from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NoReturn

import click

from polycorner.cli.options import GroupedCommand, everywhere, examples
from polycorner.cli.output import fail

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

UNREGISTERED = (
    "no application is registered in this environment, which was installed before applications "
    "registered their commands: install it again, by `make env` or `pip install -e .`"
)


def group(name: str, *lines: str) -> Callable[[Callable[..., Any]], "LazyGroup"]:
    """Return the decorator of a group of commands, whose help ends in calls of them."""
    return click.group(
        cls=LazyGroup, prefix=f"{name}.", epilog=examples(*lines), no_args_is_help=True
    )


@cache
def registered(kind: str) -> Mapping[str, "EntryPoint"]:
    """Return the entry points of applications, ``commands`` or ``studies``, by name."""
    from importlib.metadata import entry_points  # takes as long as all the rest of a start

    return {point.name: point for point in entry_points(group=f"polycorner.{kind}")}


class LazyGroup(click.Group):
    """A group with members given as ``module:attribute``, and those of applications.

    Parameters
    ----------
    members : mapping from str to str
        Module and attribute of each command, imported when it runs or its help is shown.
    prefix : str, optional
        What precedes the names of this group's members among the entry points.
    of_files : mapping from str to str, optional
        What takes the place of commands where an argument is a problem in a file, ``FILE.toml``.
    """

    command_class = GroupedCommand

    def __init__(
        self,
        *args: Any,
        members: Mapping[str, str] | None = None,
        prefix: str = "",
        of_files: Mapping[str, str] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(*args, **options)
        self.members, self.prefix = dict(members or {}), prefix
        self.of_files = dict(of_files or {})

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, together with the options that all commands share."""
        super().add_command(everywhere(cmd), name)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        names = (n for n in registered("commands") if n.startswith(self.prefix))
        beyond = {rest for n in names if "." not in (rest := n.removeprefix(self.prefix))}
        return sorted({*super().list_commands(ctx), *self.members, *beyond})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command, importing it if necessary."""
        if cmd_name not in self.commands:
            if cmd_name in self.members:
                self.add_command(_imported(self.members[cmd_name]), cmd_name)
            elif self.prefix + cmd_name in registered("commands"):
                point = registered("commands")[self.prefix + cmd_name]
                self.add_command(_loaded(point), cmd_name)
        return super().get_command(ctx, cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the arguments name, and the arguments that are left."""
        if args[0] in self.of_files and (_name_a_problem(args[1:]) or _is_saved(args)):
            return args[0], everywhere(_imported(self.of_files[args[0]])), args[1:]
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            msg = error.message.rstrip(".")
            if not registered("commands"):
                msg = f"{msg}; {UNREGISTERED}"
            elif close := get_close_matches(args[0].lower(), self.list_commands(ctx), n=1):
                msg = f"{msg}: did you mean {close[0]!r}?"  # Click tells since its version 8.4
            raise click.UsageError(msg, ctx) from error


def _imported(place: str) -> click.Command:
    module, _, attribute = place.partition(":")
    command: click.Command = getattr(import_module(module), attribute)
    return command


def _name_a_problem(arguments: Sequence[str]) -> bool:
    """Whether one of the arguments is a problem in a file, not options in one."""
    pairs = pairwise(["", *arguments])
    return any(a.endswith(".toml") and a[0] != "-" and before != "--config" for before, a in pairs)


def _is_saved(arguments: Sequence[str]) -> bool:
    """Whether the first argument of ``view`` is a motion or a skeleton in a file."""
    return arguments[0] == "view" and "".join(arguments[1:2]).lower().endswith((".nc", ".json"))


def _loaded(point: "EntryPoint") -> click.Command:
    """Load the command of an application, or make one that says why it cannot be loaded."""
    try:
        command = point.load()
    except Exception as error:  # code of others: whatever it raises, the other commands work
        why = f"{point.name}: {point.value} cannot be loaded ({type(error).__name__}: {error})"
    else:
        if isinstance(command, click.Command):
            return command
        why = f"{point.name}: expected a command of click in {point.value}; got {command!r}"

    def refuse(rest: object) -> NoReturn:
        del rest
        fail(why)

    return click.Command(
        point.name,
        callback=refuse,
        short_help="(cannot be loaded)",
        params=[click.Argument(["rest"], nargs=-1, type=click.UNPROCESSED)],
        context_settings={"ignore_unknown_options": True},
    )
