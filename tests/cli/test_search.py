"""Searches for an atlas: saved, interrupted, resumed, and shown as they go."""

import json
import re
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from atlas_commands import answer, on_terminal, run, started

from polycorner.formulas.cache import cache_folder
from polycorner.models import CriticalSearch

pytestmark = pytest.mark.usefixtures("own_searches")


@pytest.fixture(autouse=True)
def _nothing_kept(own_searches):  # noqa: ARG001 - in whose folder they are
    """Begin without searches that another test left unfinished."""
    for state in cache_folder().glob("atlas-*"):
        state.unlink()


@pytest.mark.parametrize(
    ("arguments", "budget"),
    [
        (("tutorial",), 3),
        (("spheres", "--count", "6"), 2),
        (("dyad", "--plane"), 15),
        (("dyad", "--heading", "20", "--drum", "60", "--length", "20"), 20),
    ],
    ids=str,
)
def test_parts_add_up_to_the_whole(arguments, budget):
    whole = answer(*arguments)
    code, out, err = run(*arguments, "--budget", str(budget), "--json")
    part, edges = json.loads(out), 0
    while part["complete"] != "exhausted":
        edges += budget
        assert (code, part["complete"], len(part["edges"])) == (0, "budget", edges)
        assert re.fullmatch(r"polycorner: unfinished, kept in \S+; --resume continues it\n", err)
        code, out, err = run(*arguments, "--budget", str(budget), "--resume", "--json")
        part = json.loads(out)
    assert edges
    assert part == whole
    code, out, err = run(*arguments, "--budget", "1", "--resume", "--json")
    assert (code, len(json.loads(out)["edges"])) == (0, 1)
    assert err.startswith("polycorner: nothing to resume in ")


def test_a_folder_keeps_its_own_search(tmp_path):
    code, _, err = run("spheres", "--budget", "2", "--out", str(tmp_path))
    assert code == 0
    assert str(tmp_path) in err
    assert json.loads((tmp_path / "atlas.json").read_text())["complete"] == "budget"
    code, _, err = run("spheres", "--resume", "--budget", "1")
    assert (code, "nothing to resume" in err) == (0, True)
    code, _, err = run("spheres", "--resume", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    assert json.loads((tmp_path / "atlas.json").read_text()) == answer("spheres")
    assert {path.name for path in tmp_path.iterdir()} == {"atlas.json", "clusters.png"}


OTHERS = {
    ("spheres", "--count", "5"): ("spheres", "--count", "6"),
    ("dyad", "--plane"): ("dyad", "--plane", "--length", "20"),
    ("tutorial",): ("pinball",),
    ("tutorial", "--seed", "0"): ("tutorial", "--seed", "1"),
}


@pytest.mark.parametrize("folder", [False, True], ids=["cache", "folder"])
@pytest.mark.parametrize("one", OTHERS, ids=" ".join)
def test_only_the_same_search_goes_on(tmp_path, one, folder):
    where = ("--out", str(tmp_path)) if folder else ()
    code, _, err = run(*one, "--budget", "1", *where)
    assert (code, "unfinished" in err) == (0, True)
    code, out, err = run(*OTHERS[one], "--resume", "--budget", "1", *where)
    if folder:
        assert (code, out) == (2, "")
        assert err.startswith("polycorner: --resume: ")
        assert err.count("\n") == 1
    else:  # a cache keeps searches apart
        assert code == 0
        assert err.startswith("polycorner: nothing to resume in ")


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"polycorner atlas": 1}', "\x00\xff"])
def test_a_damaged_search_is_refused(tmp_path, content):
    run("tutorial", "--budget", "1", "--out", str(tmp_path))
    (state,) = tmp_path.glob("*state*")
    state.write_text(content, encoding="latin-1")
    code, out, err = run("tutorial", "--resume", "--out", str(tmp_path))
    assert (code, out) == (2, "")
    assert err.startswith("polycorner: --resume: ")
    assert err.count("\n") == 1


def test_ctrl_c_keeps_what_was_found():
    """Nine spheres take long; the bar tells when there is something to interrupt."""
    search = ("spheres", "--count", "9", "--json")
    code, out, shown = on_terminal(*search, interrupt_at=r"[1-9]\d* of \d+ edges")
    found = json.loads(out)
    assert (code, found["complete"]) == (130, "interrupted")
    assert found["edges"]
    assert "unfinished, kept in" in shown
    process = started(*search, "--resume", "--budget", "3", stderr=subprocess.PIPE)
    out, err = process.communicate()
    later = json.loads(out)
    assert (process.returncode, later["complete"]) == (0, "budget")
    assert len(later["edges"]) == len(found["edges"]) + 3
    assert later["edges"][: len(found["edges"])] == found["edges"]
    known = [corner["point"] for corner in found["corners"]]
    assert [corner["point"] for corner in later["corners"][: len(known)]] == known
    assert err.count("\n") == 1


def test_a_terminal_shows_progress_and_a_pipe_does_not():
    code, out, shown = on_terminal("spheres", "--count", "6", "--json")
    assert code == 0
    assert json.loads(out)["complete"] == "exhausted"
    assert re.search(r"searching spheres .* \d+ of \d+ edges, .*2 corners", shown)
    process = started("spheres", "--count", "6", "--json", stderr=subprocess.PIPE)
    piped, err = process.communicate()
    assert (process.returncode, piped, err) == (0, out, "")


# ------------------------------------------------------------------------------------- disks


@pytest.fixture
def stopped(monkeypatch):
    """Let Ctrl-C come in the second round of a search of disks."""

    @contextmanager
    def at_round(number):
        usual = CriticalSearch.advanced

        def advanced(search):
            if search.rounds == number - 1:
                raise KeyboardInterrupt
            return usual(search)

        with monkeypatch.context() as patch:
            patch.setattr(CriticalSearch, "advanced", advanced)
            yield

    return at_round


def test_disks_that_were_interrupted_are_resumed(stopped, tmp_path):
    disks = ("disks", "--count", "3", "--out", str(tmp_path))
    whole = answer("disks", "--count", "3")
    with stopped(3):
        code, out, err = run(*disks, "--json")
    assert code == 130
    assert json.loads(out)["complete"] == "interrupted"
    assert "--resume continues it" in err
    code, out, err = run(*disks, "--resume", "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == whole
    assert {path.name for path in tmp_path.iterdir()} == {"atlas.json", "critical.png"}


@pytest.mark.parametrize("change", [lambda text: text[:-40], lambda text: text.replace("1", "2")])
def test_a_changed_search_of_disks_is_refused(stopped, tmp_path, change):
    disks = ("disks", "--count", "2", "--out", str(tmp_path))
    with stopped(2):
        run(*disks)
    (state,) = tmp_path.glob("*state*")
    state.write_text(change(state.read_text()))
    code, out, err = run(*disks, "--resume")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("polycorner: --resume: ")


def test_what_a_killed_process_found_is_kept(tmp_path):
    """The search is saved by the clock, long before its first thousand edges."""
    search = ("spheres", "--count", "10", "--out", str(tmp_path), "--json")
    program = (
        "import sys, polycorner.searches as s; s.Clock.every = 0.5\n"
        "from polycorner.cli.main import main; main(sys.argv[1:])"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, "atlas", *search], stdout=subprocess.DEVNULL
    )
    state = tmp_path / "atlas-state.json"
    while process.poll() is None and not state.exists():
        time.sleep(0.05)
    process.kill()
    process.wait()
    assert state.exists()
    code, out, _ = run(*search, "--resume", "--budget", "1")
    assert code == 0
    assert json.loads(out)["complete"] == "budget"


def test_processes_that_walk_find_the_same():
    search = ("spheres", "--count", "5", "--json")
    assert run(*search, "--workers", "1")[:2] == run(*search)[:2]


def test_a_number_of_processes_that_is_none_is_refused():
    code, out, err = run("spheres", "--workers", "0")
    assert (code, out) == (2, "")
    assert "--workers" in err
