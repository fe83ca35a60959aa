"""Output of commands: remarks, warnings and the log, and answers before their files."""

import logging
import math
import os
import subprocess
import sys
import warnings

import click
import pytest

from polycorner.cli import output
from polycorner.cli.output import Verbosity, deliver, json_text, notices


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("quiet", [False, True])
def test_warnings_are_one_line_and_none_with_quiet(capsys, quiet):
    with notices(Verbosity(quiet=quiet)):
        warnings.warn("the folder\n cannot be written", RuntimeWarning, stacklevel=1)
    err = capsys.readouterr().err
    assert err == ("" if quiet else "polycorner: warning: the folder cannot be written\n")


@pytest.mark.parametrize(
    ("chosen", "terminal", "told"),
    [
        (Verbosity(), False, []),
        (Verbosity(), True, ["compiling"]),
        (Verbosity(quiet=True), True, []),
        (Verbosity(verbose=True), False, ["kernel", "compiling"]),
    ],
)
def test_the_log_is_shown_on_terminals_and_its_details_with_verbose(
    capsys, monkeypatch, chosen, terminal, told
):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    log = logging.getLogger("polycorner.compilation")
    with notices(chosen):
        log.debug("kernel")
        log.info("compiling")
    log.info("afterwards")
    assert capsys.readouterr().err.splitlines() == [f"polycorner: {words}" for words in told]


def test_numbers_that_json_lacks_are_null():
    answer = {"a": [math.inf, 1.0, (math.nan,)], "b": {"c": -math.inf}}
    assert (
        json_text(answer).split() == json_text({"a": [None, 1.0, [None]], "b": {"c": None}}).split()
    )


def test_an_answer_is_printed_before_its_files_are_written(capsys, tmp_path):
    def write(_):
        assert capsys.readouterr().out == "the answer\n"
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        deliver({}, lambda: "the answer", write, as_json=False, out=tmp_path)


def test_files_are_written_where_the_answer_cannot_be_printed(monkeypatch, tmp_path):
    def closed(*_, **__):
        raise BrokenPipeError

    monkeypatch.setattr(click, "echo", closed)
    written = []
    with pytest.raises(BrokenPipeError):
        deliver({}, lambda: "x", lambda f: written.append(f) or [], as_json=False, out=tmp_path)
    assert written == [tmp_path]


def test_a_bar_shows_what_is_done_and_how_long_it_takes(capsys, monkeypatch):
    monkeypatch.setattr(output, "shows_progress", lambda: True)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("FORCE_COLOR", "1")
    with output.working("walking", "edges") as progress:
        progress(3, 12, "2 corners")
    shown = capsys.readouterr().err
    assert "walking" in shown
    assert "3 of 12 edges" in shown
    assert "s left" in shown
    assert "2 corners" in shown


OTHER_VERSIONS = """
from polycorner.formulas.shipped import Shipped
Shipped.text = ""
"""
COMMAND = """
import sys
from polycorner.cli.main import main
sys.exit(main(["minima", "pinball", "--starts", "1"]))
"""
PYTHON = """
from polycorner import Manifold, Polyhedron, minimise
M = Manifold.euclidean("x")
minimise(Polyhedron(M, {"wall": M.symbols[0]}), M.symbols[0], [1.0])
"""


@pytest.mark.parametrize("program", [COMMAND, PYTHON])
def test_compiling_is_announced_when_something_is_compiled(program, tmp_path):
    """Once, where the package's intermediate code does not fit; the next process finds the code."""
    command = [sys.executable, "-c", OTHER_VERSIONS + program]
    for announced in (True, False):
        done = subprocess.run(
            command,
            env=os.environ | {"POLYCORNER_CACHE_DIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        lines = [line for line in done.stderr.splitlines() if "compiling the search" in line]
        assert len(lines) == announced
