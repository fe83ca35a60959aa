"""The command line, run in this process."""

import json
import sys

import pytest

from polycorner.cli.main import main


def run(capsys, *arguments):
    """Run the command; return its exit code, output and errors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["polycorner", *arguments])
        with pytest.raises(SystemExit) as stopped:
            main()
    captured = capsys.readouterr()
    return stopped.value.code, captured.out, captured.err


def answer(capsys, *arguments):
    """Return what is printed as JSON, and nothing else."""
    code, out, err = run(capsys, *arguments, "--json")
    assert (code, err) == (0, "")
    return json.loads(out)
