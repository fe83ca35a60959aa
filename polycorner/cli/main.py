"""The command ``polycorner``: subcommands, errors in one line, exit codes.

=====  ==================================================
0      an answer, whatever it says
1      a check of ``polycorner paper`` broke
2      bad input: one line on standard error says which
130    interrupted
=====  ==================================================
"""

import sys
from collections.abc import Sequence

import click

from polycorner import __version__
from polycorner.cli.atlas import atlas
from polycorner.cli.drum import drum
from polycorner.cli.dyad import dyad
from polycorner.cli.minima import minima
from polycorner.cli.paper import paper
from polycorner.cli.prove import prove

EXAMPLES = """\b
Examples:
  polycorner dyad
  polycorner dyad --rod 1 --drum inf --json
  polycorner atlas spheres --count 7
"""


@click.group(
    context_settings={"help_option_names": ["-h", "--help"]}, epilog=EXAMPLES, no_args_is_help=True
)
@click.version_option(__version__, message="polycorner %(version)s")
def cli() -> None:
    """Faces of curvilinear polyhedra, and where energies come to rest on them."""


cli.add_command(dyad)
cli.add_command(atlas)
cli.add_command(prove)
cli.add_command(minima)
cli.add_command(drum)
cli.add_command(paper)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows the name of the command; those of the process unless given.
    """
    given = None if arguments is None else list(arguments)
    try:
        code = cli.main(given, prog_name="polycorner", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        code = 0
    except click.ClickException as error:
        message = " ".join(error.format_message().split())
        click.echo(f"polycorner: {message}", err=True)
        code = 2
    except click.exceptions.Abort:
        click.echo("polycorner: interrupted", err=True)
        code = 130
    sys.exit(code if isinstance(code, int) else 0)
