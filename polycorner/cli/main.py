"""The command ``polycorner``: subcommands, errors in one line, exit codes.

=====  ============================================================
0      an answer, whatever it says
1      a check of ``polycorner paper`` broke
2      bad input, or a file that cannot be read or written
70     an unexpected error: a mistake in the program
74     standard output cannot be written
130    interrupted; what was found is kept where the command says so
141    whoever read standard output has gone
=====  ============================================================
"""

import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from time import perf_counter

import click

from polycorner import __version__
from polycorner.cli.completion import VARIABLE
from polycorner.cli.lazy import LazyGroup
from polycorner.cli.manner import Manner, manner_options

UNEXPECTED, NO_OUTPUT, INTERRUPTED, UNREAD = 70, 74, 130, 141
EXIT_CODES = {
    0: "an answer, whatever it says",
    1: "a check of polycorner paper broke",
    2: "bad input, or a file that cannot be read or written",
    UNEXPECTED: "an unexpected error: a mistake in the program",
    NO_OUTPUT: "standard output cannot be written",
    INTERRUPTED: "interrupted; what was found is kept where the command says so",
    UNREAD: "whoever read standard output has gone",
}
COMMANDS = {
    **{name: f"polycorner.cli.{name}:{name}" for name in ("atlas", "completion", "sweep")},
    **{
        name: f"polycorner.dumbbells.cli.{name}:{name}"
        for name in ("drum", "dyad", "minima", "paper", "prove", "view")
    },
}
EXAMPLES = """\b
Examples:
  polycorner dyad
  polycorner dyad --rod 1 --drum inf --json
  polycorner atlas spheres --count 7
  polycorner dyad --help

\b
Exit codes:
"""
EPILOG = EXAMPLES + "\n".join(f"  {code:<3}  {words}" for code, words in EXIT_CODES.items())


@click.group(
    cls=LazyGroup,
    members=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EPILOG,
    no_args_is_help=True,
)
@click.version_option(__version__, message="polycorner %(version)s")
@manner_options
def cli() -> None:
    """Faces of curvilinear polyhedra, and where energies come to rest on them."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows the name of the command; those of the process unless given.
    """
    given = None if arguments is None else list(arguments)
    manner, start = Manner(), perf_counter()
    try:
        code = _answered(given, manner)
        sys.stdout.flush()
    except OSError as error:
        code = _unwritten(error)
    if manner.verbose and not manner.quiet:
        _say(f"exit code {code} after {perf_counter() - start:.2f} s")
    sys.exit(code)


def _answered(given: list[str] | None, manner: Manner) -> int:
    """Run a command and return its exit code; also that of whatever went wrong."""
    try:
        code = cli.main(given, prog_name="polycorner", standalone_mode=False, obj=manner)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        code = 0
    except click.ClickException as error:
        _say(error.format_message())
        code = 2
    except click.exceptions.Abort:
        _say("interrupted")
        code = INTERRUPTED
    except SystemExit as stopped:  # by click and rich where the reader of a pipe has gone
        code = stopped.code if VARIABLE in os.environ else _given_up()
    except OSError:
        raise
    except Exception as error:
        code = _unexpected(error, verbose=manner.verbose)
    return code if isinstance(code, int) else 0


def _unexpected(error: Exception, *, verbose: bool) -> int:
    if verbose:
        traceback.print_exception(error)
    words = " ".join(str(error).split()) or "no message"
    hint = "" if verbose else "; the same command with --verbose shows where"
    _say(f"unexpected {type(error).__name__}: {words}{hint}")
    return UNEXPECTED


def _given_up() -> int:
    """Give up standard output, so that Python does not try again at its end."""
    with suppress(OSError):  # not a file of the system, as in tests
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return UNREAD


def _unwritten(error: OSError) -> int:
    unread = _given_up()
    if isinstance(error, BrokenPipeError):
        return unread
    what = "standard output" if error.filename is None else error.filename
    _say(f"{what} cannot be read or written ({error.strerror or error})")
    return NO_OUTPUT if error.filename is None else 2


def _say(words: str) -> None:
    click.echo(f"polycorner: {' '.join(words.split())}", err=True)
