"""The command ``polycorner``: subcommands, errors in one line, exit codes."""

import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from time import perf_counter

import click

from polycorner import __version__
from polycorner.cli.lazy import LazyGroup
from polycorner.cli.options import command, examples, verbosity_options
from polycorner.cli.output import Verbosity, notices

VARIABLE = "_POLYCORNER_COMPLETE"  # by which shells ask for completions
UNEXPECTED, NO_OUTPUT, INTERRUPTED, BROKEN_PIPE = 70, 74, 130, 141
EXIT_CODES = {
    0: "success, whatever the answer",
    1: "a file was not verified, or a check of polycorner paper failed to run",
    2: "bad input, or a file that cannot be read or written",
    UNEXPECTED: "unexpected error: a defect of the program",
    NO_OUTPUT: "standard output cannot be written",
    INTERRUPTED: "interrupted; the message says whether results were kept",
    BROKEN_PIPE: "broken pipe",
}
NAMES = ("atlas", "branches", "cache", "landscape", "measure", "minima", "sweep", "verify")
COMMANDS = {name: f"polycorner.cli.{name}:{name}" for name in NAMES}
OF_FILES = {
    "measure": "polycorner.cli.measure:measure_file",
    **{
        n: f"polycorner.cli.problems:{n}"
        for n in ("atlas", "branches", "landscape", "minima", "prove", "view")
    },
}
EXAMPLES = examples(
    "dyad",
    "dyad --rod 1 --drum inf --json",
    "atlas spheres --count 6",
    "dyad --help",
)
UNITS = """
Lengths are in mm, times in s.  Angles on the command line and in tables are in degrees; in JSON the
keys of angles in degrees end in _deg, all other angles are in radians.

The commands prove, atlas, branches, measure, minima, landscape and view also take a problem of
your own in a file: FILE.toml, and --help after it.

\b
Exit codes:
"""
EPILOG = EXAMPLES + UNITS + "\n".join(f"  {code:<3}  {words}" for code, words in EXIT_CODES.items())


@click.group(
    cls=LazyGroup,
    members=COMMANDS,
    of_files=OF_FILES,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "show_default": True,
        "max_content_width": 100,
    },
    epilog=EPILOG,
    no_args_is_help=True,
)
@click.version_option(__version__, message="polycorner %(version)s")
@verbosity_options
def cli() -> None:
    """Corners, minima and proofs on curvilinear polyhedra, and motion on them."""


@command(
    epilog="""\b
Examples:
  source <(polycorner completion bash)
  polycorner completion zsh > ~/.zfunc/_polycorner
  polycorner completion fish > ~/.config/fish/completions/polycorner.fish
"""
)
@click.argument("shell", metavar="SHELL", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the completion script of SHELL: bash, zsh or fish."""
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None  # click knows the three shells
    root = click.get_current_context().find_root().command
    click.echo(found(root, {}, "polycorner", VARIABLE).source())


cli.add_command(completion)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, with the process's arguments by default, and end with its exit code."""
    given = None if arguments is None else list(arguments)
    chosen, start = Verbosity(), perf_counter()
    closed = _occupied()
    try:
        with notices(chosen):
            code = _answered(given, chosen)
        sys.stdout.flush()
    except OSError as error:
        code = _unwritten(error)
    if closed and not code:
        _say("standard output is closed, and the answer is lost")
        code = NO_OUTPUT
    if chosen.verbose and not chosen.quiet:
        _say(f"exit code {code} after {perf_counter() - start:.2f} s")
    sys.exit(code)


def _occupied() -> bool:
    """Let closed standard streams lead nowhere, so that no other file takes their place.

    Return whether standard output is one of them.
    """
    closed = [name for name in ("stdin", "stdout", "stderr") if getattr(sys, name) is None]
    for name in closed:  # in the order of their numbers: the lowest is taken first
        opened = os.open(os.devnull, os.O_RDWR)
        os.set_inheritable(opened, True)
        mode = {"stdin": "r"}.get(name, "w")
        setattr(sys, name, os.fdopen(opened, mode, encoding="utf-8"))
    return "stdout" in closed


def _answered(given: list[str] | None, chosen: Verbosity) -> int:
    """Run a command and return its exit code, also where it raises."""
    try:
        code = cli.main(given, prog_name="polycorner", standalone_mode=False, obj=chosen)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        code = 0
    except click.ClickException as error:
        _say(error.format_message())
        code = 2
    except click.exceptions.Abort:
        _say("interrupted")
        code = INTERRUPTED
    except SystemExit as stopped:  # by click and rich for a broken pipe
        code = stopped.code if VARIABLE in os.environ else _give_up_output()
    except OSError:
        raise
    except Exception as error:
        code = _unexpected(error, verbose=chosen.verbose)
    return code if isinstance(code, int) else 0


def _unexpected(error: Exception, *, verbose: bool) -> int:
    if verbose:
        traceback.print_exception(error)
    words = " ".join(str(error).split()) or "no message"
    hint = "" if verbose else "; the same command with --verbose shows where"
    _say(f"unexpected {type(error).__name__}: {words}{hint}")
    return UNEXPECTED


def _give_up_output() -> int:
    """Redirect standard output to nowhere, so that Python does not flush it again at exit."""
    with suppress(OSError):  # not a file of the system, as in tests
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return BROKEN_PIPE


def _unwritten(error: OSError) -> int:
    broken = _give_up_output()
    if isinstance(error, BrokenPipeError):
        return broken
    what = "standard output" if error.filename is None else error.filename
    _say(f"{what} cannot be read or written ({error.strerror or error})")
    return NO_OUTPUT if error.filename is None else 2


def _say(words: str) -> None:
    click.echo(f"polycorner: {' '.join(words.split())}", err=True)
