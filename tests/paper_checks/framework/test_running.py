"""Running checks: failures stay isolated, and Ctrl-C keeps finished results."""

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import small_catalogue
from small_catalogue import CLAIMS

from paper_checks.framework.claims import Means, Verdict
from paper_checks.framework.records import counts, markdown, records, to_act_on
from paper_checks.framework.running import Result, Run, run, select
from paper_checks.framework.table import problems, run_text

TESTS = Path(small_catalogue.__file__).parent
QUICK = tuple(claim for claim in CLAIMS if not claim.slow)
INTERRUPTED = """
import small_catalogue
from paper_checks.framework.running import run

def progress(done, total, ids):
    print(done, ids.replace(",", ""), flush=True)

if __name__ == "__main__":
    claims = [c for c in small_catalogue.CLAIMS if c.id in ("A1", "A4", "B1", "S1")]
    found = run(claims, workers=2, progress=progress, catalogue="small_catalogue")
    print("found", *[r.claim.id for r in found.results], "missed", *[c.id for c in found.missed])
"""


@pytest.fixture(scope="module")
def done():
    told = []
    found = run(QUICK, catalogue="small_catalogue", progress=lambda *state: told.append(state))
    return found, told


def test_every_check_is_heard_in_the_order_of_the_claims(done):
    found, told = done
    assert [result.claim.id for result in found.results] == [claim.id for claim in QUICK]
    assert not found.missed
    assert told[0][0] == 0
    assert told[-1] == (len(QUICK), len(QUICK), "")
    shown = {name for *_, names in told for name in names.split(", ") if name}
    assert shown == {claim.id for claim in QUICK}


def test_verdicts_and_errors(done):
    found, _ = done
    verdicts = {result.claim.id: result.verdict for result in found.results}
    assert verdicts == {
        "A1": "holds",
        "A2": "error",
        "A3a": "error",
        "A3b": "corrected",
        "A4": "refuted",
        "A5": "not reproduced",
        "B1": "holds under stated conditions",
        "B2": "error",
    }
    errors = {result.claim.id: result.error for result in found.errors}
    assert errors["A2"] == "ValueError: no such thing"
    assert "ended abruptly" in errors["A3a"]
    assert errors["B2"] == "TypeError: check: expected a Finding; got NoneType"
    assert [line.split(":")[0] for line in problems(found)] == ["A2", "A3a", "B2"]


def test_records_counts_and_what_to_act_on(done):
    found, _ = done
    table = {record["id"]: record for record in records(found)}
    for record in table.values():
        assert list(record)[:6] == ["id", "section", "claim", "means", "verdict", "evidence"]
    assert table["A1"]["numbers"] == {"half": 0.5}
    assert table["A2"]["evidence"] == "ValueError: no such thing"
    expected = [
        "holds",
        "holds under stated conditions",
        "corrected",
        "refuted",
        "not reproduced",
        "error",
    ]
    assert list(counts(found)) == expected
    groups = {
        title: [result.claim.id for result in group] for title, group in to_act_on(found).items()
    }
    assert groups == {
        "To correct": ["A3b", "A4"],
        "Not found in simulations": ["A5"],
        "Conditions to state": ["B1"],
    }


def test_what_simulations_do_not_show_is_apart():
    simulated = replace(CLAIMS[0], means=Means.SIMULATION)
    found = Run((Result(simulated, small_catalogue.found(Verdict.REFUTED)),))
    assert list(to_act_on(found)) == ["Not found in simulations"]


def test_markdown_has_a_row_for_each_claim_under_its_section(done):
    found, _ = done
    rows = [line for line in markdown(found).splitlines() if line.startswith("| A3b")]
    assert rows == ["| A3b | Statement A3b with $x_1 \\ge 0$. | numerical | corrected |"]
    assert "## Section 2: " in markdown(found)
    assert "## Appendix C: " in markdown(found)


def test_terminal(done):
    found, _ = done
    told = run_text(found)
    assert "x_1 ≥ 0" in told
    assert "What an author would act on" in told
    assert told.splitlines()[-1].startswith("8 claims: 1 holds, ")
    assert run_text(found, quiet=True).count("\n") == 0


def stopped_by(number, folder):
    """Run checks in a process; stop it in the last one, and return it with what it then prints.

    Its output ends when the last process has that inherited it.
    """
    script = folder / "interrupted.py"
    script.write_text(INTERRUPTED, encoding="utf-8")
    root = TESTS.parents[1]
    with subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={"PYTHONPATH": f"{root}:{TESTS}", "PATH": ""},
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.split() == ["3", "S1"]:
                process.send_signal(number)
                break
        rest, _ = process.communicate()
    return process, rest


def test_interrupted_processes_end_and_what_was_found_is_kept(tmp_path):
    process, rest = stopped_by(signal.SIGINT, tmp_path)
    assert process.returncode == 0
    assert rest.split() == ["found", "A1", "A4", "B1", "missed", "S1"]


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGKILL,
        *(pytest.param(n, marks=pytest.mark.slow) for n in (signal.SIGTERM, signal.SIGHUP)),
    ],
)
def test_killed_it_leaves_no_process(number, tmp_path):
    """That of the last check would sleep for ten minutes, and the other one wait for ever."""
    process, rest = stopped_by(number, tmp_path)
    assert (process.returncode, rest) == (-number, "")


def ids(claims):
    return [claim.id for claim in claims]


def test_selection():
    chosen, left_out = select(CLAIMS)
    assert (ids(chosen), ids(left_out)) == (ids(QUICK), ["S1"])
    assert ids(select(CLAIMS, slow=True)[0]) == ids(CLAIMS)
    assert ids(select(CLAIMS, ["2"])[0]) == ["A1", "A2", "A3a"]
    assert ids(select(CLAIMS, ["2"], ["A3"])[0]) == ["A3a"]
    assert ids(select(CLAIMS, (), ["S1", "A3"])[0]) == ["A3a", "A3b", "S1"]


@pytest.mark.parametrize(
    ("arguments", "argument"),
    [((["D"],), "section"), (((), ["A9"]), "id"), (((), [""]), "id")],
)
def test_an_unknown_selection_is_named(arguments, argument):
    with pytest.raises(ValueError, match=f"^{argument}: expected "):
        select(CLAIMS, *arguments)


def test_the_verdicts_are_all_there():
    assert {verdict.value for verdict in Verdict} == {
        "holds",
        "holds under stated conditions",
        "corrected",
        "refuted",
        "not reproduced",
        "not testable",
    }
