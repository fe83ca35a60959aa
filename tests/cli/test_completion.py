"""Completion: the scripts are right for their shells, and the command answers what they ask."""

import os
import shutil
import subprocess
import sys

import commands
import pytest

HAS = {shell: shutil.which(shell) for shell in ("bash", "zsh", "fish")}


@pytest.mark.parametrize("shell", HAS)
def test_a_script_is_printed(capsys, shell):
    code, out, err = commands.run(capsys, "completion", shell)
    assert (code, err) == (0, "")
    assert f"_POLYCORNER_COMPLETE={shell}_complete" in out


@pytest.mark.parametrize("shell", [shell for shell, found in HAS.items() if found])
def test_the_shell_reads_the_script(capsys, shell):
    script = commands.run(capsys, "completion", shell)[1]
    done = subprocess.run(
        [HAS[shell], "-n"], input=script, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def completed(*words):
    """Return what bash would be told to offer for the last of the words."""
    line = ["polycorner", *words]
    asked = {
        "_POLYCORNER_COMPLETE": "bash_complete",
        "COMP_WORDS": " ".join(line),
        "COMP_CWORD": str(len(line) - 1),
    }
    done = subprocess.run(
        [sys.executable, "-m", "polycorner"],
        env=os.environ | asked,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    return {entry.partition(",")[2] for entry in done.stdout.split()}


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("d",), {"drum", "dyad"}),
        (("atlas", "p"), {"pinball"}),
        (("prove", "--minimum", "delta"), {"delta_R", "delta_L"}),
        (("atlas", "disks", "--t"), {"--torus"}),
        (("completion", "z"), {"zsh"}),
        (("paper", "P3"), {"P3", "P3a", "P3b"}),
        (("paper", "figures", "flow"), {"flow_lines"}),
    ],
)
def test_what_is_typed_is_completed(words, offered):
    assert completed(*words) == offered


@pytest.mark.skipif(not HAS["bash"], reason="needs bash")
def test_bash_completes_through_the_script(capsys, tmp_path):
    script = commands.run(capsys, "completion", "bash")[1]
    program = tmp_path / "polycorner"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m polycorner "$@"\n')
    program.chmod(0o755)
    asked = (
        "COMP_WORDS=(polycorner minima pin); COMP_CWORD=2; "
        '_polycorner_completion polycorner; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(
        [HAS["bash"], "--norc", "-c", f"{script}\n{asked}"],
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["pinball"]


def test_another_shell_is_refused(capsys):
    code, out, err = commands.run(capsys, "completion", "tcsh")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "bash" in err
