"""``polycorner completion``: scripts by which a shell completes commands, options and choices."""

import click

from polycorner.cli.options import command

VARIABLE = "_POLYCORNER_COMPLETE"
EPILOG = """\b
Examples:
  source <(polycorner completion bash)
  polycorner completion zsh > ~/.zfunc/_polycorner
  polycorner completion fish > ~/.config/fish/completions/polycorner.fish
"""


@command(epilog=EPILOG)
@click.argument("shell", metavar="SHELL", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the completion script of SHELL: bash, zsh or fish."""
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None  # click knows the three shells
    root = click.get_current_context().find_root().command
    click.echo(found(root, {}, "polycorner", VARIABLE).source())
