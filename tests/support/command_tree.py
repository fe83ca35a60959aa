"""All commands of the command line, and for each arguments with which it answers soon."""

import click

from polycorner.cli.main import cli

# Arguments with which a command answers soon.
QUICK = {
    "dyad": ("--drum", "inf"),
    "atlas dyad": ("--plane", "--budget", "1"),
    "atlas spheres": ("--count", "5"),
    "measure spheres": ("--count", "5"),
    "atlas tutorial": (),
    "atlas pinball": ("--budget", "1"),
    "atlas disks": ("--count", "2"),
    "cache": (),
    "prove": ("--drum", "inf"),
    "minima dyad": ("--starts", "5"),
    "minima pinball": ("--starts", "5"),
    "drum": ("--duration", "0.1", "--dt", "0.005"),
    "paper": ("G4",),
}


def walk(command, *names):
    """Yield every command below one as ``(names, command)``, groups too."""
    yield names, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from walk(command.get_command(context, name), *names, name)


EVERY = dict(walk(cli))
LEAVES = {
    " ".join(names): command
    for names, command in EVERY.items()
    if not isinstance(command, click.Group)
}


def options(command):
    return {option: p for p in command.params for option in p.opts if option.startswith("--")}


def one_line(code, out, err):
    assert (code, out) == (2, "")
    assert err.startswith("polycorner: ")
    assert err.count("\n") == 1
    return err
