"""The command ``polycorner paper``: output, files, names of claims and figures."""

import errno
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import commands
import pytest
import small_catalogue

import paper_checks
from paper_checks import command
from paper_checks.figures import FIGURES
from paper_checks.framework import running
from paper_checks.framework.running import Result, Run

ROOT = Path(paper_checks.__file__).parents[1]
A, B, C = small_catalogue.CLAIMS[:3]
GOOD = Result(A, small_catalogue.found())
BROKEN = Result(B, None, "ValueError: no such thing")


def run(capsys, *arguments):
    return commands.run(capsys, "paper", *arguments)


@pytest.fixture
def pretended(monkeypatch):
    """Let a run come to a given end."""

    def come_to(*results, missed=()):
        monkeypatch.setattr(running, "run", lambda *_, **__: Run(results, missed=missed))

    return come_to


def test_claims_by_name_as_json(capsys):
    code, out, err = run(capsys, "G4", "P3a", "--json")
    assert (code, err) == (0, "")
    first, second = json.loads(out)
    assert (first["id"], first["section"], first["means"]) == ("G4", "2", "symbolic")
    assert (second["id"], second["section"], second["verdict"]) == ("P3a", "B", "holds")
    assert first["claim"]
    assert "7 corners" in second["evidence"]


def test_files_and_table(capsys, tmp_path):
    out = tmp_path / "deep" / "out"
    code, told, _ = run(capsys, "P2b", "--out", str(out))
    assert code == 0
    assert "corrected" in told
    assert "What an author would act on" in told
    page = (out / "report.html").read_text(encoding="utf-8")
    assert 'id="P2b"' in page
    (record,) = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert record["verdict"] == "corrected"
    assert "| P2b |" in (out / "report.md").read_text(encoding="utf-8")


def test_names_are_read_from_the_sources():
    """Without importing the checks, and all of them."""
    claims = {claim.id for claim in paper_checks.CLAIMS}
    assert claims <= set(command.claim_ids())
    assert {name.rstrip("abcdefghij") for name in command.claim_ids()} == {
        name.rstrip("abcdefghij") for name in claims
    }
    assert set(command.figure_names()) == set(FIGURES)
    assert command.sections() == sorted({claim.section for claim in paper_checks.CLAIMS})


def test_examples_name_claims_and_figures():
    for line in re.findall(r"polycorner paper (.*)", command.EPILOG):
        words = [word for word in line.partition("--")[0].split() if word != "figures"]
        assert set(words) <= {*command.claim_ids(), *command.figure_names()}


def test_claims_are_listed(capsys):
    code, out, err = run(capsys, "--list", "--section", "B", "--json")
    assert (code, err) == (0, "")
    known = [claim.id for claim in paper_checks.CLAIMS if claim.section == "B"]
    assert [record["id"] for record in json.loads(out)] == known
    assert known[0] in run(capsys, "--list", known[0])[1]


def test_a_wrong_id_is_refused_before_anything_is_imported():
    program = (
        "import sys; from polycorner.cli.main import main\n"
        "try:\n    main(['paper', 'E44'])\nexcept SystemExit as stopped:\n    code = stopped.code\n"
        "print(code, sorted({'numpy', 'sympy', 'paper_checks.catalogue'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout == "2 []\n"
    assert "did you mean E4" in done.stderr


def test_quiet(capsys):
    code, out, err = run(capsys, "P3", "--quiet")
    assert (code, out, err) == (0, "2 claims: 2 holds\n", "")


def test_a_check_that_breaks_is_told_and_counts(capsys, pretended, tmp_path):
    pretended(GOOD, BROKEN)
    code, out, err = run(capsys, "--out", str(tmp_path))
    assert code == 1
    assert "2 claims: 1 holds, 1 error" in out
    assert err == "polycorner: A2: ValueError: no such thing\n"
    assert "ValueError: no such thing" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_interrupted_runs_keep_what_was_found(capsys, pretended, tmp_path):
    pretended(GOOD, missed=(B, C))
    code, out, err = run(capsys, "--out", str(tmp_path), "--json")
    assert code == 130
    assert [record["id"] for record in json.loads(out)] == ["A1"]
    assert err == "polycorner: interrupted; not run: A2, A3a\n"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Interrupted before these were checked: A2, A3a." in page


def test_a_full_disk_costs_neither_the_answer_nor_the_old_report(
    capsys, pretended, monkeypatch, tmp_path
):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    pretended(GOOD)
    _, answer, _ = run(capsys)
    old = tmp_path / "report.html"
    old.write_text("the report of yesterday")
    monkeypatch.setattr("os.fsync", full)
    code, out, err = run(capsys, "--out", str(tmp_path))
    assert (code, out) == (2, answer)
    assert os.strerror(errno.ENOSPC) in err
    assert old.read_text() == "the report of yesterday"
    assert list(tmp_path.iterdir()) == [old]


def test_slow_claims_are_left_out_and_said_to_be(capsys, monkeypatch):
    monkeypatch.setattr(paper_checks, "CLAIMS", (A, small_catalogue.CLAIMS[-1]))
    monkeypatch.setattr(running, "run", lambda claims, **_: Run((GOOD,) if claims == (A,) else ()))
    assert "left out as slow (add --slow): S1" in run(capsys)[1]
    assert "left out" not in run(capsys, "--slow")[1]
    assert "left out" not in run(capsys, "S1")[1]


def test_figures(capsys, tmp_path):
    code, out, _ = run(capsys, "figures", "tutorial", "--out", str(tmp_path))
    assert code == 0
    assert (tmp_path / "tutorial.png").read_bytes().startswith(b"\x89PNG")
    assert out.count("wrote ") == len(list(tmp_path.iterdir())) == 2


def test_mistakes_with_figures(capsys, tmp_path):
    out = ("--out", str(tmp_path))
    code, _, err = run(capsys, "figures", "nosuch", *out)
    assert (code, err) == (
        2,
        f"polycorner: figures: expected {', '.join(sorted(FIGURES))}; got nosuch\n",
    )
    code, _, err = run(capsys, "figures", "--section", "2", *out)
    assert (code, err.count("\n")) == (2, 1)


def test_help(capsys):
    code, out, _ = run(capsys, "--help")
    assert code == 0
    assert "python -m paper_checks" in out


def test_python_dash_m_is_the_same_command():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "paper_checks", "G4", "--quiet"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, done.stderr) == ("1 claims: 1 holds\n", "")
