"""The command line, run in this process."""

import json
import sys

import pytest

from polycorner.cli.main import main

ANNOUNCED = "once on this machine: about"  # of what is compiled


def run(capsys, *arguments):
    """Run the command; return its exit code, output and errors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["polycorner", *arguments])
        with pytest.raises(SystemExit) as stopped:
            main()
    captured = capsys.readouterr()
    return stopped.value.code, captured.out, captured.err


def answer(capsys, *arguments):
    """Return what is printed as JSON, and nothing else.

    Where a cache is empty, what is compiled is announced.
    """
    code, out, err = run(capsys, *arguments, "--json")
    assert code == 0
    assert not [line for line in err.splitlines() if ANNOUNCED not in line]
    return json.loads(out)
