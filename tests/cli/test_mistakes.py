"""Mistakes in arguments: one sentence that names the argument, exit code 2, before any work."""

import click
import commands
import pytest
from click.types import FloatParamType, IntParamType

from polycorner.cli.main import cli

NEEDED = {
    "branches dyad": ("--vary", "rod=2:2.01"),
    "completion": ("bash",),
    "sweep": ("heading",),
    "verify": ("no.zip",),
    "view trajectory": ("nowhere.nc",),
}
# Nothing that is no number is a number; the paper's models have no use for infinities.
WRONG = {
    FloatParamType: ("x", "", "nan", "-inf"),
    IntParamType: ("x", "", "1.5", "-7", "99999999999999999999"),
    click.Choice: ("?", ""),
}
UNBOUNDED = {
    "--seed",
    "--budget",
    "--max-arcs",
    "--max-boxes",
    "--starts",
    "--workers",
    "--count",
    "--sample",
    "--jobs",
}  # above


def leaves(command, *names):
    """Yield every command that is no group, with its names."""
    if not isinstance(command, click.Group):
        yield " ".join(names), command
        return
    context = click.Context(command)
    for name in command.list_commands(context):
        yield from leaves(command.get_command(context, name), *names, name)


def mistakes():
    """Yield command lines with one wrong value each, and the option that has it."""
    for name, command in leaves(cli):
        for option in command.params:
            if not isinstance(option, click.Option) or option.is_flag:
                continue
            flag = max(option.opts, key=len)
            kind = next((kind for kind in WRONG if isinstance(option.type, kind)), None)
            for value in WRONG.get(kind, ()):
                if value.startswith("999") and flag in UNBOUNDED:
                    continue
                yield name, flag, (value,) * option.nargs


@pytest.mark.parametrize("command", sorted({name for name, _, _ in mistakes()}))
def test_a_wrong_value_is_one_sentence(capsys, monkeypatch, tmp_path, subtests, command):
    monkeypatch.chdir(tmp_path)
    for name, flag, values in mistakes():
        if name != command:
            continue
        with subtests.test(flag=flag, values=values):
            line = (*name.split(), *NEEDED.get(name, ()), flag, *values)
            code, out, err = commands.run(capsys, *line)
            assert (code, out, err.count("\n")) == (2, "", 1)
            assert err.startswith("polycorner: ")
            assert flag in err
            assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "command"),
    list(leaves(cli)),
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_wrong_path_is_one_sentence(capsys, monkeypatch, tmp_path, name, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("")
    flags = {flag for option in command.params for flag in option.opts}
    for flag, path in (("--config", "nowhere.toml"), ("--config", "."), ("--out", "taken/below")):
        if flag not in flags or name.startswith("view"):
            continue
        code, out, err = commands.run(capsys, *name.split(), *NEEDED.get(name, ()), flag, path)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert err.startswith(f"polycorner: {flag}: ")


@pytest.mark.parametrize("name", [name for name, _ in leaves(cli)])
def test_an_argument_too_many_is_one_sentence(capsys, name):
    if name in ("paper", "verify"):  # which take any number
        return
    code, out, err = commands.run(capsys, *name.split(), *NEEDED.get(name, ()), "superfluous")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "superfluous" in err


OTHERS = {
    "cubes": "cubes",
    "atlas cubes": "cubes",
    "minima marble": "marble",
    "atlas spheres --count 1": "--count",
    "atlas disks --count 0": "--count",
    "atlas disks --torus round": "--torus",
    "atlas tutorial --budget 0": "--budget",
    "minima pinball --starts 0": "--starts",
    "atlas tutorial --quiet --verbose": "--quiet: expected no --verbose beside it",
}


@pytest.mark.parametrize("line", OTHERS)
def test_a_mistake_is_one_sentence(capsys, line):
    code, out, err = commands.run(capsys, *line.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("polycorner: ")
    assert OTHERS[line] in err
