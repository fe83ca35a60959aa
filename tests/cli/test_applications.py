"""Commands of applications: found by their entry points, and what is said where one is missing."""

import re
from importlib import metadata
from importlib.metadata import EntryPoint

import commands
import pytest

from polycorner.cli import lazy
from polycorner.cli.atlas import atlas
from polycorner.cli.main import cli

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
