"""Properties of every subcommand: help, examples, tables, JSON, quiet and verbose, exit codes."""

import errno
import json
import os
import re
import shlex
import subprocess
import sys
from importlib import metadata
from importlib.metadata import EntryPoint
from pathlib import Path

import click
import commands
import pytest
from command_tree import EVERY, LEAVES, QUICK, one_line, options

from polycorner.cli import lazy
from polycorner.cli import main as entry
from polycorner.cli.atlas import atlas
from polycorner.cli.main import EXIT_CODES, cli
from polycorner.formulas.cache import cache_folder

ROOT = Path(entry.__file__).parents[2]
# Tested in files of their own.
ELSEWHERE = {"branches", "completion", "landscape", "sweep", "verify", "view"}
NO_SEED = {"cache", "dyad", "prove", "paper"}  # nothing random in them


every_leaf = pytest.mark.parametrize("name", LEAVES)
every_answer = pytest.mark.parametrize("name", QUICK)


pytestmark = pytest.mark.usefixtures("own_searches")


def run(capsys, name, *arguments):
    return commands.run(capsys, *name.split(), *arguments)


def test_every_subcommand_is_looked_at():
    told = set(QUICK) | {name for name in LEAVES if name.split()[0] in ELSEWHERE}
    assert told == set(LEAVES)


# ------------------------------------------------------------------------------- tables


@pytest.mark.parametrize("name", sorted(set(QUICK) - {"drum"}))  # which tells its speed
def test_no_table_cuts_a_word_in_a_narrow_terminal(capsys, monkeypatch, name):
    words = {}
    for columns in (1000, 80, 60):
        monkeypatch.setenv("COLUMNS", str(columns))
        code, out, _ = run(capsys, name, *QUICK[name])
        assert code == 0
        words[columns] = set(out.split())
        wide = [line for line in out.splitlines() if len(line) > columns]
        assert all(max(map(len, line.split())) > columns / 2 for line in wide)
    assert words[80] == words[60] == words[1000]


# -------------------------------------------------------------------------------- help


@pytest.mark.parametrize("names", EVERY, ids=" ".join)
def test_help_has_examples_and_they_are_right(capsys, monkeypatch, names):
    code, out, err = commands.run(capsys, *names, "--help")
    assert (code, err) == (0, "")
    assert "Examples:" in out
    lines = re.findall(r"polycorner ([^|>)\n]+)", out.partition("Examples:")[2])
    calls = [line.split() for line in lines if line.split()[0] in cli.commands]
    assert calls
    monkeypatch.chdir(ROOT)
    for words in calls:
        command, below = cli, list(words)
        while isinstance(command, click.Group):
            command = command.commands[below.pop(0)]
        try:
            command.make_context("polycorner", below).close()
        except click.exceptions.Exit:
            assert "--help" in words


EXECUTED = (
    "atlas dyad --plane",
    "atlas spheres --count 6",
    "atlas tutorial --out out",
    "atlas disks --count 2",
    "cache",
    "dyad",
    "dyad --drum inf --json",
    "minima pinball --starts 200 --seed 1",
    "paper --list",
    "prove",
)


@pytest.mark.parametrize("line", EXECUTED)
def test_quick_examples_run(capsys, monkeypatch, tmp_path, line):
    monkeypatch.chdir(tmp_path)
    helps = [commands.run(capsys, *names, "--help")[1] for names in EVERY]
    assert any(re.search(rf"^ *polycorner {re.escape(line)}$", text, re.M) for text in helps)
    code, out, err = commands.run(capsys, *line.split())
    assert (code, err) == (0, "")
    assert out


@every_leaf
def test_options_stand_in_groups_with_their_defaults(capsys, name):
    text = commands.run(capsys, *name.split(), "--help")[1]
    assert "General options:" in text
    for option in options(LEAVES[name]).values():
        if not option.is_flag and isinstance(option.default, int | float | str | tuple):
            assert "[default: " in text


@every_leaf
def test_every_command_has_the_common_options(name):
    present = options(LEAVES[name])
    assert {"--quiet", "--verbose"} <= set(present)
    if name in QUICK:
        assert "--json" in present
        assert ({"--out", "--config"} <= set(present)) == (name != "cache")
        assert ("--seed" in present) == (name not in NO_SEED)


@every_leaf
def test_every_option_is_described(name):
    assert all(p.help for p in options(LEAVES[name]).values())


# ----------------------------------------------------------------------------- answers


@every_answer
def test_answers_are_json_and_quiet_says_nothing_else(capsys, name):
    code, out, err = run(capsys, name, *QUICK[name], "--json", "--quiet")
    assert (code, err) == (0, "")
    assert json.loads(out)


@every_answer
def test_verbose_tells_versions_times_and_the_exit_code(capsys, name):
    code, out, err = run(capsys, name, *QUICK[name], "--json", "--verbose")
    assert code == 0
    assert json.loads(out)
    lines = err.splitlines()
    assert all(line.startswith("polycorner: ") for line in lines)
    assert "Python 3" in lines[0]
    assert re.search(r": \d+\.\d\d s$", "\n".join(lines[1:-1]), re.MULTILINE)
    assert re.fullmatch(r"polycorner: exit code 0 after \d+\.\d\d s", lines[-1])


@pytest.mark.parametrize("name", ["atlas tutorial", "minima pinball", "prove"])
def test_files_are_named_unless_quiet(capsys, tmp_path, name):
    chosen = (*QUICK[name], "--out", str(tmp_path))
    code, out, err = run(capsys, name, *chosen)
    assert (code, err) == (0, "")
    assert f"wrote {tmp_path}" in out
    code, less, err = run(capsys, name, *chosen, "--quiet")
    assert (code, err) == (0, "")
    assert "wrote" not in less
    code, out, err = run(capsys, name, *chosen, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out)


def test_quiet_and_verbose_are_understood_before_the_subcommand(capsys):
    assert run(capsys, "--verbose", "completion", "fish")[2].count("\n") == 2
    assert run(capsys, "--quiet", "atlas", "--quiet", "pinball", "--budget", "1")[2] == ""


def test_unfinished_work_is_told_of_unless_quiet(capsys):
    assert "--resume continues it" in run(capsys, "atlas pinball", "--budget", "1")[2]
    assert run(capsys, "atlas pinball", "--budget", "1", "--quiet")[2] == ""


# ---------------------------------------------------------------------------- mistakes


@every_leaf
def test_a_misspelt_option_is_refused_and_the_right_one_suggested(capsys, name):
    first = ("bash",) if name == "completion" else ()
    assert "'--verbose'" in one_line(*run(capsys, name, *first, "--verbos"))
    one_line(*run(capsys, name, *first, "--no-such-option"))
    one_line(*run(capsys, name, *first, "--quiet", "--verbose"))


@pytest.mark.parametrize(
    ("words", "meant"),
    [("dyda", "dyad"), ("dyadd", "dyad"), ("Minima", "minima"), ("atlas sphere", "spheres")],
)
def test_a_misspelt_subcommand_is_refused_and_the_right_one_suggested(capsys, words, meant):
    assert f"'{meant}'" in one_line(*run(capsys, words))


# -------------------------------------------------------------------------- exit codes


def test_exit_codes_are_documented_in_one_way(capsys):
    _, shown, _ = commands.run(capsys, "--help")
    page = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    for code, words in EXIT_CODES.items():
        for text, sign in ((shown, ""), (page.replace("`", ""), r"\|")):
            assert re.search(rf"{code} +{sign} *{re.escape(words)}", text), (code, words)


def broken(*_):
    message = "a wheel\n  came off"
    raise RuntimeError(message)


def test_an_unexpected_error_is_one_sentence_and_verbose_shows_where(capsys, monkeypatch):
    monkeypatch.setattr("polycorner.dumbbells.cli.dyad.chosen_pair", broken)
    code, out, err = run(capsys, "dyad")
    assert (code, out, err.count("\n")) == (70, "", 1)
    assert "unexpected RuntimeError: a wheel came off" in err
    assert "--verbose" in err
    code, out, err = run(capsys, "dyad", "--verbose")
    assert (code, out) == (70, "")
    assert "Traceback" in err
    assert "in broken" in err


@pytest.mark.parametrize(
    "name", ["atlas tutorial", "atlas pinball", "atlas disks", "minima pinball", "dyad"]
)
def test_a_full_disk_costs_neither_the_answer_nor_the_old_file(capsys, monkeypatch, tmp_path, name):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    words = (name, *QUICK[name], "--json")
    _, answer, _ = run(capsys, *words)
    old = tmp_path / f"{name.split()[0]}.json"
    old.write_text("what was computed before")
    monkeypatch.setattr("os.fsync", full)
    code, out, err = run(capsys, *words, "--out", str(tmp_path))
    assert (code, out, err.count("\n")) == (2, answer, 1)
    assert err.startswith("polycorner: --out: ")
    assert os.strerror(errno.ENOSPC) in err
    assert old.read_text() == "what was computed before"
    assert list(tmp_path.iterdir()) == [old]


def process(*words, **streams):
    command = [sys.executable, "-W", "error", "-m", "polycorner", *words]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT, **streams)


@pytest.mark.skipif(os.name != "posix", reason="the shell of other systems closes no streams")
@pytest.mark.parametrize(
    ("closed", "code", "said"),
    [
        (">&-", 74, "polycorner: standard output is closed, and the answer is lost\n"),
        (">&- 2>&-", 74, ""),
        ("<&-", 0, ""),
        ("2>&-", 0, ""),
    ],
)
@pytest.mark.parametrize("words", ["--version", "dyad --json", "--help"])
def test_closed_streams_are_no_defect(words, closed, code, said):
    line = f"exec {shlex.quote(sys.executable)} -m polycorner {words} {closed}"
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False, cwd=ROOT)
    assert (done.returncode, done.stderr) == (code, said)
    assert bool(done.stdout) is (code == 0)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full here")
@pytest.mark.parametrize("words", [("--help",), ("atlas", "disks", "--count", "2")])
def test_standard_output_that_is_full_is_one_sentence(words):
    with Path("/dev/full").open("w") as full:
        started = process(*words, stdout=full)
        _, err = started.communicate()
    assert started.returncode == 74
    assert err == (
        "polycorner: standard output cannot be read or written (No space left on device)\n"
    )


@pytest.mark.parametrize("words", [("--help",), ("atlas", "disks", "--count", "2")])
@pytest.mark.parametrize("form", ["--json", "--quiet"])
def test_a_reader_that_goes_away_ends_it_silently(words, form):
    arguments = words if words == ("--help",) else (*words, form)
    started = process(*arguments, stdout=subprocess.PIPE)
    started.stdout.close()
    assert started.stderr.read() == ""
    assert started.wait() == 141
    started.stderr.close()


# -------------------------------------------------------------------------------------------- cache


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """A cache of its own with two files in it."""
    chosen = tmp_path / "cache"
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(chosen))
    (cache_folder() / "kernels").mkdir()
    (chosen / "kernels" / "a.o").write_bytes(b"12345")
    (chosen / "atlas-0.json").write_text("{}")
    return chosen


def test_folder_and_size_are_shown(capsys, folder):
    code, out, err = commands.run(capsys, "cache")
    assert (code, err) == (0, "")
    assert str(folder) in out
    assert "2 files" in out
    found = commands.answer(capsys, "cache")
    assert found == {"folder": str(folder), "files": 2, "bytes": 7, "cleared": False}


def test_clearing_empties_the_folder(capsys, folder):
    code, out, _ = commands.run(capsys, "cache", "--clear", "--json")
    assert (code, json.loads(out)["files"], json.loads(out)["cleared"]) == (0, 2, True)
    assert list(folder.iterdir()) == []
    assert commands.answer(capsys, "cache")["files"] == 0


# ------------------------------------------------------------------------------------- applications

COMMANDS = "polycorner.commands"


@pytest.fixture
def registering(monkeypatch):
    """Let applications register given commands, as names and values of entry points."""
    own = {"completion": cli.commands["completion"]}
    monkeypatch.setattr(cli, "commands", own)  # without those that were loaded before
    monkeypatch.delitem(atlas.commands, "dyad", raising=False)

    lazy.registered.cache_clear()

    def register(**values):
        points = [EntryPoint(name, value, COMMANDS) for name, value in values.items()]
        found = {COMMANDS: points}
        monkeypatch.setattr(metadata, "entry_points", lambda group: found.get(group, []))

    yield register
    lazy.registered.cache_clear()


def test_commands_are_registered(capsys, registering):
    registering(tidy="polycorner.cli.cache:cache")
    assert "\n  tidy " in commands.run(capsys, "--help")[1]
    assert commands.run(capsys, "tidy", "--help")[0] == 0


@pytest.mark.parametrize(
    ("value", "why"),
    [
        ("nosuch.package:drum", "cannot be loaded (ModuleNotFoundError"),
        ("polycorner.cli.cache:nosuch", "cannot be loaded (AttributeError"),
        ("polycorner.cli.cache:__name__", "expected a command of click"),
    ],
)
def test_an_application_that_cannot_be_loaded_is_one_sentence(capsys, registering, value, why):
    registering(broken=value)
    code, out, err = commands.run(capsys, "broken", "this", "--count", "3")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("polycorner: broken: ")
    assert why in err
    code, out, _ = commands.run(capsys, "--help")
    assert code == 0
    assert re.search(r"broken +\(cannot be loaded\)", out)


@pytest.mark.parametrize("words", [("drum",), ("atlas", "dyad")])
def test_an_environment_older_than_the_applications_is_said_to_be(capsys, registering, words):
    registering()
    code, out, err = commands.run(capsys, *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"polycorner: No such command '{words[-1]}'; no application")
    assert "make env" in err
