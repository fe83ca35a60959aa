"""Groups of commands whose members are imported when they are needed."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import click

from polycorner.cli.options import GroupedCommand, everywhere


class LazyGroup(click.Group):
    """A group with members given as ``module:attribute``.

    Parameters
    ----------
    members : mapping from str to str
        Module and attribute of each command, imported when it runs or its help is shown.
    """

    command_class = GroupedCommand

    def __init__(
        self, *args: Any, members: Mapping[str, str] | None = None, **options: Any
    ) -> None:
        super().__init__(*args, **options)
        self.members = dict(members or {})

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, together with the options that all commands share."""
        super().add_command(everywhere(cmd), name)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return sorted({*super().list_commands(ctx), *self.members})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command, importing it if necessary."""
        if cmd_name in self.members and cmd_name not in self.commands:
            module, _, attribute = self.members[cmd_name].partition(":")
            self.add_command(getattr(import_module(module), attribute), cmd_name)
        return super().get_command(ctx, cmd_name)
