"""Files of ``--config``: keys, kinds of values, and options that override them."""

import json

import click
import commands
import pytest
from command_tree import LEAVES, QUICK, one_line, options


def run(capsys, name, *arguments):
    return commands.run(capsys, *name.split(), *arguments)


SETTLED = [name for name in QUICK if "--config" in options(LEAVES[name])]
KINDS = {
    click.types.IntParamType: ("1.5", "a whole number"),
    click.types.FloatParamType: ("'three'", "a number"),
    click.types.BoolParamType: ("1", "true or false"),
    click.Choice: ("3", ""),
}


def settings_of(name):
    """Return the keys a file may hold, and their options."""
    about_the_call = {
        "config",
        "json",
        "out",
        "quiet",
        "verbose",
        "resume",
        "help",
        "movie",
        "list",
    }
    found = {word[2:].replace("-", "_"): p for word, p in options(LEAVES[name]).items()}
    return {key: p for key, p in found.items() if key not in about_the_call}


@pytest.mark.parametrize("name", SETTLED)
def test_a_misspelt_key_is_refused_and_the_right_one_suggested(capsys, tmp_path, name):
    file = tmp_path / "run.toml"
    for key in settings_of(name):
        if len(key) < 4:
            continue
        wrong = key[:-2] + key[-1] + key[-2]
        if wrong in settings_of(name):
            continue
        file.write_text(f"{wrong} = 1\n")
        err = one_line(*run(capsys, name, "--config", str(file)))
        assert err.startswith(f"polycorner: --config: {file}: expected one of ")
        assert err.endswith(f"; got {wrong} (did you mean {key}?)\n")
    file.write_text("zzz = 1\n")
    assert "did you mean" not in one_line(*run(capsys, name, "--config", str(file)))


@pytest.mark.parametrize("name", SETTLED)
def test_a_value_of_another_kind_is_refused_by_its_key(capsys, tmp_path, name):
    file = tmp_path / "run.toml"
    for key, option in settings_of(name).items():
        kind = next((k for k in KINDS if isinstance(option.type, k)), None)
        if kind is None or option.nargs > 1:
            continue
        written, expected = KINDS[kind]
        file.write_text(f"{key} = {written}\n")
        err = one_line(*run(capsys, name, "--config", str(file)))
        assert err.startswith(f"polycorner: --config: {file}: {key}: ")
        assert expected in err


def test_a_file_stands_for_options_and_options_override_it(capsys, tmp_path):
    file = tmp_path / "run.toml"
    file.write_text('count = 2\ntorus = "hexagonal"\nseed = 3\n')
    read = run(capsys, "atlas disks", "--config", str(file), "--json")
    assert read == run(
        capsys, "atlas disks", "--count", "2", "--torus", "hexagonal", "--seed", "3", "--json"
    )
    over = json.loads(
        run(capsys, "atlas disks", "--config", str(file), "--torus", "square", "--json")[1]
    )
    assert over["parameters"] == {"count": 2, "torus": "square"}


def test_a_file_may_hold_flags_lists_and_dashes(capsys, tmp_path):
    file = tmp_path / "run.toml"
    file.write_text('box = ["t=1.49:1.51", "l=16:16.01"]\nrod-weight = 0\ndigits = 5\n')
    found = json.loads(run(capsys, "prove", "--config", str(file), "--json")[1])
    assert found["box"] == {"t": [1.49, 1.51], "l": [16.0, 16.01]}
    file.write_text("plane = true\ndrum = 80\nbudget = 1\n")
    found = json.loads(run(capsys, "atlas dyad", "--config", str(file), "--json", "-q")[1])
    assert found["parameters"]["drum"] == "inf"
    one_line(*run(capsys, "atlas dyad", "--plane", "--drum", "80"))
