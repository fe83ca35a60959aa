"""``polycorner sweep``: results, files, interruptions, and one line for a mistake."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import commands
import numpy as np
import pytest
import xarray as xr

from polycorner.dumbbells.studies import STUDIES, heading
from polycorner.sweeps import Axis, Grid, StudyFile, open_results, sweep

TESTS = Path(__file__).parents[1]
HEADING = """
study = "heading"
[axes]
length = {start = 8, stop = 16, count = 3}
rod_radius = [0.75, 1.5]
"""
OWN = """
study = "own_functions:slow"
seed = 5
[axes]
a = {start = 0, stop = 19, count = 20}
b = [1, 2, 3, 4, 5]
"""
FUNCTION = """
import time
def slow(a, b, rng):
    open("calls", "a").write("x")
    time.sleep(0.02)
    return {"x": rng.normal()}
"""


@pytest.fixture(autouse=True)
def own_path(monkeypatch, tmp_path):
    """Let each test have a folder of its own, with modules beside its files."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])
    monkeypatch.delitem(sys.modules, "own_functions", raising=False)


def run(capsys, *arguments):
    return commands.run(capsys, "sweep", *map(str, arguments))


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "headings.toml"
    path.write_text(HEADING)
    return path


def test_an_installed_study_is_computed_kept_drawn_and_shown_again(capsys, tmp_path, file):
    out = tmp_path / "out"
    code, printed, err = run(capsys, file, "--out", out, "--workers", 1, "--json")
    assert (code, err) == (0, "")
    answer = json.loads(printed)
    assert [answer[k] for k in ("total", "done", "failed", "pending")] == [6, 5, 1, 0]
    (failure,) = answer["failures"]
    assert failure["point"] == {"length": 8.0, "rod_radius": 0.75}
    assert "got none" in failure["message"]
    assert json.loads((out / "sweep.json").read_text()) == answer
    assert (out / "heading.png").stat().st_size > 10_000
    kept = open_results(out / "sweep.zarr")
    grid = {"length": [8.0, 12.0, 16.0], "rod_radius": [0.75, 1.5]}
    np.testing.assert_array_equal(kept["heading"].values, sweep(heading, grid)["heading"].values)
    (row,) = (row for row in answer["results"] if row["name"] == "heading")
    assert row["greatest"] == np.nanmax(kept["heading"])
    assert row["unit"] == "deg"

    begun = time.time_ns()
    code, printed, err = run(capsys, file, "--out", out)
    assert (code, err) == (0, "")
    assert "5 of 6 points done, 1 failed, 0 pending" in printed
    assert "failed at 1 points, first length = 8.0, rod_radius = 0.75: SolverError" in printed
    assert f"wrote {out / 'heading.png'}" in printed
    chunks = [path for path in (out / "sweep.zarr" / "heading" / "c").rglob("*") if path.is_file()]
    assert chunks
    assert all(path.stat().st_mtime_ns < begun for path in chunks)


def test_quiet_prints_the_answer_alone(capsys, tmp_path, file):
    sweep(
        heading,
        {"length": ([8.0, 12.0, 16.0], "mm"), "rod_radius": ([0.75, 1.5], "mm")},
        store=tmp_path / "out" / "sweep.zarr",
    )
    code, printed, err = run(capsys, file, "--out", tmp_path / "out", "--quiet")
    assert (code, err) == (0, "")
    assert "wrote" not in printed


@pytest.mark.parametrize(
    ("blow", "quiet"), [(signal.SIGINT, ()), (signal.SIGINT, ("--quiet",)), (signal.SIGKILL, ())]
)
def test_interrupted_it_resumes_with_resume_and_only_then(capsys, tmp_path, blow, quiet):
    (tmp_path / "own.toml").write_text(OWN)
    (tmp_path / "own_functions.py").write_text(FUNCTION)
    out = tmp_path / "out"
    command = ("sweep", str(tmp_path / "own.toml"), "--out", str(out), "--workers", "1")
    calls = tmp_path / "calls"
    with subprocess.Popen(
        [sys.executable, "-m", "polycorner", *command, *quiet],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(TESTS.parent)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        while running.poll() is None:
            if calls.exists() and calls.stat().st_size > 40:
                break
            time.sleep(0.02)
        running.send_signal(blow)
        printed, err = running.communicate()
    if blow == signal.SIGINT:
        assert running.returncode == 130
        assert "kept in" in err
        assert "the same command with --resume computes the rest" in err
        assert "pending" in printed
    code, _, err = run(capsys, *command[1:])
    assert code == 2
    assert "unfinished" in err
    assert "--resume" in err
    code, printed, err = run(capsys, *command[1:], "--resume", "--json")
    assert (code, err) == (0, "")
    answer = json.loads(printed)
    assert (answer["done"], answer["pending"], answer["seed"]) == (100, 0, 5)
    children = np.random.SeedSequence(5).spawn(100)
    expected = [np.random.default_rng(child).normal() for child in children]
    with xr.open_zarr(out / "sweep.zarr", chunks=None) as found:
        assert found["x"].values.ravel().tolist() == expected


def test_killed_before_anything_was_saved_it_starts_with_resume(capsys, tmp_path):
    """What a kill leaves is a folder with the beginning of a file, or nothing."""
    (tmp_path / "own.toml").write_text(OWN.replace("count = 20", "count = 1"))
    (tmp_path / "own_functions.py").write_text(FUNCTION)
    store = tmp_path / "out" / "sweep.zarr"
    store.mkdir(parents=True)
    (store / ".zarr-0123abcd.part.json").write_text('{"zarr')
    command = (tmp_path / "own.toml", "--workers", 1, "--out", tmp_path / "out", "--json")
    code, printed, err = run(capsys, *command, "--resume")
    assert (code, err.count("\n")) == (0, 1)
    assert err.startswith(f"polycorner: nothing to resume in {store}")
    assert json.loads(printed)["done"] == 5
    assert run(capsys, *command, "--resume")[::2] == (0, "")


def test_a_seed_overrides_the_files(capsys, tmp_path):
    (tmp_path / "own.toml").write_text(OWN.replace("count = 20", "count = 1").replace("19", "0"))
    (tmp_path / "own_functions.py").write_text(FUNCTION)
    first, again, other = (
        json.loads(run(capsys, tmp_path / "own.toml", "--workers", 1, "--json", *seed)[1])
        for seed in ((), ("--seed", 5), ("--seed", 6))
    )
    assert first == again
    assert first["results"] != other["results"]
    assert (first["store"], other["seed"]) == (None, 6)


MISTAKES = {
    ("--workers", "0"): "--workers: expected",
    ("--workers", "2", "--scheduler", "tcp://127.0.0.1:1"): "--workers: expected no --scheduler",
    ("--seed", "-1"): "--seed: expected",
    ("--seed", "1"): "--seed: expected none, for heading draws no random numbers",
    ("--resume",): "--resume: expected --out",
    ("--sceduler", "x"): "--sceduler",
}


def test_studies_of_the_package_go_by_name_and_help_lists_them(capsys, tmp_path, monkeypatch):
    code, printed, err = run(capsys, "--help")
    assert (code, err) == (0, "")
    for name, study in STUDIES.items():
        assert f"\n    {name} " in printed
        assert study.file.is_file()
    assert str(STUDIES["heading"].file.parent) in printed.replace("\n", "")
    (tmp_path / "heading").mkdir()  # as --out heading leaves it
    grid = Grid({"length": Axis([16.0]), "rod_radius": Axis([1.5])})
    short = StudyFile("heading", heading, grid, {}, None, random=False)
    monkeypatch.setattr("polycorner.sweeps.study_files.read_study", lambda *_: short)
    code, printed, err = run(capsys, "heading", "--workers", 1)
    assert (code, err) == (0, "")
    assert "1 of 1 points done" in printed


def test_examples_in_the_help_are_studies_that_exist(capsys):
    _, printed, _ = run(capsys, "--help")
    named = re.findall(r"polycorner sweep (\w+) ", printed)
    assert set(named) <= set(STUDIES)
    assert named


@pytest.mark.parametrize("study", ["haeding", "none.toml", "no/heading"])
def test_a_study_that_does_not_exist_is_named(capsys, study):
    code, out, err = run(capsys, study)
    assert (code, out) == (2, "")
    assert study in err
    assert err.count("\n") == 1


def test_a_damaged_store_is_refused_and_the_file_is_named(capsys, tmp_path, file):
    out = tmp_path / "out"
    assert run(capsys, file, "--out", out, "--workers", 1)[0] == 0
    for damaged in (out / "sweep.zarr" / "status" / "c" / "0" / "0", out / "sweep.zarr/zarr.json"):
        content = damaged.read_bytes()
        damaged.write_bytes(content[:5] + bytes([content[5] ^ 4]) + content[6:])
        code, printed, err = run(capsys, file, "--out", out)
        assert (code, printed) == (2, "")
        assert str(damaged) in err
        damaged.write_bytes(content)


@pytest.mark.parametrize(("arguments", "words"), MISTAKES.items())
def test_mistakes_get_one_line(capsys, tmp_path, file, arguments, words):
    given = [argument.format(tmp=tmp_path) for argument in arguments]
    code, out, err = run(capsys, file, *given)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_a_misspelt_key_is_named_with_the_right_one(capsys, tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(HEADING.replace("rod_radius", "rod_raduis"))
    code, out, err = run(capsys, file)
    assert (code, out) == (2, "")
    assert "got rod_raduis (did you mean rod_radius?)" in err


def test_a_scheduler_that_does_not_answer_is_named(capsys, file):
    code, out, err = run(capsys, file, "--scheduler", "no-such-protocol://here")
    assert (code, out) == (2, "")
    assert "--scheduler: expected the address of one that answers" in err
    assert err.count("\n") == 1
